"""Largest Lyapunov exponents: of linear motions, of periodic ones, and of chaos."""

from __future__ import annotations

import numpy as np
import pytest
from two_bars import TURN, at, duffing

import foldyn as fd
from foldyn.errors import ComputationError, InputError, MotionInterrupted

DT = TURN / 100
SPROTT = 0.1034
"""Of Ueda's oscillator x'' + 0.05 x' + x^3 = 7.5 cos t (exponents 0.1034, 0, -0.1534):
J. C. Sprott, Chaos and Time-Series Analysis, Oxford 2003, appendix A."""


def interrupted_after(time, case):
    """What is kept of 8 periods after 2 more, interrupted at a time (s)."""

    def stop(state):
        if state.time > time - 1e-6:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted) as stopped:
        fd.lyapunov_exponent(case, 8 * TURN, settle=2 * TURN, dt=DT, progress=stop)
    return stopped.value


@pytest.fixture(scope="module")
def ueda():
    return duffing(0.0, 0.05, 7.5, phase=90.0)


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
def test_a_linear_vibration_decays_with_zeta_omega(method):
    case = duffing(1.0, 0.1, 0.3, omega=1.4, cubic=False)
    found = fd.lyapunov_exponent(case, 300 * TURN, settle=20 * TURN, method=method, dt=DT)
    assert float(found.exponent) == pytest.approx(-0.05, rel=5e-3)


def test_an_overdamped_motion_decays_with_its_slow_root():
    case = duffing(1.0, 3.0, 0.3, cubic=False)
    found = fd.lyapunov_exponent(case, 20 * TURN, settle=4 * TURN, interval=TURN / 4, dt=DT)
    assert float(found.exponent) == pytest.approx(-1.5 + np.sqrt(1.25), rel=1e-4)
    assert found.error < 1e-4


def test_a_motion_without_a_drive_has_an_exponent():
    """Beside the saddle x = 0 of x'' + 0.3 x' - x = 0 motions part with the root above 0."""
    case = duffing(-1.0, 0.3)
    found = fd.lyapunov_exponent(case, 40.0, settle=5.0, interval=0.5, initial=at(case, 0), dt=0.02)
    assert float(found.exponent) == pytest.approx(-0.15 + np.sqrt(0.15**2 + 1.0), rel=1e-3)


@pytest.mark.matrix
def test_a_stable_orbit_has_half_the_damping():
    """Its two multipliers are a complex pair with the product exp(-alpha T), by Liouville."""
    case = duffing(1.0, 0.1, 0.3, omega=1.3)
    found = fd.lyapunov_exponent(case, 400 * TURN / 1.3, settle=60 * TURN, dt=DT)
    assert float(found.exponent) == pytest.approx(-0.05, rel=0.01)


@pytest.mark.matrix
def test_uedas_oscillator_is_chaotic(ueda):
    found = fd.lyapunov_exponent(ueda, 800 * TURN, settle=50 * TURN, dt=TURN / 80)
    error = float(found.error)
    assert 0.001 < error < 0.01
    assert float(found.exponent) == pytest.approx(SPROTT, abs=3.0 * error)
    assert found.exponent > 10.0 * error  # far from 0
    assert found.sizes["time"] == 800 and found.estimate.values[-1] == found.exponent


@pytest.mark.matrix
def test_the_exponent_converges_to_the_published_value(ueda):
    found = fd.lyapunov_exponent(ueda, 8_000 * TURN, settle=100 * TURN, dt=TURN / 80)
    assert found.error < 0.002
    assert float(found.exponent) == pytest.approx(SPROTT, abs=0.004)


@pytest.mark.matrix
def test_tied_nodes_stay_tied():
    """Two masses that are linked move as one of twice the mass."""
    pattern = fd.patterns.simple_fold(1.0, 1.0, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.1, density=1.0), preset="plate")
    push = fd.Force([0, 1], (1.0, 0, 0), history=fd.Harmonic(5.0))
    held = [fd.Fix([4, 5]), fd.Fix([0, 1], "yz")]
    case = fd.Case(s, [*held, fd.Link([0, 1], "x")], [push], damping=fd.Rayleigh(alpha=4.0))
    found = fd.lyapunov_exponent(case, 20.0, settle=2.0)
    assert float(found.exponent) == pytest.approx(-2.0, rel=0.03)


def test_what_has_no_exponent_is_refused(ueda):
    with pytest.raises(InputError, match='method = "newmark": choose one of rk4'):
        fd.lyapunov_exponent(ueda, 100.0, method="newmark", dt=DT)
    pattern, sheet = (
        fd.patterns.simple_fold(1.0, 1.0, dihedral=60),
        fd.Sheet(1e6, 0.25, 0.01, density=1.0),
    )
    touching = fd.Case(
        fd.discretize(pattern, sheet, preset="plate"), contact=fd.Contact(thickness=0.01)
    )
    with pytest.raises(InputError, match="contact: the exponent needs smooth forces"):
        fd.lyapunov_exponent(touching, 1.0)
    yielding = fd.discretize(pattern, sheet, fold_law=fd.Plastic(10.0), preset="plate")
    with pytest.raises(InputError, match="some of its hinges yield, creep or have latches"):
        fd.lyapunov_exponent(fd.Case(yielding, [fd.Fix([4, 5])]), 1.0)
    with pytest.raises(InputError, match="duration = 1 s: is shorter than a period of the drive"):
        fd.lyapunov_exponent(ueda, 1.0)
    with pytest.raises(InputError, match=r"initial: displacement of shape \(7, 3\): the case has"):
        fd.lyapunov_exponent(ueda, 100.0, initial=fd.State(np.zeros((7, 3))))
    overdamped = duffing(1.0, 3.0, 0.3, cubic=False)
    with pytest.raises(ComputationError, match="take a shorter interval"):
        fd.lyapunov_exponent(overdamped, 500.0, interval=100.0, dt=DT)


def test_what_was_counted_is_kept_when_it_is_interrupted(ueda):
    whole = fd.lyapunov_exponent(ueda, 8 * TURN, settle=2 * TURN, dt=DT)
    stop = interrupted_after(6 * TURN, ueda)
    kept = stop.partial
    assert str(stop) == f"interrupted after {float(kept.time[-1] - kept.attrs['settle']):.6g} s"
    np.testing.assert_array_equal(kept.estimate, whole.estimate[: kept.sizes["time"]])
    assert kept.sizes["time"] == 3 and kept.exponent == whole.estimate[2]
    early = interrupted_after(TURN, ueda)
    assert early.partial is None and "before anything was counted" in str(early)
