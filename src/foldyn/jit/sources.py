"""The sources of a kernel, found by reading the text of its file and of the files it imports.

A kernel contains the compiled functions and numbers that it names, and depends on the fields of the
named tuples that it names. So its sources are its own text and the statements that define these
names, in the same file or in the file of the package that they are imported from, recursively.
Nothing else counts: neither functions without a decorator, which compiled ones cannot call, nor
messages, nor the place of a line in its file. Only contents are compared, never file times, which
copies, checkouts or clocks change arbitrarily.

Statements start at the first column, and all words in their text count as names. Words that are not
names, such as words of comments, only add dependencies, and never hide any.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import llvmlite
import numba
import numpy as np
from numba.core import config

PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(
    rf"^[ \t]*(?:from ({PACKAGE.name}[\w.]*) import (\([^)]*\)|[^\n#]*)"
    rf"|import ({PACKAGE.name}[\w.]*)(?: as (\w+))?)",
    re.MULTILINE,
)
_DOCSTRING = re.compile(r'^\s*[rb]?"""[\s\S]*?"""', re.MULTILINE)
_STATEMENT = re.compile(r"^(?=[@\w])", re.MULTILINE)
_DEFINES = re.compile(r"(?:def|class) +(\w+)|(\w+(?:, *\w+)*)(?: *:[^=\n]*)? *=(?!=)")
_DECORATOR = re.compile(r"@(\w+)")
_WORD = re.compile(r"[A-Za-z_]\w*")
# settings that do not affect the code; the simulator replaces kernels of GPUs alone
_NO_CODE = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_ENABLE_CUDASIM")
# these files store kernels, which does not affect their code; the rest of `jit` may change Numba
_KEEPING, _COMPILING = ("kernel_cache.py", "sources.py"), PACKAGE / "jit"
_COMPILERS = ("foldyn.jit.compiled", "foldyn.mechanics.term")  # modules with decorators of kernels
_NO_CODE_IN = ("from ", "import ", "if TYPE_CHECKING:")  # starts of statements without code
_READ: set[Path] = set()
REST = ""  # stands for statements that define no name

Part = tuple[Path, str]  # the statements of a file that define a name
_WRITTEN: dict[Part, tuple[str, frozenset[Part]]] = {}  # generated text, and parts it names


class Module(NamedTuple):
    """Names that kernels may use from a file."""

    parts: dict[str, str]  # statements by the name that they define
    names: dict[str, tuple[str, str]]  # by name here: module, and name there ("" for all of it)


@cache
def digest(source: Path, name: str) -> str:
    """Digest of all that a function or class of a file consists of, such as "1f0c6a2b9d3e4f58"."""
    parts = sorted(_content(part) for part in made_from(source, name))
    return hashlib.sha256(_tools().encode() + b"".join(parts)).hexdigest()[:16]


def define(part: Part, text: str, named: Iterable[Part]) -> None:
    """Define a name of a file by a text that is generated at import."""
    _WRITTEN[part] = text, frozenset(named)


@cache
def _content(part: Part) -> bytes:
    """Digest of a part, including its location in the package."""
    path, name = part
    place = path.relative_to(PACKAGE).as_posix() if path.is_relative_to(PACKAGE) else path.name
    text = _WRITTEN[part][0] if part in _WRITTEN else _module(path).parts.get(name)
    return hashlib.sha256(f"{place} {name}\n{text}".encode()).digest()


def made_from(source: Path, name: str) -> set[Part]:
    """Parts of files that a function or class of a file consists of."""
    found: set[Part] = set()
    ahead = [(source, name)]
    while ahead:
        part = ahead.pop()
        if part not in found:
            found.add(part)
            ahead += _needed(*part)
    return found


@cache
def _needed(path: Path, name: str) -> frozenset[Part]:
    """Parts, in any file, to which the statements that define `name` in a file refer directly."""
    if (path, name) in _WRITTEN:
        return _WRITTEN[path, name][1]
    own = _module(path)
    words = set(_WORD.findall(own.parts.get(name, "")))
    needed = {(path, word) for word in words & own.parts.keys()} | {(path, REST)}
    for word in words & own.names.keys():
        module, original = own.names[word]
        for home in _home(module, original):
            parts = _module(home).parts
            if home.parent == _COMPILING:
                wanted = parts.keys() if home.name not in _KEEPING else set()
            elif original in parts:
                wanted = {original}
            elif original and home.stem != original:
                wanted = parts.keys()  # unknown which part defines the name
            else:  # the word is a module
                wanted = words & parts.keys() | {REST}
            needed |= {(home, part) for part in wanted}
    decorator = _DECORATOR.match(own.parts.get(name, ""))
    if decorator and own.names.get(decorator.group(1), ("", ""))[0] in _COMPILERS:
        needed = {part for part in needed if not _in_python(*part)}
    return frozenset(needed)


@cache
def _in_python(path: Path, name: str) -> bool:
    """Whether a name is a function without decorator, which compiled code cannot call."""
    text = _module(path).parts.get(name, "")
    alone = text.startswith("def ") and len(_STATEMENT.findall(text)) == 1
    return alone and path.parent != _COMPILING


@cache
def _module(path: Path) -> Module:
    """Names that kernels may use from a file."""
    text = _DOCSTRING.sub("", _text(path))
    names = {alias: (module, name) for module, name, alias in imports(text)}
    parts, decorators = {REST: ""}, ""
    for statement in _STATEMENT.split(text):
        if statement.startswith("@"):
            decorators += statement
            continue
        defined = _DEFINES.match(statement)
        for name in _WORD.findall(defined.group(1) or defined.group(2)) if defined else [REST]:
            if not statement.startswith(_NO_CODE_IN):
                parts[name] = parts.get(name, "") + decorators + statement
        decorators = ""
    return Module(parts, names)


def imports(text: str) -> Iterator[tuple[str, str, str]]:
    """Imports of a file from the package: module, name, and local name.

    The name is empty if a whole module is imported.
    """
    for module, names, whole, alias in _IMPORT.findall(text):
        if whole:
            yield whole, "", alias or PACKAGE.name
        for name in re.sub(r"#.*", "", names).strip("() \n").split(","):
            if name.strip():
                yield module, name.split()[0], name.split()[-1]


@cache
def _home(module: str, name: str) -> frozenset[Path]:
    """Files that may define a name imported from a module."""
    place = PACKAGE.joinpath(*module.split(".")[1:])
    if not place.is_dir():
        return frozenset([place.with_suffix(".py")])
    if name and (place / name).is_dir():
        return _home(f"{module}.{name}", "")
    if name and (place / f"{name}.py").is_file():
        return frozenset([place / f"{name}.py"])
    there = [pair for pair in imports(_text(place / "__init__.py")) if pair[0] != module]
    passed_on = [origin for origin, other, _ in there if other == name]
    passed_on = passed_on or [origin for origin, other, _ in there if other == "*"]
    if name and passed_on:
        return frozenset(path for origin in passed_on for path in _home(origin, name))
    return frozenset(place.rglob("*.py"))  # the whole folder, as the file is unknown


def read(source: Path) -> None:
    """Read a file and its imports now, so that they match the imported code."""
    ahead = [source]
    while ahead:
        path = ahead.pop()
        if path not in _READ:
            _READ.add(path)
            ahead += _imported(path)


def _imported(source: Path) -> frozenset[Path]:
    """Files of the package that a file imports from."""
    found = imports(_text(source))
    return frozenset(path for module, name, _ in found for path in _home(module, name))


@cache
def _text(path: Path) -> str:
    """Text of a file as first read in this process, before or soon after the file's import."""
    return path.read_text("utf-8")


@cache
def _tools() -> str:
    """Versions and settings that affect a kernel's code; Numba itself checks the processor."""
    versions = (sys.version, np.__version__, numba.__version__, llvmlite.__version__)
    variables = getattr(config, "_env_reloader").old_environ  # noqa: B009 - of files too
    settings = sorted(item for item in variables.items() if item[0] not in _NO_CODE)
    return repr((versions, settings, getattr(config, "USING_SVML", None)))
