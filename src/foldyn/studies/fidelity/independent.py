"""The shell's frequencies beside those of OpenSees, which shares no code with it.

    python -m foldyn.studies.fidelity.independent

computes those documented cases that the model of the case studies takes (panels of four corners,
supports of vertices, nothing free) and stores them; it needs the extra `opensees`.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.linear.refinement import extrapolated
from foldyn.materials import EnhancedLinear
from foldyn.structures import discretize
from foldyn.studies.fidelity.cases import FidelityCase, documented
from foldyn.studies.fidelity.stored import RESULTS, read
from foldyn.studies.herkal.opensees.model import PanelShells

STORED = RESULTS / "opensees.csv"
MESHES = (8, 16)  # divisions
HELD = ("case 1", "panel", "folding")
LINEAR = EnhancedLinear(5.0, 355.0)  # folds that are linear wherever they rest


class Independent(NamedTuple):
    """Frequencies (Hz) of a mode: of OpenSees, extrapolated, of the shell and of a model."""

    case: str
    mode: int
    opensees: float
    shell: float
    plate: float  # calibration plate, consistent mass


def frequencies(case: FidelityCase, count: int) -> NDArray:
    """Lowest frequencies (count,), Hz, of a case by OpenSees."""
    held = case.case(discretize(case.pattern(), case.sheet, fold_law=LINEAR))
    coarse, fine = (PanelShells(held, n).frequencies(count) for n in MESHES)
    return extrapolated(coarse, fine, MESHES[1] / MESHES[0])


def taken(case: FidelityCase) -> bool:
    """Whether OpenSees' model takes a case."""
    four = all(len(face) == 4 for face in case.pattern().faces)
    return four and case.support in HELD


def computed() -> list[Independent]:
    """All modes of the documented set that are stored and that OpenSees' model takes."""
    stored = {
        modes.case: modes.rows["plate, consistent"] for modes in read(RESULTS / "documented.csv")
    }
    found = []
    for case in documented():
        rows = stored.get(case.name, [])
        if not rows or not taken(case):
            continue
        own = frequencies(case, max(row.mode for row in rows) + 1)
        for row in rows:
            plate = row.shell * (1.0 + row.error)
            found.append(
                Independent(case.name, row.mode, float(own[row.mode - 1]), row.shell, plate)
            )
    return found


def write(path: Path, found: list[Independent]) -> None:
    """Write a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["case", "mode", "opensees [Hz]", "shell [Hz]", "plate, consistent [Hz]"])
        for one in found:
            out.writerow([one.case, one.mode, *(f"{f:.6g}" for f in one[2:])])


def read_stored(path: Path = STORED) -> list[Independent]:
    """A table that `write` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))[1:]
    return [Independent(name, int(mode), *map(float, values)) for name, mode, *values in lines]


def errors(found: list[Independent]) -> tuple[NDArray, NDArray]:
    """Relative errors of the shell and of the plate calibration against OpenSees."""
    true = np.array([one.opensees for one in found])
    shell, plate = (np.array([getattr(one, name) for one in found]) for name in ("shell", "plate"))
    return shell / true - 1.0, plate / true - 1.0


if __name__ == "__main__":
    results = computed()
    write(STORED, results)
    for what, error in zip(("shell", "plate"), errors(results), strict=True):
        median, ninetieth = np.percentile(np.abs(error), [50, 90], method="higher")
        print(
            f"{what}: {len({one.case for one in results})} cases, {len(error)} modes, "
            f"median {100 * median:.2f} %, 90th percentile {100 * ninetieth:.2f} %, "
            f"largest {100 * np.abs(error).max():.2f} %"
        )
    sys.exit(0)
