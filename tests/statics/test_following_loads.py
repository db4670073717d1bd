"""Pressure and crease moments in equilibrium, against formulas, for both models."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.following import asymmetry
from foldyn.statics import OrigamiProblem, landscape

pytestmark = pytest.mark.filterwarnings("ignore:.*has no potential")
E, T, P = 1e6, 0.01, 20.0
K = 0.0005  # N m/rad, of a crease far softer than its panels
BOX = fd.Pattern(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)
PAIR = fd.Pattern(
    [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]], {(1, 4): "V"}
)
STRIP = fd.Pattern([[0, 0], [1, 0], [1, 0.25], [0, 0.25]], [[0, 1, 2, 3]])


SOFT = fd.Sheet(E, 0.25, T, 1.0)


def bars(pattern, sheet=SOFT, **more):
    laws = {"fold_law": "linear", "bend_law": "linear", "mass": "centroid"}
    return fd.discretize(pattern, sheet, **laws, preset="herkal", **more)


def shell(pattern, sheet=SOFT, divisions=3, **more):
    return fd.shell(pattern, sheet, divisions=divisions, fold_law="linear", **more)


MODELS = [bars, shell]


def where(s, x):
    return np.flatnonzero(np.abs(s.nodes[:, 0] - x) < 1e-9).tolist()


def turned(s, path):
    """Angle by which the free panel of `PAIR` has turned, from its far edge."""
    x = s.nodes[2] + path.displacement.values[-1, 2]
    return float(np.arctan2(x[2], x[0] - 1.0))


def half_held(s):
    return [fd.Fix(np.flatnonzero(s.nodes[:, 0] < 1.0 + 1e-9).tolist(), "xyz")]


def problem_and_state(case, seed=0):
    problem = OrigamiProblem(case)
    u = 0.05 * np.random.default_rng(seed).standard_normal(len(problem.start()))
    u[problem.held] = 0.0
    return problem, u


@pytest.mark.parametrize("make", MODELS)
def test_a_closed_body_is_pushed_nowhere_and_its_pressure_has_a_potential(make) -> None:
    s = make(BOX)
    problem, u = problem_and_state(fd.Case(s, loads=[fd.Pressure(P)]))
    force = problem.external(u, 1.0)[: s.nodes.size].reshape(-1, 3)
    x = s.nodes + problem.displacement(u)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * P
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * P
    assert asymmetry(problem.load_stiffness(u, 1.0)) < 1e-14

    def volume(q):
        corners = (s.nodes + problem.displacement(q))[s.triangles]
        return np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0

    along, h = np.random.default_rng(1).standard_normal(u.size), 1e-5
    slope = (volume(u + h * along) - volume(u - h * along)) / (2.0 * h)
    assert problem.external(u, 1.0) @ along == pytest.approx(P * slope, rel=1e-8)


def test_a_held_rim_makes_the_stiffness_of_a_pressure_symmetric() -> None:
    s = shell(STRIP)
    rim = np.flatnonzero((np.abs(s.nodes[:, :2] / [1, 0.25] - 0.5) > 0.5 - 1e-9).any(axis=1))
    for supports, symmetric in (([fd.Fix(rim.tolist(), "xyz")], True), ([], False)):
        problem, u = problem_and_state(fd.Case(s, supports, [fd.Pressure(P)]))
        free = problem.free
        matrix = problem.load_stiffness(u, 1.0)[free][:, free]
        assert (asymmetry(matrix) < 1e-14) == symmetric
        assert abs(matrix).max() > 0.01 * P


@pytest.mark.parametrize("make", MODELS)
def test_newtons_method_converges_quadratically(make) -> None:
    """With the exact tangent, which is not symmetric: residuals r, then about r^2."""
    s = make(PAIR)
    case = fd.Case(s, half_held(s), [fd.Pressure(0.01, [1])])
    with pytest.warns(FoldynWarning, match="has no potential: .* is not symmetric"):
        path = fd.trace(case, load_factors=[0, 0.5, 1])
    assert path.iterations.values.max() <= 8
    problem = OrigamiProblem(case)
    u = problem.state(path.displacement.values[-1], 1.0)
    free, norms = problem.free, []
    u[free] += 1e-4 * np.random.default_rng(2).standard_normal(free.size)
    for _ in range(4):
        left = problem.residual(u, 1.0)[free]
        norms.append(np.linalg.norm(left))
        matrix = case.body.tangent(u) + problem.load_stiffness(u, 1.0)
        u[free] -= np.linalg.solve(matrix.toarray()[np.ix_(free, free)], left)
    assert norms[3] < max(1e3 * (norms[2] / norms[0]) ** 2 * norms[0], 1e-11)
    step = OrigamiProblem(case).tangent(u, 1.0) - case.body.step_tangent(u)
    np.testing.assert_allclose(step.toarray(), problem.load_stiffness(u, 1.0).toarray(), atol=1e-9)


@pytest.mark.parametrize("make", MODELS)
def test_a_crease_under_a_moment_rests_where_its_spring_balances_it(make) -> None:
    """A positive moment opens the dihedral; each crease may have its own."""
    vertices = [[x, y] for y in (0, 1) for x in range(4)]
    faces = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
    s = make(fd.Pattern(vertices, faces, {(1, 5): "V", (2, 6): "M"}), crease_stiffness=K)
    case = fd.Case(s, half_held(s), [fd.CreaseMoment("all", [-0.8 * K, -0.5 * K])])
    path = fd.trace(case, load_factors=[0, 0.5, 1])
    x = s.nodes + path.displacement.values[-1]
    for panel, angle in ((x[2] - x[1], 0.8), (x[3] - x[2], 1.3)):
        assert np.arctan2(panel[2], panel[0]) == pytest.approx(angle, rel=1e-9)  # valleys close: up
    # the work of the moment is its integral over the angle
    energy = 0.5 * K * (0.8**2 + 0.5**2)
    assert float(path.strain_folds[-1]) == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("make", MODELS)
def test_a_pressure_turns_a_panel_until_its_crease_balances_it(make) -> None:
    """Its moment about the crease is p b a^2 / 2 in any position: angle = moment / k."""
    s = make(PAIR, crease_stiffness=K)
    case = fd.Case(s, half_held(s), [fd.Pressure(2 * 0.6 * K, [1])])
    path = fd.trace(case, load_factors=[0, 1])
    assert turned(s, path) == pytest.approx(0.6, rel={bars: 2e-4, shell: 3e-3}[make])


@pytest.mark.parametrize("make", MODELS)
def test_a_line_load_on_a_crease_between_rollers(make) -> None:
    """Rigid panels of length a turn by f: k 2 f = Q a cos(f) / 2 by moments about the crease."""
    s = make(PAIR, crease_stiffness=K)
    q = 1.5 * K
    supports = [fd.Fix(where(s, 0.0) + where(s, 2.0), "yz"), fd.Fix([0], "x")]
    case = fd.Case(s, supports, [fd.LineLoad([[1, 4]], (0, 0, q))])
    path = fd.trace(case, load_factors=[0, 1])
    f = brentq(lambda f: 2 * K * f - 0.5 * q * np.cos(f), 0.0, 1.5)
    rise = float(path.displacement[-1].sel(node=1, axis="z"))
    assert rise == pytest.approx(np.sin(f), rel={bars: 5e-4, shell: 4e-3}[make])


def test_small_pressure_bends_a_strip_as_a_beam() -> None:
    """5 p L^4 / (384 D) with nu = 0, between supports (Timoshenko and Woinowsky-Krieger, 1959)."""
    error = []
    for n in (8, 16):
        s = shell(STRIP, fd.Sheet(E, 0.0, T), divisions=n)
        supports = [fd.Fix(where(s, 0.0), "xyz"), fd.Fix(where(s, 1.0), "yz")]
        path = fd.trace(fd.Case(s, supports, [fd.Pressure(1e-4)]), load_factors=[0, 1])
        found = path.displacement.values[-1, where(s, 0.5), 2].mean()
        error.append(found / (5 * 1e-4 / (384 * E * T**3 / 12)) - 1.0)
    assert error[1] == pytest.approx(0.0032, abs=2e-4)
    assert error[0] / error[1] == pytest.approx(4.0, abs=0.2)  # of second order


def test_large_pressure_makes_a_held_strip_a_cylinder_under_hoop_tension() -> None:
    """T = p R: an arc of half angle a and radius R = L / (2 sin a), stretched to L a / sin a."""
    s, p = shell(STRIP, fd.Sheet(E, 0.0, T), divisions=16), 300.0
    case = fd.Case(s, [fd.Fix(where(s, 0.0) + where(s, 1.0), "xyz")], [fd.Pressure(p)])
    path = fd.trace(case, load_factors=[0, 1])

    def unbalanced(a: float) -> float:
        e = a / np.sin(a) - 1.0
        return E * T * (e + 0.5 * e * e) * (1.0 + e) - p * 0.5 / np.sin(a)  # Green's strain

    a = brentq(unbalanced, 1e-3, 1.5)
    radius = 0.5 / np.sin(a)
    rise = path.displacement.values[-1, where(s, 0.5), 2].mean()
    assert rise == pytest.approx(radius * (1.0 - np.cos(a)), rel=1.2e-3)
    # half of the strip: what the support takes and the pressure pushes sideways is the tension
    side = path.support_node.isin(where(s, 0.0)) & (path.support_axis == "x")
    pull = -float(path.reaction[-1].where(side, 0.0).sum()) / 0.25
    assert pull + p * rise == pytest.approx(p * radius, rel=5e-3)


@pytest.mark.parametrize("method", ["newton", "mgdcm", "arc_length"])
def test_all_methods_find_the_same_state(method) -> None:
    s = bars(PAIR, crease_stiffness=K)
    loads = [fd.Pressure(0.4 * K, [1]), fd.CreaseMoment([0], -0.2 * K)]
    case = fd.Case(s, half_held(s), loads)
    path = fd.trace(case, method, load_factors=[0, 1])
    steady = fd.trace(case, load_factors=[0, 1], constant=[0])
    moved = fd.trace(case, load_factors=[0.0], constant=[0, 1])
    assert turned(s, path) == pytest.approx(0.4, rel=3e-3)
    for other in (steady, moved):
        np.testing.assert_allclose(other.displacement[-1], path.displacement[-1], atol=1e-8)
    assert turned(s, steady.isel(step=[0])) == pytest.approx(0.2, rel=3e-3)


def test_a_displacement_path_under_constant_pressure() -> None:
    s = bars(PAIR, crease_stiffness=K)
    supports = [*half_held(s), fd.Impose([2, 5], "z", np.sin(0.9))]
    case = fd.Case(s, supports, [fd.Pressure(0.4 * K, [1])])
    path = fd.trace(case, "displacement", steps=4, constant=[0])
    lift = float(path.reaction[-1].where(path.support_node.isin([2, 5]), 0.0).sum())
    # moments about the crease: k angle = p a^2 / 2 + lift cos(angle)
    assert lift * np.cos(0.9) == pytest.approx(K * 0.9 - 0.2 * K, rel=5e-3)


def test_a_landscape_refuses_such_a_path() -> None:
    s = bars(PAIR, crease_stiffness=K)
    case = fd.Case(s, half_held(s), [fd.CreaseMoment([0], -0.2 * K)])
    path = fd.trace(case, "arc_length", load_factors=[0, 1])
    with pytest.raises(InputError, match="path: has loads that depend on the displacement"):
        landscape(path)
