"""Folded sheets as plates: ratios of Miura-ori with rigid panels."""

from __future__ import annotations

import numpy as np
import xarray

import foldyn as fd
from verification.benchmarks.benchmark import Benchmark

A, B, ANGLE = 0.03, 0.035, 60.0


def thin(pattern: fd.Pattern, thickness: float, crease: float) -> xarray.Dataset:
    """Cell of a sheet that bends as one of 1 mm and 1 GPa, and hardly stretches."""
    sheet = fd.Sheet(1e9 * (1e-3 / thickness) ** 3, 0.3, thickness)
    structure = fd.discretize(pattern, sheet, crease_stiffness=crease, fold_law="linear")
    return fd.effective(fd.UnitCell(fd.Case(structure)), check_model=False)


def miura_of(dihedral: float) -> fd.Pattern:
    """A cell."""
    return fd.patterns.miura(a=A, b=B, panel_angle=ANGLE, dihedral=dihedral)


def ratio(dihedral: float) -> float:
    """Poisson's ratio in the plane, -(cos theta tan gamma)^2 (Schenk and Guest, PNAS 110, 2013)."""
    tilt, angle = np.radians(180.0 - dihedral) / 2.0, np.radians(ANGLE)
    return float(-((np.cos(tilt) * np.tan(angle)) ** 2))


def ratios(name: str) -> float:
    """The first of the ratios at a dihedral of 90 degrees, creases much softer than panels."""
    return float(thin(miura_of(90.0), 1e-5, 1e-2)[name].values[0])


BARS = {"model": "bars and hinges", "mesh": "one cell", "unit": ""}
BENCHMARKS = [
    Benchmark(
        "Miura-ori in its plane", "Schenk and Guest (2013), formula", **BARS,
        quantity="Poisson's ratio", reference=(ratio(90.0),), error=1e-5,
        compute=lambda: ratios("poissons_ratio"),
    ),
    Benchmark(
        "Miura-ori in bending", "Schenk and Guest (2013), formula", **BARS,
        quantity="ratio of the curvatures", reference=(-ratio(90.0),), error=1e-3,
        compute=lambda: ratios("bending_poissons_ratio"),
    ),
]  # fmt: skip
