"""Dependence of the results of the case studies on settings that the paper does not state.

All combinations of pulse, loaded nodes, law of the bends and calibration are run with every mass
distribution. A task computes one motion of the shell and the motions of all models under the same
load, and keeps only the errors. Other densities need no further motions: density only rescales
time, for pulse, damping and record together.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import foldyn
from foldyn.analyses import CaseFile
from foldyn.input_files import file_digest, from_json, read_text
from foldyn.store import Store, stamp_of
from foldyn.studies.herkal import runs
from foldyn.studies.herkal.metric import errors, partners
from foldyn.studies.herkal.runs import REFERENCE, Numerics
from foldyn.studies.pool import Task
from foldyn.writing import write_text
from verification.herkal import models
from verification.herkal.models import AS_FILED, DISTRIBUTIONS, LOADS, OTHERS, Variant, Varied
from verification.herkal.variations import Variations

PULSES = (0.1, 0.25, 0.5, 1.0)  # s
BEND_LAWS = ("superlinear", "linear")
CALIBRATIONS = ("standard", "merlin2")
# Models compared with the shell: all distributions, and equi-inertial with the other orientation.
MODELS = (*DISTRIBUTIONS, *OTHERS)
SOURCES = [file_digest(Path(file)) for file in (__file__, models.__file__)]

MOST = 64  # largest stored file (MiB)


def stiffnesses(load: Variant = AS_FILED) -> list[Variant]:
    """Variants of law and calibration of bars and hinges under one load."""
    laws = product(BEND_LAWS, CALIBRATIONS)
    return [Variant(load.pulse, load.loads, *law) for law in laws]


def load_sets(case_file: CaseFile) -> tuple[str, ...]:
    """Sets of loaded nodes; a single set if the case file loads the whole edge."""
    loaded = {node for load in case_file.case().loads for node in getattr(load, "nodes", ())}
    return LOADS[:1] if loaded == set(case_file.output.nodes.tolist()) else LOADS


def _digest(rows: Any) -> str:
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()


def _read(file: Path) -> tuple[str, list[dict[str, Any]]]:
    found = from_json(read_text(file, "what a study keeps", MOST, "compute it again"))
    if found["rows_sha256"] != _digest(found["rows"]):
        raise ValueError
    return stamp_of(found["settings"]), found["rows"]


def _write(file: Path, stamp: str, rows: list[dict[str, Any]]) -> None:
    kept = {"settings": json.loads(stamp), "rows": rows, "rows_sha256": _digest(rows)}
    write_text(json.dumps(kept, indent=1) + "\n", file)


KEPT: Store[list[dict[str, Any]]] = Store(_read, _write)


@dataclass(frozen=True)
class Comparison(Task):
    """All models compared with the shell, kept as rows of a JSON file with its settings.

    Attributes
    ----------
    case : str
    numerics : Numerics
    load : Variant or None
        Load under which the frequency content of motions is compared; with None the first
        frequencies at rest are compared.
    """

    case: str
    numerics: Numerics = field(default_factory=Numerics)
    load: Variant | None = None
    store = KEPT
    suffix = ".json"

    @property
    def name(self) -> str:
        """Name of the task."""
        what = "frequencies" if self.load is None else f"motions-{self.load.name}"
        return f"{self.case}-{what}"

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        return {
            "task": self.name,
            "case_file": runs.case_file_digest(self.case),
            "program": [runs.program(), *SOURCES],
            "models": list(MODELS),
            **asdict(self.numerics),
        }

    def compute(self, folder: Path) -> list[dict[str, Any]]:
        """Compute the rows of the table."""
        return list(self._frequencies() if self.load is None else self._errors(self.load))

    def _errors(self, load: Variant) -> Iterator[dict[str, Any]]:
        """Rows with errors of the frequency content under one load."""
        shown = runs.reported(self.case)
        reference = Varied(self.case, REFERENCE, "motion", self.numerics, load).compute()
        for variant in stiffnesses(load):
            row = {"case": self.case, **asdict(variant)}
            for model in MODELS:
                motion = Varied(self.case, model, "motion", self.numerics, variant).compute()
                row[model] = float(errors(motion, reference, *shown).mean())
            yield row

    def _frequencies(self) -> Iterator[dict[str, Any]]:
        """Rows that compare first frequencies with the shell's."""
        reference = Varied(self.case, REFERENCE, "modes", self.numerics).compute()
        for variant, model in product(stiffnesses(), MODELS):
            ours = Varied(self.case, model, "modes", self.numerics, variant).compute()
            found = partners(reference, ours)
            for k, shell in enumerate(found.reference):
                yield {
                    "case": self.case,
                    "bend_law": variant.bend_law,
                    "calibration": variant.calibration,
                    "model": model,
                    "mode": k + 1,
                    "shell": float(shell),
                    "frequency": float(found.frequency[k]),
                    "mac": float(found.mac[k]),
                }


def tasks(cases: Iterable[str], numerics: Numerics) -> list[Comparison]:
    """All tasks, the longest first."""
    names = list(cases)
    loads = [
        (case, loaded) for case in reversed(names) for loaded in load_sets(runs.case_study(case))
    ]
    found = [  # case 1 is the smallest
        Comparison(case, numerics, Variant(pulse, loaded))
        for (case, loaded), pulse in product(loads, PULSES)
    ]
    return [*found, *(Comparison(case, numerics) for case in names)]


def variations(folder: Path, cases: Iterable[str], numerics: Numerics) -> Variations:
    """Results of `tasks` in a folder."""
    motions: list[dict[str, Any]] = []
    frequencies: list[dict[str, Any]] = []
    for task in sorted(tasks(cases, numerics), key=lambda task: task.case):
        rows = frequencies if task.load is None else motions
        rows += task.result(folder) or []
    about = (
        f"Foldyn {foldyn.__version__}, shells of {numerics.divisions} divisions, steps of "
        f"{numerics.dt:g} s, motions of {numerics.duration:g} s"
    )
    return Variations(about, motions, frequencies)
