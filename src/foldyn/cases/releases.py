"""Releases: supports and planes of a case that act until a time, or until something is reached."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from foldyn.cases.directions import AXES
from foldyn.cases.latches import Latch
from foldyn.cases.reached import Reached, ReachedTension
from foldyn.cases.supports import BaseMotion, Fix
from foldyn.errors import InputError, within
from foldyn.values import show


def _until(part: Any) -> float | Reached | None:
    """When a part is released; None for those that stay."""
    return None if isinstance(part, Latch) else getattr(part, "until", None)


def _released(case: Any) -> Iterator[tuple[str, Any]]:
    """Parts of a case that are released, each with its place."""
    lists = {"supports": case.supports, "contact.planes": case.contact and case.contact.planes}
    for name, parts in lists.items():
        for k, part in enumerate(parts or ()):
            if _until(part) is not None:
                yield f"{name}[{k}]", part


def released_at(case: Any) -> dict[str, float]:
    """Times (s) at which parts of a case are released, by their places."""
    every = {place: part.until for place, part in _released(case)}
    return {place: until for place, until in every.items() if not isinstance(until, Reached)}


def release_times(case: Any) -> list[float]:
    """Times (s) at which parts of a case are released, increasing."""
    return sorted(set(released_at(case).values()))


def waiting(case: Any) -> dict[str, Reached]:
    """What is reached where parts of a case are released, by their places."""
    return {place: part.until for place, part in _released(case) if isinstance(part.until, Reached)}


def awaited(case: Any, time: float) -> dict[str, Callable[..., float]]:
    """What a case waits for just after a time (s), by the places: see `Reached.share`.

    Nothing waits for the tension of what is released itself.
    """
    found = waiting(case)
    gone = [not stays(support, time) for support, *_ in case.polylines()] if found else []
    return {
        place: until.share(case)
        for place, until in found.items()
        if not (isinstance(until, ReachedTension) and gone[until.line])
    }


def stays(part: Any, time: float) -> bool:
    """Whether a support or a plane still acts just after a time (s)."""
    until = _until(part)
    return until is None or isinstance(until, Reached) or until > time


def _changed(case: Any, change: Callable[[Any], Any]) -> Any:
    """A case with each support and plane as changed, without those that change to None."""
    supports, contact = [new for part in case.supports if (new := change(part))], case.contact
    if contact is not None:
        planes = [new for plane in contact.planes if (new := change(plane))]
        contact = replace(contact, planes=planes) if planes or contact.panels else None
    return case.altered(supports=supports, contact=contact)


def _without(case: Any, goes: Callable[[Any], bool]) -> Any:
    """A case without some parts, nor motions of a base that hold nothing; all others stay."""
    held = {
        axis
        for part in case.supports
        if isinstance(part, Fix) and not goes(part)
        for axis in part.axes or AXES
    }

    def change(part: Any) -> Any:
        idle = isinstance(part, BaseMotion) and part.axis not in held
        if goes(part) or idle:
            return None
        return part if _until(part) is None else replace(part, until=None)

    return _changed(case, change)


def released(case: Any, time: float) -> Any:
    """A case without the parts that are released up to a time (s); all others stay."""
    return _without(case, lambda part: not stays(part, time))


def check_releases(case: Any) -> bool:
    """Check what is reached, and the case without all that is released; whether there is any."""
    for place, until in waiting(case).items():
        with within(f"{place}.until."):
            until.share(case)
    if some := any(_released(case)):  # loads need to move only what is free in the end
        _without(case, lambda part: _until(part) is not None)
    return some


def timed(case: Any, times: Mapping[str, float]) -> Any:
    """A case whose parts at some places are released at times (s), whatever they waited for."""
    parts = {id(part): times[place] for place, part in _released(case) if place in times}

    def change(part: Any) -> Any:
        if id(part) not in parts:
            return part
        own = copy.copy(part)
        object.__setattr__(own, "until", parts[id(part)])  # may be the start, at 0
        return own

    return _changed(case, change)


def unreleased(case: Any) -> Any:
    """A case whose parts all stay, for analyses of the state before anything is released."""
    return _without(case, lambda part: False)


def refuse_releases(
    case: Any, name: str, instead: str = "leave it out, or compute the motion by fd.simulate"
) -> None:
    """Refuse parts that are released, for an analysis of this name; `instead` is the remedy."""
    for place, part in _released(case):
        raise InputError(
            f" = {show(part.until)}: {name} releases nothing: {instead}", f"{place}.until"
        )
