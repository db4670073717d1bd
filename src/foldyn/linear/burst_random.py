"""Frequency response from the motions after bursts of random excitation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError
from foldyn.linear.answer import Answer
from foldyn.linear.records import check_records, record_of, smooth_history, transform
from foldyn.linear.time_domain import Integration, Rig, overall
from foldyn.values import choice, number, whole

PER_CYCLE = 20  # samples in a cycle of the highest frequency
BAND = (0.8, 1.2)  # of the lowest and the highest frequency: what is excited
TAPER = 0.1  # of the burst: how much of it rises and falls
ESTIMATORS = ("h1", "h2")


@dataclass(frozen=True)
class BurstRandom(Integration):
    """Options of the burst random method, beside those of the integration.

    Parameters
    ----------
    averages : int
        Number of bursts, each from the state at rest, at least 2.
    seed : int
        Of the random numbers: the same seed gives the same bursts.
    burst : float
        Part of each record that is driven; in the rest the motion dies away.
    estimator : {"h1", "h2"}
        As of `signals.frequency_response`.
    duration : float, optional
        Time (s) to simulate for each burst. Without it damping leaves 1e-5 of a motion after the
        burst; without alpha, it is the inverse of the frequencies' spacing.
    every : float, optional
        Largest sampling interval (s); a 20th of a cycle of the highest frequency by default.
    window_rate : float
        As of the impulse method.
    """

    averages: int = 8
    seed: int = 0
    burst: float = 0.5
    estimator: str = "h1"
    duration: float | None = None
    every: float | None = None
    window_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        for name, least in (("averages", 2), ("seed", 0)):
            whole(name, getattr(self, name), least=least)
        if not 0.0 < number("burst", self.burst) < 1.0:
            raise InputError(f"burst = {self.burst}: must be a part of the record, between 0 and 1")
        choice("estimator", self.estimator, ESTIMATORS)
        for name in ("duration", "every"):
            if getattr(self, name) is not None:
                number(name, getattr(self, name), above=0.0)
        number("window_rate", self.window_rate, least=0.0)


def burst_random(rig: Rig, frequency: NDArray, options: BurstRandom, report: Reporter) -> Answer:
    """Response to random bursts, with its coherence.

    Warns
    -----
    FoldynWarning
        Motions have not died away at the end.
    """
    alpha = rig.case.damping.alpha
    quiet = 1.0 - options.burst
    every = 1.0 / (PER_CYCLE * float(frequency[-1])) if options.every is None else options.every
    record = record_of(frequency, alpha, quiet, every, options.duration)
    check_records("averages", record, options.averages, len(rig.state))
    count = int(options.burst * record.samples)
    random = np.random.default_rng(options.seed)
    drives = np.zeros((options.averages, record.length))
    responses = []
    for k in range(options.averages):
        factor = _burst(random, count, record.every, frequency)
        drives[k, : len(factor)] = rig.drive.value * factor
        history = smooth_history(factor, record.every)
        told = overall(report, k * record.duration, options.averages * record.duration)
        responses.append(rig.run(history, record.duration, record.every, told)[1])
    found = transform(drives, np.array(responses), record, options.window_rate, options.estimator)
    held = rig.case.fixed
    found.response[:, held] = np.where(rig.drive.vector[held] != 0.0, 1.0, 0.0)
    facts = {
        "estimator": options.estimator,
        "averages": options.averages,
        "seed": options.seed,
        "burst": options.burst,
        "record": record.duration,
        "every": record.every,
        "window_rate": options.window_rate,
        "left_at_end": found.left,
    }
    return Answer(found.response, {"coherence": found.coherence}, facts)


def _burst(
    random: np.random.Generator, count: int, every: float, frequency: NDArray
) -> NDArray[np.float64]:
    """Samples of random numbers within the band wanted, of root mean square 1, tapered to 0."""
    if count < 32:
        raise InputError(
            f"burst: {count} samples are too few; give a longer duration, or a larger part of it"
        )
    lines = np.fft.rfftfreq(count, every)
    inside = (lines >= BAND[0] * frequency[0]) & (lines <= BAND[1] * frequency[-1]) & (lines > 0.0)
    if inside.sum() < 4:
        raise InputError(
            f"burst: only {int(inside.sum())} lines of {1.0 / (count * every):.3g} Hz lie between "
            f"{frequency[0]:g} and {frequency[-1]:g} Hz; give a longer duration, or a wider band"
        )
    spectrum = np.zeros(len(lines), complex)
    spectrum[inside] = random.normal(size=inside.sum()) + 1j * random.normal(size=inside.sum())
    factor = np.fft.irfft(spectrum, count)
    ramp = np.minimum(np.arange(count), np.arange(count)[::-1]) / (TAPER * (count - 1))
    factor *= np.sin(0.5 * np.pi * np.minimum(ramp, 1.0)) ** 2
    return factor / np.sqrt(np.mean(factor**2))
