"""Keys of case files: paths such as "sheet.thickness" or "loads[0].force[2]".

Also the values of keys, and ties: keys that depend on others. A tie, such as theta2 = 360 - theta1,
is a sum, difference, product or quotient of numbers and keys. A small parser reads it; it is never
evaluated as Python.
"""

from __future__ import annotations

import ast
import copy
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from foldyn.errors import InputError, within
from foldyn.patterns.expressions import parse, written
from foldyn.values import SHOWN, shortened, show, suggest

LONGEST = 200
"""Largest number of characters of a key: no case file nests its tables deeper."""
_KEY = re.compile(r"[A-Za-z_]\w*(\[\d+\])*(\.[A-Za-z_]\w*(\[\d+\])*)*\Z")


def parts(key: Any) -> tuple[str | int, ...]:
    """Keys and indices of a path: "loads[0].force" becomes ("loads", 0, "force").

    Raises
    ------
    InputError
        The text is not a path.
    """
    if not isinstance(key, str) or len(key) > LONGEST or not _KEY.match(key):
        raise InputError(
            f"{show(key)}: is no key of a case file; write the section and the key, as in "
            '"sheet.thickness" or "loads[0].force[2]"'
        )
    return tuple(int(p) if p.isdigit() else p for p in re.findall(r"\w+", key))


def dotted(location: Sequence[str | int]) -> str:
    """Path of a key: ("loads", 0, "nodes") becomes "loads[0].nodes"."""
    text = ""
    for part in location:
        word = f"[{part}]" if isinstance(part, int) else part[:SHOWN]
        text += f".{word}" if text and isinstance(part, str) else word
    return text


def value_at(document: Mapping[str, Any], key: str) -> Any:
    """Value of a key in a case file; None if the file does not have it."""
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

    Missing tables are added, and a law given by its name becomes a table. The reader of the case
    file checks whether the file may have such a key.

    Raises
    ------
    InputError
        A path leads through something other than a table or list, or beyond the end of a list.
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


def files_of(value: Any, *without: str) -> list[str]:
    """Paths of all files named in a case file, except in tables under the keys `without`."""
    if isinstance(value, Mapping):
        own = [value["file"]] if isinstance(value.get("file"), str) else []
        inner = [item for key, item in value.items() if key not in without]
        return own + [file for item in inner for file in files_of(item, *without)]
    if isinstance(value, list):
        return [file for item in value for file in files_of(item, *without)]
    return []


def files_moved(value: Any, way: str) -> Any:
    """Document with file names relative to another folder; `way` leads there."""
    if isinstance(value, dict):
        return {
            key: Path(way, item).as_posix() if key == "file" else files_moved(item, way)
            for key, item in value.items()
        }
    return [files_moved(item, way) for item in value] if isinstance(value, list) else value


_OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_REMEDY = 'write for example "360 - model.fold_law.theta1"'


@dataclass(frozen=True)
class Tie:
    """A key of a case file that depends on parameters.

    Parameters
    ----------
    key : str
        The dependent key.
    expression : str
        Value of the key in terms of numbers, ``+ - * /``, parentheses and keys of parameters.
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
        """Value for given parameters; with None the expression is only checked."""
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
        raise self._error(f"{written(node)} is neither a number nor a key")

    def _error(self, what: str) -> InputError:
        return InputError(f'tie {self.key} = "{shortened(self.expression)}": {what}; {_REMEDY}')


def ties_of(table: Any) -> tuple[Tie, ...]:
    """Ties from a table of keys and expressions."""
    if not isinstance(table, Mapping):
        raise InputError(f" = {show(table)}: must be a table of keys, each with an expression")
    with within(": "):
        return tuple(Tie(key, text) for key, text in table.items())
