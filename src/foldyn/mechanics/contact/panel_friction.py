"""Friction between panels: springs between the points of first contact.

A pair whose closest points differ by r, d = |r|, is tied between two points fixed to its parts,
which differ by q. Their distance along the parts is

    s = sqrt(|q|^2 - d^2)

which is invariant under rigid motions. The spring has the energy k s^2 / 2 and pulls with k s,
limited to mu N, with N the normal force of the pair. At the end of a step the tied points follow a
slipping pair, like anchors on planes (`planes`). With weights a_i of q and w_i of r on the four
nodes the forces are k (a_i q - w_i r): two pairs of opposite forces along q and r, which have
neither a resultant nor a moment.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.distances import dot, point
from foldyn.mechanics.contact.edge_edge import edge_edge
from foldyn.mechanics.contact.pairs import VERTEX, closest_of, gap_of, nodes_of, weights_of
from foldyn.mechanics.contact.planes import LEAST
from foldyn.mechanics.contact.vertex_triangle import vertex_triangle
from foldyn.mechanics.threads import part, wait


@kernel
def pressed_pair(tables, memory, x, kind, pair):
    """Normal force (N) of a listed pair at x (n, 3), and its closest points."""
    one, other, d0 = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1], memory.d0[kind, pair]
    if kind == VERTEX:
        _, pressed, p, q = vertex_triangle(tables, x, None, one, other, d0)
    else:
        _, pressed, p, q = edge_edge(tables, x, None, one, other, d0)
    return pressed, p, q


@inner_scalar
def _across(x, nodes, weights):
    """Vector between two points of a pair."""
    a, b, c, d = point(x, nodes[0]), point(x, nodes[1]), point(x, nodes[2]), point(x, nodes[3])
    e, f, g, h = weights
    return (
        e * a[0] + f * b[0] + g * c[0] + h * d[0],
        e * a[1] + f * b[1] + g * c[1] + h * d[1],
        e * a[2] + f * b[2] + g * c[2] + h * d[2],
    )


@inner
def stretch_of_pair(tables, memory, x, kind, pair, p, q):
    """Stretch (m) of the spring of a pair whose closest points are p, q.

    Preceded by the nodes, the weights of the tied and the closest points, and their vectors.
    """
    tie = memory.tie[kind, pair]
    one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
    nodes = nodes_of(tables.triangles, tables.edges, kind, one, other)
    tied, closest = weights_of(kind, tie[0], tie[1]), weights_of(kind, p, q)
    apart, r = _across(x, nodes, tied), _across(x, nodes, closest)
    square = dot(apart, apart) - dot(r, r)
    return nodes, tied, closest, apart, r, math.sqrt(max(0.0, square))


@inner_scalar
def bound(tables, memory, kind, pair, pressed):
    """Stretch (m) at which the spring of a pair slips under a normal force `pressed` (N)."""
    normal = memory.tie[kind, pair, 2] if memory.counts.lagged == 1 else pressed
    return tables.friction * normal / tables.stiffness


@inner_scalar
def pull_of(k, stretch, most):
    """Spring force over its stretch (N/m)."""
    return k if stretch <= most else k * most / stretch


@kernel
def add_rub(tables, memory, x, force, kind, pair, pressed, p, q):
    """Add the friction gradient (N) of a pair with normal force `pressed` to force (n, 3)."""
    if memory.tie[kind, pair, 2] == 0.0 or pressed <= 0.0:
        return
    nodes, tied, closest, apart, r, stretch = stretch_of_pair(tables, memory, x, kind, pair, p, q)
    most = bound(tables, memory, kind, pair, pressed)
    pull = pull_of(tables.stiffness, stretch, most)
    for c in range(3):
        for i in range(4):
            force[nodes[i], c] += pull * (tied[i] * apart[c] - closest[i] * r[c])


@kernel
def add_rubs(tables, memory, force):
    """Add friction of a member's share of near pairs, at the last force evaluation."""
    team = memory.share.team
    for kind in range(2):
        near = memory.counts.near_first if kind == VERTEX else memory.counts.near_second
        first, last = part(team, near)
        for k in range(first, last):
            pair = memory.near[kind, k]
            if memory.tie[kind, pair, 2] > 0.0:
                pressed, p, q = pressed_pair(tables, memory, memory.x, kind, pair)
                add_rub(tables, memory, memory.x, force, kind, pair, pressed, p, q)


@kernel
def rub_power(tables, v, memory):
    """Power (W) dissipated by friction of a member's near pairs at velocities v (n, 3).

    Call it after a force evaluation.
    """
    team, taken = memory.share.team, 0.0
    for kind in range(2):
        near = memory.counts.near_first if kind == VERTEX else memory.counts.near_second
        first, last = part(team, near)
        for k in range(first, last):
            pair = memory.near[kind, k]
            if memory.tie[kind, pair, 2] == 0.0:
                continue
            pressed, p, q = pressed_pair(tables, memory, memory.x, kind, pair)
            if pressed <= 0.0:
                continue
            nodes, tied, closest, apart, r, stretch = stretch_of_pair(
                tables, memory, memory.x, kind, pair, p, q
            )
            most = bound(tables, memory, kind, pair, pressed)
            power = dot(apart, _across(v, nodes, tied)) - dot(r, _across(v, nodes, closest))
            taken += pull_of(tables.stiffness, stretch, most) * power
    wait(team)  # until others have read this member's velocities
    return taken


@kernel
def rub_state(tables, memory):
    """Energy (J) of the near pairs' springs at the last force evaluation; whether one slips."""
    energy, slips, k = 0.0, False, tables.stiffness
    for kind in range(2):
        near = memory.counts.near_first if kind == VERTEX else memory.counts.near_second
        for n in range(near):
            pair = memory.near[kind, n]
            if memory.tie[kind, pair, 2] == 0.0:
                continue
            pressed, p, q = pressed_pair(tables, memory, memory.x, kind, pair)
            if pressed <= 0.0:
                continue
            stretch = stretch_of_pair(tables, memory, memory.x, kind, pair, p, q)[5]
            most = bound(tables, memory, kind, pair, pressed)
            energy += 0.5 * k * min(stretch, most) ** 2
            slips = slips or stretch > most
    return energy, slips


@kernel
def tie_pairs(tables, memory):
    """Tie all listed pairs within the skin that are not tied yet."""
    for kind in range(2):
        listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
        for pair in range(listed):
            tie = memory.tie[kind, pair]
            one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
            gap = gap_of(tables.triangles, tables.edges, memory.x, kind, one, other)
            if tie[2] == 0.0 and gap - memory.d0[kind, pair] < memory.facts.skin:
                tie[0], tie[1] = closest_of(
                    tables.triangles, tables.edges, memory.x, kind, one, other
                )[:2]
                tie[2], tie[3] = LEAST, 0.0


@kernel
def slip_pairs(tables, x, memory):
    """Update ties at the end of a step: follow slipping pairs, begin and end with contact.

    Covers a member's share of near pairs. Returns the dissipated energy (J): the path of the ties
    times the mean of mu N at both ends of the step, and the energy of released springs.
    """
    lost, team, k = 0.0, memory.share.team, tables.stiffness
    for kind in range(2):
        near = memory.counts.near_first if kind == VERTEX else memory.counts.near_second
        first, last = part(team, near)
        for n in range(first, last):
            pair = memory.near[kind, n]
            tie = memory.tie[kind, pair]
            pressed, p, q = pressed_pair(tables, memory, x, kind, pair)
            if pressed <= 0.0:
                lost += 0.5 * k * tie[3] * tie[3]
                tie[2] = tie[3] = 0.0
                continue
            before = tie[2]
            tie[2] = max(pressed, LEAST)
            if before == 0.0:
                tie[0], tie[1], tie[3] = p, q, 0.0
                continue
            stretch = stretch_of_pair(tables, memory, x, kind, pair, p, q)[5]
            most = tables.friction * pressed / k
            tie[3] = min(stretch, most)
            if stretch > most:
                share = 1.0 - most / stretch
                tie[0] += share * (p - tie[0])
                tie[1] += share * (q - tie[1])
                lost += 0.5 * tables.friction * (before + pressed) * (stretch - most)
    return lost
