"""Panels cut so that they can bend along lines from every corner.

A crease pattern whose panels are cut once, or not at all, has few ways to bend: a triangle has
none. In its barycentric subdivision each triangle of a panel becomes six, around its centroid, and
each edge becomes two. Lines within panels are welds, across which the sheet continues.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import edge_lookup, edge_of
from foldyn.structures.mesh import n4b5

SLIVER = 1e-4  # height over length


def are_slivers(corners: NDArray) -> NDArray[np.bool_]:
    """Whether triangles (k, 3, 3), by their corners, are much longer than wide."""
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return area < SLIVER * (sides**2).sum(axis=2).max(axis=1)


def _sides(triangles: NDArray) -> tuple[NDArray, NDArray[np.int64]]:
    """Distinct sides (k, 2) of triangles (n, 3), and the rows (n, 3) of each triangle's sides."""
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    sides, row = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    return sides, row.reshape(-1, 3)


def subdivided(pattern: Pattern) -> tuple[Pattern, NDArray[np.int64]]:
    """Barycentric subdivision of a pattern, and the original crease (nc,) of each of its creases.

    The vertices of the pattern come first, then edge midpoints, then triangle centroids.

    Raises
    ------
    InputError
        A panel with three corners on a line.
    """
    mesh = n4b5(pattern)
    triangles = mesh.triangles
    narrow = mesh.triangle_panel[are_slivers(pattern.vertices[triangles])]
    if narrow.size:
        raise InputError(
            f' = "subdivided": panel {narrow[0]} has three corners on a line, which leave a '
            'sliver; take "whole", or divide the panel at the one in the middle',
            "panels",
        )
    edges, middle = _sides(triangles)
    middle += len(pattern.vertices)
    center = middle.max() + 1 + np.arange(len(triangles))
    points = np.concatenate([
        pattern.vertices, pattern.vertices[edges].mean(axis=1),
        pattern.vertices[triangles].mean(axis=1),
    ])  # fmt: skip
    halves = [
        np.stack([triangles, middle, np.tile(center[:, None], 3)], axis=2),
        np.stack([middle, np.roll(triangles, -1, axis=1), np.tile(center[:, None], 3)], axis=2),
    ]
    faces = np.stack(halves, axis=2).reshape(-1, 3).tolist()
    number = {edge_of(*edge): len(pattern.vertices) + k for k, edge in enumerate(edges.tolist())}
    parent: dict[tuple[int, int], int] = {}
    for k, pair in enumerate(pattern.creases.tolist()):
        parent |= {edge_of(end, number[edge_of(*pair)]): k for end in pair}
    rim = {
        edge_of(end, number[edge_of(*pair)]) for pair in pattern.boundary.tolist() for end in pair
    }
    welds = [
        pair
        for a, b in _sides(np.array(faces))[0].tolist()
        if (pair := (a, b)) not in parent and pair not in rim
    ]
    families = {name: {*rows.tolist()} for name, rows in pattern.families.items()}
    letters, angles = pattern.assignments, pattern.fold_angles.tolist()
    made = Pattern(
        points, faces, {pair: letters[k] for pair, k in parent.items()}, pattern.name,
        fold_angles={pair: angles[k] for pair, k in parent.items()},
        families={
            name: [pair for pair, k in parent.items() if k in own]
            for name, own in families.items()
        },
        custom=pattern.custom, welds=welds,
    )  # fmt: skip
    row = edge_lookup(made.creases)
    rows = np.zeros(len(row), np.int64)
    for pair, k in parent.items():
        rows[row[pair]] = k
    return made, rows
