"""Copies of all that changes in the objects of a motion, to go on from exactly there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.course import Course
from foldyn.dynamics.system import Packed
from foldyn.mechanics.hinge_memory import HingeMemory

CONSTANT = ("team", "strips", "packed", "course", "_packed", "_course", "_plan", "share")
"""Fields that stay what they are, or serve one evaluation."""


def parts_of(packed: Packed, course: Course) -> dict[str, Any]:
    """What changes in a case and its state, for all methods."""
    memory = packed.body.find(HingeMemory)
    parts: dict[str, Any] = {"course": course}
    if memory is not None:
        parts["branches"] = memory.own
    if packed.system.turns:
        parts["folds"] = [packed.body.sheet.folds, packed.body.sheet.series()[1]]
    return parts


class _Place(NamedTuple):
    """Something that changes: an array or a record, in place, or a number of its owner."""

    name: str
    owner: Any
    field: str
    value: Any


def snapshot(parts: Mapping[str, Any]) -> dict[str, NDArray]:
    """Copy what changes in parts.

    Parameters
    ----------
    parts : mapping of str to ndarray, named tuple, list or object
        Arrays and records, also those within tuples and lists; of other objects their own arrays,
        tuples and numbers.

    Returns
    -------
    dict of str to ndarray
        What `restore` takes, by the names of the places.
    """
    kept = {}
    for place in _places(parts):
        if isinstance(place.value, np.void):
            kept[place.name] = np.array(
                [float(place.value[one]) for one in place.value.dtype.names or ()]
            )
        else:
            kept[place.name] = np.array(place.value)
    return kept


def restore(parts: Mapping[str, Any], kept: Mapping[str, NDArray]) -> None:
    """Put a snapshot of such parts back.

    Raises
    ------
    KeyError, ValueError
        It is one of other parts.
    """
    for name, owner, field, value in list(_places(parts)):
        then = kept[name]
        if isinstance(value, np.void):
            for one, number in zip(value.dtype.names or (), then.tolist(), strict=True):
                value[one] = number
        elif isinstance(value, np.ndarray):
            if value.shape != then.shape:
                raise ValueError(f"{name}: {then.shape} instead of {value.shape}")
            value[...] = then
        else:
            setattr(owner, field, type(value)(then[()]))


def _places(parts: Mapping[str, Any]) -> Iterator[_Place]:
    """Places in parts; an array that threads share is one."""
    seen: set[int] = set()
    for place in _all_places(parts):
        if isinstance(place.value, np.ndarray):
            if id(place.value) in seen:
                continue
            seen.add(id(place.value))
        yield place


def _all_places(parts: Mapping[str, Any]) -> Iterator[_Place]:
    for name, part in parts.items():
        if isinstance(part, tuple | list | np.ndarray | np.void):
            yield from _arrays(name, part)
            continue
        for field, value in vars(part).items():
            if isinstance(value, bool | int | float):
                yield _Place(f"{name}.{field}", part, field, value)
            elif field not in CONSTANT:
                yield from _arrays(f"{name}.{field}", value)


def _arrays(name: str, value: Any) -> Iterator[_Place]:
    """Arrays and records in a value."""
    if isinstance(value, np.void) or (isinstance(value, np.ndarray) and value.flags.writeable):
        yield _Place(name, None, "", value)
    elif isinstance(value, list):
        for k, one in enumerate(value):
            yield from _arrays(f"{name}[{k}]", one)
    elif isinstance(value, tuple):
        for field, one in zip(getattr(value, "_fields", ()), value, strict=False):
            if field not in CONSTANT:
                yield from _arrays(f"{name}.{field}", one)
