"""The pages of modes and of frequency responses: what they show runs, and is computed."""

from __future__ import annotations

import re
import warnings
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from bodies import paper_specimen

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear import METHODS, character, equivalent_slope, frf, modes
from foldyn.results.quantities import MODES

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "modes.md").read_text("utf-8")


def ran(text: str) -> dict:
    """What the code of a page makes."""
    names: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S):
        exec(compile(block, "page.md", "exec"), names)
    return names


def test_the_examples_of_modes_run():
    names = ran(PAGE)
    omega = 2 * np.pi * names["found"].frequency.values
    np.testing.assert_allclose(names["found"].damping_ratio, 0.03 / omega, rtol=1e-9)
    assert float(names["full"].displacement[40, 0]) > float(names["half"].displacement[40, 0]) > 0
    assert names["values"].shape == (4, 4)
    assert names["pairs"].mac[0] > 0.9
    assert float(names["what"].share.max("kind")[0]) > 0.85


def test_every_variable_has_a_row():
    rows = "".join(line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| `"))
    assert [name for name in MODES if f"`{name}`" not in rows] == []


def test_the_slope_at_rest():
    assert f"= {float(equivalent_slope(0.0, 1.0)):.3f}," in PAGE


def test_what_the_page_says_of_the_amplitude():
    shown = re.search(
        r"From `secant=([\d.]+)` to ([\d.]+) the \[specimen\]\(specimen.md\)'s first bending "
        r"along y rises from ([\d.]+) to ([\d.]+) Hz, its first torsion from ([\d.]+) to "
        r"([\d.]+) Hz",
        PAGE,
    ).groups()
    small, large, *hertz = map(float, shown)
    for amplitude, bending, torsion in zip((small, large), hertz[:2], hertz[2:], strict=True):
        found = modes(paper_specimen(), 8, secant=amplitude)
        named = dict(zip(character(found).name.values, found.frequency.values, strict=True))
        assert named["first bending along y"] == pytest.approx(bending, abs=0.006)
        assert named["first torsion"] == pytest.approx(torsion, abs=0.006)


def test_what_the_page_says_of_the_turns_of_bends():
    found = modes(paper_specimen(), 6, secant=0.03)
    s, medians = found.attrs, []
    structure = paper_specimen().structure
    rest = structure.dihedrals(np.zeros_like(structure.nodes))[1]
    assert s["secant"] == 0.03
    for name in ("first bending along y", "first axial", "second bending along y"):
        shape = found["shape"].values[character(found).name.values.tolist().index(name)]
        small = 1e-7 * shape / np.abs(shape[[0, 6], 0]).max()
        turns = np.degrees(np.abs(structure.dihedrals(small)[1] - rest)) * 1e4
        medians.append(float(np.median(turns)))
    low, high = re.search(
        r"more than ([\d.]+) to ([\d.]+) degrees", PAGE.replace("\n", " ")
    ).groups()
    assert (min(medians), max(medians)) == pytest.approx((float(low), float(high)), rel=0.15)


def test_modes_without_a_secant_warn_on_this_page():
    assert "warns with the number of hinges" in PAGE
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        modes(paper_specimen(), 2)
    assert "192 hinges" in str(caught[0].message)


TEXT = (DOCS / "frequency-response.md").read_text("utf-8")
ROWS = "".join(line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| `"))


@pytest.fixture(scope="module")
def names():
    return ran(TEXT)


@pytest.mark.matrix
def test_the_examples_run(names):
    weak, full = names["first"]
    assert 0.3 < weak < full < 1.5
    assert 0.002 < float(names["full"].swing.max()) < 0.5
    coherence = names["bursts"].coherence.sel(node=7, axis="x")
    assert 0.3 < float(coherence.min()) < 0.9999
    still = complex(names["base"].transmissibility.sel(node=4, axis="z")[0])
    assert still == pytest.approx(1.0, abs=0.05)
    size = np.abs(names["response"].receptance.sel(node=7, axis="x"))
    ratio = np.abs(names["mobility"].mobility.sel(node=7, axis="x")) / size
    np.testing.assert_allclose(ratio, 2 * np.pi * names["frequencies"])


def test_every_method_and_option_has_a_row():
    assert [name for name in METHODS if f"`{name}`" not in ROWS] == []
    timed = ("impulse", "stepped_sine", "burst_random")
    options = {field.name for name in timed for field in fields(METHODS[name].options)}
    shared = {"integrator", "dt", "tolerance"}
    assert [name for name in options - shared if f"`{name}`" not in ROWS] == []
    assert all(f"`{name}`" in TEXT for name in shared)


@pytest.mark.matrix
def test_the_warning_that_the_page_speaks_of(names):
    with pytest.warns(FoldynWarning, match="secant"):
        frf(names["soft"], names["drive"], frequencies=[1.0])
    assert fd.case_of(names["response"]).damping == names["case"].damping
