"""Buckling of superelements: the tangent of their panels' mesh, in shapes of the edges.

Superelements are linear. Their panels are meshes of a shell (`shells`), which has the exact tangent
of large displacements. Its nodes on edges move by the shapes of the superelements, and the sheet
turns about the sides there by theirs; inside, each panel is free. The rotations of a shell are
relative to its triangles, so that a turn psi of the sheet about a side on an edge is that of the
triangle, phi, less the rotation. phi changes with the nodes as they are in the loaded state:
otherwise moments along welds would couple the insides of panels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.load_factors import LoadFactors, Softening
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.substructures import Substructures
from foldyn.algebra.superlu import SingularTangentError
from foldyn.cases import Case
from foldyn.cases.connectors import Connector
from foldyn.condensation import Superelements
from foldyn.errors import InputError
from foldyn.linear.buckling_base import FARTHEST, STEP, Base, unstable, warn_of_asymmetry
from foldyn.linear.shell_of import shell_of
from foldyn.mechanics.following import asymmetry
from foldyn.patterns.pattern import refuse_junctions
from foldyn.shells import Shell
from foldyn.statics import OrigamiProblem
from foldyn.statics.tracing import refuse_mechanisms

BENT = 1e-6  # rad: creases whose rest angle is farther from their dihedral load the panels


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
        springs = [one for one in self.case.supports if isinstance(one, Connector)]
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
        put = _entries(
            1.0, 3 * nodes[:, None] + axis, 3 * first[:, None] + axis, (x.size, along.shape[0])
        )
        # sides of triangles on edges
        a, b, c = (np.roll(tri, -k, axis=1).ravel() for k in range(3))
        low, high = ends[:, :-1].ravel(), ends[:, 1:].ravel()
        own, wanted = (
            np.minimum(i, j) * len(x) + np.maximum(i, j) for i, j in ((low, high), (a, b))
        )
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
