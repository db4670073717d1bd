"""Motions with known answers: order of convergence, energy law, damping, loads."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import MASS, duffing_law, equal_steps, linear_law, oscillator, released
from scipy import special

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS

K = 8.0  # N/m
OMEGA = np.sqrt(K / MASS)


@pytest.fixture(scope="module")
def spring() -> fd.Case:
    return oscillator(linear_law(), K)


def end(case: fd.Case, dt: float, duration: float, initial: fd.State, method: str) -> float:
    motion = fd.simulate(case, duration, method, dt=dt, initial=initial, **equal_steps(method))
    return float(motion.displacement[-1, 1, 0])


@pytest.mark.parametrize("method", METHODS)
def test_order_on_the_linear_oscillator(spring, method):
    """x = a cos(w t): the error at a fixed time falls with the method's order."""
    duration, a = 2.0, 0.1
    steps = np.array([60, 120, 240, 480])
    errors = []
    for n in steps:
        motion = fd.simulate(
            spring, duration, method, dt=duration / n, initial=released(a), **equal_steps(method)
        )
        phase = OMEGA * motion.time.to_numpy()
        u = motion.displacement[:, 1, 0].to_numpy() - a * np.cos(phase)
        v = motion.velocity[:, 1, 0].to_numpy() / OMEGA + a * np.sin(phase)
        errors.append(np.hypot(u, v).max())
    assert observed_order(duration / steps, errors) == pytest.approx(METHODS[method].order, abs=0.1)


@pytest.mark.parametrize("method", METHODS)
def test_order_on_the_duffing_oscillator(method):
    """x'' + w^2 (x + c x^3) = 0 has a Jacobi elliptic cosine as its motion.

    With x(0) = a, x = a cn(W t, m), W^2 = w^2 (1 + c a^2), m = c a^2 / (2 (1 + c a^2)).
    """
    cubic = 40.0 / 2.0**2  # of the displacement, 1/m^2; of the strain e = x / L: times L^2
    case = oscillator(duffing_law(40.0), K)
    a, duration = 0.3, 2.0
    fast = np.sqrt(OMEGA**2 * (1.0 + cubic * a**2))
    m = cubic * a**2 / (2.0 * (1.0 + cubic * a**2))
    exact = a * special.ellipj(fast * duration, m)[1]
    steps = np.array([80, 160, 320, 640])
    errors = [end(case, duration / n, duration, released(a), method) - exact for n in steps]
    assert observed_order(duration / steps, errors) == pytest.approx(METHODS[method].order, abs=0.1)
    assert abs(errors[-1]) < 10.0 ** (1 - 2 * METHODS[method].order) * a


def test_rk4_loses_energy_with_the_fifth_power_of_the_step(spring):
    """|R(i w h)|^2 = 1 - (w h)^6 / 72 + ...: over a fixed time the loss is T w (w h)^5 / 72."""
    duration = 10.0
    steps = np.array([200, 400, 800])
    lost = []
    for n in steps:
        motion = fd.simulate(spring, duration, dt=duration / n, initial=released(0.1))
        energy = motion.kinetic + motion.strain_bars
        lost.append(float(1.0 - energy[-1] / energy[0]))
    h = duration / steps
    assert observed_order(h, lost) == pytest.approx(5.0, abs=0.05)
    np.testing.assert_allclose(lost[-1], duration * OMEGA * (OMEGA * h[-1]) ** 5 / 72, rtol=0.02)


def damped(t: np.ndarray, ratio: float) -> np.ndarray:
    """x = a e^(-z w t) (cos + z w / wd sin) for x(0) = a = 0.1, x'(0) = 0."""
    wd, decay = OMEGA * np.sqrt(1.0 - ratio**2), ratio * OMEGA
    return 0.1 * np.exp(-decay * t) * (np.cos(wd * t) + decay / wd * np.sin(wd * t))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("alpha", "beta"), [(0.3, 0.0), (0.0, 0.02), (0.3, 0.02)])
def test_damped_motion(alpha, beta, method):
    """The damping ratio is alpha / 2w + beta w / 2; the order holds with damping too."""
    case = oscillator(linear_law(), K, alpha=alpha, beta=beta)
    ratio = alpha / (2.0 * OMEGA) + beta * OMEGA / 2.0
    steps, errors = np.array([300, 600, 1200, 2400]), []
    if METHODS[method].order == 5:
        steps //= 6  # else rounding hides the order
    for n in steps:
        motion = fd.simulate(
            case, 3.0, method, dt=3.0 / n, initial=released(0.1), **equal_steps(method)
        )
        exact = damped(motion.time.to_numpy(), ratio)
        errors.append(float(np.abs(motion.displacement[:, 1, 0].to_numpy() - exact).max()))
    order = METHODS[method].order
    assert observed_order(3.0 / steps, errors) == pytest.approx(order, abs=0.1)
    assert errors[-1] < (1e-5 if order == 2 else 1e-10)
    energy = motion.kinetic + motion.strain_bars
    np.testing.assert_allclose(motion.dissipated, energy[0] - energy, atol=10 * errors[-1])


def test_constant_force_and_its_reaction(spring):
    """x = F/k (1 - cos w t); the support feels - k x."""
    case = fd.Case(spring.structure, spring.supports, [fd.Force([1], (0.4, 0.0, 0.0))])
    motion = fd.simulate(case, 3.0, dt=1e-3)
    x = 0.4 / K * (1.0 - np.cos(OMEGA * motion.time))
    np.testing.assert_allclose(motion.displacement[:, 1, 0], x, atol=1e-11)
    np.testing.assert_allclose(motion.work, 0.4 * x, atol=1e-11)
    held = (motion.support_node == 0) & (motion.support_axis == "x")
    np.testing.assert_allclose(motion.reaction[:, held.to_numpy()][:, 0], -K * x, atol=1e-10)


def test_harmonic_force(spring):
    """Forced far from resonance: particular plus free motion."""
    f = 1.5
    w = 2.0 * np.pi * f
    load = fd.Force([1], (0.4, 0.0, 0.0), fd.Harmonic(frequency=f))
    motion = fd.simulate(fd.Case(spring.structure, spring.supports, [load]), 3.0, dt=1e-3)
    amplitude = 0.4 / MASS / (OMEGA**2 - w**2)
    t = motion.time
    exact = amplitude * (np.sin(w * t) - w / OMEGA * np.sin(OMEGA * t))
    np.testing.assert_allclose(motion.displacement[:, 1, 0], exact, atol=1e-9)


def test_histories_are_evaluated_at_stage_times(spring):
    """The times are t_n + c dt with t_n = n dt, to the last bit."""
    seen = []

    def history(t):
        seen.append(np.asarray(t, float).ravel())
        return np.zeros_like(t)

    dt, steps = 0.003, 700
    load = fd.Force([1], (1.0, 0.0, 0.0), history)
    fd.simulate(fd.Case(spring.structure, spring.supports, [load]), steps * dt, dt=dt)
    n = np.arange(steps)
    wanted = np.unique(np.concatenate([n * dt, n * dt + 0.5 * dt, n * dt + dt]))
    assert np.isin(wanted, np.concatenate(seen)).all()


def test_superlinear_law_lowers_the_order_to_seven_thirds():
    """A restoring force |u|^(4/3) is not smooth where u crosses zero.

    Near a crossing u = v t, so the force is (v t)^(4/3) and a step across it errs by dt^(7/3)
    times a factor that depends on where in the step the crossing falls; a fixed time holds a
    fixed number of crossings. Amplitudes are varied to average over that factor.
    """
    law = fd.CustomBarLaw(
        energy_of=lambda s: 3.0 / 7.0 * abs(s - 1.0) ** (7.0 / 3.0),
        stress_of=lambda s: (s - 1.0) * abs(s - 1.0) ** (1.0 / 3.0) / s,
        slope_of=lambda s: 4.0 / 3.0 * abs(s - 1.0) ** (1.0 / 3.0) / s**2,
        name="superlinear bar",
    )
    case, duration = oscillator(law, 40.0), 4.0
    steps = 2 ** np.arange(8, 13)
    errors = np.zeros(len(steps))
    for a in np.linspace(0.2, 0.4, 24):
        exact = end(case, duration / 2**16, duration, released(a), "rk4")
        found = [end(case, duration / n, duration, released(a), "rk4") for n in steps]
        errors += (np.array(found) - exact) ** 2
    order = observed_order(duration / steps, np.sqrt(errors))
    assert order == pytest.approx(7.0 / 3.0, abs=0.2)
