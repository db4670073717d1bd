"""`backbone`: frequency of a vibration as a function of its amplitude."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter, reported
from foldyn.errors import ComputationError, InputError, MotionInterrupted, warn
from foldyn.periodic.balance import Balance, Fourier, values_of
from foldyn.periodic.continuation import LOST, Point, Step, Stride, corrected, point_at, steps
from foldyn.periodic.equation import Equation
from foldyn.periodic.families import AboutRest, Free, InResonance
from foldyn.periodic.motion import (
    FLOOR,
    balance_of,
    balanced,
    linear_response,
    place_of,
    warn_of_errors,
)
from foldyn.periodic.orbit import SHOWN, STEPS, Orbit, along, is_stable
from foldyn.ram_limit import check_memory
from foldyn.results.dataset import points_dataset
from foldyn.values import flag, number, numbers, of_kind, show, whole

FIRST = 0.3  # length of the first step, relative to the longest step
TURN = 2.0 * np.pi
SAMPLES = 16  # samples of half a period at which energies are compared
CONSTANT = 1e-10  # goal for the relative change of the energy along a normal mode
RAISE, RAISES = 1.5, 3  # factor by which the number of harmonics grows, and most increases
WORTH = 30.0  # another increase is tried if the last one reduced the energy change by this factor
LOOSE = 1e-2  # relative change of the energy above which to warn


def backbone(
    case: Case,
    mode: int = 1,
    *,
    amplitudes: Sequence[float] = (1e-6, 1e-3),
    harmonics: int = 9,
    damped: bool = False,
    state: State | None = None,
    modes: int | None = None,
    longest_step: float = 0.3,
    most_points: int = 500,
    tolerance: float = 1e-9,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Frequency of the vibration that starts as a linear mode, as its amplitude grows.

    Nonlinear normal modes are the periodic motions of the undamped sheet without drive (Kerschen,
    Peeters, Golinval and Vakakis, Mech. Syst. Signal Process. 23, 2009).

    Parameters
    ----------
    case : Case
        As for `periodic_motion`. Damping and harmonic histories are ignored unless `damped`.
    mode : int
        Number of the mode, from 1, as in `modes`.
    amplitudes : (float, float)
        First and last amplitude: the largest displacement of any node from the equilibrium, m.
    harmonics : int
        Number of harmonics; for normal modes it is raised as needed to keep the energy constant.
    damped : bool
        Instead of the undamped case, follow the damped case under its harmonic histories in phase
        resonance, where force and displacement are a quarter of a period apart: the curve on which
        the peaks of response curves lie.
    state : State, optional
        State near the equilibrium about which the sheet vibrates; rest by default. The constant
        loads of the case act.
    modes : int, optional
        As for `periodic_motion`, about this state.
    longest_step : float
        Largest length of a step; a growth of the motion by its own size has the length 1.
    most_points : int
        Largest number of points.
    tolerance : float
        Largest last step of Newton's method, as a fraction of the motion.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress`, in which `steps` counts points.

    Returns
    -------
    xarray.Dataset
        Along `point`: `frequency` (Hz, coordinate), `amplitude` (m), `coefficient` (harmonic, node,
        axis) as in `periodic_motion`, `truncation`, with `modes` also `reduction`. For the undamped
        case `energy` (J) above the equilibrium and `energy_drift`, the largest relative change of
        this energy along the motion; for the damped case `level`, the factor on the drive,
        `floquet` and `stable`. Attributes: `linear_frequency` (Hz); `complete`, 1 if the last
        amplitude is reached; and facts about the run.

    Raises
    ------
    InputError
        As from `periodic_motion`.
    ComputationError
        The equilibrium is unstable, or the first motion is not found.
    MotionInterrupted
        Interrupted from the keyboard (Ctrl-C); the exception's `partial` holds the points so far.

    Warns
    -----
    FoldynWarning
        The backbone is lost before the last amplitude (the points found are kept); too few
        harmonics or modes; motions that pass through contacts.

    Notes
    -----
    Normal modes are sought among motions that come to rest twice in a period (series with only
    cosines). If one mode resonates with another, the backbone turns back and continues as a motion
    of both modes.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law="linear")
    >>> case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")])
    >>> spine = backbone(case, amplitudes=(1e-6, 0.05), harmonics=5)
    >>> bool(spine.frequency[-1] > spine.frequency[0])
    True
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    mode = whole("mode", mode, least=1)
    ends = numbers("amplitudes", amplitudes)
    if ends.shape != (2,) or not 0.0 < ends[0] < ends[1]:
        raise InputError(
            f" = {show(amplitudes)}: must be two increasing numbers above 0", "amplitudes"
        )
    longest = number("longest_step", longest_step, above=0.0, most=1.0)
    stride = Stride(FIRST * longest, longest, whole("most_points", most_points, least=2))
    tolerance = number("tolerance", tolerance, above=0.0, below=1.0)
    damped = flag("damped", damped)
    balance = balance_of(case, "fd.backbone", harmonics, modes=modes, guess=state, driven=damped)
    if damped and not balance.equation.damping.any():
        raise InputError(
            ": nothing damps the sheet, which in resonance swings without bound; give the case "
            "damping, or leave damped out",
            "damped",
        )
    with balance.threads:
        place, frequency, shape = _mode(balance.equation, state, mode)
        begin = _resonant if damped else _free
        family, first = begin(balance, place, frequency, shape * ends[0], tolerance)

        def reached(point: Point) -> float:
            return _largest(family.orbit(point.z, point.p), place)

        kept, complete, interrupted = [first], False, False
        try:
            with reported(progress) as report:
                complete = _follow(family, kept, stride, reached, ends, report)
        except KeyboardInterrupt:
            interrupted = True
        facts = {
            "mode": mode,
            "harmonics": balance.fourier.harmonics,
            "damped": damped,
            "linear_frequency": frequency,
            "complete": complete,
        }
        orbits = [family.orbit(point.z, point.p) for point in kept]
        if isinstance(family, Free):
            orbits = [_sharpened(family, orbit) for orbit in orbits]
            values = _values(orbits, place)
        else:
            floquet = np.array([orbit.multipliers(STEPS) for orbit in orbits])
            values = {
                "level": np.array([orbit.level for orbit in orbits]),
                "floquet": floquet,
                "stable": np.array([is_stable(row) for row in floquet]),
            }
        values |= along(orbits)
        values["frequency"] = np.array([orbit.omega / TURN for orbit in orbits])
        values["amplitude"] = np.array([_largest(orbit, place) for orbit in orbits])
    truncation = float(values["truncation"].max())
    warn_of_errors(orbits, balance.fourier.harmonics, truncation, values.get("reduction"))
    facts["wall_seconds"] = time.perf_counter() - began
    found = points_dataset("backbone", case, values, facts, origin=balance.equation.origin)
    if interrupted:
        raise MotionInterrupted(f"interrupted after {len(kept)} points", found)
    return found


def _mode(equation: Equation, state: Any, mode: int) -> tuple[NDArray, float, NDArray]:
    """Equilibrium (k,), and frequency (Hz) and shape (k,) of a mode; some node moves by 1."""
    case = equation.case
    displacement = place_of(case, state, "state", "a State, as fd.initial_state(path)")
    at, place = equation.undriven(displacement)
    stiffness = _settled(equation, at, place)
    if mode > equation.heavy:
        raise InputError(f" = {mode}: there are {equation.heavy} modes", "mode")
    u = at.displacements(place[None])[0]
    if len(equation.body.sheet.soft_hinges(u).offset):  # laws with zero slope at rest
        stiffness = equation.projected(equation.body.tangent(u, FLOOR))
    value, vector = equation.vibrations(stiffness, mode - 1, mode - 1)
    if not value[0] > 0.0:
        raise ComputationError(
            f"mode {mode} does not swing: the equilibrium is unstable, or nothing resists it; take "
            "a state near a stable one, or another mode"
        )
    return place, math.sqrt(value[0]) / TURN, vector[:, 0] / _reach(equation, vector.T)


def _settled(equation: Equation, at: Any, place: NDArray) -> NDArray:
    """Move unknowns (k,) into equilibrium, and return the stiffness (k, k) in equilibrium."""
    for _ in range(20):
        stiffness = at.tangents(place[None])[0]
        force = at.forces(place[None])[0]
        if np.linalg.norm(force) <= 4.0 * equation.rounding:
            break
        step = np.linalg.lstsq(stiffness, -force, rcond=None)[0]
        place += step
        if np.linalg.norm(step) <= 1e-13 * equation.length:
            break
    return stiffness


def _free(
    balance: Balance, place: NDArray, frequency: float, motion: NDArray, tolerance: float
) -> tuple[Free, Point]:
    """Family of normal modes, and its member closest to a linear mode of motion (k,)."""
    family = Free(balance, frequency, tolerance, place)
    x = np.zeros(balance.shape)
    x[0], x[1] = place, motion
    row = np.zeros(x.size + 1)
    row[len(motion) : 2 * len(motion)] = motion
    found = corrected(family, x.ravel(), frequency, row / np.abs(row).max(), 30)
    if found is None:
        raise ComputationError(
            f"no normal mode is found at the first amplitude, near {frequency:.6g} Hz; take another"
        )
    return family, point_at(family, *found[:2], row, found[2])


def _resonant(
    balance: Balance, place: NDArray, frequency: float, motion: NDArray, tolerance: float
) -> tuple[InResonance, Point]:
    """Family of motions in phase resonance, and a member with about the amplitude of a mode."""
    equation, omega = balance.equation, TURN * frequency
    x = np.zeros(balance.shape)
    x[0] = place
    response = linear_response(balance, x, omega, 1.0)
    size = _reach(equation, response[1:])
    if not size > 0.0:
        raise InputError(": the drive does not move the sheet", "case")
    level = _reach(equation, motion[None]) / size
    found = balanced(balance, x + level * response, omega, tolerance, level)
    family = InResonance(balance, tolerance, place, frequency)
    z, p = np.append(found.x, frequency / family.unit), math.log(level)
    row = np.zeros(len(z) + 1)
    row[-1] = 1.0
    near = corrected(family, z, p, row, 30)
    if near is None:
        raise ComputationError(
            f"no phase resonance is found near {frequency:.6g} Hz at the first amplitude: the mode "
            "is hardly driven, or others are near; drive it where it moves most"
        )
    return family, point_at(family, *near[:2], row, near[2])


def _sharpened(family: Free, orbit: Orbit) -> Orbit:
    """A normal mode with enough harmonics to keep its energy constant.

    No more are added if they gain little, for example where a law has a kink.
    """
    drift = _energy(orbit, family.place)[1]
    for _ in range(RAISES):
        if drift <= CONSTANT:
            break
        equation, kept = orbit.equation, len(orbit.amplitudes)
        fourier = Fourier(math.ceil(RAISE * (kept - 1)), even=True)
        try:
            check_memory("harmonics", "a larger matrix", fourier.memory(equation.size), "")
        except InputError:
            break
        finer = Free(Balance(equation, fourier), family.span, family.tolerance, family.place)
        x = fourier.real_of(orbit.amplitudes)
        row = np.append(x.ravel(), 0.0)  # fixes the size of the motion
        row[: equation.size] = 0.0
        found = corrected(finer, x.ravel(), orbit.omega / TURN, row / np.abs(row).max(), 30)
        if found is None:
            break
        sharper = finer.orbit(*found[:2])
        left = _energy(sharper, family.place)[1]
        if left >= drift:
            break
        orbit, drift, gain = sharper, left, drift / max(left, CONSTANT)
        if gain < WORTH:
            break
    return orbit


def _reach(equation: Equation, motions: NDArray) -> float:
    """Largest displacement of a node in motions (j, k) of the unknowns."""
    return float(np.linalg.norm(equation.nodal(motions @ equation.basis.T), axis=2).max())


def _follow(
    family: Any, kept: list[Point], stride: Stride, reached: Callable[[Point], float],
    ends: NDArray, report: Reporter,
) -> bool:  # fmt: skip
    """Add points up to the last amplitude; returns whether the last amplitude is reached."""
    whole_way = math.log(ends[1] / ends[0])
    for step in steps(family, kept[0], stride, lambda point: reached(point) / ends[1] - 1.0):
        if not isinstance(step, Step):
            remedy = "a smaller longest_step, or more harmonics" if step == LOST else "most_points"
            warn(
                f"the backbone ends at an amplitude of {reached(kept[-1]):.3g} m; the points "
                f"before are kept. Remedy: {remedy}",
                "nonlinear-vibration.md#backbones",
            )
            return False
        kept.append(step.after)
        done = math.log(reached(step.after) / ends[0]) / whole_way
        report(Progress(min(max(done, 0.0), 1.0), 1.0, len(kept), 0.0))
    return True


def _largest(orbit: Orbit, place: NDArray) -> float:
    """Largest displacement of any node from the equilibrium (k,) in a motion, m."""
    phase = TURN * np.arange(SHOWN) / SHOWN
    equation = orbit.equation
    mean = equation.nodal(equation.at(np.zeros(1), 0.0).displacements(place[None]))
    return float(np.linalg.norm(orbit.displacement(phase) - mean, axis=2).max())


def _values(orbits: list[Orbit], place: NDArray) -> dict[str, Any]:
    """Energy and energy drift of normal modes; warns if the drift is large."""
    energies = np.array([_energy(orbit, place) for orbit in orbits])
    worst = float(energies[:, 1].max())
    if worst > LOOSE:
        warn(
            f"harmonics: the energy of a motion should be constant, but changes by {worst:.1g} of "
            "its size: give more",
            "nonlinear-vibration.md#backbones",
        )
    return {"energy": energies[:, 0], "energy_drift": energies[:, 1]}


def _energy(orbit: Orbit, place: NDArray) -> tuple[float, float]:
    """Energy (J) above the equilibrium, and its largest relative change along the motion."""
    phase, equation = np.pi * np.arange(SAMPLES + 1) / SAMPLES, orbit.equation
    x = values_of(orbit.amplitudes, phase)
    v = orbit.omega * values_of(orbit.amplitudes, phase, 1)
    stored = AboutRest(equation, phase, place).energies(x)
    total = stored + 0.5 * np.einsum("ji,ik,jk->j", v, equation.mass, v)
    return float(total[0]), float(np.ptp(total) / total.mean())
