"""Regions enclosed by lines in the plane, and the sheet that they form as panels."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats.lines import Lines
from foldyn.formats.panels import Panels
from foldyn.formats.planar import segments
from foldyn.patterns.topology import Faces, around, components, edge_of


def enclosed(lines: Lines, tolerance: float) -> tuple[Panels, Lines, int]:
    """Panels enclosed by lines that meet only at their ends.

    Parameters
    ----------
    lines : Lines
        As returned by `split`.
    tolerance : float
        Distance within which a point lies on a line.

    Returns
    -------
    panels : Panels
    loose : Lines
        Lines that bound no panel: open ends, and links between separate parts.
    divided : int
        Number of panels that contain other panels; they are divided into triangles.

    Raises
    ------
    InputError
        No panel is enclosed.
    """
    faces, divided = _faces(lines)
    if not faces:
        raise InputError(
            ": they enclose no panel; draw the sheet's outline, and lines that end on each other",
            "lines",
        )
    bound = {edge_of(a, b) for face in faces for a, b in around(face)}
    ends = [edge_of(a, b) for a, b in lines.ends.tolist()]
    is_loose = np.array([edge not in bound for edge in ends])
    rest, loose = lines, lines.taken(is_loose)
    if is_loose.any():
        rest = straightened(lines.taken(~is_loose), np.unique(loose.ends), tolerance)
        faces, divided = _faces(rest)
    ends = [edge_of(a, b) for a, b in rest.ends.tolist()]
    letters = dict(zip(ends, rest.letters.tolist(), strict=True))
    angles = dict(zip(ends, rest.angles.tolist(), strict=True))
    return Panels(rest.points, faces, letters, angles), loose, divided


def _faces(lines: Lines) -> tuple[Faces, int]:
    """Faces, counter-clockwise and sorted, and the number of divided faces."""
    polygons = shapely.get_parts(shapely.polygonize(list(segments(lines))))
    hollow = shapely.get_num_interior_rings(polygons) > 0
    if hollow.any():
        triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygons[hollow]))
        polygons = np.concatenate((polygons[~hollow], triangles))
    rings = shapely.get_exterior_ring(shapely.orient_polygons(polygons))
    corners, polygon = shapely.get_coordinates(rings, return_index=True)
    used = np.unique(lines.ends)  # unused points may coincide with others
    places = lines.points[used].tolist()
    number = {(x, y): k for k, (x, y) in zip(used.tolist(), places, strict=True)}
    numbers = [number[x, y] for x, y in corners.tolist()]
    bounds = np.searchsorted(polygon, np.arange(len(polygons) + 1)).tolist()
    faces = []
    for start, end in pairwise(bounds):
        face = numbers[start : end - 1]  # the last corner repeats the first
        first = face.index(min(face))
        faces.append(tuple(face[first:] + face[:first]))
    return tuple(sorted(faces)), int(np.count_nonzero(hollow))


def straightened(lines: Lines, suspects: NDArray, tolerance: float) -> Lines:
    """Remove those suspected points that lie within a straight line of one kind."""
    at: dict[int, set[int]] = {}
    drawn = {edge_of(a, b) for a, b in lines.ends.tolist()}
    for row, (a, b) in enumerate(lines.ends.tolist()):
        at.setdefault(a, set()).add(row)
        at.setdefault(b, set()).add(row)
    ends, kept = lines.ends.copy(), np.ones(len(lines.ends), dtype=bool)
    for point in suspects.tolist():
        if len(at.get(point, ())) != 2:
            continue
        one, other = sorted(at[point])
        alike = lines.letters[one] == lines.letters[other] and np.array_equal(
            lines.angles[one], lines.angles[other], equal_nan=True
        )
        a, b = int(ends[one].sum() - point), int(ends[other].sum() - point)
        if not alike or edge_of(a, b) in drawn:
            continue
        along = lines.points[b] - lines.points[a]
        to = lines.points[point] - lines.points[a]
        aside = abs(along[0] * to[1] - along[1] * to[0])
        if aside > tolerance * np.linalg.norm(along) or not 0 < to @ along < along @ along:
            continue
        ends[one], kept[other] = (a, b), False
        drawn.add(edge_of(a, b))
        at[b] = at[b] - {other} | {one}
    return replace(lines, ends=ends).taken(kept)


def areas(panels: Panels) -> NDArray[np.float64]:
    """Area of each panel of a flat drawing."""
    corners = panels.points[[point for face in panels.faces for point in face], :2]
    number = np.repeat(np.arange(len(panels.faces)), [len(face) for face in panels.faces])
    return np.asarray(shapely.area(shapely.polygons(shapely.linearrings(corners, indices=number))))


def parts(panels: Panels) -> NDArray[np.int64]:
    """Part number of each panel; edges that are not cuts join panels to a part."""
    letters, sides = panels.letters, panels.sides()
    pairs = [at for edge, at in sides.items() if len(at) == 2 and letters.get(edge) != "C"]
    return components(pairs, len(panels.faces))


def sheet(panels: Panels) -> tuple[Panels, NDArray, list[tuple[float, NDArray]]]:
    """Largest sheet of a flat drawing, without pieces that fall out of it.

    Returns
    -------
    panels : Panels
        The largest part that reaches the outline.
    openings : ndarray of float
        Areas of inner regions that fall out because only cuts and outlines bound them.
    others : list of (float, ndarray)
        Area and a corner of each further sheet; these sheets are left out.
    """
    part, area = parts(panels), areas(panels)
    total = np.bincount(part, area)
    outer = np.zeros(len(total), dtype=bool)
    for at in panels.sides().values():
        if len(at) == 1:
            outer[part[at[0]]] = True
    largest = int(np.where(outer, total, -1.0).argmax())
    others = [
        (float(total[k]), panels.points[panels.faces[int(np.argmax(part == k))][0]])
        for k in np.flatnonzero(outer)
        if k != largest
    ]
    faces = tuple(face for face, k in zip(panels.faces, part, strict=True) if k == largest)
    return Panels(panels.points, faces, panels.letters, panels.angles), total[~outer], others
