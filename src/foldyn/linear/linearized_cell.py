"""A cell of a repeated sheet, linearized about a state that repeats.

The periods may change with the state: a translation to another translation, a screw to another
angle and shift. Displacements of all cells follow from one cell and from the motions of the
deformed sheet; massless dofs are in balance, as they are in the repeated sheet. Displacements of
cell R are given in axes that turn with the cell, so that a wave differs between cells only by a
factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import State
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.modal_damping import mass_of
from foldyn.errors import ComputationError, InputError, warn
from foldyn.linear.bloch import Bloch, Hops, collected, hermitian, hops, null_space, steps_of
from foldyn.linear.cell_patch import Patch, cell_patch
from foldyn.linear.linearized import amplitude_of, damped_tangent, slope_change
from foldyn.linear.unit_cell import UnitCell, check_commuting, images, rotation
from foldyn.mechanics.assembly import BALANCED as SETTLED
from foldyn.mechanics.assembly import Assembly
from foldyn.patterns.screw import Screw, motion_between
from foldyn.statics.tracing import displacement_of
from foldyn.values import number, of_kind

BALANCED = 1e-6  # largest residual in equilibrium, relative to the forces that act
ROUNDING = 1e-12  # forces below this, relative to EA of the bars, count as zero
SAME = 1e-12  # changes of a motion below this, relative to the pattern's size, are round-off
SLACK = 10.0  # times the tolerance: largest distance of nodes from copies of their partners
PLACES = "None (the rest state), or a State, as fd.initial_state(path)"
ITERATIONS = 30
TURNED = 1e-13  # coefficients of constraints below this count as zero


class CellReach:
    """The m dofs of cell 0 (3 node + axis, then hidden dofs), and all dofs that act on them.

    Parameters
    ----------
    patch : Patch
    motions : sequence of Screw
        Motions from a cell to the next in the state.
    body : Assembly
        Body of the patch.

    Attributes
    ----------
    rows : ndarray of int, shape (m,)
        Numbers of the dofs of cell 0 among the dofs of the patch.
    steps : ndarray of int, shape (s, d)
        R of the cells that have nodes in the patch, and their opposites.
    hidden : ndarray of bool, shape (m,)
        Dofs without mass.
    held : ndarray of bool, shape (m,)
        Dofs held by supports.
    """

    def __init__(self, patch: Patch, motions: Sequence[Screw], body: Assembly) -> None:
        units = len(patch.first)
        self.patch, self.body, self.count = patch, body, 3 * units + patch.hidden
        nodal = (3 * patch.unit[:, None] + np.arange(3)).ravel()
        behind = np.where(patch.hidden_unit < 0, -1, 3 * units + patch.hidden_unit)
        self._unit = np.concatenate([nodal, behind])
        offset = np.concatenate([np.repeat(patch.step, 3, axis=0), patch.hidden_step])
        self.steps, self.number = steps_of(offset)
        own = np.flatnonzero((offset == 0).all(axis=1))
        self.rows = own[np.argsort(self._unit[own], kind="stable")]
        self.hidden = (np.arange(self.count) >= 3 * units) & (body.sheet.mass is None)
        self.held = np.zeros(self.count, bool)
        self.held[: 3 * units] = patch.case.constraints.held[self.rows[: 3 * units]]
        turned = [rotation(motions, step) for step in self.steps]
        blocks = sparse.block_diag([turned[k] for k in self.number[: 3 * len(patch.unit) : 3]])
        more = [sparse.eye_array(len(behind))] if len(behind) else []
        self._frames = sparse.csr_array(sparse.block_diag([blocks, *more]))

    def hops(self, matrix: sparse.sparray) -> Hops:
        """A matrix of the patch's dofs as `Hops`, in the axes of the cells."""
        return self._hops(self._frames.T @ matrix, self.rows)

    def gathered(self, matrix: sparse.sparray) -> Hops:
        """A matrix (r, m) on the patch's dofs as `Hops`."""
        return self._hops(matrix, np.arange(matrix.shape[0]))

    def _hops(self, matrix: sparse.sparray, rows: NDArray) -> Hops:
        """Rows of a matrix on the patch's dofs, with these in the axes of the cells."""
        own, steps = sparse.csr_array(matrix @ self._frames), len(self.steps)
        return hops(own, rows, self._unit, self.number, self.count, steps)

    def forces(self, q: NDArray) -> NDArray[np.float64]:
        """Forces (m,), N, of the sheet on the dofs of cell 0 for the patch at q."""
        return self.body.internal(q)[self.rows]

    def copies(self, factors: NDArray) -> sparse.csr_array:
        """Matrix from dofs of cell 0 to those of the patch, times a factor (s,) for each R."""
        there = np.flatnonzero(self._unit >= 0)
        entries = (factors[self.number[there]], (there, self._unit[there]))
        shape = (len(self._unit), self.count)
        return sparse.csr_array(self._frames @ sparse.csr_array(entries, shape=shape))

    @cached_property
    def _known(self) -> sparse.csr_array:
        """Matrix from hidden dofs of a cell to hidden dofs of the patch that copy them."""
        unit = self.patch.hidden_unit
        there = np.flatnonzero(unit >= 0)
        entries = (np.ones(len(there)), (there, unit[there]))
        return sparse.csr_array(entries, shape=(len(unit), self.patch.hidden))

    def balanced(self, displacement: NDArray) -> NDArray[np.float64]:
        """All dofs of the patch at a displacement (n, 3); hidden dofs are equal in all cells.

        Newton's method balances the hidden dofs of cell 0.

        Raises
        ------
        ComputationError
            No balance is found near zero.
        """
        first, own = displacement.size, self.rows[self.hidden]
        hidden = np.zeros(len(own))
        q = np.concatenate([displacement.ravel(), np.zeros(len(self.patch.hidden_unit))])
        for _ in range(ITERATIONS):
            couple = self.body.internal(q)[own]
            if not couple.any():
                return q
            block = self.body.tangent(q)[own][:, first:] @ self._known
            step = -np.linalg.solve(block.toarray(), couple)
            hidden += step
            q[first:] = self._known @ hidden
            if self.body.sheet.per_hidden * np.abs(step).max() <= SETTLED:
                return q
        raise ComputationError("the rotations of the panels do not balance in this state")

    @cached_property
    def ties(self) -> Hops:
        """Constraints (k, m) of one cell: constraints whose first cell is cell 0."""
        rows = self.patch.case.constraints.rows
        steps = [self.steps[self.number[rows.indices[a:b]]] for a, b in pairwise(rows.indptr)]
        first = [min(map(tuple, own.tolist())) for own in steps]
        kept = [k for k, step in enumerate(first) if not any(step)]
        size = rows.shape[1]
        own = sparse.coo_array(rows[kept] @ self._frames[:size, :size])
        value = np.where(np.abs(own.data) > TURNED, own.data, 0.0)
        return collected(
            own.row, self._unit[own.col], self.number[own.col], value, (len(kept), self.count),
            len(self.steps),
        )  # fmt: skip

    @cached_property
    def moves(self) -> NDArray[np.float64]:
        """Orthonormal motions (m, r), equal in all cells, that supports and constraints allow."""
        basis = np.eye(self.count)[:, ~self.held]
        together = self.ties.at(np.ones(len(self.steps)))
        return basis @ null_space(together @ basis).real

    def projected(self, force: NDArray) -> NDArray[np.float64]:
        """Forces (r,), N, on `moves`."""
        return force[~self.held] if self.ties.empty else self.moves.T @ force


@dataclass(frozen=True, eq=False)
class LinearizedCell:
    """Matrices of small motions of a repeated sheet about a state.

    Attributes
    ----------
    cell : UnitCell
    patch : Patch
    motions : tuple of Screw
        Motions from a cell to the next in the state.
    reach : CellReach
        Dofs of cell 0 (3 node + axis, then hidden dofs), and of the patch.
    bloch : Bloch
        Their matrices.
    displacement : (n, 3)
        Displacement of the nodes of the cell's own structure in the state, m.
    residual : float
        Largest force on a free dof, as a fraction of the forces that act.
    dofs : (k,)
        All dofs of the patch in the state.
    """

    cell: UnitCell
    patch: Patch
    motions: tuple[Screw, ...]
    reach: CellReach
    bloch: Bloch
    displacement: NDArray
    residual: float
    dofs: NDArray

    @property
    def nodes(self) -> int:
        """Nodes of cell 0."""
        return len(self.patch.first)

    @property
    def vectors(self) -> NDArray[np.float64]:
        """Shifts (d, 3) from a cell to the next in the state, m."""
        return np.array([motion.vector for motion in self.motions])

    @property
    def variables(self) -> dict[str, Any]:
        """Variables of results that describe the state."""
        angles = [motion.angle for motion in self.motions]
        axes = np.array([motion.unit for motion in self.motions])
        points = np.array([motion.point for motion in self.motions])
        return {
            "vectors": (("period", "axis"), self.vectors, {"units": "m"}),
            "angles": ("period", np.radians(angles), {"units": "rad"}),
            "axes": (("period", "axis"), axes, {"units": "1"}),
            "points": (("period", "axis"), points, {"units": "m"}),
            "displacement": (("node", "axis"), self.displacement, {"units": "m"}),
        }

    def expanded(self, shapes: NDArray, phase: NDArray) -> NDArray[np.complex128]:
        """Shapes (k, n, 3) at the nodes of the cell's structure, from shapes (m, k) of the dofs."""
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
        State of the cell's own structure, which is the same in all cells except for the motions
        from a cell to the next; by default the rest state.
    secant, load_factor : float
        As in `linearize`.

    Raises
    ------
    InputError
        The state does not repeat: the message names nodes.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium; hinges have no slope.
    """
    of_kind("cell", cell, UnitCell)
    load_factor = number("load_factor", load_factor)
    amplitude = amplitude_of(secant)
    patch = cell_patch(cell)
    case, own = patch.case, np.zeros_like(cell.case.structure.nodes)
    check_mass(case.mass[patch.own_nodes][:, patch.own_nodes], patch.determined)
    motions, body = cell.motions, case.elastic_body
    displacement = np.zeros_like(case.structure.nodes)
    if state is not None:
        check_state(cell)
        if not isinstance(state, State):
            raise InputError(f": got {type(state).__name__}; give {PLACES}", "state")
        own = displacement_of(state, cell.case, "state", PLACES)
        motions = deformed_motions(cell, patch, own)
        displacement = tiled(cell, patch, motions, own)
        body = folded_body(cell, patch, load_factor)
    reach = CellReach(patch, motions, body)
    q = reach.balanced(displacement)
    change, soft = slope_change(case, body, q, amplitude)
    if soft:
        _warn(
            "hinges of the superlinear law stand at their rest angle, where their slope vanishes: "
            "they count without stiffness, and waves that only they resist have the frequency "
            "zero. Give secant = an amplitude in degrees, such as 1, or take preset = "
            '"plate" in place of this law'
        )
    tangent, mass = body.tangent(q), mass_of(case)
    stiffness = tangent if change is None else sparse.csr_array(tangent + change)
    damping = sparse.csr_array(
        damping_matrix(case, q, True) + case.rayleigh.matrix(mass, damped_tangent(case, tangent))
    )
    parts = {"stiffness": stiffness, "mass": mass, "damping": damping}
    hopping = {
        name: hermitian(reach.hops(own), reach.steps, name, patch.first)
        for name, own in parts.items()
    }
    bloch = Bloch(reach.steps, **hopping, ties=reach.ties, hidden=reach.hidden, held=reach.held)
    residual = _residual(reach, q)
    if residual > BALANCED:
        _warn(
            f"the state is no equilibrium of the repeated sheet: its residual is {residual:.2g} of "
            "the forces at play, and motions about it are not free vibrations. Remedy: "
            "foldyn.linear.relaxed finds the equilibrium with given periods"
        )
    return LinearizedCell(cell, patch, motions, reach, bloch, own, residual, q)


def check_state(cell: UnitCell) -> None:
    """Refuse states other than rest for models that are linear about it."""
    if linear := cell.case.structure.linear:
        raise InputError(f": {linear} are linear about the rest state only", "state")


def _warn(message: str) -> None:
    warn(message, "waves.md#prestressed-and-folded-states")


def deformed_motions(cell: UnitCell, patch: Patch, displacement: NDArray) -> tuple[Screw, ...]:
    """Motions from a cell to the next in a state (n, 3), m, of the cell's own structure.

    Raises
    ------
    InputError
        The state has no such motions.
    """
    rest = cell.case.structure.nodes
    place, near, pattern = rest + displacement, cell.near, cell.case.structure.pattern
    found = []
    for k, motion in enumerate(cell.motions):
        one, two = patch.own_pairs(k).T
        if not len(one):
            raise InputError(
                f": no two nodes of the cell are partners under motion {k} alone, so that a state "
                "does not determine it",
                "state",
            )
        change = displacement[one] @ motion.rotation().T - displacement[two]
        moved, off = motion, np.linalg.norm(change, axis=1)
        if off.max() > SAME * pattern.size:
            other, left = motion_between(place[one], place[two], SAME * pattern.size)
            # a turn that appears or vanishes in a small change is noise, or pairs on a line do not
            # reveal it
            if off.max() > near or other.turns == motion.turns:
                moved, off = other, left
        if off.max() > near:
            worst = int(off.argmax())
            raise InputError(
                f": does not repeat: no motion brings the nodes at one side of the cell to their "
                f"partners at the other; nodes {one[worst]} and {two[worst]} are off by "
                f"{off[worst]:.2g} m, as are {int((off > near).sum())} of {len(off)} pairs. A cell "
                "with free sides has no such state; see foldyn.linear.relaxed",
                "state",
            )
        found.append(moved)
    check_commuting(place, found, near, "state")
    return tuple(found)


def tiled(
    cell: UnitCell, patch: Patch, motions: Sequence[Screw], displacement: NDArray
) -> NDArray[np.float64]:
    """Displacements (n, 3), m, of the patch, from displacements of the cell's own structure.

    Raises
    ------
    InputError
        Nodes do not coincide with the copies of their partners.
    """
    place = cell.case.structure.nodes + displacement
    first = np.array([images(motions, place[v], -patch.own_step[v]) for v in patch.first.tolist()])
    off = np.linalg.norm(spread(motions, first, patch.own_unit, patch.own_step) - place, axis=1)
    worst = int(off.argmax())
    if off[worst] > SLACK * cell.near:
        raise InputError(
            f": does not repeat: node {worst} is {off[worst]:.2g} m from where the copy of node "
            f"{patch.first[patch.own_unit[worst]]} is",
            "state",
        )
    return spread(motions, first, patch.unit, patch.step) - patch.case.structure.nodes


def spread(
    motions: Sequence[Screw], first: NDArray, unit: NDArray, step: NDArray
) -> NDArray[np.float64]:
    """Places (n, 3) of copies of points (m, 3): of point `unit` (n,), in cell R (n, d)."""
    out = np.empty((len(unit), 3))
    for each in np.unique(step, axis=0):
        rows = (step == each).all(axis=1)
        out[rows] = images(motions, first[unit[rows]], each)
    return out


def folded_body(cell: UnitCell, patch: Patch, factor: float) -> Assembly:
    """The patch with its folds actuated by a factor; refuses loads that depend on displacement."""
    if cell.case.following_terms:
        raise InputError(
            ": some depend on the displacement, as a pressure does, and a cell does not include "
            "their stiffness; leave them out",
            "loads",
        )
    body: Any = patch.case.elastic_body
    terms = patch.case.rest_terms
    if not terms:
        return body
    return body.folded(body.sheet.rest_angles + factor * sum(change for change, _ in terms))


def _residual(reach: CellReach, q: NDArray) -> float:
    """Largest force on a free dof of cell 0, as a fraction of the forces that act."""
    force = reach.forces(q)
    left = float(np.abs(reach.projected(force)).max(initial=0.0))
    every = np.concatenate([force, reach.body.hinge_forces(q)[reach.rows]])
    at_play = float(np.abs(every).max(initial=0.0))
    return 0.0 if left <= ROUNDING * float(reach.body.scale().max()) else left / at_play
