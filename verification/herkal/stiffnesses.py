"""The case studies and the specimen with stiffnesses other than the paper's.

The models that `foldyn.fidelity` compares with the shell compute the case studies under small
loads, and modes and peaks of the specimen. Each computation is kept as rows of a JSON file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from foldyn import store
from foldyn.algebra.extrapolation import extrapolated
from foldyn.analyses import read_case
from foldyn.input_files import file_digest
from foldyn.linear.fidelity import MODELS, fidelity, small_loads
from foldyn.shells import shell
from foldyn.structures import discretize
from foldyn.structures.discretized import Discretized
from foldyn.studies import find_case
from foldyn.studies.herkal.calibration import shipped
from foldyn.studies.herkal.runs import case_file_digest
from foldyn.studies.herkal.specimen.evaluation import corner_peaks
from foldyn.studies.pool import Task
from verification.herkal.sensitivity import KEPT

OWN = "own"  # the model of the specimen's case file
BESIDE = ("standard", "plate", "n5b8e")  # other models whose modes are computed
PEAKED = (OWN, "plate", "n5b8e")
SPECIMEN = ("specimen-modes", "specimen-frf")
MODES = 5
MESHES = (6, 12)  # divisions of the shells for the specimen
STUDIED = (8, 16)  # divisions of the shells for the case studies

# Files on which results depend, in addition to the solvers.
COMPUTING = "studies/herkal/calibration.py", "studies/herkal/specimen/evaluation.py"
SOURCE = file_digest(Path(__file__))

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Stiffness(Task):
    """A computation with these models.

    Attributes
    ----------
    kind : {"small-loads", "modes", "peaks"}
    of : str
        A case study for small loads, the specimen for modes, or a model of `PEAKED` for the
        specimen's peaks.
    divisions : tuple of int
        Divisions of the specimen's shells.
    """

    kind: Literal["small-loads", "modes", "peaks"]
    of: str = "specimen"
    divisions: tuple[int, int] = MESHES
    store = KEPT
    suffix = ".json"

    @property
    def name(self) -> str:
        """Name of the computation."""
        return f"{self.of}-{self.kind}" if self.kind != "peaks" else f"specimen-{self.of}-peaks"

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        files = (self.of,) if self.kind == "small-loads" else SPECIMEN
        mesh = {"divisions": list(self.divisions)} if self.kind == "modes" else {}
        return {
            "task": self.name,
            "case_files": [case_file_digest(file) for file in files],
            "program": [store.program(*COMPUTING), SOURCE],
            **mesh,
        }

    def compute(self, folder: Path) -> Rows:
        """Compute the rows of the table."""
        return ROWS[self.kind](self)


def tasks(cases: Sequence[str], divisions: tuple[int, int] = MESHES) -> list[Stiffness]:
    """All computations, the longest first."""
    found = [Stiffness("modes", divisions=divisions)]
    found += [Stiffness("small-loads", case) for case in cases]
    return found + [Stiffness("peaks", model) for model in PEAKED]


class Softness(NamedTuple):
    """Displacement under small loads, with relative errors by model.

    Attributes
    ----------
    case : str
    shell : float
        Displacement of the loaded nodes along their load, computed with the shell, m.
    error : mapping of str to float
    """

    case: str
    shell: float
    error: Mapping[str, float]


def between(values: Callable[[int], Any], meshes: tuple[int, int]) -> Any:
    """Value of a shell in the limit of fine meshes, from its values with two meshes."""
    coarse, fine = (np.asarray(values(n)) for n in meshes)
    return extrapolated(coarse, fine, meshes[1] / meshes[0])


def softness(name: str) -> Softness:
    """Displacement and errors for one of the paper's case studies."""
    given = read_case(find_case(f"herkal/{name}")).case("circumcenter")
    pattern, sheet = given.structure.pattern, given.structure.sheet

    def of(structure: Discretized) -> float:
        return small_loads(replace(given, structure=structure)).displacement

    true = float(between(lambda n: of(shell(pattern, sheet, divisions=n)), STUDIED))
    bars = {m: of(discretize(pattern, sheet, **o)) for m, o in MODELS.items()}
    return Softness(name, true, {model: found / true - 1.0 for model, found in bars.items()})


def _small_loads(asked: Stiffness) -> Rows:
    """Rows with the displacement (m) of the shell and relative errors, as in the fidelity study."""
    found = softness(asked.of)
    return [{"shell": found.shell, **found.error}]


def specimen_modes(divisions: tuple[int, int] = MESHES, **changes: Any) -> Rows:
    """First modes of the specimen by every model, compared with the shell.

    Parameters
    ----------
    divisions : tuple of int
        Divisions of the shells.
    **changes
        Changed keys of [model], such as fold_law="linear".

    Returns
    -------
    sequence of mappings
        One for each model and mode: model, mode, frequencies `shell` and `frequency` (Hz, None for
        a mode without a partner) and mac.
    """
    file = shipped("specimen-modes", {f"model.{k}": v for k, v in changes.items()})
    secant = file.analysis.arguments["secant"]
    found = fidelity(
        file.case(file.masses[0]),
        MODES,
        reference="shell",
        divisions=divisions,
        models=BESIDE,
        secant=secant,
    )
    return [
        {
            "model": model,
            "mode": one.mode,
            "shell": float(one.shell),
            "frequency": float(one.shell * (1 + one.error)) if math.isfinite(one.error) else None,
            "mac": float(one.mac),
        }
        for model in found.models
        for one in found.table(model)
    ]


def specimen_peaks(model: str) -> Rows:
    """Peaks of the specimen's frequency response, determined as in the paper.

    Returns
    -------
    sequence of mappings
        One for each peak: frequency (Hz) and damping, which is None without half-power points.
    """
    own = {} if model == OWN else {k: v for k, v in MODELS[model].items() if k != "straight"}
    file = shipped("specimen-frf", {f"model.{key}": value for key, value in own.items()})
    return [
        {
            "frequency": one.frequency,
            "damping": one.textbook if math.isfinite(one.textbook) else None,
        }
        for one in corner_peaks(file.run(file.masses[0]))
    ]


# Function that computes each kind.
ROWS: Mapping[str, Callable[[Stiffness], Rows]] = {
    "small-loads": _small_loads,
    "modes": lambda asked: specimen_modes(asked.divisions),
    "peaks": lambda asked: specimen_peaks(asked.of),
}
