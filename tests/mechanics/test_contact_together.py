"""Contact on several threads: the same list, step and force as on one, the same bits each time."""

from __future__ import annotations

import numpy as np
import pytest
from contact_samples import T, miura, touching
from samples import relative

from foldyn.jit.compiled import shared
from foldyn.mechanics.contact.contact_state import memories
from foldyn.mechanics.contact.forces import add_contact
from foldyn.mechanics.contact.planes import plane_powers
from foldyn.mechanics.contact.step_limit import RESOLVED, limited
from foldyn.mechanics.threads import run_together, team, wait

ROUNDING = 1e-13  # of the largest force: sums of some ten numbers in another order
STACK = miura(1.6, cells=3)  # panels of paper that touch
FLOOR = ((0.0, 0.0, float(STACK.nodes[:, 2].min()) - 0.3 * T), (0.0, 0.0, 1.0), 0.3)
DT = 1e-4


@shared
def two_steps(tables, u, v, angle, lightness, memory, force):
    """The first force, two steps' limits, and the forces after them; returns limits and powers."""
    add_contact(tables, u[0], angle[0], force[0], memory)
    one = limited(tables, u[0], v, v, angle[0], DT, RESOLVED, lightness, memory)
    wait(memory.share.team)
    add_contact(tables, u[1], angle[1], force[1], memory)
    other = limited(tables, u[1], v, v, angle[1], DT, RESOLVED, lightness, memory)
    wait(memory.share.team)
    add_contact(tables, u[2], angle[2], force[2], memory)
    work, dissipated = plane_powers(tables, v, memory)
    return one, other, work, dissipated


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
