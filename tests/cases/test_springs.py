"""Springs to the ground and between nodes: closed forms, energy, both models."""

from __future__ import annotations

import numpy as np
import pytest
from attached_cases import (
    FOLD,
    MODELS,
    SHEET,
    derivative_errors,
    everywhere,
    moved,
    structure,
)

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


@pytest.fixture(params=MODELS)
def model(request):
    return request.param


# ------------------------------------------------------------------ the body


@pytest.mark.parametrize("size", [1e-3, 0.2])
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_the_forces(model, size):
    s = structure(model, FOLD)
    body = fd.Case(s, SOME).body
    errors = derivative_errors(body, moved(s, size))
    assert max(errors) < 1e-8


def test_energies_and_forces_are_those_of_the_formulas(model):
    s = structure(model)
    body, q = fd.Case(s, SOME).body, moved(s, 0.1)
    u = q[: s.nodes.size].reshape(-1, 3)
    x = s.nodes + u

    def apart(a, b):
        return np.linalg.norm(x[b] - x[a])

    d = np.array([1, 2, -1]) / np.sqrt(6.0)
    wanted = 0.5 * (
        300 * (u[0] @ u[0] + u[2] @ u[2]) + 70 * (u[1] @ d) ** 2
        + 40 * (apart(0, 2) - np.sqrt(2)) ** 2 + 40 * (apart(1, 3) - np.sqrt(2)) ** 2
        + 25 * (apart(0, 3) - 0.4) ** 2 + 35 * apart(1, 2) ** 2
        + 55 * (u[3, 1] - u[0, 1]) ** 2
    )  # fmt: skip
    assert list(body.energy_groups)[-1] == "strain_springs"
    assert body.energies(q)[-1] == pytest.approx(wanted, rel=1e-14)
    alone = body.internal(q) - s.body.internal(q)
    inner = alone[: s.nodes.size].reshape(-1, 3)
    ground = 300 * (u[0] + u[2]) + 70 * (u[1] @ d) * d
    assert inner.sum(axis=0) == pytest.approx(ground, abs=1e-9)  # springs between nodes balance
    assert inner[4:].any() == np.False_


@pytest.mark.matrix
def test_compiled_loops_see_the_same_forces_as_statics(model):
    s = structure(model, FOLD)
    body, q = fd.Case(s, SOME).body, moved(s, 0.05)
    case = fd.Case(s, SOME, masses=[fd.PointMass(everywhere(s), 1.0)])
    state = fd.State(displacement=q[: s.nodes.size].reshape(-1, 3))
    motion = fd.simulate(case, 1e-9, "generalized_alpha", dt=1e-9, initial=state)
    full = body.dofs(state.displacement)
    parts = dict(zip(body.energy_groups, body.energies(full), strict=True))
    for name, value in parts.items():
        assert float(motion[name][0]) == pytest.approx(value, rel=1e-9, abs=1e-12)


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
    s = fd.discretize(fd.patterns.miura(cells=(8, 8)), SHEET)
    assert len(s.nodes) > 300  # below, nothing is renumbered
    body = fd.Case(s, [fd.Spring(3.0, nodes=[5], direction="x"), *SOME]).body
    other, by = body.renumbered()
    order = by.order
    assert not np.array_equal(order, np.arange(len(order)))
    u = moved(s, 0.1).reshape(-1, 3)
    assert other.energies(u[order]) == pytest.approx(body.energies(u), rel=1e-12)
    force = np.empty_like(u)
    force[order] = other.internal(u[order]).reshape(-1, 3)
    wanted = body.internal(u).reshape(-1, 3)
    assert np.abs(force - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_a_case_without_springs_has_the_body_of_its_structure(model):
    s = structure(model)
    assert fd.Case(s, [fd.Fix([0])]).body is s.body


# ------------------------------------------------------------------ closed forms


def test_masses_on_springs_to_the_ground_swing_with_the_root_of_k_over_m(model):
    """Every node alike: all six rigid motions, whatever the sheet's stiffness; exact."""
    s, k, m = structure(model, FOLD), 300.0, 2.0
    case = fd.Case(s, [fd.Spring(k, everywhere(s))], masses=[fd.PointMass(everywhere(s), m)])
    found = fd.modes(case, 6)
    exact = np.sqrt(k / m) / (2 * np.pi)
    assert found.frequency.values == pytest.approx(exact, rel=1e-9)
    assert not found.rigid.any()


def test_a_sheet_heaves_on_springs_of_one_direction(model):
    """Springs in proportion to the masses: f = sqrt(sum k / m) / 2 pi, exactly."""
    s = structure(model, FOLD, HEAVY, **({} if model == "shell" else {"mass": "centroid"}))
    k = 7.0
    springs = [
        fd.Spring(float(k * share), [node], direction="z")
        for node, share in enumerate(s.nodal_mass / s.total_mass)
    ]
    case = fd.Case(s, [fd.Fix(everywhere(s), "xy"), *springs])
    found = fd.modes(case, 1)
    assert float(found.frequency[0]) == pytest.approx(
        np.sqrt(k / s.total_mass) / (2 * np.pi), rel=1e-7
    )


def test_a_sheet_on_springs_alone_is_in_balance(model):
    s, k = structure(model, FOLD), 300.0
    case = fd.Case(s, [fd.Spring(k, [0, 1, 4])], [fd.Force([2, 3], (0.1, 0.2, -0.3))])
    path = fd.trace(case)
    u, x = path.displacement.values[-1], s.nodes
    feet = -k * u[[0, 1, 4]]
    assert feet.sum(axis=0) == pytest.approx([-0.2, -0.4, 0.6], abs=1e-9)
    applied = case.load_terms[0][0]
    moments = np.cross(x[[0, 1, 4]] + u[[0, 1, 4]], feet).sum(axis=0)
    assert moments == pytest.approx(-np.cross(x + u, applied).sum(axis=0), abs=1e-9)
    strain = sum(float(path[name][-1]) for name in case.energy_groups)
    assert strain == pytest.approx(float(path.work[-1]), rel=0.05)  # nearly linear, few steps
    assert float(path.strain_springs[-1]) == pytest.approx(0.5 * k * (u[[0, 1, 4]] ** 2).sum())


def test_two_springs_in_series():
    """A triangle on a sled, and a second one pulled by it: F / k2 and F / k1 + F / k2."""
    x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 0, 0], [4, 0, 0], [3, 1, 0]]
    k1, k2, force = 200.0, 300.0, 3.0
    for model in MODELS:
        s = structure(model, fd.Pattern(x, [[0, 1, 2], [3, 4, 5]]))
        springs = [fd.Spring(k2, [0], direction="x"), fd.Spring(k1, between=[(1, 3)])]
        rails = [fd.Fix([0, 1, 3, 4], "yz"), fd.Fix([2, 5], "z")]
        path = fd.trace(fd.Case(s, [*rails, *springs], [fd.Force([4], (force, 0, 0))]))
        u = path.displacement.values[-1][:, 0]
        assert k2 * u[0] == pytest.approx(force, rel=1e-8)
        assert k1 * (u[3] - u[1]) == pytest.approx(force, rel=1e-8)
        assert float(path.strain_springs[-1]) == pytest.approx(
            0.5 * force**2 * (1 / k1 + 1 / k2), rel=1e-8
        )


def test_mechanisms_are_named_with_springs(model):
    s = structure(model, FOLD)
    fd.trace(fd.Case(s, [fd.Spring(1.0, [0, 1, 4])], [fd.Force([2], (0, 0, 1e-3))]))
    along = [fd.Spring(1.0, everywhere(s), direction="z")]
    with pytest.raises(InputError, match=r"translation along x; translation along y; rotation ab"):
        fd.trace(fd.Case(s, along, [fd.Force([2], (0, 0, 1e-3))]))
    between = [fd.Fix([0]), fd.Spring(9.0, between=[(0, 4)])]
    with pytest.raises(InputError, match="rotation about"):
        fd.trace(fd.Case(s, between, [fd.Force([2], (0, 0, 1e-3))]))


def test_a_spring_stops_an_internal_mechanism():
    """Two triangles with a crease of no stiffness; one spring between the free corners."""
    pattern = fd.Pattern(
        [[0, 0, 0], [0, 1, 0], [1, 0.5, 0.2], [-1, 0.5, 0]], [[0, 2, 1], [0, 1, 3]]
    )
    s = structure("bars and hinges", pattern, crease_stiffness=0.0)
    load = [fd.Force([2], (0, 0, 1e-3))]
    held = [fd.Fix([0, 1, 3])]
    with pytest.raises(InputError, match="internal mechanism that moves node 2"):
        fd.trace(fd.Case(s, held, load))
    fd.trace(fd.Case(s, [*held, fd.Spring(5.0, [2], direction="z")], load))
    with pytest.raises(InputError, match="internal mechanism"):  # its own edge is no new tie
        fd.trace(fd.Case(s, [*held, fd.Spring(5.0, between=[(0, 2)])], load))


def test_inertia_relief_takes_what_springs_leave_free(model):
    s = structure(model, FOLD, HEAVY)
    springs = [fd.Spring(1e3, [0, 1, 4])]
    with pytest.raises(InputError, match="leave no rigid motion free"):
        fd.trace(fd.Case(s, springs, [fd.Force([2], (0, 0, 1e-3))]), inertia_relief=True)


# ------------------------------------------------------------------ motion


def test_a_pendulum_on_a_spring_keeps_its_energy():
    """A panel hung by a long spring swings through a large angle."""
    s = structure("bars and hinges", sheet=HEAVY, mass="panel")
    case = fd.Case(s, [fd.Fix([0]), fd.Spring(400.0, between=[(0, 2), (1, 3)])], [fd.Gravity("-z")])
    for method, most in (("rk4", 1e-5), ("generalized_alpha", 1e-3)):
        motion = fd.simulate(case, 0.8, method, every=0.05)
        assert np.ptp(motion.displacement[:, 2, 2].values) > 0.7
        assert motion.attrs["energy_error"] < most


@pytest.mark.parametrize(
    "method",
    [
        "rk4",
        pytest.param("central_difference", marks=pytest.mark.matrix),
        pytest.param("dormand_prince", marks=pytest.mark.matrix),
        "newmark",
    ],
)
def test_the_energy_balance_closes_with_springs_and_damping(method):
    s = structure("bars and hinges", FOLD, HEAVY)
    case = fd.Case(
        s, SLACK, [fd.Force([2], (3.0, 1.0, 2.0), fd.HalfSine(0.05))], fd.Rayleigh(1.0, 1e-5)
    )
    motion = fd.simulate(case, 0.1, method, every=0.01)
    assert motion.attrs["energy_error"] < (1e-2 if method == "central_difference" else 1e-3)
    assert float(motion.strain_springs.max()) > 0.01 * float(motion.work.max())


@pytest.mark.matrix
def test_the_energy_balance_of_a_shell_closes_with_springs():
    s = structure("shell", FOLD, HEAVY)
    case = fd.Case(s, SOME, [fd.Force([2], (3.0, 1.0, 2.0), fd.HalfSine(0.05))])
    motion = fd.simulate(case, 0.1, "generalized_alpha", every=0.01)
    assert motion.attrs["energy_error"] < 1e-3


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha", "energy_momentum"])
def test_creases_that_fold_by_themselves_work_against_springs(method):
    s = structure("bars and hinges", FOLD, HEAVY, clamped=[(0, 1)])
    springs = [fd.Spring(2.0, [4], direction="z"), fd.Spring(3.0, between=[(2, 5)])]
    fold = fd.Actuate([0], 150.0, fd.Ramp(0.2, smooth=True))
    case = fd.Case(s, [fd.Fix([0, 1]), *springs], [fold], fd.Rayleigh(0.5, 1e-5))
    motion = fd.simulate(case, 0.2, method, every=0.02)
    assert motion.attrs["energy_error"] < 1e-4
    assert float(motion.work.max()) > 0.01
    assert float(motion.strain_springs.max()) > 0.0
    path = fd.trace(fd.Case(s, case.supports, [fd.Actuate([0], 150.0)]))
    strain = sum(float(path[name][-1]) for name in case.energy_groups)
    assert strain == pytest.approx(float(path.work[-1]), rel=1e-3)


def test_the_critical_step_sees_stiff_springs():
    s = structure("bars and hinges", sheet=HEAVY, mass="panel")
    slack, stiff = (fd.critical_step(fd.Case(s, [fd.Spring(k, everywhere(s))])) for k in (1.0, 1e8))
    m = s.nodal_mass.min()
    assert stiff < 0.1 * slack
    assert stiff == pytest.approx(0.9 * 2.8284 / np.sqrt(1e8 / m), rel=1e-3)  # RK4: 2 sqrt(2)


# ------------------------------------------------------------------ responses to a moving base


def transmissibility(w, k, m, alpha, beta):
    """Of a mass on a spring from a base; the text of `linear.excitation`."""
    return (k + 1j * w * beta * k) / (k - w**2 * m + 1j * w * (alpha * m + beta * k))


def test_a_mass_on_a_spring_from_a_moving_base(model):
    k, m, alpha, beta = 300.0, 2.0, 0.3, 1e-3
    s = structure(model)
    feet = [0, 1]
    supports = [
        fd.Fix(feet),
        fd.Fix([node for node in everywhere(s) if node not in feet], "xy"),
        fd.Spring(1e7, between=[(2, 3)], direction="z"),
        fd.Spring(k, between=[(0, 3), (1, 2)], direction="z"),
    ]
    soft = fd.Sheet(1e-3, 0.3, 0.01)  # hardly resists
    s = structure(model, sheet=soft)
    case = fd.Case(s, supports, (), fd.Rayleigh(alpha, beta), [fd.PointMass(everywhere(s), m)])
    f = np.array([0.5, 1.9, 4.0])
    exact = transmissibility(2 * np.pi * f, k, m, alpha, beta)
    for method in ("direct", "modal"):
        response = fd.frf(case, [fd.BaseMotion("z")], f, method=method)
        found = response.transmissibility.sel(axis="z").values
        found = found if found.ndim == 2 else found[..., 0] + 1j * found[..., 1]
        assert found[:, 3] == pytest.approx(exact, rel=1e-4)


def test_springs_on_the_ground_do_not_move_with_the_base():
    """z'' m = -k z_abs - c (z - y): one mass on the ground with k1 and to the base with k2."""
    k1, k2, m, beta = 200.0, 300.0, 2.0, 1e-3
    s = structure("bars and hinges", sheet=fd.Sheet(1e-3, 0.3, 0.01))
    others = [node for node in everywhere(s) if node not in (0, 1)]
    supports = [
        fd.Fix([0, 1]),
        fd.Fix(others, "xy"),
        fd.Spring(k2, between=[(0, node) for node in others], direction="z"),
        fd.Spring(k1, others, direction="z"),
    ]
    case = fd.Case(s, supports, (), fd.Rayleigh(0.0, beta), [fd.PointMass(everywhere(s), m)])
    f = np.array([0.5, 2.0, 4.0])
    w = 2 * np.pi * f
    exact = k2 * (1 + 1j * w * beta) / ((k1 + k2) * (1 + 1j * w * beta) - w**2 * m)
    for method in ("direct", "modal"):
        response = fd.frf(case, [fd.BaseMotion("z")], f, method=method)
        found = response.transmissibility.sel(axis="z").values
        assert found[:, 2] == pytest.approx(exact, rel=1e-4)
    history = fd.Harmonic(2.0)
    moving = fd.Case(
        s, [*supports, fd.BaseMotion("z", history, 1e-3)], (), fd.Rayleigh(0.0, 5e-2), case.masses
    )
    motion = fd.simulate(moving, 6.0, "generalized_alpha", every=0.01)
    beta = 5e-2
    w = 2 * np.pi * 2.0
    exact = k2 * (1 + 1j * w * beta) / ((k1 + k2) * (1 + 1j * w * beta) - w**2 * m)
    late = motion.displacement[-100:, 2, 2].values
    assert 0.5 * np.ptp(late) == pytest.approx(1e-3 * abs(exact), rel=1e-2)
    assert motion.attrs["energy_error"] < 1e-3


# ------------------------------------------------------------------ writing and bad input


def test_springs_survive_storage(model, tmp_path):
    s = structure(model, FOLD, HEAVY)
    case = fd.Case(s, [fd.Fix([5]), *SLACK], [fd.Force([2], (0, 0, 1e-3))])
    path = fd.trace(case)
    fd.save(path, tmp_path / "path.nc")
    again = fd.case_of(fd.load(tmp_path / "path.nc"))
    assert again.supports == case.supports
    assert "strain_springs" in fd.load(tmp_path / "path.nc")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "give nodes, for springs to the ground, or between"),
        ({"nodes": [0], "between": [(0, 1)]}, "give nodes, for springs to the ground, or between"),
        ({"nodes": [0], "stiffness": 0.0}, "stiffness = 0.0: must be greater than 0 N/m"),
        ({"nodes": [0], "stiffness": "k"}, 'stiffness = "k": must be a number'),
        ({"nodes": [0], "direction": "w"}, 'direction = "w": choose one of x, y'),
        ({"nodes": [0], "direction": (0, 0, 0)}, "direction = .*: must not be zero"),
        ({"nodes": [0], "rest_length": 1.0}, "rest_length = 1: only for springs along the line"),
        ({"between": [(0, 1)], "rest_length": -1.0}, "rest_length = -1.0: must be at least 0 m"),
        ({"between": (0,)}, r"between = \[0\]: must be two nodes"),
        ({"between": [(0, 0)]}, r"between\[0\] = \[0, 0\]: node 0 is listed twice"),
        ({"between": [(0, 1, 2)]}, r"between\[0\] = \[0, 1, 2\]: must be two nodes"),
        ({"between": "0, 1"}, "between = .*: must be two nodes, as in"),
    ],
)
def test_bad_springs(given, message):
    with pytest.raises(InputError, match=message):
        fd.Spring(**{"stiffness": 1.0, **given})


def test_springs_of_a_case_are_checked(model):
    s = structure(model)
    with pytest.raises(InputError, match=r"supports\[1\]\.nodes = \[99\]: node 99 is out of range"):
        fd.Case(s, [fd.Fix([0]), fd.Spring(1.0, [99])])
    with pytest.raises(InputError, match=r"supports\[0\]\.between\[1\] = \[0, 99\]: node 99 is"):
        fd.Case(s, [fd.Spring(1.0, between=[(0, 1), (0, 99)])])


def test_ends_that_coincide_need_a_direction():
    x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, -1, 0]]
    s = structure("bars and hinges", fd.Pattern(x, [[0, 1, 2], [3, 4, 5]]))
    with pytest.raises(InputError, match=r"between\[0\] = \[0, 3\]: these nodes coincide"):
        fd.Case(s, [fd.Spring(1.0, between=[(0, 3)])])
    assert fd.Case(s, [fd.Spring(1.0, between=[(0, 3)], direction="x")]).terms
