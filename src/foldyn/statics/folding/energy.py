"""The energy that folding minimizes: stiff panels, soft creases with moving rest angles.

Panels are cut into triangles. With l and L the length of a bar now and in the flat panel, theta the
fold angle of a hinge (pi less its dihedral) and all lengths in units of the mean bar,

    E = 1/2 sum L (l/L - 1)^2 + 1/2 b sum L (theta - theta0)^2   bars, bends within panels
      + 1/2 c sum L (theta - theta*)^2                           driven creases
      + 1/2 s sum L (shortfall^2 + excess^2)                     mountains and valleys,

where a mountain or valley falls short if it has turned its own way by less than a margin, and
exceeds if it has turned by more than is allowed, at most 180 degrees: beyond, its panels would have
passed through each other. This is the energy of bars and hinges with linear laws; s is a one-sided
law. It is a sum of squares, so that the Gauss-Newton matrix is positive semidefinite everywhere.
The tangent stiffness is not: in the flat state it is singular in every direction that folds.

A bar or hinge with the strain or turn q has the gradient g and adds slope g g' to the matrix of a
step: the Gauss-Newton part. The second part is its force or moment times the second derivative of
q. Entries are stored as they are factorized: in a band, with the nodes numbered along the sheet, or
in a sparse matrix if that band would be too wide.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.algebra.banded import Cholesky
from foldyn.algebra.solvers import factorizer, takes_band
from foldyn.algebra.superlu import SingularTangentError, Solution
from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.mechanics.dihedral import add_hessian, dihedrals_and_gradients
from foldyn.mechanics.model import ranks
from foldyn.patterns import Pattern
from foldyn.structures.mesh import lengths, n4b5

SIGNS = {"M": -1.0, "V": 1.0, "F": 0.0, "U": 0.0}
"""Sign of the fold angle of each assignment; 0 if a crease may fold either way."""


class Places(NamedTuple):
    """Places of p x p node blocks of k elements: entry (a, b) at start + a + stride b."""

    start: NDArray  # -1 for blocks whose transpose is stored
    stride: NDArray


class Parts(NamedTuple):
    """Contributions of bars (p = 2) or hinges (p = 4) to a matrix."""

    gradients: NDArray  # (k, 3 p) of strains or turns
    slopes: NDArray  # (k,)
    pulls: NDArray  # (k,)


class Curvature:
    """Matrices of bars (nb, 2) and hinges (nh, 4) on a given number of nodes."""

    def __init__(self, bars: NDArray, hinges: NDArray, nodes: int) -> None:
        self._bars, self._hinges = bars.astype(np.int64), hinges.astype(np.int64)
        own = np.repeat(np.arange(nodes), 2).reshape(-1, 2)
        pairs = np.concatenate([pairs_within(self._bars), pairs_within(self._hinges), own])
        graph = sparse.csr_array(_graph(pairs, nodes))
        order = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
        row, column = ranks(order)[pairs].T
        self._dofs = (3 * order[:, None] + np.arange(3)).ravel()
        size, width = 3 * nodes, 3 * int(np.abs(row - column).max()) + 2
        self._band = takes_band(size, width, True)
        if self._band:
            self._shape = size, width + 1
            stride = np.full(len(row), width)
            start = np.where(row > column, -1, width + 3 * row + 3 * column * width)
        else:
            self._factorizer = factorizer("auto", size)[1]
            blocks = _graph(np.column_stack([row, column]), nodes)
            full = sparse.bsr_array(
                (np.ones((len(blocks.indices), 3, 3)), blocks.indices, blocks.indptr)
            ).tocsr()
            self._shape, self._pattern = full.shape, (full.indices, full.indptr)
            first = blocks.indptr.astype(np.int64)
            here = np.repeat(np.arange(nodes), np.diff(first))
            place = np.searchsorted(here * nodes + blocks.indices, column * nodes + row)
            stride, start = 3 * np.diff(first)[column], 3 * (place + 2 * first[column])
        ends = np.cumsum([4 * len(bars), 16 * len(hinges)])
        (*self._places, own) = (
            Places(one.reshape(-1, p, p), other.reshape(-1, p, p))
            for p, one, other in zip(
                (2, 4, 1), np.split(start, ends), np.split(stride, ends), strict=True
            )
        )
        self._diagonal = (own.start[:, 0] + np.arange(3) * (own.stride[:, 0] + 1)).ravel()

    def matrix(self, x: NDArray, bars: Parts, hinges: Parts) -> NDArray:
        """Entries of the matrix at positions x (n, 3), in the storage that is factorized."""
        out = np.zeros(np.prod(self._shape) if self._band else len(self._pattern[0]))
        _put(x, self._bars, bars, self._places[0], self._band, out)
        _put(x, self._hinges, hinges, self._places[1], self._band, out)
        return out

    def factorized(self, entries: NDArray, damping: float) -> Callable[[NDArray], NDArray] | None:
        """Solver from forces (m,) to steps (n, 3); None if the matrix is not positive definite.

        damping : added to the diagonal, as a fraction of its mean.
        """
        damped = entries.copy()
        damped[self._diagonal] += damping * entries[self._diagonal].mean()
        try:
            if self._band:
                factors: Solution = Cholesky(damped.reshape(self._shape).T)
            else:
                matrix = sparse.csc_array((damped, *self._pattern), self._shape)
                factors = indefinite = self._factorizer(matrix)
                if indefinite.negative():
                    return None
        except SingularTangentError:
            return None

        def solution(force: NDArray) -> NDArray:
            out = np.empty(len(force))
            out[self._dofs] = factors.solve(force[self._dofs])
            return out.reshape(-1, 3)

        return solution


def _graph(pairs: NDArray, nodes: int) -> sparse.csc_array:
    """Pairs (k, 2) of nodes as a sparsity pattern by columns, sorted."""
    graph = sparse.coo_array((np.ones(len(pairs)), tuple(pairs.T)), (nodes, nodes)).tocsc()
    graph.sort_indices()
    return graph


@inner
def _add_stretch(points, gradient, pull, block):
    """Add pull times the second derivative of the strain of a bar to `block` (2, 3, 2, 3)."""
    x, y, z = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1], points[1, 2] - points[0, 2]
    length, per_rest = math.sqrt(x * x + y * y + z * z), 0.0
    for c in range(3):
        per_rest += gradient[1, c] ** 2
    per_rest = math.sqrt(per_rest)
    for a in range(3):
        for b in range(3):
            value = -gradient[1, a] * gradient[1, b] / (per_rest * length)
            value = pull * (value + (per_rest / length if a == b else 0.0))
            block[0, a, 0, b] += value
            block[1, a, 1, b] += value
            block[0, a, 1, b] -= value
            block[1, a, 0, b] -= value


@kernel
def _put(x, nodes, parts, places, upper, out):
    """Add the matrices of elements between `nodes` (k, p), or their `upper` triangles.

    x : (n, 3) positions.
    """
    count = nodes.shape[1]
    points, opening = np.empty((count, 3)), np.empty((count, 3))
    block = np.empty((count, 3, count, 3))
    for e in range(nodes.shape[0]):
        slope, pull = parts.slopes[e], parts.pulls[e]
        gradient = parts.gradients[e].reshape(count, 3)
        block[:] = 0.0
        for v in range(count if pull != 0.0 else 0):
            for c in range(3):
                points[v, c], opening[v, c] = x[nodes[e, v], c], -gradient[v, c]
        if pull != 0.0 and count == 4:
            add_hessian(points, opening, -pull, block)  # a turn is pi less the dihedral
        elif pull != 0.0:
            _add_stretch(points, gradient, pull, block)
        for v in range(count):
            for w in range(count):
                start, stride = places.start[e, v, w], places.stride[e, v, w]
                for a in range(3 if start >= 0 else 0):
                    for b in range(a if upper and v == w else 0, 3):
                        value = block[v, a, w, b] + slope * gradient[v, a] * gradient[w, b]
                        out[start + a + stride * b] += value


class Stiffness(NamedTuple):
    """Stiffnesses of hinges, relative to the bars."""

    bends: float
    creases: float
    sides: float


class Aim(NamedTuple):
    """Rest angles (nc,) of creases, nan if free; least and largest turns (nc,), rad."""

    angles: NDArray
    least: NDArray
    most: NDArray


class Shape(NamedTuple):
    """A state: positions (n, 3) in mean bar lengths, turns (nh,), strains (nb,), energy."""

    x: NDArray
    turns: NDArray
    strains: NDArray
    energy: float


class Evaluated(NamedTuple):
    """A shape with its energy and the parts of its gradient and matrix."""

    shape: Shape
    bars: Parts
    hinges: Parts


class FoldEnergy:
    """Folding energy of a pattern; its welds and undriven flat creases count as bends.

    Attributes
    ----------
    signs : (nc,)
        Sign of the fold angle of each crease, 0 for flat and unassigned ones.
    stiff : (nc,)
        Whether a crease belongs to a panel.
    bends : int
        Number of hinges within panels or on welds, which precede the creases.
    size : float
        Mean length of the bars, m.
    """

    def __init__(self, pattern: Pattern, stiff: NDArray) -> None:
        mesh = n4b5(pattern)
        bars = np.concatenate([mesh.inner, pattern.edges])
        hinges = np.concatenate([mesh.bends, mesh.welds, mesh.folds])
        self.triangles, self.triangle_panel = mesh.triangles, mesh.triangle_panel
        self.diagonals, self.diagonal_panel = mesh.inner, mesh.inner_panel
        self.bends, self.stiff = len(mesh.bends) + len(mesh.welds), stiff
        self.signs = np.where(stiff, 0.0, [SIGNS[letter] for letter in pattern.assignments])
        self.size = float(lengths(pattern.vertices, bars).mean())
        self.center = pattern.vertices.mean(axis=0)
        x = (pattern.vertices - self.center) / self.size
        self._bars, self._hinges = bars, np.ascontiguousarray(hinges, np.uint32)
        self._length, self._axis = lengths(x, bars), lengths(x, hinges[:, :2])
        self.curvature = Curvature(bars, hinges, len(x))
        turns, _ = self._turns(x, np.zeros(len(hinges)))
        # the letter, not the geometry, decides which way a closed crease has turned
        apart = math.pi - pattern.dihedrals - turns[self.bends :]
        turns[self.bends :] += 2.0 * math.pi * np.round(apart / (2.0 * math.pi))
        self.rest = turns.copy()
        self.start = Shape(x, turns, np.zeros(len(bars)), 0.0)

    def creases(self, turns: NDArray) -> NDArray:
        """Fold angles (nc,), rad, of the creases, from the turns of all hinges."""
        return turns[self.bends :]

    def bent(self, turns: NDArray) -> NDArray:
        """Turns (rad) of hinges within panels, flat creases among them."""
        stiff = np.concatenate([np.ones(self.bends, bool), self.stiff])
        return np.abs(turns - self.rest)[stiff]

    def place(self, x: NDArray) -> NDArray:
        """Positions (n, 3), m, from dimensionless ones."""
        return x * self.size + self.center

    def moved(self, shape: Shape, x: NDArray) -> Shape:
        """Shape at other positions; assumes that no hinge turns by more than pi."""
        strains, _ = self._stretch(x)
        turns, _ = self._turns(x, shape.turns)
        return Shape(x, turns, strains, math.nan)

    def evaluated(self, near: Shape, x: NDArray, aim: Aim, stiffness: Stiffness) -> Evaluated:
        """Energy, gradient and matrix at positions x (n, 3) near a shape."""
        strains, along = self._stretch(x)
        turns, gradients = self._turns(x, near.turns)
        driven = ~np.isnan(aim.angles) & ~self.stiff
        weight = np.full(len(turns), stiffness.bends)
        weight[self.bends :] = np.where(
            self.stiff, stiffness.bends, np.where(driven, stiffness.creases, 0.0)
        )
        rest = self.rest.copy()
        rest[self.bends :][driven] = aim.angles[driven]
        own = self.signs * self.creases(turns)
        beyond = np.minimum(own - aim.least, 0.0) + np.maximum(own - aim.most, 0.0)
        beyond = np.where(self.signs != 0.0, beyond, 0.0)
        offset = turns - rest
        pull, slope = weight * offset, weight
        slope[self.bends :] += stiffness.sides * (beyond != 0.0)
        twice = self._length @ strains**2 + self._axis @ (pull * offset)
        twice += stiffness.sides * (self._axis[self.bends :] @ beyond**2)
        pull[self.bends :] += stiffness.sides * self.signs * beyond
        return Evaluated(
            Shape(x, turns, strains, 0.5 * float(twice)),
            Parts(np.hstack([-along, along]), self._length, self._length * strains),
            Parts(gradients, self._axis * slope, self._axis * pull),
        )

    def gradient(
        self, at: Evaluated, first: Evaluated | None = None,
        pulls: tuple[NDArray, NDArray] | None = None,
    ) -> NDArray:  # fmt: skip
        """Gradient (m,) of the energy.

        pulls : forces of bars and moments of hinges that act along their gradients here; the rest
            acts along the gradients at the `first` shape, whose matrix the step uses.
        """
        out = np.zeros(at.shape.x.size)
        here = pulls or (at.bars.pulls, at.hinges.pulls)
        for nodes, own, old, pull in zip(
            (self._bars, self._hinges), at[1:], (first or at)[1:], here, strict=True
        ):
            rest = own.pulls - pull
            forces = own.gradients * pull[:, None] + old.gradients * rest[:, None]
            out += np.bincount(_dofs(nodes).ravel(), forces.ravel(), out.size)
        return out

    def expected(self, at: Evaluated, first: Evaluated, step: NDArray) -> tuple[NDArray, NDArray]:
        """Forces of bars (nb,) and moments of hinges (nh,) after a step (n, 3), to first order.

        first : as in `gradient`.
        """
        bars, hinges = (
            own.pulls
            + old.slopes * np.einsum("kd,kd->k", old.gradients, step[nodes].reshape(len(nodes), -1))
            for nodes, own, old in zip((self._bars, self._hinges), at[1:], first[1:], strict=True)
        )
        return bars, hinges

    def matrix(self, at: Evaluated, pulls: tuple[NDArray, NDArray] | None = None) -> NDArray:
        """Entries of the matrix with these forces and moments, or of its Gauss-Newton part."""
        pulls = pulls or (0.0 * at.bars.pulls, 0.0 * at.hinges.pulls)
        parts = (own._replace(pulls=pull) for own, pull in zip(at[1:], pulls, strict=True))
        return self.curvature.matrix(at.shape.x, *parts)

    def _stretch(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Strains (nb,) of bars and their gradients (nb, 3) with respect to the second end."""
        span = x[self._bars[:, 1]] - x[self._bars[:, 0]]
        length = np.linalg.norm(span, axis=1)
        return length / self._length - 1.0, span / (length * self._length)[:, None]

    def _turns(self, x: NDArray, near: NDArray) -> tuple[NDArray, NDArray]:
        """Turns (nh,), each within pi of `near`, and their gradients (nh, 12)."""
        dihedral, gradient = dihedrals_and_gradients(np.ascontiguousarray(x), self._hinges)
        turns = math.pi - dihedral
        return turns + 2.0 * math.pi * np.round((near - turns) / (2.0 * math.pi)), -gradient


def _dofs(rows: NDArray) -> NDArray:
    """Coordinate numbers (k, 3 p) of the nodes in rows (k, p)."""
    return (3 * rows[:, :, None] + np.arange(3)).reshape(len(rows), -1)
