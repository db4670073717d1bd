"""The page of frequency responses shows what there is, and what it shows runs."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear import METHODS, frf

PAGE = Path(__file__).resolve().parents[2] / "docs" / "frequency-response.md"
TEXT = PAGE.read_text("utf-8")
ROWS = "".join(line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| `"))


@pytest.fixture(scope="module")
def names():
    found: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```$", TEXT, re.M | re.S):
        exec(compile(block, PAGE.name, "exec"), found)
    return found


@pytest.mark.matrix
def test_the_examples_run(names):
    weak, full = names["first"]
    assert 0.3 < weak < full < 1.5
    assert 0.1 < float(names["full"].swing.max()) < 30
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


def test_the_warning_that_the_page_speaks_of(names):
    with pytest.warns(FoldynWarning, match="secant"):
        frf(names["soft"], names["drive"], [1.0])
    assert fd.case_of(names["response"]).damping == names["case"].damping
