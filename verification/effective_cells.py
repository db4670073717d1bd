"""Effective properties of drawn cells: superelements and `n5b8e` beside shells.

    python -m verification.effective_cells [--first 0] [--count 20] [--out FILE]

draws cells of sheets (Miura-ori, eggboxes, uneven triangles) and of beams (strips, tubes, towers)
in turn, with any folding, thickness, Poisson's ratio and stiffness of creases; a minute each. The
reference are shells with rigid vertices on three graded meshes, extrapolated. What is compared are
entries of A, B and D, of beams those of the stiffness, and moduli. An entry C_ij counts if |C_ij|
is more than `LEAST` of sqrt(C_ii C_jj). Shares are of the numbers whose limit is known to `KNOWN`.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
import warnings
from collections.abc import Iterable, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

import foldyn as fd
from foldyn.algebra.extrapolation import doubt, limits
from foldyn.errors import FoldynWarning, ModelRangeWarning
from verification.fidelity.cases import spread
from verification.fidelity.compare import markdown

SEED, COUNT = 20261201, 20
KINDS = ("miura", "eggbox", "triangles", "miura", "beam")
BEAMS = ("strip", "miura_tube", "kresling")
MESHES = (8, 12, 16)
LEAST = 0.01  # entries below this, relative to their row and column, do not count
KNOWN = 0.01  # largest estimated error of the shells' limit
SIDE = 0.03  # m
BLOCKS = ("membrane", "coupling", "bending")
MODULI = (
    "modulus", "shear_modulus", "bending_modulus", "twisting_modulus", "bending_stiffness",
)  # fmt: skip
RESULTS = Path(__file__).parent / "fidelity" / "results" / "effective_cells.csv"


class DrawnCell(NamedTuple):
    """A cell, its sheet, and the stiffness of its creases, N m/rad per m."""

    kind: str
    pattern: fd.Pattern
    vectors: NDArray | None  # periods, if the pattern does not mark them
    sheet: fd.Sheet
    crease: float
    text: str  # what was drawn

    def properties(self, model: str, divisions: int | None = None) -> xarray.Dataset:
        """`fd.effective` by a model."""
        own: dict[str, Any] = {"crease_stiffness": self.crease}
        if divisions:
            own["divisions"] = divisions
        if model == "shell":
            own["vertex_radius"] = self.sheet.thickness
        structure = getattr(fd, model)(self.pattern, self.sheet, **own)
        cell = fd.UnitCell(fd.Case(structure), vectors=self.vectors)
        return fd.effective(cell, check_model=False)

    @property
    def told(self) -> bool:
        """Whether bars and hinges warn that the cell is beyond their range."""
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            fd.discretize(self.pattern, self.sheet, crease_stiffness=self.crease)
        return any(issubclass(each.category, ModelRangeWarning) for each in told)


class Row(NamedTuple):
    """A number of a cell; differences are relative to the shells' limit."""

    cell: int
    kind: str
    told: int  # whether bars and hinges warn of the cell
    quantity: str
    shell: float  # limit, N/m, N, N m, or N m2
    doubt: float  # estimated error of the limit
    superelements: float
    n5b8e: float
    same_mesh: float  # superelements beside the shell, both on its finest mesh

    @property
    def entry(self) -> bool:
        """Whether it is an entry of A, B, D or of the stiffness of a beam, and no modulus."""
        return "," in self.quantity


def drawn() -> Iterable[DrawnCell]:
    """The cells, without end."""
    rng, number = np.random.default_rng(SEED), 0
    while True:
        kind = KINDS[number % len(KINDS)]
        yield _cell(rng, BEAMS[number // len(KINDS) % len(BEAMS)] if kind == "beam" else kind)
        number += 1


def _cell(rng: np.random.Generator, kind: str) -> DrawnCell:
    b, slender, ratio = SIDE * spread(rng, 1 / 1.6, 1.6), spread(rng, 30.0, 400.0), rng.random()
    angle, dihedral = float(rng.uniform(45.0, 80.0)), float(rng.uniform(20.0, 170.0))
    crease, twist, sides = spread(rng, 0.01, 100.0), float(rng.uniform(10, 40)), rng.integers(4, 9)
    shape: dict[str, Any] = {"a": SIDE, "b": b, "panel_angle": angle, "dihedral": dihedral}
    vectors = None
    if kind == "triangles":
        shape, (pattern, vectors) = {"a": SIDE, "b": b}, uneven(rng, b)
    elif kind == "kresling":
        shape = {"sides": int(sides), "radius": SIDE, "height": b, "twist": twist}
        pattern = fd.patterns.kresling(**shape)
    elif kind == "miura_tube":
        pattern = fd.patterns.miura_tube(cells=1, **shape)
    else:
        pattern = getattr(fd.patterns, "miura" if kind == "strip" else kind)(**shape)
    if kind == "strip":
        ends = pattern.vertices[np.array(pattern.periods[0])]
        vectors = (ends[:, 1] - ends[:, 0])[:1]
    ends = pattern.vertices[pattern.lines]
    edge = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min())
    sheet = fd.Sheet(1e9, 0.45 * ratio, edge / slender, density=1000.0)
    bending = 1e9 * sheet.thickness**3 / 12.0 / (1.0 - sheet.poissons_ratio**2)
    drawn = {**shape, "t/L": 1.0 / slender, "nu": 0.45 * ratio, "k L/D": crease}
    text = ", ".join(f"{name} {value:.3g}" for name, value in drawn.items())
    return DrawnCell(kind, pattern, vectors, sheet, crease * bending / edge, text)


def uneven(rng: np.random.Generator, b: float) -> tuple[fd.Pattern, NDArray]:
    """Eight triangles between points at uneven heights and places, over a lattice that is skew."""
    vectors = 2.0 * np.array([[SIDE, 0.0, 0.0], [rng.uniform(0.0, 0.3) * SIDE, b, 0.0]])
    off = rng.uniform(-0.25, 0.25, (2, 2, 3)) * min(SIDE, b)
    i, j = np.indices((3, 3)).reshape(2, -1)
    points = 0.5 * (i[:, None] * vectors[0] + j[:, None] * vectors[1]) + off[i % 2, j % 2]
    corners = [(3 * p + q, 3 * p + q + 3, 3 * p + q + 4, 3 * p + q + 1)
               for p in (0, 1) for q in (0, 1)]  # fmt: skip
    faces = [face for a, b, c, d in corners for face in ((a, b, c), (a, c, d))]
    return fd.Pattern(points, faces), vectors


def numbers(found: xarray.Dataset) -> dict[str, float]:
    """Entries of the stiffness and moduli, by the names that sweeps have for them."""
    names = found["load"].values
    out = {}
    for block in (*BLOCKS, "stiffness"):
        for i, j in np.ndindex(*found[block].shape) if block in found else ():
            if i <= j or block == "coupling":
                out[f"{block}[{names[i]},{names[j]}]"] = float(found[block][i, j])
    for name in MODULI:
        for k, value in enumerate(np.ravel(found[name]) if name in found else ()):
            out[f"{name}[{k}]"] = float(value)
    return out


def counts(values: Mapping[str, float], name: str) -> bool:
    """Whether an entry is large enough, and a modulus always."""
    if "," not in name:
        return True
    block, (i, j) = name.split("[")[0], name.split("[")[1][:-1].split(",")
    left, right = {"coupling": ("membrane", "bending")}.get(block, (block, block))
    scale = values[f"{left}[{i},{i}]"] * values[f"{right}[{j},{j}]"]
    return abs(values[name]) > LEAST * np.sqrt(scale)


def rows(number: int, cell: DrawnCell) -> list[Row]:
    """The numbers of a cell that count."""
    meshes = [numbers(cell.properties("shell", each)) for each in MESHES]
    others = [numbers(cell.properties(model)) for model in ("superelements", "discretize")]
    same = numbers(cell.properties("superelements", MESHES[-1]))
    told, out = int(cell.told), []
    for name in (name for name in meshes[-1] if counts(meshes[-1], name)):
        values = [[mesh[name]] for mesh in meshes]
        limit = float(limits(values, MESHES, observed=True)[0])
        apart = [other[name] / limit - 1.0 for other in others]
        apart.append(same[name] / meshes[-1][name] - 1.0)
        own = float(doubt(values, MESHES)[0])
        out.append(Row(number, cell.kind, told, name, limit, own, *apart))
    return out


def write(found: Iterable[Row], path: Path) -> None:
    """Write a table of numbers."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(Row._fields)
        out.writerows([f"{x:.5g}" if isinstance(x, float) else x for x in row] for row in found)


def read(path: Path = RESULTS) -> list[Row]:
    """Read a table of numbers."""
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))[1:]
    return [Row(int(one[0]), one[1], int(one[2]), one[3], *map(float, one[4:])) for one in lines]


def summary(found: Iterable[Row]) -> str:
    """Shares of the known entries and moduli that are within bounds, in Markdown."""
    known = [row for row in found if row.doubt <= KNOWN]
    quiet = [row for row in known if not row.told]
    panels = [row for row in quiet if row.kind != "triangles"]
    lines = []
    for name, model, some in (
        ("superelements", "superelements", known),
        ("superelements and shell on one mesh", "same_mesh", known),
        ("`n5b8e`", "n5b8e", known),
        ("`n5b8e` where it does not warn", "n5b8e", quiet),
        ("the same, panels with four corners", "n5b8e", panels),
    ):
        for what, entry in (("entries", True), ("moduli", False)):
            apart = np.abs([getattr(row, model) for row in some if row.entry == entry])
            if len(apart):
                shares = (np.mean(apart <= bound) for bound in (0.02, 0.05))
                lines.append(
                    [name, f"{len(apart)} {what}", *(f"{100 * each:.0f} %" for each in shares),
                     f"{100 * np.median(apart):.1f} %", f"{100 * apart.max():.1f} %"]
                )  # fmt: skip
    heads = ["model", "numbers", "within 2 %", "within 5 %", "median", "largest"]
    return markdown(heads, lines)


def largest(found: Iterable[Row]) -> str:
    """Where the entries of a cell differ most."""
    entries = [row for row in found if row.entry]
    told = [f"{len(entries)} entries"]
    for name in ("doubt", "superelements", "n5b8e", "same_mesh"):
        apart = [getattr(row, name) for row in entries]
        worst = int(np.abs(apart).argmax())
        told.append(f"{name} {100 * apart[worst]:+.1f} % {entries[worst].quantity}")
    return ", ".join(told)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Effective properties beside those of shells.")
    parser.add_argument("--first", type=int, default=0, help="number of the first cell")
    parser.add_argument("--count", type=int, default=COUNT, help="of the cells")
    parser.add_argument("--out", type=Path, default=RESULTS, help="table of the numbers")
    given = parser.parse_args(arguments)
    found: list[Row] = []
    for number, cell in enumerate(islice(drawn(), given.first, given.first + given.count)):
        began = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            own = rows(given.first + number, cell)
        found += own
        print(f"{given.first + number} {cell.kind} ({cell.text}): {largest(own)}, "
              f"{time.perf_counter() - began:.0f} s", flush=True)  # fmt: skip
        write(found, given.out)
    print(summary(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
