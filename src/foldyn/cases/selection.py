"""Selections: nodes by number or, as "zmax and y>0", by place; creases by number or name.

An expression for nodes is made of

- ``xmin xmax ymin ymax zmin zmax``: vertices at an extreme of the pattern;
- comparisons of ``x``, ``y`` or ``z`` (m) with numbers: ``y > 0``, ``0 <= x < 1.5``, ``z == 0``;
- ``and``, ``or``, ``not`` and parentheses.

All of them use a tolerance of 1e-9 of the pattern's size, so that rounding in the coordinates does
not matter: ``y > 0`` leaves out a vertex at y = 1e-17. Expressions select among the vertices of
the pattern (at rest), never panel centers. They are read by a small parser, never evaluated.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases.expressions import parse, written
from foldyn.errors import InputError, within
from foldyn.patterns.crease_data import crease_rows
from foldyn.values import indices, shortened, show

TOLERANCE = 1e-9
"""Tolerance of a selection relative to the size of the pattern."""

_WORDS = 'one of "all", "mountain", "valley", or a family of the pattern'
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
    """Vertices that an expression selects.

    Parameters
    ----------
    points : Pattern or array_like, shape (n, 3)
        A pattern, or points (m).
    expression : str
        See the module's text.

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


def resolve_nodes(
    structure: Any, nodes: int | Sequence[int] | ArrayLike | str, field: str = "nodes"
) -> NDArray[np.int64]:
    """Numbers of nodes of a structure from a number, several, or an expression.

    Parameters
    ----------
    structure : Structure
        Its `nodes` (n, 3) bound the numbers; its pattern's vertices serve expressions.
    nodes : int, sequence of int, or str
        Numbers are kept in the order given.
    field : str
        Name of the field for messages.

    Raises
    ------
    InputError
        A number is out of range or listed twice, or an expression selects nothing.
    """
    if isinstance(nodes, str):
        pattern = structure.pattern  # None for a structure made by hand: all nodes are vertices
        with within(f"{field} = "):
            return select(structure.nodes if pattern is None else pattern, nodes)
    check_nodes(nodes, field)
    return in_range(field, nodes, len(structure.nodes), "node")


def in_range(field: str, given: Any, count: int, what: str) -> NDArray[np.int64]:
    """Return numbers of nodes or creases, of which the structure has `count`, as an array."""
    chosen = np.atleast_1d(np.array(given, dtype=np.int64))
    bad = chosen[(chosen < 0) | (chosen >= count)]
    if bad.size:
        raise InputError(
            f" = {show(given)}: {what} {bad[0]} is out of range; this structure has {what}s 0 to "
            f"{count - 1}",
            field,
        )
    return chosen


def check_nodes(nodes: Any, field: str = "nodes") -> str | tuple[int, ...]:
    """Return a node selection as text or as a tuple of numbers, checked but for its range."""
    if isinstance(nodes, str):
        if not nodes.strip():
            raise InputError(f' = "{nodes}": selects nothing; {_REMEDY}', field)
        with within(f"{field} = "):  # names and numbers, whatever the points
            _Selector(nodes, np.zeros((1, 3)), 0.0).mask()
        return nodes
    return indices(field, nodes, "node", 'or a selection such as "xmin"')


def check_creases(name: str, creases: Any) -> str | tuple[int, ...]:
    """Return a choice of creases, a word or a tuple of numbers, checked but for its range."""
    if isinstance(creases, str):
        if not creases.strip():
            raise InputError(
                f' = "{creases}": give crease numbers, as in [0, 1], or {_WORDS}', name
            )
        return creases
    return indices(name, creases, "crease", f"or {_WORDS}")


def resolve_creases(structure: Any, creases: Any, name: str = "creases") -> NDArray[np.int64]:
    """Numbers of creases of a structure from numbers or a word.

    Parameters
    ----------
    structure : Structure
        Its folds bound the numbers; its pattern's assignments and families serve words.
    creases : str or tuple of int
        As `check_creases` returns them; numbers are kept in the order given.
    name : str
        Name of the field for messages.

    Raises
    ------
    InputError
        The structure has no folds, a number is out of range, or a word means no crease.
    """
    count = len(structure.folds)
    if count == 0:
        raise InputError(
            f"{name} = {show(creases)}: this structure has no folds; give a pattern with creases"
        )
    if not isinstance(creases, str):
        return in_range(name, creases, count, "crease")
    if structure.pattern is None:
        raise InputError(
            f'{name} = "{creases}": this structure has no pattern with assignments; give crease '
            "numbers"
        )
    return crease_rows(name, creases, structure.pattern)


class _Selector:
    """One expression applied to points with an absolute tolerance (m)."""

    def __init__(self, expression: str, points: NDArray, tolerance: float) -> None:
        self.expression = expression
        self.points = points
        self.tolerance = tolerance

    def mask(self) -> NDArray[np.bool_]:
        try:
            tree = parse(self.expression.strip())
        except InputError as error:
            raise self._error(f"{error} (compare with ==, not =)") from None
        return self._truth(tree)

    def _truth(self, node: ast.expr) -> NDArray[np.bool_]:
        if isinstance(node, ast.BoolOp):
            combine = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
            return combine.reduce([self._truth(value) for value in node.values])
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return ~self._truth(node.operand)
        if isinstance(node, ast.Name):
            return self._extreme(node.id)
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            parts = [
                self._comparison(left, operator, right)
                for left, operator, right in zip(sides, node.ops, sides[1:], strict=False)
            ]
            return np.logical_and.reduce(parts)
        raise self._error(f"{written(node)} is not a condition")

    def _extreme(self, name: str) -> NDArray[np.bool_]:
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
