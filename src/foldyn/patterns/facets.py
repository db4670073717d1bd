"""Facets: lines that divide a panel in a drawing, but along which the sheet is not creased.

Programs that fold patterns cut panels into triangles by such lines, assigned "F". `welded` takes
them out: two panels become one polygon where this is convex, with every vertex at a corner of it,
as Hertel and Mehlhorn (Proc. FCT 1983) merge the triangles of a polygon; other facets stay as
welds, lines across which the sheet runs on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge, around, edge_lookup, vertex_pair

COPLANAR = 1e-3  # rad: panels that turn by less lie in one plane, as coordinates in a file do
STRAIGHT = np.radians(15.0)  # corners that turn by less divide an edge


def welded(pattern: Pattern, facets: Iterable[tuple[int, int]] | None = None) -> Pattern:
    """Pattern whose facets are no creases.

    Panels in one plane (within 1e-3 rad) are joined across a facet where that makes a convex
    polygon with a corner at each of their vertices, across the longest facets first. Other facets
    become `welds`. Vertices keep their numbers; panels and creases are counted anew, in their
    order, a joined panel as the first of its parts.

    Parameters
    ----------
    pattern : Pattern
    facets : iterable of (vertex, vertex), optional
        Creases that are facets; without it all that are assigned "F".

    Returns
    -------
    Pattern

    Raises
    ------
    InputError
        A facet is no crease or is assigned "M" or "V"; panels of boards; panels that lie upon each
        other.

    Examples
    --------
    >>> import foldyn as fd
    >>> square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])
    >>> fd.welded(square).faces
    ((0, 1, 2, 3),)
    """
    if not isinstance(pattern, Pattern):
        raise InputError(f": got {type(pattern).__name__}, give a Pattern", "pattern")
    rows = _rows(pattern, facets)
    if pattern.boards is not None and len(rows):
        raise InputError(
            ": thick panels are boards of their own; weld the thin pattern, then thicken it",
            "facets",
        )
    flat = np.abs(pattern.dihedrals[rows] - np.pi) <= COPLANAR
    length = np.linalg.norm(np.diff(pattern.vertices[pattern.creases], axis=1)[:, 0], axis=1)
    order = rows[flat][np.lexsort((rows[flat], -length[rows[flat]].round(12)))]
    joined = _joined(pattern, order.tolist())
    faces = tuple(face for face in joined if face)
    edges = {frozenset(edge) for face in faces for edge in around(face)}
    left = [pair for pair in pattern.creases[rows].tolist() if frozenset(pair) in edges]
    kept = np.setdiff1d(np.arange(len(pattern.creases)), rows)
    return Pattern(
        pattern.vertices,
        faces,
        {_pair(pattern.creases[k]): pattern.assignments[k] for k in kept.tolist()},
        pattern.name,
        pattern.boards,
        {_pair(pattern.creases[k]): pattern.fold_angles[k] for k in kept.tolist()},
        {
            name: [_pair(pair) for pair in pattern.creases[np.intersect1d(members, kept)]]
            for name, members in pattern.families.items()
        },
        pattern.custom,
        [*map(_pair, pattern.welds), *map(_pair, left)],
    )


def _pair(edge: Sequence[int] | NDArray) -> Edge:
    return int(edge[0]), int(edge[1])


def _rows(pattern: Pattern, facets: Any) -> NDArray[np.int64]:
    """Rows of the creases that are facets."""
    letters = np.array(pattern.assignments, dtype="<U1")
    if facets is None:
        return np.flatnonzero(letters == "F")
    row, rows = edge_lookup(pattern.creases), set()
    for facet in facets:
        pair = vertex_pair("facets", facet)
        if pair not in row:
            raise InputError(f": {pair} is not a crease; name its two vertices", "facets")
        if letters[row[pair]] in ("M", "V"):
            raise InputError(
                f': crease {pair} is assigned "{letters[row[pair]]}", so that it folds; assign '
                'it "F", or leave it out',
                "facets",
            )
        rows.add(row[pair])
    return np.array(sorted(rows), dtype=np.int64)


def _joined(pattern: Pattern, order: Sequence[int]) -> list[tuple[int, ...]]:
    """Faces, joined across creases in their order; () in the place of those that are part of one.

    A joined face has the place, the first corner and the plane of the first of its parts.
    """
    faces, part_of = list(pattern.faces), list(range(len(pattern.faces)))

    def whole(face: int) -> int:
        while part_of[face] != face:
            face = part_of[face]
        return face

    for k in order:
        one, two = sorted(whole(face) for face in pattern.crease_faces[k].tolist())
        if one == two:
            continue
        union = _union(faces[one], faces[two], _pair(pattern.creases[k]))
        if union is not None and _convex(pattern.vertices, union, pattern.face_normals[one]):
            faces[one], faces[two], part_of[two] = union, (), one
    return faces


def _union(one: Sequence[int], two: Sequence[int], edge: Edge) -> tuple[int, ...] | None:
    """Corners of two faces without the edge that they share; None if they share more."""
    if len(set(one) & set(two)) > 2:
        return None
    a = edge[0] if edge in set(around(one)) else edge[1]  # from which `one` runs along it
    at, back = one.index(a), two.index(a)
    beyond = [*two[back:], *two[:back]][1:-1]  # between the two ends of the edge
    return (*one[: at + 1], *beyond, *one[at + 1 :])


def _convex(vertices: NDArray, face: Sequence[int], normal: NDArray) -> bool:
    """Whether a face lies in the plane across `normal` and turns to the left at every corner."""
    x = vertices[list(face)]
    if np.abs((x - x[0]) @ normal).max() > COPLANAR * np.linalg.norm(x - x[0], axis=1).max():
        return False
    along = np.roll(x, -1, axis=0) - x
    before = np.roll(along, 1, axis=0)
    left = np.einsum("ij,j->i", np.cross(before, along), normal)
    ahead = np.einsum("ij,ij->i", before, along)
    return bool((np.arctan2(left, ahead) > STRAIGHT).all())
