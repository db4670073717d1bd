"""The base state of linear buckling, and the change of the tangent along the path from there.

Superelements are linear. Their panels are meshes of a shell (`shells`), which has the exact tangent
of large displacements. Its nodes on edges move by the shapes of the superelements, and the sheet
turns about the sides there by theirs; inside, each panel is free. The rotations of a shell are
relative to its triangles, so that a turn psi of the sheet about a side on an edge is that of the
triangle, phi, less the rotation. phi changes with the nodes as they are in the loaded state:
otherwise moments along welds would couple the insides of panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.load_factors import LoadFactors, Softening
from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.substructures import Substructures
from foldyn.algebra.superlu import SingularTangentError, Solution, unsymmetric
from foldyn.cases import Case, Load
from foldyn.cases.connectors import Connector
from foldyn.cases.springs import Elastic
from foldyn.condensation import Superelements
from foldyn.dynamics.modal_damping import soft_at_rest
from foldyn.errors import ComputationError, InputError, warn
from foldyn.linear.shell_of import shell_of
from foldyn.mechanics.following import ASYMMETRIC, NO_POTENTIAL, asymmetry
from foldyn.patterns.pattern import refuse_junctions
from foldyn.shells import Shell
from foldyn.statics import OrigamiProblem
from foldyn.statics.newton import Solver
from foldyn.statics.stepping import PathStoppedError, arrive, settle, step_to
from foldyn.statics.tracing import refuse_mechanisms

STEP = 1e-5  # largest strain or turn in the difference of tangents: errors of 1e-10 and rounding
FARTHEST = 0.1  # strain or turn along the linear path beyond which no factor means anything
BENT = 1e-6  # rad: creases whose rest angle is farther from their dihedral load the panels


class Base:
    """The base state, the tangent there, and its change along the path.

    Attributes
    ----------
    problem : OrigamiProblem
        The case, with its preloads constant.
    case : Case
        The case of results.
    factor : float
        Load factor of the base state.
    u, slope : (m,)
        The base state, and its derivative with respect to the load factor.
    step : float
        Load factor of the central difference.
    softening : Softening
        Symmetric parts of the tangent and of its derivative, on the free dofs.
    """

    factor = 0.0

    def __init__(self, case: Case, preloads: Sequence[Load]) -> None:
        whole = case.altered(loads=(*preloads, *case.loads)) if preloads else case
        problem = OrigamiProblem(whole, range(len(preloads)))
        refuse_mechanisms(problem)
        self._solver, self._preloaded = Solver(problem), bool(preloads)
        try:
            self._station = settle(self._solver, problem.start(), 0.0)
        except PathStoppedError as stop:
            raise ComputationError(f"buckling: {stop}") from None
        self.problem, self.case, self._reduce = problem, problem.case, Reduction(problem.free)
        self.backend, self._factorize = factorizer("auto", len(problem.free))
        self._linearize()

    def closer(self, factor: float) -> Base | None:
        """The state at another load factor of the path; None if it is lost or unstable there."""
        other, attempt = copy(self), step_to(self._solver, self._station, factor)
        if attempt.failure:
            return None
        other._station = arrive(self._solver, attempt)
        try:
            other._linearize()
        except InputError:
            return None
        return other

    def _linearize(self) -> None:
        """Find the tangent and its change at the station."""
        problem, point = self.problem, self._station.point
        self.u, self.factor = point.u, point.factor
        self._refuse_soft()
        matrix = self.tangent(self.u, self.factor)
        block = self._reduce(matrix)
        try:
            factors = self._factorize(block.symmetric)
            negative = factors.negative()
            exact = factors if block.is_symmetric else unsymmetric(block.exact)
        except SingularTangentError:
            raise unstable("is singular", self._preloaded) from None
        if negative:
            raise unstable(f"has {negative} negative eigenvalues", self._preloaded)
        self._exact: Solution = exact
        self.slope = self._slope(matrix)
        self.step = STEP / self.stretch()
        ahead = self.tangent(self.u + self.step * self.slope, self.factor + self.step)
        behind = self.tangent(self.u - self.step * self.slope, self.factor - self.step)
        change = self._reduce(sparse.csr_array((ahead - behind) / (2.0 * self.step)))
        if not change.is_symmetric:
            loads = problem.load_stiffness(problem.dofs(self.u), 1.0)
            loads = problem.case.constraints.matrix(loads)
            warn_of_asymmetry(asymmetry(Reduction(problem.free)(sparse.csr_array(loads)).exact))
        self.softening = Softening(
            block.symmetric, change.symmetric, factors, self._factorize,
            rounding=1.0 / self.step, farthest=FARTHEST * self.step / STEP,
        )  # fmt: skip

    def nearest(self, count: int) -> tuple[LoadFactors, LoadFactors]:
        """Positive and negative factors, with shapes on the free dofs of the problem."""
        return self.softening.nearest(count)

    def tangent(self, u: NDArray, factor: float) -> sparse.csr_array:
        """Exact tangent (m, m) of a state, N/m, with the load stiffness."""
        problem, q = self.problem, self.problem.dofs(u)
        matrix = problem.body(u, factor).tangent(q)
        if problem.following.acts:
            matrix = sparse.csr_array(matrix + problem.load_stiffness(q, factor))
        return sparse.csr_array(problem.case.constraints.matrix(matrix))

    def all_dofs(self, free: NDArray) -> NDArray:
        """Motions (m, k) of all dofs in motions of the free dofs."""
        full = np.zeros((len(self.u), free.shape[1]))
        full[self.problem.free] = free
        return full

    def moved(self, force: NDArray) -> NDArray:
        """Motion (m,) under a force (m,) on the free dofs."""
        motion = np.zeros(len(self.u))
        motion[self.problem.free] = self._exact.solve(force[self.problem.free])
        return motion

    def _slope(self, matrix: sparse.csr_array) -> NDArray:
        problem, given = self.problem, np.zeros(len(self.u))
        given[problem.held] = problem.prescribed(1.0) - problem.prescribed(0.0)
        return given + self.moved(-problem.rate(self.u, self.factor) - matrix @ given)

    def stretch(self) -> float:
        """Largest strain or turn per unit of the load factor, about.

        Loads on held dofs move nothing, but stress the structure: their forces over those at unit
        strain count, too.
        """
        problem, structure = self.problem, self.problem.structure
        body = problem.body(self.u, self.factor)
        moved, q = problem.dofs(self.slope), problem.dofs(self.u)
        nodes = structure.nodes.size
        x, v = structure.nodes + q[:nodes].reshape(-1, 3), moved[:nodes].reshape(-1, 3)
        a, b = structure.bars.T
        apart = np.linalg.norm(v[b] - v[a], axis=1) / np.linalg.norm(x[b] - x[a], axis=1)
        turned = body.sheet.per_hidden * np.abs(moved[body.hidden])
        scale = body.scale()
        held = np.abs(problem.rate(self.u, self.factor))[: len(scale)]
        stressed = np.divide(held, scale, out=np.zeros_like(scale), where=scale > 0.0)
        most = max(float(each.max(initial=0.0)) for each in (apart, turned, stressed))
        if most == 0.0:  # springs alone resist the loads
            most = float(np.linalg.norm(v)) / problem.length
        if most == 0.0:
            raise InputError(
                ": they load nothing, so that no load factor exists; give loads that deform the "
                "case",
                "loads",
            )
        return most

    def _refuse_soft(self) -> None:
        problem, body = self.problem, self.problem.body(self.u, self.factor)
        soft = int(soft_at_rest(problem.case, body, problem.dofs(self.u))[0].sum())
        if soft:
            raise InputError(
                f": {soft} hinges of the superlinear law stand at their rest angle, where their "
                'slope vanishes and has no derivative; take preset = "plate" or "n5b8e", or a '
                "preload that turns these hinges",
                "bend_law",
            )


def unstable(how: str, preloaded: bool) -> InputError:
    """Error for a base state in which the tangent is not positive definite."""
    if preloaded:
        return InputError(
            f": the tangent {how} in the equilibrium under it: the case has buckled already; give "
            "a smaller one",
            "preload",
        )
    return InputError(
        f"the tangent {how} at rest, before any load acts; hold what moves, or give folds a "
        "stiffness, or a preload under which the case is stable"
    )


def warn_of_asymmetry(share: float) -> None:
    """Warn if the antisymmetric share of the load stiffness counts."""
    if share > ASYMMETRIC:
        warn(
            f"{NO_POTENTIAL.format(share)} load factors take its symmetric part, which misses "
            "flutter: simulated motions include it",
            "loads.md#pressure",
        )


class PanelsBase(Base):
    """The state of superelements at rest, on the mesh of their panels; see `Base`."""

    def __init__(self, case: Case) -> None:
        _refuse(case)
        structure: Any = case.structure
        own = OrigamiProblem(case.altered(structure=structure.for_buckling))
        refuse_mechanisms(own)
        meshes = structure.meshes
        self.case = shell_of(case, meshes.divisions[-2:][0], meshes.graded[-1].radius)
        assert isinstance(self.case.structure, Shell)
        springs = [one for one in self.case.supports if isinstance(one, Connector | Elastic)]
        self.problem = OrigamiProblem(self.case.altered(supports=springs))
        self.u = self.problem.start()
        self._shapes = _Shapes(own, self.case.structure)
        every = self._shapes.at(self.u)
        moving = np.diff(sparse.csc_array(every).indptr) > 0
        moving[own.held] = False
        self._moving = np.flatnonzero(moving)
        self._still = every[:, self._moving]
        self.backend, self._factorize = factorizer("auto", own.free.size)
        matrix = self.tangent(self.u, 0.0)
        try:
            self._parts = Substructures(
                sparse.csr_array(self._still.T @ matrix @ self._still), self._shapes.owner,
                self._factorize,
            )  # fmt: skip
        except SingularTangentError:
            raise unstable("is singular", False) from None
        if negative := self._parts.outer.negative():
            raise unstable(f"has {negative} negative eigenvalues", False)
        given = np.zeros(every.shape[1])
        given[own.held] = own.prescribed(1.0) - own.prescribed(0.0)
        held = every @ given
        self.slope = held + self.moved(-self.problem.rate(self.u, 0.0) - matrix @ held)
        self.step = STEP / self.stretch()
        ahead, behind = (self._moved_tangent(way * self.step) for way in (1.0, -1.0))
        loads = self._still.T @ self.problem.load_stiffness(self.u, 1.0) @ self._still
        warn_of_asymmetry(asymmetry(sparse.csr_array(loads)))
        change = (ahead - behind) / (4.0 * self.step)
        self._pencil = self._parts.pencil(sparse.csr_array(change + change.T))
        self.softening = Softening(
            self._pencil.stiffness, self._pencil.change, self._factorize(self._pencil.stiffness),
            self._factorize, rounding=1.0 / self.step, farthest=FARTHEST * self.step / STEP,
        )  # fmt: skip

    def nearest(self, count: int) -> tuple[LoadFactors, LoadFactors]:
        """See `Base`."""
        one, other = (
            found._replace(shapes=self._still @ self._parts.whole(self._pencil, found.shapes))
            for found in self.softening.nearest(count)
        )
        return one, other

    def moved(self, force: NDArray) -> NDArray:
        """See `Base`."""
        return self._still @ self._parts.solve(self._still.T @ force)

    def _moved_tangent(self, factor: float) -> sparse.csr_array:
        """Tangent of the moving shapes at a small factor."""
        u = self.u + factor * self.slope
        shapes = self._shapes.at(u)[:, self._moving]
        return sparse.csr_array(shapes.T @ self.tangent(u, factor) @ shapes)


class _Shapes:
    """Motions of a shell: states of superelements on its edges, then motions inside its panels.

    Attributes
    ----------
    owner : (i,)
        The panel of each motion inside.
    """

    def __init__(self, problem: OrigamiProblem, shell: Shell) -> None:
        structure, sides = problem.structure, shell.sides
        assert isinstance(structure, Superelements)
        self._shell, ends, x = shell, shell.edge_nodes, shell.nodes
        apart = np.linalg.norm(x[ends] - x[ends[:, :1]], axis=2)
        along, turned = structure.on_edges(apart / apart[:, -1:], edges=problem.case.held_edges)
        states = problem.case.constraints.extended(along.shape[1])
        axis, tri = np.arange(3), shell.triangles
        nodes, first = np.unique(ends, return_index=True)
        rows, columns = 3 * nodes[:, None] + axis, 3 * first[:, None] + axis
        put = _entries(1.0, rows, columns, (x.size, along.shape[0]))
        # sides of triangles on edges
        a, b, c = (np.roll(tri, -k, axis=1).ravel() for k in range(3))
        low, high = ends[:, :-1].ravel(), ends[:, 1:].ravel()
        own = np.minimum(low, high) * len(x) + np.maximum(low, high)
        wanted = np.minimum(a, b) * len(x) + np.maximum(a, b)
        order = np.argsort(own)
        piece = order[np.searchsorted(own[order], wanted).clip(max=len(own) - 1)]
        rotation = sides.rotation.ravel()
        on = np.flatnonzero((own[piece] == wanted) & (rotation >= 0))
        self._corners, self._rotation = np.stack([a, b, c], axis=1)[on], rotation[on]
        smooth = sides.hinge.ravel()[on] >= 0  # a weld: half of the difference of both turns
        reach = 1.0 / shell.model.per_reach
        self._share = reach * sides.sign.ravel()[on] * np.where(smooth, 0.5, 1.0)
        row = 2 * piece[on] + (self._corners[:, 0] != low[piece[on]])
        turning = _entries(self._share, self._rotation, row, (shell.rotations, turned.shape[0]))
        # motions inside
        inside = np.setdiff1d(np.arange(len(x)), nodes)
        free = np.setdiff1d(np.arange(shell.rotations), self._rotation)
        of_node, of_rotation = np.zeros(len(x), np.int64), np.zeros(shell.rotations + 1, np.int64)
        of_node[tri] = of_rotation[sides.rotation] = shell.triangle_panel[:, None]
        self.owner = np.append(np.repeat(of_node[inside], 3), of_rotation[free])
        count, dofs = len(self.owner), (3 * inside[:, None] + axis).ravel()
        alone = _entries(1.0, dofs, np.arange(len(dofs)), (x.size, count))
        loose = _entries(1.0, free, len(dofs) + np.arange(len(free)), (shell.rotations, count))
        self._nodes = sparse.csr_array(sparse.hstack([put @ along @ states, alone]))
        self._turned = sparse.csr_array(sparse.hstack([turning @ turned @ states, loose]))

    def at(self, u: NDArray) -> sparse.csr_array:
        """Motions (m, s + i) of the dofs in a state (m,)."""
        x = self._shell.nodes + u[: self._shell.nodes.size].reshape(-1, 3)
        a, b, c = x[self._corners].swapaxes(0, 1)
        side = b - a
        length2 = (side**2).sum(axis=1)
        normal = np.cross(side, c - a)
        foot = ((c - a) * side).sum(axis=1) / length2
        per_height = np.sqrt(length2) / (normal**2).sum(axis=1)  # of the unit normal
        weight = np.stack([foot - 1.0, -foot, np.ones(len(foot))], axis=1)
        turn = (self._share * per_height)[:, None, None] * weight[:, :, None] * normal[:, None]
        columns = 3 * self._corners[:, :, None] + np.arange(3)
        rows = np.broadcast_to(self._rotation[:, None, None], columns.shape)
        phi = _entries(turn, rows, columns, (self._shell.rotations, x.size))
        return sparse.csr_array(sparse.vstack([self._nodes, self._turned - phi @ self._nodes]))


def _entries(
    value: NDArray | float, row: NDArray, column: NDArray, shape: tuple[int, int]
) -> sparse.csr_array:
    """Sparse matrix with values in rows and columns of one shape; values at one place add up."""
    values = np.broadcast_to(value, row.shape).ravel()
    return sparse.coo_array((values, (row.ravel(), column.ravel())), shape=shape).tocsr()


def _refuse(case: Case) -> None:
    """Refuse what shapes of edges leave out."""
    structure = case.structure
    refuse_junctions(structure.pattern, "where superelements have no load factors; take fd.shell")
    if structure.options.rigid:
        raise InputError(
            ": superelements with rigid panels have no load factors; take fd.shell", "rigid"
        )
    if np.abs(structure.fold_rest - structure.pattern.dihedrals).max(initial=0.0) > BENT:
        raise InputError(
            ": creases at rest at other angles load the panels, which superelements leave out; "
            "take fd.shell",
            "crease_rest",
        )
