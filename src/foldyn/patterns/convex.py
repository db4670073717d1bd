"""Convex decomposition of panels: models mesh a panel about its center.

The cuts are welds, so the sheet is continuous across them. A panel is triangulated, and triangles
are merged while they form a convex polygon, after Hertel and Mehlhorn (see `facets`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.facets import COPLANAR, corner_turns, joined, longest_first
from foldyn.patterns.pattern import Pattern, pattern_of
from foldyn.patterns.topology import Edge, around, edge_of

Face = tuple[int, ...]


def convex(pattern: Pattern) -> Pattern:
    """Pattern with convex panels that have a corner at each of their vertices.

    Other panels are cut between their vertices, by `welds`. Vertices, creases and panels keep their
    numbers: the part at a panel's first edge keeps its number, the other parts follow after all
    panels.

    Parameters
    ----------
    pattern : Pattern

    Returns
    -------
    Pattern
        The same one if all of its panels are convex.

    Raises
    ------
    InputError
        A thick panel is not convex.

    Examples
    --------
    >>> import foldyn as fd
    >>> bracket = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
    >>> pattern = fd.convex(fd.Pattern(bracket, [[0, 1, 2, 3, 4, 5]]))
    >>> len(pattern.faces), len(pattern.creases), pattern.welds.tolist()
    (2, 0, [[0, 3]])
    """
    pattern = pattern_of(pattern)
    faces, more = list(pattern.faces), []
    for panel, face in enumerate(pattern.faces):
        corners = pattern.vertices[list(face)]
        if corner_turns(corners, pattern.face_normals[panel]).min() > COPLANAR:
            continue
        if pattern.boards is not None:
            raise InputError(
                f": panel {panel} is thick and not convex; cut the thin pattern, then thicken it",
                "pattern",
            )
        faces[panel], *rest = _parts(face, pattern.vertices, pattern.face_normals[panel])
        more += rest
    if not more:
        return pattern
    sides = {edge_of(a, b) for face in (*faces, *more) for a, b in around(face)}
    known = set(map(tuple, pattern.edges.tolist()))
    return pattern.changed(
        faces=[*faces, *more], welds=[*pattern.welds.tolist(), *sorted(sides - known)]
    )


def what_was_cut(before: Pattern, after: Pattern) -> str:
    """Describe in words how `convex` cut panels."""
    new = range(len(before.faces), len(after.faces))
    cut = sum(one != other for one, other in zip(before.faces, after.faces, strict=False))
    which = f"{cut} panels" if cut > 1 else "a panel"
    parts = f"panel {new[0]} is new" if len(new) == 1 else f"panels {new[0]} to {new[-1]} are new"
    return f"cut {which} not convex, or with a vertex within an edge, along welds ({parts})"


def triangles_of(face: Face, corners: NDArray, normal: NDArray) -> list[Face]:
    """Triangles of a polygon with corners (k, 3), cut in the plane across `normal`."""
    import shapely

    first = corners[1] - corners[0]
    first = first - (first @ normal) * normal
    axes = np.stack([first, np.cross(normal, first)]) / np.linalg.norm(first)
    flat = (corners - corners[0]) @ axes.T
    number = {tuple(point): v for point, v in zip(flat.tolist(), face, strict=True)}
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(flat)))
    rings = [shapely.orient_polygons(piece).exterior.coords[:3] for piece in pieces]
    return [tuple(number[x, y] for x, y in ring) for ring in rings]


def _parts(face: Face, vertices: NDArray, normal: NDArray) -> list[Face]:
    """Convex parts of a panel, starting with the one at its first edge."""
    rank = {vertex: k for k, vertex in enumerate(face)}
    pieces = triangles_of(face, vertices[list(face)], normal)
    pieces = [min((p[k:] + p[:k] for k in range(3)), key=lambda q: rank[q[0]]) for p in pieces]
    pieces.sort(key=lambda piece: sorted(rank[v] for v in piece))
    beside: dict[Edge, list[int]] = {}
    for number, piece in enumerate(pieces):
        for a, b in around(piece):
            beside.setdefault(edge_of(a, b), []).append(number)
    edges = np.array([edge for edge, both in beside.items() if len(both) == 2])
    cuts = edges[longest_first(vertices, edges)].tolist()
    both = [beside[a, b] for a, b in cuts]
    return joined(pieces, vertices, np.tile(normal, (len(pieces), 1)), cuts, both)
