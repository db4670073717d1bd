"""What a mass rule distributes, and small helpers that rules share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse


class Surface(NamedTuple):
    """Panels and triangles of a structure with their areas (SI)."""

    nodes: NDArray  # (n, 3)
    faces: tuple[tuple[int, ...], ...]  # corners of each panel
    centers: NDArray  # (np,) center node of each panel, -1 without one
    triangles: NDArray  # (nt, 3)
    triangle_panel: NDArray  # (nt,)
    triangle_area: NDArray  # (nt,) m2
    areal_density: float  # kg/m2

    @property
    def panel_mass(self) -> NDArray:
        """Mass of each panel (np,), kg."""
        area = np.bincount(self.triangle_panel, self.triangle_area, minlength=len(self.faces))
        return self.areal_density * area


def lumped(mass: NDArray) -> sparse.csr_array:
    """Diagonal mass matrix of nodal masses (n,)."""
    return sparse.csr_array(sparse.diags_array(mass))


def from_triangle_shares(surface: Surface, shares: NDArray) -> sparse.csr_array:
    """Lumped matrix from shares (nt, 3) of each triangle's mass for its corners."""
    mass = shares * (surface.areal_density * surface.triangle_area)[:, None]
    total = np.bincount(surface.triangles.ravel(), mass.ravel(), minlength=len(surface.nodes))
    return lumped(total)


def corner_angles(surface: Surface) -> tuple[NDArray, NDArray]:
    """Squared edge lengths opposite each corner (nt, 3), and cotangents of the angles (nt, 3)."""
    x = surface.nodes[surface.triangles]
    opposite = np.roll(x, -2, axis=1) - np.roll(x, -1, axis=1)
    squared = np.einsum("tkc,tkc->tk", opposite, opposite)
    others = squared.sum(axis=1, keepdims=True) - 2.0 * squared
    return squared, others / (4.0 * surface.triangle_area[:, None])


def circumcentric_shares(surface: Surface) -> NDArray:
    """Share of each triangle nearest to each corner, by perpendicular bisectors (nt, 3)."""
    squared, cotangent = corner_angles(surface)
    part = squared * cotangent / (8.0 * surface.triangle_area[:, None])
    return np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1)
