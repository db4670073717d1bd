"""What solvers know of a structure: forces, tangent and energies on a flat vector of dofs.

The dofs are 3 node + axis, then those without mass that a shell has beside them. Bars and hinges
and shells look the same from here; `body_of` makes the one that belongs to a structure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn import mechanics
from foldyn.mechanics import BarsHinges
from foldyn.shells import Shell
from foldyn.shells.balance import balanced_rotations
from foldyn.shells.extrapolated import add_extrapolated_strain
from foldyn.shells.kernels import ShellModel, shell_energy, shell_force, shell_work
from foldyn.shells.shell import GROUPS as SHELL_GROUPS
from foldyn.shells.tangent import shell_tangent
from foldyn.statics.mixed import add_extrapolated_stress
from foldyn.structures import Structure
from foldyn.structures.structure import GROUPS

FLOOR = 1e-3  # of a hinge's stiffness: its least slope in steps, as in MERLIN2


class Body(Protocol):
    """A structure with its folds' rest angles; m dofs.

    Attributes
    ----------
    size : int
        Number m of the dofs.
    groups : tuple of str
        Names of the parts of the energy.
    hidden : ndarray of int
        Dofs beside the displacements of the nodes.
    model
        The arrays of its kernels.
    """

    size: int
    groups: tuple[str, ...]
    hidden: NDArray
    model: Any

    def folded(self, rest: NDArray) -> Body:
        """The body with other rest angles of its folds (nf,), rad."""
        ...

    def rest_angles(self) -> NDArray:
        """Rest angles of the folds (nf,), rad."""
        ...

    def scale(self) -> NDArray:
        """Forces (m,) at the dofs under a strain of one, whose rounding errors stay."""
        ...

    def dofs(self, displacement: NDArray) -> NDArray:
        """Vector (m,) of displacements (n, 3), the hidden dofs in balance."""
        ...

    def internal(self, q: NDArray) -> NDArray:
        """Internal forces (m,)."""
        ...

    def hinge_forces(self, q: NDArray) -> NDArray:
        """Those of the hinges (of bending and folds) alone."""
        ...

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Their derivative (m, m); slopes per unit stiffness below `floor` are raised to it."""
        ...

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """The matrix that a step of Newton's method takes at q, after one from `before`."""
        ...

    def energies(self, q: NDArray) -> NDArray:
        """Strain energies (J) by group."""
        ...

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn (rad) of a part between two states; inf if parts collide."""
        ...


class BarsHingesBody:
    """A structure of bars and hinges; see `Body`."""

    groups: tuple[str, ...] = GROUPS

    def __init__(self, structure: Structure, model: BarsHinges | None = None) -> None:
        self.structure = structure
        self.model = structure.model if model is None else model
        self.size = structure.nodes.size
        self.hidden = np.zeros(0, np.int64)
        self._shape = structure.nodes.shape
        self._work = mechanics.workspace(self.model)

    def folded(self, rest: NDArray) -> BarsHingesBody:
        """See `Body`."""
        rows = self.structure.hinge_of_fold
        angle, parameters = self.model.hinge_rest.copy(), self.model.hinge_parameters.copy()
        angle[rows] = rest
        parameters[rows] = self.structure.fold_law.parameters(rest)
        model = self.model._replace(hinge_rest=angle, hinge_parameters=parameters)
        return BarsHingesBody(self.structure, model)

    def rest_angles(self) -> NDArray:
        """See `Body`."""
        return self.structure.fold_rest

    def scale(self) -> NDArray:
        """EA of the bars, summed at the nodes."""
        ea = self.structure.sheet.youngs_modulus * self.structure.bar_area
        nodal = np.zeros(len(self.structure.nodes))
        np.add.at(nodal, self.structure.bars, ea[:, None])
        return np.repeat(nodal, 3)

    def dofs(self, displacement: NDArray) -> NDArray:
        """See `Body`."""
        return np.asarray(displacement, float).ravel()

    def internal(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self._internal(self.model, q)

    def hinge_forces(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self._internal(self.model._replace(bar_runs=self.model.bar_runs[:0]), q)

    def _internal(self, model: BarsHinges, q: NDArray) -> NDArray:
        force = np.empty(self._shape)
        state = np.ascontiguousarray(q.reshape(self._shape))
        mechanics.internal_force(model, state, force, self._work)
        return force.ravel()

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        state = q.reshape(self._shape)
        return mechanics.tangent(self.model, self.structure.sparsity, state, floor).tocsr()

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `Body`.

        Slopes of the built-in hinge laws are raised to `FLOOR`; those of a user's own law, which
        may fall on purpose, are exact. With the state `before` the last step, the bars' stresses
        are extrapolated from there (see `statics.mixed`).
        """
        model, state, pattern = self.model, q.reshape(self._shape), self.structure.sparsity
        runs = model.hinge_runs
        own = runs[:, 2] < 0
        matrix = mechanics.tangent(model._replace(hinge_runs=runs[~own]), pattern, state, FLOOR)
        if own.any():
            exact = model._replace(hinge_runs=runs[own], bar_runs=model.bar_runs[:0])
            matrix.data += mechanics.tangent(exact, pattern, state).data
        if before is not None:
            law, old = self.structure.bar_law, before.reshape(self._shape)
            add_extrapolated_stress(model, pattern, law, state, old, matrix.data)
        return matrix.tocsr()

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`."""
        out = np.empty(3)
        mechanics.strain_energies(self.model, q.reshape(self._shape), out)
        return out

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn of a hinge, or of a bar with the rest of it; inf on penetration."""
        model, structure = self.model, self.structure
        shift = (other - q).reshape(self._shape)
        apart = np.linalg.norm(shift[structure.bars[:, 1]] - shift[structure.bars[:, 0]], axis=1)
        largest = float((apart / structure.bar_length).max(initial=0.0))
        before = mechanics.angles(model.rest + q.reshape(self._shape), model.hinges)
        after = mechanics.angles(model.rest + other.reshape(self._shape), model.hinges)
        return _turn(largest, before, after)


class ShellBody:
    """A shell of triangles; see `Body`."""

    groups: tuple[str, ...] = SHELL_GROUPS

    def __init__(self, structure: Shell, model: ShellModel | None = None) -> None:
        self.structure = structure
        self.model = structure.model if model is None else model
        self._nodes = structure.nodes.size
        self.size = self._nodes + structure.rotations
        self.hidden = np.arange(self._nodes, self.size)
        self._work = shell_work(self.model)

    def _split(self, q: NDArray) -> tuple[NDArray, NDArray]:
        u = np.ascontiguousarray(q[: self._nodes]).reshape(-1, 3)
        return u, np.ascontiguousarray(q[self._nodes :])

    def folded(self, rest: NDArray) -> ShellBody:
        """See `Body`."""
        change = rest - self.structure.fold_rest
        angle = self.structure.piece_rest + change[self.structure.sides.piece_crease]
        model = self.model._replace(
            piece_rest=angle,
            piece_parameters=self.structure.fold_law.parameters(angle).reshape(-1, 4),
        )
        return ShellBody(self.structure, model)

    def rest_angles(self) -> NDArray:
        """See `Body`."""
        return self.structure.fold_rest

    def scale(self) -> NDArray:
        """Stiffness of the triangles' sides in the plane times their lengths, summed at nodes."""
        model = self.model
        stiff = np.abs(model.membrane).sum(axis=2) * np.sqrt(model.per_length2)
        nodal = np.zeros(self._nodes // 3)
        for end in (0, -1):
            np.add.at(nodal, np.roll(model.triangles, end, axis=1), stiff)
        bending = model.per_reach * np.abs(model.bending).sum(axis=(1, 2)).max(initial=0.0)
        return np.concatenate([np.repeat(nodal, 3), np.full(len(self.hidden), bending)])

    def dofs(self, displacement: NDArray) -> NDArray:
        """See `Body`."""
        u = np.ascontiguousarray(displacement, float).reshape(-1, 3)
        rotation = balanced_rotations(self.model, self.structure.sparsity, u)
        return np.concatenate([u.ravel(), rotation])

    def internal(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self._internal(self.model, q)

    def hinge_forces(self, q: NDArray) -> NDArray:
        """See `Body`."""
        return self._internal(self.model._replace(membrane=np.zeros_like(self.model.membrane)), q)

    def _internal(self, model: ShellModel, q: NDArray) -> NDArray:
        u, x = self._split(q)
        out = np.empty(self.size)
        force, couple = out[: self._nodes].reshape(-1, 3), out[self._nodes :]
        shell_force(model, u, x, force, couple, self._work)
        return out

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        u, x = self._split(q)
        return shell_tangent(self.model, self.structure.sparsity, u, x, self._work, floor)

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `Body`."""
        own = self.model.code < 0  # slopes of a user's law may fall on purpose
        matrix = self.tangent(q, -np.inf if own else FLOOR)
        if before is not None:
            u, old = self._split(q)[0], self._split(before)[0]
            add_extrapolated_strain(self.model, self.structure.sparsity, u, old, matrix.data)
        return matrix

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`."""
        u, x = self._split(q)
        out = np.empty(3)
        shell_energy(self.model, u, x, self._work, out)
        return out

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn of a triangle's side, of a hinge or of a fold; inf on penetration."""
        model, tri = self.model, self.model.triangles
        shift = (other - q)[: self._nodes].reshape(-1, 3)
        apart = np.linalg.norm(shift[np.roll(tri, -1, axis=1)] - shift[tri], axis=2)
        largest = float((apart * np.sqrt(model.per_length2)).max(initial=0.0))
        return _turn(largest, self._angles(q), self._angles(other))

    def _angles(self, q: NDArray) -> NDArray:
        points = self.model.rest.copy()
        points[: self._nodes // 3] += q[: self._nodes].reshape(-1, 3)
        return mechanics.angles(points, self.model.hinges.astype(np.uint32))


def _turn(largest: float, before: NDArray, after: NDArray) -> float:
    hinges = float(np.abs(after - before).max(initial=0.0))
    if hinges > math.pi or not np.isfinite(hinges + largest):
        return math.inf
    return max(largest, hinges)


BODIES: Mapping[type, Callable[[Any], Body]] = {Structure: BarsHingesBody, Shell: ShellBody}


def body_of(structure: Any) -> Body:
    """The body of a structure."""
    return BODIES[type(structure)](structure)
