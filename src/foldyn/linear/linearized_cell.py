"""A cell of a repeated sheet linearized about a state that repeats.

The periods may change with the state: translations become others, screws get another angle and
shift. Displacements of all cells follow from those of one and from the motions of the deformed
sheet; dofs without mass are in balance as they are in the repeated sheet.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import State
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.modal_damping import mass_of
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.linear.bloch import Bloch, Hops, NotAlike, collected, hermitian, hops, steps_of
from foldyn.linear.cell_patch import Patch, cell_patch
from foldyn.linear.linearized import slope_change
from foldyn.linear.unit_cell import UnitCell, images, rotation
from foldyn.mechanics.assembly import Assembly
from foldyn.patterns.screw import Screw, motion_between
from foldyn.statics.tracing import displacement_of
from foldyn.values import number, of_kind

BALANCED = 1e-6  # of the forces at play: the largest residual of a state taken for an equilibrium
ITERATIONS = 30
STEP = 1e-13  # rad, of the last step of Newton's method for hidden dofs
PLACES = "None (the rest state), or a State, as fd.initial_state(path)"


@dataclass(frozen=True, eq=False)
class LinearizedCell:
    """Matrices of small motions of a repeated sheet about a state.

    Attributes
    ----------
    cell : UnitCell
    patch : Patch
    motions : tuple of Screw
        From a cell to the next in the state.
    bloch : Bloch
        Matrices of the dofs (3 node + axis, then hidden ones) of cell 0.
    displacement : (n, 3)
        The state at the nodes of the cell's own structure, m.
    force : (m,)
        What the sheet exerts on the dofs of cell 0 in the state, N.
    residual : float
        The largest of it on a node that is free, as a fraction of the forces at play.
    soft : int
        Hinges of the superlinear law in the patch that stand at their rest angle.
    """

    cell: UnitCell
    patch: Patch
    motions: tuple[Screw, ...]
    bloch: Bloch
    displacement: NDArray
    force: NDArray
    residual: float
    soft: int

    @property
    def nodes(self) -> int:
        """Nodes of cell 0."""
        return len(self.patch.first)

    @property
    def vectors(self) -> NDArray[np.float64]:
        """Shifts (d, 3) from a cell to the next in the state, m."""
        return np.array([motion.vector for motion in self.motions])

    def expanded(self, shapes: NDArray, phase: NDArray) -> NDArray[np.complex128]:
        """Shapes (k, n, 3) at the nodes of the cell's own structure, of those (m, k) of its dofs."""
        count, patch = shapes.shape[1], self.patch
        own = shapes[: 3 * self.nodes].T.reshape(count, self.nodes, 3)
        out = np.empty((count, len(patch.own_unit), 3), complex)
        for step in np.unique(patch.own_step, axis=0):
            rows = (patch.own_step == step).all(axis=1)
            turned = own[:, patch.own_unit[rows]] @ rotation(self.motions, step).T
            out[:, rows] = np.exp(1j * (step @ phase)) * turned
        return out


def linearize_cell(
    cell: UnitCell, state: State | None = None, secant: float | None = None,
    load_factor: float = 1.0,
) -> LinearizedCell:  # fmt: skip
    """Linearize a repeated sheet about a state.

    Parameters
    ----------
    cell : UnitCell
    state : State, optional
        Of the cell's own structure: the same displacements in all cells, but for the motions that
        bring a cell to the next; by default the rest state.
    secant, load_factor : float
        As in `linearize`.

    Raises
    ------
    InputError
        The state does not repeat: the message names nodes.

    Warns
    -----
    FoldynWarning
        The state is no equilibrium; hinges have no slope.
    """
    of_kind("cell", cell, UnitCell)
    amplitude = None
    if secant is not None:
        amplitude = math.radians(number("secant", secant, above=0.0, most=180.0, unit="degrees"))
    patch = cell_patch(cell)
    case, own = patch.case, np.zeros_like(cell.case.structure.nodes)
    if isinstance(state, str):
        raise InputError(f" = {state!r}: give {PLACES}", "state")
    if state is not None:
        own = displacement_of(state, cell.case, "state", PLACES)
        _check_loads(cell)
    motions = cell.motions if state is None else deformed_motions(cell, patch, own)
    displacement = own if state is None else _tiled(cell, patch, motions, own)
    body = case.elastic_body
    if state is not None:
        body = _folded(case, body, load_factor)
    reach = _Reach(patch, motions, body)
    q = reach.balanced(displacement if state is not None else np.zeros_like(case.structure.nodes))
    change, soft = slope_change(case, body, q, amplitude)
    tangent = body.tangent(q)
    _warn_of_soft(soft)
    stiffness = tangent if change is None else sparse.csr_array(tangent + change)
    mass = mass_of(case)
    damping = damping_matrix(case, q, True)
    if case.rayleigh.alpha or case.rayleigh.beta:
        reference = tangent
        if case.rayleigh.state == "rest" and state is not None and case.rayleigh.beta:
            rest = case.elastic_body
            reference = rest.tangent(rest.dofs(np.zeros_like(case.structure.nodes)))
        damping = damping + case.rayleigh.matrix(mass, reference)
    force = reach.frames.T @ body.internal(q)
    try:
        bloch = Bloch(
            steps=reach.steps,
            stiffness=hermitian(reach.hops(stiffness), reach.steps, "stiffness"),
            mass=hermitian(reach.hops(mass), reach.steps, "mass"),
            damping=hermitian(reach.hops(damping), reach.steps, "damping"),
            ties=reach.ties(case),
            hidden=np.arange(reach.count) >= 3 * len(patch.first),
            held=case.constraints.held[reach.rows[: 3 * len(patch.first)]],
        )
    except NotAlike as error:
        raise _naming(error, cell, patch) from None
    residual = _residual(bloch, force[reach.rows], body, q, state is None)
    if residual > BALANCED:
        warnings.warn(
            f"the state is no equilibrium of the repeated sheet: its residual is {residual:.2g} of "
            "the forces at play, and motions about it are not free vibrations; "
            "foldyn.linear.relaxed finds one with given periods",
            FoldynWarning,
            stacklevel=3,
        )
    return LinearizedCell(cell, patch, motions, bloch, own, force[reach.rows], residual, soft)


def deformed_motions(cell: UnitCell, patch: Patch, displacement: NDArray) -> tuple[Screw, ...]:
    """Motions from a cell to the next in a state (n, 3), m, of the cell's own structure.

    Raises
    ------
    InputError
        There are none.
    """
    place = cell.case.structure.nodes + displacement
    near = cell.tolerance * cell.case.structure.pattern.size
    found = []
    for k, motion in enumerate(cell.motions):
        pairs = _pairs(patch, k)
        if not len(pairs):
            raise InputError(
                f": no two nodes of the cell are partners under motion {k} alone, so that a state "
                "does not say what becomes of it",
                "state",
            )
        before = cell.case.structure.nodes[pairs]
        if not displacement.any():
            found.append(motion)
            continue
        moved, off = motion_between(place[pairs[:, 0]], place[pairs[:, 1]], near)
        still = np.abs(displacement[pairs[:, 1]] - displacement[pairs[:, 0]] @ motion.rotation().T)
        if still.max() <= near * 1e-3 and motion.turns:
            moved, off = motion, np.zeros(len(pairs))
        worst = int(off.argmax())
        if off[worst] > near:
            a, b = pairs[worst].tolist()
            kind = "screw motion" if motion.turns else "translation"
            raise InputError(
                f": does not repeat: no {kind} brings the nodes at one side of the cell to their "
                f"partners at the other; nodes {a} and {b} are off by {off[worst]:.2g} m "
                f"({int((off > near).sum())} of {len(off)} pairs are). A state of a cell whose "
                "sides are free does not repeat; see foldyn.linear.relaxed",
                "state",
            )
        del before
        found.append(moved)
    return tuple(found)


def _pairs(patch: Patch, k: int) -> NDArray[np.int64]:
    """Pairs (m, 2) of nodes of the cell's own structure of which motion k brings one to the other."""
    at = {}
    for node, (unit, step) in enumerate(
        zip(patch.own_unit.tolist(), map(tuple, patch.own_step.tolist()), strict=True)
    ):
        at[unit, step] = node
    pairs = []
    for (unit, step), node in at.items():
        after = tuple(x + (j == k) for j, x in enumerate(step))
        if (unit, after) in at:
            pairs.append((node, at[unit, after]))
    return np.array(pairs, np.int64).reshape(-1, 2)


def _tiled(
    cell: UnitCell, patch: Patch, motions: Sequence[Screw], displacement: NDArray
) -> NDArray[np.float64]:
    """Displacements (n, 3), m, of the patch from those of the cell's own structure.

    Raises
    ------
    InputError
        Partners are not where each other's copies are.
    """
    place = cell.case.structure.nodes + displacement
    near = cell.tolerance * cell.case.structure.pattern.size
    first = np.empty((len(patch.first), 3))
    for unit, node in enumerate(patch.first.tolist()):
        first[unit] = images(motions, place[node], -patch.own_step[node])
    for step in np.unique(patch.own_step, axis=0):
        rows = np.flatnonzero((patch.own_step == step).all(axis=1))
        off = np.linalg.norm(
            images(motions, first[patch.own_unit[rows]], step) - place[rows], axis=1
        )
        if off.max() > 10.0 * near:
            worst = rows[off.argmax()]
            raise InputError(
                f": does not repeat: node {worst} is {off.max():.2g} m from where the copy of node "
                f"{patch.first[patch.own_unit[worst]]} is",
                "state",
            )
    out = np.empty((len(patch.unit), 3))
    for step in np.unique(patch.step, axis=0):
        rows = np.flatnonzero((patch.step == step).all(axis=1))
        out[rows] = images(motions, first[patch.unit[rows]], step)
    return out - patch.case.structure.nodes


class _Reach:
    """Dofs of a patch as those of cell 0 and its neighbors."""

    def __init__(self, patch: Patch, motions: Sequence[Screw], body: Assembly) -> None:
        nodes, units = len(patch.unit), len(patch.first)
        axes = np.arange(3)
        unit = np.where(patch.unit[:, None] < 0, -1, 3 * patch.unit[:, None] + axes).ravel()
        hidden = np.where(patch.hidden_unit < 0, -1, 3 * units + patch.hidden_unit)
        self.patch, self.motions, self.body = patch, motions, body
        self.unit = np.concatenate([unit, hidden])
        self.count = 3 * units + patch.hidden
        offset = np.concatenate([np.repeat(patch.step, 3, axis=0), patch.hidden_step])
        self.steps, (self.number,) = steps_of([offset])
        own = np.flatnonzero((offset == 0).all(axis=1) & (self.unit >= 0))
        self.rows = own[np.argsort(self.unit[own], kind="stable")]
        turned = [rotation(motions, step) for step in self.steps]
        blocks = [turned[k] for k in self.number[: 3 * nodes : 3]]
        self.frames = sparse.csr_array(
            sparse.block_diag([sparse.block_diag(blocks), sparse.eye_array(len(hidden))])
            if len(hidden)
            else sparse.block_diag(blocks)
        )

    def hops(self, matrix: sparse.sparray) -> Hops:
        """A matrix (m, m) of the patch in the axes of the cells."""
        own = sparse.csr_array(self.frames.T @ matrix @ self.frames)
        return hops(own, self.rows, self.unit, self.number, self.count, len(self.steps))

    def balanced(self, displacement: NDArray) -> NDArray[np.float64]:
        """All dofs (m,), the hidden ones of all cells alike and in balance."""
        first = displacement.size
        hidden = np.zeros(self.patch.hidden)
        q = np.concatenate([displacement.ravel(), np.zeros(len(self.patch.hidden_unit))])
        if not len(hidden):
            return q
        own = self.rows[3 * len(self.patch.first) :]
        column = np.where(self.patch.hidden_unit < 0, 0, self.patch.hidden_unit)
        known = sparse.csr_array(
            ((self.patch.hidden_unit >= 0).astype(float), (np.arange(len(column)), column)),
            (len(column), len(hidden)),
        )
        for _ in range(ITERATIONS):
            q[first:] = known @ hidden
            couple = self.body.internal(q)[own]
            if not couple.any():
                return q
            block = (self.body.tangent(q)[own][:, first:] @ known).toarray()
            step = np.linalg.solve(block, -couple)
            hidden += step
            if self.body.sheet.per_hidden * np.abs(step).max() <= STEP:
                q[first:] = known @ hidden
                return q
        raise ComputationError("the rotations of the panels do not balance in this state")

    def ties(self, case: object) -> Hops:
        """Constraints of one cell (k, n)."""
        ties = case.constraints  # type: ignore[attr-defined]
        empty = np.zeros(0, np.int64)
        if not ties:
            none = sparse.csr_array((0, len(self.steps)))
            return Hops(empty, empty, none, (0, self.count))
        rows = sparse.csr_array(ties.rows)
        nodal = sparse.csr_array(self.frames[: rows.shape[1], : rows.shape[1]])
        turned = sparse.csr_array(rows @ nodal)
        turned.data[np.abs(turned.data) < 1e-14] = 0.0
        turned.eliminate_zeros()
        at = self.steps[self.number[: rows.shape[1]]]
        kept = [
            k
            for k in range(rows.shape[0])
            if tuple(
                min(map(tuple, at[rows.indices[rows.indptr[k] : rows.indptr[k + 1]]].tolist()))
            )
            == (0,) * self.steps.shape[1]
        ]
        own = sparse.coo_array(turned[kept])
        return collected(
            own.row, self.unit[own.col], self.number[own.col], own.data,
            (len(kept), self.count), len(self.steps),
        )  # fmt: skip


def _folded(case: object, body: Assembly, factor: float) -> Assembly:
    """The body with its actuated folds folded by a factor."""
    terms = case.rest_terms  # type: ignore[attr-defined]
    if not terms:
        return body
    change = sum(change for change, _ in terms)
    return body.folded(body.sheet.rest_angles + number("load_factor", factor) * change)


def _check_loads(cell: UnitCell) -> None:
    if cell.case.following_terms:
        raise InputError(
            ": has loads that depend on the displacement, as a pressure, whose stiffness a cell "
            "does not have; leave them out, or take the state without them",
            "loads",
        )


def _warn_of_soft(soft: int) -> None:
    if soft:
        warnings.warn(
            "hinges of the superlinear law stand at their rest angle, where their slope vanishes: "
            "they count without stiffness, and waves that only they resist have the frequency "
            "zero. Give secant = an amplitude in degrees, such as 1, or take preset = "
            '"plate" in place of this law',
            FoldynWarning,
            stacklevel=4,
        )


def _residual(bloch: Bloch, force: NDArray, body: Assembly, q: NDArray, at_rest: bool) -> float:
    """Largest force on a free dof as a fraction of the forces at play."""
    free = np.ones(len(force), bool)
    free[: len(bloch.held)] = ~bloch.held
    left = float(np.abs(force[free]).max(initial=0.0))
    at_play = float(np.abs(body.hinge_forces(q)).max(initial=0.0))
    at_play = max(at_play, float(np.abs(body.internal(q)).max(initial=0.0)))
    rounding = 1e-13 * float(body.scale().max())
    if left <= rounding or at_play == 0.0 or len(bloch.ties.rows):
        return 0.0
    del at_rest
    return left / at_play


def _naming(error: NotAlike, cell: UnitCell, patch: Patch) -> InputError:
    names = []
    for dof in error.dofs:
        unit = dof // 3
        names.append(f"node {patch.first[unit]}" if unit < len(patch.first) else "a hidden dof")
    reason = str(error).split(": ", 1)[1].split(", at dofs")[0]
    return InputError(
        f": {reason}, at {names[0]} and {names[1]}; a support, a panel or the state does not "
        "repeat under the motions of the cell",
        "case",
    )
