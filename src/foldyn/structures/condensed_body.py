"""Bars, folds and plates without their edge angles, which stay in balance: for explicit methods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import InputError
from foldyn.materials import HingeLaw
from foldyn.mechanics.body import Body, FoldHinges, Unstrained
from foldyn.mechanics.plates_condensed import (
    CondensedWork,
    condensed_plates,
    condensed_term,
    condensed_work,
)
from foldyn.mechanics.step_tangent import SparseBlocks
from foldyn.mechanics.term import Folds, Term
from foldyn.structures.plates_body import BarsPlatesBody


class CondensedBody(Body):
    """A model of bars, folds and plates by its displacements alone; see `mechanics.body.Body`.

    Parameters
    ----------
    inner : BarsPlatesBody
        The same with edge angles.
    """

    def __init__(self, inner: BarsPlatesBody) -> None:
        self.inner, self.energy_groups = inner, inner.energy_groups
        self.model = condensed_plates(inner.model, inner.linear_folds)
        self.size, self.rows = 3 * inner.model.nodes, inner.model.nodes

    def _whole(self, q: NDArray) -> NDArray:
        """All dofs at displacements q, with edge angles in balance."""
        return self.inner.dofs(np.asarray(q, float).reshape(-1)[: self.size])

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self.inner.energies(self._whole(q))

    def internal(self, q: NDArray, work: CondensedWork | None = None) -> NDArray:
        """See `Body`."""
        return self.inner.internal(self._whole(q))[: self.size]

    def hinge_forces(self, q: NDArray, work: CondensedWork | None = None) -> NDArray:
        """See `Body`."""
        return self.inner.hinge_forces(self._whole(q))[: self.size]

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        return balanced(self.inner.tangent(self._whole(q), floor), self.inner.hidden)

    def blocks(self) -> SparseBlocks:
        """See `Body`: all are full."""
        full = sparse.csr_array(np.ones((self.size, self.size)))
        return SparseBlocks(full, self.rows, np.repeat(self.inner.model.bars.rest, 3, axis=0))

    def workspaces(self, threads: int) -> list[CondensedWork]:
        """See `Body`."""
        return [condensed_work(self.model)]

    def terms(self, work: CondensedWork) -> list[Term]:
        """See `Body`."""
        return [condensed_term(self.model, work)]

    @property
    def hinges(self) -> NDArray:
        """See `Body`."""
        return self.inner.hinges

    @property
    def folds(self) -> Folds:
        """See `Body`."""
        return self.inner.folds

    def angles(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self.inner.angles(q)

    def turn(self, q: NDArray, other: NDArray) -> float:
        """See `Body`."""
        return self.inner.turn(q, other)

    def scale(self) -> NDArray:
        """See `Body`."""
        return self.inner.scale()[: self.size]

    def turning_moments(self) -> float:
        """See `Body`."""
        return self.inner.turning_moments()

    def longest(self) -> float:
        """See `Body`."""
        return self.inner.longest()

    @property
    def rest_angles(self) -> NDArray:
        """See `Body`."""
        return self.inner.rest_angles

    def rest_law(self, number: int) -> HingeLaw:
        """See `Body`."""
        return self.inner.rest_law(number)

    def fold_hinges(self) -> FoldHinges:
        """See `Body`: moments of creases act on edge angles, which are not there."""
        raise InputError(
            ': with scheme = "n5b8e" explicit methods take neither moments on creases nor their '
            'damping; choose "generalized_alpha"',
            "method",
        )

    def folded(self, rest: NDArray) -> CondensedBody:
        """See `Body`."""
        return CondensedBody(self.inner.folded(rest))

    def actuated(self, numbers: NDArray) -> tuple[CondensedBody, NDArray, NDArray]:
        """See `Body`."""
        inner, rows, place = self.inner.actuated(numbers)
        return CondensedBody(inner), rows, place

    def turned(self) -> tuple[NDArray, NDArray]:
        """See `Body`."""
        return self.inner.turned()

    def unstrained(self, q: NDArray) -> Unstrained:
        """See `Body`."""
        inner, hidden = self.inner.unstrained(self._whole(q)), self.inner.hidden
        return Unstrained(
            balanced(inner.tangent, hidden), balanced(inner.hinges, hidden), inner.stretch
        )


def balanced(matrix: sparse.csr_array, hidden: NDArray) -> sparse.csr_array:
    """The tangent (3n, 3n) of displacements where the `hidden` last dofs give way."""
    if not len(hidden):
        return matrix
    first = hidden[0]
    across = sparse.csc_array(matrix[first:, :first])
    given = sparse.csc_array(splu(sparse.csc_array(matrix[first:, first:])).solve(across.toarray()))
    return sparse.csr_array(matrix[:first, :first] - across.T @ given)
