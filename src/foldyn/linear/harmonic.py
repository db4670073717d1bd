"""Frequency response at a given amplitude: superlinear hinges linearized for their own swing.

Under a sine of finite amplitude each superlinear hinge swings with its own amplitude A_h. With one
harmonic its moment equals that of a linear hinge with the slope k_eq(A_h) (`equivalent_slope`), and

    (K(A) - w^2 M + i w C) x = f,    A_h = |g_h x|,

with g_h the gradient of the hinge's dihedral, is a nonlinear equation for the slopes: harmonic
balance with a single harmonic (Krylov and Bogoliubov 1947; Krack and Gross, Harmonic Balance for
Nonlinear Vibration Problems, 2019). Displacements are small compared to the structure, except for
these slopes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.complex_symmetric import solve
from foldyn.arguments import Check, Checked
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError
from foldyn.linear.excitation import Answer, Drive, drive_terms, warn_at
from foldyn.linear.frequency_domain import RESONANCE, dynamic_stiffness
from foldyn.linear.linearized import Linearized, equivalent_slope
from foldyn.materials import Superlinear
from foldyn.values import number, whole

REFERENCE = 1.0  # degrees: swing whose slopes are part of the given system
DEPTH = 5  # number of previous iterations used for the acceleration
PATIENCE = 25  # accelerated iterations before slow iterations are tried
RELAXED = 0.3  # share of the full step in a slow iteration
FURTHEST = 1.5  # largest factor on slopes when they are extrapolated to the next frequency
LEAST = 1e-12  # rad: least swing of a hinge
APART = 1e-4  # relative half width in the swing, for the numerical derivative of slopes


@dataclass(frozen=True)
class HarmonicBalance(Checked):
    """Options of the harmonic method.

    Parameters
    ----------
    tolerance : float
        Largest change of the response in the last iteration, relative to its maximum.
    iterations : int
        Most iterations at a frequency.
    """

    tolerance: Annotated[float, Check(number, above=0.0)] = 1e-6
    iterations: Annotated[int, Check(whole, least=2)] = 300


def harmonic(
    system: Linearized, drive: Drive, frequency: NDArray, options: HarmonicBalance, report: Reporter
) -> Answer:
    """Balance one harmonic at each frequency, starting from the slopes at the previous frequency.

    If the response has several branches, rising frequencies follow a branch until it ends.

    Parameters
    ----------
    system : Linearized
        System whose superlinear hinges have the slope for a swing of `REFERENCE`.

    Returns
    -------
    Answer
        Response at the amplitude of the drive, nan if the iteration does not converge or at an
        undamped resonance; `swing` (m,), the largest amplitude (rad) of a superlinear hinge; the
        number of iterations.

    Warns
    -----
    FoldynWarning
        The response is nan at some frequencies.
    """
    case = system.case
    turned = [k for change, _ in case.rest_terms for k in np.flatnonzero(change).tolist()]
    if any(isinstance(case.body.sheet.rest_law(k), Superlinear) for k in turned):
        raise InputError(
            " = 'harmonic': does not know how far actuated folds (or heated bends) of "
            "the superlinear law are from their rest angle; give another law, or take stepped_sine",
            "method",
        )
    hinges = Hinges(system)
    terms = drive_terms(system, drive)
    response = np.full((len(frequency), len(system.free)), np.nan, np.complex128)
    swing, spent = np.full(len(frequency), np.nan), 0
    done: list[tuple[float, NDArray]] = []
    converged = np.ones(len(frequency), bool)
    for k, f in enumerate(frequency):
        omega = 2.0 * np.pi * f
        load = np.sum([term.shape * (drive.value * term.factor(omega)) for term in terms], axis=0)
        start = _ahead(done, float(f), hinges.reference)
        motion, slope, more = _balanced(hinges, system, omega, load, options, start)
        spent += more
        if motion is None:
            converged[k] = False
        else:
            done = [*done[-1:], (float(f), slope)]
            response[k] = motion / drive.value
            swing[k] = np.abs(hinges.gradient @ motion).max(initial=0.0)
        report(Progress(k + 1.0, float(len(frequency)), spent, 0.0))
    warn_at(
        frequency[~converged],
        "the harmonic balance does not converge at {} (nan) within "
        f"{options.iterations} iterations; give more iterations, closer frequencies or more "
        "damping",
    )
    warn_at(frequency[converged & np.isnan(response).any(axis=1)], RESONANCE)
    return Answer(response, {"swing": swing}, {"iterations": spent})


def _ahead(done: list[tuple[float, NDArray]], frequency: float, first: NDArray) -> NDArray:
    """Initial slopes, extrapolated linearly from the last two frequencies."""
    if not done:
        return first
    (f1, s1), (f2, s2) = done[0], done[-1]
    if len(done) == 1:
        return s2
    line = s2 + (s2 - s1) * (frequency - f2) / (f2 - f1)
    return np.clip(line, s2 / FURTHEST, s2 * FURTHEST)


class Hinges:
    """The superlinear hinges of a system: gradients, offsets from rest, stiffness and slopes."""

    def __init__(self, system: Linearized) -> None:
        body = system.case.body
        hinges = body.sheet.soft_hinges(body.dofs(system.displacement))
        gradient = hinges.gradient
        if ties := system.case.constraints:
            gradient = gradient @ ties.extended(gradient.shape[1])
        self.gradient = sparse.csr_array(gradient[:, system.free])
        self.offset, self.stiffness = hinges.offset, hinges.stiffness
        self.reference = equivalent_slope(self.offset, np.radians(REFERENCE))

    def slope(self, motion: NDArray) -> NDArray:
        """Equivalent slopes / k (nh,) in a motion (nf,)."""
        return equivalent_slope(self.offset, np.maximum(np.abs(self.gradient @ motion), LEAST))

    def change(self, slope: NDArray) -> sparse.csr_array:
        """Stiffness to add to the reference stiffness for the given slopes."""
        weight = sparse.diags_array(self.stiffness * (slope - self.reference))
        return self.gradient.T @ weight @ self.gradient

    def left(self, stiffness: sparse.csc_array, motion: NDArray, load: NDArray) -> NDArray:
        """Out-of-balance force (nf,) of a motion (nf,), given the reference dynamic stiffness."""
        turned = self.gradient @ motion
        change = self.stiffness * (self.slope(motion) - self.reference)
        return stiffness @ motion + self.gradient.T @ (change * turned) - load

    def tangent(self, stiffness: sparse.csc_array, motion: NDArray) -> sparse.csc_array:
        """Jacobian (2 nf, 2 nf) of `left` for real and imaginary parts of the motion.

        A moment k s(A) y of the turn y changes by k s dy + k s' Re(y* dy) y / A.
        """
        turned = self.gradient @ motion
        swing = np.maximum(np.abs(turned), LEAST)
        ends = [equivalent_slope(self.offset, swing * by) for by in (1.0 + APART, 1.0 - APART)]
        curved = self.stiffness * (ends[0] - ends[1]) / (2.0 * APART * swing) / swing
        whole = stiffness + self.change(self.slope(motion))
        parts = [
            self.gradient.T @ sparse.diags_array(curved * one * other) @ self.gradient
            for one, other in (
                (turned.real, turned.real), (turned.real, turned.imag), (turned.imag, turned.imag),
            )
        ]  # fmt: skip
        real = [whole.real + parts[0], parts[1] - whole.imag]
        imaginary = [parts[1] + whole.imag, whole.real + parts[2]]
        return sparse.block_array([real, imaginary], format="csc")


def _balanced(
    hinges: Hinges, system: Linearized, omega: float, load: NDArray, options: HarmonicBalance,
    start: NDArray,
) -> tuple[NDArray | None, NDArray, int]:  # fmt: skip
    """Motion (nf,), None without convergence, slopes of the hinges in it, and iterations.

    The accelerated iteration (Anderson) comes first; it may cycle near the end of a branch, or
    find the unstable branch between two stable branches. The slow iteration follows, which
    converges only to stable branches.
    """
    stiffness, spent = dynamic_stiffness(system, omega), 0
    for accelerated in (True, False):
        most, slope, before = PATIENCE if accelerated else options.iterations, start, None
        slopes: list[NDArray] = []
        misses: list[NDArray] = []
        # in a slow step the change is less than the remaining error
        tolerance = options.tolerance * (1.0 if accelerated else RELAXED)
        while len(slopes) < most and spent < options.iterations:
            spent += 1
            matrix = sparse.csc_array(stiffness + hinges.change(slope))
            motion = solve(matrix, load, system.gram, 1j * omega)
            if np.isnan(motion).any() or not len(slope):
                return motion, slope, spent
            if before is not None:
                change = np.abs(motion - before).max()
                if change <= tolerance * np.abs(motion).max():
                    if accelerated and _repels(slopes, misses):
                        break
                    return motion, slope, spent
            before = motion
            slopes.append(slope)
            misses.append(hinges.slope(motion) - slope)
            slope = _anderson(slopes, misses) if accelerated else slope + RELAXED * misses[-1]
    return None, start, spent


def _anderson(slopes: list[NDArray], misses: list[NDArray]) -> NDArray:
    """Next slopes, from the last few slopes (Walker and Ni, SIAM J. Numer. Anal. 49, 2011)."""
    plain = slopes[-1] + misses[-1]
    if len(slopes) == 1:
        return plain
    moved, turned = _steps(slopes), _steps(misses)
    weight = np.linalg.lstsq(turned, misses[-1], rcond=1e-10)[0]
    ahead = plain - (moved + turned) @ weight
    return np.where(ahead > 0.0, ahead, 0.5 * plain)


def _steps(values: list[NDArray]) -> NDArray:
    """Changes (nh, k) in the last few iterations."""
    return np.diff(np.array(values[-DEPTH - 1 :]).T, axis=1)


def _repels(slopes: list[NDArray], misses: list[NDArray]) -> bool:
    """Whether plain iterations would leave the solution: an observed multiplier above 1."""
    moved, turned = _steps(slopes), _steps(misses)
    if not moved.size:
        return False
    seen = np.linalg.lstsq(moved, moved + turned, rcond=1e-8)[0]
    return bool(np.linalg.eigvals(seen).real.max() > 1.0)
