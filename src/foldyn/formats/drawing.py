"""`Drawing`: a crease pattern as a file gives it, before it is repaired and has panels."""

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
"""Units of length that pattern files name (m)."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """Lines with letters; what readers of all formats give.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2) or (n, 3)
        Coordinates in the file's unit.
    edges : ndarray of int, shape (m, 2)
        Vertex numbers of each line.
    letters : tuple of str
        For each line "B", "M", "V", "F", "U", "C" (cut) or "J" (join), as FOLD has them.
    fold_angles : ndarray, shape (m,)
        Angle (degrees, positive on valleys) to fold each line to; NaN where none is given.
    faces : tuple of tuple of int, optional
        Panels; None where the file has lines alone and the panels are to be found from them.
    meters : float, optional
        Length of the file's unit (m); None where the file does not say it.
    assumed : float
        Length (m) to take the unit for where neither the file nor the user says it.
    unit : str
        What the format calls its unit, for messages: "px".
    name : str
        Title.
    places : tuple of str
        Where each line is in the file ("line 12", "path 3"), for messages; () where its number
        says it.
    repairs, assumptions, doubts : tuple of str
        What the reader put right, took for granted, and is not sure of, in words.
    families : mapping
        Names for groups of lines, each with pairs of vertex numbers.
    welds : sequence, optional
        Pairs of vertex numbers of the lines across which the sheet runs on, of a file that says
        it of each of its flat lines.
    custom : mapping
        Further data, kept.
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
        """Drawing of lines with ends of their own.

        Parameters
        ----------
        points : array_like, shape (2m, d)
            Both ends of each line in turn.
        letters : sequence of str, length m
        fold_angles : array_like, shape (m,), optional
            Degrees; without it none is given.
        **more
            Further fields.
        """
        count = len(letters)
        angles = np.array(np.broadcast_to(fold_angles, count), dtype=np.float64)
        ends = np.arange(2 * count).reshape(-1, 2)
        return cls(np.array(points), ends, tuple(letters), angles, **more)


def coordinate(text: str, place: str, given: str = "") -> float:
    """Coordinate that a text is.

    Raises
    ------
    InputError
        It is no finite number; the message names the place, and shows what is given there.
    """
    try:
        value = parsed(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = show(given or text)
        raise InputError(f" = {shown}: coordinates must be finite numbers", place)
    return value
