"""A perspective camera with radial lens distortion, the scale of its pictures, and OpenCV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from foldyn.arguments import brief
from foldyn.errors import InputError, optional
from foldyn.values import choice, number

_TERMS = 6  # degree, in r^2, of the polynomial that inverts the distortion
_REACH = 1.08  # radius up to which it is fitted, relative to half the image diagonal
_LARGEST_SPREAD = 0.02  # allowed spread of the lengths that define a scale

# Unit vectors by name: "x", "-x", "+z".
DIRECTIONS = {
    f"{sign}{axis}": (1.0 if sign != "-" else -1.0) * np.eye(3)[k]
    for k, axis in enumerate("xyz")
    for sign in ("", "+", "-")
}


def opencv() -> Any:
    """Return the module `cv2`, an optional dependency.

    Raises
    ------
    InputError
        It is not installed.
    """
    install = "opencv-python-headless (or foldyn[experiment])"
    return optional("cv2", "camera tracking needs OpenCV", install)


def axes_of_view(up: str = "-x", facing: str = "z") -> NDArray[np.float64]:
    """Rotation from the model's axes to image axes: right, down and forward.

    Parameters
    ----------
    up : str
        Direction of the model that points up in the image; with "-x", for example, x points down.
    facing : str
        Direction of the model that points towards the camera.

    Returns
    -------
    ndarray, shape (3, 3)
        Rows are the unit vectors to the right, down and away from the camera.

    Raises
    ------
    InputError
        The two directions are not at a right angle.
    """
    top = DIRECTIONS[choice("up", up, DIRECTIONS)]
    toward = DIRECTIONS[choice("facing", facing, DIRECTIONS)]
    if abs(top @ toward) > 0.5:
        raise InputError(f"up: {up!r} and facing: {facing!r} lie along the same axis; turn one")
    return np.array([np.cross(top, toward), -top, -toward])


@brief
@dataclass(frozen=True)
class Camera:
    """Pinhole camera with radial distortion; (0, 0) is the center of the upper left pixel.

    A point with the camera coordinates (x, y, z), z forward, is seen at
    center + focal (1 + k1 r^2 + k2 r^4) (x, y)/z with r^2 = (x^2 + y^2)/z^2 (Brown, 1971).

    Attributes
    ----------
    size : tuple of int
        Width and height (pixels).
    focal : float
        Focal length (pixels).
    rotation : ndarray, shape (3, 3)
        Rows are the unit vectors to the right, down and forward, in the model's axes.
    position : ndarray, shape (3,)
        Position of the pinhole (m).
    k1, k2 : float
        Radial distortion; the image must not fold back on itself.
    """

    size: tuple[int, int]
    focal: float
    rotation: NDArray[np.float64]
    position: NDArray[np.float64]
    k1: float = 0.0
    k2: float = 0.0

    def __post_init__(self) -> None:
        number("focal", self.focal, above=0.0, unit="pixels")
        if min(self.size) < 8:
            raise InputError(f"size: {self.size} pixels; at least 8 x 8 are needed")
        r2 = self._outermost**2 * np.linspace(0.0, 1.0, 64) ** 2
        if (1.0 + 3.0 * self.k1 * r2 + 5.0 * self.k2 * r2**2 <= 0.1).any():
            raise InputError(
                f"k1, k2: {self.k1:g}, {self.k2:g} fold the image back on itself within its "
                "corners; take smaller ones"
            )

    @classmethod
    def looking_at(
        cls,
        target: ArrayLike,
        distance: float,
        *,
        metres_per_pixel: float,
        size: tuple[int, int],
        up: str = "-x",
        facing: str = "z",
        k1: float = 0.0,
        k2: float = 0.0,
        turned: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Camera:
        """Camera at a distance (m) from a point, which it shows in the middle of the image.

        `metres_per_pixel` is the scale in the plane through the target. `turned` are the angles
        (degrees) by which the camera goes around the target, about the directions right, down and
        forward of the image.
        """
        number("distance", distance, above=0.0, unit="m")
        number("metres_per_pixel", metres_per_pixel, above=0.0)
        tilt = Rotation.from_rotvec(np.radians(np.asarray(turned, dtype=float))).as_matrix()
        rotation = tilt @ axes_of_view(up, facing)
        position = np.asarray(target, dtype=np.float64) - distance * rotation[2]
        return cls(size, distance / metres_per_pixel, rotation, position, k1, k2)

    @property
    def center(self) -> NDArray[np.float64]:
        """Pixel at which the camera's axis meets the image."""
        return 0.5 * (np.array(self.size, dtype=np.float64) - 1.0)

    def depth(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distance of points (..., 3) from the pinhole along the axis (m)."""
        return (np.asarray(points, dtype=np.float64) - self.position) @ self.rotation[2]

    def straight(self, points: ArrayLike) -> NDArray[np.float64]:
        """Slopes (x, y)/z of the rays to points (..., 3), shape (..., 2)."""
        seen = (np.asarray(points, dtype=np.float64) - self.position) @ self.rotation.T
        if (seen[..., 2] <= 0.0).any():
            raise InputError("points: some lie behind the camera; move it away from them")
        return seen[..., :2] / seen[..., 2:]

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pixels (u, v) at which points (..., 3) in m are seen."""
        slope = self.straight(points)
        r2 = np.sum(slope**2, axis=-1, keepdims=True)
        return self.center + self.focal * (1.0 + self.k1 * r2 + self.k2 * r2**2) * slope

    @property
    def _outermost(self) -> float:
        """Slope of the ray to a corner, ignoring distortion."""
        return _REACH * 0.5 * float(np.hypot(*self.size)) / self.focal

    @cached_property
    def inverse(self) -> NDArray[np.float64]:
        """Coefficients of the factor from distorted to undistorted slopes, a polynomial in r^2."""
        r = self._outermost * np.linspace(0.01, 1.0, 200)
        seen = r * (1.0 + self.k1 * r**2 + self.k2 * r**4)
        top = seen.max() ** 2
        powers = (seen**2 / top)[:, np.newaxis] ** np.arange(_TERMS)
        return np.linalg.lstsq(powers, r / seen, rcond=None)[0] / top ** np.arange(_TERMS)


class Sight(NamedTuple):
    """Position and viewing direction of a camera in the model's axes.

    A single camera cannot measure motion along the line of sight. So a track gives the point where
    the line of sight to a node meets the plane that contained the node when the model was
    recognized. The model also moves along the line of sight, so it is compared as the camera would
    see it.

    Attributes
    ----------
    position, direction : ndarray, shape (3,)
        Position of the camera (m), and its viewing direction (a unit vector), in the model's axes.
    depth : ndarray, shape (n,)
        Distance (m) of the planes of nodes 0..n-1 from the camera along this direction.
    """

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    depth: NDArray[np.float64]

    @classmethod
    def of(cls, tracks: xr.Dataset) -> Sight | None:
        """The camera that took a film; None if the tracks do not describe it."""
        if "camera_depth" not in tracks:
            return None
        at, way = (np.array(tracks.attrs[f"camera_{name}"]) for name in ("position", "direction"))
        return cls(at, way, tracks["camera_depth"].values)

    def seen(self, nodes: NDArray[np.int64], rest: NDArray, moved: NDArray) -> NDArray[np.float64]:
        """Apparent displacements (t, m, 3), in m, of nodes (m,) whose displacements are `moved`.

        rest : (m, 3) positions at rest, m.
        """
        away = rest + moved - self.position
        nearer = self.depth[nodes] / (away @ self.direction)
        return self.position + nearer[..., None] * away - rest


@dataclass(frozen=True)
class Scale:
    """Image scale in one plane in front of the camera.

    Attributes
    ----------
    metres_per_pixel : float
    spread : float
        Largest relative deviation among the lengths that define the scale: large if the camera was
        tilted, or the lengths lie at different depths. NaN for a single length.
    """

    metres_per_pixel: float
    spread: float = float("nan")

    def __post_init__(self) -> None:
        number("--scale", self.metres_per_pixel, above=0.0, unit="m per pixel")


def scale_of_lengths(references: Sequence[Sequence[float]]) -> Scale:
    """Scale from lengths between two pixels each.

    Parameters
    ----------
    references : sequence of (u1, v1, u2, v2, metres)
        Two pixels and the length between them; usually two lengths, one across and one along.

    Raises
    ------
    InputError
        There is no length, a length is zero, or the scales of the lengths differ by more than 2 %.
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
    photo: NDArray[np.uint8], columns: int, *, rows: int, square: float, place: str = "the photo"
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
        Name of the photo in messages.

    Returns
    -------
    Scale
        Scale, whose spread is that of the sides of all squares; it grows as the board tilts.

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
