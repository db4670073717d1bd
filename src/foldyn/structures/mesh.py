"""A pattern's panels cut into triangles: inner bars, bends, and the wings of creases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern


@dataclass(frozen=True, eq=False)
class Mesh:
    """Panels as triangles.

    Attributes
    ----------
    nodes : (n, 3)
        The pattern's vertices, then the panel centers in panel order.
    centers : (np,)
        Node number of each panel's center, -1 without one.
    inner, inner_panel : (nh, 2), (nh,)
        Bars inside panels, sorted by panel, the panel of each.
    bends : (nh, 4)
        Hinge on each inner bar: axis j, k, wings i, l.
    triangles, triangle_panel : (nt, 3), (nt,)
        Counter-clockwise from the front.
    folds : (nc, 4)
        Hinge on each crease, in the pattern's order.
    """

    nodes: NDArray
    centers: NDArray
    inner: NDArray
    inner_panel: NDArray
    bends: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    folds: NDArray

    def triangle_areas(self) -> NDArray:
        """Area of each triangle (nt,), m2."""
        a, b, c = (self.nodes[self.triangles[:, k]] for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def fold_rows(pattern: Pattern, triangles: NDArray, triangle_panel: NDArray) -> NDArray:
    """Hinge rows of the creases: j to k runs along the crease as wing i's panel does.

    Wing i is the third corner of the triangle that runs low to high, wing l that of the other.
    """
    third = third_corners(triangles.tolist(), triangle_panel.tolist())
    rows = [
        (low, high, third[front, low, high], third[back, high, low])
        for (low, high), (front, back) in zip(
            pattern.creases.tolist(), pattern.crease_faces.tolist(), strict=True
        )
    ]
    return np.array(rows, np.int64).reshape(-1, 4)


def third_corners(triangles: list, panels: list) -> dict[tuple[int, int, int], int]:
    """Third corner of the triangle of a panel that runs a to b, by (panel, a, b).

    By panel, because a diagonal of one panel may be an edge of another.
    """
    third = {}
    for panel, (a, b, c) in zip(panels, triangles, strict=True):
        third[panel, a, b], third[panel, b, c], third[panel, c, a] = c, a, b
    return third


def check_triangles(mesh: Mesh, pattern: Pattern, remedy: str) -> Mesh:
    """Refuse a mesh with a flat or inside-out triangle, naming its panel."""
    a, b, c = (mesh.nodes[mesh.triangles[:, k]] for k in range(3))
    normals = pattern.face_normals[mesh.triangle_panel]
    signed = 0.5 * np.einsum("ij,ij->i", np.cross(b - a, c - a), normals)
    small = signed <= 1e-9 * pattern.face_areas[mesh.triangle_panel]
    if small.any():
        panel = int(mesh.triangle_panel[small][0])
        raise InputError(
            f"panel {panel} (vertices {', '.join(map(str, pattern.faces[panel]))}) is cut into a "
            f"triangle that is degenerate or inside out: {remedy}"
        )
    return mesh
