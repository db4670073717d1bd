"""The registry of methods that follow a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from foldyn.errors import InputError
from foldyn.statics.arc_rules import Cylinder, Plane
from foldyn.statics.continuation import ArcRule


class PathMethod(NamedTuple):
    """How a path is followed.

    `rule` is None where the load factor drives the path; `between` says whether points between
    the given load factors belong to the path, too.
    """

    name: str
    rule: ArcRule | None
    between: bool


METHODS: Mapping[str, PathMethod] = {
    "newton": PathMethod("newton", None, False),
    "displacement": PathMethod("displacement", None, True),
    "mgdcm": PathMethod("mgdcm", Plane, True),
    "arc_length": PathMethod("arc_length", Cylinder, True),
}


def method_of(name: str) -> PathMethod:
    """Method by its name."""
    if not isinstance(name, str) or name not in METHODS:
        raise InputError(f" = {name!r}: choose one of {', '.join(METHODS)}", "method")
    return METHODS[name]
