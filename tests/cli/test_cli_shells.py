"""`foldyn` on shells: case files of shells, and others run as shells."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd

SHELL = ('[model]\nmass = "circumcenter"', '[model]\nkind = "shell"\ndivisions = 2')
STATICS = (
    'kind = "dynamics"\nduration = 0.1\n[output]\nevery = 0.01',
    'kind = "statics"\nsteps = 2',
)
HISTORY = ('history = { kind = "half_sine", duration = 0.05 }\n', "")


def test_a_motion_with_all_figures(workplace, edited) -> None:
    workplace.write(edited(SHELL))
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("a Miura unit cell: 25 nodes, 32 triangles, 4 folds\n")
    assert "lumped: generalized_alpha, implicit: the rotations of a shell have no mass" in done.out
    pictures = {"structure.png", "laws.png", "load.png", "motion.png", "energies.png"}
    assert {*done.new} == {"r", *(f"r/{name}" for name in (*pictures, "result.nc", "report.html"))}
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "A shell: panels that stretch and bend as thin sheets, in 32 triangles" in page
    assert "moment of a fold, over the whole crease" in page
    assert ">inf<" not in page  # an implicit method has no critical step
    again = fd.case_of(fd.load("r/result.nc")).structure
    assert isinstance(again, fd.Shell) and again.options.divisions == 2


def test_a_path_and_its_energies(workplace, edited) -> None:
    workplace.write(edited(SHELL, STATICS, HISTORY))
    done = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert (done.status, done.err) == (0, "")
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "Strain energies of membrane, bending, folds, stacked" in page
    assert ">bending (%)<" in page and "bends" not in page
    for name in ("structure", "laws", "curve", "energies", "shapes"):
        assert base64.b64encode(Path(f"r/{name}.png").read_bytes()).decode() in page


def test_a_file_of_bars_and_hinges_as_a_shell(workplace, edited) -> None:
    workplace.write(edited(STATICS, HISTORY))
    shell = workplace.call(
        "run", "case.toml", "--no-figures", "--model", "shell", "--divisions", "4"
    )
    assert (shell.status, shell.err) == (0, "")
    # a folder of its own, beside the other model's
    assert shell.new == ["case-shell-results", "case-shell-results/result.nc"]
    reduced = workplace.call("run", "case.toml", "--no-figures")
    assert reduced.new == ["case-results", "case-results/result.nc"]
    moved = [
        fd.load(f"{made.new[0]}/result.nc").displacement.sel(node=7, axis="x").values[-1]
        for made in (shell, reduced)
    ]
    assert moved[0] == pytest.approx(moved[1], rel=0.3)
    assert moved[0] != moved[1]


def test_modes_and_responses_as_those_of_a_shell(workplace, edited) -> None:
    workplace.write(edited())
    done = workplace.call(
        "modes", "case.toml", "--no-figures", "--count", "2", "--model", "shell", "--divisions", "2"
    )
    assert done.status == 0
    assert done.new == ["case-shell-modes", "case-shell-modes/result.nc"]
    stored = fd.load("case-shell-modes/result.nc")
    again = fd.modes(fd.case_of(stored), count=2)
    np.testing.assert_allclose(stored["frequency"], again["frequency"], rtol=1e-9)
    done = workplace.call(
        "frf", "case.toml", "--no-figures", "--model", "shell", "--divisions", "2",
        "--frequencies", "0", "1", "3",
    )  # fmt: skip
    assert (done.status, done.err) == (0, "")
    assert isinstance(fd.case_of(fd.load("case-shell-frf/result.nc")).structure, fd.Shell)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (["run", "--model", "plate"], 'case.toml: model = "plate": choose one of bars_and_hinges'),
        (["run", "--divisions", "4"], 'case.toml: model.divisions: only for model.kind = "shell"'),
        (
            ["run", "--model", "shell", "--divisions", "0"],
            "case.toml: model.divisions = 0: must be at least 1",
        ),
        (["modes", "--model", "plate"], 'case.toml: model = "plate": choose one of'),
        (
            ["modes", "--model", "shell", "--secant", "1"],
            "case.toml: analysis.secant = 1.0: is for superlinear bends",
        ),
    ],
)
def test_what_cannot_be(workplace, edited, command, message) -> None:
    workplace.write(edited())
    name, *options = command
    done = workplace.call(name, "case.toml", *options)
    assert (done.status, done.new) == (2, [])
    assert message in done.err and "Traceback" not in done.err


def test_folds_without_slope(workplace, edited) -> None:
    superlinear = ("divisions = 2", 'divisions = 2\nfold_law = "superlinear"')
    workplace.write(edited(SHELL).replace(*superlinear))
    done = workplace.call("modes", "case.toml", "--no-figures")
    assert done.status == 2 and done.new == []
    assert 'case.toml: model.fold_law = "superlinear": the folds of a shell have no' in done.err


def test_info_tells_the_models(workplace) -> None:
    lines = workplace.call("info").out.splitlines()
    assert "model shell: mass lumped, consistent (default: lumped)" in lines
    (reduced,) = [line for line in lines if line.startswith("model bars_and_hinges: ")]
    assert reduced.endswith("(default: consistent)")
