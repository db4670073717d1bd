"""Supports and planes that are released where a displacement, an angle or a tension is reached."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import ComputationError, InputError
from foldyn.structures.mesh import hinge_angles

G = 9.81
PANEL = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
PLATE = fd.discretize(PANEL, fd.Sheet(1e7, 0.3, 0.01, 100.0), preset="plate", mass="mixed_voronoi")
DOWN = [fd.Gravity((0, 0, -G))]
FLAP = fd.discretize(
    fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"
)
HINGED = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
TIP = [2, 3]
SLOW = [
    pytest.param(name, marks=pytest.mark.matrix) if own.implicit else name
    for name, own in METHODS.items()
]


def hanging(until):
    """A panel on a spring (N/m) at each corner, which turns up and down at 4 rad/s."""
    springs = [
        fd.Spring(16.0 * mass, nodes=[node], direction="z", until=until)
        for node, mass in enumerate(PLATE.nodal_mass)
    ]
    return fd.Case(PLATE, springs, DOWN)


def instants(motion):
    """Times (s) of the releases of a result, by place."""
    found = (text.split(" at t = ") for text in motion.attrs["releases"].split("; "))
    return {place: float(time.removesuffix(" s")) for place, time in found}


def angle(motion, sample):
    x = FLAP.nodes + motion.displacement.values[sample]
    return np.degrees(hinge_angles(x, FLAP.folds))[0]


@pytest.mark.parametrize("method", SLOW)
def test_springs_let_go_at_a_depth(method):
    """The panel sinks by g/w^2 (1 - cos w t), and falls from the instant at which it is there."""
    w, depth, dt = 4.0, 0.5, 2e-4 if not METHODS[method].implicit else 1e-3
    case = hanging({"node": 1, "axis": "z", "displacement": -depth})
    options = {} if METHODS[method].adaptive else {"dt": dt}
    motion = fd.simulate(case, 0.5, method=method, interval=0.02, force=True, **options)
    instant = np.arccos(1.0 - depth * w**2 / G) / w
    order = 1e-6 if method in ("rk4", "dormand_prince") else 10.0 * dt**2
    found = instants(motion)
    assert len(found) == len(PLATE.nodes)
    assert list(found.values()) == pytest.approx([instant] * len(found), abs=0.5 * order)
    t = motion.time.values
    speed, after = G / w * np.sin(w * instant), t - instant
    height = np.where(
        after < 0.0, G / w**2 * (np.cos(w * t) - 1.0), -depth - speed * after - 0.5 * G * after**2
    )
    assert np.diff(t) == pytest.approx(0.02) and motion.sizes["time"] == 26
    assert motion.displacement.sel(axis="z").values[:, 0] == pytest.approx(height, abs=20 * order)
    assert motion.attrs["energy_error"] < 1e-4
    assert not motion.strain_springs.values[t > instant].any()


@pytest.mark.parametrize("interval", [0.005, 0.0033])
def test_a_cable_breaks_at_a_tension(interval):
    """Its tension never passes the limit; then it is the motion without it."""
    winch = {"change": -0.02, "history": fd.Ramp(0.03)}
    line = fd.Cable(
        [2, (0.0, 0.0, 3.0)], 50.0, pretension=0.1, until={"line": 0, "tension": 0.25}, **winch
    )
    case = fd.Case(FLAP, [*HINGED, line], [], fd.Rayleigh(alpha=0.3))
    motion = fd.simulate(case, 0.06, method="dormand_prince", interval=interval, tolerance=1e-9)
    (instant,) = instants(motion).values()
    pull, on = motion.tension.values[:, 0], motion.time.values < instant
    assert pull[on].max() < 0.25 and not pull[~on].any() and 2 < on.sum() < len(on)
    until = fd.simulate(
        case.altered(supports=[*HINGED, fd.Cable(line.nodes, 50.0, pretension=0.1, **winch)]),
        instant, method="dormand_prince", tolerance=1e-9,
    )  # fmt: skip
    assert until.tension.values[-1, 0] == pytest.approx(0.25, rel=1e-6)
    assert motion.attrs["energy_error"] < 1e-6
    jump = motion.dissipated.values[~on][0] - motion.dissipated.values[on][-1]
    assert jump == pytest.approx(until.strain_springs.values[-1], rel=0.02)


@pytest.mark.parametrize("part", ["spring", "link", "plane"])
def test_a_release_where_something_is_reached_is_one_at_that_time(part):
    """It is the motion with that time given, whatever the part is."""

    def made(until):
        supports, contact = [*HINGED], None
        if part == "plane":
            floor = fd.Plane((0, 0, -0.012), (0, 0, 1), until=until)
            contact = fd.Contact(panels=False, stiffness=10.0, planes=[floor])
            return fd.Case(PLATE, (), DOWN, contact=contact)
        held = {"spring": fd.Spring(5.0, nodes=TIP, until=until), "link": fd.Link(TIP, until=until)}
        return fd.Case(FLAP, [*supports, held[part]], DOWN, contact=contact)

    at = {"node": 1, "axis": "z", "displacement": -0.0077}
    until = at if part == "plane" else {"crease": 0, "angle": 300.7}
    options = {"method": "rk4", "interval": 0.0025}
    motion = fd.simulate(made(until), 0.06, **options)
    (instant,) = instants(motion).values()
    assert 0.0025 < instant < 0.055
    given = fd.simulate(made(float(instant)), 0.06, **options)
    for name in ("displacement", "velocity", "dissipated", "work"):
        same = given[name].values
        assert motion[name].values == pytest.approx(same, rel=1e-6, abs=1e-8 * np.abs(same).max())
    if part != "plane":
        alone = fd.simulate(made(instant), instant, method="rk4")
        assert angle(alone, -1) == pytest.approx(300.7, abs=1e-5)


def test_holds_open_one_after_another():
    """The second waits until the first has let the crease turn; each opens where it says."""
    first = fd.Spring(20.0, nodes=[2], until={"crease": 0, "angle": 300.7})
    second = fd.Spring(20.0, nodes=[3], until={"crease": 0, "angle": 301.2})
    third = fd.Spring(1.0, nodes=[0, 1], until={"node": 2, "axis": "z", "displacement": 1.0})
    case = fd.Case(FLAP, [*HINGED, second, first, third], DOWN)
    motion = fd.simulate(case, 0.2, method="rk4", interval=0.004)
    found = instants(motion)
    assert list(found) == ["supports[3]", "supports[2]"]
    assert found["supports[3]"] < found["supports[2]"]
    t = motion.time.values
    for place, goal in (("supports[3]", 300.7), ("supports[2]", 301.2)):
        k = int(np.searchsorted(t, found[place]))
        assert angle(motion, k - 1) < goal < angle(motion, k)
    assert motion.attrs["energy_error"] < 1e-3


def test_what_is_reached_at_the_start_is_released_there():
    held = fd.Fix(TIP, until={"crease": 0, "angle": 300.7})
    case, free = fd.Case(FLAP, [*HINGED, held], DOWN), fd.Case(FLAP, HINGED, DOWN)
    begin = fd.initial_state(fd.simulate(free, 0.05, method="rk4", interval=0.01))
    start = fd.State(begin.displacement, begin.velocity)
    options = {"method": "rk4", "interval": 0.005, "initial": start}
    motion, alone = (fd.simulate(each, 0.02, **options) for each in (case, free))
    assert instants(motion) == {"supports[2]": 0.0}
    assert np.array_equal(motion.displacement, alone.displacement)


def test_what_is_never_reached_changes_nothing():
    held = [fd.Fix(TIP, until=until) for until in ({"crease": 0, "angle": 330.0}, None)]
    motion, other = (
        fd.simulate(fd.Case(FLAP, [*HINGED, one], DOWN), 0.02, method="rk4", interval=0.002)
        for one in held
    )
    assert motion.attrs["releases"] == ""
    assert np.array_equal(motion.displacement, other.displacement)


def test_a_cut_cable_reaches_no_tension():
    """Its length goes on growing, but what waits for its tension stays."""
    line = fd.Cable([2, (0.0, 0.0, 3.0)], 50.0, pretension=0.1, until=0.002)
    waits = fd.Spring(1.0, nodes=TIP, until={"line": 0, "tension": 0.1001})
    motion = fd.simulate(
        fd.Case(FLAP, [*HINGED, line, waits], DOWN), 0.05, method="rk4", interval=0.005
    )
    assert list(instants(motion)) == ["supports[2]"]


def test_failures_and_functions_see_one_motion():
    """Also where a function fails after something was reached, between two looks at it."""
    case, seen = hanging({"node": 1, "axis": "z", "displacement": -0.5}), []

    def fails(u, v, t):
        if u[1, 2] < -0.6:
            raise ValueError("enough")
        return u[1, 2]

    options = {"method": "rk4", "interval": 0.02}
    with pytest.raises(ComputationError, match="enough") as caught:
        fd.simulate(case, 0.5, sample={"tip": fails}, progress=seen.append, **options)
    partial = caught.value.partial
    whole = fd.simulate(case, 0.5, **options)
    some = whole.isel(time=slice(0, partial.sizes["time"]))
    assert np.array_equal(partial.displacement, some.displacement)
    known = partial.tip.values[np.isfinite(partial.tip.values)]
    assert len(known) > 18 and np.array_equal(known, some.displacement[: len(known), 1, 2])
    assert partial.attrs["releases"] == whole.attrs["releases"]
    assert "_awaited" not in whole and seen[-1].duration == pytest.approx(0.5)


# ---------------------------------------------------------------------- files
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
stiffness = 5.0
until = { crease = 0, angle = 300.7 }

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


def test_case_files_and_stored_results(tmp_path):
    path = tmp_path / "flap.toml"
    path.write_text(CASE)
    found = fd.read_case(path).run()
    held = fd.Spring(5.0, nodes=TIP, until={"crease": 0, "angle": 300.7})
    case = fd.Case(FLAP, [*HINGED, held], DOWN)
    options = {"method": "rk4", "interval": 0.005}
    motion = fd.simulate(case, 0.05, store=tmp_path / "run.nc", **options)
    assert np.array_equal(found.displacement, motion.displacement)
    assert instants(found).keys() == {"supports[2]"}
    again = fd.case_of(fd.load(tmp_path / "run.nc"))
    assert again.supports[2].until == held.until
    assert np.array_equal(fd.simulate(again, 0.05, **options).displacement, motion.displacement)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("crease = 0", "crease = 4", r"supports\[2\]\.until\.crease.*4"),
        ("angle = 300.7", "angle = 400", r"supports\[2\]\.until\.angle = 400"),
        ("crease = 0, ", "", r"supports\[2\]\.until\.crease: missing"),
        ("crease = 0", "node = 0", r"supports\[2\]\.until"),
        ("{ crease = 0, angle = 300.7 }", "-1.0", r"supports\[2\]\.until = -1"),
        ("{ crease = 0, angle = 300.7 }", '"soon"', r"supports\[2\]\.until = .soon."),
    ],
)
def test_files_are_told_what_is_wrong(tmp_path, old, new, message):
    path = tmp_path / "flap.toml"
    path.write_text(CASE.replace(old, new))
    with pytest.raises(InputError, match=message):
        fd.read_case(path).run()


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ({"node": 2, "axis": "z", "displacement": 0.0}, r"displacement = 0: is the value at rest"),
        ({"node": 20, "axis": "z", "displacement": 1.0}, r"supports\[2\]\.until\.node.*20"),
        ({"crease": 0, "angle": 300.0}, r"supports\[2\]\.until\.angle.*at rest"),
        ({"line": 0, "tension": 1.0}, r"supports\[2\]\.until\.line = 0: the case has 0 springs"),
        ({"node": 2}, "until"),
        ({"node": 2, "angle": 1.0}, "until"),
    ],
)
def test_what_cannot_be_reached_is_refused(until, message):
    with pytest.raises(InputError, match=message):
        fd.Case(FLAP, [*HINGED, fd.Fix(TIP, until=until)], DOWN)


def test_what_has_no_releases_says_so():
    case = hanging({"node": 1, "axis": "z", "displacement": -0.5})
    with pytest.raises(InputError, match=r"supports\[0\]\.until = .*releases nothing"):
        fd.simulate_many([case], 0.1, interval=0.01)


# ---------------------------------------------------------------------- what a stranger tried
def test_loads_may_act_on_what_is_held_at_first():
    """A payload pulls at the tip, which a support holds until it lets go."""
    payload = [fd.Force(TIP, (0.0, 0.0, 0.02))]
    for until in (0.02, {"node": 2, "axis": "z", "displacement": 1e-5}):
        held = fd.Fix([3], until=until)
        case = fd.Case(FLAP, [*HINGED, held], [fd.Force([3], (0.0, 0.0, 0.02)), *payload])
        motion = fd.simulate(case, 0.05, method="rk4", interval=0.005)
        assert len(instants(motion)) == 1 and motion.attrs["energy_error"] < 1e-3


def test_samples_stay_even_far_from_the_start():
    """Times of a thousand seconds have few digits left for intervals of 25 microseconds."""
    held = fd.Spring(5.0, nodes=TIP, until={"crease": 0, "angle": 300.8})
    case = fd.Case(FLAP, [*HINGED, held], DOWN)
    options = {"method": "rk4", "interval": 2.5e-5}
    early, late = (fd.simulate(case, 0.035, start=at, **options) for at in (0.0, 1000.0))
    assert late.sizes["time"] == early.sizes["time"] == 1401
    assert np.diff(late.time.values) == pytest.approx(2.5e-5, rel=1e-6)
    u = early.displacement.values
    assert np.abs(late.displacement.values - u).max() < 1e-6 * np.abs(u).max()


def test_the_search_leaves_functions_alone_and_equal_goals_are_sought_once(monkeypatch):
    held = [fd.Spring(1.0, nodes=[k], until={"crease": 0, "angle": 300.7}) for k in TIP]
    case, seen = fd.Case(FLAP, [*HINGED, *held], DOWN), []

    def tip(u, v, t):
        seen.append(t)
        return u[2, 2]

    options = {"method": "rk4", "interval": 0.005, "sample": {"tip": tip}}
    motion = fd.simulate(case, 0.05, **options)
    (instant,) = set(instants(motion).values())
    assert len(instants(motion)) == 2
    grid = [*motion.time.values, instant]
    assert all(np.isclose(t, grid, rtol=0, atol=1e-9).any() for t in seen)


def test_a_step_is_checked_at_the_start_only():
    """The critical step falls a little while the sheet folds."""
    held = fd.Spring(5.0, nodes=TIP, until={"crease": 0, "angle": 300.7})
    case = fd.Case(FLAP, [*HINGED, held], DOWN)
    dt = 0.9993 * fd.critical_step(case)
    motion = fd.simulate(case, 0.1, method="rk4", dt=dt)
    assert len(instants(motion)) == 1 and motion.attrs["energy_error"] < 0.05


@pytest.mark.parametrize(
    ("line", "until", "message"),
    [
        (fd.Cable([2, (0.0, 0.0, 3.0)], 50.0), -0.1, "a cable does not push"),
        (fd.Cable([2, (0.0, 0.0, 3.0)], 50.0, pretension=0.5), 0.2, "it has 0.5 N already"),
    ],
)
def test_a_fuse_that_cannot_break_is_refused(line, until, message):
    fuse = fd.Cable(line.nodes, 50.0, pretension=line.pretension,
                    until={"line": 0, "tension": until})  # fmt: skip
    with pytest.raises(InputError, match=rf"supports\[2\]\.until\.tension = .*{message}"):
        fd.Case(FLAP, [*HINGED, fuse])


def test_a_spring_may_be_a_fuse():
    spring = fd.Spring(5.0, between=[(2, 4)], until={"line": 0, "tension": 0.001})
    case = fd.Case(FLAP, [*HINGED, spring], [fd.Force(TIP, (0.2, 0.2, 0.3))])
    motion = fd.simulate(case, 0.02, method="rk4", interval=2e-4)
    (instant,) = instants(motion).values()
    x = FLAP.nodes + motion.displacement.values
    pull = 5.0 * (
        np.linalg.norm(x[:, 2] - x[:, 4], axis=1) - np.linalg.norm(FLAP.nodes[2] - FLAP.nodes[4])
    )
    assert pull[motion.time.values < instant].max() < 0.001
    stored = motion.strain_springs.values
    assert stored[1] and not stored[motion.time.values > instant].any() and instant < 0.015


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ({"crease": 0, "angle": 170.0, "node": 1}, "waits for one thing; leave out"),
        ({"node": -1, "axis": "z", "displacement": 1.0}, r"until\.node = -1: node -1"),
        ({1: 2}, "until"),
    ],
)
def test_mixed_and_odd_tables_are_refused(until, message):
    with pytest.raises(InputError, match=message):
        fd.Case(FLAP, [*HINGED, fd.Fix(TIP, until=until)], DOWN)
