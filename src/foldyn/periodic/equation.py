"""Equation of motion of a driven case for its unknowns x, in the phase of its drive.

    M x'' + C x' + f(x, theta) + W^2 s2(theta) + W s1(theta) = 0

f contains the internal forces minus the loads, W = 2 pi times the frequency of the drive, and s2,
s1 are the effect of moving supports: M and C times the derivatives of their motion with respect to
theta. Displacements of all dofs are u = u0 + B x + U(theta), forces on the unknowns B' times the
forces on all dofs.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, Origin
from foldyn.dynamics.dampers import damping_terms
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.modal_damping import mass_of, modal_rows
from foldyn.mechanics.following import following_force, following_tangent, joined
from foldyn.periodic.drive import Drive, check_damping, check_held, check_smooth
from foldyn.periodic.tangents import Tangents

EPS = float(np.finfo(float).eps)


class Equation:
    """Matrices and forces of a case.

    Parameters
    ----------
    case : Case
    name : str
        Name of the analysis, for messages.
    driven : bool
        False leaves out all varying terms, and the damping.
    origin : Origin, optional
        State of damping with ``state = "initial"``; rest by default.

    Attributes
    ----------
    size : int
        Number k of unknowns.
    basis : sparse or dense (m, k)
        B.
    offset : (m,)
        Displacements with zero unknowns and drive, m.
    whole : Equation
        The equation from which this one is reduced, or itself.
    tangents : Tangents
        Tangents of the body with respect to the unknowns.
    mass, damping : (k, k)
        M (kg) and C (N s/m).
    alpha : float
        The part alpha M of the damping, 1/s.
    """

    def __init__(
        self, case: Case, name: str, driven: bool = True, origin: Origin | None = None
    ) -> None:
        check_smooth(case, name)
        check_held(case, name)
        check_mass(case.mass, case.constraints.determined)
        self.case, self.body, self.drive, self.origin = case, case.body, Drive(case), origin
        self.level = 1.0 if driven else 0.0
        free, total = case.free_dofs, self.body.size
        whole = case.constraints.extended(total) if case.constraints else sparse.eye_array(total)
        self.basis = sparse.csr_array(sparse.csc_array(whole)[:, free])
        self.size, self.offset = len(free), np.zeros(total)
        self.whole: Equation = self
        self.tangents = Tangents(self.body, self.basis)
        nodal = mass_of(case)
        self.mass = self.projected(nodal)
        terms = damping_terms(case, origin, modal_rows(case, origin)) if driven else []
        check_damping(terms, name)
        self.alpha = case.rayleigh.alpha if driven else 0.0
        drag = nodal * self.alpha
        for term in terms:
            drag = drag + term.damping(np.zeros(total))
        self.damping = self.projected(drag)
        self._moved = sparse.csr_array(self.basis.T @ nodal), sparse.csr_array(self.basis.T @ drag)
        self._back = np.zeros((0, 0))  # of a reduced equation: from the unknowns of the whole
        parts = [(part, k) for k, (part, _) in enumerate(self.drive.following)]
        self._following = joined(parts)

    @cached_property
    def rounding(self) -> float:
        """Norm (N) of the rounding errors of the forces."""
        return EPS * float(np.linalg.norm(abs(self.basis).T @ self.body.scale()))

    @cached_property
    def length(self) -> float:
        """Size of the sheet, m, as the scale of lengths."""
        return float(np.ptp(self.case.structure.nodes, axis=0).max())

    def at(self, phase: NDArray, level: float = 1.0) -> Instants:
        """The equation at phases (s,) of the drive, with all varying terms times a level."""
        return Instants(self, phase, level * self.level)

    def projected(self, matrix: sparse.csr_array) -> NDArray:
        """B' K B (k, k) of a matrix of all dofs."""
        found = self.basis.T @ (matrix @ self.basis)
        return found.toarray() if sparse.issparse(found) else found

    def unknowns(self, displacement: NDArray, instants: Instants) -> NDArray:
        """Unknowns (s, k) of displacements (s, n, 3) of all nodes at some instants."""
        flat = displacement.reshape(len(displacement), -1) - instants.moved - self.offset
        ties = self.case.constraints
        found = np.array([ties.coordinates(u)[self.case.free_dofs] for u in flat])
        return found if self.whole is self else found @ self._back.T


class Instants:
    """The equation at s phases of the drive.

    Attributes
    ----------
    moved : (s, m)
        U, m.
    inertia, drag : (s, k)
        s2 and s1 of the module docstring.
    planes : (s, p, 3)
        Displacements of contact planes, m.
    bodies : sequence of Assembly
        Body at each instant, with its rest angles and planes.
    """

    def __init__(self, equation: Equation, phase: NDArray, level: float) -> None:
        drive, body, basis = equation.drive, equation.body, equation.basis
        self.equation, self.phase, self.level = equation, phase, level
        self.moved, first, second = drive.sums(drive.moves, phase, level, body.size)
        mass, drag = equation._moved
        self.inertia, self.drag = second @ mass.T, first @ drag.T
        self.loads = drive.sums(drive.loads, phase, level, body.size)[0] @ basis
        rest = body.sheet.rest_angles
        turned = drive.sums(drive.turns, phase, level, len(rest))[0]
        self.bodies = [body.folded(rest + turn) if drive.turns else body for turn in turned]
        contact = equation.case.contact
        count = 0 if contact is None else len(contact.planes)
        places = drive.sums(drive.planes, phase, level, 3 * count)[0]
        self.planes = places.reshape(len(phase), count, 3)
        if drive.planes:
            self.bodies = [b.displaced(p) for b, p in zip(self.bodies, self.planes, strict=True)]
        factor = drive.factors(drive.following, phase, level)[0]
        self._factor = np.stack([factor, np.zeros_like(factor), np.zeros_like(factor)], axis=-1)

    def displacements(self, x: NDArray) -> NDArray:
        """Displacements of all dofs (s, m), m, from unknowns (s, k)."""
        return x @ self.equation.basis.T + self.moved + self.equation.offset

    def _each(self, x: NDArray):
        """Number, displacement and body of each instant."""
        return zip(range(len(x)), self.displacements(x), self.bodies, strict=True)

    def forces(self, x: NDArray) -> NDArray:
        """f (s, k) at unknowns (s, k), N."""
        following, force = self.equation._following, np.empty(self.moved.shape)
        for j, u, body in self._each(x):
            force[j] = body.internal(u)
            if following.acts:
                force[j] -= following_force(following, u, self._factor[j])
        with np.errstate(invalid="ignore"):  # inside a contact
            return force @ self.equation.basis - self.loads

    def tangents(self, x: NDArray) -> NDArray:
        """Derivative (s, k, k) of f, N/m."""
        equation, following = self.equation, self.equation._following
        out = np.zeros((len(x), equation.size, equation.size))
        for j, u, body in self._each(x):
            equation.tangents.put(body, u, out[j])
            if following.acts:
                added = following_tangent(following, u, self._factor[j])
                out[j] += equation.projected(added)
        return out

    def driving(self, omega: float) -> NDArray:
        """Force (s, k), N, added to f by moving supports, at a drive of omega rad/s."""
        return omega**2 * self.inertia + omega * self.drag

    def energies(self, x: NDArray) -> NDArray:
        """Strain energy less the work of constant loads (s,), J, at unknowns (s, k)."""
        strain = np.array([body.energies(u).sum() for _, u, body in self._each(x)])
        loads = self.equation.drive.sums(
            self.equation.drive.loads, self.phase, self.level, self.moved.shape[1]
        )[0]
        return strain - np.einsum("jm,jm->j", loads, self.displacements(x))
