"""Cells of repeated sheets that several tests take."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.linear.bloch import null_space
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.wave_solver import WaveSolver
from named_models import named

SHEET = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)


@cache
def miura(cells: tuple[int, int] = (1, 1), **options: Any) -> fd.UnitCell:
    """Cells of a sheet."""
    pattern = fd.patterns.miura(cells=cells, a=0.03, b=0.031)
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, **named(options))))


@cache
def chain(cells: int = 1, **options: Any) -> fd.UnitCell:
    """Cells of a strip along x with free sides."""
    pattern = fd.patterns.miura(cells=(cells, 1), a=0.03, b=0.031)
    case = fd.Case(fd.discretize(pattern, SHEET, **named(options)))
    return fd.UnitCell(case, vectors=fd.UnitCell(case).vectors[:1])


@cache
def kresling(storeys: int = 1, sides: int = 5, **options: Any) -> fd.UnitCell:
    """Storeys of a tower."""
    pattern = fd.patterns.kresling(sides=sides, radius=0.03, height=0.03, storeys=storeys)
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, **named(options))))


@cache
def squares(count: int = 1) -> fd.UnitCell:
    """Cells of one panel each, so that creases reach beyond the next cell."""
    side = 0.03
    points = [(side * i, side * j, 0.0) for i in range(count + 1) for j in (0, 1)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(count)]
    structure = fd.discretize(fd.Pattern(points, faces), SHEET, preset="plate")
    return fd.UnitCell(fd.Case(structure), vectors=[(count * side, 0, 0), (0, side, 0)])


def eigenvalues(cell: fd.UnitCell, phases: Any, **state: Any) -> NDArray[np.float64]:
    """All eigenvalues at some phases, increasing, rad2/s2."""
    bloch = linearize_cell(cell, **state).bloch
    found = []
    for phase in np.atleast_2d(phases):
        free = WaveSolver(bloch, 1).free
        count = len(free)
        if not bloch.ties.empty:
            count = null_space(bloch.ties.at(bloch.factors(phase))[:, free]).shape[1]
        found.append(WaveSolver(bloch, count).waves(phase).values)
    return np.sort(np.concatenate(found))


def of_ring(counts: Sequence[int]) -> NDArray[np.float64]:
    """Phases 2 pi j / N along each period."""
    along = [2.0 * np.pi * np.arange(count) / count for count in counts]
    return np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, len(counts))
