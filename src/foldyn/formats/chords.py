"""Chords of curves, and the lines that readers collect from shapes, with letters and places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.formats.drawing import Drawing, count, without_length
from foldyn.formats.lines import MOST_LINES, too_many

CHORD = 1e-3
"""Distance of a curve from its chords, relative to the size of the drawing."""
MOST = 1000
"""Largest number of chords of one piece of a curve."""


def bezier(control: ArrayLike, tolerance: float) -> NDArray[np.float64]:
    """Points (k, 2) on a Bezier curve of degree 2 or 3, including the first and last.

    Chords of equal steps of the parameter depart from the curve by at most max|B''| h^2 / 8.
    """
    points = np.asarray(control, dtype=np.float64)
    degree = len(points) - 1
    bend = np.linalg.norm(np.diff(points, 2, axis=0), axis=1).max() * degree * (degree - 1)
    count = chords(math.sqrt(bend / (8 * tolerance)))
    from scipy.interpolate import BPoly  # slow to import

    return BPoly(points[:, None], [0.0, 1.0])(np.linspace(0.0, 1.0, count + 1))


def arc_chords(radius: float, sweep: float, tolerance: float) -> int:
    """Number of chords of an arc (rad); a chord departs by radius (1 - cos of its half angle)."""
    if tolerance >= radius:
        return max(1, math.ceil(abs(sweep) / (0.5 * math.pi) - 1e-9))
    return chords(abs(sweep) / (2 * math.acos(1 - tolerance / radius)))


def chords(count: float) -> int:
    """Round up to a number of chords, at most `MOST`."""
    return max(1, min(MOST, math.ceil(count - 1e-9))) if math.isfinite(count) else MOST


class Chords:
    """Collects the lines of shapes.

    Parameters
    ----------
    boxes : sequence of ndarray, shape (k, d)
        Points that bound each shape.

    Attributes
    ----------
    tolerance : float
        Largest distance of a curve from its chords.
    """

    def __init__(self, boxes: Sequence[NDArray[np.float64]]) -> None:
        self.tolerance = CHORD * float(np.linalg.norm(np.ptp(np.concatenate(boxes), axis=0)))
        self.letters: list[str] = []
        self._points: list[NDArray[np.float64]] = []
        self._places: list[str] = []
        self._has_length: dict[str, bool] = {}

    def add(self, along: NDArray[np.float64], letter: str, place: str) -> int:
        """Add the lines between successive points of a shape; return how many have a length."""
        pairs = np.stack((along[:-1], along[1:]), axis=1)
        pairs = pairs[(pairs[:, 0] != pairs[:, 1]).any(axis=1)]
        self._has_length[place] = self._has_length.get(place, False) or len(pairs) > 0
        self._points.append(pairs.reshape(-1, along.shape[1]))
        self._places += [place] * len(pairs)
        self.letters += [letter] * len(pairs)
        if len(self.letters) > MOST_LINES:
            raise too_many("the lines")
        return len(pairs)

    def drawing(
        self, curved: int, fold_angles: ArrayLike, repairs: Sequence[str], **more: Any
    ) -> Drawing:
        """Drawing of all lines, with further repairs and fields; `curved` counts the curves."""
        told = [f"{count(curved, 'curve')} drawn as chords, within {self.tolerance:.3g} units"]
        repairs = (*told[:curved], *without_length(self._has_length), *repairs)
        if not self.letters:
            raise InputError(
                ": all are points, or white; give a file with a crease pattern", "lines"
            )
        return Drawing.of_lines(
            np.concatenate(self._points), self.letters, fold_angles,
            places=tuple(self._places), repairs=repairs, **more,
        )  # fmt: skip
