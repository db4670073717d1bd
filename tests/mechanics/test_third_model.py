"""A model that the package does not know goes through statics, motions and modes."""

from __future__ import annotations

import numpy as np
import pytest
from springs import Net

import foldyn as fd

K, MASS, ARM = 50.0, 0.2, 1.0
HELD = np.array([[ARM, 0.0, 0.0], [-ARM, 0.0, 0.0], [0.0, ARM, 0.0], [0.0, -ARM, 0.0],
                 [0.0, 0.0, ARM], [0.0, 0.0, -ARM]])  # fmt: skip


def star(loads=(), **damping):
    """A point on six springs along the axes: 2 k in each direction, for small motions."""
    net = Net(np.vstack([np.zeros(3), HELD]), np.array([(0, k) for k in range(1, 7)]),
              np.full(6, K), np.full(7, MASS))  # fmt: skip
    return fd.Case(net, [fd.Fix(range(1, 7), "xyz")], loads, fd.Rayleigh(**damping))


def balance(x):
    """Force (N) along x that holds the point there."""
    length = np.hypot(ARM, x)
    return 2.0 * K * x + 4.0 * K * (length - ARM) * x / length


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["newton", "arc_length"])
def test_statics(method):
    """Held springs give the force in closed form."""
    case = star([fd.Force([0], (balance(0.3), 0.0, 0.0))])
    path = fd.trace(case, method, load_factors=[0.0, 1.0])
    assert path.displacement.values[-1, 0] == pytest.approx([0.3, 0.0, 0.0], abs=1e-9)
    energy = K * 0.3**2 + 2.0 * K * (np.hypot(ARM, 0.3) - ARM) ** 2
    assert float(path.strain_springs[-1]) == pytest.approx(energy, rel=1e-9)
    assert path.strain_springs.attrs["long_name"] == "strain energy of the springs"


@pytest.mark.parametrize(
    "method", [pytest.param("rk4", marks=pytest.mark.matrix), "generalized_alpha"]
)
def test_motions(method):
    """A small vibration of known frequency, lightly damped by the mass."""
    alpha, amplitude = 0.4, 1e-4
    omega = np.sqrt(2.0 * K / MASS - 0.25 * alpha**2)
    u, v = np.zeros((7, 3)), np.zeros((7, 3))
    u[0, 0], v[0, 0] = amplitude, -0.5 * alpha * amplitude
    motion = fd.simulate(
        star(alpha=alpha), 1.0, method=method, dt=1e-3, interval=0.1, initial=fd.State(u, v)
    )
    t = motion.time.values
    wanted = amplitude * np.exp(-0.5 * alpha * t) * np.cos(omega * t)
    np.testing.assert_allclose(motion.displacement[:, 0, 0], wanted, atol=3e-3 * amplitude)
    assert {"strain_springs", "kinetic", "dissipated", "work"} < set(motion.data_vars)
    assert motion.attrs["energy_error"] < 1e-2
    assert motion.attrs["rerunnable"] == 0


def test_modes():
    modes = fd.modes(star(), count=3)
    wanted = np.sqrt(2.0 * K / MASS) / (2.0 * np.pi)
    np.testing.assert_allclose(modes.frequency, wanted, rtol=1e-9)


def test_frequency_response():
    response = fd.frf(star(alpha=1.0), fd.Force([0], (1.0, 0.0, 0.0)), frequencies=[0.0, 1.0])
    w = 2.0 * np.pi
    wanted = 1.0 / (2.0 * K - w**2 * MASS + 1j * w * MASS)
    assert complex(response.receptance[1, 0, 0]) == pytest.approx(wanted, rel=1e-9)
