"""Expressions that select vertices by position, such as "zmax and y>0".

An expression is made of

- ``xmin xmax ymin ymax zmin zmax``: vertices at an extreme of the pattern;
- comparisons of ``x``, ``y`` or ``z`` (m) with numbers: ``y > 0``, ``0 <= x < 1.5``, ``z == 0``;
- ``and``, ``or``, ``not`` and parentheses.

All comparisons use a tolerance of 1e-9 of the pattern's size, so that rounding in the coordinates
does not matter: ``y > 0`` leaves out a vertex at y = 1e-17. Expressions select vertices of the
pattern (at rest), never panel centers. They are read by a small parser, never executed as code.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.expressions import parse, written
from foldyn.values import shortened

TOLERANCE = 1e-9  # tolerance of comparisons, relative to the size of the pattern

_AXES = {"x": 0, "y": 1, "z": 2}
_REMEDY = 'write for example "xmin", "zmax and y>0" or "not (x<1 or z==0)"'
_COMPARISONS: Mapping[type[ast.cmpop], Callable[[NDArray, float], NDArray]] = {
    ast.Lt: lambda difference, tolerance: difference < -tolerance,
    ast.LtE: lambda difference, tolerance: difference <= tolerance,
    ast.Gt: lambda difference, tolerance: difference > tolerance,
    ast.GtE: lambda difference, tolerance: difference >= -tolerance,
    ast.Eq: lambda difference, tolerance: np.abs(difference) <= tolerance,
    ast.NotEq: lambda difference, tolerance: np.abs(difference) > tolerance,
}
_MIRRORED = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}


def select(points: Any, expression: str) -> NDArray[np.int64]:
    """Numbers of the vertices that an expression selects.

    Parameters
    ----------
    points : Pattern or array_like, shape (n, 3)
        A pattern, or points (m).
    expression : str
        See the docstring of the module `patterns.selection`.

    Returns
    -------
    ndarray of int, shape (k,)
        Numbers of the selected points in increasing order, k >= 1.

    Raises
    ------
    InputError
        The expression cannot be read or selects nothing.

    Examples
    --------
    >>> select([[0, 0, 0], [1, 0, 0], [1, 2, 0]], "xmax and y>0")
    array([2])
    """
    vertices = np.asarray(getattr(points, "vertices", points), dtype=np.float64)
    span = np.ptp(vertices, axis=0)
    selector = _Selector(expression, vertices, TOLERANCE * float(np.linalg.norm(span)))
    chosen = np.flatnonzero(selector.mask())
    if chosen.size == 0:
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        ranges = ", ".join(f"{axis} {low[i]:.6g} to {high[i]:.6g}" for axis, i in _AXES.items())
        raise InputError(
            f'"{shortened(expression)}": selects no vertex; the pattern spans {ranges} (m)'
        )
    return chosen


@contextmanager
def given_as(field: str) -> Iterator[None]:
    """Name the field in errors about an expression that are raised in the block."""
    try:
        yield
    except InputError as error:
        raise InputError(f" = {error}", field) from None


def check_expression(expression: str) -> str:
    """Return an expression if it can be parsed, whether or not it selects any vertex."""
    if not expression.strip():
        raise InputError(f'"{expression}": selects nothing; {_REMEDY}')
    _Selector(expression, np.zeros((1, 3)), 0.0).mask()
    return expression


@dataclass(frozen=True, eq=False)
class _Selector:
    """Evaluates one expression on points with an absolute tolerance (m)."""

    expression: str
    points: NDArray
    tolerance: float

    def mask(self) -> NDArray[np.bool_]:
        try:
            tree = parse(self.expression.strip())
        except InputError as error:
            raise self._error(f"{error} (compare with ==, not =)") from None
        return self._truth(tree)

    def _truth(self, node: ast.expr) -> NDArray[np.bool_]:
        """Mask (n,) of the points for which a condition holds."""
        if isinstance(node, ast.BoolOp):
            combine = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
            return combine.reduce([self._truth(value) for value in node.values])
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return ~self._truth(node.operand)
        if isinstance(node, ast.Name):
            return self._extreme(node.id)
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            parts = zip(sides, node.ops, sides[1:], strict=False)
            return np.logical_and.reduce([self._comparison(*part) for part in parts])
        raise self._error(f"{written(node)} is not a condition")

    def _extreme(self, name: str) -> NDArray[np.bool_]:
        """Mask (n,) of the points at an extreme such as "zmax"."""
        axis, which = _AXES.get(name[:1]), name[1:]
        if axis is None or which not in ("min", "max"):
            raise self._error(
                f"{name} is not known; use xmin, xmax, ymin, ymax, zmin, zmax, or compare x, y or "
                "z with a number"
            )
        values = self.points[:, axis]
        if which == "min":
            return values <= values.min() + self.tolerance
        return values >= values.max() - self.tolerance

    def _comparison(
        self, left: ast.expr, operator: ast.cmpop, right: ast.expr
    ) -> NDArray[np.bool_]:
        """Mask (n,) of the points whose coordinate satisfies a comparison with a number."""
        if not isinstance(left, ast.Name):
            left, right = right, left
            operator = _MIRRORED.get(type(operator), type(operator))()
        if not isinstance(left, ast.Name) or left.id not in _AXES:
            raise self._error("compare x, y or z with a number")
        difference = self.points[:, _AXES[left.id]] - self._number(right)
        compare = _COMPARISONS.get(type(operator))
        if compare is None:
            raise self._error("compare with <, <=, >, >=, == or !=")
        return compare(difference, self.tolerance)

    def _number(self, node: ast.expr) -> float:
        sign = 1.0
        while isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            sign = -sign if isinstance(node.op, ast.USub) else sign
            node = node.operand
        value = node.value if isinstance(node, ast.Constant) else None
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._error(f"{written(node)} is not a number")
        try:
            return sign * float(value)
        except OverflowError:
            raise self._error(f"{written(node)} is not a finite number") from None

    def _error(self, what: str) -> InputError:
        return InputError(f'"{shortened(self.expression)}": {what}; {_REMEDY}')
