"""Loads along a path: constant ones, actuated folds, adaptive loads, free bodies."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from sheets import compression, total_force
from trusses import APEX, VonMises, apex

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.statics import OrigamiProblem, trace

PAPER = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, 2.7)


def flat_miura(cells=(2, 2), dihedral=180.0, **model):
    pattern = fd.patterns.miura(cells=cells, a=0.03, b=0.03, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, PAPER, fold_law="linear", **model, preset="herkal")


@pytest.mark.parametrize("dihedral", [180.0, 170.0])
def test_flat_sheet_deploys(dihedral):
    """From flat to the folded Miura: no strain is left, and the shape is the pattern's.

    Every fold is actuated to its angle in the sheet folded to 90 degrees; held at six dofs.
    """
    s, folded = flat_miura(dihedral=dihedral), flat_miura(dihedral=90).pattern
    goal = np.degrees(folded.dihedrals)
    supports = [fd.Fix([0], "xyz"), fd.Fix([4], "xz"), fd.Fix([20], "z")]
    case = fd.Case(s, supports, [fd.Actuate(range(len(s.folds)), goal)])
    path = trace(case, "displacement", steps=10)
    u = path.displacement.values[-1]
    np.testing.assert_allclose(np.degrees(s.dihedrals(u)[0]), goal, atol=1e-5)
    moved = (s.nodes + u)[: len(folded.vertices)]
    np.testing.assert_allclose(pdist(moved), pdist(folded.vertices), atol=1e-8)
    assert np.abs(path.reaction).max() < 1e-9  # held at six dofs it needs no force
    strain = sum(float(path[k][-1]) for k in ("strain_bars", "strain_folds", "strain_bends"))
    assert strain < 1e-12 * PAPER.youngs_modulus * PAPER.thickness**3


@pytest.mark.matrix
def test_actuators_do_the_work():
    """Against a held edge the sheet stores energy: what the actuators put in, to second order."""
    s = flat_miura((1, 1), 150.0)
    supports = [fd.Fix("xmin", "xyz"), fd.Fix("xmax", "x"), fd.Fix([6], "z")]
    case = fd.Case(s, supports, [fd.Actuate("all", 90 + 90 * (s.fold_rest > np.pi) * 2)])
    errors, counts = [], np.array([8, 16, 32])
    for steps in counts:
        path = trace(case, "displacement", steps=int(steps))
        energy = path.strain_bars + path.strain_folds + path.strain_bends
        errors.append(float(path.work[-1] - energy[-1]))
    assert float(energy[-1]) > 1e-6
    assert abs(errors[-1]) < 1e-3 * float(energy[-1])
    assert fd.checks.observed_order(1.0 / counts, errors) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("constant", [(), (0,)])
def test_work_counts_from_rest(constant):
    """Wherever a path begins, its work is what has been stored since rest."""
    s = flat_miura((1, 1), 150.0, bend_law="linear")
    supports = [fd.Fix([0], "xyz"), fd.Fix([2], "xz"), fd.Fix([6], "z")]
    loads = [fd.Force([8], (0, 0, 2e-4)), fd.Force([8], (1e-4, 0, 0))]
    case = fd.Case(s, supports, loads)
    for factors in ([0.0, 0.3, 0.6], [0.3, 0.6], [0.6]):
        path = trace(case, load_factors=factors, constant=constant)
        stored = path.strain_bars + path.strain_folds + path.strain_bends
        assert float(stored[-1]) > 1e-10
        np.testing.assert_allclose(path.work, stored, rtol=0.05, atol=1e-15)  # trapezoids
        assert float(path.work[0]) == pytest.approx(float(stored[0]), rel=1e-9)
    again = trace(case, load_factors=[0.6, 0.7], initial=fd.initial_state(path))
    assert float(again.work[0]) == 0.0  # since the state from which it was started


def test_actuation_with_a_force():
    """The factor moves the rest angles and the force together."""
    s = flat_miura((1, 1), 150.0)
    supports = [fd.Fix([0], "xyz"), fd.Fix([2], "xz"), fd.Fix([6], "z")]
    flatter = 180.0 + 0.5 * (np.degrees(s.fold_rest) - 180.0)
    loads = [fd.Actuate([0, 1, 2, 3], flatter), fd.Force([8], (0, 0, 1e-4))]
    path = trace(fd.Case(s, supports, loads), load_factors=[1.0])
    plain = trace(fd.Case(s, supports, loads[:1]), load_factors=[1.0])
    loaded = trace(fd.Case(s, supports, loads), load_factors=[1.0], constant=[1])
    np.testing.assert_allclose(path.displacement, loaded.displacement, atol=1e-10)
    assert np.abs(path.displacement - plain.displacement).max() > 1e-6


def test_constant_weight_acts_at_factor_zero():
    case = compression(weight=True)
    path = trace(case, "displacement", steps=2, constant="gravity")
    assert total_force(path)[0] == pytest.approx(-0.0207, abs=1e-4)  # half the weight hangs there
    growing = trace(case, "displacement", steps=2)
    assert total_force(growing)[0] == 0.0
    np.testing.assert_allclose(growing.displacement[-1], path.displacement[-1], atol=1e-9)


def test_constant_and_growing_loads_add_up():
    truss, push = VonMises(), fd.Force([APEX], (0, 0, -1.0))
    case = truss.case().altered(loads=[push, push])
    path = trace(case, load_factors=[0.0, 1.0, 2.0], constant=[0])
    np.testing.assert_allclose(truss.load(-apex(path)), [1.0, 2.0, 3.0], rtol=1e-8)
    alone = trace(case, load_factors=[0.0], constant=[0, 1])
    np.testing.assert_allclose(truss.load(-apex(alone)), [2.0], rtol=1e-8)


def test_adaptive_load_is_in_equilibrium():
    """A load that grows with the displacement, P = c v: a spring that pushes."""
    truss, c = VonMises(), 20.0
    case = fd.Case(truss.structure(), truss.case().supports)

    def push(u, factor):
        forces = np.zeros_like(u)
        forces[APEX, 2] = -factor * (1.0 - c * u[APEX, 2])
        return forces

    path = trace(case, load_factors=[0.5, 1.0], adaptive_load=push)
    v = -apex(path)
    np.testing.assert_allclose(truss.load(v), [0.5, 1.0] * (1.0 + c * v), rtol=1e-8)
    assert path.attrs["rerunnable"] == 0
    assert "adaptive load" in path.attrs["not_rerunnable_because"]
    with pytest.raises(fd.errors.InputError, match=r"shape \(3,\)"):
        trace(case, load_factors=[1.0], adaptive_load=lambda u, factor: np.zeros(3))


def free_sheet(loads):
    return fd.Case(flat_miura(dihedral=90), [], loads)


def test_inertia_relief_balances_every_point():
    """Loads and inertia forces sum to zero in force and moment, also far from rest."""
    case = free_sheet([fd.Force([12], (0, 0, 0.05)), fd.Force([0], (0.02, 0, 0))])
    path = trace(case, steps=5, inertia_relief=True)
    problem, s = OrigamiProblem(case, inertia_relief=True), case.structure
    for step in (1, -1):
        u = path.displacement.values[step]
        force = problem.external(u.ravel(), float(path.load_factor[step])).reshape(-1, 3)
        assert np.abs(force.sum(axis=0)).max() < 1e-12
        assert np.abs(np.cross(s.nodes + u, force).sum(axis=0)).max() < 1e-13
        np.testing.assert_allclose(s.internal_force(u), force, atol=1e-9)  # pins carry nothing
    assert np.abs(pdist(s.nodes + u) - pdist(s.nodes)).max() > 1e-3
    fall = trace(free_sheet([fd.Gravity((0, 0, -9.81))]), steps=2, inertia_relief=True)
    assert np.abs(fall.displacement.values).max() < 1e-10  # free fall is no load


def test_inertia_relief_in_the_linear_limit():
    """K u = p - M R (R' M R)^-1 R' p, solved with the pseudo-inverse of the singular K."""
    s = flat_miura((1, 1), 90, bend_law="linear")
    p, x = np.zeros(s.nodes.shape), s.nodes
    p[4] = 0.0, 1e-7, 2e-7
    path = trace(fd.Case(s, [], [fd.Force([4], p[4])]), load_factors=[1.0], inertia_relief=True)
    mass, axes = np.kron(s.mass.toarray(), np.eye(3)), np.eye(3)
    rigid = np.stack([np.tile(a, len(x)) for a in axes] + [np.cross(a, x).ravel() for a in axes], 1)
    p = p.ravel()
    p = p - mass @ rigid @ np.linalg.solve(rigid.T @ mass @ rigid, rigid.T @ p)
    stiffness = s.tangent(0.0 * x).toarray()
    linear = (np.linalg.pinv(stiffness, rcond=1e-12) @ p).reshape(-1, 3)
    found, expected = (pdist(x + u) - pdist(x) for u in (path.displacement.values[0], linear))
    assert np.abs(expected).max() > 1e-9
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())


def test_a_problem_takes_its_case_as_it_is_checked(monkeypatch):
    """Loads are told apart without making the case again: nothing is tied or told twice."""
    s = flat_miura(dihedral=150.0)
    supports = [fd.Fix("xmin"), fd.Link("xmax", "x")]
    loads = [fd.Force([0, 24], (1.0, 0, 0)), fd.Gravity("-z"), fd.Pressure(1e-3)]
    with pytest.warns(FoldynWarning, match="acts in part where supports hold"):
        case = fd.Case(s, supports, loads)
    ties = case.constraints
    monkeypatch.setattr("foldyn.cases.case_assembly.equations_of", None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = OrigamiProblem(case, (1,))
    push, weight = loads[0].forces(s, ""), loads[1].weight(s.nodal_mass)
    np.testing.assert_array_equal(problem.growing, ties.force(push.ravel()))
    np.testing.assert_array_equal(problem.constant, ties.force(weight.ravel()))
    rest = np.zeros(s.nodes.size)
    assert not problem.following_force(rest, 0.0).any()  # the pressure grows with the factor
    assert problem.following_force(rest, 1.0).any()
