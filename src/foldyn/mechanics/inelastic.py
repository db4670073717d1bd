"""Hinges with memory: the branches of their laws, whose forces add to the elastic parts.

The branches store the state at the last accepted step. Every evaluation computes a trial state from
the stored state, from the dihedrals at that step and now, and from the elapsed time; only `commit`
accepts the trial state. A step that is rejected or repeated leaves no trace.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.materials.branch_switch import mean_moment, update
from foldyn.materials.latching import CODE as LATCH
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.discrete_gradient import discrete_gradient
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.term import (
    ADVANCE_CLOCK,
    BRANCH_STATES,
    COMMIT,
    DISSIPATED,
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    STEP_ERROR,
    CompiledTerm,
    Term,
    Way,
    advance_clock,
    branch_states,
    commit,
    dissipated,
    energies,
    forces,
    in_rows,
    mean_forces,
    step_error,
)
from foldyn.mechanics.viscous import WIDTH, coupled, hinge_gradient


class MemoryHinges(NamedTuple):
    """Arrays of h hinges with b branches in all; dofs are 3 row + column of arrays (rows, 3).

    Fields from `angle` on change in place. Angles are turns from the rest angle, including the
    offset (`SheetTerm.series`).
    """

    dofs: NDArray  # (h, 14), see `viscous.hinge_gradient`
    corners: NDArray  # (h, 4, 3) m
    hidden_turn: NDArray  # (h, 2) rad/m
    rest: NDArray  # (h,) rad
    row: NDArray  # (h,) int64: row of the offsets
    stiffness: NDArray  # (h,) N m/rad
    group: NDArray  # (h,) int64: energy group of the model
    first: NDArray  # (h + 1,) int64: hinge e has the branches first[e] to first[e + 1] - 1
    code: NDArray  # (b,) int64
    parameters: NDArray  # (b, 4)
    arm: NDArray  # (h,) m: displacement of the wings per rad
    angle: NDArray  # (h,) at the last accepted step, rad
    state: NDArray  # (b, 2) at the last accepted step
    turned: NDArray  # (h,) at the last evaluation, rad
    rate: NDArray  # (h, 2) at the last accepted step and at the last evaluation, rad/s
    reached: NDArray  # (b, 2) state at the last evaluation
    moment: NDArray  # (h,) of the branches at the last evaluation, N m
    slope: NDArray  # (h,) derivative of the moment with respect to the angle, N m/rad
    mean: NDArray  # (h, 2) mean moment from the last accepted step to the last evaluation; slope
    stored: NDArray  # (h,) energy of the branches, J
    lost: NDArray  # (2,) energy dissipated up to the last accepted step, and since, J
    elapsed: NDArray  # (1,) time since the last accepted step, s
    gradient: NDArray  # (14,) scratch of one hinge


@inner_scalar
def evaluate_branches(own, offset, e, turn):
    """Evaluate the branches of a hinge at a turn (rad); returns the dissipated energy, J."""
    moment, slope, stored, lost = 0.0, 0.0, 0.0, 0.0
    turn += offset[own.row[e], 0]
    for k in range(own.first[e], own.first[e + 1]):
        found = update(
            own.code[k], own.parameters[k], own.angle[e], turn, own.elapsed[0], own.state[k, 0],
            own.state[k, 1],
        )  # fmt: skip
        own.reached[k, 0], own.reached[k, 1] = found[0], found[1]
        moment += found[2]
        slope += found[3]
        stored += found[4]
        lost += found[5]
    own.turned[e] = turn
    offset[own.row[e], 1] += own.stiffness[e] * moment - own.moment[e]  # other laws add to it
    own.moment[e], own.slope[e] = own.stiffness[e] * moment, own.stiffness[e] * slope
    own.stored[e] = own.stiffness[e] * stored
    return own.stiffness[e] * lost


@inner
def _mean_gradient(own, e, start, end, turn, motion, points, gradient):
    """`discrete_gradient` (4, 3) of a hinge with a turn; motion, points : (2, 4, 3) scratch.

    points : outputs, positions A x and the gradient of the dihedral there.
    """
    dofs = own.dofs[e]
    for v in range(4):
        for c in range(3):
            before, after = start[dofs[3 * v + c]], end[dofs[3 * v + c]]
            motion[0, v, c] = own.corners[e, v, c] + 0.5 * (before + after)
            motion[1, v, c] = after - before
    for c in range(2):
        turn += own.hidden_turn[e, c] * (end[dofs[12 + c]] - start[dofs[12 + c]])
    discrete_gradient(motion[0], motion[1], turn, points[0], points[1], gradient)


@kernel
def evaluate_at(own, offset, u):
    """Evaluate the branches at u (rows, 3)."""
    moved, lost = flat(u), 0.0
    for e in range(own.rest.size):
        x, dofs = own.corners[e], own.dofs[e]
        angle = hinge_gradient(x, dofs, own.hidden_turn[e], moved, own.gradient)
        lost += evaluate_branches(own, offset, e, angle - own.rest[e])
    own.lost[1] = lost


@kernel
def make_last(own):
    """Accept the last evaluation as a step."""
    own.angle[:] = own.turned
    own.state[:] = own.reached
    own.rate[:, 0] = own.rate[:, 1]
    own.lost[0] += own.lost[1]
    own.lost[1] = 0.0
    own.elapsed[0] = 0.0


@kernel
def memory_tangents(own, u, out):
    """Derivatives (h, 14, 14) of the branch forces at u, after their evaluation there."""
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    moved, g = flat(u), own.gradient
    for e in range(own.rest.size):
        hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, g)
        for v in range(4):
            for c in range(3):
                points[v, c] = own.corners[e, v, c] + moved[own.dofs[e, 3 * v + c]]
                gradient[v, c] = g[3 * v + c]
        block[:] = 0.0
        add_hessian(points, gradient, own.moment[e], block)
        for i in range(14):
            for j in range(14):
                out[e, i, j] = own.slope[e] * g[i] * g[j]
                if i < 12 and j < 12:
                    out[e, i, j] += block[i // 3, i % 3, j // 3, j % 3]


@kernel
def mean_memory_tangents(own, floor, u0, u1, out):
    """Derivatives (h, 14, 14) with respect to u1 of the known mean forces from u0 to u1.

    floor : least slope of the mean moments per unit stiffness.
    """
    motion, points = np.empty((2, 4, 3)), np.empty((2, 4, 3))
    gradient, block, across = np.empty((4, 3)), np.empty((4, 3, 4, 3)), np.empty(14)
    start, end, g = flat(u0), flat(u1), own.gradient
    for e in range(own.rest.size):
        x, dofs, hidden = own.corners[e], own.dofs[e], own.hidden_turn[e]
        before = hinge_gradient(x, dofs, hidden, start, g)
        turn = hinge_gradient(x, dofs, hidden, end, g) - before
        _mean_gradient(own, e, start, end, turn, motion, points, gradient)
        for c in range(14):
            across[c] = gradient[c // 3, c % 3] if c < 12 else -hidden[c - 12]
        slope = max(own.mean[e, 1], floor * own.stiffness[e])
        block[:] = 0.0
        add_hessian(points[0], points[1], 0.5 * own.mean[e, 0], block)
        for i in range(14):
            for j in range(14):
                out[e, i, j] = slope * across[i] * g[j]
                if i < 12 and j < 12:
                    out[e, i, j] += block[i // 3, i % 3, j // 3, j % 3]


@kernel
def memory_gradients(own, u, out):
    """Gradients (h, 14) of the hinge angles at u."""
    moved = flat(u)
    for e in range(own.rest.size):
        hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, out[e])


class _Context(NamedTuple):
    own: MemoryHinges
    offset: NDArray
    rows: int
    groups: int  # number of energy groups


@forces
def _forces(term, u, v, t, force, powers):
    own, g, lost = term.own, term.own.gradient, 0.0
    moved, speed = flat(rows_at(u, term.rows)), flat(rows_at(v, term.rows))
    out = flat(rows_at(force, term.rows))
    for e in range(own.rest.size):
        angle, rate = hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, g), 0.0
        lost += evaluate_branches(own, term.offset, e, angle - own.rest[e])
        for c in range(14):
            out[own.dofs[e, c]] += own.moment[e] * g[c]
            rate += speed[own.dofs[e, c]] * g[c]
        own.rate[e, 1] = rate
    own.lost[1] = lost
    if own.elapsed[0] == 0.0:
        own.rate[:, 0] = own.rate[:, 1]


@energies
def _energies(term, u, out):
    own, energy = term.own, numbers_at(out, term.groups)
    for e in range(own.rest.size):  # from the last evaluation, which was at u
        energy[own.group[e]] += own.stored[e]


@mean_forces
def _mean_forces(term, u0, u1, before, h, t, force, powers):
    """Forces that do the work that branches store and dissipate; offsets have their end values."""
    own, g, work, lost, lacking = term.own, term.own.gradient, 0.0, 0.0, 0.0
    start, end = flat(rows_at(u0, term.rows)), flat(rows_at(u1, term.rows))
    out, both = flat(rows_at(force, term.rows)), numbers_at(powers, 2)
    one, other, gradient = np.empty((2, 4, 3)), np.empty((2, 4, 3)), np.empty((4, 3))
    own.elapsed[0] = h
    for e in range(own.rest.size):
        x, dofs, hidden = own.corners[e], own.dofs[e], own.hidden_turn[e]
        begin = hinge_gradient(x, dofs, hidden, start, g)
        after = hinge_gradient(x, dofs, hidden, end, g)
        lost += evaluate_branches(own, term.offset, e, after - own.rest[e])
        own.mean[e] = 0.0
        for k in range(own.first[e], own.first[e + 1]):
            found = mean_moment(
                own.code[k], own.parameters[k], own.angle[e], own.turned[e], h, own.state[k, 0],
                own.state[k, 1],
            )  # fmt: skip
            own.mean[e, 0] += own.stiffness[e] * found[0]
            own.mean[e, 1] += own.stiffness[e] * found[1]
            lacking += own.stiffness[e] * found[2]  # dissipation that is not work of the moments
        moment = own.mean[e, 0]
        _mean_gradient(own, e, start, end, after - begin, one, other, gradient)
        for c in range(12):
            out[dofs[c]] += moment * gradient[c // 3, c % 3]
        for c in range(2):
            out[dofs[12 + c]] -= moment * hidden[c]
        work += moment * (own.turned[e] - own.angle[e] - (after - begin))  # work of the offset
    own.lost[1] = lost
    both[0] += work / h
    both[1] -= lacking / h


@advance_clock
def _advance_clock(term, since):
    term.own.elapsed[0] = since


@commit
def _commit(term):
    make_last(term.own)


@dissipated
def _dissipated(term):
    own = term.own
    return own.lost[0] + own.lost[1]


@branch_states
def _branch_states(term, out):
    reached = flat(term.own.reached)
    to = numbers_at(out, reached.size)
    for k in range(reached.size):
        to[k] = reached[k]


@step_error
def _step_error(term, scale):
    """Error ratio of the last evaluation, because dihedrals do not change at constant rates.

    The reference path is a parabola with the rates of both ends, evaluated at its middle and
    turning point.
    """
    own = term.own
    h, wrong = own.elapsed[0], 0.0
    for e in range(own.rest.size):
        begin, turn = own.angle[e], own.turned[e] - own.angle[e]
        scale = max(scale, own.arm[e] * max(abs(begin), abs(own.turned[e])))
        first, last = h * own.rate[e, 0], h * own.rate[e, 1]
        back = first / (first - last) if first * last < 0.0 else 0.5
        moment = 0.0
        for k in range(own.first[e], own.first[e + 1]):
            part, before, one, other = 0.0, begin, own.state[k, 0], own.state[k, 1]
            for to in (min(0.5, back), max(0.5, back), 1.0):
                after = begin + to * (turn + 0.5 * (1.0 - to) * (first - last))
                found = update(
                    own.code[k], own.parameters[k], before, after, (to - part) * h, one, other
                )
                part, before, one, other = to, after, found[0], found[1]
                if to == 1.0:
                    moment += found[2]
        wrong = max(wrong, own.arm[e] * abs(moment - own.moment[e] / own.stiffness[e]))
    return wrong / scale


class HingeMemory(Term):
    """Branches of hinges, added to the elastic parts of their laws on a sheet; see `Term`.

    The state of the branches changes in place, and terms derived from this term share it.

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
        self.owns_hidden = bool((own.code == LATCH).any() and own.hidden_turn.any())

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
        """Whether branches resist a start in such a state like an instant turn."""
        return isinstance(state, str) or (state is None and not self.settles.all())

    def commit(self) -> None:
        """Accept the step that ends at the last evaluation."""
        make_last(self.own)

    def still(self) -> None:
        """Set the next evaluation to the time of the last accepted step."""
        self.own.elapsed[0] = 0.0

    def snapshot(self) -> tuple[NDArray, ...]:
        """Copy of the state at the last accepted step, for `recall`."""
        return tuple(array.copy() for array in self._kept)

    def recall(self, snapshot: Sequence[NDArray]) -> None:
        """Return to the state at an accepted step."""
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
        rates = sparse.csr_array((out.ravel(), (row, self.own.dofs.ravel())), (len(out), size))
        rates.eliminate_zeros()
        return rates

    # ------------------------------------------------------------------ as a term
    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`; the energy belongs to groups of the sheet."""
        own = Context(_Context(self.own, self._offset, self._rows, group))
        kernels = {
            FORCES: _forces, ENERGIES: _energies, ADVANCE_CLOCK: _advance_clock, COMMIT: _commit,
            DISSIPATED: _dissipated, BRANCH_STATES: _branch_states, STEP_ERROR: _step_error,
            MEAN_FORCES: _mean_forces,
        }  # fmt: skip
        return CompiledTerm(own, kernels)

    @cached_property
    def _coupled(self) -> tuple[NDArray, NDArray, NDArray]:
        mine = np.ones(self.own.dofs.shape, bool)
        mine[:, 12:] = self.own.hidden_turn != 0.0
        return coupled(self.own.dofs, mine)

    @property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's tangent entries; see `Term`."""
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
