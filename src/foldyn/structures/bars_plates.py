"""Bars, folds and plates as solvers see them: the scheme n5b8e, with edge angles as dofs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn import mechanics
from foldyn.errors import InputError
from foldyn.materials import HingeLaw, LinearHinge, Superlinear
from foldyn.mechanics.model import ranks
from foldyn.mechanics.plates import (
    RIDES,
    BarsPlates,
    PlatesScratch,
    plates_kernels,
    plates_scratch,
    turned_plates,
)
from foldyn.mechanics.plates_pullback import plates_pulled
from foldyn.mechanics.plates_tangent import PlatesPattern, add_plates_tangent, plates_pattern
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of
from foldyn.mechanics.sheet_term import (
    NO_DOF,
    FoldHinges,
    SheetTerm,
    SoftHinges,
    largest_turn,
    unit_rows,
)
from foldyn.mechanics.step_tangent import FLOOR as STEP_FLOOR
from foldyn.mechanics.step_tangent import SparseBlocks
from foldyn.mechanics.term import CompiledTerm, Folds, Strains, Term, Unstrained
from foldyn.structures.bars_hinges import GROUPS, BarsHingesTerm, stretch
from foldyn.values import writable


class BarsPlatesTerm(SheetTerm):
    """A model of bars, folds and plates; see `mechanics.sheet_term.SheetTerm`.

    Parameters
    ----------
    model : BarsPlates
    laws : tuple of HingeLaw
        Laws of the folds and of the bends.
    like : BarsPlatesTerm, optional
        A term whose elements have the same dofs.
    """

    energy_groups = GROUPS
    _groups: ClassVar = (0, 1, 2)  # energy groups of bars, folds and bends
    _no_slope: ClassVar[str] = "such folds have no slope at rest; with the scheme n5b8e modes and"

    def __init__(
        self, model: BarsPlates, laws: tuple[HingeLaw, HingeLaw], like: BarsPlatesTerm | None = None
    ) -> None:
        self.model, self.laws, self._like = model, laws, like
        self._nodal = 3 * model.nodes
        self.size, self.rows = self._nodal + model.rotations, model.rows
        self.hidden = np.arange(self._nodal, self.size)
        self.per_hidden = model.per_reach
        self._bars = BarsHingesTerm(
            model.bars, np.zeros(0, np.int64), (), np.zeros(0), like._bars if like else None
        )

    def _with(self, **arrays: Any) -> Self:
        """The sheet with other arrays of its model, whose elements keep their dofs."""
        return type(self)(self.model._replace(**arrays), self.laws, self)

    def _split(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Displacements (n, 3) and rotations (r,)."""
        flat = writable(q).reshape(-1)
        return flat[: self._nodal].reshape(-1, 3), flat[self._nodal : self.size]

    @cached_property
    def sparsity(self) -> PlatesPattern:
        """Pattern of the tangent."""
        if self._like:
            return self._like.sparsity
        bars = self._bars.sparsity
        return plates_pattern(self.model, (bars.indptr, bars.indices))

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `SheetTerm`; with the dofs of explicit methods, right where these are in balance."""
        bars = partial(self._bars.tangent, q[: self._nodal])
        whole = self._assembled(q, floor, bars)
        if not len(self.model.unmoved):
            return whole
        spread = self._spread(turned_plates(self.model, self._split(q)[0]).gradient)
        return sparse.csr_array(spread.T @ whole @ spread)

    def _spread(self, gradient: NDArray) -> sparse.csr_array:
        """Rates (m, m) of displacements and rotations by the dofs of explicit methods.

        gradient : (nh, 12) of the dihedrals, 1/m.
        """
        model, (fold, row, share, own) = self.model, self._turned
        columns = 3 * model.hinges[fold][:, :, None] + np.arange(3)
        entries = gradient[fold] * (share / model.per_reach)[:, None]
        places = (np.repeat(row, 12), columns.ravel())
        nodal = sparse.coo_array((entries.ravel(), places), (model.rotations, self._nodal))
        still = sparse.eye_array(self._nodal)
        return sparse.csr_array(sparse.block_array([[still, None], [nodal, own]]))

    @cached_property
    def _turned(self) -> tuple[NDArray, NDArray, NDArray, sparse.coo_array]:
        """Rotations beside folds: fold, number, share of the fold's turn (k,); rates by dofs.

        The rates (r, r) of all rotations are those by the dofs of explicit methods.
        """
        turns = self.model.fold_rotations
        both, fold, side = (turns >= 0).all(axis=1), *np.nonzero(turns >= 0)
        row, first = turns[fold, side], np.where(both, turns[:, 0], turns.max(axis=1))
        share, two = np.where(both, 0.5, 1.0)[fold], both[fold]
        alone = np.setdiff1d(np.arange(self.model.rotations), row)
        rows = np.concatenate([alone, row, row[two]])
        columns = np.concatenate([alone, first[fold], turns[fold[two], 1]])
        apart = np.where(side[two] == 0, 1.0, -1.0)
        values = np.concatenate([np.ones(len(alone)), -share, apart])
        own = sparse.coo_array((values, (rows, columns)), 2 * (self.model.rotations,))
        return fold, row, share, own

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `SheetTerm`."""
        q = np.ascontiguousarray(q, float).reshape(-1)
        old = None if before is None else np.reshape(before, -1)[: self._nodal]
        bars = partial(self._bars.step_tangent, q[: self._nodal], old)
        return self._assembled(q, self._floor, bars)

    def mean_tangent(
        self, q0: NDArray, q1: NDArray, angle: NDArray, before: NDArray, again: bool
    ) -> sparse.csr_array:
        """See `SheetTerm`."""
        u0, u1, old = (self._split(q)[0] for q in (q0, q1, before))

        def bars() -> sparse.csr_array:
            return 2.0 * self._bars.mean_tangent(u0, u1, np.zeros(0), old, again)

        return 0.5 * self._assembled(0.5 * (q0 + q1), self._floor, bars)

    @property
    def _floor(self) -> float:
        """Least slope of the folds in Newton steps; slopes of a user's law may fall on purpose."""
        return -np.inf if (self.model.code < 0).any() else STEP_FLOOR

    def _assembled(
        self, q: NDArray, floor: float, bars: Callable[[], sparse.csr_array]
    ) -> sparse.csr_array:
        pattern = self.sparsity
        data = np.zeros(len(pattern.indices))
        if len(self.model.bars.bar_runs):
            data[pattern.bars] = bars().data
        add_plates_tangent(self.model, pattern, *self._split(q), floor, data)
        return sparse.csr_array((data, pattern.indices, pattern.indptr), (self.size, self.size))

    def blocks(self) -> SparseBlocks:
        """See `SheetTerm`."""
        pattern = self.sparsity
        entries = (np.zeros(len(pattern.indices)), pattern.indices, pattern.indptr)
        matrix = sparse.csr_array(entries, (self.size, self.size))
        return SparseBlocks(matrix, self.rows, positions(self.model))

    def scratches(self, threads: int) -> list[PlatesScratch]:
        """See `SheetTerm`."""
        return [plates_scratch(self.model)]

    def compiled(self, part: Any, kept: PlatesScratch, group: int) -> CompiledTerm:
        """See `Term`."""
        return plates_kernels(self.model, kept, self.rows, self._groups)

    def arrays(self) -> Arrays:
        """See `Term`."""
        return arrays_of(self.model, "addresses")

    def pulled(self) -> Pulled:
        """See `Term`."""
        return plates_pulled(self.model)

    @property
    def hinges(self) -> NDArray:
        """See `SheetTerm`."""
        rows, wings = self.model.hinges.copy(), len(self.model.wings)
        rows[len(rows) - wings :, 3] = RIDES
        return rows

    @property
    def folds(self) -> Folds:
        """See `SheetTerm`."""
        return Folds(self.model.fold_rest, self.model.fold_parameters, self.model.fold_stiffness)

    # ------------------------------------------------------------------ measures
    def angles(self, q: NDArray) -> NDArray:
        """See `SheetTerm`."""
        model, x = self.model, self.model.bars.rest + self._split(q)[0]
        rows, first = model.hinges.astype(np.uint32), len(model.hinges) - len(model.wings)
        rows[first:, 3] = len(x) + np.arange(len(model.wings))
        x = np.concatenate([x, x[model.hinges[first:, :2]].mean(axis=1) + model.wings])
        return mechanics.angles(x, rows)

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `SheetTerm`: turns of the clamped edges."""
        model, first = self.model, len(self.model.hinges) - len(self.model.wings)
        if not len(model.wings):
            return super().holds(q)
        turns = turned_plates(model, self._split(q)[0]).gradient[first:]
        turns[:, :3] += turns[:, 9:]  # the first end takes the place of the wing
        return unit_rows(model.hinges[first:, :3], turns[:, :9], self.size)

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn of a hinge, or of a bar relative to the other bars; inf on penetration."""
        bars = self._bars.turn(q[: self._nodal], other[: self._nodal])
        return largest_turn(bars, self.angles(q), self.angles(other))

    def plate_angles(self, q: NDArray) -> NDArray[np.float64]:
        """Angles (nq,), rad, of all plates, from rest."""
        model, (displacement, rotation) = self.model, self._split(q)
        scratch = turned_plates(model, displacement, rotation)
        from_rest = scratch.angle
        from_rest[len(model.fold_rest) :] -= model.bend_rest
        turned = np.append(from_rest, (self.per_hidden * scratch.x)[::-1])  # number -1 comes last
        return turned[model.angle]

    def plate_energies(self, q: NDArray, turn: NDArray) -> NDArray:
        """See `SheetTerm`."""
        model, angle = self.model, self.plate_angles(q)
        size, angle = np.diff(model.start), angle - turn if turn.size else angle
        plate = np.repeat(np.arange(len(size)), size**2)
        row, column = np.divmod(np.arange(len(plate)) - model.entry[plate], size[plate])
        first = model.start[plate]
        energy = 0.5 * model.stiffness * angle[first + row] * angle[first + column]
        return np.bincount(plate, energy, len(size))

    def scale(self) -> NDArray:
        """EA of the bars, summed at nodes; for rotations, the largest stiffness of any plate."""
        turning = self.model.per_reach * np.abs(self.model.stiffness).max(initial=0.0)
        return np.concatenate([self._bars.scale(), np.full(len(self.hidden), turning)])

    def turning_moments(self) -> float:
        """See `SheetTerm`."""
        return float(self.model.fold_stiffness.sum() + np.abs(self.model.stiffness).sum())

    def longest(self) -> float:
        """See `SheetTerm`."""
        return self._bars.longest()

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """No hinges: the superlinear law is refused; see `SheetTerm`."""
        if (self.model.code == Superlinear.code).any():
            raise InputError(
                f' = "superlinear": {self._no_slope} frequency responses take "linear" or '
                '"enhanced"',
                "fold_law",
            )
        return super().soft_hinges(q)

    # ------------------------------------------------------------------ rest angles
    @property
    def rest_angles(self) -> NDArray:
        """See `SheetTerm`: rest angles of the folds, then of the bends."""
        return np.concatenate([self.model.fold_rest, self.model.bend_rest])

    def rest_law(self, number: int) -> HingeLaw:
        """See `SheetTerm`."""
        return self.laws[1] if number >= len(self.model.fold_rest) else self.laws[0].at([number])

    def fold_hinges(self) -> FoldHinges:
        """See `SheetTerm`: one hinge per fold."""
        nodes = self.model.hinges[: len(self.model.fold_rest)]
        turns, per_hidden = self.model.fold_rotations, self.model.per_reach * self.model.fold_ways
        if len(self.model.unmoved):  # one dof is the turn of the fold
            first = np.where(turns[:, 0] >= 0, turns[:, 0], turns[:, 1])
            turns, per_hidden = np.stack([first, first], axis=1), -0.5 * per_hidden
        hidden = np.where(turns >= 0, self._nodal + turns, NO_DOF)
        return FoldHinges(
            np.arange(len(nodes)), nodes, self.model.bars.rest[nodes], hidden, per_hidden,
            self.model.fold_rest, self.model.fold_stiffness, np.zeros(len(nodes)),
            np.arange(len(nodes)),
        )  # fmt: skip

    def folded(self, rest: NDArray) -> Self:
        """See `SheetTerm`."""
        folds = np.array(rest[: len(self.model.fold_rest)], float)
        parameters, law = self.model.fold_parameters, self.laws[0]
        if law.follows_rest:
            parameters = law.parameters(folds).reshape(-1, 4)
        bends = np.array(rest[len(folds) :], float)
        return self._with(fold_rest=folds, fold_parameters=parameters, bend_rest=bends)

    def actuated(self, numbers: NDArray) -> tuple[Self, NDArray, NDArray]:
        """See `SheetTerm`."""
        rest, parameters = self.model.fold_rest.copy(), self.model.fold_parameters.copy()
        own = self._with(fold_rest=rest, fold_parameters=parameters)
        return own, np.asarray(numbers), np.arange(len(numbers))

    def turned(self) -> tuple[NDArray, NDArray]:
        """See `SheetTerm`."""
        return self.model.fold_rest, np.arange(len(self.model.fold_rest))

    # ------------------------------------------------------------------ other bodies
    def hinges_alone(self) -> Self:
        """See `SheetTerm`."""
        return self._with(bars=self._bars.hinges_alone().model)

    def anchored(self, place: NDArray) -> Self:
        """See `Term`; a plate lies at the nodes of its bends and at the ends of its edges."""
        model, place = self.model, place[: self._nodal]
        edges = place[::3][model.hinges[model.rotation_hinge, :2]].min(axis=1)
        # number -1 comes last
        lowest = np.append(place[::3][model.hinges].min(axis=1), edges[::-1])
        own = (lowest[model.angle[a:b]] for a, b in pairwise(model.start))
        plates = np.array([numbers.min(initial=1) for numbers in own])
        return self._with(
            bars=self._bars.anchored(place).model,
            fold_stiffness=model.fold_stiffness * (lowest[: len(model.fold_rest)] == 0),
            stiffness=model.stiffness * np.repeat(plates == 0, np.diff(model.entry)),
        )

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """See `SheetTerm`."""
        model, bars = self.model, self._bars.unstrained_model(q[: self._nodal])
        folds, bends = np.split(self.angles(q), [len(model.fold_rest)])
        code = np.full_like(model.code, LinearHinge.code)
        sheet = self._with(bars=bars, fold_rest=folds, bend_rest=bends, code=code)
        rest = np.zeros(self.size)
        tangent, turned = sheet.tangent(rest), sheet.hinges_alone().tangent(rest)
        return Unstrained(tangent, turned, lambda motion: stretch(bars, motion[: self._nodal]))


class ClampsTerm(BarsPlatesTerm):
    """Clamped edges of bars and hinges, as plates of one angle each; see `Term`.

    A model of these alone, which adds to a sheet. Their energy is that of bends.
    """

    energy_groups: ClassVar = {}
    of_hinges = True
    shared = False
    tangent = Term.tangent

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`; the clamps' dihedrals are last among those of the thread."""
        place = len(part.angle) - len(self.model.hinges)
        scratch = plates_scratch(self.model)._replace(angle=part.angle[place:])
        return plates_kernels(self.model, scratch, self.rows, self._groups, place)

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`."""
        indptr, indices = self.sparsity[:2]
        return np.repeat(np.arange(self.size), np.diff(indptr)), indices

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """See `Term`."""
        return super().tangent(np.ravel(q), floor).data

    def unstrained(self, q: NDArray) -> Unstrained:
        """See `Term`."""
        tangent = self.nominal(q).tangent(q)
        return Unstrained(tangent, tangent, lambda motion: 0.0)

    def strains(self, others: Strains) -> Strains:
        """See `Term`; a wing repeats the first node of the axis (`viscous.hinge_gradient`)."""
        rest, nodes = self.model.bars.rest, self.model.hinges
        corners = rest[nodes]
        corners[:, 3] = rest[nodes[:, :2]].mean(axis=1) + self.model.wings
        return others._replace(
            hinges=np.concatenate([others.hinges, nodes]),
            corners=np.concatenate([others.corners, corners]),
            hinge_stiffness=np.concatenate([others.hinge_stiffness, self.model.stiffness]),
        )

    def placed(self, order: NDArray, before: Any) -> ClampsTerm:
        """See `Term`."""
        bars = self.model.bars._replace(rest=self.model.bars.rest[order])
        hinges = ranks(order)[self.model.hinges]
        return ClampsTerm(self.model._replace(bars=bars, hinges=hinges), self.laws)

    def nominal(self, q: NDArray) -> ClampsTerm:
        """See `Term`."""
        return self._with(bend_rest=self.angles(q))


def positions(model: BarsPlates) -> NDArray:
    """Positions (3 rows, 3) of the dofs, m; a rotation is at the middle of its edge."""
    points = np.zeros((3 * model.rows, 3))
    n = model.nodes
    points[: 3 * n] = np.repeat(model.bars.rest, 3, axis=0)
    points[3 * n : 3 * n + model.rotations] = model.bars.rest[
        model.hinges[model.rotation_hinge, :2]
    ].mean(axis=1)
    return points


def balanced(matrix: sparse.csr_array, hidden: NDArray) -> sparse.csr_array:
    """Tangent (3n, 3n) for displacements; the last dofs, listed in `hidden`, are in balance."""
    if not len(hidden):
        return matrix
    first = hidden[0]
    across = sparse.csc_array(matrix[first:, :first])
    given = sparse.csc_array(splu(sparse.csc_array(matrix[first:, first:])).solve(across.toarray()))
    return sparse.csr_array(matrix[:first, :first] - across.T @ given)
