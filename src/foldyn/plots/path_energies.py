"""Strain energies along a path: stacked, and as shares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.along import along, asked, check_path, way
from foldyn.plots.strain import PARTS, stacked

_NONE = 1e-9  # of the largest energy: below it there is nothing to share


def energy_shares(path: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Shares of its parts in the strain energy of each point; NaN where there is none.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.

    Returns
    -------
    dict of str to ndarray, shape (steps,)
        "bars", "bends" and "folds", or of a shell "membrane", "bending" and "folds", each from 0
        to 1.
    """
    check_path(path, "path")
    energies = {PARTS[part][0]: path[part].values for part in stacked(path)}
    total = np.asarray(sum(energies.values()))
    total = np.where(total > _NONE * max(float(total.max(initial=0.0)), 0.0), total, np.nan)
    return {label: energy / total for label, energy in energies.items()}


def plot_path_energies(
    path: xr.Dataset,
    nodes: Sequence[int] | None = None,
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the parts of the strain energy along a path, stacked: see `energy_shares`.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.
    nodes : sequence of int, optional
        Nodes whose mean displacement is the horizontal axis, if it only grows along the path.
        Without them it is the load factor or, where this turns, the mean distance that the nodes
        have traveled.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of that displacement; by default that in which the nodes move farthest.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: the energies (J) and, as a line, the work that was done on the structure; the
        shares of the energies.

    Raises
    ------
    InputError
        Not a path, a node that it does not have, another direction.
    """
    check_path(path, "path")
    x, name = _abscissa(path, nodes, direction)
    figure = style.new_figure(7.0, 5.0, title)
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.8, 1.0]})
    style.frame(upper, "", "strain energy (J)")
    style.frame(lower, name, "share")
    layers = [path[part].values for part in stacked(path)]
    labels, colors = zip(*(PARTS[part] for part in stacked(path)), strict=True)
    handles: list = list(upper.stackplot(x, layers, labels=labels, colors=colors, alpha=0.75))
    work = float(sum(layer[0] for layer in layers)) + path["work"].values
    (line,) = upper.plot(
        x, work, color=style.BLACK, linewidth=1.2, linestyle=style.DASHES[1],
        label="at the start + work done",
    )  # fmt: skip
    shares = [share for share in energy_shares(path).values()]
    lower.stackplot(x, shares, colors=colors, alpha=0.75)
    lower.set_ylim(0.0, 1.0)
    lower.yaxis.set_major_formatter(PercentFormatter(1.0))
    for axes in (upper, lower):
        axes.margins(x=0.0)
        axes.set_axisbelow(False)  # the grid must show through the areas
    style.exponents(upper)
    style.legend_below(figure, [*reversed(handles), line], columns=4)
    figure.align_ylabels()
    return style.finish(figure)


def _abscissa(
    path: xr.Dataset, nodes: Sequence[int] | None, direction: str | None
) -> tuple[NDArray[np.float64], str]:
    """Return a quantity that only grows along the path, and its name."""
    if nodes is not None:
        numbers, direction = asked({"path": path}, nodes, direction)
        moved = along(path, numbers, direction)
        if not (np.diff(moved) > 0.0).all():
            raise InputError(
                f"nodes: their displacement along {direction} does not grow all along the path; "
                "leave them out"
            )
        return moved, f"displacement along {direction} (m)"
    factor = path["load_factor"].values
    if (np.diff(factor) > 0.0).all():
        return factor, "load factor"
    return way(path), "mean distance traveled by the nodes (m)"
