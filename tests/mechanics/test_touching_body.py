"""A body with contact: lists of pairs, guards of hinges, planes, forces, tangents."""

from __future__ import annotations

import numpy as np
import pytest
from contact_samples import SHEET, T, miura, tables_of, touching

import foldyn as fd
from foldyn.checks import gradient_error, tangent_error
from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.contact_state import memory
from foldyn.mechanics.contact.distances import edge_gap, vertex_gap
from foldyn.mechanics.contact.hinge_guards import add_guards
from foldyn.mechanics.contact.search import edge_d0, list_pairs, panel_d0, place


@kernel
def every_pair(tables, x, skin):
    """Numbers of pairs of either kind nearer than d0 + skin, among all there are."""
    first, second = 0, 0
    for t in range(len(tables.triangles)):
        for v in tables.surface:
            d0 = panel_d0(tables.ranges, v, tables.panel[t])
            first += d0 > 0.0 and vertex_gap(x, tables.triangles, v, t) <= d0 + skin
    for i in range(len(tables.edges)):
        for j in range(i + 1, len(tables.edges)):
            d0 = edge_d0(tables.ranges, tables.edges, tables.edge_nodes, tables.edge_panels, i, j)
            second += d0 > 0.0 and edge_gap(x, tables.edges, i, j) <= d0 + skin
    return first, second


@pytest.mark.parametrize("seed", range(6))
def test_lists_hold_what_brute_force_finds(seed):
    rng = np.random.default_rng(seed)
    made = tables_of(miura(float(rng.uniform(2, 25)), cells=3))
    made = made._replace(skin=float(rng.uniform(0.1, 0.4)) * 0.02)
    u, kept = 1e-3 * rng.standard_normal(made.rest.shape), memory(made)
    place(made, u, kept)
    list_pairs(made, u, kept)
    found = kept.counts.listed_first, kept.counts.listed_second
    assert found == every_pair(made, kept.x, made.skin)
    assert found[0] > 0 and kept.counts.full == 0


def test_full_lists_take_a_thinner_skin():
    made = tables_of(miura(5.0, cells=3))
    kept = memory(made)
    place(made, kept.listed, kept)
    list_pairs(made, kept.listed, kept)
    room = int(max(kept.counts.listed_first, kept.counts.listed_second)) - 1
    small = kept._replace(
        pairs=kept.pairs[:, :room].copy(), d0=kept.d0[:, :room].copy(),
        gap=kept.gap[:, :room].copy(), near=kept.near[:, :room].copy(),
    )  # fmt: skip
    list_pairs(made, kept.listed, small)
    found = small.counts.listed_first, small.counts.listed_second
    assert small.facts.skin < made.skin and small.counts.full == 0
    assert found == every_pair(made, small.x, float(small.facts.skin))


def test_positions_that_are_not_finite_make_no_list():
    made = tables_of(miura(60.0))
    kept = memory(made)
    kept.x[3, 1] = np.nan
    list_pairs(made, kept.listed, kept)
    assert kept.counts.full == 1 and kept.counts.has_list == 0


STACK = miura(1.6)  # panels of paper that are folded until they touch
FLOOR = ((0.0, 0.0, float(STACK.nodes[:, 2].min()) - 0.3 * T), (0.0, 0.0, 1.0), 0.0)


@pytest.fixture(scope="module")
def stack():
    return touching(STACK, [FLOOR])


def states(count: int):
    rng = np.random.default_rng(5)
    return [2e-5 * rng.standard_normal(STACK.nodes.size) for _ in range(count)]


def test_forces_of_a_stack_are_the_gradient_and_tangents_exact(stack):
    def force(u):
        return stack.contact(u)[1].ravel()

    # differences of 1e-9 m straddle kinks of a few among hundreds of pairs, hence the median
    errors = [
        (
            gradient_error(lambda u: stack.contact(u)[0], force, at=u, size=2e-6),
            tangent_error(force, stack.tangent, at=u, size=2e-6),
        )
        for u in states(5)
    ]
    assert (np.median(errors, axis=0) < [1e-8, 1e-6]).all()
    u = states(1)[0]
    assert stack.contact(u)[0] > 0.0 and np.abs(force(u)).max() > 0.0
    matrix = stack.tangent(u)
    assert abs(matrix - matrix.T).max() < 1e-9 * abs(matrix).max()


@pytest.mark.matrix
@pytest.mark.parametrize("dihedral", [1.0, 359.0])
def test_guards_keep_dihedrals_between_0_and_360(dihedral):
    pattern = fd.patterns.simple_fold(a=0.02, b=0.02, dihedral=10.0)
    s = fd.discretize(pattern, STACK.sheet, fold_law="linear", crease_rest=dihedral, preset="plate")
    body = touching(s)
    x = body.tables.rest.copy()
    half = np.radians(5.0 - 0.5 * dihedral)  # turns both panels about the ridge, nodes 2 and 3
    ridge = x[2].copy()
    for nodes, turn in (([0, 1, s.centers[0]], -half), ([4, 5, s.centers[1]], half)):
        arm = x[nodes] - ridge
        x[nodes, 0] = ridge[0] + np.cos(turn) * arm[:, 0] + np.sin(turn) * arm[:, 2]
        x[nodes, 2] = ridge[2] - np.sin(turn) * arm[:, 0] + np.cos(turn) * arm[:, 2]

    def guard(u):
        force = np.zeros_like(x)
        moved = u.reshape(-1, 3)
        angles = s.body.angles(u - (body.tables.rest - x).ravel())
        guards = 0, len(body.tables.hinge_limit)
        return add_guards(body.tables, x + moved, angles, force, *guards), force.ravel()

    rest = np.zeros(x.size)
    angle = np.degrees(s.body.angles((x - body.tables.rest).ravel())[body.tables.hinge_row])
    assert min(angle.min(), 360.0 - angle.max()) == pytest.approx(1.0, rel=1e-9)
    assert guard(rest)[0] > 0.0 == guard((body.tables.rest - x).ravel())[0]
    error = gradient_error(lambda u: guard(u)[0], lambda u: guard(u)[1], at=rest, size=1e-6)
    assert error < 1e-8


@pytest.mark.parametrize("make", [fd.discretize, fd.shell])
def test_neighbors_meet_everywhere_at_once(make):
    """At the dihedral 2 t / w: all pairs across a crease begin to touch at the same angle."""
    begin, energies = np.degrees(2.0 * T / 0.02), []
    options = {"scheme": "n4b5"} if make is fd.discretize else {"divisions": 4}
    for factor in (1.002, 0.998):
        pattern = fd.patterns.simple_fold(a=0.02, b=0.02, dihedral=factor * begin)
        s = make(pattern, SHEET, fold_law="linear", **options)
        contact = fd.Case(s, contact=fd.Contact()).contact_term
        energies.append(contact.contact(np.zeros(s.body.size))[0])
    assert energies[0] == 0.0 < energies[1]
