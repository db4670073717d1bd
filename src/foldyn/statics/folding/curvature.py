"""The matrix of a step of folding, and its solution.

A bar or hinge with the strain or turn q has the gradient g and adds slope g g' to the matrix: the
Gauss-Newton part. The second part is its force or moment times the second derivative of q. Entries
are stored as they are factorized: in a band, with the nodes numbered along the sheet, or in a
sparse matrix if that band would be too wide.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.algebra.banded import Cholesky
from foldyn.algebra.solvers import factorizer, takes_band
from foldyn.algebra.superlu import SingularTangentError, Solution
from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.model import ranks


class Places(NamedTuple):
    """Places of p x p node blocks of k elements: entry (a, b) at start + a + stride b."""

    start: NDArray  # -1 for blocks whose transpose is stored
    stride: NDArray


class Parts(NamedTuple):
    """Contributions of bars (p = 2) or hinges (p = 4) to a matrix."""

    gradients: NDArray  # (k, 3 p) of strains or turns
    slopes: NDArray  # (k,)
    pulls: NDArray  # (k,)


class Curvature:
    """Matrices of bars (nb, 2) and hinges (nh, 4) on a given number of nodes."""

    def __init__(self, bars: NDArray, hinges: NDArray, nodes: int) -> None:
        self._bars, self._hinges = bars.astype(np.int64), hinges.astype(np.int64)
        own = np.repeat(np.arange(nodes), 2).reshape(-1, 2)
        pairs = np.concatenate([pairs_within(self._bars), pairs_within(self._hinges), own])
        graph = sparse.csr_array(_graph(pairs, nodes))
        order = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
        row, column = ranks(order)[pairs].T
        self._dofs = (3 * order[:, None] + np.arange(3)).ravel()
        size, width = 3 * nodes, 3 * int(np.abs(row - column).max()) + 2
        self._band = takes_band(size, width, True)
        if self._band:
            self._shape = size, width + 1
            stride = np.full(len(row), width)
            start = np.where(row > column, -1, width + 3 * row + 3 * column * width)
        else:
            self._factorizer = factorizer("auto", size)[1]
            blocks = _graph(np.column_stack([row, column]), nodes)
            full = sparse.bsr_array(
                (np.ones((len(blocks.indices), 3, 3)), blocks.indices, blocks.indptr)
            ).tocsr()
            self._shape, self._pattern = full.shape, (full.indices, full.indptr)
            first = blocks.indptr.astype(np.int64)
            here = np.repeat(np.arange(nodes), np.diff(first))
            place = np.searchsorted(here * nodes + blocks.indices, column * nodes + row)
            stride, start = 3 * np.diff(first)[column], 3 * (place + 2 * first[column])
        ends = np.cumsum([4 * len(bars), 16 * len(hinges)])
        (*self._places, own) = (
            Places(one.reshape(-1, p, p), other.reshape(-1, p, p))
            for p, one, other in zip(
                (2, 4, 1), np.split(start, ends), np.split(stride, ends), strict=True
            )
        )
        self._diagonal = (own.start[:, 0] + np.arange(3) * (own.stride[:, 0] + 1)).ravel()

    def matrix(self, x: NDArray, bars: Parts, hinges: Parts) -> NDArray:
        """Entries of the matrix at positions x (n, 3), in the storage that is factorized."""
        out = np.zeros(np.prod(self._shape) if self._band else len(self._pattern[0]))
        _put(x, self._bars, bars, self._places[0], self._band, out)
        _put(x, self._hinges, hinges, self._places[1], self._band, out)
        return out

    def factorized(self, entries: NDArray, damping: float) -> Callable[[NDArray], NDArray] | None:
        """Solver from forces (m,) to steps (n, 3); None if the matrix is not positive definite.

        damping : added to the diagonal, as a fraction of its mean.
        """
        damped = entries.copy()
        damped[self._diagonal] += damping * entries[self._diagonal].mean()
        try:
            if self._band:
                factors: Solution = Cholesky(damped.reshape(self._shape).T)
            else:
                matrix = sparse.csc_array((damped, *self._pattern), self._shape)
                factors = indefinite = self._factorizer(matrix)
                if indefinite.negative():
                    return None
        except SingularTangentError:
            return None

        def solution(force: NDArray) -> NDArray:
            out = np.empty(len(force))
            out[self._dofs] = factors.solve(force[self._dofs])
            return out.reshape(-1, 3)

        return solution


def _graph(pairs: NDArray, nodes: int) -> sparse.csc_array:
    """Pairs (k, 2) of nodes as a sparsity pattern by columns, sorted."""
    graph = sparse.coo_array((np.ones(len(pairs)), tuple(pairs.T)), (nodes, nodes)).tocsc()
    graph.sort_indices()
    return graph


@inner
def _add_stretch(points, gradient, pull, block):
    """Add pull times the second derivative of the strain of a bar to `block` (2, 3, 2, 3)."""
    x, y, z = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1], points[1, 2] - points[0, 2]
    length, per_rest = math.sqrt(x * x + y * y + z * z), 0.0
    for c in range(3):
        per_rest += gradient[1, c] ** 2
    per_rest = math.sqrt(per_rest)
    for a in range(3):
        for b in range(3):
            value = -gradient[1, a] * gradient[1, b] / (per_rest * length)
            value = pull * (value + (per_rest / length if a == b else 0.0))
            block[0, a, 0, b] += value
            block[1, a, 1, b] += value
            block[0, a, 1, b] -= value
            block[1, a, 0, b] -= value


@kernel
def _put(x, nodes, parts, places, upper, out):
    """Add the matrices of elements between `nodes` (k, p), or their `upper` triangles.

    x : (n, 3) positions.
    """
    count = nodes.shape[1]
    points, opening = np.empty((count, 3)), np.empty((count, 3))
    block = np.empty((count, 3, count, 3))
    for e in range(nodes.shape[0]):
        slope, pull = parts.slopes[e], parts.pulls[e]
        gradient = parts.gradients[e].reshape(count, 3)
        block[:] = 0.0
        for v in range(count if pull != 0.0 else 0):
            for c in range(3):
                points[v, c], opening[v, c] = x[nodes[e, v], c], -gradient[v, c]
        if pull != 0.0 and count == 4:
            add_hessian(points, opening, -pull, block)  # a turn is pi less the dihedral
        elif pull != 0.0:
            _add_stretch(points, gradient, pull, block)
        for v in range(count):
            for w in range(count):
                start, stride = places.start[e, v, w], places.stride[e, v, w]
                for a in range(3 if start >= 0 else 0):
                    for b in range(a if upper and v == w else 0, 3):
                        value = block[v, a, w, b] + slope * gradient[v, a] * gradient[w, b]
                        out[start + a + stride * b] += value
