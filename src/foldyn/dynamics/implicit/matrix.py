"""The matrix of a Newton iteration: weighted sum of stiffness, mass and damping of a step.

These three matrices consist of 3x3 blocks with the same pattern. One pass over them writes the
entries of the free dofs directly into the matrix to factorize. This is a band matrix with the nodes
numbered along the sheet or, if the band would be too wide, a sparse matrix. Modal damping, a
product with rows G over all dofs, would fill the matrix; Woodbury's formula adds it to the
factorization instead.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.banded import BandLU, Cholesky
from foldyn.algebra.solvers import factorizer, takes_band
from foldyn.algebra.superlu import SingularTangentError, SuperLU
from foldyn.algebra.woodbury import Updated
from foldyn.dynamics.system import PackedCase
from foldyn.dynamics.ties import Ties, follow_masters, hand_over, masters_of, onto
from foldyn.jit.compiled import kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import places_of
from foldyn.mechanics.constant_damping import DampingRows
from foldyn.mechanics.following import following_places, put_following
from foldyn.mechanics.tangent import Sparsity, block_keys, entry_slots, joined

FULL = 200  # with added terms, a full matrix is faster than a sparse one up to this many dofs


class Weights(NamedTuple):
    """Weights of stiffness, mass and damping in an iteration matrix."""

    stiffness: float
    mass: float  # 1/s2
    damping: float  # 1/s, weight of the damping except alpha M


class Matrices(NamedTuple):
    """Stiffness, mass and damping as blocks, (nnz, 3, 3) each."""

    stiffness: NDArray
    mass: NDArray
    damping: NDArray  # damping of terms


class StepMatrix:
    """Matrix of the free dofs, assembled from blocks and factorized; the mass includes alpha M.

    Parameters
    ----------
    packed : PackedCase
    symmetric : bool
        Whether the stiffness blocks are symmetric.

    Attributes
    ----------
    pattern : Sparsity
        Pattern of the blocks.
    stiffness : ndarray, shape (nnz, 3, 3)
        Blocks that the caller fills.
    free : ndarray of int
        Free dofs, 3 place + axis, in the order in which they are solved for.
    added : csr_array, shape (3 rows, 3 rows), or None
        Additional stiffness outside the pattern, N/m, such as contact.
    solver : str
        Name of the factorization.
    """

    def __init__(self, packed: PackedCase, symmetric: bool) -> None:
        mass, system = packed.mass, packed.system
        self.blocks = packed.body.blocks()
        nodes, self._following, self._symmetric = system.rows, system.following, symmetric
        self._damping = [term for term in packed.body.others if term.damps]
        places = [following_places(system.following)]
        places += [term.damping_places for term in self._damping]
        keys = [block_keys(mass.indptr, mass.indices)]
        keys += [row // 3 * nodes + column // 3 for row, column in places]
        self.pattern = joined(self.blocks.pattern, np.concatenate(keys))
        own = block_keys(self.pattern.indptr, self.pattern.indices)
        shape = (len(self.pattern.indices), 3, 3)
        self.stiffness, masses, damping = (np.zeros(shape) for _ in range(3))
        masses[np.searchsorted(own, keys[0])] = mass.data[:, None, None] * np.eye(3)
        self._follow, *slots = (entry_slots(self.pattern, *each) for each in places)
        self._damped = np.concatenate([np.zeros(0, np.int64), *slots])
        self._matrices = Matrices(self.stiffness, masses, damping)
        held = np.concatenate([system.supported, system.ties.slave, self.blocks.unused])
        self.free = self.blocks.order[~np.isin(self.blocks.order, held)]
        self._ties = system.ties
        self.added: sparse.csr_array | None = None
        self._onto = onto(self.free, self._ties, 3 * nodes) if system.touches else None
        self._across = sparse.csr_array(self._onto.T) if self._onto is not None else None
        filled = self.blocks.filled(self.pattern) | (masses != 0.0)
        filled.reshape(-1)[self._follow] = filled.reshape(-1)[self._damped] = True
        entries = _entries(self.pattern, self.free, filled, self._ties)
        size = len(self.free)
        width = int(np.abs(entries.row - entries.column).max(initial=0))
        self._sparse = _Sparse(entries, size, symmetric)
        self._band = self._full = None
        if self._onto is not None and size <= FULL:
            self._full = _Band(entries, size, size - 1, False)
        if takes_band(size, width, symmetric):
            self._band = _Band(entries, size, width, symmetric)
        self.solver = "banded" if self._band else self._sparse.solver
        self._factors: Any = None
        found = packed.body.find(DampingRows)
        modal = np.zeros((0, 3 * nodes)) if found is None else found.rows.copy()
        for row in modal:
            hand_over(self._ties, row)
        self._modal = modal[:, self.free]
        self.factorizations = 0

    def add_following(self, u: NDArray, factor: NDArray, share: float) -> None:
        """Add `share` times the stiffness of displacement-dependent loads at u (n, 3).

        factor : (h, 3) factors of the histories. A symmetric matrix only gets the symmetric part.
        """
        if not self._following.acts:
            return
        values = np.empty(len(self._follow))
        put_following(self._following, u.reshape(-1), factor, self._symmetric, values)
        np.add.at(self.stiffness.reshape(-1), self._follow, share * values)

    def factorize(self, weights: Weights) -> None:
        """Assemble the matrix from the current stiffness, and factorize it.

        Raises
        ------
        SingularTangentError
            The matrix is singular or not finite.
        """
        self._factors = None
        self.factorizations += 1
        self._factors = self._factorized(weights)
        if len(self._modal) and weights.damping != 0.0:
            self._factors = Updated(self._factors, self._modal, weights.damping)

    def _factorized(self, weights: Weights) -> Any:
        """Factors of the matrix without the modal damping."""
        if self.added is not None and self._full is not None:
            added = (self._across @ (self._across @ self.added.toarray()).T).T
            return self._full(weights, self._matrices, weights.stiffness * added)
        if self.added is not None and self._onto is not None:
            added = self._across @ self.added @ self._onto
            return self._sparse(weights, self._matrices, weights.stiffness * added)
        if self._band is not None:
            try:
                return self._band(weights, self._matrices)
            except SingularTangentError:  # indefinite: the motion leaves an unstable state
                if not np.isfinite(self.stiffness).all():
                    raise
        return self._sparse(weights, self._matrices)

    def follow(self, u: NDArray, hidden: float) -> None:
        """Recompute the damping at u (n, 3); see `Term.damping_entries` for `hidden`."""
        if len(self._damped):
            entries = [term.damping_entries(u, hidden) for term in self._damping]
            out = self._matrices.damping.reshape(-1)
            out[:] = np.bincount(self._damped, np.concatenate(entries), out.size)

    @property
    def changing(self) -> list[NDArray]:
        """Arrays of blocks that change along a motion."""
        return [self._matrices.stiffness, self._matrices.damping]

    def forget(self) -> None:
        """Discard the factors."""
        self._factors = None

    @property
    def factorized(self) -> bool:
        """Whether factors are available."""
        return self._factors is not None

    @property
    def band(self) -> NDArray | None:
        """Columns of a banded Cholesky factor; None for other factors."""
        return self._factors.columns if isinstance(self._factors, Cholesky) else None

    def solve(self, residual: NDArray, out: NDArray) -> NDArray:
        """Solve A x = residual at the free dofs of `out`; other dofs keep their values; all (n, 3).

        Slaves of constraints follow their masters.
        """
        if not len(self._ties.slave):
            out.ravel()[self.free] = self._factors.solve(residual.ravel()[self.free])
            return out
        force, moved = residual.ravel().copy(), out.reshape(-1)
        hand_over(self._ties, force)
        moved[self.free] = self._factors.solve(force[self.free])
        follow_masters(self._ties, moved)
        return out


class _Entries(NamedTuple):
    """Entries of the matrix on the free dofs: row, column, and their sources in the blocks.

    With constraints, a place may have several entries; each entry is scaled by its value and added
    to the place.
    """

    row: NDArray
    column: NDArray
    take: NDArray
    value: NDArray  # factor of each entry; empty without constraints


class _Band:
    """Writes entries into a band matrix."""

    def __init__(self, entries: _Entries, size: int, width: int, symmetric: bool) -> None:
        self._make: Callable[[NDArray], Any] = Cholesky if symmetric else BandLU
        row, column, self._take, self._value = entries
        if symmetric:
            kept = row <= column
            row, column, self._take = row[kept], column[kept], self._take[kept]
            self._value = self._value[kept] if len(self._value) else self._value
        rows, diagonal = (width + 1, width) if symmetric else (3 * width + 1, 2 * width)
        self._put = (diagonal + row - column) + rows * column
        self._memory = np.zeros((size, rows)).T
        self._diagonal = diagonal

    @cached_property
    def _everywhere(self) -> NDArray:
        """Flat positions (n, n), in the memory of the band, of all entries, by columns."""
        size, rows = self._memory.T.shape
        number = np.arange(size)
        return (rows - 1) * number[:, None] + number + self._diagonal

    def __call__(self, weights: Weights, matrices: Matrices, added: NDArray | None = None) -> Any:
        flat = self._memory.T.reshape(-1)
        flat[:] = 0.0
        _gather(weights, matrices, self._take, self._value, self._put, flat)
        if added is not None:
            flat[self._everywhere] += added.T
        return self._make(self._memory)


class _Sparse:
    """Writes entries into a sparse matrix in CSC format."""

    def __init__(self, entries: _Entries, size: int, symmetric: bool) -> None:
        row, column, self._take, self._value = entries
        place, self._put = np.unique(row + size * column, return_inverse=True)
        filled = sparse.csc_array((place, (place % size, place // size)), (size, size))
        self._indices, self._indptr, self._size = filled.indices, filled.indptr, size
        self.solver, self._make = "superlu", SuperLU
        if symmetric:
            self.solver, self._make = factorizer("auto", size)

    def __call__(self, weights: Weights, matrices: Matrices, added: Any = None) -> Any:
        data = np.zeros(len(self._indices))
        _gather(weights, matrices, self._take, self._value, self._put, data)
        shape = (self._size, self._size)
        matrix = sparse.csc_array((data, self._indices, self._indptr), shape)
        return self._make(matrix if added is None else sparse.csc_array(matrix + added))


def _entries(pattern: Sparsity, free: NDArray, filled: NDArray, ties: Ties) -> _Entries:
    """Entries between free dofs from the `filled` blocks, also through slaves of constraints."""
    dofs = 3 * (len(pattern.indptr) - 1)
    node = np.repeat(np.arange(dofs // 3), np.diff(pattern.indptr))
    row, column = places_of(np.column_stack([node, pattern.indices]))
    if not len(ties.slave):
        number = np.full(dofs, -1)
        number[free] = np.arange(len(free))
        row, column = number[row], number[column]
        kept = np.flatnonzero((row >= 0) & (column >= 0) & filled.ravel())
        return _Entries(row[kept], column[kept], kept, np.zeros(0))
    kept = np.flatnonzero(filled.ravel())
    start, master, value = masters_of(free, ties, dofs)
    count = np.diff(start)
    one, other = (count[dof[kept]] for dof in (row, column))
    first = np.repeat(np.arange(len(kept)), one * other)  # block entry of each product
    within = np.arange(len(first)) - np.repeat(np.cumsum(one * other) - one * other, one * other)
    a = start[row[kept]][first] + within // other[first]
    b = start[column[kept]][first] + within % other[first]
    return _Entries(master[a], master[b], kept[first], value[a] * value[b])


@kernel
def _gather(weights, matrices, take, value, put, out):
    """Put into out[put] the weighted sum of the entries `take`; all are flat.

    With factors `value`, several entries may share a place, which starts at zero.
    """
    stiffness, mass, damping = flat(matrices.stiffness), flat(matrices.mass), flat(matrices.damping)
    for k in range(take.size):
        e = take[k]
        entry = weights.stiffness * stiffness[e] + weights.mass * mass[e]
        entry += weights.damping * damping[e]
        if value.size == 0:
            out[put[k]] = entry
        else:
            out[put[k]] += value[k] * entry
