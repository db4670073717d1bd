"""Springs to the ground and between nodes: closed forms, energy, both models."""

from __future__ import annotations

import numpy as np
import pytest
from attached_cases import FOLD, SHEET, derivative_errors, everywhere, moved, structure

import foldyn as fd
from foldyn.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
HEAVY = fd.Sheet(1e6, 0.3, 0.01, density=100.0)
SOME = [
    fd.Spring(300.0, nodes=[0, 2]),
    fd.Spring(70.0, nodes=[1], direction=(1, 2, -1)),
    fd.Spring(40.0, between=[(0, 2), (1, 3)]),
    fd.Spring(25.0, between=[(3, 0)], rest_length=0.4),
    fd.Spring(35.0, between=[(1, 2)], rest_length=0.0),
    fd.Spring(55.0, between=[(0, 3)], direction="-y"),
]
SLACK = [*SOME[:3], SOME[-1]]  # without force at rest


# ------------------------------------------------------------------ the body


@pytest.mark.parametrize("size", [1e-3, 0.2])
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_the_forces(model, size):
    s = structure(model, FOLD)
    assert fd.Case(s, [fd.Fix([0])]).body is s.body  # without springs
    assert max(derivative_errors(fd.Case(s, SOME).body, moved(s, size))) < 1e-8


def test_energies_and_forces_are_those_of_the_formulas(model):
    s = structure(model)
    body, q = fd.Case(s, SOME).body, moved(s, 0.1)
    u = q[: s.nodes.size].reshape(-1, 3)
    apart = np.linalg.norm((s.nodes + u)[:, None] - (s.nodes + u)[None], axis=2)
    d = np.array([1, 2, -1]) / np.sqrt(6.0)
    wanted = 0.5 * (
        300 * (u[0] @ u[0] + u[2] @ u[2]) + 70 * (u[1] @ d) ** 2
        + 40 * (apart[0, 2] - np.sqrt(2)) ** 2 + 40 * (apart[1, 3] - np.sqrt(2)) ** 2
        + 25 * (apart[0, 3] - 0.4) ** 2 + 35 * apart[1, 2] ** 2 + 55 * (u[3, 1] - u[0, 1]) ** 2
    )  # fmt: skip
    assert list(body.energy_groups)[-1] == "strain_springs"
    assert body.energies(q)[-1] == pytest.approx(wanted, rel=1e-14)
    inner = (body.internal(q) - s.body.internal(q))[: s.nodes.size].reshape(-1, 3)
    ground = 300 * (u[0] + u[2]) + 70 * (u[1] @ d) * d
    assert inner.sum(axis=0) == pytest.approx(ground, abs=1e-9)  # springs between nodes balance
    assert not inner[4:].any()


@pytest.mark.matrix
def test_compiled_loops_see_the_same_forces_as_statics(model):
    s = structure(model, FOLD)
    case = fd.Case(s, SOME, masses=[fd.PointMass(everywhere(s), 1.0)])
    state = fd.State(displacement=moved(s, 0.05)[: s.nodes.size].reshape(-1, 3))
    motion = fd.simulate(case, 1e-9, method="generalized_alpha", dt=1e-9, initial=state)
    wanted = case.body.energies(case.body.dofs(state.displacement))
    found = [float(motion[name][0]) for name in case.body.energy_groups]
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_blocks_of_implicit_steps_are_the_tangent(model):
    s = structure(model, FOLD)
    body, q = fd.Case(s, SOME).body, moved(s, 0.1)
    blocks = body.blocks()
    rows = np.zeros((body.rows, 3))
    rows.ravel()[: body.size] = q
    out = np.full((len(blocks.pattern.indices), 3, 3), np.nan)
    for _ in range(2):  # places are found once
        blocks.put(body, blocks.pattern, rows, rows, False, out)
        dense = np.zeros((body.rows, body.rows, 3, 3))
        row = np.repeat(np.arange(body.rows), np.diff(blocks.pattern.indptr))
        dense[row, blocks.pattern.indices] = out
        matrix = dense.transpose(0, 2, 1, 3).reshape(3 * body.rows, -1)[: body.size, : body.size]
        wanted = body.step_tangent(q).toarray()
        assert np.abs(matrix - wanted).max() <= 1e-13 * np.abs(wanted).max()
    filled = np.zeros_like(dense, bool)
    filled[row, blocks.pattern.indices] = blocks.filled(blocks.pattern)
    assert not np.any((dense != 0.0) & ~filled)


def test_renumbered_nodes_keep_their_springs():
    s = fd.discretize(fd.patterns.miura(cells=(8, 8)), SHEET, preset="plate")
    assert len(s.nodes) > 300  # below, nothing is renumbered
    body = fd.Case(s, [fd.Spring(3.0, nodes=[5], direction="x"), *SOME]).body
    other, by = body.renumbered()
    assert not np.array_equal(by.order, np.arange(len(by.order)))
    u = moved(s, 0.1).reshape(-1, 3)
    assert other.energies(u[by.order]) == pytest.approx(body.energies(u), rel=1e-12)
    force, wanted = np.empty_like(u), body.internal(u).reshape(-1, 3)
    force[by.order] = other.internal(u[by.order]).reshape(-1, 3)
    assert np.abs(force - wanted).max() < 1e-12 * np.abs(wanted).max()


# ------------------------------------------------------------------ closed forms


def test_masses_on_springs_to_the_ground_swing_with_the_root_of_k_over_m(model):
    """Every node alike: all six rigid motions, whatever the sheet's stiffness; exact."""
    s, k, m = structure(model, FOLD), 300.0, 2.0
    case = fd.Case(s, [fd.Spring(k, everywhere(s))], masses=[fd.PointMass(everywhere(s), m)])
    found = fd.modes(case, 6)
    assert found.frequency.values == pytest.approx(np.sqrt(k / m) / (2 * np.pi), rel=1e-9)
    assert not found.rigid.any()


def test_a_sheet_on_springs_alone_is_in_balance(model):
    s, k, feet = structure(model, FOLD), 300.0, [0, 1, 4]
    case = fd.Case(s, [fd.Spring(k, feet)], [fd.Force([2, 3], (0.1, 0.2, -0.3))])
    path = fd.trace(case)
    u = path.displacement.values[-1]
    x, force = s.nodes + u, case.load_terms[0][0].copy()
    force[feet] -= k * u[feet]
    assert force.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    assert np.cross(x, force).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    strain = sum(float(path[name][-1]) for name in case.energy_groups)
    assert strain == pytest.approx(float(path.work[-1]), rel=0.05)  # nearly linear, few steps
    assert float(path.strain_springs[-1]) == pytest.approx(0.5 * k * (u[feet] ** 2).sum())


def test_two_springs_in_series(model):
    """A triangle on a sled, and a second one pulled by it: F / k2 and F / k1 + F / k2."""
    x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 0, 0], [4, 0, 0], [3, 1, 0]]
    k1, k2, force = 200.0, 300.0, 3.0
    s = structure(model, fd.Pattern(x, [[0, 1, 2], [3, 4, 5]]))
    springs = [fd.Spring(k2, [0], direction="x"), fd.Spring(k1, between=[(1, 3)])]
    rails = [fd.Fix([0, 1, 3, 4], "yz"), fd.Fix([2, 5], "z")]
    path = fd.trace(fd.Case(s, [*rails, *springs], [fd.Force([4], (force, 0, 0))]))
    u = path.displacement.values[-1][:, 0]
    assert [k2 * u[0], k1 * (u[3] - u[1])] == pytest.approx([force, force], rel=1e-8)
    energy = 0.5 * force**2 * (1 / k1 + 1 / k2)
    assert float(path.strain_springs[-1]) == pytest.approx(energy, rel=1e-8)


def test_mechanisms_are_named_with_springs(model):
    s, load = structure(model, FOLD, HEAVY), [fd.Force([2], (0, 0, 1e-3))]
    feet = fd.Case(s, [fd.Spring(1.0, [0, 1, 4])], load)
    fd.trace(feet)
    with pytest.raises(InputError, match="leave no rigid motion free"):
        fd.trace(feet, inertia_relief=True)
    along = [fd.Spring(1.0, everywhere(s), direction="z")]
    with pytest.raises(InputError, match=r"translation along x; translation along y; rotation ab"):
        fd.trace(fd.Case(s, along, load))
    with pytest.raises(InputError, match="rotation about"):
        fd.trace(fd.Case(s, [fd.Fix([0]), fd.Spring(9.0, between=[(0, 4)])], load))


def test_a_spring_stops_an_internal_mechanism():
    """Two triangles with a crease of no stiffness; one spring between the free corners."""
    x = [[0, 0, 0], [0, 1, 0], [1, 0.5, 0.2], [-1, 0.5, 0]]
    s = structure("bars and hinges", fd.Pattern(x, [[0, 2, 1], [0, 1, 3]]), crease_stiffness=0.0)
    load = [fd.Force([2], (0, 0, 1e-3))]
    held = [fd.Fix([0, 1, 3])]
    with pytest.raises(InputError, match="internal mechanism that moves node 2"):
        fd.trace(fd.Case(s, held, load))
    fd.trace(fd.Case(s, [*held, fd.Spring(5.0, [2], direction="z")], load))
    with pytest.raises(InputError, match="internal mechanism"):  # its own edge is no new tie
        fd.trace(fd.Case(s, [*held, fd.Spring(5.0, between=[(0, 2)])], load))


# ------------------------------------------------------------------ motion


@pytest.mark.parametrize(
    ("model", "method", "most"),
    [
        ("bars and hinges", "rk4", 1e-3),
        pytest.param("bars and hinges", "central_difference", 1e-2, marks=pytest.mark.matrix),
        pytest.param("bars and hinges", "dormand_prince", 1e-3, marks=pytest.mark.matrix),
        ("bars and hinges", "newmark", 1e-3),
        pytest.param("shell", "generalized_alpha", 1e-3, marks=pytest.mark.matrix),
    ],
)
def test_the_energy_balance_closes_with_springs_and_damping(model, method, most):
    push = fd.Force([2], (3.0, 1.0, 2.0), fd.HalfSine(0.05))
    case = fd.Case(structure(model, FOLD, HEAVY), SLACK, [push], fd.Rayleigh(1.0, 1e-5))
    motion = fd.simulate(case, 0.1, method=method, interval=0.01)
    assert motion.attrs["energy_error"] < most
    assert float(motion.strain_springs.max()) > 0.01 * float(motion.work.max())


def test_the_critical_step_sees_stiff_springs():
    s = structure("bars and hinges", sheet=HEAVY, mass="panel")
    slack, stiff = (fd.critical_step(fd.Case(s, [fd.Spring(k, everywhere(s))])) for k in (1.0, 1e8))
    m = s.nodal_mass.min()
    assert stiff < 0.1 * slack
    assert stiff == pytest.approx(0.9 * 2.8284 / np.sqrt(1e8 / m), rel=1e-3)  # RK4: 2 sqrt(2)


# ------------------------------------------------------------------ responses to a moving base


def test_a_mass_between_the_ground_and_a_moving_base(model):
    """z'' m + a m z' + k1 (z + b z') = k2 (y - z + b (y' - z')): k1 is on the ground."""
    k1, k2, m, a = 200.0, 300.0, 2.0, 0.3
    s = structure(model, sheet=fd.Sheet(1e-3, 0.3, 0.01))  # hardly resists
    others = [node for node in everywhere(s) if node not in (0, 1)]
    supports = [
        fd.Fix([0, 1]),
        fd.Fix(others, "xy"),
        fd.Spring(k2, between=[(0, node) for node in others], direction="z"),
        fd.Spring(k1, others, direction="z"),
    ]
    masses = [fd.PointMass(everywhere(s), m)]

    def exact(f, b):
        w = 2 * np.pi * f
        springs = 1 + 1j * w * b
        return k2 * springs / ((k1 + k2) * springs - w**2 * m + 1j * w * a * m)

    f = np.array([0.5, 2.0, 4.0])
    case = fd.Case(s, supports, (), fd.Rayleigh(a, 1e-3), masses)
    for method in ("direct", "modal"):
        found = fd.frf(case, [fd.BaseMotion("z")], frequencies=f, method=method).transmissibility
        assert found.sel(axis="z").values[:, 2] == pytest.approx(exact(f, 1e-3), rel=1e-4)
    if model != "bars and hinges":
        return
    base = fd.BaseMotion("z", fd.Harmonic(2.0), 1e-3)
    moving = fd.Case(s, [*supports, base], (), fd.Rayleigh(a, 5e-2), masses)
    motion = fd.simulate(moving, 6.0, method="generalized_alpha", interval=0.01)
    late = motion.displacement[-100:, 2, 2].values
    assert 0.5 * np.ptp(late) == pytest.approx(1e-3 * abs(exact(2.0, 5e-2)), rel=1e-2)
    assert motion.attrs["energy_error"] < 1e-3


# ------------------------------------------------------------------ writing and bad input


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "give nodes, for springs to the ground, or between"),
        ({"nodes": [0], "between": [(0, 1)]}, "give nodes, for springs to the ground, or between"),
        ({"nodes": [0], "stiffness": 0.0}, "stiffness = 0.0: must be greater than 0 N/m"),
        ({"nodes": [0], "direction": "w"}, 'direction = "w": choose one of x, y'),
        ({"nodes": [0], "direction": (0, 0, 0)}, "direction = .*: must not be zero"),
        ({"nodes": [0], "rest_length": 1.0}, "rest_length = 1: only for springs along the line"),
        ({"between": [(0, 1)], "rest_length": -1.0}, "rest_length = -1.0: must be at least 0 m"),
        ({"between": (0,)}, r"between = \[0\]: must be two nodes"),
        ({"between": [(0, 0)]}, r"between\[0\] = \[0, 0\]: node 0 is listed twice"),
        ({"between": [(0, 1, 2)]}, r"between\[0\] = \[0, 1, 2\]: must be two nodes"),
    ],
)
def test_bad_springs(given, message):
    with pytest.raises(InputError, match=message):
        fd.Spring(**{"stiffness": 1.0, **given})


def test_springs_of_a_case_are_checked():
    x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, -1, 0]]
    s = structure("bars and hinges", fd.Pattern(x, [[0, 1, 2], [3, 4, 5]]))
    for given, message in (
        ({"nodes": [99]}, r"supports\[1\]\.nodes = \[99\]: node 99 is out of range"),
        ({"between": [(0, 1), (0, 99)]}, r"supports\[1\]\.between\[1\] = \[0, 99\]: node 99 is"),
        ({"between": [(0, 3)]}, r"between\[0\] = \[0, 3\]: these nodes coincide"),
    ):
        with pytest.raises(InputError, match=message):
            fd.Case(s, [fd.Fix([0]), fd.Spring(1.0, **given)])
    assert fd.Case(s, [fd.Spring(1.0, between=[(0, 3)], direction="x")]).terms
