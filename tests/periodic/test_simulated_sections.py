"""Poincare sections, stepped sines, Lyapunov exponents and basins of Duffing's oscillator."""

import numpy as np
import pytest
from duffing import NODE, cubic, mass, oscillator

import foldyn as fd
from foldyn.errors import InputError
from foldyn.periodic import basins, lyapunov_exponent, poincare_section, stepped_sine


def test_section_of_a_periodic_motion_is_one_point():
    seen = poincare_section(oscillator(alpha=0.5), periods=5, skip=60)
    one = fd.periodic_motion(oscillator(alpha=0.5), harmonics=15)
    expected = one.displacement.values[0, NODE, 2]
    assert seen.displacement.values[:, NODE, 2] == pytest.approx(expected, abs=1e-7)
    assert seen.velocity.values[:, NODE, 2] == pytest.approx(
        one.velocity.values[0, NODE, 2], abs=1e-7
    )


def test_stepped_sines_jump_at_the_folds():
    curve = fd.response_curve(oscillator(alpha=0.2), (0.2, 0.36), 9)
    folds = curve.frequency.values[curve.bifurcation.values == "fold"]
    step = 0.005
    up = stepped_sine(oscillator(alpha=0.2), np.arange(0.24, 0.35, step), periods=2, skip=40)
    down = stepped_sine(oscillator(alpha=0.2), np.arange(0.35, 0.24, -step), periods=2, skip=40)
    for run, fold in ((up, folds.max()), (down, folds.min())):
        (at,) = np.flatnonzero(run.jump.values)
        before, after = run.frequency.values[at - 1 : at + 1]
        assert min(before, after) - step < fold < max(before, after) + step
    near = np.flatnonzero(up.frequency.values < folds.min() - step)
    exact = np.interp(up.frequency.values[near], curve.frequency.values, curve.amplitude.values)
    assert up.amplitude.values[near] == pytest.approx(exact, rel=2e-3)


@pytest.mark.matrix
def test_exponent_of_ueda_is_the_published_one():
    # x'' + 0.05 x' + x^3 = 7.5 sin t: 0.1034 (Sprott, Chaos and Time-Series Analysis, 2003,
    # appendix A.5); 0.0999 at sites.google.com/view/lyapunov-spectrum: between them
    time = np.sqrt(mass() / cubic())
    case = oscillator(
        force=7.5 * cubic(), frequency=1.0 / (2.0 * np.pi * time), alpha=0.05 / time, spring=False
    )
    found = lyapunov_exponent(case, periods=600, skip=50)
    assert float(found.exponent) * time == pytest.approx(0.1017, abs=0.01)
    assert float(found.uncertainty) * time < 0.01


def test_exponent_of_a_periodic_motion_is_that_of_its_multiplier():
    case = oscillator(alpha=0.5)
    found = lyapunov_exponent(case, periods=64, skip=64)
    one = fd.periodic_motion(case, harmonics=15)
    expected = np.log(abs(one.floquet.values[0])) * 0.25
    assert float(found.exponent) == pytest.approx(expected, rel=0.01)


def bistable(count, drive=0.0):
    """Starts about the saddle of two wells, at 0.2 below the node."""
    case = oscillator(force=drive, frequency=0.1, alpha=0.1, height=0.2, spring=False)
    if not drive:
        case = case.altered(loads=[])
    along, speed = np.zeros((3, 3)), np.zeros((3, 3))
    along[NODE, 2], speed[NODE, 2] = 1.0, 1.0
    return basins(
        case, (along, 0.0 * along), (0.0 * along, speed), ((-0.61, 0.21), (-0.02, 0.02)),
        (count, count), duration=400.0, dt=0.1,
    )  # fmt: skip


@pytest.fixture(scope="module")
def coarse():
    return bistable(8)


def test_both_wells_have_a_basin_and_they_mirror_each_other(coarse):
    assert coarse.sizes["attractor"] == 2
    ends = np.sort(coarse.displacement.values[:, NODE, 2])
    assert ends == pytest.approx([-0.4, 0.0], abs=1e-3)
    found = coarse.basin.values
    mirrored = found[::-1, ::-1]
    assert (found >= 0).all()
    assert (found + mirrored == 1).all()


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance")  # of the start on the saddle
def test_boundary_of_basins_does_not_depend_on_the_grid(coarse):
    found, finer = coarse.basin.values, bistable(15).basin.values
    assert (finer[::2, ::2] == found).all()
    for i in range(1, 6):
        for j in range(1, 6):  # cells whose neighbors lie in one basin
            around = found[i - 1 : i + 3, j - 1 : j + 3]
            if (around == around[0, 0]).all():
                assert (finer[2 * i : 2 * i + 3, 2 * j : 2 * j + 3] == around[0, 0]).all()


def test_what_is_not_driven_or_out_of_range_is_refused():
    still = oscillator().altered(loads=[])
    for call in (poincare_section, lyapunov_exponent):
        with pytest.raises(InputError, match="nothing drives it"):
            call(still)
    with pytest.raises(InputError, match="nothing drives it"):
        stepped_sine(still, [1.0])
    for field, call in (
        ("periods", lambda: poincare_section(oscillator(), 0)),
        ("skip", lambda: poincare_section(oscillator(), skip=-1)),
        ("periods", lambda: lyapunov_exponent(oscillator(), 1)),
        ("seed", lambda: lyapunov_exponent(oscillator(), seed=-1)),
        ("frequencies", lambda: stepped_sine(oscillator(), [])),
        ("measure", lambda: stepped_sine(oscillator(), [1.0], fd.Quantity())),
        ("jump", lambda: stepped_sine(oscillator(), [1.0], jump=0.0)),
        ("ranges", lambda: grid(ranges=((1.0, 0.0), (0.0, 1.0)))),
        ("counts", lambda: grid(counts=(1, 3))),
        ("counts", lambda: grid(counts=3)),
        ("first", lambda: grid(first=3)),
        (r"first\[1\]", lambda: grid(first=(np.zeros((3, 3)), np.zeros((2, 3))))),
        ("duration", lambda: grid(duration=-1.0)),
        ("tolerance", lambda: grid(tolerance=2.0)),
    ):
        with pytest.raises(InputError, match=field):
            call()


def grid(**changes):
    zero = np.zeros((3, 3))
    given = {
        "first": (zero, zero), "second": (zero, zero), "ranges": ((0.0, 1.0), (0.0, 1.0)),
        "duration": 1.0,
    }  # fmt: skip
    return basins(oscillator(), **(given | changes))
