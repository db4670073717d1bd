"""Constraints between displacements: oblique supports, links and rigid panels.

All constraints are linear equations G u = g with constant coefficients for the displacements u
(3n,); g is zero except for supports that move. Elimination satisfies them exactly: u = E x
(`algebra.elimination`), and solvers solve for the free dofs of x. This adds no stiffness and no
unknowns, and keeps matrices symmetric and positive definite.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.elimination import Elimination, eliminate
from foldyn.cases.clamped_edges import supported_points
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import Fix, Impose, Link
from foldyn.errors import InputError
from foldyn.structures.discretized import Discretized
from foldyn.structures.rigid_plates import OFF_PLANE, on_plate
from foldyn.values import show

STRUCTURE = "the rigid panels"  # owner of the equations of rigid panels
AGREES = 1e-9  # largest error of an equation, relative to displacements or lengths


class Equation(NamedTuple):
    """Sum of coefficients times dofs; it is solved for the first dof."""

    owner: str  # the support that needs it, such as "supports[2]", or STRUCTURE
    dofs: Sequence[int]
    coefficients: Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Constraints:
    """Equations between the 3n nodal dofs of a case; false as a condition if there are none.

    Vectors and matrices for all dofs (m) may have further dofs after the nodal dofs (a model's
    hidden dofs), which stay unchanged.

    Parameters
    ----------
    equations : sequence of Equation
    held : ndarray of bool, shape (3n,)
        Dofs that supports hold along their axes.
    """

    equations: Sequence[Equation]
    held: NDArray

    def __bool__(self) -> bool:
        """Whether there are equations."""
        return len(self.equations) > 0

    @cached_property
    def owners(self) -> NDArray[np.str_]:
        """Owner of each equation, (k,)."""
        return np.array([one.owner for one in self.equations], np.str_)

    @cached_property
    def rows(self) -> sparse.csr_array:
        """G, (k, 3n)."""
        starts = np.cumsum([0, *(len(one.dofs) for one in self.equations)])
        dofs = np.concatenate([np.zeros(0, np.int64), *(one.dofs for one in self.equations)])
        values = np.concatenate([np.zeros(0), *(one.coefficients for one in self.equations)])
        return sparse.csr_array(
            (values, dofs.astype(np.int64), starts), (len(self.equations), len(self.held))
        )

    @cached_property
    def _solved(self) -> Elimination:
        return eliminate(self.rows, self.held)

    @property
    def slaves(self) -> NDArray[np.int64]:
        """Dofs that the other dofs determine."""
        return self._solved.slaves

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """Dofs that are neither held nor slaves, increasing: the unknowns."""
        taken = self.held.copy()
        if self:
            taken[self.slaves] = True
        return np.flatnonzero(~taken).astype(np.int64)

    @property
    def basis(self) -> sparse.csr_array:
        """E (3n, 3n)."""
        return self._solved.basis

    @cached_property
    def determined(self) -> NDArray[np.bool_]:
        """Whether each dof (n, 3) is held or determined by other dofs."""
        mask = np.ones(len(self.held), bool)
        mask[self.free] = False
        return mask.reshape(-1, 3)

    def with_held(self, dofs: NDArray) -> Constraints:
        """The same constraints with further dofs held."""
        held = self.held.copy()
        held[dofs] = True
        return Constraints(self.equations, held) if len(dofs) else self

    def slaves_of(self, owners: Collection[str]) -> NDArray[np.int64]:
        """Slaves in the equations of the given owners."""
        if not self:
            return np.zeros(0, np.int64)
        return self.slaves[np.isin(self.owners[self._solved.kept], list(owners))]

    # ------------------------------------------------------------------ vectors and matrices
    def displacement(self, x: NDArray) -> NDArray:
        """Displacements u = E x for coordinates x (m,) or (m, k)."""
        return self._times(x, lambda: self.basis)

    def coordinates(self, u: NDArray) -> NDArray:
        """Vector x for displacements u (m,): u with each slave replaced by its equation's value."""
        if not self:
            return u
        x = u.copy()
        x[self.slaves] = self.rows[self._solved.kept] @ u[: len(self.held)]
        return x

    def rows_on_dofs(self, rows: NDArray) -> NDArray:
        """Rows (r, m) whose products with x equal those of the given rows with u = E x."""
        if not self:
            return rows
        out, count = rows.copy(), len(self.held)
        out[:, self.slaves] = 0.0
        out[:, :count] += rows[:, self.slaves] @ self.rows[self._solved.kept]
        return out

    def force(self, force: NDArray) -> NDArray:
        """E' f for forces f (m,) or (m, k), N."""
        return self._times(force, lambda: self.basis.T)

    def largest(self, force: NDArray) -> NDArray:
        """|E|' f: upper bounds, N, of E' f if forces have the absolute values f (m,)."""
        return self._times(force, lambda: abs(self.basis).T)

    def _times(self, vector: NDArray, matrix: Callable[[], Any]) -> NDArray:
        """A matrix (3n, 3n) times the nodal part of a vector (m,) or (m, k); the rest is kept."""
        if not self:
            return vector
        count = len(self.held)
        return np.concatenate([matrix() @ vector[:count], vector[count:]])

    def matrix(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """E' K E for a matrix K (m, m)."""
        if not self:
            return matrix
        basis = self.extended(matrix.shape[0])
        return sparse.csr_array(basis.T @ matrix @ basis)

    def extended(self, size: int) -> sparse.csr_array:
        """E (m, m), extended to m dofs; the identity without equations."""
        if not self:
            return sparse.csr_array(sparse.eye_array(size))
        more = size - len(self.held)
        if not more:
            return self.basis
        return sparse.csr_array(sparse.block_diag([self.basis, sparse.eye_array(more)]))

    def values(self, u: NDArray) -> NDArray:
        """G u for displacements u (n, 3): the values (k,) of the equations, m."""
        return self.rows @ u.ravel()

    @cached_property
    def along(self) -> NDArray[np.bool_]:
        """Whether each equation (k,) belongs to a support along a direction, with one node."""
        return np.array([len({dof // 3 for dof in one.dofs}) == 1 for one in self.equations], bool)

    # ------------------------------------------------------------------ supports that move
    def moved(self, shape: NDArray, values: NDArray, place: str) -> NDArray:
        """Displacements (n, 3) when held dofs move as in `shape` and free dofs stay in place.

        Parameters
        ----------
        shape : ndarray, shape (n, 3)
        values : ndarray, shape (k,)
            Values of the equations, m.
        place : str
            The support that moves, for messages.

        Raises
        ------
        InputError
            Redundant equations contradict each other.
        """
        if not self:
            return shape
        x = shape.ravel().copy()
        x[self.slaves] = values[self._solved.kept]
        u = self.basis @ x
        gap = np.abs(self.rows @ u - values)
        if gap.max() > AGREES * np.abs(u).max(initial=np.abs(values).max()):
            raise InputError(
                f"{place}: what it moves cannot follow, because of {self.owners[gap.argmax()]}; "
                "leave out one of the two"
            )
        return u.reshape(shape.shape)

    # ------------------------------------------------------------------ reactions
    @cached_property
    def supported(self) -> NDArray[np.int64]:
        """Dofs (s,), increasing, on which supports exert forces, along axes or directions."""
        along = self.rows[np.flatnonzero(self.along)].indices
        return np.union1d(np.flatnonzero(self.held), along).astype(np.int64)

    @cached_property
    def reactions(self) -> sparse.csr_array:
        """Matrix (s, 3n) from forces on all dofs to forces of supports on `supported` dofs."""
        size = len(self.held)
        own = sparse.diags_array(self.held.astype(float))
        if not self:
            return sparse.csr_array(sparse.csr_array(own)[self.supported])
        kept = self._solved.kept
        straight = self.along[kept].astype(float)
        # the multipliers of directions
        put = sparse.csr_array((straight, (np.arange(len(kept)), self.slaves)), (len(kept), size))
        exerted = own + self.rows[kept].T @ put
        return sparse.csr_array((sparse.csr_array(exerted) @ self.basis.T)[self.supported])


def equations_of(structure: Discretized, supports: Iterable[tuple[str, Any]]) -> list[Equation]:
    """Equations of supports, given with their places, and of a structure's rigid panels.

    Supports come first, so that the equation of a support carries the force if an equation of a
    panel is redundant.
    """
    directions: list[Equation] = []
    links: list[Equation] = []
    for place, support in supports:
        nodes, _ = supported_points(structure, support, place)
        if isinstance(support, Link):
            links += _link(structure, support, place, nodes)
        elif support.direction is not None:
            directions += _along(support, place, nodes)
    for plate in structure.plates:
        links += _riding(STRUCTURE, plate.riders, plate.corners, plate.weights)
    return [*directions, *links]


def values_of(owners: NDArray, values: Mapping[str, Any]) -> NDArray[np.float64]:
    """Values (k,), m, of the equations of `owners`; zero for owners without a value.

    values : by owner, one value for all nodes or one for each.
    """
    out = np.zeros(len(owners))
    for owner, value in values.items():
        out[owners == owner] = value
    return out


def check_tied(case: Any, displacement: NDArray, field: str) -> None:
    """Refuse displacements (n, 3), m, that violate links or bend rigid panels."""
    ties = case.constraints
    if not ties:
        return
    gap = np.where(ties.along, 0.0, np.abs(ties.values(displacement)))
    if gap.max() > AGREES * case.body.sheet.longest():
        worst = int(gap.argmax())
        raise InputError(
            f": does not satisfy {ties.owners[worst]}: node {ties.equations[worst].dofs[0] // 3} "
            f"stands {gap[worst]:.3g} m from where it is tied to; take a state of a case with the "
            "same links and rigid panels",
            field,
        )


def _along(support: Fix | Impose, owner: str, nodes: NDArray) -> list[Equation]:
    """Equations for the displacement along a direction, solved for its largest component."""
    unit = unit_vector(support.direction)
    axes = [int(k) for k in np.argsort(-np.abs(unit), kind="stable") if unit[k] != 0.0]
    values = unit[axes].tolist()
    return [Equation(owner, [3 * node + k for k in axes], values) for node in nodes.tolist()]


def _link(structure: Discretized, link: Link, place: str, nodes: NDArray) -> list[Equation]:
    if link.to is None:
        if len(nodes) < 2:
            raise InputError(
                f" = {show(link.nodes)}: selects node {nodes[0]} alone; a link ties at least two",
                f"{place}.nodes",
            )
        first, *others = nodes.tolist()
        return [
            Equation(place, [3 * node + k, 3 * first + k], [1.0, -1.0])
            for node in others
            for k in sorted(map(AXES.index, link.axes or ""))
        ]
    corners = resolve_nodes(structure, link.to, f"{place}.to")
    if twice := set(nodes.tolist()) & set(corners.tolist()):
        raise InputError(
            f": node {min(twice)} cannot ride on itself; leave it out of nodes or of to",
            f"{place}.to",
        )
    weights, off = on_plate(structure.nodes[nodes], structure.nodes[corners])
    if np.isnan(off).any():
        raise InputError(
            f" = {list(link.to)}: these nodes lie on a line; take three that span a triangle",
            f"{place}.to",
        )
    if off.max() > OFF_PLANE:
        raise InputError(
            f": node {nodes[int(off.argmax())]} lies off the plane of nodes {list(link.to)} by "
            f"{off.max():.2g} of their size; a point off the plane moves with the rotation of "
            "the plate, which is not a linear function of three displacements: take nodes in the "
            "plane, or join it by bars",
            f"{place}.nodes",
        )
    return _riding(place, nodes, corners, weights)


def _riding(owner: str, nodes: NDArray, corners: NDArray, weights: NDArray) -> list[Equation]:
    """Equations by which each node follows three corners with its weights (k, 3)."""
    return [
        Equation(owner, [3 * node + k, *(3 * corners + k).tolist()], [1.0, *-row])
        for node, row in zip(nodes.tolist(), weights, strict=True)
        for k in range(3)
    ]
