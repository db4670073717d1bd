"""Superelements as solvers see them: a linear sheet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at
from foldyn.mechanics.pullback import Arrays, Pulled, pullback
from foldyn.mechanics.sheet_term import Blocks, CreaseTurns, FoldHinges, SheetTerm
from foldyn.mechanics.term import ENERGIES, FORCES, CompiledTerm, Folds, energies, forces
from foldyn.mechanics.threads import Team, team

GROUPS: Mapping[str, str] = {
    "strain_panels": "strain energy of the panels",
    "strain_folds": "strain energy of the folds",
}


RESISTED = 1e-10  # stiffness of a rotation, relative to that of its parts, above which it counts


class _Matrix(NamedTuple):
    indptr: NDArray
    indices: NDArray
    data: NDArray  # N/m


def matrix(given: sparse.csr_array) -> _Matrix:
    """A sparse matrix for compiled functions."""
    return _Matrix(given.indptr.astype(np.int64), given.indices.astype(np.int64), given.data)


class Parts(NamedTuple):
    """Parts of a sheet, e of them: the stiffness is the sum of A' N A, with N shared by some.

    The first parts are the panels, which alone have mass; creases follow.
    """

    rows: _Matrix  # the amplitudes A of part after part
    first: NDArray  # (e + 1,) first row of each part
    at: NDArray  # (e,) place of its matrix N in `stiffness`
    stiffness: NDArray  # (k,) all N, flat
    mass: NDArray  # (l,) those of the panels alone, kg
    panels: int  # number of the panels
    scratch: NDArray  # (2, largest number of rows)


class _Backward(NamedTuple):
    parts: Parts
    stiffness: NDArray  # (k,) derivatives by `Parts.stiffness`
    panels: _Matrix
    folds: _Matrix


class _Context(NamedTuple):
    panels: _Matrix
    folds: _Matrix
    moved: NDArray  # (m,) forces of changed rest angles, N
    held: float  # energy of the folds at rest under these, J


class _Scratch(NamedTuple):
    """See `SheetTerm.scratches`; the kernels need none."""

    angle: NDArray
    fold_angle: NDArray
    own: NDArray
    team: Team


@inner_scalar
def _pull(matrix, q, i):
    """Force on a dof."""
    force = 0.0
    for k in range(matrix.indptr[i], matrix.indptr[i + 1]):
        force += matrix.data[k] * q[matrix.indices[k]]
    return force


@inner
def _add_products(parts, count, z, x, by, out):
    """Add the derivatives of by z' K x by all N to `out`; of the first `count` parts alone."""
    for e in range(count):
        first, size = parts.first[e], parts.first[e + 1] - parts.first[e]
        for i in range(size):
            parts.scratch[0, i] = by * _pull(parts.rows, z, first + i)
            parts.scratch[1, i] = _pull(parts.rows, x, first + i)
        for i in range(size):
            for j in range(size):
                out[parts.at[e] + i * size + j] += parts.scratch[0, i] * parts.scratch[1, j]


@kernel
def add_mass_products(parts, z, x, by, out):
    """Add the derivatives of by z' M x by `Parts.mass` to `out`, with z and x (m,)."""
    _add_products(parts, parts.panels, z, x, by, out)


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    size = own.panels.indptr.size - 1
    q, w, out = numbers_at(u, size), numbers_at(weight, size), numbers_at(product, size)
    for i in range(size):
        out[i] += _pull(own.panels, w, i) + _pull(own.folds, w, i)
    _add_products(own.parts, own.parts.at.size, w, q, 1.0, own.stiffness)


@forces
def _forces(own, u, v, t, force, powers):
    size = own.panels.indptr.size - 1
    q, out = numbers_at(u, size), numbers_at(force, size)
    for i in range(size):
        out[i] = _pull(own.panels, q, i) + _pull(own.folds, q, i) + own.moved[i]


@energies
def _energies(own, u, out):
    size = own.panels.indptr.size - 1
    q, energy = numbers_at(u, size), numbers_at(out, 2)
    energy[0], energy[1] = 0.0, own.held
    for i in range(size):
        energy[0] += 0.5 * _pull(own.panels, q, i) * q[i]
        energy[1] += (0.5 * _pull(own.folds, q, i) + own.moved[i]) * q[i]


class SuperelementsTerm(SheetTerm):
    """Condensed panels and creases about rest; see `mechanics.sheet_term.SheetTerm`.

    Parameters
    ----------
    panels, mass : (m, m)
        Stiffness and mass of the panels.
    turns : CreaseTurns
    slope : (nf,)
        Stiffness of the folds at rest, N m/rad.
    folds : FoldHinges
        One for each fold.
    nodes : (n, 3)
        Vertices, m.
    rotated : (h, 3)
        See `SheetTerm`.
    parts : callable
        Returns the parts that `panels`, `mass` and the stiffness of the folds are the sum of.
    """

    energy_groups = GROUPS
    mass: sparse.csr_array
    crease_turns: CreaseTurns
    rotated: NDArray

    def __init__(
        self, panels: sparse.csr_array, mass: sparse.csr_array, turns: CreaseTurns, slope: NDArray,
        folds: FoldHinges, nodes: NDArray, rotated: NDArray, parts: Callable[[], Parts],
    ) -> None:  # fmt: skip
        self._parts_of = parts
        self.mass, self.crease_turns, self._fold_hinges, self._panels = mass, turns, folds, panels
        self.rotated, self._slope, self._changed = rotated, slope, np.zeros(len(slope))
        self._folds = sparse.csr_array(turns.rows.T @ (turns.rows * slope[turns.fold][:, None]))
        self._stiffness = sparse.csr_array(panels + self._folds)
        self._nodes, self._extent = nodes, float(np.linalg.norm(np.ptp(nodes, axis=0)))
        self.model = None
        self.size = panels.shape[0]
        self.rows = -(-self.size // 3)
        self.hidden = np.arange(nodes.size, self.size)

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        turns, moment = self.crease_turns, self._slope * self._changed
        energy = 0.5 * float(moment @ self._changed)
        own = _Context(matrix(self._panels), matrix(self._folds), turns.mean.T @ moment, energy)
        return CompiledTerm(Context(own), {FORCES: _forces, ENERGIES: _energies})

    @cached_property
    def parts(self) -> Parts:
        """What the matrices are made of, for gradients."""
        return self._parts_of()

    def arrays(self) -> Arrays:
        """See `Term`."""
        parts = self.parts
        layout = {"shape of superelements": self._nodes, "first": parts.first, "at": parts.at}
        return Arrays({"stiffness": parts.stiffness, "mass": parts.mass}, layout)

    def pulled(self) -> Pulled:
        """See `Term`; the mass is differentiated by `add_mass_products`."""
        out = {name: np.zeros_like(getattr(self.parts, name)) for name in ("stiffness", "mass")}
        own = _Backward(self.parts, out["stiffness"], matrix(self._panels), matrix(self._folds))
        return Pulled(Context(own), _pullback, out)

    def scratches(self, threads: int) -> Sequence[_Scratch]:
        """See `SheetTerm`."""
        none = np.zeros(0)
        return [_Scratch(none, none, np.array([0, self.rows]), team(1)[0])]

    def blocks(self) -> Blocks:
        """See `SheetTerm`; implicit motions refuse superelements before they ask for blocks."""
        raise InputError("superelements have no blocks for implicit motions")

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `SheetTerm`; a copy, because other terms add to it."""
        return self._stiffness.copy()

    def folded(self, rest: NDArray) -> SuperelementsTerm:
        """See `SheetTerm`; a crease turns evenly by the change of its rest angle."""
        other = copy(self)
        other._changed = self._changed + rest - self.rest_angles
        other._fold_hinges = self._fold_hinges._replace(rest=rest)
        return other

    def anchored(self, place: NDArray) -> SuperelementsTerm:
        """See `Term`; only its tangent is that of these elements."""
        parts, other = self.parts, copy(self)
        shape = (len(parts.rows.indptr) - 1, self.size)
        rows = sparse.csr_array((parts.rows.data, parts.rows.indices, parts.rows.indptr), shape)
        blocks = []
        for at, (a, b) in zip(parts.at, pairwise(parts.first), strict=True):
            own = place[parts.rows.indices[parts.rows.indptr[a] : parts.rows.indptr[b]]].min() == 0
            size = b - a
            blocks.append(own * parts.stiffness[at : at + size**2].reshape(size, size))
        other._stiffness = sparse.csr_array(rows.T @ sparse.block_diag(blocks) @ rows)
        return other

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `Term`: clamped edges resist rotations of the whole."""
        arm = (self._nodes - self._nodes.mean(axis=0)) / self._extent
        turned = np.concatenate([np.cross(np.eye(3), own).T for own in arm])
        turned = np.concatenate([turned, self.rotated / self._extent])
        resisted, kinds = np.linalg.eigh(turned.T @ (self._stiffness @ turned))
        size = (np.abs(turned).T @ (abs(self._stiffness) @ np.abs(turned))).max()
        shifts = np.tile(np.eye(3), (len(arm), 1))
        moved = np.linalg.pinv(np.hstack([shifts, turned[: self._nodes.size]]))[3:]
        rows = kinds[:, resisted > RESISTED * size].T @ moved
        rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        return sparse.csr_array(np.pad(rows, ((0, 0), (0, self.size - rows.shape[1]))))

    @property
    def folds(self) -> Folds:
        """See `SheetTerm`; motions refuse superelements before they ask for actuated folds."""
        return Folds(np.zeros(0), np.zeros((0, 4)), np.zeros(0))

    def turn(self, q: NDArray, other: NDArray) -> float:
        """See `SheetTerm`."""
        return float(np.abs(self.crease_turns.rows @ (q - other)).max(initial=0.0))

    def scale(self) -> NDArray:
        """See `SheetTerm`."""
        return abs(self._stiffness).sum(axis=1) * self._extent

    def longest(self) -> float:
        """See `SheetTerm`."""
        return self._extent

    def fold_hinges(self) -> FoldHinges:
        """See `SheetTerm`; one for each fold, with the turns of `crease_turns`."""
        return self._fold_hinges

    @property
    def rest_angles(self) -> NDArray:
        """See `SheetTerm`."""
        return self._fold_hinges.rest
