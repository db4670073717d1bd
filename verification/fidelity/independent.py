"""The shell's frequencies compared with OpenSees, which shares no code with it.

    python -m verification.fidelity.independent

computes and stores the documented cases that the model of the case studies supports (panels of four
corners, supports of vertices, nothing free); it needs the extra `opensees`.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.materials import EnhancedLinear
from foldyn.structures import discretize
from verification.fidelity.cases import FidelityCase, documented
from verification.fidelity.compare import RESULTS, read
from verification.opensees.model import PanelShells

STORED = RESULTS / "opensees.csv"
MESHES = (8, 16)  # divisions
BESIDE = ("plate, consistent", "n5b8e, condensed")
HELD = ("case 1", "panel", "folding")
LINEAR = EnhancedLinear(5.0, 355.0)  # folds that are linear at any rest angle


class Independent(NamedTuple):
    """Frequencies (Hz) of a mode: by OpenSees, extrapolated, by the shell and by two models."""

    case: str
    mode: int
    opensees: float
    shell: float
    plate: float  # calibration plate, consistent mass
    n5b8e: float  # condensed mass


def frequencies(case: FidelityCase, count: int) -> NDArray:
    """Lowest frequencies (count,), Hz, of a case by OpenSees."""
    held = case.case(discretize(case.pattern(), case.sheet, fold_law=LINEAR, preset="plate"))
    coarse, fine = (PanelShells(held, n).frequencies(count) for n in MESHES)
    return extrapolated(coarse, fine, MESHES[1] / MESHES[0])


def taken(case: FidelityCase) -> bool:
    """Whether OpenSees' model supports a case."""
    four = all(len(face) == 4 for face in case.pattern().faces)
    return four and case.support in HELD


def computed() -> list[Independent]:
    """All stored modes of the documented set that OpenSees' model supports."""
    stored = {modes.case: modes.rows for modes in read(RESULTS / "documented.csv")}
    found = []
    for case in documented():
        if case.name not in stored or not taken(case):
            continue
        both = [stored[case.name][model] for model in BESIDE]
        own = frequencies(case, max(row.mode for row in both[0]) + 1)
        for rows in zip(*both, strict=True):
            mode, shell = rows[0].mode, rows[0].shell
            models = (row.shell * (1.0 + row.error) for row in rows)
            found.append(Independent(case.name, mode, float(own[mode - 1]), shell, *models))
    return found


def write(found: list[Independent], path: Path) -> None:
    """Write a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(
            ["case", "mode", "opensees [Hz]", "shell [Hz]", *(f"{m} [Hz]" for m in BESIDE)]
        )
        for one in found:
            out.writerow([one.case, one.mode, *(f"{f:.6g}" for f in one[2:])])


def read_stored(path: Path = STORED) -> list[Independent]:
    """A table that `write` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))[1:]
    return [Independent(name, int(mode), *map(float, values)) for name, mode, *values in lines]


def errors(found: list[Independent]) -> dict[str, NDArray]:
    """Relative errors of the shell and of both models against OpenSees."""
    true = np.array([one.opensees for one in found])
    named = ("shell", "plate", "n5b8e")
    return {name: np.array([getattr(one, name) for one in found]) / true - 1.0 for name in named}


if __name__ == "__main__":
    results = computed()
    write(results, STORED)
    for what, error in errors(results).items():
        median, ninetieth = np.percentile(np.abs(error), [50, 90], method="higher")
        print(
            f"{what}: {len({one.case for one in results})} cases, {len(error)} modes, "
            f"median {100 * median:.2f} %, 90th percentile {100 * ninetieth:.2f} %, "
            f"largest {100 * np.abs(error).max():.2f} %"
        )
    sys.exit(0)
