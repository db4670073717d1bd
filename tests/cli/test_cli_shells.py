"""`foldyn` on shells: case files of shells, and others run as shells."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import changed

SHELL = 'model = { kind = "shell", divisions = 2 }; analysis.method ='
STATICS = 'output =; loads[0].history =; analysis = { kind = "statics", steps = 2 }'
AS_SHELL = ("--no-figures", "--model", "shell", "--divisions", "2")


@pytest.mark.matrix
def test_a_motion_with_all_figures(workplace, miura) -> None:
    workplace.write(changed(miura, SHELL))
    done = workplace.good("run", "case.toml", "--no-figures")
    assert done.out.startswith("a Miura unit cell: 25 nodes, 32 triangles, 4 folds\n")
    assert "lumped: generalized_alpha, implicit: the rotations of a shell have no mass" in done.out
    page = workplace.page("structure.png", "laws.png", "load.png", "motion.png", "energies.png")
    assert "A shell: panels that stretch and bend as thin sheets, in 32 triangles" in page
    assert "moment of a fold, over the whole crease" in page
    assert ">inf<" not in page  # an implicit method has no critical step
    again = fd.case_of(fd.load("r/result.nc")).structure
    assert isinstance(again, fd.Shell) and again.options.divisions == 2


@pytest.mark.matrix
def test_a_path_and_its_energies(workplace, miura) -> None:
    workplace.write(changed(miura, f"{SHELL}; {STATICS}"))
    page = workplace.page("structure.png", "laws.png", "curve.png", "energies.png", "shapes.png")
    assert "Strain energies of membrane, bending, folds, stacked" in page
    assert ">bending (%)<" in page and "bends" not in page


@pytest.mark.matrix
def test_a_file_of_bars_and_hinges_as_a_shell(workplace, miura) -> None:
    workplace.write(changed(miura, STATICS))
    shell = workplace.good("run", "case.toml", *AS_SHELL[:-1], "4")
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


@pytest.mark.matrix
def test_modes_and_responses_as_those_of_a_shell(workplace, miura) -> None:
    workplace.write(miura)
    done = workplace.call("modes", "case.toml", *AS_SHELL, "--count", "2")
    assert done.status == 0
    assert done.new == ["case-shell-modes", "case-shell-modes/result.nc"]
    stored = fd.load("case-shell-modes/result.nc")
    again = fd.modes(fd.case_of(stored), count=2)
    np.testing.assert_allclose(stored["frequency"], again["frequency"], rtol=1e-9)
    workplace.good("frf", "case.toml", *AS_SHELL, "--frequencies", "0", "1", "3")
    assert isinstance(fd.case_of(fd.load("case-shell-frf/result.nc")).structure, fd.Shell)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("run --model plate", 'model = "plate": choose one of bars_and_hinges'),
        ("modes --model plate", 'model = "plate": choose one of'),
        ("modes --model shell --secant 1", "analysis.secant = 1.0: is for superlinear bends"),
    ],
)
def test_what_cannot_be(workplace, miura, arguments, message) -> None:
    workplace.write(miura)
    command, *options = arguments.split()
    assert workplace.refused(command, "case.toml", *options).startswith(f"case.toml: {message}")


def test_folds_without_slope(workplace, miura) -> None:
    workplace.write(changed(miura, f'{SHELL}; model.fold_law = "superlinear"'))
    line = workplace.refused("modes", "case.toml", "--no-figures")
    told = 'case.toml: model.fold_law = "superlinear": the folds of a shell have no'
    assert line.startswith(told)


def test_info_tells_the_models(workplace) -> None:
    lines = workplace.call("info").out.splitlines()
    assert "model shell: mass lumped, consistent (default: lumped)" in lines
    (reduced,) = [line for line in lines if line.startswith("model bars_and_hinges: ")]
    assert reduced.endswith("(default: condensed)")
