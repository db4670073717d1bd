"""Cuts in a sheet: panels on both sides get their own points where the cut opens."""

from __future__ import annotations

import numpy as np

from foldyn.formats.panels import Panels, components
from foldyn.patterns.topology import Edge, Faces, around, edge_of


def opened(panels: Panels) -> tuple[Panels, int]:
    """Split cut edges (letter "C", of two panels) into two boundary edges each.

    Around each end of a cut, panels joined by folds keep a common point. So a cut that ends inside
    the sheet stays closed there, and one that reaches the outline or another cut opens. A cut of
    one edge with both ends inside gets a midpoint on each side.

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
        panels = _halved(panels, halved)
        sides = panels.sides()
        cuts = {
            edge for edge, at in sides.items() if len(at) == 2 and panels.letters.get(edge) == "C"
        }
        apart = _parted(panels, sides, cuts)
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
    return Panels(points, tuple(faces), letters, angles), len(cuts) - len(halved)


def _parted(
    panels: Panels, sides: dict[Edge, list[int]], cuts: set[Edge]
) -> dict[tuple[int, int], int]:
    """Group of each corner (face, point) at a cut; folds around the point join corners."""
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
    groups = components(joined, len(corners)).tolist()
    return dict(zip(corners, groups, strict=True))


def _halved(panels: Panels, edges: list[Edge]) -> Panels:
    """Panels with a midpoint added to some edges."""
    middle = {edge: len(panels.points) + k for k, edge in enumerate(edges)}
    places = [0.5 * (panels.points[a] + panels.points[b]) for a, b in edges]
    faces: Faces = tuple(
        tuple(
            point
            for a, b in around(face)
            for point in ((a, middle[edge_of(a, b)]) if edge_of(a, b) in middle else (a,))
        )
        for face in panels.faces
    )
    letters = dict(panels.letters)
    for (a, b), point in middle.items():
        letters[edge_of(a, point)] = letters[edge_of(b, point)] = "C"
    return Panels(np.concatenate((panels.points, places)), faces, letters, panels.angles)
