"""Short expressions in case files: parsed by Python's parser, never evaluated."""

from __future__ import annotations

import ast
import re
import warnings

from foldyn.errors import InputError
from foldyn.values import shortened

_UNDERSCORED = re.compile(r"(?<![\w.])\d[\d.]*_")
LONGEST = 1000  # most characters of an expression
DEEPEST = 50  # most nested operations


def parse(text: str) -> ast.expr:
    """Syntax tree of an expression, checked to be shallow enough for recursive functions.

    Raises
    ------
    InputError
        The text cannot be read, or is too long or too deep; the message names no field.
    """
    if _UNDERSCORED.search(text):  # 1_000, which only Python reads as a number
        raise InputError("cannot be read")
    if len(text) > LONGEST:
        raise InputError(f"is longer than {LONGEST} characters")
    try:
        with warnings.catch_warnings(action="ignore"):  # Python's syntax warnings
            tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError("cannot be read") from None
    level: list[ast.AST] = [tree]
    for _ in range(DEEPEST):
        level = [inner for node in level for inner in ast.iter_child_nodes(node)]
        if not level:
            return tree
    raise InputError(f"has more than {DEEPEST} nested operations")


def written(node: ast.expr) -> str:
    """Source text of a subexpression, for a message."""
    try:
        return shortened(ast.unparse(node))
    except ValueError:  # an integer with too many digits
        return "a number"
