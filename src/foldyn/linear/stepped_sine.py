"""Frequency response from steady motions under a sine, frequency after frequency."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Harmonic, State
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.answer import Answer
from foldyn.linear.time_domain import Integration, Rig
from foldyn.signals import stepped_sine as response_per_drive
from foldyn.values import choice, number, whole

PER_CYCLE = 32  # samples in a cycle
SLOWEST = 0.99  # ratio of successive changes above which no decay is seen
NEGLIGIBLE = 1e-12  # change that is rounding
_NAMED = 5


@dataclass(frozen=True)
class SteppedSine(Integration):
    """Options of the stepped sine method, beside those of the integration.

    Parameters
    ----------
    cycles : int
        Cycles whose motion is fitted, at least 2.
    settled : float
        Relative error that the transient may leave, as estimated from its decay: cycles are added
        until it is below.
    most_cycles : int
        Cycles at a frequency after which to go on all the same.
    sweep : {"up", "down"}
        Whether frequencies rise or fall; each motion starts from the end of the one before.
    """

    cycles: int = 4
    settled: float = 1e-3
    most_cycles: int = 400
    sweep: str = "up"

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        for name, least in (("cycles", 2), ("most_cycles", 3 * self.cycles)):
            whole(name, getattr(self, name), least=least)
        number("settled", self.settled, above=0.0)
        choice("sweep", self.sweep, ("up", "down"))


def stepped_sine(rig: Rig, frequency: NDArray, options: SteppedSine, report: Reporter) -> Answer:
    """Response to sines, and how unsteady each motion is.

    Warns
    -----
    FoldynWarning
        Motions have not settled.
    """
    if rig.case.damping.state == "start":
        raise InputError(
            'damping: with state = "start" each motion would take K0 where the one before has '
            'ended; use state = "rest", or method = "impulse" or "burst_random"'
        )
    response = np.empty((len(frequency), *rig.state.shape), complex)
    unsteady, spent = np.empty(len(frequency)), np.zeros(len(frequency))
    order = np.arange(len(frequency))
    state: State | None = None
    done = 0.0
    for place, k in enumerate(order if options.sweep == "up" else order[::-1]):
        run = _Run(rig, float(frequency[k]), options, state)
        while not run.settled:
            ahead = (len(frequency) - place) * 3 * run.block

            def told(now: Progress, before: float = done + run.time, left: float = ahead) -> None:
                done_now = before + now.time
                report(Progress(done_now, before + left, now.steps, now.energy_error))

            run.advance(told)
        response[k], unsteady[k], spent[k] = run.response, run.unsteady, run.time * frequency[k]
        state, done = run.state, done + run.time
    _warn_of(frequency[unsteady > options.settled], options)
    facts = {
        "cycles": options.cycles,
        "cycles_in_all": round(float(spent.sum())),
        "settled": options.settled,
        "sweep": options.sweep,
    }
    return Answer(response, {"unsteadiness": unsteady}, facts)


class _Run:
    """Motion at one frequency, in blocks of cycles."""

    def __init__(
        self, rig: Rig, frequency: float, options: SteppedSine, state: State | None
    ) -> None:
        self.rig, self.frequency, self.options = rig, frequency, options
        self.state, self.history = state, Harmonic(frequency)
        self.block = options.cycles / frequency
        self.blocks = 0
        self.response = np.zeros(0)
        self.unsteady = np.inf
        self._change = np.inf

    @property
    def time(self) -> float:
        """Simulated so far (s)."""
        return self.blocks * self.block

    @property
    def settled(self) -> bool:
        """Whether to go on to the next frequency."""
        long = (self.blocks + 1) * self.options.cycles > self.options.most_cycles
        return self.unsteady <= self.options.settled or long

    def advance(self, report: Reporter) -> None:
        """One more block."""
        every = 1.0 / (PER_CYCLE * self.frequency)
        time, motion, self.state = self.rig.run(
            self.history, self.block, every, report, self.time, self.state
        )
        drive = self.rig.drive.value * self.history(time)
        # the last sample is the first one of the next block
        found = response_per_drive(time[:-1], drive[:-1], motion[:-1], self.frequency)
        if self.blocks:
            before, self._change = self._change, _relative(found, self.response)
            self.unsteady = _remaining(self._change, before)
        self.response, self.blocks = found, self.blocks + 1


def _relative(now: NDArray, before: NDArray) -> float:
    return float(np.abs(now - before).max() / max(np.abs(now).max(), 1e-300))


def _remaining(change: float, before: float) -> float:
    """What is left of changes that fall by the same factor from block to block."""
    if change <= NEGLIGIBLE:
        return change
    if not np.isfinite(before):
        return np.inf
    ratio = min(change / before, SLOWEST)
    return change * max(ratio / (1.0 - ratio), 1.0)


def _warn_of(unsettled: NDArray, options: SteppedSine) -> None:
    if not unsettled.size:
        return
    shown = ", ".join(f"{f:.6g}" for f in unsettled[:_NAMED])
    more = " and others" if unsettled.size > _NAMED else ""
    warnings.warn(
        f"frequencies: the motion has not settled after {options.most_cycles} cycles at {shown} "
        f"Hz{more} (see unsteadiness); give most_cycles, or damping: without it a transient does "
        "not die away",
        FoldynWarning,
        stacklevel=4,
    )
