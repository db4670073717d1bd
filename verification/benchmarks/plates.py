"""Thin plates: NAFEMS FV12, FV15, FV16 and FV32, Leissa's squares, plates under pressure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.structures.discretized import Discretized
from verification.benchmarks.benchmark import Benchmark, frequencies
from verification.benchmarks.facets import welded

NAFEMS = "NAFEMS (1990), target"
SIDE, THICKNESS, DENSITY = 10.0, 0.05, 8000.0
SHEET = fd.Sheet(200e9, 0.3, THICKNESS, DENSITY)
CORNERS = [0, 1, 2, 3]
RIM = [(0, 1), (1, 2), (2, 3), (0, 3)]
HELD = fd.Fix(CORNERS, along=True)
ROOT = fd.Fix([0, 3], along=True)  # of a cantilever
FV16 = (0.421, 1.029, 2.582, 3.306, 3.753, 6.555)
LEISSA = {
    "free": (13.489, 19.789, 24.432, 35.024, 35.024, 61.526),
    "cantilevered": (3.4917, 8.5246, 21.429, 27.331, 31.111, 54.443),
    "clamped": (35.992, 73.413, 73.413, 108.27, 131.64, 132.24),
}
"""Square plates, nu = 0.3: omega a^2 sqrt(rho t / D), by Ritz's method with 36 beam functions, so a
little high. A. W. Leissa, J. Sound Vib. 31, 257-293, 1973."""


def rhombus(angle: float = 90.0) -> fd.Pattern:
    """A panel with sides of 10 m and this angle (degrees) between them."""
    x, y = SIDE * np.cos(np.radians(angle)), SIDE * np.sin(np.radians(angle))
    return fd.Pattern([(0, 0), (SIDE, 0), (SIDE + x, y), (x, y)], [CORNERS])


SQUARE = rhombus()


def shell(pattern: fd.Pattern = SQUARE, divisions: int = 32, clamped: Any = ()) -> Discretized:
    """The plate as a shell with consistent mass."""
    return fd.shell(pattern, SHEET, divisions=divisions, mass="consistent", clamped=clamped)


def by_plate_theory(frequency: NDArray) -> NDArray:
    """Omega a^2 sqrt(rho t / D) of a frequency (Hz)."""
    unit = np.sqrt(SHEET.bending_modulus / (DENSITY * THICKNESS))
    return 2.0 * np.pi * SIDE**2 * frequency / unit


def tapered(panels: int = 4, divisions: int = 16) -> NDArray:
    """Modes in its plane (Hz) of a sheet 10 m long, 5 m deep at its root and 1 m at its tip."""
    x = np.linspace(0.0, SIDE, panels + 1)
    points = [(a, side * (2.5 - 0.2 * a)) for side in (-1, 1) for a in x]
    n = panels + 1
    faces = [(i, i + 1, n + i + 1, n + i) for i in range(panels)]
    sheet = shell(welded(fd.Pattern(points, faces)), divisions)
    flat = fd.Fix(range(len(sheet.nodes)), "z")
    return frequencies(sheet, [fd.Fix([0, n], along=True), flat])


def bulge(clamped: bool, divisions: int = 32) -> float:
    """Deflection of the middle over q a^4 / D under a pressure q, small."""
    plate = shell(clamped=RIM if clamped else (), divisions=divisions)
    q = 1e-3
    path = fd.trace(
        fd.Case(plate, [HELD], [fd.Pressure(q)]), steps=1, settings={"stability": False}
    )
    middle = np.linalg.norm(plate.nodes[:, :2] - 0.5 * SIDE, axis=1).argmin()
    moved = np.abs(path.displacement.values[-1, middle, 2])
    return float(moved * SHEET.bending_modulus / (q * SIDE**4))


def cantilever(make: Callable[..., Discretized], **options: Any) -> Discretized:
    """The square plate, held along one edge."""
    return make(SQUARE, SHEET, clamped=[(0, 3)], **options)


HZ = {"quantity": "modes 1 to 6", "unit": "Hz"}
FACTOR = {"unit": "frequency factor"}
BENCHMARKS = [
    Benchmark(
        "FV12, free square plate", NAFEMS, "shell", "32 divisions", "bending modes 1 to 6", "Hz",
        (1.622, 2.360, 2.922, 4.233, 4.233, 7.416), 0.013,
        lambda: frequencies(shell(), [], rigid=6),
    ),
    Benchmark(
        "FV15, clamped rhombic plate, 45°", NAFEMS, "shell", "48 divisions", **HZ,
        reference=(7.938, 12.835, 17.941, 19.133, 24.009, 27.922), error=0.025,
        compute=lambda: frequencies(shell(rhombus(45.0), 48, RIM), [HELD]),
    ),
    Benchmark(
        "FV16, cantilevered square plate", NAFEMS, "shell", "32 divisions", **HZ,
        reference=FV16, error=0.015,
        compute=lambda: frequencies(shell(clamped=[(0, 3)]), [ROOT]),
    ),
    Benchmark(
        "FV32, cantilevered tapered membrane", NAFEMS, "shell", "4 panels, 16 divisions", **HZ,
        reference=(44.623, 130.03, 162.70, 246.05, 379.90, 391.44), error=0.01, compute=tapered,
    ),
    Benchmark(
        "free square plate", "Leissa (1973), Ritz", "superelements", "one panel",
        "bending modes 1 to 6", **FACTOR, reference=LEISSA["free"], error=0.01,
        compute=lambda: by_plate_theory(frequencies(fd.superelements(SQUARE, SHEET), [], rigid=6)),
    ),
    Benchmark(
        "cantilevered square plate", "Leissa (1973), Ritz", "superelements", "one panel",
        "modes 1 to 6", **FACTOR, reference=LEISSA["cantilevered"], error=0.01,
        compute=lambda: by_plate_theory(frequencies(cantilever(fd.superelements), [ROOT])),
    ),
    Benchmark(
        "cantilevered square plate", "Leissa (1973), Ritz", "bars and hinges, `n5b8e`", "one panel",
        "mode 1", **FACTOR, reference=LEISSA["cantilevered"][:1], error=0.01,
        compute=lambda: by_plate_theory(
            frequencies(cantilever(fd.discretize, preset="n5b8e"), [fd.Fix([0, 3])], 1)
        ),
    ),
    Benchmark(
        "clamped square plate", "Leissa (1973), Ritz", "shell", "48 divisions", "modes 1 to 6",
        **FACTOR, reference=LEISSA["clamped"], error=0.02,
        compute=lambda: by_plate_theory(frequencies(shell(divisions=48, clamped=RIM), [HELD])),
    ),
    Benchmark(
        "simply supported square plate", "Navier, formula", "shell", "32 divisions",
        "modes 1 to 6", **FACTOR,
        reference=tuple(n * np.pi**2 for n in (2, 5, 5, 8, 10, 10)), error=0.01,
        compute=lambda: by_plate_theory(frequencies(shell(), [HELD])),
    ),
    Benchmark(
        "clamped square plate under pressure", "Taylor and Govindjee (2004), computed", "shell",
        "32 divisions", "deflection of the middle", "$qa^4/D$", (0.00126532,), 0.025,
        lambda: bulge(clamped=True),
    ),
]  # fmt: skip
