"""Scheme N5B8: every panel of more than three corners gets a center node and spokes to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.structures.mesh import Mesh, check_triangles, fold_rows

PARALLEL = 1e-12  # of two vectors: the squared sine of an angle that rounding spoils


def n5b8(pattern: Pattern, centers: dict[int, NDArray] | None = None) -> Mesh:
    """Mesh of a pattern with a center node in each panel of more than three corners.

    centers : center points by panel number, in place of the computed ones.
    """
    given = centers or {}
    sizes = np.array([len(f) for f in pattern.faces])
    number = np.where(sizes > 3, len(pattern.vertices) + np.cumsum(sizes > 3) - 1, -1)
    points = np.empty((int((sizes > 3).sum()), 3))
    spokes, owner, bends, triangles, triangle_panel = [], [], [], [], []
    for size in np.unique(sizes):
        panels = np.flatnonzero(sizes == size)
        corners = np.array([pattern.faces[p] for p in panels])
        after, before = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
        if size == 3:
            triangles.append(corners)
            triangle_panel.append(panels)
            continue
        x = pattern.vertices[corners]
        found = quad_centers(x) if size == 4 else np.array([polygon_center(p) for p in x])
        lost = panels[np.isnan(found).any(axis=1)]
        if lost.size:
            raise InputError(
                f"panel {lost[0]}: is so narrow that rounding hides where its diagonals cross; cut "
                'it into shorter panels, or use scheme = "n4b5"'
            )
        points[number[panels] - len(pattern.vertices)] = found
        hub = np.repeat(number[panels][:, None], size, axis=1)
        spokes.append(np.stack([hub, corners], -1).reshape(-1, 2))
        bends.append(np.stack([hub, corners, after, before], -1).reshape(-1, 4))
        triangles.append(np.stack([corners, after, hub], -1).reshape(-1, 3))
        triangle_panel.append(np.repeat(panels, size))
        owner.append(np.repeat(panels, size))
    for panel, point in given.items():
        points[number[panel] - len(pattern.vertices)] = point
    triangle_of = np.concatenate(triangle_panel)
    order = np.argsort(triangle_of, kind="stable")
    triangle_rows = np.concatenate(triangles)[order]
    owner_of = np.concatenate(owner) if owner else np.zeros(0, np.int64)
    by_panel = np.argsort(owner_of, kind="stable")

    def sort(parts, width):
        return np.concatenate(parts)[by_panel] if parts else np.zeros((0, width), np.int64)

    mesh = Mesh(
        nodes=np.concatenate([pattern.vertices, points]),
        centers=number,
        inner=sort(spokes, 2),
        inner_panel=owner_of[by_panel],
        bends=sort(bends, 4),
        triangles=triangle_rows,
        triangle_panel=triangle_of[order],
        folds=fold_rows(pattern, triangle_rows, triangle_of[order]),
    )
    return check_triangles(
        mesh, pattern, 'its center cannot see every edge; use scheme = "n4b5" or cut the panel'
    )


def quad_centers(x: NDArray) -> NDArray:
    """Crossing of the diagonals of quadrilaterals x (m, 4, 3).

    Where a panel is not flat, the point of the shorter diagonal that is nearest to the other;
    for equal ones, of the diagonal through corners 1 and 3 (counted from 0). nan where the
    diagonals are parallel to rounding.
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

    The sum is one of weighted distances to lines: convex and piecewise linear, so its minimum is
    at a crossing of two diagonals. Where several tie, the corners' mean if it is one of the
    minimizers, else the mean of the tied crossings. A polygon that is not flat is projected on
    its mean plane for this.
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
    for a in range(len(pairs)):
        for b in range(a + 1, len(pairs)):
            system = normal[[a, b]]
            if abs(np.linalg.det(system)) > 1e-9:
                crossings.append(np.linalg.solve(system, offset[[a, b]]))
    candidates = np.array(crossings)
    value = total(candidates)
    tied = value <= value.min() + 1e-9
    best = candidates[0] if tied[0] else candidates[tied].mean(axis=0)
    return origin + best @ axes[:2]
