"""Releases: supports and planes of a case that hold or push until a time within a motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from foldyn.cases.directions import AXES
from foldyn.cases.latches import Latch
from foldyn.cases.supports import BaseMotion, Fix
from foldyn.errors import InputError


def _until(part: Any) -> float:
    """Time (s) at which a part is released; infinite for those that stay."""
    until = None if isinstance(part, Latch) else getattr(part, "until", None)
    return math.inf if until is None else until


def _by_field(case: Any) -> dict[str, float]:
    """Times (s) of releases by the field."""
    lists = {"supports": case.supports, "contact.planes": case.contact and case.contact.planes}
    return {
        f"{name}[{k}].until": _until(part)
        for name, parts in lists.items()
        for k, part in enumerate(parts or ())
        if _until(part) < math.inf
    }


def release_times(case: Any) -> list[float]:
    """Times (s) at which parts of a case are released, increasing."""
    return sorted(set(_by_field(case).values()))


def stays(part: Any, time: float) -> bool:
    """Whether a support or a plane still acts just after a time (s)."""
    return _until(part) > time


def _changed(case: Any, change: Callable[[Any], Any]) -> Any:
    """A case with each support and plane as changed, without those that change to None."""
    supports, contact = [new for part in case.supports if (new := change(part))], case.contact
    if contact is not None:
        planes = [new for plane in contact.planes if (new := change(plane))]
        contact = replace(contact, planes=planes) if planes or contact.panels else None
    return case.altered(supports=supports, contact=contact)


def released(case: Any, time: float) -> Any:
    """A case without the parts that are released up to a time (s).

    Motions of a base to which nothing is held any more go, too.
    """
    held = {
        axis
        for part in case.supports
        if isinstance(part, Fix) and stays(part, time)
        for axis in part.axes or AXES
    }

    def change(part: Any) -> Any:
        idle = isinstance(part, BaseMotion) and part.axis not in held
        return part if stays(part, time) and not idle else None

    return _changed(case, change)


def unreleased(case: Any) -> Any:
    """A case whose parts all stay, for analyses of the state before anything is released."""
    return _changed(
        case, lambda part: replace(part, until=None) if _until(part) < math.inf else part
    )


def refuse_releases(
    case: Any, name: str, instead: str = "leave it out, or compute the motion by fd.simulate"
) -> None:
    """Refuse parts that are released, for an analysis of this name; `instead` is the remedy."""
    for field, time in _by_field(case).items():
        raise InputError(f" = {time:g}: {name} releases nothing: {instead}", field)
