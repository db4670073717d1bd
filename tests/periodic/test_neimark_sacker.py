"""The absorber of a Duffing oscillator, whose resonance breaks up at a Neimark-Sacker point."""

from pathlib import Path

import absorber
import numpy as np
import pytest
from absorber import CUBIC, DASHPOT, FORCE, MASS, STAND, STIFFNESS, X, Y
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import foldyn as fd
from foldyn.periodic.families import ByFrequency
from foldyn.periodic.motion import balance_of

TURN = 2.0 * np.pi


def test_structure_has_the_forces_of_the_equation():
    case, u = absorber.case(), np.zeros((6, 3))
    for x, y in ((0.7, 0.7), (0.7, -0.2)):
        u[[X, *STAND], 2], u[Y, 2] = x, y
        found = case.body.internal(case.body.dofs(u)).reshape(-1, 3)[:, 2]
        between = STIFFNESS[1] * (x - y) + CUBIC[1] * (x - y) ** 3
        assert found[[X, *STAND]].sum() == pytest.approx(STIFFNESS[0] * x + x**3 + between)
        assert found[Y] == pytest.approx(-between)


@pytest.fixture(scope="module")
def curve():
    ends = 1.05 / TURN, 1.13 / TURN
    return fd.response_curve(absorber.case(), ends, harmonics=9, longest_step=0.5, steps=32)


def rate(t, state, f):
    """Of the equation in `absorber`, and of deviations from a motion."""
    (x, y, v, w), deviation = state[:4], state[4:].reshape(4, 4)
    pull = STIFFNESS[1] * (x - y) + CUBIC[1] * (x - y) ** 3 + DASHPOT[1] * (v - w)
    push = FORCE * np.sin(TURN * f * t) - STIFFNESS[0] * x - CUBIC[0] * x**3 - DASHPOT[0] * v
    k, c = STIFFNESS[1] + 3.0 * CUBIC[1] * (x - y) ** 2, DASHPOT[1]
    ground = STIFFNESS[0] + 3.0 * CUBIC[0] * x**2
    slope = np.array(
        [[0, 0, 1, 0], [0, 0, 0, 1], [-ground - k, k, -DASHPOT[0] - c, c], [k, -k, c, -c]]
    )
    slope[2] /= MASS[0]
    slope[3] /= MASS[1]
    own = [v, w, (push - pull) / MASS[0], pull / MASS[1]]
    return np.concatenate([own, (slope @ deviation).ravel()])


@pytest.mark.matrix
def test_it_is_where_a_pair_of_the_equation_leaves_the_circle(curve):
    (at,) = np.flatnonzero(curve.bifurcation.values == "Neimark-Sacker")
    found = curve.isel(point=at)
    f, amplitudes = float(found.frequency), found.coefficient.values[:, [X, Y], 2]
    rates = TURN * f * np.arange(len(amplitudes))[:, None] * 1j * amplitudes

    def crossing(y):
        start = np.append(y[:4], np.eye(4).ravel())
        end = solve_ivp(
            rate, (0.0, 1.0 / y[4]), start, "DOP853", args=(y[4],), rtol=1e-10, atol=1e-11
        )
        ended, monodromy = end.y[:4, -1], end.y[4:, -1].reshape(4, 4)
        return [*(ended - y[:4]), np.abs(np.linalg.eigvals(monodromy)).max() - 1.0]

    guess = [*amplitudes.sum(axis=0).real, *rates.sum(axis=0).real, f]
    exact = fsolve(crossing, guess, xtol=1e-10)
    assert f == pytest.approx(exact[4], rel=1e-7)
    assert f * TURN == pytest.approx(1.1127, abs=1e-4)


def strobed(point, periods=600):
    """The oscillator once a period, m, after a little push on a motion of the curve."""
    f = float(point.frequency)
    one = fd.periodic_motion(absorber.case(f), f, guess=point, steps=32)
    start = fd.State(one.displacement.values[0] * 1.001, one.velocity.values[0])
    run = fd.simulate(
        absorber.case(f),
        periods / f,
        method="rk4",
        dt=1.0 / f / 128,
        initial=start,
        every_steps=128,
    )
    return run.displacement.values[:, X, 2] - one.displacement.values[0, X, 2], one


@pytest.mark.matrix
def test_motions_before_it_are_steady_and_beyond_it_quasi_periodic(curve):
    before, one = strobed(curve.isel(point=0))
    assert bool(one.stable)
    assert np.abs(before[-50:]).max() < 1e-3 * np.abs(before[:50]).max()
    beyond, other = strobed(curve.isel(point=-1))
    assert not bool(other.stable)
    late = beyond[300:]
    assert np.ptp(late) > 0.1  # far from the periodic motion
    assert np.ptp(late[:150]) == pytest.approx(np.ptp(late[150:]), rel=0.05)  # and it stays so
    spectrum = np.abs(np.fft.rfft((late - late.mean()) * np.hanning(len(late))))
    line = spectrum.argmax()  # a second frequency, about that of the multiplier
    angle = TURN * line / len(late)
    assert angle == pytest.approx(abs(np.angle(other.floquet.values[0])), rel=0.15)
    near = np.abs(np.arange(len(spectrum)) - line) <= 3
    multiples = np.abs((np.arange(len(spectrum)) / line + 0.5) % 1.0 - 0.5) * line <= 5
    assert (spectrum[~multiples] ** 2).sum() < 0.01 * (spectrum[near] ** 2).sum()  # no chaos


def test_motions_are_those_of_pyharm():
    """Its coefficients, of all branches, solve our equation to 2e-10, as it iterates."""
    rows = np.loadtxt(Path(absorber.__file__).with_name("absorber_by_pyharm.csv"), delimiter=",")
    harmonics = 7
    balance = balance_of(absorber.case(), "a test", harmonics)
    assert np.ptp(rows[:, 0]) > 0.39  # rad/s
    amplitudes = rows[:, 1:].reshape(len(rows), 2, -1)
    cosines, sines = np.split(amplitudes, [harmonics + 1], axis=2)
    theirs = cosines.astype(complex)
    theirs[:, :, 1:] -= 1j * sines
    family = ByFrequency(balance, 1.0, 1e-9)
    for omega, both in zip(rows[:, 0], theirs, strict=True):
        x = balance.fourier.real_of(both.T)
        found = family.solved(x.ravel(), omega / TURN)
        assert np.linalg.norm(found.x - x.ravel()) < 2e-9 * np.linalg.norm(x)
