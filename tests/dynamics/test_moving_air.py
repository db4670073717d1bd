"""Added mass in wind: what matters is the velocity relative to the air, and its acceleration."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import foldyn as fd
from foldyn.dynamics import prepare
from foldyn.dynamics.methods import METHODS
from foldyn.errors import InputError, ModelRangeWarning
from named_models import named

SIDE = 0.2
WIND = np.array([0.4, -0.3, 0.6])
EXPLICIT = ("rk4", "central_difference", "dormand_prince")
PRESSING = 0.5 * 20.0 * 1.2 * SIDE**2  # 1/2 rho Cd A of the plate, kg/m


def plate(**changes):
    corners = SIDE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    sheet = fd.Sheet(1e8, 0.3, 0.02, density=150.0)
    return fd.discretize(fd.Pattern(corners, [(0, 1, 2, 3)]), sheet, **named(changes))


def fluid(**changes):
    return fd.Air(**{"density": 80.0, "drag": False, "resolution": 4} | changes)


def normal_mass(case):
    """Added mass (kg) of a plate that moves along z."""
    return case.added_mass().todense()[2::3, 2::3].sum()


def folded(added_mass, wind, drift, history=None, loads=()):
    """A sheet that folds while it turns and drifts, and how it moves."""
    pattern = fd.patterns.simple_fold(a=SIDE, b=1.2 * SIDE, dihedral=130)
    crease = {"crease_stiffness": 0.3, "crease_rest": 200.0}
    structure = fd.discretize(pattern, fd.Sheet(2e7, 0.3, 2e-3, density=500.0), **named(crease))
    blows = {} if history is None else {"history": history}
    air = fluid(added_mass=added_mass, velocity=wind, drag=True, resolution=2, **blows)
    spin = np.cross((2.0, -1.0, 3.0), structure.nodes)
    case = fd.Case(structure, loads=loads, air=air)
    return fd.simulate(
        case, 0.06, method="rk4", interval=0.02, initial=fd.State(velocity=spin + drift)
    )


@pytest.mark.parametrize("added_mass", [True, "local", False])
def test_a_sheet_in_wind_moves_as_in_still_air_seen_from_the_wind(added_mass):
    blown = folded(added_mass, WIND, 0.0)
    still = folded(added_mass, 0.0 * WIND, -WIND)
    drift = still.time.values[:, None, None] * WIND
    assert_allclose(blown.displacement, still.displacement + drift, atol=1e-10 * SIDE)
    assert_allclose(blown.velocity, still.velocity + WIND, atol=1e-9)
    assert added_mass is False or blown.attrs["flows"] > 2
    assert np.abs(still.displacement).max() > 0.2 * SIDE


GUSTS = {  # with the time derivatives and the integrals of their factors
    "harmonic": (
        fd.Harmonic(7.0, phase=25.0),
        (14.0 * np.pi, fd.Harmonic(7.0, phase=115.0)),
        lambda t: (np.cos(np.radians(25.0)) - np.cos(14 * np.pi * t + np.radians(25))) / 14 / np.pi,
    ),
    "half sine": (
        fd.HalfSine(0.08),
        (np.pi / 0.08, fd.Harmonic(6.25, phase=90.0)),
        lambda t: 0.08 / np.pi * (1.0 - np.cos(np.pi * t / 0.08)),
    ),
    "table": (fd.Table([0, 0.1], [-0.5, 2.5]), (30.0, fd.Step(0.0)), lambda t: (15 * t - 0.5) * t),
    "function": (
        fd.Function(lambda t: 400.0 * t * t, at=[]),
        (80.0, fd.Table([0.0, 0.1], [0.0, 1.0])),
        lambda t: 400.0 / 3.0 * t**3,
    ),
}


@pytest.mark.parametrize("gust", GUSTS)
def test_air_that_accelerates_pushes_as_gravity_does_against_it(gust):
    """Seen from the air, the sheet has the weight -M U' more, and nothing else is different."""
    history, (rate, derivative), integral = GUSTS[gust]
    blown = folded(True, WIND, history(0.0) * WIND, history)
    pull = fd.Gravity(-rate * WIND, derivative)
    still = folded(True, 0.0 * WIND, 0.0 * WIND, loads=[pull])
    drift = integral(still.time.values)[:, None, None] * WIND
    assert_allclose(blown.displacement, still.displacement + drift, atol=1e-6 * SIDE)
    assert np.abs(drift).max() > 0.05 * SIDE
    assert blown.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize("method", EXPLICIT)
def test_a_gust_takes_a_plate_along_by_its_added_mass(method):
    """M v + M_a (v - U) stays zero, so that v = M_a U / (M + M_a); the air gives what it works."""
    ramp, span = fd.Ramp(0.04, smooth=True), 0.06
    case = fd.Case(plate(), air=fluid(velocity=(0.0, 0.0, 2.0), history=ramp))
    added, mass = normal_mass(case), case.total_mass
    motion = fd.simulate(case, span, method=method, interval=0.01)
    moves = added / (added + mass) * 2.0 * ramp(motion.time.values)
    mean = np.einsum("tia,i->ta", motion.velocity.values, case.nodal_mass) / mass
    assert added > 2.0 * mass
    assert_allclose(mean[:, 2], moves, atol=1e-3)  # it bends a little
    assert np.abs(mean[:, :2]).max() < 1e-9  # no push along the plate
    relative = 2.0 * ramp(motion.time.values) - moves
    kinetic = 0.5 * mass * moves**2 + 0.5 * added * relative**2
    assert_allclose(motion.kinetic, kinetic, atol=1e-3 * kinetic[-1])
    assert_allclose(motion.air[-1], -kinetic[-1], rtol=2e-3)
    assert motion.air[0] == 0.0


@pytest.mark.filterwarnings("ignore:nothing moves farther")
@pytest.mark.parametrize("added_mass", [True, "local"])
def test_supports_of_a_plate_in_wind_bear_munks_moment_and_the_push_of_its_change(added_mass):
    """On a plate at rest: no force and the moment U x M_a U in a steady wind; M_a U' in a gust."""
    held = [fd.Fix([1, 2, 3]), fd.Fix([0], "yz")]  # all but what moves along itself
    for history in (fd.Table([0.0, 1.0], [1.0, 1.0]), fd.Harmonic(2.0, phase=30.0)):
        air = fluid(added_mass=added_mass, velocity=WIND, history=history)
        case = fd.Case(plate(scheme="n4b5"), held, air=air)
        motion = fd.simulate(case, 1e-5, method="rk4", dt=1e-5, every_steps=1)
        force = np.zeros(case.structure.nodes.shape)
        axis = ["xyz".index(name) for name in motion.support_axis.values]
        force[motion.support_node.values, axis] = motion.reaction.values[0]
        moment = np.cross(case.structure.nodes - case.center_of_mass, force).sum(axis=0)
        added, rate = normal_mass(case), history.derivatives(0.0)[1]
        wind = history(0.0) * WIND
        munk = np.cross(wind, (0.0, 0.0, added * wind[2]))
        assert_allclose(force[:, 2].sum(), -added * rate * WIND[2], rtol=1e-6, atol=1e-6)
        assert_allclose(moment[:2], munk[:2], atol=1e-6)


def test_a_wind_that_jumps_is_refused_with_added_mass_alone():
    gust = {"velocity": WIND, "history": fd.Step(0.013)}
    for added_mass in (True, "local"):
        case = fd.Case(plate(), air=fluid(added_mass=added_mass, **gust))
        with pytest.raises(InputError, match=r"air: the wind .* jumps at t = 0.013 s.*added_mass"):
            fd.simulate(case, 0.02, method="rk4")


@pytest.mark.parametrize("method", METHODS)
def test_drag_takes_a_wind_that_jumps(method):
    """From then on v = w (1 - 1 / (1 + k w t / m))."""
    wind, when = 0.7, 0.0413
    air = fd.Air(20.0, (0.2, 0.1, wind), False, True, 1.2, history=fd.Step(when))
    case = fd.Case(plate(), air=air)
    steps = {"dt": 2e-3} if METHODS[method].implicit else {}
    motion = fd.simulate(case, 0.2, method=method, interval=0.02, **steps)
    since = np.maximum(motion.time.values - when, 0.0)
    exact = wind * (1.0 - 1.0 / (1.0 + PRESSING * wind * since / case.total_mass))
    assert_allclose(motion.velocity[:, 0, 2], exact, atol=2e-3 * wind)


def test_what_knows_no_flow_at_rest_refuses_wind():
    case = fd.Case(plate(), [fd.Fix([0, 1])], air=fluid(velocity=WIND))
    push = fd.Force([2], (0.0, 0.0, 1e-3))
    with pytest.raises(InputError, match=r"air.velocity = .*: small vibrations would leave wind"):
        fd.modes(case, 2)
    for method in ("direct", "modal", "impulse"):
        with pytest.raises(InputError, match=r"air.velocity = .* would leave wind out"):
            fd.frf(case, push, frequencies=[3.0], method=method)
    with pytest.raises(InputError, match=r"air.velocity = .*: statics would leave wind out"):
        fd.trace(case.altered(loads=[push]))


@pytest.mark.parametrize(
    ("changes", "speed", "warns"),
    [
        ({}, 0.0, True),
        ({"history": fd.Harmonic(3.0)}, 0.0, True),
        ({}, 30.0, False),  # beside which the wind hardly matters
        ({"velocity": (0.0, 0.0, 0.0)}, 0.0, False),
        ({"added_mass": "local"}, 0.0, False),
        ({"added_mass": False, "drag": True}, 0.0, False),
    ],
)
def test_sheets_that_stand_in_a_wind_with_added_mass_are_warned_of(changes, speed, warns):
    pattern = fd.patterns.simple_fold(a=SIDE, b=0.8 * SIDE, dihedral=95)
    structure = fd.discretize(pattern, fd.Sheet(2e7, 0.3, 2e-3, density=500.0), preset="plate")
    case = fd.Case(structure, air=fluid(**{"velocity": WIND, "resolution": 2} | changes))
    start = fd.State(velocity=np.full(structure.nodes.shape, speed))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        prepare(case, 1e-3, method="rk4", initial=start)
    said = [str(each.message) for each in caught if each.category is ModelRangeWarning]
    assert [text.startswith("air: in a wind of 0.78") for text in said] == [True] * warns
