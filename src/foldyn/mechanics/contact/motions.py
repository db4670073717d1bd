"""Nodal speeds, and motions since the last listing of pairs, relative to the mean.

Common motion of all nodes closes no gap.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.mechanics.contact.thread_partition import FAR, FAST, MOTION, SPEED
from foldyn.mechanics.threads import largest, total, wait


@inner_scalar
def _moved(now, before, i, c):
    if before is None:
        return now[i, c]
    return now[i, c] - before[i, c]


@inner_scalar
def _mean(now, before, first, last, n):
    """Contribution of nodes first to last - 1 to the mean over n of now - before, (rows, 3)."""
    a, b, c = 0.0, 0.0, 0.0
    for i in range(first, last):
        a += _moved(now, before, i, 0) / n
        b += _moved(now, before, i, 1) / n
        c += _moved(now, before, i, 2) / n
    return a, b, c


@inner_scalar
def _largest(now, before, first, last, a, b, c):
    """Largest deviation of now - before of these nodes from a mean; inf if not finite."""
    if not abs(a) + abs(b) + abs(c) < math.inf:
        return math.inf
    worst = 0.0
    for i in range(first, last):
        square = 0.0
        square += (_moved(now, before, i, 0) - a) ** 2
        square += (_moved(now, before, i, 1) - b) ** 2
        square += (_moved(now, before, i, 2) - c) ** 2
        worst = max(worst, square)
    return math.sqrt(worst)


@inner
def fastest(v, n):
    """Largest speed (m/s) of n nodes relative to the mean."""
    a, b, c = _mean(v, None, 0, n, n)
    return _largest(v, None, 0, n, a, b, c)


@inner
def farthest(u, memory):
    """Largest motion (m) of a node since the last listing of pairs, relative to the mean."""
    n = len(memory.x)
    a, b, c = _mean(u, memory.listed, 0, n, n)
    return _largest(u, memory.listed, 0, n, a, b, c)


@inner_scalar
def motions(u, v, memory):
    """Both `fastest` and `farthest` over a team, whose members check their own nodes.

    Synchronizes the team.
    """
    team, n = memory.share.team, len(memory.x)
    note, first, last = team.note[team.number], memory.share.own[0], memory.share.own[1]
    note[SPEED], note[SPEED + 1], note[SPEED + 2] = _mean(v, None, first, last, n)
    note[MOTION], note[MOTION + 1], note[MOTION + 2] = _mean(u, memory.listed, first, last, n)
    wait(team)
    a, b, c = total(team, SPEED), total(team, SPEED + 1), total(team, SPEED + 2)
    note[FAST] = _largest(v, None, first, last, a, b, c)
    a, b, c = total(team, MOTION), total(team, MOTION + 1), total(team, MOTION + 2)
    note[FAR] = _largest(u, memory.listed, first, last, a, b, c)
    wait(team)
    return largest(team, FAST), largest(team, FAR)
