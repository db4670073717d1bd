"""Releases: supports and planes of a case that act until a time, or until something is reached.

Parts of a case are named by their places, as in "supports[2]".
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from foldyn.cases.directions import AXES
from foldyn.cases.latches import Latch
from foldyn.cases.reached import Reached, ReachedTension
from foldyn.cases.supports import BaseMotion, Fix
from foldyn.errors import InputError, within
from foldyn.values import show

NEVER = 1e49  # s: until when parts stay that are not released yet


def _ends(case: Any) -> dict[str, Any]:
    """When parts of a case are released, by their places."""
    lists = {"supports": case.supports, "contact.planes": case.contact and case.contact.planes}
    return {
        f"{name}[{k}]": part.until
        for name, parts in lists.items()
        for k, part in enumerate(parts or ())
        if getattr(part, "until", None) is not None and not isinstance(part, Latch)
    }


def release_times(case: Any) -> dict[str, float]:
    """Times (s) at which parts of a case are released, by their places."""
    ends = _ends(case).items()
    return {place: until for place, until in ends if not isinstance(until, Reached)}


def waiting(case: Any) -> dict[Reached, list[str]]:
    """What is reached where parts of a case are released, with their places."""
    found: dict[Reached, list[str]] = {}
    for place, until in _ends(case).items():
        if isinstance(until, Reached):
            found.setdefault(until, []).append(place)
    return found


def _without(case: Any, gone: Collection[str], until: float | None) -> Any:
    """A case without parts at some places, nor motions of a base that hold nothing.

    until : time (s) of release of all other parts that are released.
    """
    ends, contact = _ends(case), case.contact

    def left(name: str, parts: Sequence[Any]) -> list[Any]:
        named = ((f"{name}[{k}]", part) for k, part in enumerate(parts))
        return [
            replace(part, until=until) if place in ends else part
            for place, part in named
            if place not in gone
        ]

    supports = left("supports", case.supports)
    held = {axis for part in supports if isinstance(part, Fix) for axis in part.axes or AXES}
    supports = [p for p in supports if not isinstance(p, BaseMotion) or p.axis in held]
    if contact is not None:
        planes = left("contact.planes", contact.planes)
        contact = replace(contact, planes=planes) if planes or contact.panels else None
    return case.altered(supports=supports, contact=contact)


def released(case: Any, gone: Collection[str]) -> Any:
    """A case without parts at some places; all others stay."""
    return _without(case, gone, NEVER)


def unreleased(case: Any) -> Any:
    """A case whose parts all stay, for analyses of the state before anything is released."""
    return _without(case, (), None)


def check_releases(case: Any) -> bool:
    """Check what is reached, and the case without all that is released; whether there is any."""
    for until, places in waiting(case).items():
        with within(f"{places[0]}.until."):
            until.share(case)
            if isinstance(until, ReachedTension):
                _check_fuse(case, until, places)
    ends = _ends(case)
    if ends:  # loads need to move only what is free in the end
        _without(case, ends, None)
    return bool(ends)


def _check_fuse(case: Any, until: ReachedTension, places: Collection[str]) -> None:
    """Refuse a line that waits for less than its own tension at rest."""
    rest = until.at_rest(case)
    if case.line_places[until.line] in places and abs(until.tension) < abs(rest):
        raise InputError(
            f" = {until.tension:g}: at rest it has {rest:.6g} N already; give more", "tension"
        )


def refuse_releases(
    case: Any, name: str, instead: str = "leave until out, or compute the motion by fd.simulate"
) -> None:
    """Refuse parts that are released, for an analysis of this name; `instead` is the remedy."""
    for place, until in _ends(case).items():
        shown = show(until.table() if isinstance(until, Reached) else until)
        raise InputError(f" = {shown}: {name} releases nothing: {instead}", f"{place}.until")
