"""Frequency response from steady motions under a sine, one frequency at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases import Harmonic, State
from foldyn.dynamics.progress import Reporter
from foldyn.linear.excitation import Answer, warn_at
from foldyn.linear.time_domain import Integration, Rig, overall
from foldyn.signals import stepped_sine as response_per_drive
from foldyn.values import choice, number, whole

PER_CYCLE = 32  # samples in a cycle
SLOWEST = 0.99  # ratio of successive changes above which no decay is assumed
NEGLIGIBLE = 1e-12  # change at round-off


@dataclass(frozen=True)
class SteppedSine(Integration):
    """Options of the stepped sine method, in addition to the integration.

    Parameters
    ----------
    cycles : int
        Cycles whose motion is fitted, at least 2.
    settled : float
        Relative error that the transient may leave, estimated from its decay: cycles are added
        until the error is smaller.
    most_cycles : int
        Largest number of cycles at a frequency, settled or not.
    sweep : {"up", "down"}
        Whether frequencies rise or fall; each motion starts from the end of the previous one.
    """

    cycles: Annotated[int, Check(whole, least=2)] = 4
    settled: Annotated[float, Check(number, above=0.0)] = 1e-3
    most_cycles: Annotated[int, Check(whole)] = 400
    sweep: Annotated[str, Check(choice, known=("up", "down"))] = "up"

    def agree(self) -> None:
        """Refuse too few cycles to tell whether a motion has settled."""
        whole("most_cycles", self.most_cycles, least=3 * self.cycles)


def stepped_sine(rig: Rig, frequency: NDArray, options: SteppedSine, report: Reporter) -> Answer:
    """Response to sines, and the unsteadiness of each motion.

    Warns
    -----
    FoldynWarning
        Motions have not settled.
    """
    response = np.empty((len(frequency), *rig.state.shape), complex)
    unsteady, spent = np.empty(len(frequency)), np.zeros(len(frequency))
    order = np.arange(len(frequency))
    state: State | None = None
    done = 0.0
    for place, k in enumerate(order if options.sweep == "up" else order[::-1]):
        motion = _Motion(rig, float(frequency[k]), options, state)
        while not motion.settled:
            before, ahead = done + motion.time, (len(frequency) - place) * 3 * motion.block
            motion.advance(overall(report, before, before + ahead))
        response[k], unsteady[k] = motion.response, motion.unsteady
        spent[k] = motion.time * frequency[k]
        state, done = motion.state, done + motion.time
    warn_at(
        frequency[unsteady > options.settled],
        f"the motion has not settled after {options.most_cycles} cycles at {{}} (see "
        "unsteadiness); give most_cycles, or damping: without it a transient does not die away",
    )
    facts = {
        "cycles": options.cycles,
        "cycles_in_all": round(float(spent.sum())),
        "settled": options.settled,
        "sweep": options.sweep,
    }
    return Answer(response, {"unsteadiness": unsteady}, facts)


class _Motion:
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
        """Simulated time so far (s)."""
        return self.blocks * self.block

    @property
    def settled(self) -> bool:
        """Whether to continue with the next frequency."""
        long = (self.blocks + 1) * self.options.cycles > self.options.most_cycles
        return self.unsteady <= self.options.settled or long

    def advance(self, report: Reporter) -> None:
        """Simulate one more block."""
        interval = 1.0 / (PER_CYCLE * self.frequency)
        time, motion, self.state = self.rig.run(
            self.history, self.block, interval, report, self.time, self.state
        )
        drive = self.rig.drive.value * self.history(time)
        # the last sample is the first one of the next block
        response = response_per_drive(
            time[:-1], drive[:-1], response=motion[:-1], frequency=self.frequency
        )
        if self.blocks:
            largest = max(np.abs(response).max(), 1e-300)
            change = float(np.abs(response - self.response).max() / largest)
            self.unsteady, self._change = _remaining(change, self._change), change
        self.response, self.blocks = response, self.blocks + 1


def _remaining(change: float, before: float) -> float:
    """Remaining error of changes that fall geometrically from block to block."""
    if change <= NEGLIGIBLE:
        return change
    if not np.isfinite(before):
        return np.inf
    ratio = min(change / before, SLOWEST)
    return change * max(ratio / (1.0 - ratio), 1.0)
