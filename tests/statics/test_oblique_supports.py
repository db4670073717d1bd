"""Paths with directions held: equilibrium by hand, and the same structure turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from trusses import APEX, VonMises, marked

import foldyn as fd
from foldyn.statics import landscape, switch_branch, trace

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
A, B = np.radians(25.0), np.radians(40.0)
TURN = Rotation.from_euler("zy", [B, A]).as_matrix()


def reactions(path, nodes) -> np.ndarray:
    """Forces of the supports (step, n, 3)."""
    out = np.zeros((path.sizes["step"], nodes, 3))
    axis = ["xyz".index(name) for name in path.support_axis.values]
    out[:, path.support_node.values, axis] = path.reaction.values
    return out


MODELS = {
    "bars": lambda pattern: fd.discretize(pattern, SHEET, mass="consistent", preset="plate"),
    "shell": lambda pattern: fd.shell(pattern, SHEET, divisions=4),
}


@pytest.mark.parametrize("model", MODELS)
def test_a_triangle_on_a_pin_and_an_inclined_roller(model) -> None:
    """In its plane three forces: moments about the pin give that of the roller, N along n."""
    pattern = fd.Pattern([[0, 0, 0], [2, 0, 0], [0.8, 0, 1.1]], [[0, 1, 2]], [])
    s = MODELS[model](pattern)
    normal = np.array([-np.sin(A), 0.0, np.cos(A)])
    plane = fd.Fix(list(range(len(s.nodes))), "y")
    load = np.array([30.0, 0.0, -50.0])
    supports = [plane, fd.Fix([0], "xz"), fd.Fix([1], direction=2.0 * normal)]
    path = trace(fd.Case(s, supports, [fd.Force([2], load)]), load_factors=[1.0])
    forces = reactions(path, len(s.nodes))[-1]
    x = s.nodes + path.displacement.values[-1]
    arm, lever = x[2] - x[0], x[1] - x[0]
    pushed = -np.cross(arm, load)[1] / np.cross(lever, normal)[1]
    np.testing.assert_allclose(forces[1, [0, 2]], pushed * normal[[0, 2]], rtol=1e-8)
    np.testing.assert_allclose(forces.sum(axis=0), -load, atol=1e-7)
    assert path.displacement.values[-1, 1] @ normal == pytest.approx(0.0, abs=1e-15)
    assert np.linalg.norm(path.displacement.values[-1, 1]) > 1e-4  # it slides


def turned_truss(truss) -> tuple[fd.Case, fd.Case]:
    """A truss of two bars whose apex is guided, and the same turned: held in directions."""
    case = truss.case(free="xz")
    s = replace(case.structure, nodes=case.structure.nodes @ TURN.T)
    supports = [fd.Fix([0, 1]), fd.Fix([APEX], direction=TURN[:, 1])]
    loads = [fd.Force(load.nodes, TURN @ load.vector) for load in case.loads]
    return case, fd.Case(s, supports, loads)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the path loses stability")
@pytest.mark.parametrize("method", ["arc_length", "mgdcm"])
def test_a_turned_truss_buckles_and_snaps_as_before(method) -> None:
    """Limit and bifurcation points, their counts, the crossing path: Z' K Z keeps its signs."""
    truss = VonMises(h=2.0)
    plain, case = turned_truss(truss)
    one, path = (
        trace(case, method, first_step=100.0, steps=60,
              until=lambda u, _: np.linalg.norm(u[APEX]) > 2.2 * truss.h)
        for case in (plain, case)
    )  # fmt: skip
    before, found = marked(one), marked(path)
    assert found.point.values.tolist() == ["bifurcation", "limit", "limit", "bifurcation"]
    for name in ("point", "negative_eigenvalues"):
        np.testing.assert_array_equal(found[name], before[name])
    np.testing.assert_allclose(found.load_factor, before.load_factor, rtol=1e-9)
    # the path that crosses: a circle, and a load in proportion to the height
    branch = switch_branch(path, case=case, steps=8, method=method)
    apex = (branch.displacement.values[:, APEX] @ TURN) + (0.0, 0.0, truss.h)
    radius = np.sqrt(truss.h**2 - 2.0 * truss.b**2)
    np.testing.assert_allclose(np.hypot(apex[:, 0], apex[:, 2]), radius, rtol=1e-7)
    load = 2.0 * truss.EA * truss.b**2 * apex[:, 2] / truss.L**3
    np.testing.assert_allclose(branch.load_factor, load, rtol=1e-6)
    assert np.ptp(apex[:, 0]) > 0.1


@pytest.mark.filterwarnings("ignore:the path loses stability")
def test_a_landscape_along_a_direction() -> None:
    """An apex moved along a direction passes the same states without force."""
    truss = VonMises(h=0.3)
    plain = truss.structure()
    s = replace(plain, nodes=plain.nodes @ TURN.T)
    guide = [fd.Fix([APEX], direction=TURN[:, 1])]
    moved = fd.Impose([APEX], direction=-TURN[:, 2], value=2.2 * truss.h)
    case = fd.Case(s, [fd.Fix([0, 1]), *guide, moved])
    path = trace(case, "displacement", steps=20)
    v = np.linalg.norm(path.displacement.values[:, APEX], axis=1)
    np.testing.assert_allclose(v, path.load_factor * 2.2 * truss.h, atol=1e-12)
    force = reactions(path, 3)[:, APEX] @ -TURN[:, 2]
    np.testing.assert_allclose(force, truss.load(v), atol=1e-8 * truss.limit)
    states = landscape(path, case=case)
    heights = [state.stroke for state in states.states]
    np.testing.assert_allclose(heights, [0.0, truss.h, 2.0 * truss.h], atol=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_a_turned_fold_deforms_as_before(model) -> None:
    """Both models, under forces and under an imposed displacement along a direction."""
    pattern, load = fd.patterns.simple_fold(), np.array([-1e-3, 0.0, 0.0])
    turned = fd.Pattern(pattern.vertices @ TURN.T, pattern.faces, pattern.assignments)
    s, t = MODELS[model](pattern), MODELS[model](turned)
    plain = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
    oblique = [fd.Fix([4, 5]), fd.Fix([0, 1], direction=TURN[:, 2])]
    way = [-0.05, -0.06]
    for one, other in (
        (fd.Case(s, plain, [fd.Force([0, 1], load)]),
         fd.Case(t, oblique, [fd.Force([0, 1], TURN @ load)])),
        (fd.Case(s, [*plain, fd.Impose([0, 1], "x", way)]),
         fd.Case(t, [*oblique, fd.Impose([0, 1], value=way, direction=TURN[:, 0])])),
    ):  # fmt: skip
        a, b = (trace(case, load_factors=[0.5, 1.0]) for case in (one, other))
        fields = [(path.displacement.values, reactions(path, len(s.nodes))) for path in (a, b)]
        for before, after, close in zip(*fields, (1e-7, 1e-6), strict=True):
            np.testing.assert_allclose(before @ TURN.T, after, atol=close * np.abs(before).max())
        np.testing.assert_allclose(a.work, b.work, rtol=1e-6)


def test_mechanisms_with_directions_are_named() -> None:
    """A roller in a direction leaves what it does not hold, and links hold what they tie."""
    s = MODELS["bars"](fd.patterns.simple_fold())
    load = [fd.Force([0, 1], (1.0, 0.0, 0.0))]
    rollers = [fd.Fix(list(range(6)), direction=(1.0, 0.0, 1.0)), fd.Fix([0], "y")]
    with pytest.raises(fd.errors.InputError, match=r"translation along \(1, 0, -1\)"):
        trace(fd.Case(s, rollers, load))
    linked = [fd.Fix([0], "xyz"), fd.Link([0, 1, 4, 5])]  # none of these moves any more
    held = fd.Case(s, linked, [fd.Force([2, 3], (0.0, 0.0, -1e-4))])
    assert trace(held, load_factors=[1.0]).status == "complete"
    free = fd.Case(s, [*linked[:1], fd.Link([0, 1])], [fd.Force([2], (1.0, 0.0, 0.0))])
    with pytest.raises(fd.errors.InputError, match="rotation about y"):
        trace(free, load_factors=[1.0])


def test_inertia_relief_on_an_incline() -> None:
    """A sheet that slides freely down: its inertia balances what drives it."""
    s = MODELS["bars"](fd.patterns.simple_fold())
    normal = np.array([np.sin(A), 0.0, np.cos(A)])
    supports = [fd.Fix([0, 1, 4, 5], direction=normal), fd.Fix([0, 4], "y")]
    case = fd.Case(s, supports, [fd.Gravity((0.0, 0.0, -1e-3))])
    path = trace(case, load_factors=[1.0], inertia_relief=True)
    forces = reactions(path, len(s.nodes))[-1].sum(axis=0)
    expected = s.total_mass * 1e-3 * np.cos(A) * normal
    np.testing.assert_allclose(forces, expected, atol=1e-10)
