"""Motions with known answers: order of convergence, energy law, damping, loads."""

from __future__ import annotations

import numpy as np
import pytest
from measured import order
from moving_sheets import equal_steps
from oscillators import damped, duffing_law, oscillator, place, pulled, released, spring
from scipy import special

import foldyn as fd
from foldyn.dynamics import METHODS
from pairwise import beyond

OMEGA = 4.0
K = 8.0  # N/m
SPRING = spring(OMEGA)


@pytest.mark.matrix
@pytest.mark.parametrize("cubic", [0.0, 40.0])
@pytest.mark.parametrize("method", METHODS)
def test_order_on_linear_and_duffing_oscillators(method, cubic):
    """x'' + w^2 (x + c x^3) = 0 has a Jacobi elliptic cosine as its motion.

    With x(0) = a, x = a cn(W t, m), W^2 = w^2 (1 + c a^2), m = c a^2 / (2 (1 + c a^2)).
    """
    c, a, duration = cubic / 2.0**2, 0.3, 2.0  # of e = x / L: times L^2
    case = oscillator(duffing_law(cubic), K)
    fast = OMEGA * np.sqrt(1.0 + c * a**2)
    steps, errors = [80, 160, 320, 640], []
    for n in steps:
        motion = fd.simulate(
            case,
            duration,
            method=method,
            dt=duration / n,
            initial=released(a),
            **equal_steps(method),
        )
        m = c * a**2 / (2.0 * (1.0 + c * a**2))
        sn, cn, dn, _ = special.ellipj(fast * motion.time.values, m)
        v = motion.velocity.values[:, 1, 0] / fast + a * sn * dn
        errors.append(np.hypot(place(motion) - a * cn, v).max())
    assert order(steps, errors) == pytest.approx(METHODS[method].order, abs=0.1)
    assert errors[-1] < 10.0 ** (1 - 2 * METHODS[method].order) * a


@pytest.mark.parametrize("masses", [1, 3])
@pytest.mark.parametrize("method", METHODS)
def test_masses_on_springs_without_any_bar(method, masses):
    """m x'' + k x = F, from rest: x = (F / k) (1 - cos(w t)), wherever a mass stands."""
    structure = fd.Structure(
        np.arange(masses)[:, None] * [[2.0, 0.0, 0.0]], np.zeros((0, 2), int), np.zeros(0),
        fd.Sheet(1e9, 0.3, 0.01), node_mass=np.full(masses, 0.5),
    )  # fmt: skip
    nodes = list(range(masses))
    load = fd.Force(nodes, (0.0, 0.0, 0.1))
    case = fd.Case(structure, [fd.Spring(K, nodes=nodes)], [load])
    motion = fd.simulate(case, 1.0, method=method, dt=2e-3)
    exact = 0.1 / K * (1.0 - np.cos(OMEGA * motion.time.values))
    moved = motion.displacement.values[:, :, 2].T
    np.testing.assert_allclose(moved, np.tile(exact, (masses, 1)), atol=2e-5 * 0.1 / K)


@pytest.mark.matrix
def test_rk4_loses_energy_with_the_fifth_power_of_the_step():
    """|R(i w h)|^2 = 1 - (w h)^6 / 72 + ...: over a fixed time the loss is T w (w h)^5 / 72."""
    steps, lost = np.array([200, 400, 800]), []
    for n in steps:
        motion = fd.simulate(SPRING, 10.0, method="rk4", dt=10.0 / n, initial=released(0.1))
        energy = motion.kinetic + motion.strain_bars
        lost.append(float(1.0 - energy[-1] / energy[0]))
    assert order(steps, lost) == pytest.approx(5.0, abs=0.05)
    exact = 10.0 * OMEGA * (OMEGA * 10.0 / steps[-1]) ** 5 / 72
    np.testing.assert_allclose(lost[-1], exact, rtol=0.02)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("alpha", "beta", "method"),
    [
        *((0.3, 0.02, method) for method in METHODS),
        *beyond([(*one, method) for one in ((0.3, 0.0), (0.0, 0.02)) for method in METHODS], 4),
    ],
)
def test_damped_motion(alpha, beta, method):
    """The damping ratio is alpha / 2w + beta w / 2; the order holds with damping too."""
    case = spring(OMEGA, alpha=alpha, beta=beta)
    steps, errors = np.array([300, 600, 1200, 2400]), []
    if METHODS[method].order > 4:
        steps //= 6  # else rounding hides the order
    for n in steps:
        motion = fd.simulate(
            case, 3.0, method=method, dt=3.0 / n, initial=released(0.1), **equal_steps(method)
        )
        ratio = alpha / (2.0 * OMEGA) + beta * OMEGA / 2.0
        exact = 0.1 * damped(motion.time.values, OMEGA, ratio)
        errors.append(np.abs(place(motion) - exact).max())
    assert order(steps, errors) == pytest.approx(METHODS[method].order, abs=0.1)
    angle = OMEGA * 3.0  # the error over it is a part of the vibration in one step to the order
    assert errors[-1] < 0.1 * angle / 3.0 * (angle / steps[-1]) ** METHODS[method].order
    energy = motion.kinetic + motion.strain_bars
    np.testing.assert_allclose(motion.dissipated, energy[0] - energy, atol=10 * errors[-1])


def test_histories_are_evaluated_at_stage_times():
    """The times are t_n + c dt with t_n = n dt, to the last bit."""
    seen = []

    def history(t):
        seen.append(np.asarray(t, float).ravel())
        return np.zeros_like(t)

    dt, n = 0.003, np.arange(700)
    fd.simulate(pulled(SPRING, 1.0, history), 700 * dt, method="rk4", dt=dt)
    wanted = np.unique(np.concatenate([n * dt, n * dt + 0.5 * dt, n * dt + dt]))
    assert np.isin(wanted, np.concatenate(seen)).all()


@pytest.mark.matrix
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
    case, steps = oscillator(law, 40.0), 2 ** np.arange(8, 13)

    def end(n, a):
        return place(fd.simulate(case, 4.0, method="rk4", dt=4.0 / n, initial=released(a)))[-1]

    ends = np.array([[end(n, a) for n in (*steps, 2**15)] for a in np.linspace(0.2, 0.4, 12)])
    errors = np.linalg.norm(ends[:, :-1] - ends[:, -1:], axis=0)
    assert order(steps, errors) == pytest.approx(7.0 / 3.0, abs=0.2)
