"""A Z-section cantilever under torque: LE5 of The Standard NAFEMS Benchmarks, rev. 3, 1990.

The section, 10 m long and 0.1 m thick, has a web 2 m high and flanges 1 m wide. It is held at
x = 0; at x = 10 m shears of 0.6 MN in the planes of the flanges, opposite to each other, act evenly
along their edges. The axial stress in the middle of the sheet at the free edge of a flange, at
x = 2.5 m, is -108 MPa.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import foldyn as fd

STEEL = fd.Sheet(210e9, 0.3, thickness=0.1, density=7800.0)
OUTLINE = [(1, 1), (0, 1), (0, 0), (0, -1), (-1, -1)]  # y, z of the section, in squares of 1 m
LENGTH, SHEAR, EXACT = 10, 0.6e6, -108e6


def section():
    """Squares, all welded, four around the section."""
    row = len(OUTLINE)
    vertices = [(x, y, z) for x in range(LENGTH + 1) for y, z in OUTLINE]
    faces = [
        (a, a + row, b + row, b)
        for x in range(LENGTH)
        for a, b in pairwise(range(row * x, row * x + row))
    ]
    along = [(k, k + row) for k in range(row * LENGTH) if k % row not in (0, row - 1)]
    around = [pair for x in range(1, LENGTH) for pair in pairwise(range(row * x, row * x + row))]
    return fd.Pattern(vertices, faces, welds=[*along, *around])


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.UnitsWarning")
@pytest.mark.parametrize(("kind", "within"), [("shell", 0.01), ("superelements", 0.02)])
def test_z_section_under_torque(kind, within):
    make = {
        "shell": lambda: fd.shell(section(), STEEL, divisions=8),
        "superelements": lambda: fd.superelements(section(), STEEL),
    }[kind]
    end = len(OUTLINE) * LENGTH
    shears = [
        fd.LineLoad([(end, end + 1)], (0.0, SHEAR, 0.0)),
        fd.LineLoad([(end + 3, end + 4)], (0.0, -SHEAR, 0.0)),
    ]
    case = fd.Case(make(), [fd.Fix("xmin", along=True)], shears)
    settings = fd.statics.Settings(stability=False)
    found = fd.stresses(fd.trace(case, steps=1, settings=settings)).isel(step=-1)
    point = np.linalg.norm(found.point_position.values - [2.5, 1.0, 1.0], axis=1).argmin()
    assert found.point_place.values[point] == "edge"
    force = found.membrane_force.sel(component="xx").values[point]
    assert force / STEEL.thickness == pytest.approx(EXACT, rel=within)
