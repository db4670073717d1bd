"""Products of options of which `make test` runs a few."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable
from itertools import combinations, product
from typing import Any

import pytest

FEW = int(os.environ.get("DRAWS", "500")) < 500
"""Whether a part of the matrix is tried, as in CI."""


def beyond(rows: Iterable[Any], one_in: int = 8) -> list[Any]:
    """Rows of the matrix, or values of one parameter; with few draws one in so many of them."""
    chosen = [*rows][:: one_in if FEW else 1]
    return [
        pytest.param(*(row if isinstance(row, tuple) else (row,)), marks=pytest.mark.matrix)
        for row in chosen
    ]


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
