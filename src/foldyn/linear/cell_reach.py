"""The dofs of a patch as dofs of a cell and its neighbors.

Displacements of cell R are given in axes that turn with the cell, so that a wave differs between
cells only by a factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import ComputationError
from foldyn.linear.bloch import Hops, collected, hops, null_space, steps_of
from foldyn.linear.cell_patch import Patch
from foldyn.linear.unit_cell import rotation
from foldyn.mechanics.assembly import Assembly
from foldyn.patterns.screw import Screw

ITERATIONS = 30
BALANCED = 1e-13  # rad, of the last Newton step for hidden dofs
TURNED = 1e-13  # of coefficients of constraints: round-off of zeros


class CellReach:
    """Dofs of cell 0, m = 3 node + axis followed by hidden ones, and all dofs that reach them.

    Parameters
    ----------
    patch : Patch
    motions : sequence of Screw
        Motions from a cell to the next in the state.
    body : Assembly
        Body of the patch.

    Attributes
    ----------
    rows : ndarray of int, shape (m,)
        Dofs of cell 0 among those of the patch.
    steps : ndarray of int, shape (s, d)
        R of the cells with nodes in the patch, and their opposites.
    hidden : ndarray of bool, shape (m,)
        Dofs without mass.
    held : ndarray of bool, shape (m,)
        Dofs held by supports.
    """

    def __init__(self, patch: Patch, motions: Sequence[Screw], body: Assembly) -> None:
        units = len(patch.first)
        self.patch, self.body, self.count = patch, body, 3 * units + patch.hidden
        nodal = (3 * patch.unit[:, None] + np.arange(3)).ravel()
        behind = np.where(patch.hidden_unit < 0, -1, 3 * units + patch.hidden_unit)
        self._unit = np.concatenate([nodal, behind])
        offset = np.concatenate([np.repeat(patch.step, 3, axis=0), patch.hidden_step])
        self.steps, self._number = steps_of(offset)
        own = np.flatnonzero((offset == 0).all(axis=1))
        self.rows = own[np.argsort(self._unit[own], kind="stable")]
        self.hidden = np.arange(self.count) >= 3 * units
        self.held = np.zeros(self.count, bool)
        self.held[: 3 * units] = patch.case.constraints.held[self.rows[: 3 * units]]
        turned = [rotation(motions, step) for step in self.steps]
        blocks = sparse.block_diag([turned[k] for k in self._number[: 3 * len(patch.unit) : 3]])
        more = sparse.eye_array(len(behind)) if len(behind) else None
        self._frames = sparse.csr_array(
            blocks if more is None else sparse.block_diag([blocks, more])
        )

    def hops(self, matrix: sparse.sparray) -> Hops:
        """A matrix of the patch's dofs as `Hops`, in the axes of the cells."""
        own = sparse.csr_array(self._frames.T @ matrix @ self._frames)
        return hops(own, self.rows, self._unit, self._number, self.count, len(self.steps))

    def forces(self, q: NDArray) -> NDArray[np.float64]:
        """Forces (m,), N, of the sheet on the dofs of cell 0 for the patch at q."""
        return self.body.internal(q)[self.rows]

    @cached_property
    def _known(self) -> sparse.csr_array:
        """Map from hidden dofs of a cell to those of the patch, as far as they are known."""
        unit = self.patch.hidden_unit
        there = np.flatnonzero(unit >= 0)
        entries = (np.ones(len(there)), (there, unit[there]))
        return sparse.csr_array(entries, shape=(len(unit), self.patch.hidden))

    def balanced(self, displacement: NDArray) -> NDArray[np.float64]:
        """All dofs of the patch at a displacement (n, 3), hidden ones equal in all cells.

        Newton's method balances them in cell 0.

        Raises
        ------
        ComputationError
            No balance is found near zero.
        """
        first, own = displacement.size, self.rows[self.hidden]
        hidden = np.zeros(len(own))
        q = np.concatenate([displacement.ravel(), np.zeros(len(self.patch.hidden_unit))])
        if not len(own):
            return q
        for _ in range(ITERATIONS):
            couple = self.body.internal(q)[own]
            if not couple.any():
                return q
            block = self.body.tangent(q)[own][:, first:] @ self._known
            step = -np.linalg.solve(block.toarray(), couple)
            hidden += step
            q[first:] = self._known @ hidden
            if self.body.sheet.per_hidden * np.abs(step).max() <= BALANCED:
                return q
        raise ComputationError("the rotations of the panels do not balance in this state")

    @cached_property
    def ties(self) -> Hops:
        """Constraints (k, m) of one cell: the ones whose first cell is cell 0."""
        ties = self.patch.case.constraints
        rows = (
            sparse.csr_array(ties.rows) if ties else sparse.csr_array((0, 3 * len(self.patch.unit)))
        )
        first = [
            min(map(tuple, self.steps[self._number[rows.indices[a:b]]].tolist()))
            for a, b in zip(rows.indptr[:-1], rows.indptr[1:], strict=True)
        ]
        kept = [k for k, step in enumerate(first) if not any(step)]
        size = rows.shape[1]
        own = sparse.coo_array(rows[kept] @ self._frames[:size, :size])
        value = np.where(np.abs(own.data) > TURNED, own.data, 0.0)
        return collected(
            own.row, self._unit[own.col], self._number[own.col], value, (len(kept), self.count),
            len(self.steps),
        )  # fmt: skip

    @cached_property
    def moves(self) -> NDArray[np.float64]:
        """Orthonormal motions (m, r), equal in all cells, that supports and constraints allow."""
        basis = np.eye(self.count)[:, ~self.held]
        if self.ties.empty:
            return basis
        together = self.ties.at(np.ones(len(self.steps)))
        return basis @ null_space(together @ basis).real

    def projected(self, force: NDArray) -> NDArray[np.float64]:
        """Forces (r,), N, on `moves`."""
        return self.moves.T @ force
