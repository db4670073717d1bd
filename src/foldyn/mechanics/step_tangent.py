"""Tangent for Newton steps: slopes with a lower bound, and bar stresses suited to such steps.

As a sheet bends, panels turn far while their bars hardly stretch. A Newton step moves nodes along
straight lines, which stretches turning bars to second order, and the huge spurious stresses would
enter the geometric stiffness of the next step: convergence would be slow, and the slower the more
slender the sheet. With the bar stresses as additional unknowns, Newton's method for both gives,
after their elimination, the same equations for the displacements but with a geometric stiffness
from

    S = S(u0) + S'(u0) (D0 . d) / L^2,    d the step from u0 to u of a bar with vector D0,

without the second-order error (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech. Eng. 313,
2017). The residual remains the residual of the displacements, so the solution is the same, and
convergence is still quadratic.

Implicit motions use the tangent as 3x3 blocks, in a dof order with a small bandwidth.
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
from foldyn.mechanics.tangent import Sparsity, add_tangent, add_to_bar, entry_slots, sparsity

FLOOR = 1e-3  # least slope in Newton steps, relative to a hinge's stiffness, as in MERLIN2


def put_tangent(
    model: BarsHinges, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
) -> None:
    """Tangent blocks (nnz, 3, 3) at displacement u (n, 3), with bar stresses from `before`.

    Parameters
    ----------
    model, pattern
    u, before : ndarray, shape (n, 3)
        The iterate u; and the start of the step or, if `again`, the last iterate, from which
        stresses are extrapolated to u.
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
    """Blocks of the mean forces from u0, with dihedrals `angle` (nh,), to u1; see `put_tangent`."""
    start, end = np.empty((2, len(model.bars)))
    expected_stress(model, u0, u0, False, start)
    expected_stress(model, u1, before, again, end)
    out[:] = 0.0
    add_bar_tangent(model, u0, u1, 0.5 * (start + end), pattern.bar_slots, out)
    add_hinge_tangent(model, u0, u1, angle, FLOOR, pattern.hinge_slots, out)


def add_floored_tangent(model: BarsHinges, pattern: Sparsity, u: NDArray, out: NDArray) -> None:
    """Add tangent blocks; built-in laws have slopes of at least `FLOOR` times the stiffness.

    Slopes of user laws, which may be meant to fall, are kept.
    """
    runs = model.hinge_runs
    own = runs[:, 2] < 0
    add_tangent(model._replace(hinge_runs=runs[~own]), pattern, u, FLOOR, out)
    if own.any():
        exact = model._replace(hinge_runs=runs[own], bar_runs=model.bar_runs[:0])
        add_tangent(exact, pattern, u, -np.inf, out)


@kernel
def expected_stress(model, u, before, again, out):
    """Stress S / E_y of the bars (nb,) at `before`; with `again`, extrapolated from there to u."""
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
    """Replace the bar stresses in blocks at u by `stress` (nb,)."""
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
        """Fill blocks with the tangent; see `Blocks.put`."""
        put_tangent(of.model, pattern, u, before, again, out)

    def put_mean(
        self, of: SheetTerm, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
        before: NDArray, again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """Fill blocks with the derivative of the mean forces; see `Blocks.put_mean`."""
        put_mean_tangent(of.model, pattern, u0, u1, angle, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """Mask of the entries that `put` may fill; see `Blocks.filled`."""
        return np.ones((len(pattern.indices), 3, 3), bool)


class SparseBlocks:
    """Blocks of any sparse tangent, with hidden dofs grouped by three.

    Parameters
    ----------
    tangent : csr_array, shape (m, m)
        A matrix with the entries of `SheetTerm.step_tangent` in the same order.
    rows : int
    position : ndarray, shape (3 rows, 3)
        Positions of the dofs, m.
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
        """Fill blocks with the tangent; see `Blocks.put`."""
        out[:] = 0.0
        matrix = of.step_tangent(u, before if again else None)
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def put_mean(
        self, of: SheetTerm, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
        before: NDArray, again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """Fill blocks with the derivative of the mean forces; see `Blocks.put_mean`."""
        out[:] = 0.0
        matrix = of.mean_tangent(u0, u1, angle, before, again)
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def filled(self, pattern: Sparsity) -> NDArray:
        """Mask of the entries that `put` may fill; three dofs of one row may lie far apart."""
        filled = np.zeros((len(pattern.indices), 3, 3), bool)
        filled.reshape(-1)[self._places(pattern)] = True
        return filled

    def _places(self, pattern: Sparsity) -> NDArray:
        """Positions of the entries in the blocks of a pattern."""
        if self._place is None or self._place[0] is not pattern:
            self._place = pattern, entry_slots(pattern, self._row, self._column).astype(np.int64)
        return self._place[1]


def narrowest(order: NDArray, position: NDArray, row: NDArray, column: NDArray) -> NDArray:
    """`order` of places (n,), or a sweep along an axis if that has a smaller bandwidth.

    On a rectangular sheet a sweep along its longer side has half the width of other orders.

    position : (n, 3).
    row, column : places that are coupled.
    """
    size = np.ptp(position, axis=0).max() or 1.0
    x, y, z = np.round(position / size, 6).T  # makes rows of nodes straight
    sweeps = [np.lexsort(keys) for keys in ((z, y, x), (z, x, y), (y, x, z))]

    def width(order: NDArray) -> int:
        number = ranks(order)
        return int(np.abs(number[row] - number[column]).max())

    return min((order, *sweeps), key=width)
