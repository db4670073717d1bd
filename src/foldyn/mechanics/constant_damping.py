"""Damping with a constant matrix C: sparse, or the product G' G of a few full rows.

The forces are C v and dissipate the power v' C v.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.context import Context, numbers_at
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.pullback import Arrays, Pulled, pullback
from foldyn.mechanics.term import FORCES, CompiledTerm, Term, forces
from foldyn.mechanics.threads import Team, wait


class _Matrix(NamedTuple):
    indptr: NDArray
    indices: NDArray
    data: NDArray
    own: NDArray  # (2,) first and last + 1 of the thread's rows
    team: Team


class _Rows(NamedTuple):
    rows: NDArray  # (r, 3 rows)


@forces
def _of_matrix(own, u, v, t, force, powers):
    size, power = own.indptr.size - 1, 0.0
    speed, out = numbers_at(v, size), numbers_at(force, size)
    for i in range(3 * own.own[0], 3 * own.own[1]):
        resisted = 0.0
        for k in range(own.indptr[i], own.indptr[i + 1]):
            resisted += own.data[k] * speed[own.indices[k]]
        out[i] += resisted
        power += resisted * speed[i]
    numbers_at(powers, 2)[1] += power
    wait(own.team)  # until others have read this member's velocities


@forces
def _of_rows(own, u, v, t, force, powers):
    size, power = own.rows.shape[1], 0.0
    speed, out = numbers_at(v, size), numbers_at(force, size)
    for k in range(own.rows.shape[0]):
        rate, row = 0.0, own.rows[k]
        for i in range(size):
            rate += row[i] * speed[i]
        for i in range(size):
            out[i] += rate * row[i]
        power += rate * rate
    numbers_at(powers, 2)[1] += power


class _MatrixBackward(NamedTuple):
    indptr: NDArray
    indices: NDArray
    data: NDArray
    out: NDArray  # gradient with respect to the data


class _RowsBackward(NamedTuple):
    rows: NDArray
    out: NDArray  # (r, 3 rows) gradient


@pullback
def _matrix_pullback(own, u, v, t, weight, product, rate):
    size = own.indptr.size - 1
    speed, weights, out = numbers_at(v, size), numbers_at(weight, size), numbers_at(rate, size)
    for i in range(size):
        for k in range(own.indptr[i], own.indptr[i + 1]):
            j = own.indices[k]
            own.out[k] += weights[i] * speed[j]
            out[j] += own.data[k] * weights[i]


@pullback
def _rows_pullback(own, u, v, t, weight, product, rate):
    size = own.rows.shape[1]
    speed, weights, out = numbers_at(v, size), numbers_at(weight, size), numbers_at(rate, size)
    for k in range(own.rows.shape[0]):
        row, ahead, back = own.rows[k], 0.0, 0.0
        for i in range(size):
            ahead += row[i] * speed[i]
            back += row[i] * weights[i]
        for i in range(size):
            out[i] += back * row[i]
            own.out[k, i] += back * speed[i] + ahead * weights[i]


class DampingMatrix(Term):
    """Damping by a sparse matrix C (m, m), N s/m, of which some dofs are `hidden`; see `Term`."""

    damps = shared = True

    def __init__(self, matrix: sparse.csr_array, hidden: NDArray | None = None) -> None:
        self.matrix = matrix
        self._hidden = np.zeros(0, np.int64) if hidden is None else hidden

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        start, column = self.matrix.indptr.astype(np.int64), self.matrix.indices.astype(np.int64)
        own = _Matrix(start, column, self.matrix.data, np.asarray(part.own), part.team)
        return CompiledTerm(Context(own), {FORCES: _of_matrix})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        layout = {"indptr": self.matrix.indptr, "indices": self.matrix.indices}
        return Arrays({"data": self.matrix.data}, layout)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        start, column = self.matrix.indptr.astype(np.int64), self.matrix.indices.astype(np.int64)
        out = np.zeros_like(self.matrix.data)
        own = _MatrixBackward(start, column, self.matrix.data, out)
        return Pulled(Context(own), _matrix_pullback, {"data": out})

    @cached_property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's damping entries; see `Term`."""
        return self.matrix.tocoo().coords

    @cached_property
    def _share(self) -> NDArray:
        """Power (k,) of `hidden` in each entry: half the number of its dofs that are hidden."""
        row, column = (np.isin(place, self._hidden) for place in self.damping_places)
        return 0.5 * (row.astype(float) + column)

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Damping entries (k,), N s/m; symmetric, as those of `ViscousTerm`. See `Term`."""
        return self.matrix.data * hidden**self._share

    def placed(self, order: NDArray, before: Assembly) -> DampingMatrix:
        """The term with nodes in memory order; see `Term`."""
        numbering = before.numbering(order)
        return DampingMatrix(numbering.matrix(self.matrix), numbering.dofs(self._hidden))


class DampingRows(Term):
    """Damping by full rows G (r, m), sqrt(N s/m), added to factors in implicit steps."""

    damps = True
    without = ("damping",)

    def __init__(self, rows: NDArray) -> None:
        self.rows = rows

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return CompiledTerm(Context(_Rows(self.rows)), {FORCES: _of_rows})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return Arrays({"rows": self.rows}, {})

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        out = np.zeros_like(self.rows)
        return Pulled(Context(_RowsBackward(self.rows, out)), _rows_pullback, {"rows": out})

    def damping(self, q: NDArray) -> sparse.csr_array:
        """Damping matrix, which is full: only for few dofs; see `Term`."""
        return sparse.csr_array(self.rows.T @ self.rows)

    def placed(self, order: NDArray, before: Assembly) -> DampingRows:
        """The term with nodes in memory order; see `Term`."""
        rows = np.zeros((len(self.rows), 3 * before.rows))
        rows[:, before.numbering(order).dofs(np.arange(self.rows.shape[1]))] = self.rows
        return DampingRows(rows)
