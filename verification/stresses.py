"""Stresses of superelements and of bars and hinges beside those of shells, on drawn sheets.

    python -m verification.stresses [--count 20] [--out FILE]

takes the sheets of `verification.fidelity.fresh` in order, with their first panel held along its
edges, under a force at the vertex that is farthest from it, a line load on an edge there, pressure,
or gravity, in turn. The reference is a shell with 24 divisions. Errors are those of the largest von
Mises stress at all points of `fd.stresses`, and of the moments of creases; the loads are small.
"""

from __future__ import annotations

import argparse
import csv
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.cases.load import Load
from foldyn.structures.discretized import Discretized
from verification.fidelity.fresh import FreshCase, fresh

DIVISIONS, LARGE = 24, 32_000  # of the shell, and its most triangles
FIRST = 1e-9  # of a load that tells how far a sheet moves
SMALL = 1e-5  # largest displacement, relative to the size of the sheet
LOADS = ("tip", "edge", "pressure", "gravity")
RESULTS = Path(__file__).parent / "fidelity" / "results" / "stresses.csv"


class Row(NamedTuple):
    """Errors of one sheet, relative to the shell's largest value."""

    case: str
    load: str
    superelements: float  # largest von Mises stress
    anywhere: float  # largest difference at a point
    crease: float  # largest difference of a crease's moment, relative to the largest moment
    bars: float  # largest von Mises stress at centers, by "n5b8e"
    bars_crease: float


def chosen(count: int) -> list[tuple[FreshCase, str]]:
    """The sheets, with their loads."""
    found = [one for one in fresh() if one.triangles(DIVISIONS) <= LARGE]
    return [(one, LOADS[k % len(LOADS)]) for k, one in enumerate(found[:count])]


def held(structure: Discretized) -> fd.Fix:
    """Support of the first panel, along its edges; bars and hinges have no nodes there."""
    along = not isinstance(structure, fd.Structure)
    return fd.Fix(list(structure.pattern.faces[0]), along=along)


def row(case: FreshCase, load: str) -> Row:
    """Errors of a sheet."""
    pattern, sheet = case.pattern(), case.sheet
    thickness = float(np.max(sheet.values("thickness", len(pattern.faces))))
    panels = fd.superelements(pattern, sheet)
    own = load_on(panels, load, FIRST)
    size = np.linalg.norm(np.ptp(pattern.vertices, axis=0))
    moved = fd.trace(fd.Case(panels, [held(panels)], [own]), steps=1)["displacement"].values
    factor = FIRST * SMALL * size / np.abs(moved).max()
    others = (
        fd.shell(pattern, sheet, divisions=DIVISIONS, vertex_radius=thickness),
        fd.discretize(pattern, sheet),
    )
    found = []
    for structure in (panels, *others):
        loaded = fd.Case(structure, [held(structure)], [load_on(structure, load, factor)])
        path = fd.trace(loaded, steps=1, settings=fd.statics.Settings(stability=False))
        found.append(fd.stresses(path.isel(step=[-1])).isel(step=0))
    one, true, bars = found
    stress, exact = one.von_mises.values, true.von_mises.values
    center = true.point_place.values == "center"
    most = exact.max()
    return Row(
        case.name, load, stress.max() / most - 1.0, np.abs(stress - exact).max() / most,
        _apart(one.crease_moment.values, true.crease_moment.values),
        bars.von_mises.values[center].max() / exact[center].max() - 1.0,
        _apart(bars.crease_moment.values, true.crease_moment.values),
    )  # fmt: skip


def _apart(own: NDArray, true: NDArray) -> float:
    return float(np.abs(own - true).max() / np.abs(true).max()) if true.size else 0.0


def load_on(structure: Discretized, load: str, factor: float) -> Load:
    """A load of the kind `load`, of this size."""
    pattern = structure.pattern
    away = pattern.vertices - pattern.vertices[list(pattern.faces[0])].mean(axis=0)
    tip = int(np.linalg.norm(away, axis=1).argmax())
    push = (0.3 * factor, 0.2 * factor, factor)
    if load == "tip":
        return fd.Force([tip], push)
    if load == "edge":
        edge = next(edge for edge in pattern.boundary.tolist() if tip in edge)
        return fd.LineLoad([edge], push)
    if load == "pressure":
        return fd.Pressure(factor)
    return fd.Gravity(push)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Stresses beside those of shells.")
    parser.add_argument("--count", type=int, default=20, help="of the sheets")
    parser.add_argument("--out", type=Path, default=RESULTS, help="table of the errors")
    given = parser.parse_args(arguments)
    rows = []
    for case, load in chosen(given.count):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fd.errors.FoldynWarning)
            rows.append(row(case, load))
        print(rows[-1], file=sys.stderr, flush=True)
        with given.out.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(Row._fields)
            writer.writerows([*one[:2], *(f"{each:.4g}" for each in one[2:])] for one in rows)
    for name in Row._fields[2:]:
        values = np.abs([getattr(one, name) for one in rows])
        print(f"{name}: median {np.median(values):.2%}, within 3 % {np.mean(values < 0.03):.0%}, "
              f"within 5 % {np.mean(values < 0.05):.0%}, largest {values.max():.2%}")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
