"""Contacts that press but hardly move get inertia, so that steps need not resolve them."""

from __future__ import annotations

import numpy as np
import pytest
from contact_cases import tower

import foldyn as fd
from contact_sheets import SHEET, crossing, on_a_panel
from foldyn.dynamics.slow_contacts import slow_down
from foldyn.dynamics.system import pack, scratch
from foldyn.mechanics.contact.inertia import added_inertia

DT, ALPHA = 1e-4, 30.0


def pressed(mass: str):
    """A packed case in which a strip lies on a panel and a corner on the ground."""
    s = on_a_panel()[0]
    s = fd.discretize(s.pattern, SHEET, fold_law="linear", mass=mass)
    ground = fd.Plane((0, 0, -0.49 * SHEET.thickness), (0.0, 0.0, 1.0))
    contact = fd.Contact(planes=[ground])
    return pack(fd.Case(s, damping=fd.Rayleigh(alpha=ALPHA), contact=contact), 1e-4)


@pytest.mark.parametrize("mass", ["centroid", "consistent"])
def test_accelerations_are_those_of_the_mass_with_the_inertia_of_contacts(mass):
    packed = pressed(mass)
    body, system, order = packed.body, packed.system, packed.numbering.order
    u = np.zeros((len(order), 3))
    body.contact(u)
    kept = body._memory
    kept.facts.resolved = np.inf
    assert (
        len(added_inertia(body.tables, u, DT, 0.7, system.lightness, kept).ease) == 0
    )  # the step resolves all
    kept.facts.resolved = 0.0
    added = added_inertia(body.tables, u, DT, 0.7, system.lightness, kept)
    pairs = kept.counts.near_first + kept.counts.near_second
    assert len(added.ease) > len(body.tables.meeting) - 8 and pairs > 0
    rng = np.random.default_rng(0)
    before, w = rng.standard_normal((2, *u.shape))
    a = before.copy()
    slow_down(added, system, packed.mass, w, a, scratch(system))
    rows = np.zeros((len(added.ease), u.size))
    for row, nodes, gradient in zip(rows, added.nodes, added.gradient, strict=True):
        for node, slope in zip(nodes, gradient, strict=True):
            row[3 * node : 3 * node + 3] += slope
    nodal = packed.mass
    count = len(u)
    plain = np.zeros((count, count))
    for i in range(count):
        for k in range(nodal.indptr[i], nodal.indptr[i + 1]):
            plain[i, nodal.indices[k]] = nodal.data[k]
    m = np.kron(plain, np.eye(3))
    whole = m + rows.T @ (rows / added.ease[:, None])
    forced = (before + ALPHA * w).ravel()
    expected = np.linalg.solve(whole, m @ forced) - ALPHA * w.ravel()
    np.testing.assert_allclose(a.ravel(), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert np.abs(a - before).max() > 0.1
    # what panels do to each other changes neither momentum
    panels = (added.nodes[:, 0] != added.nodes[:, 1]).nonzero()[0]
    push = rows[panels].reshape(-1, count, 3)
    x = body.tables.rest
    assert np.abs(push.sum(axis=1)).max() < 1e-12
    assert np.abs(np.cross(x, push).sum(axis=1)).max() < 1e-12


def test_a_tower_that_is_pressed_flat_takes_few_steps():
    """It snaps shut under 38 N on each node and stays so; its vibrations die within some 10 ms.

    With steps that resolve each contact everywhere (beta = 0.25) it took 289,739 steps and ended
    at this height.
    """
    pytest.importorskip("ipctk")
    case = tower(38.0, fd.Contact(), fd.Ramp(0.02, smooth=True), alpha=1000.0)
    run = fd.simulate(case, 0.1, method="auto", every=1e-3)
    u = run.displacement.values
    assert run.attrs["method"] == "dormand_prince"
    assert run.attrs["steps"] < 289_739 / 10
    assert run.attrs["energy_error"] < 1e-3
    assert crossing(case.structure, u) == 0
    height = 0.06 + u[-1, 6:12, 2].mean()
    assert height == pytest.approx(0.58503143e-3, rel=1e-3)
    assert float(run.contact[-1]) > 0.01  # its panels press on each other
