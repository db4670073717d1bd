"""Paths whose steps take time: creases relax and creep along them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from named_models import named
from one_hinge import STIFFNESS, WING, moment, one_hinge, opened

PRONY = fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear")
CREEP = fd.Eyring(2e-3, 1e-2, law="linear")
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1e-3)


def moved(law, turn):
    """The hinge, whose wing is moved to this turn (rad) at the factor 1."""
    return one_hinge(law, [fd.Impose([WING], "z", np.tan(turn))], hold=False)


def pressed(law, push):
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, push))], hold=False)


@pytest.mark.parametrize("method", ["newton", "displacement"])
def test_relaxation_at_a_held_angle(method):
    """After a turn in no time: the series of the law, whatever the steps."""
    steps = [0.0, 0.01, 0.3, 0.002, 1.0]
    path = fd.trace(moved(PRONY, 0.3), method, load_factors=[0.0] + [1.0] * 5, duration=steps)
    np.testing.assert_allclose(path.elapsed, np.cumsum([0.0, *steps]), rtol=1e-15)
    wanted = STIFFNESS * 0.3 * PRONY.relaxation(path.elapsed.values[1:])
    np.testing.assert_allclose(moment(path)[1:], wanted, rtol=1e-12)


def test_logarithmic_relaxation():
    """tanh(M / 2 M0) falls as exp(-2 k r t / M0)."""
    barrier, rate, turn = 4e-4, 1e-6, 0.3
    law = fd.Eyring(barrier, rate, law="linear")
    steps = [0.0, *np.logspace(-3, 3, 13)]
    path = fd.trace(moved(law, turn), "newton", load_factors=[0.0] + [1.0] * 14, duration=steps)
    t = path.elapsed.values[1:]
    first = np.tanh(0.5 * STIFFNESS * turn / barrier)
    wanted = 2 * barrier * np.arctanh(first * np.exp(-2 * STIFFNESS * rate * t / barrier))
    np.testing.assert_allclose(moment(path)[1:], wanted, rtol=1e-7)
    assert moment(path)[-1] < 0.8 * moment(path)[1]


@pytest.mark.parametrize("ratio", [0.7, 30.0])
def test_creep_under_a_constant_moment(ratio):
    """The standard linear solid, of order 2; what is soft in the end is not taken for a snap."""
    tau, push, errors = 0.3, 1e-5, []
    case = pressed(fd.Prony(ratio, tau, law="linear"), push)
    whole = 3.0 * (1.0 + ratio) * tau
    for n in (20, 40, 80):
        steps = [0.0] + [whole / n] * n
        path = fd.trace(case, "newton", load_factors=[0.0] + [1.0] * (n + 1), duration=steps)
        left = ratio / (1 + ratio) * np.exp(-path.elapsed.values[1:] / ((1 + ratio) * tau))
        errors.append(np.abs(opened(path)[1:] / (push / STIFFNESS * (1 - left)) - 1.0).max())
    assert errors[-1] < 3e-3
    assert np.log2(errors[-2] / errors[-1]) > 1.8


@pytest.mark.parametrize("speed", [1e-4, 1e-2, 1.0, 100.0])
def test_the_moment_at_a_constant_rate(speed):
    """Eyring's: M = M0 asinh(rate / 2 r), once it flows as fast as it turns."""
    barrier, rate, turn = 2e-6, 0.01, 0.02
    case = moved(fd.Eyring(barrier, rate, law="linear"), turn)
    path = fd.trace(case, "newton", steps=40, duration=turn / speed / 40)
    assert moment(path)[-1] == pytest.approx(barrier * np.arcsinh(speed / 2 / rate), rel=1e-3)


def test_slow_paths_are_relaxed_and_fast_ones_are_instantaneous():
    turn, factors = 0.3, [0.0, 0.5, 1.0]
    relaxed = moment(fd.trace(moved("linear", turn), load_factors=factors))
    for law, slow in ((PRONY, relaxed), (CREEP, 0.0 * relaxed)):
        found = [
            moment(fd.trace(moved(law, turn), load_factors=factors, duration=each))
            for each in (1e-12, 1e9)
        ]
        at_once = 1.7 * relaxed if law is PRONY else relaxed
        np.testing.assert_allclose(found[0], at_once, rtol=1e-9)
        np.testing.assert_allclose(found[1], slow, rtol=0, atol=1e-8 * relaxed[-1])
    untimed = fd.trace(moved(PRONY, turn), load_factors=factors)
    np.testing.assert_array_equal(moment(untimed), relaxed)
    assert "elapsed" not in untimed


def test_moments_are_of_order_1_where_the_rate_changes():
    """Its mean over the last step is seen: the wing moves along a line, not along its arc."""
    case = moved(CREEP, 0.3)
    ends = [moment(fd.trace(case, steps=n, duration=1000.0 / n))[-1] for n in (5, 10, 20, 40)]
    change = np.diff(ends)
    assert np.log2(change[:-1] / change[1:]) == pytest.approx(1.0, abs=0.1)


def test_energies_balance():
    case = moved(fd.Prony(0.7, 0.3, law="linear"), 0.3)
    off = []
    for n in (50, 100):
        path = fd.trace(case, "displacement", steps=n, duration=1.0 / n)
        left = path.work - path.strain_folds - path.strain_bars - path.dissipated
        off.append(float(np.abs(left).max() / path.work.max()))
    assert float(path.dissipated[-1]) > 0.05 * float(path.work[-1])
    assert off[1] < 1e-3
    assert off[0] / off[1] > 3.5  # of trapezoids


PRONY_FOLDS = {"fold_law": fd.Prony(2.0, 0.2, law="linear")}
LINEAR_FOLDS = {"fold_law": "linear"}  # in series with their panels


@pytest.mark.parametrize(
    ("part", "laws", "damping"),
    [
        (lambda h: fd.Force([0, 1], (2e-3, 0, 0), h), PRONY_FOLDS, None),
        (lambda h: fd.Impose([0, 1], "x", 0.05, h), PRONY_FOLDS, None),
        (lambda h: fd.Actuate("all", 140.0, h), PRONY_FOLDS, None),
        (lambda h: fd.Force([0, 1], (2e-3, 0, 0), h), LINEAR_FOLDS, fd.CreaseDamping(0.01)),
    ],
    ids=["force", "imposed", "actuated", "dampers"],
)
def test_a_sheet_moves_as_in_a_slow_motion(part, laws, damping):
    """Of panels so light that nothing but the creases takes time, in the default model."""
    duration, n = 0.5, 50
    structure = fd.discretize(fd.patterns.simple_fold(dihedral=120), SHEET, **named(laws))
    cases = []
    for history in (fd.Constant(), fd.Ramp(duration)):
        held, given = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")], part(history)
        supports = [*held, given] if isinstance(given, fd.Impose) else held
        loads = [] if isinstance(given, fd.Impose) else [given]
        cases.append(fd.Case(structure, supports, loads, damping or fd.Rayleigh()))
    path = fd.trace(cases[0], "newton", steps=n, duration=duration / n)
    motion = fd.simulate(
        cases[1],
        duration,
        method="generalized_alpha",
        dt=duration / n,
        every_steps=n,
        spectral_radius=0.0,
    )
    elastic = fd.trace(cases[0], "newton", load_factors=[0.0, 1.0])
    end, moved, still = (r.displacement.values[-1] for r in (path, motion, elastic))
    scale = np.abs(moved).max()
    assert np.abs(end - moved).max() < 2e-3 * scale
    if isinstance(given, fd.Force):
        assert np.abs(end - still).max() > 0.1 * scale
    if damping is None:
        np.testing.assert_allclose(path.memory[-1], motion.memory[-1], atol=5e-3 * scale)


@pytest.mark.matrix
def test_steps_that_are_cut_take_their_shares_of_the_time():
    case, few = pressed(fd.Prony(0.7, 0.3, law="linear"), 7e-3), {"iterations": 4}
    path = fd.trace(case, load_factors=[0.0, 1.0, 1.0], duration=[1.0, 2.0], settings=few)
    assert path.attrs["step_cuts"] > 0
    np.testing.assert_allclose(path.elapsed, [0.0, 1.0, 3.0], rtol=1e-12)
    factors, steps = [*np.linspace(0, 1, 201), *[1.0] * 200], [5e-3] * 200 + [1e-2] * 200
    fine = fd.trace(case, load_factors=factors, duration=steps)
    assert opened(path)[-1] == pytest.approx(opened(fine)[-1], rel=5e-3)


@pytest.mark.matrix
def test_creep_buckling():
    """Under a load between the long-time limit and the instantaneous one it gives way in time.

    k (theta + g e) = F / cos^2 theta, e' = theta' - e / tau.
    """
    g, tau, force, n, dt = 0.7, 0.3, 1.1e-2, 400, 0.005
    case = pressed(fd.Prony(g, tau, law="linear"), force)
    with pytest.raises(ComputationError, match=r"load factor 1 after .* give way by creep") as stop:
        fd.trace(case, load_factors=[0.0] + [1.0] * (n + 1), duration=[0.0] + [dt] * n)
    path = stop.value.partial

    def slope(theta):
        return STIFFNESS * (1 + g) - 2 * force * np.tan(theta) / np.cos(theta) ** 2

    def rate(_, theta):
        spring = (force / np.cos(theta) ** 2 / STIFFNESS - theta) / g
        return STIFFNESS * g * spring / tau / slope(theta)

    t, theta = path.elapsed.values[1:], opened(path)[1:]
    (true,) = solve_ivp(rate, (0.0, t[-1]), theta[:1], t_eval=t, rtol=1e-9, atol=1e-12).y
    before = t < 0.98 * t[-1]
    assert 0.05 < t[-1] < n * dt
    np.testing.assert_allclose(theta[before], true[before], rtol=1e-3)
    assert 0.0 < slope(theta[-1]) < 0.1 * (1 + g) * STIFFNESS


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_critical_points_have_their_share_of_the_time():
    """A flat strip that is pressed buckles where its crease is as stiff as at this speed."""
    pattern, found = fd.patterns.simple_fold(dihedral=180), []
    supports = [fd.Fix([0, 1], "xyz"), fd.Fix([4, 5], "yz"), fd.Impose([4, 5], "x", -4e-5)]
    for ratio, duration in ((1e-9, 1e9), (2.0, 1e9), (2.0, 1.0), (2.0, 1e-9), (1e-9, 1e-9)):
        laws = {"fold_law": fd.Prony(ratio, 0.2, law="linear"), "crease_stiffness": 0.2}
        case = fd.Case(fd.discretize(pattern, SHEET, membrane="bars", **named(laws)), supports)
        path = fd.trace(case, "displacement", steps=2, duration=duration / 2)
        np.testing.assert_allclose(path.elapsed, duration * path.load_factor, rtol=1e-4)
        with pytest.raises(InputError, match="creases have relaxed in part"):
            fd.switch_branch(path)
        found.append(float(path.load_factor[path.point == "bifurcation"][0]))
    relaxed, slow, between, fast, elastic = found
    assert [slow, elastic] == pytest.approx([relaxed, relaxed], rel=1e-6)
    assert 1.01 * slow < between < 0.999 * fast


def test_a_fold_creeps_until_a_plane_carries_its_load():
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=120)
    sheet, law = fd.Sheet(1e9, 0.25, 1e-3, 800.0), fd.Eyring(1e-3, 1e-2)
    ground = fd.Plane((0, 0, pattern.vertices[:, 2].min() - 2e-3), (0, 0, 1))
    case = fd.Case(
        fd.discretize(pattern, sheet, fold_law=law, preset="plate"), [fd.Fix([0, 1, 2, 3], "xyz")],
        [fd.Force([4, 5], (0, 0, -0.02))], contact=fd.Contact(planes=[ground]),
    )  # fmt: skip
    path = fd.trace(case, load_factors=[0.0] + [1.0] * 12, duration=[0.0] + [0.1] * 11)
    force = path.contact_force.values.sum(axis=1)
    assert (np.diff(force) >= -1e-9).all()
    assert force[1] < 0.01
    assert force[-1] == pytest.approx(0.04, rel=1e-5)


def test_a_timed_path_goes_on_from_a_stored_point():
    law = CREEP
    factors, times = [0.0, 0.5, 1.0, 1.0], [0.3, 0.2, 4.0]
    whole = fd.trace(moved(law, 0.3), load_factors=factors, duration=times)
    state = fd.initial_state(whole, 1)
    again = fd.trace(moved(law, 0.3), load_factors=factors[1:], duration=times[1:], initial=state)
    np.testing.assert_allclose(moment(again), moment(whole)[1:], rtol=1e-9)
    np.testing.assert_allclose(again.elapsed, whole.elapsed[1:] - whole.elapsed[1], rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"method": "arc_length", "duration": 1.0},
            r"duration: method 'arc_length' finds its load",
        ),
        ({"steps": 3, "duration": [1.0, 2.0]}, r"duration = \[1.0, 2.0\].*each of the 3 steps"),
        ({"steps": 3, "duration": -1.0}, r"duration = -1.0: give one time \(s\), at least 0"),
        ({"load_factors": [0, 1, 1]}, "load_factors: number 2 repeats .*needs a duration"),
        ({"load_factors": [0, 1, 1], "duration": [1, 0]}, "number 2 repeats"),
        ({"case": moved(CREEP, 0.3)}, r"'eyring': creep goes on for ever.*fd.trace a duration"),
    ],
)
def test_times_that_mean_nothing_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        fd.trace(**{"case": moved(PRONY, 0.3), **arguments})
