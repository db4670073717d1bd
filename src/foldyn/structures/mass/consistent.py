"""Rule `consistent`: the mass matrix of linear triangles, not lumped."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from foldyn.structures.mass.surface import Surface


def consistent(surface: Surface) -> sparse.csr_array:
    """rho A t / 12 [2 1 1; 1 2 1; 1 1 2] of each triangle, assembled.

    Its rotational inertia is exact about every axis in the plane of a panel.
    """
    element = (np.ones((3, 3)) + np.eye(3)) / 12.0
    values = (surface.areal_density * surface.triangle_area)[:, None, None] * element
    rows = np.repeat(surface.triangles, 3, axis=1).ravel()
    columns = np.tile(surface.triangles, (1, 3)).ravel()
    n = len(surface.nodes)
    return sparse.coo_array((values.ravel(), (rows, columns)), shape=(n, n)).tocsr()
