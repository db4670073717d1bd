"""Gradients of sizes and extremes: near 0, and where several places reach them at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import InputError

TOP = "is reached at [0-9]+ places at once.*no derivative"
PRESSED = {"kind": "statics", "load_factors": [0.5, 1.0]}


def tower(stiffness: Any, thickness: float = 0.018, force: float = 0.04) -> fd.Case:
    """One with a symmetry of five, pressed from above."""
    pattern = fd.patterns.kresling(sides=5, radius=0.6, height=0.8, twist=26)
    sheet = fd.Sheet(1.4e6, 0.3, thickness, 900.0)
    own: Any = np.broadcast_to(stiffness, 10)
    made = fd.discretize(pattern, sheet, crease_stiffness=own, preset="plate")
    return fd.Case(made, [fd.Fix("zmin")], [fd.Force("zmax", (0, 0, -force))])


@pytest.mark.matrix
@pytest.mark.parametrize("measure", ["largest_displacement", "strain"])
def test_what_nodes_reach_at_once_has_a_derivative_where_they_stay_alike(measure: str) -> None:
    with pytest.raises(InputError, match=TOP):
        fd.sensitivity(tower, {"stiffness": np.full(10, 0.15)}, measures=measure, analysis=PRESSED)
    twice = f"2 * {measure} + 0 * displacement[6,z]"
    with pytest.raises(InputError, match=TOP):
        fd.sensitivity(tower, {"stiffness": np.full(10, 0.15)}, measures=twice, analysis=PRESSED)
    alike = Design(tower, {"stiffness": 0.15, "thickness": 0.018}, [measure], PRESSED)
    assert max(alike.errors().values()) < 1e-5
    uneven = np.linspace(0.1, 0.2, 10)
    assert max(Design(tower, {"stiffness": uneven}, [measure], PRESSED).errors().values()) < 1e-5


@pytest.mark.matrix
def test_what_counts_for_nothing_may_tie() -> None:
    both = "displacement[6,z] + 0 * strain"
    found = fd.sensitivity(tower, {"stiffness": np.full(10, 0.15)}, measures=both, analysis=PRESSED)
    alone = fd.sensitivity(
        tower, {"stiffness": np.full(10, 0.15)}, measures="displacement[6,z]", analysis=PRESSED
    )
    assert found["gradient_stiffness"].values == pytest.approx(alone["gradient_stiffness"].values)


def test_a_sample_that_repeats_the_highest_displacement() -> None:
    """A node that a support has lifted stays at its highest place."""

    def lifted(height: float) -> fd.Case:
        pattern = fd.patterns.simple_fold(a=1.0, b=1.2, dihedral=120)
        made = fd.discretize(
            pattern, fd.Sheet(1e5, 0.25, 0.03, 400.0), crease_stiffness=0.5, preset="plate"
        )
        lift = fd.Impose([4, 5], "z", height, fd.Ramp(0.1))
        return fd.Case(made, [fd.Fix([0, 1, 2, 3]), lift])

    motion = {"kind": "dynamics", "method": "rk4", "dt": 1e-3, "duration": 0.3, "every_steps": 20}
    found = fd.sensitivity(lifted, {"height": 0.01}, measures="maximum[4,z]", analysis=motion)
    assert found["gradient_height"].item() == pytest.approx(1.0, rel=1e-9)


@pytest.mark.matrix
def test_the_strain_of_a_bar_that_hardly_stretches() -> None:
    """The shape changes it by far less than it changes the places of the bar's ends."""

    def folded(a: float, dihedral: float) -> fd.Case:
        pattern = fd.patterns.simple_fold(a=a, b=0.8, dihedral=dihedral)
        sheet = fd.Sheet(2e6, 0.25, 0.03, 1000.0)
        made = fd.discretize(pattern, sheet, scheme="n4b5", membrane="bars")
        return fd.Case(made, [fd.Fix([2, 3, 4, 5])], [fd.Force([0], (2e-4, 3e-4, 9e-3))])

    design = Design(folded, {"a": 1.1, "dihedral": 77.0}, ["strain"], PRESSED)
    design.step = 3e-3
    assert design.numbers({}) < 1e-6  # far below a step in the parameters
    assert max(design.errors().values()) < 1e-4


def near(gap: float, size: float = 1.0, tilt: float = 0.0) -> fd.Case:
    """A square above another, size 1, tilted."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    above = square * [0.5 * size, 0.5 * size, 0.0] + [0.2, 0.3, gap]
    above[2:, 2] += 0.3
    above[[1, 2], 2] += tilt
    pattern = fd.Pattern(np.vstack([square, above]), [(0, 1, 2, 3), (4, 5, 6, 7)])
    return fd.Case(
        fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"), [fd.Fix([0, 1, 3])]
    )


@pytest.mark.matrix
def test_panels_that_all_but_touch() -> None:
    """Differences of the distance itself would pass through 0."""
    found = fd.sensitivity(
        near, {"gap": 1e-6, "size": 1.3}, measures="clearance", analysis={"kind": "modes",
        "count": 3},
        sizes={"gap": 1.0},
    )  # fmt: skip
    assert found["gradient_gap"].item() == pytest.approx(1.0, rel=1e-9)
    assert found["gradient_size"].item() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.matrix
def test_panels_that_are_as_close_at_two_places() -> None:
    about = {"kind": "modes", "count": 3}
    found = fd.sensitivity(near, {"gap": 0.2, "size": 1.3}, measures="clearance", analysis=about)
    assert found["gradient_gap"].item() == pytest.approx(1.0, rel=1e-9)
    with pytest.raises(InputError, match=TOP):
        fd.sensitivity(
            near,
            {"gap": 0.2, "tilt": 0.0},
            measures="clearance",
            analysis=about,
            sizes={"tilt": 1.0},
        )


def test_lengths_to_which_bars_are_cut_are_no_part_of_some_measures() -> None:
    case = tower(np.linspace(0.1, 0.2, 10))
    cut = fd.discretize(case.structure.pattern, fd.Sheet(1.4e6, 0.3, 0.018, 900.0),
                        scheme="n4b5", membrane="bars")  # fmt: skip
    made = fd.Case(cut, case.supports, case.loads)
    for measure in ("strain", "strain_energy"):
        with pytest.raises(InputError, match=f"{measure}: has no derivative by bar_length"):
            fd.sensitivity(made, ["bar_length"], measures=measure, analysis=PRESSED)
    fd.sensitivity(
        made, ["bar_length", "fold_stiffness"], measures="displacement[6,z]", analysis=PRESSED
    )


@pytest.mark.matrix
def test_strain_energy_of_edges_that_lag_behind() -> None:
    pattern = fd.patterns.miura(dihedral=110)

    def build(force: float, beta: float) -> fd.Case:
        made = fd.discretize(pattern, fd.Sheet(1e5, 0.25, 0.03, 400.0), crease_stiffness=0.5,
                             preset="n5b8e")  # fmt: skip
        push = fd.Force("xmax", (0.0, 0.1 * force, force))
        return fd.Case(made, [fd.Fix("xmin")], [push], [fd.Rayleigh(0.2, beta)])

    motion = {"kind": "dynamics", "method": "newmark", "dt": 0.02, "duration": 0.2}
    still = Design(lambda force: build(force, 0.0), {"force": 0.3}, ["strain_energy"], motion)
    assert max(still.errors().values()) < 1e-6
    with pytest.raises(InputError, match=r"strain_energy: .*lag behind.*leave out beta"):
        fd.sensitivity(
            build, {"force": 0.3, "beta": 3e-3}, measures="strain_energy", analysis=motion
        )
