"""What any value of a case file or fit file may be, whatever its key."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from foldyn.cases.messages import dotted
from foldyn.errors import InputError
from foldyn.values import LARGEST, MOST, SMALLEST, show

DEEPEST = 12
"""Tables and lists within each other."""
Place = tuple[str | int, ...]


def check_values(document: Mapping[str, Any]) -> None:
    """Refuse numbers that cannot be computed with, and tables within tables without end.

    What is not finite is left to the checks of the keys, which know what is right there. Small
    numbers in lists are left alone: tables of a pulse have such tails.
    """
    for place, value in _values(document):
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        whole = isinstance(value, int)
        text = f"{dotted(place)} = {show(value)}"
        if whole and not -MOST - 1 <= value <= MOST:
            raise InputError(f"{text}: must be a whole number of at most 64 bits")
        if whole or not math.isfinite(value):
            continue
        if abs(value) > LARGEST:
            raise InputError(f"{text}: must be in size at most {LARGEST:g}")
        if 0.0 < abs(value) < SMALLEST and not isinstance(place[-1], int):
            raise InputError(f"{text}: must be 0 or in size at least {SMALLEST:g}")


def _values(document: Mapping[str, Any]) -> Iterator[tuple[Place, Any]]:
    """All that is no table or list, with its place."""
    waiting: list[tuple[Place, Any]] = [((key,), document[key]) for key in reversed(document)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping | list):
            if len(place) >= DEEPEST:
                raise InputError(f"{dotted(place[:3])}: has too many tables or lists in each other")
            inside = value.items() if isinstance(value, Mapping) else enumerate(value)
            waiting += reversed([((*place, key), item) for key, item in inside])
        else:
            yield place, value
