"""Sheets that move."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import foldyn as fd
from foldyn.dynamics import METHODS

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
HEAVY = replace(SHEET, density=1000.0)
LINEAR = {"fold_law": "linear", "bend_law": "linear"}
CELL_HELD = (fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"))
FOLD_HELD = (fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z"))
EXPLICIT = [name for name, method in METHODS.items() if not method.implicit]
IMPLICIT = [name for name, method in METHODS.items() if method.implicit]


def cell(cells=(1, 1), dihedral: float = 60, sheet: fd.Sheet = SHEET, **options) -> fd.Structure:
    """Miura cells of unit sides."""
    pattern = fd.patterns.miura(cells, 1.0, b=1.0, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, sheet, **{"preset": "herkal"} | options)


def fold(dihedral: float = 60, sheet: fd.Sheet = SHEET, **options) -> fd.Structure:
    """Two unit squares."""
    pattern = fd.patterns.simple_fold(1.0, 1.0, dihedral=dihedral)
    return fd.discretize(pattern, sheet, **{"preset": "herkal"} | options)


def case2(history=None, alpha: float = 0.0628, beta: float = 0.0, **options) -> fd.Case:
    """Case study 2 of Herkal et al. (supports, pulse and damping: our assumptions)."""
    load = fd.Force([7], (0.01, 0.0, 0.0), history or fd.HalfSine(0.5))
    return fd.Case(cell(**options), CELL_HELD, [load], fd.Rayleigh(alpha, beta))


def steps_of(method: str, dt: float) -> dict[str, float]:
    """A step for an implicit method; explicit ones find their own."""
    return {"dt": dt} if METHODS[method].implicit else {}


def equal_steps(method: str) -> dict[str, float]:
    """Arguments of `simulate` with which a method that controls its error takes equal steps."""
    return {"tolerance": 1e6} if METHODS[method].adaptive else {}


def spinning(s: Any, spin, speed=(0.0, 0.0, 0.0)) -> fd.State:
    """Turning about the center of mass (rad/s) and flying (m/s)."""
    return fd.State(velocity=np.cross(spin, s.nodes - s.center_of_mass) + np.array(speed))
