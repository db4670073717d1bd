"""Ties: keys of a case file that follow others.

A tie, such as theta2 = 360 - theta1, is a sum, difference, product or quotient of numbers and keys;
it is read by a small parser, never evaluated as Python.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from foldyn.analyses.keys import parts
from foldyn.errors import InputError, within
from foldyn.patterns.expressions import parse, written
from foldyn.values import shortened, show, suggest

_OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_REMEDY = 'write for example "360 - model.fold_law.theta1"'


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


def ties_of(table: Any) -> tuple[Tie, ...]:
    """Ties from a table of keys and expressions."""
    if not isinstance(table, Mapping):
        raise InputError(f" = {show(table)}: must be a table of keys, each with an expression")
    with within(": "):
        return tuple(Tie(key, text) for key, text in table.items())
