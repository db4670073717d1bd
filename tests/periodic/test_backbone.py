"""Backbones: normal modes against elliptic functions, linear modes and resonances."""

import numpy as np
import pytest
from duffing import NODE, K, cubic, mass, oscillator
from scipy.special import ellipk

import foldyn as fd
from foldyn.errors import ComputationError, FoldynWarning, InputError, MotionInterrupted


def exact_frequency(amplitude):
    """Of Duffing's free oscillator (Kovacic and Brennan, The Duffing Equation, 2011, ch. 2), Hz."""
    whole = K + cubic() * amplitude**2
    modulus2 = cubic() * amplitude**2 / (2.0 * whole)
    return np.sqrt(whole / mass()) / (4.0 * ellipk(modulus2))


@pytest.fixture(scope="module")
def spine():
    return fd.backbone(oscillator(), amplitudes=(1e-3, 2.0), harmonics=25, longest_step=0.4)


@pytest.mark.matrix
def test_backbone_of_duffing_is_that_of_elliptic_functions(spine):
    a = spine.amplitude.values
    assert a[[0, -1]] == pytest.approx([1e-3, 2.0], rel=1e-7)
    assert spine.frequency.values == pytest.approx(exact_frequency(a), rel=1e-9)
    assert spine.energy.values == pytest.approx(K * a**2 / 2 + cubic() * a**4 / 4, rel=1e-9)
    assert spine.energy_drift.values.max() < 1e-10


@pytest.fixture(scope="module")
def miura():
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), scheme="n5b8", bend_law="linear")
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    return fd.Case(s, held, damping=fd.Rayleigh(alpha=0.1))


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_small_motions_have_the_frequency_of_the_linear_mode(miura, mode):
    found = fd.backbone(miura, mode, amplitudes=(1e-6, 2e-6), harmonics=3)
    linear = fd.modes(miura, count=3).frequency.values[mode - 1]
    assert found.frequency.values[0] == pytest.approx(linear, rel=1e-6)
    assert found.attrs["linear_frequency"] == pytest.approx(linear, rel=1e-9)
    assert found.energy_drift.values.max() < 1e-12


@pytest.mark.matrix
def test_energy_of_a_sheet_is_constant_and_the_motion_is_a_simulated_one(miura):
    found = fd.backbone(miura, amplitudes=(1e-3, 2e-2), harmonics=9)
    assert found.energy_drift.values.max() < 1e-10
    assert found.sizes["harmonic"] > 10  # the largest motions take more than nine
    last = found.isel(point=-1)
    start = last.coefficient.values.sum(axis=0).real
    period = 1.0 / float(last.frequency)
    free = fd.Case(miura.structure, miura.supports)
    run = fd.simulate(free, period, method="rk4", initial=fd.State(start), interval=period / 8)
    assert run.displacement.values[-1] == pytest.approx(start, abs=1e-8)


@pytest.mark.matrix
def test_constant_loads_shift_the_state_about_which_it_vibrates(miura):
    loaded = miura.altered(loads=[fd.Force([7], (2e-3, 0, 0))])
    found = fd.backbone(loaded, amplitudes=(1e-6, 2e-6), harmonics=3)
    linear = fd.modes(loaded, count=1, state="equilibrium").frequency.values[0]
    assert found.frequency.values[0] == pytest.approx(linear, rel=1e-6)
    assert linear != pytest.approx(found.attrs["linear_frequency"] * 1.01, rel=1e-4)
    assert found.energy_drift.values.max() < 1e-10


@pytest.fixture(scope="module")
def resonant():
    return fd.backbone(
        oscillator(), amplitudes=(0.01, 1.8), harmonics=9, damped=True, longest_step=0.4
    )


def test_resonance_without_damping_is_refused():
    case = oscillator().altered(damping=fd.Rayleigh())
    with pytest.raises(InputError, match="damped: nothing damps the sheet"):
        fd.backbone(case, amplitudes=(0.01, 0.1), damped=True)


@pytest.mark.matrix
def test_damped_backbone_is_that_of_the_scalar_equation(resonant):
    assert resonant.frequency.values == pytest.approx(
        exact_frequency(resonant.amplitude.values), rel=1e-5
    )
    assert resonant.stable.values.all()


@pytest.mark.matrix
def test_damped_backbone_follows_the_peaks_of_response_curves(resonant):
    curve = fd.response_curve(
        oscillator(0.1), (0.225, 0.255), harmonics=7, longest_step=0.06, branches=0, steps=8
    )
    here = np.interp(0.1 / 0.5, resonant.level.values, resonant.amplitude.values)
    assert curve.amplitude.values.max() == pytest.approx(here, rel=5e-3)


@pytest.mark.matrix
def test_in_phase_resonance_force_and_displacement_are_a_quarter_apart(resonant):
    first = resonant.coefficient.values[:, 1, NODE, 2]
    assert np.angle(first / -1j) == pytest.approx(-np.pi / 2, abs=1e-9)  # the force is a sine
    point = resonant.isel(point=-1)
    case = oscillator(0.5 * float(point.level), float(point.frequency))
    one = fd.periodic_motion(case, guess=point)
    assert one.coefficient.values[1, NODE, 2] == pytest.approx(first[-1], rel=1e-6)


def test_what_does_not_swing_is_refused_and_what_is_lost_is_warned_of():
    unstable = np.zeros((3, 3))
    unstable[NODE, 2] = -0.2
    with pytest.raises(ComputationError, match="does not swing"):
        fd.backbone(oscillator(height=0.2, spring=False), state=fd.State(unstable))
    with pytest.warns(FoldynWarning, match="the points before are kept"):
        found = fd.backbone(oscillator(), amplitudes=(1e-3, 1.0), most_points=4)
    assert found.attrs["complete"] == 0
    assert found.sizes["point"] == 5


@pytest.mark.matrix
def test_points_found_are_kept_when_it_is_interrupted():
    def stop(state):
        if state.steps > 4:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted, match="interrupted after 5 points") as stopped:
        fd.backbone(oscillator(), amplitudes=(1e-3, 1.0), progress=stop)
    kept, whole = stopped.value.partial, fd.backbone(oscillator(), amplitudes=(1e-3, 1.0))
    assert kept.attrs["complete"] == 0
    np.testing.assert_array_equal(kept.amplitude, whole.amplitude[:5])


def test_arguments_out_of_range_are_refused():
    for field, value in (
        ("mode", 0), ("mode", 9), ("amplitudes", (1.0, 0.5)), ("amplitudes", 2), ("harmonics", 0),
        ("damped", 3), ("state", "here"), ("longest_step", 2.0), ("most_points", 0),
        ("tolerance", 0.0),
    ):  # fmt: skip
        with pytest.raises(InputError, match=field):
            fd.backbone(oscillator(), **{field: value})
