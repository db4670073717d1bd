"""Peaks of a frequency response, and their damping."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import signals
from foldyn.cases.directions import AXES, signed
from foldyn.errors import ComputationError, InputError, quietly
from foldyn.linear.frf import PER_FORCE, convert, quantity_of
from foldyn.values import choice

PROMINENT = 0.05
HALF_POWER = math.sqrt(2.0)
SIDES = 1.5  # samples of a circle fit: at most so many half-power widths on either side


@dataclass(frozen=True)
class Peak:
    """A peak of a frequency response; values that cannot be found are nan.

    Attributes
    ----------
    frequency, height : float
        Frequency (Hz), interpolated between samples, and height in the unit of the response.
    half_power, textbook : float
        Damping ratios from the half-power points: `half_power` is exact for a single mode,
        `textbook` is (upper - lower) / (2 peak).
    asymmetry : float
        Asymmetry of the half-power points; above 0.1, the peak belongs to more than one mode.
    natural_frequency, damping_ratio : float
        Natural frequency (Hz) and damping ratio from the circle fit.
    frequency_error, damping_error : float
        Standard errors of the circle fit.
    misfit : float
        Misfit of the circle, as a fraction of its radius.
    note : str
        Reason for nan values.
    """

    frequency: float
    height: float
    half_power: float = math.nan
    textbook: float = math.nan
    asymmetry: float = math.nan
    natural_frequency: float = math.nan
    damping_ratio: float = math.nan
    frequency_error: float = math.nan
    damping_error: float = math.nan
    misfit: float = math.nan
    note: str = ""


def peaks_of(
    response: xarray.Dataset,
    node: int,
    *,
    axis: str,
    quantity: str | None = None,
    prominence: float | None = None,
    count: int | None = None,
) -> tuple[Peak, ...]:
    """Peaks of a frequency response at one node along one axis, by increasing frequency.

    Parameters
    ----------
    response : xarray.Dataset
        A result of `frf`.
    node : int
    axis : {"x", "y", "z", "-x", "-y", "-z"}
        The sign has no effect.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity whose peaks and half-power points are used; by default the stored quantity. A
        strongly damped mode peaks at its natural frequency in the mobility, and at a lower
        frequency in the receptance. The circle fit does not depend on the quantity.
    prominence : float, optional
        Least prominence of a peak, as a fraction of the curve's maximum. By default 0.05; a lower
        peak also counts if it falls to half its power on both sides, as seen on a logarithmic axis,
        except in an estimate from random bursts, which scatters.
    count : int, optional
        Number of peaks to keep: the most prominent peaks; all by default.

    Returns
    -------
    tuple of Peak
        Peaks with circles, which are fitted to all peaks together, or, if this fails, to each peak
        alone. For a response estimated with an exponential window, `half_power`,
        `natural_frequency` and `damping_ratio` exclude the damping of the window.

    Raises
    ------
    InputError
        Not a frequency response; no such node, axis or quantity.
    """
    held = quantity_of(response)
    column, _ = signed("axis", axis)
    if isinstance(node, bool) or node not in response["node"].values:
        raise InputError(f"node = {node!r}: the response has nodes 0 to {len(response.node) - 1}")
    shown = held
    if quantity is not None:
        shown = choice("quantity", quantity, PER_FORCE)
        response = convert(response, shown)
    f = response["frequency"].values
    curve = response[shown].values[:, int(node), column]
    usable = np.isfinite(curve)
    f, curve = f[usable], curve[usable]
    if f.size < 3 or not curve.any():
        return ()
    kind = kind_of(shown)
    rate = float(response.attrs.get("window_rate", 0.0))
    curve_peaks = resonances(f, curve, shown, prominence, count, "coherence" in response)
    if not curve_peaks.index.size:
        return ()
    peaks, widths = [], []
    for frequency, height in zip(curve_peaks.frequency, curve_peaks.height, strict=True):
        peak, width = _with_half_power(Peak(float(frequency), float(height)), f, curve, kind, rate)
        peaks.append(peak)
        widths.append(width)
    bands = _bands(f, np.abs(curve), curve_peaks.index, widths)
    circled = _modal(response, f, curve, shown, AXES[column], rate)
    return tuple(_with_circles(peaks, f, circled, bands, kind, rate))


def resonances(
    f: NDArray, curve: NDArray, shown: str, prominence: float | None, count: int | None,
    scatters: bool,
) -> signals.Peaks:  # fmt: skip
    """Peaks of a finite curve, as marked in figures and listed in tables; see `peaks_of`.

    shown : quantity of the curve; a transmissibility is treated like a receptance.
    scatters : whether the curve is an estimate from random records, with meaningless low peaks.
    """
    kind, size = kind_of(shown), np.abs(curve)  # an undamped response is real, of either sign
    rise = None if scatters or prominence is not None else HALF_POWER
    least = PROMINENT if prominence is None else prominence
    return signals.find_peaks(f, size, prominence=least, count=count, quantity=kind, rise=rise)


def kind_of(shown: str) -> str:
    """The quantity as which peak estimators treat a curve."""
    return shown if shown in PER_FORCE else "receptance"


def _with_half_power(
    peak: Peak, f: NDArray, curve: NDArray, kind: str, rate: float
) -> tuple[Peak, float]:
    """The peak with its half-power damping, and the distance (Hz) of the half-power points."""
    with quietly():  # the asymmetry is in the result
        try:
            points = signals.half_power(f, np.abs(curve), near=peak.frequency, quantity=kind)
        except InputError as error:
            return replace(peak, note=f"half power: {error}"), math.inf
    ratio = points.damping_ratio
    if rate > 0.0:
        ratio = float(signals.without_window(points.natural_frequency, ratio, rate=rate)[1])
    textbook, asymmetry = points.textbook_damping_ratio, points.asymmetry
    damped = replace(peak, half_power=ratio, textbook=textbook, asymmetry=asymmetry)
    return damped, points.upper - points.lower


def _bands(
    f: NDArray, size: NDArray, index: NDArray, widths: list[float]
) -> list[tuple[float, float]]:
    """Band (Hz) of each peak, up to the lowest points next to it, with limited width."""
    ends = [0, *index.tolist(), len(f) - 1]
    valleys = [a + int(np.argmin(size[a : b + 1])) for a, b in pairwise(ends)]
    bands = []
    for k, at in enumerate(index):
        low, high = f[valleys[k]], f[valleys[k + 1]]
        reach = SIDES * widths[k]
        bands.append((max(low, f[at] - reach), min(high, f[at] + reach)))
    return bands


def _modal(
    response: xarray.Dataset, f: NDArray, curve: NDArray, shown: str, axis: str, rate: float
) -> NDArray:
    """The curve converted to a quantity in which modes trace circles.

    A transmissibility is 1 - (s^2 + alpha s) H, with H the receptance to the forces M t of a unit
    translation t of the base, s = i w plus the rate of the window, if any.
    """
    if shown in PER_FORCE:
        return curve
    s = 2j * np.pi * f + rate
    still = 1.0 if axis == response.attrs["base_axis"] else 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return (still - curve) / (s * (s + float(response.attrs["alpha"])))


def _with_circles(
    peaks: list[Peak], f: NDArray, curve: NDArray, bands: list[tuple[float, float]], kind: str,
    rate: float,
) -> list[Peak]:  # fmt: skip
    """The peaks with circle fits: of all peaks together, or else of each alone."""
    try:
        fits = signals.circle_fits(f, curve, bands=bands, quantity=kind)
        return [_with_circle(peak, fit, rate) for peak, fit in zip(peaks, fits, strict=True)]
    except (InputError, ComputationError):
        alone = []
    for peak, band in zip(peaks, bands, strict=True):
        try:
            fit = signals.circle_fit(f, curve, band=band, quantity=kind)
            alone.append(_with_circle(peak, fit, rate))
        except (InputError, ComputationError) as error:
            alone.append(replace(peak, note="; ".join(filter(None, (peak.note, str(error))))))
    return alone


def _with_circle(peak: Peak, fit: signals.CircleFit, rate: float) -> Peak:
    """The peak with its circle fit, excluding the damping of the window."""
    natural, ratio = fit.natural_frequency, fit.damping_ratio
    if rate > 0.0:
        natural, ratio = map(float, signals.without_window(natural, ratio, rate=rate))
    return replace(
        peak, natural_frequency=natural, damping_ratio=ratio, misfit=fit.misfit,
        frequency_error=fit.frequency_error, damping_error=fit.damping_error,
    )  # fmt: skip
