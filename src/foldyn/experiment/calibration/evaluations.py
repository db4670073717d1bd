"""Evaluations of the model of a fit: in processes, each kept, so that a fit can be resumed."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock

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


@dataclass(frozen=True)
class Course:
    """How far a fit is.

    Attributes
    ----------
    computed, found : int
        Evaluations of the model that were computed, and that were kept from before.
    cost : float
        The smallest so far.
    """

    computed: int
    found: int
    cost: float


class Evaluations:
    """Predictions of a model at values of its parameters, each computed once.

    Several threads may ask at a time.

    Parameters
    ----------
    problem : Problem
    pool : Workers, optional
        Evaluate; by default this process does.
    folder : path, optional
        Keeps every evaluation; those that are there are not computed again.
    progress : callable, optional
        Called with a `Course` after each.
    """

    def __init__(
        self,
        problem: Problem,
        pool: Workers | None = None,
        folder: str | os.PathLike[str] | None = None,
        progress: Callable[[Course], None] | None = None,
    ) -> None:
        self.problem, self.pool, self.progress = problem, pool, progress
        self.folder = None if folder is None else Path(folder)
        self.computed, self.found, self.cost = 0, 0, math.inf
        self._known: dict[Values, Outcome] = {}
        self._lock = Lock()
        self._digest = problem.digest()
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            remove_leftovers(self.folder)

    def at(self, points: Sequence[NDArray]) -> list[Outcome]:
        """Predictions at several points, at the same time where there is a pool."""
        wanted = [tuple(map(float, point)) for point in points]
        new = [values for values in dict.fromkeys(wanted) if not self._look(values)]
        evaluate = partial(_evaluate, self.problem)
        if self.pool is None:
            for values in new:
                self._keep(values, evaluate(values))
        else:
            self.pool.each(evaluate, new, self._keep)
        return [self._known[values] for values in wanted]

    def _look(self, values: Values) -> bool:
        """Whether a point is known, or kept in the folder."""
        if values not in self._known and self.folder is not None:
            name = name_of([self._digest, values])
            outcome = KEPT.find(self.folder / f"{name}.npz", name)
            if outcome is not None:
                self._count(values, outcome, found=1)
        return values in self._known

    def _keep(self, values: Values, outcome: Outcome) -> None:
        if self.folder is not None:
            name = name_of([self._digest, values])
            KEPT.keep(self.folder / f"{name}.npz", name, outcome)
        self._count(values, outcome, computed=1)

    def _count(self, values: Values, outcome: Outcome, computed: int = 0, found: int = 0) -> None:
        self._known[values] = outcome
        with self._lock:
            self.computed += computed
            self.found += found
            if self.progress is not None:
                self.progress(Course(self.computed, self.found, self.cost))


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


def _evaluate(problem: Problem, values: Values) -> Outcome:
    try:
        return np.concatenate(problem.predict(values))
    except (InputError, ComputationError) as error:
        return str(error)
