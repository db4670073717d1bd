"""`foldyn run` on case files of modes and frequency responses: results, figures, refusals."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.run import DRAWN
from foldyn.errors import InputError, MotionInterrupted
from foldyn.linear import frf, modes, peaks_of

MODES = """
title = "modes of a Miura unit cell"
[pattern]
kind = "miura"
cells = [1, 1]
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
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
LOAD = "[[loads]]\nnodes = [7]\nforce = [0.01, 0, 0]\n"
PICTURES = ("structure.png", "laws.png", "modes.png")


@pytest.fixture
def small(edited):
    """Function that gives a case file with things replaced that occur in it once."""
    return lambda *pairs, text=MODES: edited(*pairs, text=text)


@pytest.fixture(autouse=True)
def short_films(monkeypatch):
    """Films of two pictures: what they show is tested with the figures."""
    monkeypatch.setattr("foldyn.analyses.modes.FRAMES", 2)


def cells_of(page: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


def test_modes_become_a_result_that_is_that_of_python(workplace) -> None:
    done = workplace.run(MODES)
    assert (done.status, done.err) == (0, "")
    assert done.new == ["case-results", "case-results/result.nc"]
    stored = fd.load("case-results/result.nc")
    f = stored["frequency"].values
    assert "modes of a Miura unit cell: 13 nodes" in done.out
    assert f"circumcenter: 4 modes, {f[0]:.4g} to {f[-1]:.4g} Hz, " in done.out
    again = modes(fd.case_of(stored), count=4)
    np.testing.assert_allclose(again["frequency"], f, rtol=1e-12)
    np.testing.assert_allclose(again["shape"], stored["shape"], atol=1e-9)


def test_a_response_becomes_a_result_that_is_that_of_python(workplace) -> None:
    done = workplace.run(RESPONSE)
    assert (done.status, done.err) == (0, "")
    assert done.new == ["case-results", "case-results/result.nc"]
    assert "circumcenter: direct, 61 frequencies from 0 to 3 Hz, " in done.out
    stored = fd.load("case-results/result.nc")
    drive = [fd.Force([7], (0.01, 0, 0))]
    again = frf(fd.case_of(stored), drive, np.linspace(0.0, 3.0, 61))
    np.testing.assert_allclose(again["receptance"], stored["receptance"], rtol=1e-12)
    assert stored.attrs["drive_force"] == pytest.approx(0.01)


def test_a_case_file_about_a_stored_equilibrium(workplace, small) -> None:
    """The state of a path that loads end, and the equilibrium found anew, have the same modes."""
    slow = small(('kind = "modes"\ncount = 4', 'kind = "statics"\nload_factors = [0, 1]'))
    workplace.write(slow.replace("[analysis]", LOAD + "[analysis]"), "slow.toml")
    assert workplace.call("run", "slow.toml", "--no-figures").status == 0
    loaded = small(("[analysis]", LOAD + "[analysis]"))
    stored = '[initial]\nfile = "slow-results/result.nc"\n'
    workplace.write(loaded.replace("[analysis]", stored + "[analysis]"), "stored.toml")
    workplace.write(loaded.replace("count = 4", 'state = "equilibrium"\ncount = 4'), "found.toml")
    for name in ("stored", "found"):
        done = workplace.call("run", f"{name}.toml", "--no-figures")
        assert (done.status, done.err) == (0, "")
    stored, found = (fd.load(f"{name}-results/result.nc") for name in ("stored", "found"))
    np.testing.assert_allclose(stored["frequency"], found["frequency"], rtol=1e-6)
    workplace.write(MODES, "rest.toml")
    workplace.call("run", "rest.toml", "--no-figures")
    rest = fd.load("rest-results/result.nc")["frequency"]
    assert np.abs(found["frequency"] / rest - 1.0).max() > 1e-3  # the load matters


def test_figures_of_modes(workplace, small) -> None:
    text = small(('"circumcenter"', '["circumcenter", "panel"]'))
    workplace.write(text + '[output]\nshapes = [1, 3]\naxis = "y"\n')
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    results = ("result-circumcenter.nc", "result-panel.nc")
    drawn = (*PICTURES, "mac.png", "report.html")
    assert set(done.new) == {"r", *(f"r/{name}" for name in (*drawn, *results))}
    assert set(drawn) <= set(DRAWN)
    page = Path("r/report.html").read_text(encoding="utf-8")
    for name in drawn[:-1]:
        assert base64.b64encode(Path("r", name).read_bytes()).decode() in page, name
    one, two = (fd.load(f"r/{name}") for name in results)
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
    mac = fd.linear.mac(one, two, fd.case_of(one).structure.mass)
    pairs = fd.linear.pair_modes(mac)
    for k, row in enumerate(comparison[1:]):
        assert float(row[2]) == pytest.approx(float(two["frequency"][pairs.second[k]]), rel=1e-3)
        assert float(row[3]) == pytest.approx(pairs.mac[k], rel=1e-3)
    assert "seen along y" in page


def test_figures_of_a_response(workplace, small) -> None:
    finer = ("count = 61", "count = 601")
    text = small(('"circumcenter"', '["circumcenter", "panel"]'), finer, text=RESPONSE)
    workplace.write(text + 'quantity = "mobility"\n')
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    results = ("result-circumcenter.nc", "result-panel.nc")
    drawn = ("structure.png", "laws.png", "response.png", "nyquist.png", "report.html")
    assert set(done.new) == {"r", *(f"r/{name}" for name in (*drawn, *results))}
    assert set(drawn) <= set(DRAWN)
    page = Path("r/report.html").read_text(encoding="utf-8")
    for name in drawn[:-1]:
        assert base64.b64encode(Path("r", name).read_bytes()).decode() in page, name
    header, *rows = cells_of(page)
    assert header[:4] == ["mass rule", "node", "peak (Hz)", "height (m/(N s))"]
    expected = [
        (rule, str(node), peak)
        for rule in ("circumcenter", "panel")
        for node in (7, 8)
        for peak in peaks_of(fd.load(f"r/result-{rule}.nc"), node, "x", "mobility")
    ]
    for row, (rule, node, peak) in zip(rows, expected, strict=False):
        assert row[:2] == [rule, node]
        assert float(row[2]) == pytest.approx(peak.frequency, rel=1e-3)
        assert float(row[3]) == pytest.approx(peak.height, rel=1e-3)
        for cell, ratio in ((row[4], peak.half_power), (row[7], peak.damping_ratio)):
            assert (
                cell == ""
                if np.isnan(ratio)
                else float(cell) == pytest.approx(100 * ratio, rel=1e-2)
            )
    assert rows[len(expected)][:2] == ["mass rule", "method"]


def test_a_response_to_a_moving_base(workplace, small) -> None:
    text = small(("nodes = [7]\nforce = [0.01, 0, 0]", 'base = "x"'), text=RESPONSE)
    workplace.write(text)
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    assert "r/nyquist.png" not in done.new  # circles are those of responses to forces
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "displacement along x per displacement of the base along x" in page
    assert "transmissibility" in fd.load("r/result.nc")


def test_soft_hinges_are_told_of_once_and_in_the_report(workplace, small) -> None:
    text = small(
        ('bend_law = "linear"', 'preset = "herkal"'),
        ('"circumcenter"', '["circumcenter", "panel"]'),
    )
    text += "[output]\nshapes = [1]\n"
    workplace.write(text)
    done = workplace.call("run", "case.toml")
    assert done.status == 0
    (line,) = done.err.splitlines()  # once, not for every mass rule
    assert line.startswith("foldyn: warning: 16 hinges of the superlinear law stand at their rest")
    page = Path("case-results/report.html").read_text(encoding="utf-8")
    assert "16 hinges of the superlinear law stand at their rest angle" in page
    workplace.write(text.replace("count = 4", "count = 4\nsecant = 2"))
    done = workplace.call("run", "case.toml", "--out", "secant")
    assert (done.status, done.err) == (0, "")
    page = Path("secant/report.html").read_text(encoding="utf-8")
    assert "equivalent to an oscillation by 2 degrees" in page


def test_a_free_sheet_has_rigid_modes(workplace, small) -> None:
    text = small(("[[supports]]\nnodes = [0, 1, 2]\n", ""), ("count = 4", "count = 8"))
    workplace.write(text + "[output]\nshapes = [1]\n")
    done = workplace.call("run", "case.toml")
    assert (done.status, done.err) == (0, "")
    assert "circumcenter: 8 modes (6 rigid), " in done.out
    page = Path("case-results/report.html").read_text(encoding="utf-8")
    assert [row[1] for row in cells_of(page)[1:7]] == ["rigid"] * 6
    assert "0.0" not in [row[2] for row in cells_of(page)[1:7]]  # they have no damping ratio


def test_a_response_in_time(workplace, small) -> None:
    method = (
        'kind = "frf"\nmethod = "burst_random"\naverages = 2\nduration = 20.0\nwindow_rate = 0.2'
    )
    text = small(
        ('kind = "frf"', method),
        ("first = 0, last = 3, count = 61", "first = 0.5, last = 1, count = 11"),
        text=RESPONSE,
    )
    workplace.write(text)
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert done.status == 0
    result = fd.load("r/result.nc")
    assert result.attrs["averages"] == 2
    assert result["coherence"].shape == result["receptance"].shape
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "Magnitude, phase and coherence of the receptance of nodes 7, 8" in page


REFUSED = {
    "more modes than there are": (
        MODES,
        [("count = 4", "count = 400")],
        "analysis.count = 400: the case has only 30 free dofs",
    ),
    "drive on a support": (
        RESPONSE,
        [("nodes = [7]\nforce", "nodes = [0]\nforce")],
        "drive[0]: the force [0.01, 0.0, 0.0] acts only where supports hold its nodes: 0 (x)",
    ),
    "base without support": (
        RESPONSE,
        [
            ("[[supports]]\nnodes = [0, 1, 2]\n", '[[supports]]\nnodes = [0, 1, 2]\naxes = "yz"\n'),
            ("nodes = [7]\nforce = [0.01, 0, 0]", 'base = "x"'),
        ],
        "drive[0]: the base moves along x, but no support holds a node along x",
    ),
    "0 Hz in time": (
        RESPONSE,
        [('kind = "frf"', 'kind = "frf"\nmethod = "stepped_sine"')],
        "analysis.frequencies: stepped_sine cannot give 0 Hz; begin above it",
    ),
    "no such start": (
        MODES,
        [("[analysis]", '[initial]\nfile = "none.nc"\n[analysis]')],
        'initial.file = "none.nc": none.nc: there is no such file',
    ),
    "massless node": (
        MODES,
        [
            (
                'kind = "miura"\ncells = [1, 1]\ndihedral = 60',
                "vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]]\n"
                "faces = [[0, 1, 2, 3]]",
            ),
            ("nodes = [0, 1, 2]", "nodes = [0, 1]"),
        ],
        "node 4 is free but has no mass",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_gets_one_message_and_nothing_is_written(workplace, small, name) -> None:
    text, edits, message = REFUSED[name]
    workplace.write(small(*edits, text=text))
    bad = workplace.call("run", "case.toml")
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    (line,) = bad.err.splitlines()
    assert line.startswith(f"foldyn: case.toml: {message}"), line


def test_an_equilibrium_that_is_not_found_is_a_failure(workplace, small) -> None:
    """Status 1, and the points of the search are not kept as if they were modes."""
    heavy = LOAD.replace("0.01", "-1e3")
    state = 'state = "equilibrium"\ncount = 4'
    workplace.write(small(("[analysis]", heavy + "[analysis]"), ("count = 4", state)))
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


def test_mp4_without_ffmpeg_is_refused_at_once(workplace, monkeypatch) -> None:
    def missing() -> str:
        raise InputError("MP4 needs ffmpeg: install it")

    monkeypatch.setattr("foldyn.plots.writers.find_ffmpeg", missing)
    workplace.write(MODES + '[output]\nanimation = "mp4"\n')
    done = workplace.call("run", "case.toml")
    assert (done.status, done.new) == (2, [])
    assert 'case.toml: output.animation = "mp4": MP4 needs ffmpeg' in done.err
