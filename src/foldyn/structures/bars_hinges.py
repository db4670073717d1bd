"""Bars and hinges as solvers see them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn import mechanics
from foldyn.materials import BarLaw, HingeLaw, Superlinear
from foldyn.mechanics.bars_hinges import bars_hinges_kernels, bars_hinges_pulled
from foldyn.mechanics.dihedral import dihedrals_and_gradients
from foldyn.mechanics.model import BarsHinges, node_order, ranks, renumber
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of
from foldyn.mechanics.sheet_term import NO_DOF, FoldHinges, SheetTerm, SoftHinges, largest_turn
from foldyn.mechanics.step_tangent import BarsHingesBlocks, put_mean_tangent, put_tangent
from foldyn.mechanics.term import CompiledTerm, Folds, Strains, Unstrained
from foldyn.values import writable

GROUPS: Mapping[str, str] = {
    "strain_bars": "strain energy of the bars",
    "strain_folds": "strain energy of the folds",
    "strain_bends": "strain energy of the bends",
}
SMALL = 300  # nodes: smaller models fit in the cache, however their nodes are numbered


class BarsHingesTerm(SheetTerm):
    """A model of bars and hinges; see `mechanics.sheet_term.SheetTerm`.

    Parameters
    ----------
    model : BarsHinges
    turning : ndarray, shape (nr,)
        Rows in `model.hinges`: the folds, then the bends.
    laws : tuple of (HingeLaw, int)
        Law and number of the folds, then of the bends.
    softness : ndarray, shape (nf,)
        Softness of the panels adjacent to each fold, rad/(N m).
    like : BarsHingesTerm, optional
        A term whose elements have the same nodes.
    """

    energy_groups = GROUPS

    def __init__(
        self, model: BarsHinges, turning: NDArray, laws: tuple[tuple[HingeLaw, int], ...],
        softness: NDArray, like: BarsHingesTerm | None = None,
    ) -> None:  # fmt: skip
        self.model, self._turning, self._laws, self._like = model, turning, laws, like
        self.laws = tuple(law for law, _ in laws)
        self._softness, self.offsets = softness, len(softness) if softness.any() else 0
        self.size, self.rows = model.rest.size, len(model.rest)

    def _with(self, **arrays: NDArray) -> BarsHingesTerm:
        """Term with other arrays of the model, whose elements keep their nodes."""
        model = self.model._replace(**arrays)
        return BarsHingesTerm(model, self._turning, self._laws, self._softness, self)

    def _nodal(self, q: NDArray) -> NDArray:
        return writable(q).reshape(self.model.rest.shape)

    @cached_property
    def sparsity(self) -> mechanics.Sparsity:
        """Pattern of the tangent."""
        return self._like.sparsity if self._like else mechanics.sparsity(self.model)

    @property
    def threads(self) -> int:
        """Fastest number of threads for a motion; see `SheetTerm`."""
        return mechanics.threads_for(self.model)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent (m, m), N/m; see `SheetTerm`."""
        return mechanics.tangent(self.model, self.sparsity, self._nodal(q), floor).tocsr()

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """Matrix for a Newton step at q; see `SheetTerm` and `mechanics.step_tangent`."""
        pattern, again = self.sparsity, before is not None
        data, old = np.empty((len(pattern.indices), 3, 3)), q if before is None else before
        put_tangent(self.model, pattern, self._nodal(q), self._nodal(old), again, data)
        return self._assembled(data)

    def mean_tangent(
        self, q0: NDArray, q1: NDArray, angle: NDArray, before: NDArray, again: bool
    ) -> sparse.csr_array:
        """Matrix for the mean forces from q0 to q1; see `SheetTerm`."""
        pattern, ends = self.sparsity, (self._nodal(q0), self._nodal(q1))
        data = np.empty((len(pattern.indices), 3, 3))
        put_mean_tangent(self.model, pattern, *ends, angle, self._nodal(before), again, data)
        return self._assembled(data)

    def _assembled(self, data: NDArray) -> sparse.csr_array:
        """Sparse matrix with the given blocks (nnz, 3, 3), in the pattern of the tangent."""
        blocks = data, self.sparsity.indices, self.sparsity.indptr
        return sparse.bsr_array(blocks, shape=(self.size, self.size)).tocsr()

    def blocks(self) -> BarsHingesBlocks:
        """Tangent blocks for implicit integrators; see `SheetTerm`."""
        return BarsHingesBlocks(self.model)

    def scratches(self, threads: int) -> list[mechanics.ForceScratch]:
        """Scratch for each thread; see `SheetTerm`."""
        return mechanics.force_scratches(self.model, threads)

    def compiled(self, part: Any, kept: mechanics.ForceScratch, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return bars_hinges_kernels(self.model, kept, len(GROUPS))

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.model, "addresses")

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        return bars_hinges_pulled(self.model)

    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of the sheet's hinges; see `SheetTerm`."""
        return self.model.hinges

    @property
    def folds(self) -> Folds:
        """Actuated hinges; see `SheetTerm`."""
        model = self.model
        return Folds(model.hinge_rest, model.hinge_parameters, model.hinge_stiffness)

    def angles(self, q: NDArray) -> NDArray:
        """Dihedrals (nh,) of the sheet's hinges, rad; see `SheetTerm`."""
        return mechanics.angles(self.model.rest + self._nodal(q), self.model.hinges)

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn of a hinge, or of a bar relative to the other bars; inf on penetration."""
        shift, (a, b) = self._nodal(other - q), self.model.bars.T
        apart = np.linalg.norm(shift[b] - shift[a], axis=1)
        bars = float((apart / np.linalg.norm(self.model.bar_vector, axis=1)).max(initial=0.0))
        return largest_turn(bars, self.angles(q), self.angles(other))

    def scale(self) -> NDArray:
        """Force scale: EA of the bars, summed at the nodes."""
        nodal = np.zeros(self.rows)
        stiff = self.model.bar_stiffness / np.sqrt(self.model.bar_per_length2)
        np.add.at(nodal, self.model.bars, stiff[:, None])
        return np.repeat(nodal, 3)

    def turning_moments(self) -> float:
        """Sum of the moments (N m) of all hinges for a unit turn; see `SheetTerm`."""
        return float(self.model.hinge_stiffness.sum())

    def longest(self) -> float:
        """Length (m) of the longest bar or side; see `SheetTerm`."""
        per_length2 = self.model.bar_per_length2
        if not per_length2.size:
            return float(np.ptp(self.model.rest, axis=0).max()) or 1.0
        return float(1.0 / np.sqrt(per_length2.min()))

    @cached_property
    def _soft(self) -> NDArray:
        """Rows (h,) of the hinges with the superlinear law."""
        runs = self.model.hinge_runs
        return np.flatnonzero(np.repeat(runs[:, 2], runs[:, 1] - runs[:, 0]) == Superlinear.code)

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """Hinges with the superlinear law; see `SheetTerm`."""
        model, rows = self.model, self._soft
        if not len(rows):
            return super().soft_hinges(q)
        columns = 3 * model.hinges[rows].astype(np.int64)[:, :, None] + np.arange(3)
        place = np.ascontiguousarray(model.rest + self._nodal(q))
        angle, found = dihedrals_and_gradients(place, np.ascontiguousarray(model.hinges[rows]))
        start = 12 * np.arange(len(rows) + 1)
        gradient = sparse.csr_array((found.ravel(), columns.ravel(), start), (len(rows), self.size))
        return SoftHinges(angle - model.hinge_rest[rows], model.hinge_stiffness[rows], gradient)

    def soft_tangent(self, q: NDArray, slope: NDArray) -> sparse.csr_array:
        """Tangent (m, m) of the superlinear hinges alone; see `SheetTerm`."""
        alone = self.nominal(q).hinges_alone()
        stiffness = np.zeros(len(alone.model.hinges))
        stiffness[self._soft] = alone.model.hinge_stiffness[self._soft] * slope
        return alone._with(hinge_stiffness=stiffness).tangent(q)

    def weakened(self, hinges: NDArray) -> BarsHingesTerm:
        """The sheet without the stiffness of some superlinear hinges; see `SheetTerm`."""
        stiffness = self.model.hinge_stiffness.copy()
        stiffness[self._soft[hinges]] = 0.0
        return self._with(hinge_stiffness=stiffness)

    @property
    def rest_angles(self) -> NDArray:
        """Rest angles of folds and bends, then offsets; see `SheetTerm`."""
        offsets = self.model.hinge_offset[self._turning[: self.offsets], 0]
        return np.append(self.model.hinge_rest[self._turning], offsets)

    def rest_law(self, number: int) -> HingeLaw:
        """Law of the hinge with a rest angle; see `SheetTerm`."""
        (folds, count), (bends, _) = self._laws
        if count <= number < len(self._turning):
            return bends
        return folds.at([number if number < count else number - len(self._turning)])

    def fold_hinges(self) -> FoldHinges:
        """Hinges of the folds, one per fold; see `SheetTerm`."""
        return self._hinges_at(self._turning[: self._laws[0][1]], self._softness)

    def bend_hinges(self) -> FoldHinges:
        """Hinges within panels; see `SheetTerm`."""
        rows = self._turning[self._laws[0][1] :]
        return self._hinges_at(rows, np.zeros(len(rows)))

    def _hinges_at(self, rows: NDArray, softness: NDArray) -> FoldHinges:
        model = self.model
        nodes, none = model.hinges[rows].astype(np.int64), np.full((len(rows), 2), NO_DOF)
        return FoldHinges(
            np.arange(len(rows)), nodes, model.rest[nodes], none, 0.0, model.hinge_rest[rows],
            model.hinge_stiffness[rows], softness, rows,
        )  # fmt: skip

    def own_strains(self) -> Strains:
        """Strains of the sheet's bars and hinges; see `SheetTerm`."""
        model, angle = self.model, self.angles(np.zeros(self.size))
        bars, hinges = model.bars.astype(np.int64), model.hinges.astype(np.int64)
        slope, turn = np.zeros(len(bars)), np.zeros(len(hinges))
        for start, end, code, row in model.bar_runs.tolist():
            slope[start:end] = BarLaw.compiled(code, np.zeros(1), model.addresses[row])[2]
        for start, end, code, row in model.hinge_runs.tolist():
            part, address = slice(start, end), model.addresses[row]
            state = angle[part], model.hinge_rest[part], model.hinge_parameters[part]
            own, share = HingeLaw.slopes(code, *state, address)[0], model.hinge_share[part]
            turn[part] = own / (share + (1.0 - share) * own)  # in series with panels
        return Strains(
            bars, model.bar_vector, model.bar_stiffness * slope,
            hinges, model.rest[hinges], model.hinge_stiffness * turn,
        )  # fmt: skip

    def folded(self, rest: NDArray) -> BarsHingesTerm:
        """The sheet with other rest angles (nr,), rad; see `SheetTerm`."""
        angle, parameters = self.model.hinge_rest.copy(), self.model.hinge_parameters.copy()
        offset, count = self.model.hinge_offset.copy(), len(self._turning)
        angle[self._turning], start = rest[:count], 0
        offset[self._turning[: self.offsets], 0] = rest[count:]
        for law, count in self._laws:
            part = slice(start, start + count)
            if law.follows_rest:
                parameters[self._turning[part]] = law.parameters(rest[part])
            start += count
        return self._with(hinge_rest=angle, hinge_parameters=parameters, hinge_offset=offset)

    def actuated(self, numbers: NDArray) -> tuple[BarsHingesTerm, NDArray, NDArray]:
        """A copy with rest angles that change in place; see `SheetTerm`."""
        model = self.model
        own = self._with(
            hinge_rest=model.hinge_rest.copy(), hinge_parameters=model.hinge_parameters.copy(),
            hinge_offset=model.hinge_offset.copy(),
        )  # fmt: skip
        rows = np.append(self._turning, self._turning[: self.offsets])
        return own, rows[numbers], np.arange(len(numbers))

    def turned(self) -> tuple[NDArray, NDArray]:
        """Rest angles (rad) of actuated hinges, and their rows; see `SheetTerm`."""
        return self.model.hinge_rest, np.arange(len(self.model.hinge_rest))

    def series(self) -> tuple[NDArray, NDArray]:
        """Crease shares and offsets of actuated hinges; see `SheetTerm`."""
        return self.model.hinge_share, self.model.hinge_offset

    def offsets_under(self, moments: NDArray) -> NDArray:
        """Turns of the compliant panels at creases with the given moments; see `SheetTerm`."""
        return moments * self._softness

    def lowest_nodes(self, turned: NDArray) -> NDArray:
        """Lowest node (k,) of actuated hinges; see `SheetTerm`."""
        return self.model.hinges[turned].min(axis=1)

    def renumbered(self) -> tuple[BarsHingesTerm, NDArray]:
        """The sheet with nodes numbered along it, unless it is small; see `SheetTerm`."""
        if self.rows < SMALL:
            return self, np.arange(self.rows)
        order = node_order(self.model)
        model, rows = renumber(self.model, order)
        return BarsHingesTerm(model, ranks(rows)[self._turning], self._laws, self._softness), order

    def hinges_alone(self) -> BarsHingesTerm:
        """The sheet with its hinges only; see `SheetTerm`."""
        return self._with(bar_runs=self.model.bar_runs[:0])

    def anchored(self, place: NDArray) -> BarsHingesTerm:
        """See `Term`."""
        model = self.model
        bars, hinges = (place[::3][nodes].min(axis=1) == 0 for nodes in (model.bars, model.hinges))
        return self._with(
            bar_stiffness=model.bar_stiffness * bars, hinge_stiffness=model.hinge_stiffness * hinges
        )

    def nominal(self, q: NDArray) -> BarsHingesTerm:
        """The model at nominal stiffness, about its state at q; see `SheetTerm`."""
        runs = self.model.hinge_runs.copy()
        runs[:, 2] = 0  # the linear law
        offset = np.zeros_like(self.model.hinge_offset)
        return self._with(hinge_rest=self.angles(q), hinge_runs=runs, hinge_offset=offset)

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model with q as its unstrained state; see `SheetTerm`."""
        sheet = self._with(**self.unstrained_model(q)._asdict())
        rest = np.zeros(self.size)
        return Unstrained(
            sheet.tangent(rest), sheet.hinges_alone().tangent(rest), partial(stretch, sheet.model)
        )

    def unstrained_model(self, q: NDArray) -> BarsHinges:
        """Arrays of this model with linear laws and with q as rest state."""
        linear = self.nominal(q).model
        x, runs = linear.rest + self._nodal(q), linear.bar_runs.copy()
        bar = x[linear.bars[:, 1]] - x[linear.bars[:, 0]]
        per_length2 = 1.0 / np.einsum("ij,ij->i", bar, bar)
        runs[:, 2] = 0
        return linear._replace(rest=x, bar_vector=bar, bar_per_length2=per_length2, bar_runs=runs)


def stretch(model: BarsHinges, motion: NDArray) -> float:
    """Bar elongations in a small motion (m,), relative to the largest ones possible.

    A bar's largest possible elongation is the sum of its end displacements. Root sums of squares,
    weighted by the bars' stiffness; 0 without bars.
    """
    ends = motion.reshape(-1, 3)[model.bars]
    along = model.bar_vector * np.sqrt(model.bar_per_length2)[:, None]
    elongation = np.einsum("ij,ij->i", ends[:, 1] - ends[:, 0], along)
    most = np.linalg.norm(ends, axis=2).sum(axis=1)
    whole = float((model.bar_stiffness * most**2).sum())
    return np.sqrt(float((model.bar_stiffness * elongation**2).sum()) / whole) if whole else 0.0
