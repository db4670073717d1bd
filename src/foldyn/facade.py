"""Packages that load public names on first use, so that importing them is fast.

The stub of such a package, `__init__.pyi`, lists its public names and their modules, for type
checkers and for this module.
"""

from __future__ import annotations

import ast
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy(
    package: str, file: str, *own: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package.

    Parameters
    ----------
    package, file : str
        `__name__` and `__file__` of the package.
    *own : str
        Public names that the package defines itself.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text("utf-8"))
    imports = [statement for statement in stub.body if isinstance(statement, ast.ImportFrom)]
    homes = {alias.name: each.module or package for each in imports for alias in each.names}
    public = sorted((*homes, *own))

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        with _uncollected():
            if homes[name] == package:
                return import_module(f"{package}.{name}")
            return getattr(import_module(homes[name]), name)

    return load, lambda: public, public


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without garbage collection: a quarter of the time of imports, and it finds nothing."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
