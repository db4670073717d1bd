"""Figures of response curves, with stability and bifurcations, and of backbones."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.readings import alone, by_label
from foldyn.results.sweep_dataset import label

MARKERS = {"fold": "o", "pitchfork": "s", "period doubling": "D", "Neimark-Sacker": "^"}
UNSTABLE = (0, (3, 1.6))
SIZE = (6.4, 3.8)


def plot_response_curve(
    curves: xr.Dataset | Mapping[str, xr.Dataset],
    backbone: xr.Dataset | None = None,
    *,
    title: str = "",
) -> Figure:
    """Draw response curves: stable motions solid, unstable motions dashed, bifurcations marked.

    Parameters
    ----------
    curves : xarray.Dataset, or mapping of str to xarray.Dataset
        A result of `foldyn.response_curve`, or several by their labels.
    backbone : xarray.Dataset, optional
        A result of `foldyn.backbone`, drawn behind the curves, which must be without a measure.
        Their amplitude is half the range of the largest displacement along an axis.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Amplitude against the frequency or the factor on the drive, whichever varies.

    Raises
    ------
    InputError
        The results are not response curves of one kind, or a backbone is given with curves of a
        measure.
    """
    labeled = by_label("curves", curves)
    kinds = {_kind("curves", one, "response_curve", "by") for one in labeled.values()}
    if len(kinds) > 1:
        raise InputError(": some vary the frequency, others the level; draw them apart", "curves")
    along = "frequency" if kinds.pop() == "frequencies" else "level"
    xlabel = "frequency of the drive (Hz)" if along == "frequency" else "factor on the drive"
    first = next(iter(labeled.values()))
    ylabel = label(first["amplitude"], f"amplitude of the {first.attrs['measure']}")
    figure, axes = style.single(SIZE, title, xlabel, ylabel)
    keys, kept = [], set()
    for index, (name, curve) in enumerate(labeled.items()):
        color = style.CYCLE[index % len(style.CYCLE)]
        kept |= _draw(axes, curve, along, color)
        if name:
            keys.append(style.key(name, color=color))
    if not all(curve["stable"].values.all() for curve in labeled.values()):
        keys.append(style.key("unstable", color=style.GRAY, linestyle=UNSTABLE))
    keys += [style.key(name, **_mark(style.GRAY, name)) for name in MARKERS if name in kept]
    if backbone is not None and along == "frequency":
        _kind("backbone", backbone, "backbone", "mode")
        look = {"color": style.GRAY, "linewidth": 1.0, "label": "backbone", "zorder": 1.0}
        limits = axes.get_xlim(), axes.get_ylim()
        keys += axes.plot(backbone["frequency"].values, _size_along(backbone, labeled), **look)
        axes.set(xlim=limits[0], ylim=limits[1])
    style.exponents(axes)
    return style.finish(figure, keys, 4, width=SIZE[0])


def plot_backbone(backbones: xr.Dataset | Mapping[str, xr.Dataset], title: str = "") -> Figure:
    """Draw backbones: frequency against amplitude and, if undamped, against energy.

    Parameters
    ----------
    backbones : xarray.Dataset, or mapping of str to xarray.Dataset
        A result of `foldyn.backbone`, or several by their labels.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Axes with logarithmic amplitude and, if undamped, axes with logarithmic energy.

    Raises
    ------
    InputError
        Not backbones.
    """
    labeled = by_label("backbones", backbones)
    for one in labeled.values():
        _kind("backbones", one, "backbone", "mode")
    parts = {"amplitude": "m"}
    if all("energy" in one for one in labeled.values()):
        parts["energy"] = "J"
    charts = []
    for name, unit in parts.items():
        curves = [
            Curve(whose, one[name].values, one["frequency"].values)
            for whose, one in labeled.items()
        ]
        charts.append(Chart(f"{name} ({unit})", "frequency (Hz)", curves, by_ratio=True))
    size = 3.2 * len(charts) + 1.0, SIZE[1]
    return figure_of(charts, size, title, len(charts), 4, sharey=True)


def _size_along(backbone: xr.Dataset, curves: Mapping[str, xr.Dataset]) -> NDArray:
    """Amplitudes of a backbone's motions, defined as in curves without a measure."""
    from foldyn.periodic.orbit import amplitudes_of
    from foldyn.periodic.response import LARGEST

    for curve in curves.values():
        if curve.attrs["measure"] != LARGEST:
            raise InputError(
                f": the curves show the {curve.attrs['measure']}, a backbone the {LARGEST}; leave "
                "it out",
                "backbone",
            )
    dims = "point", "harmonic", "node", "axis"
    return amplitudes_of(backbone["coefficient"].transpose(*dims).values)


def _kind(field: str, result: xr.Dataset, kind: str, attribute: str) -> str:
    """Return an attribute of a result; refuse results of other kinds."""
    if alone(field, result).attrs.get("foldyn_result") != kind or attribute not in result.attrs:
        raise InputError(f": must be a result of foldyn.{kind}", field)
    return str(result.attrs[attribute])


def _mark(color: str, name: str) -> dict:
    return style.ring(color) | {"marker": MARKERS[name]}


def _draw(axes: Axes, curve: xr.Dataset, along: str, color: str) -> set[str]:
    """Draw a curve with its branches; return the names of its bifurcations."""
    x, y = curve[along].values, curve["amplitude"].values
    names, branch = curve["bifurcation"].values, curve["branch"].values
    for number in np.unique(branch):
        own = np.flatnonzero(branch == number)
        for part, stable in _pieces(curve["stable"].values[own], names[own] != ""):
            look = {"linestyle": "solid" if stable else UNSTABLE, "linewidth": 1.5}
            axes.plot(x[own[part]], y[own[part]], color=color, **look)
    for name in MARKERS:
        at = names == name
        if at.any():
            axes.plot(x[at], y[at], zorder=4.0, **_mark(color, name))
    return set(names.tolist())


def _pieces(stable: NDArray[np.bool_], marked: NDArray[np.bool_]) -> list[tuple[NDArray, bool]]:
    """Point numbers of each stretch of equal stability; stretches end at bifurcations."""
    count = len(stable)
    if count == 1:
        return [(np.array([0]), bool(stable[0]))]
    # a bifurcation is neither stable nor unstable: the other end of the segment decides
    segment = np.where(marked[:-1], stable[1:], stable[:-1])
    edges = [0, *(np.flatnonzero(np.diff(segment)) + 1).tolist(), count - 1]
    return [(np.arange(first, last + 1), bool(segment[first])) for first, last in pairwise(edges)]
