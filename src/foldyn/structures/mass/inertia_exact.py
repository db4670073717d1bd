"""Rule `inertia_exact`: nodal masses with the panel's own mass, center of mass and inertia.

On a parallelogram with a center node: 2/3 at the center and 1/12 at each corner have exactly the
second moments of the panel about every axis. On other panels the non-negative masses with the
exact total and center of mass whose second moments come nearest to the panel's (least squares);
on a panel without center node that leaves a third each for a triangle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, sparse

from foldyn.structures.mass.surface import Surface, lumped

WEIGHT = 1e3  # of total and center of mass against second moments, before the exact correction


def inertia_exact(surface: Surface) -> sparse.csr_array:
    """Masses that keep the rotational inertia of each panel as far as its nodes allow."""
    mass = np.zeros(len(surface.nodes))
    total = surface.panel_mass
    first = np.searchsorted(surface.triangle_panel, np.arange(len(surface.faces) + 1))
    known: dict[bytes, NDArray] = {}
    for p, face in enumerate(surface.faces):
        center = int(surface.centers[p])
        nodes = [*face, center] if center >= 0 else list(face)
        x = surface.nodes[nodes]
        if len(nodes) == 5 and _is_parallelogram(x):
            mass[nodes] += total[p] * np.array([1.0, 1.0, 1.0, 1.0, 8.0]) / 12.0
            continue
        triangles = surface.triangles[first[p] : first[p + 1]]
        area = surface.triangle_area[first[p] : first[p + 1]]
        flat, moments = _moments(x, surface.nodes[triangles], area)
        key = flat.round(9).tobytes()
        if key not in known:
            known[key] = _fit(flat, moments)
        mass[nodes] += total[p] * known[key]
    return lumped(mass)


def _is_parallelogram(x: NDArray) -> bool:
    return bool(np.abs(x[0] + x[2] - x[1] - x[3]).max() < 1e-9 * np.ptp(x, axis=0).max())


def _moments(x: NDArray, triangles: NDArray, area: NDArray) -> tuple[NDArray, NDArray]:
    """Nodes in the panel's plane, scaled to its size, and the panel's moments per unit mass."""
    share = area / area.sum()
    middle = np.einsum("t,tc->c", share, triangles.mean(axis=1))
    _, _, axes = np.linalg.svd(x - middle)
    scale = np.abs((x - middle) @ axes[:2].T).max()
    flat = (x - middle) @ axes[:2].T / scale
    corners = (triangles - middle) @ axes[:2].T / scale
    # integral of x x^T over a triangle: A/12 (sum of v v^T + s s^T), s the sum of its corners
    s = corners.sum(axis=1)
    second = np.einsum("t,tka,tkb->ab", share / 12.0, corners, corners)
    second += np.einsum("t,ta,tb->ab", share / 12.0, s, s)
    return flat, np.array([1.0, 0.0, 0.0, second[0, 0], second[1, 1], second[0, 1]])


def _fit(flat: NDArray, moments: NDArray) -> NDArray:
    """Non-negative weights: total and first moments exact, second moments nearest."""
    a, b = flat.T
    rows = np.array([np.ones_like(a), a, b, a * a, b * b, a * b])
    scale = np.array([WEIGHT, WEIGHT, WEIGHT, 1.0, 1.0, 1.0])
    weights, _ = optimize.nnls(rows * scale[:, None], moments * scale)
    active = weights > 0.0
    constraint = rows[:3, active]
    residual = moments[:3] - constraint @ weights[active]
    weights[active] += np.linalg.pinv(constraint) @ residual
    weights = np.maximum(weights, 0.0)
    return weights / weights.sum()
