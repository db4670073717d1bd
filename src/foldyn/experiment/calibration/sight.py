"""Where a camera is: what it sees of nodes that come nearer or go away.

Tracks tell where the line of sight of a node meets the plane in which it was when the model was
recognized: the motion along the line of sight is unknown to one camera. The model knows it, so a
model is compared as it would look.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray


class Sight(NamedTuple):
    """A camera, as a model sees it.

    Attributes
    ----------
    position, direction : ndarray, shape (3,)
        Of the camera (m), and the way in which it looks (a unit vector), in the model's axes.
    depth : ndarray, shape (n,)
        Distance (m) along it of the planes to which displacements of nodes 0..n-1 belong.
    """

    position: NDArray[np.float64]
    direction: NDArray[np.float64]
    depth: NDArray[np.float64]

    @classmethod
    def of(cls, tracks: xr.Dataset) -> Sight | None:
        """The camera of a film; None where its tracks do not tell."""
        if "camera_depth" not in tracks:
            return None
        there, way = (
            np.array(tracks.attrs[f"camera_{name}"]) for name in ("position", "direction")
        )
        return cls(there, way, tracks["camera_depth"].values)

    def seen(self, nodes: NDArray[np.int64], rest: NDArray, moved: NDArray) -> NDArray[np.float64]:
        """Displacements (t, m, 3), m, that tracks tell of nodes (m,) which move by `moved`.

        rest : (m, 3) positions at rest, m.
        """
        away = rest + moved - self.position
        nearer = self.depth[nodes] / (away @ self.direction)
        return self.position + nearer[..., None] * away - rest
