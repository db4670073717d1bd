"""Evaluations of the model of a fit: in processes, each kept, so that a fit can be gone on with."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.fit_problem import Problem

Outcome = NDArray[np.float64] | str
"""All predictions in a row, or why there are none."""


class Evaluations:
    """Predictions of a model at values of its parameters, each computed once.

    A context manager: its processes end with it. Several threads may ask at a time.

    Parameters
    ----------
    problem : Problem
    processes : int
        How many evaluations run at a time; 1: in this process.
    folder : Path, optional
        Keeps every evaluation, and is looked in first.
    tell : callable
        Called with the number of evaluations computed and of those found, after each.
    """

    def __init__(
        self,
        problem: Problem,
        processes: int = 1,
        folder: Path | None = None,
        tell: Callable[[int, int], None] = lambda computed, found: None,
    ) -> None:
        self.problem, self.folder, self.tell = problem, folder, tell
        self.computed = self.found = 0
        self._known: dict[str, Outcome] = {}
        self._lock = Lock()
        self._digest = problem.digest()
        self._pool = None
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
        if processes > 1:
            self._pool = ProcessPoolExecutor(
                processes, get_context("spawn"), initializer=_begin, initargs=(problem,)
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def at(self, points: Sequence[NDArray]) -> list[Outcome]:
        """Predictions at several points, at the same time where there are processes."""
        waiting: dict[str, Any] = {}
        for point in points:
            key = self._key(point)
            if key in waiting or self._look(key):
                continue
            values = tuple(map(float, point))
            waiting[key] = (
                _evaluate(self.problem, values)
                if self._pool is None
                else self._pool.submit(_evaluate_own, values)
            )
            if self._pool is None:
                self._keep(key, waiting[key])
        if self._pool is not None:
            for key, future in waiting.items():
                try:
                    self._keep(key, future.result())
                except BrokenProcessPool:
                    raise ComputationError(
                        "a process that evaluates the model ended at once; in a script, call fit "
                        'below if __name__ == "__main__": (or use processes=1)'
                    ) from None
        return [self._known[self._key(point)] for point in points]

    def _key(self, point: NDArray) -> str:
        values = np.asarray(point, dtype=np.float64).tobytes()
        return hashlib.sha256(self._digest.encode() + values).hexdigest()[:32]

    def _look(self, key: str) -> bool:
        """Whether a point is known, or kept in the folder."""
        if key in self._known:
            return True
        file = None if self.folder is None else self.folder / f"{key}.npz"
        if file is None or not file.is_file():
            return False
        try:
            with np.load(file) as kept:
                failure = str(kept["failure"])
                values = kept["values"]
            if values.dtype != np.float64 or values.ndim != 1:
                return False
        except Exception:  # what NumPy and zipfile raise on damaged files is of any kind
            return False  # computed again
        self._known[key] = failure or values
        with self._lock:
            self.found += 1
            self.tell(self.computed, self.found)
        return True

    def _keep(self, key: str, outcome: Outcome) -> None:
        self._known[key] = outcome
        if self.folder is not None:
            failed = isinstance(outcome, str)
            partial = self.folder / f".{key}.{os.getpid()}.npz"
            values = np.zeros(0) if failed else outcome
            np.savez(partial, values=values, failure=np.array(outcome if failed else ""))
            os.replace(partial, self.folder / f"{key}.npz")
        with self._lock:
            self.computed += 1
            self.tell(self.computed, self.found)


_own: list[Problem] = []  # the one problem of a process that evaluates


def _begin(problem: Problem) -> None:
    _own[:] = [problem]


def _evaluate_own(values: tuple[float, ...]) -> Outcome:
    return _evaluate(_own[0], values)


def _evaluate(problem: Problem, values: tuple[float, ...]) -> Outcome:
    try:
        return np.concatenate(problem.predict(values))
    except (InputError, ComputationError) as error:
        return str(error)
