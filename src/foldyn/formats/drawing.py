"""`Drawing`: a crease pattern as read from a file, before repair and without derived panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.values import parsed, show

METERS = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
    "pt": 0.0254 / 72,
    "px": 0.0254 / 96,
}
"""Units of length in pattern files (m)."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """Lines with letters, as readers of all formats return them.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2) or (n, 3)
        Coordinates in the file's unit.
    edges : ndarray of int, shape (m, 2)
        Vertex numbers of each line.
    letters : tuple of str
        For each line "B", "M", "V", "F", "U", "C" (cut) or "J" (join), as in FOLD.
    fold_angles : ndarray, shape (m,)
        Angle (degrees, positive on valleys) to fold each line to; NaN if not given.
    faces : tuple of tuple of int, optional
        Panels; None if the file has only lines, from which panels are to be found.
    meters : float, optional
        Length of the file's unit (m); None if the file does not give it.
    assumed : float
        Length (m) assumed for the unit if neither the file nor the user gives it.
    unit : str
        Name of the format's unit, for messages: "px".
    name : str
        Title.
    places : tuple of str
        Where each line is in the file ("line 12", "path 3"), for messages; () if its number says
        so.
    repairs, assumptions, doubts : tuple of str
        What the reader repaired, assumed, and doubts, in words.
    families : mapping
        Names for groups of lines, each with pairs of vertex numbers.
    welds : sequence, optional
        Pairs of vertex numbers of lines across which the sheet is continuous, if the file states
        this for each of its flat lines.
    custom : mapping
        Further data, preserved.
    """

    vertices: NDArray[np.float64]
    edges: NDArray[np.int64]
    letters: tuple[str, ...]
    fold_angles: NDArray[np.float64]
    faces: tuple[tuple[int, ...], ...] | None = None
    meters: float | None = None
    assumed: float = 1.0
    unit: str = "unit"
    name: str = ""
    places: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    families: Mapping[str, Sequence[tuple[int, int]]] = field(default_factory=dict)
    welds: Sequence[tuple[int, int]] | None = None
    custom: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of_lines(
        cls, points: ArrayLike, letters: Sequence[str], fold_angles: ArrayLike = np.nan, **more: Any
    ) -> Self:
        """Drawing of lines that share no ends.

        Parameters
        ----------
        points : array_like, shape (2m, d)
            Both ends of each line in turn.
        letters : sequence of str, length m
        fold_angles : array_like, shape (m,), optional
            Degrees; by default none.
        **more
            Further fields.
        """
        count = len(letters)
        angles = np.array(np.broadcast_to(fold_angles, count), dtype=np.float64)
        ends = np.arange(2 * count).reshape(-1, 2)
        return cls(np.array(points), ends, tuple(letters), angles, **more)


def coordinate(text: str, place: str, given: str = "") -> float:
    """Parse a coordinate.

    Raises
    ------
    InputError
        It is not a finite number; the message names the place and shows the text.
    """
    try:
        value = parsed(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = show(given or text)
        raise InputError(f" = {shown}: coordinates must be finite numbers", place)
    return value
