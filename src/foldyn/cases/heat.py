"""Corrections to the strain energies of a case with warm panels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foldyn.mechanics import angles
from foldyn.mechanics.following import joined
from foldyn.mechanics.heat import Heat
from foldyn.structures.discretized import Discretized
from foldyn.structures.structure import Structure
from foldyn.structures.swelling import Swelling

IN_PLANE = "strain_membrane", "strain_bars", "strain_panels"
BENDING = "strain_bending", "strain_bends", "strain_panels"


def heat_of(
    structure: Discretized, parts: Sequence[tuple[Swelling, int]], histories: int
) -> Heat | None:
    """Heat of swellings, each given with the number of its history; None without swellings."""
    if not parts:
        return None
    loads = joined((own.forces, row) for own, row in parts)
    quadratic = np.zeros((2, histories, histories))
    for one, i in parts:
        for other, j in parts:
            for g in range(2):
                quadratic[g, i, j] += one.push[g] @ other.free[g]
    count, code, addresses, volume = len(loads.moment), 0, None, np.zeros(0)
    if len(parts[0][0].stress):
        assert isinstance(structure, Structure)
        code, addresses = structure.bar_law.code, structure.bar_law.addresses
        volume = structure.sheet.youngs_modulus * structure.bar_area * structure.bar_length
    names = list(structure.energy_groups)
    groups = [next(names.index(n) for n in kind if n in names) for kind in (IN_PLANE, BENDING)]
    return Heat(
        loads=loads,
        angles=angles(loads.corners.reshape(-1, 3), np.arange(4 * count).reshape(-1, 4)),
        groups=np.array(groups),
        quadratic=quadratic,
        stress=np.array([own.stress for own, _ in parts], float),
        row=np.array([row for _, row in parts], np.int64),
        volume=volume,
        code=code,
        addresses=np.array(addresses or (0, 0, 0), np.int64),
        seen=np.array([np.nan, 0.0]),
    )
