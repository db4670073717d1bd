"""The optimization problem: parameters within bounds, an objective, constraints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, within
from foldyn.gradients.expressions import Constraint, Expression, constraint, parse
from foldyn.values import listed, numbers, show


@dataclass(frozen=True)
class Problem:
    """An objective, and constraints on the design.

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
        """For each constraint -1 if left minus right side must be at least 0, else 1."""
        return np.array([-1.0 if one.sense == ">=" else 1.0 for one in self.constraints])

    def numbers(self, values: Mapping[str, float]) -> NDArray:
        """Objective, and left minus right sides of the constraints."""
        return np.array([one.value(values) for one in (self.objective, *self.constraints)])

    def with_slopes(
        self, values: Mapping[str, float], jacobian: Mapping[str, NDArray]
    ) -> tuple[NDArray, NDArray]:
        """`numbers`, and derivatives with respect to a design's entries, from those of measures."""
        width = len(next(iter(jacobian.values())))
        found, rows = [], []
        for one in (self.objective, *self.constraints):
            value, slopes = one.value_and_slopes(values)
            found.append(value)
            rows.append(sum((s * jacobian[n] for n, s in slopes.items()), np.zeros(width)))
        return np.array(found), np.array(rows)

    def sizes(self, values: Mapping[str, float]) -> NDArray:
        """Scales of the objective and of the violations, from the measures of one design."""
        sizes = [one.size(values) for one in self.constraints]
        return np.array([abs(self.objective.value(values)) or 1.0, *sizes])


def problem_of(minimize: Any, maximize: Any, subject_to: Any) -> Problem:
    """Check the objective and constraints of a design.

    Raises
    ------
    InputError
        An expression cannot be read, or there is not exactly one objective.
    """
    if (minimize is None) == (maximize is None):
        raise InputError(
            ': give one of the two, an expression to make small or large, such as "frequency[1]"',
            "minimize, maximize",
        )
    name, text = ("minimize", minimize) if maximize is None else ("maximize", maximize)
    with within(name):
        objective = parse(text)
        if not objective.measures:
            raise InputError(f' = "{text}": has no measure, so it is equal for all designs')
    asked = [subject_to] if isinstance(subject_to, str) else subject_to
    constraints = []
    for k, text in enumerate(listed("subject_to", asked, "texts")):
        with within(f"subject_to[{k}]"):
            constraints.append(constraint(text))
    return Problem(objective, 1.0 if name == "minimize" else -1.0, tuple(constraints))


Values = Mapping[str, float | NDArray]
"""Values of parameters, by the names of the parameters."""


@dataclass(frozen=True, eq=False)
class Space:
    """Parameters within their bounds.

    Attributes
    ----------
    shapes : dict of str to tuple
        Shape of each parameter: () for a number, (count,) for an array.
    lower, upper : ndarray, shape (n,)
        Bounds of all entries, one parameter after the other.
    """

    shapes: dict[str, tuple[int, ...]]
    lower: NDArray
    upper: NDArray

    def point(self, x: NDArray) -> tuple[float, ...]:
        """Entries of a design from scaled values (0 to 1)."""
        inside = np.clip(x, 0.0, 1.0)
        return tuple((self.lower * (1.0 - inside) + self.upper * inside).tolist())

    def x(self, point: NDArray) -> NDArray:
        """Scaled values (0 to 1) of the entries of a design."""
        return (np.asarray(point) - self.lower) / (self.upper - self.lower)

    def parts(self, entries: NDArray) -> dict[str, NDArray]:
        """Split an array of entries (..., n) into one part for each parameter."""
        counts = [int(np.prod(shape)) for shape in self.shapes.values()]
        split = np.split(np.asarray(entries), np.cumsum(counts)[:-1], axis=-1)
        return dict(zip(self.shapes, split, strict=True))

    def values(self, point: ArrayLike) -> dict[str, float | NDArray]:
        """Values of the parameters of a design."""
        parts = self.parts(np.array(point)).items()
        return {name: part if self.shapes[name] else float(part[0]) for name, part in parts}

    @property
    def entries(self) -> list[str]:
        """Names of all entries, such as "panel_angle" and "stiffness[3]"."""
        return [
            f"{name}[{k}]" if shape else name
            for name, shape in self.shapes.items()
            for k in range(int(np.prod(shape)))
        ]


def space_of(bounds: Any, guess: Any) -> tuple[Space, NDArray]:
    """Design space, and the entries of the first design, by default in the middle of the space.

    Raises
    ------
    InputError
        Bounds are missing, or inconsistent with each other or the guess.
    """
    if not isinstance(bounds, Mapping) or not bounds:
        raise InputError(
            f' = {show(bounds)}: give each parameter its bounds, as {{"panel_angle": (45, 80)}}',
            "bounds",
        )
    if guess is not None and not isinstance(guess, Mapping):
        raise InputError(f" = {show(guess)}: give a mapping of names to values", "guess")
    for name in guess or {}:
        if name not in bounds:
            raise InputError(f": {name} has no bounds; give it some in bounds", "guess")
    shapes, columns = {}, []
    for name, pair in bounds.items():
        if not isinstance(name, str):
            raise InputError(f": {show(name)} must be the name of a parameter", "bounds")
        shape, ends = _ends(name, pair, None if guess is None else guess.get(name))
        shapes[name] = shape
        columns.append(ends)
    lower, upper, first = np.concatenate(columns, axis=1)
    return Space(shapes, lower, upper), first


def _ends(name: str, pair: Any, guess: Any) -> tuple[tuple[int, ...], NDArray]:
    """Shape of a parameter, and its lower bound, upper bound and guess (3, count)."""
    place = f"bounds.{name}"
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        raise InputError(f" = {show(pair)}: must be a lower and an upper bound", place)
    lower, upper = (numbers(f"{place}[{k}]", end) for k, end in enumerate(pair))
    first = None if guess is None else numbers(f"guess.{name}", guess)
    given = [one for one in (lower, upper, first) if one is not None]
    if any(one.ndim > 1 or not one.size for one in given):
        raise InputError(": must be numbers, or lists of one for each entry", place)
    try:
        shape = np.broadcast_shapes(*(one.shape for one in given))
    except ValueError:
        lengths = ", ".join(str(one.size) for one in given if one.ndim)
        raise InputError(
            f": lists of different lengths ({lengths}), guess among them", place
        ) from None
    lower, upper = (np.broadcast_to(end, shape).ravel() for end in (lower, upper))
    bad = np.flatnonzero(~(lower < upper))
    with within(place):
        if bad.size:
            at = f"[{bad[0]}]" if shape else ""
            raise InputError(
                f": from {lower[bad[0]]:g} to {upper[bad[0]]:g}: the lower bound must be below the "
                "upper one; leave out parameters that are fixed",
                at,
            )
    begin = 0.5 * (lower + upper) if first is None else np.broadcast_to(first, shape).ravel()
    outside = np.flatnonzero((begin < lower) | (begin > upper))
    if outside.size:
        k = outside[0]
        raise InputError(
            f" = {begin[k]:g}: must be within its bounds, {lower[k]:g} to {upper[k]:g}",
            f"guess.{name}{f'[{k}]' if shape else ''}",
        )
    return shape, np.stack([lower, upper, begin])
