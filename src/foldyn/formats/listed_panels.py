"""Panels listed in a file: joined along shared edges, without repeated or collapsed ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats.lines import Lines, single, without_points
from foldyn.formats.notes import Notes, count
from foldyn.formats.panels import Panels, compact, components, with_inner_borders
from foldyn.formats.t_junctions import ON_EDGE, with_corners_on_edges
from foldyn.patterns.geometry import SAME_PLACE, face_geometry, seams
from foldyn.patterns.topology import Edge, Faces, around, build_topology, checked_faces, edge_of
from foldyn.values import show

_ROUNDS = 8


def listed_panels(
    lines: Lines, faces: Faces, notes: Notes, tolerance: float | None = None
) -> Panels:
    """Join a file's panels along shared edges, with the letters of its lines.

    Coincident boundary edges get the same points unless their letters mark a boundary or a cut.
    Coincident panels (layers) stay apart.

    Parameters
    ----------
    lines : Lines
        As in the file (m).
    faces : tuple of tuple of int
        Corners of the panels, as point numbers.
    notes : Notes
        Collects repairs and doubts.
    tolerance : float, optional
        Distance (m) within which points that panels should share are merged.

    Raises
    ------
    InputError
        A corner that does not exist, or panels that form no surface.
    """
    lines, contradictions = single(without_points(lines))
    notes.contradict(contradictions)
    pairs = [edge_of(a, b) for a, b in lines.ends.tolist()]
    panels = Panels(
        lines.points,
        _numbered(faces, len(lines.points)),
        dict(zip(pairs, lines.letters.tolist(), strict=True)),
        dict(zip(pairs, lines.angles.tolist(), strict=True)),
    )
    panels, twice = _once(panels)
    if twice:
        notes.repairs.append(
            f"left out {count(twice, 'panel')} listed twice or of fewer than 3 corners"
        )
    merged = divided = 0
    near = None if tolerance is None else tolerance / lines.size
    for _ in range(_ROUNDS):  # joined panels may close further seams
        into, wound, points, normals = _seam_points(panels, near or SAME_PLACE)
        if into is not None:
            merged += int(np.count_nonzero(into != np.arange(len(into))))
            panels = _renumbered(panels, into)
            continue
        whole = replace(panels, faces=wound)
        parted, more = with_corners_on_edges(whole, points, normals, near or ON_EDGE)
        if not more:
            break
        panels, divided = parted, divided + more
    if divided:
        notes.repairs.append(
            f"divided edges of panels at {count(divided, 'vertex', 'vertices')} of others that lie "
            "in them"
        )
    if merged:
        notes.repairs.append(f"merged {count(merged, 'vertex', 'vertices')} where panels meet")
        panels = compact(panels)
    sides = panels.sides()
    loose = sum(edge not in sides for edge in panels.letters)
    if loose:
        notes.repairs.append(f"left out {count(loose, 'line')} that bound no panel")
    panels, cuts, folds = with_inner_borders(panels)
    if cuts:
        notes.doubts.append(f"{count(cuts, 'boundary edge')} of two panels taken as cuts")
    if folds:
        notes.doubts.append(
            f"all edges are given as the boundary: the {folds} of two panels are taken as creases "
            "without a letter"
        )
    return panels


def _numbered(faces: Faces, n_vertices: int) -> Faces:
    """Faces whose corners exist; other errors are repaired or found later."""
    for f, face in enumerate(faces):
        bad = [v for v in face if not 0 <= v < n_vertices]
        if bad:
            raise InputError(
                f" = {show(list(face))}: vertex {bad[0]} does not exist; with {n_vertices} "
                f"vertices the numbers run from 0 to {n_vertices - 1}",
                f"faces[{f}]",
            )
    return tuple(tuple(int(v) for v in face) for face in faces)


def _once(panels: Panels) -> tuple[Panels, int]:
    """Panels without repeated corners, and without repeated panels."""
    faces: dict[tuple[int, ...], tuple[int, ...]] = {}
    for face in panels.faces:
        corners = tuple(a for a, b in around(face) if a != b)
        if len(set(corners)) > 2:
            faces.setdefault(tuple(sorted(corners)), corners)
    if not faces:  # the pattern reports what is wrong
        return panels, 0
    left = len(panels.faces) - len(faces)
    return Panels(panels.points, tuple(faces.values()), panels.letters, panels.angles), left


def _seam_points(
    panels: Panels, near: float
) -> tuple[NDArray[np.int64] | None, Faces, NDArray[np.float64], NDArray[np.float64]]:
    """Point that each point is merged into, or None if panels are already joined.

    Also return the panels with consistent winding, their points in space, and their normals. `near`
    is the merging distance, relative to the size.
    """
    points = np.zeros((len(panels.points), 3))
    points[:, : panels.points.shape[1]] = panels.points
    topology = build_topology(checked_faces(panels.faces, len(points)), len(points))
    normals = face_geometry(points, topology.faces).face_normals
    pairs = seams(points, topology.faces, normals, topology.boundary, near)
    same: list[tuple[int, int]] = []
    for one, other in pairs:
        if {panels.letters.get(one), panels.letters.get(other)} & {"B", "C"}:
            continue
        c, d = other
        if np.linalg.norm(points[one[0]] - points[c]) > np.linalg.norm(points[one[0]] - points[d]):
            c, d = d, c
        same += [(one[0], c), (one[1], d)]
    if all(a == b for a, b in same):
        return None, topology.faces, points, normals
    part = components(same, len(points))
    into = np.unique(part, return_index=True)[1][part]  # the first of the merged points
    return into, topology.faces, points, normals


def _renumbered(panels: Panels, into: NDArray[np.int64]) -> Panels:
    number = into.tolist()
    faces: Faces = tuple(tuple(number[point] for point in face) for face in panels.faces)
    letters: dict[Edge, str] = {}
    angles: dict[Edge, float] = {}
    for (a, b), letter in panels.letters.items():
        letters.setdefault(edge_of(number[a], number[b]), letter)
        angles.setdefault(edge_of(number[a], number[b]), panels.angles.get((a, b), np.nan))
    return Panels(panels.points, faces, letters, angles)
