"""Shell modes of the mixed sets and known gaps, stored to compare models without the shell.

    python -m verification.fidelity.references [--out FOLDER] [--until HH:MM]

computes missing cases, alternating between sets, and appends them one by one. Meshes are graded
toward vertices, down to the thickness. A line of a file has the frequencies of three meshes, and
shapes at the vertices and at the middles of edges and panels, as bytes in base64, scaled to a
largest component of 127.
"""

from __future__ import annotations

import argparse
import base64
import json
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import doubt, limits
from foldyn.errors import FoldynWarning
from foldyn.linear.mac import SAME_PLACE
from foldyn.linear.reference import reference_modes
from foldyn.patterns import Pattern
from foldyn.shells import shell
from foldyn.structures.beyond_range import BELOW, plate_frequency
from verification.fidelity.compare import COMPARED, FIRST, RESULTS
from verification.fidelity.mixed import FINE, SETS, MixedCase, gaps, mixed

STEPS = 127  # resolution of a byte, relative to a shape's largest component
CERTAIN = 0.015  # largest estimated error of a reference


@dataclass(frozen=True, eq=False)
class Stored:
    """Stored modes of a shell.

    Attributes
    ----------
    divisions : (int, int, int)
        Divisions of the three meshes.
    mesh_frequency : (3, k)
        Hz.
    shape : (k, p, 3)
        At the points, with a largest component of 127.
    points : (p, 3)
        Vertices, means of panels' corners and middles of edges, m.
    size : float
        Size of the pattern, m.
    """

    divisions: tuple[int, int, int]
    mesh_frequency: NDArray
    shape: NDArray
    points: NDArray
    size: float

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies (k,), Hz, extrapolated by the observed order, increasing."""
        return limits(self.mesh_frequency, self.divisions, observed=True)

    @property
    def doubt(self) -> NDArray[np.float64]:
        """Estimated relative error (k,) of the frequencies; nan for modes that a mesh lacks."""
        return doubt(self.mesh_frequency, self.divisions)

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """See `Shown`."""
        from scipy.spatial import cKDTree

        apart, place = cKDTree(self.points).query(nodes)
        seen = np.flatnonzero(apart < SAME_PLACE * self.size)
        return seen, self.shape[:, place[seen]]


@cache
def case_sets() -> dict[str, Sequence[MixedCase]]:
    """Sets of cases with stored shells, by file name."""
    return {**{name: mixed(name) for name in SETS}, "gaps": gaps()}


def points_of(pattern: Pattern) -> NDArray[np.float64]:
    """Points of stored shapes (p, 3)."""
    middles = [pattern.vertices[list(face)].mean(axis=0) for face in pattern.faces]
    return np.concatenate([pattern.vertices, middles, pattern.vertices[pattern.edges].mean(axis=1)])


def certain(case: MixedCase, true: Stored) -> bool:
    """Whether the modes that count, the first and low ones, are known to 1.5 %."""
    low = true.frequency < BELOW * plate_frequency(case.pattern(), case.sheet)
    counts = low | (np.arange(len(low)) < FIRST)
    return bool((true.doubt[counts] <= CERTAIN).all())  # nan is not


def computed(
    case: MixedCase, divisions: tuple[int, int, int], count: int = COMPARED
) -> dict[str, Any]:
    """Compute the content of a file's line, with `count` modes."""
    began = time.perf_counter()
    pattern, radius = case.pattern(), case.sheet.thickness
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        meshes = [
            case.case(
                shell(
                    pattern,
                    case.sheet,
                    divisions=n,
                    mass="consistent",
                    vertex_radius=radius,
                    **case.options,
                )
            )
            for n in divisions
        ]
        true = reference_modes(meshes, count)
    _, shape = true.at(points_of(pattern))
    scale = STEPS / np.abs(shape).max(axis=(1, 2), keepdims=True)
    return {
        "case": case.name,
        "divisions": divisions,
        "seconds": round(time.perf_counter() - began, 1),
        "mesh_frequency": [[float(f"{f:.8g}") for f in row] for row in true.mesh_frequency],
        "shape": base64.b64encode(np.rint(scale * shape).astype(np.int8).tobytes()).decode(),
    }


def read_references(name: str, folder: Path = RESULTS) -> dict[str, dict[str, Any]]:
    """Lines of a set, by the name of the case."""
    path = folder / f"{name}.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {line["case"]: line for line in map(json.loads, lines)}


def stored(case: MixedCase, line: dict[str, Any]) -> Stored:
    """Modes of a case from its line."""
    pattern = case.pattern()
    frequency, points = np.array(line["mesh_frequency"], float), points_of(pattern)
    shape = np.frombuffer(base64.b64decode(line["shape"]), np.int8).astype(float)
    first, second, third = line["divisions"]
    shapes = shape.reshape(frequency.shape[1], len(points), 3)
    return Stored((first, second, third), frequency, shapes, points, pattern.size)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Shells of the mixed sets.")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the files")
    parser.add_argument("--until", help="time of day (HH:MM) after which no case is begun")
    given = parser.parse_args(arguments)
    sets = case_sets()
    known = {name: read_references(name, given.out) for name in sets}
    for turn in zip_longest(*sets.values()):
        for name, case in zip(sets, turn, strict=True):
            if case is None or case.name in known[name]:
                continue
            if given.until and time.strftime("%H:%M") >= given.until:
                return 0
            line = computed(case, case.divisions)
            if not certain(case, stored(case, line)) and case.divisions != FINE:
                line = computed(case, FINE)
            with (given.out / f"{name}.jsonl").open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, separators=(",", ":")) + "\n")
            found = stored(case, line)
            worst = 100.0 * np.max(found.doubt, initial=0.0)
            print(f"{case.name}: {line['seconds']} s, +-{worst:.2f} %", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
