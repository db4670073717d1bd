"""Kresling cells with a straight and with a guided upper rim, compared with superelements.

    python -m verification.fidelity.rims

prints the table (about a minute). The upper rim is pressed by a small distance along z and turns
freely. A straight rim is that of a rigid plate that is hinged there; a guided one bows in its
plane.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np

from foldyn.cases import Case, Fix, Impose
from foldyn.condensation import superelements
from foldyn.errors import FoldynWarning
from foldyn.patterns import Pattern, kresling
from foldyn.statics import trace
from foldyn.structures import Sheet, discretize
from foldyn.structures.calibration import fold_stiffness
from verification.fidelity.compare import markdown

SMALL, RADIUS = 1e-7, 0.04  # m
CELLS = ((6, 1.5, 30, 40), (6, 1.0, 45, 80), (6, 1.5, 30, 133), (8, 1.0, 40, 300))
"""Sides, height/radius, twist and smallest length/thickness."""
PRESETS = ("plate", "n5b8e")


def stiffness(structure: Any, sides: int, along: bool) -> float:
    """N/m, of a cell whose upper rim is moved, along its edges or at its vertices alone."""
    low, high = list(range(sides)), list(range(sides, 2 * sides))
    case = Case(structure, [Fix(low, along=True), Impose(high, "z", SMALL, along=along)])
    path = trace(case, "displacement", steps=1)
    return 2.0 * sum(float(path[name][-1]) for name in case.energy_groups) / SMALL**2


def closed(pattern: Pattern, sheet: Sheet, sides: int) -> Any:
    """Superelements of a cell with a rigid plate hinged to its upper rim."""
    top = tuple(range(sides, 2 * sides))
    made = Pattern(pattern.vertices, [*pattern.faces, top])
    ends = pattern.vertices[pattern.creases]
    own = fold_stiffness(None, pattern, sheet) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    known = dict(zip(map(tuple, pattern.creases.tolist()), own.tolist(), strict=True))
    stiff = [known.get((low, high), 0.0) for low, high in made.creases.tolist()]
    return superelements(made, sheet, rigid=[len(pattern.faces)], crease_stiffness=stiff)


def row(sides: int, height: float, twist: float, slender: float) -> list[str]:
    """Stiffness of a cell with both rims, each with the errors of the models."""
    pattern = kresling(sides=sides, radius=RADIUS, height=height * RADIUS, twist=twist)
    ends = pattern.vertices[pattern.lines]
    least = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
    sheet = Sheet(2e11, 0.3, least / slender, density=7850.0, length_scale_ratio=1.0)
    rims = {
        "straight": (closed(pattern, sheet, sides), False, {"straight": "zmin or zmax"}),
        "guided": (
            superelements(pattern, sheet),
            True,
            {"straight": "zmin", "guided": {"z": "zmax"}},
        ),
    }
    out = [f"{sides}, {height:g}, {twist:g}, 1/{slender:g}"]
    for reference, along, options in rims.values():
        true = stiffness(reference, sides, along)
        out.append(f"{true:.3g} N/m")
        for preset in PRESETS:
            made = discretize(pattern, sheet, preset=preset, **options)
            out.append(f"{100.0 * (stiffness(made, sides, True) / true - 1.0):+.1f} %")
    return out


def table() -> str:
    """The table in Markdown."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        rows = [row(*cell) for cell in CELLS]
    head = ["cell", "rim straight", *PRESETS, "rim guided", *PRESETS]
    return markdown(head, rows)


if __name__ == "__main__":
    print(table())
    sys.exit(0)
