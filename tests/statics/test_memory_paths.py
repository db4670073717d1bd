"""Equilibria of structures whose laws have memory: relaxed, or yielding along the path."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn import checks
from foldyn.structures.inelastic_hinges import memory
from one_hinge import STIFFNESS, WING, moment, one_hinge, opened

LIMIT, HARD = 2e-3, 5e-3  # N m and N m/rad of a hinge 1 m long
KINEMATIC = fd.Plastic(LIMIT, kinematic=HARD, law="linear")


def cycled(law, factors, turn=0.3):
    """Path of the hinge, turned by an imposed motion of its wing."""
    moved = fd.Impose([WING], "z", np.tan(turn))
    return fd.statics.trace(
        one_hinge(law, [moved], hold=False), "displacement", load_factors=factors
    )


def test_paths_have_the_long_time_stiffness():
    """They are those of the elastic part, and end relaxed."""
    factors = [0.5, 1.0]
    path = cycled(fd.Prony([0.5, 0.2], [0.1, 1.0], law="linear"), factors)
    plain = cycled("linear", factors)
    np.testing.assert_array_equal(path.reaction, plain.reaction)
    assert path.memory.shape == (len(path.step), 2, 2)
    assert not path.memory.any()
    start = fd.initial_state(path)
    held = one_hinge(path_law := fd.Prony([0.5, 0.2], [0.1, 1.0], law="linear"))
    found = fd.simulate(held, 0.1, method="rk4", dt=0.01, initial=start)
    assert path_law.relaxes
    np.testing.assert_allclose(moment(found), STIFFNESS * opened(path)[-1], rtol=1e-12)


def yielding(theta):
    """Moment where a hinge is loaded for the first time."""
    slope, first = STIFFNESS * HARD / (STIFFNESS + HARD), LIMIT / STIFFNESS
    return np.where(theta < first, STIFFNESS * theta, LIMIT + slope * (theta - first))


@pytest.mark.parametrize("hardening", ["isotropic", "kinematic"])
def test_a_yielding_path_follows_the_law(hardening):
    """M = k (theta - p) with the plastic turn of the formula; work is stored or dissipated."""
    law = fd.Plastic(LIMIT, **{hardening: HARD}, law="linear")
    way = np.linspace(0.0, 1.0, 61)
    path = cycled(law, [*way, *(1.0 - 2.0 * way[1:])])
    theta, found = opened(path), moment(path)
    top = int(np.argmax(theta))
    np.testing.assert_allclose(found[: top + 1], yielding(theta)[: top + 1], rtol=1e-7)
    plastic = theta[top] - found[top] / STIFFNESS
    lost = LIMIT * plastic + (0.5 * HARD * plastic**2 if hardening == "isotropic" else 0.0)
    assert float(path.dissipated[top]) == pytest.approx(lost, rel=1e-7)
    np.testing.assert_allclose(abs(path.memory[top, 0]), plastic, rtol=1e-7)
    stored = path.strain_folds.values + path.dissipated.values
    work = np.append(0.0, np.cumsum(0.5 * (found[1:] + found[:-1]) * np.diff(theta)))
    np.testing.assert_allclose(work, stored, rtol=0, atol=2e-3 * work.max())  # trapezoids


def test_a_path_that_begins_after_yielding_knows_what_was_lost():
    """Work and dissipation count from rest, also where the first point has yielded already."""
    law = fd.Plastic(LIMIT, isotropic=HARD, law="linear")
    whole, late = cycled(law, [0.0, 0.8, 1.0]), cycled(law, [0.8, 1.0])
    assert float(late.dissipated[0]) > 0.0
    np.testing.assert_allclose(late.dissipated, whole.dissipated[1:], rtol=1e-9)
    begun = float(late.strain_folds[0] + late.dissipated[0])
    assert float(late.work[0]) == pytest.approx(begun, rel=1e-9)


@pytest.mark.parametrize("method", ["mgdcm", "arc_length"])
def test_methods_with_a_free_factor_follow_the_law(method):
    """The moment at each point is that of the formula, and so is the end."""
    case = one_hinge(KINEMATIC, [fd.Impose([WING], "z", np.tan(0.3))], hold=False)
    path = fd.statics.trace(case, method, load_factors=[0.0, 1.0], first_step=0.02)
    theta, found = opened(path), moment(path)
    np.testing.assert_allclose(found, yielding(theta), rtol=1e-7, atol=1e-12)
    plastic = theta[-1] - found[-1] / STIFFNESS
    assert float(path.dissipated[-1]) == pytest.approx(LIMIT * plastic, rel=1e-7)


def test_a_path_goes_on_from_a_stored_point():
    whole = cycled(KINEMATIC, [1.0, 0.0])
    case = one_hinge(KINEMATIC, [fd.Impose([WING], "z", np.tan(0.3))], hold=False)
    at = int(np.flatnonzero(opened(whole) > 0.3 - 1e-9)[0])
    state = fd.initial_state(whole, at)
    again = fd.statics.trace(case, "displacement", load_factors=[1.0, 0.0], initial=state)
    assert moment(again)[-1] == pytest.approx(moment(whole)[-1], rel=1e-9)
    fresh = fd.State(state.displacement)
    forgotten = fd.statics.trace(case, "displacement", load_factors=[1.0, 0.0], initial=fresh)
    assert moment(forgotten)[-1] == pytest.approx(moment(whole)[-1], rel=1e-6)


def test_a_sheet_yields_and_springs_back():
    """A fold bent beyond its yield moment keeps a part of the turn without load."""
    pattern, sheet = fd.patterns.simple_fold(1.0, 1.0, dihedral=120), fd.Sheet(1e6, 0.25, 0.01)
    structure = fd.discretize(
        pattern, sheet, fold_law=fd.Plastic(1e-3, kinematic=0.002), preset="plate"
    )
    push = fd.Force([0, 1], (5.2e-3, 0, 0))
    case = fd.Case(structure, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")], [push])
    path = fd.statics.trace(case, "newton", load_factors=[0.5, 1.0, 0.5, 0.0])
    fold = [structure.dihedrals(u)[0][0] for u in path.displacement.values]
    rest = structure.fold_rest[0]
    assert abs(fold[-1] - rest) > 0.02
    assert abs(fold[-1] - rest) < abs(fold[2] - rest)
    assert float(path.dissipated[-1]) > 0.0


@pytest.mark.parametrize(
    "law",
    [fd.Prony([0.5, 0.2], [0.1, 1.0]), fd.Plastic(1e-7, 0.01, 0.02), fd.Eyring(1e-3, 1e-3)],
    ids=lambda law: law.name,
)
@pytest.mark.parametrize("options", [{"scheme": "n5b8"}, {"scheme": "n5b8e"}, {"divisions": 2}])
def test_tangents_of_bodies_with_memory_are_exact(law, options):
    """Where hinges yield and flow within the step, dofs without mass included."""
    build = fd.shell if "divisions" in options else fd.discretize
    pattern = fd.patterns.miura((1, 1), 0.1, b=0.1, dihedral=120)
    structure = build(pattern, fd.Sheet(1e6, 0.3, 1e-3, 1.0), fold_law=law, **options)
    body = structure.body
    branches = memory(fd.Case(structure).remembering, body)
    whole = body.with_terms(branches)
    random = np.random.default_rng(3)
    q0, q1 = 3e-3 * random.normal(size=(2, body.size))
    branches.start(q0)
    branches.own.elapsed[0] = 0.1
    assert checks.tangent_error(whole.internal, whole.tangent, at=q1, size=1e-3) < 1e-7
    assert np.abs(branches.own.moment).min() > 0.0


def test_folds_are_actuated_beside_bends_that_may_yield():
    """Bends that do not yield are elastic, and the way is that of elastic ones."""
    sheet, pattern = fd.Sheet(1e6, 0.25, 0.01, 1.0), fd.patterns.simple_fold(dihedral=120)
    ends = []
    for law in ("linear", fd.Plastic(yield_moment=1e3, law="linear")):
        structure = fd.discretize(pattern, sheet, fold_law="linear", bend_law=law)
        case = fd.Case(structure, [fd.Fix([0, 1, 4])], [fd.Actuate([0], 150)])
        ends.append(fd.trace(case, method="newton", steps=4).displacement.values[-1])
    assert np.abs(ends[0]).max() > 0.1 * pattern.size
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12 * pattern.size)
