"""`Boards`: the panels of a pattern as boards with thickness, hinged off their midplanes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.patterns.geometry import FaceGeometry, face_geometry


@dataclass(frozen=True, eq=False)
class Boards:
    """Boards that represent a pattern's thick panels; usually made by `thicken`.

    Parameters
    ----------
    offsets : array_like, shape (np + 1,)
        Board p has the rows offsets[p] to offsets[p + 1] of `corners`, one for each corner of its
        panel.
    corners : array_like, shape (m, 3)
        Corners of the boards' middle surfaces at rest (m), in the order of each panel's corners.
    thickness : array_like, shape (np,)
        Thickness (m) of each board.

    Attributes
    ----------
    areas : ndarray, shape (np,)
        Areas of the middle surfaces (m2).
    normals : ndarray, shape (np, 3)
        Unit normals of the boards towards the front.
    centers : ndarray, shape (np, 3)
        Mean (m) of the corners of each board's middle surface.
    """

    offsets: NDArray[np.int64]
    corners: NDArray[np.float64]
    thickness: NDArray[np.float64]

    def __init__(self, offsets: ArrayLike, corners: ArrayLike, thickness: ArrayLike) -> None:
        for name, value, kind in (
            ("offsets", offsets, np.int64),
            ("corners", corners, np.float64),
            ("thickness", thickness, np.float64),
        ):
            array = np.array(value, dtype=kind)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def of(self, panel: int) -> NDArray[np.float64]:
        """Corners (k, 3) of one board's middle surface, m."""
        return self.corners[self.offsets[panel] : self.offsets[panel + 1]]

    @property
    def areas(self) -> NDArray[np.float64]:
        """Areas of the middle surfaces (np,), m2."""
        return self._geometry.face_areas

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals of the boards (np, 3) towards the front."""
        return self._geometry.face_normals

    @cached_property
    def centers(self) -> NDArray[np.float64]:
        """Mean (np, 3), m, of the corners of each board's middle surface."""
        return np.array([self.of(panel).mean(axis=0) for panel in range(len(self.thickness))])

    @cached_property
    def _geometry(self) -> FaceGeometry:
        """Geometry of the middle surfaces."""
        faces = tuple(tuple(range(*ends)) for ends in pairwise(self.offsets.tolist()))
        return face_geometry(self.corners, faces)

    def check(self, faces: tuple[tuple[int, ...], ...]) -> None:
        """Check that the boards match the faces of a pattern."""
        sizes = np.array([len(face) for face in faces])
        if not np.array_equal(np.diff(self.offsets), sizes) or len(self.thickness) != len(sizes):
            raise InputError("boards: give one for each face, with as many corners")
