"""Geometry of faces: areas, normals and planarity, dihedrals, and seams between faces.

A crease is an edge of two panels with the same two vertex numbers; panels that meet at coincident
but different vertices only look joined. A seam is a pair of coincident boundary edges that are not
joined, probably by mistake; a seam on purpose is a cut, marked by a letter. Two panels that
coincide where their edges do, as in a flat-folded state, are layers, not a seam.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.topology import Edge, Faces, around, components, edge_lookup, edge_of

# A face is degenerate if area divided by squared diameter, or edge length divided by diameter, is
# smaller: far above rounding (1e-16), far below any panel that can be made.
_DEGENERATE = 1e-10
SAME_PLACE = 1e-9  # points closer than this are equal, relative to the pattern's size
ASKEW = np.array([0.5377, 0.8339, 0.1244])  # a generic direction, shorter than a unit vector
LAYERS = 1e-6  # rad: panels that leave a common edge within this angle coincide
_ASKANCE = 10.0  # the same angle, divided by the relative distance within which points are merged
CLOSED = 1e-3  # rad: within this angle from closed, the letter decides the side


@dataclass(frozen=True, eq=False, repr=False)
class FaceGeometry:
    """Shape data of each face.

    Attributes
    ----------
    face_areas : ndarray, shape (m,)
        Area (m2); for a face that is not flat, the area of its projection along the normal.
    face_normals : ndarray, shape (m, 3)
        Unit normals towards the front, by Newell's method, which works for any polygon.
    face_planarity : ndarray, shape (m,)
        Largest distance of a corner from the mean plane, divided by the face's diameter.
    """

    face_areas: NDArray[np.float64]
    face_normals: NDArray[np.float64]
    face_planarity: NDArray[np.float64]


def face_geometry(vertices: NDArray, faces: Faces) -> FaceGeometry:
    """Areas, normals and planarity of faces.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    faces : tuple of tuple of int
        Faces as vertex numbers.

    Returns
    -------
    FaceGeometry
        One row per face.

    Raises
    ------
    InputError
        A face without area, with coincident corners, or with an outline that crosses itself.
    """
    count = len(faces)
    areas, planarity, shortest = np.empty(count), np.empty(count), np.empty(count)
    diameter, normals = np.empty(count), np.empty((count, 3))
    crossed = np.zeros(count, dtype=bool)
    sizes = np.array([len(face) for face in faces])
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        corners = vertices[np.array([faces[f] for f in which])]
        # Positions relative to the mean corner: a pattern far from the origin loses no accuracy.
        corners = corners - corners.mean(axis=1, keepdims=True)
        newell = 0.5 * np.cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
        areas[which] = np.linalg.norm(newell, axis=1)
        # sqrt of the smallest normal number, to avoid division by a zero area
        normals[which] = newell / np.maximum(areas[which], 1e-154)[:, None]
        diameter[which] = 0.0
        shortest[which] = np.inf
        for shift in range(1, size // 2 + 1):
            distance = np.linalg.norm(np.roll(corners, -shift, axis=1) - corners, axis=2)
            diameter[which] = np.maximum(diameter[which], distance.max(axis=1))
            shortest[which] = np.minimum(shortest[which], distance.min(axis=1))
        planarity[which] = np.abs(np.einsum("fvc,fc->fv", corners, normals[which])).max(axis=1)
        crossed[which] = _crosses_itself(corners, normals[which], diameter[which])
    for bad, text, sizes in (
        (
            ~(shortest > _DEGENERATE * diameter),
            "two of its corners lie in the same place ({:.3g} m apart in a face of {:.3g} m); "
            "merge them into one vertex or move one.",
            shortest,
        ),
        (
            ~(areas > _DEGENERATE * diameter**2),
            "has no area ({:.3g} m2 in a face of {:.3g} m): its corners lie on a line or are not "
            "listed in order around it; reorder them or leave the face out.",
            areas,
        ),
        (crossed, "its outline crosses itself; list its corners in order around it.", areas),
    ):
        if bad.any():
            f = int(bad.argmax())
            told = text.format(sizes[f], diameter[f])
            raise InputError(f"faces[{f}] = {list(faces[f])}: {told}")
    return FaceGeometry(areas, normals, planarity / diameter)


def _crosses_itself(corners: NDArray, normals: NDArray, diameter: NDArray) -> NDArray:
    """Whether two edges of a face, seen along its normal, cross (touching does not count)."""
    after = np.roll(corners, -1, axis=1)
    least = _DEGENERATE * diameter[:, None] ** 2
    result = np.zeros(len(corners), dtype=bool)

    def side(a: NDArray, b: NDArray, c: NDArray) -> NDArray:
        turn = np.einsum("fvc,fc->fv", np.cross(b - a, c - a), normals)
        return np.where(np.abs(turn) > least, np.sign(turn), 0).astype(np.int8)

    for shift in range(2, corners.shape[1] // 2 + 1):
        other, other_after = np.roll(corners, -shift, axis=1), np.roll(after, -shift, axis=1)
        parted = side(corners, after, other) * side(corners, after, other_after) < 0
        parts = side(other, other_after, corners) * side(other, other_after, after) < 0
        result |= (parted & parts).any(axis=1)
    return result


def crease_dihedrals(
    vertices: NDArray, normals: NDArray, creases: NDArray, crease_faces: NDArray, ways: NDArray,
    letters: NDArray,
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """Dihedral of each crease, from the angle (`atan2`) between the two normals.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    normals : ndarray, shape (m, 3)
        Unit normals of the faces towards the front.
    creases, crease_faces, ways : ndarray of int, shape (nc, 2)
        As `creases`, `crease_faces` and `crease_ways` in `Topology`.
    letters : ndarray of str, shape (nc,)
        "M" and "V" decide the side of closed creases.

    Returns
    -------
    dihedral : ndarray, shape (nc,)
        Dihedrals (rad) in [0, 2 pi]: pi when flat, less on a valley, more on a mountain. If the
        panels coincide to rounding, the geometry cannot tell 0 from 2 pi: it is 2 pi for a
        mountain, else 0.
    closed : ndarray of bool, shape (nc,)
        Whether the panels coincide within 1e-3 rad.
    """
    axis = vertices[creases[:, 1]] - vertices[creases[:, 0]]
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    front, back = (ways[:, k, None] * normals[crease_faces[:, k]] for k in range(2))
    # Normals of non-planar faces may lean along the crease: use only the components across it.
    front = front - np.einsum("ij,ij->i", front, axis)[:, None] * axis
    back = back - np.einsum("ij,ij->i", back, axis)[:, None] * axis
    sine = np.einsum("ij,ij->i", np.cross(front, back), axis)
    cosine = np.einsum("ij,ij->i", front, back)
    closed = (np.abs(sine) < CLOSED * np.abs(cosine)) & (cosine < 0)
    shut = closed & (np.abs(sine) < 1e-12 * np.abs(cosine))
    dihedral = np.where(shut, 0.0, np.pi + np.arctan2(sine, cosine))
    dihedral[closed & (letters == "M") & (dihedral < np.pi)] = 2.0 * np.pi
    dihedral[closed & (letters == "V") & (dihedral > np.pi)] = 0.0
    return dihedral, closed


def seams(
    vertices: NDArray, faces: Faces, normals: NDArray, boundary: NDArray, near: float = SAME_PLACE
) -> list[tuple[Edge, Edge]]:
    """Pairs of boundary edges with coincident ends whose panels do not coincide.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    faces : tuple of tuple of int
        Faces as vertex numbers, consistently wound.
    normals : ndarray, shape (m, 3)
        Unit normals of the faces.
    boundary : ndarray of int, shape (nb, 2)
        Edges that belong to one face only.
    near : float
        Distance within which points coincide, relative to the size of the pattern.
    """
    ends = np.sort(_places(vertices, boundary, near)[boundary], axis=1)
    _, group, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    doubled = np.flatnonzero(count[group.ravel()] > 1)
    if not len(doubled):
        return []
    inward = _inward(vertices, faces, normals, boundary, doubled)
    pairs: list[tuple[Edge, Edge]] = []
    first: dict[int, int] = {}
    for k in doubled.tolist():
        other = first.setdefault(int(group.ravel()[k]), k)
        if np.linalg.norm(inward[k] - inward[other]) > max(LAYERS, _ASKANCE * near):
            pairs.append((edge_of(*boundary[other].tolist()), edge_of(*boundary[k].tolist())))
    return pairs


def _places(vertices: NDArray, boundary: NDArray, near: float) -> NDArray:
    """Number of each vertex's place (n,); coincident boundary vertices have the same number."""
    rim = np.unique(boundary)
    points, where = np.unique(vertices[rim], axis=0, return_inverse=True)
    pairs = _pairs_nearer(points, near * float(np.linalg.norm(np.ptp(vertices, axis=0))))
    places = np.arange(len(vertices)) + len(points)
    places[rim] = components(pairs, len(points))[where.ravel()]
    return places


def _pairs_nearer(points: NDArray, distance: float) -> NDArray:
    """Pairs (k, 2) of points (n, 3) within a distance."""
    # quick test: if no two points are that close along a generic direction, there are no pairs
    along = np.sort((points - points[:1]) @ ASKEW)
    if not (np.diff(along) <= 2.0 * distance).any():
        return np.zeros((0, 2), np.int64)
    from scipy.spatial import cKDTree

    return cKDTree(points).query_pairs(distance, output_type="ndarray")


def _inward(
    vertices: NDArray, faces: Faces, normals: NDArray, boundary: NDArray, chosen: NDArray
) -> dict[int, NDArray]:
    """Unit vectors from chosen boundary edges into their panels, perpendicular to the edges."""
    row = edge_lookup(boundary[chosen])
    unit = {}
    for number, face in enumerate(faces):
        for a, b in around(face):
            k = row.get(edge_of(a, b))
            if k is not None:
                inward = np.cross(normals[number], vertices[b] - vertices[a])
                unit[int(chosen[k])] = inward / np.linalg.norm(inward)
    return unit
