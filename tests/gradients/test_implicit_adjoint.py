"""Gradients through implicit motions, against differences of the motions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.dynamics import central_difference_adjoint, implicit_adjoint
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.generalized_alpha import Alpha
from foldyn.dynamics.implicit import matrix
from foldyn.dynamics.implicit_adjoint import Retraced
from foldyn.errors import InputError
from foldyn.gradients import sensitivity
from foldyn.gradients.neighbors import Asked, motions

FOLD = {"a": 1.0, "b": 1.3}
TIP = ["displacement[4,z]", "velocity[5,x]", "mean_square[4,z]"]
PULSE = fd.HalfSine(0.05)
METHODS = ("newmark", "generalized_alpha")
MOTION = {"kind": "dynamics", "duration": 0.06, "dt": 0.003, "every_steps": 2}


@pytest.fixture(autouse=True)
def _exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are solved to rounding: then differences show the gradient to more than 6 digits."""
    monkeypatch.setattr(Alpha, "tolerance", 1e-14)


def case(
    dihedral: float = 70.0, thickness: float = 0.05, force: float = 3.0, alpha: float = 2.0,
    beta: float = 1e-3, history: Any = PULSE, model: Any = "plate",
    extra: tuple[Any, ...] = (), damping: tuple[Any, ...] = (), pushed: tuple[int, ...] = (4, 5),
    **options: Any,
) -> fd.Case:  # fmt: skip
    """A fold with one side held, the other pushed."""
    pattern = fd.patterns.simple_fold(dihedral=dihedral, **FOLD)
    sheet = fd.Sheet(1e5, 0.25, thickness, 100.0)
    if model == "shell":
        made = fd.shell(pattern, sheet, divisions=2)
    else:
        given: dict[str, Any] = {"membrane": "bars"} | options
        made = fd.discretize(pattern, sheet, preset=model, **given)
    return fd.Case(
        made,
        [fd.Fix([0, 1, 2, 3]), *extra],
        [fd.Force(pushed, (0.2 * force, 0.1 * force, force), history=history)],
        [fd.Rayleigh(alpha, beta), *damping],
    )


def falling(force: float, **given: Any) -> fd.Case:
    """Pushed until it is let go."""
    return case(force=force, history=fd.Pulse(0.0314), **given)


def held_with(**given: Any) -> fd.Case:
    """With a spring, a dashpot that follows the motion, and damped creases."""
    extra = fd.Dashpot(3.0, between=[(0, 4)]), fd.Spring(30.0, between=[(1, 5)])
    return case(extra=extra, damping=(fd.CreaseDamping(0.3),), model="merlin2", beta=0.0, **given)


def shaken(way: float, **given: Any) -> fd.Case:
    """On a base that moves."""
    moved = fd.BaseMotion("z", value=way, history=fd.Harmonic(7.0, 0.3))
    return case(extra=(moved,), **given)


def imposed(way: float, **given: Any) -> fd.Case:
    """A corner is moved."""
    extra = (fd.Impose([5], "z", way, history=fd.Ramp(0.04, smooth=True)),)
    return case(extra=extra, pushed=(4,), **given)


def linked(**given: Any) -> fd.Case:
    """Corners that move alike."""
    return case(extra=(fd.Link([4, 5], "xz"),), **given)


def pulled(way: float, **given: Any) -> fd.Case:
    """Both corners are moved, one of them by the other."""
    moved = fd.Impose([5], "z", way, history=fd.Ramp(0.04, smooth=True))
    return case(extra=(fd.Link([4, 5], "z"), moved), pushed=(4,), **given)


def inclined(**given: Any) -> fd.Case:
    """A corner that slides along an inclined plane."""
    return case(extra=(fd.Fix([5], direction=(0.3, 0.5, 1.0)),), **given)


BASIC = {"dihedral": 72.0, "thickness": 0.051, "force": 2.9}
CASES = {
    "bars": (case, BASIC | {"alpha": 2.2, "beta": 1.1e-3}),
    "jump": (falling, BASIC),
    "dampers": (held_with, BASIC),
    "base": (shaken, BASIC | {"way": 0.05}),
    "imposed": (imposed, BASIC | {"way": 0.06}),
    "lumped": (lambda **g: shaken(mass="mixed_voronoi", **g), BASIC | {"alpha": 2.2, "way": 0.05}),
    "plates": (lambda **g: case(model="n5b8e", **g), BASIC | {"alpha": 2.2}),
    "panels": (lambda **g: case(membrane="panel", **g), {"force": 2.9, "alpha": 2.2}),
    "shell": (lambda **g: case(model="shell", **g), BASIC),
    "linked": (linked, BASIC | {"alpha": 2.2}),
    "inclined": (inclined, BASIC),
    "pulled": (pulled, BASIC | {"way": 0.02}),
}


ARRAYS = {
    "hinges": (case(), ["fold_stiffness", "fold_rest", "bend_stiffness", "bar_area"]),
    "lumped": (case(mass="mixed_voronoi"), ["node_mass", "bend_rest"]),
}


def measures_of(name: str) -> list[str]:
    """What is not given: a corner that is moved has a given motion."""
    given = {"imposed": ["displacement[4,z]", "velocity[4,x]"], "pulled": ["displacement[4,x]"]}
    return given.get(name, TIP)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("name", "method"), [(name, METHODS[k % 2]) for k, name in enumerate(CASES)]
)
def test_gradients_are_those_of_the_motion(name: str, method: str) -> None:
    build, values = CASES[name]
    errors = Design(build, values, measures_of(name), MOTION | {"method": method}).errors()
    assert max(errors.values()) < 1e-8, errors


@pytest.mark.matrix
@pytest.mark.parametrize(("build", "more"), [(shaken, {"way": 0.05}), (linked, {})])
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
def test_explicit_methods_go_through_a_consistent_mass(
    method: str, build: Any, more: dict[str, float]
) -> None:
    """Of supports that move, and of corners that are tied."""
    motion = {"kind": "dynamics", "duration": 2e-3, "method": method, "dt": 1e-4}
    measures = ["velocity[4,z]", "mean_square[4,x]"]
    errors = Design(build, {"dihedral": 72.0, "alpha": 2.2} | more, measures, motion).errors()
    assert max(errors.values()) < 1e-7, errors


@pytest.mark.matrix
@pytest.mark.parametrize("name", ["jump", "dampers", "lumped", "linked"])
def test_central_differences(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(central_difference_adjoint, "ROOM", 5e4)  # segments of some hundred steps
    build, values = CASES[name]
    motion = {"kind": "dynamics", "duration": 0.05, "method": "central_difference", "dt": 1e-4}
    errors = Design(build, values, TIP, motion | {"every_steps": 10}).errors()
    assert max(errors.values()) < 1e-6, errors


@pytest.mark.matrix
@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_of_a_case(name: str) -> None:
    made, names = ARRAYS[name]
    values = {one: getattr(made.structure, one) for one in names if one != "node_mass"}
    if "node_mass" in names:
        values["node_mass"] = made.structure.mass.sum(axis=1)

    def build(**arrays: Any) -> fd.Case:
        return replace(made, structure=replace(made.structure, **arrays))

    errors = Design(build, values, TIP, MOTION | {"method": "generalized_alpha"}).errors()
    assert max(errors.values()) < 1e-8, errors


@pytest.mark.matrix
@pytest.mark.parametrize("name", ["bars", "dampers", "plates", "base"])
def test_remainders_fall_with_the_second_order(name: str) -> None:
    build, values = CASES[name]
    design = Design(build, values, measures_of(name), MOTION | {"method": METHODS[len(name) % 2]})
    assert (design.order(len(name)) > 1.9).all()


@pytest.mark.matrix
def test_a_start_with_velocity_and_segments_that_are_taken_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    moving = fd.State(np.zeros((8, 3)), np.outer(np.arange(8.0) // 4, [0.1, 0.2, 0.3]))
    motion = MOTION | {"method": "generalized_alpha", "spectral_radius": 0.3, "initial": moving}
    design = Design(case, BASIC, TIP, motion)
    assert max(design.errors().values()) < 1e-8
    whole = design.gradient()
    monkeypatch.setattr(implicit_adjoint, "ROOM", 3 * 8 * 18 * 3)  # three steps
    parts = design.gradient()
    for name, value in whole.items():
        assert np.array_equal(parts[name], value)


def test_steps_taken_again_are_those_of_the_motion_to_the_bit() -> None:
    made, given = falling(3.0), {"duration": 0.06, "dt": 0.003}
    for method in METHODS:
        motion = prepare(made, method=method, **given)
        found = fd.simulate(made, method=method, **given)
        taken = [
            one for one in Retraced(motion).back(0, 20) if one.end.t == (one.number + 1) * 0.003
        ]
        assert len(taken) > 15
        for one in taken:
            sample = found["displacement"].values[one.number + 1]
            assert np.array_equal(motion.packed.numbering.outward(one.end.q), sample)


@pytest.mark.matrix
def test_gradient_of_what_was_computed_with_the_usual_tolerance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.undo()
    design = Design(case, BASIC, TIP, MOTION | {"method": "newmark"})
    assert max(design.errors().values()) < 1e-4  # differences show the tolerance of steps


REMEDY = "take rk4, central_difference, newmark or generalized_alpha"
WRONG = {
    "energy_momentum": (case, {"method": "energy_momentum"}, REMEDY),
    "dormand_prince": (case, {"method": "dormand_prince"}, REMEDY),
    "steps by error": (case, {"tolerance": 1e-4}, "give dt, and no tolerance"),
    "no dt": (case, {"dt": None}, "give dt"),
    "contact": (
        lambda **g: replace(case(**g), contact=fd.Contact()), {}, "contact.*fd.sweep",
    ),
    "actuated": (
        lambda force: replace(case(), loads=[fd.Actuate(0, force, history=fd.Ramp(1.0))]), {},
        "Actuate.*leave that out",
    ),
    "turns at once": (lambda **g: falling(model="n5b8e", **g), {}, "fd.Ramp"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_has_no_gradient_names_a_remedy(name: str) -> None:
    build, changed, remedy = WRONG[name]
    analysis = MOTION | {"method": "newmark"} | changed
    with pytest.raises(InputError, match=remedy):
        sensitivity(build, {"force": 2.9}, measures=TIP[0], analysis=analysis)


def test_a_motion_that_goes_on_with_what_another_knew_is_refused() -> None:
    before = fd.simulate(case(), 0.03, method="newmark", dt=0.003)
    analysis = MOTION | {"method": "newmark", "initial": fd.initial_state(before), "start": 0.03}
    with pytest.raises(InputError, match=r"analysis\.initial.*fd\.State"):
        sensitivity(case, {"force": 2.9}, measures=TIP[0], analysis=analysis)


# ------------------------------------------------------------------ motions beside one
def blown(pressure: float, **given: Any) -> fd.Case:
    """Under a pressure that follows the panels."""
    made = case(**given)
    return replace(made, loads=[*made.loads, fd.Pressure(pressure, history=PULSE)])


BESIDE = CASES | {"blown": (blown, BASIC | {"pressure": 2.0})}


def compare_beside(name: str, method: str, least: float = 2e-6) -> None:
    """Motions found along another one with those that their cases have on their own."""
    build, values = BESIDE[name]
    given = {key: value for key, value in MOTION.items() if key != "kind"} | {"method": method}
    one = build(**values)
    others = [build(**values | {key: 1.0001 * value}) for key, value in values.items()]
    motion = prepare(one, **given)
    found = motions(motion, Asked(one, given), [Asked(each, given) for each in others], 1e-7)
    first = fd.simulate(one, **given)["displacement"].values
    np.testing.assert_array_equal(motion.output.first(motion.stored)[0].displacement, first)
    for other, beside in zip(others, found, strict=True):
        own = fd.simulate(other, **given)["displacement"].values
        apart = np.abs(own - first).max()
        assert apart > 1e-9
        np.testing.assert_allclose(beside, own, 0.0, least * apart)


@pytest.mark.parametrize(
    ("name", "method"), [(name, METHODS[k % 2]) for k, name in enumerate(BESIDE)]
)
def test_motions_beside_one_are_those_of_their_cases(name: str, method: str) -> None:
    compare_beside(name, method)


def test_motions_beside_one_without_a_band(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matrix, "takes_band", lambda *_: False)
    compare_beside("imposed", "generalized_alpha")


def test_what_has_no_motions_beside_it() -> None:
    given = {"duration": 0.06, "dt": 0.003, "method": "newmark"}
    folded = case()
    turned = replace(folded, loads=[fd.Actuate([0], angle=80, history=fd.Ramp(0.05))])
    touching = replace(folded, contact=fd.Contact(thickness=0.01))
    for made, other in ((turned, {}), (touching, {}), (folded, {"method": "energy_momentum"})):
        asked = Asked(made, given | other)
        with pytest.raises(InputError, match="no neighbor"):
            motions(prepare(made, **asked.arguments), asked, [asked], 1e-4)
    coarse = Asked(folded, given | {"dt": 0.006})
    with pytest.raises(InputError, match="other steps"):
        motions(prepare(folded, **given), Asked(folded, given), [coarse], 1e-4)


def test_what_changes_a_constraint_has_no_gradient() -> None:
    def tilted(tilt: float) -> fd.Case:
        return case(extra=(fd.Fix([5], direction=(tilt, 0.5, 1.0)),))

    with pytest.raises(InputError, match=r"changes numbers of the case \(constraints\)"):
        sensitivity(
            tilted,
            {"tilt": 0.3},
            measures="displacement[4,z]",
            analysis=MOTION | {"method": "newmark"},
        )
