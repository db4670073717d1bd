"""Response curves: folds, forks and branches against independent computations."""

import numpy as np
import pytest
from duffing import NODE, K, cubic, mass, oscillator
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError, MotionInterrupted
from foldyn.periodic.continuation import Stride
from foldyn.periodic.motion import balance_of
from foldyn.periodic.response import Event, _Tracer

ALPHA, FORCE = 0.1, 0.5
FEW = {"longest_step": 0.2, "steps": 16}  # where multipliers are not what is tested


@pytest.fixture(scope="module")
def curve():
    return fd.response_curve(
        oscillator(), frequencies=(0.1, 0.6), harmonics=13, steps=32, longest_step=0.25
    )


def marked(curve, name):
    return curve.isel(point=np.flatnonzero(curve.bifurcation.values == name))


def period_map(z, v, f):
    """State and monodromy of the scalar oscillator after a period, by DOP853."""
    m, k3 = mass(), cubic()

    def rate(t, y):
        push = FORCE * np.sin(2.0 * np.pi * f * t)
        slope = -(K + 3.0 * k3 * y[0] ** 2) / m
        return [
            y[1], (push - K * y[0] - k3 * y[0] ** 3) / m - ALPHA * y[1],
            y[3], slope * y[2] - ALPHA * y[3], y[5], slope * y[4] - ALPHA * y[5],
        ]  # fmt: skip

    start = [z, v, 1.0, 0.0, 0.0, 1.0]
    end = solve_ivp(rate, (0.0, 1.0 / f), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return end[:2], end[2:].reshape(2, 2).T


@pytest.mark.matrix
def test_folds_are_those_of_the_scalar_equation(curve):
    def at_fold(y):
        end, monodromy = period_map(*y)
        return [*(end - y[:2]), np.linalg.det(monodromy - np.eye(2))]

    folds = marked(curve, "fold")
    assert folds.sizes["point"] == 2
    for k in range(2):
        found = folds.isel(point=k)
        amplitudes, f = found.coefficient.values[:, NODE, 2], float(found.frequency)
        rates = 2j * np.pi * f * np.arange(len(amplitudes)) * amplitudes
        exact = fsolve(at_fold, [amplitudes.sum().real, rates.sum().real, f], xtol=1e-13)
        assert f == pytest.approx(exact[2], rel=1e-8)
        assert np.abs(found.floquet.values - 1.0).min() < 1e-5


@pytest.mark.matrix
def test_folds_of_one_harmonic_are_the_textbook_ones():
    # Duffing's frequency equation (Nayfeh and Mook, Nonlinear Oscillations, 1979, section 4.1; here
    # by harmonic balance): ((k + 3/4 k3 a^2 - m w^2)^2 + (c w)^2) a^2 = F^2 has vertical tangents
    few = pytest.warns(FoldynWarning, match="harmonics = 1")
    with few, pytest.warns(FoldynWarning, match="no multiplier is 1 at the folds"):
        one = fd.response_curve(oscillator(), frequencies=(0.1, 0.6), harmonics=1, **FEW)
    m, k3, c = mass(), cubic(), ALPHA * mass()
    for found in (marked(one, "fold").isel(point=k) for k in range(2)):
        a, w = float(found.amplitude), 2.0 * np.pi * float(found.frequency)
        stiff = K + 0.75 * k3 * a**2 - m * w**2
        assert (stiff**2 + (c * w) ** 2) * a**2 == pytest.approx(FORCE**2, rel=1e-6)
        slope = stiff**2 + (c * w) ** 2 + 1.5 * stiff * k3 * a**2  # d/da^2 of the same, over a^2
        assert slope == pytest.approx(0.0, abs=1e-5 * K**2)


@pytest.mark.matrix
def test_only_motions_between_the_folds_are_unstable_and_they_repel(curve):
    at = np.flatnonzero(curve.bifurcation.values == "fold")
    stable = curve.stable.values.copy()
    stable[at] = True
    assert not stable[at[0] + 1 : at[1]].any()
    assert stable[: at[0]].all()
    assert stable[at[1] :].all()
    middle = curve.isel(point=(at[0] + at[1]) // 2)
    f = float(middle.frequency)
    case = oscillator(frequency=f)
    one = fd.periodic_motion(case, guess=middle, harmonics=13)
    assert not one.stable
    start = one.displacement.values[0].copy()
    start[NODE, 2] += 1e-4
    run = fd.simulate(
        case, 60.0 / f, method="rk4", dt=1.0 / f / 512, every_steps=512,
        initial=fd.State(start, one.velocity.values[0]),
    )  # fmt: skip
    away = run.displacement.values[:, NODE, 2] - one.displacement.values[0, NODE, 2]
    assert np.abs(away).max() > 1e3 * 1e-4


@pytest.mark.matrix
def test_curve_of_small_motions_is_the_linear_response():
    case = oscillator(force=1e-5)
    found = fd.response_curve(case, frequencies=(0.4, 0.1), harmonics=3, **FEW)
    assert found.frequency.values[[0, -1]] == pytest.approx([0.4, 0.1], rel=1e-9)
    still = fd.Case(case.structure, case.supports, damping=case.damping)
    inner = np.sort(found.frequency.values)
    linear = fd.frf(still, fd.Force([NODE], (0, 0, 1.0)), frequencies=inner)
    expected = 1e-5 * np.abs(linear.receptance.values[:, NODE, 2])
    assert found.amplitude.values[::-1] == pytest.approx(expected, rel=1e-5)
    assert found.stable.values.all()
    assert not (found.bifurcation.values != "").any()


@pytest.mark.matrix
def test_curve_along_the_amplitude_meets_that_along_the_frequency(curve):
    at = oscillator(frequency=0.3)
    along = fd.response_curve(at, amplitudes=(0.2, 4.0), harmonics=7, **FEW)
    assert marked(along, "fold").sizes["point"] == 2
    assert along.frequency.values == pytest.approx(0.3)
    assert along.level.values[[0, -1]] == pytest.approx([0.2, 4.0])
    # all three motions at 0.3 Hz and the whole drive, from points nearby on either curve
    found = [
        {
            round(float(np.abs(one.displacement.values).max()), 8)
            for near in _beside(line, of, value)
            for one in [fd.periodic_motion(at, guess=near, harmonics=7, steps=16)]
        }
        for line, of, value in ((along, along.level, 1.0), (curve, curve.frequency, 0.3))
    ]
    assert len(found[0]) == 3
    assert found[0] == found[1]


def _beside(curve, of, value):
    """Points after which a curve passes a value."""
    passes = np.flatnonzero((of.values[:-1] - value) * (of.values[1:] - value) < 0.0)
    return [curve.isel(point=k) for k in passes]


@pytest.fixture(scope="module")
def forked():
    return fd.response_curve(
        oscillator(force=8.0, alpha=0.2), frequencies=(0.18, 0.23), harmonics=7, longest_step=0.5,
        steps=16,
    )  # fmt: skip


@pytest.mark.matrix
def test_symmetry_breaks_at_pitchforks_and_comes_back(forked):
    forks = marked(forked, "pitchfork")
    assert forks.sizes["point"] == 2
    assert np.abs(forks.floquet.values - 1.0).min(axis=1) == pytest.approx(0.0, abs=1e-6)
    means = []
    for branch in (1, 2):
        own = forked.isel(point=np.flatnonzero(forked.branch.values == branch))
        mean = own.coefficient.values[:, 0, NODE, 2].real
        assert mean[[0, -1]] == pytest.approx(0.0, abs=2e-3)  # symmetric at both ends
        assert own.stable.values[1:-1].all()
        means.append(mean[np.abs(mean).argmax()])
    assert means[0] == pytest.approx(-means[1], rel=0.02)  # mirror images, at other points
    assert abs(means[0]) > 0.05
    assert forked.branch.values.max() == 2
    on_curve = forked.isel(point=np.flatnonzero(forked.branch.values == 0))
    assert np.abs(on_curve.coefficient.values[:, 0, NODE, 2]).max() < 1e-7
    inside = (on_curve.frequency > forks.frequency.min()) & (
        on_curve.frequency < forks.frequency.max()
    )
    between = on_curve.isel(point=np.flatnonzero(inside.values))
    assert not between.stable.values.any()


def in_a_well(share):
    """Node of a triangle that snaps through, driven in one well by a share of its inertia there."""
    case = oscillator(height=0.2, spring=False)
    f = float(fd.modes(case.altered(loads=[]), count=1).frequency[0])
    force = share * mass() * (2.0 * np.pi * f) ** 2 * 0.2
    case = oscillator(
        force=force, frequency=f, height=0.2, spring=False, alpha=0.15 * 2.0 * np.pi * f
    )
    return case, f


@pytest.mark.matrix
def test_period_doubles_and_simulation_follows():
    case, f = in_a_well(0.2)
    found = fd.response_curve(case, frequencies=(1.4 * f, 0.7 * f), harmonics=8, longest_step=0.2)
    doubled = marked(found, "period doubling")
    assert doubled.sizes["point"] >= 1
    assert np.abs(doubled.floquet.values + 1.0).min(axis=1) == pytest.approx(0.0, abs=1e-5)
    branch = found.isel(point=np.flatnonzero(found.periods.values == 2))
    steady = branch.isel(point=np.flatnonzero(branch.stable.values))
    middle = steady.isel(point=steady.sizes["point"] // 2)
    here = float(middle.frequency)
    one = fd.periodic_motion(case, here, harmonics=16, guess=middle, periods=2)
    assert one.time.values[1] == pytest.approx(2.0 / here / 128)
    load = fd.Force([NODE], case.loads[0].vector, history=fd.Harmonic(here))
    run = fd.simulate(
        case.altered(loads=[load]), 2.0 / here, method="rk4", dt=1.0 / here / 500, every_steps=500,
        initial=fd.State(one.displacement.values[0], one.velocity.values[0]),
    )  # fmt: skip
    z = run.displacement.values[:, NODE, 2]
    assert z[2] == pytest.approx(z[0], abs=1e-6)
    assert abs(z[1] - z[0]) > 1e-3


@pytest.mark.matrix
def test_measure_shows_what_it_says(curve):
    height = fd.Quantity("mm", "height", function=lambda u, v, t: 1e3 * u[NODE, 2])
    found = fd.response_curve(oscillator(), (0.1, 0.12), harmonics=3, measure=height, **FEW)
    plain = fd.response_curve(oscillator(), (0.1, 0.12), harmonics=3, **FEW)
    assert found.amplitude.values == pytest.approx(1e3 * plain.amplitude.values, rel=1e-12)
    assert found.amplitude.attrs["units"] == "mm"
    speed = fd.Quantity("m/s", "speed", function=lambda u, v, t: v[NODE, 2])
    small = oscillator(force=1e-6)
    slow = fd.response_curve(small, (0.1, 0.12), harmonics=3, measure=speed, **FEW)
    still = fd.response_curve(small, (0.1, 0.12), harmonics=3, **FEW)
    expected = 2.0 * np.pi * still.frequency.values * still.amplitude.values
    assert slow.amplitude.values == pytest.approx(expected, rel=1e-6)


@pytest.mark.matrix
def test_points_found_are_kept_with_a_warning():
    with pytest.warns(FoldynWarning, match="more than 5 points, which are kept"):
        found = fd.response_curve(oscillator(), (0.1, 0.6), harmonics=3, most_points=5)
    assert found.attrs["complete"] == 0
    assert found.sizes["point"] == 6


@pytest.mark.matrix
def test_what_nothing_damps_is_told_where_its_curve_does_not_end():
    undamped = oscillator(alpha=0.0)
    with pytest.warns(FoldynWarning, match="point") as told:
        fd.response_curve(undamped, (0.1, 0.6), harmonics=3, most_points=5)
    assert "give more most_points. Nothing damps the sheet" in str(told[0].message)


@pytest.mark.matrix
def test_points_found_are_kept_when_it_is_interrupted():
    def stop(state):
        if state.steps > 12:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted, match="interrupted after 13 points") as stopped:
        fd.response_curve(oscillator(), (0.1, 0.6), harmonics=3, steps=32, progress=stop)
    kept = stopped.value.partial
    with pytest.warns(FoldynWarning, match="more than 15 points"):
        whole = fd.response_curve(oscillator(), (0.1, 0.6), harmonics=3, steps=32, most_points=15)
    assert kept.attrs["complete"] == 0
    np.testing.assert_array_equal(kept.amplitude, whole.amplitude[:13])


def test_a_fork_without_branch_is_warned_of():
    # as at points that few harmonics take for a period doubling
    tracer = _Tracer("frequencies", (0.1, 0.6), Stride(0.02, 0.1, 10), 32, 1e-9)
    family = tracer.family(balance_of(oscillator(), "a test", 5))
    point = tracer.first(family, None)
    with pytest.warns(FoldynWarning, match="no branch is found at the period doubling at 0.1,"):
        tracer._fork(family, Event("period doubling", point), 0, print)


@pytest.mark.matrix
def test_a_curve_is_saved_and_loaded(tmp_path, curve):
    fd.save(curve, tmp_path / "curve.nc")
    again = fd.load(tmp_path / "curve.nc")
    assert again.bifurcation.values.tolist() == curve.bifurcation.values.tolist()
    assert again.coefficient.values == pytest.approx(curve.coefficient.values)


def test_arguments_out_of_range_are_refused():
    for field, value in (
        ("frequencies", (0.2, 0.2)), ("frequencies", 3), ("amplitudes", (0.1, 0.2)),
        ("harmonics", 0), ("measure", 3), ("measure", fd.Quantity("m")), ("branches", -1),
        ("measure", fd.Quantity("m", function=lambda u, v, t: u[99, 2])), ("steps", 10**9),
        ("longest_step", 0.0), ("most_points", 1), ("steps", 2), ("tolerance", 0.0),
        ("periods", 0), ("guess", "here"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=field):
            fd.response_curve(oscillator(), **({"frequencies": (0.1, 0.2)} | {field: value}))
