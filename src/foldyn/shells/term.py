"""Shells as solvers see them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn import mechanics
from foldyn.errors import InputError
from foldyn.materials import HingeLaw, Superlinear
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of
from foldyn.mechanics.sheet_term import (
    NO_DOF,
    FoldHinges,
    SheetTerm,
    SoftHinges,
    largest_turn,
    unit_rows,
)
from foldyn.mechanics.step_tangent import FLOOR as STEP_FLOOR
from foldyn.mechanics.step_tangent import SparseBlocks
from foldyn.mechanics.term import Compiled, Folds
from foldyn.shells.kernels import (
    ShellModel,
    ShellWork,
    fold,
    ride,
    shell_kernels,
    shell_work,
)
from foldyn.shells.pullback import shell_pulled
from foldyn.shells.tangent import (
    ShellPattern,
    add_extrapolated_strain,
    add_mean_strain,
    shell_pattern,
    shell_tangent,
)
from foldyn.values import writable

GROUPS: Mapping[str, str] = {
    "strain_membrane": "strain energy of stretching",
    "strain_bending": "strain energy of bending",
    "strain_folds": "strain energy of the folds",
}
RANDOM = 0.05  # of rounding errors, how much is left where many of either sign add up


class ShellTerm(SheetTerm):
    """A shell of triangles; see `mechanics.sheet_term.SheetTerm`.

    Parameters
    ----------
    model : ShellModel
    crease : ndarray, shape (c,)
        The fold that each piece of a crease belongs to.
    law : HingeLaw
        Law of the folds.
    like : ShellTerm, optional
        One with the same mesh.
    """

    energy_groups = GROUPS

    def __init__(
        self, model: ShellModel, crease: NDArray, law: HingeLaw, like: ShellTerm | None = None
    ) -> None:
        self.model, self._crease, self._law, self._like = model, crease, law, like
        self._nodal = 3 * model.nodes
        self.size, self.rows = self._nodal + model.rotations, model.rows
        self.hidden = np.arange(self._nodal, self.size)
        self.per_hidden = model.per_reach

    def _with(self, model: ShellModel) -> ShellTerm:
        """Another sheet of the same mesh."""
        return ShellTerm(model, self._crease, self._law, self)

    def _split(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Displacements (n, 3) and rotations (r,)."""
        flat = writable(q).reshape(-1)
        return flat[: self._nodal].reshape(-1, 3), flat[self._nodal : self.size]

    @cached_property
    def sparsity(self) -> ShellPattern:
        """Pattern of the tangent."""
        return self._like.sparsity if self._like else shell_pattern(self.model)

    def hinges_alone(self) -> ShellTerm:
        """See `SheetTerm`: bending and folds."""
        return self._with(self.model._replace(membrane=np.zeros_like(self.model.membrane)))

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `SheetTerm`."""
        return shell_tangent(self.model, self.sparsity, *self._split(q), floor)

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `SheetTerm`."""
        matrix = self.tangent(q, self._floor)
        if before is not None:
            u, old = self._split(q)[0], self._split(before)[0]
            add_extrapolated_strain(self.model, self.sparsity, u, old, matrix.data)
        return matrix

    def mean_tangent(
        self, q0: NDArray, q1: NDArray, angle: NDArray, before: NDArray, again: bool
    ) -> sparse.csr_array:
        """See `SheetTerm`."""
        matrix = self.tangent(0.5 * (q0 + q1), self._floor)
        u0, u1, old = (self._split(q)[0] for q in (q0, q1, before))
        add_mean_strain(self.model, self.sparsity, u0, u1, old, again, matrix.data)
        return 0.5 * matrix

    @property
    def _floor(self) -> float:
        """Least slope of the folds in steps; slopes of a user's law may fall on purpose."""
        return -np.inf if self.model.code < 0 else STEP_FLOOR

    def blocks(self) -> SparseBlocks:
        """See `SheetTerm`."""
        pattern = self.sparsity
        entries = (np.zeros(len(pattern.indices)), pattern.indices, pattern.indptr)
        matrix = sparse.csr_array(entries, (self.size, self.size))
        return SparseBlocks(matrix, self.rows, positions(self.model))

    def workspaces(self, threads: int) -> list[ShellWork]:
        """See `SheetTerm`."""
        return [shell_work(self.model)]

    def compiled(self, work: Any, kept: ShellWork, group: int) -> Compiled:
        """See `Term`."""
        return shell_kernels(self.model, kept)

    def arrays(self) -> Arrays:
        """See `Term`."""
        return arrays_of(self.model, "addresses")

    def pulled(self) -> Pulled:
        """See `Term`."""
        return shell_pulled(self.model)

    @property
    def hinges(self) -> NDArray:
        """See `SheetTerm`."""
        return self.model.hinges

    @property
    def folds(self) -> Folds:
        """See `SheetTerm`."""
        model = self.model
        return Folds(model.piece_rest, model.piece_parameters, model.piece_stiffness)

    def angles(self, q: NDArray) -> NDArray:
        """See `SheetTerm`."""
        model, u = self.model, self._split(q)[0]
        x = model.rest.copy()
        x[: model.nodes] += u
        for j, k, _, wing in model.hinges[model.hinges[:, 3] >= model.nodes].tolist():
            x[wing] += 0.5 * (u[j] + u[k])
        return mechanics.angles(x, model.hinges.astype(np.uint32))

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `SheetTerm`: clamped edges as they turn."""
        model, (u, x) = self.model, self._split(q)
        rows = np.flatnonzero(model.hinges[:, 3] >= model.nodes)
        work = shell_work(model)
        if len(rows):
            fold(model, u, x, work)
            ride(model, u, work)
        turns = work.gradient[rows]
        turns[:, :6] += 0.5 * np.tile(turns[:, 9:], (1, 2))
        return unit_rows(model.hinges[rows, :3], turns[:, :9], self.size)

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn of a triangle's side, of a hinge or of a fold; inf on penetration."""
        shift, tri = self._split(other - q)[0], self.model.triangles
        apart = np.linalg.norm(shift[np.roll(tri, -1, axis=1)] - shift[tri], axis=2)
        sides = float((apart * np.sqrt(self.model.per_length2)).max(initial=0.0))
        return largest_turn(sides, self.angles(q), self.angles(other))

    def plate_energies(self, q: NDArray, strain: NDArray, turn: NDArray) -> NDArray:
        """See `SheetTerm`: of stretching and bending."""
        model, work, (u, x) = self.model, shell_work(self.model), self._split(q)
        fold(model, u, x, work)
        ride(model, u, work)
        apart = u[np.roll(model.triangles, -1, axis=1)] - u[model.triangles]
        longer = np.einsum("tkc,tkc->tk", apart, 2.0 * model.side + apart)
        green = 0.5 * longer * model.per_length2
        beta = np.append(work.turn, 0.0)[model.hinge] * model.weight  # without one: number -1
        beta += model.sign * model.per_reach * np.append(x, 0.0)[model.rotation]
        if strain.size:
            green, beta = green - strain.reshape(-1, 3), beta - turn.reshape(-1, 3)
        stretching = np.einsum("tk,tkm,tm->t", green, model.membrane, green)
        return 0.5 * (stretching + np.einsum("tk,tkm,tm->t", beta, model.bending, beta))

    def scale(self) -> NDArray:
        """Stiffness of the triangles' sides in the plane times their lengths, summed at nodes.

        Turns of sides come from positions, whose rounding errors small triangles feel: with them
        the moments of a turn by what lies between node and origin, over a triangle's height. These
        errors are random, about a twentieth of what they could add up to.
        """
        model = self.model
        stiff = np.abs(model.membrane).sum(axis=2) * np.sqrt(model.per_length2)
        double = np.linalg.norm(np.cross(model.side[:, 0], model.side[:, 1]), axis=1)
        height = double * np.sqrt(model.per_length2.min(axis=1))
        reach = np.linalg.norm(model.rest, axis=1).max(initial=0.0)
        stiff += RANDOM * np.abs(model.bending).sum(axis=2) * (reach / height**2)[:, None]
        nodal = np.zeros(model.nodes)
        for end in (0, -1):
            np.add.at(nodal, np.roll(model.triangles, end, axis=1), stiff)
        bending = model.per_reach * np.abs(model.bending).sum(axis=(1, 2)).max(initial=0.0)
        return np.concatenate([np.repeat(nodal, 3), np.full(len(self.hidden), bending)])

    def turning_moments(self) -> float:
        """See `SheetTerm`."""
        return float(np.abs(self.model.bending).sum() + self.model.piece_stiffness.sum())

    def longest(self) -> float:
        """See `SheetTerm`."""
        return float(1.0 / np.sqrt(self.model.per_length2.min()))

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """See `SheetTerm`: none."""
        if self.model.code == Superlinear.code:
            raise InputError(
                ' = "superlinear": the folds of a shell have no slope at rest; modes and '
                'frequency responses of shells take "linear" or "enhanced"',
                "fold_law",
            )
        return super().soft_hinges(q)

    @property
    def rest_angles(self) -> NDArray:
        """See `SheetTerm`: of the folds, the mean along each crease."""
        return np.bincount(self._crease, self.model.piece_rest) / np.bincount(self._crease)

    def rest_law(self, number: int) -> HingeLaw:
        """See `SheetTerm`."""
        return self._law

    def fold_hinges(self) -> FoldHinges:
        """See `SheetTerm`: the pieces of the creases."""
        model = self.model
        nodes = model.hinges[model.piece_hinge]
        turns = model.piece_rotations
        hidden = np.where(turns >= 0, self._nodal + turns, NO_DOF)
        return FoldHinges(
            self._crease, nodes, model.rest[nodes], hidden, model.per_reach, model.piece_rest,
            model.piece_stiffness, np.zeros(len(nodes)), np.arange(len(nodes)),
        )  # fmt: skip

    def folded(self, rest: NDArray) -> ShellTerm:
        """See `SheetTerm`."""
        angle = self.model.piece_rest + (rest - self.rest_angles)[self._crease]
        parameters = self._law.parameters(angle).reshape(-1, 4)
        return self._with(self.model._replace(piece_rest=angle, piece_parameters=parameters))

    def actuated(self, numbers: NDArray) -> tuple[ShellTerm, NDArray, NDArray]:
        """See `SheetTerm`."""
        model = self.model
        own = model._replace(
            piece_rest=model.piece_rest.copy(), piece_parameters=model.piece_parameters.copy()
        )
        pieces = [np.flatnonzero(self._crease == fold) for fold in numbers]
        place = np.repeat(np.arange(len(numbers)), [len(each) for each in pieces])
        return self._with(own), np.concatenate([np.zeros(0, np.int64), *pieces]), place

    def turned(self) -> tuple[NDArray, NDArray]:
        """See `SheetTerm`."""
        return self.model.piece_rest, self.model.piece_hinge


def positions(model: ShellModel) -> NDArray:
    """Where the dofs are in the shell (3 rows, 3): rotations in the middle of their sides."""
    points = np.zeros((3 * model.rows, 3))
    n, tri = model.nodes, model.triangles
    points[: 3 * n] = np.repeat(model.rest[:n], 3, axis=0)
    middle = 0.5 * (model.rest[tri] + model.rest[np.roll(tri, -1, axis=1)])
    has = model.rotation >= 0
    points[3 * n + model.rotation[has]] = middle[has]
    return points
