"""Panels listed in a file: joined along shared edges, without repeated or collapsed panels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from foldyn.formats.drawing import Notes, count
from foldyn.formats.lines import MOST_PAIRS, Lines, single, without_points
from foldyn.formats.panels import Panels, compact, renumbered, with_inner_borders
from foldyn.patterns.geometry import SAME_PLACE, face_geometry, seams
from foldyn.patterns.topology import (
    Faces,
    around,
    build_topology,
    checked_faces,
    components,
    edge_of,
)

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
        A corner does not exist, or the panels form no surface.
    """
    lines, contradictions = single(without_points(lines))
    notes.contradict(contradictions)
    pairs = [edge_of(a, b) for a, b in lines.ends.tolist()]
    letters = dict(zip(pairs, lines.letters.tolist(), strict=True))
    angles = dict(zip(pairs, lines.angles.tolist(), strict=True))
    panels = Panels(lines.points, faces, letters, angles)
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
            panels = renumbered(panels, dict(enumerate(into.tolist())))
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
    topology = build_topology(checked_faces(panels.faces, len(points)), points)
    normals = face_geometry(points, topology.faces).face_normals
    same: list[tuple[int, int]] = []
    for one, other in seams(points, topology.faces, normals, topology.boundary, near):
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


ON_EDGE = 1e-5
"""Distance within which a vertex lies on an edge, relative to the size: rounding in files."""
UPON = 1e-2
"""Angle (rad) below which panels coincide: also due to rounding in files."""


def with_corners_on_edges(
    panels: Panels,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    share: float = ON_EDGE,
) -> tuple[Panels, int]:
    """Make vertices of neighbors that lie on panel edges corners; also return how many were added.

    A boundary edge is divided at the ends of another panel's boundary edge that runs along its
    other side. Edges that the file marks as boundary or cut are not divided, and neither are edges
    at which more than two panels would then meet. Nothing is done if too many vertices are near the
    edges.

    Parameters
    ----------
    panels : Panels
        Panels whose winding is consistent with `normals`.
    points : ndarray, shape (n, 3)
        Coordinates, also for flat panels.
    normals : ndarray, shape (m, 3)
        Unit normals of the panels.
    share : float
        Distance within which a vertex lies on an edge, relative to the size.
    """
    sides = panels.sides()
    rim = [
        (a, b, number)
        for number, face in enumerate(panels.faces)
        for a, b in around(face)
        if len(sides[edge_of(a, b)]) == 1 and panels.letters.get(edge_of(a, b)) not in ("B", "C")
    ]
    taken = Counter({edge: len(at) for edge, at in sides.items()})
    inside: dict[tuple[int, int], list[int]] = {}
    for a, b, panel, found in _divided(rim, points, normals, share):
        pieces = [edge_of(*piece) for piece in pairwise([a, *found, b])]
        own = set(found) & set(panels.faces[panel])
        if not own and all(taken[piece] < 2 for piece in pieces):
            taken.update(pieces)
            inside[a, b] = found
    faces = tuple(
        tuple(v for a, b in around(face) for v in (a, *inside.get((a, b), ())))
        for face in panels.faces
    )
    letters, angles = dict(panels.letters), dict(panels.angles)
    for (a, b), found in inside.items():
        letter, angle = letters.pop(edge_of(a, b), ""), angles.pop(edge_of(a, b), np.nan)
        for piece in pairwise([a, *found, b]):
            if letter and edge_of(*piece) not in letters:
                letters[edge_of(*piece)], angles[edge_of(*piece)] = letter, angle
    divided = replace(panels, faces=faces, letters=letters, angles=angles)
    return divided, sum(map(len, inside.values()))


def _divided(
    rim: list[tuple[int, int, int]], points: NDArray, normals: NDArray, share: float
) -> Iterator[tuple[int, int, int, list[int]]]:
    """Boundary edges (start, end, panel) with the points that divide them, in order."""
    rows = np.array(rim, dtype=np.int64).reshape(-1, 3)
    tolerance = share * float(np.linalg.norm(np.ptp(points, axis=0)))
    lengths = np.linalg.norm(points[rows[:, 1]] - points[rows[:, 0]], axis=1)
    rows, lengths = rows[lengths > tolerance], lengths[lengths > tolerance]
    if not len(rows):
        return
    ends, panel = rows[:, :2], rows[:, 2]
    along = (points[ends[:, 1]] - points[ends[:, 0]]) / lengths[:, None]
    inward = np.cross(normals[panel], along)
    at: dict[int, list[int]] = {}
    for k, end in np.ndenumerate(ends):
        at.setdefault(int(end), []).append(k[0])
    corners = np.array(sorted(at))
    tree, middles = cKDTree(points[corners]), points[ends].mean(axis=1)
    if tree.query_ball_point(middles, 0.5 * lengths, return_length=True).sum() > MOST_PAIRS:
        return

    def place(k: int, point: NDArray) -> tuple[NDArray, NDArray]:
        """Coordinates of points along an edge, and their distances from its line."""
        to = point - points[ends[k, 0]]
        far = to @ along[k]
        return far, np.linalg.norm(to - far[..., None] * along[k], axis=-1)

    def beside(k: int, other: int) -> bool:
        """Whether an edge runs along another, with its panel on the other side."""
        apart = np.linalg.norm(inward[k] - inward[other]) > UPON
        return panel[k] != panel[other] and bool(
            apart and (place(k, points[ends[other]])[1] < tolerance).all()
        )

    for k, near in enumerate(tree.query_ball_point(middles, 0.5 * lengths)):
        far, off = place(k, points[corners[near]])
        within = (off < tolerance) & (far > tolerance) & (far < lengths[k] - tolerance)
        order = np.flatnonzero(within)[np.argsort(far[within], kind="stable")]
        found: list[int] = []
        last = 0.0
        for corner, reached in zip(corners[near][order].tolist(), far[order].tolist(), strict=True):
            if reached > last + tolerance and any(beside(k, other) for other in at[corner]):
                found.append(corner)
                last = reached
        if found:
            yield int(ends[k, 0]), int(ends[k, 1]), int(panel[k]), found
