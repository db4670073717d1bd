"""Equilibria of a repeated sheet with given periods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import State
from foldyn.errors import ComputationError, InputError
from foldyn.linear.cell_patch import cell_patch
from foldyn.linear.linearized_cell import (
    ROUNDING,
    CellReach,
    check_state,
    deformed_motions,
    folded_body,
    spread,
)
from foldyn.linear.unit_cell import UnitCell, check_commuting, images
from foldyn.patterns.screw import Screw, of_twist, translation
from foldyn.statics.tracing import displacement_of
from foldyn.values import listed, number, of_kind, vector, whole

ITERATIONS = 40
HALVINGS = 12
NULL = 1e-11  # stiffnesses below this, relative to the largest, count as zero
BY_STATE = (
    "poissons_ratio", "bending_poissons_ratio", "modulus", "bending_modulus", "shear_modulus",
    "twisting_modulus", "axial_stiffness", "torsional_stiffness", "bending_stiffness",
    "stretch_twist", "density", "mean_force", "mean_load",
)  # fmt: skip
"""Properties of cells that are drawn and listed by state."""


def relaxed(
    cell: UnitCell,
    motions: Sequence[Any] | None = None,
    *,
    state: State | None = None,
    load_factor: float = 1.0,
    steps: int = 4,
) -> State:
    """Equilibrium of a repeated sheet with given periods: a state that repeats.

    Copies of the cell follow the periods; all else is free except for supports. The periods change
    in steps; in each, Newton's method starts from a uniform deformation of the cell.

    Parameters
    ----------
    cell : UnitCell
    motions : sequence of Screw or array_like of shape (3,), optional
        For each motion of the cell, the motion from a cell to the next in the final state: a vector
        of translation (m), or a screw. A translation that becomes a rotation bends the sheet
        uniformly. By default the motions at rest, or in the given state.
    state : State, optional
        Periodic state from which the search starts.
    load_factor : float
        Load factor of actuated folds.
    steps : int
        Number of steps to the final motions.

    Returns
    -------
    State
        Displacements (m) of the nodes of the cell.

    Raises
    ------
    InputError
        Motions that do not fit the cell.
    ComputationError
        No equilibrium is found.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> pulled = fd.linear.relaxed(cell, 1.01 * cell.vectors)
    >>> fd.bands(cell, [[0.5, 0.5]], count=1, state=pulled).vectors.values.round(5).tolist()
    [[0.03967, 0.0, 0.0], [0.0, 0.04008, 0.0]]
    """
    check_state(of_kind("cell", cell, UnitCell))
    patch = cell_patch(cell)
    steps, load_factor = whole("steps", steps, least=1), number("load_factor", load_factor)
    rest = cell.case.structure.nodes
    place, now = rest, cell.motions
    if state is not None:
        displacement = displacement_of(of_kind("state", state, State), cell.case, "state")
        place, now = rest + displacement, deformed_motions(cell, patch, displacement)
    end = now if motions is None else _given(cell, motions)
    first = np.array([images(now, place[v], -patch.own_step[v]) for v in patch.first.tolist()])
    begin = np.array([motion.twist for motion in now])
    way = np.array([motion.twist for motion in end]) - begin
    for k in range(1, steps + 1):
        share = k / steps
        then = end if k == steps else tuple(map(of_twist, begin + share * way))
        first = _carried(first, now, then)
        factor = load_factor * (1.0 if state is not None else share)
        reach = CellReach(patch, then, folded_body(cell, patch, factor))
        first, now = _newton(reach, patch, then, first), then
    return State(displacement=spread(end, first, patch.own_unit, patch.own_step) - rest)


def _given(cell: UnitCell, motions: Any) -> tuple[Screw, ...]:
    """The final motions."""
    given = []
    for k, motion in enumerate(listed("motions", motions, "screws or vectors (m)")):
        if not isinstance(motion, Screw):
            motion = translation(vector(f"motions[{k}]", motion, nonzero=True))
        given.append(motion)
    if len(given) != cell.dimensions:
        raise InputError(f": {len(given)} of them; the cell has {cell.dimensions}", "motions")
    check_commuting(cell.case.structure.nodes, given, cell.near, "motions")
    return tuple(given)


def _carried(points: NDArray, one: Sequence[Screw], two: Sequence[Screw]) -> NDArray[np.float64]:
    """Points (m, 3) moved by the uniform deformation that takes motions `one` to `two`.

    Each point is moved back to cell 0 along motions `one`, by its position among the cells, and
    forward again along motions `two`.
    """
    shifts = np.array([motion.vector for motion in one])
    place = (points - points.mean(axis=0)) @ np.linalg.pinv(shifts)
    back, forth = (np.array([motion.twist for motion in each]) for each in (one, two))
    out = np.empty_like(points)
    for k, (point, share) in enumerate(zip(points, place, strict=True)):
        for twist in (-share @ back, share @ forth):
            point = of_twist(twist).images(point) if twist.any() else point
        out[k] = point
    return out


def _newton(
    reach: CellReach, patch: Any, motions: Sequence[Screw], first: NDArray
) -> NDArray[np.float64]:
    """Places (m, 3) of the nodes of cell 0 in equilibrium, starting from given places."""
    rest, moves = patch.case.structure.nodes, reach.moves
    free, enough = ~reach.hidden, ROUNDING * float(reach.body.scale().max())
    ones = np.ones(len(reach.steps))

    def dofs(points: NDArray) -> NDArray:
        return reach.balanced(spread(motions, points, patch.unit, patch.step) - rest)

    def better(first: NDArray, step: NDArray, left: NDArray) -> tuple[NDArray, ...] | None:
        """Places that are closer to equilibrium, along a step; their dofs; remaining forces."""
        for halving in range(HALVINGS):
            trial = first + 0.5**halving * step
            try:
                q = dofs(trial)
            except ComputationError:
                continue
            new = reach.projected(reach.forces(q))
            if np.linalg.norm(new) < np.linalg.norm(left):
                return trial, q, new
        return None

    q = dofs(first)
    left = reach.projected(reach.forces(q))
    done = False
    for _ in range(ITERATIONS):
        if done:
            return first
        done = np.abs(left).max(initial=0.0) <= enough  # one more step leaves only round-off
        stiffness = moves.T @ reach.hops(reach.body.step_tangent(q)).at(ones) @ moves
        values, shapes = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        kept = np.abs(values) > NULL * np.abs(values).max()
        push = shapes[:, kept].T @ left
        # downhill; if that fails, to the nearest equilibrium, even if it is unstable
        for slopes in (np.abs(values[kept]), values[kept]):
            step = (-moves @ (shapes[:, kept] @ (push / slopes)))[free].reshape(-1, 3)
            if found := better(first, step, left):
                break
        else:
            break
        first, q, left = found
    if done:
        return first
    raise ComputationError(
        f"no equilibrium with these periods: {np.abs(left).max():.2g} N are left; take more steps, "
        "or motions nearer to those at rest"
    )
