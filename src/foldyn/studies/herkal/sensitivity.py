"""How far the results of the case studies depend on what the paper leaves unsaid.

All combinations of pulse, loaded nodes, law of the bends and calibration, each with every mass
distribution. A task computes one motion of the shell and those that belong to it, and keeps only
the errors. Density needs no motions of its own: it only rescales time, that of pulse, damping and
record together.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import foldyn
from foldyn.analyses import CaseFile, read_case
from foldyn.input_files import from_json, read_text
from foldyn.store import Store, stamp_of
from foldyn.studies import find_case
from foldyn.studies.herkal.metric import UP_TO, errors
from foldyn.studies.herkal.models import LOADS, OTHERS, REFERENCE, Variant, rules
from foldyn.studies.herkal.partners import partners
from foldyn.studies.herkal.program import program
from foldyn.studies.herkal.runs import Job, Numerics, case_file_digest, compute
from foldyn.studies.herkal.variations import Variations
from foldyn.writing import write_text

PULSES = (0.1, 0.25, 0.5, 1.0)  # s
BEND_LAWS = ("superlinear", "linear")
CALIBRATIONS = ("standard", "merlin2")
MODELS = (*rules(), *OTHERS)
"""What is compared with the shell: the distributions, and equi-inertial turned the other way."""

MOST = 64
"""Size of a kept file (MiB)."""


def stiffnesses(pulse: float | None = None, loads: str = "file") -> list[Variant]:
    """Variants of bars and hinges under one load."""
    return [Variant(pulse, loads, *one) for one in product(BEND_LAWS, CALIBRATIONS)]


def load_sets(case_file: CaseFile) -> tuple[str, ...]:
    """Sets of loaded nodes; one where the case file loads the whole edge."""
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
    write_text(file, json.dumps(kept, indent=1) + "\n")


KEPT: Store[list[dict[str, Any]]] = Store(_read, _write)


@dataclass(frozen=True)
class _Kept:
    """A task whose result is a JSON file with its settings."""

    case: str
    numerics: Numerics = field(default_factory=Numerics)

    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.case}-{self.kind}"

    def settings(self) -> dict[str, Any]:
        """All that its result depends on."""
        return {
            "task": self.name,
            "case_file": case_file_digest(self.case),
            "program": program(),
            "models": list(MODELS),
            **asdict(self.numerics),
        }

    def there(self, folder: Path) -> bool:
        """Whether its result is in a folder."""
        return self.result(folder) is not None

    def result(self, folder: Path) -> list[dict[str, Any]] | None:
        """Rows that it found; None where there are none, or some of other settings."""
        return KEPT.find(folder / f"{self.name}.json", self.settings())

    def make(self, folder: Path) -> None:
        """Compute its result into a folder."""
        KEPT.keep(folder / f"{self.name}.json", self.settings(), list(self.rows()))

    def rows(self) -> Iterator[dict[str, Any]]:
        """Compute the rows."""
        raise NotImplementedError


@dataclass(frozen=True)
class Motions(_Kept):
    """Errors of the frequency content of all models under one load.

    Attributes
    ----------
    case : str
    numerics : Numerics
    pulse : float
        s.
    loads : str
        One of `foldyn.studies.herkal.models.LOADS`.
    """

    pulse: float = 0.5
    loads: str = "file"

    kind: ClassVar[str] = "motions"

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.case}-{self.kind}-{Variant(self.pulse, self.loads).name}"

    def rows(self) -> Iterator[dict[str, Any]]:
        """Compute the rows."""
        output = read_case(find_case(f"herkal/{self.case}")).output
        shown = output.nodes.tolist(), output.axis or "x", output.max_frequency or UP_TO
        load = Variant(self.pulse, self.loads)
        reference = compute(Job(self.case, REFERENCE, "motion", self.numerics, load))
        for variant in stiffnesses(self.pulse, self.loads):
            row = {"case": self.case, **asdict(variant)}
            for model in MODELS:
                motion = compute(Job(self.case, model, "motion", self.numerics, variant))
                row[model] = float(errors(motion, reference, *shown).mean())
            yield row


@dataclass(frozen=True)
class Frequencies(_Kept):
    """First frequencies of all models beside those of the shell."""

    kind: ClassVar[str] = "frequencies"

    def rows(self) -> Iterator[dict[str, Any]]:
        """Compute the rows."""
        reference = compute(Job(self.case, REFERENCE, "modes", self.numerics))
        for variant in stiffnesses():
            for model in MODELS:
                ours = compute(Job(self.case, model, "modes", self.numerics, variant))
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


def tasks(cases: Iterable[str], numerics: Numerics) -> list[Motions | Frequencies]:
    """All that is to be computed, the longest first."""
    names = list(cases)
    found: list[Motions | Frequencies] = []
    for case in reversed(names):  # case 1 is the smallest
        for loads in load_sets(read_case(find_case(f"herkal/{case}"))):
            found += [Motions(case, numerics, pulse, loads) for pulse in PULSES]
    return [*found, *(Frequencies(case, numerics) for case in names)]


def variations(folder: Path, cases: Iterable[str], numerics: Numerics) -> Variations:
    """What is in a folder of that of `tasks`."""
    found: dict[str, list[Any]] = {Motions.kind: [], Frequencies.kind: []}
    for task in sorted(tasks(cases, numerics), key=lambda task: task.case):
        found[task.kind] += task.result(folder) or []
    about = (
        f"Foldyn {foldyn.__version__}, shells of {numerics.divisions} divisions, steps of "
        f"{numerics.dt:g} s, motions of {numerics.duration:g} s"
    )
    return Variations(about, found[Motions.kind], found[Frequencies.kind])
