"""Motions with contact: collisions, sheets folded onto themselves, a snap, friction, obstacles."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from contact_cases import (
    G,
    folded_from_both_ends,
    on_slope,
    tower,
    two_sheets,
    without_step_limit,
)

import foldyn as fd
from contact_sheets import SHEET, crossing, strip
from foldyn.checks import observed_order
from foldyn.errors import ComputationError, FoldynWarning, InputError, PenetrationError
from foldyn.viewer.fields import fields

EXPLICIT = ["rk4", "central_difference", "dormand_prince"]


def collided(method: str, **options):
    s, upper = two_sheets()
    v = np.zeros_like(s.nodes)
    v[upper, 2] = -2.0
    return s, fd.simulate(
        fd.Case(s, contact=fd.Contact()), 0.02, method=method, initial=fd.State(velocity=v),
        **{"every": 1e-4, **options},
    )  # fmt: skip


# the energy errors of steps of half the critical one, which the collision shortens
@pytest.mark.parametrize(
    ("method", "accuracy"), [("rk4", 1e-4), ("central_difference", 1e-3), ("dormand_prince", 1e-4)]
)
def test_colliding_sheets_keep_momentum_and_energy(method, accuracy):
    s, run = collided(method)
    v, x = run.velocity.values, s.nodes + run.displacement.values
    momentum = np.einsum("nm,tmc->tnc", s.mass.toarray(), v)
    linear, angular = momentum.sum(axis=1), np.cross(x, momentum).sum(axis=1)
    # Runge-Kutta methods keep no quadratic invariants but within their error
    exact = 1e-12 if method == "central_difference" else 1e-8
    for total, accurate in ((linear, 1e-12), (angular, exact)):
        assert np.abs(total - total[0]).max() < accurate * np.abs(total[0]).max()
    assert run.attrs["energy_error"] < accuracy
    assert float(run.contact.max()) > 0.0 == float(run.contact[0])
    assert v[-1, 6, 2] > -1.9  # it has been slowed down


@pytest.mark.parametrize(("method", "order"), [("rk4", 3.9), ("central_difference", 1.9)])
def test_a_rebound_converges_with_the_order_of_the_method(method, order):
    s, upper = two_sheets()
    v = np.zeros_like(s.nodes)
    v[upper, 2] = -2.0
    case, start = fd.Case(s, contact=fd.Contact(stiffness=300.0)), fd.State(velocity=v)

    def rebound(steps, method=method):
        dt = 2e-3 / steps
        run = fd.simulate(case, 2e-3, method=method, dt=dt, every=steps, initial=start)
        return run.velocity.values[-1]

    fine = rebound(25600, "rk4")
    counts = np.array([1600, 3200, 6400])
    errors = [np.abs(rebound(count) - fine).max() for count in counts]
    assert observed_order(1.0 / counts, errors) > order
    assert np.abs(fine[upper, 2].mean()) < 1.95


@pytest.mark.parametrize("method", EXPLICIT)
def test_a_strip_folded_from_both_ends_stops_where_it_touches(method):
    pytest.importorskip("ipctk")
    case = folded_from_both_ends(fd.Contact())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # of the energy error of rk4 there
        run = fd.simulate(case, 0.35, method=method, every=2e-3)
    assert crossing(case.structure, run.displacement.values) == 0
    angles = np.degrees(case.structure.dihedrals(run.displacement.values[-1])[0])
    assert angles.max() > 25.0  # the panel that lies above rests on the other one
    assert float(run.contact.max()) > 0.0


def test_it_crosses_itself_without_contact_or_without_the_limit_of_steps(monkeypatch):
    pytest.importorskip("ipctk")
    case = folded_from_both_ends(None)
    with pytest.raises(PenetrationError) as passed:
        fd.simulate(case, 0.35, every=2e-3)
    assert crossing(case.structure, passed.value.partial.displacement.values) > 0
    # the tower is where it matters: impacts at some m/s
    hit = tower(80.0, fd.Contact())
    motion = without_step_limit(monkeypatch, hit, 0.03, method="central_difference", every=1e-4)
    with pytest.raises(ComputationError):
        motion.run()


@pytest.mark.parametrize("force", [38.0, 50.0, 80.0])
def test_the_tower_snaps_bounces_and_rests(force):
    pytest.importorskip("ipctk")
    case = tower(force, fd.Contact())
    run = fd.simulate(case, 0.25, method="auto", every=2e-4)  # fewer samples may miss its closing
    assert run.attrs["method"] == "dormand_prince"
    height = 0.06 + run.displacement.values[:, 6:12, 2].mean(axis=1)
    assert height.min() < 0.01  # it nearly closes
    stable = np.array([0.0288, 0.06])  # as statics finds them
    assert np.abs(height[-1] - stable).min() < 2e-4
    assert crossing(case.structure, run.displacement.values) == 0
    assert run.attrs["energy_error"] < 1e-4


def test_a_sheet_slides_above_the_angle_of_friction():
    """A slope of 20 degrees; friction of 0.3 holds up to 16.7."""
    case = on_slope(20.0, 0.3)
    run = fd.simulate(case, 0.2, every=2e-3)
    a, distance = np.radians(20.0), run.displacement.values[-1, :, 0].mean()
    expected = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * 0.2**2
    assert distance == pytest.approx(expected, rel=0.02)
    normal = case.total_mass * G * np.cos(a)
    assert float(run.dissipated[-1]) == pytest.approx(0.3 * normal * distance, rel=0.03)
    assert run.attrs["energy_error"] < 1e-2


def test_a_sheet_sticks_below_the_angle_of_friction():
    """A slope of 15 degrees: where it has come to rest it stays, for good."""
    run = fd.simulate(on_slope(15.0, 0.3, alpha=200.0), 0.4, every=2e-3)
    along = run.displacement.values[:, :, 0].mean(axis=1)
    assert abs(along[-1] - along[100]) < 1e-9
    assert along[-1] < 1e-3 and run.attrs["energy_error"] < 1e-2


def test_without_friction_a_sheet_slides_as_it_falls():
    run = fd.simulate(on_slope(20.0, 0.0), 0.1, every=2e-3)
    distance = run.displacement.values[-1, :, 0].mean()
    assert distance == pytest.approx(0.5 * G * np.sin(np.radians(20.0)) * 0.01, rel=1e-9)


def test_a_moving_plane_does_the_work_that_it_gives():
    s = strip(2)
    plane = fd.Plane(
        (0, 0, -0.2e-3), (0, 0, 1), friction=0.2, motion=(0, 0, 2e-3),
        history=fd.Ramp(0.01, smooth=True),
    )  # fmt: skip
    run = fd.simulate(fd.Case(s, contact=fd.Contact(planes=[plane])), 0.02, every=2e-4)
    assert float(run.work[-1]) > 0.0
    assert run.attrs["energy_error"] < 1e-3
    assert run.displacement.values[-1, :, 2].min() > 2e-3 - 0.2e-3  # it flies ahead of the plane


def test_a_start_behind_a_plane_or_inside_each_other_is_refused():
    s = strip()
    behind = fd.Contact(planes=[fd.Plane((0, 0, 1e-3), (0, 0, 1))])
    with pytest.raises(InputError, match=r"contact.planes\[0\]: node 0 is 0.001 m behind"):
        fd.simulate(fd.Case(s, contact=behind), 0.01)
    folded = fd.patterns.simple_fold(a=0.02, b=0.02, dihedral=1.0)
    case = fd.Case(fd.discretize(folded, SHEET, fold_law="linear"), contact=fd.Contact())
    with pytest.warns(FoldynWarning, match="nearer to each other than the sheet is thick"):
        fd.simulate(case, 1e-4)


def test_samples_tell_where_a_sheet_touches():
    s, run = collided("dormand_prince")
    force = run.contact_force
    assert force.dims == ("time", "node") and force.attrs["units"] == "N"
    touching = run.contact.values > 0.0
    assert (force.values.max(axis=1) > 0.0).tolist() == touching.tolist()
    case = fd.case_of(run)
    shown = fields(case, run, run.displacement.values)["contact"]
    assert shown.on == "node" and shown.values.shape == (len(run.time), len(s.nodes))


@pytest.mark.matrix  # compiles the loop with contact around laws with memory
def test_a_relaxing_fold_falls_on_a_plane_and_its_energies_balance():
    """Contact and memory together."""
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=90)
    ground = fd.Plane((0, 0, pattern.vertices[:, 2].min() - 1e-3), (0, 0, 1), friction=0.4)
    law = fd.Prony(ratios=[3.0], times=[0.01])
    s = fd.discretize(pattern, fd.Sheet(1e9, 0.25, 1e-3, 800.0), fold_law=law)
    case = fd.Case(
        s, [], [fd.Gravity((0, 0, -G))], fd.Rayleigh(alpha=3.0),
        contact=fd.Contact(planes=[ground]),
    )  # fmt: skip
    fallen = fd.simulate(case, 0.3, method="auto", every=0.005)
    assert fallen.attrs["method"] == "dormand_prince"
    assert fallen.attrs["energy_error"] < 1e-4
    assert float(fallen.contact.max()) > 1e-7
    height = (fallen.rest_position + fallen.displacement).sel(axis="z").values - ground.point[2]
    assert 0.0 < height.min() < 0.5e-3  # within half the thickness, and not through
    without = fd.simulate(case.altered(contact=None), 0.005, method="rk4", every=0.005)
    assert fallen.displacement.values[1] == pytest.approx(without.displacement.values[-1], abs=1e-9)
