"""`poincare_section`: states of a motion once per period, or where a quantity passes a level."""

from __future__ import annotations

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.attractors.drive import drive_frequency
from foldyn.attractors.run import Stretch, check_measure, measured
from foldyn.errors import InputError, warn
from foldyn.ram_limit import check_memory
from foldyn.results import Quantity, case_of
from foldyn.results.attributes import facts, own_attributes
from foldyn.results.quantities import MOTION, variable, variables
from foldyn.values import choice, number, show

ITERATIONS = 60  # bisection steps to find the time of a crossing
ROUNDING = 1e-9  # tolerance of times, as a fraction of a period


def poincare_section(
    motion: xarray.Dataset,
    period: float | None = None,
    *,
    plane: Quantity | None = None,
    level: float = 0.0,
    direction: str = "up",
    phase: float = 0.0,
    after: float = 0.0,
) -> xarray.Dataset:
    """States at which a motion crosses a section of its phase space.

    Parameters
    ----------
    motion : xarray.Dataset
        A result of `simulate`.
    period : float, optional
        Time (s) between the states, for a stroboscopic section. By default, without a plane, the
        period of the drive in the motion's case.
    plane : Quantity, optional
        Alternatively, a quantity; states are taken where its `function` of displacement (n, 3), m,
        velocity (n, 3), m/s, and time, s, crosses the level.
    level : float
        Level, in the unit of the quantity.
    direction : {"up", "down", "both"}
        Direction of the crossing.
    phase : float
        Phase of the states in a period (degrees): they are at (n + phase / 360) periods.
    after : float
        Time (s) before which states are skipped: the transient.

    Returns
    -------
    xarray.Dataset
        `displacement` (m), `velocity` (m/s) along time, node, axis.

    Raises
    ------
    InputError
        Not a motion; no period; both a period and a plane.

    Warns
    -----
    FoldynWarning
        The section has no states.

    Notes
    -----
    Between samples a motion is interpolated by the cubic through displacements and velocities. With
    the sampling interval h, the error is of order h^4 in displacement and h^3 in velocity. With
    ``interval = period / k`` the states are samples themselves.

    Examples
    --------
    >>> import foldyn as fd
    >>> s = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.1, 1.0))
    >>> push = fd.Force([0, 1], (1.0, 0, 0), history=fd.Harmonic(5.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> case = fd.Case(s, supports, [push], damping=fd.Rayleigh(alpha=20.0))
    >>> section = poincare_section(fd.simulate(case, 2.0, interval=0.05), after=1.0)
    >>> section.time.values.round(6).tolist()
    [1.0, 1.2, 1.4, 1.6, 1.8, 2.0]
    """
    stretch = _stretch(motion)
    after = number("after", after, unit="s")
    choice("direction", direction, ("up", "down", "both"))
    if plane is not None:
        check_measure(plane, stretch.displacement.shape[1], "plane")
    if plane is None:
        period = _period(motion, period)
        shift = number("phase", phase, unit="degrees") / 360.0
        first, last = (stretch.time[[0, -1]] / period - shift).tolist()
        size = 16.0 * stretch.displacement[0].nbytes * (last - first)
        check_memory("period", f"a section of {last - first:.3g} states", size, "take a longer one")
        turns = np.arange(np.ceil(first - ROUNDING), np.floor(last + ROUNDING) + 1.0)
        times = np.clip((turns + shift) * period, *stretch.time[[0, -1]])
    elif period is not None:
        raise InputError(f" = {show(period)}: give either a period or a plane", "period")
    else:
        times = _passages(stretch, plane, number("level", level), direction)
    times = times[times >= after]
    if not len(times):
        warn(_missed(stretch, after, period, level), "long-motions.md#period-doubling-and-chaos")
    found = at_times(stretch, times)
    values = {"displacement": found.displacement, "velocity": found.velocity}
    along = {"time": variable(("time",), found.time, "s", "time")}
    told = {"period": period if plane is None else None, "after": after}
    told |= {"level": level, "direction": direction} if plane else {"phase": phase}
    own = motion.drop_dims("time").assign(variables(MOTION, "time", values)).assign_coords(along)
    why = motion.attrs.get("not_rerunnable_because")
    own.attrs = own_attributes("poincare_section", (why,) if why else ()) | facts(told)
    return own


def _missed(stretch: Stretch, after: float, period: float | None, level: float) -> str:
    """Warning for a section without states."""
    wanted = f"whole period of {period:g} s" if period else f"passage of the level {level:g}"
    last = float(stretch.time[-1])
    return f"the section is empty: from after = {after:g} s until the end, {last:g} s, no {wanted}"


def _stretch(motion: xarray.Dataset) -> Stretch:
    """Samples of a motion."""
    held = getattr(motion, "data_vars", ())
    if "displacement" not in held or "velocity" not in held or "time" not in motion.dims:
        raise InputError(f": got {type(motion).__name__}, give a result of fd.simulate", "motion")
    if motion.displacement.dims != ("time", "node", "axis") or motion.sizes["time"] < 2:
        raise InputError(": give one motion of at least two samples", "motion")
    return Stretch(motion.time.values, motion.displacement.values, motion.velocity.values)


def _period(motion: xarray.Dataset, given: float | None) -> float:
    """The given period, or the drive period of a motion's case."""
    if given is not None:
        return number("period", given, above=0.0, unit="s")
    try:
        case = case_of(motion)
    except InputError as error:
        raise InputError(f": give one (s), or a plane: {error}", "period") from None
    if frequency := drive_frequency(case):
        return 1.0 / frequency
    raise InputError(": nothing drives the case; give a period (s), or a plane", "period")


def at_times(stretch: Stretch, times: NDArray[np.float64]) -> Stretch:
    """States at some times (k,), interpolated by cubics between samples."""
    t = stretch.time
    i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    h = (t[i + 1] - t[i])[:, None, None]
    x = ((times - t[i]) / (t[i + 1] - t[i]))[:, None, None]
    (u, after), (v, then) = ((a[i], a[i + 1]) for a in (stretch.displacement, stretch.velocity))
    jump = after - u
    square = 3.0 * jump - h * (2.0 * v + then)
    cube = h * (v + then) - 2.0 * jump
    place = u + x * (h * v + x * (square + x * cube))
    speed = v + x * (2.0 * square + 3.0 * x * cube) / h
    exact = x == 1.0
    return Stretch(times, np.where(exact, after, place), np.where(exact, then, speed))


def _passages(
    stretch: Stretch, plane: Quantity, level: float, direction: str
) -> NDArray[np.float64]:
    """Times at which a quantity crosses a level, by bisection between samples."""
    above = measured(plane, stretch, "plane") > level
    passes = above[1:] != above[:-1]
    if direction != "both":
        passes &= above[1:] == (direction == "up")
    k = np.flatnonzero(passes)
    low, high = stretch.time[k], stretch.time[k + 1]
    for _ in range(ITERATIONS):
        middle = 0.5 * (low + high)
        if not len(k) or not (high - low > 1e-15 * np.abs(high)).any():
            break
        stays = (measured(plane, at_times(stretch, middle), "plane") > level) == above[k]
        low, high = np.where(stays, middle, low), np.where(stays, high, middle)
    return 0.5 * (low + high)
