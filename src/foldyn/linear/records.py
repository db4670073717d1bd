"""Records of motions that die away: their sampling, and the response that they tell."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Table
from foldyn.errors import FoldynWarning, InputError
from foldyn.memory import check_memory
from foldyn.signals import exponential_window, frequency_response

MOST_LINES = 100  # of the frequencies' spacing: how fine a spacing may be that holds them all
DECAYED = 1e-5  # what damping leaves of a motion within the default duration
COPIES = 4  # of the samples, while their spectra are taken
FEWEST = 4  # samples in a cycle of the highest frequency
LEFT = 1e-3  # of the largest response: what may be left at the end of a record
END = 0.05  # of the record: where that is looked for


@dataclass(frozen=True)
class Record:
    """Sampling of transient records, the lines of which hold the frequencies asked for.

    Attributes
    ----------
    every : float
        Sampling interval (s).
    samples : int
        Samples simulated.
    length : int
        Samples of the record, zeros appended; its lines are 1 / (length every) apart.
    lines : ndarray of int, shape (m,)
        The frequencies' numbers among the lines.
    """

    every: float
    samples: int
    length: int
    lines: NDArray[np.int64]

    @property
    def duration(self) -> float:
        """Time simulated (s)."""
        return self.samples * self.every


def record_of(
    frequency: NDArray, alpha: float, quiet: float, every: float, duration: float | None
) -> Record:
    """Choose the sampling of a transient record.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        Frequencies wanted (Hz).
    alpha : float
        Mass-proportional damping (1/s): a motion falls at least as fast as exp(-alpha t / 2).
    quiet : float
        Part of the record after the drive has ended.
    every : float
        Largest sampling interval (s).
    duration : float, optional
        Time to simulate (s).
    """
    spacing = common_spacing(frequency)
    if duration is None:
        decay = 2.0 * math.log(1.0 / DECAYED) / alpha if alpha > 0.0 else 0.0
        duration = decay / quiet if decay > 0.0 else 1.0 / spacing
    whole = math.ceil(duration * spacing * (1.0 - 1e-9)) / spacing
    length = math.ceil(whole / every * (1.0 - 1e-9))
    every = whole / length
    check_resolved(frequency, every)
    samples = min(math.ceil(duration / every * (1.0 - 1e-9)), length)
    return Record(every, samples, length, np.rint(frequency * whole).astype(np.int64))


def check_records(field: str, record: Record, count: int, nodes: int) -> None:
    """Refuse records that memory cannot hold."""
    what = f"{float(count):.3g} records of {float(record.length):.3g} samples of {nodes} nodes"
    check_memory(field, what, 8.0 * COPIES * count * record.length * 3 * nodes, "take fewer")


def check_resolved(frequency: NDArray, every: float) -> None:
    """Refuse frequencies that the sampling does not resolve."""
    if frequency[-1] * every * FEWEST > 1.0 + 1e-9:
        raise InputError(
            f" = {every:g} s: {frequency[-1]:g} Hz has only "
            f"{1.0 / (frequency[-1] * every):.3g} samples in a cycle, and at least {FEWEST} are "
            "needed; sample faster, or leave every out",
            "every",
        )


def common_spacing(frequency: NDArray) -> float:
    """Largest spacing (Hz) of lines from 0 Hz on that hold all the frequencies.

    Raises
    ------
    InputError
        None that is coarse enough.
    """
    step = float(np.diff(frequency, prepend=0.0)[frequency > 0.0].min())
    for divisor in range(1, MOST_LINES + 1):
        multiple = frequency * divisor / step
        if np.abs(multiple - np.rint(multiple)).max() < 1e-6 * divisor:
            return float(frequency[-1] / np.rint(multiple[-1]))
    near = max(float(f"{step:.1g}"), 1e-300)
    raise InputError(
        ": the lines of a record are multiples of one spacing, and these are of none "
        f"above {step / MOST_LINES:.3g} Hz; give multiples, as numpy.arange({near:g}, "
        f"{frequency[-1]:g}, {near:g})",
        "frequencies",
    )


def smooth_history(factor: NDArray, every: float) -> Table:
    """History through samples (k,) of a factor, the first and the last 0: a cubic spline.

    Below a tenth of the sampling frequency its spectrum is that of the samples to 3e-5: a cubic
    spline errs by (2 pi f dt)^4 / 720.
    """
    return Table(every * np.arange(len(factor)), factor, smooth=True)


class Estimate(NamedTuple):
    """What records tell at the frequencies wanted."""

    response: NDArray[np.complex128]  # (m, n, 3)
    coherence: NDArray[np.float64]  # (m, n, 3)
    left: float  # of the largest motion, at the end of the records


def transform(
    drive: NDArray, response: NDArray, record: Record, rate: float, estimator: str
) -> Estimate:
    """Estimate the response, and warn where a motion has not died away.

    Parameters
    ----------
    drive, response : ndarray, shape (records, length), (records, samples + 1, n, 3)
        Records, the responses without the zeros to append.
    """
    responses = np.zeros((*drive.shape, *response.shape[2:]))
    part = response[:, : record.samples]
    responses[:, : record.samples] = part
    if rate > 0.0:
        window = exponential_window(record.length, record.every, rate)
        drive = drive * window
        responses *= window[:, None, None]
    size = np.abs(responses).max(axis=(2, 3))
    end = slice(int((1.0 - END) * record.samples), record.samples)
    whole = size.max(axis=1)
    left = float((size[:, end].max(axis=1) / np.where(whole > 0.0, whole, 1.0)).max())
    if left > LEFT:
        decay = 2.0 * np.log(1.0 / LEFT) / record.duration
        warnings.warn(
            f"duration: {left:.1%} of the motion is left at the end of {record.duration:.3g} s, "
            "which blurs the response; give a longer duration, more damping, or "
            f"window_rate = {decay:.2g} (1/s)",
            FoldynWarning,
            stacklevel=5,
        )
    found = frequency_response(drive, responses, record.every, estimator)
    lines = record.lines
    return Estimate(found.response[lines], found.coherence[lines], left)
