"""A motion that continues in stretches while its drive changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.releases import refuse_releases
from foldyn.dynamics import METHODS, prepare
from foldyn.dynamics.methods import suited, suiting
from foldyn.dynamics.modal_damping import modal_rows
from foldyn.dynamics.progress import Reporter
from foldyn.dynamics.timing import DEFAULT_FRACTION
from foldyn.errors import InputError
from foldyn.results import Quantity
from foldyn.values import choice, number, of_kind, show

PER_PERIOD = 64  # samples per period of the drive, for amplitudes


class Stretch(NamedTuple):
    """Samples of a stretch of a motion."""

    time: NDArray[np.float64]  # (k,) s
    displacement: NDArray[np.float64]  # (k, n, 3) m
    velocity: NDArray[np.float64]  # (k, n, 3) m/s
    memory: NDArray[np.float64] | None = None  # (k, b, 2), states of laws with memory


@dataclass(frozen=True)
class Run:
    """Current state of a motion, and its integration method.

    Parameters
    ----------
    method, dt, tolerance :
        As in `simulate`; `dt` is the largest step (s), shortened to divide the sampling interval.
    state : State, optional
        Current state; rest by default.
    """

    method: str
    dt: float | None
    tolerance: float | None
    state: State | None

    def __post_init__(self) -> None:
        """Check the arguments that all stretches share."""
        choice("method", self.method, METHODS)
        if self.state is not None:
            of_kind("initial", self.state, State)

    def advanced(
        self, case: Case, duration: float, interval: float, longest: float, start: float = 0.0,
        report: Reporter | None = None,
    ) -> tuple[Stretch, Run]:  # fmt: skip
        """Continue under a case for a duration (s), with a sample every `interval` (s).

        longest : step (s) of methods with fixed steps if the user gives none.
        """
        dt, method = self.dt, METHODS[self.method]
        if dt is None and not (method.implicit or method.adaptive):
            dt = step_of(case, self.method, self.state, longest)
        if dt is not None:
            dt = divisor(interval, dt)
        motion = prepare(
            case, duration, self.method, dt, interval=interval, initial=self.state,
            tolerance=self.tolerance, start=start,
        )  # fmt: skip
        found = motion.samples(report)
        memory = found.memory if found.memory.size else None
        stretch = Stretch(found.time, found.displacement, found.velocity, memory)
        return stretch, replace(self, state=motion.end)


def step_of(case: Case, method: str, state: State | None, longest: float) -> float:
    """Step (s) of a fixed-step method: half the critical step about a state, at most `longest`."""
    shape, chosen = case.structure.nodes.shape, suited(method, case)
    case, at = suiting(chosen, case), state or State()
    modal = modal_rows(case, at.origin_of(shape))
    critical = chosen.critical_step(case, at.of_nodes("displacement", shape), modal)
    return min(DEFAULT_FRACTION * critical, longest)


def divisor(interval: float, dt: float) -> float:
    """The longest step (s) up to dt that divides an interval (s)."""
    dt = number("dt", dt, above=0.0, unit="s")
    return interval / math.ceil(interval / dt * (1.0 - 1e-12))


def check_relaxing(case: Case, why: str) -> None:
    """Refuse hinges that yield or creep, for a reason, and releases."""
    refuse_releases(case, "this analysis")
    if not all(part.law.relaxes for part in case.remembering):
        raise InputError(
            f"structure: some of its hinges yield, creep or have latches, and {why}; take prony or "
            "an elastic law"
        )


def check_measure(measure: Any, nodes: int, name: str = "measure") -> None:
    """Refuse a measure that does not return a number in the rest state."""
    of_kind(name, measure, Quantity)
    if measure.function is None or measure.dims:
        raise InputError(
            ": must have a function of displacement, velocity and time that gives one number", name
        )
    rest = np.zeros((1, nodes, 3))
    measured(measure, Stretch(np.zeros(1), rest, rest.copy()), name)


def measured(measure: Quantity, stretch: Stretch, name: str = "measure") -> NDArray[np.float64]:
    """Values (k,) of a measure at the samples of a stretch."""
    assert measure.function is not None
    try:
        values = [measure.function(u, v, float(t)) for t, u, v in zip(*stretch[:3], strict=True)]
    except Exception as error:
        raise InputError(f": raised {type(error).__name__}: {error}", name) from error
    try:
        found = np.array(values, float)
    except (TypeError, ValueError):
        found = np.zeros((0, 0))
    if found.ndim != 1 or not np.isfinite(found).all():
        raise InputError(f": gave {show(values[0])}; it must give a finite number", name)
    return found


def extremes(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Upper and lower values (k, ...) of evenly spaced samples (k, ...), refined at extremes.

    The value at a turning point is the vertex of the parabola through three samples; elsewhere it
    is the sample itself.
    """
    top = values.copy()
    before, now, after = values[:-2], values[1:-1], values[2:]
    slope, bend = 0.5 * (after - before), before - 2.0 * now + after
    turns = ((now - before) * (after - now) <= 0.0) & (bend != 0.0)
    top[1:-1][turns] -= 0.5 * slope[turns] ** 2 / bend[turns]
    return np.maximum(values, top), np.minimum(values, top)


def swing(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the difference (...) between the extremes of samples (k, ...)."""
    top, bottom = extremes(values)
    return 0.5 * (top.max(axis=0) - bottom.min(axis=0))
