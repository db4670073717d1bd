"""Loads along a path: constant ones, actuated folds, adaptive loads, free bodies."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from sheets import compression, total_force
from trusses import APEX, VonMises, apex

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.statics import OrigamiProblem, trace

PAPER = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, 2.7)


def flat_miura(cells=(2, 2), dihedral=180.0, **model):
    pattern = fd.patterns.miura(cells=cells, a=0.03, b=0.03, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, PAPER, fold_law="linear", **model, preset="herkal")


def deployment(s, cells=(2, 2)):
    """Every fold actuated to its angle in the sheet folded to 90 degrees; held at six dofs."""
    folded = fd.patterns.miura(cells=cells, a=0.03, b=0.03, panel_angle=60, dihedral=90)
    goal = np.degrees(fd.discretize(folded, PAPER, preset="herkal").fold_rest)
    width = 2 * cells[1]
    corner = (2 * cells[0]) * (width + 1)
    supports = [fd.Fix([0], "xyz"), fd.Fix([width], "xz"), fd.Fix([corner], "z")]
    actuate = fd.Actuate(list(range(len(s.folds))), goal.tolist())
    return fd.Case(s, supports, [actuate]), goal, folded


@pytest.mark.parametrize("dihedral", [180.0, 170.0])
def test_flat_sheet_deploys(dihedral):
    """From flat to the folded Miura: no strain is left, and the shape is the pattern's."""
    s = flat_miura(dihedral=dihedral)
    case, goal, folded = deployment(s)
    path = trace(case, "displacement", steps=10)
    u = path.displacement.values[-1]
    np.testing.assert_allclose(np.degrees(s.dihedrals(u)[0]), goal, atol=1e-5)
    x = s.nodes + u
    got, wanted = (v[: len(folded.vertices)] for v in (x, folded.vertices))
    distances = [np.linalg.norm(v[:, None] - v[None], axis=2) for v in (got, wanted)]
    np.testing.assert_allclose(distances[0], distances[1], atol=1e-8)
    assert np.abs(path.reaction).max() < 1e-9  # held at six dofs it needs no force
    strain = sum(float(path[k][-1]) for k in ("strain_bars", "strain_folds", "strain_bends"))
    assert strain < 1e-12 * PAPER.youngs_modulus * PAPER.thickness**3


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
    truss = VonMises()
    case = fd.Case(
        truss.structure(),
        truss.case().supports,
        [fd.Force([APEX], (0, 0, -1.0)), fd.Force([APEX], (0, 0, -1.0))],
    )
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
    pattern = fd.patterns.miura(cells=(2, 2), a=0.03, b=0.03, panel_angle=60, dihedral=90)
    return fd.Case(fd.discretize(pattern, PAPER, preset="herkal"), [], loads)


def deformation(case, u):
    """Distances between all nodes: what rigid motions leave alone."""
    x = case.structure.nodes + u
    return np.linalg.norm(x[:, None] - x[None], axis=2)


def test_inertia_relief_balances_every_point():
    """Loads and inertia forces sum to zero in force and moment, also far from rest."""
    case = free_sheet([fd.Force([12], (0, 0, 0.05)), fd.Force([0], (0.02, 0, 0))])
    path = trace(case, steps=5, inertia_relief=True)
    problem = OrigamiProblem(case, inertia_relief=True)
    for step in (1, -1):
        u = path.displacement.values[step]
        force = problem.external(u.ravel(), float(path.load_factor[step])).reshape(-1, 3)
        x = case.structure.nodes + u
        assert np.abs(force.sum(axis=0)).max() < 1e-12
        assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13
        inside = case.structure.internal_force(u)
        np.testing.assert_allclose(inside, force, atol=1e-9)  # the pins carry nothing
    assert (
        np.abs(deformation(case, path.displacement.values[-1]) - deformation(case, 0)).max() > 1e-3
    )


def test_free_fall_is_no_load():
    fall = trace(free_sheet([fd.Gravity((0, 0, -9.81))]), steps=2, inertia_relief=True)
    assert np.abs(fall.displacement.values).max() < 1e-10


def test_inertia_relief_in_the_linear_limit():
    """K u = p - M R (R' M R)^-1 R' p, solved with the pseudo-inverse of the singular K."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.03, b=0.03, panel_angle=60, dihedral=90)
    s = fd.discretize(pattern, PAPER, bend_law="linear", fold_law="linear", preset="herkal")
    load = fd.Force([4], (0.0, 1e-7, 2e-7))
    path = trace(fd.Case(s, [], [load]), load_factors=[1.0], inertia_relief=True)
    n = len(s.nodes)
    mass = np.kron(s.mass.toarray(), np.eye(3))
    rigid = np.zeros((n, 3, 6))
    for axis in range(3):
        rigid[:, axis, axis] = 1.0
        rigid[:, :, 3 + axis] = np.cross(np.eye(3)[axis], s.nodes)
    rigid = rigid.reshape(3 * n, 6)
    p = np.zeros((n, 3))
    p[4] = load.vector
    p = p.ravel()
    p = p - mass @ rigid @ np.linalg.solve(rigid.T @ mass @ rigid, rigid.T @ p)
    stiffness = s.tangent(np.zeros((n, 3))).toarray()
    linear = (np.linalg.pinv(stiffness, rcond=1e-12) @ p).reshape(n, 3)
    rest = deformation(fd.Case(s), 0.0)
    expected = deformation(fd.Case(s), linear) - rest
    found = deformation(fd.Case(s), path.displacement.values[0]) - rest
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
