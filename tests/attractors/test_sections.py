"""Poincaré sections: once a period, and where a quantity passes a level."""

from __future__ import annotations

import numpy as np
import pytest
from two_bars import SIZE, TURN, X, at, duffing, place

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError

FALL = fd.Quantity("m/s", "speed", function=lambda u, v, t: v[1, 2])


def spread(case, section) -> float:
    return float(np.ptp(place(case, section.displacement.values)))


@pytest.fixture(scope="module")
def periodic():
    """The motion x'' + 0.3 x' - x + x^3 = 0.28 cos 1.2 t, of two periods."""
    case = duffing(-1.0, 0.3, 0.28, omega=1.2, phase=90.0)
    period = TURN / 1.2
    return (
        case,
        period,
        fd.simulate(case, 100 * period, method="rk4", dt=period / 150, interval=period / 50),
    )


def test_a_motion_of_two_periods_has_two_points(periodic):
    case, period, motion = periodic
    section = fd.poincare_section(motion, period, after=60 * period)
    assert section.sizes["time"] == 41
    x = place(case, section.displacement.values)
    assert np.ptp(x[::2]) < 1e-6 and np.ptp(x[1::2]) < 1e-6
    assert abs(x[0] - x[1]) > 0.05
    assert spread(case, fd.poincare_section(motion, 2 * period, after=60 * period)) < 1e-6


def test_a_periodic_motion_has_one_point():
    case = duffing(1.0, 0.4, 0.3, omega=1.3)
    motion = fd.simulate(
        case, 80 * TURN / 1.3, method="rk4", dt=TURN / 1.3 / 60, interval=TURN / 1.3 / 4
    )
    section = fd.poincare_section(motion, TURN / 1.3, after=60 * TURN / 1.3)
    assert section.sizes["time"] == 21 and spread(case, section) < 1e-9


def test_sections_by_a_plane_are_passed_once_in_a_vibration():
    case = duffing(1.0, cubic=False)
    motion = fd.simulate(case, 40.0, method="rk4", dt=0.01, interval=0.1, initial=at(case, 1.0))
    down = fd.poincare_section(motion, plane=X, direction="down")
    np.testing.assert_allclose(down.time, np.pi / 2 + TURN * np.arange(7), rtol=0, atol=1e-6)
    np.testing.assert_allclose(down.velocity[:, 1, 2], -SIZE, rtol=1e-5)
    both = fd.poincare_section(motion, plane=X, level=0.5, direction="both")
    assert both.sizes["time"] == 13
    tops = fd.poincare_section(motion, plane=FALL, direction="down", after=1.0)
    np.testing.assert_allclose(place(case, tops.displacement.values), 1.0, rtol=0, atol=1e-6)


def test_states_between_samples_are_those_of_a_cubic():
    case = duffing(1.0, cubic=False)
    errors = []
    for interval in (0.4, 0.2):
        motion = fd.simulate(
            case, 20.0, method="rk4", dt=0.005, interval=interval, initial=at(case, 1.0)
        )
        section = fd.poincare_section(motion, 0.7, phase=90.0)
        t = section.time.values
        np.testing.assert_allclose(t, 0.7 * (np.arange(len(t)) + 0.25))
        errors.append(abs(place(case, section.displacement.values) - np.cos(t)).max())
    assert 12.0 < errors[0] / errors[1] < 20.0 and errors[1] < 1e-5


@pytest.mark.matrix
def test_sections_keep_the_case_and_can_be_stored(tmp_path):
    s = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.0, dihedral=60),
        fd.Sheet(1e6, 0.25, 0.01, density=1.0),
        preset="plate",
    )
    push = fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.5))
    case = fd.Case(s, [fd.Fix([4, 5]), fd.Fix([0, 1], "yz")], [push], fd.Rayleigh(alpha=2.0))
    motion = fd.simulate(case, 20.0, method="rk4", interval=0.5)
    section = fd.poincare_section(motion, after=10.0)  # of the drive
    same = motion.displacement[20::4]
    np.testing.assert_allclose(section.displacement, same, rtol=0, atol=1e-14)
    assert fd.case_of(section).loads == case.loads
    fd.save(section, tmp_path / "section.nc")
    assert fd.load(tmp_path / "section.nc").equals(section)
    assert section.displacement.attrs["units"] == "m"


def test_what_has_no_section_is_refused(periodic):
    motion = periodic[2]
    with pytest.raises(InputError, match="motion: got DataArray, give a result of fd"):
        fd.poincare_section(motion.time)
    with pytest.raises(InputError, match='direction = "left"'):
        fd.poincare_section(motion, plane=X, direction="left")
    with pytest.raises(InputError, match=r"period = 1\.0: give either a period or a plane"):
        fd.poincare_section(motion, 1.0, plane=X)
    with pytest.raises(InputError, match=r"period: a section of .* states needs about"):
        fd.poincare_section(motion, 1e-12)
    with pytest.raises(InputError, match=r"^plane: raised IndexError: "):
        fd.poincare_section(motion, plane=fd.Quantity(function=lambda u, v, t: u[99, 2]))
    with pytest.raises(
        InputError, match=r"^period: give one \(s\), or a plane: this result cannot"
    ):
        fd.poincare_section(motion)
    with pytest.warns(
        FoldynWarning, match=r"from after = 1e\+09 s until the end, .* no whole period of 1 s"
    ):
        assert not fd.poincare_section(motion, 1.0, after=1e9).sizes["time"]
    with pytest.warns(FoldynWarning, match=r"no passage of the level 1e\+09"):
        assert not fd.poincare_section(motion, plane=X, level=1e9).sizes["time"]
