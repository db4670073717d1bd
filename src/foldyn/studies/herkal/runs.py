"""The computations of the case studies, each kept in its own file."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import xarray

from foldyn import program as programs
from foldyn.dynamics import simulate
from foldyn.input_files import file_digest
from foldyn.linear import modes
from foldyn.results import load, save
from foldyn.statics import trace
from foldyn.studies import find_case
from foldyn.studies.herkal.metric import UP_TO
from foldyn.studies.herkal.sheet_models import (
    AS_FILED,
    REFERENCE,
    Variant,
    case_study,
    case_with,
    model_of,
)
from foldyn.studies.pool import Task, datasets

# Files that the results of the case studies depend on, in addition to the solvers.
COMPUTING = tuple(
    f"studies/herkal/{name}.py" for name in ("sheet_models", "runs", "metric", "sensitivity")
)
INTERVAL = 0.01  # s, between samples, unless the case file sets it
STEPS = 10  # steps of a path's load
SHELL_MODES, RULE_MODES = 5, 12  # modes of the reference; candidates for partners
SECANT = 1.0  # degrees, amplitude of the hinges: superlinear bends have no slope at rest


@dataclass(frozen=True)
class Numerics:
    """Numerical resolution.

    Attributes
    ----------
    divisions : int
        Divisions of the shell.
    dt : float
        Time step (s) for the shell and other implicit models.
    duration : float
        Duration of motions (s).
    """

    divisions: int = 16
    dt: float = 0.005
    duration: float = 10.0


@dataclass(frozen=True)
class Job(Task):
    """One computation.

    Attributes
    ----------
    case : str
        Name of a shipped case of a motion, "case1".
    model : str
        One of `foldyn.studies.herkal.sheet_models.MODELS`.
    kind : {"path", "modes", "motion"}
    numerics : Numerics
    variant : Variant
    """

    case: str
    model: str
    kind: Literal["path", "modes", "motion"]
    numerics: Numerics = field(default_factory=Numerics)
    variant: Variant = AS_FILED
    store = datasets(load, save)

    @property
    def name(self) -> str:
        """Name of the computation."""
        return "-".join(filter(None, (self.case, self.model, self.kind, self.variant.name)))

    def settings(self) -> dict[str, Any]:
        """Everything that its result depends on."""
        numerics = {} if self.kind != "motion" else {"duration": self.numerics.duration}
        if self.model == REFERENCE:  # other models have no mesh
            numerics["divisions"] = self.numerics.divisions
        if self.kind == "motion" and model_of(self.model).implicit:
            numerics["dt"] = self.numerics.dt
        return {
            "case": self.case,
            "case_file": case_file_digest(self.case),
            "program": program(),
            "model": self.model,
            "kind": self.kind,
            "variant": asdict(self.variant),
            **numerics,
        }

    def compute(self, folder: Path) -> xarray.Dataset:
        """Run it; the result covers the pattern's vertices, which all models share."""
        return compute(self)


def program() -> str:
    """Digest of the program that computes the case studies."""
    return programs.program(*COMPUTING)


def case_file_digest(case: str) -> str:
    """Digest of a shipped case file."""
    return file_digest(find_case(f"herkal/{case}"))


def reported(case: str) -> tuple[list[int], str, float]:
    """Nodes and axis that a case study reports, and the upper end of its spectra (Hz)."""
    output = case_study(case).output
    return output.nodes.tolist(), output.axis or "x", output.max_frequency or UP_TO


def compute(job: Job) -> xarray.Dataset:
    """Run a computation; the result covers the pattern's vertices, which all models share."""
    case_file = case_study(job.case)
    case = case_with(case_file, job.model, job.variant, job.numerics.divisions)
    model, of_shell = model_of(job.model), job.model == REFERENCE
    if job.kind == "path":
        found = trace(case, steps=STEPS)
    elif job.kind == "modes":
        count, secant = SHELL_MODES if of_shell else RULE_MODES, SECANT
        found = modes(replace(case, loads=()), count, secant=secant if model.distribution else None)
    else:
        own = {"method": "newmark", "dt": job.numerics.dt} if model.implicit else {}
        given = {"interval": INTERVAL, **case_file.analysis.arguments, **own}
        found = simulate(case, **{**given, "duration": job.numerics.duration})
    kept = found.drop_vars("velocity", errors="ignore")
    kept = kept.sel(node=range(len(case_file.pattern.vertices)))
    kept.attrs |= {
        "rerunnable": 0,
        "not_rerunnable_because": "a study keeps what happens at the pattern's vertices only",
    }
    return kept
