"""The optimization problem: minimize or maximize an expression under constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, within
from foldyn.gradients.expressions import Constraint, Expression, constraint, parse
from foldyn.values import listed


@dataclass(frozen=True)
class Problem:
    """An objective and its constraints.

    Attributes
    ----------
    objective : Expression
    sign : float
        1 to minimize, -1 to maximize.
    constraints : tuple of Constraint
    """

    objective: Expression
    sign: float
    constraints: tuple[Constraint, ...]

    @property
    def places(self) -> dict[str, str]:
        """All measures, each with the argument that first requests it."""
        goal = "minimize" if self.sign > 0.0 else "maximize"
        found = dict.fromkeys(self.objective.measures, goal)
        for k, one in enumerate(self.constraints):
            found |= {name: f"subject_to[{k}]" for name in one.measures if name not in found}
        return found

    @property
    def measures(self) -> tuple[str, ...]:
        """All measures."""
        return tuple(self.places)

    @property
    def equal(self) -> NDArray:
        """Whether each constraint is an equality."""
        return np.array([one.sense == "==" for one in self.constraints], bool)

    @property
    def signs(self) -> NDArray:
        """For each constraint -1 if its difference must be at least 0, else 1."""
        return np.array([-1.0 if one.sense == ">=" else 1.0 for one in self.constraints])

    def numbers(self, values: Mapping[str, float]) -> NDArray:
        """Objective, and left minus right sides of the constraints."""
        return np.array([one.value(values) for one in (self.objective, *self.constraints)])

    def with_slopes(
        self, values: Mapping[str, float], jacobian: Mapping[str, NDArray]
    ) -> tuple[NDArray, NDArray]:
        """The same, and derivatives by the entries of a design, from the measures' jacobian."""
        width = len(next(iter(jacobian.values())))
        found, rows = [], []
        for one in (self.objective, *self.constraints):
            value, slopes = one.value_and_slopes(values)
            found.append(value)
            rows.append(sum((s * jacobian[n] for n, s in slopes.items()), np.zeros(width)))
        return np.array(found), np.array(rows)

    def sizes(self, values: Mapping[str, float]) -> NDArray:
        """Scales of the objective and the violations, from one design."""
        return np.array(
            [
                abs(self.objective.value(values)) or 1.0,
                *(one.size(values) for one in self.constraints),
            ]
        )


def problem_of(minimize: Any, maximize: Any, subject_to: Any) -> Problem:
    """Check the objective and constraints of a design.

    Raises
    ------
    InputError
        An expression cannot be read, or there is not exactly one objective.
    """
    if (minimize is None) == (maximize is None):
        raise InputError(
            ': give one of both, the expression to make small or large, as "frequency[1]"',
            "minimize, maximize",
        )
    name, text = ("minimize", minimize) if maximize is None else ("maximize", maximize)
    with within(name):
        objective = parse(text)
        if not objective.measures:
            raise InputError(f' = "{text}": has no measure, so it is equal for all designs')
    texts = (
        [subject_to] if isinstance(subject_to, str) else listed("subject_to", subject_to, "texts")
    )
    return Problem(objective, 1.0 if name == "minimize" else -1.0, _constraints(texts))


def _constraints(texts: Sequence[Any]) -> tuple[Constraint, ...]:
    found = []
    for k, text in enumerate(texts):
        with within(f"subject_to[{k}]"):
            found.append(constraint(text))
    return tuple(found)
