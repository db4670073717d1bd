"""Gradients of frequency responses, against differences of the responses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import InputError
from pairwise import beyond

AT = ["response[4,z,3]", "response[5,x,7]", "peak_height[4,z]", "peak_frequency[4,z]"]
FREQUENCIES = np.arange(1.0, 8.0, 0.25)
PUSH = {"kind": "frf", "drive": [fd.Force([4, 5], (0.2, 0.0, 1.0))], "frequencies": FREQUENCIES}
SHAKE = PUSH | {"drive": fd.BaseMotion("z")}
LOADED = PUSH | {"state": "equilibrium"}


def case(
    dihedral: float = 70.0, thickness: float = 0.05, alpha: float = 4.0, beta: float = 1e-3,
    force: float = 0.0, model: Any = "plate", state: str = "rest", **options: Any,
) -> fd.Case:  # fmt: skip
    """A fold with one side held."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=dihedral)
    sheet = fd.Sheet(1e8, 0.25, thickness, 100.0)
    if model == "shell":
        made = fd.shell(pattern, sheet, divisions=2)
    else:
        given: dict[str, Any] = {"membrane": "bars"} | options
        made = fd.discretize(pattern, sheet, preset=model, **given)
    loads = [fd.Force([4, 5], (0.0, 0.0, force))] if force else []
    return fd.Case(made, [fd.Fix([0, 1, 2, 3])], loads, fd.Rayleigh(alpha, beta, state))


BASIC = {"dihedral": 72.0, "thickness": 0.0505, "alpha": 4.1, "beta": 1.1e-3}
CASES = {
    "pushed": (case, BASIC, PUSH),
    "modal": (case, BASIC, PUSH | {"method": "modal"}),
    "shaken": (case, BASIC, SHAKE),
    "membranes": (partial(case, membrane="panel"), BASIC, SHAKE),
    "loaded": (case, BASIC | {"force": 12.0}, LOADED),
    "damped there": (partial(case, state="initial"), BASIC | {"force": 12.0}, LOADED),
    "plates": (partial(case, model="n5b8e"), BASIC, PUSH),
    "shell": (partial(case, model="shell"), BASIC, SHAKE),
}


def check(design: Design) -> None:
    """To 1e-6, beside what differences of responses have of their rounding."""
    rounding = 1e-8 * np.abs(design.numbers({}))
    for direction in design.directions():
        expected, (name,) = design.difference(direction), direction
        assert (np.abs(expected) > 10.0 * rounding).any(), f"{name} changes nothing"
        wrong = np.abs(design.along(direction) - expected)
        assert (wrong <= 1e-6 * np.abs(expected) + rounding).all(), name


@pytest.mark.matrix
@pytest.mark.parametrize("name", [*list(CASES)[::2], *beyond(list(CASES)[1::2], 2)])
def test_gradients_are_those_of_the_response(name: str) -> None:
    build, values, analysis = CASES[name]
    check(Design(build, values, AT, analysis))


@pytest.mark.matrix
@pytest.mark.parametrize("analysis", [PUSH, SHAKE], ids=["force", "base"])
def test_arrays_of_a_case(analysis: dict[str, Any]) -> None:
    made = case(mass="mixed_voronoi")
    names = ("fold_stiffness", "bend_stiffness", "bar_area")
    values = {name: getattr(made.structure, name) for name in names}
    values["node_mass"] = made.structure.mass.sum(axis=1)

    def build(**arrays: Any) -> fd.Case:
        return replace(made, structure=replace(made.structure, **arrays))

    check(Design(build, values, AT[:3:2], analysis))


@pytest.mark.matrix
@pytest.mark.parametrize("name", ["pushed", "shaken", "damped there"])
def test_remainders_fall_with_the_second_order(name: str) -> None:
    build, values, analysis = CASES[name]
    assert (Design(build, values, AT[:3], analysis).order(len(name)) > 1.9).all()


@pytest.mark.matrix
def test_a_magnitude_of_all_axes_and_an_own_number() -> None:
    """The mean square over all frequencies, as a function of the result with its derivative."""

    def square(result: Any, case: fd.Case) -> float:
        return float((np.abs(result["receptance"].values[:, 4]) ** 2).sum())

    def derivative(result: Any, case: fd.Case) -> dict[str, Any]:
        out = np.zeros_like(result["receptance"].values)
        out[:, 4] = 2.0 * result["receptance"].values[:, 4].conj()
        return {"receptance": out}

    found = fd.sensitivity(
        case, {"alpha": 4.1}, measures={"square": (square, derivative)}, analysis=PUSH
    )
    near, far = (
        square(fd.frf(case(alpha=4.1 + h), PUSH["drive"], frequencies=FREQUENCIES), case())
        - square(fd.frf(case(alpha=4.1 - h), PUSH["drive"], frequencies=FREQUENCIES), case())
        for h in (2e-3, 4e-3)
    )
    expected = (8.0 * near - far) / (12.0 * 2e-3)
    assert found["gradient_alpha"].values[0] == pytest.approx(expected, rel=1e-7)
    errors = Design(case, {"thickness": 0.0505}, ["peak_height[4]"], PUSH).errors()
    assert max(errors.values()) < 1e-6


def damped(**given: Any) -> fd.Case:
    return replace(case(**given), damping=fd.ModalDamping([0.02, 0.03]))


def with_a_rigid_panel(shift: float) -> fd.Case:
    """Of a shape, which says how its corners move with each other."""
    far = 2.0 + 2.0 * shift
    points = [
        (0, 0, 0),
        (1, 0, 0),
        (1 + shift, 1, 0),
        (0, 1, 0),
        (2, 0, 0.5),
        (far, 1, 0.5 + 0.5 * shift),
    ]
    pattern = fd.Pattern(points, [(0, 1, 2, 3), (1, 4, 5, 2)])
    sheet = fd.Sheet(1e6, 0.25, 0.02, 900.0)
    return fd.Case(fd.discretize(pattern, sheet, rigid=[1], preset="plate"), [fd.Fix([0, 1, 3])])


def test_a_design_that_changes_what_constraints_tie_is_refused() -> None:
    drive = {"drive": fd.Force([4], (0.0, 0.0, 1.0))}
    with pytest.raises(InputError, match=r"constraints.*fd\.sweep"):
        fd.sensitivity(
            with_a_rigid_panel, {"shift": 0.31}, measures="response[4,z,3]", analysis=PUSH | drive
        )
    made = with_a_rigid_panel(0.31)
    found = fd.sensitivity(
        made, ["fold_stiffness"], measures="response[4,z,3]", analysis=PUSH | drive
    )
    assert np.isfinite(found["gradient_fold_stiffness"]).all()


WRONG = {
    "some modes": (case, {"method": "modal", "count": 3}, AT[0], "choose direct"),
    "harmonic": (case, {"method": "harmonic"}, AT[0], "choose direct"),
    "ratios": (damped, {}, AT[0], "Rayleigh.from_ratios"),
    "slopes": (case, {"secant": 2.0}, AT[0], "secant.*fd.sweep"),
    "no peak": (case, {"frequencies": [0.1, 0.2, 0.3, 0.4]}, AT[3], "finite value|take others"),
    "elsewhere": (case, {}, "response[4,z,90]", "from 1 to 7.75 Hz"),
    "held": (case, {}, "response[0,z,3]", "no derivative"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_has_no_gradient_names_a_remedy(name: str) -> None:
    build, changed, measure, remedy = WRONG[name]
    parameter = {"thickness": 0.0505} if name == "ratios" else {"alpha": 4.1}
    with pytest.raises(InputError, match=remedy):
        fd.sensitivity(build, parameter, measures=measure, analysis=PUSH | changed)
