"""Lists of near pairs, found by sorting into the cells of a grid.

A list holds all pairs closer than d0 + skin, and all pairs tied by friction. It is valid until a
node has moved by half the skin relative to the mean motion: common motion of all nodes closes no
gap. Every new list keeps the tied pairs, however far apart they are: a Newton step may lead far
away before it is shortened.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.contact_state import FAR, FAST, MOTION, SPEED, pass_on
from foldyn.mechanics.contact.distances import VERTEX, edge_gap, gap_of, vertex_gap
from foldyn.mechanics.contact.planes import LEAST
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
    """Largest deviation of now - before from the mean (a, b, c); inf if that is not finite."""
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


@kernel
def take_ties(memory):
    """Of all m tied pairs: kind and both parts (m, 3); d0 and tie (m, 5)."""
    count = 0
    for go in range(2):
        if go == 1:
            parts, ties = np.empty((count, 3), np.int64), np.empty((count, 5))
        count = 0
        for kind in range(2):
            listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
            for k in range(listed):
                if memory.tie[kind, k, 2] == 0.0:
                    continue
                if go == 1:
                    parts[count, 0] = kind
                    pair, tie = memory.pairs[kind, k], memory.tie[kind, k]
                    parts[count, 1], parts[count, 2] = pair[0], pair[1]
                    ties[count, 0] = memory.d0[kind, k]
                    for c in range(tie.size):
                        ties[count, 1 + c] = tie[c]
                count += 1
    return parts, ties


@kernel
def lay_ties(memory, parts, ties):
    """Make a list of only the pairs from `take_ties`; the next list takes them over."""
    counts = memory.counts
    counts.has_list = counts.listed_first = counts.listed_second = 0
    for m in range(len(parts)):
        kind = parts[m, 0]
        k = counts.listed_first if kind == VERTEX else counts.listed_second
        memory.pairs[kind, k, 0], memory.pairs[kind, k, 1] = parts[m, 1], parts[m, 2]
        memory.d0[kind, k] = ties[m, 0]
        for c in range(ties.shape[1] - 1):
            memory.tie[kind, k, c] = ties[m, 1 + c]
        if kind == VERTEX:
            counts.listed_first = k + 1
        else:
            counts.listed_second = k + 1


@inner
def put_ties(tables, memory, parts, ties, loose, found):
    """In a new list of found[kind] pairs, tie the pairs that `take_ties` returned.

    Missing pairs are added and counted in `found`; `loose`: whether to include pairs that did not
    touch. New lists are ordered by triangles and first edges.
    """
    for kind in range(2):
        memory.tie[kind, : found[kind], 2:] = 0.0
    fresh = found[0], found[1]
    for m in range(len(parts)):
        kind = parts[m, 0]
        pairs, key = memory.pairs[kind], 1 if kind == VERTEX else 0
        k, last = _begin(pairs, key, parts[m, 1 + key], fresh[kind]), fresh[kind]
        while k < last and pairs[k, key] == parts[m, 1 + key]:
            if pairs[k, 1 - key] == parts[m, 2 - key]:
                break
            k += 1
        if k == last or pairs[k, key] != parts[m, 1 + key]:
            if ties[m, 3] <= LEAST and not loose:
                continue
            k = found[kind]
            if k == len(pairs):
                found[kind] = len(pairs) + 1  # tells that the list is full
                return
            found[kind] += 1
            pairs[k, 0], pairs[k, 1], memory.d0[kind, k] = parts[m, 1], parts[m, 2], ties[m, 0]
            gap = gap_of(
                tables.triangles, tables.edges, memory.x, kind, parts[m, 1], parts[m, 2]
            )  # fmt: skip
            memory.gap[kind, k] = gap - ties[m, 0]
        for c in range(ties.shape[1] - 1):
            memory.tie[kind, k, c] = ties[m, 1 + c]


@inner
def _begin(pairs, key, value, count):
    """First of the pairs (m, 2), ordered by column `key`, whose key is at least `value`."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if pairs[middle, key] < value:
            low = middle + 1
        else:
            high = middle
    return low


CELLS = 8.0  # largest number of cells per node
THINNEST = 1e-3  # full lists halve the skin, but not below this share of it


@inner
def panel_d0(ranges, v, panel):
    """d0 (m) of a node against a panel; 0 if the node belongs to it."""
    for at in range(ranges.own_start[v], ranges.own_start[v + 1]):
        if ranges.own[at] == panel:
            return 0.0
    for at in range(ranges.near_start[v], ranges.near_start[v + 1]):
        if ranges.near[at] == panel:
            return ranges.near_d0[at]
    return 0.5 * (ranges.node_thickness[v] + ranges.panel_thickness[panel])


@inner
def edge_d0(ranges, edges, nodes, panels, i, j):
    """d0 (m) of two edges (e, 2) of panels (e, k); 0 if they share a panel or a node."""
    a, b, c, d = nodes[i, 0], nodes[i, 1], nodes[j, 0], nodes[j, 1]
    if a in (c, d) or b in (c, d):
        return 0.0
    for p in panels[i]:
        for q in panels[j]:
            if p >= 0 and p == q:
                return 0.0
    a, b, c, d = edges[i, 0], edges[i, 1], edges[j, 0], edges[j, 1]
    best = math.inf
    for side in range(panels.shape[1]):
        p, q = panels[i, side], panels[j, side]
        if q >= 0:
            best = min(best, 0.5 * (panel_d0(ranges, a, q) + panel_d0(ranges, b, q)))
        if p >= 0:
            best = min(best, 0.5 * (panel_d0(ranges, c, p) + panel_d0(ranges, d, p)))
    return best


@inner
def _corners(x, nodes, low, high):
    """Bounding box (3,), (3,) of some nodes; whether it is finite."""
    for c in range(3):
        low[c], high[c] = math.inf, -math.inf
        for k in range(nodes.size):
            low[c] = min(low[c], x[nodes[k], c])
            high[c] = max(high[c], x[nodes[k], c])
            if not abs(x[nodes[k], c]) < math.inf:
                return False
    return True


@inner
def _cells(low, high, size, most, counts):
    """Numbers (3,) of cells of at least `size`, enlarged to give at most `most` cells."""
    while True:
        cells = 1.0
        for c in range(3):
            cells *= math.floor((high[c] - low[c]) / size) + 1.0
        if cells <= most:
            break
        size *= 1.26
    for c in range(3):
        counts[c] = int((high[c] - low[c]) / size) + 1
    return size


@inner_scalar
def _cell(value, low, size, count):
    return min(count - 1, max(0, int((value - low) / size)))


@inner
def _sort(points, low, size, counts, start, items):
    """Sort points (m, 3) into cells; `items` lists them cell by cell."""
    start[:] = 0
    cell = np.empty(len(points), np.int64)
    for i in range(len(points)):
        a = _cell(points[i, 0], low[0], size, counts[0])
        b = _cell(points[i, 1], low[1], size, counts[1])
        c = _cell(points[i, 2], low[2], size, counts[2])
        cell[i] = (a * counts[1] + b) * counts[2] + c
        start[cell[i] + 1] += 1
    for k in range(start.size - 1):
        start[k + 1] += start[k]
    fill = start[:-1].copy()
    for i in range(len(points)):
        items[fill[cell[i]]] = i
        fill[cell[i]] += 1


@inner_scalar
def _within(x, v, low, high):
    """Whether a node is in a box."""
    inside = True
    for c in range(3):
        inside = inside and low[c] <= x[v, c] <= high[c]
    return inside


@inner_scalar
def _beside(x, edges, i, low, high):
    """Whether the bounding box of an edge meets a box."""
    for c in range(3):
        p, q = x[edges[i, 0], c], x[edges[i, 1], c]
        if max(p, q) < low[c] or min(p, q) > high[c]:
            return False
    return True


@inner
def _pairs(tables, x, kind, far, skin, low, size, counts, half, start, items, memory):
    """List vertex-triangle pairs, kind 0, or edge-edge pairs; return their number.

    half : (3,) half of the largest extent of the items, which are sorted by their centers.
    """
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    below, above = np.empty(3), np.empty(3)
    # unpacked, because arrays in tuples would be reference-counted for each pair
    surface, panels, edge_panels = tables.surface, tables.panel, tables.edge_panels
    edge_nodes = tables.edge_nodes
    ranges, pairs = tables.ranges, memory.pairs[kind]
    ds, gaps = memory.d0[kind], memory.gap[kind]
    found, room = 0, len(ds)
    elements = tables.triangles if kind == VERTEX else tables.edges
    for e in range(len(elements)):
        _corners(x, elements[e], below, above)
        for c in range(3):
            below[c] -= far
            above[c] += far
            first[c] = _cell(below[c] - half[c], low[c], size, counts[c])
            last[c] = _cell(above[c] + half[c], low[c], size, counts[c])
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * counts[1] + j) * counts[2]
                for at in range(start[row + first[2]], start[row + last[2] + 1]):
                    one, other, d0, gap = e, items[at], 0.0, math.inf
                    if kind == VERTEX:
                        one, other = surface[other], e
                        if _within(x, one, below, above):
                            gap = vertex_gap(x, elements, one, e)
                        if gap <= far:
                            d0 = panel_d0(ranges, one, panels[e])
                    elif other > e and _beside(x, elements, other, below, above):
                        gap = edge_gap(x, elements, e, other)
                        if gap <= far:
                            d0 = edge_d0(ranges, elements, edge_nodes, edge_panels, e, other)
                    if d0 == 0.0 or gap - d0 > skin:
                        continue
                    if found < room:
                        pairs[found, 0], pairs[found, 1] = one, other
                        ds[found], gaps[found] = d0, gap - d0
                    found += 1
    return found


@kernel
def list_pairs(tables, u, memory):
    """List all pairs closer than d0 + skin at memory.x, the positions at displacement u (n, 3).

    The skin shrinks if there is no room. If positions are not finite, or the room is still too
    small, no list is made, and forces are not finite.
    """
    x, counts, facts = memory.x, memory.counts, memory.facts
    counts.has_list = 0
    if tables.friction > 0.0:
        tied, ties = take_ties(memory)
    low, high, dims = np.empty(3), np.empty(3), np.empty(3, np.int64)
    counts.listed_first = counts.listed_second = 0
    if not _corners(x, tables.surface, low, high):
        counts.full = 1
        if tables.friction > 0.0:
            lay_ties(memory, tied, ties)
        return
    e = len(tables.edges)
    middle, half, none, mean = np.empty((e, 3)), np.zeros(3), np.zeros(3), 0.0
    for i in range(e):
        square = 0.0
        for c in range(3):
            p, q = x[tables.edges[i, 0], c], x[tables.edges[i, 1], c]
            middle[i, c] = 0.5 * (p + q)
            half[c] = max(half[c], 0.5 * abs(p - q))
            square += (p - q) ** 2
        mean += math.sqrt(square) / e
    vertices = np.empty((tables.surface.size, 3))
    for i in range(len(vertices)):
        for c in range(3):
            vertices[i, c] = x[tables.surface[i], c]
    skin, thinnest, found = tables.skin, THINNEST * tables.skin, np.zeros(2, np.int64)
    while True:
        far = tables.farthest + skin
        size = _cells(low, high, max(0.7 * mean, far), CELLS * len(x) + 64.0, dims)
        start = np.empty(dims[0] * dims[1] * dims[2] + 1, np.int64)
        items = np.empty(max(len(vertices), e), np.int64)
        _sort(vertices, low, size, dims, start, items)
        found[0] = _pairs(tables, x, 0, far, skin, low, size, dims, none, start, items, memory)
        _sort(middle, low, size, dims, start, items)
        found[1] = _pairs(tables, x, 1, far, skin, low, size, dims, half, start, items, memory)
        room = memory.d0.shape[1]
        if tables.friction > 0.0 and found.max() <= room:
            put_ties(tables, memory, tied, ties, skin == tables.skin, found)
        if found.max() <= room:
            break
        skin *= 0.5
        if skin < thinnest:
            counts.full = 1
            if tables.friction > 0.0:
                lay_ties(memory, tied, ties)
            return
    counts.full, counts.has_list = 0, 1
    counts.lists += 1
    counts.listed_first, counts.listed_second = found[0], found[1]
    facts.skin = skin
    for i in range(len(x)):
        for c in range(3):
            memory.listed[i, c] = u[i, c]


@inner
def relist(tables, u, memory):
    """Run `list_pairs` on the first team member for all, after a `wait` for all positions."""
    if memory.share.team.number == 0:
        list_pairs(tables, u, memory)
    pass_on(memory.share)


@kernel
def place(tables, u, memory):
    """Put positions at displacement u (rows, 3) into memory.x, for a member's own nodes."""
    for i in range(memory.share.own[0], memory.share.own[1]):
        for c in range(3):
            memory.x[i, c] = tables.rest[i, c] + u[i, c]


@kernel
def use_all(memory):
    """Mark all listed pairs as near."""
    for kind in range(2):
        count = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
        for k in range(count):
            memory.near[kind, k] = k
    memory.counts.near_first = memory.counts.listed_first
    memory.counts.near_second = memory.counts.listed_second


@inner
def follow(tables, u, memory):
    """Update the near pairs for any u.

    Call it after a `wait` for all positions; the first member does the work.
    """
    if memory.share.team.number == 0 and (
        memory.counts.has_list == 0 or not farthest(u, memory) < 0.5 * memory.facts.skin
    ):
        list_pairs(tables, u, memory)
        use_all(memory)
    pass_on(memory.share)
