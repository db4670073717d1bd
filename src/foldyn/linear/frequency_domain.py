"""Frequency responses of linearized cases: one solution for each frequency, or modes superposed.

The static response of the modes left out completes those superposed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.complex_symmetric import solve
from foldyn.algebra.eigen import Pencil, Spectrum, lowest
from foldyn.algebra.woodbury import Squared
from foldyn.arguments import Check, Checked, Flag
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError
from foldyn.linear.excitation import Answer, Drive, drive_terms, warn_at
from foldyn.linear.linearized import Linearized
from foldyn.linear.modes import rigid_space, unresisted
from foldyn.values import whole

DIAGONAL = 1e-12  # of the modal damping: couplings of modes that are rounding
BESIDE = 0.01  # of the lowest eigenvalue above 0: how far below 0 a free body is held up
RESONANCE = (
    "there is no response at {} (nan): a resonance without damping, or 0 Hz of a body that is free "
    "to move; give the case damping, as Rayleigh(alpha=...), or leave these frequencies out"
)


@dataclass(frozen=True)
class Direct(Checked):
    """Options of the direct method: none."""


def direct(
    system: Linearized, drive: Drive, frequency: NDArray, options: Direct, report: Reporter
) -> Answer:
    """Solve (K - w^2 M + i w (C + G'G)) x = f at each frequency, G the rows of modal damping.

    The response is nan where the matrix is singular to rounding: at a resonance without damping,
    and at 0 Hz of a body that is free to move.

    Warns
    -----
    FoldynWarning
        There are such frequencies.
    """
    terms = drive_terms(system, drive)
    response = np.zeros((len(frequency), len(system.free)), np.complex128)
    for k, f in enumerate(frequency):
        omega = 2.0 * np.pi * f
        load = np.sum([term.shape * term.factor(omega) for term in terms], axis=0)
        response[k] = solve(dynamic_stiffness(system, omega), load, system.gram, 1j * omega)
        report(Progress(k + 1.0, float(len(frequency)), k + 1, 0.0))
    warn_at(frequency[np.isnan(response).any(axis=1)], RESONANCE)
    return Answer(response, {}, {})


def dynamic_stiffness(system: Linearized, omega: float) -> sparse.csc_array:
    """K - w^2 M + i w C at an angular frequency (rad/s), with the complex stiffness of memories."""
    if isinstance(system.mass, Squared):
        raise InputError(
            ": the fluid couples too many dofs for full matrices at each frequency; take "
            'method = "modal"',
            "method",
        )
    undamped = system.stiffness - omega**2 * system.mass
    if system.responding is not None:
        undamped = undamped + system.responding.stiffness(1j * omega)
    return sparse.csc_array(undamped + 1j * omega * system.damping)


@dataclass(frozen=True)
class Modal(Checked):
    """Options of the modal method.

    Parameters
    ----------
    count : int, optional
        How many modes, the lowest ones; all without it.
    static_correction : bool
        Whether to add the static response of the modes left out: errors then fall as the fourth
        power of the highest frequency kept instead of as the second.
    """

    count: Annotated[int | None, Check(whole, least=1, what="modes")] = None
    static_correction: Flag = True


def modal(
    system: Linearized, drive: Drive, frequency: NDArray, options: Modal, report: Reporter
) -> Answer:
    """Superpose modes: x = Phi q + r with (Lambda - w^2 + i w Phi' C Phi) q = Phi' f.

    The matrix of the modal damping is taken whole: modes that damping couples (dashpots and
    creases, beta K0 about a state where the tangent is not K0) stay coupled.
    r = (K - s M)^-1 f - Phi (Lambda - s)^-1 Phi' f is the response of all other modes at the
    squared frequency s: 0, or slightly below for a body that is free to move (mode acceleration:
    Craig and Kurdila, Fundamentals of Structural Dynamics, 2nd ed. 2006, chapter 11).

    At a resonance without damping the response is nan.

    Warns
    -----
    FoldynWarning
        There are such resonances.
    """
    pencil = Pencil(system.stiffness, system.mass)
    count = pencil.finite if options.count is None else int(options.count)
    modes = lowest(pencil, count, unresisted(system, rigid_space(system)))
    damping = modes.shapes.T @ (system.damping @ modes.shapes)
    if len(system.modal):
        own = system.modal @ modes.shapes
        damping = damping + own.T @ own
    parts = []
    for term in drive_terms(system, drive):
        load, left = modes.shapes.T @ term.shape, np.zeros(pencil.size)
        if options.static_correction and count < pencil.finite:
            left = _residual(pencil, modes, term.shape, load)
        parts.append((load, left, term.factor))
    noise, memory = pencil.noise(modes.shapes), None
    response = np.zeros((len(frequency), pencil.size), np.complex128)
    for k, f in enumerate(frequency):
        omega = 2.0 * np.pi * f
        if system.responding is not None:
            memory = system.responding.between(modes.shapes, 1j * omega)
        for load, left, factor in parts:
            q = _amplitudes(modes.values, noise, damping, omega, load, memory)
            response[k] += (modes.shapes @ q + left) * factor(omega)
        report(Progress(k + 1.0, float(len(frequency)), k + 1, 0.0))
    warn_at(frequency[np.isnan(response).any(axis=1)], RESONANCE)
    facts = {"modes": count, "static_correction": options.static_correction}
    return Answer(response, {}, facts)


def _amplitudes(
    values: NDArray, noise: NDArray, damping: NDArray, omega: float, load: NDArray,
    memory: NDArray | None,
) -> NDArray:  # fmt: skip
    """Modal amplitudes at an angular frequency (rad/s); `noise` is the rounding of the values.

    memory : complex stiffness of laws with memory between the modes there.
    """
    own = damping.diagonal()
    detuned = values - omega**2
    scale = np.sqrt(np.abs(np.outer(own, own)))
    if memory is not None or (np.abs(damping - np.diag(own)) > DIAGONAL * scale.max()).any():
        try:
            matrix = np.diag(detuned) + 1j * omega * damping
            matrix = matrix if memory is None else matrix + memory
            return np.linalg.solve(matrix, load.astype(complex))
        except np.linalg.LinAlgError:
            return np.full(len(load), np.nan, complex)
    resonant = (np.abs(detuned) <= noise) & (omega * own == 0.0)
    amplitudes = load / np.where(resonant, 1.0, detuned + 1j * omega * own)
    return np.where(resonant, np.nan, amplitudes)


def _residual(pencil: Pencil, modes: Spectrum, shape: NDArray, load: NDArray) -> NDArray:
    """Static response (nf,) of the modes left out."""
    positive = modes.values[modes.values > 0.0]
    shift = 0.0
    if modes.values[0] <= 0.0:
        beside = positive[0] if positive.size else pencil.scale
        shift = float(modes.values[0] - BESIDE * beside)
    factors = pencil.factorize(shift)
    whole = factors.solve(shape)
    left = shape - pencil.stiffness @ whole + shift * (pencil.mass @ whole)
    whole = whole + factors.solve(left)
    return whole - modes.shapes @ (load / (modes.values - shift))
