"""Contact in implicit methods: collisions, a strip folded onto itself, friction, obstacles."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from contact_cases import G, folded_from_both_ends, on_slope, tower, two_sheets

import foldyn as fd
from contact_sheets import crossing, strip
from foldyn.checks import observed_order
from foldyn.errors import ComputationError, FoldynWarning
from foldyn.mechanics.contact import term

METHODS = ["newmark", "generalized_alpha"]


def thrown(method: str, duration: float = 0.02, stiffness: float | None = None, **options):
    """The upper one of two free sheets flies at the lower one with 2 m/s."""
    s, upper = two_sheets()
    v = np.zeros_like(s.nodes)
    v[upper, 2] = -2.0
    case = fd.Case(s, contact=fd.Contact(stiffness=stiffness))
    return s, fd.simulate(case, duration, method=method, initial=fd.State(velocity=v), **options)


@pytest.mark.parametrize("method", METHODS)
def test_colliding_sheets_keep_momentum_and_energy(method):
    pytest.importorskip("ipctk")
    s, run = thrown(method, every=1e-4)
    momentum = np.einsum("nm,tmc->tc", s.mass.toarray(), run.velocity.values)
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * np.abs(momentum[0]).max()
    assert run.attrs["energy_error"] < 3e-3  # its steps do not resolve what stiff bars do
    assert float(run.contact.max()) > 0.0 == float(run.contact[0])
    assert crossing(s, run.displacement.values) == 0


def conserved(structure: fd.Structure, run) -> dict[str, float]:
    """Largest changes of what a free motion keeps, over the largest value of it at the start."""
    p = np.einsum("nm,tmc->tnc", structure.mass.toarray(), run.velocity.values)
    x = structure.nodes + run.displacement.values
    energies = ("kinetic", "strain_bars", "strain_folds", "strain_bends", "contact")
    energy = sum(run[name].values for name in energies)
    kept = {"momentum": p.sum(axis=1), "turning": np.cross(x, p).sum(axis=1), "energy": energy}
    return {k: np.abs(v - v[0]).max() / np.abs(v[0]).max() for k, v in kept.items()}


@pytest.mark.matrix
@pytest.mark.parametrize("options", [{"dt": 1e-4, "every": 1}, {"tolerance": 1e-3, "every": 1e-4}])
def test_the_conserving_method_keeps_all_in_a_collision(options):
    """With steps that do not resolve what bars do, fixed or not: energy and both momenta."""
    pytest.importorskip("ipctk")
    s, run = thrown("energy_momentum", **options)
    found = conserved(s, run)
    assert found["momentum"] < 1e-13 and found["turning"] < 1e-11 and found["energy"] < 1e-10
    assert run.attrs["energy_error"] < 1e-10
    assert float(run.contact.max()) > 1e-6 > float(run.contact[0])
    assert crossing(s, run.displacement.values) == 0


@pytest.mark.matrix
@pytest.mark.parametrize("method", [*METHODS, "energy_momentum"])
def test_a_rebound_converges_with_order_two(method):
    """Of displacements, which steps resolve that are far above the period of a bar."""
    counts = np.array([200, 400, 1600])
    runs = [thrown(method, 2e-3, 300.0, dt=2e-3 / n, every=int(n))[1] for n in counts]
    *ends, best = [run.displacement.values[-1] for run in runs]
    errors = [np.abs(end - best).max() for end in ends]
    assert observed_order(1.0 / counts[:2], errors) > 1.9
    upper = two_sheets()[1]
    assert abs(runs[-1].velocity.values[-1, upper, 2].mean()) < 1.95  # it has been slowed down


def test_a_strip_folded_from_both_ends_stops_where_it_touches():
    pytest.importorskip("ipctk")
    case = folded_from_both_ends(fd.Contact())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # of the energy that the impact takes
        run = fd.simulate(case, 0.35, method="generalized_alpha", dt=5e-5, every=2e-3)
    assert crossing(case.structure, run.displacement.values) == 0
    angles = np.degrees(case.structure.dihedrals(run.displacement.values[-1])[0])
    assert angles.max() > 25.0  # the panel that lies above rests on the other one
    assert run.attrs["energy_error"] < 0.05
    assert run.attrs["contact_lists"] > 1


@pytest.mark.matrix
def test_a_conserving_strip_loses_no_energy_where_it_touches():
    """The same with actuators, damping, guards of hinges and friction, also on a plane beneath."""
    pytest.importorskip("ipctk")
    plane = fd.Plane((0, 0, -0.2e-3), (0, 0, 1))
    case = fd.Case(
        strip(), [fd.Fix(nodes=[2, 3])], [fd.Actuate([0, 1], 8.0, fd.Ramp(0.05))],
        fd.Rayleigh(alpha=20.0), contact=fd.Contact(friction=0.3, planes=[plane]),
    )  # fmt: skip
    run = fd.simulate(case, 0.075, method="energy_momentum", dt=1e-4, every=1e-3)
    assert crossing(case.structure, run.displacement.values) == 0
    assert float(run.contact.max()) > 0.0
    assert run.attrs["energy_error"] < 1e-9


def met(dt: float):
    """Energy error of a collision in few steps, and the speed of the sheet that was at rest."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # so few steps do not resolve an impact
        run = thrown("newmark", 0.012, dt=dt, every=1)[1]
    lower = ~two_sheets()[1]
    return run.attrs, np.abs(run.velocity.values[-1, lower, 2]).max()


def test_no_step_is_too_long_to_see_what_is_in_its_way(monkeypatch):
    """In a step of 2 ms a sheet flies by more than its distance from another one."""
    facts, speed = met(2e-3)
    assert speed > 0.5 and facts["halved_steps"] > 0
    monkeypatch.setattr(term, "clear_share", lambda *given: 1.0)
    facts, speed = met(2e-3)
    assert speed == 0.0 and facts["energy_error"] < 1e-9  # through it, without a trace


@pytest.mark.matrix
def test_an_impact_too_violent_for_the_step_is_told():
    """A snap at some m/s, with a step that is far too long for it."""
    with pytest.raises(ComputationError, match=r"use a step below|no equilibrium was found"):
        fd.simulate(
            tower(80.0, fd.Contact()), 0.03, method="generalized_alpha", dt=2e-5, every=1e-4
        )


def test_a_sheet_slides_above_the_angle_of_friction():
    """A slope of 20 degrees; friction of 0.3 holds up to 16.7."""
    case, a = on_slope(20.0, 0.3), np.radians(20.0)
    expected = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * 0.1**2
    off = []
    for dt in (2e-4, 1e-4):
        run = fd.simulate(case, 0.1, method="generalized_alpha", dt=dt, every=2e-3)
        distance = run.displacement.values[-1, :, 0].mean()
        off.append(abs(distance / expected - 1.0))
    assert off[0] < 0.02 and off[1] < 0.6 * off[0]  # the normal force lags by a step
    taken = 0.3 * case.total_mass * G * np.cos(a) * distance
    assert float(run.dissipated[-1]) == pytest.approx(taken, rel=0.01)
    assert run.attrs["energy_error"] < 1e-3


def test_the_conserving_method_slides_and_takes_exactly_what_friction_does():
    """As above; all that the plane takes is counted."""
    case, a = on_slope(20.0, 0.3), np.radians(20.0)
    expected = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * 0.1**2
    run = fd.simulate(case, 0.1, method="energy_momentum", dt=1e-4, every=2e-3)
    distance = run.displacement.values[-1, :, 0].mean()
    assert distance == pytest.approx(expected, rel=0.02)
    taken = 0.3 * case.total_mass * G * np.cos(a) * distance
    assert float(run.dissipated[-1]) == pytest.approx(taken, rel=0.01)
    assert run.attrs["energy_error"] < 1e-9


@pytest.mark.parametrize("options", [{"dt": 2e-4}, {}])
def test_a_sheet_sticks_below_the_angle_of_friction(options):
    """A slope of 15 degrees: where it has come to rest it stays, for good."""
    case = on_slope(15.0, 0.3, alpha=200.0)
    run = fd.simulate(case, 0.2, method="generalized_alpha", every=2e-3, **options)
    along = run.displacement.values[:, :, 0].mean(axis=1)
    assert abs(along[-1] - along[60]) < 5e-12
    assert along[-1] < 1e-3 and run.attrs["energy_error"] < 1e-2


@pytest.mark.parametrize(
    ("method", "dt", "error"), [("generalized_alpha", 1e-5, 1e-3), ("energy_momentum", 4e-5, 1e-9)]
)
def test_a_moving_plane_does_the_work_that_it_gives(method, dt, error):
    plane = fd.Plane(
        (0, 0, -0.2e-3), (0, 0, 1), friction=0.2, motion=(0, 0, 2e-3),
        history=fd.Ramp(0.01, smooth=True),
    )  # fmt: skip
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane]))
    run = fd.simulate(case, 0.02, method=method, dt=dt, every=2e-4)
    assert float(run.work[-1]) > 0.0
    assert run.attrs["energy_error"] < error
    assert run.displacement.values[-1, :, 2].min() > 2e-3 - 0.2e-3  # it flies ahead of the plane


def test_nodes_make_way_for_a_plane_that_hits_them():
    """A plane that hits a sheet at rest: within a step it comes through where the sheet was."""
    plane = fd.Plane(
        (0, 0, -2e-3), (0, 0, 1), motion=(0, 0, 6e-3), history=fd.Ramp(2e-3),
    )  # fmt: skip
    case = fd.Case(strip(2), contact=fd.Contact(planes=[plane]))
    with pytest.warns(FoldynWarning, match="energy balance"):  # an impact in very few steps
        run = fd.simulate(case, 4e-3, method="newmark", dt=2e-4, every=1)
    height = (case.structure.nodes + run.displacement.values)[:, :, 2].min(axis=1)
    reached = -2e-3 + 6e-3 * np.minimum(run.time.values / 2e-3, 1.0)
    assert (height > reached).all()


def test_supports_that_move_press_panels_together():
    pytest.importorskip("ipctk")
    s = fd.discretize(fd.patterns.simple_fold(a=0.04, b=0.05, dihedral=40), strip().sheet)
    width = float(np.ptp(s.nodes[:, 0]))
    close = fd.Impose([4, 5], "x", -0.995 * width, fd.Ramp(0.02, smooth=True))
    case = fd.Case(
        s, [fd.Fix([0, 1]), close, fd.Fix([4, 5], "yz")], damping=fd.Rayleigh(alpha=200.0),
        contact=fd.Contact(),
    )  # fmt: skip
    run = fd.simulate(case, 0.03, method="generalized_alpha", dt=1e-4, every=1e-3)
    assert crossing(s, run.displacement.values) == 0
    assert float(run.contact[-1]) > 0.0
