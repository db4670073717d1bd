"""Hinges with memory: what the branches of their laws add to the elastic parts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.inelastic import (
    MemoryHinges,
    evaluate_at,
    make_last,
    mean_memory_tangents,
    memory_gradients,
    memory_kernels,
    memory_tangents,
)
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.term import CompiledTerm, Term, Way, in_rows
from foldyn.mechanics.viscous import WIDTH, coupled


class HingeMemory(Term):
    """Branches of hinges, added to the elastic parts of their laws on a sheet; see `Term`.

    Their state changes in place, and terms derived from this one share it.

    Parameters
    ----------
    own : MemoryHinges
    settles : ndarray of bool, shape (b,)
        Branches that are settled at the start of a motion by default.
    sheet : SheetTerm
    """

    undifferentiated = "creases that yield, creep, relax or, beside panels that give way, damp"

    def __init__(self, own: MemoryHinges, settles: NDArray, sheet: SheetTerm) -> None:
        self.own, self.settles = own, settles
        self._offset, self._rows = sheet.series()[1], sheet.rows

    def start(self, q: NDArray, state: NDArray | str | None = None) -> None:
        """Start at the dofs q (m,) or (rows, 3) in a state (b, 2), "fresh", or the default."""
        own, offset, q = self.own, self._offset, in_rows(q, self._rows)
        for array in (own.angle, own.state, own.moment, own.elapsed, own.lost):
            array[:] = 0.0
        offset[own.row, 1] = 0.0  # other motions of the sheet have left their values
        evaluate_at(own, offset, q)  # turned instantly from rest
        make_last(own)
        own.lost[:] = 0.0
        if isinstance(state, np.ndarray):
            own.state[:] = state
        elif state is None:
            own.state[self.settles] = 0.0
        evaluate_at(own, offset, q)

    def resists(self, state: NDArray | str | None) -> bool:
        """Whether a start in such a state counts as an instant turn, neither relaxed nor given."""
        return isinstance(state, str) or (state is None and not self.settles.all())

    def commit(self) -> None:
        """Accept the step that ends at the last evaluation."""
        make_last(self.own)

    def still(self) -> None:
        """Set the next evaluation to the time of the last accepted step."""
        self.own.elapsed[0] = 0.0

    def snapshot(self) -> tuple[NDArray, ...]:
        """Copy of the last accepted step, for `recall`."""
        return tuple(array.copy() for array in self._kept)

    def recall(self, snapshot: Sequence[NDArray]) -> None:
        """Return to an accepted step."""
        for array, kept in zip(self._kept, snapshot, strict=True):
            array[:] = kept
        self.still()

    @property
    def _kept(self) -> tuple[NDArray, ...]:
        return self.own.angle, self.own.state, self.own.lost

    def gradients(self, q: NDArray, size: int) -> sparse.csr_array:
        """Gradients (h, size) of the hinge angles at the dofs q (m,)."""
        out = np.zeros((len(self.own.rest), WIDTH))
        memory_gradients(self.own, np.ascontiguousarray(q, float), out)
        row = np.repeat(np.arange(len(out)), WIDTH)
        entries = (out.ravel(), (row, self.own.dofs.ravel()))
        rates = sparse.csr_array(sparse.coo_array(entries, shape=(len(out), size)))
        rates.eliminate_zeros()
        return rates

    # ------------------------------------------------------------------ as a term
    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`; the energy belongs to groups of the sheet."""
        return memory_kernels(self.own, self._offset, self._rows, group)

    @cached_property
    def _coupled(self) -> tuple[NDArray, NDArray, NDArray]:
        mine = np.ones(self.own.dofs.shape, bool)
        mine[:, 12:] = self.own.hidden_turn != 0.0
        return coupled(self.own.dofs, mine)

    @property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of its tangent entries; see `Term`."""
        return self._coupled[1:]

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries; the elastic part of a hinge has a slope of 1 per unit stiffness."""
        own, u = self.own, in_rows(q, self._rows)
        out = np.empty((len(own.rest), WIDTH, WIDTH))
        evaluate_at(own, self._offset, u)
        np.maximum(own.slope, (floor - 1.0) * own.stiffness, out=own.slope)
        memory_tangents(own, u, out)
        return out[self._coupled[0]]

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        out = np.empty((len(self.own.rest), WIDTH, WIDTH))
        ends = in_rows(q0, self._rows), in_rows(q1, self._rows)
        mean_memory_tangents(self.own, 0.5 * (floor - 1.0), *ends, out)
        return out[self._coupled[0]]

    def on(self, sheet: SheetTerm) -> Self:
        """The branches on another sheet; they keep their own rest angles. See `Term`."""
        return type(self)(self.own, self.settles, sheet)
