"""Potential flow about an open surface, by doublets whose strength is linear on each triangle.

The surface moves with the normal velocity w in a fluid that is at rest far away, and the only
vortices are bound to the surface. The potential jumps across the surface by m, which is zero on the
edge. The kinetic energy of the fluid for given w is the maximum over m of

    E(m) = rho (b'm - m'D m / 2),     b_i = int w phi_i dS,
    D_ij = 1/(4 pi) int int curl phi_i . curl phi_j / |x - y| dS dS',   curl phi = n x grad phi

(Nedelec 1982, Int. J. Numer. Methods Eng. 18; the jump m is a vortex sheet of strength curl m, and
D its self-inductance). With m linear on triangles, D is symmetric and positive definite for any
shape of triangles, and rho b'D^-1 b converges to the added mass from below as the triangles are
refined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import shared
from foldyn.mechanics.air.potentials import CLOSE, inverse_distances
from foldyn.mechanics.triangle import normals_of
from foldyn.threads import in_threads

BLOCK = 64e6  # bytes of the integrals in memory at once
ROWS = 16  # rows per thread at a time
FEW = 400  # up to this many triangles, one thread is enough


def inductance(points: NDArray, triangles: NDArray, unknown: NDArray) -> NDArray[np.float64]:
    """The matrix D (u, u), m, of an open surface.

    Parameters
    ----------
    points : ndarray, shape (p, 3)
        Positions of the points, m.
    triangles : ndarray of int, shape (t, 3)
        Corners, with consistent orientation.
    unknown : ndarray of int, shape (p,)
        Index of the unknown of each point, -1 on the edge of the surface.
    """
    corners = points[triangles]
    normals, areas = normals_of(corners)
    centers = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    inner = 0.5 * (corners + centers[:, None])  # weights 2/3, 1/6, 1/6
    curls = (np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)) / (
        2.0 * areas[:, None, None]
    )  # curl of each corner's shape function, along the opposite side
    numbers = unknown[triangles]
    size, count = int(unknown.max(initial=-1)) + 1, len(triangles)
    row, column = numbers.ravel() + 1, np.repeat(np.arange(count), 3)
    owner = sparse.csr_array((np.ones(row.size), (row, column)), (size + 1, count))
    out = np.zeros((size, size))
    do = in_threads if count > FEW else _one_by_one
    most = max(int(BLOCK / (8 * count)), ROWS)
    for begin in range(0, count, most):
        rows = np.empty((min(most, count - begin), count))

        def fill(first: int, rows: NDArray = rows, begin: int = begin) -> None:
            inverse_distances(
                corners, normals, areas, centers, radii, inner, CLOSE, begin + first,
                rows[first : first + ROWS],
            )  # fmt: skip

        do(fill, range(0, len(rows), ROWS))
        touched = np.unique(numbers[begin : begin + len(rows)])
        touched = touched[touched >= 0]

        def gather(part: NDArray, rows: NDArray = rows, begin: int = begin) -> None:
            _gather(rows, begin, curls, numbers, part, owner.indptr, owner.indices, out)

        do(gather, np.array_split(touched, max(len(touched) // ROWS, 1)))
    out += out.T.copy()
    return out * (0.25 / np.pi)


def _one_by_one(do: Callable[[Any], None], items: Iterable[Any]) -> None:
    for item in items:
        do(item)


@shared
def _gather(rows, begin, curls, numbers, chosen, starts, owners, out):
    """Add the contribution of rows of integrals, from triangle `begin` on, to chosen rows of D."""
    for i in chosen:
        for k in range(starts[i + 1], starts[i + 2]):
            a = owners[k]
            row = a - begin
            if row < 0 or row >= rows.shape[0]:
                continue
            for corner in range(3):
                if numbers[a, corner] != i:
                    continue
                x, y, z = curls[a, corner, 0], curls[a, corner, 1], curls[a, corner, 2]
                for b in range(a, rows.shape[1]):
                    by = rows[row, b]
                    for other in range(3):
                        j = numbers[b, other]
                        if j >= 0:
                            along = x * curls[b, other, 0] + y * curls[b, other, 1]
                            out[i, j] += by * (along + z * curls[b, other, 2])
