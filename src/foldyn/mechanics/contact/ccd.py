"""Continuous collision detection: how far a step may go before parts cross.

Explicit methods limit their steps by speeds (`step_limit`). A Newton step has no speed: nodes and
planes move along straight lines, and the step is shortened so that each gap keeps a share of its
width and no guarded hinge passes 0 or 2 pi. Pair lists are renewed when the motion leaves their
range.

Conservative advancement finds the first gap to close and needs only distances. If the points of a
pair move by at most l relative to each other, the gap g of the pair stays above its goal during the
share (g - goal) / l of the motion; the next share is found from there (additive continuous
collision detection; Li, Kaufman and Jiang, Codimensional Incremental Potential Contact, ACM Trans.
Graph. 40, 2021, section 5).
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.candidates import NORMAL
from foldyn.mechanics.contact.distances import VERTEX, corners_gap, nodes_of, put_corners
from foldyn.mechanics.contact.hinge_guards import TURN, gradient_at
from foldyn.mechanics.contact.planes import height
from foldyn.mechanics.contact.search import farthest, fastest, list_pairs, place, use_all

KEEP = 0.2  # share of each gap to keep
NEAR = 0.01  # a gap has reached its goal if it is at most this share above it
ADVANCES = 100  # largest number per pair
LISTS = 40  # largest number of pair lists per motion
HALVINGS = 40  # largest number of halvings if a hinge would pass 0 or 2 pi


@inner_scalar
def _length(values, i):
    return math.sqrt(values[i, 0] ** 2 + values[i, 1] ** 2 + values[i, 2] ** 2)


@inner
def _pair_share(corners, motion, kind, keep, best):
    """The smaller of `best` and the share of a motion (4, 3) that keeps corners (4, 3) apart."""
    for c in range(3):
        mean = 0.25 * (motion[0, c] + motion[1, c] + motion[2, c] + motion[3, c])
        for i in range(4):
            motion[i, c] -= mean
    one, two = _length(motion, 0), _length(motion, 1)
    three, four = _length(motion, 2), _length(motion, 3)
    fast = one + max(two, three, four) if kind == VERTEX else max(one, two) + max(three, four)
    d = corners_gap(kind, corners)
    goal, now = keep * d, 0.0
    for _ in range(ADVANCES):
        if not fast * (best - now) > d - goal:
            return best
        more = (d - goal) / fast
        now += more
        for i in range(4):
            for c in range(3):
                corners[i, c] += more * motion[i, c]
        d = corners_gap(kind, corners)
        if not d > (1.0 + NEAR) * goal:
            break
    return min(best, now)


@inner
def _pairs_share(tables, memory, step, keep, best):
    """Share of a motion (n, 3) that keeps all listed pairs apart."""
    x, corners, motion = memory.x, np.empty((4, 3)), np.empty((4, 3))
    triangles, edges = tables.triangles, tables.edges
    for kind in range(2):
        listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
        for k in range(listed):
            one, other = memory.pairs[kind, k, 0], memory.pairs[kind, k, 1]
            nodes = nodes_of(triangles, edges, kind, one, other)
            put_corners(x, nodes, corners)
            put_corners(step, nodes, motion)
            best = _pair_share(corners, motion, kind, keep, best)
    return best


@inner
def _planes_share(tables, memory, step, moves, keep, best):
    """Share of a motion (n, 3) that keeps all nodes in front of the planes, which move (q, 3)."""
    for p in range(len(tables.planes)):
        for m in range(tables.meeting.size):
            i, closing = tables.meeting[m], 0.0
            for c in range(3):
                closing += (moves[p, c] - step[i, c]) * tables.planes[p, NORMAL + c]
            if closing > 0.0:
                best = min(
                    best, (1.0 - keep) * height(tables, memory.x, memory.moved, p, i) / closing
                )
    return best


@inner
def _hinges_share(tables, x, step, keep, best):
    """Share of a motion (n, 3) in which no guarded hinge passes 0 or 2 pi."""
    ahead, n = np.empty_like(x), len(x)
    angle = np.empty(tables.hinge_limit.size)
    for h in range(angle.size):
        angle[h] = gradient_at(tables, x, h)[0]
    for _ in range(HALVINGS):
        for i in range(n):
            for c in range(3):
                ahead[i, c] = x[i, c] + best * step[i, c]
        passes = False
        for h in range(angle.size):
            theta, now = angle[h], gradient_at(tables, ahead, h)[0]
            near, was = min(now, TURN - now), min(theta, TURN - theta)
            passes = passes or not (abs(now - theta) < math.pi and near >= keep * was)
        if not passes:
            return best
        best *= 0.5
    return 0.0


@inner
def _listed_share(tables, memory, u, step, keep, fast):
    """Share of a motion from u (positions memory.x) that keeps all pairs apart.

    If the motion leaves the range of the pair list, it continues from there with a new list.
    """
    far, done = farthest(u, memory), 0.0
    if memory.counts.has_list == 0 or not far <= 0.25 * memory.facts.skin:
        list_pairs(tables, u, memory)
        use_all(memory)
        far = 0.0
    ahead = np.empty((0, 3))
    for _ in range(LISTS):
        if memory.counts.full == 1:
            return done
        left, range_left = 1.0 - done, 0.5 * memory.facts.skin - far
        part = range_left / fast if fast * left > range_left else left
        share = _pairs_share(tables, memory, step, keep, part)
        if share < part:
            return done + share
        if part == left:
            return 1.0
        done += part
        if ahead.size == 0:
            ahead = np.empty_like(u)
        for i in range(len(u)):
            for c in range(3):
                ahead[i, c] = u[i, c] + done * step[i, c]
        place(tables, ahead, memory)
        list_pairs(tables, ahead, memory)
        use_all(memory)
        far = 0.0
    return done


@kernel
def clear_share(tables, memory, u, step, moves, keep):
    """Share, 0 to 1, of a motion (rows, 3) by `step` from u without any crossing.

    moves : (q, 3) simultaneous motion of the planes, m; keep : share of each gap to keep. Renews
    the pair list if necessary; memory.x becomes the positions at u.
    """
    place(tables, u, memory)
    n, best = len(memory.x), 1.0
    for i in range(n):  # max would ignore nan
        if not _length(step, i) < math.inf:
            return 0.0
    if memory.d0.shape[1] > 0:
        best = _listed_share(tables, memory, u, step, keep, fastest(step, n))
        place(tables, u, memory)
        best = _hinges_share(tables, memory.x, step, keep, best)
    return max(0.0, _planes_share(tables, memory, step, moves, keep, best))
