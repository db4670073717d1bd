"""Charts: curves with their axes, drawn both by figures for papers and by pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foldyn.errors import InputError

DIGITS = 5  # significant digits of the numbers in a page
MOST_POINTS = 2000  # largest number of points of a curve in a page; of more points only every k-th


@dataclass(frozen=True)
class Curve:
    """A curve of a chart.

    Parameters
    ----------
    name : str
        Name in the legend below the chart.
    x, y : array_like, shape (m,)
        Coordinates; x need not increase. Points that are not finite are left out.
    dots : bool
        Whether to draw dots, as for measured values, instead of a line.
    spread : array_like, optional
        Uncertainty of y: figures draw error bars at dots, or a band around a line.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    dots: bool = False
    spread: ArrayLike | None = None

    def __post_init__(self) -> None:
        """Check that x and y have one length."""
        if np.shape(self.x) != np.shape(self.y) or np.ndim(self.x) != 1:
            raise InputError(
                f"curve {self.name!r}: x {np.shape(self.x)} and y {np.shape(self.y)} must be lists "
                "of one length"
            )

    def about(self) -> dict[str, Any]:
        """Description for a page's script."""
        x, y = np.asarray(self.x, float), np.asarray(self.y, float)
        every = slice(None, None, -(-len(x) // MOST_POINTS) or 1)
        kept = (np.isfinite(x) & np.isfinite(y))[every]
        numbers = {name: _rounded(one[every][kept]) for name, one in (("x", x), ("y", y))}
        return {"name": self.name, "dots": self.dots, **numbers}


@dataclass(frozen=True)
class Chart:
    """Curves with their axes.

    Parameters
    ----------
    xlabel, ylabel : str
        Titles of the axes, with units.
    curves : sequence of Curve
    title : str
        Written above the chart.
    note : str
        Written below the chart.
    reach : float
        The vertical axis spans -reach to reach; with 0 it fits the curves.
    words : sequence of str
        Labels of the numbers 0, 1, 2, ... along the horizontal axis.
    zero : bool
        Whether a figure shows the line y = 0.
    by_ratio : bool
        Whether the horizontal axis of a figure is logarithmic.
    """

    xlabel: str
    ylabel: str
    curves: Sequence[Curve]
    title: str = ""
    note: str = ""
    reach: float = 0.0
    words: Sequence[str] = ()
    zero: bool = False
    by_ratio: bool = False

    def about(self) -> dict[str, Any]:
        """Description for a page's script."""
        return {
            "xlabel": self.xlabel, "ylabel": self.ylabel, "title": self.title,
            "reach": self.reach, "words": list(self.words),
            "curves": [curve.about() for curve in self.curves],
        }  # fmt: skip


def _rounded(values: np.ndarray) -> list[float]:
    """Round numbers to as many digits as a reader can see."""
    return [float(f"{value:.{DIGITS}g}") for value in values.tolist()]
