"""What a fit compares of a motion: histories of nodes, and their spectra."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.experiment.calibration.measurement import NodeValues, column
from foldyn.experiment.camera import Sight
from foldyn.signals import sampling_interval, spectrum
from foldyn.values import choice, number, numbers, show

DETRENDS = (None, "constant", "linear")
REFINED = 8
"""Steps by which the best place in time is refined: they converge quadratically."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TimeHistory(NodeValues):
    """Displacements of nodes along an axis over time.

    Parameters
    ----------
    time : array_like, shape (t,)
        Times (s), increasing.
    values : array_like, shape (t, m)
        Displacement of each node (m); NaN where it was lost.
    axis : {"x", "y", "z"}
    delay : float
        Time of the model minus that of the measurement (s).
    align : float
        How far (s) the model may be moved beyond `delay`, to where the misfit is least: the instant
        of a release is rarely known to a part of a frame. Not moved by default.
    detrend : {None, "constant", "linear"}
        What is subtracted from the misfit: nothing, its mean, or the straight line of best fit. The
        mean where the zero of the measured displacements is arbitrary.
    sight : Sight, optional
        Where a camera was whose displacements these are: then the model is compared as it would
        look from there; `Sight.of` finds it in tracks.
    """

    time: Any = ()
    axis: str = "x"
    delay: float = 0.0
    align: float = 0.0
    detrend: str | None = None
    sight: Sight | None = None
    kind: ClassVar[str] = "history"
    analysis: ClassVar[str] = "dynamics"

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        choice(self._of("axis"), self.axis, AXES)
        number(self._of("align"), self.align, least=0.0)
        time = column(self._of("time"), self.time)
        if len(time) < 2 or not (np.diff(time) > 0.0).all():
            raise InputError(f"{self._of('time')}: must be at least two increasing times (s)")
        values = self._per_node(np.array(self.values, dtype=np.float64), len(time), "times")
        if np.isinf(values).any():
            raise InputError(f"{self._of('values')}: infinite; give NaN where a node was lost")
        if self.detrend not in DETRENDS:
            raise InputError(
                f'{self._of("detrend")} = {show(self.detrend)}: choose "constant", "linear" or none'
            )
        self._set(time=time, values=values)
        for node in range(values.shape[1]):
            self._refuse_constant(node)

    def _refuse_constant(self, node: int) -> None:
        """Refuse a history without any motion."""
        seen = self.values[:, node][np.isfinite(self.values[:, node])]
        named = np.ravel(self.nodes)
        one = f"node {named[node]}" if len(named) == self.values.shape[1] else f"column {node}"
        which = f"{self._of('values')}: {one}"
        if seen.size < 2:
            raise InputError(f"{which} has {seen.size} values that are numbers; give at least two")
        if np.ptp(seen) == 0.0:
            raise InputError(
                f"{which} is constant ({seen[0]:g} m at all times): nothing moved, or the wrong "
                "point was followed; leave it out"
            )

    @property
    def adapts(self) -> bool:
        """See `Measurement`."""
        return self.align > 0.0

    @property
    def absorbed(self) -> int:
        """See `Measurement`."""
        return (self.align > 0.0) + DETRENDS.index(self.detrend) * self.values.shape[1]

    def observed(self) -> NDArray[np.float64]:
        """See `Measurement`."""
        return self._reduced(self.values)

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """See `Measurement`."""
        super().check(case, arguments)
        early, late = self.time[0] + self.delay, self.time[-1] + self.delay
        _within(self._of("time"), np.array([early - self.align, late + self.align]), arguments)

    def curves(self, result: Any, case: Case) -> NDArray[np.float64]:
        """Displacements in a motion at the measured times, shape (t, m), no trend removed."""
        along = _spline(result, self.where(case), self.axis, self.sight)
        return along(self.time + self.delay + self.shift(result, case))

    def shift(self, result: Any, case: Case) -> float:
        """How far (s) the model is moved, beyond `delay` and at most by `align`, to fit best."""
        if self.align == 0.0:
            return 0.0
        along = _spline(result, self.where(case), self.axis, self.sight)
        there, observed, speed = self.time + self.delay, self.observed(), along.derivative()

        def misfit(by: float) -> NDArray[np.float64]:
            return self._reduced(along(there + by)) - observed

        step = 0.25 * float(np.diff(self.time).min())
        tried = np.linspace(-self.align, self.align, 2 * math.ceil(self.align / step) + 1)
        by = float(tried[np.argmin([float(r @ r) for r in map(misfit, tried)])])
        for _ in range(REFINED):  # Gauss and Newton's steps, from a place that is close
            slope = self._reduced(speed(there + by))
            by = float(np.clip(by - slope @ misfit(by) / (slope @ slope), *tried[[0, -1]]))
        return by

    def predicted(self, result: Any, case: Case) -> NDArray[np.float64]:
        """See `Measurement`."""
        return self._reduced(self.curves(result, case))

    def trend(self, curves: NDArray[np.float64]) -> NDArray[np.float64]:
        """What `detrend` subtracts from curves (t, m), fitted where the nodes were seen."""
        if self.detrend is None:
            return np.zeros(curves.shape)
        degree = DETRENDS.index(self.detrend) - 1
        lines = []
        for curve, measured in zip(curves.T, self.values.T, strict=True):
            seen = np.isfinite(measured)
            line = np.polynomial.Polynomial.fit(self.time[seen], curve[seen], degree)
            lines.append(line(self.time))
        return np.stack(lines, axis=1)

    def _reduced(self, curves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Curves where the nodes were seen, without their trend, flat: node after node."""
        return (curves - self.trend(curves)).T[np.isfinite(self.values).T]


@dataclass(frozen=True, eq=False, kw_only=True)
class Spectrum(NodeValues):
    """Amplitude spectra of the displacements of nodes along an axis.

    Parameters
    ----------
    frequency : array_like, shape (f,)
        Frequencies (Hz).
    values : array_like, shape (f, m)
        Amplitude of each node (m), as `foldyn.signals.spectrum` has it.
    time : array_like, shape (t,)
        Times (s) of the model's motion of which the spectrum is compared: those of the record
        whose spectrum this is, so that both resolve and leak the same.
    axis : {"x", "y", "z"}
    detrend : {None, "constant", "linear"}
        What is subtracted from the model's motion first; as it was for the record.
    taper : str, optional
        Window function of both, as `foldyn.signals.spectrum` takes it.
    sight : Sight, optional
        As of a history.
    """

    frequency: Any = ()
    time: Any = ()
    axis: str = "x"
    detrend: str | None = "constant"
    taper: str | None = None
    sight: Sight | None = None
    kind: ClassVar[str] = "spectrum"
    analysis: ClassVar[str] = "dynamics"

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        choice(self._of("axis"), self.axis, AXES)
        frequency = column(self._of("frequency"), self.frequency)
        values = numbers(self._of("values"), self.values)
        values = self._per_node(values, len(frequency), "frequencies")
        time = column(self._of("time"), self.time)
        sampling_interval(time)
        self._set(frequency=frequency, values=values, time=time)

    @classmethod
    def of(
        cls,
        history: TimeHistory,
        band: tuple[float, float],
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

    def observed(self) -> NDArray[np.float64]:
        """See `Measurement`."""
        return self.values.T.ravel()

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """See `Measurement`."""
        super().check(case, arguments)
        _within(self._of("time"), self.time, arguments)

    def spectra(self, result: Any, case: Case) -> NDArray[np.float64]:
        """Amplitudes of the model at the measured frequencies, shape (f, m)."""
        along = _spline(result, self.where(case), self.axis, self.sight)(self.time)
        step = sampling_interval(self.time)
        frequency, amplitude = spectrum(along, step, window=self.taper, detrend=self.detrend)
        return np.stack([np.interp(self.frequency, frequency, one) for one in amplitude.T], axis=1)

    def predicted(self, result: Any, case: Case) -> NDArray[np.float64]:
        """See `Measurement`."""
        return self.spectra(result, case).T.ravel()


def _spline(result: Any, nodes: NDArray[np.int64], axis: str, sight: Sight | None) -> CubicSpline:
    """Displacement of nodes along an axis between a motion's samples, as it is seen."""
    moved = result["displacement"].values[:, nodes]
    if sight is not None:
        moved = sight.seen(nodes, result["rest_position"].values[nodes], moved)
    return CubicSpline(result["time"].values, moved[..., AXES.index(axis)])


def _within(name: str, times: NDArray[np.float64], arguments: Mapping[str, Any]) -> None:
    """Refuse times that the motion of a case does not have."""
    first = float(arguments.get("start", 0.0))
    last = first + arguments["duration"]
    slack = 1e-9 * (last - first)
    if times[0] < first - slack or times[-1] > last + slack:
        raise InputError(
            f"{name}: {times[0]:.6g} to {times[-1]:.6g} s, delay included, is not within the "
            f"motion of the case, {first:g} to {last:g} s; change the delay, the window or "
            "analysis.duration"
        )
