"""The parameters of a fit: keys of a case file with bounds and scales, and keys tied to them.

A key is a path such as "sheet.thickness", "model.fold_law.theta1" or "loads[0].force[2]". A tie,
such as theta2 = 360 - theta1, is a sum, difference, product or quotient of numbers and keys; it is
read by a small parser, never evaluated as Python.
"""

from __future__ import annotations

import ast
import copy
import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.expressions import parse, written
from foldyn.errors import InputError
from foldyn.values import brief, number, shortened, show, suggest, whole

MOST_STARTS = 100_000
"""Searches: a larger number is a typing error."""
LONGEST = 200
"""Characters of a key: no case file nests its tables that deep."""
_KEY = re.compile(r"[A-Za-z_]\w*(\[\d+\])*(\.[A-Za-z_]\w*(\[\d+\])*)*\Z")
_OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_REMEDY = 'write for example "360 - model.fold_law.theta1"'


def parts(key: Any) -> tuple[str | int, ...]:
    """Keys and indices of a path: "loads[0].force" becomes ("loads", 0, "force").

    Raises
    ------
    InputError
        The text is no path.
    """
    if not isinstance(key, str) or len(key) > LONGEST or not _KEY.match(key):
        raise InputError(
            f"{show(key)}: is no key of a case file; write the section and the key, as in "
            '"sheet.thickness" or "loads[0].force[2]"'
        )
    return tuple(int(p) if p.isdigit() else p for p in re.findall(r"\w+", key))


def value_at(document: Mapping[str, Any], key: str) -> Any:
    """Value of a key in a case file; None where the file does not have it."""
    here: Any = document
    for part in parts(key):
        if isinstance(part, int):
            here = here[part] if isinstance(here, list) and part < len(here) else None
        else:
            here = here.get(part) if isinstance(here, Mapping) else None
    return here


def number_keys(document: Mapping[str, Any]) -> list[str]:
    """Keys of all numbers in a case file, except for those in lists."""
    keys: list[str] = []
    for key, value in document.items():
        if isinstance(value, Mapping):
            keys += [f"{key}.{inner}" for inner in number_keys(value)]
        elif isinstance(value, int | float) and not isinstance(value, bool):
            keys.append(key)
    return keys


def replaced(document: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy of a case file with the values of some keys replaced or added.

    Missing tables are made, and a law given by its name becomes a table of that kind; whether a
    case file may have such a key is for its reader to decide.

    Raises
    ------
    InputError
        A path leads through something that is no table or list, or beyond the end of a list.
    """
    result = copy.deepcopy(dict(document))
    for key, value in changes.items():
        here: Any = result
        for part, following in pairwise(parts(key)):
            holder = _step(here, part, key)
            if isinstance(holder[part], str) and isinstance(following, str):
                holder[part] = {"kind": holder[part]}
            here = holder[part]
        last = parts(key)[-1]
        _step(here, last, key)[last] = value
    return result


def _step(here: Any, part: str | int, key: str) -> Any:
    """The table or list that holds the next part of a path."""
    if isinstance(part, int):
        if not isinstance(here, list):
            raise InputError(f"{key}: [{part}] needs a list, but there is {show(here)}")
        if part >= len(here):
            raise InputError(f"{key}: there are only {len(here)} entries, [0] to [{len(here) - 1}]")
        return here
    if not isinstance(here, dict):
        raise InputError(f"{key}: .{part} needs a table, but there is {show(here)}")
    here.setdefault(part, {})
    return here


@dataclass(frozen=True)
class Tie:
    """A key of a case file that follows parameters.

    Parameters
    ----------
    key : str
        Key that is set.
    expression : str
        Its value, of numbers, ``+ - * /``, parentheses and keys of parameters.
    """

    key: str
    expression: str

    def __post_init__(self) -> None:
        """Check the arguments."""
        parts(self.key)
        if not isinstance(self.expression, str):
            raise InputError(f"tie {self.key} = {show(self.expression)}: must be a text; {_REMEDY}")
        self.value(None)

    def value(self, parameters: Mapping[str, float] | None) -> float:
        """Value for given values of the parameters; None where these are not known yet."""
        try:
            tree = parse(self.expression.strip())
        except InputError as error:
            raise self._error(str(error)) from None
        return self._value(tree, parameters)

    def _value(self, node: ast.expr, parameters: Mapping[str, float] | None) -> float:
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
            left, right = self._value(node.left, parameters), self._value(node.right, parameters)
            try:
                return _OPERATIONS[type(node.op)](left, right)
            except ZeroDivisionError:
                raise self._error("divides by zero") from None
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -self._value(node.operand, parameters)
        number = node.value if isinstance(node, ast.Constant) else None
        if isinstance(number, int | float) and not isinstance(number, bool):
            try:
                return float(number)
            except OverflowError:
                raise self._error(f"{written(node)} is not a finite number") from None
        if isinstance(node, ast.Name | ast.Attribute | ast.Subscript):
            key = ast.unparse(node)
            if parameters is None:
                return 0.7320508  # no tie is likely to divide by a difference from this number
            if key not in parameters:
                known = ", ".join(parameters)
                hint = suggest(key, parameters)
                raise self._error(f"{written(node)} is no parameter; {hint}use {known}")
            return parameters[key]
        raise self._error(f"{written(node)} is no number or key")

    def _error(self, what: str) -> InputError:
        return InputError(f'tie {self.key} = "{shortened(self.expression)}": {what}; {_REMEDY}')


@dataclass(frozen=True)
class Parameter:
    """A number in a case file that a fit is to find.

    Parameters
    ----------
    key : str
        Where it stands in the case file: "sheet.length_scale_ratio", "damping.alpha",
        "model.fold_law.theta1" (degrees, as there), "loads[0].force[2]".
    start : float, optional
        Value to start from; that of the case file by default.
    lower, upper : float
        Bounds; none by default. Several starts need both.
    scale : float, optional
        A change of the value that matters; by default the size of the start or, where that is 0,
        the distance of the bounds.
    """

    key: str
    start: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    scale: float | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        parts(self.key)
        missing = {"start": None, "scale": None, "lower": -math.inf, "upper": math.inf}
        for name, default in missing.items():
            value, above = getattr(self, name), 0.0 if name == "scale" else None
            if value != default:
                object.__setattr__(self, name, number(f"{self.key}: {name}", value, above=above))
        if not self.lower < self.upper:
            raise InputError(
                f"{self.key}: lower = {self.lower:g} is not below upper = {self.upper:g}; exchange "
                "them, or leave one out"
            )
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise InputError(
                f"{self.key}: start = {self.start:g} is outside the bounds {self.lower:g} to "
                f"{self.upper:g}"
            )


@brief
@dataclass(frozen=True)
class Space:
    """All parameters of a fit and the keys tied to them.

    Attributes
    ----------
    parameters : tuple of Parameter
        With start and scale filled in.
    ties : tuple of Tie
    """

    parameters: tuple[Parameter, ...]
    ties: tuple[Tie, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the parameters."""
        return tuple(p.key for p in self.parameters)

    def column(self, name: str) -> NDArray[np.float64]:
        """One of "start", "lower", "upper", "scale" of all parameters."""
        return np.array([getattr(p, name) for p in self.parameters], dtype=np.float64)

    def changes(self, values: Sequence[float] | NDArray) -> dict[str, float]:
        """Values of all keys, parameters and ties, at given values of the parameters."""
        own = {key: float(value) for key, value in zip(self.keys, values, strict=True)}
        return own | {tie.key: tie.value(own) for tie in self.ties}

    def starts(self, count: int, seed: int) -> NDArray[np.float64]:
        """Values to start from, shape (count, p): the given ones, then random ones.

        The random ones are a Latin hypercube within the bounds: each parameter's range is cut
        into as many pieces as there are starts, and each piece is used once.
        """
        whole("starts", count, least=1, most=MOST_STARTS)
        whole("seed", seed, least=0)
        if count == 1:
            return self.column("start")[None]
        low, high = self.column("lower"), self.column("upper")
        free = [p.key for p in self.parameters if not math.isfinite(p.upper - p.lower)]
        if free:
            raise InputError(
                f"starts = {count}: random starts are drawn between bounds; give {free[0]} both "
                "lower and upper"
            )
        drawn = np.random.default_rng(seed)
        pieces = [drawn.permutation(count - 1) for _ in self.parameters]
        places = (np.array(pieces).T + drawn.random((count - 1, len(pieces)))) / (count - 1)
        return np.vstack([self.column("start"), low + places * (high - low)])


def space(
    document: Mapping[str, Any], parameters: Sequence[Parameter], ties: Mapping[str, str]
) -> Space:
    """Parameters with the starts and scales that the case file gives them, and their ties.

    Raises
    ------
    InputError
        No parameter, or one given twice, without a start or no number; a tie to something that is
        no parameter.
    """
    if not parameters:
        raise InputError("parameters: none; name at least one key of the case file")
    for i, parameter in enumerate(parameters):
        if not isinstance(parameter, Parameter):
            raise InputError(f"parameters[{i}]: got {show(parameter)}, give a Parameter")
    tied = tuple(Tie(key, text) for key, text in ties.items())
    keys = [one.key for one in (*parameters, *tied)]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{key}: is given twice, as a parameter or as a tie")
    filled = Space(tuple(_filled(p, document) for p in parameters), tied)
    filled.changes(filled.column("start"))
    return filled


def _filled(parameter: Parameter, document: Mapping[str, Any]) -> Parameter:
    start = parameter.start
    if start is None:
        given = value_at(document, parameter.key)
        if given is None:
            hint = suggest(parameter.key, number_keys(document))
            raise InputError(
                f"{parameter.key}: the case file has no value for it; {hint}give start if the key "
                "is right"
            )
        if isinstance(given, bool) or not isinstance(given, int | float):
            raise InputError(f"{parameter.key} = {show(given)}: is no number that could be fitted")
        start = float(given)
    scale = parameter.scale
    if scale is None:
        width = parameter.upper - parameter.lower
        scale = abs(start) or (width if math.isfinite(width) else 0.0)
    if scale == 0.0:
        raise InputError(f"{parameter.key}: starts from 0; give scale, a change of it that matters")
    return replace(parameter, start=start, scale=scale)
