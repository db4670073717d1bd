"""What any value of a case file or fit file may be, whatever its key."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from foldyn.analyses.messages import dotted
from foldyn.errors import InputError
from foldyn.values import LARGEST, MOST, SMALLEST, show

Place = tuple[str | int, ...]


def check_values(document: Mapping[str, Any]) -> None:
    """Refuse numbers that cannot be computed with.

    What is not finite is left to the checks of the keys, which know what is right there. Small
    numbers in lists are left alone: tables of a pulse have such tails.
    """
    for place, value in _values(document):
        words = ""
        if isinstance(value, int) and not -MOST - 1 <= value <= MOST:
            words = "a whole number of at most 64 bits"
        elif isinstance(value, float) and LARGEST < abs(value) < math.inf:
            words = f"in size at most {LARGEST:g}"
        elif isinstance(value, float) and 0.0 < abs(value) < SMALLEST:
            words = "" if isinstance(place[-1], int) else f"0 or in size at least {SMALLEST:g}"
        if words:
            raise InputError(f"{dotted(place)} = {show(value)}: must be {words}")


def _values(document: Mapping[str, Any]) -> Iterator[tuple[Place, Any]]:
    """All that is no table or list, with its place."""
    waiting: list[tuple[Place, Any]] = [((), document)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping | list):
            inside = value.items() if isinstance(value, Mapping) else enumerate(value)
            waiting += reversed([((*place, key), item) for key, item in inside])
        else:
            yield place, value
