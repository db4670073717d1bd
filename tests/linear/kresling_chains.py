"""Chains of Kresling cells with plates, as small as tests need them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import foldyn as fd
from verification.waves.kresling import SIDES, Unit

UNIT = Unit()
TRUSS = replace(UNIT, crease=0.0, plate_stiffness=1e6)
"""Without creases, between plates that hardly give way: two dofs a cell."""
HEAVIER = 4.0
"""Mass of every second plate of a chain with a gap."""


@cache
def cell(unit: Unit = UNIT) -> fd.UnitCell:
    return unit.cell


def motion(positions: NDArray, displacement: NDArray, velocity: NDArray, time: NDArray):
    """A motion as it is stored, as far as cells are concerned."""
    place = ("time", "node", "axis")
    return xr.Dataset(
        {
            "displacement": (place, displacement),
            "velocity": (place, velocity),
            "rest_position": (("node", "axis"), positions),
        },
        {"time": time, "node": np.arange(len(positions)), "axis": list("xyz")},
    )


def diatomic(cells: int, rings: int | None = None) -> fd.Case:
    """A chain of pairs of cells, in which every second plate is heavier.

    rings : with plates; by default all.
    """
    storeys = 2 * cells
    rings = storeys + 1 if rings is None else rings
    plain = TRUSS.case(TRUSS.structure(storeys), range(rings))
    light = 2.0 * TRUSS.structure(1).mass.sum() / 2.0 + TRUSS.plate_mass
    heavy = [node for r in range(1, rings, 2) for node in range(SIDES * r, SIDES * (r + 1))]
    more = fd.PointMass(heavy, (HEAVIER - 1.0) * light / SIDES)
    return fd.Case(plain.structure, plain.supports, masses=[*plain.masses, more])


def branches() -> NDArray:
    """Eigenvalues of M^-1 K, rad2/s2, of a cell between light plates."""
    return TRUSS.two_dofs.speeds**2


def decay(frequency: NDArray) -> NDArray:
    """Np per pair of cells of the wave of two dofs that decays least; 0 where one travels.

    Plates of masses m and r m between the same springs: 2 cos kappa = (2 - z)(2 - r z) - 2 with
    z = omega^2/eig(M^-1 K) (L. Brillouin, Wave Propagation in Periodic Structures, 1946).
    """
    ratio = (2.0 * np.pi * frequency[:, None]) ** 2 / branches()
    cosine = 0.5 * ((2.0 - ratio) * (2.0 - HEAVIER * ratio) - 2.0)
    return np.arccosh(np.maximum(np.abs(cosine), 1.0)).min(axis=1)
