"""`lyapunov_exponent`: how fast two motions that start close together separate."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.attractors.drive import drive_frequency
from foldyn.attractors.run import PER_PERIOD, check_relaxing, divisor, step_of
from foldyn.cases import Case, State
from foldyn.dynamics import METHODS, Motion, prepare
from foldyn.dynamics.failures import failure
from foldyn.dynamics.methods import suited
from foldyn.dynamics.motion_state import Outcome
from foldyn.dynamics.progress import Progress, Reporter, reported
from foldyn.errors import ComputationError, InputError, MotionInterrupted, told_once
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import variable
from foldyn.values import choice, number, of_kind

APART = 1e-7  # distance of the second motion, relative to the size of the first
SMALL = 1e-4  # least size of a motion (if it is at rest), relative to the longest bar
MOST = 11.0  # largest change of the distance's logarithm in an interval
BLOCKS = 16  # blocks of the record, for the error estimate
SEED = 20
"""Seed for the direction in which the second motion starts."""


def lyapunov_exponent(
    case: Case,
    duration: float,
    *,
    settle: float = 0.0,
    interval: float | None = None,
    initial: State | None = None,
    method: str = "rk4",
    dt: float | None = None,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Largest Lyapunov exponent of a motion, positive if it is chaotic.

    Benettin's method: a second motion starts at a small distance, and is brought back to this
    distance along the line between the two after each interval; the exponent is the mean growth
    rate of the logarithm of the distance.

    Parameters
    ----------
    case : Case
        Case without contact or hinges that yield or creep.
    duration : float
        Time over which the rate is averaged (s).
    settle : float
        Time (s) before the average begins, in which the motion reaches its attractor and the
        separation of the two motions turns to the most unstable direction.
    interval : float, optional
        Time between corrections of the distance (s); by default the period of the drive, or a
        hundredth of the duration without a drive.
    initial : State, optional
        Where the motion starts; rest by default.
    method : {"rk4", "central_difference"}
        An explicit method with fixed steps.
    dt : float, optional
        Largest step (s), shortened to divide the interval. By default half the critical step, and
        with a drive at most 1/64 of the period.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`.

    Returns
    -------
    xarray.Dataset
        `exponent` (1/s); `error`, the standard error of the exponent, from the means of 16 blocks
        of the record; and `estimate`, the running mean along `time` (the ends of the intervals
        after `settle`), to judge the convergence.

    Raises
    ------
    InputError
        An argument out of range, contact, added mass of air, hinges that yield or creep, or damped
        creases of the scheme "n5b8e".
    InstabilityError
        A motion grew without bound.
    MotionInterrupted
        Interrupted from the keyboard (Ctrl-C); the exception's `partial` holds the estimate so far.

    Notes
    -----
    The distance is 1e-7 of the motion's size, so that nonlinear terms have the same small relative
    size. It combines displacements (m) and velocities times interval / (2 pi). The error of the
    mean falls in proportion to 1 / duration for a periodic motion, and to 1 / sqrt(duration) for a
    chaotic motion.

    Benettin, Galgani, Giorgilli, Strelcyn (1980), Meccanica 15, 9-30.

    Examples
    --------
    >>> import foldyn as fd
    >>> s = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.1, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> push = fd.Force([0, 1], (1.0, 0, 0), history=fd.Harmonic(5.0))
    >>> case = fd.Case(s, supports, [push], damping=fd.Rayleigh(alpha=4.0))
    >>> round(float(lyapunov_exponent(case, 20.0, settle=2.0).exponent))
    -2
    """
    began = time.perf_counter()
    _check(case, method, initial)
    duration = number("duration", duration, above=0.0, unit="s")
    settle = number("settle", settle, least=0.0, unit="s")
    frequency = drive_frequency(case)
    if interval is None:
        interval = 1.0 / frequency if frequency else 0.01 * duration
        if interval > duration:
            raise InputError(
                f" = {duration:g} s: is shorter than a period of the drive, {interval:g} s; give "
                "many of them",
                "duration",
            )
    interval = number("interval", interval, above=0.0, most=duration, unit="s")
    silent, counted = math.ceil(settle / interval - 1e-9), math.floor(duration / interval + 1e-9)
    if dt is None:
        longest = 1.0 / (PER_PERIOD * frequency) if frequency else interval
        dt = step_of(case, method, initial, longest)
    dt = divisor(interval, dt)
    grown, interrupted = list[float](), False
    with told_once():
        pair = Pair(case, (silent + counted) * interval, interval, initial, method, dt)
        try:
            with reported(progress) as report:
                grown.extend(pair.growth(silent + counted, report))
        except KeyboardInterrupt:
            interrupted, counted = True, len(grown) - silent
    if counted < 1:
        raise MotionInterrupted("interrupted before anything was counted")
    growth = np.array(grown[silent:])
    elapsed = interval * (1.0 + np.arange(counted))
    estimate = np.cumsum(growth) / elapsed
    blocks = np.array([block.mean() for block in np.array_split(growth, min(BLOCKS, counted))])
    spread = blocks.std(ddof=1) / math.sqrt(len(blocks)) / interval if counted > 1 else math.nan
    data = {
        "exponent": variable((), estimate[-1], "1/s", "largest Lyapunov exponent"),
        "error": variable((), spread, "1/s", "standard error of the exponent"),
        "estimate": variable(
            ("time",), estimate, "1/s", "largest Lyapunov exponent, mean until then"
        ),
    }
    along = {"time": variable(("time",), silent * interval + elapsed, "s", "time")}
    facts = {
        "method": method, "dt": pair.dt, "interval": interval, "settle": silent * interval,
        "apart": APART, "wall_seconds": time.perf_counter() - began,
    }  # fmt: skip
    found = result_dataset("lyapunov_exponent", case, data, along, facts)
    if interrupted:
        raise MotionInterrupted(f"interrupted after {elapsed[-1]:.6g} s", found)
    return found


def _check(case: Case, method: str, initial: State | None) -> None:
    """Refuse cases and methods that the exponent does not cover."""
    of_kind("case", case, Case)
    if initial is not None:
        of_kind("initial", initial, State)
        initial.of_nodes("displacement", case.structure.nodes.shape)
    explicit = [one.name for one in METHODS.values() if not (one.implicit or one.adaptive)]
    choice("method", method, explicit)
    if case.contact is not None:
        raise InputError(": the exponent needs smooth forces; leave contact out", "contact")
    if case.air is not None and case.air.added_mass:
        raise InputError(
            ": the exponent needs a constant mass; give added_mass = false", "air.added_mass"
        )
    check_relaxing(case, "the exponent needs smooth forces")
    suited(method, case)


class Pair:
    """Two motions that start close together.

    Parameters
    ----------
    case, initial, method, dt :
        As in `lyapunov_exponent`.
    duration, interval : float
        As in `lyapunov_exponent`, s.
    """

    def __init__(
        self, case: Case, duration: float, interval: float, initial: State | None, method: str,
        dt: float,
    ) -> None:  # fmt: skip
        given = {"method": method, "dt": dt, "interval": interval, "initial": initial}
        self._motions = [prepare(case, duration, **given), prepare(case, duration, **given)]
        self.dt = self._motions[0].plan.dt
        self._interval, self._speed = interval, interval / (2.0 * math.pi)
        self._ties, self._numbering = case.constraints, self._motions[0].packed.numbering
        chance = np.random.default_rng(SEED).standard_normal(case.structure.nodes.shape)
        self._aside = self._tied(self._numbering.inward(chance))

    def growth(self, intervals: int, report: Reporter) -> Iterator[float]:
        """Growth of the logarithm of the distance in each interval."""
        first, second = self._motions
        engines = []
        for motion in self._motions:
            motion.output.begin()
            engine = motion.method.engine(motion.case, motion.packed, motion.state, motion.plan)
            engines.append(engine)
            self._advance(motion, engine, 0)  # records the start
        size = max(self._size(first), SMALL * first.case.body.sheet.longest())
        difference = [self._aside, *(0.0 * array for array in _arrays(first)[1:])]
        away = self._distance(*difference[:2])
        steps = first.plan.every
        for k in range(intervals):
            wanted = APART * size
            for array, base, part in zip(_arrays(second), _arrays(first), difference, strict=True):
                array[:] = base + wanted / away * part
            for motion, engine in zip(self._motions, engines, strict=True):
                self._advance(motion, engine, steps)
            difference = [b - a for a, b in zip(_arrays(first), _arrays(second), strict=True)]
            difference[:3] = map(self._tied, difference[:3])
            away = self._distance(*difference[:2])
            grown = math.log(max(away, 1e-300) / wanted)
            if not abs(grown) < MOST:
                raise ComputationError(
                    f"the distance changes by a factor of {math.exp(grown):.2g} in an interval of "
                    f"{self._interval:.3g} s, too much to be measured; take a shorter interval"
                )
            size = max(size, self._size(first))
            now = float(first.state.tally.time)
            report(Progress(now, first.plan.end, int(first.state.tally.steps), 0.0))
            if (k + 1) % 64 == 0:
                self._look(first)
            yield grown
        self._look(first)

    def _advance(self, motion: Motion, engine: Any, steps: int) -> None:
        """Advance a motion by a number of steps; raises if it fails."""
        code, hinge = engine.advance(motion.output.window, steps)
        if code != Outcome.DONE:
            kind, why = failure(motion, code, hinge)
            raise kind(why)
        error = motion.packed.callbacks.error
        if error is not None:
            raise error

    def _tied(self, values: NDArray) -> NDArray:
        """Values (rows, 3), as stored, with motions that ties forbid set to zero."""
        x = self._numbering.outward(values)
        x[self._ties.determined] = 0.0
        out = self._numbering.inward(self._ties.displacement(x.ravel()).reshape(x.shape))
        out[len(x) :] = values[len(x) :]  # dofs beside those of nodes are free
        return out

    def _look(self, motion: Motion) -> None:
        """Raise an error if energies do not balance, or the step has become too long."""
        motion.audit()
        motion.recheck(motion.packed.numbering.outward(motion.state.u))

    def _size(self, motion: Motion) -> float:
        """Norm of a motion's state, m."""
        return self._distance(motion.state.u, motion.state.v)

    def _distance(self, u: NDArray, v: NDArray) -> float:
        """Norm (m) of displacements, and velocities scaled to a length."""
        return math.hypot(float(np.linalg.norm(u)), self._speed * float(np.linalg.norm(v)))


def _arrays(motion: Motion) -> list[NDArray]:
    """State of a motion: displacement, velocity, acceleration, and memory of hinges."""
    state, memory = motion.state, motion.packed.body.find(HingeMemory)
    remembered = [] if memory is None else [memory.own.angle, memory.own.state]
    return [state.u, state.v, state.carry, *remembered]
