"""Bands of Miura and eggbox sheets against their fold state.

Pratapa, Suryanarayana and Paulino (J. Mech. Phys. Solids 118, 2018) compute them with bars and
hinges. Their dimensions and numbers were not at hand: panels here are those of the paper specimen
of the other study (25 mm, Canson Mi-Teintes), on the scheme n4b5, with lumped masses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray

from foldyn.cases import Case
from foldyn.linear import UnitCell, band_gaps, bands
from foldyn.patterns import eggbox, miura
from foldyn.structures import Sheet, discretize

PATTERNS = {"miura": (miura, 60.0), "eggbox": (eggbox, 60.0)}
"""Generators, and the angle (degrees) of their panels."""
EDGE = 0.025  # m
PAPER = Sheet(1.219e9, 0.2, 2.4e-4, 667.0, length_scale_ratio=2.7)
PATH = "G-X-M-Y-G"
COUNT = 12  # bands: three of each of four vertices


def cell_of(kind: str, dihedral: float) -> UnitCell:
    """A cell folded to a dihedral (degrees)."""
    generator, angle = PATTERNS[kind]
    pattern = generator(cells=(1, 1), a=EDGE, b=EDGE, panel_angle=angle, dihedral=dihedral)
    made = discretize(
        pattern, PAPER, scheme="n4b5", mass="panel", fold_law="linear", bend_law="linear",
        calibration="standard", membrane="bars",
    )  # fmt: skip
    return UnitCell(Case(made))


def fold_states(kind: str, dihedrals: Sequence[float], count: int = 81) -> xarray.Dataset:
    """Bands along the edge of the zone in each fold state, and the widest full gap.

    Variables: `frequency` (dihedral, phase, band), Hz; `bottom`, `top` (dihedral) of the widest gap
    relative to its middle, Hz, and `below`, the number of bands below it; nan and 0 where there is
    none. Attributes: ticks of the path.
    """
    frequency, gaps, path = [], [], None
    for dihedral in dihedrals:
        cell = cell_of(kind, float(dihedral))
        path = cell.path(PATH, count)
        found = bands(cell, path, count=COUNT)
        frequency.append(found["frequency"].values)
        gaps.append(_widest(frequency[-1]))
    bottom, top, below = np.array(gaps).T
    assert path is not None
    return xarray.Dataset(
        {
            "frequency": (("dihedral", "phase", "band"), np.array(frequency), {"units": "Hz"}),
            "bottom": ("dihedral", bottom, {"units": "Hz"}),
            "top": ("dihedral", top, {"units": "Hz"}),
            "below": ("dihedral", below.astype(int)),
        },
        {
            "dihedral": ("dihedral", np.asarray(dihedrals, float), {"units": "degrees"}),
            "distance": ("phase", path["distance"].values),
            "band": 1 + np.arange(COUNT),
        },
        {"ticks": path.attrs["ticks"], "tick_labels": path.attrs["tick_labels"], "pattern": kind},
    )
