"""Motions with supports that move: base motion and imposed displacements."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import MASS, equal_steps, linear_law, oscillator

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS

OMEGA = 4.0
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
SMOOTH = fd.Ramp(duration=0.02, smooth=True)


LIGHT = fd.Sheet(1e6, 0.25, 0.01, 1.0)  # vibrates 30 times as fast


def miura(mass: str = "mixed_voronoi", sheet: fd.Sheet = SHEET) -> fd.Structure:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, sheet, bend_law="linear", fold_law="linear", mass=mass)


SUPPORTS = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]


@pytest.mark.parametrize("method", METHODS)
def test_oscillator_on_a_shaken_base(method):
    """x'' = w^2 (b - x) with b = B sin(p t) from rest, in closed form; observed order."""
    B, p = 0.01, 2.5
    spring = oscillator(linear_law(), MASS * OMEGA**2)
    shaken = fd.BaseMotion("x", fd.Harmonic(p / (2.0 * np.pi)), value=B)
    case = fd.Case(spring.structure, [*spring.supports, shaken])
    steps, errors = np.array([40, 80, 160, 320]), []
    for n in steps:
        motion = fd.simulate(case, 3.0, method, dt=3.0 / n, **equal_steps(method))
        t = motion.time.to_numpy()
        gain = OMEGA**2 / (OMEGA**2 - p**2)
        exact = B * gain * (np.sin(p * t) - p / OMEGA * np.sin(OMEGA * t))
        errors.append(float(np.abs(motion.displacement[:, 1, 0].to_numpy() - exact).max()))
        np.testing.assert_allclose(motion.displacement[:, 0, 0], B * np.sin(p * t), atol=1e-16)
        np.testing.assert_allclose(motion.velocity[:, 0, 0], B * p * np.cos(p * t), atol=1e-15)
        # the base drives its own mass and the spring
        force = -MASS * B * p**2 * np.sin(p * t) + MASS * OMEGA**2 * (
            motion.displacement[:, 0, 0] - motion.displacement[:, 1, 0]
        )
        first = (motion.support_node == 0) & (motion.support_axis == "x")
        np.testing.assert_allclose(motion.reaction[:, first][:, 0], force, atol=1e-12)
    assert observed_order(3.0 / steps, errors) == pytest.approx(METHODS[method].order, abs=0.15)


def second_derivative(t: float) -> float:
    return float(SMOOTH.derivatives(t)[2])


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_base_motion_is_gravity_in_the_moving_frame(mass):
    """u = b(t) + what a body force -M b'' makes on resting supports, to the integrator's order."""
    s, value, differences = miura(mass), 0.05, []
    damping = fd.Rayleigh(beta=1e-5)
    shaken = fd.Case(s, [*SUPPORTS, fd.BaseMotion("x", SMOOTH, value)], [], damping)
    body = fd.Gravity((-value, 0.0, 0.0), second_derivative)
    still = fd.Case(s, SUPPORTS, [body], damping)
    steps = np.array([400, 800, 1600])
    for n in steps:
        options = {"dt": 0.04 / n, "every": int(n) // 8}
        one = fd.simulate(shaken, 0.04, **options)
        other = fd.simulate(still, 0.04, **options)
        base = value * SMOOTH(one.time.to_numpy())
        relative = one.displacement.to_numpy() - base[:, None, None] * np.array([1.0, 0.0, 0.0])
        differences.append(np.abs(relative - other.displacement.to_numpy()).max())
    moved = np.abs(other.displacement.to_numpy()).max()
    assert moved > 1e-4
    assert differences[-1] < 1e-6 * moved
    assert observed_order(0.04 / steps, differences) > 3.7


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_energy_of_a_jolted_sheet(mass):
    """A ramp starts with a jolt: its energy comes from the support, and the audit closes."""
    errors, steps = [], np.array([25, 50, 75])
    pull = fd.Impose([6, 7, 8], "x", 1e-3, fd.Ramp(duration=0.05))
    case = fd.Case(miura(mass), [*SUPPORTS, pull], [], fd.Rayleigh(alpha=3.0, beta=1e-5))
    for n in steps:
        motion = fd.simulate(case, 0.04, dt=0.04 / n)
        assert float(motion.work[0]) == 0.0
        assert float(motion.kinetic[0]) > 0.0  # the pulled nodes move at once
        errors.append(motion.attrs["energy_error"])
    assert errors[-1] < 1e-5
    assert observed_order(0.04 / steps, errors) > 3.7


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_reactions_change_the_momentum(mass):
    """Sum of the reactions along x = d/dt of the momentum along x, by differences of order 4."""
    pull = fd.Impose([6, 7, 8], "x", 1e-3, fd.Ramp(duration=0.03, smooth=True))
    case = fd.Case(miura(mass), [*SUPPORTS, pull])
    n = 4000
    motion = fd.simulate(case, 0.02, dt=0.02 / n)
    p = np.array([(case.structure.mass @ v)[:, 0].sum() for v in motion.velocity.to_numpy()])
    h = 0.02 / n
    rate = (p[:-4] - 8 * p[1:-3] + 8 * p[3:-1] - p[4:]) / (12 * h)
    along = motion.reaction[:, motion.support_axis.to_numpy() == "x"].sum(axis=1).to_numpy()
    np.testing.assert_allclose(along[2:-2], rate, atol=1e-5 * np.abs(rate).max())


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_a_motion_goes_on_from_where_it_was_stored(mass):
    """Continued at `start` with the stored state, moving supports included."""
    pull = fd.Impose([6, 7, 8], "x", 1e-3, lambda t: np.sin(300.0 * t))
    base = fd.BaseMotion("z", fd.Harmonic(40.0), 1e-4)
    case = fd.Case(miura(mass), [*SUPPORTS, pull, base])
    whole = fd.simulate(case, 0.02, dt=1e-5, every=100)
    middle = fd.initial_state(whole, at=10)
    rest = fd.simulate(case, 0.01, dt=1e-5, every=100, initial=middle, start=0.01)
    np.testing.assert_allclose(rest.time, whole.time[10:], rtol=1e-14)
    for name in ("displacement", "velocity"):
        scale = float(np.abs(whole[name]).max())
        np.testing.assert_allclose(rest[name], whole[name][10:], rtol=0, atol=1e-11 * scale)


def test_a_function_is_differentiated():
    """Velocities and reactions of a function of time are those of the same formula built in."""
    pull = [
        fd.Impose([6, 7, 8], "x", 1e-3, history)
        for history in (fd.Harmonic(frequency=20.0), lambda t: np.sin(40.0 * np.pi * t))
    ]
    one, other = (
        fd.simulate(fd.Case(miura(), [*SUPPORTS, p]), 0.01, dt=1e-4, every=10) for p in pull
    )
    for name in ("displacement", "velocity", "reaction"):
        scale = float(np.abs(one[name]).max())
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-7 * scale)


def test_a_slow_pull_ends_in_equilibrium():
    """After a slow pull with strong damping, reactions balance and forces vanish elsewhere."""
    pull = fd.Impose([6, 7, 8], "x", 0.05, fd.Ramp(duration=5.0, smooth=True))
    case = fd.Case(miura(sheet=LIGHT), [*SUPPORTS, pull], [], fd.Rayleigh(alpha=6.0))
    motion = fd.simulate(case, 12.0, every=1.0)
    u = motion.displacement[-1].to_numpy()
    np.testing.assert_allclose(u[[6, 7, 8], 0], 0.05)
    force = case.structure.internal_force(u)
    scale = np.abs(force).max()
    np.testing.assert_allclose(force[~case.fixed], 0.0, atol=1e-5 * scale)
    np.testing.assert_allclose(motion.reaction[-1], force[case.fixed], atol=1e-5 * scale)
    np.testing.assert_allclose(motion.work[-1] - motion.dissipated[-1], case.structure.energy(u))


def test_refusals():
    s = miura()

    def run(support, **options):
        return fd.simulate(fd.Case(s, [*SUPPORTS, support]), 0.1, **options)

    with pytest.raises(fd.errors.InputError, match=r"jumps at t = 0\.05 s"):
        run(fd.Impose([6], "x", 1e-3, fd.Pulse(0.05)), initial=None)
    with pytest.raises(fd.errors.InputError, match=r"jumps at t = 0\.03 s"):
        run(fd.BaseMotion("x", fd.Step(0.03)))
    with pytest.raises(
        fd.errors.InputError, match=r"node 6 is imposed 0\.001 m along x at the start"
    ):
        run(fd.Impose([6], "x", 1e-3))
    with pytest.raises(fd.errors.InputError, match="fails at t = 0"):
        run(fd.Impose([6], "x", 1e-3, lambda t: 1.0 / t))
    u = np.zeros(s.nodes.shape)
    u[6, 0] = 1e-3
    held = run(fd.Impose([6], "x", 1e-3), initial=fd.State(displacement=u), dt=1e-4)
    np.testing.assert_array_equal(held.displacement[:, 6, 0], 1e-3)
    v = np.zeros(s.nodes.shape)
    v[0, 0] = 1.0
    with pytest.raises(fd.errors.InputError, match="velocity of node 0"):
        run(fd.Impose([6], "x", 1e-3, fd.Ramp(1.0)), initial=fd.State(velocity=v))
