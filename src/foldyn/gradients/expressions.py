"""Expressions of measures, such as "-frequency[2] / frequency[1]", and their derivatives.

Expressions are read by Python's parser and evaluated here, never executed as code. Derivatives are
propagated forward with the values.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import expressions as trees
from foldyn.values import show, suggest

EXAMPLE = 'write for example "-frequency[2] / frequency[1]"'
SENSES = {ast.Eq: "==", ast.LtE: "<=", ast.GtE: ">="}
TIE = 1e-9
"""Relative difference below which two numbers are equal up to round-off."""
SMOOTH = (
    "has no derivative there; write it smoothly, such as (a**8 + b**8)**(1/8), or bound both: make "
    "one of them the objective and constrain the other"
)


class _Number(NamedTuple):
    """A number, and its derivatives with respect to all measures."""

    value: float
    slope: NDArray


@dataclass(frozen=True)
class Expression:
    """An expression of measures.

    Attributes
    ----------
    text : str
    measures : tuple of str
        Measures in the expression, in the form "peak_frequency[8,x]".
    """

    text: str
    measures: tuple[str, ...]
    tree: ast.expr = field(repr=False, compare=False)

    def value(self, values: Mapping[str, float]) -> float:
        """Value of the expression, from values of the measures.

        Raises
        ------
        InputError
            The expression has no value at these values.
        """
        return self._at(values, np.zeros((len(self.measures), 0))).value

    def value_and_slopes(self, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Value of the expression, and its derivatives with respect to all measures.

        Raises
        ------
        InputError
            The expression has no value or no derivative at these values.
        """
        found = self._at(values, np.eye(len(self.measures)))
        return found.value, dict(zip(self.measures, found.slope.tolist(), strict=True))

    def _at(self, values: Mapping[str, float], slopes: NDArray) -> _Number:
        pairs = zip(self.measures, slopes, strict=True)
        known = {name: _Number(float(values[name]), slope) for name, slope in pairs}
        with np.errstate(all="ignore"):
            found = _worked(self.tree, known, slopes.shape[1])
        if not math.isfinite(found.value) or not np.isfinite(found.slope).all():
            what = "value" if not math.isfinite(found.value) else "derivative"
            at = ", ".join(f"{name} = {values[name]:.6g}" for name in self.measures)
            raise InputError(f"{show(self.text)}: has no finite {what} at {at}")
        return found


def parse(text: str) -> Expression:
    """Expression from its text.

    The text may contain numbers, measures, ``+ - * / **``, parentheses, and the functions min, max,
    abs, sqrt, log, exp.

    Raises
    ------
    InputError
        The text cannot be read, or contains anything else; the message quotes text and place.
    """
    tree = _read(text, "an expression of measures", EXAMPLE)
    if isinstance(tree, ast.Compare):
        _refuse(text, tree, "is a comparison; one belongs in subject_to, an expression here")
    return _expression(text.strip(), tree, text)


def _read(text: str, what: str, example: str) -> ast.expr:
    if not isinstance(text, str) or not text.strip():
        raise InputError(f" = {show(text)}: must be {what}; {example}")
    try:
        return trees.parse(text.strip())
    except InputError as error:
        raise InputError(f" = {show(text)}: {error}; {example}") from None


def _expression(own: str, tree: ast.expr, text: str) -> Expression:
    found = dict[str, None]()
    _check(tree, text, found)
    return Expression(own, tuple(found), tree)


def _check(node: ast.expr, text: str, found: dict[str, None]) -> None:
    """Refuse nodes that expressions cannot contain, and collect the measures."""
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        _check(node.left, text, found)
        _check(node.right, text, found)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        _check(node.operand, text, found)
    elif isinstance(node, ast.Call):
        _check_call(node, text, found)
    elif isinstance(node, ast.Name) or (
        isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name)
    ):
        found.setdefault(_measure(node))
    elif not _is_number(node):
        hint = "write powers with **" if isinstance(node, ast.BinOp) else EXAMPLE
        _refuse(text, node, f"is neither a number, a measure, nor + - * / ** of them; {hint}")


def _check_call(node: ast.Call, text: str, found: dict[str, None]) -> None:
    """Refuse unknown functions and wrong arguments, and collect the measures."""
    name = ast.unparse(node.func)
    known = ", ".join([*_SEVERAL, *_FUNCTIONS])
    if name not in (*_SEVERAL, *_FUNCTIONS):
        hint = suggest(name, (*_SEVERAL, *_FUNCTIONS))
        _refuse(text, node, f"{hint}the functions are {known}; measures have brackets, [1]")
    if node.keywords or any(isinstance(one, ast.Starred) for one in node.args):
        _refuse(text, node, f"write plain numbers and measures as arguments of {name}")
    if name in _FUNCTIONS and len(node.args) != 1:
        _refuse(text, node, f"{name} has one argument")
    if name in _SEVERAL and len(node.args) < 2:
        _refuse(text, node, f"{name} has two arguments or more")
    for one in node.args:
        _check(one, text, found)


def _refuse(text: str, node: ast.expr, why: str) -> NoReturn:
    """Raise an error about a part of an expression."""
    place = f"{trees.written(node)} (character {node.col_offset + 1})"
    raise InputError(f" = {show(text)}: {place}: {why}")


def _is_number(node: ast.expr) -> bool:
    value = node.value if isinstance(node, ast.Constant) else None
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _measure(node: ast.expr) -> str:
    """Text of a measure, without spaces."""
    return "".join(ast.unparse(node).split())


# ------------------------------------------------------------------ values
def _worked(node: ast.expr, known: Mapping[str, _Number], width: int) -> _Number:
    """Value and derivatives of a part of an expression."""
    if isinstance(node, ast.BinOp):
        left, right = (_worked(one, known, width) for one in (node.left, node.right))
        return _OPERATIONS[type(node.op)](left, right)
    if isinstance(node, ast.UnaryOp):
        one = _worked(node.operand, known, width)
        return one if isinstance(node.op, ast.UAdd) else _Number(-one.value, -one.slope)
    if isinstance(node, ast.Call):
        arguments = [_worked(one, known, width) for one in node.args]
        name = ast.unparse(node.func)
        if name in _SEVERAL:
            return _chosen(_SEVERAL[name], arguments, ast.unparse(node))
        return _of_one(name, arguments[0], ast.unparse(node), _rounding(node.args[0], known))
    if isinstance(node, ast.Constant):
        return _Number(float(node.value), np.zeros(width))  # type: ignore[arg-type]
    return known[_measure(node)]


def _divided(one: _Number, other: _Number) -> _Number:
    if other.value == 0.0:
        return _Number(math.nan, one.slope)
    ratio = one.value / other.value
    return _Number(ratio, (one.slope - ratio * other.slope) / other.value)


def _power(one: _Number, other: _Number) -> _Number:
    """Power of two numbers, with its derivatives."""
    a, b = one.value, other.value
    if (a == 0.0 and b < 0.0) or (a < 0.0 and b % 1.0):
        return _Number(math.nan, one.slope)
    value = float(np.float64(a) ** b)
    slope = np.zeros_like(one.slope)
    if b != 0.0 and one.slope.any():
        slope = slope + b * float(np.float64(a) ** (b - 1.0)) * one.slope
    if other.slope.any():
        slope = slope + value * float(np.log(np.float64(a))) * other.slope
    return _Number(value, slope)


def _chosen(
    choose: Callable[[Sequence[float]], float], arguments: Sequence[_Number], text: str
) -> _Number:
    """The least or largest of several numbers; tied numbers must have equal derivatives."""
    value = choose([one.value for one in arguments])
    tied = [one for one in arguments if abs(one.value - value) <= TIE * abs(value)]
    if any(not np.allclose(one.slope, tied[0].slope, TIE, 0.0) for one in tied):
        raise InputError(f"{text}: its arguments are equal ({value:.6g}), so that it {SMOOTH}")
    return _Number(value, tied[0].slope)


def _rounding(node: ast.expr, known: Mapping[str, _Number]) -> float:
    """Bound below which a difference counts as 0 up to round-off, from the size of its terms."""
    if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)):
        return 0.0
    return TIE * max(abs(_worked(one, known, 0).value) for one in (node.left, node.right))


def _of_one(name: str, one: _Number, text: str, rounding: float) -> _Number:
    """Function of one number, with its derivatives."""
    function, derivative = _FUNCTIONS[name]
    value = float(function(one.value))
    if not one.slope.any():
        return _Number(value, one.slope)
    if name == "abs" and abs(one.value) <= rounding:
        raise InputError(f"{text}: is 0, where it has no derivative; take its square instead")
    return _Number(value, float(derivative(np.float64(one.value))) * one.slope)


_OPERATIONS: Mapping[type[ast.operator], Callable[[_Number, _Number], _Number]] = {
    ast.Add: lambda a, b: _Number(a.value + b.value, a.slope + b.slope),
    ast.Sub: lambda a, b: _Number(a.value - b.value, a.slope - b.slope),
    ast.Mult: lambda a, b: _Number(a.value * b.value, a.value * b.slope + b.value * a.slope),
    ast.Div: _divided,
    ast.Pow: _power,
}
_SEVERAL: Mapping[str, Callable[[Sequence[float]], float]] = {"min": min, "max": max}
_FUNCTIONS: Mapping[str, tuple[Callable[[float], float], Callable[[np.float64], float]]] = {
    "abs": (np.abs, np.sign),
    "sqrt": (np.sqrt, lambda x: 0.5 / np.sqrt(x)),
    "log": (np.log, lambda x: 1.0 / x),
    "exp": (np.exp, np.exp),
}


# ------------------------------------------------------------------ constraints
@dataclass(frozen=True)
class Constraint:
    """A condition on a design: "frequency[1] == 12", "mass <= 0.1".

    Attributes
    ----------
    text : str
    left, right : Expression
    sense : {"==", "<=", ">="}
    """

    text: str
    left: Expression
    right: Expression
    sense: str

    @property
    def measures(self) -> tuple[str, ...]:
        """Measures in both sides."""
        return tuple(dict.fromkeys((*self.left.measures, *self.right.measures)))

    def value(self, values: Mapping[str, float]) -> float:
        """Left minus right side; above 0 where "<=" is violated, below 0 where ">=" is."""
        return self.left.value(values) - self.right.value(values)

    def value_and_slopes(self, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """`value`, and its derivatives with respect to all measures."""
        left, slopes = self.left.value_and_slopes(values)
        right, others = self.right.value_and_slopes(values)
        return left - right, {n: slopes.get(n, 0.0) - others.get(n, 0.0) for n in self.measures}

    def size(self, values: Mapping[str, float]) -> float:
        """Scale of a violation: the side that is a plain number, else the larger side."""
        sides = [abs(side.value(values)) for side in (self.left, self.right)]
        if 0.0 not in sides and not (self.left.measures and self.right.measures):
            return sides[0] if not self.left.measures else sides[1]
        return max(sides) or 1.0

    def violation(self, difference: float) -> float:
        """Violation for a difference of the two sides; 0 if the constraint is satisfied."""
        if self.sense == "==":
            return abs(difference)
        return max(difference if self.sense == "<=" else -difference, 0.0)


def constraint(text: str) -> Constraint:
    """Constraint from its text.

    Raises
    ------
    InputError
        The text cannot be read, or is not a constraint.
    """
    example = 'write for example "frequency[1] == 12" or "mass <= 0.1"'
    tree = _read(text, "a constraint", example)
    if not isinstance(tree, ast.Compare):
        raise InputError(f" = {show(text)}: compares nothing; {example}")
    if len(tree.ops) != 1:
        raise InputError(f" = {show(text)}: has several comparisons; write one each")
    if type(tree.ops[0]) not in SENSES:
        raise InputError(f" = {show(text)}: compare with ==, <= or >=; {example}")
    sides = tree.left, tree.comparators[0]
    left, right = (_expression(ast.unparse(side), side, text) for side in sides)
    if not (left.measures or right.measures):
        raise InputError(f" = {show(text)}: has no measure; {example}")
    return Constraint(text.strip(), left, right, SENSES[type(tree.ops[0])])
