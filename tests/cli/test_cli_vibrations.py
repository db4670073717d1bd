"""`foldyn run` on case files of modes and frequency responses: results, figures, refusals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT, changed, rows
from foldyn.errors import MotionInterrupted
from foldyn.linear import frf, modes, peaks_of

MODES = f"""title = "modes of a Miura unit cell"
{FOLD_TEXT.replace("simple_fold", "miura")}[model]
mass = "circumcenter"
bend_law = "linear"
[damping]
alpha = 0.3
[[supports]]
nodes = [0, 1, 2]
[analysis]
kind = "modes"
count = 4
"""
RESPONSE = (
    MODES.replace('"modes"\ncount = 4', '"frf"')
    + """frequencies = { first = 0, last = 3, count = 61 }
[[drive]]
nodes = [7]
force = [0.01, 0, 0]
[output]
nodes = [7, 8]
"""
)
LOADED = "loads = [{ nodes = [7], force = [0.01, 0, 0] }]"
TWO_RULES = 'model.mass = ["circumcenter", "panel"]'
RESULTS = ("result-circumcenter.nc", "result-panel.nc")
FIGURES = ("--out", "r", "--figures", "png")


@pytest.fixture(autouse=True)
def short_films(monkeypatch):
    """Films of two pictures: what they show is tested with the figures."""
    monkeypatch.setattr("foldyn.analyses.modes.FRAMES", 2)


def cells_of(page: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


@pytest.mark.matrix
def test_modes_become_a_result_that_is_that_of_python(workplace) -> None:
    workplace.write(MODES)
    done = workplace.good("run", "case.toml", "--no-figures")
    assert done.new == ["case-results", "case-results/result.nc"]
    stored = fd.load("case-results/result.nc")
    f = stored["frequency"].values
    assert "modes of a Miura unit cell: 13 nodes" in done.out
    assert f"circumcenter: 4 modes, {f[0]:.4g} to {f[-1]:.4g} Hz, " in done.out
    again = modes(fd.case_of(stored), count=4)
    np.testing.assert_allclose(again["frequency"], f, rtol=1e-12)
    np.testing.assert_allclose(again["shape"], stored["shape"], atol=1e-9)


@pytest.mark.matrix
def test_a_response_becomes_a_result_that_is_that_of_python(workplace) -> None:
    workplace.write(RESPONSE)
    done = workplace.good("run", "case.toml", "--no-figures")
    assert done.new == ["case-results", "case-results/result.nc"]
    assert "circumcenter: direct, 61 frequencies from 0 to 3 Hz, " in done.out
    stored = fd.load("case-results/result.nc")
    drive = [fd.Force([7], (0.01, 0, 0))]
    again = frf(fd.case_of(stored), drive, frequencies=np.linspace(0.0, 3.0, 61))
    np.testing.assert_allclose(again["receptance"], stored["receptance"], rtol=1e-12)
    assert stored.attrs["drive_force"] == pytest.approx(0.01)


@pytest.mark.matrix
def test_a_case_file_about_a_stored_equilibrium(workplace) -> None:
    """The state of a path that loads end, and the equilibrium found anew, have the same modes."""
    for name, edits in {
        "slow": f'{LOADED}; analysis = {{ kind = "statics", load_factors = [0, 1] }}',
        "stored": f'{LOADED}; initial.file = "slow-results/result.nc"',
        "found": f'{LOADED}; analysis.state = "equilibrium"',
        "rest": "",
    }.items():
        workplace.write(changed(MODES, edits), f"{name}.toml")
        assert workplace.call("run", f"{name}.toml", "--no-figures").status == 0
    stored, found, rest = (
        fd.load(f"{name}-results/result.nc")["frequency"] for name in ("stored", "found", "rest")
    )
    np.testing.assert_allclose(stored, found, rtol=1e-6)
    assert np.abs(found / rest - 1.0).max() > 1e-3  # the load matters


@pytest.mark.matrix
def test_figures_of_modes(workplace) -> None:
    workplace.write(changed(MODES, f'{TWO_RULES}; output = {{ shapes = [1, 3], axis = "y" }}'))
    pictures = ("structure.png", "laws.png", "modes.png", "mac.png")
    page = workplace.page(*pictures, results=RESULTS)
    one, two = (fd.load(f"r/{name}") for name in RESULTS)
    header, *rows = cells_of(page)
    assert header[:5] == ["mode", "frequency (Hz)", "damping (%)", "what it does", "share (%)"]
    told = fd.linear.character(one, "y")
    for k, row in enumerate(rows[:4]):
        f = float(one["frequency"][k])
        assert float(row[1]) == pytest.approx(f, rel=1e-3)
        assert float(row[2]) == pytest.approx(100 * 0.3 / (4 * np.pi * f), rel=1e-2)
        assert row[3] == str(told["name"].values[k])
    comparison = rows[4:9]
    assert comparison[0] == ["mode", "circumcenter (Hz)", "panel (Hz)", "MAC"]
    mac = fd.linear.mac(one, two, mass=fd.case_of(one).structure.mass)
    pairs = fd.linear.pair_modes(mac)
    for k, row in enumerate(comparison[1:]):
        assert float(row[2]) == pytest.approx(float(two["frequency"][pairs.second[k]]), rel=1e-3)
        assert float(row[3]) == pytest.approx(pairs.mac[k], rel=1e-3)
    assert "seen along y" in page


@pytest.mark.matrix
def test_figures_of_a_response(workplace) -> None:
    finer = 'analysis.frequencies.count = 601; output.quantity = "mobility"'
    workplace.write(changed(RESPONSE, f"{TWO_RULES}; {finer}"))
    pictures = ("structure.png", "laws.png", "response.png", "nyquist.png")
    page = workplace.page(*pictures, results=RESULTS)
    header, *rows = cells_of(page)
    assert header[:4] == ["mass rule", "node", "peak (Hz)", "height (m/(N s))"]
    expected = [
        (rule, str(node), peak)
        for rule in ("circumcenter", "panel")
        for node in (7, 8)
        for peak in peaks_of(fd.load(f"r/result-{rule}.nc"), node, axis="x", quantity="mobility")
    ]
    for row, (rule, node, peak) in zip(rows, expected, strict=False):
        assert row[:2] == [rule, node]
        assert float(row[2]) == pytest.approx(peak.frequency, rel=1e-3)
        assert float(row[3]) == pytest.approx(peak.height, rel=1e-3)
        for cell, ratio in ((row[4], peak.half_power), (row[7], peak.damping_ratio)):
            told = float(cell or "nan")
            assert told == pytest.approx(100 * ratio, rel=1e-2, nan_ok=True)
    assert rows[len(expected)][:2] == ["mass rule", "method"]


@pytest.mark.matrix
def test_a_response_to_a_moving_base(workplace) -> None:
    workplace.write(changed(RESPONSE, 'drive[0] = { base = "x" }'))
    page = workplace.page("structure.png", "laws.png", "response.png")  # circles are of forces
    assert "displacement along x per displacement of the base along x" in page
    assert "transmissibility" in fd.load("r/result.nc")


@pytest.mark.matrix
def test_soft_hinges_are_told_of_once_and_in_the_report(workplace) -> None:
    herkal = f'model = {{ preset = "herkal" }}; {TWO_RULES}; output.shapes = [1]'
    workplace.write(changed(MODES, herkal))
    done = workplace.call("run", "case.toml")
    assert done.status == 0
    (line,) = done.err.splitlines()  # once, not for every mass rule
    assert line.startswith("foldyn: warning: case.toml: 16 hinges of the superlinear law stand at")
    assert line.endswith("(docs/modes.md#bends-without-a-slope) (circumcenter, panel)")
    page = Path("case-results/report.html").read_text(encoding="utf-8")
    assert "16 hinges of the superlinear law stand at their rest angle" in page
    workplace.write(changed(MODES, f"{herkal}; analysis.secant = 2"))
    workplace.good("run", "case.toml", "--no-figures", "--out", "secant")  # no warning


def test_a_free_sheet_has_rigid_modes(workplace) -> None:
    workplace.write(changed(MODES, "supports =; analysis.count = 8; output.shapes = [1]"))
    done = workplace.good("run", "case.toml")
    assert "circumcenter: 8 modes (6 rigid), " in done.out
    page = Path("case-results/report.html").read_text(encoding="utf-8")
    assert [row[1] for row in cells_of(page)[1:7]] == ["rigid"] * 6
    assert "0.0" not in [row[2] for row in cells_of(page)[1:7]]  # they have no damping ratio


@pytest.mark.matrix
def test_a_response_in_time(workplace) -> None:
    method = 'kind = "frf", method = "burst_random", averages = 2, duration = 20.0'
    grid = "window_rate = 0.2, frequencies = { first = 0.5, last = 1, count = 11 }"
    workplace.write(changed(RESPONSE, f"analysis = {{ {method}, {grid} }}"))
    assert workplace.call("run", "case.toml", *FIGURES).status == 0
    result = fd.load("r/result.nc")
    assert result.attrs["averages"] == 2
    assert result["coherence"].shape == result["receptance"].shape
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "Magnitude, phase and coherence of the receptance of nodes 7, 8" in page


REFUSED = """
analysis.count = 400: the case has only 30 free dofs
pattern = { vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]], faces = [[0, 1, 2,
    3]] }; supports[0].nodes = [0, 1] | node 4 is free but has no mass
"""
REFUSED_RESPONSE = """
drive[0].nodes = [0] | drive[0]: the force [0.01, 0.0, 0.0] acts only where supports hold its
    nodes: 0 (x)
supports[0].axes = "yz"; drive[0] = { base = "x" } | drive[0]: the base moves along x, but no
    support holds a node along x
analysis.method = "stepped_sine" | analysis.frequencies: stepped_sine cannot give 0 Hz; begin
    above it
"""


@pytest.mark.parametrize(
    ("text", "edits", "message"),
    [*((MODES, *row) for row in rows(REFUSED)), *((RESPONSE, *r) for r in rows(REFUSED_RESPONSE))],
)
def test_what_is_refused_gets_one_message(workplace, text, edits, message) -> None:
    workplace.write(changed(text, edits))
    assert workplace.refused("run", "case.toml").startswith(f"case.toml: {message}")


@pytest.mark.matrix
def test_an_equilibrium_that_is_not_found_is_a_failure(workplace) -> None:
    """Status 1, and the points of the search are not kept as if they were modes."""
    heavy = LOADED.replace("0.01", "-1e3")
    workplace.write(changed(MODES, f'{heavy}; analysis.state = "equilibrium"'))
    failed = workplace.call("run", "case.toml")
    assert (failed.status, failed.new) == (1, [])
    assert failed.err.startswith("foldyn: case.toml: ")


def test_an_interrupted_response_leaves_nothing(workplace, monkeypatch) -> None:
    def interrupted(*_, **__):
        raise MotionInterrupted("interrupted at 0.1 s", fd.load("motion.nc"))

    workplace.write(RESPONSE)
    workplace.call("run", "case.toml", "--no-figures", "--out", "motion")
    (workplace.folder / "motion.nc").write_bytes(Path("motion/result.nc").read_bytes())
    monkeypatch.setattr("foldyn.analyses.frf.frf", interrupted)
    stopped = workplace.call("run", "case.toml", "--no-figures")
    assert (stopped.status, stopped.new) == (130, [])
    assert stopped.err == "foldyn: interrupted at 0.1 s\n"
