"""Bands of Miura and eggbox sheets by fold state.

Pratapa, Suryanarayana and Paulino (J. Mech. Phys. Solids 118, 2018) compute them with bars and
hinges. The dimensions and numbers of that paper were not available. Panels here have the size
(25 mm) and the material (Canson Mi-Teintes) of the specimen in the study `herkal`, with the scheme
n4b5 and lumped masses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray

from foldyn.cases import Case
from foldyn.linear import UnitCell, band_gaps, bands
from foldyn.patterns import eggbox, miura
from foldyn.structures import Sheet, discretize

# Generators, and the angle (degrees) of their panels.
PATTERNS = {"miura": (miura, 60.0), "eggbox": (eggbox, 60.0)}
EDGE = 0.025  # m
PAPER = Sheet(1.219e9, 0.2, 2.4e-4, 667.0, length_scale_ratio=2.7)
PATH = "G-X-M-Y-G"
COUNT = 12  # number of bands: three for each of four vertices


def cell_of(kind: str, dihedral: float) -> UnitCell:
    """A cell folded to a dihedral (degrees)."""
    generator, angle = PATTERNS[kind]
    pattern = generator(cells=(1, 1), a=EDGE, b=EDGE, panel_angle=angle, dihedral=dihedral)
    made = discretize(
        pattern, PAPER, scheme="n4b5", mass="panel", fold_law="linear", bend_law="linear",
        calibration="standard", membrane="bars",
    )  # fmt: skip
    return UnitCell(Case(made))


def fold_states(
    kind: str, dihedrals: Sequence[float], count: int = 81, grid: int = 24
) -> xarray.Dataset:
    """Bands in fold states, and their gaps.

    Variables: `frequency` (dihedral, phase, band), Hz, along the edge of the zone; `bottom` and
    `top` (direction, dihedral, below), Hz, the edges of the gap above the lowest `below` bands (nan
    without a gap), for waves along x only and for the whole zone. Attributes: ticks of the path.
    """
    path = cell_of(kind, 90.0).path(PATH, count)
    frequency, edges = [], np.full((2, 2, len(dihedrals), COUNT), np.nan)
    for k, dihedral in enumerate(dihedrals):
        cell = cell_of(kind, float(dihedral))
        found = bands(cell, path, count=COUNT)
        frequency.append(np.sort(found["frequency"].values, axis=1))
        zone = bands(cell, cell.grid(grid), count=COUNT, track=False)
        for d, (gaps, name) in enumerate(((band_gaps(found), "G-X"), (band_gaps(zone), "all"))):
            for row in np.flatnonzero(np.isin(gaps["direction"].values, (name, "all"))):
                below = int(gaps["below"][row])
                edges[:, d, k, below] = float(gaps["bottom"][row]), float(gaps["top"][row])
    place = ("direction", "dihedral", "below")
    return xarray.Dataset(
        {
            "frequency": (("dihedral", "phase", "band"), np.array(frequency), {"units": "Hz"}),
            "bottom": (place, edges[0], {"units": "Hz"}),
            "top": (place, edges[1], {"units": "Hz"}),
        },
        {
            "direction": ["along x", "all"],
            "dihedral": ("dihedral", np.asarray(dihedrals, float), {"units": "degrees"}),
            "distance": ("phase", path["distance"].values),
            "band": 1 + np.arange(COUNT),
            "below": np.arange(COUNT),
        },
        {"ticks": path.attrs["ticks"], "tick_labels": path.attrs["tick_labels"]},
    )


def widest(found: xarray.Dataset, direction: str) -> tuple[float, float, float]:
    """Dihedral (degrees) and edges (Hz) of the gap of largest ratio of width to middle, or nan."""
    bottom, top = (found[name].sel(direction=direction).values for name in ("bottom", "top"))
    width = np.nan_to_num((top - bottom) / (top + bottom))
    k, below = np.unravel_index(width.argmax(), width.shape)
    return float(found["dihedral"][k]), float(bottom[k, below]), float(top[k, below])
