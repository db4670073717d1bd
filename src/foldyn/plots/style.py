"""Look of all figures: colors, fonts and frames, set on each figure only.

This module does not change matplotlib's global settings, so the caller's own figures are
unaffected. Fonts, colors and widths are set explicitly, so the caller's settings do not affect our
figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import NDArray

from foldyn.patterns.palette import (  # noqa: F401  figures take all colors from here
    BLACK,
    BLUE,
    CREASE_NAMES,
    CREASES,
    GRAY,
    GREEN,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    YELLOW,
)
from foldyn.values import of_kind

CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, BLACK, ORANGE, SKY, GRAY)
# Dashes change with the color, so that curves can be told apart in gray print.
DASHES = ("solid", (0, (6, 2)), (0, (2, 1.4)), (0, (7, 2, 1.5, 2)), (0, (4, 1.5)))

CREASE_DASHES = {"M": "solid", "V": (0, (5, 2)), "F": (0, (1, 1.5)), "U": (0, (5, 2, 1, 2))}
ACTUATED = YELLOW
SUPPORT = SPRING = GREEN
IMPOSED = ORANGE
IMPOSED_TEXT = "#8A5A00"  # orange dark enough for text
BASE = SKY
MASS = LINK = DASHPOT = GRAVITY = BLACK
WARM = VERMILLION
LOAD = PURPLE

DPI = 150
FAMILY = "DejaVu Sans"  # shipped with matplotlib: the same everywhere
TITLE, LABEL, TICK, NOTE = 10.5, 9.0, 8.0, 7.5
TEXT: dict[str, Any] = {"fontsize": LABEL, "color": BLACK}
# Look of labels, and of notes inside a frame.
FINE: dict[str, Any] = {"fontsize": NOTE, "color": BLACK}
LEGEND: dict[str, Any] = {"labelcolor": BLACK, "labelspacing": 0.5, "frameon": False}


def new_figure(width: float, height: float, title: str = "", constrained: bool = True) -> Figure:
    """Return an empty white figure on an Agg canvas.

    Parameters
    ----------
    width, height : float
        Size in inches.
    title : str
        Title of the figure; empty for none.
    constrained : bool
        Let matplotlib make room for labels and legends; False keeps axes in place.
    """
    layout = "constrained" if constrained else None
    white: Any = {"facecolor": "white", "edgecolor": "white"}
    figure = Figure(figsize=(width, height), dpi=DPI, layout=layout, **white)
    if not constrained:
        figure.set_layout_engine("none")  # overrides the caller's layout setting
    FigureCanvasAgg(figure)
    if of_kind("title", title, str):
        place = {} if constrained else {"y": 1.0 - 0.1 / height, "va": "top"}
        figure.suptitle(title, fontsize=TITLE, color=BLACK, **place)
    return figure


def frame(axes: Axes, xlabel: str = "", ylabel: str = "", title: str = "") -> None:
    """Give axes their labels, grid and colors."""
    axes.set_xlabel(xlabel, **TEXT)
    axes.set_ylabel(ylabel, **TEXT)
    if title:
        # A fixed height: otherwise a title moves above the exponent of the axis.
        axes.set_title(title, **TEXT, y=1.0, pad=4.0)
    axes.set_facecolor("white")
    axes.grid(True, color="#E4E4E4", linewidth=0.6, linestyle="solid")
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=TICK, color=GRAY, labelcolor=BLACK, direction="out")
    for side, spine in axes.spines.items():
        spine.set(visible=side in ("left", "bottom"), color=GRAY, linewidth=0.8)


def rows(
    size: tuple[float, float],
    title: str,
    xlabel: str,
    ylabels: Sequence[str],
    heights: Sequence[float] | None = None,
) -> tuple[Figure, NDArray]:
    """Return a figure with rows of axes; their common horizontal axis is labeled below the last.

    Parameters
    ----------
    size : tuple of float
        Width and height of the figure (inches).
    title, xlabel : str
    ylabels : sequence of str
        Title of the vertical axis of each row.
    heights : sequence of float, optional
        Heights of the rows relative to each other.
    """
    figure = new_figure(*size, title)
    grid = {"height_ratios": heights}
    axes = figure.subplots(len(ylabels), 1, squeeze=False, sharex=True, gridspec_kw=grid)[:, 0]
    for k, row in enumerate(axes):
        frame(row, xlabel if row is axes[-1] else "", ylabels[k])
    figure.align_ylabels(list(axes))
    return figure, axes


def single(
    size: tuple[float, float], title: str, xlabel: str, ylabel: str, heading: str = ""
) -> tuple[Figure, Axes]:
    """Return a figure of a size (inches) with one frame; see `new_figure` and `frame`."""
    figure = new_figure(*size, title)
    axes = figure.subplots()
    frame(axes, xlabel, ylabel, heading)
    return figure, axes


def color_bar(figure: Figure, drawn: ScalarMappable, label: str, **place: Any) -> None:
    """Add a color bar for drawn artists; its place is given as in `Figure.colorbar`."""
    bar = figure.colorbar(drawn, **place)
    bar.set_label(label, **TEXT)
    bar.ax.tick_params(labelsize=TICK, labelcolor=BLACK, color=GRAY)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]


def line_style(index: int) -> dict:
    """Return color, dashes and width of the curve number `index`."""
    dashes = DASHES[(index + index // len(CYCLE)) % len(DASHES)]
    return {"color": CYCLE[index % len(CYCLE)], "linestyle": dashes, "linewidth": 1.1}


def ring(color: str, size: float = 4.5) -> dict[str, Any]:
    """Return the look of a white dot with a colored outline."""
    dot = {"linestyle": "none", "marker": "o", "markersize": size}
    return {**dot, "markerfacecolor": "white", "markeredgecolor": color}


def key(label: str, **look: Any) -> Line2D:
    """Return a legend entry."""
    return Line2D([], [], label=label, **look)


def exponents(axes: Axes, ticks: int = 6, which: Literal["x", "y"] = "y") -> None:
    """Write small and large values along an axis with one common exponent."""
    small = -2 if which == "y" else -3
    axes.ticklabel_format(axis=which, scilimits=(small, 4), useMathText=True)
    side = axes.yaxis if which == "y" else axes.xaxis
    side.get_offset_text().set(fontsize=TICK, color=BLACK)
    axes.locator_params(axis=which, nbins=ticks)


def columns_that_fit(handles: Sequence, width: float, most: int) -> int:
    """Number of legend columns, at most `most`, that fit a width (inches) with the longest text."""
    labels = [str(handle.get_label()) for handle in handles]
    letter, handle, gap = 0.065, 0.38, 0.22  # inches, in the legend's font
    for columns in range(most, 1, -1):
        rows = -(-len(labels) // columns)
        filled = [labels[k : k + rows] for k in range(0, len(labels), rows)]
        longest = [max(len(label) for label in column) for column in filled]
        if sum(letter * n + handle + gap for n in longest) - gap <= width:
            return columns
    return 1


def legend_below(
    figure: Figure, handles: Sequence, columns: int = 3, width: float | None = None
) -> None:
    """Put one legend for the whole figure below its axes, where it hides no data.

    With a width (inches) the number of columns follows from `columns_that_fit`.
    """
    if width is not None:
        columns = columns_that_fit(handles, width, columns)
    rows = max(1, -(-len(handles) // columns))
    # only the layout engine can make room "outside"
    outside = isinstance(figure.get_layout_engine(), ConstrainedLayoutEngine)
    where = "outside lower center" if outside else "lower center"
    columns = max(1, -(-len(handles) // rows))  # fills the rows evenly
    look = {"fontsize": TICK, "handlelength": 2.6, **LEGEND}
    figure.legend(handles=list(handles), loc=where, ncols=columns, **look)


def finish(
    figure: Figure, handles: Sequence = (), columns: int = 3, width: float | None = None
) -> Figure:
    """Add the legend if it has entries, set all fonts, and return the figure."""
    if handles:
        legend_below(figure, handles, columns, width)
    for text in figure.findobj(Text):
        text.set(fontfamily=FAMILY, fontweight="normal")
    for axes in figure.axes:
        axes.tick_params(labelfontfamily=FAMILY)
    return figure
