"""Cables, bars and driven springs: closed forms, derivatives, energy and work, messages."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from attached_cases import FOLD, derivative_errors, moved, structure
from scipy.optimize import brentq

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning, InputError, ModelRangeWarning
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES

G = 9.81
UP = (0.0, 0.0, 1.0)
EA = 1e4  # N
SHEET = fd.Sheet(1e9, 0.3, 0.01, 100.0)
TRIANGLE = [[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0]]


def blocks(*places: tuple[float, float, float]) -> fd.Structure:
    """Triangles with their first corners here: on vertical rails they move as points do."""
    x = np.concatenate([np.array(TRIANGLE) + place for place in places])
    faces = [[3 * k, 3 * k + 1, 3 * k + 2] for k in range(len(places))]
    return fd.discretize(fd.Pattern(x, faces), SHEET)


def on_rails(count: int) -> fd.Fix:
    return fd.Fix(list(range(3 * count)), "xy")


def level(count: int) -> list[fd.Link]:
    """The corners of each block rise together."""
    return [fd.Link([3 * k, 3 * k + 1, 3 * k + 2], "z") for k in range(count)]


# ------------------------------------------------------------------ the body
EVERYTHING = [
    fd.Cable([0, (0.2, -0.4, 1.5), 2, 1], 300.0, pretension=20.0),
    fd.Cable([3, 0, (1.0, 2.0, 0.5), 3], 200.0, rest_length=2.0),
    fd.Cable([0, 3], 900.0, rest_length=30.0),  # slack
    fd.Bar([(0, 2), (1, 3)], 70.0, rest_length=0.9),
    fd.Cable([1, 4], 50.0, change=-0.3),
]


def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_the_forces(model):
    s = structure(model, FOLD)
    with pytest.warns(FoldynWarning, match="slack until its points are farther apart"):
        case = fd.Case(s, EVERYTHING)
    body = case.body
    assert max(derivative_errors(body, moved(s, 0.1))) < 1e-8
    tension = case.lines.pulls(moved(s, 0.1))
    assert tension[2] == 0.0
    assert np.abs(tension[[0, 1, 5]]).min() > 1.0


def test_tension_follows_from_the_length_of_the_line():
    s = structure("bars and hinges", FOLD)
    case = fd.Case(s, [fd.Cable([0, (0.2, -0.4, 1.5), 2, 1], 300.0, rest_length=2.5)])
    u = moved(s, 0.1).reshape(-1, 3)
    a, b, c, d = s.nodes[0] + u[0], np.array([0.2, -0.4, 1.5]), s.nodes[2] + u[2], s.nodes[1] + u[1]
    whole = sum(np.linalg.norm(q - p) for p, q in ((a, b), (b, c), (c, d)))
    pull = 300.0 * (whole / 2.5 - 1.0)
    assert case.lines.pulls(u.ravel()) == pytest.approx([pull], rel=1e-13)
    assert case.body.energies(u.ravel())[-1] == pytest.approx(
        0.5 * 300.0 / 2.5 * (whole - 2.5) ** 2, rel=1e-13
    )
    force = (case.body.internal(u.ravel()) - s.body.internal(u.ravel())).reshape(-1, 3)
    assert force[0] == pytest.approx(pull * (a - b) / np.linalg.norm(a - b), rel=1e-12)
    unit = [(q - p) / np.linalg.norm(q - p) for p, q in ((b, c), (c, d))]
    assert force[2] == pytest.approx(pull * (unit[0] - unit[1]), rel=1e-12)


# ------------------------------------------------------------------ statics in closed form
def test_a_weight_on_a_cable_over_two_pulleys():
    """The counterweight w pulls everywhere; the weight W hangs where 2 w sin(angle) = W."""
    s, w, W = blocks((-1, 0, -1), (0, 0, 0)), 30.0, 24.0
    cable = fd.Cable([0, (-1, 0, 0), 3, (1, 0, 0), (1, 0, -2)], EA, pretension=w)
    loads = [fd.Force([0], (0, 0, -w)), fd.Force([3], (0, 0, -W))]
    case = fd.Case(s, [on_rails(2), *level(2), cable], loads)
    path = fd.trace(case, constant=[0])
    low = float(path.displacement[-1, 3, 2])
    assert low == pytest.approx(-math.tan(math.asin(W / (2 * w))), rel=1e-6)
    assert float(path.displacement[-1, 0, 2]) == pytest.approx(2 * math.hypot(1, low) - 2, rel=1e-6)
    assert path.tension.values[-1] == pytest.approx([w], rel=1e-8)
    assert float(path.work[-1]) == pytest.approx(  # it falls and lifts the counterweight
        float(sum(path[name][-1] - path[name][0] for name in case.energy_groups)), abs=2e-3 * W
    )


def test_a_bell_crank():
    """A plate that turns about one corner: the moments of cable and load cancel where it stands."""
    s = fd.discretize(fd.Pattern([[0, 0, 0], [1, 0, 0], [0, 0, 2]], [[0, 1, 2]]), SHEET)
    held = [fd.Fix([0]), fd.Fix([1, 2], "y"), fd.Cable([2, (-3, 0, 2), (-3, 0, 0)], EA)]
    path = fd.trace(fd.Case(s, held, [fd.Force([1], (0, 0, -60.0))]))
    x = s.nodes + path.displacement.values[-1]
    along = np.array([-3, 0, 2]) - x[2]
    arm = abs(np.cross(x[2], along / np.linalg.norm(along))[1])
    assert float(path.tension[-1, 0]) * arm == pytest.approx(60.0 * x[1, 0], rel=1e-7)
    assert float(path.tension[-1, 0]) == pytest.approx(30.0, rel=0.01)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_chain_of_forty_bars_hangs_as_the_funicular_polygon():
    """Equal weights at its nodes: tan of each bar is the weight to one side over the thrust."""
    count, span, weight, EA = 40, 2.0, 0.5, 100.0
    own = 0.98 * span / count  # force-free length: taut at rest
    x = span * np.arange(1, count) / count
    s = blocks(*[(at, 0.0, -0.4 * span * math.sin(math.pi * at / span)) for at in x])
    nodes = [3 * k for k in range(count - 1)]
    riding = [fd.Link([k, k + 1, k + 2], "xyz") for k in nodes]  # a block moves with its node
    bars = fd.Bar(list(pairwise(nodes)), EA, rest_length=own)
    ends = [
        fd.Cable([k, (at, 0, 0)], EA, rest_length=own) for k, at in ((0, 0.0), (nodes[-1], span))
    ]
    weights = fd.Force(nodes, (0, 0, -weight))
    case = fd.Case(s, [fd.Fix(nodes, "y"), *riding, bars, *ends], [weights])
    path = fd.trace(case, constant=[0], load_factors=[0.0])
    slope = weight * (np.arange(count) - 0.5 * (count - 1))

    def wide(thrust: float) -> float:
        pull = np.hypot(slope, thrust)
        return float((own * (1.0 + pull / EA) * thrust / pull).sum()) - span

    thrust = brentq(wide, 1e-3, 1e3, xtol=1e-14)
    pull = np.hypot(slope, thrust)
    down = np.cumsum(own * (1.0 + pull / EA) * slope / pull)[:-1]
    found = (s.nodes + path.displacement.values[-1])[nodes, 2]
    assert found == pytest.approx(down, abs=1e-6 * np.abs(down).max())
    bars_alone = path.tension.values[-1][: count - 2]
    assert bars_alone == pytest.approx(pull[1:-1], rel=1e-6)


# ------------------------------------------------------------------ motions
def bouncing() -> fd.Case:
    """A block falls onto a cable that hangs slack beside it, and bounces without loss."""
    s = blocks((0, 0, 0))
    cable = fd.Cable([0, (0, 0, 1.0)], 500.0, rest_length=1.2)
    weight = fd.Gravity((0, 0, -G))
    return fd.Case(s, [on_rails(1), *level(1), cable], [weight])


@pytest.fixture(scope="module")
def slack_case() -> fd.Case:
    with pytest.warns(FoldynWarning, match="the cable is 1.2 m long and its line at rest 1 m"):
        return bouncing()


def period(case: fd.Case) -> float:
    """Of the bounces: free flight over 0.2 m and back, and a swing about the hanging length."""
    mass, k = float(case.nodal_mass.sum()), 500.0 / 1.2
    rate, sag, speed = math.sqrt(k / mass), mass * G / k, math.sqrt(2 * G * 0.2)
    return 2 * speed / G + (math.pi + 2 * math.atan(sag * rate / speed)) / rate


def test_a_cable_that_goes_slack_and_taut_fifty_times_keeps_the_energy(slack_case):
    case, bounces = slack_case, 25
    motion = fd.simulate(
        case, bounces * period(case), method="dormand_prince", interval=1e-2, tolerance=1e-8
    )
    assert motion.attrs["energy_error"] < 1e-5
    tension = motion.tension.values[:, 0]
    assert (tension == 0.0).any()
    assert tension.max() > 5 * G * float(case.nodal_mass.sum())
    assert float(motion.displacement[-1, 0, 2]) == pytest.approx(0.0, abs=2e-3)  # back again


@pytest.mark.parametrize("method", [name for name in METHODS if name != "dormand_prince"])
def test_energy_errors_of_bounces_shrink_with_the_step(slack_case, method):
    """Explicit steps end where the cable goes slack or taut, which keeps the order of a method."""
    end = period(slack_case)
    error = []
    for dt in (1e-3, 2.5e-4):
        given = {"dt": dt} if METHODS[method].implicit else {"dt": 0.2 * dt}
        error.append(fd.simulate(slack_case, end, method=method, **given).attrs["energy_error"])
    order = {"rk4": 3.0, "energy_momentum": 0.0}.get(method, 1.5)
    assert error[1] < max(error[0] / 4.0**order, 1e-9)
    assert error[1] < 1e-3


SOFT = 30.0  # N, EA of a cable that stays taut as it is wound in


def winding() -> fd.Case:
    """A block that a winch lifts by 0.3 m in a second, and on."""
    cable = fd.Cable([0, (0, 0, 1.0)], SOFT, change=-0.36, history=fd.Ramp(1.2))
    return fd.Case(blocks((0, 0, 0)), [on_rails(1), *level(1), cable], [fd.Gravity((0, 0, -G))])


@pytest.mark.parametrize("method", METHODS)
def test_a_winch_lifts_a_weight_and_its_work_is_booked(method):
    case = winding()
    given = {} if method == "dormand_prince" else {"dt": 5e-4}
    motion = fd.simulate(case, 1.0, method=method, interval=0.05, **given)
    assert motion.attrs["energy_error"] < 1e-4
    lifted = float(motion.displacement[-1, 0, 2])
    mass = float(case.nodal_mass.sum())
    assert lifted == pytest.approx(0.3, abs=0.03)  # it swings by the sag, and the winch's speed
    # what the winch gave is in the height, the speed and the cable
    stored = sum(float(motion[n][-1] - motion[n][0]) for n in (*case.energy_groups, "kinetic"))
    assert float(motion.work[-1]) == pytest.approx(stored, abs=1e-4 * mass * G * lifted)
    assert abs(float(motion.work[-1])) < 0.2 * mass * G * 0.3  # of winch and weight together


def test_a_path_winds_with_the_load_factor():
    case = winding()
    path = fd.trace(case, constant=[0], steps=4)
    mass = float(case.nodal_mass.sum())
    pull = mass * G
    own = 1.0 - 0.36 * path.load_factor.values
    lifted = 1.0 - own * (1.0 + pull / SOFT)
    assert path.displacement.values[:, 0, 2] == pytest.approx(lifted, abs=1e-9)
    assert path.tension.values == pytest.approx(np.full((5, 1), pull), rel=1e-9)
    gained = float(sum(path[name][-1] - path[name][0] for name in case.energy_groups))
    # the weight is a load: its work is negative, the winch's is what is left
    assert float(path.work[-1] - path.work[0]) == pytest.approx(gained, abs=0.02 * pull * 0.3)


def test_a_spring_whose_rest_length_changes_swings_as_on_a_moving_foot():
    s, k = blocks((0, 0, 0)), 80.0
    history = fd.Harmonic(1.3)
    foot = fd.Case(
        blocks((0, 0, 0), (0, 0, -1)),
        [
            on_rails(2),
            *level(2),
            fd.Spring(k, between=[(0, 3)]),
            fd.Impose([3], "z", 0.05, history),
        ],
    )
    own = fd.Case(
        blocks((0, 0, 0), (0, 0, -1)),
        [on_rails(2), *level(2), fd.Fix([3], "z"),
         fd.Spring(k, between=[(0, 3)], change=0.05, history=history)],
    )  # fmt: skip
    one, other = (fd.simulate(case, 1.0, interval=0.02) for case in (foot, own))
    assert other.displacement[:, 0].values == pytest.approx(one.displacement[:, 0].values, abs=1e-5)
    assert float(other.work[-1]) == pytest.approx(  # the foot has a kinetic energy of its own
        float(sum(other[n][-1] - other[n][0] for n in (*own.energy_groups, "kinetic"))), abs=1e-7
    )
    assert s.nodes.shape == (3, 3)


@pytest.mark.parametrize("method", ["dormand_prince", "newmark", "energy_momentum"])
@pytest.mark.parametrize("kind", ["ground", "line"])
def test_work_of_a_changing_stiffness(kind, method):
    """Stiffness that follows a ramp: energy is put in with half the square of the extension."""
    s, growth = blocks((0, 0, 0), (0, 0, -1)), fd.Ramp(0.5)
    given = {"nodes": [0], "direction": "z"} if kind == "ground" else {"between": [(0, 3)]}
    spring = fd.Spring(60.0, **given, stiffness_history=growth)
    case = fd.Case(s, [on_rails(2), *level(2), fd.Fix([3], "z"), spring])
    start = fd.State(displacement=np.outer([1, 1, 1, 0, 0, 0], (0, 0, 0.1)))
    dt = {} if method == "dormand_prince" else {"dt": 2e-4}
    motion = fd.simulate(case, 0.6, method=method, initial=start, interval=0.01, **dt)
    assert motion.attrs["energy_error"] < 1e-5
    extension = motion.displacement.values[:, 0, 2]
    factor = growth(motion.time.values)
    assert motion.strain_springs.values == pytest.approx(30.0 * factor * extension**2, abs=1e-9)
    assert float(motion.work[-1]) > 0.05
    same = fd.simulate(case, 0.6, method="dormand_prince", initial=start, interval=0.01)
    assert extension == pytest.approx(same.displacement.values[:, 0, 2], abs=2e-4)


@pytest.mark.parametrize("method", ["newmark", "generalized_alpha", "energy_momentum"])
def test_a_cable_that_is_paid_out_fast_gives_its_energy_back_to_the_winch(method):
    """Within a step the winch moves by more than the cable is stretched."""
    cable = fd.Cable([0, (0, 0, 1.0)], 300.0, pretension=0.5, change=0.05, history=fd.Ramp(0.2))
    case = fd.Case(blocks((0, 0, 0)), [on_rails(1), *level(1), cable])
    motion = fd.simulate(case, 0.2, method=method, dt=5e-4, interval=0.02)
    assert float(motion.tension[-1, 0]) == 0.0
    assert motion.attrs["energy_error"] < 0.02
    given = float(motion.strain_springs[0] + motion.work[-1])
    assert given == pytest.approx(
        float(motion.kinetic[-1]), abs=0.03 * float(motion.strain_springs[0])
    )


# ------------------------------------------------------------------ files, warnings, messages
STATICS = """
pattern = { kind = "miura", cells = [1, 1], a = 0.04, b = 0.04, panel_angle = 60, dihedral = 110 }
sheet = { youngs_modulus = 2e9, poissons_ratio = 0.3, thickness = 3e-4 }
model = { preset = "plate" }
supports = [
  { nodes = "xmin" },
  { cable = [7, [0.1, 0.03, 0.05]], cable_stiffness = 0.5, cable_change = -1e-3, HISTORY },
]
analysis = { kind = "statics", load_factors = [0.0, 0.5, 1.0] }
"""


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_path_of_a_file_winds_a_cable_that_has_a_history(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(STATICS.replace("HISTORY", 'history = { kind = "ramp", duration = 1.0 }'))
    tension = fd.read_case(file).run().tension.values[:, 0]
    assert tension[0] == 0.0
    assert (np.diff(tension) > 1e-5).all()


def test_cases_with_lines_come_back_from_results(tmp_path):
    supports = [
        on_rails(2), *level(2), fd.Bar([(0, 3)], EA, bending=2.0),
        fd.Cable([0, (0.5, 0, 2.0), 3], 200.0, pretension=1.0, change=-0.1, history=fd.Ramp(0.1)),
        fd.Spring(
            5.0, between=[(1, 4)], change=0.01, history=fd.Ramp(0.1), stiffness_history=fd.Ramp(2.0)
        ),
    ]  # fmt: skip
    case = fd.Case(blocks((0, 0, 0), (1, 0, 0)), supports)
    motion = fd.simulate(case, 0.01, interval=0.005)
    fd.save(motion, tmp_path / "lines.nc")
    again = fd.case_of(fd.load(tmp_path / "lines.nc"))
    assert again.supports == case.supports
    same = fd.simulate(again, 0.01, interval=0.005)
    np.testing.assert_array_equal(same.displacement, motion.displacement)
    assert motion.tension.attrs["units"] == "N"


def test_bars_that_would_buckle_are_told():
    s = blocks((0, 0, 0), (0, 0, 1))
    bar = fd.Bar([(0, 3)], EA, bending=1.0)
    held = [on_rails(2), *level(2), fd.Fix([0], "z"), bar]
    limit = math.pi**2
    for load, told in ((0.9 * limit, False), (1.2 * limit, True)):
        case = fd.Case(s, held, [fd.Force([3], (0, 0, -load))])
        if told:
            with pytest.warns(ModelRangeWarning, match=r"bar \(line 0\) is pressed with 1.2 times"):
                path = fd.trace(case)
        else:
            path = fd.trace(case)
        assert float(path.tension[-1, 0]) == pytest.approx(-load, rel=1e-6)
        share = asked("bar_load", MEASURES).number(path, case, {})
        assert share == pytest.approx(load / limit, rel=1e-6)


# ------------------------------------------------------------------ the mass of bars
@pytest.mark.parametrize("model", [fd.discretize, fd.shell, fd.superelements])
def test_a_bar_has_the_inertia_of_a_rod(model):
    """About its end m L^2 / 3; in translation m; its weight is shared by its ends."""
    x = np.concatenate([TRIANGLE, np.add(TRIANGLE, (0.0, 0.0, 2.0))])
    s = model(fd.Pattern(x, [[0, 1, 2], [3, 4, 5]]), SHEET)
    case = fd.Case(s, [fd.Bar([(0, 3), (1, 4)], EA, mass=6.0)], [fd.Gravity((0, 0, -G))])
    turning = s.nodes[:, 2]  # velocity along x of a turn about the plane z = 0
    for motion, expected in ((np.ones(len(turning)), 12.0), (turning, 2 * 6.0 * 2.0**2 / 3.0)):
        assert motion @ (case.carried @ motion) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(case.point_masses[[0, 1, 2, 3, 4, 5]], [3, 3, 0, 3, 3, 0])
    assert case.total_mass == pytest.approx(12.0 + s.total_mass, rel=1e-12)


@pytest.mark.parametrize("method", ["rk4", "newmark", "energy_momentum"])
def test_a_bar_swings_like_a_physical_pendulum(method):
    """A rod that carries a block of mass M at its end: w^2 = (m/2 + M) g / ((m/3 + M) L)."""
    s, m, L, swing = blocks((0, 0, 0), (0, 0, -1)), 3.0, 1.0, 1e-3
    M = s.total_mass / 2.0
    own = L / (1.0 + (m / 2 + M) * G / 1e6)  # as long as L under the weight
    bar = fd.Bar([(0, 3)], 1e6, rest_length=own, mass=m)
    held = [fd.Fix([0, 1, 2]), fd.Link([3, 4, 5]), bar]
    case = fd.Case(s, [*held, fd.Fix(list(range(6)), "y")], [fd.Gravity((0, 0, -G))])
    period = 2.0 * math.pi * math.sqrt((m / 3 + M) * L / ((m / 2 + M) * G))
    aside = np.zeros_like(s.nodes)
    aside[3:, 0] = swing
    dt = period / (4000 if method == "rk4" else 200)
    motion = fd.simulate(
        case, period, method=method, dt=dt, initial=fd.State(aside), interval=period / 4
    )
    expected = swing * np.cos(0.5 * np.pi * np.arange(5))
    np.testing.assert_allclose(motion.displacement[:5, 3, 0], expected, atol=1e-3 * swing)


def test_gradients_by_the_mass_of_a_bar():
    for model in (fd.discretize, fd.superelements):

        def frequency(mass, model=model):
            s = model(fd.patterns.simple_fold(a=0.3, b=0.3), SHEET)
            return fd.Case(
                s, [fd.Fix("xmin", "xyz"), fd.Fix("xmax", "z"), fd.Bar([(1, 5)], 1e3, mass=mass)]
            )

        found = fd.sensitivity(frequency, {"mass": 0.4}, measures="frequency[1]",
                               analysis={"kind": "modes", "count": 1})  # fmt: skip
        ends = [fd.modes(frequency(mass), 1).frequency.values[0] for mass in (0.399, 0.401)]
        assert float(found["gradient_mass"][0]) == pytest.approx(
            (ends[1] - ends[0]) / 2e-3, rel=1e-4
        )


@pytest.mark.matrix
def test_a_tube_is_zipped_shut():
    """Springs that come on as two edges meet hold them after what folded the tube lets go."""
    points = [(0.05 * k, y, 0.0) for k in range(4) for y in (0.0, 0.2)]
    strip = fd.Pattern(points, [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(3)], "VV")
    film = fd.Sheet(2e9, 0.3, thickness=5e-4, density=1200.0)
    strip = fd.discretize(strip, film, preset="plate", crease_stiffness=0.02, fold_law="linear")
    folding = fd.Table([0.0, 1.0, 1.5, 2.5], [0.0, 1.0, 1.0, 0.0], smooth=True)
    closing = fd.Table([0.0, 1.0, 1.2, 2.5], [1e-6, 1e-6, 1.0, 1.0])
    pairs, width = [(0, 6), (1, 7)], 2e-2
    for stiffness, last in ((100.0, 2.1e-2), (1e-3, 0.15)):
        seam = fd.Spring(stiffness, between=pairs, rest_length=width, stiffness_history=closing)
        held = [fd.Fix([2, 3]), fd.Fix([4], "z"), seam]
        turn = [fd.Actuate("all", 75.0, history=folding)]
        case = fd.Case(strip, held, turn, fd.CreaseDamping(5e-3))
        motion = fd.simulate(case, 2.5, interval=0.05)
        assert motion.attrs["energy_error"] < 3e-3
        x = motion.displacement.values[-1] + strip.nodes
        gap = np.linalg.norm(x[6] - x[0])
        assert abs(gap - last) < 0.1 * last + 1e-3


WRONG = {
    "one point": (lambda: fd.Cable([3], 1.0), "runs over at least two points"),
    "twice the same": (
        lambda: fd.Case(blocks((0, 0, 0)), [fd.Cable([1, 1], 1.0)]), "are in one place",
    ),
    "no node": (lambda: fd.Case(blocks((0, 0, 0)), [fd.Cable([1, 9], 1.0)]), "out of range"),
    "two lengths": (
        lambda: fd.Cable([1, 2], 1.0, rest_length=1.0, pretension=1.0), "follows from rest_length",
    ),
    "an idle history": (lambda: fd.Cable([1, 2], 1.0, history=fd.Ramp(1.0)), "needs the change"),
    "nothing left": (
        lambda: fd.Case(blocks((0, 0, 0)), [fd.Cable([1, 2], 1.0, change=-1.0)]),
        "leaves no cable of 0.424264 m",
    ),
    "a path": (
        lambda: fd.trace(
            fd.Case(
                blocks((0, 0, 0)), [fd.Spring(1.0, nodes=[0], stiffness_history=fd.Ramp(1.0))],
                [fd.Force([1], UP)],
            )
        ),
        "only motions have a time in which a stiffness can vary",
    ),
    "superelements": (
        lambda: fd.Case(
            fd.superelements(fd.patterns.simple_fold(), SHEET), [fd.Cable([0, 2], 1.0)]
        ),
        "superelements are linear, and cables",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_lines_refuse(name):
    make, message = WRONG[name]
    with pytest.raises(InputError, match=message):
        make()


DRIVEN = {
    "periodic": lambda: fd.periodic_motion(
        fd.Case(
            fd.discretize(FOLD, SHEET, preset="plate", fold_law="linear"),
            [
                fd.Fix([0, 1, 2]),
                fd.Spring(1.0, between=[(0, 5)], change=0.1, history=fd.Harmonic(1.0)),
            ],
            damping=fd.Rayleigh(1.0, 0.0),
        )
    ),
    "superelements": lambda: fd.simulate(
        fd.Case(
            fd.superelements(FOLD, SHEET),
            [fd.Fix([0, 1]), fd.Spring(1.0, nodes=[5], stiffness_history=fd.Ramp(1.0))],
        ),
        0.1,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", DRIVEN)
def test_what_leaves_histories_out_says_so(name):
    with pytest.raises(InputError, match="springs and cables that follow a history have no place"):
        DRIVEN[name]()


def test_a_winch_that_would_use_up_its_cable_is_refused():
    cable = fd.Cable([0, (0, 0, 1.0)], SOFT, change=-2.0, history=fd.Ramp(1.0))
    case = fd.Case(blocks((0, 0, 0)), [on_rails(1), *level(1), cable])
    with pytest.raises(InputError, match=r"leaves nothing of its 1 m at t = 0.5 s"):
        fd.simulate(case, 1.0)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_sheet_that_hangs_on_cables_swings_as_a_pendulum():
    """sqrt(g/L) in both directions: tension holds what no length does."""
    sheet = fd.discretize(fd.patterns.miura(a=0.04, b=0.04), SHEET, preset="plate")
    weight = float(np.asarray(sheet.mass.sum())) * G
    corners, long = [0, 2, 6, 8], 0.2
    hung = [
        fd.Cable([k, tuple(sheet.nodes[k] + [0, 0, long])], 1e3, pretension=weight / 4)
        for k in corners
    ]
    case = fd.Case(sheet, hung, [fd.Gravity((0, 0, -G))])
    found = fd.modes(case, 3, state="equilibrium", check_model=False)
    assert found.frequency.values[:2] == pytest.approx(
        math.sqrt(G / long) / (2 * math.pi), rel=0.01
    )
