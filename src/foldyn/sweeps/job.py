"""What a sweep computes at points: the case file with other values, its result, its measures."""

from __future__ import annotations

import hashlib
import inspect
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from foldyn.analyses import CaseFile
from foldyn.analyses.casefile import Computation
from foldyn.analyses.keys import files_of, replaced
from foldyn.analyses.reading import case_of_document
from foldyn.analyses.ties import Tie
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.program import program
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.measure import Asked, Loaded
from foldyn.sweeps.points import Point

COMPUTING = ("analyses", "results", "sweeps")
"""Folders that measures depend on, besides the solvers."""
ASIDE = ("sweep", "title")
"""Tables and keys of a case file that change no result."""


@dataclass(frozen=True, eq=False)
class Job:
    """Computes points of a sweep; it can be sent to another process.

    Attributes
    ----------
    path : Path
        The case file.
    document : dict
        Its content.
    keys : tuple of str
        What is varied.
    ties : tuple of Tie
    measures : tuple of Asked
    program : str
        Digest of the program that asks.
    """

    path: Path
    document: dict[str, Any]
    keys: tuple[str, ...]
    ties: tuple[Tie, ...]
    measures: tuple[Asked, ...]
    program: str

    def changes(self, point: Point) -> dict[str, Any]:
        """Values of all keys at a point, ties among them."""
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
        return case_of_document(self.path, self.changed(point))

    def stamp(self, point: Point) -> list[Any]:
        """All that the evaluation of a point depends on."""
        document = self.changed(point)
        there = [self.path.parent / file for file in sorted(files_of(document))]
        files = {str(file): _digest(str(file)) for file in there}
        measures = [[one.name, one.text, code_of(one.measure.function)] for one in self.measures]
        return [self.program, document, files, measures]

    def __call__(self, points: Sequence[Point]) -> list[Evaluation]:
        """Evaluate points, side by side where that can be: what goes wrong is what is found."""
        trials = [_Trial(self.path) for _ in points]
        ready = list[tuple[_Trial, Computation]]()
        for trial, point in zip(trials, points, strict=True):
            with trial.watched():
                if self.program != this_program():
                    raise RuntimeError("this worker has another version of Foldyn than who asks it")
                ready.append((trial, self.case_file(point).computation()))
        if ready:
            analysis = ready[0][1].case_file.analysis
            groups = analysis.side_by_side([one.compute for _, one in ready])
            left = dict(enumerate(ready))
            ready.clear()  # results live no longer than their group
            for group in groups:
                self._measure([left.pop(k) for k in group])
        return [trial.evaluation() for trial in trials]

    def _measure(self, group: Sequence[tuple[_Trial, Computation]]) -> None:
        """Compute a group, side by side if it is one, and take the measures."""
        if len(group) > 1:
            began = time.perf_counter()
            with suppress(Exception):  # then each is alone, and computes or says why not
                group[0][1].case_file.analysis.together([one.compute for _, one in group])
                for trial, _ in group:
                    trial.side_by_side = len(group)
            for trial, _ in group:
                trial.seconds += (time.perf_counter() - began) / len(group)
        for trial, one in group:
            with trial.watched():
                result, case, shared = one.result(), one.case_file.case(), {}
                for each in self.measures:
                    with trial.noted():
                        trial.values[each.name] = each.of(result, case, shared)


class _Trial:
    """A point on its way to its evaluation."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[str, Any] = {}
        self.lasting, self.seconds, self.side_by_side = True, 0.0, 1
        self.failures: list[str] = []
        self.told: list[str] = []

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Note what goes wrong in the block, what is warned of, and how long it takes."""
        began = time.perf_counter()
        with warnings.catch_warnings(record=True) as told, self.noted():
            warnings.simplefilter("always")
            yield
        self.told += [str(one.message) for one in told if issubclass(one.category, FoldynWarning)]
        self.seconds += time.perf_counter() - began

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Note what goes wrong in the block; what else is found is kept."""
        try:
            yield
        except (InputError, ComputationError) as error:
            self.failures.append(str(error).removeprefix(f"{self.path}: "))
        except Exception as error:  # of one point; the others are computed all the same
            self.failures.append(f"{type(error).__name__}: {error}")
            self.lasting = False

    def evaluation(self) -> Evaluation:
        """What was found."""
        failure, said = ("; ".join(dict.fromkeys(texts)) for texts in (self.failures, self.told))
        return Evaluation(self.values, failure, said, self.seconds, self.lasting, self.side_by_side)


def this_program() -> str:
    """Digest of the program."""
    return program(*COMPUTING)


@cache
def _digest(file: str) -> str:
    """Digest of a file that a case file names; "" where there is none."""
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return ""


def code_of(function: Callable[..., Any]) -> str:
    """Digest of the sources of a user's function; "" for one of the registry."""
    found = function.load() if isinstance(function, Loaded) else function
    if getattr(found, "__module__", "").startswith("foldyn."):
        return ""
    try:
        file = inspect.getsourcefile(found)
        text = Path(file).read_text("utf-8") if file else inspect.getsource(found)
    except (OSError, TypeError):  # typed into a session
        code = getattr(found, "__code__", None)
        text = repr(found) if code is None else f"{code.co_code!r}{code.co_consts!r}"
    return hashlib.sha256(text.encode()).hexdigest()
