"""Trusses whose equilibrium paths are known in closed form (bars linear in Green strain).

Two bars of length L rise by h over half spans b to an apex that is pushed down by v: with the
Green strain E = (v^2 - 2 h v) / (2 L^2) each bar pulls with S = E_y E, and the load is

    P = EA / L^3  v (2 h - v) (h - v)

(R. von Mises, ZAMM 3, 1923, for the truss; the form in Green strain in Crisfield, Non-linear
Finite Element Analysis of Solids and Structures 1, 1991, section 1.2). It has its limit points at
v = h (1 -+ 1/sqrt 3), of +-2 / (3 sqrt 3) EA h^3 / L^3.

With the apex free sideways, s: equilibrium sideways is s (E + b^2 / L^2) = 0 with E the mean of
the strains, so that a second path crosses at E = -b^2 / L^2 and is the circle
s^2 + z^2 = h^2 - 2 b^2 (z the height of the apex) with P = 2 EA b^2 z / L^3. It comes before the
limit point if h > sqrt(3) b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import foldyn as fd
from foldyn.structures import ModelOptions

AREA = 1e-4
APEX = 2


@dataclass(frozen=True)
class VonMises:
    """A truss of two bars; h, b (m), EA (N)."""

    h: float = 0.1
    b: float = 1.0
    EA: float = 1e4

    @property
    def L(self):
        return float(np.hypot(self.h, self.b))

    def load(self, v):
        return self.EA / self.L**3 * v * (2 * self.h - v) * (self.h - v)

    @property
    def limit(self):
        return 2 / (3 * np.sqrt(3)) * self.EA * self.h**3 / self.L**3

    @property
    def limit_at(self):
        return self.h * (1 - 1 / np.sqrt(3)), self.h * (1 + 1 / np.sqrt(3))

    def energy(self, v):
        return self.EA / self.L**3 * (v * (2 * self.h - v)) ** 2 / 4

    def structure(self):
        nodes = np.array([[-self.b, 0, 0], [self.b, 0, 0], [0, 0, self.h]], float)
        bars, sheet = np.array([[0, 2], [1, 2]]), fd.Sheet(self.EA / AREA, 0.3, 0.01)
        options = ModelOptions(bar_law="linear")
        return fd.Structure(nodes, bars, np.array([AREA, AREA]), sheet, options=options)

    def case(self, free="z", load=-1.0):
        """The apex free along some axes under a load (N) along z at factor 1."""
        held = "".join(axis for axis in "xyz" if axis not in free)
        supports = [fd.Fix([0, 1], "xyz")] + ([fd.Fix([APEX], held)] if held else [])
        return fd.Case(self.structure(), supports, [fd.Force([APEX], (0, 0, load))])


@dataclass(frozen=True)
class SpringLoaded:
    """A truss of two springs pushed down through a third one, of stiffness k (N/m).

    Springs are linear in their length l: with l = sqrt(b^2 + (h - v)^2),

        P = 2 EA (h - v) (1/l - 1/L),    w = v + P/k

    for the displacement w of the third spring's far end (node 3).
    """

    k: float
    h: float = 0.1
    b: float = 1.0
    EA: float = 1e4

    def load(self, v):
        length = np.hypot(self.b, self.h - v)
        return 2 * self.EA * (self.h - v) * (1 / length - 1 / np.hypot(self.h, self.b))

    def moved(self, v):
        """w."""
        return v + self.load(v) / self.k

    def slope(self, v):
        """dP/dv."""
        length = np.hypot(self.b, self.h - v)
        return 2 * self.EA * (1 / np.hypot(self.h, self.b) - self.b**2 / length**3)

    def case(self, displacement):
        """The far end moved along z by a displacement (m) at factor 1."""
        law = fd.CustomBarLaw(
            lambda s: 0.5 * (s - 1.0) ** 2, lambda s: (s - 1.0) / s, lambda s: 1.0 / s**3
        )
        above = 1.0  # length of the third spring
        nodes = [[-self.b, 0, 0], [self.b, 0, 0], [0, 0, self.h], [0, 0, self.h + above]]
        bars, area = [[0, 2], [1, 2], [2, 3]], [AREA, AREA, AREA * self.k * above / self.EA]
        structure = fd.Structure(
            np.array(nodes, float), np.array(bars), np.array(area),
            fd.Sheet(self.EA / AREA, 0.3, 0.01), options=ModelOptions(bar_law=law),
        )  # fmt: skip
        supports = [fd.Fix([0, 1], "xyz"), fd.Fix([APEX, 3], "xy")]
        return fd.Case(structure, [*supports, fd.Impose([3], "z", displacement)])


def snapped(case, method="arc_length", past=2.2, **given):
    """Path until the apex of a truss, which is node 2, has gone down so many times its height."""
    down = past * case.structure.nodes[APEX, 2]
    return fd.trace(case, method, until=lambda u, factor: u[APEX, 2] < -down, **given)


def marked(path, kind=None):
    """Points of a path that are not regular, or those of a kind."""
    return path.isel(step=path.point.values != "regular" if kind is None else path.point == kind)


def apex(path, axis="z"):
    """Displacement (m) of the apex along a path."""
    return path.displacement.sel(node=APEX, axis=axis).values
