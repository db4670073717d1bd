"""Products of options of which `make test` runs a few."""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations, product
from typing import Any

import pytest


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
    beyond = pytest.mark.matrix
    return [pytest.param(*row, marks=() if i in few else beyond) for i, row in enumerate(rows)]
