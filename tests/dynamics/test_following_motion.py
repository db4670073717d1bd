"""Motions under loads that follow the sheet: exact motions, energy, reactions, in all methods."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from measured import apart
from moving_sheets import FOLD_HELD, IMPLICIT, LINEAR, SHEET, spinning, steps_of
from scipy.optimize import brentq

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning
from foldyn.linear.linearized import linearize

STIFF, SOFT = fd.Sheet(1e7, 0.25, 0.01, 1.0), fd.Sheet(1e5, 0.25, 0.01, 1.0)
SQUARE = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
FOLD = fd.patterns.simple_fold()
LEAF = fd.Pattern(
    [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]], {(1, 4): "V"}
)
BOX = fd.Pattern(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)
P, MASS, SPIN = 0.02, 0.01, 3.0


def bars(pattern, sheet=STIFF, **more):
    return fd.discretize(pattern, sheet, mass="centroid", **LINEAR, **more, preset="herkal")


def shell(pattern, sheet=STIFF, **more):
    return fd.shell(pattern, sheet, divisions=2, fold_law="linear", **more)


def held_leaf(make, sheet=STIFF):
    """One panel held, the other free to turn about the crease; stiffness of this 5 mN m/rad."""
    s = make(LEAF, sheet, crease_stiffness=0.005)
    return s, [fd.Fix(np.flatnonzero(s.nodes[:, 0] < 1.0 + 1e-9).tolist(), "xyz")]


def turned_fold(part, s=None):
    """A fold under a part of its stiffness as a moment."""
    s = s or shell(FOLD)
    return fd.Case(s, FOLD_HELD, [fd.CreaseMoment("all", part * float(s.fold_stiffness[0]))])


@pytest.mark.parametrize(
    ("make", "method"),
    [*((bars, method) for method in METHODS), (shell, "newmark"), (shell, "energy_momentum")],
)
def test_a_spinning_panel_is_pushed_along_its_normal(make, method) -> None:
    """The normal turns with the spin w: the center of mass moves as under a force that turns.

    Mass and pressure have the same shares, so that nothing bends; a force that keeps its
    direction would take it more than twice as high.
    """
    s = make(SQUARE)
    case, start = fd.Case(s, [], [fd.Pressure(P)]), spinning(s, [0.0, SPIN, 0.0])
    found = fd.simulate(
        case, 1.0, method=method, interval=0.1, initial=start, **steps_of(method, 4e-3)
    )
    center = np.einsum("n,tnc->tc", s.nodal_mass, found.displacement.values) / MASS
    t, a = found.time.values, P / MASS
    x = a / SPIN * (t - np.sin(SPIN * t) / SPIN)
    z = a / SPIN**2 * (1.0 - np.cos(SPIN * t))
    bound = 1e-4 if METHODS[method].implicit else 2e-6
    bound = 5e-7 if method == "rk4" else 5e-5 if make is shell else bound
    assert apart(center, np.stack([x, 0.0 * t, z], axis=1)) < bound
    assert found.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_a_hinged_panel_turns_under_a_constant_moment(method) -> None:
    """p b a^2 / 2 about its axis in any position: angle = moment t^2 / (2 I)."""
    s, p = bars(SQUARE), 0.05
    case = fd.Case(s, [fd.Fix([0, 3], "xyz")], [fd.Pressure(p)])
    found = fd.simulate(case, 1.0, method=method, interval=0.1, **steps_of(method, 2e-3))
    inertia = float(s.nodal_mass @ s.nodes[:, 0] ** 2)
    x = s.nodes[1] + found.displacement.values[:, 1]
    angle = np.unwrap(np.arctan2(x[:, 2], x[:, 0]))
    expected = 0.5 * (0.5 * p / inertia) * found.time.values**2
    assert expected[-1] == pytest.approx(3.0)
    np.testing.assert_allclose(angle[3:], expected[3:], rtol=1e-3)
    np.testing.assert_allclose(found.work, 0.5 * p * expected, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_reactions_carry_the_pressure(method) -> None:
    """They are what changes the momentum, less the resultant of the pressure."""
    s = bars(SQUARE)
    case = fd.Case(s, [fd.Fix([0, 3], "xyz")], [fd.Pressure(P)])
    found = fd.simulate(case, 0.3, method=method, dt=2e-4, every_steps=1)
    momentum = np.einsum("n,tnc->tc", s.nodal_mass, found.velocity.values)
    change = np.gradient(momentum, found.time.values, axis=0)
    x = (s.nodes + found.displacement.values)[:, s.triangles]
    push = 0.5 * P * np.cross(x[:, :, 1] - x[:, :, 0], x[:, :, 2] - x[:, :, 0]).sum(axis=1)
    total = found.reaction.values.reshape(len(x), 2, 3).sum(axis=1)
    assert found.support_axis.values.tolist() == [*"xyz"] * 2
    assert np.abs(total + push - change)[2:-2].max() < 1e-2 * P


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize(
    ("make", "method"), [*((bars, name) for name in METHODS), *((shell, name) for name in IMPLICIT)]
)
def test_the_energy_balance_closes(make, method) -> None:
    s = make(FOLD, SHEET if make is bars else STIFF)
    loads = [
        fd.CreaseMoment("all", 0.3 * float(s.fold_stiffness[0]), fd.HalfSine(0.2)),
        fd.Pressure(0.05 if make is bars else 0.5, [0], fd.Ramp(0.1)),
        fd.Pressure(-0.02, [1]),
    ]
    case = fd.Case(s, FOLD_HELD, loads, fd.Rayleigh(0.2, 1e-4) if make is bars else ())
    found = fd.simulate(case, 0.3, method=method, interval=0.02, **steps_of(method, 5e-4))
    assert abs(float(found.work[-1])) > 1e-5
    usual = 1e-5 if make is bars else 1e-3
    bound = {"energy_momentum": 1e-10, "central_difference": 2e-4}.get(method, usual)
    assert found.attrs["energy_error"] < bound


def test_a_motion_starts_with_a_shells_rotations_in_balance_with_the_moment() -> None:
    """Held where its moment and its fold balance, it stays: nothing rings."""
    case = turned_fold(0.3)
    rest = fd.initial_state(fd.trace(case, load_factors=[0, 1]))
    found = fd.simulate(case, 0.2, method="generalized_alpha", dt=0.01, every_steps=1, initial=rest)
    assert np.abs(rest.displacement).max() > 0.05
    assert np.abs(found.displacement.values - rest.displacement).max() < 1e-8


def test_rotations_of_a_shell_follow_a_moment_that_jumps() -> None:
    """They have no mass: gone within a nanosecond, or at once, the moment is the same."""
    pulses = [(1.0, 0.1)], [(0.5, 0.1), (0.5, 0.1 - 1e-9)]
    s = shell(fd.patterns.simple_fold(dihedral=100))
    one, other = (
        fd.simulate(
            fd.Case(s, loads=[fd.CreaseMoment([0], 0.1 * p, fd.Pulse(end)) for p, end in parts]),
            0.2, method="newmark", dt=0.004, every_steps=10,
        )
        for parts in pulses
    )  # fmt: skip
    assert apart(other, one) < 1e-7
    assert one.energy_error < 1e-3


@pytest.mark.parametrize("make", [bars, shell])
def test_work_of_pressure_on_a_closed_body_is_pressure_times_volume(make) -> None:
    s, p = make(BOX, SOFT), 20.0
    method, dt = ("rk4", 2e-4) if make is bars else ("newmark", 5e-4)
    found = fd.simulate(
        fd.Case(s, [], [fd.Pressure(p)]), 0.05, method=method, dt=dt, every_steps=10
    )
    x = (s.nodes + found.displacement.values)[:, s.triangles]
    volume = np.einsum("stc,stc->s", x[:, :, 0], np.cross(x[:, :, 1], x[:, :, 2])) / 6.0
    assert volume.max() > 1.2
    assert apart(p * (volume - 1.0), found.work.values) < (4e-9 if make is bars else 4e-6)
    momentum = np.einsum("n,tnc->tc", s.nodal_mass, found.velocity.values)
    assert np.abs(momentum).max() < 1e-10


@pytest.mark.parametrize("make", [bars, shell])
def test_a_step_matrix_takes_few_iterations(make) -> None:
    """With the symmetric part of the stiffness alone: the rest is small against M / h^2."""
    case = fd.Case(make(SQUARE), [fd.Fix([0, 3], "xyz")], [fd.Pressure(1.0)])
    found = fd.simulate(case, 0.2, method="generalized_alpha", dt=4e-3, every_steps=1)
    assert found.attrs["iterations"] < 8 * found.attrs["steps"]


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("make", [bars, shell])
def test_pressure_leaves_the_frequency_of_a_fold_as_it_is(make) -> None:
    """Its moment about the crease does not depend on the angle; that of a weight does.

    About the state a = m g r cos(a) / k the stiffness of a weight is k + m g r sin(a).
    """
    (s, held), k = held_leaf(make), 0.005
    inertia = float(s.nodal_mass @ np.maximum(s.nodes[:, 0] - 1.0, 0.0) ** 2)
    free = np.sqrt(k / inertia) / (2.0 * np.pi)
    angle = brentq(lambda f: f - 0.6 * np.cos(f), 0.0, 1.0)
    for load, ratio in (
        (fd.Pressure(1.2 * k, [1]), 1.0),
        (fd.CreaseMoment([0], -0.6 * k), 1.0),
        (fd.TotalForce((0, 0, 1.2 * k), panels=[1]), np.sqrt(1.0 + 0.6 * np.sin(angle))),
    ):
        found = fd.modes(fd.Case(s, held, [load]), state="equilibrium", count=1).frequency[0]
        assert float(found) == pytest.approx(ratio * free, rel=1e-4 if make is bars else 2e-3)


def test_free_inflated_body_keeps_its_six_rigid_motions() -> None:
    case = fd.Case(bars(BOX, SOFT), [], [fd.Pressure(20.0)])
    found = fd.modes(case, state="equilibrium", count=8)
    assert found.rigid.values.tolist() == [True] * 6 + [False] * 2


def test_a_state_of_a_path_takes_the_loads_by_its_factor() -> None:
    case = turned_fold(0.6)
    state = fd.initial_state(fd.trace(case, load_factors=[0, 0.5, 1]), at=1)
    assert linearize(case, state, load_factor=0.5).residual < 1e-6
    with pytest.warns(FoldynWarning, match="load_factor of its pressure and moments"):
        assert linearize(case, state).residual > 0.01


@pytest.mark.matrix
def test_frequency_responses_about_a_loaded_state_agree_with_motions() -> None:
    """The direct one takes the stiffness of the loads, the stepped sine their forces."""
    s, held = held_leaf(bars, SOFT)
    loads = [fd.Pressure(0.004, [1]), fd.CreaseMoment([0], -0.002)]
    case, drive = fd.Case(s, held, loads, fd.Rayleigh(alpha=0.5)), fd.Force([2, 5], (0, 0, 1e-6))

    def response(**options):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = fd.frf(case, drive, frequencies=[0.15], **options).receptance
        return found.sel(node=2, axis="z").values[0]

    direct, stepped = (
        response(state="equilibrium", method=name) for name in ("direct", "stepped_sine")
    )
    assert abs(stepped - direct) < 1e-3 * abs(direct)
    assert abs(response() - direct) > 0.1 * abs(direct)  # so that the state matters
