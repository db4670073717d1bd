"""Mutations of TOML texts that stay TOML: values, keys and tables change."""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Sequence
from random import Random
from typing import Any

import tomli_w
from fuzz_mutations import INTEGERS, REALS, mutate

LATER = [2**100, -(10**400), 2.5, 1e50, 1e-50, -1e30, 1e-30, 3, 7, 60, 1000, 10**6, 10**9]
OTHERS: list[Any] = [True, "", "x" * 200, "xmin", "y>0", [], {}, [[]], [0, 0], [[0, 1], [2]], [{}]]
VALUES: list[Any] = [*INTEGERS, *REALS, *LATER, *OTHERS]


def mutator(words: Sequence[str]) -> Any:
    """Mutator of a format with these words: half of the mutations keep the text TOML."""

    def damaged(random: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
        if random.random() < 0.5:
            return mutate(random, data, seeds, words)
        document = tomllib.loads(data.decode())
        other = tomllib.loads(random.choice(seeds).decode())
        for _ in range(random.choice((1, 1, 1, 2, 3))):
            _change(random, document, other, words)
        return tomli_w.dumps(document).encode()

    return damaged


def _change(random: Random, document: Any, other: Any, words: Sequence[str]) -> None:
    places = _places(document)
    if not places:
        return
    inside, key = random.choice(places)
    old, kind = (
        inside[key],
        random.choice(("value", "value", "near", "key", "drop", "list", "other")),
    )
    if kind == "value":
        inside[key] = random.choice(VALUES)
    elif kind == "near" and isinstance(old, int | float) and math.isfinite(old):
        change = random.choice((-1, 0, 2, 10, 1000, 10**7, 0.5, 1e-12, 1e40))
        inside[key] = old * change if abs(old) < 1e300 else change
    elif kind == "key" and isinstance(inside, dict):
        inside[random.choice(words)] = inside.pop(key)
    elif kind == "drop":
        del inside[key]
    elif kind == "list":
        inside[key] = [old] * random.choice((0, 1, 2, 3, 500))
    else:
        taken = _places(other)
        where, which = random.choice(taken)
        inside[key] = copy.deepcopy(where[which])


def _places(value: Any) -> list[tuple[Any, Any]]:
    """All places of a document, as what is around each and the key there."""
    keys = list(value) if isinstance(value, dict) else range(len(value))
    found = [(value, key) for key in keys]
    for key in keys:
        if isinstance(value[key], dict | list):
            found += _places(value[key])
    return found
