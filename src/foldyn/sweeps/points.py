"""The points of a sweep: a grid, or samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses.ranges import SAMPLINGS, Value, Varied
from foldyn.errors import InputError

LATIN, SOBOL, SALTELLI = SAMPLINGS
GRID = "grid"
MOST_POINTS = 1_000_000
"""Most points of a sweep; a larger number is a typing error."""
MOST_SOBOL = 21201
"""Largest number of dimensions of SciPy's Sobol sequence."""

Point = tuple[Value, ...]


def grid(varied: Sequence[Varied]) -> list[Point]:
    """All combinations of values; the last key varies fastest."""
    _check_count(math.prod(len(one.values) for one in varied))
    return list(product(*(one.values for one in varied)))


def samples(varied: Sequence[Varied], count: int, method: str, seed: int) -> list[Point]:
    """Draw sample points.

    Parameters
    ----------
    varied : sequence of Varied
        Keys with one value keep this value at all points and add no dimension.
    count : int
        Number of points. With "saltelli" it is the number of points in each sample of a design for
        Sobol indices. The design has two independent samples, and for each key a copy of the first
        sample that takes this key from the second (Saltelli et al., Comput. Phys. Commun. 181,
        2010).
    method : {"latin_hypercube", "sobol", "saltelli"}
    seed : int

    Raises
    ------
    InputError
        The count is not a power of 2 although a Sobol sequence needs it, or too large.
    """
    free = [one.key for one in varied if len(one.values) != 1]
    d = max(len(free), 1)
    _check_count(count * (d + 2) if method == SALTELLI else count)
    share = _shares(d, count, method, seed)
    still = np.zeros(len(share))
    values = [one.at(share[:, free.index(one.key)] if one.key in free else still) for one in varied]
    return list(zip(*values, strict=True))


def _shares(d: int, count: int, method: str, seed: int) -> NDArray[np.float64]:
    """Sample points in the unit cube, shape (points, d)."""
    from scipy.stats import qmc

    drawn = np.random.default_rng(seed)
    if method == LATIN:
        return qmc.LatinHypercube(d, seed=drawn).random(count)
    if count & (count - 1):
        near = 2 ** round(math.log2(count))
        raise InputError(
            f" = {count}: a Sobol sequence is balanced only for a power of 2; take {near}",
            "samples",
        )
    size = 2 * d if method == SALTELLI else d
    if size > MOST_SOBOL:
        raise InputError(f": {d} keys are too many for a Sobol sequence", "vary")
    share = qmc.Sobol(size, seed=drawn).random(count)
    if method == SOBOL:
        return share
    one, other = share[:, :d], share[:, d:]
    mixed = [np.where(np.arange(d) == k, other, one) for k in range(d)]
    return np.vstack([one, other, *mixed])


def _check_count(count: int) -> None:
    if count > MOST_POINTS:
        raise InputError(
            f": {count} points; give at most {MOST_POINTS}, fewer values or samples", "vary"
        )
