"""Latches of creases: when they engage, how they hold, and when they open."""

import math

import numpy as np
import pytest
from test_stops import FLAP, LENGTH, MODELS, REST, angle, flap

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import InputError, ModelRangeWarning

K, HELD = 0.5, 40.0  # N m/rad per m: of the crease, and of the latch
RISE = 3.0  # degrees from rest to the latch
FAST = 20.0  # rad/s


def swinging(**more):
    """A flap that flies into its latch, with its initial state and its inertia about the crease."""
    case, tip = flap("plate", [fd.Latch("all", REST + RISE, HELD, **more)], mass="consistent")
    x, pattern = case.structure.nodes, case.structure.pattern
    a, b = sorted(set(pattern.faces[0]) & set(pattern.faces[1]))
    axis = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
    moving = [*tip, int(case.structure.centers[1])]
    velocity = np.zeros_like(x)
    velocity[moving] = np.cross(FAST * axis, x[moving] - x[a])
    small = x.copy()
    small[moving] += 1e-6 * velocity[moving]
    if angle(case, small - x) < REST:
        velocity *= -1.0
    away = np.linalg.norm(x[tip[0]] - x[a] - ((x[tip[0]] - x[a]) @ axis) * axis)
    inertia = 900.0 * 2e-3 * LENGTH * away**3 / 3.0
    return case, fd.State(velocity=velocity), inertia


def turn_at(time: float, inertia: float) -> tuple[float, float]:
    """Turn from rest (rad) of the flap in closed form, and the instant at which it is caught."""
    slow, fast = math.sqrt(K * LENGTH / inertia), math.sqrt((K + HELD) * LENGTH / inertia)
    caught = math.asin(math.radians(RISE) * slow / FAST) / slow
    speed = FAST * math.cos(slow * caught)
    rests = HELD / (K + HELD) * math.radians(RISE)
    late = fast * (time - caught)
    start = math.radians(RISE) - rests
    return rests + start * math.cos(late) + speed / fast * math.sin(late), caught


def test_a_caught_flap_swings_on_both_springs():
    """The instant is found within the step: after 10 swings the phase is still right."""
    case, start, inertia = swinging()
    rate = math.sqrt((K + HELD) * LENGTH / inertia) / (2 * math.pi)
    end = 10.0 / rate
    motion = fd.simulate(
        case, end, method="dormand_prince", initial=start, interval=end / 200, tolerance=1e-10
    )
    found = [math.radians(angle(case, u) - REST) for u in motion.displacement.values]
    wanted, caught = [], turn_at(0.0, inertia)[1]
    for time in motion.time.values:
        slow = math.sqrt(K * LENGTH / inertia)
        free = FAST / slow * math.sin(slow * time)
        wanted.append(free if time < caught else turn_at(time, inertia)[0])
    assert found == pytest.approx(wanted, abs=2e-5)  # bars of rigid panels stretch by as much
    held = fd.latched(motion)
    assert held.dims == ("time", "crease")
    assert held.values[:, 0].tolist() == (motion.time.values > caught).tolist()
    assert motion.attrs["energy_error"] < 1e-6
    assert float(motion.dissipated[-1]) == 0.0  # engaging costs nothing


@pytest.mark.parametrize("method", METHODS)
def test_every_method_catches_the_flap_and_keeps_the_energy(method):
    case, start, inertia = swinging()
    end = 3.0 * 2 * math.pi / math.sqrt((K + HELD) * LENGTH / inertia)
    dt = {"dt": end / 2000} if METHODS[method].implicit else {}
    motion = fd.simulate(case, end, method=method, initial=start, interval=end / 20, **dt)
    assert fd.latched(motion).values[-1].all()
    found = math.radians(angle(case, motion.displacement.values[-1]) - REST)
    assert found == pytest.approx(turn_at(end, inertia)[0], abs=2e-3)
    assert motion.attrs["energy_error"] < 2e-3


@pytest.mark.parametrize("model", MODELS)
def test_a_path_engages_and_opens(model):
    """(k + k_l) turn = moment + k_l angle while it holds, k turn = moment before and after."""
    release, K = 0.4, 30.0  # N m per m; a crease stiff enough that opening is a small jump
    latch = fd.Latch("all", REST + RISE, HELD, release=release)
    case, _ = flap(model, [latch], crease_stiffness=K)
    at = math.radians(RISE)
    moment = 1.3 * LENGTH * (K * (at + release / HELD) + release)
    case = case.altered(loads=[fd.CreaseMoment([0], moment)])
    path = fd.trace(case, "newton", steps=60)
    held = fd.latched(path).values[:, 0]
    for factor, u, holds in zip(
        path.load_factor.values, path.displacement.values, held, strict=True
    ):
        found = math.radians(angle(case, u) - REST)
        own = factor * moment / LENGTH
        wanted = (own + HELD * at) / (K + HELD) if holds else own / K
        assert found == pytest.approx(wanted, abs=2e-6)
        if holds:
            assert HELD * (found - at) <= release * (1.0 + 1e-9)
    assert not held[0]
    assert held.any()
    assert not held[-1]  # opened
    lost = 0.5 * LENGTH * release**2 / HELD
    assert float(path.dissipated[-1]) == pytest.approx(lost, rel=1e-6)


def test_two_latches_go_through_a_cycle_and_back():
    K, release = 30.0, 2.5
    latches = [fd.Latch("all", REST + sign * RISE, 60.0, release=release) for sign in (1.0, -1.0)]
    case, _ = flap("plate", latches, crease_stiffness=K)
    moment = LENGTH * (K * math.radians(RISE) + release) * 1.5
    case = case.altered(loads=[fd.CreaseMoment([0], moment)])
    way = [*np.linspace(0, 0.4, 5), *np.linspace(0.3, -0.9, 13), *np.linspace(-0.8, 0.9, 18)]
    path = fd.trace(case, "newton", load_factors=way)
    at = [math.radians(angle(case, u) - REST) for u in path.displacement.values]
    state = path.memory.values[:, :, 0]
    kept = np.argmin(np.abs(np.array(way) - 0.1)[5:12]) + 5
    assert state[kept].tolist() == [1.0, 0.0]
    held = (way[kept] * moment / LENGTH + 60.0 * math.radians(RISE)) / (K + 60.0)
    assert at[kept] == pytest.approx(held, abs=1e-6)
    assert [1.0, 0.0] in state[:5].tolist()
    assert [0.0, 1.0] in state[12:25].tolist()
    assert [1.0, 0.0] in state[25:].tolist()  # again


def test_a_latch_opens_at_its_time_and_a_motion_goes_on_where_it_ended():
    case, start, inertia = swinging(until=0.04)
    given = {"method": "dormand_prince", "interval": 0.005, "tolerance": 1e-9}
    whole = fd.simulate(case, 0.06, initial=start, **given)
    held = fd.latched(whole).values[:, 0]
    times = whole.time.values
    caught = turn_at(0.0, inertia)[1]
    assert held.tolist() == ((times > caught) & (times < 0.04 - 1e-9)).tolist()
    half = fd.simulate(case, 0.03, initial=start, **given)
    rest = fd.simulate(case, 0.03, initial=fd.initial_state(half), start=0.03, **given)
    assert fd.latched(rest).values[0].all()
    assert rest.displacement.values[-1] == pytest.approx(whole.displacement.values[-1], abs=1e-7)


def test_what_latches_refuse():
    structure = MODELS["plate"](**FLAP)
    with pytest.raises(
        InputError, match="crease 0 rests at the latch; give an angle that it passes"
    ):
        fd.Case(structure, [fd.Fix([0, 1, 2]), fd.Latch("all", REST, 1.0)])
    with pytest.raises(InputError, match="stiffness"):
        fd.Latch("all", 200.0, 0.0)
    case, _ = flap("plate", [fd.Latch("all", REST + RISE, HELD)])
    motion = fd.simulate(flap("plate", [])[0], 1e-4, interval=1e-4)
    with pytest.raises(InputError, match="has no latches; give its case"):
        fd.latched(motion)
    with pytest.raises(InputError, match="latches make equilibria depend on the path"):
        fd.buckling(case.altered(loads=[fd.CreaseMoment([0], 0.1)]))
    sheet = fd.superelements(structure.pattern, structure.sheet)
    with pytest.raises(InputError, match="superelements are linear, and latches are not"):
        fd.Case(sheet, [fd.Latch("all", REST + RISE, HELD)])


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("model", MODELS)
def test_modes_count_a_latch_that_holds(model):
    """omega^2 = k L / I of the open flap, (k + k_l) L / I of the one that is held."""
    case, _ = flap(model, [fd.Latch("all", REST + RISE, HELD)])
    inertia = swinging()[2]
    at = LENGTH * K * math.radians(RISE + 0.1)
    case = case.altered(loads=[fd.CreaseMoment([0], at)])
    rates = {
        name: (2 * math.pi * float(fd.modes(case, 1, state=state, check_model=False).frequency[0]))
        ** 2
        for name, state in (("open", None), ("held", "equilibrium"))
    }
    assert rates["held"] / rates["open"] == pytest.approx((K + HELD) / K, rel=1e-4)
    assert rates["held"] == pytest.approx((K + HELD) * LENGTH / inertia, rel=0.3)  # lumped masses
    path = fd.trace(case, steps=20)
    again = fd.modes(case, 1, state=fd.initial_state(path), check_model=False)
    assert (2 * math.pi * float(again.frequency[0])) ** 2 == pytest.approx(rates["held"], rel=1e-5)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
@pytest.mark.parametrize("kind", ["latch", "stop"])
def test_what_rests_on_a_latch_or_a_stop_stays_at_rest(model, kind):
    """Dofs without mass start in balance with the latch that holds, in motions as in paths."""
    support = (
        fd.Latch("all", REST + RISE, HELD) if kind == "latch" else fd.Stop("all", REST + RISE, HELD)
    )
    case, _ = flap(model, [support], rigid=None)
    case = case.altered(loads=[fd.CreaseMoment([0], LENGTH * (K * math.radians(RISE) + 0.3))])
    path = fd.trace(case, steps=20)
    stored = sum(float(path[name][-1]) for name in case.energy_groups)
    given = {"interval": 2e-4, "initial": fd.initial_state(path)}
    for method in ("energy_momentum", "dormand_prince"):
        motion = fd.simulate(case, 1e-3, method=method, **given)
        assert sum(float(motion[name][0]) for name in case.energy_groups) == pytest.approx(
            stored, rel=1e-6
        )
        assert float(motion.kinetic.max()) < 1e-10 * stored


@pytest.mark.parametrize("other", ["latch", "stop"])
def test_what_acts_on_a_crease_together_is_told_where_panels_are_springs(other):
    """Two springs k beside panels c: 2k/(1 + c k) instead of 2k/(1 + 2 c k)."""
    fold, sheet = fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0)
    kinds = {"latch": fd.Latch, "stop": fd.Stop}
    flap = fd.discretize(fold, sheet, preset="plate")
    hinge = flap.body.sheet.fold_hinges()
    softness, length = float(hinge.softness[0]), float(hinge.length[0])

    def case(structure, stiffness, angle=302.0):
        parts = fd.Latch([0], 302.0, stiffness), kinds[other]([0], angle, stiffness=stiffness)
        return fd.Case(structure, [fd.Fix([4, 5]), fd.Fix([0, 1], "z"), *parts])

    stiff = softness * 5.0 * length
    ratio = (1.0 + 2.0 * stiff) / (1.0 + stiff)
    with pytest.warns(ModelRangeWarning, match=f"up to {ratio:.3g} times too stiff"):
        case(flap, 5.0)
    case(flap, 0.02 / (softness * length))
    case(fd.discretize(fold, sheet, preset="n5b8e"), 5.0)
    stops = fd.Stop([0], 302.0, stiffness=5.0), fd.Stop([0], 290.0, stiffness=5.0)
    fd.Case(flap, stops)  # on either side
