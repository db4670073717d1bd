"""Motions that go on from a sample keep damping and added mass of the whole motion."""

import numpy as np
import pytest

import foldyn as fd

pytestmark = pytest.mark.filterwarnings(
    "ignore:damping. .* resist", "ignore:beta = .* critical step"
)

PANEL = fd.patterns.simple_fold(a=0.9, b=1.1, dihedral=100)
S = fd.discretize(
    PANEL, fd.Sheet(1e9, 0.3, 0.02, 300.0), preset="herkal", bend_law="linear",
    crease_stiffness=60.0,
)  # fmt: skip
HELD = [fd.Fix([2, 3, 4, 5])]
PUSH = fd.Force([0, 1], (0, 0, 3.0))
OMEGA = 2.0 * np.pi * float(fd.modes(fd.Case(S, HELD), 1).frequency[0])
STIFF = fd.Rayleigh(beta=0.1 / OMEGA, state="initial")
MODAL = fd.ModalDamping(0.1, state="initial")
WATER = fd.Air(density=40.0, resolution=2)
UP, DOWN = (fd.Case(S, HELD, [fd.Force([0, 1], (0, 0, f))]) for f in (20.0, -15.0))
BENT, DROPPED = (fd.trace(each, "newton").displacement.values[-1] for each in (UP, DOWN))


def end(motion):
    return {name: motion[name].values[-1] for name in ("displacement", "velocity")}


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("damping", "air", "method", "dt"),
    [
        (STIFF, None, "newmark", 2.0**-7),
        (MODAL, None, "generalized_alpha", 2.0**-7),
        (MODAL, None, "rk4", 2.0**-12),
        (fd.Rayleigh(), WATER, "rk4", 2.0**-12),
        (MODAL, WATER, "rk4", 2.0**-12),
    ],
)
def test_identical_bits_from_the_last_sample(damping, air, method, dt, tmp_path):
    case, interval = fd.Case(S, HELD, [PUSH], damping, air=air), 96 * dt
    options = {"method": method, "dt": dt, "interval": interval, "force": True}
    begin = fd.State(BENT)
    whole = fd.simulate(case, 16 * interval, initial=begin, **options)
    first = fd.simulate(case, 7 * interval, initial=begin, **options)
    fd.save(first, tmp_path / "first.nc")
    first = fd.load(tmp_path / "first.nc")
    middle = fd.simulate(
        case, 4 * interval, initial=fd.initial_state(first), start=7 * interval, **options
    )
    last = fd.simulate(
        case, 5 * interval, initial=fd.initial_state(middle), start=11 * interval, **options
    )
    if air is not None:
        assert whole.attrs["flows"] > 4
    for name, values in end(whole).items():
        assert np.array_equal(end(last)[name], values)


def test_damping_is_about_the_first_start_from_any_sample():
    case = fd.Case(S, HELD, [PUSH], MODAL)
    whole = fd.simulate(
        case, 0.25, method="rk4", initial=fd.State(BENT), dt=2.0**-12, every_steps=64
    )
    start = fd.initial_state(whole, 3)
    assert np.array_equal(start.origin_of(BENT.shape).displacement, BENT)
    rest = 0.25 - float(whole.time[3])
    again = fd.simulate(case, rest, method="rk4", initial=start, dt=2.0**-12, every_steps=64)
    assert np.array_equal(end(again)["displacement"], end(whole)["displacement"])
    plain = fd.State(start.displacement, start.velocity)
    anew = fd.simulate(case, rest, method="rk4", initial=plain, dt=2.0**-12, every_steps=64)
    swing = np.abs(end(whole)["displacement"] - BENT).max()
    assert np.abs(end(anew)["displacement"] - end(whole)["displacement"]).max() > 1e-3 * swing


def test_an_origin_of_other_nodes_is_refused():
    case = fd.Case(S, HELD, [PUSH], MODAL)
    other = fd.initial_state(fd.simulate(case, 0.01, method="rk4"))
    small = fd.discretize(fd.patterns.simple_fold(), fd.Sheet(1e5, 0.3, 0.02, 300.0), scheme="n4b5")
    start = fd.State(np.zeros_like(small.nodes), origin=other.origin)
    with pytest.raises(fd.errors.InputError, match="origin of shape"):
        fd.simulate(fd.Case(small, [fd.Fix([2, 3, 4, 5])]), 0.01, method="rk4", initial=start)


@pytest.mark.matrix
@pytest.mark.parametrize(("damping", "air"), [(MODAL, None), (fd.Rayleigh(), WATER)])
def test_motions_of_one_case_side_by_side_begin_each_with_its_own(damping, air):
    case = fd.Case(S, HELD, [PUSH], damping, air=air)
    starts = [fd.State(place) for place in (0.0 * BENT, BENT, DROPPED)]
    dt, options = 2.0**-12, {"interval": 2.0**-7, "force": True}
    many = fd.simulate_many([case] * 3, 2.0**-5, dt=dt, initial=starts, **options)
    ends = [fd.initial_state(many.isel(model=k)) for k in range(3)]
    more = fd.simulate_many([case] * 3, 2.0**-5, dt=dt, initial=ends, start=2.0**-5, **options)
    for k, start in enumerate(starts):
        alone = fd.simulate(
            case, 2.0**-4, method="central_difference", dt=dt, initial=start, **options
        )
        swing = np.abs(alone.displacement.values - start.displacement).max()
        apart = many.displacement.values[k] - alone.displacement.values[:5]
        assert np.abs(apart).max() < 1e-10 * swing
        apart = more.displacement.values[k, -1] - alone.displacement.values[-1]
        assert np.abs(apart).max() < 1e-2 * swing  # the method begins anew


@pytest.mark.matrix
@pytest.mark.parametrize("damping", [STIFF, MODAL])
def test_stepped_sines_keep_the_state_about_which_they_are_damped(damping):
    case = fd.Case(S, HELD, [PUSH], [damping, fd.Rayleigh(0.1 * OMEGA)][: 1 + (damping is MODAL)])
    drive, f = fd.Force([0], (0, 0, 1e-4)), [0.8 * OMEGA / 6.28, 1.1 * OMEGA / 6.28]
    options = {"state": "equilibrium", "frequencies": f, "drive": drive}
    exact = fd.frf(case, **options).receptance.values
    found = fd.frf(
        case, method="stepped_sine", integrator="newmark", dt=5e-3, **options
    ).receptance.values
    assert np.abs(found - exact).max() < 5e-3 * np.abs(exact).max()


def test_rest_angles_of_the_damping_stay_those_of_the_first_start():
    turn = fd.Actuate("all", fold_angle=50.0, history=fd.Ramp(1.0))
    case, dt = fd.Case(S, HELD, [turn], STIFF), 2.0**-6
    options = {"method": "newmark", "dt": dt, "every_steps": 4}
    whole = fd.simulate(case, 32 * dt, initial=fd.State(BENT), start=0.25, **options)
    first = fd.simulate(case, 16 * dt, initial=fd.State(BENT), start=0.25, **options)
    assert fd.initial_state(first).origin_of(BENT.shape).time == 0.25
    last = fd.simulate(
        case, 16 * dt, initial=fd.initial_state(first), start=0.25 + 16 * dt, **options
    )
    assert np.array_equal(end(last)["displacement"], end(whole)["displacement"])


def test_each_motion_of_many_goes_on_from_where_it_began_itself():
    case, dt = fd.Case(S, HELD, [PUSH], MODAL, air=WATER), 2.0**-12
    options = {"method": "rk4", "dt": dt, "interval": 24 * dt}
    first = fd.simulate(case, 72 * dt, initial=fd.State(BENT), **options)
    starts = [fd.initial_state(first), fd.State(DROPPED)]
    many = fd.simulate_many([case] * 2, 48 * dt, initial=starts, start=72 * dt, **options)
    for k, start in enumerate(starts):
        one = fd.simulate(case, 48 * dt, initial=start, start=72 * dt, **options)
        alone, beside = (fd.initial_state(each).origin for each in (one, many.isel(model=k)))
        assert (
            (beside.time, beside.looked) == (alone.time, alone.looked) == (k * 72 * dt, (8, 0)[k])
        )
        assert np.array_equal(beside.displacement, alone.displacement)
        assert np.array_equal(beside.flow, alone.flow)
