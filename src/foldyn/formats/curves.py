"""Curves as chords."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

CHORD = 1e-3
"""Distance of a curve from its chords, relative to the size of the drawing."""
MOST = 1000
"""Most chords of one piece of a curve."""


def bezier(control: ArrayLike, tolerance: float) -> NDArray[np.float64]:
    """Points (k, 2) on a Bezier curve of degree 2 or 3, including the first and last.

    Chords of equal steps of the parameter depart from the curve by at most max|B''| h^2 / 8.
    """
    points = np.asarray(control, dtype=np.float64)
    degree = len(points) - 1
    bend = np.linalg.norm(np.diff(points, 2, axis=0), axis=1).max() * degree * (degree - 1)
    count = chords(math.sqrt(bend / (8 * tolerance)))
    t = np.linspace(0.0, 1.0, count + 1)[:, None]
    level: Sequence[NDArray] = list(points)
    while len(level) > 1:
        level = [(1 - t) * a + t * b for a, b in pairwise(level)]
    return np.broadcast_to(level[0], (count + 1, 2))


def arc_chords(radius: float, sweep: float, tolerance: float) -> int:
    """Number of chords of an arc (rad), each departing by radius (1 - cos of half its angle)."""
    if tolerance >= radius:
        return max(1, math.ceil(abs(sweep) / (0.5 * math.pi) - 1e-9))
    return chords(abs(sweep) / (2 * math.acos(1 - tolerance / radius)))


def chords(count: float) -> int:
    """Round up to a number of chords, at most `MOST`."""
    return max(1, min(MOST, math.ceil(count - 1e-9))) if math.isfinite(count) else MOST
