"""Implicit methods on linear systems: stability, numerical damping, energy, nodes without mass."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import LENGTH, MASS, linear_law, oscillator, released

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS
from foldyn.dynamics.generalized_alpha import parameters
from foldyn.structures import ModelOptions

IMPLICIT = [name for name, method in METHODS.items() if method.implicit]
K = 8.0  # N/m
OMEGA = np.sqrt(K / MASS)


def chain(stiffness: list[float], mass: list[float], **damping: float) -> fd.Case:
    """Masses on linear springs along x, one after the other; node 0 is held."""
    n = len(stiffness)
    nodes = np.zeros((n + 1, 3))
    nodes[:, 0] = LENGTH * np.arange(n + 1)
    structure = fd.Structure(
        nodes=nodes,
        bars=np.column_stack([np.arange(n), np.arange(1, n + 1)]),
        bar_area=1e-4 * np.array(stiffness) / stiffness[0],
        sheet=fd.Sheet(stiffness[0] * LENGTH / 1e-4, 0.3, 0.01),
        options=ModelOptions(bar_law=linear_law()),
        node_mass=np.array([1.0, *mass]),
    )
    supports = [fd.Fix([0], "xyz"), fd.Fix(range(1, n + 1), "yz")]
    return fd.Case(structure, supports, damping=fd.Rayleigh(**damping))


def moved(case: fd.Case, x: list[float]) -> fd.State:
    u = np.zeros(case.structure.nodes.shape)
    u[1:, 0] = x
    return fd.State(u)


@pytest.mark.filterwarnings("ignore:the energy balance")  # numerical damping is told
@pytest.mark.parametrize("method", IMPLICIT)
def test_a_step_a_thousand_times_the_critical_one(method):
    """Two masses, coupled a hundred million times as stiffly as they are held.

    The slow mode follows its cosine with the error of the step; the fast one, started too, grows
    in no way over 5000 steps.
    """
    case = chain([K, 1e8 * K], [MASS, MASS])
    dt = 1000.0 * fd.critical_step(case, "rk4")
    slow = np.sqrt(K / (2.0 * MASS))
    assert 0.05 < slow * dt < 0.5
    motion = fd.simulate(case, 100 * dt, method, dt=dt, initial=moved(case, [0.1, 0.1]))
    exact = 0.1 * np.cos(slow * motion.time.to_numpy())
    assert np.abs(motion.displacement[:, 1, 0] - exact).max() < 0.1 * (slow * dt) ** 3 * 100 / 10
    shaken = fd.simulate(
        case, 5000 * dt, method, dt=dt, every=10, initial=moved(case, [1e-6, -1e-6])
    )
    assert np.abs(shaken.displacement).max() < 2e-6
    energy = shaken.kinetic + shaken.strain_bars
    if method == "generalized_alpha":  # its velocity overshoots at first
        assert float(energy[-1]) < float(energy[0])
    else:
        assert float(energy.max()) < float(energy[0]) * (1.0 + 1e-6)


def amplification(radius: float | None, wh: float, damping: float = 0.0) -> np.ndarray:
    """Matrix of a step on (x, h v, h^2 a) of x'' + 2 damping w x' + w^2 x = 0, from the definition.

    Chung and Hulbert, J. Appl. Mech. 60, 1993, equations 2 to 7; radius None: Newmark.
    """
    am, af, beta, gamma = (0.0, 0.0, 0.25, 0.5) if radius is None else parameters(radius)
    c, k = 2.0 * damping * wh, wh**2
    new = [[1.0, 0.0, -beta], [0.0, 1.0, -gamma], [(1 - af) * k, (1 - af) * c, 1 - am]]
    old = [[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma], [-af * k, -af * c, -am]]
    return np.linalg.solve(new, old)


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.8, 1.0])
def test_spectral_radius_at_infinite_frequency(radius):
    """The parameters give the radius asked for, which no frequency exceeds."""
    found = np.abs(np.linalg.eigvals(amplification(radius, 1e6))).max()
    assert found == pytest.approx(radius, abs=2e-3)  # a triple eigenvalue: cube root of rounding
    for wh in np.geomspace(1e-3, 1e4, 60):
        assert np.abs(np.linalg.eigvals(amplification(radius, wh))).max() <= 1.0 + 1e-9
    assert parameters(1.0) == pytest.approx((0.5, 0.5, 0.25, 0.5))


@pytest.fixture
def unaudited(monkeypatch):
    """Let a motion lose all its energy, or gain some in an overshoot, without being stopped."""
    monkeypatch.setattr("foldyn.dynamics.motion.EXPLODED", np.inf)


@pytest.mark.usefixtures("unaudited")
@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("wh", [0.5, 10.0, 3000.0])
@pytest.mark.parametrize(("method", "radius"), [("newmark", None), ("generalized_alpha", 0.6)])
def test_steps_are_those_of_the_amplification_matrix(method, radius, wh, damping):
    """Every state of a computed motion is the matrix times the last one."""
    case = oscillator(linear_law(), K, alpha=2.0 * damping * OMEGA)
    dt = wh / OMEGA
    options = {} if radius is None else {"spectral_radius": radius}
    motion = fd.simulate(case, 30 * dt, method, dt=dt, initial=released(1e-4), **options)
    state = 1e-4 * np.array([1.0, 0.0, -(wh**2)])
    for k in range(1, 31):
        state = amplification(radius, wh, damping) @ state
        x, v = (float(motion[q][k, 1, 0]) for q in ("displacement", "velocity"))
        assert x == pytest.approx(state[0], abs=1e-6 * 1e-4)
        assert v * dt == pytest.approx(state[1], abs=1e-6 * 1e-4 * max(1.0, wh))


@pytest.mark.usefixtures("unaudited")
@pytest.mark.filterwarnings("ignore:the energy balance")
def test_high_frequencies_die_out_with_the_radius():
    """Observed at w h = 1e4: the decay per step is the radius."""
    case, dt = oscillator(linear_law(), K), 1e4 / OMEGA
    for radius, first, last in ((0.2, 4, 9), (0.5, 6, 20), (0.8, 20, 60)):
        motion = fd.simulate(
            case, last * dt, "generalized_alpha", dt=dt, spectral_radius=radius,
            initial=released(1e-4),
        )  # fmt: skip
        n = np.arange(first, last)
        x = np.abs(motion.displacement[:, 1, 0].to_numpy())[n]
        # a triple eigenvalue: |x| = r^n times a parabola in n
        states = np.array([1.0, 0.0, -1e8]) * 1e-4
        exact = []
        for _ in range(last):
            states = amplification(radius, 1e4) @ states
            exact.append(abs(states[0]))
        np.testing.assert_allclose(x, np.array(exact)[n - 1], rtol=1e-3)
        parabola = np.polyfit(n, x / radius**n, 2)
        assert np.abs(np.polyval(parabola, n) * radius**n / x - 1.0).max() < 0.02


@pytest.mark.filterwarnings("ignore:steps of 0.5 s do not resolve")
@pytest.mark.parametrize("method", ["newmark", "energy_momentum"])
def test_a_linear_system_keeps_its_energy_and_closes_its_balance(method):
    """Whatever the step: free, and with damping and a load the balance closes to rounding."""
    free = fd.simulate(oscillator(linear_law(), K), 50.0, method, dt=0.5, initial=released(0.1))
    energy = free.kinetic + free.strain_bars
    np.testing.assert_allclose(energy, float(energy[0]), rtol=1e-6)
    case = oscillator(linear_law(), K, alpha=0.3, beta=0.02)
    load = fd.Force([1], (0.4, 0.0, 0.0), fd.Harmonic(frequency=0.3))
    driven = fd.Case(case.structure, case.supports, [load], case.damping)
    motion = fd.simulate(driven, 50.0, method, dt=0.5)
    assert float(motion.dissipated[-1]) > 0.01
    assert motion.attrs["energy_error"] < 1e-6


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("beta", [0.0, 0.03])
def test_a_node_without_mass_is_in_equilibrium(method, beta):
    """Two springs with nothing between them are one of half the stiffness; explicit: refused."""
    case = chain([K, K], [0.0, MASS], beta=beta)
    with pytest.raises(fd.errors.InputError, match="node 1 is free but has no mass"):
        fd.simulate(case, 1.0)
    omega = np.sqrt(0.5 * K / MASS)
    ratio = 0.5 * beta * omega
    steps, errors = np.array([40, 80, 160]), []
    for n in steps:
        motion = fd.simulate(case, 3.0, method, dt=3.0 / n, initial=moved(case, [0.05, 0.1]))
        t = motion.time.to_numpy()
        damped, decay = omega * np.sqrt(1.0 - ratio**2), ratio * omega
        exact = np.cos(damped * t) + decay / damped * np.sin(damped * t)
        exact *= 0.1 * np.exp(-decay * t)
        x = motion.displacement[:, :, 0].to_numpy()
        errors.append(np.abs(x[:, 2] - exact).max())
        if beta == 0.0:
            np.testing.assert_allclose(x[:, 1], 0.5 * x[:, 2], atol=1e-6)
    assert errors[-1] < 2e-4
    assert observed_order(3.0 / steps, errors) > 1.8


def test_bad_arguments():
    case = oscillator(linear_law(), K)
    for options, message in (
        ({"method": "generalized_alpha", "spectral_radius": 1.2}, "at most 1"),
        ({"method": "generalized_alpha", "spectral_radius": "half"}, "must be a number"),
        ({"method": "newmark", "spectral_radius": 0.8}, "newmark has none"),
        ({"method": "rk4", "spectral_radius": 0.8}, "rk4 has none"),
        ({"method": "newmark", "tolerance": -1.0}, "tolerance = -1"),
        ({"method": "rk4", "tolerance": 1e-6}, "rk4 has fixed steps"),
    ):
        with pytest.raises(fd.errors.InputError, match=message):
            fd.simulate(case, 1.0, **options)
