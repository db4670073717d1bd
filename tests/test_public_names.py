"""What is public: few modules, which the API page lists, and arguments that are given by name."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import foldyn as fd

PAGE = (Path(__file__).resolve().parents[1] / "docs/api.md").read_text("utf-8")
MODULES = {name for name in fd.__all__ if isinstance(getattr(fd, name), ModuleType)}
CONTRACTS = {"check", "reach", "of_nodes", "origin_of", "least_slope"}
"""Methods that loads, laws and states have for solvers."""


def test_the_page_lists_the_public_modules():
    assert set(re.findall(r"^\| `fd\.(\w+)` \|", PAGE, re.M)) == MODULES
    assert set(fd.__all__) == set(dir(fd))


def test_no_module_is_the_plural_of_a_function():
    assert not {name for name in fd.__all__ if f"{name}s" in MODULES}


def functions() -> Iterator[tuple[str, Callable]]:
    """Functions of the page, and methods of its classes, by name."""
    for space in (fd, *(getattr(fd, name) for name in sorted(MODULES))):
        for name in filter(re.compile(r"[A-Za-z]").match, dir(space)):
            found = getattr(space, name)
            if not re.search(rf"\b{name}\b", PAGE) or isinstance(found, ModuleType):
                continue
            if inspect.isfunction(found):
                yield name, found
            elif inspect.isclass(found) and not issubclass(found, Exception):
                for key, method in vars(found).items():
                    own = getattr(method, "__func__", method)
                    if inspect.isfunction(own) and key[0] != "_":
                        yield f"{name}.{key}", own


def test_third_arguments_are_given_by_name():
    several = {}
    for name, function in functions():
        known = inspect.signature(function).parameters.values()
        given = [p.name for p in known if p.kind is p.POSITIONAL_OR_KEYWORD]
        given = [key for key in given if key not in ("self", "cls")]
        if len(given) > 2 and name.partition(".")[2] not in CONTRACTS:
            several[name] = given
    assert not several


def test_both_models_have_the_same_defaults():
    bars, shell = (inspect.signature(make).parameters for make in (fd.discretize, fd.shell))
    shared = bars.keys() & shell.keys()
    assert len(shared) > 6
    assert {key: bars[key].default for key in shared} == {key: shell[key].default for key in shared}
    assert fd.ShellOptions().fold_law == fd.ModelOptions().fold_law
