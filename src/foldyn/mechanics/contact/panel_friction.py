"""Friction between panels: springs between the points at which two of them touched first.

A pair whose closest points are apart by r, d = |r|, is tied between two points that stay with its
parts, apart by q. They are as far from each other along the parts as

    s = sqrt(|q|^2 - d^2)

says, which no rigid motion changes. The spring has the energy k s^2 / 2 and pulls with k s, at most
mu N, N the normal force of the pair. At the end of a step the tied points follow a pair that slips,
as anchors on planes do (`planes`). With weights a_i of q and w_i of r on the four nodes the forces
are k (a_i q - w_i r): two pairs of opposite forces along q and r, which have neither a resultant
nor a moment.
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
    """Normal force (N) of a listed pair at x (n, 3), and where its parts are closest."""
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
    """Stretch (m) of the spring of a pair that is closest at p, q.

    Before it the nodes, the weights of the tied points and the closest ones, and their vectors.
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
    """Stretch (m) at which the spring of a pair slips that is pressed by some force (N)."""
    normal = memory.tie[kind, pair, 2] if memory.counts.lagged == 1 else pressed
    return tables.friction * normal / tables.stiffness


@inner_scalar
def pull_of(k, stretch, most):
    """Pull of a spring over its stretch (N/m)."""
    return k if stretch <= most else k * most / stretch


@kernel
def add_rub(tables, memory, x, force, kind, pair, pressed, p, q):
    """Add the gradient (N) of a pair's friction to force (n, 3); its normal force is `pressed`."""
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
    """Add that of a member's part of all near pairs, where forces were found last."""
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
    """Power (W) that friction takes at velocities v (n, 3): of a member's part of near pairs.

    After a force.
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
    wait(team)  # others look at this member's velocities
    return taken


@kernel
def rub_state(tables, memory):
    """Energy (J) of the springs of near pairs where forces were found last; whether one slips."""
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
    """Tie all pairs of the list that are within its skin, and are not tied yet."""
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
    """At the end of a step, ties follow pairs that slip, and begin and end with touch.

    Of a member's part of near pairs. Returns what that dissipates (J): the way of the ties under
    the mean of mu N at both ends of the step, and what springs held that let go.
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
