"""Frequency responses of linearized cases: direct solutions per frequency, or modal superposition.

The static response of the omitted modes completes the superposition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.complex_symmetric import solve
from foldyn.algebra.eigen import Pencil, Spectrum, lowest
from foldyn.algebra.superlu import factorize
from foldyn.algebra.woodbury import Squared
from foldyn.arguments import Check, Checked, Flag
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError
from foldyn.linear.excitation import Answer, Drive, drive_terms, warn_at
from foldyn.linear.linearized import Linearized
from foldyn.linear.modes import rigid_space, unresisted
from foldyn.ram_limit import check_memory
from foldyn.values import whole

DIAGONAL = 1e-12  # couplings of modes smaller than this, relative to modal damping, are round-off
FOLLOWS = 1e-8  # damping force on a massless dof, relative to its terms, that counts as zero
COPIES = 3  # copies of the matrix of amplitudes in memory
BESIDE = 0.01  # shift below 0 for a free body, relative to the lowest positive eigenvalue
OMITTED = 0.02  # warn if omitted modes would change the response by more than this share of it
TOO_FEW = (
    "the modes that are left out would change the response by about {share:.1g} of it or more at "
    "{{}}: give a higher count, or take the method direct"
)
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
    """Solve (K - w^2 M + i w (C + G'G)) x = f at each frequency; G: rows of modal damping.

    The response is nan if the matrix is singular to round-off: at a resonance without damping,
    and at 0 Hz for a body that is free to move.

    Warns
    -----
    FoldynWarning
        The response is nan at some frequencies.
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
    """K - w^2 M + i w C at an angular frequency (rad/s), with the stiffness of memory laws."""
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
        Number of modes, from the lowest on; all by default.
    static_correction : bool
        Whether to add the static response of the omitted modes: errors then fall with the fourth
        power of the highest frequency kept, instead of the second power.
    """

    count: Annotated[int | None, Check(whole, least=1, what="modes")] = None
    static_correction: Flag = True


def modal(
    system: Linearized, drive: Drive, frequency: NDArray, options: Modal, report: Reporter
) -> Answer:
    """Superpose modes: x = Phi q + r with (Lambda - w^2 + i w Phi' C Phi) q = Phi' f.

    The modal damping matrix is kept in full: modes coupled by damping (dashpots and creases, beta
    K0 about a state where the tangent is not K0) stay coupled. Massless dofs follow the modes
    statically; their further motion due to damping or memory is coupled to the modes. r = (K - s
    M)^-1 f - Phi (Lambda - s)^-1 Phi' f is the response of all other modes at the squared frequency
    s: 0, or slightly below for a body that is free to move (mode acceleration: Craig and Kurdila,
    Fundamentals of Structural Dynamics, 2nd ed. 2006, chapter 11).

    At a resonance without damping the response is nan.

    Warns
    -----
    FoldynWarning
        There are resonances without damping; omitted modes matter, by their static response to what
        the response leaves of the equation.
    """
    modes = SuperposedModes(system, Pencil(system.stiffness, system.mass), options.count)
    driven = ModalResponse(modes, drive, options.static_correction)
    missing = np.zeros(len(frequency))
    response = np.zeros((len(frequency), len(system.free)), np.complex128)
    for k, f in enumerate(frequency):
        omega = 2.0 * np.pi * f
        response[k] = driven.motions @ driven.amplitudes(np.array([omega]))[0]
        missing[k] = driven.missing(omega, response[k])
        report(Progress(k + 1.0, float(len(frequency)), k + 1, 0.0))
    warn_at(frequency[np.isnan(response).any(axis=1)], RESONANCE)
    if (told := missing > OMITTED).any():
        warn_at(frequency[told], TOO_FEW.format(share=missing[told].max()))
    facts = {"modes": modes.count, "static_correction": options.static_correction}
    return Answer(response, {}, facts)


class SuperposedModes:
    """Modes of a linearized case and its massless motions, to answer any drive; see `modal`.

    count : number of modes; all by default.
    """

    def __init__(self, system: Linearized, pencil: Pencil, count: int | None) -> None:
        self.system, self.pencil = system, pencil
        self.count = pencil.finite if count is None else int(count)
        modes = lowest(pencil, self.count, unresisted(system, rigid_space(system)))
        self.basis = basis = _with_massless(system, pencil, modes)
        own = system.modal @ basis.shapes
        self.damping = basis.shapes.T @ (system.damping @ basis.shapes) + own.T @ own
        diagonal = self.damping.diagonal()
        scale = np.sqrt(np.abs(np.outer(diagonal, diagonal)))
        off = np.abs(self.damping - np.diag(diagonal)) > DIAGONAL * scale.max(initial=0.0)
        self.coupled = system.responding is not None or bool(off.any())
        few = self.count < pencil.finite
        self.shift = _shift(pencil, basis) if few else 0.0
        self.factors = pencil.factorize(self.shift) if few else None


class ModalResponse:
    """Superposed modes of a linearized case under a drive; see `modal`.

    Attributes
    ----------
    modes : SuperposedModes
    motions : (nf, r + t)
        Motions that are superposed: modes, massless motions, and the static response of all other
        modes to each of the t parts of the drive.
    """

    def __init__(self, modes: SuperposedModes, drive: Drive, correction: bool = True) -> None:
        self.modes, basis, factors = modes, modes.basis, modes.factors
        self._terms = drive_terms(modes.system, drive)
        self._loads, left = [], []
        for term in self._terms:
            load = basis.shapes.T @ term.shape
            self._loads.append(load)
            if correction and factors is not None:
                pencil, shift = modes.pencil, modes.shift
                whole = factors.solve(term.shape)
                miss = term.shape - pencil.stiffness @ whole + shift * (pencil.mass @ whole)
                whole += factors.solve(miss)
                left.append(whole - basis.shapes @ (load / (basis.values - shift * basis.inertia)))
            else:
                left.append(np.zeros(modes.pencil.size))
        self.motions = np.column_stack([basis.shapes, *left])
        self._damped = [basis.shapes.T @ _damping_force(modes.system, own) for own in left]
        if modes.system.responding is not None:
            self._turns = modes.system.responding.gradient @ self.motions

    @property
    def remembers(self) -> bool:
        """Whether laws with memory act, whose damping depends on the frequency."""
        return self.modes.system.responding is not None

    def amplitudes(self, omega: NDArray) -> NDArray[np.complex128]:
        """Amplitudes (m, r + t) of `motions`, per unit of the drive, at frequencies (m,) in rad/s.

        nan at resonances without damping.
        """
        factors = np.array(
            [[term.factor(each) for each in omega.tolist()] for term in self._terms], complex
        ).T
        left = 1j * omega[:, None] * (factors @ self._damped)
        load = factors @ self._loads - left
        if self.modes.coupled:
            each = zip(omega, load, factors, strict=True)
            own = np.array([self._coupled(*at) for at in each]).reshape(load.shape)
        else:
            own = _uncoupled(self.modes.basis, self.modes.damping.diagonal(), omega, load)
        return np.hstack([own, factors])

    def _coupled(self, omega: float, load: NDArray, factor: NDArray) -> NDArray:
        """Amplitudes (r,) of coupled motions under loads (r,) with factors (t,), or nan."""
        basis, responding = self.modes.basis, self.modes.system.responding
        matrix = 1j * omega * self.modes.damping
        matrix[np.diag_indices(len(load))] += basis.values - omega**2 * basis.inertia
        if responding is not None:
            turns, followed = np.hsplit(self._turns, [len(load)])
            push = turns.T * responding.weights(1j * omega)
            matrix += push @ turns
            load = load - push @ (followed @ factor)
        try:
            return np.linalg.solve(matrix, load)
        except np.linalg.LinAlgError:
            return np.full(len(load), np.nan, complex)

    def missing(self, omega: float, response: NDArray) -> float:
        """Share of a response (nf,) by which the modes that are left out would change it, or more.

        The response leaves forces unbalanced, to which they respond statically.
        """
        if self.modes.factors is None:
            return 0.0
        unbalanced: NDArray[np.complex128] = -_resisting(self.modes.system, omega, response)
        for term in self._terms:
            unbalanced += term.shape * term.factor(omega)
        change = self.modes.factors.solve(np.stack([unbalanced.real, unbalanced.imag], axis=1))
        return float(np.hypot(*change.T).max() / np.abs(response).max())


class _Basis(NamedTuple):
    """Basis of r motions, uncoupled in stiffness and mass: modes, and massless motions.

    values : (r,) stiffness; inertia : (r,) 1 or 0; noise : (r,) rounding errors of the values.
    """

    shapes: NDArray  # (nf, r)
    values: NDArray
    inertia: NDArray
    noise: NDArray


def _with_massless(system: Linearized, pencil: Pencil, modes: Spectrum) -> _Basis:
    """Modes, and motions by which massless dofs deviate from modes due to damping or memory.

    In modes, massless dofs follow other dofs statically. If damping forces depend on the rates of
    massless dofs, these dofs get an additional motion; massless dofs without damping follow it
    statically.
    """
    shapes, light = modes.shapes, ~pencil.heavy
    pull, most = np.abs(system.damping @ shapes), abs(system.damping) @ np.abs(shapes)
    moved = (pull > FOLLOWS * most).any(axis=1)
    if system.responding is not None:
        moved[system.responding.gradient.indices] = True
    own, others = np.flatnonzero(light & moved), np.flatnonzero(light & ~moved)
    size = f"{len(own)} unknowns without mass beside {len(modes.values)} modes"
    needed = 16.0 * COPIES * (len(own) + len(modes.values)) ** 2 + 16.0 * len(own) * pencil.size
    check_memory("method", size, needed, 'take method = "direct"')
    aside, stiffness = np.zeros((pencil.size, len(own))), pencil.stiffness
    aside[own, np.arange(len(own))] = 1.0
    if len(own) and len(others):
        across = stiffness[others][:, own].toarray()
        within = factorize(sparse.csc_array(stiffness[others][:, others]))
        aside[others] = -np.stack([within.solve(column) for column in across.T], axis=1)
    values, turned = np.linalg.eigh(aside.T @ (stiffness @ aside))
    return _Basis(
        np.hstack([shapes, aside @ turned]),
        np.append(modes.values, values),
        np.append(np.ones(len(modes.values)), np.zeros(len(own))),
        np.append(pencil.noise(shapes), np.zeros(len(own))),
    )


def _uncoupled(basis: _Basis, damping: NDArray, omega: NDArray, load: NDArray) -> NDArray:
    """Amplitudes (m, r) of motions with damping (r,) under loads (m, r), or nan."""
    resistance = basis.values - np.outer(omega**2, basis.inertia)
    damped = np.outer(omega, damping)
    resonant = (np.abs(resistance) <= basis.noise) & (damped == 0.0)
    amplitudes = load / np.where(resonant, 1.0, resistance + 1j * damped)
    return np.where(resonant, np.nan, amplitudes)


def _resisting(system: Linearized, omega: float, x: NDArray) -> NDArray[np.complex128]:
    """Forces (nf,), N, that resist an oscillation x (nf,) at an angular frequency (rad/s)."""
    return system.stiffness @ x - omega**2 * (system.mass @ x) + damped(system, omega, x)


def damped(system: Linearized, omega: float, x: NDArray) -> NDArray:
    """Forces (nf,), N, of damping and of laws with memory in such an oscillation."""
    force = 1j * omega * _damping_force(system, x)
    if system.responding is not None:
        turns = system.responding.gradient
        force += turns.T @ (system.responding.weights(1j * omega) * (turns @ x))
    return force


def _damping_force(system: Linearized, x: NDArray) -> NDArray:
    """Forces (nf,), N, of damping at velocities x (nf,), m/s."""
    return system.damping @ x + system.modal.T @ (system.modal @ x)


def _shift(pencil: Pencil, basis: _Basis) -> float:
    """Squared frequency (rad2/s2) at which omitted modes respond statically: 0, or below it."""
    modal = basis.values[basis.inertia > 0.0]
    if modal[0] > 0.0:
        return 0.0
    positive = modal[modal > 0.0]
    return float(modal[0] - BESIDE * (positive[0] if positive.size else pencil.scale))
