"""Three random sets of all patterns, sizes, supports and thicknesses, from stored seeds.

Patterns and supports rotate in an order that is redrawn for each round, so that the first cases of
a set are a sample of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import GENERATORS, Pattern, miura
from foldyn.structures import PanelSheet, Sheet
from foldyn.structures.graded import grading
from verification.fidelity import cases
from verification.fidelity.cases import FidelityCase, Held

# Seed and number of cases of each set.
SETS = {"mixed_1": (20261201, 34), "mixed_2": (20261202, 33), "mixed_3": (20261203, 33)}
PARALLELOGRAMS = sorted(
    {case.kind for case in cases.documented() if "cells" in case.shape}, reverse=True
)
KINDS = (*PARALLELOGRAMS, "kresling", "waterbomb", "resch", "quads")
SUPPORTS = ("free", "one edge", "two edges", "corners")
GRIDS = (*PARALLELOGRAMS, "quads")  # numbered along y first
CELLS = 8  # at most, along either direction
FINE, USUAL = (8, 12, 16), (4, 8, 12)  # divisions of small and of large cases
SMALL, LARGE = 60_000, 180_000  # triangles of the finest mesh: with 16 divisions, and in general
FLAT = 179.0  # degrees
NARROW = 1.0 / 3.0  # least width of a panel, relative to the shortest edge


@dataclass(frozen=True)
class MixedCase(FidelityCase):
    """A case whose supported rims follow from the outline of the flat pattern."""

    def pattern(self) -> Pattern:
        """The pattern."""
        return _pattern(self.kind, self.shape)

    @property
    def held(self) -> Held:
        """Its supports."""
        if self.support == "free":
            return Held()
        rings, corners = self._rims()
        if self.support == "corners":
            return Held({"xyz": tuple(dict.fromkeys(corners))})  # three on a small Resch sheet
        chosen = rings[:1] if self.support == "one edge" else rings
        return Held(edges=tuple(edge for ring in chosen for edge in pairwise(ring)))

    def _rims(self) -> tuple[list[list[int]], tuple[int, ...]]:
        """Vertices along both ends, in sequence, and the corners; for towers the lower ones."""
        if self.kind == "kresling":
            sides = int(self.shape["sides"])
            top = sides * int(self.shape["storeys"])
            return [[*range(n, n + sides), n] for n in (0, top)], tuple(range(sides))
        if self.kind in GRIDS:
            columns, rows = (2 * n for n in self.shape["cells"])
            ends = [list(range(n, n + rows + 1)) for n in (0, columns * (rows + 1))]
            return ends, tuple(end[k] for end in ends for k in (0, -1))
        return outline(_pattern(self.kind, {**self.shape, "dihedral": FLAT}))

    @property
    def divisions(self) -> tuple[int, int, int]:
        """Divisions of its three meshes."""
        return FINE if self.triangles(FINE[-1]) <= SMALL else USUAL

    def triangles(self, divisions: int) -> int:
        """Number of triangles of a graded mesh."""
        pattern = self.pattern()
        mesh = grading(pattern, divisions, self.sheet.thickness)
        return 4 * mesh.rays * (mesh.arcs - 1) * sum(map(len, pattern.faces))


def mixed(name: str) -> list[MixedCase]:
    """Cases of a set.

    Sheets of 1 x 1 to 8 x 8 cells (small numbers as likely as large ones on a logarithmic scale;
    towers of 4 to 8 sides and 1 to 8 storeys), dihedrals of 20 to 179 degrees, sheets of 1/30 to
    1/400 of the shortest edge. Cases are redrawn if generators refuse them, such as sheets that
    roll up by more than a turn, if panels are narrower than a third of the shortest edge, or if
    they are too large.
    """
    seed, count = SETS[name]
    rng = np.random.default_rng(seed)
    turns = zip(turns_of(rng, KINDS), turns_of(rng, SUPPORTS), strict=True)
    return [_one(rng, *next(turns)) for _ in range(count)]


def turns_of(rng: np.random.Generator, names: Sequence[str]) -> Iterator[str]:
    """Names, over and over, in an order that is redrawn for each round."""
    while True:
        yield from map(str, rng.permutation(names))


def _one(rng: np.random.Generator, kind: str, support: str) -> MixedCase:
    while True:
        shape = _shape(rng, kind)
        sheet = cases.random_sheet(rng, 1.0, 30.0)
        try:
            edge, width = sizes(_pattern(kind, shape))
        except InputError:
            continue
        sheet = replace(sheet, thickness=edge * sheet.thickness)
        case = MixedCase(kind, shape, support, sheet)
        if width >= NARROW * edge and case.triangles(USUAL[-1]) <= LARGE:
            return case


def _shape(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    a = cases.spread(rng, 0.02, 2.0)
    b = a * cases.spread(rng, 1.0 / 1.6, 1.6)
    cells = [int(cases.spread(rng, 1.0, CELLS + 1.0)) for _ in range(2)]
    dihedral, angle = float(rng.uniform(20.0, 179.0)), float(rng.uniform(45.0, 85.0))
    if kind == "kresling":
        sides, twist = int(rng.integers(4, 9)), float(rng.uniform(10.0, 40.0))
        return {"sides": sides, "radius": a, "height": b, "twist": twist, "storeys": cells[1]}
    shape: dict[str, Any] = {"cells": cells, "a": a, "dihedral": dihedral}
    if kind == "resch":
        return shape
    if kind == "waterbomb":
        return {**shape, "b": b}
    shape |= {"b": b, "panel_angle": angle}
    return {**shape, "seed": int(rng.integers(1 << 16))} if kind == "quads" else shape


def _pattern(kind: str, shape: Mapping[str, Any]) -> Pattern:
    return quads(**shape) if kind == "quads" else GENERATORS[kind](**shape)


def quads(seed: int, **shape: Any) -> Pattern:
    """A Miura-ori whose rows and columns differ, seen in perspective: planar irregular panels.

    Parameters
    ----------
    seed : int
        Random seed of the widths, which differ by up to a third, and of the perspective.
    **shape
        Arguments of `miura`.
    """
    rng, even = np.random.default_rng(seed), miura(**shape)
    columns = 2 * shape["cells"][0] + 1
    grid = even.vertices.reshape(columns, -1, 3)
    along, across = (_uneven(rng, line) for line in (grid[:, 0], grid[0]))
    vertices = (along[:, None] + across[None]).reshape(-1, 3)
    place = (vertices - vertices.mean(axis=0)) / np.ptp(vertices, axis=0).max()
    scale = 1.0 + place @ rng.uniform(-0.4, 0.4, 3)
    return Pattern(vertices / scale[:, None], even.faces, name="quads")


def _uneven(rng: np.random.Generator, line: NDArray) -> NDArray[np.float64]:
    """A polyline from the origin with perturbed segment lengths."""
    steps = np.diff(line, axis=0) * rng.uniform(0.75, 4.0 / 3.0, (len(line) - 1, 1))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def sizes(pattern: Pattern) -> tuple[float, float]:
    """The shortest edge and the least width of a panel, m."""
    edges, widths = [], []
    for face in pattern.faces:
        corners = pattern.vertices[list(face)]
        side = np.roll(corners, -1, axis=0) - corners
        length = np.linalg.norm(side, axis=1)
        apart = np.cross(side[:, None] / length[:, None, None], corners - corners[:, None])
        edges.append(length.min())
        widths.append(np.linalg.norm(apart, axis=2).max(axis=1).min())
    return float(min(edges)), float(min(widths))


def outline(flat: Pattern) -> tuple[list[list[int]], tuple[int, ...]]:
    """Vertices along the two ends of a sheet in x, in sequence, and its four corners."""
    sides = {(a, b) for face in flat.faces for a, b in pairwise((*face, face[0]))}
    after = {a: b for a, b in sides if (b, a) not in sides}
    ring = np.array(sorted(after))
    place = flat.vertices[ring, :2]
    place = (place - place.mean(axis=0)) / np.ptp(place, axis=0)
    toward = ((-1, -1), (-1, 1), (1, -1), (1, 1))
    corners = tuple(int(ring[np.argmax(place @ way)]) for way in toward)
    return [_path(after, corners[:2], corners), _path(after, corners[2:], corners)], corners


def _path(after: Mapping[int, int], ends: Sequence[int], corners: Sequence[int]) -> list[int]:
    """Boundary between two neighboring corners."""
    for first, last in (ends, ends[::-1]):
        path = [first]
        while path[-1] == first or path[-1] not in corners:
            path.append(after[path[-1]])
        if path[-1] == last:
            return path
    raise ValueError("corners are not next to each other")


PLASTIC = Sheet(3e9, 0.35, 3e-4, density=1380.0, length_scale_ratio=4.0)
THICK = replace(PLASTIC, thickness=1e-3)
MIURA = {"cells": (2, 2), "a": 0.04, "b": 0.04, "panel_angle": 60, "dihedral": 110}
TOWER = {"sides": 6, "radius": 0.04, "height": 0.06, "twist": 30, "storeys": 1}


@dataclass(frozen=True)
class Gap(MixedCase):
    """A named case.

    Attributes
    ----------
    told : str
        What it represents.
    clamped : bool
        Whether the held edge is clamped.
    """

    told: str = ""
    clamped: bool = False

    @property
    def name(self) -> str:
        """What it represents."""
        return self.told

    def pattern(self) -> Pattern:
        """The pattern."""
        return cases.polygons(**self.shape) if self.kind == "polygons" else super().pattern()

    @property
    def held(self) -> Held:
        """Its supports."""
        panel = self.support == "panel"
        return cases.supports(self.kind, self.shape)["panel"] if panel else super().held

    @property
    def options(self) -> Mapping[str, Any]:
        """Options that follow from the supports."""
        return {"clamped": self.held.edges} if self.clamped else {}


def gaps() -> list[Gap]:
    """All gap cases: sheets of 0.3 mm and panels of 40 mm unless their names say otherwise."""
    patched = replace(PLASTIC, panels=[PanelSheet(list(range(0, 16, 2)), thickness=1e-3)])
    cells = {"cells": (3, 3)}
    return [
        _sheet("1 x 1 cells, free", {"cells": (1, 1)}, "free"),
        _sheet("1 x 1 cells, one edge held", {"cells": (1, 1)}),
        _sheet("panels 4 times as long as wide", {"b": 0.16}),
        _sheet("panels 8 times as long as wide", {"b": 0.32}),
        _sheet("skew panels, 30 degrees", {"panel_angle": 30}),
        _sheet("skew panels, 20 degrees", {"panel_angle": 20}),
        _sheet("nearly flat, 176 degrees", {"dihedral": 176}),
        _sheet("one edge clamped, 3 x 3 cells", cells, clamped=True),
        _sheet("two edges held, 3 x 3 cells", cells, "two edges"),
        _sheet("the same, 1 mm", cells, "two edges", THICK),
        _sheet("every other panel 1 mm", {}, sheet=patched),
        Gap("polygons", {"sides": 6, "edge": 0.04}, "panel", PLASTIC, "two hexagons, one held"),
        Gap("kresling", TOWER, "one edge", PLASTIC, "Kresling cell"),
        Gap("kresling", TOWER, "one edge", THICK, "Kresling cell, 1 mm"),
        Gap("kresling", {**TOWER, "storeys": 4}, "one edge", PLASTIC, "Kresling tower, 4 storeys"),
    ]


def _sheet(
    told: str,
    shape: Mapping[str, Any],
    support: str = "one edge",
    sheet: Sheet = PLASTIC,
    clamped: bool = False,
) -> Gap:
    """A Miura-ori."""
    return Gap("miura", {**MIURA, **shape}, support, sheet, told, clamped)
