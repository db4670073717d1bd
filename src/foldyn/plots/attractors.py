"""Long motions: jumps of sweeps, bifurcation diagrams, Poincare sections, basins, exponents."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.readings import alone, check_nodes_of
from foldyn.results.sweep_dataset import label
from foldyn.values import choice

# Looks of both sweep directions.
_WAYS: dict[str, dict[str, Any]] = {
    "up": {"color": style.BLUE, "linestyle": style.DASHES[0]},
    "down": {"color": style.VERMILLION, "linestyle": style.DASHES[1]},
}
_MOST = 8  # largest number of attractors named in the legend
_PALE = 0.55  # share of white in the color of a basin


def plot_amplitudes(result: xr.Dataset, title: str = "") -> Figure:
    """Draw the amplitude against the frequency or the level of the drive, with its jumps.

    Parameters
    ----------
    result : xarray.Dataset
        From `foldyn.bifurcation_diagram` or `foldyn.swept_sine`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A curve for each sweep. A jump is a vertical line from the amplitude before to the amplitude
        after it, with an arrow and its frequency or level.

    Raises
    ------
    InputError
        Another result.
    """
    _check("result", result, "bifurcation_diagram", "swept_sine")
    along = _along(result)
    labels = label(result[along]), label(result["amplitude"])
    figure, axes = style.single((7.0, 4.0), title, *labels)
    keys = []
    for way in result["sweep"].values:
        one = result.sel(sweep=way)
        dots = {"marker": ".", "markersize": 4.0} if one["amplitude"].size <= 100 else {}
        axes.plot(*_with_jumps(one, along, str(way)), linewidth=1.1, **_WAYS[way], **dots)
        keys.append(style.key(f"sweep {way}", **_WAYS[way]))
    for k in range(result.sizes["jump"]):
        jump = result.isel(jump=k)
        place, (before, after) = float(jump["jump_between"].mean()), jump["jump_amplitude"].values
        color = _WAYS[str(jump["jump_sweep"].values)]["color"]
        arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (place, after), (place, before), arrowprops=arrow)
        side = {"xytext": (4.0, 0.0), "textcoords": "offset points", "va": "center"}
        axes.annotate(f"{place:.4g}", (place, 0.5 * (before + after)), **style.FINE | side)
    style.exponents(axes)
    return style.finish(figure, keys)


def plot_bifurcation_diagram(diagram: xr.Dataset, title: str = "") -> Figure:
    """Draw a measure, taken once per period, against the frequency or the level of the drive.

    Parameters
    ----------
    diagram : xarray.Dataset
        From `foldyn.bifurcation_diagram`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Dots, in the color of their sweep: one for a motion with the drive's period, two after a
        period doubling, a cloud for chaos.

    Raises
    ------
    InputError
        Another result.
    """
    _check("diagram", diagram, "bifurcation_diagram")
    along = _along(diagram)
    labels = label(diagram[along]), label(diagram["section"])
    figure, axes = style.single((7.0, 4.2), title, *labels)
    keys = []
    for way in diagram["sweep"].values:
        section = diagram["section"].sel(sweep=way).transpose(along, "record").values
        x = np.repeat(diagram[along].values, section.shape[1])
        look = {"color": _WAYS[way]["color"], "linestyle": "none", "marker": "."}
        axes.plot(x, section.ravel(), markersize=1.6, rasterized=True, **look)
        keys.append(style.key(f"sweep {way}", **look))
    style.exponents(axes)
    return style.finish(figure, keys)


def plot_poincare_section(
    section: xr.Dataset, node: int | str, *, axis: str, title: str = ""
) -> Figure:
    """Draw the velocity of a node against its displacement at the points of a section.

    Parameters
    ----------
    section : xarray.Dataset
        From `foldyn.poincare_section`.
    node : int or str
        Node number, or a selection of one vertex.
    axis : {"x", "y", "z"}
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A dot for each state.

    Raises
    ------
    InputError
        The result is of another kind, or has no such node or axis.
    """
    _check("section", section, "poincare_section")
    choice("axis", axis, AXES)
    (number,) = check_nodes_of({"": section}, node)[:1]
    here = section.sel(node=number, axis=axis)
    of = f"of node {number} along {axis}"
    labels = f"displacement {of} (m)", f"velocity {of} (m/s)"
    figure, axes = style.single((5.2, 4.6), title, *labels)
    count = section.sizes["time"]
    size = 6.0 if count < 50 else 2.2 if count < 3000 else 1.2
    look = {"linestyle": "none", "marker": ".", "markersize": size, "color": style.BLUE}
    axes.plot(here["displacement"].values, here["velocity"].values, rasterized=True, **look)
    style.exponents(axes)
    style.exponents(axes, which="x")
    return style.finish(figure)


def plot_basins(
    basins: xr.Dataset, x: str | None = None, *, y: str | None = None, title: str = ""
) -> Figure:
    """Draw the basins of attraction in the plane of two parameters of a grid.

    Parameters
    ----------
    basins : xarray.Dataset
        From `foldyn.basins` over a grid of two parameters.
    x, y : str, optional
        Parameters along the two axes, by default in the order of the result.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A color for each attractor, gray where motions do not repeat.

    Raises
    ------
    InputError
        The result is of another kind, has not exactly two parameters, or lacks the parameter.
    """
    _check("basins", basins, "basins")
    names = [str(name) for name in basins["basin"].dims]
    if len(names) != 2:
        raise InputError(f": a grid of {len(names)} parameters; choose two with isel", "basins")
    across = names[0] if x is None else choice("x", x, names)
    rest = [name for name in names if name != across]
    upward = rest[0] if y is None else choice("y", y, rest)
    labels = basins["basin"].transpose(upward, across).values
    figure, axes = style.single((6.2, 4.8), title, label(basins[across]), label(basins[upward]))
    axes.grid(False)
    colors = [style.GRAY, *(_pale(k) for k in range(basins.sizes["attractor"]))]
    axes.pcolormesh(
        basins[across].values, basins[upward].values, labels + 0.5, cmap=ListedColormap(colors),
        vmin=-1.0, vmax=len(colors) - 1.0, shading="nearest", rasterized=True,
    )  # fmt: skip
    keys = [
        Patch(facecolor=colors[k + 1], label=f"attractor {k}{_periods(basins, k)}")
        for k in range(min(_MOST, basins.sizes["attractor"]))
    ]
    if (labels < 0).any():
        keys.append(Patch(facecolor=style.GRAY, label="does not repeat"))
    return style.finish(figure, keys)


def plot_lyapunov_exponent(found: xr.Dataset, title: str = "") -> Figure:
    """Draw how the estimate of a largest Lyapunov exponent converges.

    Parameters
    ----------
    found : xarray.Dataset
        From `foldyn.lyapunov_exponent`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Running mean over time, and a band of two standard errors about its last value.

    Raises
    ------
    InputError
        Another result.
    """
    _check("found", found, "lyapunov_exponent")
    figure, axes = style.single((7.0, 3.6), title, "time (s)", "largest Lyapunov exponent (1/s)")
    last, error = float(found["exponent"]), float(found["error"])
    axes.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    axes.axhspan(last - 2.0 * error, last + 2.0 * error, color=style.SKY, alpha=0.35, linewidth=0)
    axes.plot(found["time"].values, found["estimate"].values, color=style.BLUE, linewidth=1.2)
    axes.set_title(f"{last:.4g} ± {error:.2g} 1/s", **style.FINE, loc="right", y=1.0, pad=4.0)
    return style.finish(figure)


def _with_jumps(one: xr.Dataset, along: str, way: str) -> tuple[NDArray, NDArray]:
    """Curve of amplitudes; for a stepped sine it is broken at its jumps."""
    x = np.broadcast_to(one[along].values, one["amplitude"].shape)
    y = one["amplitude"].values
    if one.attrs["foldyn_result"] != "bifurcation_diagram":
        return x, y
    for k in np.flatnonzero(one["jump_sweep"].values == way):
        between, sizes = one["jump_between"].values[k], one["jump_amplitude"].values[k]
        order = slice(None, None, 1 if between[0] < between[1] else -1)
        (low, high), (left, right) = between[order], sizes[order]
        at = int(np.searchsorted(x, low))
        x = np.insert(x, at, [low, low, high])
        y = np.insert(y, at, [left, np.nan, right])
    return x, y


def _check(field: str, result: xr.Dataset, *kinds: str) -> None:
    if alone(field, result).attrs.get("foldyn_result") not in kinds:
        raise InputError(f": give a result of {' or '.join(f'fd.{kind}' for kind in kinds)}", field)


def _along(result: xr.Dataset) -> str:
    """Name of the swept parameter."""
    return "level" if "level" in result.coords else "frequency"


def _pale(number: int) -> tuple[float, float, float]:
    """Color of a basin."""
    color = np.array(to_rgb(style.CYCLE[number % len(style.CYCLE)]))
    share = _PALE if number < len(style.CYCLE) else 0.5 * _PALE
    return tuple((share + (1.0 - share) * color).tolist())


def _periods(basins: xr.Dataset, number: int) -> str:
    """Remark on an attractor whose period is a multiple of the drive's."""
    count = int(basins["periods"].values[number])
    return f" (repeats after {count} periods)" if count > 1 else ""
