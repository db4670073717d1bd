"""`response_curve`: periodic motions along the frequency or the amplitude of the drive.

Bifurcations between two points of the curve are detected, located and named. As the parameter
changes, multipliers cross the unit circle at 1 (fold, or pitchfork if another branch crosses), at
-1 (period doubling) or in complex pairs (Neimark-Sacker): Kuznetsov, Elements of Applied
Bifurcation Theory, 3rd ed. 2004, chapters 4 and 5.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.attractors.run import check_measure
from foldyn.cases import Case, State
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter, reported
from foldyn.errors import InputError, MotionInterrupted, warn
from foldyn.periodic.balance import Balance, Fourier
from foldyn.periodic.continuation import (
    LONG,
    LOST,
    Point,
    Step,
    Stride,
    branch_point,
    located,
    point_at,
    steps,
)
from foldyn.periodic.families import ByFrequency, ByLevel
from foldyn.periodic.motion import NAMED, balance_of, balanced, coefficients, warn_of_errors
from foldyn.periodic.orbit import STEPS, along, amplitude, is_stable
from foldyn.results import Quantity
from foldyn.results.dataset import points_dataset
from foldyn.values import number, numbers, of_kind, show, whole

FIRST = 0.2  # length of the first step, relative to the longest step
AWAY = 0.05  # distance at which a branch is entered, relative to the motion
APART = 1e-2  # at a spurious fold, all multipliers are farther than this from 1
LARGEST = "largest displacement"  # of any node along an axis: name of the default measure
MEETS = 1e-4  # branches meet below this distance, relative to the range of the parameter
FOLD, PITCHFORK = "fold", "pitchfork"
DOUBLING, TORUS = "period doubling", "Neimark-Sacker"
SURE = {FOLD: 1e-6, PITCHFORK: 1e-3, DOUBLING: 1e-3, TORUS: 1e-3}
"""Largest absolute value of the test function at a located bifurcation of each kind."""
REAL = 1e-9  # largest imaginary part of a real multiplier


class _Found(NamedTuple):
    """A recorded point of the curve."""

    family: Any
    point: Point
    branch: int
    bifurcation: str
    floquet: NDArray


def response_curve(
    case: Case,
    frequencies: Sequence[float] | None = None,
    *,
    harmonics: int = 9,
    measure: Quantity | None = None,
    amplitudes: Sequence[float] | None = None,
    guess: State | xarray.Dataset | None = None,
    periods: int = 1,
    modes: int | None = None,
    branches: int = 1,
    longest_step: float = 0.1,
    most_points: int = 500,
    steps: int = STEPS,
    tolerance: float = 1e-9,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Periodic motions of a case along the frequency or the amplitude of its harmonic histories.

    Pseudo-arclength continuation leads from the first end to the second, through folds. It gives
    the stability of each motion, and follows branches that fork off.

    Parameters
    ----------
    case : Case
        As for `periodic_motion`.
    frequencies : (float, float)
        Both ends of the range (Hz); the curve begins at the first. Amplitudes and phases of the
        drive are kept.
    harmonics : int
        Number of harmonics of the drive frequency.
    measure : Quantity, optional
        Quantity of which the curve shows the amplitude: half the difference between the largest and
        the smallest value of its `function` (of displacement (n, 3), m, velocity (n, 3), m/s, and
        time, s) in a period. By default the displacement along an axis of the node that swings
        most.
    amplitudes : (float, float), optional
        Instead of frequencies: both ends of the range of a factor on all harmonic histories, at the
        frequency of the case.
    guess : State or xarray.Dataset, optional
        Start of the search at the first end; see `periodic_motion`.
    periods : int
        Periods of the drive in one period of the motion.
    modes : int, optional
        As for `periodic_motion`.
    branches : int
        Depth to which branches that fork off at a pitchfork (both) or a period doubling are
        followed: 0 none, 1 branches of the curve, 2 also their branches.
    longest_step : float
        Largest length of a step. A change of the motion by its own size has the length 1, and so
        has the whole range of frequencies.
    most_points : int
        Largest number of points on one branch.
    steps, tolerance
        As for `periodic_motion`.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`, in which `steps` counts points.

    Returns
    -------
    xarray.Dataset
        Along `point`: `frequency` (coordinate), `level` (factor on the drive), `amplitude` of the
        measure, `stable`, `bifurcation` ("fold", "pitchfork", "period doubling", "Neimark-Sacker"
        or ""), `branch` (0 for the curve itself), `periods`, `floquet` (multiplier), `coefficient`
        (harmonic, node, axis) as in `periodic_motion`, of the motion's own frequency, `truncation`,
        with `modes` also `reduction`. The motion at a point is
        ``periodic_motion(case, f, guess=curve.isel(point=3))``.
        Attributes: `complete`, 1 if every branch reached an end of the range, and facts.

    Raises
    ------
    InputError
        As from `periodic_motion`.
    ComputationError
        No motion is found at the first end.
    MotionInterrupted
        Interrupted from the keyboard (Ctrl-C); the exception's `partial` holds the points so far.

    Warns
    -----
    FoldynWarning
        A branch is lost, or has too many points (the points found are kept); motions pass through
        contacts; there are too few modes; or too few harmonics, as shown by the truncation, by
        folds at which no multiplier is 1, or by forks without branches.
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    if measure is not None:
        check_measure(measure, len(case.structure.nodes))
    by, ends = checked_range(frequencies, amplitudes)
    tolerance = number("tolerance", tolerance, above=0.0, below=1.0)
    longest = number("longest_step", longest_step, above=0.0, most=1.0)
    stride = Stride(FIRST * longest, longest, whole("most_points", most_points, least=2))
    branches = whole("branches", branches, least=0)
    periods = whole("periods", periods, least=1)
    steps = whole("steps", steps, least=4)
    balance = balance_of(case, "fd.response_curve", harmonics, periods, modes, guess, steps)
    tracer = _Tracer(by, ends, stride, steps, tolerance)
    try:
        with reported(progress) as report, balance.threads:
            family = tracer.family(balance)
            tracer.follow(family, tracer.first(family, guess), branches, report)
    except KeyboardInterrupt:
        tracer.complete = False
        partial = _dataset(case, tracer, measure, began) if tracer.found else None
        raise MotionInterrupted(f"interrupted after {len(tracer.found)} points", partial) from None
    return _dataset(case, tracer, measure, began)


def checked_range(frequencies: Any, amplitudes: Any) -> tuple[str, tuple[float, float]]:
    """Name of the varied parameter, and the two ends of its range."""
    if (frequencies is None) == (amplitudes is None):
        raise InputError(
            ": give both ends of the frequencies (Hz), as frequencies = [2.0, 5.0], or of a "
            "factor on the drive, as amplitudes = [0.1, 2.0]",
            "frequencies",
        )
    by, given = ("frequencies", frequencies) if amplitudes is None else ("amplitudes", amplitudes)
    ends = numbers(by, given)
    if ends.shape != (2,) or ends[0] == ends[1] or ends.min() <= 0.0:
        raise InputError(f" = {show(given)}: must be two different numbers above 0", by)
    return by, (float(ends[0]), float(ends[1]))


class _Tracer:
    """Follows a curve and its branches, and records the points."""

    def __init__(
        self, by: str, ends: tuple[float, float], stride: Stride, count: int, tolerance: float
    ) -> None:
        self.by, self.ends, self.stride, self.tolerance = by, ends, stride, tolerance
        self.low, self.high = min(ends), max(ends)
        self.span, self.count = self.high - self.low, count
        self.found: list[_Found] = []
        self.forks: list[Event] = []  # bifurcations at which branches cross or begin
        self.met: list[Event] = []  # forks that a branch has returned to
        self.branch, self.complete = 0, True

    def family(self, balance: Balance) -> Any:
        """Family of motions of a balance along the varied parameter."""
        if self.by == "frequencies":
            return ByFrequency(balance, self.span, self.tolerance)
        return ByLevel(balance, self.span, self.tolerance, balance.equation.drive.frequency)

    def first(self, family: Any, guess: Any) -> Point:
        """Point at the first end of the range, with the tangent toward the second."""
        balance, p = family.balance, self.ends[0]
        _, omega, level = family.own(np.zeros(balance.shape).ravel(), p)
        x = coefficients(balance, guess, omega, level)
        z = balanced(balance, x, omega, self.tolerance, level).x
        ahead = np.append(np.zeros(len(z)), np.sign(self.ends[1] - self.ends[0]))
        return point_at(family, z, p, ahead)

    def follow(
        self, family: Any, first: Point, depth: int, report: Reporter, origin: Point | None = None
    ) -> None:
        """Follow a branch from its first point, then the branches that fork off, to a depth.

        origin : the bifurcation from which the branch comes, as a member of this family.
        """
        branch, forks = self.branch, []
        known: dict[int, tuple[Point, NDArray]] = {}

        def of(point: Point) -> NDArray:
            if id(point) not in known:
                known[id(point)] = point, family.orbit(point.z, point.p).multipliers(self.count)
            return known[id(point)][1]

        def keep(point: Point, name: str = "") -> None:
            self.found.append(_Found(family, point, branch, name, of(point)))

        def outside(point: Point) -> float:
            return max(self.low - point.p, point.p - self.high)

        for point in (first,) if origin is None else (origin, first):
            keep(point)
        for step in steps(family, first, self.stride, outside):
            if not isinstance(step, Step):
                self._warn(step)
                break
            back = None
            for event in events(family, step, of):
                back = back or self._known(event, branch)
                keep(event.point, "" if back else event.name)
                if event.name in (PITCHFORK, DOUBLING) and not back:
                    forks.append(event)
            if back:  # the branch has returned to the curve from which it came
                self.met.append(back)
                break
            keep(step.after)
            known = {id(step.after): known[id(step.after)]}
            done = min(max(abs(step.after.p - self.ends[0]) / self.span, 0.0), 1.0)
            report(Progress(done, 1.0, len(self.found), 0.0))
        self.forks += forks
        for event in forks if depth else ():
            if event not in self.met:
                self._fork(family, event, depth - 1, report)

    def _known(self, event: Event, branch: int) -> Event | None:
        """The bifurcation on another branch at which this branch ends."""
        near = MEETS * self.span
        same = (one for one in self.forks if abs(one.point.p - event.point.p) <= near)
        return next(same, None) if branch and event.name == PITCHFORK else None

    def _warn(self, why: str) -> None:
        """Warn that a branch ends early, and why."""
        self.complete, last = False, self.found[-1]
        texts = {
            LOST: "is lost: no further motion is found; the points before are kept. Remedies: a "
            "smaller longest_step, or more harmonics",
            LONG: f"has more than {self.stride.most} points, which are kept; give more most_points",
        }
        cause = ""
        if not last.family.balance.equation.damping.any():
            cause = (
                ". Nothing damps the sheet, which in resonance swings without bound: give the case "
                "damping, or stay on one side of the resonance"
            )
        warn(
            f"the branch at {last.point.p:.6g} {texts[why]}{cause}",
            "nonlinear-vibration.md#response-curves",
        )

    def _fork(self, family: Any, event: Event, depth: int, report: Reporter) -> None:
        """Follow the branches that leave a bifurcation."""
        point, old = event.point, family.balance
        if event.name == DOUBLING:
            fourier = Fourier(2 * old.fourier.harmonics)
            family = self.family(Balance(old.equation, fourier, 2 * old.multiple))
            amplitudes = old.fourier.complex_of(point.z.reshape(old.shape))
            spread = np.zeros((fourier.harmonics + 1, old.shape[1]), complex)
            spread[::2] = amplitudes
            ahead = np.append(np.zeros(spread.size * 2 - old.shape[1]), 1.0)
            point = Point(fourier.real_of(spread).ravel(), point.p, ahead, 0.0)
        jacobian, across = family.jacobian(point.z, point.p), np.zeros(len(point.z))
        mode = np.ones(len(across), bool)
        if event.name == DOUBLING:  # odd harmonics are new, and decoupled from even harmonics
            mode = np.repeat(family.balance.fourier.order % 2 == 1, old.shape[1])
        across[mode] = np.linalg.svd(jacobian[np.ix_(mode, mode)])[2][-1] * family.size(point.z)
        # the two sides of a period doubling differ only in phase
        for side in (1.0, -1.0) if event.name == PITCHFORK else (1.0,):
            first = branch_point(family, point.z, point.p, side * across, AWAY)
            if first is None:
                warn(
                    f"harmonics: no branch is found at the {event.name} at {point.p:.6g}, but a "
                    "longer series may not have it: give more harmonics",
                    "nonlinear-vibration.md#response-curves",
                )
            elif self.low <= first.p <= self.high:
                self.branch = max(found.branch for found in self.found) + 1
                self.follow(family, first, depth, report, point)


def _warn_of_folds(found: list[_Found]) -> None:
    """Warn of spurious folds of the Fourier series, at which no multiplier is 1."""
    folds = [one for one in found if one.bifurcation == FOLD]
    spurious = [one for one in folds if np.abs(one.floquet - 1.0).min() > APART]
    at = [f"{one.point.p:.6g}" for one in spurious]
    if at:
        warn(
            f"harmonics: no multiplier is 1 at the folds at {', '.join(at[:NAMED])}, and a longer "
            "series may not have them: give more harmonics (or more steps)",
            "nonlinear-vibration.md#one-motion",
        )


def _dataset(case: Case, tracer: _Tracer, measure: Any, began: float) -> Any:
    """Dataset of the points found; warns if they are not accurate."""
    orbits = [found.family.orbit(found.point.z, found.point.p) for found in tracer.found]
    values = {
        "frequency": np.array([orbit.omega / (2.0 * np.pi) for orbit in orbits]),
        "level": np.array([orbit.level for orbit in orbits]),
        "amplitude": np.array([amplitude(orbit, measure) for orbit in orbits]),
        "stable": np.array([is_stable(found.floquet) for found in tracer.found]),
        "bifurcation": np.array([found.bifurcation for found in tracer.found], dtype="<U15"),
        "branch": np.array([found.branch for found in tracer.found]),
        "periods": np.array([orbit.multiple for orbit in orbits]),
        "floquet": np.array([found.floquet for found in tracer.found]),
        **along(orbits),
    }
    _warn_of_folds(tracer.found)
    harmonics = tracer.found[0].family.balance.fourier.harmonics
    warn_of_errors(orbits, harmonics, float(values["truncation"].max()), values.get("reduction"))
    facts = {
        "by": tracer.by,
        "harmonics": harmonics,
        "unknowns": orbits[0].equation.size,
        "complete": tracer.complete,
        "measure": LARGEST if measure is None else measure.text or "measure",
        "wall_seconds": time.perf_counter() - began,
    }
    units = "m" if measure is None else measure.units
    return points_dataset("response_curve", case, values, facts, units, orbits[0].equation.origin)


class Event(NamedTuple):
    """A bifurcation and its location."""

    name: str
    point: Point


Found = NDArray[np.complex128]
Multipliers = Callable[[Point], Found]


def events(family: Any, step: Step, of: Multipliers) -> list[Event]:
    """Bifurcations within a step, in order along it.

    of : function that returns the multipliers (2k,) at a point.
    """
    one, other = step.before, step.after
    found: list[tuple[str, Callable[[Point], float]]] = []
    if one.side != other.side:
        found.append((PITCHFORK, lambda point: point.side * _nearest(of(point), 1.0)))
    elif one.tangent[-1] * other.tangent[-1] < 0.0:
        found.append((FOLD, lambda point: float(point.tangent[-1])))
    if _parity(of(one)) != _parity(of(other)):
        found.append((DOUBLING, lambda point: _parity(of(point)) * _nearest(of(point), -1.0)))
    moduli = _moduli(of(one)), _moduli(of(other))
    counts = [int((pairs > 1.0).sum()) for pairs in moduli]
    # a complex pair that crosses the unit circle exists at both ends of the step
    if counts[0] != counts[1] and min(map(len, moduli)) >= max(counts):
        found.append((TORUS, lambda point: _modulus(_moduli(of(point)), max(counts)) - 1.0))
    events = []
    for name, value in found:
        point = located(family, one, other, step.length, value)
        if abs(value(point)) <= SURE[name]:  # else a pair has met on the real axis instead
            events.append((name, point))
    along = [np.append(at.z - one.z, at.p - one.p) @ one.tangent for _, at in events]
    return [Event(*events[k]) for k in np.argsort(along, kind="stable")]


def _nearest(found: Found, value: float) -> float:
    """Distance of the nearest real multiplier from a value; of any multiplier if none is real."""
    real = found[np.abs(found.imag) <= REAL].real
    return float(np.abs((real if len(real) else found) - value).min())


def _parity(found: Found) -> float:
    """Sign of det(monodromy + 1): -1 with an odd number of multipliers below -1."""
    real = found[np.abs(found.imag) <= REAL].real
    return -1.0 if np.count_nonzero(real < -1.0) % 2 else 1.0


def _moduli(found: Found) -> NDArray:
    """Moduli of the multipliers with a positive imaginary part, the largest first."""
    return -np.sort(-np.abs(found[found.imag > REAL]))


def _modulus(moduli: NDArray, place: int) -> float:
    """Modulus at a place in the list, counted from 1; 0 if the list is shorter."""
    return float(moduli[place - 1]) if len(moduli) >= place else 0.0
