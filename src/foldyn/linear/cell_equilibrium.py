"""Equilibria of a repeated sheet whose periods are given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import State
from foldyn.errors import ComputationError, InputError
from foldyn.linear.cell_patch import cell_patch
from foldyn.linear.cell_reach import CellReach
from foldyn.linear.linearized_cell import deformed_motions, folded_body, spread
from foldyn.linear.unit_cell import UnitCell, images
from foldyn.patterns.screw import Screw, translation
from foldyn.statics.tracing import displacement_of
from foldyn.values import number, numbers, of_kind, whole

ITERATIONS = 40
BALANCED = 1e-12  # of the bars' EA: the largest force left
HALVINGS = 12
NULL = 1e-11  # of the largest stiffness: motions that nothing resists


def relaxed(
    cell: UnitCell,
    vectors: Any = None,
    screw: Screw | None = None,
    state: State | None = None,
    load_factor: float = 1.0,
    steps: int = 4,
) -> State:
    """Equilibrium of a repeated sheet with given periods: a state that repeats.

    Copies of the cell move as the periods say; everything else is free but for supports. Newton's
    method, from an even deformation of the cell, in steps of the periods.

    Parameters
    ----------
    cell : UnitCell
    vectors : array_like, shape (d, 3), optional
        Translations (m) from a cell to the next in the state, for those motions of the cell that are
        translations; those at rest by default.
    screw : Screw, optional
        The screw from a cell to the next in the state, about the same axis as that at rest.
    state : State, optional
        From where the search begins, if it repeats; its periods are kept where none are given.
    load_factor : float
        How far actuated folds are folded.
    steps : int
        Of the way from the rest state, or from the state given.

    Returns
    -------
    State
        Displacements (m) of the cell's own nodes.

    Raises
    ------
    InputError
        Periods that do not fit the cell.
    ComputationError
        No equilibrium is found.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> pulled = fd.linear.relaxed(cell, vectors=1.01 * cell.vectors)
    >>> fd.bands(cell, [[0.5, 0.5]], count=1, state=pulled).vectors.round(5).tolist()
    [[0.03967, 0.0, 0.0], [0.0, 0.04008, 0.0]]
    """
    of_kind("cell", cell, UnitCell)
    patch = cell_patch(cell)
    steps, load_factor = whole("steps", steps, least=1), number("load_factor", load_factor)
    rest = cell.case.structure.nodes
    place, begin = rest, cell.motions
    if state is not None:
        displacement = displacement_of(of_kind("state", state, State), cell.case, "state")
        place, begin = rest + displacement, deformed_motions(cell, patch, displacement)
    end = _given(cell, begin, vectors, screw)
    first = np.array([images(begin, place[v], -patch.own_step[v]) for v in patch.first.tolist()])
    first, now = first.reshape(-1, 3), begin
    for k in range(1, steps + 1):
        then = tuple(_between(one, two, k / steps) for one, two in zip(begin, end, strict=True))
        first = _carried(first, now, then)
        factor = load_factor if state is not None else load_factor * k / steps
        reach = CellReach(patch, then, folded_body(cell, patch, factor))
        first, now = _newton(reach, patch, then, first), then
    moved = spread(end, first, patch.own_unit, patch.own_step) - rest
    return State(displacement=moved)


def _given(
    cell: UnitCell, begin: Sequence[Screw], vectors: Any, screw: Screw | None
) -> tuple[Screw, ...]:
    """The motions at the end."""
    ways = [k for k, motion in enumerate(cell.motions) if not motion.turns]
    turns = [k for k, motion in enumerate(cell.motions) if motion.turns]
    end = list(begin)
    if vectors is not None:
        array = np.atleast_2d(numbers("vectors", vectors))
        if array.shape != (len(ways), 3):
            raise InputError(
                f": shape {array.shape}; give a vector (m) for each of the {len(ways)} translations "
                "of the cell",
                "vectors",
            )
        for k, vector in zip(ways, array, strict=True):
            end[k] = translation(vector)
    if screw is not None:
        of_kind("screw", screw, Screw)
        if len(turns) != 1:
            raise InputError(f": the cell has {len(turns)} screws that could change", "screw")
        own = begin[turns[0]]
        gap = np.array(screw.point) - np.array(own.point)
        along = float(own.unit @ screw.unit)
        off = np.linalg.norm(gap - (gap @ own.unit) * own.unit)
        if abs(along - 1.0) > 1e-9 or off > cell.near:
            raise InputError(
                ": must turn about the axis of the cell's own screw, in the same sense", "screw"
            )
        end[turns[0]] = replace(own, angle=screw.angle, shift=screw.shift)
    return tuple(end)


def _between(one: Screw, two: Screw, share: float) -> Screw:
    """A motion on the way from one to another."""
    if share == 1.0:
        return two
    if not one.turns:
        return translation((1.0 - share) * one.vector + share * two.vector)
    return replace(
        one,
        angle=(1.0 - share) * one.angle + share * two.angle,
        shift=(1.0 - share) * one.shift + share * two.shift,
    )


def _carried(points: NDArray, one: Sequence[Screw], two: Sequence[Screw]) -> NDArray[np.float64]:
    """Points (m, 3) as an even deformation takes them along from motions to others."""
    out = points
    ways = [(a.vector, b.vector) for a, b in zip(one, two, strict=True) if not a.turns]
    if ways:
        before, after = (np.array(each) for each in zip(*ways, strict=True))
        out = out + out @ np.linalg.pinv(before) @ (after - before)
    for a, b in zip(one, two, strict=True):
        if a.turns and a.shift != 0.0:
            place = (out - np.array(a.point)) @ a.unit / a.shift
            change = b.angle - a.angle, b.shift - a.shift
            out = np.array(
                [
                    _part(a, *(share * each for each in change)).images(point)
                    if any(change) and share != 0.0
                    else point
                    for point, share in zip(out, place, strict=True)
                ]
            )
    return out


def _part(motion: Screw, angle: float, shift: float) -> Screw:
    return replace(motion, angle=angle, shift=shift)


def _newton(
    reach: CellReach, patch: Any, motions: Sequence[Screw], first: NDArray
) -> NDArray[np.float64]:
    """Places (m, 3) of the nodes of cell 0 in equilibrium, from others."""
    rest, moves = patch.case.structure.nodes, reach.moves
    free, enough = ~reach.hidden, BALANCED * float(reach.body.scale().max())
    ones = np.ones(len(reach.steps))

    def dofs(points: NDArray) -> NDArray:
        return reach.balanced(spread(motions, points, patch.unit, patch.step) - rest)

    q = dofs(first)
    left = reach.projected(reach.forces(q))
    for _ in range(ITERATIONS):
        if np.abs(left).max(initial=0.0) <= enough:
            return first
        stiffness = moves.T @ reach.hops(reach.body.step_tangent(q)).at(ones) @ moves
        values, shapes = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        kept = np.abs(values) > NULL * np.abs(values).max()
        push = shapes[:, kept].T @ left
        step = -moves @ (shapes[:, kept] @ (push / np.abs(values[kept])))
        step = step[free].reshape(-1, 3)
        for halving in range(HALVINGS):
            trial = first + 0.5**halving * step
            try:
                q_new = dofs(trial)
            except ComputationError:
                continue
            new = reach.projected(reach.forces(q_new))
            if np.linalg.norm(new) < np.linalg.norm(left) or np.abs(new).max() <= enough:
                break
        else:
            break
        first, q, left = trial, q_new, new
    raise ComputationError(
        f"no equilibrium with these periods: {np.abs(left).max():.2g} N are left; take more steps, "
        "or periods nearer to those at rest"
    )
