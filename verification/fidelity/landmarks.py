"""Superelements beside closed forms, a benchmark, and shells on three graded meshes.

    python -m verification.fidelity.landmarks

prints the table (some minutes): structures that bars and hinges get wrong by large amounts.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from foldyn.cases import Case, Fix
from foldyn.condensation import superelements
from foldyn.errors import FoldynWarning
from foldyn.linear.reference import reference_modes, superelement_modes
from foldyn.patterns import Pattern, kresling, miura_tube, yoshimura
from foldyn.shells import shell
from foldyn.structures import Sheet
from verification.benchmarks import plates
from verification.benchmarks.facets import facets, welded
from verification.fidelity.compare import markdown

STEEL = Sheet(2e11, 0.3, 1e-3, density=7850.0)
MESHES = (8, 16, 24)


class Landmark(NamedTuple):
    """A structure, its supports, and its frequencies (Hz) where they are known."""

    name: str
    pattern: Pattern
    sheet: Sheet
    options: dict[str, Any]
    supports: tuple[Fix, ...]
    known: Sequence[float] = ()


def strip(panels: int) -> Landmark:
    """A cantilever of 1 m x 50 mm, across which the creases are a thousand times as stiff."""
    x = np.linspace(0.0, 1.0, panels + 1)[:, None] * np.eye(3)[0]
    modulus, thickness, density = 2e11, 2e-3, 7850.0
    sheet = Sheet(modulus, 0.0, thickness, density)  # no Poisson's ratio: a beam exactly
    k = 1e3 * panels * modulus * thickness**3 / 12.0  # N m/rad per m
    first = (modulus / density / 12.0) ** 0.5 * thickness / (2.0 * np.pi)
    known = [root**2 * first for root in (1.875104, 4.694091)]
    ends = (0, panels + 1)
    return Landmark(
        f"strip of {panels} panels, creases a thousand times as stiff", facets(x, 0.05, 1),
        sheet, {"crease_stiffness": k, "clamped": [ends]}, (Fix(list(ends), along=True),), known,
    )  # fmt: skip


def landmarks() -> list[Landmark]:
    """All structures."""
    turn = np.radians(np.linspace(0.0, 90.0, 6))
    arc = 0.03 * np.stack([np.sin(turn), 0.0 * turn, np.cos(turn)], axis=1)
    blade = welded(facets(arc, 0.2, 10))
    corner = np.array([[0.05, 0, 0], [0, 0, 0], [0, 0, 0.05]], float)
    held = "ymin or ymax"
    rolled = yoshimura(cells=(4, 4), a=0.05, b=0.1, dihedral=150.0)
    tube = miura_tube(cells=2, a=0.05, b=0.05, panel_angle=60.0, dihedral=100.0)
    cell = kresling(sides=6, radius=0.04, height=0.04, twist=30.0)
    return [
        Landmark(
            "FV16, one panel", plates.SQUARE, plates.SHEET, {"clamped": [(0, 3)]},
            (plates.ROOT,), plates.FV16,
        ),
        strip(2), strip(5), strip(20),
        Landmark("blade, welded facets of 9 x 20 mm", blade, STEEL, {}, (Fix("ymin", along=True),)),
        *(
            Landmark(
                f"L-section, welded facets of 50 x {400 // n} mm", welded(facets(corner, 0.4, n)),
                STEEL, {}, (Fix("ymin", along=True),),
            )
            for n in (4, 2)
        ),
        Landmark("Yoshimura sheet, two edges held", rolled, STEEL, {}, (Fix(held, along=True),)),
        Landmark("Miura tube, one end held", tube, STEEL, {}, (Fix("xmin", along=True),)),
        Landmark("Kresling cell, one rim held", cell, STEEL, {}, (Fix("zmin", along=True),)),
    ]  # fmt: skip


def row(one: Landmark, count: int = 6) -> list[str]:
    """Frequencies of the lowest modes, and the largest differences."""

    def held(make: Callable[..., Any], **options: Any) -> Case:
        return Case(make(one.pattern, one.sheet, **one.options, **options), list(one.supports))

    true, doubt = np.array(one.known), np.zeros(len(one.known))
    if not len(true):
        graded = {"mass": "consistent", "vertex_radius": one.sheet.thickness}
        found = reference_modes([held(shell, divisions=n, **graded) for n in MESHES], count)
        fine = found.mesh_frequency[-1]
        true, doubt = found.frequency, np.abs(fine / found.frequency - 1.0)
    own = superelement_modes(held(superelements), len(true))
    errors = np.abs(own.frequency / true - 1.0), own.mesh_error, doubt
    largest = [f"{100.0 * each.max():.1f} %" for each in errors]
    return [one.name, f"{true[0]:.4g} Hz", *largest]


def main() -> int:
    """Print the table."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        rows = [row(one) for one in landmarks()]
    print(
        markdown(
            ["structure", "first mode", "largest error", "own estimate", "extrapolated by"], rows
        )
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
