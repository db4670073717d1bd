"""Random cases, from a stored seed."""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.structures import Sheet
from foldyn.studies.fidelity.cases import FidelityCase, documented, supports

SEED, COUNT = 20261123, 30  # drawn after the constants of the calibration were fixed
SEED_SHEETS, COUNT_SHEETS = 20261125, 24  # drawn after the membranes of panels had been derived


def drawn(count: int = COUNT, seed: int = SEED) -> list[FidelityCase]:
    """Random patterns, sizes, sheets and supports.

    Sizes of 0.02 to 2 m and up to 1.6 times that across, panel angles of 45 to 85 degrees, sheets
    of 1/50 to 1/400 of the smaller size, Poisson's ratios of 0.1 to 0.45, length-scale ratios of
    0.5 to 10.
    """
    rng = np.random.default_rng(seed)
    kinds = sorted({case.kind for case in documented()})
    return [_one(rng, kinds) for _ in range(count)]


def sheets(count: int = COUNT_SHEETS, seed: int = SEED_SHEETS) -> list[FidelityCase]:
    """Random sheets of 2 x 2 to 5 x 5 cells, half of them held along an edge or as in case study 2.

    Two of three are Miura-ori, with dihedrals of 20 to 175 degrees, the others fold both ways.
    Sheets of 1/30 to 1/400 of the smaller side of a panel; all else as in `drawn`, but panels up to
    2.5 times as long as wide.
    """
    rng, found = np.random.default_rng(seed), []
    other, flat_foldable = sorted({c.kind for c in documented() if "cells" in c.shape})
    for _ in range(count):
        kind = str(rng.choice([flat_foldable, flat_foldable, other]))
        a = spread(rng, 0.02, 2.0)
        b = a * spread(rng, 1.0 / 1.6, 2.5)
        cells = [int(rng.integers(2, 6)), int(rng.integers(2, 6))]
        angle, dihedral = float(rng.uniform(45.0, 85.0)), float(rng.uniform(20.0, 175.0))
        if kind == other:
            dihedral, angle = float(rng.uniform(40.0, 150.0)), float(rng.uniform(50.0, 80.0))
        shape = {"cells": cells, "a": a, "b": b, "panel_angle": angle, "dihedral": dihedral}
        sheet = random_sheet(rng, min(a, b), 30.0)
        support = str(rng.choice(["edge", "edge", "corners", "folding", "free"]))
        found.append(FidelityCase(kind, shape, support, sheet))
    return found


def _one(rng: np.random.Generator, kinds: list[str]) -> FidelityCase:
    a = spread(rng, 0.02, 2.0)
    b = a * spread(rng, 1.0 / 1.6, 1.6)
    kind = str(rng.choice(kinds))
    shape = _shape(rng, kind, a, b)
    sheet = random_sheet(rng, min(a, b), 50.0)
    support = str(rng.choice(sorted(supports(kind, shape))))
    return FidelityCase(kind, shape, support, sheet)


def random_sheet(rng: np.random.Generator, size: float, thickest: float) -> Sheet:
    """A sheet of 1/400 to 1/thickest of a size."""
    return Sheet(
        youngs_modulus=spread(rng, 1e6, 2e11),
        poissons_ratio=float(rng.uniform(0.1, 0.45)),
        thickness=size / spread(rng, thickest, 400.0),
        density=spread(rng, 100.0, 8000.0),
        length_scale_ratio=spread(rng, 0.5, 10.0),
    )


def _shape(rng: np.random.Generator, kind: str, a: float, b: float) -> dict[str, Any]:
    angle, dihedral = float(rng.uniform(45.0, 85.0)), float(rng.uniform(40.0, 150.0))
    if kind == "simple_fold":
        return {"a": a, "b": b, "dihedral": dihedral}
    if kind == "polygons":
        return {"sides": int(rng.choice([3, 5, 6])), "dihedral": dihedral, "edge": a}
    if kind == "kresling":
        sides = int(rng.integers(4, 9))
        return {"sides": sides, "radius": a, "height": b, "twist": float(rng.uniform(10.0, 40.0))}
    cells = [int(rng.integers(1, 3)), int(rng.integers(1, 3))]
    return {"cells": cells, "a": a, "b": b, "panel_angle": angle, "dihedral": dihedral}


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
