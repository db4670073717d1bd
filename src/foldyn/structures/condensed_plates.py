"""Bars, folds and plates with their edge angles in balance: for explicit methods."""

from __future__ import annotations

from copy import copy
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.jit.context import Context
from foldyn.materials import HingeLaw
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.inelastic import MemoryHinges
from foldyn.mechanics.inelastic_balance import evaluation
from foldyn.mechanics.plates import BarsPlates
from foldyn.mechanics.plates_condensed import (
    CondensedScratch,
    condensed_kernels,
    condensed_plates,
    condensed_pulled,
    condensed_scratch,
)
from foldyn.mechanics.pullback import Arrays, Pulled
from foldyn.mechanics.sheet_term import NO_DOF, FoldHinges
from foldyn.mechanics.step_tangent import SparseBlocks
from foldyn.mechanics.term import CompiledTerm, Unstrained
from foldyn.structures.bars_plates import BarsPlatesTerm


class CondensedPlatesTerm(BarsPlatesTerm):
    """Bars, folds and plates by their displacements alone; see `mechanics.sheet_term.SheetTerm`."""

    undifferentiated = "creases that yield, creep, relax or, beside panels that give way, damp"
    _held: Context  # keeps the branches of its folds alive

    def __init__(
        self, model: BarsPlates, laws: tuple[HingeLaw, HingeLaw], like: BarsPlatesTerm | None = None
    ) -> None:
        super().__init__(model, laws, like)
        self._full = BarsPlatesTerm(model, laws, like)  # the same model with edge angles
        self.condensed = condensed_plates(model, self.linear_folds)
        self.size, self.rows, self.hidden = self._nodal, model.nodes, np.zeros(0, np.int64)
        self.offsets = model.rotations

    def _with(self, model: BarsPlates) -> Self:
        """Copy with another model and the same forces on edge angles; see `BarsPlatesTerm`."""
        other = super()._with(model)
        other.condensed.offset[:] = self.condensed.offset
        return other

    def _whole(self, q: NDArray) -> NDArray:
        """All dofs at displacements q, with edge angles in balance."""
        push = np.append(np.zeros(self.size), self._push)
        return Assembly(self._full).dofs(np.ravel(q)[: self.size], push)

    def compiled(self, part: Any, kept: CondensedScratch, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return condensed_kernels(self.condensed, kept)

    def arrays(self) -> Arrays | None:
        """Arrays that its forces depend on; see `Term`."""
        if self.condensed.memory.any():
            return None
        found = super().arrays()
        return found._replace(numbers={**found.numbers, "push": self._push})

    def pulled(self) -> Pulled | None:
        """Pullback of its forces; see `Term`."""
        return None if self.condensed.memory.any() else condensed_pulled(self.condensed)

    def scratches(self, threads: int) -> list[CondensedScratch]:
        """Scratch for each thread; see `SheetTerm`."""
        return [condensed_scratch(self.condensed)]

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent (m, m), N/m; see `SheetTerm`."""
        return balanced(self._full.tangent(self._whole(q), floor), self._full.hidden)

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """Matrix for a Newton step at q; see `SheetTerm`."""
        return self.tangent(q)

    def blocks(self) -> SparseBlocks:
        """Tangent blocks, all of them full; see `SheetTerm`."""
        full = sparse.csr_array(np.ones((self.size, self.size)))
        return SparseBlocks(full, self.rows, np.repeat(self.model.bars.rest, 3, axis=0))

    def fold_hinges(self) -> FoldHinges:
        """Hinges of the folds without the edge angles, which are no dofs; see `SheetTerm`."""
        found = super().fold_hinges()
        plates, turns = self.condensed, self.model.fold_rotations
        side = plates.band[plates.rank, -1] / self.per_hidden**2
        there, each = turns >= 0, np.full(turns.shape, np.inf)
        each[there] = side[turns[there]]
        give = (1.0 / each).sum(axis=1)
        beside = np.divide(1.0, give, out=np.full(len(give), np.inf), where=give > 0.0)
        return found._replace(hidden=np.full_like(found.hidden, NO_DOF), beside=beside)

    def remembering(self, own: MemoryHinges) -> Self:
        """A copy of the sheet whose balance evaluates the branches of its folds."""
        other, folds = copy(self), len(self.model.fold_rest)
        other._held, memory = evaluation(own, self.condensed.offset, folds)
        other.condensed = self.condensed._replace(memory=memory)
        return other

    # ------------------------------------------------------------------ forces on edge angles
    @property
    def _push(self) -> NDArray:
        """Forces (r,), N, on the edge angles."""
        return self.condensed.offset[len(self.model.fold_rest) :, 0]

    @property
    def rest_angles(self) -> NDArray:
        """Rest angles of folds and bends, then forces on edge angles; see `SheetTerm`."""
        return np.append(super().rest_angles, self._push)

    def offsets_under(self, moments: NDArray) -> NDArray:
        """Forces on the adjacent edge angles due to moments of creases; see `SheetTerm`."""
        beside = self.model.fold_rotations
        there, both = beside >= 0, np.repeat(moments[:, None], 2, axis=1)
        return -self.per_hidden * np.bincount(beside[there], both[there], minlength=self.offsets)

    def folded(self, rest: NDArray) -> Self:
        """The sheet with other rest angles (nr,), rad; see `SheetTerm`."""
        angles, push = np.split(rest, [len(rest) - self.offsets])
        other = super().folded(angles)
        other._push[:] = push
        return other

    def actuated(self, numbers: NDArray) -> tuple[Self, NDArray, NDArray]:
        """A copy with rest angles that change in place; see `SheetTerm`."""
        folds, bends = len(self.model.fold_rest), len(self.model.bend_rest)
        sheet, _, which = super().actuated(numbers)
        return sheet, np.where(numbers < folds, numbers, numbers - bends), which

    def series(self) -> tuple[NDArray, NDArray]:
        """Crease shares and offsets of actuated hinges; see `SheetTerm`."""
        return np.ones(len(self.condensed.offset)), self.condensed.offset

    # ------------------------------------------------------------------ other bodies
    def unstrained(self, q: NDArray) -> Unstrained | None:
        """See `SheetTerm`."""
        found, hidden = self._full.unstrained(self._whole(q)), self._full.hidden
        return found and Unstrained(
            balanced(found.tangent, hidden), balanced(found.hinges, hidden), found.stretch
        )


def balanced(matrix: sparse.csr_array, hidden: NDArray) -> sparse.csr_array:
    """The tangent (3n, 3n) of displacements with the `hidden` last dofs in balance."""
    if not len(hidden):
        return matrix
    first = hidden[0]
    across = sparse.csc_array(matrix[first:, :first])
    given = sparse.csc_array(splu(sparse.csc_array(matrix[first:, first:])).solve(across.toarray()))
    return sparse.csr_array(matrix[:first, :first] - across.T @ given)
