"""How well a mass matrix keeps the rotational inertia of a panel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.structures.mass.consistent import consistent
from foldyn.structures.mass.surface import Surface


def rotational_inertia(mass: sparse.csr_array, nodes: NDArray, start: int, end: int) -> float:
    """Moment of inertia (kg m2) of a mass matrix about the line through two nodes."""
    axis = nodes[end] - nodes[start]
    axis = axis / np.linalg.norm(axis)
    arm = nodes - nodes[start]
    arm = arm - np.outer(arm @ axis, axis)
    return float(sum(arm[:, c] @ (mass @ arm[:, c]) for c in range(3)))


def rotational_inertia_errors(mass: sparse.csr_array, surface: Surface, edges: NDArray) -> NDArray:
    """Relative error of the inertia about each edge (ne, 2) of a single flat panel.

    The consistent matrix is exact there: distances from an edge are linear over triangles.
    """
    exact = consistent(surface)
    return np.array(
        [
            rotational_inertia(mass, surface.nodes, a, b)
            / rotational_inertia(exact, surface.nodes, a, b)
            - 1.0
            for a, b in np.asarray(edges).tolist()
        ]
    )
