"""Vectors of a case with their histories."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.history import History, as_history
from foldyn.structures.discretized import read_only

Terms = tuple[tuple[NDArray[np.float64], History], ...]
Summands = Iterable[tuple[NDArray[np.float64], Any]]


def union(numbers: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Numbers that are among any of some, increasing."""
    return np.unique(np.concatenate([np.zeros(0, np.int64), *numbers]))


def summed(parts: Summands) -> Terms:
    """Vectors with their histories, those with equal histories added."""
    terms: list[tuple[NDArray[np.float64], History]] = []
    for vector, given in parts:
        history = as_history(given)
        same = next((total for total, other in terms if other == history), None)
        if same is None:
            terms.append((vector, history))
        else:
            same += vector
    return tuple((read_only(vector), history) for vector, history in terms)
