"""Motions under loads that follow the sheet: exact motions, energy, reactions, in all methods."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning
from foldyn.linear.linearized import linearize

SHEET = fd.Sheet(1e7, 0.25, 0.01, 1.0)
SQUARE = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
P, MASS, SPIN = 0.02, 0.01, 3.0
IMPLICIT = [name for name, method in METHODS.items() if method.implicit]
BOX = fd.Pattern(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)],
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
)


def bars(pattern, sheet=SHEET, **more):
    return fd.discretize(
        pattern,
        sheet,
        mass="centroid",
        fold_law="linear",
        bend_law="linear",
        **more,
        preset="herkal",
    )


def shell(pattern, sheet=SHEET, **more):
    return fd.shell(pattern, sheet, divisions=2, fold_law="linear", **more)


def step(method: str, dt: float) -> dict[str, float]:
    return {"dt": dt} if METHODS[method].implicit else {}


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
    case = fd.Case(s, [], [fd.Pressure(P)])
    start = fd.State(velocity=np.cross([0.0, SPIN, 0.0], s.nodes - s.center_of_mass))
    found = fd.simulate(case, 1.0, method, every=0.1, initial=start, **step(method, 4e-3))
    center = np.einsum("n,tnc->tc", s.nodal_mass, found.displacement.values) / MASS
    t, a = found.time.values, P / MASS
    x = a / SPIN * (t - np.sin(SPIN * t) / SPIN)
    z = a / SPIN**2 * (1.0 - np.cos(SPIN * t))
    expected = np.stack([x, 0.0 * t, z], axis=1)
    error = np.abs(center - expected).max() / expected.max()
    bound = 1e-4 if METHODS[method].implicit else 2e-6
    assert error < (5e-7 if method == "rk4" else 5e-5 if make is shell else bound)
    assert found.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_a_hinged_panel_turns_under_a_constant_moment(method) -> None:
    """p b a^2 / 2 about its axis in any position: angle = moment t^2 / (2 I)."""
    s, p = bars(SQUARE), 0.05
    case = fd.Case(s, [fd.Fix([0, 3], "xyz")], [fd.Pressure(p)])
    found = fd.simulate(case, 1.0, method, every=0.1, **step(method, 2e-3))
    inertia = float(s.nodal_mass @ s.nodes[:, 0] ** 2)
    x = s.nodes[1] + found.displacement.values[:, 1]
    angle = np.unwrap(np.arctan2(x[:, 2], x[:, 0]))
    expected = 0.5 * (0.5 * p / inertia) * found.time.values**2
    assert expected[-1] == pytest.approx(3.0)
    np.testing.assert_allclose(angle[3:], expected[3:], rtol=1e-3)
    np.testing.assert_allclose(found.work, 0.5 * p * expected, rtol=2e-3, atol=1e-5)


def test_reactions_carry_the_pressure() -> None:
    """They are what changes the momentum, less the resultant of the pressure."""
    s = bars(SQUARE)
    case = fd.Case(s, [fd.Fix([0, 3], "xyz")], [fd.Pressure(P)])
    for method in ("rk4", "newmark"):
        found = fd.simulate(case, 0.3, method, dt=2e-4, every=1)
        momentum = np.einsum("n,tnc->tc", s.nodal_mass, found.velocity.values)
        change = np.gradient(momentum, found.time.values, axis=0)
        x = (s.nodes + found.displacement.values)[:, s.triangles]
        push = 0.5 * P * np.cross(x[:, :, 1] - x[:, :, 0], x[:, :, 2] - x[:, :, 0]).sum(axis=1)
        total = [
            found.reaction.values[:, (found.support_axis == axis).values].sum(axis=1)
            for axis in "xyz"
        ]
        error = np.abs(np.array(total).T + push - change)[2:-2].max()
        assert error < 1e-2 * P


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize("method", METHODS)
def test_the_energy_balance_closes(method) -> None:
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    s = bars(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0))
    k = float(s.fold_stiffness[0])
    loads = [
        fd.CreaseMoment("all", 0.3 * k, fd.HalfSine(0.2)),
        fd.Pressure(0.05, [0], fd.Ramp(0.1)),
        fd.Pressure(-0.02, [1]),
    ]
    case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")], loads, fd.Rayleigh(0.2, 1e-4))
    found = fd.simulate(case, 0.3, method, every=0.02, **step(method, 1e-3))
    assert abs(float(found.work[-1])) > 1e-5
    bound = {"energy_momentum": 1e-10, "central_difference": 2e-4}.get(method, 1e-5)
    assert found.attrs["energy_error"] < bound


@pytest.mark.parametrize("method", ["newmark", "generalized_alpha", "energy_momentum"])
def test_the_energy_balance_of_a_shell_closes(method) -> None:
    s = shell(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60))
    k = float(s.fold_stiffness[0])
    loads = [fd.CreaseMoment("all", 0.3 * k, fd.HalfSine(0.2)), fd.Pressure(0.5)]
    case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")], loads)
    found = fd.simulate(case, 0.2, method, dt=5e-4, every=40)
    assert found.attrs["energy_error"] < (1e-10 if method == "energy_momentum" else 1e-3)
    assert abs(float(found.work[-1])) > 1e-4


def test_a_motion_starts_with_a_shells_rotations_in_balance_with_the_moment() -> None:
    """Held where its moment and its fold balance, it stays: nothing rings."""
    s = shell(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60))
    k = float(s.fold_stiffness[0])
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    case = fd.Case(s, supports, [fd.CreaseMoment("all", 0.3 * k)])
    rest = fd.initial_state(fd.trace(case, load_factors=[0, 1]))
    found = fd.simulate(case, 0.2, "generalized_alpha", dt=0.01, every=1, initial=rest)
    moved = np.abs(found.displacement.values - rest.displacement).max()
    assert np.abs(rest.displacement).max() > 0.05
    assert moved < 1e-8


def test_rotations_of_a_shell_follow_a_moment_that_jumps() -> None:
    """They have no mass: gone within a nanosecond, or at once, the moment is the same."""
    fold = shell(fd.patterns.simple_fold(1.0, 1.0, 100), SHEET)
    whole, half = ([fd.CreaseMoment([0], 0.1 * part, fd.Pulse(0.1))] for part in (1.0, 0.5))
    half.append(fd.CreaseMoment([0], 0.05, fd.Pulse(0.1 - 1e-9)))
    one, other = (
        fd.simulate(fd.Case(fold, loads=loads), 0.2, "newmark", dt=0.004, every=10)
        for loads in (whole, half)
    )
    size = np.abs(one.displacement).max()
    np.testing.assert_allclose(one.displacement, other.displacement, rtol=0, atol=1e-7 * size)
    assert one.energy_error < 1e-3


@pytest.mark.parametrize("make", [bars, shell])
def test_work_of_pressure_on_a_closed_body_is_pressure_times_volume(make) -> None:
    s, p = make(BOX, fd.Sheet(1e5, 0.25, 0.01, 1.0)), 20.0
    case = fd.Case(s, [], [fd.Pressure(p)])
    method, dt = ("rk4", 2e-4) if make is bars else ("newmark", 5e-4)
    found = fd.simulate(case, 0.05, method, dt=dt, every=10)
    x = (s.nodes + found.displacement.values)[:, s.triangles]
    volume = np.einsum("stc,stc->s", x[:, :, 0], np.cross(x[:, :, 1], x[:, :, 2])) / 6.0
    assert volume.max() > 1.2
    off = np.abs(found.work.values - p * (volume - 1.0)).max() / float(found.work.max())
    assert off < (4e-9 if make is bars else 4e-6)
    momentum = np.einsum("n,tnc->tc", s.nodal_mass, found.velocity.values)
    assert np.abs(momentum).max() < 1e-10


@pytest.mark.parametrize("make", [bars, shell])
def test_a_step_matrix_takes_few_iterations(make) -> None:
    """With the symmetric part of the stiffness alone: the rest is small against M / h^2."""
    s = make(SQUARE)
    case = fd.Case(s, [fd.Fix([0, 3], "xyz")], [fd.Pressure(1.0)])
    found = fd.simulate(case, 0.2, "generalized_alpha", dt=4e-3, every=1)
    assert found.attrs["iterations"] < 8 * found.attrs["steps"]


@pytest.mark.parametrize("make", [bars, shell])
def test_pressure_leaves_the_frequency_of_a_fold_as_it_is(make) -> None:
    """Its moment about the crease does not depend on the angle; that of a weight does.

    About the state a = m g r cos(a) / k the stiffness of a weight is k + m g r sin(a).
    """
    pattern = fd.Pattern(
        [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]],
        [[0, 1, 4, 3], [1, 2, 5, 4]],
        {(1, 4): "V"},
    )
    k = 0.005
    s = make(pattern, crease_stiffness=k)
    held = [fd.Fix(np.flatnonzero(s.nodes[:, 0] < 1.0 + 1e-9).tolist(), "xyz")]
    inertia = float(s.nodal_mass @ np.maximum(s.nodes[:, 0] - 1.0, 0.0) ** 2)

    def first(load) -> float:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = fd.modes(fd.Case(s, held, [load]), state="equilibrium", count=1)
        return float(found.frequency[0])

    free = np.sqrt(k / inertia) / (2.0 * np.pi)
    error = 1e-4 if make is bars else 2e-3
    assert first(fd.Pressure(1.2 * k, [1])) == pytest.approx(free, rel=error)
    assert first(fd.CreaseMoment([0], -0.6 * k)) == pytest.approx(free, rel=error)
    dead = first(fd.TotalForce((0, 0, 1.2 * k), panels=[1]))
    angle = brentq(lambda f: f - 0.6 * np.cos(f), 0.0, 1.0)
    assert dead == pytest.approx(free * np.sqrt(1.0 + 0.6 * np.sin(angle)), rel=error)


def test_free_inflated_body_keeps_its_six_rigid_motions() -> None:
    case = fd.Case(bars(BOX, fd.Sheet(1e5, 0.25, 0.01, 1.0)), [], [fd.Pressure(20.0)])
    found = fd.modes(case, state="equilibrium", count=8)
    assert found.rigid.values.tolist() == [True] * 6 + [False] * 2


def test_a_state_of_a_path_takes_the_loads_by_its_factor() -> None:
    s = shell(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60))
    moment = 0.6 * float(s.fold_stiffness[0])
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    case = fd.Case(s, supports, [fd.CreaseMoment("all", moment)])
    state = fd.initial_state(fd.trace(case, load_factors=[0, 0.5, 1]), at=1)
    assert linearize(case, state, load_factor=0.5).residual < 1e-6
    with pytest.warns(FoldynWarning, match="load_factor of its pressure and moments"):
        assert linearize(case, state).residual > 0.01


def test_frequency_responses_about_a_loaded_state_agree_with_motions() -> None:
    """The direct one takes the stiffness of the loads, the stepped sine their forces."""
    pattern = fd.Pattern(
        [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]],
        [[0, 1, 4, 3], [1, 2, 5, 4]],
        {(1, 4): "V"},
    )
    s = bars(pattern, fd.Sheet(1e5, 0.25, 0.01, 1.0), crease_stiffness=0.005)
    held = [fd.Fix(np.flatnonzero(s.nodes[:, 0] < 1.0 + 1e-9).tolist(), "xyz")]
    loads = [fd.Pressure(0.004, [1]), fd.CreaseMoment([0], -0.002)]
    case, drive = fd.Case(s, held, loads, fd.Rayleigh(alpha=0.5)), fd.Force([2, 5], (0, 0, 1e-6))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        found = [
            fd.frf(case, drive, [0.15], state="equilibrium", method=method).receptance
            for method in ("direct", "stepped_sine")
        ]
        unloaded = fd.frf(case, drive, [0.15]).receptance
    direct, stepped, rest = (one.sel(node=2, axis="z").values[0] for one in (*found, unloaded))
    assert abs(stepped - direct) < 1e-3 * abs(direct)
    assert abs(rest - direct) > 0.1 * abs(direct)  # so that the state matters
