"""Laws with memory by themselves: closed forms, exact steps, energies."""

from __future__ import annotations

import numpy as np
import pytest
from branch_runs import LAWS, histories, moments

import foldyn as fd
from foldyn.errors import InputError
from foldyn.materials import HINGE_LAWS, MemoryLaw, hinge_law
from pairwise import beyond

RANDOM = np.random.default_rng(20)
TURNS, TIMES = 0.1 * RANDOM.normal(size=12), 0.2 * RANDOM.random(12)


def divided(parts):
    """The same history with each step, at its constant rate, in so many parts."""
    at = np.arange(1, len(TURNS) * parts + 1) / parts
    return np.interp(at, np.arange(len(TURNS) + 1), [0.0, *TURNS]), np.repeat(TIMES / parts, parts)


def test_all_registered_laws_with_memory_are_tested():
    assert {name for name, law in HINGE_LAWS.items() if issubclass(law, MemoryLaw)} == set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_a_step_is_exact_for_turns_at_a_constant_rate(name):
    """So it does not matter in how many parts it is taken."""
    whole, parts = histories(LAWS[name], TURNS, TIMES), histories(LAWS[name], *divided(100))
    np.testing.assert_allclose(parts[:, 99::100, :3], whole[:, :, :3], rtol=0, atol=1e-12)


@pytest.mark.parametrize("last", [TIMES[-1], 0.02, 1e-4])
@pytest.mark.parametrize("name", LAWS)
def test_slopes_are_derivatives_by_the_turn_at_the_end_of_a_step(name, last):
    """Of the moment at the end and of the mean moment."""
    h, times = 1e-6, np.append(TIMES[:-1], last)
    ends = [histories(LAWS[name], [*TURNS[:-1], TURNS[-1] + d], times)[:, -1] for d in (h, -h)]
    slopes = (ends[0] - ends[1])[:, [2, 6]] / (2 * h)
    found = histories(LAWS[name], TURNS, times)[:, -1, [3, 7]]
    np.testing.assert_allclose(slopes, found, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", LAWS)
def test_work_is_what_is_stored_and_dissipated(name):
    """The work by Simpson's rule over fine steps; what is dissipated never comes back."""
    turns, times = divided(2000)
    found = histories(LAWS[name], turns, times)
    moment = np.concatenate([np.zeros((len(found), 1)), found[:, :, 2]], axis=1)
    change = np.diff(turns, prepend=0.0)
    work = (0.5 * (moment[:, 1:] + moment[:, :-1]) * change).sum()
    stored, lost = found[:, -1, 4].sum(), found[:, :, 5]
    assert (lost >= -1e-15).all()
    assert abs(work - stored - lost.sum()) < 2e-6 * lost.sum()


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0])
@pytest.mark.parametrize("name", LAWS)
def test_mean_moments_do_the_work_that_is_stored_and_lost(name, size):
    """Exactly, in steps of any size; what they lose instead of the law is no less than nothing."""
    turns, times = 0.1 + size * TURNS.cumsum(), size * TIMES
    found = histories(LAWS[name], np.append(0.1, turns), np.append(0.0, times))
    change = np.diff(turns, prepend=0.1)
    stored, lost = np.diff(found[:, :, 4], axis=1), (found[:, :, 5] - found[:, :, 8])[:, 1:]
    np.testing.assert_allclose(found[:, 1:, 6] * change, stored + lost, rtol=0, atol=2e-16)
    assert (lost >= -1e-17).all()
    middle = 0.5 * (found[:, 1:, 2] + found[:, :-1, 2])
    np.testing.assert_allclose(found[:, 1:, 6], middle, rtol=0, atol=0.5 * np.abs(change).max())


@pytest.mark.parametrize("name", LAWS)
def test_what_does_not_move_in_no_time_stays_bit_by_bit(name):
    found = histories(LAWS[name], np.append(TURNS, TURNS[-1]), np.append(TIMES, 0.0))
    np.testing.assert_array_equal(found[:, -1, :2], found[:, -2, :2])


def test_relaxation_is_the_prony_series():
    law, times = LAWS["prony"], np.geomspace(1e-5, 10.0, 30)
    found = moments(law, np.full(31, 0.1), np.diff([0.0, 0.0, *times]))
    np.testing.assert_allclose(found[1:], 0.1 * law.relaxation(times), rtol=1e-13)
    assert found[0] == pytest.approx(0.1 * 1.4, rel=1e-14)


@pytest.mark.parametrize("frequency", [0.05, 1.0, *beyond([30.0], 1)])
def test_a_steady_sine_sees_the_complex_modulus(frequency):
    """Of order 2 in the step: 4,000 steps in a period err by 2e-7."""
    law, errors = LAWS["prony"], []
    for steps in (500, 1000, 4000):
        periods = max(3, int(20.0 * frequency))
        phase = 2.0 * np.pi * np.arange(1, periods * steps + 1) / steps
        found = moments(law, np.sin(phase), np.full(phase.size, 1.0 / (frequency * steps)))
        last = slice(-steps, None)
        response = 2j * np.mean(found[last] * np.exp(-1j * phase[last]))
        errors.append(abs(response / law.modulus(frequency) - 1.0))
    assert errors[-1] < 1e-6
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_plastic_cycles_close_as_the_formula_says():
    """Kinematic hardening: a parallelogram between the turns +-a; its area is what is lost."""
    limit, hard, a = 0.05, 0.25, 0.2
    law = fd.Plastic(limit, kinematic=hard, law="linear")
    down = np.linspace(a, -a, 99)[1:]
    turns = np.concatenate([np.linspace(0, a, 50), down, -down, down, -down])
    found = histories(law, turns, np.zeros(turns.size))[0]
    moment = turns + found[:, 2]
    top = limit + hard / (1.0 + hard) * (a - limit)  # M(a) on the way up
    assert moment[[-1, -99]] == pytest.approx([top, -top], rel=1e-14)
    area = 4.0 * limit * (a - limit) / (1.0 + hard)  # 2 My times twice the plastic turn at a
    assert found[-196:, 5].sum() == pytest.approx(area, rel=1e-12)
    assert found[-1, 0] == pytest.approx(found[-197, 0], rel=1e-13)


def test_isotropic_hardening_widens_the_cycles_until_nothing_yields():
    law = fd.Plastic(0.05, isotropic=0.5, law="linear")
    turns = np.array([0.2, -0.2] * 60)
    found = histories(law, turns, np.zeros(turns.size))[0]
    lost = found[:, 5]
    assert (lost[1:-1] >= lost[2:]).all()
    assert lost[-1] < 1e-9 * lost[0]
    assert 0.05 + 0.5 * found[-1, 1] == pytest.approx(0.2, rel=1e-6)  # all is elastic in the end
    first = (0.2 - 0.05) / 1.5  # plastic turn of the first loading
    assert found[0, 0] == pytest.approx(first, rel=1e-14)
    assert lost[0] == pytest.approx(0.05 * first + 0.25 * first**2, rel=1e-13)


def test_creep_relaxes_by_the_logarithm_over_six_decades():
    """M(t) = M(0) - M0 ln(1 + t/t0), as long as M is well above M0: see `eyring`."""
    barrier, rate, first = 0.01, 1e-9, 0.3
    law = fd.Eyring(barrier, rate, law="linear")
    t0 = barrier / rate * np.exp(-first / barrier)
    times = t0 * np.geomspace(1.0, 1e6, 40)
    found = moments(law, np.full(41, first), np.diff([0.0, 0.0, *times]))[1:]
    wanted = first - barrier * np.log1p(times / t0)
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    assert wanted[0] - wanted[-1] == pytest.approx(13.1 * barrier, rel=0.01)


def test_small_moments_creep_as_a_dashpot_does():
    law, first = fd.Eyring(0.01, 1e-3, law="linear"), 1e-6
    (branch,) = law.branches(np.ones(1), np.ones(1))
    found = moments(law, [first, first], [0.0, 5.0])
    assert found[1] == pytest.approx(first * np.exp(-5.0 * branch.rate[0]), rel=1e-8)


@pytest.mark.parametrize("moment", [-12.0, 12.0])
def test_creep_takes_moments_far_above_its_barrier(moment):
    """No overflow: what is left after a time is what can be left, whatever was there before."""
    law = fd.Eyring(0.01, 1e-3, law="linear")
    found = moments(law, [moment, moment], [0.0, 1.0])
    assert np.isfinite(found).all()
    assert abs(found[1]) == pytest.approx(0.01 * np.log(0.01 / 1e-3), rel=0.01)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.Prony([0.1, 0.2], 1.0), "2 ratios .* and 1 times"),
        (lambda: fd.Prony(0.1, 0.0), "Prony: times = 0.0: must be greater than 0"),
        (lambda: fd.Plastic(-1.0), "Plastic: yield_moment = -1.0: must be greater than 0"),
        (lambda: fd.Plastic(1.0, kinematic=-1.0), "Plastic: kinematic"),
        (lambda: fd.Eyring(0.1, 0.0), "Eyring: rate"),
        (lambda: fd.Prony(0.1, 1.0, law=fd.Plastic(0.1)), "has a memory itself"),
        (lambda: hinge_law("prony", "fold_law"), 'fold_law = "prony": the law needs ratios'),
        (lambda: hinge_law(fd.Prony(1, 1, law="superlinear"), "bend_law"), "has none there"),
        (lambda: hinge_law(fd.Prony(1, 1, law="plate_superlinear")), "no onset of their own"),
    ],
)
def test_bad_arguments_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
