"""Periodic motions have all the damping of their case: that of modes and frequency responses."""

import numpy as np
import pytest

import foldyn as fd

LIFT, TINY = 0.02, 1e-7  # N: what bends the fold open, and what shakes it
S = fd.discretize(
    fd.patterns.simple_fold(a=0.8, b=1.0, dihedral=70), fd.Sheet(2e5, 0.3, 0.01, 2.0),
    scheme="n4b5", bend_law="linear",
)  # fmt: skip
HELD = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
PRELOAD = fd.Force([2, 3], (0, 0, LIFT))
F1 = float(fd.modes(fd.Case(S, HELD, [PRELOAD]), 1, state="equilibrium").frequency[0])
W1 = 2.0 * np.pi * F1
BETA = 0.08 / W1
DAMPINGS = {
    "all modes": [fd.ModalDamping(0.04)],
    "one mode": [fd.ModalDamping(0.04, count=1)],
    "ratios of two, and drag": [fd.ModalDamping([0.04, 0.02]), fd.Rayleigh(0.05 * W1)],
    "modes at the start": [fd.ModalDamping(0.04, state="initial")],
    "stiffness at rest": [fd.Rayleigh(beta=BETA)],
    "stiffness at the start": [fd.Rayleigh(beta=BETA, state="initial")],
}


def shaken(name, force=TINY, frequency=F1):
    push = fd.Force([0, 1], (force, 0, 0), history=fd.Harmonic(frequency))
    return fd.Case(S, HELD, [PRELOAD, push], DAMPINGS[name])


@pytest.mark.parametrize("name", DAMPINGS)
def test_small_motions_about_a_loaded_state_are_the_linear_response(name):
    case = shaken(name)
    one = fd.periodic_motion(case, harmonics=2)
    still = case.altered(loads=[PRELOAD])
    linear = fd.frf(still, fd.Force([0, 1], (TINY, 0, 0)), frequencies=[F1], state="equilibrium")
    expected = -1j * linear.receptance.values[0] * linear.attrs["drive_force"]
    found = one.coefficient.values[1]
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()
    ratio = float(fd.modes(still, 1, state="equilibrium").damping_ratio[0])
    decay = np.exp(-2.0 * np.pi * ratio)
    assert np.abs(np.abs(one.floquet.values) - decay).min() < 1e-3


@pytest.mark.parametrize("name", ["all modes", "modes at the start", "stiffness at the start"])
def test_large_motions_come_back_in_simulated_ones(name):
    case = shaken(name, force=3e-4)
    one = fd.periodic_motion(case, harmonics=9)
    run = fd.simulate(
        case, 1.0 / F1, method="dormand_prince", interval=0.5 / F1, tolerance=1e-9,
        initial=fd.initial_state(one, 0),
    )  # fmt: skip
    swing = np.ptp(one.displacement.values, axis=0).max()
    assert swing > 0.01
    for name in ("displacement", "velocity"):
        apart = np.abs(run[name].values[-1] - one[name].values[0]).max()
        assert apart < 1e-5 * np.abs(one[name].values).max()


@pytest.mark.matrix
def test_curves_and_damped_backbones_have_it_and_say_about_which_state():
    case = shaken("modes at the start", force=1e-5)
    curve = fd.response_curve(case, (0.95 * F1, 1.05 * F1), harmonics=3)
    spine = fd.backbone(case, amplitudes=(1e-5, 2e-5), harmonics=3, damped=True)
    one = fd.periodic_motion(case, harmonics=3, guess=curve.isel(point=-1))
    equilibrium = fd.trace(fd.Case(S, HELD, [PRELOAD]), "newton").displacement.values[-1]
    for found in (curve, spine, one):
        assert np.abs(found.origin.values - equilibrium).max() < 1e-6
    linear = fd.frf(
        case.altered(loads=[PRELOAD]), fd.Force([0, 1], (1e-5, 0, 0)),
        frequencies=np.linspace(0.95, 1.05, 41) * F1, state="equilibrium",
    )  # fmt: skip
    peak = np.abs(linear.receptance.values).max() * linear.attrs["drive_force"]
    assert np.abs(curve.coefficient.values[:, 1]).max() == pytest.approx(peak, rel=5e-3)
    assert spine.frequency.values[0] == pytest.approx(F1, rel=5e-3)
    assert spine.level.values[0] * peak == pytest.approx(1e-5, rel=0.1)
