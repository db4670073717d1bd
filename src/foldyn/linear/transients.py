"""Frequency response from decaying motions: after a pulse, or bursts of random excitation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases import Table
from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError, warn
from foldyn.linear.excitation import Answer
from foldyn.linear.time_domain import Duration, Integration, Rig, overall
from foldyn.ram_limit import check_memory
from foldyn.signals import exponential_window, frequency_response
from foldyn.values import choice, number, whole

MOST_LINES = 100  # most spectral lines of a record per spacing of the frequencies
DECAYED = 1e-5  # share of a motion left by damping at the end of the default duration
COPIES = 4  # copies of the samples in memory, while spectra are computed
LEFT = 1e-3  # largest response at the end of a record, relative to its maximum
END = 0.05  # fraction of the record, at its end, in which the remainder is measured
FEWEST = 4  # least number of samples in a cycle of the highest frequency, and in a pulse
PER_PULSE = 10  # samples in the pulse
WIDTH = 0.5  # length of the pulse, in cycles of the highest frequency
WEAK = 1.5  # at frequencies with more cycles per pulse, the pulse's spectrum is too weak
STILL = 8  # samples of rest before and after a pulse, in which the spline decays
PER_CYCLE = 20  # samples in a cycle of the highest frequency, in bursts
BAND = (0.8, 1.2)  # band that a burst excites, in units of the lowest and highest frequency
TAPER = 0.1  # fraction of the burst in which it rises and falls


@dataclass(frozen=True)
class Impulse(Integration):
    """Options of the impulse method, in addition to the integration.

    Parameters
    ----------
    pulse : float, optional
        Duration (s) of the pulse (1 - cos(2 pi t / pulse)) / 2, whose height is the drive. By
        default half a cycle of the highest frequency, at which the spectrum of the pulse still has
        0.85 of its strength.
    duration : float, optional
        Time (s) to simulate. By default, until damping leaves 1e-5 of a motion; without alpha, the
        inverse of the spacing of the frequencies.
    interval : float, optional
        Largest sampling interval (s); a tenth of the pulse by default, at most a 20th of a cycle
        of the highest frequency.
    window_rate : float
        Decay rate (1/s) of an exponential window, for motions that have not decayed at the end. It
        adds damping to the response, which `peaks_of` subtracts again.
    """

    pulse: Duration | None = None
    duration: Duration | None = None
    interval: Duration | None = None
    window_rate: Annotated[float, Check(number, least=0.0)] = 0.0


@dataclass(frozen=True)
class BurstRandom(Integration):
    """Options of the burst random method, in addition to the integration.

    Parameters
    ----------
    averages : int
        Number of bursts, each from the state at rest, at least 2.
    seed : int
        Seed of the random numbers: the same seed gives the same bursts.
    burst : float
        Driven fraction of each record; in the rest the motion decays.
    estimator : {"h1", "h2"}
        As in `signals.frequency_response`.
    duration : float, optional
        Time (s) to simulate for each burst. By default until damping leaves 1e-5 of a motion after
        the burst; without alpha, the inverse of the spacing of the frequencies.
    interval : float, optional
        Largest sampling interval (s); a 20th of a cycle of the highest frequency by default.
    window_rate : float
        As in the impulse method.
    """

    averages: Annotated[int, Check(whole, least=2)] = 8
    seed: Annotated[int, Check(whole, least=0)] = 0
    burst: Annotated[float, Check(number, above=0.0, below=1.0)] = 0.5
    estimator: Annotated[str, Check(choice, known=("h1", "h2"))] = "h1"
    duration: Duration | None = None
    interval: Duration | None = None
    window_rate: Annotated[float, Check(number, least=0.0)] = 0.0


def impulse(rig: Rig, frequency: NDArray, options: Impulse, report: Reporter) -> Answer:
    """Response to a pulse.

    Warns
    -----
    FoldynWarning
        The motion has not decayed at the end.
    """
    width = WIDTH / float(frequency[-1])
    pulse = width if options.pulse is None else options.pulse
    interval = min(pulse, width) / PER_PULSE if options.interval is None else options.interval
    record = record_of(frequency, rig.case.rayleigh.alpha, 1.0, interval, options.duration)
    check_records("duration", record, 1, len(rig.state))
    factor = _pulse(float(frequency[-1]), pulse, record)
    answer = respond(rig, [factor], record, options.window_rate, "h1", report)
    width = (len(factor) - 1 - 2 * STILL) * record.interval
    return Answer(answer.response, {}, {"pulse": width, **answer.facts})


def _pulse(highest: float, pulse: float, record: Record) -> NDArray:
    """Samples of the pulse, with samples of rest on either side."""
    if highest * pulse > WEAK:
        raise InputError(
            f"pulse = {pulse:g} s: has no strength left at {highest:g} Hz; take at most "
            f"{1.0 / highest:.3g} s, or lower frequencies"
        )
    count = round(pulse / record.interval)
    if count < FEWEST:
        raise InputError(
            f" = {record.interval:g} s: the pulse of {pulse:g} s has only {count} samples, and "
            f"at least {FEWEST} are needed; sample faster, or leave interval out",
            "interval",
        )
    if count + 2 * STILL >= record.samples:
        raise InputError(
            f"pulse = {pulse:g} s: does not end within the {record.duration:.3g} s of the motion; "
            "shorten it, or give a longer duration"
        )
    return np.pad(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(count + 1) / count), STILL)


def burst_random(rig: Rig, frequency: NDArray, options: BurstRandom, report: Reporter) -> Answer:
    """Response to random bursts, with its coherence.

    Warns
    -----
    FoldynWarning
        Motions have not decayed at the end.
    """
    alpha = rig.case.rayleigh.alpha
    quiet = 1.0 - options.burst
    interval = options.interval or 1.0 / (PER_CYCLE * float(frequency[-1]))
    record = record_of(frequency, alpha, quiet, interval, options.duration)
    check_records("averages", record, options.averages, len(rig.state))
    count = int(options.burst * record.samples)
    random = np.random.default_rng(options.seed)
    bursts = [_burst(random, count, record.interval, frequency) for _ in range(options.averages)]
    answer = respond(rig, bursts, record, options.window_rate, options.estimator, report)
    held = rig.case.fixed
    answer.response[:, held] = np.where(rig.drive.vector[held] != 0.0, 1.0, 0.0)
    own = {name: getattr(options, name) for name in ("estimator", "averages", "seed", "burst")}
    return answer._replace(facts={**own, **answer.facts})


def _burst(random: np.random.Generator, count: int, interval: float, frequency: NDArray) -> NDArray:
    """Random samples within the band, of root mean square 1, tapered to 0."""
    if count < 32:
        raise InputError(
            f"burst: {count} samples are too few; give a longer duration, or a larger part of it"
        )
    lines = np.fft.rfftfreq(count, interval)
    inside = (lines >= BAND[0] * frequency[0]) & (lines <= BAND[1] * frequency[-1]) & (lines > 0.0)
    if inside.sum() < 4:
        raise InputError(
            f"burst: only {int(inside.sum())} lines of {1.0 / (count * interval):.3g} Hz lie "
            f"between {frequency[0]:g} and {frequency[-1]:g} Hz; give a longer duration, or a "
            "wider band"
        )
    spectrum = np.zeros(len(lines), complex)
    spectrum[inside] = random.normal(size=inside.sum()) + 1j * random.normal(size=inside.sum())
    factor = np.fft.irfft(spectrum, count)
    ramp = np.minimum(np.arange(count), np.arange(count)[::-1]) / (TAPER * (count - 1))
    factor *= np.sin(0.5 * np.pi * np.minimum(ramp, 1.0)) ** 2
    return factor / np.sqrt(np.mean(factor**2))


@dataclass(frozen=True)
class Record:
    """Sampling of transient records whose spectral lines include the given frequencies.

    Attributes
    ----------
    interval : float
        Sampling interval (s).
    samples : int
        Samples simulated.
    length : int
        Samples of the zero-padded record; its lines are 1 / (length interval) apart.
    lines : ndarray of int, shape (m,)
        Line numbers of the frequencies.
    """

    interval: float
    samples: int
    length: int
    lines: NDArray[np.int64]

    @property
    def duration(self) -> float:
        """Time simulated (s)."""
        return self.samples * self.interval


def record_of(
    frequency: NDArray, alpha: float, quiet: float, interval: float, duration: float | None
) -> Record:
    """Choose the sampling of a transient record.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        Frequencies wanted (Hz).
    alpha : float
        Mass-proportional damping (1/s): a motion falls at least as fast as exp(-alpha t / 2).
    quiet : float
        Fraction of the record after the drive has ended.
    interval : float
        Largest sampling interval (s).
    duration : float, optional
        Time to simulate (s).
    """
    spacing = common_spacing(frequency)
    if duration is None:
        decay = 2.0 * math.log(1.0 / DECAYED) / alpha if alpha > 0.0 else 0.0
        duration = decay / quiet if decay > 0.0 else 1.0 / spacing
    whole = math.ceil(duration * spacing * (1.0 - 1e-9)) / spacing
    length = math.ceil(whole / interval * (1.0 - 1e-9))
    interval = whole / length
    if frequency[-1] * interval * FEWEST > 1.0 + 1e-9:
        raise InputError(
            f" = {interval:g} s: {frequency[-1]:g} Hz has only "
            f"{1.0 / (frequency[-1] * interval):.3g} samples in a cycle, and at least {FEWEST} are "
            "needed; sample faster, or leave interval out",
            "interval",
        )
    samples = min(math.ceil(duration / interval * (1.0 - 1e-9)), length)
    return Record(interval, samples, length, np.rint(frequency * whole).astype(np.int64))


def check_records(field: str, record: Record, count: int, nodes: int) -> None:
    """Refuse records too large for memory."""
    what = f"{float(count):.3g} records of {float(record.length):.3g} samples of {nodes} nodes"
    check_memory(field, what, 8.0 * COPIES * count * record.length * 3 * nodes, "take fewer")


def common_spacing(frequency: NDArray) -> float:
    """Largest spacing (Hz) of spectral lines, from 0 Hz on, that include all given frequencies.

    Raises
    ------
    InputError
        No spacing is coarse enough.
    """
    step = float(np.diff(frequency, prepend=0.0)[frequency > 0.0].min())
    for divisor in range(1, MOST_LINES + 1):
        multiple = frequency * divisor / step
        if np.abs(multiple - np.rint(multiple)).max() < 1e-6 * divisor:
            return float(frequency[-1] / np.rint(multiple[-1]))
    near = max(float(f"{step:.1g}"), 1e-300)
    raise InputError(
        ": the lines of a record are multiples of one spacing, but these have no common "
        f"spacing above {step / MOST_LINES:.3g} Hz; give multiples, as numpy.arange({near:g}, "
        f"{frequency[-1]:g}, {near:g})",
        "frequencies",
    )


def respond(
    rig: Rig, factors: Sequence[NDArray], record: Record, rate: float, estimator: str,
    report: Reporter,
) -> Answer:  # fmt: skip
    """Response estimated from motions under the drive, each starting at rest in the state.

    Warns if a motion has not decayed.

    Parameters
    ----------
    factors : sequence of ndarray, shape (k,)
        Samples of the factor on the drive in each motion; the first and the last are 0, and a cubic
        spline connects them. Below a tenth of the sampling frequency the spectrum of the spline
        agrees with that of the samples to 3e-5: its error is (2 pi f dt)^4 / 720.
    rate : float
        Decay rate of the exponential window, 1/s.
    """
    drive = np.zeros((len(factors), record.length))
    responses = np.zeros((*drive.shape, *rig.state.shape))
    for k, factor in enumerate(factors):
        history = Table(record.interval * np.arange(len(factor)), factor, smooth=True)
        ahead = overall(report, k * record.duration, len(factors) * record.duration)
        motion = rig.run(history, record.duration, record.interval, ahead)[1]
        drive[k, : len(factor)] = rig.drive.value * factor
        responses[k, : record.samples] = motion[: record.samples]
    if rate > 0.0:
        window = exponential_window(record.length, record.interval, rate=rate)
        drive = drive * window
        responses *= window[:, None, None]
    size = np.abs(responses).max(axis=(2, 3))
    end = slice(int((1.0 - END) * record.samples), record.samples)
    whole = size.max(axis=1)
    left = float((size[:, end].max(axis=1) / np.where(whole > 0.0, whole, 1.0)).max())
    if left > LEFT:
        decay = 2.0 * np.log(1.0 / LEFT) / record.duration
        warn(
            f"duration: {left:.1%} of the motion is left at the end of {record.duration:.3g} s, "
            "which blurs the response; give a longer duration, more damping, or "
            f"window_rate = {decay:.2g} (1/s)",
            "frequency-response.md#responses-from-simulated-motions",
        )
    estimate = frequency_response(drive, responses, dt=record.interval, estimator=estimator)
    coherence = {"coherence": estimate.coherence[record.lines]}
    facts = {"record": record.duration, "interval": record.interval, "window_rate": rate}
    return Answer(estimate.response[record.lines], coherence, facts | {"left_at_end": left})
