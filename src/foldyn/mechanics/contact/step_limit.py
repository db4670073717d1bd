"""Longest step of an explicit method that resolves all contacts.

At the speed at the start of a step, no gap d may close by more than (d - d0)+ plus the share
`APPROACH` = eta of min(d, d0), and the step resolves the stiffness of active contacts,

    h <= ((d - d0)+ + eta min(d, d0)) / closing speed,    h <= beta / sqrt(k f'' sum w_i^2 / m_i),

with the weights w_i of the closest points and the masses m_i. A method that gives slow contacts
inertia (`inertia`) may exceed the second limit if the contacts have little energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.candidates import FRICTION, NORMAL
from foldyn.mechanics.contact.contact_state import HINGES, LIMIT, NEAR, gather
from foldyn.mechanics.contact.distances import (
    VERTEX,
    closest_of,
    dot,
    nodes_of,
    weighted,
    weights_of,
)
from foldyn.mechanics.contact.hinge_guards import TURN, gradient_at
from foldyn.mechanics.contact.panel_friction import slip_pairs
from foldyn.mechanics.contact.planes import height, slip
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.contact.search import motions, place, relist
from foldyn.mechanics.threads import largest, part, wait

APPROACH = 0.1
REACH = 4.0  # search range for pairs, divided by the fastest motion in a step
TINY = 1e-300  # m/s
MARGIN = 0.05  # extra range relative to the skin, because speeds change within a step


class Pace(NamedTuple):
    """How well steps of a method must resolve contacts."""

    resolved: float  # beta: largest vibration angle of a contact per step, rad
    energy: float  # J, largest k f'' (change of the gap)^2 of unresolved contacts


RESOLVED = Pace(0.25, 0.0)  # for methods without error estimate


@inner_scalar
def _spring_bound(limit, rate, pace):
    """The smaller of `limit` and the step limit of a spring with stiffness / mass `rate` (1/s2)."""
    return min(limit, pace.resolved / math.sqrt(rate)) if rate > 0.0 else limit


@inner_scalar
def _bound(limit, d, d0, closing, change, stiffness, lightness, pace, facts):
    """The smaller of a step (s) and the limit of a gap d that closes at a given speed.

    change : rate of the closing speed, which distinguishes resting from reversing contacts.
    """
    if closing > 0.0:
        limit = min(limit, (max(d - d0, 0.0) + APPROACH * min(d, d0)) / closing)
    if d < d0:
        k = stiffness * barrier(d / d0)[2]
        resolved = _spring_bound(math.inf, k * lightness, pace)
        facts.resolved = min(facts.resolved, resolved)
        if pace.energy > 0.0:  # h |closing| + h^2 |change| = most
            most, speed = math.sqrt(pace.energy / k), abs(closing) + TINY
            slow = 2.0 * most / (speed + math.sqrt(speed * speed + 4.0 * most * abs(change)))
            resolved = max(resolved, slow)
        limit = min(limit, resolved)
    return limit


@inner
def _pair_bound(tables, x, v, a, lightness, kind, one, other, d0, reach, limit, pace, facts):
    """Step limit of a pair, see `_bound`; nan if it is beyond reach."""
    nodes = nodes_of(tables.triangles, tables.edges, kind, one, other)
    p, q, _ = closest_of(tables.triangles, tables.edges, x, kind, one, other)
    weights = weights_of(kind, p, q)
    r = weighted(x, nodes, weights)
    d, light = math.sqrt(dot(r, r)), 0.0
    if d - d0 > reach:
        return np.nan
    for i in range(4):
        light += weights[i] * weights[i] * lightness[nodes[i]]
    if d < d0 and tables.friction > 0.0:
        limit = _spring_bound(limit, tables.stiffness * light, pace)
    closing = -dot(r, weighted(v, nodes, weights)) / d
    change = dot(r, weighted(a, nodes, weights)) / d
    return _bound(limit, d, d0, closing, change, tables.stiffness, light, pace, facts)


@inner_scalar
def _pairs_bound(tables, x, v, a, lightness, far, reach, limit, pace, memory):
    """Step limit of a member's share of listed pairs, see `_bound`; notes near pairs."""
    counts, team = memory.counts, memory.share.team
    for kind in range(2):
        listed = counts.listed_first if kind == VERTEX else counts.listed_second
        first, last = part(team, listed)
        found = first
        for k in range(first, last):
            if memory.gap[kind, k] - 2.0 * far > reach:
                continue
            one, other = memory.pairs[kind, k, 0], memory.pairs[kind, k, 1]
            now = _pair_bound(
                tables, x, v, a, lightness, kind, one, other, memory.d0[kind, k], reach, limit,
                pace, memory.facts,
            )  # fmt: skip
            if now == now:
                limit = now
                memory.share.found[kind, found] = k
                found += 1
        team.note[team.number, NEAR + kind] = found - first
    return limit


@inner
def _hinges_bound(tables, x, v, a, lightness, angle, reach, limit, pace, memory):
    """Step limit of a member's share of guarded hinges, see `_bound`.

    Notes how many hinges a motion by `reach` may bring to their guards.
    """
    near, team = 0, memory.share.team
    first, last = part(team, tables.hinge_limit.size)
    for h in range(first, last):
        begin, theta = tables.hinge_limit[h], angle[tables.hinge_row[h]]
        if min(theta, TURN - theta) - begin > 2.0 * tables.hinge_reach[h] * reach:
            continue
        near += 1
        found = gradient_at(tables, x, h)
        rate, change, light = 0.0, 0.0, 0.0
        for k in range(4):
            node = tables.hinges[h, k]
            for c in range(3):
                slope = found[1 + 3 * k + c]
                rate += slope * v[node, c]
                change += slope * a[node, c]
                light += slope * slope * lightness[node]
        theta = found[0]
        if theta > math.pi:
            theta, rate = TURN - theta, -rate
        limit = _bound(
            limit, theta, begin, -rate, change, tables.hinge_stiffness[h], light, pace, memory.facts
        )
    team.note[team.number, HINGES] = near
    return limit


@inner
def _planes_bound(tables, x, v, a, lightness, memory, limit, pace):
    """Step limit of a member's nodes on planes and their friction springs, see `_bound`."""
    k, mine = tables.stiffness, memory.share.meeting
    for p in range(len(tables.planes)):
        for m in range(mine[0], mine[1]):
            i = tables.meeting[m]
            d0, d = 0.5 * tables.node_thickness[i], height(tables, x, memory.moved, p, i)
            closing, change = 0.0, 0.0
            for c in range(3):
                speed = memory.moved[p, 3 + c] - v[i, c]
                closing += speed * tables.planes[p, NORMAL + c]
                change += a[i, c] * tables.planes[p, NORMAL + c]
            limit = _bound(limit, d, d0, closing, change, k, lightness[i], pace, memory.facts)
            if d < d0 and tables.planes[p, FRICTION] > 0.0:
                limit = _spring_bound(limit, k * lightness[i], pace)
    return limit


@kernel
def limited(tables, u, v, a, angle, dt, pace, lightness, memory):
    """Longest step (s), at most dt, from displacement u with velocity v, all (rows, 3).

    Renews lists, gathers pairs that may touch in the step, and lets friction slip: call it once
    before each step, at the end of the last step. Each team member checks its share; all get the
    same step.

    a : acceleration, used for contacts that need not be resolved; angle : dihedrals (nh,) at u;
    pace : see `Pace`; lightness : (n,) 1 / mass of the nodes, 1/kg.
    """
    limit, counts, x, team = dt, memory.counts, memory.x, memory.share.team
    rubs, memory.facts.resolved = tables.friction > 0.0, dt
    panels = memory.d0.shape[1] > 0
    place(tables, u, memory)
    if panels:
        fast, far = motions(u, v, memory)
        skin = memory.facts.skin
        if rubs:
            slip_pairs(tables, x, memory)
        fresh = counts.has_list == 1 and far < MARGIN * skin
        if counts.has_list == 0 or (not fresh and not far + 2.0 * fast * dt < 0.5 * skin):
            if rubs:
                wait(team)  # for the ties of the other members
            relist(tables, u, memory)
            far, skin = 0.0, memory.facts.skin
        if 2.0 * fast * dt > 0.5 * skin - far:
            limit = (0.25 * skin - 0.5 * far) / fast
        reach = REACH * fast * limit + MARGIN * skin
        limit = _pairs_bound(tables, x, v, a, lightness, far, reach, limit, pace, memory)
        limit = _hinges_bound(tables, x, v, a, lightness, angle, reach, limit, pace, memory)
    if len(tables.planes) > 0:
        slip(tables, x, memory)
        limit = _planes_bound(tables, x, v, a, lightness, memory, limit, pace)
    team.note[team.number, LIMIT] = -limit
    wait(team)
    limit = -largest(team, LIMIT)
    if panels:
        gather(memory)
    counts.watched = counts.has_list if panels else 1
    memory.facts.shortest = min(memory.facts.shortest, limit)
    return limit
