"""Rigid motions that map a pattern to a neighboring copy: translations and screws.

By Chasles' theorem every rigid motion (without reflection) is a screw: a rotation about an axis and
a shift along the axis; without rotation it is a translation. All powers of a screw share the axis,
so any number of copies of a pattern are spaced correctly.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked
from foldyn.errors import InputError, UnitsWarning
from foldyn.values import number, show, vector

SPREAD = 1e-6
"""Least extent of points across a line, relative to their size, to determine a rotation."""
STILL = 1e-9  # rad: a smaller rotation counts as zero


def direction(name: str, value: ArrayLike) -> tuple[float, float, float]:
    """Return a direction: an axis by its name, or a nonzero vector."""
    if isinstance(value, str):
        if value not in ("x", "y", "z"):
            raise InputError(f' = {show(value)}: give "x", "y", "z" or three numbers', name)
        return tuple(np.eye(3)["xyz".index(value)].tolist())  # type: ignore[return-value]
    return vector(name, value, nonzero=True)


@dataclass(frozen=True)
class Screw(Checked):
    """A rotation about an axis by the right-hand rule, and a shift along the axis.

    Parameters
    ----------
    axis : {"x", "y", "z"} or sequence of float, shape (3,)
        Direction of the axis, of any length.
    angle : float
        Rotation (degrees); 0 makes it a translation.
    shift : float
        Shift (m) along the axis.
    point : sequence of float, shape (3,)
        Any point on the axis (m).

    Raises
    ------
    InputError
        An argument of the wrong kind, or neither a rotation nor a shift.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.Screw("z", 30.0, 0.5).images([[1.0, 0.0, 0.0]], 3).round(12).tolist()
    [[0.0, 1.0, 1.5]]
    """

    axis: Annotated[str | Sequence[float], Check(direction)]
    angle: Annotated[float, Check(number, unit="degrees")]
    shift: Annotated[float, Check(number, unit="m")]
    point: Annotated[Sequence[float], Check(vector, unit="m")] = (0.0, 0.0, 0.0)

    def agree(self) -> None:
        """Require a motion."""
        if self.angle % 360.0 == 0.0 and self.shift == 0.0:
            raise InputError(f" = 0, angle = {self.angle:g}: moves nothing; give one", "shift")

    @property
    def unit(self) -> NDArray[np.float64]:
        """Unit vector (3,) along the axis."""
        return np.array(self.axis) / np.linalg.norm(self.axis)

    @property
    def vector(self) -> NDArray[np.float64]:
        """Shift vector (3,), m."""
        return self.shift * self.unit

    @property
    def turns(self) -> bool:
        """Whether the motion has a rotation."""
        return self.angle != 0.0

    @property
    def twist(self) -> NDArray[np.float64]:
        """Logarithm (6,) of the motion: rotation vector (rad), then rate of the origin (m)."""
        turn = np.radians(self.angle) * self.unit
        return np.concatenate([turn, self.vector - np.cross(turn, self.point)])

    def rotation(self, power: int = 1) -> NDArray[np.float64]:
        """Rotation (3, 3) of a power of the motion."""
        if not self.turns or power == 0:
            return np.eye(3)
        from scipy.spatial.transform import Rotation

        return Rotation.from_rotvec(power * np.radians(self.angle) * self.unit).as_matrix()

    def images(self, points: ArrayLike, power: int = 1) -> NDArray[np.float64]:
        """Images of points (n, 3), m, under a power of the motion."""
        points, center = np.asarray(points, float), np.array(self.point)
        if not self.turns:
            return points + power * self.vector
        return (points - center) @ self.rotation(power).T + center + power * self.vector


def translation(vector: ArrayLike) -> Screw:
    """The screw without rotation for a translation (3,), m."""
    step = np.asarray(vector, float)
    return Screw(tuple(step.tolist()), 0.0, float(np.linalg.norm(step)))


def of_twist(twist: NDArray) -> Screw:
    """The motion with a given logarithm (6,); see `Screw.twist`."""
    turn, move = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    if angle < STILL:
        return translation(move)
    axis = turn / angle
    return _screw(axis, angle, float(move @ axis), np.cross(turn, move) / angle**2)


def _screw(axis: NDArray, angle: float, shift: float, point: NDArray) -> Screw:
    """A screw from computed values, which are not checked; angle in rad."""
    with warnings.catch_warnings(action="ignore", category=UnitsWarning):
        return Screw(tuple(axis.tolist()), math.degrees(angle), shift, tuple(point.tolist()))


def closest_rotations(products: NDArray) -> NDArray[np.float64]:
    """Rotations (k, 3, 3) that bring vectors b closest to a (Kabsch), for sums of a b^T."""
    left, _, right = np.linalg.svd(products)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]  # no reflections
    return left @ right


def motion_between(points: NDArray, images: NDArray, tolerance: float) -> tuple[Screw, NDArray]:
    """Motion from points (m, 3) to their images (m, 3), and the error of each image (m,), m.

    The motion is a translation if a translation fits within the tolerance (m), or if the points are
    too few or too nearly collinear to determine a rotation; else it is the screw of least squares
    (Kabsch, Acta Cryst. A 32, 1976).
    """
    step = (images - points).mean(axis=0)
    off = np.linalg.norm(points + step - images, axis=1)
    from_center, to_center = points - points.mean(axis=0), images - images.mean(axis=0)
    spread = np.linalg.svd(from_center, compute_uv=False)
    if off.max() <= tolerance or len(points) < 3 or spread[1] <= SPREAD * spread[0]:
        return translation(step), off
    from scipy.spatial.transform import Rotation

    turn = Rotation.align_vectors(to_center, from_center)[0]
    rotation, about = turn.as_matrix(), turn.as_rotvec()
    angle = float(np.linalg.norm(about))
    if angle < STILL:
        return translation(step), off
    axis = about / angle
    move = images.mean(axis=0) - rotation @ points.mean(axis=0)
    shift = float(move @ axis)
    point = np.linalg.lstsq(np.eye(3) - rotation, move - shift * axis, rcond=None)[0]
    found = _screw(axis, angle, shift, point)
    left = np.linalg.norm(found.images(points) - images, axis=1)
    if left.max() > tolerance:  # no motion fits; the majority may still tell which points are wrong
        usual = np.median(images - points, axis=0)
        off = np.linalg.norm(points + usual - images, axis=1)
        if 2 * (off <= tolerance).sum() > len(off):
            return translation(usual), off
    return found, left
