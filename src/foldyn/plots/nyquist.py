"""Nyquist plots: circles of modes in the plane of the mobility."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.linear import Peak, peaks_of
from foldyn.linear.frf import PER_FORCE, quantity_of
from foldyn.linear.peaks_of import SIDES
from foldyn.plots import style
from foldyn.plots.frf import Curve, curves_of
from foldyn.plots.modes import hertz
from foldyn.plots.readings import unit_of

MOST_CIRCLES = 6
_COLUMNS = 3
_POINTS = {"color": style.BLUE, "marker": ".", "markersize": 5.0, "linestyle": "none"}
_RESONANT = style.ring(style.BLACK, 6.0)


class Circle(NamedTuple):
    """Circle of a mode in the plane of mobility: diameter / (1 + i x) + residual, with detuning x.

    `natural` (Hz) and `ratio` describe the curve, including the damping of a window, if any.
    """

    peak: Peak
    diameter: complex
    residual: complex
    natural: float
    ratio: float
    band: NDArray[np.bool_]  # marks frequencies that were fitted

    def __call__(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Mobility at frequencies (Hz) above 0."""
        curve = _resonance(frequency, self.natural, self.ratio)
        return np.asarray(self.diameter * curve + self.residual, np.complex128)

    def outline(self) -> NDArray[np.complex128]:
        """The whole circle."""
        around = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 181))
        return np.asarray(self.residual + 0.5 * self.diameter * (1.0 + around), np.complex128)


def plot_nyquist(
    response: xr.Dataset,
    node: int,
    *,
    axis: str | None = None,
    peaks: Sequence[Peak] | None = None,
    title: str = "",
) -> Figure:
    """Draw the mobility of a node around its resonances in the complex plane, with circles.

    Parameters
    ----------
    response : xarray.Dataset
        A response of `foldyn.frf` to forces.
    node : int
    axis : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of the mobility; by default the axis along which the node responds most, in the
        direction of the drive.
    peaks : sequence of Peak, optional
        Peaks of the response, from `foldyn.linear.peaks_of`, by default all. They set the natural
        frequency and damping ratio of the circles. The first 6 peaks that have a circle are drawn.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Axes for each circle, at equal scale in both directions: the points within 1.5 half-power
        widths of the resonance, the circle, and the resonance on it. If no circle fits, axes with
        the whole curve.

    Raises
    ------
    InputError
        The response is driven by a moving base, or has no such node or direction.
    """
    if quantity_of(response) not in PER_FORCE:
        raise InputError("response: a base drives it; circles need forces, drive=[fd.Force(...)]")
    (curve,), _ = curves_of({"": response}, [node], axis, "mobility")
    usable = np.isfinite(curve.values) & (curve.frequency > 0.0)
    f, Y = curve.frequency[usable], curve.values[usable]
    if not f.size:
        raise InputError(f"response: node {node} has no finite mobility along {curve.axis}")
    known = peaks_of(response, node, axis=curve.axis) if peaks is None else peaks
    rate = float(response.attrs.get("window_rate", 0.0))
    fitted = [peak for peak in known if np.isfinite(peak.natural_frequency * peak.damping_ratio)]
    circles = circles_of(f, Y, fitted[:MOST_CIRCLES], rate)
    figure, frames = _frames(max(len(circles), 1), curve, title)
    if not circles:
        frames[0].plot(Y.real, Y.imag, **_POINTS | {"linestyle": "solid", "linewidth": 0.8})
    for frame, circle in zip_longest(frames, circles):
        heading = "no circle fits" if circle is None else _draw(frame, Y, circle)
        frame.set_title(heading, **style.TEXT, y=1.0, pad=4.0)
        frame.set_aspect("equal", adjustable="datalim")
        frame.ticklabel_format(axis="both", scilimits=(-3, 4), useMathText=True)
        for offset in (frame.xaxis.get_offset_text(), frame.yaxis.get_offset_text()):
            offset.set(fontsize=style.TICK, color=style.BLACK)
        frame.locator_params(nbins=5)
    keys = [style.key("response", **_POINTS)]
    if circles:
        keys.append(style.key("fitted circle", color=style.VERMILLION, linewidth=1.2))
        keys.append(style.key("natural frequency", **_RESONANT))
    return style.finish(figure, keys)


def circles_of(
    frequency: NDArray[np.float64], mobility: NDArray[np.complex128], peaks: Sequence[Peak],
    rate: float = 0.0,
) -> list[Circle]:  # fmt: skip
    """Circles of peaks, fitted to the mobility around them by least squares.

    Parameters
    ----------
    rate : float
        Decay rate (1/s) of an exponential window, whose damping the curve includes but the peaks do
        not.
    """
    modes = [_windowed(peak.natural_frequency, peak.damping_ratio, rate) for peak in peaks]
    between = [0.5 * (a[0] + b[0]) for a, b in pairwise(modes)]
    edges = [0.0, *between, np.inf]
    circles = []
    for k, (peak, (natural, ratio)) in enumerate(zip(peaks, modes, strict=True)):
        reach = SIDES * 2.0 * ratio * natural
        low, high = max(edges[k], natural - reach), min(edges[k + 1], natural + reach)
        band = (frequency >= low) & (frequency <= high)
        if band.sum() < 3:
            continue
        columns = np.stack([_resonance(frequency[band], natural, ratio), np.ones(band.sum())], 1)
        (diameter, residual), *_ = np.linalg.lstsq(columns, mobility[band], rcond=None)
        circles.append(Circle(peak, complex(diameter), complex(residual), natural, ratio, band))
    return circles


def _windowed(natural: float, ratio: float, rate: float) -> tuple[float, float]:
    """Natural frequency (Hz) and damping ratio, including the damping of an exponential window."""
    omega = 2.0 * np.pi * natural
    decay, damped = ratio * omega + rate, omega * np.sqrt(1.0 - min(ratio, 1.0) ** 2)
    size = float(np.hypot(decay, damped))
    return size / (2.0 * np.pi), decay / size


def _resonance(f: NDArray[np.float64], natural: float, ratio: float) -> NDArray[np.complex128]:
    detuning = (f / natural - natural / f) / (2.0 * ratio)
    return np.asarray(1.0 / (1.0 + 1j * detuning), np.complex128)


def _frames(count: int, curve: Curve, title: str) -> tuple[Figure, list[Axes]]:
    columns, unit = min(count, _COLUMNS), unit_of("mobility")
    rows = -(-count // columns)
    figure = style.new_figure(max(3.0 * columns, 4.2), 0.9 + 2.9 * rows, title)
    frames = list(figure.subplots(rows, columns, squeeze=False).flat)
    for spare in frames[count:]:
        spare.remove()
    for k, frame in enumerate(frames[:count]):
        xlabel = f"real mobility{unit}" if k + columns >= count else ""
        ylabel = f"imaginary mobility{unit}" if k % columns == 0 else ""
        style.frame(frame, xlabel, ylabel)
        frame.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
        frame.axvline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    return figure, frames[:count]


def _draw(frame: Axes, Y: NDArray, circle: Circle) -> str:
    """Draw a circle and the points near it; return its title."""
    outline = circle.outline()
    frame.plot(outline.real, outline.imag, color=style.VERMILLION, linewidth=1.2, zorder=2.0,
               label="fitted circle")  # fmt: skip
    near = Y[circle.band]
    frame.plot(np.real(near), np.imag(near), **_POINTS, zorder=3.0, label="response")
    top = circle(np.array([circle.natural]))
    frame.plot(top.real, top.imag, **_RESONANT, zorder=4.0, label="natural frequency")
    mode = circle.peak
    return f"{hertz(mode.natural_frequency)} Hz, damping {100.0 * mode.damping_ratio:.3g} %"
