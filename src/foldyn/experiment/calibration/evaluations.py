"""Evaluations of the model of a fit: in processes, each kept, so that a fit can be gone on with."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.workers import Workers
from foldyn.writing import remove_leftovers, whole

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
            remove_leftovers(folder)
        if processes > 1:
            self._pool = Workers(processes, _begin, problem)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: Any) -> None:
        if self._pool is not None:
            self._pool.__exit__(*raised)

    def stop(self) -> None:
        """End what the processes compute: threads that wait for it go on with an error."""
        if self._pool is not None:
            self._pool.stop()

    def at(self, points: Sequence[NDArray]) -> list[Outcome]:
        """Predictions at several points, at the same time where there are processes."""
        wanted = {self._key(point): tuple(map(float, point)) for point in points}
        new = {key: values for key, values in wanted.items() if not self._look(key)}
        if self._pool is None:
            for key, values in new.items():
                self._keep(key, _evaluate(self.problem, values))
        else:
            self._at_a_time(self._pool, new)
        return [self._known[self._key(point)] for point in points]

    def _at_a_time(self, pool: Workers, new: Mapping[str, tuple[float, ...]]) -> None:
        """Compute in processes; each evaluation is kept as soon as it is there."""
        waiting: dict[Future[Outcome], str] = {}
        try:
            waiting = {pool.submit(_evaluate_own, values): key for key, values in new.items()}
            for future in as_completed(list(waiting)):
                self._keep(waiting.pop(future), future.result())
        except BrokenProcessPool:
            raise ComputationError(
                "a process that evaluates the model ended at once; in a script, call fit "
                'below if __name__ == "__main__": (or use processes=1)'
            ) from None
        except KeyboardInterrupt:
            for future, key in waiting.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    self._keep(key, future.result())
            raise

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
            values = np.zeros(0) if failed else outcome
            with whole(self.folder / f"{key}.npz") as part:
                np.savez(part, values=values, failure=np.array(outcome if failed else ""))
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
