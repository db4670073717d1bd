"""What free motions keep: linear and angular momentum, energy; and that methods agree."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import equal_steps

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
pytestmark = pytest.mark.filterwarnings("ignore:the energy balance")


def free_sheet(**options) -> fd.Case:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=100)
    return fd.Case(fd.discretize(pattern, SHEET, **options, preset="herkal"))


def tumbling(case: fd.Case, spin: float = 1.0, shake: float = 0.02) -> fd.State:
    """A rotation about an oblique axis, a translation and a little disorder."""
    s = case.structure
    x = s.nodes - s.nodes.mean(axis=0)
    v = np.cross(spin * np.array([0.3, -0.5, 0.8]), x) + np.array([0.2, 0.1, 0.4])
    return fd.State(velocity=v + shake * np.random.default_rng(5).standard_normal(x.shape))


def momenta(case: fd.Case, motion) -> tuple[np.ndarray, np.ndarray]:
    """Linear (kg m/s) and angular momentum (kg m2/s) about the origin, per sample."""
    s = case.structure
    p = np.array([s.mass @ v for v in motion.velocity.to_numpy()])
    x = s.nodes + motion.displacement.to_numpy()
    return p.sum(axis=1), np.cross(x, p).sum(axis=1)


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
@pytest.mark.parametrize("method", METHODS)
def test_linear_momentum_over_many_steps(method, mass):
    """Over 1e5 steps of explicit methods; implicit ones take 500, ten times as long."""
    case = free_sheet(mass=mass)
    implicit = METHODS[method].implicit
    dt = (4.0 if implicit else 0.4) * fd.critical_step(case, "rk4" if implicit else method)
    motion = fd.simulate(
        case, (500 if implicit else 100_000) * dt, method, dt=dt, every=100 if implicit else 2000,
        initial=tumbling(case), **equal_steps(method),
    )  # fmt: skip
    p, _ = momenta(case, motion)
    np.testing.assert_allclose(p, np.broadcast_to(p[0], p.shape), atol=1e-12 * np.abs(p).max())


def test_central_differences_keep_energy_and_angular_momentum_over_1e5_steps():
    case = free_sheet()
    dt = 0.5 * fd.critical_step(case, "central_difference")
    initial = tumbling(case, shake=0.005)
    motion = fd.simulate(case, 1e5 * dt, "central_difference", dt=dt, every=500, initial=initial)
    _, h = momenta(case, motion)
    np.testing.assert_allclose(h, np.broadcast_to(h[0], h.shape), atol=1e-11 * np.abs(h).max())
    energy = motion.kinetic + motion.strain_bars + motion.strain_folds + motion.strain_bends
    error = (energy / energy[0] - 1.0).to_numpy()
    # bounded: the second half of the motion is no worse than the first
    first, second = np.abs(error[1:100]).max(), np.abs(error[100:]).max()
    assert first < 0.02
    assert second < 1.5 * first


@pytest.mark.parametrize("method", ["rk4", "dormand_prince"])
def test_angular_momentum_drifts_with_the_order_or_faster(method):
    """These methods cannot keep it; the drift over a fixed time falls with their order."""
    case = free_sheet(bend_law="linear", fold_law="linear")
    duration, base = 0.05, fd.critical_step(case)
    steps = np.ceil(duration / base * np.array([12, 16, 24])).astype(int)
    drift = []
    for n in steps:
        motion = fd.simulate(
            case, duration, method, dt=duration / n, every=int(n),
            initial=tumbling(case, spin=60.0, shake=0.0), **equal_steps(method),
        )  # fmt: skip
        _, h = momenta(case, motion)
        drift.append(float(np.linalg.norm(h[-1] - h[0])))
    assert observed_order(duration / steps, drift) > METHODS[method].order - 0.15


@pytest.mark.parametrize("method", [name for name in METHODS if name != "rk4"])
def test_methods_converge_to_one_motion(method):
    """The others approach the motion of RK4 with their own order."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    structure = fd.discretize(pattern, SHEET, bend_law="linear", fold_law="linear", preset="herkal")
    supports = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    load = fd.Force([7], (0.01, 0.0, 0.0), fd.Harmonic(frequency=0.7))
    case = fd.Case(structure, supports, [load], fd.Rayleigh(alpha=0.5, beta=1e-5))
    reference = fd.simulate(case, 0.2, dt=0.2 / 16000, every=16000).displacement[-1]
    order = METHODS[method].order
    steps = np.array([4000, 8000, 16000]) // (1 if order == 2 else 8)
    if METHODS[method].implicit:
        steps //= 4
    errors = []
    for n in steps:
        motion = fd.simulate(case, 0.2, method, dt=0.2 / n, every=int(n), **equal_steps(method))
        errors.append(float(np.linalg.norm(motion.displacement[-1] - reference)))
    assert errors[-1] < 1e-5 * float(np.linalg.norm(reference))
    assert observed_order(0.2 / steps, errors) == pytest.approx(order, abs=0.2)
