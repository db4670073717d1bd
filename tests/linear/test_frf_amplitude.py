"""Responses that depend on the amplitude: superlinear hinges stiffen as they swing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bodies import TOP, paper_specimen
from frf_structures import chain, flap, largest_error, miura_case

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear import frf, linearize, modes, peaks_of
from pairwise import beyond

LIFT = fd.Force([3], (0, 0, 1.0))


WIDE, FEW = np.arange(0.7, 1.31, 0.01), np.arange(0.88, 1.13, 0.04)


def backbone(amplitudes, span, method="harmonic", **options):
    """Peak frequency (Hz) and the displacement (m) there, of the flap with one superlinear fold.

    Along the backbone k ~ A^(1/3), so w ~ A^(1/6); at the peak alpha m w A is the force.
    """
    found = []
    for amplitude in amplitudes:
        guess = 0.65 * (amplitude / 5e-5) ** (1 / 7)
        response = frf(
            flap(alpha=0.3),
            LIFT,
            frequencies=guess * span,
            method=method,
            amplitude=amplitude,
            **options,
        )
        assert response.attrs["amplitude"] == amplitude
        assert response.attrs["drive_force"] == amplitude
        (peak,) = peaks_of(response, 3, axis="z", count=1)
        found.append((peak.frequency, amplitude * peak.height))
    return np.array(found).T


@pytest.mark.matrix
def test_the_peak_moves_as_the_sixth_root_of_the_amplitude():
    frequency, displacement = backbone([1e-5, 4e-5, 16e-5], WIDE)
    slope = np.diff(np.log(frequency)) / np.diff(np.log(displacement))
    np.testing.assert_allclose(slope, 1 / 6, atol=0.004)
    assert displacement[-1] > 8 * displacement[0]
    by_force = np.diff(np.log(frequency)) / np.log(4.0)
    np.testing.assert_allclose(by_force, 1 / 7, atol=0.004)


@pytest.mark.matrix
def test_simulated_motions_follow_the_same_law():
    frequency, displacement = backbone([1e-5, 8e-5], FEW, method="stepped_sine", settled=1e-3)
    slope = np.diff(np.log(frequency)) / np.diff(np.log(displacement))
    assert slope[0] == pytest.approx(1 / 6, abs=0.01)
    balanced = backbone([1e-5, 8e-5], FEW)
    np.testing.assert_allclose([frequency, displacement], balanced, rtol=0.005)


def test_a_linear_fold_does_not_depend_on_the_amplitude():
    case, f = flap(alpha=1.0, law="linear"), np.arange(0.2, 2.0, 0.2)
    exact = frf(case, LIFT, frequencies=f).receptance
    for amplitude in (1e-6, 1.0):
        found = frf(case, LIFT, frequencies=f, method="harmonic", amplitude=amplitude)
        np.testing.assert_allclose(found.receptance, exact, rtol=1e-12)
    base = fd.BaseMotion("x", value=0.01)  # of bars alone
    found, direct = (
        frf(chain(alpha=0.4), base, frequencies=f, method=m) for m in ("harmonic", "direct")
    )
    np.testing.assert_allclose(found.transmissibility, direct.transmissibility, rtol=1e-12)
    assert (found.swing.values == 0.0).all()


def test_one_hinge_balances_with_its_own_slope():
    """The response is the direct one with the secant slope of the swing that comes out."""
    case, f = flap(alpha=1.0), [0.4]
    found = frf(case, LIFT, frequencies=f, method="harmonic", amplitude=1e-4, tolerance=1e-10)
    swing = math.degrees(found.swing[0])
    assert swing > 0.3
    secant = frf(case, LIFT, frequencies=f, secant=swing)
    assert largest_error(found.receptance, secant.receptance.values) < 1e-8


@pytest.mark.matrix
def test_rising_and_falling_sweeps_differ_where_there_are_two_branches():
    """Hardening: rising frequencies follow the upper branch to its end, as the balance does."""
    case, f = flap(alpha=0.1), np.arange(0.44, 0.581, 0.02)
    options = {"amplitude": 5e-6, "method": "stepped_sine"}
    up, down = (
        np.abs(frf(case, LIFT, frequencies=f, sweep=way, **options).receptance.values[:, 3, 2])
        for way in ("up", "down")
    )
    upper = np.flatnonzero(up > 2 * down)
    assert 3 <= len(upper) < len(f) - 2 and (np.diff(upper) == 1).all()
    np.testing.assert_allclose(np.delete(up, upper), np.delete(down, upper), rtol=0.01)
    balanced = frf(case, LIFT, frequencies=np.r_[0.4, 0.42, f], method="harmonic", amplitude=5e-6)
    np.testing.assert_allclose(np.abs(balanced.receptance.values[2:, 3, 2]), up, rtol=0.005)


def test_soft_hinges_are_told():
    case = miura_case(bend_law="superlinear")
    with pytest.warns(FoldynWarning, match="secant = an amplitude"):
        found = frf(case, fd.Force([7], (0.01, 0, 0)), frequencies=[0.5, 1.0])
    assert found.attrs["soft_hinges"] == 16
    assert (
        frf(case, fd.Force([7], (0.01, 0, 0)), frequencies=[0.5], secant=1.0).attrs["soft_hinges"]
        == 0
    )


def test_an_iteration_that_is_cut_short_is_told():
    with pytest.warns(FoldynWarning, match="does not converge at 0.4 Hz"):
        found = frf(
            flap(alpha=1.0),
            LIFT,
            frequencies=[0.4],
            method="harmonic",
            amplitude=1e-4,
            iterations=2,
        )
    assert np.isnan(found.receptance.values[0, 3]).all()
    assert np.isnan(found.swing.values).all()


# ------------------------------------------------------------------------ the specimen
# paper (design, section 7): peaks at 3.8, 9.3 and 16.7 Hz; damping 13.5 % (second) and 9 % (third)
PAPER = np.array([3.8, 9.3, 16.7])
DRIVE = fd.Force(TOP, (1e-3, 0, 0))


def specimen(alpha, beta=0.0, **options):
    return paper_specimen(**options).altered(damping=fd.Rayleigh(alpha, beta))


PEAKED = [
    (14.4, 4.1e-4, "circumcenter", 0.05),
    (14.4, 4.1e-4, "consistent", 0.07),
    (15.8, 0.0, "circumcenter", 0.06),
    (15.8, 0.0, "consistent", 0.08),
]


@pytest.mark.parametrize(("alpha", "beta", "mass", "within"), beyond(PEAKED, 3))
def test_peaks_of_the_specimen(alpha, beta, mass, within):
    found = frf(
        specimen(alpha, beta, mass=mass),
        DRIVE,
        frequencies=np.arange(1, 25.1, 0.2),
        method="harmonic",
    )
    assert found.attrs["drive_force"] == pytest.approx(7e-3)
    peaks = peaks_of(found, 0, axis="x", prominence=0.02)
    np.testing.assert_allclose([p.frequency for p in peaks], PAPER, rtol=within)
    if beta > 0.0:
        assert peaks[1].textbook == pytest.approx(0.135, abs=0.015)
        assert peaks[2].textbook == pytest.approx(0.09, abs=0.005)


@pytest.mark.matrix
def test_a_simulated_motion_of_the_specimen_agrees():
    """At the drive of the paper the middle row moves by millimeters: one harmonic is enough."""
    case, f = specimen(15.8), [9.5]
    balanced = frf(case, DRIVE, frequencies=f, method="harmonic")
    moved = frf(case, DRIVE, frequencies=f, method="stepped_sine", settled=3e-3, dt=1.3e-5)
    assert 7e-3 * np.abs(moved.receptance.values).max() > 3e-3
    assert largest_error(balanced.receptance, moved.receptance.values) < 0.02
    weak = frf(case, DRIVE, frequencies=f, method="harmonic", amplitude=0.1)
    assert largest_error(weak.receptance, moved.receptance.values) > 0.05


@pytest.mark.matrix
def test_the_specimen_as_published_about_its_relaxed_equilibrium():
    """Its bends are bent there: a small motion has slopes, and the peaks hardly move with it."""
    case, f = specimen(15.8, rest="as_published"), np.arange(2, 22.1, 0.25)
    found = [
        frf(case, DRIVE, frequencies=f, state="equilibrium", method="harmonic", amplitude=a)
        for a in (0.1, 1.0)
    ]
    weak, full = ([p.frequency for p in peaks_of(r, 0, axis="x", prominence=0.02)] for r in found)
    np.testing.assert_allclose(weak, full, rtol=0.02)
    np.testing.assert_allclose(full, PAPER, rtol=0.10)
    assert modes(case, 1, state="equilibrium").frequency.values[0] > 4.0
    assert linearize(case, "equilibrium").soft == 0
