"""Added mass: fluid that moves with a sheet, M_a = rho B' D^-1 B."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, cho_factor, cholesky
from scipy.linalg.lapack import dpotri

from foldyn.errors import ComputationError
from foldyn.mechanics.air.doublets import inductance
from foldyn.mechanics.triangle import normals_of
from foldyn.threads import one_thread

COLUMNS = 256  # columns of a matrix to compute at once

Flow = NDArray[np.float64] | sparse.csr_array


@dataclass(frozen=True, eq=False)
class AddedMass:
    """Symmetric operator (kg) on displacements (3n,) or (3n, k), with dofs 3 node + axis.

    It is positive semidefinite: motions along the sheet move no fluid.

    Attributes
    ----------
    flux : sparse array, shape (u, 3n)
        B, m2: flux at each unknown of the flow due to nodal velocities.
    flow : ndarray or sparse array, shape (u, u)
        rho D^-1, kg/m4.
    """

    flux: sparse.csr_array
    flow: Flow

    @property
    def shape(self) -> tuple[int, int]:
        """3n, 3n."""
        return self.flux.shape[1], self.flux.shape[1]

    def __matmul__(self, motions: NDArray) -> NDArray[np.float64]:
        """Forces (N) that the nodes exert on the fluid if they have these accelerations (m/s2)."""
        return self.flux.T @ (self.flow @ (self.flux @ motions))

    def diagonal(self) -> NDArray[np.float64]:
        """Entries (3n,) on the diagonal."""
        out = np.zeros(self.shape[0])
        columns = sparse.csc_array(self.flux)
        for first in range(0, len(out), COLUMNS):
            part = columns[:, first : first + COLUMNS].toarray()
            out[first : first + COLUMNS] = np.einsum("uk,uk->k", part, self.flow @ part)
        return out

    def todense(self) -> NDArray[np.float64]:
        """The matrix (3n, 3n)."""
        return self.sparse.toarray()

    @property
    def moving(self) -> NDArray[np.int64]:
        """Indices of the dofs that move fluid."""
        return np.flatnonzero(np.diff(sparse.csc_array(self.flux).indptr))

    @property
    def rows(self) -> NDArray[np.float64]:
        """Rows G (u, 3n), kg^1/2, whose product G'G is the matrix; needs a full flow matrix."""
        return np.asarray(self.flux.T @ cholesky(self.flow, lower=True)).T

    @cached_property
    def sparse(self) -> sparse.csr_array:
        """The matrix (3n, 3n), with the entries of dofs that move fluid."""
        moving = self.moving
        flux = sparse.csr_array(sparse.csc_array(self.flux)[:, moving])
        small = flux.T @ (self.flow @ flux)
        small = sparse.coo_array(0.5 * (small + small.T))
        places = moving[small.coords[0]], moving[small.coords[1]]
        return sparse.csr_array((small.data, places), self.shape)


def flow_of(
    points: NDArray, triangles: NDArray, unknown: NDArray, parts: NDArray | None = None
) -> Flow:
    """Compute D^-1 (u, u), 1/m, of a surface of triangles.

    Parameters
    ----------
    points : ndarray, shape (p, 3)
        Corners of the triangles, m.
    triangles : ndarray of int, shape (t, 3)
        Corners of each triangle, with consistent orientation.
    unknown : ndarray of int, shape (p,)
        Index of the unknown of each corner, -1 on an open edge.
    parts : ndarray of int, shape (t,), optional
        Part of each triangle, from 0; each part is computed as if it were alone in the fluid.

    Raises
    ------
    ComputationError
        Parts of the surface coincide.
    """
    if parts is None:
        return inverse(inductance(points, triangles, unknown))
    blocks, places = [], []
    order = np.argsort(parts, kind="stable")
    for own in np.split(order, np.cumsum(np.bincount(parts))[:-1]):
        here, local = np.unique(triangles[own], return_inverse=True)
        free = unknown[here] >= 0
        number = np.where(free, np.cumsum(free) - 1, -1)
        blocks.append(inverse(inductance(points[here], local.reshape(-1, 3), number)))
        places.append(unknown[here][free])
    place = np.concatenate(places)
    turned = sparse.csr_array((np.ones(len(place)), (place, np.arange(len(place)))))
    return sparse.csr_array(turned @ sparse.block_diag(blocks, format="csr") @ turned.T)


def inverse(matrix: NDArray) -> NDArray[np.float64]:
    """Invert a positive definite matrix in place."""
    with one_thread(len(matrix)):
        try:
            factor, _ = cho_factor(matrix, lower=True, overwrite_a=True)
        except LinAlgError:
            raise ComputationError(
                "added mass: panels lie on each other, and no flow between them is defined; open "
                "the sheet"
            ) from None
        found, _ = dpotri(factor, lower=True, overwrite_c=True)
    upper = np.triu_indices(len(found), 1)
    found[upper] = found.T[upper]
    return found


def caught(points: NDArray, triangles: NDArray, unknown: NDArray) -> sparse.csr_array:
    """Integrals (u, t), m2, of the shape function of each unknown over each triangle."""
    areas, size = normals_of(points[triangles])[1], int(unknown.max(initial=-1)) + 1
    rows = unknown[triangles]
    kept = rows >= 0
    columns = np.broadcast_to(np.arange(len(triangles))[:, None], rows.shape)
    entries = np.broadcast_to(areas[:, None] / 3.0, rows.shape)
    return sparse.csr_array((entries[kept], (rows[kept], columns[kept])), (size, len(triangles)))


def normal_velocities(
    x: NDArray, triangles: NDArray, under: NDArray, shares: NDArray
) -> sparse.csr_array:
    """Matrix from velocities of nodes (3n,) to normal velocities of points (e,).

    x : (n, 3) positions of the nodes, m.
    triangles : (t, 3) nodes of triangles.
    under, shares : (e,) triangle of each point, and (e, 3) the weights of its nodes.
    """
    normals = normals_of(x[triangles])[0][under]
    columns = 3 * triangles[under][:, :, None] + np.arange(3)
    entries = shares[:, :, None] * normals[:, None, :]
    rows = np.broadcast_to(np.arange(len(under))[:, None, None], entries.shape)
    places = rows.ravel(), columns.ravel()
    out = sparse.csr_array((entries.ravel(), places), (len(under), x.size))
    out.eliminate_zeros()
    return out
