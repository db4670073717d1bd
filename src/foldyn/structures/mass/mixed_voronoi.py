"""Rule `mixed_voronoi`: perpendicular bisectors, made safe for obtuse triangles."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from foldyn.structures.mass.surface import (
    Surface,
    circumcentric_shares,
    corner_angles,
    from_triangle_shares,
)


def mixed_voronoi(surface: Surface) -> sparse.csr_array:
    """Circumcentric shares; an obtuse triangle gives 1/2 to its obtuse corner, 1/4 to the others.

    Source: Meyer et al., Discrete differential-geometry operators for triangulated
    2-manifolds, 2003, section 3.3.
    """
    _, cotangent = corner_angles(surface)
    obtuse = cotangent < 0.0
    fallback = np.where(obtuse, 0.5, 0.25)
    shares = np.where(obtuse.any(axis=1, keepdims=True), fallback, circumcentric_shares(surface))
    return from_triangle_shares(surface, shares)
