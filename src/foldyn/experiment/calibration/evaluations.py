"""Evaluations of the model of a fit: in processes, each kept, so that a fit can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.store import Store, name_of
from foldyn.workers import Workers
from foldyn.writing import remove_leftovers, whole

Outcome = NDArray[np.float64] | str
"""All predictions in a row, or why there are none."""
Values = tuple[float, ...]
"""Of the parameters."""


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
        self._known: dict[Values, Outcome] = {}
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
        wanted = [tuple(map(float, point)) for point in points]
        new = [values for values in dict.fromkeys(wanted) if not self._look(values)]
        if self._pool is None:
            for values in new:
                self._keep(values, _evaluate(self.problem, values))
        else:
            self._at_a_time(self._pool, new)
        return [self._known[values] for values in wanted]

    def _at_a_time(self, pool: Workers, new: Sequence[Values]) -> None:
        """Compute in processes; each evaluation is kept as soon as it is there."""
        waiting: dict[Future[Outcome], Values] = {}
        try:
            waiting = {pool.submit(_evaluate_own, values): values for values in new}
            for future in as_completed(list(waiting)):
                self._keep(waiting.pop(future), future.result())
        except BrokenProcessPool:
            raise ComputationError(
                "a process that evaluates the model ended at once; in a script, call fit "
                'below if __name__ == "__main__": (or use processes=1)'
            ) from None
        except KeyboardInterrupt:
            for future, values in waiting.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    self._keep(values, future.result())
            raise

    def _file(self, values: Values) -> Path:
        assert self.folder is not None
        return self.folder / f"{name_of([self._digest, values])}.npz"

    def _look(self, values: Values) -> bool:
        """Whether a point is known, or kept in the folder."""
        if values in self._known or self.folder is None:
            return values in self._known
        file = self._file(values)
        outcome = KEPT.find(file, file.stem)
        if outcome is None:
            return False
        self._known[values] = outcome
        with self._lock:
            self.found += 1
            self.tell(self.computed, self.found)
        return True

    def _keep(self, values: Values, outcome: Outcome) -> None:
        self._known[values] = outcome
        if self.folder is not None:
            file = self._file(values)
            KEPT.keep(file, file.stem, outcome)
        with self._lock:
            self.computed += 1
            self.tell(self.computed, self.found)


def _read(file: Path) -> tuple[str, Outcome]:
    with np.load(file) as kept:
        predicted = kept["predicted"]
        if predicted.dtype != np.float64 or predicted.ndim != 1:
            raise ValueError
        return str(kept["stamp"]), str(kept["failure"]) or predicted


def _write(file: Path, stamp: str, outcome: Outcome) -> None:
    failed = isinstance(outcome, str)
    predicted, failure = (np.zeros(0), outcome) if failed else (outcome, "")
    with whole(file) as part:
        np.savez(part, predicted=predicted, failure=np.array(failure), stamp=np.array(stamp))


KEPT: Store[Outcome] = Store(_read, _write, warns=False)


_own: list[Problem] = []  # the one problem of a process that evaluates


def _begin(problem: Problem) -> None:
    _own[:] = [problem]


def _evaluate_own(values: Values) -> Outcome:
    return _evaluate(_own[0], values)


def _evaluate(problem: Problem, values: Values) -> Outcome:
    try:
        return np.concatenate(problem.predict(values))
    except (InputError, ComputationError) as error:
        return str(error)
