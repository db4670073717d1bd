"""Compiled functions generated at import, with a branch for each entry.

Classes declare formulas, each with a number as its code. Kernels reach a formula by its code,
through one function with a branch for each code. This function is generated here from the
declarations, so that nothing is listed twice.
"""

from __future__ import annotations

import inspect
import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.sources import define

Branch = tuple[str, tuple[Any, ...]]
"""What a branch returns, with nan, and {0}, {1}, ... for compiled functions; and these."""


def switch(
    module: str, name: str, arguments: str, branches: Mapping[int, Branch], otherwise: Branch
) -> Any:
    """Function `name` of a module; the first of its `arguments` is a code that selects a branch."""
    lines, known = ["@inner_scalar", f"def {name}({arguments}):"], {}
    for code, (formula, functions) in [*branches.items(), (None, otherwise)]:
        called = [f"{one.__module__}.{one.__name__}".replace(".", "_") for one in functions]
        known |= dict(zip(called, functions, strict=True))
        test = "" if code is None else f"if {arguments.partition(',')[0]} == {code}: "
        lines.append(f"    {test}return {formula.format(*called)}")
    home, text = str(sys.modules[module].__file__), "\n".join(lines)
    define((Path(home).resolve(), name), text, map(_part, known.values()))
    scope = {"__name__": module, "inner_scalar": inner_scalar, "nan": math.nan, **known}
    exec(compile(text, home, "exec"), scope)
    return scope[name]


def _part(function: Any) -> tuple[Path, str]:
    """File and name that define a compiled function or an intrinsic."""
    text = function.py_func if hasattr(function, "py_func") else function._defn
    return Path(inspect.getfile(text)).resolve(), function.__name__


def by_code(declared: Mapping[str, Iterable[Any]]) -> dict[int, Any]:
    """Declarations of classes, by code; refuses classes without declarations, and double codes."""
    found: dict[int, Any] = {}
    owner: dict[int, str] = {}
    for name, formulas in declared.items():
        if not formulas:
            raise TypeError(f"{name} is registered, but declares no formulas")
        for one in formulas:
            if one.code in found:
                raise TypeError(
                    f"{name} and {owner[one.code]} have the same code, {one.code}: give another"
                )
            found[one.code], owner[one.code] = one, name
    return found


def arguments_of(formula: Any) -> list[str]:
    """Names of the arguments of a compiled function."""
    return list(inspect.signature(formula.py_func).parameters)
