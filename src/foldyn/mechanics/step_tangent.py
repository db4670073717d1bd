"""Tangent for steps of Newton's method: floored slopes, and bar stresses that it can use.

As a sheet bends, panels turn far while their bars hardly stretch. A step of Newton's method moves
nodes along straight lines, which stretches turning bars to second order, and the huge spurious
stresses would sit in the geometric stiffness of the next step: convergence would be slow, worse so
the more slender the sheet. If the bars' stresses are unknowns of their own, Newton's method for
both gives, after these are eliminated, the same equations for the displacements but with a
geometric stiffness from

    S = S(u0) + S'(u0) (D0 . d) / L^2,    d the step from u0 to u of a bar with vector D0,

which knows nothing of the second order (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
Eng. 313, 2017). The residual is that of the displacements and never sees any of this, so the
solution is the same, and convergence is quadratic as before.

Implicit motions take the tangent as 3x3 blocks, in an order of the dofs that keeps their matrix
narrow.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.jit.compiled import kernel
from foldyn.materials.switch import bar_slope, bar_stress
from foldyn.mechanics.discrete_gradient import add_bar_tangent, add_hinge_tangent
from foldyn.mechanics.energy import bar_extension
from foldyn.mechanics.model import BarsHinges, node_order, ranks
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.tangent import Sparsity, add_tangent, add_to_bar, block_keys, sparsity

FLOOR = 1e-3  # of a hinge's stiffness: its least slope in steps, as in MERLIN2


def put_tangent(
    model: BarsHinges, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
) -> None:
    """Tangent blocks (nnz, 3, 3) at displacement u (n, 3), with bar stresses from `before`.

    Parameters
    ----------
    model, pattern
    u, before : ndarray, shape (n, 3)
        The iterate; the start of the step, or, `again`, the last iterate, from which stresses are
        extrapolated to u.
    again : bool
    out : ndarray, shape (nnz, 3, 3)
    """
    out[:] = 0.0
    add_floored_tangent(model, pattern, u, out)
    stress = np.empty(len(model.bars))
    expected_stress(model, u, before, again, stress)
    _replace_stress(model, u, stress, pattern.bar_slots, out)


def put_mean_tangent(
    model: BarsHinges, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
    before: NDArray, again: bool, out: NDArray,
) -> None:  # fmt: skip
    """Blocks likewise of the mean forces from u0, where the dihedrals are `angle` (nh,), to u1."""
    start, end = np.empty((2, len(model.bars)))
    expected_stress(model, u0, u0, False, start)
    expected_stress(model, u1, before, again, end)
    out[:] = 0.0
    add_bar_tangent(model, u0, u1, 0.5 * (start + end), pattern.bar_slots, out)
    add_hinge_tangent(model, u0, u1, angle, FLOOR, pattern.hinge_slots, out)


def add_floored_tangent(model: BarsHinges, pattern: Sparsity, u: NDArray, out: NDArray) -> None:
    """Add tangent blocks with slopes of the built-in laws of at least `FLOOR` times the stiffness.

    Those of a user's law, which may fall on purpose, stay.
    """
    runs = model.hinge_runs
    own = runs[:, 2] < 0
    add_tangent(model._replace(hinge_runs=runs[~own]), pattern, u, FLOOR, out)
    if own.any():
        exact = model._replace(hinge_runs=runs[own], bar_runs=model.bar_runs[:0])
        add_tangent(exact, pattern, u, -np.inf, out)


@kernel
def expected_stress(model, u, before, again, out):
    """Stress S / E_y of the bars (nb,) at `before`, or `again` extrapolated from there to u."""
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            a, b = model.bars[e, 0], model.bars[e, 1]
            x = bar_extension(model, before, e)
            out[e] = bar_stress(code, x, address[1])
            if again:
                along = 0.0
                for c in range(3):
                    d = before[b, c] - before[a, c]
                    along += (model.bar_vector[e, c] + d) * (u[b, c] - u[a, c] - d)
                out[e] += bar_slope(code, x, address[2]) * along * model.bar_per_length2[e]


@kernel
def _replace_stress(model, u, stress, slots, data):
    """Replace the bars' stresses in blocks at u by `stress` (nb,)."""
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            value = stress[e] - bar_stress(code, bar_extension(model, u, e), address[1])
            value *= model.bar_stiffness[e]
            for c in range(3):
                add_to_bar(data, slots, e, c, c, value)


class BarsHingesBlocks:
    """Blocks of bars and hinges; see `mechanics.sheet_term.Blocks`."""

    def __init__(self, model: BarsHinges) -> None:
        self.pattern = sparsity(model)
        row = np.repeat(np.arange(len(model.rest)), np.diff(self.pattern.indptr))
        order = narrowest(node_order(model), model.rest, row, self.pattern.indices)
        self.order = (3 * order[:, None] + np.arange(3)).ravel()
        self.unused = np.zeros(0, np.int64)

    def put(
        self, of: SheetTerm, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        put_tangent(of.model, pattern, u, before, again, out)

    def put_mean(
        self, of: SheetTerm, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
        before: NDArray, again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        put_mean_tangent(of.model, pattern, u0, u1, angle, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        return np.ones((len(pattern.indices), 3, 3), bool)


class SparseBlocks:
    """Blocks of any sparse tangent, with hidden dofs three to a row.

    Parameters
    ----------
    tangent : csr_array, shape (m, m)
        Where its entries are: those of `SheetTerm.step_tangent`, in their order.
    rows : int
    position : ndarray, shape (3 rows, 3)
        Where the dofs are, m.
    """

    def __init__(self, tangent: sparse.csr_array, rows: int, position: NDArray) -> None:
        size = tangent.shape[0]
        self._row = np.repeat(np.arange(size), np.diff(tangent.indptr))
        self._column = tangent.indices.astype(np.int64)
        ones = sparse.csr_array((np.ones(len(self._row), np.int8), tangent.indices, tangent.indptr))
        ones.resize((3 * rows, 3 * rows))
        blocks = ones.tobsr((3, 3))
        blocks.sort_indices()
        empty = np.zeros(0, np.int64)
        self.pattern = Sparsity(
            blocks.indptr.astype(np.int32), blocks.indices.astype(np.int32),
            empty.reshape(0, 2, 2), empty.reshape(0, 4, 4),
        )  # fmt: skip
        self._place: tuple[Sparsity, NDArray] | None = None
        self.unused = np.arange(size, 3 * rows)
        order = reverse_cuthill_mckee(ones.tocsr(), symmetric_mode=True).astype(np.int64)
        self.order = narrowest(order, position, self._row, self._column)

    def put(
        self, of: SheetTerm, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        out[:] = 0.0
        matrix = of.step_tangent(u, before if again else None)
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def put_mean(
        self, of: SheetTerm, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
        before: NDArray, again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        out[:] = 0.0
        matrix = of.mean_tangent(u0, u1, angle, before, again)
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`; three dofs that share a row of blocks may lie far apart."""
        filled = np.zeros((len(pattern.indices), 3, 3), bool)
        filled.reshape(-1)[self._places(pattern)] = True
        return filled

    def _places(self, pattern: Sparsity) -> NDArray:
        """Where the entries stand among those of a pattern's blocks."""
        if self._place is None or self._place[0] is not pattern:
            keys, rows = block_keys(pattern.indptr, pattern.indices), len(pattern.indptr) - 1
            block = np.searchsorted(keys, self._row // 3 * rows + self._column // 3)
            self._place = pattern, 9 * block + 3 * (self._row % 3) + self._column % 3
        return self._place[1]


def narrowest(order: NDArray, position: NDArray, row: NDArray, column: NDArray) -> NDArray:
    """`order` of places (n,), or a sweep along an axis if it couples none as far apart.

    On a rectangular sheet a sweep along its longer side has half the width of other orders.

    position : (n, 3).
    row, column : places that are coupled.
    """
    size = np.ptp(position, axis=0).max()
    x, y, z = np.round(position / size, 6).T  # so that rows of nodes are straight
    sweeps = [np.lexsort(keys) for keys in ((z, y, x), (z, x, y), (y, x, z))]

    def width(order: NDArray) -> int:
        number = ranks(order)
        return int(np.abs(number[row] - number[column]).max())

    return min((order, *sweeps), key=width)
