"""The computations of the case studies, each kept in a file of its own.

So a study goes on where it was interrupted.
"""

from __future__ import annotations

import hashlib
import json
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from foldyn.cases import Case, CaseFile, read_case
from foldyn.dynamics import simulate
from foldyn.errors import FoldynError, FoldynWarning, InputError
from foldyn.linear import modes
from foldyn.results import load, save
from foldyn.statics import trace
from foldyn.studies import find_case
from foldyn.studies.herkal.models import REFERENCE, Variant, case_with

if TYPE_CHECKING:
    import xarray

SETTINGS = "study_settings"
EVERY = 0.01  # s, between samples where the case file does not say
STEPS = 10  # of the load of a path
SHELL_MODES, RULE_MODES = 5, 12  # of the reference, and among how many their partners are sought
SECANT = 1.0  # degrees, by which hinges turn: superlinear bends have no slope at rest


@dataclass(frozen=True)
class Numerics:
    """How finely is computed.

    Attributes
    ----------
    divisions : int
        Of the shell.
    dt : float
        Step (s) of the shell's motions.
    duration : float
        Of motions (s).
    """

    divisions: int = 16
    dt: float = 0.005
    duration: float = 10.0


@dataclass(frozen=True)
class Job:
    """One computation.

    Attributes
    ----------
    case : str
        Name of a shipped case of a motion, "case1".
    model : str
        One of `foldyn.studies.herkal.models.MODELS`.
    kind : {"path", "modes", "motion"}
    numerics : Numerics
    variant : Variant
    """

    case: str
    model: str
    kind: Literal["path", "modes", "motion"]
    numerics: Numerics = field(default_factory=Numerics)
    variant: Variant = field(default_factory=Variant)

    @property
    def name(self) -> str:
        """What it is called."""
        return "-".join(filter(None, (self.case, self.model, self.kind, self.variant.name)))

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.name}.nc"

    def settings(self) -> dict[str, Any]:
        """All that its result depends on but the program."""
        text = find_case(f"herkal/{self.case}").read_bytes()
        numerics = asdict(self.numerics)
        if self.model != REFERENCE:  # neither a mesh nor steps of its own
            numerics = {"duration": self.numerics.duration}
        if self.kind != "motion":
            numerics.pop("duration", None)
            numerics.pop("dt", None)
        return {
            "case": self.case,
            "case_file": hashlib.sha256(text).hexdigest()[:16],
            "model": self.model,
            "kind": self.kind,
            "variant": asdict(self.variant),
            **numerics,
        }


def compute(job: Job) -> xarray.Dataset:
    """Run a computation; the result is that of the pattern's vertices."""
    case_file = read_case(find_case(f"herkal/{job.case}"))
    case = case_with(case_file, job.model, job.variant, job.numerics.divisions)
    kinds = {"path": _path, "modes": _modes, "motion": _motion}
    return _vertices_of(kinds[job.kind](job, case_file, case), job, case_file)


def _path(job: Job, case_file: CaseFile, case: Case) -> xarray.Dataset:
    return trace(case, steps=STEPS)


def _modes(job: Job, case_file: CaseFile, case: Case) -> xarray.Dataset:
    unloaded = Case(case.structure, case.supports, damping=case.damping)
    if job.model == REFERENCE:
        return modes(unloaded, SHELL_MODES)
    return modes(unloaded, RULE_MODES, secant=SECANT)


def _motion(job: Job, case_file: CaseFile, case: Case) -> xarray.Dataset:
    arguments = {"every": EVERY, **case_file.analysis.arguments, "duration": job.numerics.duration}
    if job.model == REFERENCE:
        arguments |= {"method": "newmark", "dt": job.numerics.dt}
    return simulate(case, **arguments)


def _vertices_of(found: xarray.Dataset, job: Job, case_file: CaseFile) -> xarray.Dataset:
    """Result at the pattern's vertices, which all models have, with the settings of the job."""
    kept = found.drop_vars("velocity", errors="ignore")
    kept = kept.sel(node=range(len(case_file.pattern.vertices)))
    kept.attrs |= {
        "rerunnable": 0,
        "not_rerunnable_because": "a study keeps what happens at the pattern's vertices only",
        SETTINGS: _text(job),
    }
    return kept


def _text(job: Job) -> str:
    return json.dumps(job.settings(), sort_keys=True)


def stored(folder: Path, job: Job) -> xarray.Dataset | None:
    """Result of a job in a folder; None where there is none, or one of other settings."""
    path = folder / job.file
    if not path.is_file():
        return None
    try:
        found = load(path)
    except InputError:  # cut short by a full disk, or no result at all: computed again
        return None
    return found if found.attrs.get(SETTINGS) == _text(job) else None


@dataclass(frozen=True)
class Done:
    """What became of a job.

    Attributes
    ----------
    job : Job
    seconds : float
        That it took; 0 where it was skipped.
    skipped : bool
        Whether its result was there already.
    failure : str
        Why there is no result, or "".
    warnings : tuple of str
        What was warned of.
    """

    job: Job
    seconds: float = 0.0
    skipped: bool = False
    failure: str = ""
    warnings: tuple[str, ...] = ()


def run(
    jobs: Iterable[Job],
    folder: Path,
    tell: Callable[[Done], None] = lambda done: None,
    processes: int = 2,
) -> list[Done]:
    """Run what is not yet in a folder.

    Parameters
    ----------
    jobs : iterable of Job
        The longest first.
    folder : Path
        Exists; gets a file for each job.
    tell : callable
        Called with each job that is done, skipped or failed.
    processes : int
        How many jobs run at a time; 1: in this process.

    Returns
    -------
    list of Done
        Jobs fail one by one; the others are computed all the same.
    """
    ended: list[Done] = []

    def end(done: Done) -> None:
        ended.append(done)
        tell(done)

    open_jobs: list[Job] = []
    for job in dict.fromkeys(jobs):
        if stored(folder, job) is None:
            open_jobs.append(job)
        else:
            end(Done(job, skipped=True))
    if processes <= 1 or len(open_jobs) <= 1:
        for job in open_jobs:
            end(_compute_and_keep(job, folder))
        return ended
    _in_processes(open_jobs, folder, end, processes)
    return ended


def _in_processes(
    jobs: Sequence[Job], folder: Path, end: Callable[[Done], None], processes: int
) -> None:
    pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"))
    try:
        running = {pool.submit(_compute_and_keep, job, folder) for job in jobs}
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            for one in finished:
                end(one.result())
    except KeyboardInterrupt:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _compute_and_keep(job: Job, folder: Path) -> Done:
    began = time.perf_counter()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            save(compute(job), folder / job.file)
            failure = ""
        except FoldynError as error:
            failure = str(error)
    messages = [str(one.message) for one in told if issubclass(one.category, FoldynWarning)]
    return Done(job, time.perf_counter() - began, False, failure, tuple(dict.fromkeys(messages)))
