"""`periodic_motion`: the steady response of a case to its harmonic histories."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.attractors.drive import HARMONIC
from foldyn.cases import Case, Constant, Impose, Origin, State
from foldyn.dynamics import initial
from foldyn.errors import ComputationError, InputError, warn
from foldyn.linear.linearized import equivalent_slope
from foldyn.periodic.balance import Balance, Converged, Fourier, newton, values_of
from foldyn.periodic.continuation import Step, Stride, point_at, steps
from foldyn.periodic.equation import Equation
from foldyn.periodic.families import ByLevel
from foldyn.periodic.orbit import SHOWN, STEPS, Orbit, Shooting, is_stable
from foldyn.periodic.reduction import reduced
from foldyn.ram_limit import check_memory
from foldyn.results.dataset import periodic_dataset
from foldyn.statics import trace
from foldyn.statics.equilibrium import drives
from foldyn.statics.tracing import displacement_of
from foldyn.values import choice, number, of_kind, whole

METHODS = ("harmonic_balance", "shooting")
TRUNCATED = 1e-3  # warn if twice as many harmonics change the motion by more than this fraction
REDUCED = 0.05  # warn if the omitted dofs change the motion by more than this fraction
NAMED = 5  # most frequencies listed in a warning
FEW = 3  # number of harmonics of the motion from which shooting starts
ROUNDING = 1e-14  # harmonics of a shooting result below this fraction of the motion are zero
FLOOR = float(equivalent_slope(0.0, np.radians(1.0)))
"""Slope of superlinear hinges at rest in a first guess, for a swing of one degree."""
LITTLE = 1e-4  # fraction of the drive that is small enough for forces to be proportional to it
SMALL = 0.05  # fraction of the drive from which a motion is followed to the full drive
GROWING = Stride(0.05, 0.5, 200)
TURN = 2.0 * np.pi
PLACES = "None, a State, or a result of periodic_motion or response_curve"


def periodic_motion(
    case: Case,
    frequency: float | None = None,
    *,
    harmonics: int = 9,
    method: str = "harmonic_balance",
    guess: State | xarray.Dataset | None = None,
    periods: int = 1,
    modes: int | None = None,
    steps: int = STEPS,
    tolerance: float = 1e-9,
) -> xarray.Dataset:
    """Periodic motion of a case under its harmonic histories, and its stability.

    Solves M u'' + C u' + F(u, t) = p(t) with the exact internal forces F. Several motions may exist
    at a frequency: `guess` selects one, and `response_curve` finds motions connected to it.

    Parameters
    ----------
    case : Case
        Case with `Harmonic` histories of forces, base motions, imposed displacements or actuated
        creases; other histories are constant.
    frequency : float, optional
        Frequency (Hz) of the slowest of these histories; the others keep their frequency ratio to
        it, and all keep their phases. By default the frequency of the case.
    harmonics : int
        Number of harmonics of the motion's own frequency.
    method : {"harmonic_balance", "shooting"}
        What is solved for: a Fourier series that satisfies the equation of motion projected on each
        harmonic, or an initial state to which integration over one period (Radau's method of order
        5) returns.
    guess : State or xarray.Dataset, optional
        Start of the search: a state, about which the motion is taken as small at first, or a result
        of `periodic_motion` or a point of a `response_curve`. By default the equilibrium under the
        constant loads. Damping with ``state = "initial"`` is taken about this state, or as in the
        given result.
    periods : int
        Periods of the drive in one period of the motion: 2 after a period doubling.
    modes : int, optional
        For large sheets: instead of all free dofs, use the span of this many modes, their modal
        derivatives and the static response to the drive. The modes are taken about the guess, or
        about the equilibrium if the guess is a motion.
    steps : int
        Integration steps in a period of the drive, for shooting and the multipliers.
    tolerance : float
        Largest last step of Newton's method, as a fraction of the motion.

    Returns
    -------
    xarray.Dataset
        `displacement`, `velocity` (time, node, axis) in one period; `coefficient` (harmonic, node,
        axis), complex amplitudes c_j of the motion Re sum c_j exp(2 pi i j t / T); `floquet`
        (multiplier), the eigenvalues of the monodromy matrix of the variational equation, the
        largest first; `stable`; `periods`. Attributes: `frequency`; `truncation`, the effect of
        twice as many harmonics as a fraction of the motion, estimated from the residual at the
        additional harmonics; with `modes` also `reduction`, the effect of the omitted dofs,
        estimated in the same way; and facts about the run.

    Raises
    ------
    InputError
        An argument out of range; nothing drives the case, or not harmonically; friction, laws with
        memory, damping with a matrix that varies, or supports that let it drift.
    ComputationError
        No motion is found.

    Warns
    -----
    FoldynWarning
        There are too few harmonics, or modes; the motion passes through a contact.

    Notes
    -----
    Bases swing about their rest positions. If vibrations of a stiff sheet are too fast for the
    integration steps, their multipliers show the decay by alpha M, but not the phase.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law="linear")
    >>> push = fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(0.5))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> one = periodic_motion(fd.Case(s, supports, [push], fd.Rayleigh(alpha=0.5)), harmonics=5)
    >>> bool(one.stable)
    True
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    choice("method", method, METHODS)
    tolerance = number("tolerance", tolerance, above=0.0, below=1.0)
    steps = whole("steps", steps, least=4)
    periods = whole("periods", periods, least=1)
    balance = balance_of(case, "fd.periodic_motion", harmonics, periods, modes, guess, steps)
    if frequency is None:
        frequency = balance.equation.drive.frequency
    omega = TURN * number("frequency", frequency, above=0.0, unit="Hz")
    with balance.threads:
        if method == "shooting":
            orbit, spent = _shot(balance, guess, omega, steps, tolerance)
        else:
            found = balanced(balance, coefficients(balance, guess, omega), omega, tolerance)
            orbit, spent = Orbit.of(balance, found.x, omega), found.iterations
        floquet = orbit.multipliers(steps)
    truncation = orbit.truncation()
    reduction = None if modes is None else orbit.reduction()
    warn_of_errors([orbit], len(orbit.amplitudes) - 1, truncation, reduction)
    phase = TURN * np.arange(SHOWN) / SHOWN
    motion = {"displacement": orbit.displacement(phase), "velocity": orbit.velocity(phase)}
    facts = {
        "method": method,
        "frequency": omega / TURN,
        "harmonics": len(orbit.amplitudes) - 1,
        "steps": steps,
        "iterations": spent,
        "truncation": truncation,
        "modes": modes,
        "reduction": reduction,
        "multipliers": "variational equation integrated by Gauss's method of order 6",
        "wall_seconds": time.perf_counter() - began,
    }
    return periodic_dataset(
        case, phase / TURN * orbit.period, motion, orbit.node_amplitudes(), floquet,
        is_stable(floquet), periods, facts, balance.equation.origin,
    )  # fmt: skip


def balance_of(
    case: Case, name: str, harmonics: int, periods: int = 1, modes: int | None = None,
    guess: Any = None, steps: int = STEPS, driven: bool = True,
) -> Balance:  # fmt: skip
    """Balance of a case; for undriven cases, of free motions with an even series.

    Raises
    ------
    InputError
        Nothing drives a case that is to be driven, or memory is too small.
    """
    harmonics = whole("harmonics", harmonics, least=1)
    equation = Equation(case, name, driven, origin_of(case, guess) if driven else None)
    if driven and not equation.drive.frequency:
        raise InputError(
            f"case: nothing drives it: {name} follows the period of a load or support; give one "
            f"the history {HARMONIC}"
        )
    if modes is not None:
        count = whole("modes", modes, least=1)
        if isinstance(guess, State):
            place = guess.of_nodes("displacement", case.structure.nodes.shape)
        else:
            place = equilibrium(case)
        equation = reduced(equation, count, place)
    fourier = Fourier(harmonics, even=not driven)
    size, needed = fourier.count * equation.size, fourier.memory(equation.size)
    check_memory("harmonics", f"a matrix of {size} unknowns", needed, "take fewer")
    if driven:
        instants, each = 3.0 * steps * periods, equation.size**2 + 4 * equation.body.size
        period = f"a period of {steps * periods:.3g} steps"
        check_memory("steps", period, 8.0 * instants * each, "take fewer")
    return Balance(equation, fourier, periods)


def warn_of_errors(
    orbits: Sequence[Orbit], harmonics: int, truncation: float, reduction: Any
) -> None:
    """Warn of motions that need more harmonics or modes, or pass through contacts.

    reduction : effect of the omitted dofs on each motion; None without `modes`.
    """
    if truncation > TRUNCATED:
        warn(
            f"harmonics = {harmonics}: twice as many would change the motion by about "
            f"{truncation:.1g} of its size; give more",
            "nonlinear-vibration.md#one-motion",
        )
    crossed = [f"{orbit.omega / TURN:.6g} Hz" for orbit in orbits if orbit.crosses()]
    if crossed:
        warn(
            f"contact: the motion at {', '.join(crossed[:NAMED])} passes through a contact and is "
            "not valid; give another guess, or give more harmonics",
            "nonlinear-vibration.md#one-motion",
        )
    most = 0.0 if reduction is None else float(np.max(reduction))
    if most > REDUCED:
        warn(
            f"modes: the omitted dofs would change the motion by {most:.1g} of its size or more; "
            "give more modes",
            "nonlinear-vibration.md#big-sheets",
        )


def _shot(
    balance: Balance, guess: Any, omega: float, steps: int, tolerance: float
) -> tuple[Orbit, int]:
    """Motion by shooting, started from a motion of few harmonics, and the iterations spent."""
    equation, longer = balance.equation, balance.multiple
    few = Balance(equation, Fourier(min(balance.fourier.harmonics, FEW * longer)), longer)
    near = Orbit.of(few, balanced(few, coefficients(few, guess, omega), omega, 1e-3).x, omega)
    shooting = Shooting(equation, omega, steps, longer)
    x, v = (values_of(near.amplitudes, np.zeros(1), k)[0] for k in (0, 1))
    start = np.concatenate([x, v[: equation.heavy]])
    found = newton(shooting.residual, shooting.jacobian, start, tolerance, 0.0)
    if found is None:
        raise ComputationError(
            f"method = 'shooting': does not converge at {omega / TURN:g} Hz; give more steps, or "
            "take method = 'harmonic_balance'"
        )
    states = shooting.period(found.x)[0]
    count = len(states) - 1
    amplitudes = np.fft.rfft(states[:-1, : equation.size], axis=0)[: (count + 1) // 2] / count
    amplitudes[1:] *= 2.0
    size = np.linalg.norm(amplitudes, axis=1)
    tail = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1])  # norm of each harmonic and all higher ones
    kept = max(int((tail > ROUNDING * tail[0]).sum()), 2)
    return Orbit(equation, amplitudes[:kept], omega, longer), found.iterations


def still_case(case: Case) -> Case:
    """The case without varying loads, its swinging supports held in place."""
    loads = [load for load in case.loads if load.history == Constant()]
    supports = []
    for support in case.supports:
        if getattr(support, "history", None) in (None, Constant()):
            supports.append(support)
        elif isinstance(support, Impose):
            supports.append(replace(support, value=0.0, history=Constant()))
    contact = case.contact
    if contact is not None:
        planes = []
        for plane in contact.planes:
            stands = plane.history in (None, Constant())
            planes.append(plane if stands else replace(plane, motion=None, history=None))
        contact = replace(contact, planes=planes)
    return case.altered(loads=loads, supports=supports, contact=contact)


def equilibrium(case: Case) -> NDArray:
    """Displacement (n, 3), m, under the constant loads, near rest."""
    still = still_case(case)
    if not drives(still, ()):
        return np.zeros_like(case.structure.nodes)
    return trace(still, "newton", load_factors=[0.0, 1.0])["displacement"].values[-1]


def place_of(case: Case, state: Any, field: str, expected: str) -> NDArray:
    """Displacement (n, 3), m, of a state, or of the equilibrium if none is given."""
    if state is None:
        return equilibrium(case)
    return displacement_of(state, case, field, expected)


def origin_of(case: Case, guess: Any) -> Origin | None:
    """State about which damping with ``state = "initial"`` is taken; None without such damping.

    It is the state or result from which the search begins or, without one, the equilibrium.
    """
    if not case.damped_at_start:
        return None
    if isinstance(guess, State):
        return guess.origin_of(case.structure.nodes.shape, field="guess")
    found = initial.origin_of(guess, "guess: ") if isinstance(guess, xarray.Dataset) else None
    return found or Origin(equilibrium(case))


def coefficients(balance: Balance, guess: Any, omega: float, level: float = 1.0) -> NDArray:
    """Initial coefficients (c, k): from a given motion, or of small motions about a state."""
    equation = balance.equation
    if isinstance(guess, xarray.Dataset):
        return _of_result(balance, guess, level)
    place = place_of(equation.case, guess, "guess", PLACES)
    x = np.zeros(balance.shape)
    x[0] = equation.undriven(place)[1]
    return x + linear_response(balance, x, omega, level)


def linear_response(balance: Balance, x: NDArray, omega: float, level: float) -> NDArray:
    """Coefficients (c, k) of one Newton step from a state, with a least slope for soft hinges."""
    equation, fourier = balance.equation, balance.fourier
    still = balance.residual(x, omega, balance.instants(0.0))
    little = balance.residual(x, omega, balance.instants(LITTLE * level))
    residual = still + (little - still) / LITTLE
    u = equation.basis @ x[0] + equation.offset
    tangent = equation.projected(equation.body.tangent(u, FLOOR))
    w = omega / balance.multiple
    amplitudes = fourier.complex_of(residual)
    for j in range(len(amplitudes)):
        matrix = tangent - (j * w) ** 2 * equation.mass + 1j * j * w * equation.damping
        amplitudes[j] = np.linalg.lstsq(matrix, -amplitudes[j], rcond=None)[0]
    return fourier.real_of(amplitudes)


def _of_result(balance: Balance, guess: xarray.Dataset, level: float) -> NDArray:
    """Coefficients (c, k) of a motion from an earlier result."""
    found = guess.variables.get("coefficient")
    n = len(balance.equation.case.structure.nodes)
    if found is None or found.dims != ("harmonic", "node", "axis") or found.shape[1:] != (n, 3):
        raise InputError(
            f": must be {PLACES} of this case (of a curve one point, as curve.isel(point=3))",
            "guess",
        )
    given, longer = np.asarray(found), balance.multiple
    if not np.isfinite(given).all():
        raise InputError(": its coefficients must be finite", "guess")
    own = int(guess.get("periods", 1))
    if own != longer:  # the same motion in a longer period
        if longer % own:
            raise InputError(
                f": its period is {own} of the drive; give periods = {own}, or a multiple", "guess"
            )
        spread = np.zeros(((len(given) - 1) * (longer // own) + 1, n, 3), complex)
        spread[:: longer // own] = given
        given = spread
    phase = balance.fourier.phase
    at = balance.instants(level)
    return balance.fourier.fit @ balance.equation.unknowns(values_of(given, phase), at)


def balanced(
    balance: Balance, x: NDArray, omega: float, tolerance: float, level: float = 1.0
) -> Converged:
    """The motion near coefficients (c, k), or the motion that grows from rest with the drive.

    Raises
    ------
    ComputationError
        Neither motion is found.
    """
    family = ByLevel(balance, level, tolerance, omega / TURN)
    return family.solved(x.ravel(), level) or _grown(family, x, level)


def _grown(family: ByLevel, x: NDArray, level: float) -> Converged:
    """Follow the motion from a small drive to the full one, around folds."""
    still = np.zeros(x.shape)
    still[0] = x[0]
    begin = (still + SMALL * (x - still)).ravel()
    first, share = family.solved(begin, SMALL * level), 0.0
    if first is not None:
        spent, ahead = first.iterations, np.append(np.zeros(x.size), 1.0)
        top = point_at(family, first.x, SMALL * level, ahead)  # point with the largest drive so far
        for step in steps(family, top, GROWING, lambda point: point.p / level - 1.0):
            if not isinstance(step, Step) or step.after.p < 0.0:
                break
            spent += step.after.iterations
            top = max(top, step.after, key=lambda point: point.p)
        found, share = family.solved(top.z, level), top.p / level
        if found is not None:
            return Converged(found.x, spent + found.iterations)
    raise ComputationError(
        f"frequency = {family.omega / TURN:g} Hz: no periodic motion is found; the search ends at "
        f"{share:.2g} of the drive. Remedies: another guess (a motion at a frequency nearby, or a "
        "State), fd.response_curve from a frequency off resonance, or more damping"
    )
