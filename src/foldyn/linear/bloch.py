"""Matrices of Bloch waves: K(k) = sum over R of K_R exp(i k . R); also M, C and constraints.

K_R maps displacements of cell R to forces on the dofs of cell 0, and is taken from the patch around
cell 0 (`cell_patch`); displacements of cell R are given in axes that turn with the cell. K_-R is
the transpose of K_R, so that K(k) is Hermitian. A check of this also confirms that all cells are
alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError

ALIKE = 1e-8  # largest difference of K_-R from the transpose of K_R, relative to the largest entry


class Hops(NamedTuple):
    """A matrix A(k) = sum over R of A_R exp(i k . R), (r, n), given by its nonzero entries.

    Attributes
    ----------
    rows, columns : (p,)
        Positions of the entries that are nonzero for some R.
    values : sparse (p, s)
        Values of these entries for each R.
    shape : (int, int)
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: sparse.csr_array
    shape: tuple[int, int]

    def at(self, factors: NDArray) -> NDArray:
        """A (r, n) for the factors (s,) of all R: exp(i k . R), or its derivatives."""
        out = np.zeros(self.shape, factors.dtype)
        out[self.rows, self.columns] = self.values @ factors
        return out

    def sparse_at(self, factors: NDArray) -> sparse.csc_array:
        """A (r, n) as a sparse matrix; see `at`."""
        entries = (self.values @ factors, (self.rows, self.columns))
        return sparse.csc_array(sparse.coo_array(entries, self.shape))

    @property
    def empty(self) -> bool:
        """Whether the matrix is zero."""
        return not len(self.rows)


def hops(
    matrix: sparse.sparray, rows: NDArray, unit: NDArray, number: NDArray, count: int, steps: int
) -> Hops:
    """Rows of cell 0 of a matrix (m, m) of a patch, as `Hops`.

    rows : (n,) rows of the dofs of cell 0, in their order.
    unit, number : (m,) for each dof, the dof of cell 0 of which it is a copy (-1 for none), and the
        index of its R.
    """
    own = sparse.coo_array(sparse.csr_array(matrix)[rows])
    return collected(own.row, unit[own.col], number[own.col], own.data, (len(rows), count), steps)


def collected(
    row: NDArray, column: NDArray, number: NDArray, value: NDArray, shape: tuple[int, int],
    steps: int,
) -> Hops:  # fmt: skip
    """`Hops` from entries; duplicates add up."""
    kept = (column >= 0) & (value != 0.0)
    row, column, number, value = row[kept], column[kept], number[kept], value[kept]
    places, place = np.unique(row.astype(np.int64) * shape[1] + column, return_inverse=True)
    values = sparse.csr_array(sparse.coo_array((value, (place, number)), (len(places), steps)))
    return Hops(places // shape[1], places % shape[1], values, shape)


@dataclass(frozen=True, eq=False)
class Bloch:
    """Matrices of the n dofs of a cell.

    Attributes
    ----------
    steps : (s, d)
        R of the cells that act on cell 0, and their opposites.
    stiffness, mass, damping : Hops
        Matrices (n, n).
    ties : Hops
        Constraints (k, n) of links and rigid panels.
    hidden, held : (n,) bool
        Dofs without mass, and dofs held by supports.
    """

    steps: NDArray[np.int64]
    stiffness: Hops
    mass: Hops
    damping: Hops
    ties: Hops
    hidden: NDArray[np.bool_]
    held: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number n of the dofs."""
        return self.stiffness.shape[0]

    def factors(self, phase: NDArray) -> NDArray[np.complex128]:
        """exp(i k . R), (s,)."""
        return np.exp(1j * (self.steps @ phase))

    def slopes(self, phase: NDArray, period: int) -> NDArray[np.complex128]:
        """Derivatives (s,) of `factors` with respect to one phase."""
        return 1j * self.steps[:, period] * self.factors(phase)

    @cached_property
    def lumped(self) -> NDArray[np.float64] | None:
        """Masses (n,), kg, if the mass matrix is diagonal and the same for all k; else None."""
        mass, here = self.mass, np.flatnonzero((self.steps == 0).all(axis=1))
        if (mass.rows != mass.columns).any() or mass.values.nnz != len(mass.rows):
            return None
        values = mass.values[:, here].toarray()[:, 0]
        if (values == 0.0).any():
            return None
        return np.bincount(mass.rows, values, self.size).astype(float)

    @cached_property
    def nodal(self) -> Hops | None:
        """Nodal mass (n/3, n/3), kg, if all three axes have the same mass matrix; else None."""
        mass, nodes = self.mass, int((~self.hidden).sum()) // 3
        axis = mass.rows % 3
        if (axis != mass.columns % 3).any() or mass.rows.max(initial=0) >= 3 * nodes:
            return None
        parts = [np.flatnonzero(axis == k) for k in range(3)]
        rows, columns, values = zip(
            *((mass.rows[p] // 3, mass.columns[p] // 3, mass.values[p]) for p in parts), strict=True
        )
        alike = all(
            np.array_equal(rows[0], rows[k])
            and np.array_equal(columns[0], columns[k])
            and abs(values[0] - values[k]).max() <= ALIKE * abs(values[0]).max()
            for k in (1, 2)
        )
        return Hops(rows[0], columns[0], values[0], (nodes, nodes)) if alike else None


def hermitian(own: Hops, steps: NDArray, what: str, first: NDArray) -> Hops:
    """Hermitian part of a matrix; raises an error if the rest is more than round-off.

    what : name of the matrix.
    first : (m,) the node to name for each node of cell 0.
    """
    where = {tuple(row): k for k, row in enumerate(steps.tolist())}
    opposite = np.array([where[tuple(-x for x in row)] for row in steps.tolist()])  # index of -R
    entries = own.values.tocoo()
    row, column = own.rows[entries.row], own.columns[entries.row]

    def half(sign: float) -> Hops:
        """Half the sum of the matrix and its adjoint, or half their difference."""
        return collected(
            np.concatenate([row, column]), np.concatenate([column, row]),
            np.concatenate([entries.col, opposite[entries.col]]),
            0.5 * np.concatenate([entries.data, sign * entries.data]), own.shape, len(steps),
        )  # fmt: skip

    both, skew = half(1.0), half(-1.0)
    largest = np.abs(own.values.data).max(initial=0.0)
    off = np.abs(skew.values.data)
    if off.max(initial=0.0) > ALIKE * largest:
        place = int(np.searchsorted(skew.values.indptr, off.argmax(), side="right")) - 1
        where = " and ".join(
            f"node {first[dof // 3]}" if dof < 3 * len(first) else "a rotation of a panel's edge"
            for dof in (skew.rows[place], skew.columns[place])
        )
        raise InputError(
            f": the {what} differs from one cell to the next by {off.max() / largest:.2g} of its "
            f"largest entry, at {where}; a support, a panel or the state does not repeat",
            "case",
        )
    return both


def steps_of(offset: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Distinct R (s, d) among `offset` (m, d) and its opposites; the row (m,) of each given R."""
    steps, number = np.unique(np.concatenate([offset, -offset]), axis=0, return_inverse=True)
    return steps, np.ravel(number)[: len(offset)]


def null_space(rows: NDArray) -> NDArray[np.complex128]:
    """Orthonormal motions (n, m) that satisfy constraints (k, n)."""
    _, sizes, motions = np.linalg.svd(rows)
    rank = int((sizes > 1e-10 * sizes.max(initial=0.0)).sum())
    return motions[rank:].conj().T
