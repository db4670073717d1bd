"""Periodic motions against closed forms, against each other, and against motions in time."""

from itertools import pairwise

import numpy as np
import pytest
from duffing import NODE, K, mass, oscillator

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.periodic.motion import equilibrium

PANEL = {"a": 1.0, "b": 1.0, "dihedral": 60}


def at_start(motion):
    return fd.State(motion.displacement.values[0], motion.velocity.values[0])


def difference(one, other):
    apart = np.abs(one.displacement.values - other.displacement.values).max()
    return apart / np.abs(other.displacement.values).max()


@pytest.fixture(scope="module")
def strong():
    return fd.periodic_motion(oscillator(), harmonics=25)


def fold(loads=(), supports=(), mass_rule="panel", alpha=0.5):
    s = fd.discretize(
        fd.patterns.simple_fold(**PANEL), fd.Sheet(1e5, 0.25, 0.01, 1.0), scheme="n4b5",
        mass=mass_rule, bend_law="linear",
    )  # fmt: skip
    held = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz"), *supports]
    return fd.Case(s, held, list(loads), fd.Rayleigh(alpha=alpha))


@pytest.mark.matrix
def test_harmonics_converge_spectrally_to_what_shooting_finds(strong):
    shot = fd.periodic_motion(oscillator(), method="shooting", steps=96)
    assert difference(strong, shot) < 1e-8
    fewer = [fd.periodic_motion(oscillator(), harmonics=n) for n in (3, 5, 7, 9)]
    errors = [difference(one, strong) for one in fewer]
    assert all(after < 0.2 * before for before, after in pairwise(errors))
    assert abs(shot.floquet.values[0]) == pytest.approx(abs(strong.floquet.values[0]), rel=1e-6)


@pytest.mark.matrix
def test_estimate_of_what_is_missing_is_near_the_truth(strong):
    for harmonics in (3, 5):
        with_few = fd.periodic_motion(oscillator(), harmonics=harmonics)
        found = with_few.attrs["truncation"]
        assert 0.3 * found < difference(with_few, strong) < 3.0 * found


@pytest.mark.matrix
def test_superlinear_bends_converge_as_a_power():
    s = fd.discretize(
        fd.patterns.simple_fold(**PANEL), fd.Sheet(1e5, 0.25, 0.01, 1.0), preset="herkal"
    )
    push = fd.Force([0], (1e-3, 0, 0), history=fd.Harmonic(0.4))
    case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")], [push], fd.Rayleigh(alpha=0.5))
    finest = fd.periodic_motion(case, harmonics=21)
    errors = [
        difference(fd.periodic_motion(case, harmonics=n, guess=finest), finest) for n in (5, 9, 13)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert (
        errors[1] / errors[2] < (13 / 9) ** 6
    )  # 2.4 of a power; 10 and more where laws are smooth
    shot = fd.periodic_motion(case, method="shooting", steps=64, guess=finest)
    assert difference(shot, finest) < 5e-6


def test_small_motions_are_the_linear_response_and_decay_as_the_damping_says():
    case = oscillator(force=1e-6, frequency=0.2)
    one = fd.periodic_motion(case, harmonics=3)
    still = fd.Case(case.structure, case.supports, damping=case.damping)
    linear = fd.frf(still, fd.Force([NODE], (0, 0, 1e-6)), frequencies=[0.2])
    expected = -1j * linear.receptance.values[0, NODE, 2] * linear.attrs["drive_force"]
    assert one.coefficient.values[1, NODE, 2] == pytest.approx(expected, rel=1e-9)
    omega = np.sqrt(3.0 / mass() - 0.05**2)  # of the damped vibration
    decay = np.exp((-0.05 + 1j * omega) / 0.2)
    assert one.floquet.values[0].real == pytest.approx(decay.real, abs=1e-9)
    assert abs(one.floquet.values[0].imag) == pytest.approx(abs(decay.imag), abs=1e-9)


@pytest.mark.parametrize(("dashpot", "beta"), [(0.0, 0.0), (0.3, 0.0), (0.0, 0.02)])
def test_product_of_the_multipliers_is_that_of_liouville(dashpot, beta):
    case = oscillator(dashpot=dashpot).altered(damping=fd.Rayleigh(alpha=0.1, beta=beta))
    one = fd.periodic_motion(case, harmonics=9)
    expected = -(0.1 + (dashpot + beta * K) / mass()) / 0.25
    assert np.log(np.abs(one.floquet.values)).sum() == pytest.approx(expected, rel=1e-8)


def test_product_holds_for_a_stiff_sheet_with_drag():
    push = fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.4))
    one = fd.periodic_motion(fold([push]), harmonics=7)
    free = len(one.floquet) / 2
    total = np.log(np.abs(one.floquet.values)).sum()
    assert total == pytest.approx(-0.5 * free / 0.4, rel=1e-8)


@pytest.mark.matrix
def test_multipliers_are_those_of_deviations_in_simulated_motion(strong):
    case, far = oscillator(), 1e-5
    start, columns = at_start(strong), []
    for name in ("displacement", "velocity"):
        ends = []
        for sign in (1.0, -1.0):
            given = {n: np.array(getattr(start, n)) for n in ("displacement", "velocity")}
            given[name][NODE, 2] += sign * far
            run = fd.simulate(
                case, 4.0, method="rk4", dt=1e-3, every_steps=4000, initial=fd.State(**given)
            )
            ends.append([run[n].values[-1, NODE, 2] for n in ("displacement", "velocity")])
        columns.append((np.array(ends[0]) - ends[1]) / (2.0 * far))
    found = np.linalg.eigvals(np.array(columns).T)
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(strong.floquet.values), abs=1e-6)


@pytest.mark.matrix
def test_simulated_motion_settles_on_it(strong):
    run = fd.simulate(oscillator(), 400.0, method="rk4", dt=4.0 / 2048, every_steps=16)
    last = run.displacement.values[-129:-1, NODE, 2]
    assert np.abs(last - strong.displacement.values[:, NODE, 2]).max() < 1e-7


DRIVES = {
    "force": fold([fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.4, phase=40.0))]),
    "base": fold(supports=[fd.BaseMotion("x", value=0.02, history=fd.Harmonic(0.4))]),
    "base, consistent mass": fold(
        supports=[fd.BaseMotion("x", value=0.02, history=fd.Harmonic(0.4))], mass_rule="consistent"
    ),
    "imposed": fold(
        [fd.Force([0], (1e-4, 0, 0))], [fd.Impose([1], "x", value=0.02, history=fd.Harmonic(0.4))]
    ),
    "actuated": fold([fd.Actuate("all", angle=290.0, history=fd.Harmonic(0.4))]),
    "pressure": fold([fd.Pressure(1e-3, history=fd.Harmonic(0.4))]),
    "two frequencies": fold(
        [
            fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.4)),
            fd.Force([0], (5e-4, 0, 0), history=fd.Harmonic(1.2, phase=30.0)),
        ]
    ),
    "linked": fold([fd.Force([0], (2e-3, 0, 0), history=fd.Harmonic(0.4))], [fd.Link([0, 1], "x")]),
}


@pytest.mark.parametrize("name", DRIVES)
def test_simulation_from_a_point_of_it_comes_back(name):
    case = DRIVES[name]
    one = fd.periodic_motion(case, harmonics=12)
    period = 1.0 / one.attrs["frequency"]
    run = fd.simulate(case, period, method="rk4", initial=at_start(one), interval=period / 4)
    assert run.displacement.values[-1] == pytest.approx(one.displacement.values[0], abs=2e-5)
    quarter = one.displacement.values[32]
    assert run.displacement.values[1] == pytest.approx(quarter, abs=2e-5)
    assert np.ptp(one.displacement.values, axis=0).max() > 5e-3


def test_start_takes_a_motion_or_a_state():
    case = oscillator(height=0.2, spring=False, force=1e-4)
    well = np.zeros((3, 3))
    well[NODE, 2] = -0.4
    near, other = (fd.periodic_motion(case, guess=s) for s in (None, fd.State(well)))
    shift = (
        other.displacement.values[:, NODE, 2].mean() - near.displacement.values[:, NODE, 2].mean()
    )
    assert shift == pytest.approx(-0.4, abs=0.01)
    again = fd.periodic_motion(case, guess=other)
    assert difference(again, other) < 1e-9
    doubled = fd.periodic_motion(case, guess=other, periods=2)
    assert doubled.attrs["iterations"] == 1
    assert doubled.displacement.values[::2] == pytest.approx(
        np.tile(other.displacement.values[::4], (2, 1, 1))[::1], abs=1e-9
    )


def test_what_is_constant_acts_on_the_state_about_which_it_swings():
    moved = fd.Impose([0, 1], "x", 0.05)
    swung = fd.Impose([4], "y", 0.05, history=fd.Harmonic(0.4))
    push, shake = (
        fd.Force([2, 3], (0, 0, -1e-2), history=history) for history in (None, fd.Harmonic(0.4))
    )
    still, swinging = ([push], [moved, fd.Fix([4], "y")]), ([push, shake], [moved, swung])
    states = []
    for loads, supports in (still, swinging):
        held = [fd.Fix([5], "xyz"), fd.Fix([4], "xz"), fd.Fix([0, 1], "yz"), *supports]
        states.append(equilibrium(fd.Case(fold().structure, held, loads)))
    assert states[0][[0, 1], 0] == pytest.approx(0.05)
    assert np.abs(states[0][[2, 3], 2]).min() > 1e-3
    assert states[1] == pytest.approx(states[0], abs=1e-9)


def test_few_harmonics_are_warned_of():
    with pytest.warns(FoldynWarning, match="harmonics = 1: twice as many would change"):
        fd.periodic_motion(oscillator(force=3.0, frequency=0.1), harmonics=1)


def test_a_result_is_saved_and_loaded(tmp_path, strong):
    fd.save(strong, tmp_path / "one.nc")
    again = fd.load(tmp_path / "one.nc")
    assert again.floquet.values == pytest.approx(strong.floquet.values)
    assert bool(again.stable)
    assert fd.case_of(again).loads[0].history == fd.Harmonic(0.25)


PUSH = fd.Force([0], (1e-3, 0, 0), history=fd.Harmonic(0.4))
REFUSED = {
    "serve linear analyses": fd.Case(
        fd.superelements(fd.patterns.simple_fold(**PANEL), fd.Sheet(1e6, 0.25, 0.01, 1.0)),
        [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")], [PUSH],
    ),
    "nothing drives it": fold(),
    r"loads\[0\].history: is of the kind 'ramp'": fold(
        [fd.Force([0], (1e-3, 0, 0), history=fd.Ramp(1.0))]
    ),
    "no multiple": fold([PUSH, fd.Force([1], (1e-3, 0, 0), history=fd.Harmonic(0.5))]),
    "needs supports": fd.Case(fold().structure, loads=[PUSH]),
    "constant matrix": fd.Case(fold().structure, fold().supports, [PUSH], fd.StrainDamping(1e-3)),
    "friction depends on how it was reached": fd.Case(
        fold().structure, fold().supports, [PUSH], contact=fd.Contact(friction=0.3)
    ),
    "hinges have memory": fd.Case(
        fd.discretize(
            fd.patterns.simple_fold(**PANEL), fd.Sheet(1e6, 0.25, 0.01, 1.0),
            fold_law=fd.Prony(0.5, 0.1), preset="plate"
        ),
        [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")], [PUSH],
    ),
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_what_it_cannot_follow_is_refused(message):
    with pytest.raises(InputError, match=message):
        fd.periodic_motion(REFUSED[message])


def test_arguments_out_of_range_are_refused():
    for field, value in (
        ("frequency", -1.0), ("harmonics", 0), ("method", "guess"), ("guess", 3), ("periods", 0),
        ("steps", 1), ("tolerance", 2.0), ("steps", 10**9), ("harmonics", 10**9),
        ("harmonics", 10**4),  # matrices of one dof, but many of them
    ):  # fmt: skip
        with pytest.raises(InputError, match=field):
            fd.periodic_motion(oscillator(), **{field: value})
