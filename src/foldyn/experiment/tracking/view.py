"""How a camera sees a model: the pose that is fitted to matched corners, and the way back."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A camera far enough away to be described by the scale of one plane.

    Points are seen at center + (right, down) / (metres_per_pixel (1 + depth / distance)), all
    relative to `origin`, whose plane has the scale; right, down and depth are along the rows of
    `rotation`.

    Attributes
    ----------
    rotation : ndarray, shape (3, 3)
        Rows: to the right, down and away, in the model's axes.
    origin : ndarray, shape (3,)
        A point of the model (m), and
    center : ndarray, shape (2,)
        the pixel at which it is seen.
    metres_per_pixel : float
        In the plane through `origin`.
    distance : float
        Of that plane from the camera (m); infinite: things do not shrink with depth.
    axis : ndarray, shape (2,)
        Pixel in which the camera's axis meets the image: towards it things shrink with depth.
    """

    rotation: Array
    origin: Array
    center: Array
    metres_per_pixel: float
    distance: float
    axis: Array

    def project(self, points: ArrayLike) -> Array:
        """Pixels (..., 2) at which points (..., 3) in m are seen."""
        seen = (np.asarray(points, dtype=np.float64) - self.origin) @ self.rotation.T
        shrink = 1.0 + seen[..., 2:] / self.distance
        flat = (self.center - self.axis) + seen[..., :2] / self.metres_per_pixel
        return self.axis + flat / shrink

    def depth(self, points: ArrayLike) -> Array:
        """Distance of points (..., 3) behind the plane of the scale (m)."""
        return (np.asarray(points, dtype=np.float64) - self.origin) @ self.rotation[2]

    def back(self, uv: ArrayLike, depth: ArrayLike) -> Array:
        """Points (..., 3) seen at pixels (..., 2), `depth` (m) behind the plane of the scale."""
        z = np.asarray(depth, dtype=np.float64)[..., np.newaxis]
        flat = (np.asarray(uv, dtype=np.float64) - self.axis) * (1.0 + z / self.distance)
        seen = (flat - (self.center - self.axis)) * self.metres_per_pixel
        z = np.broadcast_to(z, (*seen.shape[:-1], 1))
        return self.origin + np.concatenate([seen, z], axis=-1) @ self.rotation

    def turned(self, rotvec: ArrayLike) -> View:
        """The same view with the model turned by a rotation vector (rad) in the camera's axes."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_rotvec(np.asarray(rotvec, dtype=np.float64)).as_matrix()
        return replace(self, rotation=turn @ self.rotation)


def fit_view(
    view: View,
    points: Array,
    uv: Array,
    scaled: bool,
    placed: bool,
    shapes: Array | None = None,
) -> tuple[View, float, float]:
    """Fit a view to points and the pixels at which they are seen.

    Parameters
    ----------
    view : View
        A guess; its axis is kept.
    points : ndarray, shape (m, 3)
        Positions in the model (m).
    uv : ndarray, shape (m, 2)
    scaled : bool
        The scale is known, and kept,
    placed : bool
        and so is the distance.
    shapes : ndarray, shape (2, m, 3), optional
        Positions in the states before and after: then the state is fitted, too.

    Returns
    -------
    view : View
    state : float
        0 for `points`, to -1 for the state before and to 1 for that after.
    rms : float
        Root mean square of the distances between seen and projected (pixels).
    """
    from scipy.optimize import least_squares

    extent = float(np.ptp(points, axis=0).max())
    size, nearness = extent / view.metres_per_pixel, extent / view.distance

    def unpack(x: Array) -> tuple[View, Array, float]:
        moved = replace(view.turned(x[2:5]), center=view.center + size * x[:2])
        if not scaled:
            moved = replace(moved, metres_per_pixel=view.metres_per_pixel * np.exp(x[5]))
        if not placed:
            near = max(nearness + x[5 + (not scaled)], 1e-9)
            moved = replace(moved, distance=extent / near)
        state = float(x[-1]) if shapes is not None else 0.0
        if shapes is None:
            return moved, points, state
        other = shapes[1] if state > 0.0 else shapes[0]
        return moved, points + abs(state) * (other - points), state

    def misfit(x: Array) -> Array:
        moved, place, _ = unpack(x)
        return (moved.project(place) - uv).ravel()

    count = 5 + (not scaled) + (not placed) + (shapes is not None)
    low, high = np.full(count, -1.0), np.full(count, 1.0)
    if not placed:  # between infinitely far away and twice the model's size
        low[5 + (not scaled)], high[5 + (not scaled)] = -nearness - 1e-6, 0.5 - nearness
    fit = least_squares(misfit, np.zeros(count), bounds=(low, high), loss="soft_l1", f_scale=3.0)
    fitted, _, state = unpack(fit.x)
    left = misfit(fit.x).reshape(-1, 2)
    return fitted, state, float(np.sqrt(np.mean(np.sum(left**2, axis=1))))
