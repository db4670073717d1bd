"""Implicit methods on linear systems: stability, numerical damping, energy, nodes without mass."""

from __future__ import annotations

import numpy as np
import pytest
from measured import order
from moving_sheets import IMPLICIT
from oscillators import LENGTH, MASS, damped, linear_law, place, pulled, released, spring

import foldyn as fd
from foldyn.dynamics.generalized_alpha import parameters
from foldyn.structures import ModelOptions

OMEGA = 4.0
K = MASS * OMEGA**2  # N/m


def chain(stiffness: list[float], mass: list[float], **damping: float) -> fd.Case:
    """Masses on linear springs along x, one after the other; node 0 is held."""
    count = np.arange(len(stiffness))
    structure = fd.Structure(
        nodes=LENGTH * np.outer(np.arange(len(count) + 1), [1.0, 0.0, 0.0]),
        bars=np.column_stack([count, count + 1]),
        bar_area=1e-4 * np.array(stiffness) / stiffness[0],
        sheet=fd.Sheet(stiffness[0] * LENGTH / 1e-4, 0.3, 0.01),
        options=ModelOptions(bar_law=linear_law()),
        node_mass=np.array([1.0, *mass]),
    )
    supports = [fd.Fix([0], "xyz"), fd.Fix(count + 1, "yz")]
    return fd.Case(structure, supports, damping=fd.Rayleigh(**damping))


def moved(*x: float) -> fd.State:
    return fd.State(np.outer([0.0, *x], [1.0, 0.0, 0.0]))


@pytest.mark.matrix
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
    motion = fd.simulate(case, 100 * dt, method=method, dt=dt, initial=moved(0.1, 0.1))
    exact = 0.1 * np.cos(slow * motion.time.values)
    assert np.abs(place(motion) - exact).max() < 0.1 * (slow * dt) ** 3 * 100 / 10
    shaken = fd.simulate(
        case, 5000 * dt, method=method, dt=dt, every_steps=10, initial=moved(1e-6, -1e-6)
    )
    assert np.abs(shaken.displacement).max() < 2e-6
    energy = (shaken.kinetic + shaken.strain_bars).values
    if method == "generalized_alpha":  # its velocity overshoots at first
        assert energy[-1] < energy[0]
    else:
        assert energy.max() < energy[0] * (1.0 + 1e-6)


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


def states(radius: float | None, wh: float, damping: float, count: int) -> np.ndarray:
    """(x, h v, h^2 a) (count + 1, 3) after each of some steps from 1e-4 m."""
    found = [1e-4 * np.array([1.0, 0.0, -(wh**2)])]
    for _ in range(count):
        found.append(amplification(radius, wh, damping) @ found[-1])
    return np.array(found)


@pytest.mark.usefixtures("unaudited")
@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("wh", [0.5, 10.0, 1e4])
@pytest.mark.parametrize(("method", "radius"), [("newmark", None), ("generalized_alpha", 0.6)])
def test_steps_are_those_of_the_amplification_matrix(method, radius, wh, damping):
    """Every state of a computed motion is the matrix times the last one."""
    dt = wh / OMEGA
    motion = fd.simulate(
        spring(OMEGA, alpha=2.0 * damping * OMEGA), 30 * dt, method=method, dt=dt,
        initial=released(1e-4),
        **({} if radius is None else {"spectral_radius": radius}),
    )  # fmt: skip
    exact = states(radius, wh, damping, 30)
    np.testing.assert_allclose(place(motion), exact[:, 0], rtol=1e-6, atol=1e-10)
    v = motion.velocity.values[:, 1, 0] * dt
    np.testing.assert_allclose(v, exact[:, 1], rtol=1e-6, atol=1e-10 * max(1.0, wh))


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:steps of 0.5 s do not resolve")
@pytest.mark.parametrize("method", ["newmark", "energy_momentum"])
def test_a_linear_system_keeps_its_energy_and_closes_its_balance(method):
    """Whatever the step: free, and with damping and a load the balance closes to rounding."""
    free = fd.simulate(spring(OMEGA), 50.0, method=method, dt=0.5, initial=released(0.1))
    energy = free.kinetic + free.strain_bars
    np.testing.assert_allclose(energy, float(energy[0]), rtol=1e-6)
    driven = pulled(spring(OMEGA, alpha=0.3, beta=0.02), 0.4, fd.Harmonic(frequency=0.3))
    motion = fd.simulate(driven, 50.0, method=method, dt=0.5)
    assert float(motion.dissipated[-1]) > 0.01
    assert motion.attrs["energy_error"] < 1e-6


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("beta", [0.0, 0.03])
def test_a_node_without_mass_is_in_equilibrium(method, beta):
    """Two springs with nothing between them are one of half the stiffness; explicit: refused."""
    case = chain([K, K], [0.0, MASS], beta=beta)
    with pytest.raises(fd.errors.InputError, match="node 1 is free but has no mass"):
        fd.simulate(case, 1.0, method="rk4")
    omega = np.sqrt(0.5 * K / MASS)
    steps, errors = [40, 80, 160], []
    for n in steps:
        motion = fd.simulate(case, 3.0, method=method, dt=3.0 / n, initial=moved(0.05, 0.1))
        x = motion.displacement.values[:, :, 0]
        exact = 0.1 * damped(motion.time.values, omega, 0.5 * beta * omega)
        errors.append(np.abs(x[:, 2] - exact).max())
        if beta == 0.0:
            np.testing.assert_allclose(x[:, 1], 0.5 * x[:, 2], atol=1e-6)
    assert errors[-1] < 2e-4
    assert order(steps, errors) > 1.8
