"""Motions with contact: collisions, sheets folded onto themselves, a snap, friction, obstacles."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
import pytest
from contact_cases import G, folded_from_both_ends, on_slope, tower, two_sheets
from measured import drift, energy, momenta, order
from moving_sheets import EXPLICIT

import foldyn as fd
from contact_sheets import SHEET, crossing, on_a_panel, strip
from foldyn.dynamics import METHODS, driver, equation
from foldyn.dynamics.explicit_contact import contact_parts
from foldyn.errors import ComputationError, FoldynWarning, InputError, PenetrationError
from foldyn.mechanics.contact import term
from foldyn.viewer.states import fields
from pairwise import beyond

ALPHA, CONSERVING = "generalized_alpha", "energy_momentum"


@cache
def thrown(method, duration=0.02, stiffness=None, friction=0.0, speed=(0.0, 0.0, -2.0), **options):
    """The upper one of two free sheets flies at the lower one."""
    s, upper = two_sheets()
    start = fd.State(velocity=np.outer(upper, speed))
    case = fd.Case(s, contact=fd.Contact(stiffness=stiffness, friction=friction))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # few steps do not resolve an impact
        sampled = {} if "every_steps" in options else {"interval": 1e-4}
        return s, fd.simulate(case, duration, method=method, initial=start, **sampled | options)


@pytest.mark.parametrize(
    ("method", "turning", "error"),
    [
        ("rk4", 1e-8, 1e-4),  # Runge-Kutta methods keep no quadratic invariants but in their error
        ("central_difference", 1e-12, 1e-3),
        ("dormand_prince", 1e-8, 1e-4),
        ("newmark", 1.0, 3e-3),  # their steps do not resolve what stiff bars do
        (ALPHA, 1.0, 3e-3),
    ],
)
def test_colliding_sheets_keep_momentum_and_energy(method, turning, error):
    """The error of explicit methods is that of half the critical step, which contact shortens."""
    pytest.importorskip("ipctk")
    s, run = thrown(method)
    linear, angular = map(drift, momenta(s, run))
    assert linear < 1e-12 and angular < turning and run.attrs["energy_error"] < error
    assert float(run.contact.max()) > 0.0 == float(run.contact[0])
    assert crossing(s, run.displacement.values) == 0
    assert run.velocity[-1, 6, 2] > -1.9  # it has been slowed down


@pytest.mark.matrix
@pytest.mark.parametrize("options", [{"dt": 1e-4, "every_steps": 1}, {"tolerance": 1e-3}])
def test_the_conserving_method_keeps_all_in_a_collision(options):
    """With steps that do not resolve what bars do, fixed or not: energy and both momenta."""
    pytest.importorskip("ipctk")
    s, run = thrown(CONSERVING, **options)
    linear, angular = map(drift, momenta(s, run))
    assert linear < 1e-13 and angular < 1e-11 and drift(energy(run)) < 1e-10
    assert run.attrs["energy_error"] < 1e-10
    assert float(run.contact.max()) > 1e-6 > float(run.contact[0])
    assert crossing(s, run.displacement.values) == 0


# of what steps resolve: the velocities of explicit methods, the displacements of implicit ones
REBOUNDS = [
    ("rk4", [1600, 3200], 12800, 3.9),
    ("central_difference", [1600, 3200, 6400], 25600, 1.9),
    *beyond([(method, [200, 400], 1600, 1.9) for method in ("newmark", ALPHA, CONSERVING)], 2),
]


@pytest.mark.matrix
@pytest.mark.parametrize(("method", "counts", "fine", "least"), REBOUNDS)
def test_a_rebound_converges_with_the_order_of_the_method(method, counts, fine, least):
    explicit = method in EXPLICIT

    def rebound(n, method=method):
        run = thrown(method, 2e-3, 300.0, dt=2e-3 / n, every_steps=n)[1]
        return run, run["velocity" if explicit else "displacement"].values[-1]

    run, best = rebound(fine, "rk4" if explicit else method)
    assert order(counts, [np.abs(rebound(n)[1] - best).max() for n in counts]) > least
    assert abs(run.velocity.values[-1, two_sheets()[1], 2].mean()) < 1.95


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("method", "options"),
    [*((method, {}) for method in EXPLICIT), *beyond([(ALPHA, {"dt": 5e-5})])],
)
def test_a_strip_folded_from_both_ends_stops_where_it_touches(method, options):
    pytest.importorskip("ipctk")
    case = folded_from_both_ends(fd.Contact())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # of the energy that the impact takes
        run = fd.simulate(case, 0.28, method=method, interval=2e-3, **options)
    assert crossing(case.structure, run.displacement.values) == 0
    angles = np.degrees(case.structure.dihedrals(run.displacement.values[-1])[0])
    assert angles.max() > 25.0  # the panel that lies above rests on the other one
    assert float(run.contact.max()) > 0.0 and run.attrs["contact_lists"] > 1
    assert method in EXPLICIT or run.attrs["energy_error"] < 0.05


@pytest.mark.matrix
def test_a_conserving_strip_loses_no_energy_where_it_touches():
    """The same with actuators, damping, guards of hinges and friction, also on a plane beneath."""
    pytest.importorskip("ipctk")
    contact = fd.Contact(friction=0.3, planes=[fd.Plane((0, 0, -0.2e-3), (0, 0, 1))])
    fold = fd.Actuate([0, 1], 8.0, fd.Ramp(0.05))
    case = fd.Case(strip(), [fd.Fix([2, 3])], [fold], fd.Rayleigh(alpha=20.0), contact=contact)
    run = fd.simulate(case, 0.075, method=CONSERVING, dt=1e-4, interval=1e-3)
    assert crossing(case.structure, run.displacement.values) == 0
    assert float(run.contact.max()) > 0.0
    assert run.attrs["energy_error"] < 1e-9


@pytest.mark.matrix
def test_it_crosses_itself_without_contact_or_without_the_limit_of_steps(monkeypatch):
    pytest.importorskip("ipctk")
    case = folded_from_both_ends(None)
    with pytest.raises(PenetrationError) as passed:
        fd.simulate(case, 0.35, method="rk4", interval=2e-3)
    assert crossing(case.structure, passed.value.partial.displacement.values) > 0

    # the tower is where it matters: impacts at some m/s
    def unlimited(case, limited, slow):
        return contact_parts(case, False, slow)

    with monkeypatch.context() as patch:
        patch.setattr(equation, "contact_parts", unlimited)
        hit = tower(80.0, fd.Contact())
        motion = driver.prepare(hit, 0.03, method="central_difference", interval=1e-4)
        with pytest.raises(ComputationError):
            motion.run()


@pytest.mark.matrix
def test_no_step_is_too_long_to_see_what_is_in_its_way(monkeypatch):
    """In a step of 2 ms a sheet flies by more than its distance from another one."""
    lower = ~two_sheets()[1]

    def met():
        thrown.cache_clear()
        run = thrown("newmark", 0.012, dt=2e-3, every_steps=1)[1]
        return run.attrs, np.abs(run.velocity.values[-1, lower, 2]).max()

    facts, speed = met()
    assert speed > 0.5 and facts["halved_steps"] > 0
    monkeypatch.setattr(term, "clear_share", lambda *given: 1.0)
    facts, speed = met()
    assert speed == 0.0 and facts["energy_error"] < 1e-9  # through it, without a trace
    thrown.cache_clear()


@pytest.mark.matrix
def test_an_impact_too_violent_for_the_step_is_told():
    """A snap at some m/s, with a step that is far too long for it."""
    with pytest.raises(ComputationError, match=r"use a step below|no equilibrium was found"):
        fd.simulate(tower(80.0, fd.Contact()), 0.03, method=ALPHA, dt=1e-4, interval=1e-4)


@pytest.mark.matrix
@pytest.mark.parametrize("force", [80.0, *beyond([38.0, 50.0])])
def test_the_tower_snaps_bounces_and_rests(force):
    pytest.importorskip("ipctk")
    case = tower(force, fd.Contact())
    run = fd.simulate(
        case, 0.16, method="auto", interval=2e-4
    )  # fewer samples may miss its closing
    assert run.attrs["method"] == "dormand_prince"
    height = 0.06 + run.displacement.values[:, 6:12, 2].mean(axis=1)
    assert height.min() < 0.01  # it nearly closes
    stable = np.array([0.0288, 0.06])  # as statics finds them
    assert np.abs(height[-1] - stable).min() < 2e-4
    assert crossing(case.structure, run.displacement.values) == 0
    assert run.attrs["energy_error"] < 1e-4


def leaning(kind: str, angle: float, alpha: float = 0.0) -> tuple[fd.Case, list[int]]:
    """A strip on a plane, or turned a little on a panel, that leans by some degrees; its nodes."""
    if kind == "plane":
        case = on_slope(angle, 0.3, alpha)
        return case, list(range(len(case.structure.nodes)))
    s, strip = on_a_panel(shift=(0.013, 0.007), turn=0.3)
    a = np.radians(angle)
    held = fd.Fix(np.setdiff1d(np.arange(len(s.nodes)), strip))
    gravity, contact = fd.Gravity((G * np.sin(a), 0, -G * np.cos(a))), fd.Contact(friction=0.3)
    return fd.Case(s, [held], [gravity], fd.Rayleigh(alpha=alpha), contact=contact), strip


def slid(case: fd.Case, strip: list[int], run) -> tuple[np.ndarray, float]:
    """How far the strip's center of mass has gone along the slope, m, and its mass, kg."""
    mass = case.structure.mass.toarray()[np.ix_(strip, strip)].sum(axis=1)
    return run.displacement.values[:, strip, 0] @ mass / mass.sum(), mass.sum()


RUBBING = [
    ("panel", method, 0.15, 1e-4 if METHODS[method].implicit else None, 0.02, 0.03, 1e-2)
    for method in METHODS
    if method != "newmark"
]


SLIDING = [
    ("plane", "rk4", 0.2, None, 0.02, 0.03, 1e-2),
    ("plane", ALPHA, 0.1, 2e-4, 0.02, 0.01, 1e-3),
    ("plane", ALPHA, 0.1, 1e-4, 0.01, 0.01, 1e-3),  # the normal force lags by a step
    ("plane", CONSERVING, 0.1, 1e-4, 0.02, 0.01, 1e-9),  # all that is taken is counted
]


@pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
@pytest.mark.parametrize(
    ("kind", "method", "duration", "dt", "near", "lost", "error"),
    [*beyond(SLIDING, 3), *beyond(RUBBING, 3)],
)
def test_a_strip_slides_above_the_angle_of_friction(kind, method, duration, dt, near, lost, error):
    """A slope of 20 degrees; friction of 0.3 holds up to 16.7. On a panel it passes inner sides."""
    (case, strip), a = leaning(kind, 20.0), np.radians(20.0)
    run = fd.simulate(case, duration, method=method, dt=dt, interval=2e-3)
    way, mass = slid(case, strip, run)
    expected = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * duration**2
    assert way[-1] == pytest.approx(expected, rel=near)
    taken = 0.3 * mass * G * np.cos(a) * way[-1]
    assert float(run.dissipated[-1]) == pytest.approx(taken, rel=lost)
    assert run.attrs["energy_error"] < error


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
@pytest.mark.parametrize(
    ("kind", "method", "duration", "dt", "still", "most"),
    [
        ("plane", "rk4", 0.25, None, 1e-9, 1e-3),
        ("plane", ALPHA, 0.2, 2e-4, 5e-12, 1e-3),
        ("plane", ALPHA, 0.2, None, 5e-12, 1e-3),
        *beyond([("panel", method, 0.17, dt, 1e-11, 1e-5) for _, method, _, dt, *_ in RUBBING], 2),
    ],
)
def test_a_strip_sticks_below_the_angle_of_friction(kind, method, duration, dt, still, most):
    """A slope of 15 degrees: where it has come to rest it stays, for good."""
    case, strip = leaning(kind, 15.0, alpha=200.0)
    run = fd.simulate(case, duration, method=method, dt=dt, interval=2e-3)
    way = slid(case, strip, run)[0]
    assert abs(way[-1] - way[int(0.6 * len(way))]) < still
    assert 0.0 < way[-1] < most and run.attrs["energy_error"] < 1e-2


@pytest.mark.matrix
def test_without_friction_a_sheet_slides_as_it_falls():
    run = fd.simulate(on_slope(20.0, 0.0), 0.1, method="rk4", interval=2e-3)
    distance = run.displacement.values[-1, :, 0].mean()
    assert distance == pytest.approx(0.5 * G * np.sin(np.radians(20.0)) * 0.01, rel=1e-9)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("method", "dt", "error"), [("rk4", None, 1e-3), (ALPHA, 1e-5, 1e-3), (CONSERVING, 4e-5, 1e-9)]
)
def test_a_moving_plane_does_the_work_that_it_gives(method, dt, error):
    up = fd.Ramp(0.01, smooth=True)
    plane = fd.Plane((0, 0, -0.2e-3), (0, 0, 1), friction=0.2, motion=(0, 0, 2e-3), history=up)
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane]))
    run = fd.simulate(case, 0.02, method=method, dt=dt, interval=2e-4)
    assert float(run.work[-1]) > 0.0
    assert run.attrs["energy_error"] < error
    assert run.displacement.values[-1, :, 2].min() > 2e-3 - 0.2e-3  # it flies ahead of the plane


def test_nodes_make_way_for_a_plane_that_hits_them():
    """A plane that hits a sheet at rest: within a step it comes through where the sheet was."""
    plane = fd.Plane((0, 0, -2e-3), (0, 0, 1), motion=(0, 0, 6e-3), history=fd.Ramp(2e-3))
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane]))
    with pytest.warns(FoldynWarning, match="energy balance"):  # an impact in very few steps
        run = fd.simulate(case, 4e-3, method="newmark", dt=2e-4, every_steps=1)
    height = (case.structure.nodes + run.displacement.values)[:, :, 2].min(axis=1)
    assert (height > -2e-3 + 6e-3 * np.minimum(run.time.values / 2e-3, 1.0)).all()


@pytest.mark.matrix
def test_supports_that_move_press_panels_together():
    pytest.importorskip("ipctk")
    s = fd.discretize(fd.patterns.simple_fold(a=0.04, b=0.05, dihedral=40), SHEET, preset="plate")
    close = fd.Impose([4, 5], "x", -0.995 * np.ptp(s.nodes[:, 0]), fd.Ramp(0.02, smooth=True))
    supports = [fd.Fix([0, 1]), close, fd.Fix([4, 5], "yz")]
    case = fd.Case(s, supports, damping=fd.Rayleigh(alpha=200.0), contact=fd.Contact())
    run = fd.simulate(case, 0.03, method=ALPHA, dt=1e-4, interval=1e-3)
    assert crossing(s, run.displacement.values) == 0
    assert float(run.contact[-1]) > 0.0


def test_a_start_behind_a_plane_or_inside_each_other_is_refused():
    behind = fd.Contact(planes=[fd.Plane((0, 0, 1e-3), (0, 0, 1))])
    with pytest.raises(InputError, match=r"contact.planes\[0\]: node 0 is 0.001 m behind"):
        fd.simulate(fd.Case(strip(), contact=behind), 0.01, method="rk4")
    folded = fd.patterns.simple_fold(a=0.02, b=0.02, dihedral=1.0)
    case = fd.Case(
        fd.discretize(folded, SHEET, fold_law="linear", preset="plate"), contact=fd.Contact()
    )
    with pytest.warns(FoldynWarning, match="nearer to each other than the sheet is thick"):
        fd.simulate(case, 1e-4, method="rk4")


def test_samples_tell_where_a_sheet_touches():
    s, run = thrown("dormand_prince")
    force = run.contact_force
    assert force.dims == ("time", "node") and force.attrs["units"] == "N"
    touching = run.contact.values > 0.0
    assert (force.values.max(axis=1) > 0.0).tolist() == touching.tolist()
    shown = fields(fd.case_of(run), run, run.displacement.values)["contact"]
    assert shown.on == "node" and shown.values.shape == (len(run.time), len(s.nodes))


@pytest.mark.matrix  # compiles the loop with contact around laws with memory
def test_a_relaxing_fold_falls_on_a_plane_and_its_energies_balance():
    """Contact and memory together."""
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=90)
    ground = fd.Plane((0, 0, pattern.vertices[:, 2].min() - 1e-3), (0, 0, 1), friction=0.4)
    law = fd.Prony(ratios=[3.0], times=[0.01])
    s = fd.discretize(pattern, fd.Sheet(1e9, 0.25, 1e-3, 800.0), fold_law=law, preset="plate")
    weight, contact = fd.Gravity((0, 0, -G)), fd.Contact(planes=[ground])
    case = fd.Case(s, [], [weight], fd.Rayleigh(alpha=3.0), contact=contact)
    fallen = fd.simulate(case, 0.1, method="auto", interval=0.005)
    assert fallen.attrs["method"] == "dormand_prince"
    assert fallen.attrs["energy_error"] < 1e-4
    assert float(fallen.contact.max()) > 1e-7
    height = (fallen.rest_position + fallen.displacement).sel(axis="z").values - ground.point[2]
    assert 0.0 < height.min() < 0.5e-3  # within half the thickness, and not through
    without = fd.simulate(case.altered(contact=None), 0.005, method="rk4", interval=0.005)
    assert fallen.displacement.values[1] == pytest.approx(without.displacement.values[-1], abs=1e-9)


@pytest.mark.matrix
@pytest.mark.parametrize(("method", "dt"), [("dormand_prince", None), (CONSERVING, 1e-4)])
def test_sheets_that_collide_askew_keep_both_momenta_and_lose_what_friction_takes(method, dt):
    given, upper, across = {"speed": (1.0, 0.5, -2.0), "dt": dt}, two_sheets()[1], []
    for mu in (0.0, 0.5):
        s, run = thrown(method, friction=mu, **given)
        assert max(map(drift, momenta(s, run))) < 1e-7
        assert run.attrs["energy_error"] < 1e-4
        lost = float(run.dissipated[-1]) / float(run.kinetic[0])
        assert lost > 1e-3 if mu else abs(lost) < 1e-12
        across.append(run.velocity.values[-1][~upper, 0].mean())
    # friction takes the upper sheet's speed across, and gives it to the lower one
    assert across[1] > across[0] + 0.05


@pytest.mark.parametrize(("method", "dt"), [("rk4", None), ("dormand_prince", None), (ALPHA, 1e-5)])
def test_a_plane_that_would_jump_is_refused_by_name(method, dt):
    up = {"motion": (0, 0, 3e-3), "history": fd.Step(4e-3)}
    plane = fd.Plane((0, 0, -5e-3), (0, 0, 1), **up)
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane]))
    with pytest.raises(InputError, match=r"contact: a plane with the history step jumps .* 0.004"):
        fd.simulate(case, 0.01, method=method, dt=dt, interval=1e-3)


def test_steps_that_are_chosen_end_where_the_motion_of_a_plane_has_corners():
    """A press that comes down late, in a pulse much shorter than the steps before it."""
    down = fd.Table([0.0, 0.031, 0.0312, 0.0314, 1.0], [0.0, 0.0, 1.0, 0.0, 0.0])
    plane = fd.Plane((0, 0, 2e-3), (0, 0, -1), motion=(0, 0, -1e-3), history=down)
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane], panels=False))
    assert set(down.times[1:4]) <= set(driver.prepare(case, 0.05, "dormand_prince").plan.stops)
