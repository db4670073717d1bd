"""`periodic_motion`: the steady response of a case to its harmonic histories."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.attractors.drive import HARMONIC
from foldyn.cases import Case, State
from foldyn.errors import ComputationError, InputError, warn
from foldyn.periodic.balance import Balance, newton
from foldyn.periodic.collocation import Shooting
from foldyn.periodic.equation import Equation
from foldyn.periodic.floquet import STEPS, is_stable, multipliers
from foldyn.periodic.fourier import Fourier, values_of
from foldyn.periodic.orbit import SHOWN, Orbit
from foldyn.periodic.reduction import reduced
from foldyn.periodic.start import balanced, coefficients, equilibrium, orbit_of, origin_of
from foldyn.ram_limit import check_memory
from foldyn.results.periodic_dataset import periodic_dataset
from foldyn.values import choice, number, of_kind, whole

if TYPE_CHECKING:
    import xarray

METHODS = ("harmonic_balance", "shooting")
TRUNCATED = 1e-3  # of the motion: effect of twice as many harmonics above which to warn
REDUCED = 0.05  # of the motion: effect of the omitted dofs above which to warn
NAMED = 5  # frequencies listed in a warning
FEW = 3  # harmonics of the motion from which shooting starts
ROUNDING = 1e-14  # of the motion: harmonics of a shooting result that count as zero
TURN = 2.0 * math.pi


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
    at a frequency: `guess` selects one, `response_curve` finds connected ones.

    Parameters
    ----------
    case : Case
        Case with `Harmonic` histories of forces, base motions, imposed displacements or actuated
        creases; other histories are constant.
    frequency : float, optional
        Frequency (Hz) of the slowest of these histories; others keep their ratio to it, and all
        keep their phases. By default the frequency of the case.
    harmonics : int
        Number of harmonics of the motion's own frequency.
    method : {"harmonic_balance", "shooting"}
        A Fourier series whose equation is satisfied in the mean over each harmonic, or the initial
        state to which integration over a period (Radau's method of order 5) returns.
    guess : State or xarray.Dataset, optional
        Start of the search: small motions about a state, or a result of `periodic_motion` or a
        point of a `response_curve`. By default the equilibrium under the constant loads. Damping
        with ``state = "initial"`` is taken about this state, or continued from a result.
    periods : int
        Periods of the drive in one period of the motion: 2 after a period doubling.
    modes : int, optional
        For large sheets: instead of all free dofs, use the span of this many modes about the guess
        (about the equilibrium, if it is a motion), their derivatives and the static response to the
        drive.
    steps : int
        Integration steps in a period of the drive, for shooting and the multipliers.
    tolerance : float
        Last step of Newton's method, as a fraction of the motion.

    Returns
    -------
    xarray.Dataset
        Over one period `displacement`, `velocity` (time, node, axis); `coefficient` (harmonic,
        node, axis), complex amplitudes c_j of the motion Re sum c_j exp(2 pi i j t / T); `floquet`
        (multiplier), the largest first, eigenvalues of the monodromy matrix that integrates the
        variational equation; `stable`; `periods`. Attributes: `frequency`, `truncation` (effect
        of twice as many harmonics, as a fraction of the motion, estimated from the residual
        there), with `modes` also `reduction` (effect of the omitted dofs, likewise) and facts
        about the run.

    Raises
    ------
    InputError
        An argument out of range; nothing drives the case, or not harmonically; friction, laws with
        memory, damping with a matrix that varies, massless unknowns, or supports that let it drift.
    ComputationError
        No motion is found.

    Warns
    -----
    FoldynWarning
        There are too few harmonics, or modes; the motion passes through a contact.

    Notes
    -----
    Bases swing about their rest positions. Motions with few harmonics of stiff sheets are smooth,
    so that multipliers of vibrations too fast for the steps show the decay by alpha M, but no
    phase.

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
    omega = TURN * frequency_of(balance, frequency)
    with balance.threads:
        if method == "shooting":
            orbit, floquet, spent = _shot(balance, guess, omega, steps, tolerance)
        else:
            x = coefficients(balance, guess, omega)
            found = balanced(balance, x, omega, tolerance)
            orbit, spent = orbit_of(balance, found.x, omega), found.iterations
            floquet = multipliers(balance.equation, orbit.amplitudes, omega, periods, steps=steps)
    truncation = orbit.truncation()
    warn_of_truncation(truncation, len(orbit.amplitudes) - 1, "harmonics")
    warn_of_crossing([orbit])
    reduction = None if modes is None else orbit.reduction()
    warn_of_reduction(reduction)
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
    guess: Any = None, steps: int = STEPS,
) -> Balance:  # fmt: skip
    """Balance of a driven case; raises `InputError` without a drive, or if memory is too small."""
    harmonics = whole("harmonics", harmonics, least=1)
    equation = Equation(case, name, origin=origin_of(case, guess))
    if not equation.drive.varies:
        raise InputError(
            f"case: nothing drives it: {name} follows the period of a load or support; give one "
            f"the history {HARMONIC}"
        )
    equation = on_modes(equation, modes, guess)
    fourier, size = Fourier(harmonics), (2 * harmonics + 1) * equation.size
    needed = fourier.memory(equation.size)
    check_memory("harmonics", f"a matrix of {size} unknowns", needed, "take fewer")
    instants, each = 3.0 * steps * periods, equation.size**2 + 4 * equation.body.size
    period = f"a period of {steps * periods:.3g} steps"
    check_memory("steps", period, 8.0 * instants * each, "take fewer")
    return Balance(equation, fourier, periods)


def on_modes(equation: Equation, modes: int | None, guess: Any) -> Equation:
    """The equation reduced to modes about a guess; itself if `modes` is None."""
    if modes is None:
        return equation
    count, case = whole("modes", modes, least=1), equation.case
    if isinstance(guess, State):
        return reduced(equation, count, guess.of_nodes("displacement", case.structure.nodes.shape))
    return reduced(equation, count, equilibrium(case))


def frequency_of(balance: Balance, given: float | None) -> float:
    """Frequency (Hz) of the drive: given, or of the case."""
    own = balance.equation.drive.frequency
    return own if given is None else number("frequency", given, above=0.0, unit="Hz")


def warn_of_truncation(truncation: float, harmonics: int, field: str) -> None:
    """Warn if a motion needs more harmonics."""
    if truncation > TRUNCATED:
        warn(
            f"{field} = {harmonics}: twice as many would change the motion by about "
            f"{truncation:.1g} of it; give more",
            "nonlinear-vibration.md#one-motion",
        )


def warn_of_reduction(reduction: Any) -> None:
    """Warn if modes omit much of the motions, given their `reduction` or None."""
    most = 0.0 if reduction is None else float(np.max(reduction))
    if most > REDUCED:
        warn(
            f"modes: what they leave out would change the motion by {most:.1g} of it or more; give "
            "more",
            "nonlinear-vibration.md#big-sheets",
        )


def warn_of_crossing(orbits: Sequence[Orbit]) -> None:
    """Warn of motions that pass through contacts."""
    crossed = [f"{orbit.omega / TURN:.6g} Hz" for orbit in orbits if orbit.crosses()]
    if crossed:
        warn(
            f"contact: the motion at {', '.join(crossed[:NAMED])} passes through what it touches, "
            "so that it is not valid; give another guess, or give more harmonics",
            "nonlinear-vibration.md#one-motion",
        )


def _shot(
    balance: Balance, guess: Any, omega: float, steps: int, tolerance: float
) -> tuple[Orbit, NDArray, int]:
    """Motion by shooting from one of few harmonics, its multipliers, and the iterations spent."""
    equation, longer = balance.equation, balance.multiple
    few = Balance(equation, Fourier(min(balance.fourier.harmonics, FEW * longer)), longer)
    near = orbit_of(few, balanced(few, coefficients(few, guess, omega), omega, 1e-3).x, omega)
    shooting = Shooting(equation, omega, steps, longer)
    begin = [values_of(near.amplitudes, np.zeros(1), k)[0] for k in (0, 1)]
    found = newton(shooting, np.concatenate(begin), tolerance)
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
    orbit = Orbit(equation, amplitudes[:kept], omega, longer)
    floquet = multipliers(equation, orbit.amplitudes, omega, longer, steps=steps)
    return orbit, floquet, found.iterations
