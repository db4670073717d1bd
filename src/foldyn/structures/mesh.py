"""A pattern's panels cut into triangles, with inner bars, bends and the hinges of creases."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from foldyn import mechanics
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around

CUT = 'cut it with fd.convex(pattern) (in a case file, leave out facets = "line")'
"""Remedy for panels that are not convex."""
PARALLEL = 1e-12  # squared sine of the angle between two vectors that count as parallel
Triangle = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Panels as triangles.

    Attributes
    ----------
    nodes : (n, 3)
        The pattern's vertices, then the panel centers in panel order.
    centers : (np,)
        Node number of each panel's center, -1 if it has none.
    inner, inner_panel : (nh, 2), (nh,)
        Bars inside panels, sorted by panel, and the panel of each.
    bends : (nh, 4)
        Hinge on each inner bar: axis j, k, wings i, l.
    triangles, triangle_panel : (nt, 3), (nt,)
        Counter-clockwise from the front.
    folds, welds : (nc, 4), (nw, 4)
        Hinge on each crease and on each weld, in the pattern's order.
    """

    nodes: NDArray
    centers: NDArray
    inner: NDArray
    inner_panel: NDArray
    bends: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    folds: NDArray
    welds: NDArray


def n5b8(pattern: Pattern, centers: Mapping[int, NDArray] | None = None) -> Mesh:
    """Mesh of a pattern with a center node in each panel of more than three corners.

    centers : center points by panel index, in place of computed ones.
    """
    sizes = np.array([len(face) for face in pattern.faces])
    number = np.where(sizes > 3, len(pattern.vertices) + np.cumsum(sizes > 3) - 1, -1).tolist()
    points = np.zeros((len(sizes), 3))
    quads = np.array([face for face in pattern.faces if len(face) == 4], np.int64).reshape(-1, 4)
    points[sizes == 4] = quad_centers(pattern.vertices[quads])
    for panel in np.flatnonzero(sizes > 4).tolist():
        points[panel] = polygon_center(pattern.vertices[list(pattern.faces[panel])])
    lost = np.flatnonzero(np.isnan(points).any(axis=1))
    if lost.size:
        raise InputError(
            f"panel {lost[0]}: is so narrow that rounding hides where its diagonals cross; cut "
            'it into shorter panels, or use scheme = "n4b5"'
        )
    for panel, point in (centers or {}).items():
        points[panel] = point

    def spokes(panel: int) -> tuple[list[Triangle], list[Edge]]:
        face, hub = pattern.faces[panel], number[panel]
        if hub < 0:
            return [(face[0], face[1], face[2])], []
        return [(a, b, hub) for a, b in around(face)], [(hub, a) for a in face]

    nodes = np.concatenate([pattern.vertices, points[sizes > 3]])
    remedy = f"its center cannot see every edge; {CUT}"
    return _mesh(pattern, nodes, np.array(number), spokes, remedy)


def too_narrow(pattern: Pattern) -> InputError:
    """Message for panels whose stiffness is lost in rounding, with the narrowest panel."""
    widths = pattern.face_areas / np.array([sides.sum() for sides in pattern.sides]) ** 2
    return InputError(
        f"panel {int(widths.argmin())}: is so narrow that rounding hides its stiffness; cut it "
        "into shorter panels"
    )


def n4b5(pattern: Pattern) -> Mesh:
    """Mesh of a pattern whose panels are cut by diagonals, without further nodes.

    A quadrilateral is cut at its shorter diagonal inside the panel (if both are equal, between
    corners 0 and 2), a larger polygon recursively at its shortest diagonal.
    """

    def diagonals(panel: int) -> tuple[list[Triangle], list[Edge]]:
        return _cut(list(pattern.faces[panel]), pattern, panel)

    none = np.full(len(pattern.faces), -1)
    return _mesh(pattern, pattern.vertices, none, diagonals, f"it is bent, or not convex; {CUT}")


def _mesh(
    pattern: Pattern, nodes: NDArray, centers: NDArray,
    cut: Callable[[int], tuple[list[Triangle], list[Edge]]], remedy: str,
) -> Mesh:  # fmt: skip
    """Mesh of a pattern whose panels are each `cut` into triangles with inner bars.

    The axis of a hinge runs from j to k, the direction in which wing i's triangle passes the
    crease. Wing i is the third corner of the triangle that passes it from the lower to the higher
    vertex; wing l is the third corner of the other triangle. At junctions they are those of the
    first and the second panel.
    """
    triangles, triangle_panel, inner, inner_panel = [], [], [], []
    third = {}  # third corner by panel and directed side: a diagonal may be another panel's edge
    for panel in range(len(pattern.faces)):
        pieces, bars = cut(panel)
        for a, b, c in pieces:
            third[panel, a, b], third[panel, b, c], third[panel, c, a] = c, a, b
        triangles += pieces
        triangle_panel += [panel] * len(pieces)
        inner += bars
        inner_panel += [panel] * len(bars)
    owned = zip(inner_panel, inner, strict=True)
    bends = [(a, b, third[panel, a, b], third[panel, b, a]) for panel, (a, b) in owned]

    def hinges(*creases: NDArray) -> NDArray:
        rows = []
        for edge, panels, ways in zip(*(each.tolist() for each in creases), strict=True):
            there, back = edge[:: ways[0]], edge[:: -ways[1]]
            rows.append((*edge, third[panels[0], *there], third[panels[1], *back]))
        return _rows(rows, 4)

    mesh = Mesh(
        nodes=nodes,
        centers=centers,
        inner=_rows(inner, 2),
        inner_panel=np.array(inner_panel, np.int64),
        bends=_rows(bends, 4),
        triangles=_rows(triangles, 3),
        triangle_panel=np.array(triangle_panel, np.int64),
        folds=hinges(pattern.creases, pattern.crease_faces, pattern.crease_ways),
        welds=hinges(pattern.welds, pattern.weld_faces, pattern.weld_ways),
    )
    check_triangles(nodes, mesh.triangles, mesh.triangle_panel, pattern, remedy)
    return mesh


def _rows(rows: list, width: int) -> NDArray:
    return np.array(rows, np.int64).reshape(-1, width)


def lengths(x: NDArray, pairs: NDArray) -> NDArray:
    """Distances (k,) between the points of pairs (k, 2), x (n, 3)."""
    return np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)


def double_areas(x: NDArray, triangles: NDArray) -> NDArray:
    """Normals (nt, 3) of triangles (nt, 3) of points x (n, 3), with length twice the area."""
    a, b, c = (x[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def hinge_angles(x: NDArray, hinges: NDArray) -> NDArray:
    """Dihedrals (rad) of hinge rows (nh, 4) at node positions x (n, 3)."""
    centered = np.ascontiguousarray(x - x.mean(axis=0))  # as `mechanics.build` does
    return mechanics.angles(centered, np.ascontiguousarray(hinges, np.uint32))


def check_triangles(
    nodes: NDArray, triangles: NDArray, panels: NDArray, pattern: Pattern, remedy: str
) -> None:
    """Refuse degenerate and inside-out triangles, naming their panel."""
    normals = pattern.face_normals[panels]
    signed = 0.5 * np.einsum("ij,ij->i", double_areas(nodes, triangles), normals)
    sides = nodes[np.roll(triangles, -1, axis=1)] - nodes[triangles]
    small = signed <= 1e-9 * np.square(sides).sum(axis=2).max(axis=1)
    if small.any():
        panel = int(panels[small][0])
        raise InputError(
            f"panel {panel} (vertices {', '.join(map(str, pattern.faces[panel]))}) is cut into a "
            f"triangle that is degenerate or inside out: {remedy}"
        )


def _cut(face: list[int], pattern: Pattern, number: int) -> tuple[list[Triangle], list[Edge]]:
    """Triangles and diagonals of a face, by recursion."""
    if len(face) == 3:
        return [(face[0], face[1], face[2])], []
    x = _in_plane(pattern.vertices[face], pattern.face_normals[number])
    i, j = _shortest_diagonal(x, pattern.vertices[face], number, face)
    left, left_cuts = _cut(face[i : j + 1], pattern, number)
    right, right_cuts = _cut(face[j:] + face[: i + 1], pattern, number)
    return left + right, [(face[i], face[j]), *left_cuts, *right_cuts]


def _in_plane(x: NDArray, normal: NDArray) -> NDArray:
    """Coordinates (m, 2) in the plane normal to `normal`, counter-clockwise about it."""
    first = x[1] - x[0] - ((x[1] - x[0]) @ normal) * normal
    first /= np.linalg.norm(first)
    return (x - x[0]) @ np.stack([first, np.cross(normal, first)], 1)


def _shortest_diagonal(flat: NDArray, x: NDArray, number: int, face: list[int]) -> tuple[int, int]:
    m = len(flat)
    best, chosen = np.inf, None
    for i in range(m):
        for j in range(i + 2, m):
            if (i, j) == (0, m - 1):
                continue
            length = np.linalg.norm(x[j] - x[i])
            if length < best * (1.0 - 1e-12) and _inside(flat, i, j):
                best, chosen = length, (i, j)
    if chosen is None:
        raise InputError(
            f"panel {number} (vertices {', '.join(map(str, face))}) has no diagonal inside it: "
            "its outline crosses itself; correct the panel"
        )
    return chosen


def _inside(flat: NDArray, i: int, j: int) -> bool:
    """Whether the diagonal i-j runs inside the counter-clockwise polygon `flat`."""
    m = len(flat)

    def turn(a, b, c):
        u, v = flat[b] - flat[a], flat[c] - flat[a]
        return u[0] * v[1] - u[1] * v[0]

    def in_cone(a, b):
        before, after = (a - 1) % m, (a + 1) % m
        if turn(before, a, after) >= 0:
            return turn(a, b, before) > 0 and turn(b, a, after) > 0
        return not (turn(a, b, after) >= 0 and turn(b, a, before) >= 0)

    if not (in_cone(i, j) and in_cone(j, i)):
        return False
    for p in range(m):
        q = (p + 1) % m
        if p in (i, j) or q in (i, j):
            continue
        if turn(i, j, p) * turn(i, j, q) < 0 and turn(p, q, i) * turn(p, q, j) < 0:
            return False
    return True


def quad_centers(x: NDArray) -> NDArray:
    """Crossing of the diagonals of quadrilaterals x (m, 4, 3).

    If a panel is not flat, the center is the point of the shorter diagonal that is closest to the
    other diagonal; if both are equally long, it lies on the diagonal through corners 1 and 3
    (counted from 0). nan if the diagonals are parallel within rounding.
    """
    p, q = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
    start = x[:, 1] - x[:, 0]
    pp, qq, pq = (np.einsum("ij,ij->i", a, b) for a, b in ((p, p), (q, q), (p, q)))
    ps, qs = np.einsum("ij,ij->i", p, start), np.einsum("ij,ij->i", q, start)
    determinant = pp * qq - pq * pq
    determinant[determinant <= PARALLEL * pp * qq] = np.nan
    on_p = (ps * qq - pq * qs) / determinant
    on_q = (pq * ps - pp * qs) / determinant
    first = (pp < qq * (1.0 - 1e-12))[:, None]
    return np.where(first, x[:, 0] + on_p[:, None] * p, x[:, 1] + on_q[:, None] * q)


def polygon_center(x: NDArray) -> NDArray:
    """Point of a polygon x (m, 3) that minimizes sum |(xj - c) x (xi - c)| / Lij^2 over diagonals.

    This sum of weighted distances to lines is convex and piecewise linear, so its minimum is at a
    crossing of two diagonals. If several crossings tie, the result is the mean of the corners if
    that is a minimizer too, else the mean of the tied crossings. A polygon that is not flat is
    projected on its mean plane to find crossings.
    """
    origin = x.mean(axis=0)
    _, _, axes = np.linalg.svd(x - origin)
    flat = (x - origin) @ axes[:2].T
    m = len(x)
    pairs = [(i, j) for i in range(m) for j in range(i + 2, m) if (i, j) != (0, m - 1)]
    start = flat[[i for i, _ in pairs]]
    along = flat[[j for _, j in pairs]] - start
    length = np.linalg.norm(along, axis=1)
    normal = np.stack([-along[:, 1], along[:, 0]], 1) / length[:, None]
    offset = np.einsum("ij,ij->i", normal, start)

    def total(points: NDArray) -> NDArray:
        return (np.abs(points @ normal.T - offset) / length).sum(axis=1)

    crossings = [np.zeros(2)]
    for two in map(list, combinations(range(len(pairs)), 2)):
        if abs(np.linalg.det(normal[two])) > 1e-9:
            crossings.append(np.linalg.solve(normal[two], offset[two]))
    candidates = np.array(crossings)
    value = total(candidates)
    tied = value <= value.min() + 1e-9
    best = candidates[0] if tied[0] else candidates[tied].mean(axis=0)
    return origin + best @ axes[:2]
