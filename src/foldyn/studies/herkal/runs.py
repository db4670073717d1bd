"""Computations of the case studies with the shell and the paper's mass rules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import xarray

from foldyn import store
from foldyn.analyses import CaseFile, read_case
from foldyn.cases import Case
from foldyn.dynamics import simulate
from foldyn.input_files import file_digest
from foldyn.linear import modes
from foldyn.results import load, save
from foldyn.shells import shell
from foldyn.statics import trace
from foldyn.studies import find_case
from foldyn.studies.herkal.metric import UP_TO
from foldyn.studies.pool import Task, datasets

CASES = ("case1", "case2", "case3", "case4")
REFERENCE = "shell"
BARS_AND_HINGES = "bars and hinges"
# Labels of the paper's mass rules, in the order of the tables.
RULES: Mapping[str, str] = {
    "equi_inertial": "equi-inertial",
    "panel": "panel",
    "centroid": "centroid",
    "circumcenter": "circumcenter",
    "consistent": "consistent",
}
# Files on which results of the case studies depend, in addition to the solvers.
COMPUTING = "studies/herkal/runs.py", "studies/herkal/metric.py"
INTERVAL = 0.01  # s, between samples, unless the case file sets it
STEPS = 10  # number of load steps of a path
# number of modes of the reference; number of candidates for their partners
SHELL_MODES, RULE_MODES = 5, 12
SECANT = 1.0  # degrees, amplitude of the hinges: superlinear bends have no slope at rest


def case_study(name: str) -> CaseFile:
    """Shipped case file of a case study, such as "case1"."""
    return read_case(find_case(f"herkal/{name}"))


def shell_case(case_file: CaseFile, divisions: int = 16) -> Case:
    """Case of a file as a shell with the same creases, supports, loads and damping."""
    case = case_file.case()
    given = vars(case.structure.options)
    creases = {name: given[name] for name in ("fold_law", "crease_stiffness", "crease_rest")}
    made = shell(case_file.pattern, case_file.sheet, divisions=divisions, **creases)
    return replace(case, structure=made)


@dataclass(frozen=True)
class Numerics:
    """Numerical resolution.

    Attributes
    ----------
    divisions : int
        Divisions of the shell.
    dt : float
        Time step (s) for the shell.
    duration : float
        Duration of motions (s).
    """

    divisions: int = 16
    dt: float = 0.005
    duration: float = 10.0


@dataclass(frozen=True)
class Job(Task):
    """One computation; its result covers the pattern's vertices, which all models share.

    Attributes
    ----------
    case : str
        Name of a shipped case study, such as "case1".
    model : str
        `REFERENCE`, or a mass rule.
    kind : {"path", "modes", "motion"}
    numerics : Numerics
    """

    case: str
    model: str
    kind: Literal["path", "modes", "motion"]
    numerics: Numerics = field(default_factory=Numerics)
    store = datasets(load, save)

    @property
    def name(self) -> str:
        """Name of the computation."""
        return f"{self.case}-{self.model}-{self.kind}"

    @property
    def implicit(self) -> bool:
        """Whether motions use Newmark's method with the study's time step."""
        return self.model == REFERENCE

    @property
    def secant(self) -> float | None:
        """Amplitude (degrees) of the hinges in modes; None for their slope at rest."""
        return None if self.model == REFERENCE else SECANT

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        numerics = {} if self.kind != "motion" else {"duration": self.numerics.duration}
        if self.model == REFERENCE:  # other models have no mesh
            numerics["divisions"] = self.numerics.divisions
        if self.kind == "motion" and self.implicit:
            numerics["dt"] = self.numerics.dt
        return {
            "case": self.case,
            "case_file": case_file_digest(self.case),
            "program": program(),
            "model": self.model,
            "kind": self.kind,
            **numerics,
        }

    def given(self, case_file: CaseFile) -> Case:
        """The case that is computed."""
        if self.model == REFERENCE:
            return shell_case(case_file, self.numerics.divisions)
        return case_file.case(self.model)

    def compute(self, folder: Path | None = None) -> xarray.Dataset:
        """Run the computation."""
        case_file = case_study(self.case)
        case = self.given(case_file)
        if self.kind == "path":
            found = trace(case, steps=STEPS)
        elif self.kind == "modes":
            count = SHELL_MODES if self.model == REFERENCE else RULE_MODES
            found = modes(replace(case, loads=()), count, secant=self.secant, check_model=False)
        else:
            own = {"method": "newmark", "dt": self.numerics.dt} if self.implicit else {}
            given = {"interval": INTERVAL, **case_file.analysis.arguments, **own}
            found = simulate(case, **{**given, "duration": self.numerics.duration})
        kept = found.drop_vars("velocity", errors="ignore")
        kept = kept.sel(node=range(len(case_file.pattern.vertices)))
        kept.attrs |= {
            "rerunnable": 0,
            "not_rerunnable_because": "a study keeps what happens at the pattern's vertices only",
        }
        return kept


def program() -> str:
    """Digest of the program that computes the case studies."""
    return store.program(*COMPUTING)


def case_file_digest(case: str) -> str:
    """Digest of a shipped case file."""
    return file_digest(find_case(f"herkal/{case}"))


def reported(case: str) -> tuple[list[int], str, float]:
    """Nodes and axis that a case study reports, and the upper end of its spectra (Hz)."""
    output = case_study(case).output
    return output.nodes.tolist(), output.axis or "x", output.max_frequency or UP_TO
