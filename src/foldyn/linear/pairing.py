"""Pairing of the modes of two models.

Modes of nearly equal frequency mix at the slightest disturbance, so a cluster of them is compared
as a space: the mean squared cosine between two spaces replaces the MAC of each pair in them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.linear.mac import mac

NEAR = 3e-3  # relative distance of frequencies in a cluster
FREQUENCY_WEIGHT = 0.05  # of |log(f_b / f_a)|, added to 1 - MAC: decides between similar shapes


class Pair(NamedTuple):
    """Paired modes: their numbers from 0 and their MAC."""

    first: int
    second: int
    mac: float


def clusters(frequency: NDArray) -> NDArray:
    """Number (k,) of the cluster of each of increasing frequencies (k,)."""
    apart = np.diff(frequency) > NEAR * frequency[1:]
    return np.concatenate([[0], np.cumsum(apart)])


def likeness(fa: NDArray, a: NDArray, fb: NDArray, b: NDArray, mass: NDArray) -> NDArray:
    """MAC (ka, kb) of shapes (ka, n, 3) and (kb, n, 3), averaged over clusters."""
    values = np.nan_to_num(
        mac(a, b, mass=mass)
    )  # shapes that do not move these nodes are like none
    found = values.copy()
    left, right = clusters(fa), clusters(fb)
    for i in np.unique(left):
        for j in np.unique(right):
            rows, columns = np.flatnonzero(left == i), np.flatnonzero(right == j)
            if len(rows) > 1 or len(columns) > 1:
                block = np.ix_(rows, columns)
                found[block] = values[block].sum() / min(len(rows), len(columns))
    return np.minimum(found, 1.0)


def pairs(fa: NDArray, a: NDArray, fb: NDArray, b: NDArray, mass: NDArray) -> list[Pair]:
    """Pairs of modes, in the order of the first set.

    Parameters
    ----------
    fa, fb : (ka,), (kb,)
        Frequencies (Hz, increasing).
    a, b : (ka, n, 3), (kb, n, 3)
        Shapes.
    mass : (n,)
        Weights of the nodes.
    """
    from scipy.optimize import linear_sum_assignment

    if not len(fa) or not len(fb):
        return []
    alike = likeness(fa, a, fb, b, mass)
    cost = 1.0 - alike + FREQUENCY_WEIGHT * np.abs(np.log(fb[None, :] / fa[:, None]))
    first, second = linear_sum_assignment(cost)
    return [Pair(int(i), int(j), float(alike[i, j])) for i, j in zip(first, second, strict=True)]
