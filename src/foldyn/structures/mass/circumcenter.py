"""Rule `circumcenter`: triangles split by the perpendicular bisectors of their sides."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from foldyn.errors import InputError
from foldyn.structures.mass.surface import Surface, circumcentric_shares, from_triangle_shares


def circumcenter(surface: Surface) -> sparse.csr_array:
    """Split triangles at their circumcenters (Herkal et al., section 3).

    Raises
    ------
    InputError
        A triangle is so obtuse that a share is negative (below -1e-9 of the triangle; right
        angles pass).
    """
    shares = circumcentric_shares(surface)
    worst = np.unravel_index(np.argmin(shares), shares.shape)
    if shares[worst] < -1e-9:
        corner = int(surface.triangles[worst])
        number = int(surface.triangle_panel[worst[0]])
        raise InputError(
            f'mass = "circumcenter": panel {number} has an obtuse triangle, which would give node '
            f"{corner} {shares[worst]:.3g} of that triangle's mass; use "
            'mass = "mixed_voronoi": the same on other triangles, and never negative'
        )
    return from_triangle_shares(surface, np.maximum(shares, 0.0))
