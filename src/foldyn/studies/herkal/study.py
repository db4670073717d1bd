"""The four case studies: computations, and tables made from the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.studies.herkal import metric, runs
from foldyn.studies.herkal.runs import BARS_AND_HINGES, REFERENCE, Job, Numerics
from foldyn.studies.herkal.specimen.measured import Data
from foldyn.studies.herkal.specimen.synthetic import COARSE, PAPERS, Shot
from foldyn.studies.herkal.specimen.tasks import Part, parts
from foldyn.studies.pool import Done, run

RESULTS = "runs"  # folder of results within the study's folder


@dataclass(frozen=True)
class StudyPlan:
    """Computations of a study.

    Attributes
    ----------
    numerics : Numerics
    cases : tuple of str
    models : mapping of str to str
        Labels of the models that are compared with the reference.
    shot : Shot
        Settings of the synthetic film of the specimen.
    """

    numerics: Numerics = field(default_factory=Numerics)
    cases: tuple[str, ...] = runs.CASES
    models: Mapping[str, str] = field(default_factory=lambda: runs.RULES)
    shot: Shot = PAPERS

    def job(self, case: str, model: str, kind: Any) -> Job:
        """One computation."""
        return Job(case, model, kind, self.numerics)

    def paths(self, case: str) -> dict[str, Job]:
        """Static computations by the label of their stiffness, on which mass has no influence."""
        models = {REFERENCE: REFERENCE, BARS_AND_HINGES: next(iter(self.models))}
        return {label: self.job(case, model, "path") for label, model in models.items()}

    def jobs(self) -> list[Job]:
        """All computations, the longest first."""
        found = [
            self.job(case, model, kind)
            for kind in ("motion", "modes")
            for model in (REFERENCE, *self.models)
            for case in self.cases
        ]
        return [*found, *(path for case in self.cases for path in self.paths(case).values())]


FULL = StudyPlan()
QUICK = StudyPlan(Numerics(divisions=8, dt=0.01), shot=COARSE)


@dataclass(frozen=True, eq=False)
class Study:
    """Results of a plan in a folder.

    Attributes
    ----------
    plan : StudyPlan
    folder : Path
        Folder of the study; results are in its folder `runs`.
    data : Data or None
        Measurements of the specimen; None leaves it out.
    """

    plan: StudyPlan
    folder: Path
    data: Data | None = None
    _read: dict[Job, xarray.Dataset | None] = field(default_factory=dict, init=False, repr=False)

    @property
    def parts(self) -> tuple[list[Part], list[Part]]:
        """Computations for the specimen: the independent ones, then the ones that need them."""
        return ([], []) if self.data is None else parts(self.plan.shot, self.data)

    @property
    def count(self) -> int:
        """Number of computations."""
        return sum(map(len, (self.plan.jobs(), *self.parts)))

    def compute(
        self, tell: Callable[[Done], None] = lambda done: None, processes: int = 2
    ) -> list[Done]:
        """Compute missing results; see `foldyn.studies.pool.run`."""
        results = self.folder / RESULTS
        results.mkdir(parents=True, exist_ok=True)
        first, then = self.parts
        ended = run([*first, *self.plan.jobs()], results, tell, processes)
        return ended + run(then, results, tell, processes=1)

    def found(self, job: Job) -> xarray.Dataset | None:
        """Result of a computation, or None if missing."""
        if self._read.get(job) is None:
            self._read[job] = job.result(self.folder / RESULTS)
        return self._read[job]

    def result(self, case: str, model: str, kind: str) -> xarray.Dataset | None:
        """Result of a computation of the plan, or None if missing."""
        return self.found(self.plan.job(case, model, kind))

    def motions(self, case: str) -> dict[str, xarray.Dataset]:
        """The stored motions of a case by model, starting with the shell."""
        motions = {m: self.result(case, m, "motion") for m in (REFERENCE, *self.plan.models)}
        return {m: motion for m, motion in motions.items() if motion is not None}

    # ------------------------------------------------------------------ tables
    def node_errors(self, case: str, model: str) -> NDArray | None:
        """Deviation of the frequency content from that of the shell, for each node."""
        reference = self.result(case, REFERENCE, "motion")
        motion = self.result(case, model, "motion")
        if reference is None or motion is None:
            return None
        return metric.errors(motion, reference, *runs.reported(case))

    def error(self, case: str, model: str) -> float:
        """The paper's metric, nan if a motion is missing."""
        found = self.node_errors(case, model)
        return float("nan") if found is None else float(found.mean())

    def table(self, models: Iterable[str] | None = None) -> dict[str, dict[str, float]]:
        """The numbers of the paper's Table 1, computed: the metric by case and model."""
        names = self.plan.models if models is None else tuple(models)
        return {c: {m: self.error(c, m) for m in names} for c in self.plan.cases}

    def displacements(self, case: str) -> dict[str, NDArray]:
        """Static displacement (m) of the reported nodes at full load, by path."""
        nodes, axis, _ = runs.reported(case)
        return {
            label: path["displacement"].sel(node=nodes, axis=axis).values[-1]
            for label, path in self.paths(case).items()
        }

    def paths(self, case: str) -> dict[str, xarray.Dataset]:
        """Equilibrium paths by stiffness."""
        found = {label: self.found(job) for label, job in self.plan.paths(case).items()}
        return {label: path for label, path in found.items() if path is not None}

    def frequencies(self, case: str, model: str) -> metric.Partners | None:
        """Modes of a model, matched with modes of the shell."""
        reference = self.result(case, REFERENCE, "modes")
        ours = self.result(case, model, "modes")
        if reference is None or ours is None:
            return None
        return metric.partners(reference, ours)


def mean_ranks(table: Mapping[str, Mapping[str, float]], models: Iterable[str]) -> dict[str, float]:
    """Mean rank of each model over the cases; only the given models are ranked."""
    names = list(models)
    each = [metric.ranks({m: row[m] for m in names if m in row}) for row in table.values()]
    return {m: float(np.mean([r.get(m, np.nan) for r in each])) for m in names if each}
