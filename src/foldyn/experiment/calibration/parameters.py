"""The parameters of a fit: keys of a case file with bounds and scales, and keys tied to them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses.keys import Tie, number_keys, parts, value_at
from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.values import number, of_kind, show, suggest, whole

NEAR = 1e-4  # change of a scaled parameter between neighboring solutions, for differences
FIRST = ((0, -1.0), (1, 1.0)), ((0, 1.0), (-1, -1.0))
# Steps and weights of difference quotients by order; later rows apply if a bound is near.
SECOND = (
    ((1, 0.5), (-1, -0.5)),
    ((0, -1.5), (1, 2.0), (2, -0.5)),
    ((0, 1.5), (-1, -2.0), (-2, 0.5)),
)
MOST_SEARCHES = 100_000  # a larger number must be a typing error


@dataclass(frozen=True)
class Parameter:
    """A number in a case file to be fitted.

    Parameters
    ----------
    key : str
        Key in the case file, such as "sheet.length_scale_ratio", "damping.alpha",
        "model.fold_law.theta1" (in degrees, as in the file) or "loads[0].force[2]".
    guess : float, optional
        Value from which the search begins; by default the value in the case file.
    lower, upper : float
        Bounds; none by default. Several searches need both.
    scale : float, optional
        A significant change of the value; by default the magnitude of the guess or, if that is 0,
        the distance between the bounds.
    """

    key: str
    guess: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    scale: float | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        parts(self.key)
        missing = {"guess": None, "scale": None, "lower": -math.inf, "upper": math.inf}
        for name, default in missing.items():
            value, above = getattr(self, name), 0.0 if name == "scale" else None
            if value != default:
                object.__setattr__(self, name, number(f"{self.key}: {name}", value, above=above))
        if not self.lower < self.upper:
            raise InputError(
                f"{self.key}: lower = {self.lower:g} is not below upper = {self.upper:g}; exchange "
                "them, or leave one out"
            )
        if self.guess is not None and not self.lower <= self.guess <= self.upper:
            raise InputError(
                f"{self.key}: guess = {self.guess:g} is outside the bounds {self.lower:g} to "
                f"{self.upper:g}"
            )


class Beside(NamedTuple):
    """Parameter values with one parameter changed, for differences.

    point : values of all parameters.
    place : index of the changed parameter.
    weight : weight of the prediction at this point in the derivative.
    """

    point: NDArray[np.float64]
    place: int
    weight: float


@brief
@dataclass(frozen=True)
class Space:
    """All parameters of a fit and the keys tied to them.

    Attributes
    ----------
    parameters : tuple of Parameter
        Parameters with guess and scale filled in.
    ties : tuple of Tie
    """

    parameters: tuple[Parameter, ...]
    ties: tuple[Tie, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the parameters."""
        return tuple(p.key for p in self.parameters)

    def column(self, name: str) -> NDArray[np.float64]:
        """Values of one field ("guess", "lower", "upper" or "scale") of all parameters."""
        return np.array([getattr(p, name) for p in self.parameters], dtype=np.float64)

    def changes(self, values: Sequence[float] | NDArray) -> dict[str, float]:
        """Values of all keys (parameters and ties) at given values of the parameters."""
        own = {key: float(value) for key, value in zip(self.keys, values, strict=True)}
        return own | {tie.key: tie.value(own) for tie in self.ties}

    def differences(self, values: NDArray, second: bool, near: float = NEAR) -> list[Beside]:
        """Points within the bounds for difference quotients, `near` in scaled parameters.

        Weighted sums of predictions are derivatives, accurate to first or second order.

        Raises
        ------
        InputError
            The bounds leave no room for neighboring points.
        """
        found = []
        for k, one in enumerate(self.parameters):
            step = near * (one.scale or 0.0)
            for sides in SECOND if second else FIRST:
                ends = [values[k] + side * step for side, _ in sides]
                if one.lower <= min(ends) and max(ends) <= one.upper:
                    break
            else:
                raise InputError(
                    f"{one.key}: the bounds are less than {2 * near:g} of its scale apart"
                )
            for end, (_, weight) in zip(ends, sides, strict=True):
                point = np.array(values, float)
                point[k] = end
                found.append(Beside(point, k, weight / step))
        return found

    def guesses(self, count: int, seed: int) -> NDArray[np.float64]:
        """Values from which searches begin, shape (count, p): the given values, then random ones.

        The random values are a Latin hypercube within the bounds: each parameter's range is cut
        into as many pieces as there are random guesses, and each piece is used once.
        """
        whole("searches", count, least=1, most=MOST_SEARCHES)
        whole("seed", seed, least=0)
        if count == 1:
            return self.column("guess")[None]
        low, high = self.column("lower"), self.column("upper")
        free = [p.key for p in self.parameters if not math.isfinite(p.upper - p.lower)]
        if free:
            raise InputError(
                f"searches = {count}: random guesses are drawn between bounds; give {free[0]} both "
                "lower and upper"
            )
        drawn = np.random.default_rng(seed)
        pieces = [drawn.permutation(count - 1) for _ in self.parameters]
        places = (np.array(pieces).T + drawn.random((count - 1, len(pieces)))) / (count - 1)
        return np.vstack([self.column("guess"), low + places * (high - low)])


def space(
    document: Mapping[str, Any], parameters: Sequence[Parameter], ties: Mapping[str, str]
) -> Space:
    """Parameters with guesses and scales filled in from the case file, and their ties.

    Raises
    ------
    InputError
        There is no parameter, a parameter is given twice, has no guess or is not a number, or a tie
        depends on something that is not a parameter.
    """
    if not parameters:
        raise InputError("parameters: none; name at least one key of the case file")
    for i, parameter in enumerate(parameters):
        of_kind(f"parameters[{i}]", parameter, Parameter)
    tied = tuple(Tie(key, text) for key, text in ties.items())
    keys = [one.key for one in (*parameters, *tied)]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{key}: is given twice, as a parameter or as a tie")
    filled = Space(tuple(_filled(p, document) for p in parameters), tied)
    filled.changes(filled.column("guess"))
    return filled


def _filled(parameter: Parameter, document: Mapping[str, Any]) -> Parameter:
    guess = parameter.guess
    if guess is None:
        given = value_at(document, parameter.key)
        if given is None:
            hint = suggest(parameter.key, number_keys(document))
            raise InputError(
                f"{parameter.key}: the case file has no value for it; {hint}give guess if the key "
                "is right"
            )
        if isinstance(given, bool) or not isinstance(given, int | float):
            raise InputError(f"{parameter.key} = {show(given)}: is not a number to be fitted")
        guess = float(given)
    scale = parameter.scale
    if scale is None:
        width = parameter.upper - parameter.lower
        scale = abs(guess) or (width if math.isfinite(width) else 0.0)
    if scale == 0.0:
        raise InputError(f"{parameter.key}: begins from 0; give scale, a change of it that matters")
    return replace(parameter, guess=guess, scale=scale)
