"""`bifurcation_diagram`: steady motions at successive frequencies or amplitudes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.attractors.drive import at_frequency, at_level, drive_frequency, driven_frequency
from foldyn.attractors.jumps import Jump, is_jump, jump_variables
from foldyn.attractors.run import PER_PERIOD, Run, Stretch, check_measure, measured, swing
from foldyn.cases import Case, State
from foldyn.dynamics.progress import Progress, Reporter, reported
from foldyn.errors import ComputationError, InputError, MotionInterrupted, told_once, warn
from foldyn.results import Quantity
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import variable
from foldyn.values import choice, increasing, number, of_kind, whole

SWEEPS = ("up", "down", "both")
RESOLUTION = 1e-3  # relative width to which jumps are bracketed
SAME = 1e-9  # relative difference below which values are equal
REPEATS = 1e-3  # states closer than this are equal, relative to the size of the motion
FREQUENCY = Quantity("Hz", "frequency of the drive")
LEVEL = Quantity("1", "factor on the drive")


def bifurcation_diagram(
    case: Case,
    measure: Quantity,
    *,
    frequencies: ArrayLike | None = None,
    amplitudes: ArrayLike | None = None,
    sweep: str = "both",
    settle: int = 200,
    record: int = 32,
    resolution: float = RESOLUTION,
    initial: State | None = None,
    method: str = "rk4",
    dt: float | None = None,
    tolerance: float | None = None,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Steady motions at successive frequencies, or amplitudes, of the drive: a stepped sine.

    Each motion starts at the end of the previous one and settles; then its amplitude is recorded,
    and the measure once per period of the drive. Jumps are bracketed by bisection, starting from
    the motion before the jump.

    Parameters
    ----------
    case : Case
        Case with `Harmonic` histories of loads, supports, planes or wind, which set the period.
        Other histories must be constant.
    measure : Quantity
        Quantity to show; its `function` of displacement (n, 3), m, velocity (n, 3), m/s, and time,
        s, must return a number.
    frequencies : array_like, shape (k,)
        Increasing frequencies (Hz) of the slowest of these histories; the others keep their
        frequency ratio to it, and all keep their phases.
    amplitudes : array_like, shape (k,)
        Alternatively, increasing factors on all harmonic histories, at the case's own frequency.
    sweep : {"up", "down", "both"}
        Direction; "both" sweeps up, and then down from the end of the upward sweep.
    settle, record : int
        At each value, periods of the drive that are skipped, and periods that are recorded then (at
        least 4).
    resolution : float
        Relative width to which a jump is bracketed. A large change between neighbors (more than
        20 % of the larger amplitude) counts as a steep curve, not as a jump, if it needs more than
        this width.
    initial : State, optional
        Where the first motion starts; rest by default.
    method, dt, tolerance :
        As in `simulate`; `dt` is the largest step (s), by default at most 1/64 of the period.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress` of the number of values.

    Returns
    -------
    xarray.Dataset
        Along `sweep` and `frequency` (Hz) or `level` (the factor): `section` (record), the measure
        at the start of each period of the drive; `amplitude`, half the difference between the
        measure's extremes in the record; `periods`, the number of drive periods after which the
        motion repeats to within 0.1 %, or 0 if it does not repeat within half the record
        (quasi-periodic, chaotic or not settled). Along `jump`: `jump_sweep`, the direction of the
        sweep, and `jump_between` and `jump_amplitude` (side), values before and after the jump.
        Attribute `complete`: 1 if every sweep reached its end.

    Raises
    ------
    InputError
        An argument out of range, or a case without drive.
    ComputationError
        The first motion fails.
    MotionInterrupted
        Interrupted from the keyboard (Ctrl-C); the exception's `partial` holds the points so far.

    Warns
    -----
    FoldynWarning
        A later motion fails, which ends its sweep: the remaining values are nan.

    Notes
    -----
    Close to a fold a motion takes long to leave, and jumps are found too late: settle for a few
    hundred periods if damping is light. If a long step made the motion jump too early, the points
    after this jump are replaced by motions that arrived in small steps.

    Examples
    --------
    >>> import foldyn as fd
    >>> s = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.1, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> push = fd.Force([0, 1], (1.0, 0, 0), history=fd.Harmonic(5.0))
    >>> case = fd.Case(s, supports, [push], damping=fd.Rayleigh(alpha=20.0))
    >>> ridge = fd.Quantity("m", "height of the ridge", function=lambda u, v, t: u[2, 2])
    >>> found = bifurcation_diagram(case, ridge, frequencies=[4.0, 5.0], settle=10, record=4)
    >>> found.periods.values.tolist()
    [[1, 1], [1, 1]]
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    check_measure(measure, len(case.structure.nodes))
    swept = _swept(case, frequencies, amplitudes)
    choice("sweep", sweep, SWEEPS)
    settle, record = whole("settle", settle, least=0), whole("record", record, least=4)
    steady = Steady(swept.case_at, measure, settle, record)
    resolution = number("resolution", resolution, above=0.0)
    run = Run(method, dt, tolerance, initial)
    ways = ["up", "down"] if sweep == "both" else [sweep]
    values = swept.values
    points: list[list[Point]] = []
    jumps: list[Jump] = []
    interrupted = False
    try:
        with reported(progress) as report, told_once():
            for way in ways:
                here = values if way == "up" else values[::-1]
                if points:  # start from the end of the upward sweep
                    here = here[len(values) - len(points[0]) :]
                found: list[Point] = []
                points.append(found)
                try:
                    for value in here.tolist():
                        found.append(steady.point(run, value))
                        run, done = found[-1].run, len(found) + (len(points) - 1) * len(values)
                        report(Progress(float(done), float(len(ways) * len(values)), done, 0.0))
                except ComputationError as error:
                    if not found:
                        raise
                    last = f"{swept.name} {found[-1].value:g}"
                    warn(
                        f"the sweep {way} ends after the {last}: {error}",
                        "long-motions.md#sweeps-and-jumps",
                    )
                jumps += bracketed(steady, way, found, resolution)
    except KeyboardInterrupt:
        interrupted = True
    points = [found for found in points if found]
    if not points:
        raise MotionInterrupted("interrupted before the first point")
    facts = {
        "method": method, "settle": settle, "record": record, "resolution": resolution,
        "complete": not interrupted and all(len(found) == len(values) for found in points),
        "wall_seconds": time.perf_counter() - began,
    }  # fmt: skip
    diagram = _dataset(case, measure, swept, ways[: len(points)], points, jumps, facts)
    if interrupted:
        raise MotionInterrupted(f"interrupted after {sum(map(len, points))} points", diagram)
    return diagram


class Swept(NamedTuple):
    """The swept parameter."""

    name: str  # name of its dimension
    quantity: Quantity
    values: NDArray[np.float64]
    case_at: Callable[[float], Case]


def _swept(case: Case, frequencies: ArrayLike | None, amplitudes: ArrayLike | None) -> Swept:
    """The swept parameter, from the arguments `frequencies` and `amplitudes`."""
    if (frequencies is None) == (amplitudes is None):
        raise InputError(": give frequencies (Hz) or amplitudes, one of the two", "frequencies")
    driven_frequency(case, "fd.bifurcation_diagram")
    by, given = ("frequencies", frequencies) if amplitudes is None else ("amplitudes", amplitudes)
    values = increasing(by, given, above=0.0)
    if amplitudes is None:
        return Swept("frequency", FREQUENCY, values, lambda f: at_frequency(case, f))
    return Swept("level", LEVEL, values, lambda level: at_level(case, level))


class Point(NamedTuple):
    """A steady motion."""

    value: float  # value of the swept parameter
    amplitude: float
    section: NDArray[np.float64]  # (record,)
    periods: int
    run: Run


class Steady(NamedTuple):
    """Finds steady motions."""

    case_at: Callable[[float], Case]
    measure: Quantity
    settle: int
    record: int

    def point(self, run: Run, value: float, begun: float = 0.0) -> Point:
        """The motion at a value of the swept parameter, started from a previous motion.

        begun : time (s) since the current period of the drive began.
        """
        case = self.case_at(value)
        period = 1.0 / drive_frequency(case)
        interval, transient = period / PER_PERIOD, self.settle * period
        if self.settle:
            left = transient - begun
            _, run = run.advanced(case, left, left, interval, begun)
        stretch, run = run.advanced(case, self.record * period, interval, interval, transient)
        values = measured(self.measure, stretch)
        path = states(stretch, period)
        repeats = repeats_after(path[:-1:PER_PERIOD], REPEATS * float(np.ptp(path, axis=0).max()))
        return Point(value, float(swing(values)), values[:-1:PER_PERIOD], repeats, run)


def states(stretch: Stretch, period: float) -> NDArray[np.float64]:
    """States (k, 6 n), m, of a stretch; velocities are multiplied by period / (2 pi)."""
    count = len(stretch.time)
    u, v = stretch.displacement.reshape(count, -1), stretch.velocity.reshape(count, -1)
    return np.hstack([u, period / (2.0 * np.pi) * v])


def repeats_after(section: NDArray[np.float64], near: float) -> int:
    """Least number of periods after which a motion repeats, up to half the record; 0 if none.

    section : states (k, m), one per period.
    near : distance below which states are equal.
    """
    for periods in range(1, len(section) // 2 + 1):
        if np.abs(section[periods:] - section[:-periods]).max() <= near:
            return periods
    return 0


def bracketed(steady: Steady, way: str, points: list[Point], resolution: float) -> list[Jump]:
    """Jumps between points in the order of a sweep, bracketed to a relative width.

    A long step may make a motion jump before it reaches the fold. From the motion before a jump,
    the sweep therefore continues in halved steps until the motion jumps again, possibly beyond the
    first jump. Points passed on the way are replaced.
    """
    found, k = [], 0
    while k < len(points) - 1:
        passed, after = [points[k]], points[k + 1]
        k, step = k + 1, after.value - points[k].value
        lower = sorted(points[k:], key=lambda point: point.value)
        fallen = [point.value for point in lower], [point.amplitude for point in lower]
        while is_jump(passed[-1].amplitude, after.amplitude):
            before = passed[-1]
            if abs(step) <= resolution * before.value:
                sizes = before.amplitude, after.amplitude
                found.append(Jump(way, before.value, after.value, sizes))
                k = _replace(steady, points, k, passed)
                break
            step *= 0.5
            while (points[-1].value - passed[-1].value) / step > 0.5:
                try:
                    ahead = steady.point(passed[-1].run, passed[-1].value + step)
                except ComputationError:  # may succeed closer to the jump
                    break
                to_fallen = ahead.amplitude - float(np.interp(ahead.value, *fallen))
                if abs(ahead.amplitude - passed[-1].amplitude) > abs(to_fallen):
                    after = ahead
                    break
                passed.append(ahead)
            else:
                break  # in short steps the motion does not jump
    return found


def _replace(steady: Steady, points: list[Point], k: int, passed: list[Point]) -> int:
    """Replace points from k on by motions reached in small steps; returns the next number."""
    way = np.sign(passed[-1].value - passed[0].value)
    while k < len(points) and way:
        value = points[k].value
        near = SAME * value
        if (value - passed[-1].value) * way > near:
            break
        before = [one for one in passed if (one.value - value) * way <= near]
        points[k] = steady.point(before[-1].run, value)
        k += 1
    return k


def _dataset(
    case: Case, measure: Quantity, swept: Swept, ways: list[str], points: list[list[Point]],
    jumps: list[Jump], facts: dict[str, Any],
) -> xarray.Dataset:  # fmt: skip
    """Dataset of the points and jumps of all sweeps."""
    along, text, units = ("sweep", swept.name), measure.text or "measure", measure.units
    shape = len(ways), len(swept.values)
    section = np.full((*shape, points[0][0].section.size), np.nan)
    amplitude, periods = np.full(shape, np.nan), np.zeros(shape, int)
    for row, found in enumerate(points):
        for point in found:
            k = int(np.searchsorted(swept.values, point.value))
            section[row, k], amplitude[row, k] = point.section, point.amplitude
            periods[row, k] = point.periods
    repeats = "periods of the drive after which the motion repeats (0: it does not)"
    data = {
        "section": variable((*along, "record"), section, units, f"{text} once a period"),
        "amplitude": variable(along, amplitude, units, f"amplitude of {text}"),
        "periods": variable(along, periods, "1", repeats),
        **jump_variables(jumps, swept.quantity, measure),
    }
    own = swept.quantity
    coordinates = {
        "sweep": variable(("sweep",), np.array(ways), "", "sweep"),
        swept.name: variable((swept.name,), swept.values, own.units, own.text),
    }
    return result_dataset("bifurcation_diagram", case, data, coordinates, facts)
