"""Selections: nodes by number or by place (`patterns.selection`); creases by number or name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.patterns.crease_data import crease_rows
from foldyn.patterns.selection import check_expression, given_as, select
from foldyn.values import indices, show

_WORDS = 'one of "all", "mountain", "valley", or a family of the pattern'


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
        with given_as(field):
            return select(structure.nodes if pattern is None else pattern, nodes)
    check_nodes(field, nodes)
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


def check_nodes(name: str, nodes: Any) -> str | tuple[int, ...]:
    """Return a node selection as text or as a tuple of numbers, checked but for its range."""
    if isinstance(nodes, str):
        with given_as(name):
            return check_expression(nodes)
    return indices(name, nodes, "node", 'or a selection such as "xmin"')


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


Nodes = Annotated[int | str | Sequence[int], Check(check_nodes)]
Creases = Annotated[int | str | Sequence[int], Check(check_creases)]
