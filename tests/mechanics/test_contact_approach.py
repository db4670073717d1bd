"""How far steps may go before something crosses, lagged friction, and contact on threads."""

from __future__ import annotations

import numpy as np
import pytest
from contact_samples import T, miura, sheets, touching
from samples import relative

from foldyn.checks import tangent_error
from foldyn.jit.compiled import shared
from foldyn.mechanics.contact.candidates import tables
from foldyn.mechanics.contact.ccd import KEEP, clear_share
from foldyn.mechanics.contact.contact_state import memories, memory
from foldyn.mechanics.contact.distances import edge_gap, vertex_gap
from foldyn.mechanics.contact.kernels import add_contact
from foldyn.mechanics.contact.planes import plane_powers, slip
from foldyn.mechanics.contact.search import list_pairs, place
from foldyn.mechanics.contact.step_limit import RESOLVED, limited
from foldyn.mechanics.contact.term import ContactTerm, contact_tangent
from foldyn.mechanics.threads import run_together, team, wait

NO_HINGES = np.zeros((0, 4), np.int64)
FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
NO_PLANES = np.zeros((0, 3))


def pair(above: float):
    """Two triangles, one above the other, that list all pairs."""
    nodes = np.vstack([FLAT, FLAT + np.array([0.2, 0.1, above])])
    own = sheets(nodes, [[0, 1, 2], [3, 4, 5]], [0, 1], 0.1)
    return tables(own, NO_HINGES)._replace(skin=100.0)


@pytest.mark.parametrize("keep", [0.2, 0.5])
def test_a_gap_that_closes_keeps_its_share(keep):
    made = pair(0.3)
    down, u = np.zeros((6, 3)), np.zeros((6, 3))
    down[3:, 2] = -1.0
    share = clear_share(made, memory(made), u, down, NO_PLANES, keep)
    assert share == pytest.approx(0.3 * (1.0 - keep), rel=0.02)
    assert share <= 0.3 * (1.0 - keep)


def test_motions_that_close_no_gap_go_all_the_way():
    made, u = pair(0.3), np.zeros((6, 3))
    away, together, along = np.zeros((6, 3)), np.full((6, 3), 5.0), np.zeros((6, 3))
    away[3:, 2], along[3:, 0] = 1.0, 0.3
    for step in (away, together, along):
        assert clear_share(made, memory(made), u, step, NO_PLANES, KEEP) == 1.0


@pytest.mark.parametrize("seed", range(20))
def test_nothing_crosses_on_the_way_of_any_motion(seed):
    rng = np.random.default_rng(seed)
    own = tables(
        sheets(rng.uniform(-1, 1, (12, 3)), np.arange(12).reshape(4, 3), range(4), 0.02), NO_HINGES
    )._replace(skin=100.0)
    u, kept = np.zeros((12, 3)), memory(own)
    step = rng.standard_normal((12, 3))
    share = clear_share(own, kept, u, step, NO_PLANES, KEEP)
    place(own, u, kept)
    list_pairs(own, u, kept)
    first, second = gaps(own, kept, 0.0 * step), []
    for at in np.linspace(0.0, share, 40):
        second.append(gaps(own, kept, at * step))
    assert (np.min(second, axis=0) >= KEEP * first * (1.0 - 1e-9)).all()
    if share < 1.0:  # no farther than need be: some gap is nearly down to what it keeps
        assert (second[-1] / first).min() < 1.05 * KEEP


def gaps(own, kept, u):
    """Distances of all listed pairs at displacement u."""
    x = own.rest + u
    first = [
        vertex_gap(x, own.triangles, *kept.pairs[0, k]) for k in range(kept.counts.listed_first)
    ]
    second = [edge_gap(x, own.edges, *kept.pairs[1, k]) for k in range(kept.counts.listed_second)]
    return np.array([*first, *second])


def test_motions_beyond_the_range_of_a_list_make_others_on_their_way():
    made, u = pair(0.3)._replace(skin=0.1), np.zeros((6, 3))
    step = np.zeros((6, 3))
    step[3:, 0] = 1.0  # along each other: 0.5 m of each against the mean, 0.05 m to a list
    kept = memory(made)
    assert clear_share(made, kept, u, step, NO_PLANES, KEEP) == 1.0
    assert kept.counts.lists in (10, 11)  # by rounding
    np.testing.assert_array_equal(kept.x, made.rest)
    step[3:] = 0.0, 0.0, -3.0  # onto each other, and through
    share = clear_share(made, memory(made), u, step, NO_PLANES, KEEP)
    assert 0.2 < 3.0 * share < 0.3
    none, far = memory(made), 100.0 * step
    assert clear_share(made, none, u, far, NO_PLANES, KEEP) < 0.001
    slide = np.zeros((6, 3))
    slide[3:, 0] = 1000.0
    assert clear_share(made, memory(made), u, slide, NO_PLANES, KEEP) < 0.01  # enough for once


def test_planes_and_sheets_that_meet_share_the_gap():
    made = tables(sheets(FLAT, [[0, 1, 2]], [0], 0.1, [((0, 0, -0.2), (0, 0, 1), 0.0)]), NO_HINGES)
    kept, u = memory(made), np.zeros((3, 3))
    up, down = np.array([[0.0, 0.0, 1.0]]), np.zeros((3, 3))
    down[:, 2] = -1.0
    assert clear_share(made, kept, u, down, 0.0 * up, KEEP) == pytest.approx(0.8 * 0.2)
    assert clear_share(made, kept, u, down, up, KEEP) == pytest.approx(0.8 * 0.1)
    assert clear_share(made, kept, u, down, -up, KEEP) == 1.0
    assert clear_share(made, kept, u, np.full((3, 3), np.nan), up, KEEP) == 0.0


def test_no_hinge_passes_zero():
    made = miura(20.0)
    body, contact = made.body, touching(made)
    u = np.zeros(body.size)
    rng = np.random.default_rng(2)
    for _ in range(10):
        step = 0.02 * rng.standard_normal(body.size)
        share = contact.clear(u, step, NO_PLANES)
        assert 0.0 < share < 1.0
        angles = body.angles(share * step)[contact.tables.hinge_row]
        before = body.angles(u)[contact.tables.hinge_row]
        near, was = (np.minimum(a, 2 * np.pi - a) for a in (angles, before))
        assert (np.abs(angles - before) < np.pi).all() and (near >= KEEP * was).all()


@pytest.mark.matrix
@pytest.mark.parametrize("stretch", [1e-7, 1e-4])
def test_the_tangent_of_lagged_friction_is_exact(stretch):
    """Sticking with a small stretch, slipping with a large one."""
    made = miura(70.0)
    floor = ((0.0, 0.0, float(made.nodes[:, 2].min()) - 0.4 * T), (0.0, 0.0, 1.0), 0.3)
    body = ContactTerm(
        sheets(made.nodes, made.triangles, made.triangle_panel, T, [floor]), made.body
    )
    kept, u = memory(body.tables), np.zeros((len(made.nodes), 3))
    place(body.tables, u, kept)
    slip(body.tables, kept.x, kept)
    kept.counts.lagged = 1
    rng = np.random.default_rng(1)
    u[:, :2] = stretch * rng.standard_normal((len(u), 2))

    def force(v):
        out = np.zeros_like(u)
        add_contact(body.tables, v.reshape(-1, 3), made.body.angles(v), out, kept)
        return out.ravel()

    def tangent(v):
        force(v)
        return contact_tangent(body.tables, kept, made.body.size)

    assert np.abs(force(u.ravel())[0::3]).max() > 0.0
    assert tangent_error(force, tangent, at=u.ravel(), size=1e-9) < 1e-6
    matrix = tangent(u.ravel())
    assert abs(matrix - matrix.T).max() < 1e-12 * abs(matrix).max()


ROUNDING = 1e-13  # of the largest force: sums of some ten numbers in another order
STACK = miura(1.6, cells=3)  # panels of paper that touch
FLOOR = ((0.0, 0.0, float(STACK.nodes[:, 2].min()) - 0.3 * T), (0.0, 0.0, 1.0), 0.3)
DT = 1e-4


@shared
def two_steps(tables, u, v, angle, lightness, memory, force):
    """The first force, two steps' limits, and the forces after them; returns limits and powers."""
    limits = np.zeros(2)
    for k in range(3):  # one call of each: what is called twice is compiled twice
        add_contact(tables, u[k], angle[k], force[k], memory)
        if k < 2:
            limits[k] = limited(tables, u[k], v, v, angle[k], DT, RESOLVED, lightness, memory)
            wait(memory.share.team)
    work, dissipated = plane_powers(tables, v, memory)
    return limits[0], limits[1], work, dissipated


def moved(count: int, growth: float):
    """What `count` members of a team find where a stack grows by a share of itself each step."""
    body, rng = touching(STACK, [FLOOR]), np.random.default_rng(7)
    tables, n = body.tables, len(STACK.nodes)
    u = 2e-5 * rng.standard_normal((n, 3)) + 1e-6 * rng.standard_normal((3, n, 3))
    u += growth * np.arange(3)[:, None, None] * (STACK.nodes - FLOOR[0])
    v, force = 0.1 * rng.standard_normal((n, 3)), np.zeros_like(u)
    angle = np.array([STACK.body.angles(one.ravel()) for one in u])
    cuts = np.linspace(0, n, count + 1).astype(np.int64)
    kept = memories(tables, True, team(count), [cuts[k : k + 2] for k in range(count)])
    for one in kept:
        one.moved[:] = [1e-6, 0.0, 2e-6, 0.1, 0.0, 0.2]
    light = np.full(n, 1e4)
    arguments = [(tables, u, v, angle, light, one, force) for one in kept]
    ends = run_together(two_steps, [one.share.team for one in kept], arguments)
    return force, np.array(ends), kept


@pytest.mark.matrix
@pytest.mark.parametrize("growth", [1e-4, 0.03])  # with the first list, and with others
@pytest.mark.parametrize("count", [2, 3])
def test_members_find_what_one_finds(count, growth):
    force, ends, (alone,) = moved(1, growth)
    found, of_each, kept = moved(count, growth)
    assert np.abs(force).max(axis=(1, 2)).min() > 0.0
    assert ends[0, 0] < DT  # what touches asks for shorter steps
    assert (alone.counts.lists > 1) == (growth > 1e-3)
    for one, other in zip(found, force, strict=True):
        assert relative(one, other) < ROUNDING
    np.testing.assert_array_equal(of_each[:, :2] - of_each[0, :2], 0.0)  # all take the same step
    np.testing.assert_allclose(of_each[0, :2], ends[0, :2], rtol=1e-12)
    np.testing.assert_allclose(of_each[:, 2:].sum(axis=0), ends[0, 2:], rtol=1e-10)
    energy = sum(float(one.facts.energy) for one in kept)
    assert energy == pytest.approx(float(alone.facts.energy), rel=1e-12)
    for one in kept:
        assert one.counts.item() == alone.counts.item()
        near = alone.counts.near_first, alone.counts.near_second
        assert min(near) > 0
        for kind in range(2):
            np.testing.assert_array_equal(
                one.near[kind, : near[kind]], alone.near[kind, : near[kind]]
            )
        np.testing.assert_allclose(one.anchor, alone.anchor, rtol=1e-9)
    assert (alone.anchor[0, :, 3] > 0.0).any()
    assert not kept[0].share.sums.any()  # nothing is left for the next force
    again, repeated, _ = moved(count, growth)
    np.testing.assert_array_equal(again, found)
    np.testing.assert_array_equal(repeated, of_each)
