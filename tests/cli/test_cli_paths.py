"""`foldyn run` on case files of paths: results, figures, failures, refusals."""

from __future__ import annotations

import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT, begins, changed, rows
from foldyn.analyses import path as paths
from foldyn.cli.folder import STAMP
from foldyn.cli.main import main
from foldyn.cli.run import DRAWN

CELL = f"""title = "a Miura unit cell, pulled slowly"
{FOLD_TEXT.replace("simple_fold", "miura")}[model]
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
density = 667
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
PRESSED = changed(
    TOWER,
    'loads =; supports[1] = { nodes = "zmax", axis = "z", displacement = -0.01 }; '
    'analysis = { kind = "statics", method = "displacement", steps = 4 }',
)
PICTURES = ("structure.png", "laws.png", "energies.png", "shapes.png")


@pytest.mark.matrix
def test_a_case_file_becomes_a_path_that_runs_again_from_itself(workplace) -> None:
    workplace.write(CELL)
    done = workplace.good("run", "case.toml", "--no-figures")
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


def test_a_path_ends_where_a_node_has_come_far_enough(workplace) -> None:
    until = 'analysis.until = { node = 6, axis = "z", displacement = -0.01 }'
    method = 'analysis = { kind = "statics", method = "arc_length", first_step = 5 }'
    workplace.write(changed(TOWER, f"{method}; {until}"))
    done = workplace.good("run", "case.toml", "--no-figures")
    path = fd.load("case-results/result.nc")
    down = -path.displacement.sel(node=6, axis="z").values
    assert down[-1] >= 0.01 > down[-2]
    assert (path.point.values == "limit").sum() == 1
    assert "(1 limit point, 0 bifurcations)" in done.out


def test_a_path_that_loses_stability_says_so_once(workplace) -> None:
    strut = (
        'pattern.dihedral = 180; model = { fold_law = "linear", bend_law = "linear" }; '
        'supports = [{ nodes = [0, 1] }, { nodes = [4, 5], axes = "yz" }]; '
        'loads = [{ nodes = [4, 5], force = [-1, 0, 0] }]; analysis.kind = "statics"'
    )
    done = workplace.run(changed(FOLD_TEXT, strut))
    assert done.status == 0
    (line,) = done.err.splitlines()
    assert line.startswith("foldyn: warning: case.toml: the path loses stability: ")
    unstable = fd.load("case-results/result.nc").attrs["unstable_points"]
    assert f"newton: 11 points, {unstable} of them unstable, to the load factor 1," in done.out


@pytest.mark.matrix
def test_a_path_that_cannot_go_on_is_kept_with_the_remedy(workplace) -> None:
    reason = workplace.run(TOWER).failure("case-results/result.nc")
    assert reason.startswith("foldyn: case.toml: no equilibrium was found beyond the load factor 3")
    assert "method 'arc_length' follows the path through it" in reason
    path = fd.load("case-results/result.nc")
    np.testing.assert_array_equal(path.load_factor, [0, 10, 20, 30])
    assert path.attrs["status"] == "stopped"
    assert path.attrs["stopped_because"] in reason
    assert path.attrs["remedy"] in reason
    # with figures asked for it is the same
    workplace.write(TOWER)
    assert workplace.call("run", "case.toml", "--out", "other").new == ["other", "other/result.nc"]


def test_an_interrupted_path_is_kept(workplace, monkeypatch) -> None:
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

    monkeypatch.setattr(paths, "bar", lambda shown, **options: Impatient())
    stopped = workplace.run(TOWER)
    assert stopped.status == 130
    assert "interrupted after 3 points" in stopped.err
    path = fd.load("case-results/result.nc")
    np.testing.assert_array_equal(path.load_factor, [0, 10, 20])


REFUSED = """
supports[0].nodes = [0] | the structure can move freely: rotation about z. Statics needs supports
    ... inertia_relief = true
sheet.density =; analysis.load_factors =; analysis.inertia_relief = true |
    analysis.inertia_relief: needs the mass of the structure ... density
analysis.load_factors =; analysis.method = "displacement" | analysis.method 'displacement' needs
    something that moves
analysis.steps = 3 | analysis.load_factors and steps: give one of them
analysis.load_factors =; analysis.first_step = 0.1 | analysis.first_step: method 'newton' is
    driven by load_factors or steps; leave it out
analysis.constant = "gravity": the case has no Gravity among its loads
analysis.constant = [0] | nothing grows along the path
initial.file = "none.nc": none.nc: there is no such file
"""
MECHANISM = changed(CELL, "supports[0].nodes = [0]")


@pytest.mark.parametrize(("edits", "message"), rows(REFUSED))
def test_what_is_refused_gets_one_message(workplace, edits, message) -> None:
    workplace.write(changed(CELL, edits))
    line = workplace.refused("run", "case.toml")
    assert begins(line.removeprefix("case.toml: "), message), line


def test_what_is_refused_leaves_an_earlier_run_as_it_was(workplace) -> None:
    workplace.write(MECHANISM)
    old = workplace.folder / "case-results"
    old.mkdir()
    for name in ("report.html", "curve.png", "result.nc"):
        (old / name).write_text("old")
    workplace.refused("run", "case.toml")  # which compares all files with what they were


@pytest.mark.matrix
def test_figures_of_a_loaded_path(workplace) -> None:
    workplace.write(CELL + '[output]\nnodes = [6, 7]\naxis = "x"\nshapes = [0, -1]\n')
    page = workplace.page(*PICTURES, "curve.png")
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
def test_figures_of_moved_supports(workplace) -> None:
    """Their force over their displacement; the load factor over it would say nothing."""
    workplace.write(PRESSED)
    page = workplace.page(*PICTURES, "reaction.png", "landscape.png")  # the force falls
    assert "moved along -z (m)" in page
    path = fd.load("r/result.nc")
    force = fd.plots.total_reaction(path, range(6, 12), direction="-z")
    assert force[0] == 0.0 and 0.0 < force[-1] < force.max()  # past the limit point
    assert all(f"{value:.4g}" in page for value in force)
    # nodes that move otherwise get their curve, too, in another folder
    workplace.write(changed(PRESSED, "output.nodes = [0, 6]"))
    assert "s/curve.png" in workplace.call("run", "case.toml", "--out", "s", "--figures", "png").new


def test_figures_of_an_earlier_motion_go(workplace, tmp_path) -> None:
    folder = tmp_path / "case-results"
    folder.mkdir()
    for name in DRAWN:
        (folder / name).write_text("old")
    (folder / "notes.txt").write_text("mine")
    workplace.write(CELL)
    assert main(["run", "case.toml", "--no-figures"]) == 0
    assert {path.name for path in folder.iterdir()} == {"notes.txt", "result.nc", STAMP}


@pytest.mark.matrix
def test_a_single_point_is_drawn(workplace) -> None:
    workplace.write(changed(CELL, "analysis.load_factors = [1]"))
    done = workplace.good("run", "case.toml", "--out", "r", "--figures", "png")
    assert "1 point to the load factor 1" in done.out
    assert "r/shapes.png" in done.new and "r/path.gif" not in done.new


def test_points_that_a_path_does_not_have(workplace) -> None:
    workplace.write(CELL + "[output]\nshapes = [7]\n")
    reason = workplace.call("run", "case.toml").failure("case-results/result.nc")
    assert reason == "foldyn: case.toml: figures: points: 7; there are points 0 to 2"


@pytest.mark.matrix
def test_a_path_goes_on_from_a_stored_one(workplace) -> None:
    """A second state is found from a guess near it: the tower pressed down stays there."""
    down = "supports[1].displacement = -0.0312; analysis.steps = 8"
    workplace.write(changed(PRESSED, down), "down.toml")
    assert workplace.call("run", "down.toml", "--no-figures").status == 0
    start = 'initial.file = "down-results/result.nc"; analysis.load_factors = [0]'
    workplace.write(changed(TOWER, start))
    workplace.good("run", "case.toml", "--no-figures")
    path = fd.load("case-results/result.nc")
    height = 0.06 + path.displacement.sel(node=6, axis="z").values
    # the height at which all edges have their lengths again: docs/statics.md
    assert height[0] == pytest.approx(0.02879, abs=1e-4)
    assert path.negative_eigenvalues.values.tolist() == [0]


@pytest.mark.matrix
def test_compress_release_vibrate_as_two_case_files(workplace) -> None:
    workplace.write(changed(PRESSED, "analysis.steps = 2"), "pressed.toml")
    assert workplace.call("run", "pressed.toml", "--no-figures").status == 0
    start = 'initial = { file = "pressed-results/result.nc", at = 1 }'
    motion = 'analysis = { kind = "dynamics", duration = 2e-3 }'
    workplace.write(changed(TOWER, f"loads =; {start}; {motion}"))
    workplace.good("run", "case.toml", "--no-figures")
    path, motion = fd.load("pressed-results/result.nc"), fd.load("case-results/result.nc")
    np.testing.assert_array_equal(motion.displacement[0], path.displacement[1])
    top = motion.displacement.sel(node=6, axis="z").values
    assert top[0] == -0.005
    assert top.max() > -0.001  # it springs back


def test_the_bar_tells_points_and_load_factor(monkeypatch, workplace) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    workplace.write(CELL)
    assert main(["run", "case.toml", "--no-figures"]) == 0
    told = screen.getvalue()
    assert "points: 1, load factor 0 [00:00]" in told
    # and where something is refused nothing of it remains but the message
    screen.truncate(0)
    workplace.write(MECHANISM)
    assert main(["run", "case.toml"]) == 2
    assert screen.getvalue().split("\r")[-1].startswith("foldyn: case.toml: the structure can move")
