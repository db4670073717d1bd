"""Lines between numbered points: one per place, none of zero length, not too many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError

MOST_LINES = 50_000
"""Largest number of lines of a drawing, and of their pieces after splitting."""
MOST_PAIRS = 4_000_000
"""Largest number of pairs of lines that are near each other."""
_RANKS = {letter: rank for rank, letter in enumerate("CMVUFJB")}


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines between numbered points.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Coordinates.
    ends : ndarray of int, shape (m, 2)
        Point numbers of each line.
    letters : ndarray of str, shape (m,)
        As in a `Drawing`.
    angles : ndarray, shape (m,)
        Fold angles (degrees), NaN if not given.
    source : ndarray of int, shape (m,)
        Number of the drawn line from which each line comes.
    """

    points: NDArray[np.float64]
    ends: NDArray[np.int64]
    letters: NDArray[np.str_]
    angles: NDArray[np.float64]
    source: NDArray[np.int64]

    def taken(self, rows: NDArray) -> Lines:
        """Select lines by number or mask."""
        return Lines(
            self.points, self.ends[rows], self.letters[rows], self.angles[rows], self.source[rows]
        )

    @property
    def size(self) -> float:
        """Diagonal of the box around all points."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Length of each line (m,)."""
        return np.linalg.norm(self.points[self.ends[:, 1]] - self.points[self.ends[:, 0]], axis=1)


def without_points(lines: Lines) -> Lines:
    """Remove lines of zero length."""
    return lines.taken(lines.ends[:, 0] != lines.ends[:, 1])


def single(lines: Lines) -> tuple[Lines, list[tuple[int, int]]]:
    """One line per place; cuts take precedence over folds, folds over the outline.

    Returns
    -------
    lines : Lines
        No two lines between the same points.
    contradictions : list of (int, int)
        Pairs of coincident drawn lines, one a mountain, the other a valley; the first drawn is
        kept.
    """
    ranks = np.array([_RANKS[letter] for letter in lines.letters.tolist()], int)
    ranks = np.where(ranks == _RANKS["V"], _RANKS["M"], ranks)  # the first drawn line of each place
    low, high = lines.ends.min(axis=1), lines.ends.max(axis=1)
    order = np.lexsort((lines.source, ranks, high, low))
    pairs = np.column_stack((low, high))[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    first = order[np.flatnonzero(new)[np.cumsum(new) - 1]] if len(order) else order
    letters = lines.letters
    against = (letters[order] != letters[first]) & np.isin(letters[order], ("M", "V"))
    against &= np.isin(letters[first], ("M", "V"))
    found = zip(lines.source[first[against]], lines.source[order[against]], strict=True)
    return lines.taken(np.sort(order[new])), sorted({(int(a), int(b)) for a, b in found})


def too_many(what: str) -> InputError:
    """Error for a drawing that is too large to split."""
    return InputError(
        f": {what} are too many (at most {MOST_LINES} lines and pieces of lines, and "
        f"{MOST_PAIRS} pairs of lines near each other); read a part of the pattern",
        "lines",
    )
