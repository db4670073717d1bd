"""Products of options of which `make test` runs a few."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from itertools import combinations, product
from typing import Any

import pytest

SHARE = 1 if int(os.environ.get("DRAWS", "500")) >= 500 else 8
"""With fewer draws, one in so many of the rows beyond pairs is tried."""


def beyond(rows: Sequence[tuple[Any, ...]]) -> list[Any]:
    """Rows of the matrix."""
    return [pytest.param(*row, marks=pytest.mark.matrix) for row in rows[::SHARE]]


def in_pairs(*options: Collection[Any]) -> list[Any]:
    """The whole product; what goes beyond each pair of values of two options is in the matrix."""
    rows = list(product(*map(list, options)))
    places = product(*(range(len(values)) for values in options))
    pairs = [{*combinations(enumerate(place), 2)} for place in places]
    left, few = set[Any]().union(*pairs), set[int]()
    while left:
        most = max(range(len(rows)), key=lambda i: len(pairs[i] & left))
        few.add(most)
        left -= pairs[most]
    rest = [row for i, row in enumerate(rows) if i not in few]
    return [pytest.param(*rows[i]) for i in sorted(few)] + beyond(rest)
