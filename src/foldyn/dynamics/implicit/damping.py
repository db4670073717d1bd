"""Damping that follows the motion and that of modes, in the matrix of an implicit step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.woodbury import Updated
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.tangent import block_keys
from foldyn.mechanics.viscous import WIDTH, Viscous, put_gradients
from foldyn.mechanics.viscous_panels import panel_blocks

HIDDEN = 12  # place of an element's dofs without mass among its own


class Weights(NamedTuple):
    """Factors of the matrices in that of an iteration."""

    stiffness: float
    mass: float  # 1/s2
    damping: float  # 1/s, of the damping but for alpha M


class ElementBlocks:
    """Viscous elements in 3x3 blocks of the matrix of arrays (rows, 3).

    Attributes
    ----------
    blocks : bsr_array
        Where their entries may be.
    """

    def __init__(self, elements: Viscous, rows: int) -> None:
        self._elements = elements
        self._gradient = np.zeros((len(elements.coefficient), WIDTH))
        self._own = np.ones_like(self._gradient, bool)  # the dofs that an element has
        self._own[: len(elements.axial), 6:] = False
        self._own[len(elements.axial) :, 12:] = elements.hidden_turn > 0.0
        pairs = self._own[:, :, None] & self._own[:, None, :]
        shape = (*self._own.shape, WIDTH)
        within = places_of(pairs_within(elements.panels.nodes))
        row = np.broadcast_to(elements.dofs[:, :, None], shape)[pairs]
        column = np.broadcast_to(elements.dofs[:, None, :], shape)[pairs]
        self._row = np.concatenate([row, within[0]])
        self._column = np.concatenate([column, within[1]])
        self._pairs = pairs
        ones = np.ones(len(self._row), np.int8)
        there = sparse.csr_array((ones, (self._row, self._column)), (3 * rows, 3 * rows))
        self.blocks: Any = there.tobsr((3, 3))
        self.blocks.sort_indices()
        self._slot = np.zeros(0, np.int64)
        self._still = np.zeros(0)

    def settle(self, constant: NDArray, where: NDArray) -> None:
        """Know the constant damping (nnz, 3, 3), and where (k,) its blocks stand there."""
        keys, rows = block_keys(self.blocks.indptr, self.blocks.indices), self.blocks.shape[0] // 3
        block = np.searchsorted(keys, self._row // 3 * rows + self._column // 3)
        self._slot = 9 * where[block] + 3 * (self._row % 3) + self._column % 3
        self._still = constant.copy()

    def filled(self, shape: tuple[int, ...]) -> NDArray:
        """Which entries (nnz, 3, 3) they may fill."""
        filled = np.zeros(shape, bool)
        filled.reshape(-1)[self._slot] = True
        return filled

    def put(self, u: NDArray, hidden: float, out: NDArray) -> None:
        """Make `out` (nnz, 3, 3) the whole damping at u (n, 3); see `StepMatrix.follow`."""
        if not self._elements.present:
            return
        place = np.ascontiguousarray(u)
        put_gradients(self._elements, place, self._gradient)
        self._gradient[:, HIDDEN:] *= hidden**0.5
        weighted = self._elements.coefficient[:, None] * self._gradient
        values = (weighted[:, :, None] * self._gradient[:, None, :])[self._pairs]
        values = np.append(values, panel_blocks(self._elements.panels, place))
        out[:] = self._still
        out.reshape(-1)[:] += np.bincount(self._slot, values, out.size)


class ModalTerm:
    """Adds w G'G to factors of a matrix, G (r, free) the rows of modal damping."""

    def __init__(self, rows: NDArray) -> None:
        self._rows = rows

    def __call__(self, weights: Weights, factors: Any) -> Any:
        """Factors of the sum."""
        if not len(self._rows) or weights.damping == 0.0:
            return factors
        return Updated(factors, self._rows, weights.damping)
