"""The energy landscape of a path: energy and force against the stroke, and force-free states."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.statics import Landscape
from foldyn.values import show

_FALLS = "#F3E4D8"
# Looks of stable and of unstable states.
_MARKS: dict[bool, dict[str, Any]] = {
    True: {"marker": "o", "markersize": 6.0, "color": style.BLACK, "linestyle": "none"},
    False: {**style.ring(style.BLACK, 6.0), "color": style.BLACK, "linestyle": "none"},
}


def plot_landscape(landscape: Landscape, title: str = "") -> Figure:
    """Draw energy and force of a path against its stroke, with the force-free states.

    Stable states are dots, unstable states (the tops of barriers) rings. Ranges of the stroke in
    which the force falls (negative stiffness) are shaded.

    Parameters
    ----------
    landscape : Landscape
        From `foldyn.landscape`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: above the energy (J), with the barriers between neighboring stable states; below
        the force (N).

    Raises
    ------
    InputError
        Not a landscape.

    Examples
    --------
    >>> path = fd.read_case(fd.studies.find_case("gallery/kresling")).run()  # doctest: +SKIP
    >>> figure = fd.plots.plot_landscape(fd.landscape(path))  # doctest: +SKIP
    """
    if not isinstance(landscape, Landscape):
        raise InputError(f" = {show(landscape)}: give what fd.landscape returns", "landscape")
    names = ["energy (J)", "force (N)"]
    figure, (upper, lower) = style.rows((7.0, 5.0), title, "stroke (m)", names, heights=[1.4, 1.0])
    stroke, force, energy = with_states(landscape)
    for axes, values in ((upper, energy), (lower, force)):
        axes.plot(stroke, values, color=style.BLUE, linewidth=1.4)
        style.exponents(axes)
        for start, end in landscape.negative_stiffness:
            axes.axvspan(start, end, color=_FALLS, zorder=0.5)
    lower.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    keys: list[Any] = []
    for stable, look in _MARKS.items():
        chosen = [state for state in landscape.states if state.stable == stable]
        at = [state.stroke for state in chosen]
        upper.plot(at, [state.energy for state in chosen], **look, zorder=4.0)
        lower.plot(at, np.zeros(len(at)), **look, zorder=4.0)
        keys += [style.key(f"{'stable' if stable else 'unstable'} state", **look)] if at else []
    if landscape.negative_stiffness:
        keys.append(Patch(facecolor=_FALLS, label="negative stiffness"))
    upper.set_title(barriers(landscape), **style.FINE, loc="right", y=1.0, pad=4.0)
    lower.margins(x=0.02)
    return style.finish(figure, keys)


def with_states(landscape: Landscape) -> tuple[NDArray, NDArray, NDArray]:
    """Stroke (m), force (N) and energy (J) at the points of the path and at force-free states."""
    columns = np.stack([landscape.stroke, landscape.force, landscape.energy], axis=1)
    force = landscape.force
    between = np.flatnonzero(force[:-1] * force[1:] < 0.0)
    after = np.sort([*between + 1, *np.flatnonzero(force == 0.0)])  # index of each state, in order
    rows = [[state.stroke, 0.0, state.energy] for state in landscape.states]
    kept = [row for row, place in zip(rows, after, strict=True) if force[place] != 0.0]
    return tuple(np.insert(columns, between + 1, np.reshape(kept, (-1, 3)), axis=0).T)


def barriers(landscape: Landscape) -> str:
    """Barriers between neighboring stable states, in words; "" if there are none."""
    count = len(landscape.stable)
    texts = [f"{landscape.barrier(a, b):.3g} J there, {landscape.barrier(b, a):.3g} J back"
             for a, b in pairwise(range(count))]  # fmt: skip
    return f"barrier{'s' if count > 2 else ''}: {'; '.join(texts)}" if texts else ""
