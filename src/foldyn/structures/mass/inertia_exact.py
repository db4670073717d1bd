"""Rule `inertia_exact`: nodal masses with the panel's own mass, center of mass and inertia.

On a parallelogram with a center node: 2/3 at the center and 1/12 at each corner have exactly the
second moments of the panel about every axis. On other panels the masses start from those of the
centroid rule, which have the exact total and center of mass, and go towards the nearest ones that
have the second moments too (or come as near as they can, by least squares), as far as every node
keeps a quarter of its start: a node without mass could not move. A triangle without center node
keeps a third for each corner.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.structures.mass.surface import Surface, lumped

LEAST = 0.25  # of the centroid rule's share; a parallelogram's corners need one half


def inertia_exact(surface: Surface) -> sparse.csr_array:
    """Masses that keep the rotational inertia of each panel as far as its nodes allow."""
    mass = np.zeros(len(surface.nodes))
    total = surface.panel_mass
    first = np.searchsorted(surface.triangle_panel, np.arange(len(surface.faces) + 1))
    for p, face in enumerate(surface.faces):
        center = int(surface.centers[p])
        nodes = [*face, center] if center >= 0 else list(face)
        x = surface.nodes[nodes]
        if len(nodes) == 3:
            share = np.full(3, 1.0 / 3.0)
        elif len(nodes) == 5 and _is_parallelogram(x):
            share = np.array([1.0, 1.0, 1.0, 1.0, 8.0]) / 12.0
        else:
            inside = slice(first[p], first[p + 1])
            place = {node: k for k, node in enumerate(nodes)}
            corners = np.array([[place[v] for v in t] for t in surface.triangles[inside].tolist()])
            area = surface.triangle_area[inside]
            share = _shares(x, corners, area / area.sum())
        mass[nodes] += total[p] * share
    return lumped(mass)


def _is_parallelogram(x: NDArray) -> bool:
    """Whether corners x[:4] are those of a parallelogram and x[4] is its middle."""
    off = np.abs([x[0] + x[2] - x[1] - x[3], x[0] + x[2] - 2.0 * x[4]])
    return bool(off.max() < 1e-9 * np.ptp(x, axis=0).max())


def _shares(x: NDArray, triangles: NDArray, part: NDArray) -> NDArray:
    """Shares of nodes x (m, 3) of a panel's mass, `part` of which lies in each triangle."""
    start = np.bincount(triangles.ravel(), np.repeat(part / 3.0, 3), minlength=len(x))
    x = x - start @ x
    x = x / np.abs(x).max()
    # integral of x x^T over a triangle: A/12 (sum of v v^T + s s^T), s the sum of its corners
    corners = x[triangles]
    s = corners.sum(axis=1)
    wanted = np.einsum("t,tka,tkb->ab", part / 12.0, corners, corners)
    wanted += np.einsum("t,ta,tb->ab", part / 12.0, s, s)
    missing = (wanted - np.einsum("k,ka,kb->ab", start, x, x)).ravel()
    # changes of the shares that leave total and center of mass alone
    kept = np.column_stack([np.ones(len(x)), x])
    left, singular, _ = np.linalg.svd(kept)
    free = left[:, int((singular > 1e-9 * singular[0]).sum()) :]
    products = np.einsum("ka,kb->abk", x, x).reshape(9, -1)
    change = free @ np.linalg.lstsq(products @ free, missing, rcond=1e-9)[0]
    down = change < 0.0
    allowed = (1.0 - LEAST) * start[down] / -change[down]
    return start + min(1.0, allowed.min(initial=1.0)) * change
