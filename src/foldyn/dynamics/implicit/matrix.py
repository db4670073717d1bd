"""The matrix of one iteration: stiffness, mass and damping with the weights of a step.

All three stand as 3x3 blocks of one pattern, so that a step's matrix is one pass over them, which
puts the entries between free dofs straight into what is factorized: a band with the nodes numbered
along the sheet or, where that would be too wide, a sparse matrix.

Modal damping, a product with rows G of all dofs, would fill the matrix. It is added to what is
factorized, A, by Woodbury's formula,

    (A + w G'G)^-1 = A^-1 - A^-1 G' (1/w + G A^-1 G')^-1 G A^-1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.banded import BandLU, Cholesky
from foldyn.algebra.solvers import factorizer, takes_band
from foldyn.algebra.superlu import SingularTangentError, SuperLU
from foldyn.dynamics.implicit.damping import ElementBlocks, ModalTerm, Weights
from foldyn.dynamics.system import Packed
from foldyn.jit.compiled import kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.tangent import Sparsity, block_keys


class Matrices(NamedTuple):
    """The three matrices as blocks, (nnz, 3, 3) each."""

    stiffness: NDArray
    mass: NDArray
    damping: NDArray  # beta K0, dashpots and creases


class StepMatrix:
    """Matrix of the free dofs, made from blocks and factorized; alpha M is part of the mass.

    Parameters
    ----------
    packed : Packed
    symmetric : bool
        Whether the blocks of the stiffness will be.

    Attributes
    ----------
    pattern : Sparsity
        Of the blocks.
    stiffness : ndarray, shape (nnz, 3, 3)
        Blocks that the caller fills.
    free : ndarray of int
        Free dofs, 3 place + axis, in the order in which they are solved for.
    solver : str
        What factorizes.
    """

    def __init__(self, packed: Packed, symmetric: bool) -> None:
        mass, system = packed.mass, packed.system
        self.blocks = packed.body.blocks()
        nodes = system.rows
        nodal = sparse.csr_array((mass.data, mass.indices, mass.indptr), (nodes, nodes))
        damping = system.damping.viscous(3 * nodes).tobsr((3, 3))
        damping.sort_indices()
        self._elements = ElementBlocks(system.damping.elements, nodes)
        others = (nodal, damping, self._elements.blocks)
        self.pattern, where = _with(self.blocks.pattern, *others)
        shape = (len(self.pattern.indices), 3, 3)
        self.stiffness, masses, viscous = (np.zeros(shape) for _ in range(3))
        masses[where[0]] = nodal.data[:, None, None] * np.eye(3)
        viscous[where[1]] = damping.data
        self._elements.settle(viscous, where[2])
        self._matrices = Matrices(self.stiffness, masses, viscous)
        held = np.zeros(3 * nodes, bool)
        held[system.supported] = True
        held[self.blocks.unused] = True
        along = self.blocks.order
        self.free = along[~held[along]]
        filled = self.blocks.filled(self.pattern) | (masses != 0.0) | (viscous != 0.0)
        filled |= self._elements.filled(shape)
        row, column, take = _entries(self.pattern, self.free, filled)
        size, width = len(self.free), int(np.abs(row - column).max(initial=0))
        self._sparse = _Sparse(row, column, take, size, symmetric)
        self._band = None
        if takes_band(size, width, symmetric):
            self._band = _Band(row, column, take, size, width, symmetric)
        self.solver = "banded" if self._band else self._sparse.solver
        self._factors: Any = None
        self._modal = ModalTerm(system.damping.modal[:, self.free])
        self.factorizations = 0

    def factorize(self, weights: Weights) -> None:
        """Make the matrix from the stiffness as it stands, and factorize it.

        Raises
        ------
        SingularTangentError
            It is singular or not finite.
        """
        self._factors = None
        self.factorizations += 1
        self._factors = self._modal(weights, self._factorized(weights))

    def _factorized(self, weights: Weights) -> Any:
        """Factors of the matrix without modal damping."""
        if self._band is not None:
            try:
                return self._band(weights, self._matrices)
            except SingularTangentError:  # not definite: the motion leaves an unstable state
                if not np.isfinite(self.stiffness).all():
                    raise
        return self._sparse(weights, self._matrices)

    def follow(self, u: NDArray) -> None:
        """Make the damping of elements that follow the motion what it is at u (n, 3)."""
        self._elements.put(u, self._matrices.damping)

    def forget(self) -> None:
        """Give up the factors."""
        self._factors = None

    @property
    def factorized(self) -> bool:
        """Whether there is something to solve with."""
        return self._factors is not None

    @property
    def band(self) -> NDArray | None:
        """Columns of the factor of a symmetric band, if that is what there is."""
        return self._factors.columns if isinstance(self._factors, Cholesky) else None

    def solve(self, residual: NDArray, out: NDArray) -> NDArray:
        """Solution of A x = residual at the free dofs of `out`; the others stay; all (n, 3)."""
        out.ravel()[self.free] = self._factors.solve(residual.ravel()[self.free])
        return out


class _Band:
    """Puts entries into a band."""

    def __init__(
        self, row: NDArray, column: NDArray, take: NDArray, size: int, width: int, symmetric: bool
    ) -> None:
        self._make: Callable[[NDArray], Any] = Cholesky if symmetric else BandLU
        kept = row <= column if symmetric else slice(None)
        row, column, self._take = row[kept], column[kept], take[kept]
        rows, diagonal = (width + 1, width) if symmetric else (3 * width + 1, 2 * width)
        self._put = (diagonal + row - column) + rows * column
        self._memory = np.zeros((size, rows)).T

    def __call__(self, weights: Weights, matrices: Matrices) -> Any:
        flat = self._memory.T.reshape(-1)
        flat[:] = 0.0
        _gather(weights, matrices, self._take, self._put, flat)
        return self._make(self._memory)


class _Sparse:
    """Puts entries into a sparse matrix by columns."""

    def __init__(
        self, row: NDArray, column: NDArray, take: NDArray, size: int, symmetric: bool
    ) -> None:
        numbered = sparse.csc_array((np.arange(1, len(row) + 1), (row, column)), (size, size))
        numbered.sort_indices()
        self._take = take[numbered.data - 1]
        self._indices, self._indptr, self._size = numbered.indices, numbered.indptr, size
        self.solver, self._make = "superlu", SuperLU
        if symmetric:
            self.solver, self._make = factorizer("auto", size)

    def __call__(self, weights: Weights, matrices: Matrices) -> Any:
        data, put = np.empty(len(self._take)), np.arange(len(self._take))
        _gather(weights, matrices, self._take, put, data)
        shape = (self._size, self._size)
        return self._make(sparse.csc_array((data, self._indices, self._indptr), shape))


def _with(pattern: Sparsity, *others: Any) -> tuple[Sparsity, list[NDArray]]:
    """Pattern with the entries of other ones too, and where these stand."""
    nodes = len(pattern.indptr) - 1
    own, *keys = (block_keys(each.indptr, each.indices) for each in (pattern, *others))
    every = np.unique(np.concatenate([own, *keys]))
    moved = np.searchsorted(every, own)
    return Sparsity(
        np.searchsorted(every // nodes, np.arange(nodes + 1)).astype(np.int32),
        (every % nodes).astype(np.int32),
        moved[pattern.bar_slots],
        moved[pattern.hinge_slots],
    ), [np.searchsorted(every, each) for each in keys]


def _entries(pattern: Sparsity, free: NDArray, filled: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Row, column and place in the blocks of the `filled` entries between free dofs."""
    dofs = 3 * (len(pattern.indptr) - 1)
    number = np.full(dofs, -1)
    number[free] = np.arange(len(free))
    node = np.repeat(np.arange(dofs // 3), np.diff(pattern.indptr)).astype(np.int64)
    axis = np.arange(3)
    row = 3 * node[:, None, None] + axis[:, None] + 0 * axis
    column = 3 * pattern.indices.astype(np.int64)[:, None, None] + axis[:, None] * 0 + axis
    row, column = number[row.ravel()], number[column.ravel()]
    kept = np.flatnonzero((row >= 0) & (column >= 0) & filled.ravel())
    return row[kept], column[kept], kept


@kernel
def _gather(weights, matrices, take, put, out):
    """out[put] = the weighted sum of the matrices at `take`, all flat."""
    stiffness, mass, damping = flat(matrices.stiffness), flat(matrices.mass), flat(matrices.damping)
    for k in range(take.size):
        e = take[k]
        value = weights.stiffness * stiffness[e] + weights.mass * mass[e]
        out[put[k]] = value + weights.damping * damping[e]
