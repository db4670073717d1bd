"""Rules `equi_inertial` and `equi_inertial_acute`: fixed shares for N5B8 quadrilaterals.

4/9 (0.444) at the center, 1/4 at two opposite corners, 1/36 (0.028) at the other two: for a
rhombus of 60 degrees these are q^2/12p^2 and p^2/12q^2, p and q the half diagonals. Despite the
name the in-plane second moments of that rhombus are 1/3 (0.336 with the rounded 0.028) and 3 times
the exact ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.structures.mass.surface import Surface, lumped


def equi_inertial(surface: Surface) -> sparse.csr_array:
    """The heavier corners are the ends of the shorter diagonal (tie: 0 and 2).

    Source: Herkal et al., section 3.
    """
    return _distribute(surface, "equi_inertial", swapped=False)


def equi_inertial_acute(surface: Surface) -> sparse.csr_array:
    """The other orientation: the heavier corners are the ends of the longer diagonal."""
    return _distribute(surface, "equi_inertial_acute", swapped=True)


def _distribute(surface: Surface, name: str, swapped: bool) -> sparse.csr_array:
    corners = _quads(surface, name)
    x = surface.nodes[corners]
    even = np.linalg.norm(x[:, 2] - x[:, 0], axis=1)
    odd = np.linalg.norm(x[:, 3] - x[:, 1], axis=1)
    heavy_even = (even <= odd * (1.0 + 1e-9)) != swapped
    heavy, light = 1.0 / 4.0, 1.0 / 36.0
    shares = np.where(
        heavy_even[:, None], [heavy, light, heavy, light], [light, heavy, light, heavy]
    )
    total = surface.panel_mass
    n = len(surface.nodes)
    mass = np.bincount(corners.ravel(), (shares * total[:, None]).ravel(), minlength=n)
    return lumped(mass + np.bincount(surface.centers, 4.0 / 9.0 * total, minlength=n))


def _quads(surface: Surface, name: str) -> NDArray:
    other = [
        p
        for p, (face, center) in enumerate(zip(surface.faces, surface.centers, strict=True))
        if len(face) != 4 or center < 0
    ]
    if other:
        raise InputError(
            f'mass = "{name}" is defined for N5B8 quadrilaterals only, panel {other[0]} is '
            'not one: use mass = "mixed_voronoi" (any panel) or "inertia_exact"'
        )
    return np.array(surface.faces, np.int64)
