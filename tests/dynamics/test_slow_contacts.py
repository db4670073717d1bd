"""Contacts that press but hardly move get inertia, so that steps need not resolve them."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from contact_cases import tower
from long_cases import killed_and_resumed, look_often, same
from scipy.sparse import csr_array

import foldyn as fd
from contact_sheets import SHEET, crossing, on_a_panel
from foldyn.dynamics import prepare
from foldyn.dynamics.equation import EquationOfMotion
from foldyn.dynamics.explicit_contact import slow_contacts, slow_down
from foldyn.dynamics.motion_state import TALLY, MotionState
from foldyn.dynamics.system import pack, scratch
from foldyn.jit.context import Context
from foldyn.mechanics.contact.inertia import added_inertia, room_for
from foldyn.mechanics.contact.step_limit import Pace, limited
from foldyn.mechanics.contact.term import ContactTerm

DT, ALPHA = 1e-2, 30.0
HALF = 0.5 * SHEET.thickness
DEPTH = 0.98 * HALF


def curvature(x):
    """f'' of (1 - x)^3 / x^4."""
    return 20 * (1 - x) ** 3 / x**6 + 24 * (1 - x) ** 2 / x**5 + 6 * (1 - x) / x**4


def pressed(mass: str):
    """A packed case in which a strip lies on a panel and a corner on the ground."""
    s = fd.discretize(on_a_panel()[0].pattern, SHEET, fold_law="linear", mass=mass, preset="plate")
    contact = fd.Contact(planes=[fd.Plane((0, 0, -DEPTH), (0.0, 0.0, 1.0))])
    return pack(fd.Case(s, damping=fd.Rayleigh(alpha=ALPHA), contact=contact), 1e-4)


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["centroid", "consistent"])
def test_accelerations_are_those_of_the_mass_with_the_inertia_of_contacts(mass):
    packed = pressed(mass)
    body, system, order = packed.body, packed.system, packed.numbering.order
    u = np.zeros((len(order), 3))
    contact = body.find(ContactTerm)
    contact.contact(u)
    kept, counts = contact.memory, []
    added = room_for(contact.tables, kept)
    for resolved in (0.0, DT, 0.0):
        kept.facts.resolved = resolved
        added_inertia(contact.tables, added, u, DT, 0.7, system.lightness, kept)
        counts.append(int(added.count[0]))
    count = counts[0]
    assert counts == [count, 0, count] and count > len(contact.tables.meeting) - 8
    assert kept.counts.near_first + kept.counts.near_second > 0
    nodes, gradient = added.nodes[:count], added.gradient[:count]
    rows = np.zeros((count, len(u), 3))
    np.add.at(rows, (np.arange(count)[:, None], nodes), gradient)
    rows = rows.reshape(count, -1)
    # a tau of two steps, and the stiffness of contact: here of corners on the ground
    stiffness = 1.0 / (4.0 * DT**2 * added.ease[:count])
    grounded = stiffness[nodes[:, 0] == nodes[:, 1]]
    own = contact.tables.stiffness * curvature(DEPTH / HALF)
    assert len(grounded) == 5 and grounded == pytest.approx(own, rel=1e-9)
    rng = np.random.default_rng(0)
    before, w = rng.standard_normal((2, *u.shape))
    a = before.copy()
    state = MotionState(u, np.zeros_like(u), np.zeros_like(u), np.zeros(1, TALLY)[0], np.zeros(0))
    part, own = body.thread_parts(1)[0], scratch(system)
    equation = EquationOfMotion(packed, part, own, state, True)
    slow = slow_contacts(packed, part, equation.case.value)
    assert slow is not None
    slow_down(Context(slow.value._replace(added=added)), w, a)
    nodal = packed.mass
    m = np.kron(csr_array((nodal.data, nodal.indices, nodal.indptr)).toarray(), np.eye(3))
    whole = m + rows.T @ (rows / added.ease[:count, None])
    expected = np.linalg.solve(whole, m @ (before + ALPHA * w).ravel()) - ALPHA * w.ravel()
    np.testing.assert_allclose(a.ravel(), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert np.abs(a - before).max() > 0.1
    # what panels do to each other changes neither momentum
    push = rows[(nodes[:, 0] != nodes[:, 1]).nonzero()[0]].reshape(-1, len(u), 3)
    assert np.abs(push.sum(axis=1)).max() < 1e-12
    assert np.abs(np.cross(contact.tables.rest, push).sum(axis=1)).max() < 1e-12


def test_a_tower_that_is_pressed_flat_takes_few_steps():
    """It snaps shut under 38 N on each node and stays so; its vibrations die within some 10 ms.

    With steps that resolve each contact everywhere (beta = 0.25) it took 284,675 of them, and its
    top came down by 59.4141 mm. How the panels come to lie depends on their rattling: heights of
    0.585 and 0.586 mm are both equilibria.
    """
    pytest.importorskip("ipctk")
    case = tower(38.0, fd.Contact(), fd.Ramp(0.02, smooth=True), alpha=1000.0)
    run = fd.simulate(case, 0.1, method="auto", interval=1e-3)
    u = run.displacement.values
    assert run.attrs["method"] == "dormand_prince"
    assert run.attrs["steps"] < 284_675 / 10
    assert run.attrs["energy_error"] < 1e-4
    assert crossing(case.structure, u) == 0
    assert u[-1, 6:12, 2].mean() == pytest.approx(-59.4141e-3, rel=1e-4)
    assert float(run.contact[-1]) > 0.01  # its panels press on each other
    # what is at rest does not feel the inertia: supports carry the load
    assert np.abs(run.velocity.values[-1]).max() < 1e-4
    carried = run.reaction[-1, (run.support_axis == "z").values].sum()
    assert float(carried) == pytest.approx(6 * 38.0, rel=1e-4)


@pytest.mark.matrix
def test_a_tower_that_rattles_takes_few_steps_that_conserve():
    """It snaps shut, bounces and is pressed flat, while its panels rattle.

    It takes 1,501 steps, of 5 us in the mean; contact asks explicit methods for steps down to
    0.03 us. Numbers of steps of a rattling motion differ from processor to processor, hence the
    factor of two; and its top still shakes by 0.2 mm about where it will rest.
    """
    pytest.importorskip("ipctk")
    case = tower(38.0, fd.Contact(), fd.Ramp(0.002, smooth=True), alpha=2000.0)
    run = fd.simulate(case, 8e-3, method="energy_momentum", interval=5e-4)
    u = run.displacement.values
    assert run.attrs["steps"] < 2 * 1_501
    assert run.attrs["energy_error"] < 1e-9
    assert crossing(case.structure, u) == 0
    assert u[-1, 6:12, 2].mean() == pytest.approx(-59.4141e-3, abs=2e-4)
    assert float(run.contact[-1]) > 0.01


@pytest.mark.matrix
def test_steps_overrun_no_gap_where_they_resolve_no_contact():
    """Only the stiffness of what touches may be left unresolved, not how fast a gap closes."""
    packed = pressed("centroid")
    body, lightness = packed.body, packed.system.lightness
    u = np.zeros((len(packed.numbering.order), 3))
    contact = body.find(ContactTerm)
    contact.contact(u)
    v, a = 0.5 * np.random.default_rng(1).standard_normal((2, *u.shape))
    angle = body.angles(body.dofs(u))

    def longest(beta, energy):
        pace = Pace(beta, energy)
        return limited(contact.tables, u, v, a, angle, 1.0, pace, lightness, contact.memory)

    closing = longest(1e9, 0.0)
    assert longest(0.6, 1e9) == closing > 10.0 * longest(1e-3, 0.0)
    assert longest(1e-3, 1e-30) == longest(1e-3, 0.0)  # the energy is what they may have
    assert longest(1e-3, 0.0) < longest(1e-3, 1e-9) < longest(1e-3, 4e-9) < closing


@pytest.mark.matrix
def test_a_motion_with_slow_contacts_that_is_killed_goes_on_to_the_same_bits(monkeypatch, tmp_path):
    look_often(monkeypatch, 256)
    case = tower(38.0, fd.Contact(), fd.Ramp(0.005, smooth=True), alpha=2000.0)
    given = {"duration": 0.04, "method": "dormand_prince", "interval": 1e-3}
    once = prepare(case, **given)
    whole = once.run()
    assert once._engine._equations[0]._slow.value.added.count[0] > 0

    same(killed_and_resumed(partial(fd.simulate, case), tmp_path / "run.nc", **given), whole)
