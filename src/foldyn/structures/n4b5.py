"""Scheme N4B5: panels cut by their shortest diagonals, no further nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.structures.mesh import Mesh, check_triangles, fold_rows, third_corners


def n4b5(pattern: Pattern) -> Mesh:
    """Mesh of a pattern whose panels are cut by diagonals.

    A quadrilateral is cut at its shorter diagonal inside the panel (tie: corners 0 and 2), a
    larger polygon recursively at the shortest one.
    """
    inner, owner, triangles, triangle_panel = [], [], [], []
    for number, face in enumerate(pattern.faces):
        pieces, cuts = _cut(list(face), pattern, number)
        inner += cuts
        owner += [number] * len(cuts)
        triangles += pieces
        triangle_panel += [number] * len(pieces)
    third = third_corners(triangles, triangle_panel)
    bends = [
        (a, b, third[panel, a, b], third[panel, b, a])
        for panel, (a, b) in zip(owner, inner, strict=True)
    ]
    rows = np.array(triangles, np.int64)
    mesh = Mesh(
        nodes=pattern.vertices,
        centers=np.full(len(pattern.faces), -1),
        inner=np.array(inner, np.int64).reshape(-1, 2),
        inner_panel=np.array(owner, np.int64),
        bends=np.array(bends, np.int64).reshape(-1, 4),
        triangles=rows,
        triangle_panel=np.array(triangle_panel, np.int64),
        folds=fold_rows(pattern, rows, np.array(triangle_panel)),
    )
    return check_triangles(mesh, pattern, "correct the panel or cut it into triangles")


def _cut(face: list[int], pattern: Pattern, number: int):
    """Triangles and diagonals of a face, by recursion."""
    if len(face) == 3:
        return [tuple(face)], []
    x = _in_plane(pattern.vertices[face], pattern.face_normals[number])
    i, j = _shortest_diagonal(x, pattern.vertices[face], number, face)
    left, left_cuts = _cut(face[i : j + 1], pattern, number)
    right, right_cuts = _cut(face[j:] + face[: i + 1], pattern, number)
    return left + right, [(face[i], face[j]), *left_cuts, *right_cuts]


def _in_plane(x: NDArray, normal: NDArray) -> NDArray:
    """Coordinates (m, 2) in the plane across `normal`, counter-clockwise seen from its tip."""
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
