"""`Drawing`: a crease pattern as read from a file, before repair and without derived panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, listed
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
        Letter of each line: "B", "M", "V", "F", "U", "C" (cut) or "J" (join), as in FOLD.
    fold_angles : ndarray, shape (m,)
        Angle (degrees, positive for valleys) to which each line folds; NaN if not given.
    faces : tuple of tuple of int, optional
        Panels; None if the file has only lines, from which panels are to be found.
    meters : float, optional
        Length of the file's unit (m); None if the file does not give it.
    assumed : float
        Length (m) assumed for the unit if neither the file nor the user gives it.
    unit : str
        Name of the format's unit for messages, such as "px".
    name : str
        Title.
    places : tuple of str
        Where each line is in the file, for messages, such as "line 12" or "path 3"; () if messages
        name lines by number.
    repairs, assumptions, doubts : tuple of str
        Sentences on what the reader repaired, assumed, and doubts.
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


def read_number(text: str, place: str, remedy: str) -> float:
    """Read a number of a file, or refuse it with a remedy."""
    try:
        return parsed(text)
    except ValueError:
        raise InputError(f" = {show(text)}: {remedy}", place) from None


def coordinate(text: str, place: str, given: str = "") -> float:
    """Parse a coordinate.

    Raises
    ------
    InputError
        The text is not a finite number; the message names the place and shows the text.
    """
    try:
        value = parsed(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = show(given or text)
        raise InputError(f" = {shown}: coordinates must be finite numbers", place)
    return value


_SHOWN = 3


def count(number: int, noun: str, plural: str = "") -> str:
    """Number with its noun, "1 line" or "2 lines"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def without_length(has_length: Mapping[str, bool]) -> list[str]:
    """Sentence on elements that shrink to points, say by a scale of 0, with their places."""
    places = [place for place, has in has_length.items() if not has]
    if not places:
        return []
    shown = ", ".join(places[:_SHOWN]) + (", ..." if len(places) > _SHOWN else "")
    return [f"left out {count(len(places), 'element')} of no length: {shown}"]


class Notes:
    """Collects the sentences of a diagnosis.

    Parameters
    ----------
    drawing : Drawing
        The drawing being built; its own notes come first.
    unit : float
        Length (m) of its unit; places are given in the file's coordinates.
    """

    def __init__(self, drawing: Drawing, unit: float) -> None:
        self.repairs, self.doubts = list(drawing.repairs), list(drawing.doubts)
        self._places, self._unit = drawing.places, unit

    def line(self, source: int) -> str:
        """Name of a drawn line."""
        return self._places[source] if self._places else f"line {source}"

    def point(self, point: NDArray) -> str:
        """Place of a point (m) in the file's coordinates."""
        return "(" + ", ".join(f"{x:.6g}" for x in (point / self._unit).tolist()) + ")"

    def lines(self, sources: Sequence[int], points: Sequence[NDArray] = ()) -> str:
        """Names and places of some lines."""
        names: dict[str, None] = {}
        for k, source in enumerate(sources):
            where = f" near {self.point(points[k])}" if len(points) else ""
            names.setdefault(self.line(int(source)) + where)
        return listed([*names], _SHOWN)

    def contradict(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Report pairs of coincident lines where one is a mountain and the other a valley."""
        if pairs:
            one, other = pairs[0]
            more = f" (and {len(pairs) - 1} more such pairs)" if len(pairs) > 1 else ""
            self.doubts.append(
                f"{self.line(one)} and {self.line(other)}{more} lie in one place, a mountain and a "
                "valley: the first is kept"
            )
