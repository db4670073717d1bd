"""Packages whose public names are listed once, in their stubs.

The stub of such a package, `__init__.pyi`, lists its public names and their modules, for type
checkers and for this module. Most packages load names on first use, so that importing them is fast.
"""

from __future__ import annotations

import ast
import gc
import sys
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
    homes = _homes(package, file)
    public = sorted((*homes, *own))

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        with _uncollected():
            if homes[name] == package:
                return import_module(f"{package}.{name}")
            return getattr(import_module(homes[name]), name)

    return load, lambda: public, public


def eager(package: str, file: str) -> tuple[Callable[[], list[str]], list[str]]:
    """Load the names of a package with modules of the same names; return `__dir__` and `__all__`.

    Importing such a module puts it in the place of the name, which must be set after that.
    """
    homes = _homes(package, file)
    for name, home in homes.items():
        setattr(sys.modules[package], name, getattr(import_module(home), name))
    public = sorted(homes)
    return lambda: public, public


def _homes(package: str, file: str) -> dict[str, str]:
    """Modules of public names."""
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text("utf-8"))
    imports = [statement for statement in stub.body if isinstance(statement, ast.ImportFrom)]
    return {alias.name: each.module or package for each in imports for alias in each.names}


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
