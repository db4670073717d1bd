"""Quadrilateral panels cut into triangles, each panel with nodes of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern

ALIKE = 1e-9  # relative difference below which diagonals are equal


@dataclass(frozen=True, eq=False)
class Crease:
    """Where two panels meet.

    Attributes
    ----------
    axis, length
        Unit vector from the lower to the higher vertex, and the distance between them (m).
    nodes : (n + 1, 2)
        Pairs of nodes at one place: of the panel that runs along the axis when it is gone around
        counter-clockwise from the front, and of the other. The dihedral grows with the turn of
        the second against the first about the axis.
    """

    axis: NDArray
    length: float
    nodes: NDArray


@dataclass(frozen=True, eq=False)
class PanelMesh:
    """Triangles of all panels.

    Attributes
    ----------
    points : (n, 3)
        Nodes, m.
    triangles : (nt, 3)
        Counter-clockwise from the front.
    corners : tuple of tuples of int
        Nodes at each vertex of the pattern, one of every panel there.
    creases : tuple of Crease
        In the order of `pattern.creases`.
    """

    points: NDArray
    triangles: NDArray
    corners: tuple[tuple[int, ...], ...]
    creases: tuple[Crease, ...]


def panel_mesh(pattern: Pattern, divisions: int) -> PanelMesh:
    """Cut panels of four corners into 2 `divisions`^2 triangles each.

    Cells are cut along their shorter diagonal, alternately where both are alike.

    Raises
    ------
    InputError
        A panel has not four corners.
    """
    per_panel = (divisions + 1) ** 2
    points, triangles, sides = [], [], {}
    corners: list[list[int]] = [[] for _ in pattern.vertices]
    for number, face in enumerate(pattern.faces):
        if len(face) != 4:
            raise InputError(
                f"panel {number} has {len(face)} corners: this model takes panels of four"
            )
        at = pattern.vertices[list(face)]
        node = number * per_panel + np.arange(per_panel).reshape(divisions + 1, divisions + 1)
        points.append(_bilinear(at, divisions))
        triangles.append(_cut(node, at))
        for vertex, own in zip(face, node[[0, -1, -1, 0], [0, 0, -1, -1]].tolist(), strict=True):
            corners[vertex].append(own)
        around = (node[:, 0], node[-1], node[::-1, -1], node[0, ::-1])
        for a, b, side in zip(face, (*face[1:], face[0]), around, strict=True):
            sides[a, b] = side
    creases = tuple(_crease(pattern.vertices, a, b, sides) for a, b in pattern.creases.tolist())
    return PanelMesh(
        np.concatenate(points), np.concatenate(triangles), tuple(map(tuple, corners)), creases
    )


def _bilinear(corners: NDArray, n: int) -> NDArray:
    """Points ((n + 1)^2, 3) of a grid between four corners; the second index runs along 0-3."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=-1)
    return (weights @ corners).reshape(-1, 3)


def _cut(node: NDArray, corners: NDArray) -> NDArray:
    """Two triangles (2 n^2, 3) of each cell of a grid of nodes."""
    cell = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1)
    first, second = (np.linalg.norm(corners[k + 2] - corners[k]) for k in (0, 1))
    if abs(first - second) <= ALIKE * first:
        from_0 = np.indices(cell.shape[:2]).sum(axis=0) % 2 == 0
    else:
        from_0 = np.full(cell.shape[:2], first < second)
    along_0 = cell[from_0][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    along_1 = cell[~from_0][:, [[0, 1, 3], [1, 2, 3]]].reshape(-1, 3)
    return np.concatenate([along_0, along_1])


def _crease(vertices: NDArray, a: int, b: int, sides: dict[tuple[int, int], NDArray]) -> Crease:
    across = vertices[b] - vertices[a]
    length = float(np.linalg.norm(across))
    return Crease(across / length, length, np.stack([sides[a, b], sides[b, a][::-1]], axis=1))
