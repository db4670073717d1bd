"""Stepped and swept sines: steady amplitudes, and jumps at the folds of Duffing's curve."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from two_bars import SIZE, TURN, X, at, duffing, place

import foldyn as fd
from foldyn.attractors.diagram import Steady, repeats_after
from foldyn.attractors.jumps import jumps_between
from foldyn.attractors.run import extremes
from foldyn.attractors.sweep import Line
from foldyn.errors import ComputationError, FoldynWarning, InputError, MotionInterrupted
from one_hinge import WING, one_hinge

ALPHA, FORCE = 0.05, 0.06
DT = TURN / 64
DOCS = Path(__file__).resolve().parents[2] / "docs"
FOLDS = 1.11990, 1.28847
"""Of the same curve by harmonic balance with 9 harmonics, rad/s."""


def folds() -> tuple[float, float]:
    """Angular frequencies at which Duffing's curve turns back: above, where a sweep up falls.

    From one harmonic: (1 - w^2 + 3/4 A^2)^2 + (alpha w)^2 = (F / A)^2, a quadratic in w^2.
    """
    a = np.linspace(1e-3, FORCE / ALPHA, 400_001)
    backbone = 1.0 + 0.75 * a**2
    half, product = backbone - 0.5 * ALPHA**2, backbone**2 - (FORCE / a) ** 2
    with np.errstate(invalid="ignore"):
        right, left = (np.sqrt(half + sign * np.sqrt(half**2 - product)) for sign in (1, -1))
    lower = right[1:-1][(right[1:-1] < right[:-2]) & (right[1:-1] < right[2:])]
    return float(lower[0]), float(np.nanmax(left))


@pytest.fixture(scope="module")
def hardening():
    return duffing(1.0, ALPHA, FORCE)


def test_the_cell_is_duffings_oscillator():
    case = duffing(-1.0)
    for x in (-1.7, -1.0, -0.3, 0.4, 1.2):
        force = case.structure.internal_force(at(case, x).displacement)[1, 2] / SIZE
        assert force == pytest.approx(x**3 - x, abs=1e-5)


@pytest.mark.matrix
def test_a_stepped_sine_jumps_at_the_folds(hardening):
    found = fd.bifurcation_diagram(
        hardening, X, frequencies=np.arange(1.04, 1.42, 0.06) / TURN, settle=120, record=4, dt=DT
    )
    assert found.jump_sweep.values.tolist() == ["up", "down"]
    (up, down), (low, high) = TURN * found.jump_between.values, folds()
    assert abs(np.diff([up, down])).max() < 1e-3 * high
    assert up.mean() == pytest.approx(high, rel=3e-3)
    assert down.mean() == pytest.approx(low, rel=3e-3)
    np.testing.assert_allclose([down.mean(), up.mean()], FOLDS, rtol=1e-3)  # all harmonics
    assert down.mean() < 1.2 < up.mean()
    (before, after), (small, large) = found.jump_amplitude.values
    assert before > 6.0 * after and large > 2.0 * small
    # a step of 0.06 rad/s kicks the sweep up off at 1.28, but slow ones do not
    kicked = found.amplitude.sel(frequency=1.28 / TURN, method="nearest").values
    assert kicked[0] > before - 0.05
    between = found.sel(frequency=1.22 / TURN, method="nearest").amplitude.values
    assert between[0] > 4.0 * between[1]  # two motions at one frequency
    assert (found.periods == 1).all()
    assert np.ptp(found.section.values, axis=2).max() < 1e-3
    assert found.amplitude.attrs["units"] == "1" and found.frequency.attrs["units"] == "Hz"


@pytest.mark.matrix
def test_points_that_a_long_step_kicked_off_are_replaced(hardening):
    """The sweep down in steps of 0.02 rad/s falls at 1.12, where slow steps stay, barely."""
    omega = np.array([1.1, 1.12, 1.14, 1.2, 1.32])
    found = fd.bifurcation_diagram(
        hardening, X, frequencies=omega / TURN, sweep="down", settle=150, record=4, dt=DT
    )
    (between,), (sizes,) = TURN * found.jump_between.values, found.jump_amplitude.values
    assert between[0] <= 1.12 + 1e-9
    assert sizes[0] == pytest.approx(found.amplitude.values[0, 1], rel=0.02)
    assert sizes[0] < 0.4 < sizes[1]


@pytest.mark.matrix
def test_a_swept_sine_jumps_past_the_folds(hardening):
    found = fd.swept_sine(
        hardening, X, frequencies=np.array([1.0, 1.4]) / TURN, duration=1500 * TURN, dt=DT
    )
    (low, high), between = folds(), TURN * found.jump_between.values
    assert found.jump_sweep.values.tolist() == ["up", "down"]
    np.testing.assert_allclose(between.mean(axis=1), [high, low], rtol=0.015)
    assert between[0].mean() > high and between[1].mean() < low  # late, both ways
    apart = found.amplitude.sel(sweep="up") / found.amplitude.sel(sweep="down")
    assert apart.max() > 4.0
    assert found.frequency.values[0, 0] == pytest.approx(1.0 / TURN, rel=1e-3)
    np.testing.assert_allclose(np.diff(found.frequency.values[:, [0, -1]]), 0.4 / TURN, rtol=2e-3)


def test_a_glide_begins_as_the_harmonics_that_it_replaces():
    line, t = Line(2.0, 2.1, 1e6), np.linspace(0.0, 1.0, 9)
    for own in (fd.Harmonic(1.0, 30.0), fd.Harmonic(3.0, -50.0)):
        np.testing.assert_allclose(line.chirp(1.0)(own)(t), own(2.0 * t), rtol=0, atol=1e-5)


@pytest.mark.matrix
def test_a_sharp_resonance_without_folds_has_no_jumps():
    case = duffing(1.0, 0.03, 0.01, cubic=False)
    omega = np.array([0.8, 0.96, 0.99, 1.0, 1.02, 1.1])
    found = fd.bifurcation_diagram(
        case,
        X,
        frequencies=omega / TURN,
        settle=130,
        record=4,
        dt=DT,
        initial=at(case, 0.4),
        sweep="down",
    )
    exact = 0.01 / np.hypot(1.0 - omega**2, 0.03 * omega)
    np.testing.assert_allclose(found.amplitude.values[0], exact, rtol=1e-4)
    assert found.sizes["jump"] == 0
    assert exact.max() > 10.0 * exact.min()


@pytest.mark.matrix
def test_levels_of_the_drive_scale_a_linear_motion():
    case = duffing(1.0, 0.2, 0.1, omega=0.8, cubic=False)
    found = fd.bifurcation_diagram(case, X, amplitudes=[0.5, 1.0, 3.0], settle=60, record=4)
    exact = 0.1 / np.hypot(1.0 - 0.8**2, 0.2 * 0.8)
    np.testing.assert_allclose(found.amplitude, [[0.5 * exact, exact, 3.0 * exact]] * 2, rtol=1e-3)


@pytest.mark.matrix
def test_base_motions_and_multiples_of_the_drive_are_swept():
    """A mass on a spring whose foot moves: nothing but its relative motion strains it."""
    case = duffing(0.0, 0.1, cubic=True)
    shaken = case.altered(
        supports=[*case.supports, fd.BaseMotion("z", fd.Harmonic(1.0 / TURN), 0.5 * SIZE)],
        loads=[fd.Force([1], (0, 0, 0.2 * SIZE), fd.Harmonic(3.0 / TURN))],
    )
    found = fd.bifurcation_diagram(
        shaken, X, frequencies=[0.9 / TURN], sweep="up", settle=200, record=8, dt=DT
    )
    same = shaken.altered(
        supports=[*case.supports, fd.BaseMotion("z", fd.Harmonic(0.9 / TURN), 0.5 * SIZE)],
        loads=[fd.Force([1], (0, 0, 0.2 * SIZE), fd.Harmonic(2.7 / TURN))],
    )
    motion = fd.simulate(
        same, 208 * TURN / 0.9, method="rk4", dt=TURN / 0.9 / 128, interval=TURN / 0.9 / 64
    )
    late = place(case, motion.displacement.values[-8 * 64 - 1 :])
    assert found.amplitude.item() == pytest.approx(0.5 * np.ptp(late), rel=2e-3)
    assert found.periods.item() == 1


@pytest.mark.matrix
def test_a_period_doubling_shows_in_the_section():
    """x'' + 0.3 x' - x + x^3 = f cos 1.2 t: periods 1, 2, 4 at these f.

    https://en.wikipedia.org/wiki/Duffing_equation, section Examples: f = 0.2, 0.28 and 0.29.
    """
    case = duffing(-1.0, 0.3, 0.2, omega=1.2, phase=90.0)
    found = fd.bifurcation_diagram(
        case, X, amplitudes=[1.0, 1.4, 1.45], sweep="up", settle=400, record=16, dt=TURN / 150
    )
    assert found.periods.values.tolist() == [[1, 2, 4]]


@pytest.mark.matrix
def test_a_kresling_tower_doubles_its_period():
    """The force grows in steps small enough that the tower stays in one state, without chaos."""
    script = runpy.run_path(str(DOCS / "long_motions_figures.py"))
    forces = [2.2, 2.5, 2.75, 2.85, 2.91, 2.965]
    rise = fd.Quantity("mm", function=lambda u, v, t: 1e3 * u[script["TOP"], 2].mean())
    found = fd.bifurcation_diagram(
        script["shaken"](), rise, amplitudes=forces, sweep="up", settle=120, record=16
    )
    assert found.periods.values.tolist() == [[1, 1, 2, 2, 2, 4]]


@pytest.mark.matrix
@pytest.mark.parametrize(("most", "points"), [(3, [3, 0]), (5, [4, 1])])
def test_points_found_are_kept_when_it_is_interrupted(most, points):
    def stop(state):
        if state.steps >= most:
            raise KeyboardInterrupt

    case, given = duffing(1.0, 0.3, 0.1), {"settle": 2, "record": 4, "dt": TURN / 100}
    given |= {"frequencies": np.array([0.6, 0.7, 0.8, 0.9]) / TURN}
    with pytest.raises(MotionInterrupted, match=f"interrupted after {most} points") as stopped:
        fd.bifurcation_diagram(case, X, progress=stop, **given)
    kept, whole = stopped.value.partial, fd.bifurcation_diagram(case, X, **given)
    assert kept.attrs["complete"] == 0
    for way, (up_to, order) in enumerate(zip(points, (1, -1), strict=True)):
        if up_to:
            own, all_of_it = kept.amplitude[way, ::order], whole.amplitude[way, ::order]
            np.testing.assert_array_equal(own[:up_to], all_of_it[:up_to])
            assert np.isnan(own[up_to:]).all()
    assert kept.sizes["sweep"] == np.count_nonzero(points)


def test_an_interrupt_before_the_first_point_keeps_nothing():
    def stop(u, v, t):
        if t > 0.0:  # not yet where the measure is checked
            raise KeyboardInterrupt
        return 0.0

    measure = fd.Quantity("m", function=stop)
    with pytest.raises(MotionInterrupted, match="before the first point"):
        fd.bifurcation_diagram(
            duffing(1.0, 0.3, 0.1), measure, frequencies=[0.1], settle=2, record=4
        )


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance")
def test_a_sweep_whose_motion_fails_keeps_its_points():
    """Bars stiffen as the force grows, until steps of 0.7 s are too long for them."""
    case = duffing(0.0, 0.3, 0.1)
    given = {"settle": 20, "record": 4, "dt": 0.7}
    with pytest.warns(FoldynWarning, match=r"the sweep up ends after the level \d+: ") as told:
        found = fd.bifurcation_diagram(
            case, X, amplitudes=[1.0, 4.0, 16.0, 64.0, 256.0, 1024.0], **given
        )
    assert "too large" in str(told[-1].message)
    there = np.isfinite(found.amplitude.values)
    assert found.attrs["complete"] == 0 and there[:, 0].all() and not there[:, -1].any()
    np.testing.assert_array_equal(there[0], there[1])
    with pytest.raises(ComputationError):
        fd.bifurcation_diagram(case, X, amplitudes=[1024.0], **given)


def test_a_motion_repeats_where_half_of_its_record_tells():
    record = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])[:, None]
    assert repeats_after(record, 0.1) == 3
    assert repeats_after(record[:5], 0.1) == 0  # of the third state there is but one
    assert repeats_after(record + 0.2 * np.arange(6)[:, None], 0.1) == 0


def test_extremes_lie_between_samples():
    t = np.linspace(0.3, 9.0, 60)
    top, bottom = extremes(2.0 * np.sin(t) + 1.0)
    assert top.max() == pytest.approx(3.0, abs=1e-4) and bottom.min() == pytest.approx(
        -1.0, abs=1e-4
    )


def test_jumps_are_large_changes_within_the_width():
    place_ = np.linspace(1.0, 2.0, 1001)
    steep = 1.0 + 0.5 * np.tanh((place_ - 1.5) / 0.05)
    assert not jumps_between("up", place_, steep, 0.01)
    ringing = np.where(place_ > 1.5, 3.0 + np.exp(-(place_ - 1.5) / 0.01), 1.0)
    (jump,) = jumps_between("up", place_, ringing, 0.01)
    assert jump.place <= 1.5 <= jump.after and jump.amplitudes[0] == 1.0
    two = np.where(place_ > 1.5, 2.0, 1.0) + np.where(place_ > 1.53, 2.0, 0.0)  # 2 widths apart
    (jump,) = jumps_between("up", place_, two, 0.01)  # the larger of both
    assert jump.place <= 1.53 <= jump.after
    assert len(jumps_between("up", place_, two, 0.005)) == 2


def test_what_cannot_be_swept_is_refused(hardening):
    creases = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.0, dihedral=60),
        fd.Sheet(1e6, 0.25, 0.01, density=1.0),
        preset="plate",
    )
    swinging = fd.Case(
        creases, [fd.Fix([4, 5])], [fd.Actuate("all", angle=70, history=fd.Harmonic(1.0))]
    )
    ridge = fd.Quantity(function=lambda u, v, t: u[2, 2])
    for message, call in {
        "nothing drives it": lambda: fd.bifurcation_diagram(duffing(1.0), X, frequencies=[1.0]),
        "frequencies: give frequencies": lambda: fd.bifurcation_diagram(hardening, X),
        r"frequencies\[1\] = 1.0: must increase": lambda: fd.bifurcation_diagram(
            hardening, X, frequencies=[2.0, 1.0]
        ),
        "measure: must have a function": lambda: fd.swept_sine(
            hardening, fd.Quantity("m"), frequencies=(0.1, 0.2), duration=100.0
        ),
        "duration = 1 s: holds fewer": lambda: fd.swept_sine(
            hardening, X, frequencies=(1.0, 2.0), duration=1.0
        ),
        "duration: .* samples of 3 nodes needs about": lambda: fd.swept_sine(
            hardening, X, frequencies=(0.1, 0.2), duration=1e12
        ),
        "measure: raised IndexError": lambda: fd.swept_sine(
            hardening,
            fd.Quantity(function=lambda u, v, t: u[99, 2]),
            frequencies=(0.1, 0.2),
            duration=100.0,
        ),
        "the lower one first": lambda: fd.swept_sine(
            hardening, X, frequencies=(2.0, 1.0), duration=100.0
        ),
        "amplitudes: Actuate has no size": lambda: fd.bifurcation_diagram(
            swinging, ridge, amplitudes=[1.0]
        ),
        "must give a finite number": lambda: fd.bifurcation_diagram(
            hardening,
            fd.Quantity(function=lambda u, v, t: u[0]),
            frequencies=[0.2],
            settle=1,
            record=4,
        ),
    }.items():
        with pytest.raises(InputError, match=message):
            call()


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("cubic", "alpha", "force", "ends"),
    [(False, 0.03, 0.01, (0.85, 1.15)), (True, 0.1, 0.04, (0.95, 1.2))],
)
def test_a_swept_sine_has_no_jumps_where_curves_are_but_steep(cubic, alpha, force, ends):
    """The flank of a sharp resonance, and a curve that leans over and has not yet a fold."""
    case = duffing(1.0, alpha, force, cubic=cubic)
    found = fd.swept_sine(case, X, frequencies=np.array(ends) / TURN, duration=450 * TURN, dt=DT)
    assert found.sizes["jump"] == 0
    step = max(1, int(0.01 / abs(np.diff(found.frequency[0])[0]) / TURN))
    change = found.amplitude.values[:, step:] / found.amplitude.values[:, :-step]
    assert np.abs(np.log(change)).max() > 0.2  # within a hundredth of the frequency


@pytest.mark.matrix
def test_steps_from_a_sweep_begin_with_what_creases_remember_there(monkeypatch):
    """A crease that has yielded in the sweep has a permanent turn where motions are held."""
    drive = fd.Force([WING], (0, 0, 2e-3), fd.Harmonic(0.7))
    law = fd.Plastic(yield_moment=3e-3, law="linear")
    case = one_hinge(law, loads=[drive], damping=fd.Rayleigh(alpha=0.3), hold=False)
    held = []
    point = Steady.point
    monkeypatch.setattr(Steady, "point", lambda *a: held.append(a[1].state) or point(*a))
    lift = fd.Quantity("m", "lift", (), lambda u, v, t: u[WING, 2])
    fd.swept_sine(
        case,
        lift,
        frequencies=(0.4, 0.9),
        duration=25.0,
        sweep="up",
        resolution=0.2,
        settle=2,
        dt=0.01,
    )
    assert held
    assert np.abs(held[0].memory).max() > 0.01
