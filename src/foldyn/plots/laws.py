"""Constitutive curves of a structure's folds, bends and bars."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.shells import Shell
from foldyn.structures import Structure
from foldyn.structures.discretized import HingeKind

MOST_CURVES = 4
# A law may grow without bound towards 0 and 360 degrees: the height of the frame is taken from
# what lies between these.
_FRAMED = (20.0, 340.0)


def plot_laws(
    structure: Structure | Shell, stretch: tuple[float, float] = (0.8, 1.2), title: str = ""
) -> Figure:
    """Draw moment against dihedral of folds and bends, and stress against stretch of bars.

    A shell has folds alone. Hinges of equal stiffness and rest angle share a curve; of each kind
    at most four different curves are shown, those of the most hinges. A dot and a dotted line mark
    the rest angle.

    Parameters
    ----------
    structure : Structure or Shell
        Its laws, stiffnesses and rest angles are drawn as they are used, those of whole creases.
    stretch : tuple of float
        Range of the bars' stretch.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One axes per kind of element that the structure has, in the order fold, bend, bar.

    Raises
    ------
    InputError
        Where the stretches are not positive and increasing, or a shell has no folds.
    """
    low, high = stretch
    if not (0.0 < low < high < np.inf):
        raise InputError(f"stretch: {stretch!r}; give two positive, increasing stretches")
    kinds = [kind for kind in structure.hinge_kinds if len(kind.nodes)]
    bars = structure.bar_law
    if not kinds and bars is None:
        raise InputError("structure: is a shell without folds, which has no laws to draw")
    columns = len(kinds) + (bars is not None)
    figure = style.new_figure(3.5 * columns, 3.9, title)
    frames = figure.subplots(1, columns, squeeze=False)[0]
    for axes, kind in zip(frames, kinds, strict=False):
        _draw_hinges(axes, kind)
    if bars is not None:
        _draw_bar(frames[-1], bars, structure.sheet.youngs_modulus, low, high)
    return style.finish(figure)


def _draw_hinges(axes: Axes, hinges: HingeKind) -> None:
    """Draw the moment curves of one kind of hinge."""
    kind, stiffness, rest = hinges.name, hinges.stiffness, hinges.rest
    style.frame(axes, "dihedral (degrees)", "moment (N m)", f"{kind}s: {hinges.law.name}")
    degrees = np.linspace(1.0, 359.0, 1433)
    framed = (degrees >= _FRAMED[0]) & (degrees <= _FRAMED[1])
    groups = _distinct(stiffness, rest)
    reach = 0.0
    for index, (first, count) in enumerate(groups[:MOST_CURVES]):
        k, theta0, law = float(stiffness[first]), float(rest[first]), hinges.law_of(first)
        moment = k * np.asarray(law.moment(np.radians(degrees), theta0))
        look = style.line_style(index)
        j, m = hinges.nodes[first][:2]
        label = f"{kind} {j}-{m}"
        label += f" and {count - 1} more" if count > 1 else ""
        angle = float(np.degrees(theta0))
        label += f": k {k:.4g} N m/rad, rest {angle:.4g}°"
        axes.plot(degrees, moment, label=label, **look)
        at_rest = k * float(law.moment(theta0, theta0))
        axes.plot([angle], [at_rest], "o", color=look["color"], markersize=5, zorder=4)
        axes.axvline(angle, color=look["color"], linewidth=0.8, linestyle=":", zorder=1)
        reach = max(reach, float(np.abs(moment[framed]).max()))
    axes.set_xlim(0.0, 360.0)
    axes.set_xticks(np.arange(0, 361, 60))
    if reach > 0.0:
        axes.set_ylim(-1.08 * reach, 1.08 * reach)
    axes.axhline(0.0, color=style.GRAY, linewidth=0.8, zorder=1)
    style.exponents(axes)
    hidden = len(groups) - MOST_CURVES
    _legend_below(axes, f"{hidden} other pairs of k and rest not shown" if hidden > 0 else "")


def _draw_bar(axes: Axes, law: Any, modulus: float, low: float, high: float) -> None:
    """Draw the stress of the bars' law."""
    style.frame(axes, "stretch (-)", "second Piola-Kirchhoff stress (Pa)", f"bars: {law.name}")
    stretch = np.linspace(low, high, 401)
    stress = modulus * np.asarray(law.stress(stretch))
    axes.plot(stretch, stress, label=f"bar: E {modulus:.4g} Pa", **style.line_style(0))
    axes.plot([1.0], [0.0], "o", color=style.CYCLE[0], markersize=5, zorder=4)
    axes.axhline(0.0, color=style.GRAY, linewidth=0.8, zorder=1)
    axes.set_xlim(low, high)
    axes.locator_params(axis="x", nbins=5)
    style.exponents(axes)
    _legend_below(axes, "")


def _legend_below(axes: Axes, note: str) -> None:
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(-0.2, -0.19),
        borderaxespad=0.0,
        frameon=False,
        labelcolor=style.BLACK,
        labelspacing=0.5,
        fontsize=style.NOTE,
        handlelength=2.2,
        title=note or None,
        title_fontsize=style.NOTE,
    )


def _distinct(stiffness: np.ndarray, rest: np.ndarray) -> list[tuple[int, int]]:
    """Return (first index, count) of hinges with equal stiffness and rest, most frequent first."""
    looks = [f"{k:.6e} {theta0:.6f}" for k, theta0 in zip(stiffness, rest, strict=True)]
    first = {look: k for k, look in reversed(list(enumerate(looks)))}
    return [(first[look], count) for look, count in Counter(looks).most_common()]
