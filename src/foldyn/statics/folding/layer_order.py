"""The layer order of a flat-folded sheet: found, or the reason why there is none.

For each pair of overlapping panels, the order x is 1 if the lower-numbered panel lies above the
other, and -1 if below; x_ba = -x_ab. No panel crosses another under these conditions, from J.
Justin (Towards a mathematical theory of origami, 1997), in the form of H. Akitaya, J. Ku and others
(Computing flat-folded states, 8OSME, 2024), for creases (a, b) and (c, d) that lie on each other,
and a panel c with a crease through it:

    valley, a facing up              x_ab = -1      mountain: 1; the reverse if a faces down
    crease and panel                 x_ac x_bc = 1
    two folds, same side             x_ac x_ad x_bc x_bd = 1
    fold, and a flat crease          x_ac x_bc = 1, c on the side of the fold
    two flat creases                 x_ac x_bd = 1, a and c on one side
    three panels at a point          not x_ab = x_bc = x_ca

All but the last are products; a fold has both panels on one side, a flat crease on two.

First, all orders implied by the known ones are set. The remaining pairs fall into independent
groups, each searched by guesses that are taken back if they fail (as in Flat-Folder by J. Ku and
others).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from foldyn.errors import ComputationError, InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import around, edge_lookup, edge_of
from foldyn.patterns.transforms import FACE_ORDERS

Orders = Sequence[Sequence[int]]
EXACT = 1e-6  # least tolerance for flatness, relative to the size of the pattern
MOST_TRIPLES = 1_000_000
GRID = 0.1  # grid size of intersections, relative to the distance that counts as zero
MOST_TRIES = 100_000  # guesses in one group


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
    triples : (t, 3)
        Rows of the pairs (a, b), (b, c) and (a, c) of three panels that share an area.
    """

    pairs: NDArray[np.int64]
    products: list[tuple[tuple[int, ...], int]]
    triples: NDArray[np.int64]


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
    return LayerConstraints(pairs, products, _triples(pairs, common, inside, row))


def _overlaps(inside: NDArray, near: float) -> tuple[NDArray[np.int64], NDArray]:
    """Pairs of polygons that overlap, the lower number first, and their intersections."""
    one, other = shapely.STRtree(inside).query(inside, predicate="intersects")
    one, other = one[one < other], other[one < other]
    order = np.lexsort((other, one))
    one, other = one[order], other[order]
    # on a grid: else the overlay finds nothing for panels that differ by round-off alone
    grid = GRID * near
    common = np.ravel(shapely.intersection(inside[one], inside[other], grid_size=grid))
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
                f"the order of the layers is not sought: more than {MOST_TRIPLES} triples of "
                "panels lie on each other"
            )
    shapely.prepare(common)
    shared = shapely.intersects(common[rows], inside[thirds])
    rows, thirds = np.array(rows, np.int64)[shared], np.array(thirds, np.int64)[shared]
    found = [
        (k, row[b, c], row[a, c])
        for k, (a, b), c in zip(rows.tolist(), pairs[rows].tolist(), thirds.tolist(), strict=True)
    ]
    return np.array(found, np.int64).reshape(-1, 3)


def flat_state(pattern: Pattern, angles: NDArray, closed: float) -> FlatState | None:
    """A folded pattern as a flat state; None if it does not lie flat.

    angles : fold angles (nc,), rad. closed : least size of a closed fold; one as close to 0 counts
    as open.
    """
    size = np.abs(angles)
    if ((size > math.pi - closed) & (size < closed)).any() or not (size >= closed).any():
        return None
    points, near = _flattened(pattern)
    up = [shapely.LinearRing(points[list(face)]).is_ccw for face in pattern.faces]
    signs = np.where(size >= closed, np.sign(angles), 0.0).astype(np.int64)
    return FlatState(points, np.array(up), signs, near)


def _flattened(pattern: Pattern) -> tuple[NDArray, float]:
    """Vertices (n, 2), m, in the plane of a sheet, and the distance that counts as zero.

    Separate sheets that do not lie in one plane are placed side by side, each in its own plane.
    """
    edges = np.array([pair for face in pattern.faces for pair in around(face)])
    size = len(pattern.vertices)
    graph = sparse.coo_array((np.ones(len(edges)), edges.T), shape=(size, size))
    part = csgraph.connected_components(graph, directed=False)[1]
    used = np.unique(edges)
    sheets = [used[part[used] == k] for k in np.unique(part[used])]
    planes = [_in_plane(pattern.vertices[rows]) for rows in sheets]
    near = max(EXACT * pattern.size, 2.0 * max(thickness for _, thickness in planes))
    together, thickness = _in_plane(pattern.vertices[used])
    if thickness <= near:
        sheets, planes, near = [used], [(together, thickness)], max(near, 2.0 * thickness)
    points, start = np.zeros((size, 2)), 0.0
    for rows, (flat, _) in zip(sheets, planes, strict=True):
        points[rows] = flat - flat.min(axis=0) + [start, 0.0]
        start = points[rows, 0].max() + pattern.size
    return points, near


def _in_plane(x: NDArray) -> tuple[NDArray, float]:
    """Points x (k, 3) in their plane (k, 2), and their thickness across it."""
    middle = x - x.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=False)[2]
    return middle @ axes[:2].T, float(np.ptp(middle @ axes[2]))


def with_layers(pattern: Pattern, angles: NDArray, closed: float, given: Orders) -> Pattern:
    """The pattern, with its layer order in its custom data if it lies flat.

    No order is stored if the search is given up. Arguments and errors are as in `flat_state` and
    `layer_order`.
    """
    state = flat_state(pattern, angles, closed)
    if state is None:
        return pattern
    try:
        orders = layer_order(pattern, state, given).tolist()
    except ComputationError:
        return pattern
    return pattern.changed(custom={**pattern.custom, FACE_ORDERS: orders})


def layer_order(pattern: Pattern, state: FlatState, given: Orders = ()) -> NDArray[np.int64]:
    """Layer order of overlapping panels: rows (f, g, s) as FOLD's faceOrders.

    s is 1 where panel f lies on the side of g to which the front of g faces, -1 on the other.
    `given` holds rows to satisfy.

    Raises
    ------
    InputError
        No order keeps the panels from passing through each other.
    ComputationError
        The search was given up.
    """
    constraints = layer_constraints(pattern, state)
    pairs = constraints.pairs
    row = edge_lookup(pairs)
    for f, g in pattern.crease_faces[state.signs != 0].tolist():
        if edge_of(f, g) not in row:
            raise ComputationError(
                f"the order of the layers is not sought: panels {f} and {g} lie on each other, but "
                f"are no larger than the tolerance of flatness, {state.near:.3g} m"
            )
    for f, g, side in given:
        if side and edge_of(f, g) in row:
            above = side if state.up[g] else -side
            constraints.products.append(((row[edge_of(f, g)],), above if f < g else -above))
    try:
        orders = ordered(constraints)
    except CrossingError as crossing:
        panels = np.unique(pairs[list(crossing.rows)]).tolist()
        raise InputError(
            ": lies flat when folded, but no order of its layers keeps panels from passing through "
            f"each other (found at panels {', '.join(map(str, panels))}); change assignments "
            "there, or fold it less",
            "pattern",
        ) from None
    above = np.where(state.up[pairs[:, 1]], orders, -orders)
    return np.column_stack([pairs, above])


class CrossingError(Exception):
    """One condition, on these rows of the pairs, cannot be satisfied."""

    def __init__(self, rows: tuple[int, ...]) -> None:
        super().__init__(rows)
        self.rows = rows


def ordered(constraints: LayerConstraints) -> NDArray[np.int64]:
    """Find an order, 1 or -1, for each of the k pairs so that all conditions hold.

    Raises
    ------
    CrossingError
        No orders satisfy all conditions; has the rows of the first condition that fails.
    ComputationError
        No orders were found within a bounded number of guesses.
    """
    search = _Search(constraints)
    search.propagate(range(len(search.conditions)))
    for group in search.groups():
        search.solve(group)
    return np.array(search.orders, np.int64)


class _Search:
    """Orders so far, and the conditions on each."""

    def __init__(self, constraints: LayerConstraints) -> None:
        self.orders = [0] * len(constraints.pairs)
        # a condition: rows, and the product (an int) or the signs (a tuple) that must not be equal
        self.conditions: list[tuple[tuple[int, ...], int | tuple[int, ...]]] = [
            *constraints.products,
            *((tuple(rows), (1, 1, -1)) for rows in constraints.triples.tolist()),
        ]
        self.of_row: list[list[int]] = [[] for _ in self.orders]
        for k, (rows, _) in enumerate(self.conditions):
            for row in rows:
                self.of_row[row].append(k)

    def propagate(self, touched) -> list[int]:
        """Set all orders that the touched conditions imply; returns the rows set."""
        orders, conditions = self.orders, self.conditions
        found, queue = [], list(touched)
        while queue:
            rows, rule = conditions[queue.pop()]
            open_ = [k for k, row in enumerate(rows) if not orders[row]]
            if len(open_) > 1:
                continue
            if isinstance(rule, int):
                value = rule
                for row in rows:
                    value *= orders[row] or 1
                if not open_:
                    if value < 0:
                        self.forget(found)
                        raise CrossingError(rows)
                    continue
            else:
                known = {rule[k] * orders[row] for k, row in enumerate(rows) if orders[row]}
                if len(known) > 1:
                    continue
                if not open_:
                    self.forget(found)
                    raise CrossingError(rows)
                value = -known.pop() * rule[open_[0]]
            row = rows[open_[0]]
            orders[row] = value
            found.append(row)
            queue += self.of_row[row]
        return found

    def forget(self, rows: list[int]) -> None:
        for row in rows:
            self.orders[row] = 0

    def groups(self) -> list[list[int]]:
        """Rows without an order, in groups that share no condition."""
        one, other = [], []
        for rows, _ in self.conditions:
            left = [row for row in rows if not self.orders[row]]
            one += left[:-1]
            other += left[1:]
        count = len(self.orders)
        graph = sparse.coo_array((np.ones(len(one)), (one, other)), (count, count))
        _, label = csgraph.connected_components(graph, directed=False)
        groups: dict[int, list[int]] = {}
        for row in range(count):
            if not self.orders[row]:
                groups.setdefault(int(label[row]), []).append(row)
        return list(groups.values())

    def solve(self, group: list[int]) -> None:
        """Order a group by guesses, taken back if they fail."""
        guesses: list[tuple[int, int, list[int]]] = []  # place in the group, value, implied rows
        place, value, tries = 0, 1, 0
        while True:
            while place < len(group) and self.orders[group[place]]:
                place += 1
            if place == len(group):
                return
            row = group[place]
            self.orders[row] = value
            tries += 1
            if tries > MOST_TRIES:
                raise ComputationError(
                    f"no order of the layers was found in {MOST_TRIES} guesses: {len(group)} pairs "
                    "of panels depend on each other"
                )
            try:
                guesses.append((place, value, self.propagate(self.of_row[row])))
                value = 1
            except CrossingError:
                self.orders[row] = 0
                while value < 0:
                    if not guesses:
                        raise
                    place, value, followed = guesses.pop()
                    self.forget([group[place], *followed])
                value = -1
