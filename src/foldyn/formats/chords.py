"""Lines that readers collect from shapes: with letters and places; curves become chords."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.formats.curves import CHORD
from foldyn.formats.drawing import Drawing
from foldyn.formats.lines import MOST_LINES, too_many
from foldyn.formats.notes import count, without_length


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
        """Drawing of all lines, of which some were curves, with further repairs and fields."""
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
