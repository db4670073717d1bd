"""Motions in the span of few modes and their derivatives, against those of all dofs."""

from contextlib import nullcontext

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError


def cell(force=0.0, supports=(), history=None):
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), scheme="n5b8", bend_law="linear")
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"), *supports]
    loads = [fd.Force([5], (force, 0, 0), history=fd.Harmonic(0.58))] if force else []
    return fd.Case(s, held, loads, fd.Rayleigh(alpha=0.1))


def apart(one, other):
    size = np.abs(other.displacement.values).max()
    return np.abs(one.displacement.values - other.displacement.values).max() / size


def test_all_modes_but_one_and_their_derivatives_are_nearly_everything():
    case = cell(2e-4)
    whole = fd.periodic_motion(case, harmonics=5)
    one = fd.periodic_motion(case, harmonics=5, modes=8)
    assert apart(one, whole) < 1e-9
    assert one.attrs["reduction"] < 1e-9
    assert "reduction" not in whole.attrs


@pytest.mark.matrix
def test_few_modes_come_near_and_say_how_near():
    case = cell(2e-4)
    whole = fd.periodic_motion(case, harmonics=5)
    errors = []
    for modes in (1, 3, 5):
        told = pytest.warns(FoldynWarning, match="modes: the omitted dofs would change")
        with told if modes == 1 else nullcontext():
            one = fd.periodic_motion(case, harmonics=5, modes=modes)
        errors.append(apart(one, whole))
        assert one.attrs["reduction"] < errors[-1] < 30.0 * one.attrs["reduction"]
    assert errors[2] < errors[1] < errors[0]
    assert errors[1] < 0.01
    assert abs(one.floquet.values[0]) == pytest.approx(abs(whole.floquet.values[0]), rel=1e-6)


def test_a_slow_drive_is_followed_statically_with_one_mode():
    slow = {"frequency": 1e-3, "harmonics": 1}
    whole, one = (fd.periodic_motion(cell(1e-6), modes=modes, **slow) for modes in (None, 1))
    assert apart(one, whole) < 1e-5


def test_derivatives_carry_what_modes_alone_would_lock():
    # nodes of a folding sheet follow arcs: the second harmonic is hardly in the span of the modes
    whole = fd.periodic_motion(cell(2e-4), harmonics=5).coefficient.values[2]
    few = fd.periodic_motion(cell(2e-4), harmonics=5, modes=3).coefficient.values[2]
    assert np.abs(few - whole).max() < 0.02 * np.abs(whole).max()


def test_moving_bases_carry_the_sheet_along():
    case = cell(supports=[fd.BaseMotion("x", value=5e-3, history=fd.Harmonic(0.5))])
    whole = fd.periodic_motion(case, harmonics=5)
    one = fd.periodic_motion(case, harmonics=5, modes=3)
    assert apart(one, whole) < 5e-3


@pytest.mark.matrix
def test_curves_and_backbones_take_few_modes():
    whole = fd.backbone(cell(), amplitudes=(1e-4, 0.02), harmonics=5)
    few = fd.backbone(cell(), amplitudes=(1e-4, 0.02), harmonics=5, modes=3)
    assert few.frequency.values[0] == pytest.approx(whole.frequency.values[0], rel=1e-6)
    bent = np.interp(0.01, whole.amplitude, whole.frequency)
    assert np.interp(0.01, few.amplitude, few.frequency) == pytest.approx(bent, rel=1e-3)
    assert few.reduction.values.max() < 0.01
    curve = fd.response_curve(cell(5e-5), (0.59, 0.63), harmonics=5, modes=3, steps=24)
    here = np.abs(curve.frequency.values - 0.61).argmin()
    exact = fd.periodic_motion(cell(5e-5), float(curve.frequency[here]), harmonics=5)
    amplitude = np.ptp(exact.displacement.values, axis=0).max() / 2.0
    assert curve.amplitude.values[here] == pytest.approx(amplitude, rel=5e-3)


def test_modes_out_of_range_are_refused():
    for modes in (0, 31, "all"):
        with pytest.raises(InputError, match="modes"):
            fd.periodic_motion(cell(1e-4), modes=modes)
