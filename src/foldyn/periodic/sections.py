"""Simulated motions seen once in a period of the drive: Poincare sections, and stepped sines."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, Harmonic, State
from foldyn.dynamics import Progress, critical_step, initial_state, simulate
from foldyn.dynamics.progress import Reporter, reporter
from foldyn.errors import InputError
from foldyn.periodic.drive import Drive
from foldyn.periodic.orbit import check_measure, swing
from foldyn.results import Quantity
from foldyn.results.periodic_dataset import section_dataset, stepped_dataset
from foldyn.values import number, numbers, of_kind, whole

if TYPE_CHECKING:
    import xarray

RESOLVED = 256  # steps of a period, at least
SHOWN = 64  # samples of a period from which its swing is taken


class Strobe(NamedTuple):
    """A driven case, and how its motions are integrated."""

    case: Case
    period: float  # of the drive, s
    per_period: int  # even number of steps

    @property
    def dt(self) -> float:
        """Step, s."""
        return self.period / self.per_period

    def run(self, periods: int, every: int, initial: State | None) -> xarray.Dataset:
        """Motion over some periods from phase 0, sampled every so many steps."""
        count = periods * self.per_period
        return simulate(
            self.case, count * self.dt, dt=self.dt, every=every, initial=initial, method="rk4"
        )


def strobe_of(case: Case, name: str) -> Strobe:
    """Of a case that harmonic histories drive; InputError for others."""
    of_kind("case", case, Case)
    drive = Drive(case)
    if not drive.varies:
        raise InputError(
            f"case: nothing drives it: {name} takes loads or supports that have a history such as "
            "fd.Harmonic(frequency=3.0)"
        )
    period, limit = 1.0 / drive.frequency, 0.5 * critical_step(case)
    steps = max(RESOLVED * drive.highest, math.ceil(period / limit))
    return Strobe(case, period, SHOWN * math.ceil(steps / SHOWN))


def driven_at(case: Case, frequency: float) -> Case:
    """The same with another lowest frequency (Hz) of its harmonic histories."""
    lowest = Drive(case).frequency

    def changed(part: Any) -> Any:
        history = getattr(part, "history", None)
        if not isinstance(history, Harmonic):
            return part
        order = round(history.frequency / lowest)
        return replace(part, history=Harmonic(order * frequency, history.phase))

    return case.altered(
        loads=[changed(one) for one in case.loads],
        supports=[changed(one) for one in case.supports],
    )


def poincare_section(
    case: Case, periods: int = 200, skip: int = 100, *, initial: State | None = None
) -> xarray.Dataset:
    """States of a simulated motion at the start of each period of the drive.

    Parameters
    ----------
    case : Case
        Driven by `Harmonic` histories; whatever `simulate` takes, contact and memory too.
    periods : int
        How many states.
    skip : int
        Periods that pass before the first.
    initial : State, optional
        Start of the motion; rest by default.

    Returns
    -------
    xarray.Dataset
        Along `period`: `displacement` and `velocity` (node, axis).

    Raises
    ------
    InputError
        An argument out of range; nothing drives the case; what `simulate` by rk4 refuses.
    """
    periods, skip = whole("periods", periods, least=1), whole("skip", skip, least=0)
    strobe = strobe_of(case, "poincare_section")
    run = strobe.run(skip + periods, strobe.per_period, initial)
    seen = run.isel(time=slice(skip + 1, None))
    facts = {"frequency": 1.0 / strobe.period, "skip": skip, "dt": strobe.dt}
    return section_dataset(case, seen["displacement"].values, seen["velocity"].values, facts)


def stepped_sine(
    case: Case,
    frequencies: ArrayLike,
    measure: Quantity | None = None,
    *,
    periods: int = 32,
    skip: int = 100,
    initial: State | None = None,
    jump: float = 0.2,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Simulated motions at one frequency of the drive after the other: what a test would see.

    Each goes on from the end of the one before, in phase. It is a bifurcation diagram by brute
    force, too: a motion with the period of the drive has one value of `section`, one with twice
    the period two, a chaotic one as many as are kept.

    Parameters
    ----------
    case : Case
        As for `poincare_section`.
    frequencies : array_like
        Of the slowest harmonic history (Hz), in the order in which they are stepped through.
    measure : Quantity, optional
        Whose `function` of displacement, velocity and time is seen. By default the displacement
        of the node and along the axis that swing most in the first motion.
    periods : int
        Seen of each motion,
    skip : int
        after as many that pass.
    initial : State, optional
        Start of the first motion; rest by default.
    jump : float
        Change of the amplitude from one frequency to the next, beyond what the change before
        foretells, over the larger of both amplitudes, above which it counts as a jump.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`, in which `steps` counts frequencies.

    Returns
    -------
    xarray.Dataset
        Along `frequency`: `section` (period), the measure at the start of each period;
        `amplitude`, half the distance between its extremes; `jump`, whether it has jumped there.

    Raises
    ------
    InputError
        As of `poincare_section`.
    """
    strobe_of(case, "stepped_sine")
    check_measure(measure)
    frequency = np.atleast_1d(numbers("frequencies", frequencies))
    if frequency.ndim != 1 or not frequency.size or frequency.min() <= 0.0:
        raise InputError(": must be a list of numbers above 0", "frequencies")
    periods, skip = whole("periods", periods, least=1), whole("skip", skip, least=0)
    jump = number("jump", jump, above=0.0)
    section, amplitude = np.empty((len(frequency), periods)), np.empty(len(frequency))
    state, seen = initial, measure
    report, close = reporter(progress)
    try:
        for k, f in enumerate(frequency.tolist()):
            strobe = strobe_of(driven_at(case, f), "stepped_sine")
            if skip:
                state = initial_state(strobe.run(skip, skip * strobe.per_period, state))
            run = strobe.run(periods, strobe.per_period // SHOWN, state)
            state = initial_state(run)
            if seen is None:
                seen = _largest(run)
            values = _values(run, seen)
            section[k], amplitude[k] = values[:-1:SHOWN], float(swing(values[:-1]))
            report(Progress(k + 1.0, float(len(frequency)), k + 1, 0.0))
    finally:
        close()
    facts = {"skip": skip, "measure": "largest displacement" if measure is None else measure.text}
    units = "m" if measure is None else measure.units
    return stepped_dataset(
        case, frequency, section, amplitude, _jumps(amplitude, jump), facts, units
    )


def _largest(run: xarray.Dataset) -> Quantity:
    """Displacement of the node and along the axis that swing most in a motion."""
    node, axis = np.unravel_index(
        np.ptp(run["displacement"].values, axis=0).argmax(), run["displacement"].shape[1:]
    )
    return Quantity("m", "displacement", function=lambda u, v, t: u[node, axis])


def _values(run: xarray.Dataset, measure: Quantity) -> NDArray:
    """A measure (nt,) along a motion."""
    function: Any = measure.function
    parts = (run[name].values for name in ("displacement", "velocity", "time"))
    return np.array([float(function(*one)) for one in zip(*parts, strict=True)])


def _jumps(amplitude: NDArray, least: float) -> NDArray[np.bool_]:
    """Where amplitudes (m,) leave the straight line through the two before."""
    jumped = np.zeros(len(amplitude), bool)
    for k in range(1, len(amplitude)):
        slope = amplitude[k - 1] - amplitude[k - 2] if k > 1 and not jumped[k - 1] else 0.0
        larger = max(amplitude[k], amplitude[k - 1])
        jumped[k] = abs(amplitude[k] - amplitude[k - 1] - slope) > least * larger
    return jumped
