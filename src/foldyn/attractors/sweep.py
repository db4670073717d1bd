"""`swept_sine`: the motion under a sine with continuously changing frequency."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.attractors.diagram import FREQUENCY, RESOLUTION, SWEEPS, Steady, bracketed
from foldyn.attractors.drive import at_frequency, drive_frequency, driven_frequency, with_histories
from foldyn.attractors.jumps import Jump, is_jump, jump_variables, jumps_between
from foldyn.attractors.run import Run, Stretch, check_measure, extremes, measured
from foldyn.cases import Case, Chirp, Harmonic, State
from foldyn.dynamics.progress import Reporter, reported
from foldyn.errors import ComputationError, InputError, told_once
from foldyn.linear.time_domain import overall
from foldyn.ram_limit import check_memory
from foldyn.results import Quantity
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import variable
from foldyn.values import choice, number, numbers, of_kind, whole

PER_CYCLE = 48  # samples in a cycle of the highest frequency
FEWEST = 10  # least cycles in a sweep
HELD, FEWEST_RECORDED = 50, 4  # least cycles to settle, and cycles recorded, at a held frequency


def swept_sine(
    case: Case,
    measure: Quantity,
    *,
    frequencies: ArrayLike,
    duration: float,
    sweep: str = "both",
    settle: int = 50,
    resolution: float = 0.01,
    initial: State | None = None,
    method: str = "rk4",
    dt: float | None = None,
    tolerance: float | None = None,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Motion under a slow frequency sweep of the drive, up or down, and amplitude in each cycle.

    The harmonic histories of the case become chirps with linearly changing frequency.

    Parameters
    ----------
    case : Case
        As in `bifurcation_diagram`.
    measure : Quantity
        As in `bifurcation_diagram`.
    frequencies : (float, float)
        Lower and upper frequency (Hz) of the slowest of these histories; the others keep their
        frequency ratio to it, and all keep their phases.
    duration : float
        Duration (s) of a sweep from one frequency to the other.
    sweep : {"up", "down", "both"}
        Direction; "both" sweeps up, and then down from the end of the upward sweep.
    settle : int
        Number of cycles at the first frequency before each sweep. It is also the number of cycles
        (but at least 50) at each frequency that is held to tell a jump from a steep curve.
    resolution : float
        Relative width in frequency within which a change of the amplitude, by more than 20 % of the
        larger amplitude, may be a jump. It is a jump if motions at stepped frequencies, started
        before the change, also jump, as in `bifurcation_diagram`. To show jumps, the sweep must be
        slow enough for a vibration to decay within this width.
    initial : State, optional
        Where the motion starts; rest by default.
    method, dt, tolerance :
        As in `simulate`; `dt` is the largest step (s).
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`.

    Returns
    -------
    xarray.Dataset
        Along `sweep` and `cycle`: `frequency` (Hz), the inverse duration of the cycle, and
        `amplitude`, half the difference between the measure's extremes in the cycle. Cycles are
        numbered by increasing frequency. Along `jump`: the same variables as in
        `bifurcation_diagram`.

    Raises
    ------
    InputError
        An argument out of range, a case without drive, a sweep of fewer than ten cycles.
    ComputationError
        The motion fails.

    Notes
    -----
    A sweep passes a fold before the motion jumps; the faster the sweep, the later the jump.
    `bifurcation_diagram` avoids this because it waits at each frequency.

    Examples
    --------
    >>> import foldyn as fd
    >>> s = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.1, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> push = fd.Force([0, 1], (1.0, 0, 0), history=fd.Harmonic(5.0))
    >>> case = fd.Case(s, supports, [push], damping=fd.Rayleigh(alpha=20.0))
    >>> ridge = fd.Quantity("m", "height of the ridge", function=lambda u, v, t: u[2, 2])
    >>> swept = swept_sine(case, ridge, frequencies=(5.0, 10.0), duration=2.0)
    >>> dict(swept.amplitude.sizes)
    {'sweep': 2, 'cycle': 15}
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    check_measure(measure, len(case.structure.nodes))
    driven_frequency(case, "fd.swept_sine")
    ends = numbers("frequencies", frequencies)
    if ends.shape != (2,) or not 0.0 < ends[0] < ends[1]:
        raise InputError(
            ": must be two frequencies (Hz) above 0, the lower one first", "frequencies"
        )
    duration = number("duration", duration, above=0.0, unit="s")
    if duration * ends[0] < FEWEST:
        raise InputError(
            f" = {duration:g} s: holds fewer than {FEWEST} cycles of {ends[0]:g} Hz; sweep slower",
            "duration",
        )
    choice("sweep", sweep, SWEEPS)
    settle = whole("settle", settle, least=0)
    resolution = number("resolution", resolution, above=0.0)
    run = Run(method, dt, tolerance, initial)
    samples, nodes = PER_CYCLE * float(ends[1]) * duration, len(case.structure.nodes)
    needed = 8.0 * samples * (6 * nodes + len(case.reaction_dofs))
    check_memory("duration", f"{samples:.3g} samples of {nodes} nodes", needed, "sweep faster")
    ways = ["up", "down"] if sweep == "both" else [sweep]
    frequency, amplitude, jumps = [], [], list[Jump]()
    with reported(progress) as report, told_once():
        for k, way in enumerate(ways):
            first, last = (ends if way == "up" else ends[::-1]).tolist()
            line, before = Line(first, last, duration), k * duration
            tell = overall(report, before, len(ways) * duration)
            stretch, run = _glide(case, line, settle, run, 1.0 / (PER_CYCLE * ends[1]), tell)
            top, bottom = extremes(measured(measure, stretch))
            cycle = np.searchsorted(stretch.time, line.cycles[:-1] * (1.0 - 1e-12))
            own = 0.5 * (np.maximum.reduceat(top, cycle) - np.minimum.reduceat(bottom, cycle))
            rates = 1.0 / np.diff(line.cycles)
            glide = Glide(case, measure, line, settle, stretch, rates, own, run)
            found = jumps_between(way, rates, own, resolution)
            jumps += [jump for jump in found if glide.folds(jump, resolution)]
            order = slice(None, None, 1 if way == "up" else -1)
            frequency.append(rates[order])
            amplitude.append(own[order])
    along, text = ("sweep", "cycle"), measure.text or "measure"
    data = {
        "amplitude": variable(along, amplitude, measure.units, f"amplitude of {text}"),
        **jump_variables(jumps, FREQUENCY, measure),
    }
    coordinates = {
        "sweep": variable(("sweep",), np.array(ways), "", "sweep"),
        "frequency": variable(along, frequency, FREQUENCY.units, FREQUENCY.text),
    }
    facts = {
        "method": method, "duration": duration, "settle": settle, "resolution": resolution,
        "wall_seconds": time.perf_counter() - began,
    }  # fmt: skip
    return result_dataset("swept_sine", case, data, coordinates, facts)


class Line(NamedTuple):
    """A frequency (Hz) that changes linearly from `start` to `end` in `duration` (s)."""

    start: float
    end: float
    duration: float

    @property
    def slope(self) -> float:
        """Rate of change of the frequency (Hz/s)."""
        return (self.end - self.start) / self.duration

    @property
    def cycles(self) -> NDArray[np.float64]:
        """Times (s) at which each cycle begins, and at which the last cycle ends."""
        count = int(0.5 * (self.start + self.end) * self.duration * (1.0 + 1e-12))
        turns = np.arange(count + 1)
        root = np.sqrt(self.start**2 + 2.0 * self.slope * turns)
        return 2.0 * turns / (self.start + root)

    def chirp(self, lowest: float) -> Callable[[Harmonic], Chirp]:
        """Map harmonic histories to chirps along this line, for a `lowest` drive frequency (Hz).

        The chirps continue for a cycle beyond the end of the line, so that the drive does not jump
        at the end.
        """
        more = 1.0 / max(self.start, self.end)
        length, end = self.duration + more, self.end + self.slope * more

        def made(own: Harmonic) -> Chirp:
            ratio = own.frequency / lowest
            return Chirp(ratio * self.start, ratio * end, length, own.phase)

        return made


class Glide(NamedTuple):
    """A sweep, and the amplitude of each of its cycles."""

    case: Case
    measure: Quantity
    line: Line
    settle: int
    stretch: Stretch
    rates: NDArray[np.float64]  # (k,) Hz
    amplitude: NDArray[np.float64]  # (k,)
    run: Run

    def folds(self, jump: Jump, width: float) -> bool:
        """Whether motions at stepped frequencies also jump, so that the curve is not just steep.

        The sweep passes a fold before it jumps, so the steps begin earlier, at a frequency at which
        the motion keeps its amplitude if the frequency is held.
        """
        held = max(self.settle, HELD)
        steady = Steady(partial(at_frequency, self.case), self.measure, held, FEWEST_RECORDED)
        last = first = int(np.argmin(np.abs(self.rates - jump.place)))
        back = 0.0
        try:
            while True:
                before = steady.point(*self._at(first))
                if first == 0 or not is_jump(before.amplitude, self.amplitude[first]):
                    break
                back = 2.0 * back + width * jump.place
                apart = np.abs(self.rates[:last] - jump.place) >= back
                first = int(np.flatnonzero(apart)[-1]) if apart.any() else 0
            after = steady.point(before.run, jump.after)
            return bool(bracketed(steady, jump.sweep, [before, after], RESOLUTION))
        except ComputationError:  # a motion at a held frequency fails
            return True

    def _at(self, cycle: int) -> tuple[Run, float, float]:
        """The motion in a cycle, its frequency (Hz), and the elapsed part of the cycle (s)."""
        k = int(np.searchsorted(self.stretch.time, self.line.cycles[cycle]))
        t, frequency, state = self.stretch.time[k], float(self.rates[cycle]), self.run.state
        turns = (self.line.start + 0.5 * self.line.slope * t) * t
        place, speed = self.stretch.displacement[k], self.stretch.velocity[k]
        memory = None if self.stretch.memory is None else self.stretch.memory[k]
        origin = state and state.origin and replace(state.origin, flow=None, looked=0)
        here = State(place, speed, memory, origin=origin)
        return replace(self.run, state=here), frequency, float(turns % 1.0) / frequency


def _glide(
    case: Case, line: Line, settle: int, run: Run, longest: float, report: Reporter
) -> tuple[Stretch, Run]:
    """Motion along a line of frequencies, after `settle` cycles at the first one.

    longest : largest sampling interval (s), and largest step (s) if the user gives none.
    """
    if settle:
        wait = settle / line.start
        _, run = run.advanced(at_frequency(case, line.start), wait, wait, longest)
    swept = with_histories(case, line.chirp(drive_frequency(case)))
    length = float(line.cycles[-1])
    interval = length / math.ceil(length / longest)
    return run.advanced(swept, length, interval, longest, report=report)
