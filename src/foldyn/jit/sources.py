"""Which sources a kernel is made from, found in the sources themselves.

A kernel holds the compiled functions and the numbers that it takes from other files, and knows the
fields of named tuples that are defined in others still. So it is made from its own file and from
all files of the package that this one imports, directly or through others. Their contents are
looked at, never their times: a copy, a checkout or a clock may set these as it likes.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np
from numba.core import config

PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(
    rf"^[ \t]*(?:from ({PACKAGE.name}[\w.]*) import (\([^)]*\)|[^\n#]*)"
    rf"|import ({PACKAGE.name}[\w.]*))",
    re.MULTILINE,
)
_NO_CODE = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS")  # variables that leave the code as it is


@cache
def digest(source: Path) -> str:
    """Digest of all that the kernels of a file are made from, "1f0c6a2b9d3e4f58"."""
    content = hashlib.sha256(_tools().encode())
    for path in sorted(made_from(source)):
        inside = path.is_relative_to(PACKAGE)
        content.update((path.relative_to(PACKAGE).as_posix() if inside else path.name).encode())
        content.update(_content(path))
    return content.hexdigest()[:16]


def made_from(source: Path) -> set[Path]:
    """Files that the kernels of a file are made from."""
    files, ahead = {source}, [source]
    while ahead:
        new = imported(ahead.pop()) - files
        files |= new
        ahead += new
    return files


@cache
def imported(source: Path) -> frozenset[Path]:
    """Files of the package that a file imports from."""
    return frozenset(path for module, name in imports(source) for path in _home(module, name))


def imports(source: Path) -> Iterator[tuple[str, str]]:
    """Imports of a file from the package, (module, name); no name where all of it is imported."""
    for module, names, whole in _IMPORT.findall(_text(source)):
        if whole:
            yield whole, ""
        for name in re.sub(r"#.*", "", names).strip("() \n").split(","):
            if name.strip():
                yield module, name.split()[0]


@cache
def _home(module: str, name: str) -> frozenset[Path]:
    """Files in which a name that is imported from a module may be defined."""
    place = PACKAGE.joinpath(*module.split(".")[1:])
    if not place.is_dir():
        return frozenset([place.with_suffix(".py")])
    if name and (place / name).is_dir():
        return _home(f"{module}.{name}", "")
    if name and (place / f"{name}.py").is_file():
        return frozenset([place / f"{name}.py"])
    start = place / "__init__.py"
    there = [(origin, other) for origin, other in imports(start) if origin != module]
    passed_on = [origin for origin, other in there if other == name]
    passed_on = passed_on or [origin for origin, other in there if other == "*"]
    if name and passed_on:
        return frozenset(path for origin in passed_on for path in _home(origin, name))
    return frozenset(place.rglob("*.py"))  # the folder as a whole, or nobody knows which file


@cache
def _text(path: Path) -> str:
    """Text of a file when this process first looked: before it is imported, or soon after."""
    return path.read_text("utf-8")


@cache
def _content(path: Path) -> bytes:
    return hashlib.sha256(_text(path).encode()).digest()


@cache
def _tools() -> str:
    """What else decides on the code of a kernel; Numba looks at the processor itself."""
    versions = (sys.version, np.__version__, numba.__version__, llvmlite.__version__)
    variables = getattr(config, "_env_reloader").old_environ  # noqa: B009 - of files too
    settings = sorted(item for item in variables.items() if item[0] not in _NO_CODE)
    return repr((versions, settings, getattr(config, "USING_SVML", None)))
