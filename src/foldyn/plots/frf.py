"""Frequency responses: magnitude with peaks, phase, and coherence if available."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from foldyn.cases.directions import DIRECTIONS, signed
from foldyn.errors import InputError
from foldyn.linear import convert
from foldyn.linear.frf import PER_FORCE, quantity_of
from foldyn.linear.peaks_of import resonances
from foldyn.plots import style
from foldyn.plots.modes import hertz
from foldyn.plots.readings import AXES, along_drive, by_label, check_nodes_of, directions, unit_of
from foldyn.values import number

_APART = 0.07  # smallest distance between labels of peaks, relative to the frequency axis
_FEW = 60  # up to this number of frequencies, each is also drawn as a dot
_DECADES = 5.0  # decades, largest range of the magnitude axis


def plot_frf(
    responses: xr.Dataset | Mapping[str, xr.Dataset],
    nodes: int | str | Sequence[int],
    *,
    axes: str | Sequence[str] | None = None,
    quantity: str | None = None,
    prominence: float | None = None,
    title: str = "",
) -> Figure:
    """Draw frequency responses of chosen nodes: magnitude, phase, and coherence if there is one.

    Parameters
    ----------
    responses : xarray.Dataset, or mapping of str to xarray.Dataset
        A response of `foldyn.frf`, or several by their labels, for example one per mass rule or
        amplitude.
    nodes : int, sequence of int, or str
        Nodes to show, one curve each; a selection ("xmax") means vertices of the pattern.
    axes : str, sequence of str, or None
        Direction shown: one of "x", "y", "z", "-x", "-y", "-z" for all nodes, or one for each node.
        None means the axis along which each node responds most, in the direction of the drive.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity to draw if forces drive; by default the receptance. If a base drives, the
        transmissibility is drawn.
    prominence : float, optional
        Which peaks are marked; see `foldyn.linear.peaks_of`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The magnitude on a logarithmic axis, with marked peaks, labelled with their frequency (of
        close neighbors only the higher one); below it the phase in degrees, from -180 to 180, and
        the coherence.

    Raises
    ------
    InputError
        There is no response or node, or a response lacks a node, direction or quantity.
    """
    responses = by_label("responses", responses)
    curves, shown = curves_of(responses, nodes, axes, quantity)
    if prominence is not None:
        number("prominence", prominence, least=0.0, below=1.0)
    coherent = any(curve.coherence is not None for curve in curves)
    heights = [2.6, 1.3, 1.0][: 3 if coherent else 2]
    along = {curve.axis for curve in curves}
    of = f" along {curves[0].axis}" if len(along) == 1 else ""
    ylabels = [f"{shown}{of}{unit_of(shown)}", "phase (degrees)", "coherence"][: len(heights)]
    size = 8.0, 1.2 + sum(heights)
    figure, rows = style.rows(size, title, "frequency (Hz)", ylabels, heights=heights)
    several = len(responses) > 1, len({curve.node for curve in curves}) > 1, len(along) > 1
    keys, peaks = [], []
    for index, curve in enumerate(curves):
        look = style.line_style(index) | {"label": _label(curve, *several)}
        dots = {"marker": ".", "markersize": 4.0} if len(curve.frequency) <= _FEW else {}
        height = np.where(curve.values == 0.0, np.nan, np.abs(curve.values))
        keys += rows[0].plot(curve.frequency, height, **look, **dots)
        rows[1].plot(*phase_line(curve.frequency, curve.values), **look, **dots)
        if curve.coherence is not None:
            rows[2].plot(curve.frequency, curve.coherence, **look, **dots)
        peaks.append(_peaks(curve, shown, prominence))
        ring = style.ring(look["color"]) | {"label": f"_peaks of {look['label']}", "zorder": 4.0}
        rows[0].plot(*peaks[-1].T, **ring)
    _set_axes(rows, curves)
    _label_peaks(rows[0], np.concatenate(peaks))
    if any(map(len, peaks)):
        keys.append(style.key("peak", color=style.GRAY, **style.ring(style.GRAY)))
    return style.finish(figure, keys if any(several) else [], 5, width=7.6)


class Curve(NamedTuple):
    """Response of one node of one model, with its frequencies (Hz); arrays have shape (m,)."""

    label: str
    node: int
    axis: str
    frequency: NDArray[np.float64]
    values: NDArray[np.complex128]
    coherence: NDArray[np.float64] | None


def curves_of(
    responses: Mapping[str, xr.Dataset],
    nodes: int | str | Sequence[int],
    axes: str | Sequence[str] | None,
    quantity: str | None,
) -> tuple[list[Curve], str]:
    """Responses of nodes, in order of models, then nodes; and the quantity that they show.

    Raises
    ------
    InputError
        There is no response or node, or a response lacks a node, direction or quantity.
    """
    held = {quantity_of(response) for response in responses.values()}
    if len(held) > 1:
        raise InputError("responses: forces drive some, a moving base others; draw them separately")
    shown = held.pop()
    if quantity is not None:
        if quantity not in PER_FORCE or shown not in PER_FORCE:
            known = ", ".join(PER_FORCE) if shown in PER_FORCE else shown
            raise InputError(f"quantity: {quantity!r}; the response has {known}")
        shown = quantity
        responses = {label: convert(response, shown) for label, response in responses.items()}
    numbers = check_nodes_of(responses, nodes)
    seen = (r[shown].sel(node=numbers, axis=list(AXES)).values for r in responses.values())
    if axes is None:
        along = along_drive(next(iter(responses.values())))
        most = directions(None, len(numbers), map(np.nan_to_num, seen))
        axes = [along[AXES.index(axis)] for axis in most]
    chosen = directions(axes, len(numbers), (), DIRECTIONS)
    curves = []
    for label, response in responses.items():
        frequency = response["frequency"].values.astype(np.float64)
        for node, axis in zip(numbers, chosen, strict=True):
            column, sign = signed("axes", axis)
            here = response.sel(node=node, axis=AXES[column])
            values = sign * here[shown].values.astype(np.complex128)
            coherence = here["coherence"].values if "coherence" in response else None
            curves.append(Curve(label, node, axis, frequency, values, coherence))
    return curves, shown


def phase_line(
    frequency: NDArray[np.float64], values: NDArray[np.complex128]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies and phases (degrees, -180 to 180), with a NaN where the phase wraps around."""
    degrees = np.degrees(np.angle(np.where(values == 0.0, np.nan, values)))
    # Without damping, rounding makes the phase -180 or 180: use one of them.
    degrees = np.where(degrees > 180.0 - 1e-6, -180.0, degrees)
    jumps = np.flatnonzero(np.abs(np.diff(degrees)) > 180.0) + 1
    return np.insert(frequency, jumps, frequency[jumps]), np.insert(degrees, jumps, np.nan)


def _label(curve: Curve, models: bool, nodes: bool, axes: bool) -> str:
    """Legend entry of a curve: only what distinguishes it from the other curves."""
    node = f"node {curve.node}" + (f" along {curve.axis}" if axes else "")
    parts = [*([curve.label] if models else []), *([node] if nodes or axes else [])]
    return ", ".join(parts) or "response"


def _peaks(curve: Curve, quantity: str, prominence: float | None) -> NDArray[np.float64]:
    """Frequency and height of the peaks of a curve, shape (p, 2)."""
    usable = np.isfinite(curve.values)
    if usable.sum() < 3 or not curve.values[usable].any():
        return np.zeros((0, 2))
    f, scatters = curve.frequency[usable], curve.coherence is not None
    peaks = resonances(f, curve.values[usable], quantity, prominence, None, scatters)
    return np.column_stack([peaks.frequency, peaks.height])


def _set_axes(rows: NDArray, curves: list[Curve]) -> None:
    """Set limits and ticks of all axes."""
    magnitude, phase = rows[0], rows[1]
    magnitude.set_yscale("log")
    largest = max(float(np.abs(np.nan_to_num(curve.values)).max()) for curve in curves)
    low, high = magnitude.get_ylim()
    magnitude.set_ylim(max(low, largest * 10.0**-_DECADES), high * 1.6)  # room for labels
    magnitude.yaxis.set_major_locator(LogLocator(numticks=8))
    magnitude.yaxis.set_minor_formatter(NullFormatter())
    magnitude.tick_params(which="minor", color=style.LIGHT)
    first = min(float(curve.frequency[0]) for curve in curves)
    last = max(float(curve.frequency[-1]) for curve in curves)
    if last > first:
        phase.set_xlim(first, last)
    phase.set(ylim=(-195.0, 195.0), yticks=[-180.0, -90.0, 0.0, 90.0, 180.0])
    if len(rows) > 2:
        rows[2].set(ylim=(-0.05, 1.08), yticks=[0.0, 0.5, 1.0])


def _label_peaks(axes: Axes, peaks: NDArray[np.float64]) -> None:
    """Write frequencies above the peaks, highest first, unless another label is near."""
    low, high = axes.get_xlim()
    written: list[float] = []
    for frequency, height in peaks[np.argsort(-peaks[:, 1], kind="stable")].tolist():
        if any(abs(frequency - other) < _APART * (high - low) for other in written):
            continue
        written.append(frequency)
        part = (frequency - low) / (high - low)
        side = "left" if part < 0.04 else "right" if part > 0.96 else "center"
        look = style.FINE | {"xytext": (0.0, 5.0), "textcoords": "offset points", "ha": side}
        axes.annotate(f"{hertz(frequency)} Hz", (frequency, height), zorder=5.0, **look)
