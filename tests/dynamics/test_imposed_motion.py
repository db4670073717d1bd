"""Motions with supports that move: base motion and imposed displacements."""

from __future__ import annotations

import numpy as np
import pytest
from measured import apart, order
from moving_sheets import CELL_HELD, HEAVY, LINEAR, SHEET, cell, equal_steps
from oscillators import MASS, place, spring

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

OMEGA = 4.0
SMOOTH = fd.Ramp(duration=0.02, smooth=True)
MASSES = pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])


def miura(mass: str = "mixed_voronoi", sheet: fd.Sheet = HEAVY) -> fd.Structure:
    return cell(sheet=sheet, mass=mass, preset="plate", **LINEAR)


def moved(s, *supports, **parts) -> fd.Case:
    return fd.Case(s, [*CELL_HELD, *supports], **parts)


def pull(history=None, value: float = 1e-3) -> fd.Impose:
    return fd.Impose([6, 7, 8], "x", value, history)


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_oscillator_on_a_shaken_base(method):
    """x'' = w^2 (b - x) with b = B sin(p t) from rest, in closed form; observed order."""
    B, p, case = 0.01, 2.5, spring(OMEGA)
    shaken = fd.BaseMotion("x", fd.Harmonic(p / (2.0 * np.pi)), value=B)
    case = case.altered(supports=[*case.supports, shaken])
    steps, errors = [40, 80, 160, 320], []
    for n in steps:
        motion = fd.simulate(case, 3.0, method=method, dt=3.0 / n, **equal_steps(method))
        t, base = motion.time.values, motion.displacement.values[:, 0, 0]
        gain = OMEGA**2 / (OMEGA**2 - p**2)
        exact = B * gain * (np.sin(p * t) - p / OMEGA * np.sin(OMEGA * t))
        errors.append(np.abs(place(motion) - exact).max())
        np.testing.assert_allclose(base, B * np.sin(p * t), atol=1e-16)
        np.testing.assert_allclose(motion.velocity[:, 0, 0], B * p * np.cos(p * t), atol=1e-15)
        # the base drives its own mass and the spring
        force = -MASS * B * p**2 * np.sin(p * t) + MASS * OMEGA**2 * (base - place(motion))
        first = ((motion.support_node == 0) & (motion.support_axis == "x")).values
        np.testing.assert_allclose(motion.reaction.values[:, first][:, 0], force, atol=1e-12)
    assert order(steps, errors) == pytest.approx(METHODS[method].order, abs=0.15)


@pytest.mark.matrix
@MASSES
def test_base_motion_is_gravity_in_the_moving_frame(mass):
    """u = b(t) + what a body force -M b'' makes on resting supports, to the integrator's order."""
    s, value, differences = miura(mass), 0.05, []
    damping = fd.Rayleigh(beta=1e-5)
    shaken = moved(s, fd.BaseMotion("x", SMOOTH, value), damping=damping)
    body = fd.Gravity((-value, 0.0, 0.0), lambda t: float(SMOOTH.derivatives(t)[2]))
    still = moved(s, loads=[body], damping=damping)
    steps = [400, 800, 1600]
    for n in steps:
        one, other = (
            fd.simulate(case, 0.04, method="rk4", dt=0.04 / n, every_steps=n // 8)
            for case in (shaken, still)
        )
        base = value * np.multiply.outer(SMOOTH(one.time.values), [[1.0, 0.0, 0.0]])
        differences.append(apart(one.displacement.values - base, other.displacement.values))
    assert np.abs(other.displacement).max() > 1e-4
    assert differences[-1] < 1e-6
    assert order(steps, differences) > 3.7


@MASSES
def test_energy_of_a_jolted_sheet(mass):
    """A ramp starts with a jolt: its energy comes from the support, and the audit closes."""
    case = moved(miura(mass), pull(fd.Ramp(0.05)), damping=fd.Rayleigh(alpha=3.0, beta=1e-5))
    steps, errors = [25, 50, 75], []
    for n in steps:
        motion = fd.simulate(case, 0.04, method="rk4", dt=0.04 / n)
        assert float(motion.work[0]) == 0.0
        assert float(motion.kinetic[0]) > 0.0  # the pulled nodes move at once
        errors.append(motion.attrs["energy_error"])
    assert errors[-1] < 1e-5
    assert order(steps, errors) > 3.7


@MASSES
def test_reactions_change_the_momentum(mass):
    """Sum of the reactions along x = d/dt of the momentum along x, by differences of order 4."""
    case, h = moved(miura(mass), pull(fd.Ramp(0.03, smooth=True))), 0.02 / 4000
    motion = fd.simulate(case, 0.02, method="rk4", dt=h)
    p = np.array([(case.structure.mass @ v)[:, 0].sum() for v in motion.velocity.values])
    rate = (p[:-4] - 8 * p[1:-3] + 8 * p[3:-1] - p[4:]) / (12 * h)
    along = motion.reaction.values[:, motion.support_axis.values == "x"].sum(axis=1)
    assert apart(along[2:-2], rate) < 1e-5


def test_a_function_is_differentiated():
    """Velocities and reactions of a function of time are those of the same formula built in."""
    one, other = (
        fd.simulate(moved(miura(), pull(history)), 0.01, method="rk4", dt=1e-4, every_steps=10)
        for history in (fd.Harmonic(frequency=20.0), lambda t: np.sin(40.0 * np.pi * t))
    )
    for name in ("displacement", "velocity", "reaction"):
        assert apart(other, one, name) < 1e-7


def test_a_slow_pull_ends_in_equilibrium():
    """After a slow pull with strong damping, reactions balance and forces vanish elsewhere."""
    slow = pull(fd.Ramp(duration=5.0, smooth=True), 0.05)
    case = moved(miura(sheet=SHEET), slow, damping=fd.Rayleigh(alpha=6.0))
    end = fd.simulate(case, 12.0, method="rk4", interval=1.0).isel(time=-1)
    u = end.displacement.values
    np.testing.assert_allclose(u[[6, 7, 8], 0], 0.05)
    force = case.structure.internal_force(u)
    wanted = np.zeros_like(force)
    wanted[case.fixed] = end.reaction
    assert apart(force, wanted) < 1e-5
    np.testing.assert_allclose(end.work - end.dissipated, case.structure.energy(u))


def one_at(node, x) -> np.ndarray:
    return np.outer(np.arange(13) == node, [x, 0.0, 0.0])


@pytest.mark.parametrize(
    ("support", "initial", "words"),
    [
        (fd.Impose([6], "x", 1e-3, fd.Pulse(0.05)), None, r"jumps at t = 0\.05 s"),
        (fd.BaseMotion("x", fd.Step(0.03)), None, r"jumps at t = 0\.03 s"),
        (fd.Impose([6], "x", 1e-3), None, r"node 6 is imposed 0\.001 m along x at the start"),
        (fd.Impose([6], "x", 1e-3, lambda t: 1.0 / t), None, "fails at t = 0"),
        (
            fd.Impose([6], "x", 1e-3, fd.Ramp(1.0)),
            fd.State(velocity=one_at(0, 1.0)),
            "velocity of node 0",
        ),
    ],
)
def test_refusals(support, initial, words):
    with pytest.raises(InputError, match=words):
        fd.simulate(moved(miura(), support), 0.1, method="rk4", initial=initial)


def test_what_is_imposed_from_the_start_stays():
    start = fd.State(displacement=one_at(6, 1e-3))
    held = fd.simulate(
        moved(miura(), fd.Impose([6], "x", 1e-3)), 0.1, method="rk4", initial=start, dt=1e-4
    )
    np.testing.assert_array_equal(held.displacement[:, 6, 0], 1e-3)
