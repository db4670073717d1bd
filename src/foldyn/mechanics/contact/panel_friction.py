"""Friction between panels: springs between the points of first contact.

Let the closest points of a pair differ by the vector r, with d = |r|. The pair is tied between two
points that are fixed to its parts and differ by q. The distance of these points along the parts is

    s = sqrt(|q|^2 - d^2)

which is invariant under rigid motions. The spring has the energy k s^2 / 2 and pulls with k s, but
at most with mu N, with N the normal force of the pair. At the end of a step the tied points follow
a slipping pair, like anchors on planes (`planes`). With weights a_i of q and w_i of r on the four
nodes the forces are k (a_i q - w_i r): two pairs of opposite forces along q and r, which have
neither a resultant nor a moment.

With Q = (|q|^2 - d^2) / 2, its gradient g and Hess Q = a_i a_j I - Hess(d^2 / 2) (`potential`), the
derivative is k Hess Q for a sticking pair, and for a slipping pair with the normal force N

    mu N / s (Hess Q - g g' / s^2) + mu / s g grad N'.

With N from the end of the last step the second term vanishes, and the derivative is symmetric.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.distances import (
    VERTEX,
    closest_of,
    cross,
    dot,
    gap_of,
    minus,
    nodes_of,
    point,
    put_corners,
    weighted,
    weights_of,
)
from foldyn.mechanics.contact.pair_potentials import (
    PARALLEL,
    PARTS,
    edge_edge,
    mollifier,
    share_of,
    square_of_cross,
    vertex_triangle,
    weigh_edges,
    weigh_triangle,
)
from foldyn.mechanics.contact.planes import LEAST
from foldyn.mechanics.contact.potential import apart_of, barrier, half_square
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


@inner
def stretch_of_pair(tables, memory, x, kind, pair, p, q):
    """Stretch (m) of the spring of a pair whose closest points are p, q.

    Returns the pair's nodes, the weights of the tied and of the closest points, the vectors between
    the tied points and between the closest points, then the stretch.
    """
    tie = memory.tie[kind, pair]
    one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
    nodes = nodes_of(tables.triangles, tables.edges, kind, one, other)
    tied, closest = weights_of(kind, tie[0], tie[1]), weights_of(kind, p, q)
    apart, r = weighted(x, nodes, tied), weighted(x, nodes, closest)
    square = dot(apart, apart) - dot(r, r)
    return nodes, tied, closest, apart, r, math.sqrt(max(0.0, square))


@inner_scalar
def bound(tables, memory, kind, pair, pressed):
    """Stretch (m) at which the spring of a pair slips under a normal force `pressed` (N)."""
    normal = memory.tie[kind, pair, 2] if memory.counts.lagged == 1 else pressed
    return tables.friction * normal / tables.stiffness


@inner_scalar
def pull_of(k, stretch, most):
    """Ratio of spring force to stretch (N/m)."""
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
            power = dot(apart, weighted(v, nodes, tied)) - dot(r, weighted(v, nodes, closest))
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
    """Update ties at the end of a step: follow slipping pairs, tie and release pairs.

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


@kernel
def add_rub_tangent(tables, memory, x, kind, pair, share, out):
    """Add the friction tangent of a pair at x (n, 3), times a share, to out (12, 12)."""
    tie = memory.tie[kind, pair]
    if tie[2] == 0.0:
        return
    one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
    lagged, k = memory.counts.lagged == 1, tables.stiffness
    pressed = tie[2] if lagged else pressed_pair(tables, memory, x, kind, pair)[0]
    if pressed <= 0.0:
        return
    corners, r, apart = np.empty((4, 3)), np.empty(3), np.empty(3)
    weights, moves, tied = np.empty(4), np.empty((2, 4)), np.empty(4)
    slope, second, normal = np.empty(12), np.empty((12, 12)), np.zeros(12)
    put_corners(x, nodes_of(tables.triangles, tables.edges, kind, one, other), corners)
    tied[0], tied[1], tied[2], tied[3] = weights_of(kind, tie[0], tie[1])
    if kind == VERTEX:
        free = weigh_triangle(corners, 0, weights, moves)
    else:
        free, inside = weigh_edges(corners, 0, weights, moves)
        if not inside:
            return
    square = apart_of(corners, tied, apart) - apart_of(corners, weights, r)
    stretch = math.sqrt(max(0.0, square))
    half_square(corners, weights, moves, free, r, slope, second)
    for i in range(12):
        slope[i] = tied[i // 3] * apart[i % 3] - slope[i]
        for j in range(12):
            moved = tied[i // 3] * tied[j // 3] if i % 3 == j % 3 else 0.0
            second[i, j] = moved - second[i, j]
    most = bound(tables, memory, kind, pair, pressed)
    slips = stretch > most
    pull = k * most / stretch if slips else k
    if slips and not lagged:
        if kind == VERTEX:
            _vertex_slope(tables, corners, other, memory.d0[kind, pair], weights, moves, normal)
        else:
            _edges_slope(tables, corners, one, other, memory.d0[kind, pair], weights, moves, normal)
    for i in range(12):
        for j in range(12):
            value = pull * second[i, j]
            if slips:
                value -= pull * slope[i] * slope[j] / (stretch * stretch)
                value += tables.friction * slope[i] * normal[j] / stretch
            out[i, j] += share * value


@inner
def _add_slope(corners, weights, d0, k, out):
    """Add the gradient of the force -k d0 f'(d/d0) to out (12,); return the force (N)."""
    r = np.empty(3)
    d = math.sqrt(apart_of(corners, weights, r))
    if d >= d0:
        return 0.0
    _, f1, f2 = barrier(d / d0)
    for i in range(12):
        out[i] -= k * f2 / d * weights[i // 3] * r[i % 3]
    return -k * d0 * f1


@inner
def _vertex_slope(tables, corners, t, d0, weights, moves, out):
    """Gradient (12,) of the normal force of a vertex and triangle t."""
    for which in range(PARTS):
        share = share_of(tables, t, which)
        if share != 0.0:
            weigh_triangle(corners, which, weights, moves)
            _add_slope(corners, weights, d0, share * tables.stiffness, out)


@inner
def _edges_slope(tables, corners, i, j, d0, weights, moves, out):
    """Gradient (12,) of the normal force of edges i and j."""
    e, g = minus(point(corners, 1), point(corners, 0)), minus(point(corners, 3), point(corners, 2))
    n = cross(e, g)
    c0 = PARALLEL * tables.edge_square[i] * tables.edge_square[j]
    m, m1, _ = mollifier(dot(n, n), c0)
    weigh_edges(corners, 0, weights, moves)
    pressed = _add_slope(corners, weights, d0, tables.stiffness, out)
    weigh_edges(corners, 1, weights, moves)
    pressed += _add_slope(corners, weights, d0, -tables.stiffness, out)
    for a in range(12):
        out[a] *= m
    if m1 > 0.0:
        first = square_of_cross(e, g)[0]
        for a in range(12):
            out[a] += m1 * pressed * first[a]
