"""One point of a sweep: the case file with changed values, the result, and its measures."""

from __future__ import annotations

import hashlib
import inspect
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.analyses import CaseFile
from foldyn.analyses.keys import Tie, files_of, replaced
from foldyn.analyses.motion import MotionComputation
from foldyn.analyses.reading import case_of_document
from foldyn.analyses.sections import Choice
from foldyn.errors import ComputationError, InputError, Told
from foldyn.store import program
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.measure import Asked, Loaded
from foldyn.sweeps.points import Point

if TYPE_CHECKING:
    import xarray

COMPUTING = ("analyses", "results", "sweeps")
"""Folders that measures depend on, in addition to the solvers."""
ASIDE = ("design", "sweep", "title")
"""Tables and keys of a case file that do not affect results."""


@dataclass(frozen=True, eq=False)
class Job:
    """Computes a point of a sweep; it can be sent to another process.

    Attributes
    ----------
    path : Path
        The case file.
    document : dict
        Content of the case file.
    keys : tuple of str
        Keys that are varied.
    ties : tuple of Tie
    measures : tuple of Asked
    program : str
        Digest of the program that started the sweep.
    choice : Choice, optional
        The model, one for all points, if the case file leaves it open.
    """

    path: Path
    document: dict[str, Any]
    keys: tuple[str, ...]
    ties: tuple[Tie, ...]
    measures: tuple[Asked, ...]
    program: str
    choice: Choice | None = None

    def changes(self, point: Point) -> dict[str, Any]:
        """Values of all keys at a point, including ties."""
        own: dict[str, Any] = dict(zip(self.keys, point, strict=True))
        numbers = {
            key: float(value)
            for key, value in own.items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }
        return own | {tie.key: tie.value(numbers) for tie in self.ties}

    def changed(self, point: Point) -> dict[str, Any]:
        """Content of the case file at a point."""
        whole = replaced(self.document, self.changes(point))
        return {key: value for key, value in whole.items() if key not in ASIDE}

    def case_file(self, point: Point) -> CaseFile:
        """Case file at a point."""
        return case_of_document(self.path, self.changed(point), choice=self.choice)

    def stamp(self, point: Point) -> list[Any]:
        """Everything that a point's evaluation depends on."""
        document = self.changed(point)
        if "device" in document.get("analysis", {}):  # the device changes only rounding
            del document["analysis"]["device"]
        there = [self.path.parent / file for file in sorted(files_of(document))]
        files = {str(file): _digest(str(file)) for file in there}
        measures = [[one.name, one.text, code_of(one.measure.function)] for one in self.measures]
        return [self.program, document, files, measures, self.choice and self.choice.kind]

    def __call__(self, point: Point) -> Evaluation:
        """Evaluate a point; errors become part of the evaluation."""
        return self.begun(point).finished()

    def begun(self, point: Point) -> BegunPoint:
        """A point whose computation has been checked but not started."""
        return BegunPoint(self, point)


class BegunPoint:
    """A point of a sweep on the way from its case file to its evaluation.

    Attributes
    ----------
    compute : callable or None
        The computation; None if it could not be set up.
    """

    def __init__(self, job: Job, point: Point) -> None:
        self._job, self.compute = job, None
        self._seconds, self._lasting = 0.0, True
        self._failures, self._told = list[str](), Told()
        with self._timed(), self._noted():
            if job.program != this_program():
                raise RuntimeError("this worker has another version of Foldyn than the sweep")
            self._case_file = job.case_file(point)
            self._computation = self._case_file.computation()
            self.compute = self._computation.compute

    def finished(self) -> Evaluation:
        """Finish the evaluation of the point."""
        values = {}
        with self._timed(), self._noted():
            if self.compute is not None:
                if isinstance(self.compute, MotionComputation) and self.compute.integrated:
                    self._seconds += self.compute.motion.seconds
                result, case, shared = self._result(), self._case_file.case(), {}
                for variable in result.variables.values():  # no measure may change the result
                    variable.values.setflags(write=False)
                for each in self._job.measures:
                    with self._noted():
                        values[each.name] = each.of(result.copy(deep=False), case, shared)
        failure = "; ".join(dict.fromkeys(self._failures))
        return Evaluation(values, failure, self._told.kept(), self._seconds, self._lasting)

    def _result(self) -> xarray.Dataset:
        """The result; for a path that stops, the part computed so far, with a note."""
        try:
            return self._computation.result()
        except ComputationError as error:
            if error.partial is None or error.partial.attrs["foldyn_result"] != "path":
                raise
            self._failures.append(f"{self._said(error)} (what there is of the path is measured)")
            return error.partial

    def _said(self, error: Exception) -> str:
        return str(error).removeprefix(f"{self._job.path}: ")

    @contextmanager
    def _timed(self) -> Iterator[None]:
        """Time the block and record its warnings."""
        began = time.perf_counter()
        with self._told.noting():
            yield
        self._seconds += time.perf_counter() - began

    @contextmanager
    def _noted(self) -> Iterator[None]:
        """Record errors of the block; values of other measures are kept."""
        try:
            yield
        except (InputError, ComputationError) as error:
            self._failures.append(self._said(error))
        except Exception as error:  # an error at one point must not stop the others
            self._failures.append(f"{type(error).__name__}: {error}")
            self._lasting = False


def this_program() -> str:
    """Digest of Foldyn's source, which shows whether another process runs the same version."""
    return program(*COMPUTING)


@cache
def _digest(file: str) -> str:
    """Digest of a file named in a case file; "" if the file does not exist."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


def code_of(function: Callable[..., Any]) -> str:
    """Digest of the source of a user's function; "" for registered measures."""
    found = function.load() if isinstance(function, Loaded) else function
    inner = getattr(found, "func", found)  # registered measures may be partial functions
    if getattr(inner, "__module__", "").startswith("foldyn."):
        return ""
    try:
        file = inspect.getsourcefile(found)
        text = Path(file).read_text("utf-8") if file else inspect.getsource(found)
    except (OSError, TypeError):  # a function typed into an interactive session
        code = getattr(found, "__code__", None)
        text = repr(found) if code is None else f"{code.co_code!r}{code.co_consts!r}"
    return hashlib.sha256(text.encode()).hexdigest()
