"""`Panels` with data on their edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.topology import Edge, Faces, around, components, edge_of


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
        Letters of edges, by their (low, high) pairs of points; edges may lack a letter.
    angles : dict
        Fold angles (degrees) of edges, by the same pairs; edges may lack an angle.
    """

    points: NDArray[np.float64]
    faces: Faces
    letters: dict[Edge, str]
    angles: dict[Edge, float]

    def sides(self) -> dict[Edge, list[int]]:
        """Numbers of the faces that meet at each edge."""
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


def compact(panels: Panels) -> Panels:
    """Panels without unused points; the order of points stays."""
    used = sorted({point for face in panels.faces for point in face})
    number = {point: k for k, point in enumerate(used)}
    return replace(renumbered(panels, number), points=panels.points[used])


def renumbered(panels: Panels, number: Mapping[int, int]) -> Panels:
    """Panels with new numbers of points; of edges that become one, the first counts.

    Edges with points that get no number are left out.
    """
    faces = tuple(tuple(number[point] for point in face) for face in panels.faces)
    letters: dict[Edge, str] = {}
    angles: dict[Edge, float] = {}
    for (a, b), letter in panels.letters.items():
        if a in number and b in number:
            edge = edge_of(number[a], number[b])
            letters.setdefault(edge, letter)
            angles.setdefault(edge, panels.angles.get((a, b), np.nan))
    return Panels(panels.points, faces, letters, angles)


def opened(panels: Panels) -> tuple[Panels, int]:
    """Split every cut edge (letter "C", between two panels) into two boundary edges.

    Around each end of a cut, panels joined by folds keep a common point. So a cut that ends inside
    the sheet stays closed at that end, and a cut that reaches the outline or another cut opens
    there. A cut of one edge with both ends inside gets a midpoint on each side.

    Parameters
    ----------
    panels : Panels
        Each edge belongs to at most two.

    Returns
    -------
    panels : Panels
        The first panel at a point keeps the point's number; new points follow all others.
    count : int
        Number of edges cut.
    """
    sides = panels.sides()
    cuts = {edge for edge, at in sides.items() if len(at) == 2 and panels.letters.get(edge) == "C"}
    if not cuts:
        return panels, 0
    apart = _parted(panels, sides, cuts)
    halved = [
        edge
        for edge in sorted(cuts)
        if all(apart[sides[edge][0], end] == apart[sides[edge][1], end] for end in edge)
    ]
    if halved:
        panels, count = opened(_halved(panels, halved))
        return panels, count - len(halved)
    number: dict[tuple[int, int], int] = {}
    copies: list[int] = []
    taken: set[int] = set()
    faces: list[tuple[int, ...]] = []
    letters, angles = {}, {}
    for f, face in enumerate(panels.faces):
        corners = []
        for point in face:
            key = point, apart.get((f, point), 0)
            if key not in number:
                number[key] = point if point not in taken else len(panels.points) + len(copies)
                if point in taken:
                    copies.append(point)
                taken.add(point)
            corners.append(number[key])
        faces.append(tuple(corners))
        for (a, b), (c, d) in zip(around(face), around(corners), strict=True):
            edge, new = edge_of(a, b), edge_of(c, d)
            if edge in panels.letters:
                letters[new] = panels.letters[edge]
                angles[new] = panels.angles.get(edge, np.nan)
    points = np.concatenate((panels.points, panels.points[copies]))
    return Panels(points, tuple(faces), letters, angles), len(cuts)


def _parted(
    panels: Panels, sides: dict[Edge, list[int]], cuts: set[Edge]
) -> dict[tuple[int, int], int]:
    """Group number of each corner (face, point) at a cut; folds around the point join corners."""
    ends = {end for edge in cuts for end in edge}
    corners = [(f, point) for f, face in enumerate(panels.faces) for point in face if point in ends]
    row = {corner: k for k, corner in enumerate(corners)}
    joined = [
        (row[at[0], end], row[at[1], end])
        for edge, at in sides.items()
        if len(at) == 2 and edge not in cuts
        for end in edge
        if end in ends
    ]
    return dict(zip(corners, components(joined, len(corners)).tolist(), strict=True))


def _halved(panels: Panels, edges: list[Edge]) -> Panels:
    """Panels with a midpoint added to some edges."""
    middle = {edge: [len(panels.points) + k] for k, edge in enumerate(edges)}
    places = [0.5 * (panels.points[a] + panels.points[b]) for a, b in edges]
    faces: Faces = tuple(
        tuple(v for a, b in around(face) for v in (a, *middle.get(edge_of(a, b), ())))
        for face in panels.faces
    )
    letters = dict(panels.letters)
    for (a, b), (point,) in middle.items():
        letters[edge_of(a, point)] = letters[edge_of(b, point)] = "C"
    return Panels(np.concatenate((panels.points, places)), faces, letters, panels.angles)
