"""Energy and momenta of free motions with implicit methods."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.checks import observed_order

PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)


def free_sheet(cells=(2, 1), **options) -> fd.Case:
    """The sheet of the gallery's free flight, or a part of it, with smooth laws."""
    pattern = fd.patterns.miura(cells=cells, a=0.025, b=0.025, panel_angle=60, dihedral=90)
    options = {"bend_law": "linear", "fold_law": fd.EnhancedLinear(20, 340)} | options
    return fd.Case(fd.discretize(pattern, PAPER, **options, preset="herkal"))


def thrown(case: fd.Case) -> fd.State:
    """Flying, and spinning about an oblique axis: centrifugal forces open and close the folds."""
    s = case.structure
    x = s.nodes - (s.mass @ s.nodes).sum(axis=0) / s.mass.sum()
    return fd.State(velocity=np.cross([2.0, 50.0, 1.5], x) + np.array([0.4, 0.0, 2.0]))


def momenta(case: fd.Case, motion) -> tuple[np.ndarray, np.ndarray]:
    """Linear (kg m/s) and angular momentum (kg m2/s) about the origin, per sample."""
    s = case.structure
    p = np.array([s.mass @ v for v in motion.velocity.to_numpy()])
    return p.sum(axis=1), np.cross(s.nodes + motion.displacement.to_numpy(), p).sum(axis=1)


def drift(values: np.ndarray) -> float:
    """Largest change relative to the largest value at the start."""
    return float(np.abs(values - values[0]).max() / np.abs(values[0]).max())


def energy(motion) -> np.ndarray:
    total = motion.kinetic + motion.strain_bars + motion.strain_folds + motion.strain_bends
    return total.to_numpy()


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_free_flight_over_1e4_steps(mass):
    """Energy and angular momentum to 1e-8 (found: 1e-12), linear momentum to rounding.

    The step is five times RK4's critical one, the folds turn by degrees back and forth.
    """
    case = free_sheet(mass=mass)
    dt = 1e-4
    assert dt > 5.0 * fd.critical_step(case)
    motion = fd.simulate(case, 1.0, "energy_momentum", dt=dt, every=100, initial=thrown(case))
    assert motion.attrs["steps"] == 10_000
    folds = np.array([case.structure.dihedrals(u)[0] for u in motion.displacement.to_numpy()])
    assert np.degrees(np.ptp(folds, axis=0).max()) > 5.0
    assert np.ptp(energy(motion) - motion.kinetic.to_numpy()) > 1e-3 * energy(motion)[0]
    p, h = momenta(case, motion)
    assert drift(energy(motion)) < 1e-9
    assert drift(h) < 1e-9
    assert drift(p) < 1e-13


def test_steps_that_follow_their_error_conserve_too():
    case = free_sheet()
    motion = fd.simulate(case, 0.1, "energy_momentum", initial=thrown(case), tolerance=1e-4)
    assert motion.attrs["largest_step"] > 1.2 * motion.attrs["smallest_step"]
    p, h = momenta(case, motion)
    assert max(drift(energy(motion)), drift(h), drift(p)) < 1e-10


def test_large_steps_stay_robust():
    """A twentieth of a turn in a step, with stiff bars: no failure, nothing gained or lost."""
    case = free_sheet()
    motion = fd.simulate(case, 0.3, "energy_momentum", dt=1e-3, initial=thrown(case))
    p, h = momenta(case, motion)
    assert max(drift(energy(motion)), drift(h), drift(p)) < 1e-9
    assert motion.attrs["halved_steps"] < 100


@pytest.mark.filterwarnings("ignore:the energy balance")  # of the other method
@pytest.mark.parametrize("bend_law", ["linear", "superlinear"])
def test_snap_through_keeps_its_energy(bend_law):
    """A sheet pushed far from rest and let go: energies change hands, their sum stays."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law=bend_law, preset="herkal")
    supports = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    v = np.zeros(s.nodes.shape)
    v[[6, 7, 8], 0] = -1.0
    case = fd.Case(s, supports)
    motion = fd.simulate(case, 2.0, "energy_momentum", dt=2e-3, initial=fd.State(velocity=v))
    assert float(motion.strain_folds.max()) > 0.2 * energy(motion)[0]
    assert drift(energy(motion)) < 1e-10
    plain = fd.simulate(case, 2.0, "generalized_alpha", dt=2e-3, initial=fd.State(velocity=v))
    assert drift(energy(plain)) > 1e-5


def test_other_methods_drift_with_the_square_of_the_step():
    case = free_sheet(fold_law="linear")
    for method in ("newmark", "generalized_alpha"):
        steps, lost = np.array([100, 200, 400]), []
        for n in steps:
            dt = 0.02 / n
            motion = fd.simulate(case, 0.02, method, dt=dt, every=int(n), initial=thrown(case))
            lost.append(np.linalg.norm(np.diff(momenta(case, motion)[1], axis=0)))
        assert observed_order(0.02 / steps, lost) == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_the_balance_closes_with_everything_that_acts(mass):
    """Loads, gravity, damping of both kinds, moving supports, actuated folds: to 1e-9."""
    pattern = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.0, panel_angle=60, dihedral=100)
    s = fd.discretize(
        pattern,
        fd.Sheet(1e6, 0.25, 0.01, 1000.0),
        mass=mass,
        fold_law=fd.EnhancedLinear(70, 290),
        preset="herkal",
    )
    supports = [
        fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2], "z"), fd.Fix([1], "y"),
        fd.Impose([12], "x", 0.02, fd.Ramp(0.05)),
        fd.BaseMotion("z", fd.Harmonic(20.0), 1e-3),
    ]  # fmt: skip
    loads = [
        fd.Force([14], (0.0, 0.0, 1.0), fd.Harmonic(30.0)),
        fd.Gravity((0.0, 0.0, -9.81)),
        fd.Actuate([3, 5], 150.0, fd.Ramp(0.05)),
    ]
    case = fd.Case(s, supports, loads, fd.Rayleigh(alpha=1.0, beta=1e-5))
    motion = fd.simulate(case, 0.1, "energy_momentum", dt=5e-4)
    parts = {name: float(np.abs(motion[name]).max()) for name in ("dissipated", "work", "kinetic")}
    assert min(parts.values()) > 1e-3 * max(parts.values())
    assert motion.attrs["energy_error"] < 1e-9
