"""Cases of the fidelity study, and their supports in both models.

Both models get the same pattern, sheet and supports. Supports hold vertices. A held edge is held
along its whole length in the shell, and at its two vertices with bars and hinges, which have no
other nodes there.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.cases import Case, Fix
from foldyn.patterns import GENERATORS, Pattern
from foldyn.structures import Sheet, Structure
from foldyn.structures.discretized import Discretized

DOCUMENTED = Path(__file__).with_name("documented.toml")


@dataclass(frozen=True)
class Held:
    """Supports by vertices.

    Attributes
    ----------
    points : mapping of str to tuple of int
        Held vertices, by their held axes.
    edges : tuple of (int, int)
        Edges held at every point along all axes.
    """

    points: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    edges: tuple[tuple[int, int], ...] = ()

    def of(self, structure: Discretized) -> list[Fix]:
        """Supports of a structure."""
        fixed = [Fix(list(nodes), axes) for axes, nodes in self.points.items()]
        if not self.edges:
            return fixed
        along = not isinstance(structure, Structure)  # bars and hinges have no other nodes there
        return [*fixed, Fix(np.unique(self.edges).tolist(), "xyz", along=along)]


@dataclass(frozen=True)
class FidelityCase:
    """A pattern, a sheet and supports.

    Attributes
    ----------
    kind : str
        Generator of the pattern, one of `GENERATORS`, or "polygons".
    shape : mapping
        Its arguments.
    support : str
        Name of the supports.
    sheet : Sheet
    """

    kind: str
    shape: Mapping[str, Any]
    support: str
    sheet: Sheet

    @property
    def name(self) -> str:
        """Description in one line."""
        shape = ", ".join(f"{key} {_short(value)}" for key, value in self.shape.items())
        return f"{self.kind}, {shape}, {self.support}, L* {self.sheet.length_scale_ratio:.3g}"

    def pattern(self) -> Pattern:
        """The pattern."""
        make = polygons if self.kind == "polygons" else GENERATORS[self.kind]
        return make(**self.shape)

    def case(self, structure: Discretized) -> Case:
        """A structure with the supports."""
        return Case(structure, self.held.of(structure))

    @property
    def held(self) -> Held:
        """Its supports."""
        return supports(self.kind, self.shape)[self.support]

    @property
    def options(self) -> Mapping[str, Any]:
        """Options of `discretize` and `shell` that follow from the supports."""
        return {}


def _short(value: Any) -> str:
    return "x".join(map(str, value)) if isinstance(value, list | tuple) else f"{value:.3g}"


def documented(path: Path = DOCUMENTED) -> list[FidelityCase]:
    """The documented set: simple folds, sheets of parallelograms, towers and pairs of polygons."""
    told = tomllib.loads(path.read_text("utf-8"))
    cases = []
    for case in told["cases"]:
        shape = dict(case["pattern"])
        sheet = Sheet(**told["sheet"], length_scale_ratio=case["length_scale_ratio"])
        cases.append(FidelityCase(shape.pop("kind"), shape, case["support"], sheet))
    return cases


def polygons(sides: int = 6, dihedral: float = 90.0, edge: float = 1.0) -> Pattern:
    """Two regular polygons with edges of length `edge` (m) that meet at a dihedral (degrees).

    Vertices 0 and 1 are the ends of the crease; the first polygon's vertices follow, then the
    second's.
    """
    turn = 2.0 * np.pi * np.arange(sides) / sides
    steps = edge * np.column_stack([np.cos(turn), np.sin(turn)])
    outline = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)[:-1]])
    angle = np.radians(dihedral)
    halves = [
        np.column_stack([outline[:, 0], outline[:, 1] * c, outline[:, 1] * s])
        for c, s in ((1.0, 0.0), (np.cos(angle), np.sin(angle)))
    ]
    first = tuple(range(sides))
    second = (1, 0, *range(2 * sides - 3, sides - 1, -1))
    return Pattern(np.concatenate([halves[0], halves[1][2:]]), [first, second], name="polygons")


def supports(kind: str, shape: Mapping[str, Any]) -> dict[str, Held]:
    """Supports of a kind of pattern, by name."""
    if kind == "simple_fold":
        return {
            "case 1": Held({"xyz": (4, 5), "z": (0, 1)}),
            "panel": Held({"xyz": (0, 1, 2, 3)}),
            "free": Held(),
        }
    if kind == "kresling":
        sides = int(shape.get("sides", 6))
        ring = tuple(range(sides))
        return {
            "base": Held(edges=tuple((k, (k + 1) % sides) for k in ring)),
            "base corners": Held({"xyz": ring}),
            "free": Held(),
        }
    if kind == "polygons":
        return {"panel": Held({"xyz": tuple(range(int(shape["sides"])))}), "free": Held()}
    return _sheet_supports(*shape["cells"])


def _sheet_supports(columns: int, rows: int) -> dict[str, Held]:
    """Supports of a sheet with 2 columns x 2 rows of parallelograms, numbered along y first."""
    step = 2 * rows + 1
    corners = (0, step - 1, 2 * columns * step, (2 * columns + 1) * step - 1)
    side = tuple(range(step))
    return {
        # as in case study 2: one side against a wall, the corners on the ground
        "folding": Held({"x": side, "y": (rows,), "z": corners}),
        "edge": Held(edges=tuple(pairwise(side))),
        "corners": Held({"xyz": corners}),
        "panel": Held({"xyz": (0, 1, step, step + 1)}),
        "free": Held(),
    }


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
