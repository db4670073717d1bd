"""`Panels` with data on their edges, and connected components."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from foldyn.patterns.topology import Edge, Faces, around, edge_of

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Panels:
    """Panels with data on their edges.

    Parameters
    ----------
    points : ndarray, shape (n, 2) or (n, 3)
        Coordinates.
    faces : tuple of tuple of int
        Panels, counter-clockwise in flat drawings.
    letters : dict
        Letter of each edge that has one, by its (low, high) pair of points.
    angles : dict
        Fold angle (degrees) of each edge that has one.
    """

    points: NDArray[np.float64]
    faces: Faces
    letters: dict[Edge, str]
    angles: dict[Edge, float]

    def sides(self) -> dict[Edge, list[int]]:
        """Numbers of the faces at each edge."""
        sides: dict[Edge, list[int]] = {}
        for number, face in enumerate(self.faces):
            for a, b in around(face):
                sides.setdefault(edge_of(a, b), []).append(number)
        return sides


def with_inner_borders(panels: Panels) -> tuple[Panels, int, int]:
    """Turn inner lines of the outline ("B") into cuts or creases; also return the number of each.

    In a drawing without other letters, lines connected to the outline are creases ("U") and closed
    lines inside are cuts; otherwise all are cuts. Joins ("J") become flat creases.
    """
    sides = panels.sides()
    letters = {edge: "F" if letter == "J" else letter for edge, letter in panels.letters.items()}
    inner = [edge for edge, at in sides.items() if len(at) > 1 and letters.get(edge) == "B"]
    if not inner:
        return Panels(panels.points, panels.faces, letters, panels.angles), 0, 0
    plain = set(letters.values()) == {"B"}
    part = components(list(letters), len(panels.points))  # as drawn, before panels were divided
    rim = {part[edge[0]] for edge, at in sides.items() if len(at) == 1}
    folds = [edge for edge in inner if plain and part[edge[0]] in rim]
    letters |= dict.fromkeys(inner, "C") | dict.fromkeys(folds, "U")
    panels = Panels(panels.points, panels.faces, letters, panels.angles)
    return panels, len(inner) - len(folds), len(folds)


def components(pairs: list[tuple[int, int]], size: int) -> NDArray[np.int64]:
    """Component number of each of the nodes (size,) connected by pairs."""
    rows = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(rows)), (rows[:, 0], rows[:, 1])), shape=(size, size))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def compact(panels: Panels) -> Panels:
    """Panels with only the points that they use, in order."""
    used = sorted({point for face in panels.faces for point in face})
    number = {point: k for k, point in enumerate(used)}
    faces = tuple(tuple(number[point] for point in face) for face in panels.faces)

    def renamed(known: dict[Edge, T]) -> dict[Edge, T]:
        return {
            (number[a], number[b]): value
            for (a, b), value in known.items()
            if a in number and b in number
        }

    return Panels(panels.points[used], faces, renamed(panels.letters), renamed(panels.angles))
