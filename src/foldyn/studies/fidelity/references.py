"""Modes of the shell for the mixed sets, stored so that models can be compared without it.

    python -m foldyn.studies.fidelity.references [--out FOLDER] [--until HH:MM]

computes what is not stored yet, in turn from all sets, and appends it case by case. Meshes are
graded toward vertices, down to the thickness; a line of a file has the frequencies of three of
them, and shapes at the vertices and the means of panels' corners, in thousandths of the largest.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import doubt, limits
from foldyn.errors import FoldynWarning
from foldyn.linear.reference import SAME_PLACE, reference_modes
from foldyn.patterns import Pattern
from foldyn.shells import shell
from foldyn.studies.fidelity.compare import COMPARED
from foldyn.studies.fidelity.mixed import SETS, MixedCase, mixed
from foldyn.studies.fidelity.stored import RESULTS

STEPS = 1000  # of a shape's largest component
CERTAIN = 0.015  # estimated error of a reference, at most


@dataclass(frozen=True, eq=False)
class Stored:
    """Modes of a shell as they are stored.

    Attributes
    ----------
    divisions : (int, int, int)
        Of the meshes.
    mesh_frequency : (3, k)
        Hz.
    shape : (k, p, 3)
        At the points, in thousandths.
    points : (p, 3)
        Vertices, then the means of panels' corners, m.
    size : float
        Of the pattern, m.
    """

    divisions: tuple[int, int, int]
    mesh_frequency: NDArray
    shape: NDArray
    points: NDArray
    size: float

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Extrapolated by the observed order (k,), Hz, increasing."""
        return limits(self.mesh_frequency, self.divisions, observed=True)

    @property
    def doubt(self) -> NDArray[np.float64]:
        """Estimated relative error (k,) of the frequencies; nan of modes that a mesh lacks."""
        return doubt(self.mesh_frequency, self.divisions)

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """See `Shown`."""
        from scipy.spatial import cKDTree

        apart, place = cKDTree(self.points).query(nodes)
        seen = np.flatnonzero(apart < SAME_PLACE * self.size)
        return seen, self.shape[:, place[seen]]


def points_of(pattern: Pattern) -> NDArray[np.float64]:
    """Where shapes are stored (p, 3)."""
    middles = [pattern.vertices[list(face)].mean(axis=0) for face in pattern.faces]
    return np.concatenate([pattern.vertices, middles])


def computed(case: MixedCase) -> dict[str, Any]:
    """What a line of a file has."""
    began = time.perf_counter()
    pattern, radius = case.pattern(), case.sheet.thickness
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        meshes = [
            case.case(shell(pattern, case.sheet, n, "consistent", vertex_radius=radius))
            for n in case.divisions
        ]
        true = reference_modes(meshes, COMPARED)
    _, shape = true.at(points_of(pattern))
    scale = STEPS / np.abs(shape).max(axis=(1, 2), keepdims=True)
    return {
        "case": case.name,
        "divisions": case.divisions,
        "seconds": round(time.perf_counter() - began, 1),
        "mesh_frequency": [[float(f"{f:.8g}") for f in row] for row in true.mesh_frequency],
        "shape": np.rint(scale * shape).astype(int).reshape(len(shape), -1).tolist(),
    }


def read_references(name: str, folder: Path = RESULTS) -> dict[str, dict[str, Any]]:
    """Lines of a set, by the name of the case."""
    path = folder / f"{name}.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {line["case"]: line for line in map(json.loads, lines)}


def stored(case: MixedCase, line: dict[str, Any]) -> Stored:
    """Modes of a case from its line."""
    pattern = case.pattern()
    shape = np.array(line["shape"], float).reshape(len(line["shape"]), -1, 3)
    frequency = np.array(line["mesh_frequency"], float)
    first, second, third = line["divisions"]
    return Stored((first, second, third), frequency, shape, points_of(pattern), pattern.size)


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description="Shells of the mixed sets.")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the files")
    parser.add_argument("--until", help="time of day (HH:MM) after which no case is begun")
    given = parser.parse_args(arguments)
    sets = {name: mixed(name) for name in SETS}
    known = {name: read_references(name, given.out) for name in SETS}
    for turn in zip_longest(*sets.values()):
        for name, case in zip(sets, turn, strict=True):
            if case is None or case.name in known[name]:
                continue
            if given.until and time.strftime("%H:%M") >= given.until:
                return 0
            line = computed(case)
            with (given.out / f"{name}.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, separators=(",", ":")) + "\n")
            found = stored(case, line)
            worst = 100.0 * np.max(found.doubt, initial=0.0)
            print(f"{case.name}: {line['seconds']} s, +-{worst:.2f} %", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
