"""Motions in a fit: histories of nodes, and their spectra."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn.analyses.sections import one_of
from foldyn.arguments import Check
from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.experiment.calibration.measurement import NodeValues, column
from foldyn.experiment.camera import Sight
from foldyn.signals import sampling_interval, spectrum
from foldyn.values import number, numbers, show

DETRENDS = (None, "constant", "linear")
REFINED = 8  # number of Newton steps that refine the time shift; they converge quadratically


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeHistory(NodeValues):
    """Displacements of nodes along an axis over time.

    Parameters
    ----------
    time : array_like, shape (t,)
        Times (s), increasing.
    values : array_like, shape (t, m)
        Displacement of each node (m); NaN while it was lost.
    axis : {"x", "y", "z"}
    delay : float
        Time of the model minus time of the measurement (s).
    align : float
        Largest time (s) by which the model may be shifted, in addition to `delay`, to minimize the
        misfit: the instant of a release is rarely known to a fraction of a frame. 0 by default.
    detrend : {None, "constant", "linear"}
        Trend subtracted from the misfit: none, the mean of the misfit, or its best-fit line. Use
        "constant" if the zero of the measured displacements is arbitrary.
    sight : Sight, optional
        Camera that measured the displacements; the model is then compared as this camera would see
        it. `Sight.of` takes a camera from tracks.
    """

    time: Annotated[Any, Check(column)] = ()
    axis: Annotated[str, one_of(AXES)] = "x"
    delay: float = 0.0
    align: Annotated[float, Check(number, least=0.0)] = 0.0
    detrend: str | None = None
    sight: Sight | None = None
    kind: ClassVar[str] = "history"
    analysis: ClassVar[str] = "dynamics"

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        if len(self.time) < 2 or not (np.diff(self.time) > 0.0).all():
            raise InputError("time: must be at least two increasing times (s)")
        values = self._per_node(np.array(self.values, dtype=np.float64), len(self.time), "times")
        if np.isinf(values).any():
            raise InputError("values: infinite; give NaN where a node was lost")
        if self.detrend not in DETRENDS:
            raise InputError(f'detrend = {show(self.detrend)}: choose "constant", "linear" or none')
        self._set(values=values)
        for node in range(values.shape[1]):
            self._refuse_constant(node)

    def _refuse_constant(self, node: int) -> None:
        """Refuse a history of a node that did not move."""
        seen = self.values[:, node][np.isfinite(self.values[:, node])]
        named = np.ravel(self.nodes)
        one = f"node {named[node]}" if len(named) == self.values.shape[1] else f"column {node}"
        which = f"values: {one}"
        if seen.size < 2:
            raise InputError(f"{which} has {seen.size} values that are numbers; give at least two")
        if np.ptp(seen) == 0.0:
            raise InputError(
                f"{which} is constant ({seen[0]:g} m at all times): nothing moved, or the wrong "
                "point was followed; leave it out"
            )

    @property
    def adapts(self) -> bool:
        """Whether predictions depend on the measured values."""
        return self.align > 0.0

    @property
    def absorbed(self) -> int:
        """Degrees of freedom that predictions take from the data."""
        return (self.align > 0.0) + DETRENDS.index(self.detrend) * self.values.shape[1]

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        super().check(case, arguments)
        early, late = self.time[0] + self.delay, self.time[-1] + self.delay
        _within(self._of("time"), np.array([early - self.align, late + self.align]), arguments)

    def modelled(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Displacements in a motion at the measured times, shape (t, m), trend included."""
        along = _spline(result, self.where(case), self.axis, self.sight)
        return along(self.time + self.delay + self.shift(result, case))

    def shift(self, result: xr.Dataset, case: Case) -> float:
        """Best-fitting time shift (s) of the model in addition to `delay`, at most `align`."""
        if self.align == 0.0:
            return 0.0
        along = _spline(result, self.where(case), self.axis, self.sight)
        there, observed, speed = self.time + self.delay, self.observed(), along.derivative()

        def misfit(by: float) -> NDArray[np.float64]:
            return self.flat(along(there + by)) - observed

        step = 0.25 * float(np.diff(self.time).min())
        tried = np.linspace(-self.align, self.align, 2 * math.ceil(self.align / step) + 1)
        by = float(tried[np.argmin([float(r @ r) for r in map(misfit, tried)])])
        for _ in range(REFINED):  # Gauss-Newton steps from a start close to the solution
            slope = self.flat(speed(there + by))
            by = float(np.clip(by - slope @ misfit(by) / (slope @ slope), *tried[[0, -1]]))
        return by

    def trend(self, curves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trend of curves (t, m) that `detrend` subtracts, fitted where nodes were seen."""
        if self.detrend is None:
            return np.zeros(curves.shape)
        degree = DETRENDS.index(self.detrend) - 1
        lines = []
        for curve, measured in zip(curves.T, self.values.T, strict=True):
            seen = np.isfinite(measured)
            line = np.polynomial.Polynomial.fit(self.time[seen], curve[seen], degree)
            lines.append(line(self.time))
        return np.stack(lines, axis=1)

    def flat(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values where the nodes were seen, without their trend, node by node."""
        return (values - self.trend(values)).T[np.isfinite(self.values).T]


@dataclass(frozen=True, eq=False, kw_only=True)
class Spectrum(NodeValues):
    """Amplitude spectra of the displacements of nodes along an axis.

    Parameters
    ----------
    frequency : array_like, shape (f,)
        Frequencies (Hz).
    values : array_like, shape (f, m)
        Amplitude of each node (m), as defined by `foldyn.signals.spectrum`.
    time : array_like, shape (t,)
        Times (s) at which the model's motion is sampled for its spectrum: the times of the measured
        record, so that resolution and leakage agree.
    axis : {"x", "y", "z"}
    detrend : {None, "constant", "linear"}
        Trend that is first subtracted from the model's motion, as it was from the record.
    taper : str, optional
        Window function of record and model, as in `foldyn.signals.spectrum`.
    sight : Sight, optional
        As in `TimeHistory`.
    """

    frequency: Annotated[Any, Check(column)] = ()
    time: Annotated[Any, Check(column)] = ()
    axis: Annotated[str, one_of(AXES)] = "x"
    detrend: str | None = "constant"
    taper: str | None = None
    sight: Sight | None = None
    kind: ClassVar[str] = "spectrum"
    analysis: ClassVar[str] = "dynamics"

    def agree(self) -> None:
        """Check the values."""
        super().agree()
        sampling_interval(self.time)
        values = numbers("values", self.values)
        self._set(values=self._per_node(values, len(self.frequency), "frequencies"))

    @classmethod
    def of(
        cls,
        history: TimeHistory,
        band: tuple[float, float],
        *,
        detrend: str | None = "constant",
        taper: str | None = None,
    ) -> Spectrum:
        """Spectrum of a measured history within a band of frequencies (Hz).

        Raises
        ------
        InputError
            The times are not evenly spaced, a node was lost on the way, or the band is empty.
        """
        if not np.isfinite(history.values).all():
            raise InputError(
                f"{history.name}: a spectrum needs every sample of a node; leave out nodes that "
                "were lost, or compare the history"
            )
        step = sampling_interval(history.time)
        frequency, amplitude = spectrum(history.values, step, window=taper, detrend=detrend)
        chosen = (frequency >= band[0]) & (frequency <= band[1])
        if not chosen.any():
            raise InputError(
                f"{history.name}: band = {show(band)}: holds none of the frequencies, which are "
                f"{frequency[1]:.4g} Hz apart up to {frequency[-1]:.4g} Hz"
            )
        return cls(
            nodes=history.nodes, name=history.name, label=history.label, sigma=history.sigma,
            held_out=history.held_out, case=history.case, changes=history.changes,
            frequency=frequency[chosen], values=amplitude[chosen], axis=history.axis,
            time=history.time + history.delay, detrend=detrend, taper=taper, sight=history.sight,
        )  # fmt: skip

    def flat(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values node by node."""
        return values.T.ravel()

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        super().check(case, arguments)
        _within(self._of("time"), self.time, arguments)

    def modelled(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Amplitudes of the model at the measured frequencies, shape (f, m)."""
        along = _spline(result, self.where(case), self.axis, self.sight)(self.time)
        step = sampling_interval(self.time)
        frequency, amplitude = spectrum(along, step, window=self.taper, detrend=self.detrend)
        return np.stack([np.interp(self.frequency, frequency, one) for one in amplitude.T], axis=1)


def _spline(
    result: xr.Dataset, nodes: NDArray[np.int64], axis: str, sight: Sight | None
) -> CubicSpline:
    """Interpolate the seen displacement of nodes along an axis between a motion's samples."""
    moved = result["displacement"].values[:, nodes]
    if sight is not None:
        moved = sight.seen(nodes, result["rest_position"].values[nodes], moved)
    return CubicSpline(result["time"].values, moved[..., AXES.index(axis)])


def _within(name: str, times: NDArray[np.float64], arguments: Mapping[str, Any]) -> None:
    """Refuse times that lie outside the motion of a case."""
    first = float(arguments.get("start", 0.0))
    last = first + arguments["duration"]
    slack = 1e-9 * (last - first)
    if times[0] < first - slack or times[-1] > last + slack:
        raise InputError(
            f"{name}: {times[0]:.6g} to {times[-1]:.6g} s, delay included, is not within the "
            f"motion of the case, {first:g} to {last:g} s; change the delay, the window or "
            "analysis.duration"
        )
