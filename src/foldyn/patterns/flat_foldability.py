"""Local flat-foldability of a pattern's vertices: the conditions of Maekawa and Kawasaki.

They are necessary at each interior vertex, but not sufficient for the whole pattern (layers may
collide). Source: T. Hull, On the mathematics of flat origamis, Congressus Numerantium 100 (1994):
Maekawa, mountains less valleys are 2 or -2; Kawasaki, the angles between neighboring creases, taken
with alternating signs, add up to zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.pattern import Pattern


@dataclass(frozen=True, eq=False, repr=False)
class FlatFoldability:
    """Flat-foldability of the interior vertices of a pattern, one row each.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
        Numbers of the interior vertices, which panels surround completely.
    mountains, valleys, unassigned : ndarray of int, shape (k,)
        Creases of each kind there; flat ones ("F") do not count.
    deficits : ndarray, shape (k,)
        Angle deficit (rad): a full turn minus the sum of panel angles, 0 where developable.
    alternating : ndarray, shape (k,)
        Kawasaki's alternating sum (rad, not negative) of the angles between folded creases; NaN if
        their number is odd, 0 if no crease folds.
    """

    vertices: NDArray[np.int64]
    mountains: NDArray[np.int64]
    valleys: NDArray[np.int64]
    unassigned: NDArray[np.int64]
    deficits: NDArray[np.float64]
    alternating: NDArray[np.float64]

    def __repr__(self) -> str:
        """One line."""
        return f"<FlatFoldability of {len(self.vertices)} vertices>"

    @property
    def degrees(self) -> NDArray[np.int64]:
        """Number of folded creases at each vertex (k,)."""
        return self.mountains + self.valleys + self.unassigned

    @property
    def maekawa(self) -> NDArray[np.bool_]:
        """Whether mountains minus valleys are 2 or -2, or can be with all letters (k,)."""
        least = self.mountains - self.valleys - self.unassigned
        most = self.mountains - self.valleys + self.unassigned
        even = self.degrees % 2 == 0
        reached = ((least <= 2) & (most >= 2)) | ((least <= -2) & (most >= -2))
        return (self.degrees == 0) | (even & reached)

    def kawasaki(self, tolerance: float) -> NDArray[np.bool_]:
        """Whether the alternating sum is zero within a tolerance (rad) (k,)."""
        return self.alternating <= tolerance  # False for NaN

    def developable(self, tolerance: float) -> NDArray[np.bool_]:
        """Whether the angles add up to a full turn within a tolerance (rad) (k,)."""
        return np.abs(self.deficits) <= tolerance


def flat_foldability(pattern: Pattern) -> FlatFoldability:
    """Conditions of Maekawa and Kawasaki, and developability, at interior vertices.

    Parameters
    ----------
    pattern : Pattern
        Flat or folded; only the angles of its panels matter, which folding preserves.

    Returns
    -------
    FlatFoldability
        One row for each interior vertex.
    """
    letter = dict(zip(map(tuple, pattern.creases.tolist()), pattern.assignments, strict=True))
    letter |= dict.fromkeys(map(tuple, pattern.welds.tolist()), "F")  # nothing folds there
    outer = set(pattern.boundary.ravel().tolist())
    rows = []
    for vertex, corners in _corners(pattern).items():
        if vertex in outer:
            continue
        around = _around(corners)
        if len(around) < len(corners):
            continue  # panels that meet here only at this point
        angles = np.array([corners[after][1] for after in around])
        kinds = [letter[min(vertex, after), max(vertex, after)] for after in around]
        folds = np.array([kind != "F" for kind in kinds])
        rows.append(
            (
                vertex,
                kinds.count("M"),
                kinds.count("V"),
                kinds.count("U"),
                2 * np.pi - angles.sum(),
                _alternating(angles, folds),
            )
        )
    columns = np.array(sorted(rows), dtype=np.float64).reshape(-1, 6).T
    return FlatFoldability(*columns[:4].astype(np.int64), *columns[4:])


def _corners(pattern: Pattern) -> dict[int, dict[int, tuple[int, float]]]:
    """For each vertex, the corners of faces there: next vertex to (previous vertex, angle)."""
    faces = pattern.faces
    vertex = np.array([v for face in faces for v in face])
    following = np.array([v for face in faces for v in (*face[1:], face[0])])
    previous = np.array([v for face in faces for v in (face[-1], *face[:-1])])
    normal = np.repeat(pattern.face_normals, [len(face) for face in faces], axis=0)
    after = pattern.vertices[following] - pattern.vertices[vertex]
    before = pattern.vertices[previous] - pattern.vertices[vertex]
    sine = np.einsum("ij,ij->i", np.cross(after, before), normal)
    angle = np.arctan2(sine, np.einsum("ij,ij->i", after, before)) % (2 * np.pi)
    corners: dict[int, dict[int, tuple[int, float]]] = {}
    rows = zip(vertex.tolist(), following.tolist(), previous.tolist(), angle.tolist(), strict=True)
    for v, after_v, before_v, angle_v in rows:
        corners.setdefault(v, {})[after_v] = (before_v, angle_v)
    return corners


def _around(corners: dict[int, tuple[int, float]]) -> list[int]:
    """Neighbors of a vertex counter-clockwise, each before the corner that follows it."""
    first = after = min(corners)
    found = []
    while after in corners:
        found.append(after)
        after = corners[after][0]
        if after == first:
            return found
    return []


def _alternating(angles: NDArray[np.float64], folds: NDArray[np.bool_]) -> float:
    """Kawasaki's sum of the angles after each crease, merged across flat creases."""
    count = int(folds.sum())
    if count == 0:
        return 0.0
    if count % 2:
        return np.nan
    sector = (np.cumsum(folds) - 1) % count  # sector 0 starts at the first fold
    return abs(float(np.sum(np.where(sector % 2 == 0, angles, -angles))))
