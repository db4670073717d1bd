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
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.dihedral import dihedrals_and_gradients
from foldyn.patterns import Pattern
from foldyn.statics.folding.curvature import Curvature, Parts
from foldyn.structures.mesh import lengths, n4b5

SIGNS = {"M": -1.0, "V": 1.0, "F": 0.0, "U": 0.0}
"""Sign of the fold angle of each assignment; 0 if a crease may fold either way."""


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
