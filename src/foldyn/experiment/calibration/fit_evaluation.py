"""One evaluation in a fit: predictions at values of the parameters, and derivatives."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from foldyn.errors import ComputationError, InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.sweeps.evaluations import Evaluation

PREDICTED = "predicted"
"""Name of an evaluation's predictions."""
SLOPES = "slopes"
"""Name of their derivatives with respect to the parameters."""


class Point(NamedTuple):
    """A point to evaluate.

    Attributes
    ----------
    values : tuple of float
        Values of the parameters.
    runs : tuple of int, optional
        Runs to compute, without derivatives; by default all runs, with derivatives.
    second : bool
        Whether derivatives have second-order accuracy, as intervals need.
    """

    values: tuple[float, ...]
    runs: tuple[int, ...] | None = None
    second: bool = False


def stamp(digest: str, point: Point) -> list[Any]:
    """Everything that an evaluation depends on."""
    return [digest, *point]


def evaluate(problem: Problem, point: Point) -> Evaluation:
    """Predictions at a point, with derivatives if requested."""
    began, values = time.perf_counter(), np.array(point.values)
    try:
        if point.runs is None:
            found = problem.differentiate(values, point.second)
            parts = dict(zip((PREDICTED, SLOPES), found, strict=True))
        else:
            parts = {PREDICTED: problem.predict(values, point.runs)}
        found, why = {name: np.concatenate(part) for name, part in parts.items()}, ""
    except (InputError, ComputationError) as error:
        found, why = {}, str(error)
    return Evaluation(found, why, seconds=time.perf_counter() - began)
