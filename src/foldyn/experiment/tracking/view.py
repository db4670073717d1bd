"""A camera's view of a model: the pose fitted to corners, and back-projection."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.results import case_of
from foldyn.results.contents import check_variable

Array = NDArray[np.float64]

_MOST_STATES = 200
FARTHEST = 1e4  # m, largest distance of a camera: from here lines of sight are parallel


@brief
@dataclass(frozen=True, eq=False)
class TrackedModel:
    """The model for tracking: its nodes, panels and possible states.

    Attributes
    ----------
    rest : ndarray, shape (n, 3)
        Positions of all nodes at rest (m); vertices of the pattern come first.
    states : ndarray, shape (k, n, 3)
        Positions (m) in the possible states of the specimen, in the order of a path.
    triangles : ndarray, shape (m, 3)
    vertices : int
        Number of the pattern's vertices: only they can be seen as corners.
    edges : ndarray, shape (e, 2)
        Creases and boundary edges, for pictures.
    """

    rest: NDArray[np.float64]
    states: NDArray[np.float64]
    triangles: NDArray[np.int64]
    vertices: int
    edges: NDArray[np.int64]

    @classmethod
    def of(cls, thing: Any) -> TrackedModel:
        """Model of a case or structure at rest, or of a result of `trace` with all its states."""
        if not isinstance(thing, xr.Dataset):
            structure = getattr(thing, "structure", thing)
            rest = np.asarray(structure.nodes, dtype=np.float64)
            triangles = np.asarray(structure.triangles, dtype=np.int64)
            edges = np.asarray(structure.pattern.edges, dtype=np.int64)
            return cls(rest, rest[np.newaxis], triangles, len(structure.pattern.vertices), edges)
        if "displacement" not in thing or "rest_position" not in thing:
            raise InputError("--model: the result has no displacements; give a case or a path")
        at_rest = cls.of(case_of(thing))
        if thing["displacement"].ndim != 3:
            raise InputError("--model: give a path or a motion, not modes or responses")
        place, along = ("node", "axis"), str(thing["displacement"].dims[0])
        rest = check_variable(thing, "rest_position", place, place="--model: ").values
        moved = check_variable(thing, "displacement", (along, *place), place="--model: ").values
        states = rest + moved
        if not states.size or not np.isfinite(states).all():
            raise InputError("--model: the result holds no finite displacements; compute it again")
        thin = np.unique(np.linspace(0, len(states) - 1, _MOST_STATES).round().astype(int))
        return replace(at_rest, rest=rest, states=states[thin])


@brief
@dataclass(frozen=True)
class View:
    """View of a camera, described by the scale in one plane.

    Points are seen at center + (right, down) / (metres_per_pixel (1 + depth / distance)). Here
    right, down and depth are measured from `origin` along the rows of `rotation`; the scale holds
    in the plane through `origin`.

    Attributes
    ----------
    rotation : ndarray, shape (3, 3)
        Rows are the unit vectors to the right, down and away from the camera, in the model's axes.
    origin : ndarray, shape (3,)
        A point of the model (m).
    center : ndarray, shape (2,)
        Pixel at which `origin` is seen.
    metres_per_pixel : float
        Scale in the plane through `origin`.
    distance : float
        Distance of that plane from the camera (m); if infinite, depth does not change the size of
        an object in the picture.
    axis : ndarray, shape (2,)
        Pixel at which the camera's axis meets the image; points farther away appear closer to it.
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
        flat = (self.center - self.axis) + seen[..., :2] / self.metres_per_pixel
        return self.axis + flat / (1.0 + seen[..., 2:] / self.distance)

    def depth(self, points: ArrayLike) -> Array:
        """Distance of points (..., 3) behind the plane of the scale (m)."""
        return (np.asarray(points, dtype=np.float64) - self.origin) @ self.rotation[2]

    def back(self, uv: ArrayLike, depth: ArrayLike) -> Array:
        """Points (..., 3) seen at pixels (..., 2), at `depth` (m) behind the plane of the scale."""
        z = np.asarray(depth, dtype=np.float64)[..., np.newaxis]
        flat = (np.asarray(uv, dtype=np.float64) - self.axis) * (1.0 + z / self.distance)
        seen = (flat - (self.center - self.axis)) * self.metres_per_pixel
        z = np.broadcast_to(z, (*seen.shape[:-1], 1))
        return self.origin + np.concatenate([seen, z], axis=-1) @ self.rotation

    def camera(self) -> Array:
        """Position (3,), m, of the camera, at most `FARTHEST` away."""
        distance = min(self.distance, FARTHEST)
        aside = (self.axis - self.center) * self.metres_per_pixel
        return self.origin + np.append(aside, -distance) @ self.rotation

    def turned(self, rotvec: ArrayLike) -> View:
        """The same view with the model turned by a rotation vector (rad) in the camera's axes."""
        turn = Rotation.from_rotvec(np.asarray(rotvec, dtype=np.float64)).as_matrix()
        return replace(self, rotation=turn @ self.rotation)


def fit_view(
    view: View, points: Array, uv: Array, scaled: bool, placed: bool, shapes: Array | None = None
) -> tuple[View, float, float]:
    """Fit a view to points and their pixels.

    Parameters
    ----------
    view : View
        View to start from; its `axis` is kept.
    points : ndarray, shape (m, 3)
        Positions in the model (m).
    uv : ndarray, shape (m, 2)
    scaled : bool
        Whether the scale is known and kept.
    placed : bool
        Whether the distance is known and kept.
    shapes : ndarray, shape (2, m, 3), optional
        Positions in the previous and next states; the state is then fitted too.

    Returns
    -------
    view : View
    state : float
        0 for `points`, down to -1 for the previous state and up to 1 for the next.
    rms : float
        Root mean square distance between seen and projected points (pixels).
    """
    extent = float(np.ptp(points, axis=0).max())
    size, nearness = extent / view.metres_per_pixel, extent / view.distance

    def unpack(x: Array) -> tuple[View, Array, float]:
        moved = replace(view.turned(x[2:5]), center=view.center + size * x[:2])
        if not scaled:
            moved = replace(moved, metres_per_pixel=view.metres_per_pixel * np.exp(x[5]))
        if not placed:
            moved = replace(moved, distance=extent / max(nearness + x[5 + (not scaled)], 1e-9))
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
    if not placed:  # fitted between infinity and twice the model's size
        low[5 + (not scaled)], high[5 + (not scaled)] = -nearness - 1e-6, 0.5 - nearness
    fit = least_squares(misfit, np.zeros(count), bounds=(low, high), loss="soft_l1", f_scale=3.0)
    fitted, _, state = unpack(fit.x)
    left = misfit(fit.x).reshape(-1, 2)
    return fitted, state, float(np.sqrt(np.mean(np.sum(left**2, axis=1))))


def hidden_nodes(points: Array, triangles: NDArray[np.int64], view: View) -> NDArray[np.bool_]:
    """Nodes that lie behind a triangle as seen in a view."""
    flat, depth = view.project(points), view.depth(points)
    hidden = np.zeros(len(points), dtype=bool)
    slack = 1e-3 * np.ptp(points, axis=0).max()
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    drawn = np.abs(area) > 1e-9
    a, b, c, area, corner = a[drawn], b[drawn], c[drawn], area[drawn], triangles[drawn]
    for node in range(len(points)):
        d = flat[node] - a
        s = (d[:, 0] * (c - a)[:, 1] - d[:, 1] * (c - a)[:, 0]) / area
        t = ((b - a)[:, 0] * d[:, 1] - (b - a)[:, 1] * d[:, 0]) / area
        inside = (s > 1e-6) & (t > 1e-6) & (s + t < 1.0 - 1e-6) & ~(corner == node).any(axis=1)
        z = (1.0 - s - t) * depth[corner[:, 0]] + s * depth[corner[:, 1]] + t * depth[corner[:, 2]]
        hidden[node] = bool((inside & (z < depth[node] - slack)).any())
    return hidden
