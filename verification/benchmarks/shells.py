"""Folded and curved sheets, linear: sections, a box, a blade, an arch."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.structures.discretized import Discretized
from verification.benchmarks.benchmark import Benchmark, frequencies
from verification.benchmarks.facets import cylinder, facets, welded

REPORTED = "reported, shells of another program"
MODES = {"quantity": "modes 1 to 6", "unit": "Hz"}

# ---------------------------------------------------------------------- a Z-section under torque
OUTLINE = [(1, 1), (0, 1), (0, 0), (0, -1), (-1, -1)]  # y, z of the section, in squares of 1 m
LENGTH, SHEAR = 10, 0.6e6
LE5 = (-108.0,)
SECTION = fd.Sheet(210e9, 0.3, thickness=0.1, density=7800.0)


def z_section() -> fd.Pattern:
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


def axial_stress(structure: Discretized) -> float:
    """Stress (MPa) along a flange's free edge, 2.5 m from the root.

    It is held at x = 0; at x = 10 m shears of 0.6 MN in the planes of the flanges, opposite to each
    other, act evenly along their edges.
    """
    end = len(OUTLINE) * LENGTH
    shears = [
        fd.LineLoad([(end, end + 1)], (0.0, SHEAR, 0.0)),
        fd.LineLoad([(end + 3, end + 4)], (0.0, -SHEAR, 0.0)),
    ]
    case = fd.Case(structure, [fd.Fix("xmin", along=True)], shears)
    found = fd.stresses(fd.trace(case, steps=1, settings={"stability": False})).isel(step=-1)
    edge = found.isel(point=found.point_place.values == "edge")
    point = np.linalg.norm(edge.point_position.values - [2.5, 1.0, 1.0], axis=1).argmin()
    force = edge.membrane_force.sel(component="xx").values[point]
    return float(force / structure.sheet.thickness * 1e-6)


# ---------------------------------------------------------------------- frequencies
BOX = fd.Sheet(207e9, 0.3, thickness=0.0127, density=7850.0)
ANGLE = fd.Sheet(90e9, 0.3, thickness=0.1, density=1000.0)
BLADE = fd.Sheet(206.85e9, 0.3, thickness=3.048e-3, density=7857.0)
ARCH = fd.Sheet(70e9, 0.33, thickness=0.01, density=2700.0)
SPAN, RISE = 2.0, 0.1


def double_box(side: float = 1.27, height: float = 2.54, welded: bool = True) -> fd.Pattern:
    """Two square cells, seven walls, with three walls at two of the vertical edges."""
    corners = [(x, y) for y in (0, 1) for x in (0, 1, 2)]
    vertices = [(side * x, side * y, z) for z in (0.0, height) for x, y in corners]
    walls = [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)]
    faces = [(a, b, b + 6, a + 6) for a, b in walls]
    return fd.Pattern(vertices, faces, welds=[(k, k + 6) for k in range(6)] if welded else ())


def box() -> NDArray:
    """Of the box, held at its bottom."""
    made = fd.superelements(double_box(), BOX, clamped="zmin")
    return frequencies(made, [fd.Fix("zmin")], 4)


def box_as_shell() -> NDArray:
    """The same by the shell."""
    return frequencies(
        fd.shell(double_box(), BOX, divisions=28, clamped="zmin"), [fd.Fix("zmin")], 4
    )


def angle() -> float:
    """Fourth frequency of an L-section, 10 m long, with legs of 0.5 m, held at one end."""
    corner = np.array([[0.5, 0, 0], [0, 0, 0], [0, 0, 0.5]], float)
    made = fd.superelements(welded(facets(corner, 10.0, 20)), ANGLE, clamped="ymin")
    return frequencies(made, [fd.Fix("ymin", along=True)], 4)[3]


def blade(around: int = 16, divisions: int = 2) -> NDArray:
    """Of a cylindrical panel, held along one curved edge."""
    pattern = cylinder(0.6096, 0.25, 0.3048, around, around)
    made = fd.shell(pattern, BLADE, divisions=divisions, mass="consistent", clamped="ymin")
    return frequencies(made, [fd.Fix("ymin", along=True)])


def arch(around: int = 32, divisions: int = 2) -> NDArray:
    """Of an arch 1 m wide, pinned along its straight edges."""
    radius = (0.25 * SPAN**2 + RISE**2) / (2.0 * RISE)
    half = np.arcsin(0.5 * SPAN / radius)
    pattern = cylinder(radius, half, 1.0, around, around // 2)
    made = fd.shell(pattern, ARCH, divisions=divisions, mass="consistent")
    return frequencies(made, [fd.Fix("xmin or xmax", along=True)])


STRESS = {"quantity": "axial stress at a flange's edge", "unit": "MPa"}
BENCHMARKS = [
    Benchmark(
        "LE5, Z-section under torque", "NAFEMS (1990), target", "shell",
        "squares of 1 m, 8 divisions", **STRESS, reference=LE5, error=0.01,
        compute=lambda: axial_stress(fd.shell(z_section(), SECTION, divisions=8)),
    ),
    Benchmark(
        "LE5, Z-section under torque", "NAFEMS (1990), target", "superelements",
        "squares of 1 m", **STRESS, reference=LE5, error=0.02,
        compute=lambda: axial_stress(fd.superelements(z_section(), SECTION)),
    ),
    Benchmark(
        "double-cell box, held at its bottom", REPORTED, "superelements",
        "seven walls of one panel", "modes 1 to 4", "Hz", (20.28, 25.43, 28.79, 30.62), 0.003, box,
    ),
    Benchmark(
        "double-cell box, held at its bottom", REPORTED, "shell",
        "28 divisions of a wall", "modes 1 to 4", "Hz", (20.28, 25.43, 28.79, 30.62), 0.02,
        box_as_shell,
    ),
    Benchmark(
        "L-section, cantilevered", REPORTED, "superelements",
        "squares of 0.5 m", "mode 4", "Hz", (36.37,), 0.04, angle,
        why="Mode 4 twists the section, whose legs are only five times as wide as thick. Plates "
        "without transverse shear, as ours, are too stiff then: Saint-Venant's torsion constant "
        "of a strip ten times as wide as thick is 6 % below $bt^3/3$, which takes 3 % off the "
        "frequency. The next row is the limit of thin plates.",
    ),
    Benchmark(
        "L-section, limit of thin plates", "reported", "superelements",
        "squares of 0.5 m", "mode 4", "Hz", (37.8,), 0.002, angle,
    ),
    Benchmark(
        "curved blade", "Olson and Lindberg (1971), measured", "shell",
        "16 x 16 facets, 2 divisions", **MODES,
        reference=(86.6, 135.5, 258.9, 350.6, 395.2, 531.1), error=0.05, compute=blade,
        why="The reference is measured. With 32 x 32 facets our frequencies change by at most "
        "0.4 %, so the model and the specimen differ, in the clamp for instance.",
    ),
    Benchmark(
        "shallow arch, pinned", REPORTED, "shell", "32 x 16 facets, 2 divisions",
        **MODES, reference=(23.468, 50.290, 65.761, 86.764, 94.859, 130.07), error=0.02,
        compute=arch,
    ),
]  # fmt: skip
