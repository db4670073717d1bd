"""Conditions on the layer order of a flat-folded sheet under which no panel crosses another.

For each pair of overlapping panels, the order x is 1 if the lower-numbered panel lies above the
other, and -1 if below; x_ba = -x_ab. The conditions are from J. Justin (Towards a mathematical
theory of origami, 1997), in the form of H. Akitaya, J. Ku and others (Computing flat-folded states,
8OSME, 2024), for creases (a, b) and (c, d) that lie on each other, and a panel c with a crease
through it:

    valley, a facing up              x_ab = -1      mountain: 1; the reverse if a faces down
    crease and panel                 x_ac x_bc = 1
    two folds, same side             x_ac x_ad x_bc x_bd = 1
    fold, and a flat crease          x_ac x_bc = 1, c on the side of the fold
    two flat creases                 x_ac x_bd = 1, a and c on one side
    three panels at a point          not x_ab = x_bc = x_ca

All but the last are products; a fold has both panels on one side, a flat crease on two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from foldyn.errors import ComputationError
from foldyn.patterns import Pattern

MOST_TRIPLES = 1_000_000
GRID = 0.1  # of the smallest distance that counts


class FlatState(NamedTuple):
    """A folded sheet that lies flat.

    points : (n, 2), m. up : (nf,), whether a panel's front faces up. signs : (nc,), 1 for
    valleys, -1 for mountains, 0 for others. near : distance (m) that counts as zero.
    """

    points: NDArray
    up: NDArray
    signs: NDArray
    near: float


class LayerConstraints(NamedTuple):
    """Conditions on the order of panels that overlap.

    Attributes
    ----------
    pairs : (k, 2)
        Panels that overlap, the lower number first.
    products : list of (tuple of int, int)
        Rows of `pairs`, and the product of their orders.
    triples, turns : (t, 3)
        Three rows of `pairs` each, and the signs with which their orders must not all be equal.
    """

    pairs: NDArray[np.int64]
    products: list[tuple[tuple[int, ...], int]]
    triples: NDArray[np.int64]
    turns: NDArray[np.int64]


def layer_constraints(pattern: Pattern, state: FlatState) -> LayerConstraints:
    """Conditions on the layers of a pattern in a flat state.

    Overlaps of no more than the distance that counts as zero are ignored.

    Raises
    ------
    ComputationError
        Too many panels lie on each other.
    """
    panels = [shapely.Polygon(state.points[list(face)]) for face in pattern.faces]
    inside = np.asarray(shapely.buffer(panels, -state.near, join_style="mitre"))
    pairs, common = _overlaps(inside, state.near)
    row = {(a, b): k for k, (a, b) in enumerate(pairs.tolist())}
    products = []

    def multiplied(orders: list[tuple[int, int]], value: int) -> None:
        """Add a product if all its pairs of panels overlap."""
        rows = [row.get((min(a, b), max(a, b)), -1) for a, b in orders]
        if min(rows) >= 0:
            value *= int(np.prod([1 if a < b else -1 for a, b in orders]))
            products.append((tuple(rows), value))

    edges = np.concatenate([pattern.creases, pattern.welds]).astype(np.int64)
    sides = np.concatenate([pattern.crease_faces, pattern.weld_faces]).astype(np.int64)
    side = np.where(state.up[sides], 1, -1) * [1, -1]  # left of low to high: 1
    is_fold = side[:, 0] == side[:, 1]
    for (a, b), sign in zip(pattern.crease_faces.tolist(), state.signs.tolist(), strict=True):
        if sign and state.up[a] != state.up[b]:
            multiplied([(a, b)], -int(sign) if state.up[a] else int(sign))
    lines = np.asarray(shapely.linestrings(state.points[edges])).reshape(-1)
    for e, c in _through(lines, inside, state.near):
        a, b = sides[e].tolist()
        multiplied([(a, c), (b, c)], 1)
    for e, f, way in _upon(state.points[edges], lines, state.near):
        (a, b), (c, d) = sides[e].tolist(), sides[f].tolist()
        if is_fold[e] and is_fold[f]:
            if side[e, 0] == way * side[f, 0]:
                multiplied([(a, c), (a, d), (b, c), (b, d)], 1)
        elif is_fold[e]:
            same = c if side[e, 0] == way * side[f, 0] else d
            multiplied([(a, same), (b, same)], 1)
        elif is_fold[f]:
            same = a if side[f, 0] == way * side[e, 0] else b
            multiplied([(c, same), (d, same)], 1)
        else:
            if side[e, 0] != way * side[f, 0]:
                c, d = d, c
            multiplied([(a, c), (b, d)], 1)
    triples = _triples(pairs, common, inside, row)
    return LayerConstraints(pairs, products, triples, np.tile([1, 1, -1], (len(triples), 1)))


def _overlaps(inside: NDArray, near: float) -> tuple[NDArray[np.int64], NDArray]:
    """Pairs of polygons that overlap, the lower number first, and their intersections."""
    one, other = shapely.STRtree(inside).query(inside, predicate="intersects")
    one, other = one[one < other], other[one < other]
    order = np.lexsort((other, one))
    one, other = one[order], other[order]
    # on a grid: else the overlay finds nothing for panels that differ by round-off alone
    grid = GRID * near
    common = np.asarray(shapely.intersection(inside[one], inside[other], grid_size=grid)).reshape(
        -1
    )
    kept = shapely.area(common) > near**2
    return np.stack([one, other], axis=1)[kept].astype(np.int64), common[kept]


def _through(lines: NDArray, inside: NDArray, near: float) -> list[tuple[int, int]]:
    """Pairs of a line and a polygon that it runs through."""
    line, panel = shapely.STRtree(inside).query(lines, predicate="intersects")
    within = shapely.length(shapely.intersection(lines[line], inside[panel])) > near
    return list(zip(line[within].tolist(), panel[within].tolist(), strict=True))


def _upon(ends: NDArray, lines: NDArray, near: float) -> list[tuple[int, int, int]]:
    """Pairs of lines that lie on each other; 1 if they run the same way, else -1."""
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=near)
    one, other = one[one < other], other[one < other]
    vector = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(vector, axis=1)
    unit = vector / length[:, None]
    offset = ends[other] - ends[one][:, :1]
    along = np.sort(np.einsum("kei,ki->ke", offset, unit[one]), axis=1)
    start, end = np.maximum(along[:, 0], 0.0), np.minimum(along[:, 1], length[one])
    # distance of the other line from the middle of the common part
    middle = ends[one, 0] + 0.5 * (start + end)[:, None] * unit[one] - ends[other, 0]
    apart = np.abs(middle[:, 0] * unit[other][:, 1] - middle[:, 1] * unit[other][:, 0])
    turn = np.abs(unit[one][:, 0] * unit[other][:, 1] - unit[one][:, 1] * unit[other][:, 0])
    kept = (end - start > 4.0 * near) & (apart < near) & (turn * (end - start) < 2.0 * near)
    way = np.where(np.einsum("ki,ki->k", unit[one], unit[other]) > 0.0, 1, -1)
    return list(zip(one[kept].tolist(), other[kept].tolist(), way[kept].tolist(), strict=True))


def _triples(
    pairs: NDArray, common: NDArray, inside: NDArray, row: dict[tuple[int, int], int]
) -> NDArray[np.int64]:
    """Rows (t, 3) of the pairs (a, b), (b, c) and (a, c) of panels that share an area."""
    over: list[set[int]] = [set() for _ in inside]
    for a, b in pairs.tolist():
        over[a].add(b)
    rows, thirds = [], []
    for k, (a, b) in enumerate(pairs.tolist()):
        found = over[a] & over[b]
        rows += [k] * len(found)
        thirds += sorted(found)
        if len(rows) > MOST_TRIPLES:
            raise ComputationError(
                f"the order of the layers is not looked for: more than {MOST_TRIPLES} times three "
                "panels lie upon each other"
            )
    shapely.prepare(common)
    shared = shapely.intersects(common[rows], inside[thirds])
    rows, thirds = np.array(rows, np.int64)[shared], np.array(thirds, np.int64)[shared]
    ends = pairs[rows]
    found = [
        (k, row[b, c], row[a, c])
        for k, (a, b), c in zip(rows.tolist(), ends.tolist(), thirds.tolist(), strict=True)
    ]
    return np.array(found, np.int64).reshape(-1, 3)
