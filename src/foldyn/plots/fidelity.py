"""Models beside superelements or the shell: errors of frequencies, and MAC of shapes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from foldyn.errors import InputError
from foldyn.linear import Fidelity
from foldyn.linear.compared import against
from foldyn.linear.reference import LEAST
from foldyn.plots import style
from foldyn.plots.modes import hertz

NEAR = 0.05  # errors up to this share are shaded as small
MOST = 1.0  # larger relative errors are drawn at the edge
WIDE = 12.0  # largest ratio of frequencies on a linear axis
MARKERS = "os^DvPX<>*"


def plot_fidelity(fidelity: Fidelity, title: str = "") -> Figure:
    """Draw errors of frequencies, and MAC, of models against the frequency of the reference.

    Parameters
    ----------
    fidelity : Fidelity
        From `foldyn.fidelity`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Above, the error of each model for each mode, with 5 % shaded and errors beyond 100 % as
        arrows at the edge; below, the MAC, with the range of lost modes shaded. The dashed line
        marks 0.6 of the plate frequency, above which panels vibrate as plates.

    Raises
    ------
    InputError
        Not a comparison.
    """
    if not isinstance(fidelity, Fidelity):
        raise InputError("fidelity: give what foldyn.fidelity returns")
    result = fidelity.result
    frequency, error = result["frequency"].values, result["error"].values
    labels = ["error of the frequency (%)", "MAC"]
    xlabel = f"frequency of {against(result)} (Hz)"
    figure, (upper, lower) = style.rows((8.0, 5.6), title, xlabel, labels, heights=[1.6, 1.0])
    shown = np.append(error[np.isfinite(error)], [-2.0 * NEAR, 2.0 * NEAR]).clip(-MOST, MOST)
    bottom, top = 115.0 * shown.min(), 115.0 * shown.max()
    upper.axhspan(-100.0 * NEAR, 100.0 * NEAR, color="#EAF3EA", zorder=0.5)
    upper.axhline(0.0, color=style.GRAY, linewidth=0.8)
    lower.axhspan(-0.05, LEAST, color="#F3EDED", zorder=0.5)
    keys = []
    for k, model in enumerate(fidelity.models):
        look = {"color": style.CYCLE[k % len(style.CYCLE)], "marker": MARKERS[k % len(MARKERS)]}
        look |= {"markersize": 5.0, "markerfacecolor": "white", "markeredgewidth": 1.2}
        line = {"linewidth": 0.7, "linestyle": (0, (1, 2))}
        found = np.isfinite(error[:, k])
        inside = found & (np.abs(error[:, k]) <= MOST)
        upper.plot(frequency[inside], 100.0 * error[inside, k], **look, **line)
        beyond = found & ~inside
        arrow = look | {"marker": "$\\uparrow$", "markersize": 9.0, "linestyle": "none"}
        upper.plot(frequency[beyond], np.full(beyond.sum(), 107.0 * MOST), **arrow)
        lower.plot(frequency, result["mac"].values[:, k], **look, **line)
        keys.append(style.key("the case's own model" if model == "own" else model, **look, **line))
    upper.set_ylim(bottom, top)
    lower.set_ylim(-0.05, 1.05)
    lower.text(0.006, 0.06, "lost", transform=lower.transAxes, va="bottom", **style.FINE)
    _along(upper, lower, frequency, fidelity.limit)
    if fidelity.limit < upper.get_xlim()[1]:
        dashes = {"color": style.BLACK, "linewidth": 1.0, "linestyle": (0, (4, 2))}
        for axes in (upper, lower):
            axes.axvline(fidelity.limit, **dashes)
        keys.append(style.key(f"0.6 of the plate frequency, {hertz(fidelity.limit)} Hz", **dashes))
    return style.finish(figure, keys, columns=4, width=7.6)


def _along(upper: Axes, lower: Axes, frequency: np.ndarray, limit: float) -> None:
    """Set the frequency axis: from zero, or logarithmic for a wide range of frequencies."""
    low, high = float(frequency[0]), float(frequency[-1])
    if high > WIDE * low:
        for axes in (upper, lower):
            axes.set_xscale("log")
        upper.set_xlim(low / 1.15, high * 1.15)
        lower.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        lower.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        lower.xaxis.set_minor_locator(NullLocator())
        return
    reach = high if limit > 1.6 * high else max(high, limit)
    upper.set_xlim(0.0, 1.06 * reach)
