"""Stresses of shells and superelements beside those of CalculiX, on drawn sheets.

    python -m verification.stresses_calculix [--cases 2 4 5 7 9 12] [--orthotropic] [--out FILE]

takes sheets of `verification.stresses`, by number, with their supports and loads, and computes them
with solids in CalculiX (`verification.calculix`), which must be installed as `ccx`. Of Foldyn's
mechanics these use the stiffness of creases alone. Their forces and moments are extrapolated from
the points of integration to the points of `fd.stresses`. Vertices have no rigid radius there. In
Foldyn it is an eighth of the thickness, or the thickness itself, the default of superelements.
"""

from __future__ import annotations

import argparse
import csv
import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.cases.load import Load
from foldyn.exports.creased_shell import fold_slopes
from foldyn.shells.recovery import StressPoints
from foldyn.structures.discretized import Discretized
from verification.calculix.solids import Loads, Solids
from verification.fidelity.fresh import FreshCase
from verification.stresses import DIVISIONS, FIRST, SMALL, chosen, held, load_on

CASES = (2, 4, 5, 7, 9, 12)  # of six patterns, under all four loads
RADIUS = 1 / 8  # relative to the thickness
RESULTS = Path(__file__).parent / "fidelity" / "results" / "stresses_calculix.csv"


class Row(NamedTuple):
    """Errors of a model, relative to the largest value of CalculiX."""

    case: str
    load: str
    model: str
    largest: float  # of the largest von Mises stress at all points
    away: float  # largest difference of it at centers and middles of edges
    corners: float  # the same, one thickness away from vertices
    crease: float  # largest difference of a crease's moment


def fibrous(sheet: fd.Sheet) -> fd.Sheet:
    """An orthotropic sheet in place of an isotropic one, its fibers askew of the panels' edges."""
    modulus = sheet.modulus
    return replace(
        sheet, youngs_modulus=(modulus, modulus / 7.0), poissons_ratio=0.3,
        shear_modulus=modulus / 14.0, direction=25.0,
    )  # fmt: skip


def rows(case: FreshCase, load: str, orthotropic: bool = False) -> Iterator[Row]:
    """Errors of the three models of a sheet."""
    pattern, sheet = case.pattern(), case.sheet
    if orthotropic:
        sheet = fibrous(sheet)
    radius = RADIUS * sheet.thickness
    made = {
        "shell": fd.shell(pattern, sheet, divisions=DIVISIONS, vertex_radius=radius),
        "superelements": fd.superelements(pattern, sheet, vertex_radius=radius),
        "superelements, default radius": fd.superelements(pattern, sheet),
    }
    shell = made["shell"]
    solids = Solids(pattern, sheet, shell.fold_stiffness * fold_slopes(shell))
    fields, crease = solids.solved(_loads(shell, load_on(shell, load, 1.0)))
    points = StressPoints.of(pattern, sheet)
    both = [
        solids.panels[p].at(fields[p], at)
        for p, at in zip(points.panel, points.position, strict=True)
    ]
    stress, near = _von_mises(np.array(both), sheet.thickness), points.place == "corner"
    most = stress.max()
    for name, structure in made.items():
        own, moment = _by_foldyn(structure, load)
        apart = np.abs(own - stress) / most
        turned = np.abs(moment - crease).max() / np.abs(crease).max()
        errors = own.max() / most - 1.0, apart[~near].max(), apart[near].max(), turned
        yield Row(case.name, load, name, *map(float, errors))


def _by_foldyn(structure: Discretized, load: str) -> tuple[NDArray, NDArray]:
    """Von Mises stresses and moments of creases, per unit of the load, for a small load."""
    size, factor = np.linalg.norm(np.ptp(structure.pattern.vertices, axis=0)), FIRST
    for last in (False, True):
        loaded = fd.Case(structure, [held(structure)], [load_on(structure, load, factor)])
        path = fd.trace(loaded, steps=1, settings=fd.statics.Settings(stability=False))
        if not last:
            factor *= SMALL * size / np.abs(path["displacement"].values).max()
    found = fd.stresses(path.isel(step=[-1])).isel(step=0)
    return found.von_mises.values / factor, found.crease_moment.values / factor


def _loads(structure: Discretized, load: Load) -> Loads:
    """A load of `verification.stresses` for solids."""
    pattern = structure.pattern
    none = Loads(np.zeros((len(pattern.faces), 3)), {}, {})
    if isinstance(load, fd.Force):
        return none._replace(vertices={int(np.ravel(load.nodes)[0]): np.array(load.vector)})
    if isinstance(load, fd.LineLoad):
        low, high = sorted(map(int, np.ravel(load.edges)))
        return none._replace(edges={(low, high): np.array(load.force_per_length)})
    if isinstance(load, fd.Pressure):
        return none._replace(panels=load.pressure * pattern.face_normals)
    assert isinstance(load, fd.Gravity)
    weight = structure.sheet.areal_density * np.array(load.acceleration, float)
    return none._replace(panels=none.panels + weight)


def _von_mises(both: NDArray, thickness: float) -> NDArray:
    """Von Mises stresses (p, 2) at back and front, of forces and moments (p, 2, 3)."""
    bent = 6.0 * both[:, 1] / thickness**2
    x, y, xy = np.moveaxis(both[:, :1] / thickness + np.stack([-bent, bent], axis=1), -1, 0)
    return np.sqrt(x * x - x * y + y * y + 3.0 * xy * xy)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Stresses beside those of CalculiX.")
    parser.add_argument("--cases", type=int, nargs="+", default=CASES, help="numbers of sheets")
    parser.add_argument("--orthotropic", action="store_true", help="with fibers of 7 to 1")
    parser.add_argument("--out", type=Path, default=RESULTS, help="table of the errors")
    given, found = parser.parse_args(arguments), []
    sheets = chosen(max(given.cases) + 1)
    for number in given.cases:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fd.errors.FoldynWarning)
            found += rows(*sheets[number], orthotropic=given.orthotropic)
        print(*found[-3:], sep="\n", file=sys.stderr, flush=True)
        with given.out.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(Row._fields)
            writer.writerows([*one[:3], *(f"{each:.4g}" for each in one[3:])] for one in found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
