"""Creases with memory between edge angles in balance, for explicit motions of n5b8e models.

The moment of a crease branch depends on the turn of the crease itself, which is solved together
with the adjacent edge angles: their balance calls the branches, by address, in every iteration
(`mechanics.plates_condensed`). Otherwise the branches are the same as in `mechanics.inelastic`.

The rate of a crease does not follow from velocities alone. At the end of a step h in which the
crease turns by d, it is taken as (3 d / h - r) / 2, with r the rate at the start: a parabola would
give 2 d / h - r, which never damps an error of r.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import addressed
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.materials.crease_damper import CODE as DAMPER
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.inelastic import HingeMemory, MemoryHinges, evaluate_branches, make_last
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.term import ADDRESS, FORCES, CompiledTerm, forces
from foldyn.mechanics.viscous import hinge_gradient

ROUNDS = 200  # maximum iterations for the turns of creases in a given state
FOUND = 1e-14  # rad: iterations end at smaller changes of these turns


class _Branches(NamedTuple):
    own: MemoryHinges
    offset: NDArray
    folds: int


@addressed(ADDRESS, ADDRESS)
def _evaluate(term, angle, out):
    """Put moments and slopes of the branches at the folds' angles (nf,) into out (nf, 2)."""
    own, folds, lost = term.own, term.folds, 0.0
    turned, found = numbers_at(angle, folds), numbers_at(out, 2 * folds)
    for k in range(2 * folds):
        found[k] = 0.0
    for e in range(own.rest.size):
        lost += evaluate_branches(own, term.offset, e, turned[own.row[e]] - own.rest[e])
        found[2 * own.row[e]] += own.moment[e]
        found[2 * own.row[e] + 1] += own.slope[e]
    own.lost[1] = lost


@forces
def _forces(term, u, v, t, force, powers):
    """Add the nodal forces of the branches, which the balance has evaluated."""
    own, moved, out = term.own, flat(rows_at(u, term.rows)), flat(rows_at(force, term.rows))
    h, g = own.elapsed[0], own.gradient
    for e in range(own.rest.size):
        hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, g)
        for c in range(12):
            out[own.dofs[e, c]] += own.moment[e] * g[c]
        if h > 0.0:
            own.rate[e, 1] = 1.5 * (own.turned[e] - own.angle[e]) / h - 0.5 * own.rate[e, 0]
    if h == 0.0:  # loads may have jumped, and dampers' rates with them
        for k in range(own.code.size):
            if own.code[k] == DAMPER:
                own.state[k, 0] = own.reached[k, 0]


def evaluation(own: MemoryHinges, offset: NDArray, folds: int) -> tuple[Context, NDArray]:
    """Context to keep, and `CondensedPlates.memory`, for evaluating the branches of folds."""
    held = Context(_Branches(own, offset, folds))
    return held, np.array([_evaluate.at(held), held.address], np.int64)


class BalancedMemory(HingeMemory):
    """Branches of folds between edge angles in balance; see `HingeMemory`.

    Parameters
    ----------
    own, settles
        See `HingeMemory`.
    sheet : SheetTerm
        The sheet whose balance evaluates the branches.
    """

    def __init__(self, own: MemoryHinges, settles: NDArray, sheet: SheetTerm) -> None:
        super().__init__(own, settles, sheet)
        self._sheet = sheet

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        found = super().compiled(part, kept, group)
        return CompiledTerm(found.context, {**found.kernels, FORCES: _forces})

    def start(self, q: NDArray, state: NDArray | str | None = None) -> None:
        """Start like `HingeMemory.start`; in a given state, creases turn until they balance."""
        own, sheet = self.own, Assembly(self._sheet)
        for array in (own.angle, own.state, own.rate, own.elapsed, own.lost):
            array[:] = 0.0
        on = own.parameters[:, 0].copy()
        if state is None:
            own.parameters[self.settles, 0] = 0.0
        sheet.internal(q)  # turned instantly from rest
        own.parameters[:, 0] = on
        make_last(own)
        if isinstance(state, np.ndarray):
            own.state[:] = state
            damper = np.flatnonzero(own.code == DAMPER)
            own.angle[np.searchsorted(own.first, damper, "right") - 1] = state[damper, 1]
        elif state is None:
            own.state[self.settles] = 0.0
        for _ in range(ROUNDS):
            sheet.internal(q)
            moved = np.abs(own.turned - own.angle).max(initial=0.0)
            own.angle[:] = own.turned
            if moved <= FOUND:
                break
        own.lost[:] = 0.0
        self._offset[:, 3] = np.nan  # a motion begins now
