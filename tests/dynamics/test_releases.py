"""Supports and planes that are released within a motion."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import ComputationError, InputError
from foldyn.gradients.motion import MotionGradient

G = 9.81
PANEL = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
PLATE = fd.discretize(PANEL, fd.Sheet(1e7, 0.3, 0.01, 100.0), preset="plate", mass="mixed_voronoi")
DOWN = [fd.Gravity((0, 0, -G))]
FLAP = fd.discretize(
    fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"
)
HINGED = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
TIP = [2, 3]
ORDERS = {name: 2 for name in METHODS} | {"rk4": 4}
FIXED = [name for name, own in METHODS.items() if not own.adaptive]
SLOW = [
    pytest.param(name, marks=pytest.mark.matrix) if METHODS[name].implicit else name
    for name in METHODS
]


def imbalance(motion, case):
    """Largest error of the energy balance (J) at any sample, and the largest energy."""
    names = [*case.energy_groups, "kinetic", "dissipated"]
    total = sum(motion[name].values for name in names) - motion.work.values
    return np.abs(total - total[0]).max(), max(motion[name].values.max() for name in names)


def same(one, other, names=("displacement", "velocity"), tolerance=1e-12):
    for name in names:
        a, b = one[name].values, other[name].values
        assert np.abs(a - b).max() <= tolerance * np.abs(b).max(), name


# ---------------------------------------------------------------------- closed forms
def center(values):
    """Values (nt,) of the center of mass of a panel, from those of its nodes (nt, n)."""
    return values @ PLATE.nodal_mass / PLATE.nodal_mass.sum()


def hanging(until):
    """A panel on a spring (N/m) at each corner, which turns up and down at 4 rad/s."""
    nodal = PLATE.nodal_mass
    springs = [
        fd.Spring(16.0 * nodal[node], nodes=[node], direction="z", until=until)
        for node in range(len(nodal))
    ]
    return fd.Case(PLATE, springs, DOWN)


def falling(time, until):
    """Height and velocity of this panel, let go at rest."""
    w, at = 4.0, np.minimum(time, until)
    place, speed = G / w**2 * (np.cos(w * at) - 1.0), -G / w * np.sin(w * at)
    after = time - at
    return place + speed * after - 0.5 * G * after**2, speed - G * after


@pytest.mark.parametrize("method", [name for name in FIXED])
def test_a_released_spring_lets_its_mass_fall(method):
    """Errors shrink with the order of the method, and springs keep nothing."""
    case, errors = hanging(0.25), []
    for dt in (2.0**-6, 2.0**-7):
        options = {"method": method, "dt": dt, "interval": 2.0**-5, "force": True}
        if method == "central_difference" or method == "rk4":
            options["dt"] = dt / 16  # the panel's own vibrations
        motion = fd.simulate(case, 0.5, **options)
        height, speed = falling(motion.time.values, 0.25)
        errors.append(np.abs(motion.displacement.sel(axis="z").values[:, 0] - height).max())
        assert np.allclose(motion.velocity.sel(axis="z").values[:, 2], speed, rtol=0, atol=2e-2)
    assert errors[1] < 2e-3
    assert errors[0] < 1e-9 or errors[0] / errors[1] == pytest.approx(2 ** ORDERS[method], rel=0.1)
    w, lost = motion.strain_springs.values, motion.dissipated.values
    after = motion.time.values >= 0.25
    assert not w[after].any() and w[~after][-1] > 0.0
    stretch = falling(0.25, 0.25)[0]
    mass = PLATE.nodal_mass.sum()
    assert lost[after] == pytest.approx(0.5 * 16.0 * mass * stretch**2, rel=5e-3)
    assert motion.attrs["energy_error"] < 5e-3


def test_a_taut_cable_is_cut():
    """What it had stored is lost; the energies of the whole motion balance."""
    cable = fd.Cable([2, (0.0, 0.0, 3.0)], 50.0, pretension=0.5, until=0.0203)
    case = fd.Case(FLAP, [*HINGED, cable], DOWN, fd.Rayleigh(alpha=0.3))
    motion = fd.simulate(case, 0.05, method="dormand_prince", interval=0.005)
    assert motion.sizes["time"] == 11 and np.allclose(np.diff(motion.time), 0.005, rtol=1e-12)
    off, scale = imbalance(motion, case)
    assert off < 1e-4 * scale and motion.attrs["energy_error"] < 1e-4
    pull = motion.tension.values[:, 0]
    assert (pull[:5] > 0.4).all() and not pull[5:].any()
    stored = motion.strain_springs.values
    assert not stored[5:].any()
    jump = np.diff(motion.dissipated.values)[4]
    assert jump == pytest.approx(stored[4], rel=0.05)


def test_springs_still_pull_after_all_cables_are_gone():
    parts = [
        fd.Spring(3.0, between=[(2, 4)], rest_length=0.2),
        fd.Cable([3, (0.0, 0.0, 3.0)], 50.0, pretension=0.5, until=0.01),
    ]
    case = fd.Case(FLAP, [*HINGED, *parts], DOWN)
    motion = fd.simulate(case, 0.02, method="rk4", interval=0.005)
    x = FLAP.nodes + motion.displacement.values
    pull = 3.0 * (np.linalg.norm(x[:, 2] - x[:, 4], axis=1) - 0.2)
    assert motion.tension.values[:, 0] == pytest.approx(pull, rel=1e-9)
    assert not motion.tension.values[2:, 1].any()


def test_a_plane_is_removed():
    """The panel rests on a trap door, which opens: it falls on, freely."""
    floor = fd.Plane((0, 0, -0.0047), (0, 0, 1), until=0.1)
    case = fd.Case(PLATE, (), DOWN, contact=fd.Contact(panels=False, stiffness=1e3, planes=[floor]))
    motion = fd.simulate(case, 0.2, method="dormand_prince", interval=0.01)
    on, force = motion.time.values < 0.1 - 1e-9, motion.plane_force.values[:, 0, 2]
    assert force[on].max() > 0.0 and not force[~on].any()
    assert not motion.contact_force.values[~on].any() and motion.sizes["plane"] == 1
    z = motion.displacement.sel(axis="z").values
    after, t = center(z)[~on], motion.time.values[~on] - 0.1
    speed = center(motion.velocity.sel(axis="z").values)[~on][0]
    assert after == pytest.approx(after[0] + speed * t - 0.5 * G * t**2, abs=1e-7)
    assert motion.attrs["energy_error"] < 1e-3


def test_a_panel_falls_from_plane_to_plane():
    planes = [fd.Plane((0, 0, -z), (0, 0, 1), until=t) for z, t in ((0.0047, 0.03), (0.02, None))]
    case = fd.Case(PLATE, (), DOWN, contact=fd.Contact(panels=False, stiffness=1e3, planes=planes))
    motion = fd.simulate(case, 0.1, method="dormand_prince", interval=0.002)
    upper, lower = motion.plane_force.values[:, :, 2].T
    z, on = motion.displacement.sel(axis="z").values, motion.time.values < 0.03 - 1e-9
    assert upper[on].max() > 0.0 and not upper[~on].any() and not lower[on].any()
    assert lower.max() > 0.0 and z.min() > -0.02
    assert motion.attrs["energy_error"] < 1e-3


# ---------------------------------------------------------------------- as by hand
@pytest.mark.parametrize(
    "method",
    [pytest.param(name, marks=pytest.mark.matrix) if METHODS[name].implicit else name
     for name in FIXED],
)  # fmt: skip
def test_a_flap_let_go_swings_as_from_that_state(method):
    """Nothing moves while it is held open; then it is the motion without its support."""
    options = {"method": method, "interval": 0.004, "dt": 2e-4}
    held, free = fd.Fix(TIP, until=0.02), fd.Case(FLAP, HINGED, DOWN)
    motion = fd.simulate(free.altered(supports=[*HINGED, held]), 0.06, **options)
    begin = fd.initial_state(motion, 5)
    alone = fd.simulate(
        free, 0.04, start=0.02, initial=fd.State(begin.displacement, begin.velocity), **options
    )
    assert not motion.displacement.values[:6, TIP].any()
    same(motion.isel(time=slice(5, None)), alone)
    assert np.abs(alone.displacement.values[-1, TIP]).max() > 1e-4
    by_hand = alone.reaction.values
    released = np.isin(motion.support_node, TIP)
    assert np.array_equal(motion.reaction.values[5:, ~released], by_hand)
    assert not motion.reaction.values[5:, released].any()
    assert motion.reaction.values[4, released].any()


def released_twice():
    cable = fd.Cable([2, (0.0, 0.0, 3.0)], 50.0, pretension=0.5)
    parts = [*HINGED, fd.Fix([3]), cable]
    whole = [*HINGED, fd.Fix([3], until=0.012), fd.Cable(
        cable.nodes, 50.0, pretension=0.5, until=0.024)]  # fmt: skip
    damped = {"loads": DOWN, "damping": fd.Rayleigh(alpha=0.3)}
    by_hand = [fd.Case(FLAP, own, **damped) for own in (parts, [*HINGED, cable], HINGED)]
    return fd.Case(FLAP, whole, **damped), by_hand


@pytest.mark.parametrize("method", SLOW)
def test_two_releases_are_three_motions(method):
    case, by_hand = released_twice()
    options = {"method": method, "interval": 0.004}
    whole = fd.simulate(case, 0.036, **options)
    state, work, lost = None, 0.0, 0.0
    for k, own in enumerate(by_hand):
        part = fd.simulate(own, 0.012, start=0.012 * k, initial=state, **options)
        last = fd.initial_state(part)
        state = fd.State(last.displacement, last.velocity)
        rows = slice(3 * k, 3 * k + 3 + (k == 2))
        same(whole.isel(time=rows), part.isel(time=slice(0, None if k == 2 else 3)))
        assert whole.work.values[rows] == pytest.approx(
            work + part.work.values[: 4 if k == 2 else 3], rel=1e-9, abs=1e-15
        )
        work, lost = work + part.work.values[-1], lost + part.dissipated.values[-1]
        lost += part.strain_springs.values[-1] if k == 1 else 0.0
    assert whole.dissipated.values[-1] == pytest.approx(lost, rel=1e-9)
    off, scale = imbalance(whole, case)
    assert off < 2e-3 * scale
    assert whole.attrs["energy_error"] == pytest.approx(off / scale, rel=0.5)


def test_a_motion_that_starts_later_has_released_what_is_due():
    case, _ = released_twice()
    options = {"method": "rk4", "interval": 0.004, "dt": 2e-4}
    whole = fd.simulate(case, 0.036, **options)
    first = fd.simulate(case, 0.016, **options)
    rest = fd.simulate(case, 0.02, start=0.016, initial=fd.initial_state(first), **options)
    same(rest, whole.isel(time=slice(4, None)))
    last = fd.simulate(case, 0.012, start=0.024, initial=fd.initial_state(rest, 2), **options)
    same(last, whole.isel(time=slice(6, None)))
    assert last.sizes["support"] == whole.sizes["support"] and not last.tension.values.any()
    assert not last.strain_springs.values.any()


def test_a_release_that_never_comes_changes_nothing():
    case, by_hand = released_twice()
    options = {"method": "rk4", "interval": 0.004}
    motion = fd.simulate(case, 0.012, **options)
    held = fd.simulate(by_hand[0], 0.012, **options)
    same(motion, held, ("displacement", "velocity", "reaction", "tension"), 0.0)


@pytest.mark.parametrize("method", ["rk4", "dormand_prince"])
def test_samples_can_count_steps(method):
    case, _ = released_twice()
    options = {"method": method, "dt": 1e-4}
    every = fd.simulate(case, 0.036, **options)
    third = fd.simulate(case, 0.036, every_steps=3, **options)
    assert np.array_equal(third.time.values, every.time.values[::3])
    assert {0.012, 0.024} <= set(every.time.values.tolist())
    assert every.sizes["time"] == every.attrs["steps"] + 1


def test_a_base_throws_what_it_lets_go():
    """A panel that moves with the base flies on with its speed; the base has nothing to move."""
    base = fd.BaseMotion("z", fd.Ramp(1.0), value=2.0)
    case = fd.Case(PLATE, [fd.Fix([0, 1, 2, 3], until=0.125), base])
    speed = np.full_like(PLATE.nodes, [0.0, 0.0, 2.0])
    given = {"initial": fd.State(velocity=speed), "method": "rk4", "interval": 2.0**-5}
    motion = fd.simulate(case, 0.25, **given)
    t = motion.time.values[:, None]
    assert np.abs(motion.displacement.sel(axis="z").values - 2.0 * t).max() < 1e-12
    assert np.abs(motion.velocity.values - speed).max() < 1e-12
    assert motion.attrs["energy_error"] < 1e-12 and motion.kinetic.values.min() > 0.0


@pytest.mark.parametrize("part", ["link", "impose", "bar"])
def test_other_supports_are_released(part):
    supports = {
        "link": fd.Link([0, 2], "z", until=0.01),
        "impose": fd.Impose(TIP, "x", 1e-3, fd.Ramp(0.01), until=0.01),
        "bar": fd.Bar([(2, 5)], 100.0, rest_length=0.5, until=0.01),
    }
    held = [fd.Fix([4, 5])] if part == "link" else HINGED
    case = fd.Case(FLAP, [*held, supports[part]], DOWN)
    motion = fd.simulate(case, 0.02, method="dormand_prince", interval=0.002)
    alone = fd.simulate(
        case.altered(supports=held), 0.01, start=0.01, method="dormand_prince", interval=0.002,
        initial=fd.initial_state(motion, 5),
    )  # fmt: skip
    same(motion.isel(time=slice(5, None)), alone)
    off, scale = imbalance(motion, case)
    assert off < 1e-4 * scale


def test_an_edge_held_along_its_length_is_let_go():
    """Its dofs between vertices are fewer while it is held."""
    steel = fd.Sheet(2e11, 0.3, 1e-3, 7850.0)
    sheet = fd.discretize(
        fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=60), steel, preset="n5b8e", straight="xmin"
    )
    case = fd.Case(sheet, [fd.Fix([4, 5]), fd.Fix([0, 1], until=1e-4, along=True)], DOWN)
    motion = fd.simulate(case, 2e-4, method="rk4", interval=2e-5)
    begin = fd.initial_state(motion, 5)
    alone = fd.simulate(
        fd.Case(sheet, case.supports[:1], DOWN), 1e-4, start=1e-4, method="rk4", interval=2e-5,
        initial=fd.State(begin.displacement, begin.velocity),
    )  # fmt: skip
    same(motion.isel(time=slice(5, None)), alone)
    assert motion.attrs["energy_error"] < 1e-2


def test_functions_progress_and_failures_see_one_motion():
    case, _ = released_twice()
    seen = []

    def fails(u, v, t):
        if t > 0.03:
            raise ValueError("enough")
        return u[2]

    sample = {"tip": fd.Quantity("m", "tip", ("axis",), lambda u, v, t: u[2])}
    options = {"method": "rk4", "interval": 0.004}
    motion = fd.simulate(case, 0.036, sample=sample, progress=seen.append, **options)
    assert np.array_equal(motion.tip.values, motion.displacement.values[:, 2])
    assert motion.tip.attrs == {"units": "m", "long_name": "tip"}
    times = [one.time for one in seen]
    assert times == sorted(times) and times[-1] == pytest.approx(0.036) == seen[0].duration
    with pytest.raises(ComputationError, match="enough") as caught:
        fd.simulate(case, 0.036, sample={"tip": fails}, **options)
    partial = caught.value.partial
    same(partial, motion.isel(time=slice(0, partial.sizes["time"])))
    assert partial.sizes["time"] >= 7


# ---------------------------------------------------------------------- files
def test_a_stored_motion_runs_again(tmp_path):
    case, _ = released_twice()
    options = {"method": "rk4", "interval": 0.004}
    motion = fd.simulate(case, 0.036, store=tmp_path / "run.nc", **options)
    again = fd.case_of(fd.load(tmp_path / "run.nc"))
    assert [getattr(part, "until", None) for part in again.supports] == [None, None, 0.012, 0.024]
    same(fd.simulate(again, 0.036, **options), motion, tolerance=0.0)
    going_on = fd.simulate(again, 0.004, start=0.036, initial=fd.initial_state(motion), **options)
    assert going_on.sizes["line"] == 1


CASE = """
[pattern]
kind = "simple_fold"
dihedral = 60

[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0

[model]
preset = "plate"

[[supports]]
nodes = [4, 5]
axes = "xyz"

[[supports]]
nodes = [0, 1]
axes = "z"

[[supports]]
nodes = [2, 3]
axes = "xyz"
until = 0.0203

[[loads]]
gravity = [0, 0, -9.81]

[analysis]
kind = "dynamics"
method = "rk4"
duration = 0.05

[output]
interval = 0.005
nodes = [2]
"""


def test_a_case_file_releases(tmp_path):
    path = tmp_path / "flap.toml"
    path.write_text(CASE)
    found = fd.read_case(path).run()
    held = [*HINGED, fd.Fix(TIP, until=0.0203)]
    same(found, fd.simulate(fd.Case(FLAP, held, DOWN), 0.05, method="rk4", interval=0.005))
    assert found.sizes["time"] == 11


# ---------------------------------------------------------------------- refusals
@pytest.mark.parametrize("until", [0.0, -1.0])
def test_releases_come_after_the_start(until):
    with pytest.raises(InputError, match="until"):
        fd.Fix([0], until=until)


def test_loads_may_act_on_what_is_free_in_the_end():
    payload = fd.Force([2], (0.0, 0.0, -1.0))
    fd.Case(FLAP, [*HINGED, fd.Fix(TIP, until=1.0)], [payload])
    with pytest.raises(InputError, match="supports hold"):
        fd.Case(FLAP, [*HINGED, fd.Fix(TIP), fd.Cable([2, (0, 0, 1)], 1.0, until=1.0)], [payload])


def refused():
    case, _ = released_twice()
    shell = fd.superelements(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0))
    noise = fd.SpectralDensity([0.1, 100.0], [0.01, 0.01], "m2/s3")
    drive = fd.Force([0], (1e-3, 0, 0), fd.Harmonic(5.0))
    driven = fd.Case(FLAP, [*HINGED, fd.Fix(TIP, until=1.0)], [drive], fd.Rayleigh(alpha=1.0))
    linear = fd.Case(shell, [fd.Fix([4, 5]), fd.Fix([0], until=1.0)], DOWN)
    return {
        "many": lambda: fd.simulate_many([case], 0.1, interval=0.01),
        "superelements": lambda: fd.simulate(linear, 2.0),
        "random": lambda: fd.random_response(case, base={"x": noise}),
        "periodic": lambda: fd.periodic_motion(driven, 0.2),
        "gradients": lambda: MotionGradient(case, {"duration": 0.01, "method": "rk4"}),
        "basins": lambda: fd.basins(driven, lambda x: fd.State(), grid={"x": [0.0]}, duration=1.0),
        "lyapunov": lambda: fd.lyapunov_exponent(driven, 1.0, interval=0.1),
    }


@pytest.mark.parametrize("name", list(refused()))
def test_what_has_no_releases_says_so(name):
    with pytest.raises(InputError, match=r"until = .*releases nothing"):
        refused()[name]()


@pytest.mark.parametrize("state", [None, "equilibrium"])
def test_modes_are_those_before(state):
    loads = [] if state is None else DOWN
    held, free = (
        fd.Case(FLAP, [*HINGED, fd.Fix([3], until=until)], loads) for until in (None, 1.0)
    )
    one, other = (fd.modes(each, 3, state=state).frequency for each in (held, free))
    assert np.array_equal(one, other)
