"""The four case studies: computations, and tables made from the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.studies.herkal import metric, runs, stiffnesses
from foldyn.studies.herkal.opensees.stored import read_motion, stored_motions
from foldyn.studies.herkal.runs import Job, Numerics, Variant
from foldyn.studies.herkal.specimen.measured import Data
from foldyn.studies.herkal.specimen.synthetic import COARSE, PAPERS, Shot
from foldyn.studies.herkal.specimen.tasks import Part, parts
from foldyn.studies.herkal.stiffnesses import MESHES, Rows, Stiffness
from foldyn.studies.pool import Done, run

RESULTS = "runs"  # folder of results within the study's folder
LINEAR = Variant(bend_law="linear")


@dataclass(frozen=True)
class StudyPlan:
    """Computations of a study.

    Attributes
    ----------
    numerics : Numerics
    cases : tuple of str
    models : tuple of str
        Models in addition to the reference, which is always included.
    shot : Shot
        Settings of the synthetic film of the specimen.
    meshes : tuple of int
        Divisions of the shells for the specimen.
    """

    numerics: Numerics = field(default_factory=Numerics)
    cases: tuple[str, ...] = runs.CASES
    models: tuple[str, ...] = field(default_factory=runs.compared)
    shot: Shot = PAPERS
    meshes: tuple[int, int] = MESHES

    def jobs(self) -> list[Job]:
        """All computations, the longest first."""
        found = [
            Job(case, model, kind, self.numerics)
            for kind in ("motion", "modes")
            for model in (runs.REFERENCE, *self.models)
            for case in self.cases
        ]
        return found + [
            Job(case, model, "path", self.numerics, variant)
            for case in self.cases
            for model, variant in self.paths().values()
        ]

    def stiffnesses(self) -> list[Stiffness]:
        """Computations with stiffnesses other than the paper's, in addition to `jobs`."""
        return stiffnesses.tasks(self.cases, self.meshes)

    def paths(self) -> dict[str, tuple[str, Variant]]:
        """Model and variant for each stiffness, by label; mass does not matter in statics."""
        found: dict[str, tuple[str, Variant]] = {}
        for name in (runs.REFERENCE, *self.models):
            stiffness = runs.model_of(name).statics
            found.setdefault(stiffness, (name, runs.AS_FILED))
            if runs.model_of(name).distribution:
                found.setdefault(f"{stiffness}, linear bends", (name, LINEAR))
        return found


FULL = StudyPlan()
QUICK = StudyPlan(Numerics(divisions=8, dt=0.01), shot=COARSE, meshes=(3, 6))
VARIED = Numerics(divisions=8, dt=0.01)  # resolution of the sensitivity


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
        tasks = (self.plan.jobs(), self.plan.stiffnesses(), *self.parts)
        return sum(map(len, tasks))

    def compute(
        self, tell: Callable[[Done], None] = lambda done: None, processes: int = 2
    ) -> list[Done]:
        """Compute missing results; see `foldyn.studies.pool.run`."""
        results = self.folder / RESULTS
        results.mkdir(parents=True, exist_ok=True)
        first, then = self.parts
        ended = run([*first, *self.plan.jobs(), *self.plan.stiffnesses()], results, tell, processes)
        return ended + run(then, results, tell, processes=1)

    def result(
        self, case: str, model: str, kind: str, variant: Variant = runs.AS_FILED
    ) -> xarray.Dataset | None:
        """Result of a computation, or None if missing."""
        job = Job(case, model, kind, self.plan.numerics, variant)  # type: ignore[arg-type]
        if self._read.get(job) is None:
            self._read[job] = job.result(self.folder / RESULTS)
        return self._read[job]

    def rows(self, kind: str, of: str = "specimen") -> Rows | None:
        """Rows of a computation of `stiffnesses`, or None if missing."""
        task = Stiffness(kind, of, self.plan.meshes)  # type: ignore[arg-type]
        return task.result(self.folder / RESULTS)

    # ------------------------------------------------------------------ tables
    def node_errors(
        self, case: str, model: str, variant: Variant = runs.AS_FILED
    ) -> NDArray | None:
        """Deviation of the frequency content from that of the shell, for each node."""
        reference = self.result(case, runs.REFERENCE, "motion", variant.of_shell)
        motion = self.result(case, model, "motion", variant)
        if reference is None or motion is None:
            return None
        return metric.errors(motion, reference, *runs.reported(case))

    def error(self, case: str, model: str, variant: Variant = runs.AS_FILED) -> float:
        """The paper's metric, nan if a motion is missing."""
        found = self.node_errors(case, model, variant)
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
        """Equilibrium paths by stiffness; bars and hinges also with linear bends."""
        found = {
            label: self.result(case, model, "path", variant)
            for label, (model, variant) in self.plan.paths().items()
        }
        return {label: path for label, path in found.items() if path is not None}

    def frequencies(self, case: str, model: str) -> metric.Partners | None:
        """Modes of a model, matched with modes of the shell."""
        reference = self.result(case, runs.REFERENCE, "modes")
        ours = self.result(case, model, "modes")
        if reference is None or ours is None:
            return None
        return metric.partners(reference, ours)


def mean_ranks(table: Mapping[str, Mapping[str, float]], models: Iterable[str]) -> dict[str, float]:
    """Mean rank of each model over the cases; only the given models are ranked."""
    names = list(models)
    each = [metric.ranks({m: row[m] for m in names if m in row}) for row in table.values()]
    return {m: float(np.mean([r.get(m, np.nan) for r in each])) for m in names if each}


def second_table(study: Study) -> dict[str, tuple[int, dict[str, float]]]:
    """By case, the divisions of OpenSees' finest stored motion, and errors relative to that motion.

    Cases without such a motion, or with a duration other than that of the study, are left out.
    """
    found = {}
    for case in study.plan.cases:
        for divisions, dt in reversed(stored_motions(case)):
            row = _second_row(study, case, divisions, dt)
            if row:
                found[case] = divisions, row
                break
    return found


def _second_row(study: Study, case: str, divisions: int, dt: float) -> dict[str, float]:
    nodes, axis, up_to = runs.reported(case)
    theirs = read_motion(case, divisions, dt)
    if theirs.node.tolist() != nodes:
        return {}
    moved = theirs.displacement[:, :, metric.AXES.index(axis)]
    reference = metric.content_of(theirs.time, moved, up_to)[1]
    row = {}
    for model in study.plan.models:
        motion = study.result(case, model, "motion")
        if motion is None or len(motion["time"]) != len(theirs.time):
            return {}
        ours = metric.content(motion, nodes, axis, up_to)[1]
        row[model] = float(np.mean(metric.deviation(ours, reference)))
    return row
