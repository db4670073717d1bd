"""Charts of a page, which its reader can point into: curves as numbers, drawn by the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foldyn.errors import InputError

DIGITS = 5
"""Significant digits of the numbers in a page."""
MOST_POINTS = 2000
"""Points of a curve at most; of longer ones every k-th."""


@dataclass(frozen=True)
class Curve:
    """A curve of a chart.

    Parameters
    ----------
    name : str
        For the key below the chart.
    x, y : array_like, shape (m,)
        Places along the axes; a curve may turn back. What is not finite is left out.
    dots : bool
        Whether it is drawn as dots, as measured values are, and not as a line.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    dots: bool = False

    def __post_init__(self) -> None:
        """Check that both have one length."""
        if np.shape(self.x) != np.shape(self.y) or np.ndim(self.x) != 1:
            raise InputError(
                f"curve {self.name!r}: x {np.shape(self.x)} and y {np.shape(self.y)} must be lists "
                "of one length"
            )

    def about(self) -> dict[str, Any]:
        """What the page's script reads."""
        x, y = np.asarray(self.x, float), np.asarray(self.y, float)
        every = slice(None, None, -(-len(x) // MOST_POINTS) or 1)
        kept = (np.isfinite(x) & np.isfinite(y))[every]
        numbers = {name: _rounded(one[every][kept]) for name, one in (("x", x), ("y", y))}
        return {"name": self.name, "dots": self.dots, **numbers}


@dataclass(frozen=True)
class Chart:
    """Curves over their axes.

    Parameters
    ----------
    xlabel, ylabel : str
        Titles of the axes, with units.
    curves : sequence of Curve
    title : str
        Written above the chart.
    note : str
        Written below it.
    reach : float
        The vertical axis goes from -reach to reach; 0: as far as the curves do.
    """

    xlabel: str
    ylabel: str
    curves: Sequence[Curve]
    title: str = ""
    note: str = ""
    reach: float = 0.0

    def html(self) -> str:
        """Write as HTML; the page must have the script."""
        about = {
            "xlabel": self.xlabel, "ylabel": self.ylabel, "title": self.title, "reach": self.reach,
            "curves": [curve.about() for curve in self.curves],
        }  # fmt: skip
        title = f"<h3>{escape(self.title)}</h3>" if self.title else ""
        note = f"<p>{escape(self.note)}</p>" if self.note else ""
        text = json.dumps(about, separators=(",", ":"))
        return f'<div>{title}<div class="plot" data-plot="{escape(text)}"></div>{note}</div>'


@dataclass(frozen=True)
class Charts:
    """Charts beside each other, with a caption below them."""

    charts: Sequence[Chart]
    caption: str = ""

    def html(self) -> str:
        """Write as HTML; the page must have the script."""
        caption = f"<figcaption>{escape(self.caption)}</figcaption>" if self.caption else ""
        inside = "\n".join(chart.html() for chart in self.charts)
        return f'<figure><div class="plots">{inside}</div>{caption}</figure>'


def _rounded(values: np.ndarray) -> list[float]:
    """Numbers with as many digits as a reader sees."""
    return [float(f"{value:.{DIGITS}g}") for value in values.tolist()]
