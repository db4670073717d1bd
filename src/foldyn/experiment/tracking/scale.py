"""Metres per pixel, from known lengths or from a flat target, and their change with depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.experiment.camera import opencv
from foldyn.values import number

_LARGEST_SPREAD = 0.02


@dataclass(frozen=True)
class Scale:
    """Scale of the image in one plane before the camera.

    Attributes
    ----------
    metres_per_pixel : float
    spread : float
        Largest relative deviation of the lengths that it was found from: if they differ, the camera
        was tilted, or they lie at different depths. NaN for a single length.
    """

    metres_per_pixel: float
    spread: float = float("nan")

    def __post_init__(self) -> None:
        number("--scale", self.metres_per_pixel, above=0.0, unit="m per pixel")

    def at_depth(self, behind: ArrayLike, distance: float) -> NDArray[np.float64]:
        """Metres per pixel `behind` the plane (m), `distance` (m) being the plane's own.

        A pinhole shows what is farther away smaller, in proportion to its distance.
        """
        number("--distance", distance, above=0.0, unit="m")
        return self.metres_per_pixel * (1.0 + np.asarray(behind, dtype=np.float64) / distance)


def scale_of_lengths(references: Sequence[Sequence[float]]) -> Scale:
    """Scale from lengths between two pixels each.

    Parameters
    ----------
    references : sequence of (u1, v1, u2, v2, metres)
        Usually two, one across and one along.

    Raises
    ------
    InputError
        None, a length of zero, or lengths whose scales differ by more than 2 %.
    """
    if not len(references):
        raise InputError("--reference: give at least one PX1,PY1,PX2,PY2,METRES")
    scales = []
    for u1, v1, u2, v2, metres in references:
        pixels = float(np.hypot(u2 - u1, v2 - v1))
        if not (np.isfinite(pixels) and pixels > 0.0 and np.isfinite(metres) and metres > 0.0):
            raise InputError(
                f"--reference {u1:g},{v1:g},{u2:g},{v2:g},{metres:g}: the two pixels must differ "
                "and the length be positive"
            )
        scales.append(metres / pixels)
    mean = float(np.mean(scales))
    spread = float(np.max(np.abs(np.array(scales) / mean - 1.0)))
    if spread > _LARGEST_SPREAD:
        listed = ", ".join(f"{scale:.4g}" for scale in scales)
        raise InputError(
            f"--reference: the lengths say {listed} metres per pixel, which differ by more than "
            f"{2 * _LARGEST_SPREAD:.0%}; measure them in one plane, square to the camera"
        )
    return Scale(mean, spread if len(scales) > 1 else float("nan"))


def scale_of_target(
    photo: NDArray[np.uint8], columns: int, rows: int, square: float, place: str = "the photo"
) -> Scale:
    """Scale from a chessboard, held square to the camera in the plane of the motion.

    Parameters
    ----------
    photo : ndarray of uint8, shape (height, width)
    columns, rows : int
        Inner corners of the board across and along.
    square : float
        Side of its squares (m).
    place : str
        What the photo is called in messages.

    Returns
    -------
    Scale
        Its spread is that of the sides of all squares: it grows as the board tilts.

    Raises
    ------
    InputError
        The board is not found.
    """
    cv2 = opencv()
    number("square", square, above=0.0, unit="m")
    size, accurately = (columns, rows), cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(photo, size, flags=accurately)
    if not found:
        raise InputError(
            f"{place}: no chessboard of {columns} x {rows} inner corners; show all of it, with a "
            "white margin, sharp and evenly lit"
        )
    grid = corners.reshape(rows, columns, 2).astype(np.float64)
    sides = np.concatenate([np.hypot(*np.diff(grid, axis=k).reshape(-1, 2).T) for k in (0, 1)])
    return Scale(square / float(sides.mean()), float(np.abs(sides / sides.mean() - 1.0).max()))
