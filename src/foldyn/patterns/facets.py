"""Facets: lines drawn inside a panel along which the sheet is not creased.

Folding programs cut panels into triangles along such lines, and assign them "F". `welded` removes
facets: it merges two panels if the result is convex and has a corner at each of its vertices, as
Hertel and Mehlhorn (Proc. FCT 1983) merge triangles of a polygon. Other facets become welds: lines
across which the sheet is continuous.

`convex` adds welds: models mesh a panel about its center, so a panel that is not convex is cut into
triangles, and these are merged in the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, warn
from foldyn.patterns.crease_data import crease_rows
from foldyn.patterns.pattern import Pattern, pattern_of
from foldyn.patterns.topology import Edge, around, at_junctions, edge_of, edge_rows, vertex_pair
from foldyn.patterns.transforms import refuse_boards
from foldyn.values import flag, listed

# What facets become: "weld", removed if panels can be joined, else welds; "line", welds; "hinge",
# creases.
WELD, LINE, HINGE = FACETS = ("weld", "line", "hinge")
COPLANAR = 1e-3  # rad: panels within this angle are coplanar, to allow for rounded coordinates
STRAIGHT = np.radians(15.0)  # an outline that turns by less than this has no corner


def welded(
    pattern: Pattern, facets: Iterable[tuple[int, int]] | str | None = None, *, join: bool = True
) -> Pattern:
    """Pattern with its facets removed from the creases.

    Panels that are coplanar (within 1e-3 rad) are joined across a facet if that makes a convex
    polygon with a corner at each vertex; the longest facets are tried first. Other facets become
    `welds`. Vertices keep their numbers. Panels and creases are renumbered in order; a joined panel
    takes the place of its first part.

    Parameters
    ----------
    pattern : Pattern
    facets : iterable of (vertex, vertex) or str, optional
        Creases that are facets, or the name of the family of these creases; by default all creases
        assigned "F". Existing welds are facets too.
    join : bool
        Whether to join panels; otherwise all facets become welds.

    Returns
    -------
    Pattern

    Warns
    -----
    FoldynWarning
        The argument `facets` is not given, and some welded creases are flat but have no letter.

    Raises
    ------
    InputError
        A facet is not a crease or is assigned "M" or "V"; thick panels; coincident panels.

    Examples
    --------
    >>> import foldyn as fd
    >>> square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])
    >>> fd.welded(square).faces
    ((0, 1, 2, 3),)
    """
    pattern, join = pattern_of(pattern), flag("join", join)
    rows = _rows(pattern, facets)
    edges = np.concatenate([pattern.creases[rows], pattern.welds])
    if pattern.boards is not None and len(edges):
        raise InputError(": thick panels are boards; weld the thin pattern first", "facets")
    beside = np.concatenate([pattern.crease_faces[rows], pattern.weld_faces])
    turned = np.concatenate([pattern.dihedrals[rows], pattern.weld_dihedrals]) - np.pi
    order = longest_first(pattern.vertices, edges)
    apart = (np.abs(turned) > COPLANAR) | at_junctions(edges)
    flat = order[~apart[order]] if join else order[:0]
    faces = joined(
        pattern.faces, pattern.vertices, pattern.face_normals, edges[flat].tolist(),
        beside[flat].tolist(),
    )  # fmt: skip
    sides = {frozenset(side) for face in faces for side in around(face)}
    kept = np.setdiff1d(np.arange(len(pattern.creases)), rows)
    creases = [edge_of(*pair) for pair in pattern.creases[kept].tolist()]
    families = {
        name: pattern.creases[np.intersect1d(members, kept)].tolist()
        for name, members in pattern.families.items()
    }
    return pattern.changed(
        faces=faces,
        assignments=dict(zip(creases, np.array(pattern.assignments)[kept].tolist(), strict=True)),
        fold_angles=dict(zip(creases, pattern.fold_angles[kept].tolist(), strict=True)),
        families={name: members for name, members in families.items() if members},
        welds=[pair for pair in edges.tolist() if frozenset(pair) in sides],
    )


def _rows(pattern: Pattern, facets: Any) -> NDArray[np.int64]:
    """Row numbers of the creases that are facets."""
    letters = np.array(pattern.assignments, dtype="<U1")
    if facets is None:
        rows = np.flatnonzero((letters == "F") & ~at_junctions(pattern.creases))
        guessed = rows[pattern.unlettered[rows]]
        if 0 < guessed.size < len(letters):  # in a completely flat sheet all creases are facets
            first = tuple(pattern.creases[guessed[0]].tolist())
            which = f"{guessed.size} of {len(letters)} creases, as {first}"
            warn(
                f"facets: {which}, lie flat and have no letter, and are welded; assign letters to "
                "those that fold, or name the facets",
                "facets.md#facets",
            )
        return rows
    if isinstance(facets, str):
        facets = pattern.creases[crease_rows("facets", facets, pattern)]
    row, rows = edge_rows(pattern.creases), set()
    for facet in listed("facets", facets, "pairs of vertices, as [(0, 1)]"):
        pair = vertex_pair("facets", facet)
        if pair not in row:
            raise InputError(f": {pair} is not a crease; name its two vertices", "facets")
        first = row[pair][0]
        if letters[first] in ("M", "V") and len(row[pair]) == 1:
            raise InputError(
                f': crease {pair} is assigned "{letters[first]}", so that it folds; assign '
                'it "F", or leave it out',
                "facets",
            )
        rows.update(row[pair])
    return np.array(sorted(rows), dtype=np.int64)


def longest_first(vertices: NDArray, edges: NDArray) -> NDArray[np.int64]:
    """Order of edges (m, 2) by decreasing length; equal lengths by vertex numbers."""
    length = np.linalg.norm(np.diff(vertices[edges], axis=1)[:, 0], axis=1)
    return np.lexsort((edges[:, 1], edges[:, 0], -length.round(12)))


def joined(
    faces: Sequence[tuple[int, ...]],
    vertices: NDArray,
    normals: NDArray,
    edges: Sequence[Sequence[int]],
    beside: Sequence[Sequence[int]],
) -> list[tuple[int, ...]]:
    """Join faces across edges, in the given order, from normals and the two faces at each edge.

    A joined face takes the number, the first corner and the normal of its first part.
    """
    faces, part_of = list(faces), list(range(len(faces)))

    def whole(face: int) -> int:
        while part_of[face] != face:
            face = part_of[face]
        return face

    for edge, both in zip(edges, beside, strict=True):
        one, two = sorted(whole(face) for face in both)
        if one == two:
            continue
        union = _union(faces[one], faces[two], edge_of(*edge))
        if union is not None and _convex(vertices, union, normals[one]):
            faces[one], faces[two], part_of[two] = union, (), one
    return [face for face in faces if face]


def _union(one: Sequence[int], two: Sequence[int], edge: Edge) -> tuple[int, ...] | None:
    """Corners of two faces joined at a shared edge; None if the faces share other vertices too."""
    if len(set(one) & set(two)) > 2:
        return None
    a = edge[0] if edge in set(around(one)) else edge[1]  # where the shared edge starts along `one`
    at, back = one.index(a), two.index(a)
    beyond = [*two[back:], *two[:back]][1:-1]  # vertices between the ends of the shared edge
    return (*one[: at + 1], *beyond, *one[at + 1 :])


def _convex(vertices: NDArray, face: Sequence[int], normal: NDArray) -> bool:
    """Whether a face lies in the plane normal to `normal` and turns left at every corner."""
    x = vertices[list(face)]
    if np.abs((x - x[0]) @ normal).max() > COPLANAR * np.linalg.norm(x - x[0], axis=1).max():
        return False
    return bool((corner_turns(x, normal) > STRAIGHT).all())


def corner_turns(x: NDArray, normal: NDArray) -> NDArray[np.float64]:
    """Angles (rad) by which an outline x (k, 3) turns left at its corners."""
    along = np.roll(x, -1, axis=0) - x
    before = np.roll(along, 1, axis=0)
    left = np.einsum("ij,j->i", np.cross(before, along), normal)
    return np.arctan2(left, np.einsum("ij,ij->i", before, along))


Face = tuple[int, ...]


def convex(pattern: Pattern) -> Pattern:
    """Pattern in which all panels are convex and have a corner at each of their vertices.

    Panels that are not so are cut by `welds` from vertex to vertex. Vertices, creases and panels
    keep their numbers: the part at a panel's first edge keeps the panel's number, the other parts
    are numbered after all panels.

    Parameters
    ----------
    pattern : Pattern

    Returns
    -------
    Pattern
        The given pattern itself if all of its panels are convex.

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
        refuse_boards(
            pattern, f"panel {panel} is thick and not convex; cut the thin pattern, then thicken it"
        )
        faces[panel], *rest = _parts(face, pattern.vertices, pattern.face_normals[panel])
        more += rest
    if not more:
        return pattern
    sides = {edge_of(a, b) for face in (*faces, *more) for a, b in around(face)}
    known = set(map(tuple, pattern.edges.tolist()))
    welds = [*pattern.welds.tolist(), *sorted(sides - known)]
    return pattern.changed(faces=[*faces, *more], welds=welds)


def what_was_cut(before: Pattern, after: Pattern) -> str:
    """Describe in words how `convex` cut panels."""
    new = range(len(before.faces), len(after.faces))
    cut = sum(one != other for one, other in zip(before.faces, after.faces, strict=False))
    which = f"{cut} panels" if cut > 1 else "a panel"
    parts = f"panel {new[0]} is new" if len(new) == 1 else f"panels {new[0]} to {new[-1]} are new"
    return f"cut {which} not convex, or with a vertex within an edge, along welds ({parts})"


def flattened(corners: NDArray, normal: NDArray) -> NDArray[np.float64]:
    """Coordinates (k, 2) in the plane normal to `normal`, from the first corner to the second."""
    first = corners[1] - corners[0]
    first = first - (first @ normal) * normal
    axes = np.stack([first, np.cross(normal, first)]) / np.linalg.norm(first)
    return (corners - corners[0]) @ axes.T


def triangles_of(face: Face, corners: NDArray, normal: NDArray) -> list[Face]:
    """Triangles of a polygon with corners (k, 3), cut in the plane normal to `normal`."""
    import shapely

    flat = flattened(corners, normal)
    number = {tuple(point): v for point, v in zip(flat.tolist(), face, strict=True)}
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(flat)))
    rings = [shapely.orient_polygons(piece).exterior.coords[:3] for piece in pieces]
    return [tuple(number[x, y] for x, y in ring) for ring in rings]


def _parts(face: Face, vertices: NDArray, normal: NDArray) -> list[Face]:
    """Convex parts of a panel, starting with the part at its first edge."""
    rank = {vertex: k for k, vertex in enumerate(face)}
    pieces = triangles_of(face, vertices[list(face)], normal)
    pieces = [min((p[k:] + p[:k] for k in range(3)), key=lambda q: rank[q[0]]) for p in pieces]
    pieces.sort(key=lambda piece: sorted(rank[v] for v in piece))
    beside: dict[Edge, list[int]] = {}
    for number, piece in enumerate(pieces):
        for a, b in around(piece):
            beside.setdefault(edge_of(a, b), []).append(number)
    inner = [edge for edge, both in beside.items() if len(both) == 2]
    edges = np.array(inner, np.int64).reshape(-1, 2)  # none of a needle, which is convex
    cuts = edges[longest_first(vertices, edges)].tolist()
    both = [beside[a, b] for a, b in cuts]
    return joined(pieces, vertices, np.tile(normal, (len(pieces), 1)), cuts, both)
