"""Measures of designs that are formulas, as if a case had been computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.designs.methods import METHODS, Settings
from foldyn.designs.problem import problem_of, space_of
from foldyn.designs.result import Design
from foldyn.designs.run_design import Plan, designed
from foldyn.errors import ComputationError


@dataclass
class Formulas:
    """The entries of a design, a, b, ..., as measures."""

    fails: Callable[[NDArray], bool] = lambda x: False
    asked: list[tuple[tuple[float, ...], bool]] = field(default_factory=list)
    stamp: Any = "formulas"

    def __call__(self, values: Mapping[str, Any], gradient: bool) -> Any:
        x = np.concatenate([np.atleast_1d(value) for value in values.values()])
        self.asked.append((tuple(x.tolist()), gradient))
        if self.fails(x):
            raise ComputationError("no equilibrium")
        return x, np.eye(len(x)) if gradient else None


def plan(
    bounds: Mapping[str, Any], minimize: str | None = None, subject_to: Any = (), *,
    maximize: str | None = None, guess: Any = None, method: str = "slsqp", searches: int = 1,
    evaluator: Any = None, tolerance: float = 1e-9, most: int = 1500,
) -> Plan:  # fmt: skip
    METHODS[method].check()
    problem = problem_of(minimize, maximize, subject_to)
    space, first = space_of(bounds, guess)
    assert problem.measures == tuple(space.entries)
    settings = Settings(tolerance, 1e-4, most, 0)
    return Plan(problem, space, first, evaluator or Formulas(), method, settings, searches)


def best(*arguments: Any, folder: Any = None, **options: Any) -> Design:
    return designed(plan(*arguments, **options), folder)
