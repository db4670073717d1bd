"""Releases: supports and planes of a case that hold or push until a time within a motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.latches import Latch
from foldyn.cases.supports import BaseMotion, Fix
from foldyn.errors import InputError

SIMULATE = "leave it out, or compute the motion by fd.simulate"


def _until(part: Any) -> float:
    """Time (s) at which a part is released; infinite for those that stay."""
    until = None if isinstance(part, Latch) else getattr(part, "until", None)
    return math.inf if until is None else until


def _releases(case: Any) -> Iterator[tuple[str, float]]:
    """Fields of a case with a release, and its time (s)."""
    lists = {"supports": case.supports, "contact.planes": case.contact and case.contact.planes}
    for name, parts in lists.items():
        for k, part in enumerate(parts or ()):
            if _until(part) < math.inf:
                yield f"{name}[{k}].until", _until(part)


def release_times(case: Any) -> list[float]:
    """Times (s) at which parts of a case are released, increasing."""
    return sorted({time for _, time in _releases(case)})


def stays(part: Any, time: float) -> bool:
    """Whether a support or a plane still acts just after a time (s)."""
    return _until(part) > time


def released(case: Any, time: float) -> Any:
    """A case without the parts that are released up to a time (s).

    Motions of a base to which nothing is held any more go, too.
    """
    supports = [part for part in case.supports if stays(part, time)]
    held = [part for part in supports if isinstance(part, Fix)]
    supports = [
        part for part in supports
        if not isinstance(part, BaseMotion) or any(_holds(fix, part.axis) for fix in held)
    ]  # fmt: skip
    contact = case.contact
    if contact is not None:
        planes = [plane for plane in contact.planes if stays(plane, time)]
        contact = replace(contact, planes=planes) if planes or contact.panels else None
    return case.altered(supports=supports, contact=contact)


def _holds(fix: Fix, axis: str) -> bool:
    """Whether a support holds its nodes along an axis, or along a direction with a part of it."""
    if fix.direction is None:
        return axis in (fix.axes or AXES)
    return bool(unit_vector(fix.direction)[AXES.index(axis)])


def unreleased(case: Any) -> Any:
    """A case whose parts all stay, for analyses without time."""
    if not release_times(case):
        return case
    supports = [_staying(part) for part in case.supports]
    contact = case.contact
    if contact is not None:
        contact = replace(contact, planes=[_staying(plane) for plane in contact.planes])
    return case.altered(supports=supports, contact=contact)


def _staying(part: Any) -> Any:
    return replace(part, until=None) if _until(part) < math.inf else part


def refuse_releases(case: Any, name: str, instead: str) -> None:
    """Refuse parts that are released, for an analysis of this name; `instead` is the remedy."""
    for field, time in _releases(case):
        raise InputError(f" = {time:g}: {name} releases nothing; {instead}", field)
