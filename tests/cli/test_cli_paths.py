"""`foldyn run` on case files of paths: results, figures, failures, refusals."""

from __future__ import annotations

import base64
import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli import stamp
from foldyn.cli.main import main
from foldyn.cli.run import DRAWN

CELL = """
title = "a Miura unit cell, pulled slowly"
[pattern]
kind = "miura"
cells = [1, 1]
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
[model]
preset = "herkal"
[[supports]]
nodes = [0, 1, 2]
axes = "x"
[[supports]]
nodes = [0, 2, 6, 8]
axes = "z"
[[supports]]
nodes = [1]
axes = "y"
[[loads]]
nodes = [7]
force = [0.01, 0, 0]
[analysis]
kind = "statics"
load_factors = [0, 0.5, 1]
"""

TOWER = """
[pattern]
kind = "kresling"
radius = 0.04
height = 0.06
[sheet]
youngs_modulus = 1.2e9
poissons_ratio = 0.2
thickness = 0.24e-3
[model]
membrane = "bars"
[[supports]]
nodes = "zmin"
[[loads]]
nodes = "zmax"
force = [0, 0, -1]
[analysis]
kind = "statics"
load_factors = [0, 10, 20, 30, 40, 50]
"""

MOVED = (
    '[[loads]]\nnodes = "zmax"\nforce = [0, 0, -1]\n',
    '[[supports]]\nnodes = "zmax"\naxis = "z"\ndisplacement = -0.01\n',
)
PICTURES = ("structure.png", "laws.png", "energies.png", "shapes.png")


@pytest.fixture
def slow(edited):
    """Function that gives the cell's case file with things replaced that occur in it once."""
    return lambda *pairs, text=CELL: edited(*pairs, text=text)


def test_a_case_file_becomes_a_path_that_runs_again_from_itself(workplace, slow) -> None:
    done = workplace.run(slow())
    assert (done.status, done.err) == (0, "")
    assert done.new == ["case-results", "case-results/result.nc"]
    assert "a Miura unit cell, pulled slowly: 13 nodes" in done.out
    assert "newton: 3 points to the load factor 1, " in done.out
    assert f"wrote {Path('case-results/result.nc')}" in done.out
    path = fd.load("case-results/result.nc")
    assert path.attrs["status"] == "complete"
    np.testing.assert_array_equal(path.load_factor, [0, 0.5, 1])
    # case study 2, section 5 of the design
    moved = path.displacement.sel(node=[6, 8, 7], axis="x").values[-1]
    np.testing.assert_allclose(moved, [0.0276, 0.0081, 0.0222], atol=6e-5)
    again = fd.trace(fd.case_of(path), load_factors=path.load_factor.values)
    np.testing.assert_array_equal(again.displacement, path.displacement)


def test_settings_reach_the_solver(workplace, slow) -> None:
    text = slow(("load_factors = [0, 0.5, 1]", "tolerance = 1e-6\nstability = false\nsteps = 2"))
    assert workplace.run(text).status == 0
    path = fd.load("case-results/result.nc")
    assert path.attrs["tolerance"] == 1e-6
    assert set(path.negative_eigenvalues.values) == {-1}
    assert path.sizes["step"] == 3


def test_a_path_ends_where_a_node_has_come_far_enough(workplace, edited) -> None:
    factors = "load_factors = [0, 10, 20, 30, 40, 50]"
    until = 'until = { node = 6, axis = "z", displacement = -0.01 }'
    new = f'method = "arc_length"\nfirst_step = 5\n{until}'
    done = workplace.run(edited((factors, new), text=TOWER))
    assert (done.status, done.err) == (0, "")
    path = fd.load("case-results/result.nc")
    down = -path.displacement.sel(node=6, axis="z").values
    assert down[-1] >= 0.01 > down[-2]
    assert (path.point.values == "limit").sum() == 1
    assert "(1 limit point, 0 bifurcations)" in done.out


def test_a_path_that_loses_stability_says_so_once(workplace) -> None:
    text = """
[pattern]
vertices = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
faces = [[0, 1, 4, 5], [1, 2, 3, 4]]
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
[model]
fold_law = "linear"
bend_law = "linear"
[[supports]]
nodes = [0, 5]
[[supports]]
nodes = [2, 3]
axes = "yz"
[[loads]]
nodes = [2, 3]
force = [-1, 0, 0]
[analysis]
kind = "statics"
"""
    done = workplace.run(text)
    assert done.status == 0
    (line,) = done.err.splitlines()
    assert line.startswith("foldyn: warning: the path loses stability: ")
    unstable = fd.load("case-results/result.nc").attrs["unstable_points"]
    assert f"newton: 11 points, {unstable} of them unstable, to the load factor 1," in done.out


def test_a_path_that_cannot_go_on_is_kept_with_the_remedy(workplace) -> None:
    failed = workplace.run(TOWER)
    assert failed.status == 1
    assert failed.new == ["case-results", "case-results/result.nc"]
    reason, kept = failed.err.splitlines()
    assert reason.startswith("foldyn: case.toml: no equilibrium was found beyond the load factor 3")
    assert "method 'arc_length' follows the path through it" in reason
    assert kept == "foldyn: kept what was computed: case-results/result.nc"
    path = fd.load("case-results/result.nc")
    np.testing.assert_array_equal(path.load_factor, [0, 10, 20, 30])
    assert path.attrs["status"] == "stopped"
    assert path.attrs["stopped_because"] in reason
    assert path.attrs["remedy"] in reason
    # with figures asked for it is the same
    workplace.write(TOWER)
    assert workplace.call("run", "case.toml", "--out", "other").new == ["other", "other/result.nc"]


def test_an_interrupted_path_is_kept(workplace, monkeypatch) -> None:
    from foldyn.analyses import path as paths

    class Impatient:
        """A bar after whose third point somebody presses Ctrl-C."""

        def __init__(self) -> None:
            self.points = 0

        def update(self) -> None:
            self.points += 1
            if self.points == 3:
                raise KeyboardInterrupt

        def nothing(self, *_, **__) -> None: ...

        clear = close = set_postfix_str = nothing

    monkeypatch.setattr(paths, "_bar", lambda shown: Impatient())
    stopped = workplace.run(TOWER)
    assert stopped.status == 130
    assert "interrupted after 3 points" in stopped.err
    path = fd.load("case-results/result.nc")
    np.testing.assert_array_equal(path.load_factor, [0, 10, 20])


REFUSED = {
    "mechanism": (
        [('nodes = [0, 1, 2]\naxes = "x"\n', 'nodes = [0]\naxes = "x"\n')],
        "the structure can move freely: rotation about z. Statics needs supports",
        "inertia_relief = true",
    ),
    "contradictory support": (
        [('nodes = [1]\naxes = "y"', 'nodes = [1]\naxis = "x"\ndisplacement = 0.1')],
        "supports[2]: node 1 is held and imposed along x, a contradictory support; leave out one",
    ),
    "free body without density": (
        [("load_factors = [0, 0.5, 1]", "inertia_relief = true")],
        "",
        "density",
    ),
    "nothing moves": (
        [("load_factors = [0, 0.5, 1]", 'method = "displacement"')],
        "analysis.method 'displacement' needs something that moves",
    ),
    "two ways to say where": (
        [("load_factors = [0, 0.5, 1]", "load_factors = [0, 1]\nsteps = 3")],
        "analysis.load_factors and steps: give one of them",
    ),
    "first step": (
        [("load_factors = [0, 0.5, 1]", "first_step = 0.1")],
        "analysis.first_step: method 'newton' is driven by load_factors or steps; leave it out",
    ),
    "constant": (
        [("load_factors = [0, 0.5, 1]", 'constant = "gravity"')],
        'analysis.constant = "gravity": the case has no Gravity among its loads',
    ),
    "all constant": (
        [("load_factors = [0, 0.5, 1]", "constant = [0]")],
        "nothing grows along the path",
    ),
    "no such start": (
        [("[analysis]", '[initial]\nfile = "none.nc"\n[analysis]')],
        'initial.file = "none.nc": none.nc: there is no such file',
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_gets_one_message_and_nothing_is_written(workplace, slow, name) -> None:
    edits, message, *more = REFUSED[name]
    workplace.write(slow(*edits))
    bad = workplace.call("run", "case.toml")
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    (line,) = bad.err.splitlines()
    assert line.startswith(f"foldyn: case.toml: {message}"), line
    for text in more:
        assert text in line


def test_what_is_refused_leaves_an_earlier_run_as_it_was(workplace, slow) -> None:
    workplace.write(slow(*REFUSED["mechanism"][0]))
    old = workplace.folder / "case-results"
    old.mkdir()
    for name in ("report.html", "curve.png", "result.nc"):
        (old / name).write_text("old")
    bad = workplace.call("run", "case.toml")  # which compares all files with what they were
    assert (bad.status, bad.new) == (2, [])


def test_figures_of_a_loaded_path(workplace, slow) -> None:
    workplace.write(slow() + '[output]\nnodes = [6, 7]\naxis = "x"\nshapes = [0, -1]\n')
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    files = {*PICTURES, "curve.png", "result.nc", "report.html"}
    assert set(done.new) == {"r", *(f"r/{name}" for name in files)}
    assert files - {"result.nc"} <= set(DRAWN)
    page = Path("r/report.html").read_text(encoding="utf-8")
    for name in (*PICTURES, "curve.png"):
        assert base64.b64encode(Path("r", name).read_bytes()).decode() in page, name
    rows = re.findall(r"<tr>(.*?)</tr>", page)
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]
    header, _, half, full = cells[:4]
    assert header[:4] == ["point", "load factor", "node 6 along x (m)", "node 7 along x (m)"]
    assert half[1] == "0.5" and full[0] == "2"
    assert float(full[2]) == pytest.approx(0.0276, abs=6e-5)
    shares = [float(full[header.index(f"{name} (%)")]) for name in ("bars", "bends", "folds")]
    assert sum(shares) == pytest.approx(100.0, abs=0.05)
    assert shares[2] == pytest.approx(75.0, abs=0.5)  # folds, at L* = 1
    assert full[-2:] == ["stable", ""]


@pytest.mark.matrix
def test_figures_of_moved_supports(workplace, edited) -> None:
    """Their force over their displacement; the load factor over it would say nothing."""
    factors = "load_factors = [0, 10, 20, 30, 40, 50]"
    text = edited(MOVED, (factors, 'method = "displacement"\nsteps = 4'), text=TOWER)
    workplace.write(text)
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    pictures = {*PICTURES, "reaction.png", "landscape.png"}  # the force falls
    assert set(done.new) == {"r", *(f"r/{n}" for n in (*pictures, "result.nc", "report.html"))}
    assert pictures <= set(DRAWN)
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "moved along -z (m)" in page
    path = fd.load("r/result.nc")
    force = fd.plots.total_reaction(path, range(6, 12), "-z")
    assert force[0] == 0.0 and 0.0 < force[-1] < force.max()  # past the limit point
    assert all(f"{value:.4g}" in page for value in force)
    # nodes that move otherwise get their curve, too, in another folder
    workplace.write(text.replace("[analysis]", "[output]\nnodes = [0, 6]\n[analysis]"))
    assert "s/curve.png" in workplace.call("run", "case.toml", "--out", "s", "--figures", "png").new


def test_figures_of_an_earlier_motion_go(workplace, slow, tmp_path) -> None:
    folder = tmp_path / "case-results"
    folder.mkdir()
    for name in DRAWN:
        (folder / name).write_text("old")
    (folder / "notes.txt").write_text("mine")
    workplace.write(slow())
    assert main(["run", "case.toml", "--no-figures"]) == 0
    assert {path.name for path in folder.iterdir()} == {"notes.txt", "result.nc", stamp.NAME}


def test_a_single_point_is_drawn(workplace, slow) -> None:
    workplace.write(slow(("load_factors = [0, 0.5, 1]", "load_factors = [1]")))
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    assert "1 point to the load factor 1" in done.out
    assert "r/shapes.png" in done.new and "r/path.gif" not in done.new


def test_points_that_a_path_does_not_have(workplace, slow) -> None:
    workplace.write(slow() + "[output]\nshapes = [7]\n")
    failed = workplace.call("run", "case.toml")
    assert failed.status == 1
    reason, kept = failed.err.splitlines()
    assert reason == "foldyn: case.toml: figures: points: 7; the path has points 0 to 2"
    assert kept.endswith("case-results/result.nc")


def test_a_path_goes_on_from_a_stored_one(workplace, edited, slow) -> None:
    """A second state is found from a guess near it: the tower pressed down stays there."""
    factors = "load_factors = [0, 10, 20, 30, 40, 50]"
    method = (factors, 'method = "displacement"\nsteps = 8')
    down = ("displacement = -0.01", "displacement = -0.0312")
    workplace.write(edited(down, text=edited(MOVED, method, text=TOWER)), "down.toml")
    assert workplace.call("run", "down.toml", "--no-figures").status == 0
    start = '[initial]\nfile = "down-results/result.nc"\n[analysis]'
    text = edited(("[analysis]", start), (factors, "load_factors = [0]"), text=TOWER)
    done = workplace.run(text)
    assert (done.status, done.err) == (0, "")
    path = fd.load("case-results/result.nc")
    height = 0.06 + path.displacement.sel(node=6, axis="z").values
    # the height at which all edges have their lengths again: docs/statics.md
    assert height[0] == pytest.approx(0.02879, abs=1e-4)
    assert path.negative_eigenvalues.values.tolist() == [0]


def test_compress_release_vibrate_as_two_case_files(workplace, edited) -> None:
    factors = "load_factors = [0, 10, 20, 30, 40, 50]"
    dense = ("thickness = 0.24e-3", "thickness = 0.24e-3\ndensity = 667")
    press = edited(MOVED, dense, (factors, 'method = "displacement"\nsteps = 2'), text=TOWER)
    workplace.write(press, "pressed.toml")
    assert workplace.call("run", "pressed.toml", "--no-figures").status == 0
    start = '[initial]\nfile = "pressed-results/result.nc"\nat = 1\n[analysis]'
    text = edited(
        (MOVED[0], ""),
        dense,
        ("[analysis]", start),
        (f'kind = "statics"\n{factors}', 'kind = "dynamics"\nduration = 2e-3'),
        text=TOWER,
    )
    done = workplace.run(text)
    assert (done.status, done.err) == (0, "")
    path, motion = fd.load("pressed-results/result.nc"), fd.load("case-results/result.nc")
    np.testing.assert_array_equal(motion.displacement[0], path.displacement[1])
    top = motion.displacement.sel(node=6, axis="z").values
    assert top[0] == -0.005
    assert top.max() > -0.001  # it springs back


def test_the_bar_tells_points_and_load_factor(monkeypatch, workplace, slow) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    workplace.write(slow())
    assert main(["run", "case.toml", "--no-figures"]) == 0
    told = screen.getvalue()
    assert "points: 1, load factor 0 [00:00]" in told
    # and where something is refused nothing of it remains but the message
    screen.truncate(0)
    workplace.write(slow(*REFUSED["mechanism"][0]))
    assert main(["run", "case.toml"]) == 2
    assert screen.getvalue().split("\r")[-1].startswith("foldyn: case.toml: the structure can move")
