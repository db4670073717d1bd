"""Conserving method: midpoint rule with forces that do exactly the work of the strain energy.

    (q1 - q0)/h = (w0 + w1)/2,   M (w1 - w0)/h + alpha M (w0 + w1)/2 + b = 0,
    b = F - (p0 + p1)/2,

with F the mean forces of the terms (`mechanics.mean_forces`) and of contact
(`implicit.contact_step`), and p all loads at each end of the step, including those that depend on
the displacement. Damping forces are taken at (u0 + u1)/2 and at the velocity (u1 - u0)/h, so that a
rigid motion dissipates nothing. Without damping and loads, any step conserves the energy of any
structure and the momenta of a free one, to the tolerance of the equations and to rounding; with
damping and loads, the energy balance closes equally well. The method has order 2 (Simo and Tarnow
1992, Gonzalez 1996) and does not damp vibrations that a step does not resolve.

On average over a step, massless dofs satisfy F = p: the residual at its end is minus the residual
at its start, plus a small contribution of nonlinear laws. The method conserves an energy that
includes this residual.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.dynamics.actuation import turn
from foldyn.dynamics.implicit.contact_step import StepContact
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.implicit.scheme import (
    Scheme,
    StepEnd,
    copy,
    norms,
    settle_massless,
    step_works,
)
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.motion_state import MotionState
from foldyn.dynamics.parts import ThreadCase
from foldyn.dynamics.system import PackedCase, carry, place
from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.following import add_following
from foldyn.mechanics.mean_forces import MeanForces
from foldyn.mechanics.term import ENERGIES

ORDER = 2


class MeanStep(NamedTuple):
    """Data that the compiled functions of a step need."""

    case: ThreadCase
    terms: NDArray  # (k,) contexts of all terms but contact
    forces: NDArray  # (k,) mean-force kernels of these terms
    drives: NDArray  # (k, 2) kernels that set them to factors of histories, or 0, and contexts
    powers: NDArray  # (3,) powers that these terms put in, dissipate and lose to air, W
    old: StepEnd
    new: StepEnd
    mean: NDArray  # (h, 3) mean factors of the histories
    shift: NDArray
    out: NDArray
    before: NDArray  # (nh,) dihedrals at the step's start, rad
    touch: NDArray  # (n, 3) force of contact, N; (0, 3) without contact


class EnergyMomentum(Scheme):
    """Steps of the conserving method; see `Scheme`."""

    symmetric = False
    tolerance = 1e-11  # as the residual that is left is an energy error

    def __init__(self, packed: PackedCase, state: MotionState) -> None:
        super().__init__(packed, state)
        body, equation = packed.body, self.equation
        self._contact: Any = None  # with contact, its `StepContact`
        if contact := body.find(ContactTerm):
            kept = body.kept(self.part, ContactTerm)
            self._contact = StepContact(contact, kept, packed.system.rows)
        self._terms = terms = MeanForces(body, self.part)
        self._step = Context(
            MeanStep(
                equation.case.value, terms.context, terms.kernel, terms.drive, terms.powers,
                self.old, self.new, np.zeros_like(self.new.factor), self.shift, self.out,
                state.angle, self._contact.force if self._contact else np.zeros((0, 3)),
            )
        )  # fmt: skip

    def weights(self, h: float) -> Weights:
        """Weights of the step matrix; see `Scheme.weights`."""
        return Weights(1.0, (2.0 / h + self.packed.system.alpha) / h, 1.0 / h)

    def residual(self, h: float, t: float) -> tuple[float, float]:
        """Residual of the step to time t; see `Scheme.residual`."""
        old, s = self.old, self.scratch
        if self._contact is not None:
            place(self.packed.system, old.q + self.shift, old.w, t, s)
            self._contact.put(self.displacement(), s.displacement, old.factor, s.factor)
        return residual(self._step, h, t)

    def tangent(self, matrix: StepMatrix, before: NDArray, again: bool) -> None:
        """Fill the stiffness blocks with the tangent of the mean forces; see `Scheme.tangent`."""
        body, pattern, u0, u1 = self.packed.body, matrix.pattern, self.displacement(), self.moved()
        start = u0, u1, self.state.angle
        matrix.blocks.put_mean(body, pattern, *start, before, again, matrix.stiffness)
        matrix.add_following(u1, self.new.factor, 0.5)
        matrix.follow(0.5 * (u0 + u1), 1.0)

    def contact_tangent(self, contact: ContactTerm, memory: Memory) -> sparse.csr_array:
        """Derivative of the mean contact force; see `Scheme.contact_tangent`."""
        return self._contact.tangent()

    def plane_push(self, before: NDArray, after: NDArray) -> NDArray:
        """Mean friction and normal force of the planes; see `Scheme.plane_push`."""
        return self._contact.push

    def rub(self, before: NDArray, after: NDArray) -> NDArray:
        """Mean friction between panels; see `Scheme.rub`."""
        return self._contact.rub

    def works(self, h: float) -> tuple[float, float, float]:
        """Works of a step, which are exactly the works of its forces; see `Scheme.works`."""
        system = self.packed.system
        done, lost = step_works(self._step, h, self.new.force, self.new.force)
        put_in, taken, to_air = (h * self._terms.powers).tolist()
        if system.turns:
            done += _actuation(self._step, self.displacement(), self.moved())
        return done + put_in, lost + taken, to_air

    def change(self, h: float) -> NDArray:
        """Error estimate of a step, from accelerations at midpoints; see `Scheme.change`."""
        return h**3 / (6.0 * (h + self._last)) * (self.new.a - self.old.a)


@kernel
def residual(step, h, t):
    """Put the residual of a step into `out`; return norms of it and of the forces at play, N."""
    old, new, out = step.old, step.new, step.out
    system, mass, s = step.case.system, step.case.mass, step.case.s
    q0, w0, q1, w1, a1 = flat(old.q), flat(old.w), flat(new.q), flat(new.w), flat(new.a)
    d, x, left, bracket = flat(step.shift), flat(s.moving), flat(out), flat(new.force)
    for i in range(q0.size):
        q1[i] = q0[i] + d[i]
        w1[i] = 2.0 * d[i] / h - w0[i]
        a1[i] = (w1[i] - w0[i]) / h
        x[i] = a1[i] + system.alpha * (0.5 * (w0[i] + w1[i]))
    settle_massless(step, h)
    if step.case.histories != 0:
        run_at(step.case.histories, (step.case, t))
    copy(s.factor, new.factor)
    mean = mean_factors(step)
    carry(system.moved, old.factor[:, 0], old.q, s.displacement)
    carry(system.moved, new.factor[:, 0], new.q, s.velocity)
    new.force[:] = 0.0
    step.powers[:] = 0.0
    middle = t - 0.5 * h
    for k in range(mean.shape[0]):  # rates with which powers are works over the step
        mean[k, 1] = (new.factor[k, 0] - old.factor[k, 0]) / h
    for k in range(step.terms.size):
        if step.drives[k, 0] != 0:
            run_at(step.drives[k, 0], (step.drives[k, 1], mean))
        if system.turns:  # terms that store the step's start also need its end
            turn(system.actuators, mean if k == 0 else new.factor)
        ends = step.terms[k], s.displacement, s.velocity
        run_at(step.forces[k], (*ends, step.before, h, middle, new.force, step.powers))
    if system.turns:  # for the tangent
        turn(system.actuators, mean)
    touch = flat(step.touch)
    for i in range(touch.size):
        bracket[i] += touch[i]
    loads = system.loads
    for k in range(loads.dof.size):
        bracket[loads.dof[k]] -= loads.value[k] * mean[loads.row[k], 0]
    if system.follows:
        before, after = flat(old.pushed), flat(new.pushed)
        after[:] = 0.0
        add_following(system.following, flat(s.velocity), s.factor, after)
        for i in range(after.size):
            bracket[i] -= 0.5 * (before[i] + after[i])
    times_mass(mass, s.moving, out)
    inertia = 0.0
    for i in range(q0.size):
        inertia += left[i] * left[i]
        left[i] += bracket[i]
    return norms(system, out, inertia, mean, new.pushed)


@inner_scalar
def mean_factors(step):
    """Mean (h, 3) of the histories' factors over the step."""
    mean, one, other = flat(step.mean), flat(step.old.factor), flat(step.new.factor)
    for k in range(mean.size):
        mean[k] = 0.5 * (one[k] + other[k])
    return step.mean


@kernel
def _actuation(step, u0, u1):
    """Work (J) of the actuators in a step: energy change as rest angles turn at u0 and at u1."""
    terms, old, new = step.case.terms, step.old, step.new
    done, mean, system, s = 0.0, mean_factors(step), step.case.system, step.case.s
    turn(system.actuators, old.factor)
    done -= _energy_of_sheet(terms, u0, s.energy)
    turn(system.actuators, mean)
    done += _energy_of_sheet(terms, u0, s.energy)
    done -= _energy_of_sheet(terms, u1, s.energy)
    turn(system.actuators, new.factor)
    return done + _energy_of_sheet(terms, u1, s.energy)


@inner
def _energy_of_sheet(terms, u, out):
    """Strain energy (J) of the first term, which is the sheet."""
    out[:] = 0.0
    run_at(terms.kernel[0, ENERGIES], (terms.context[0], u, out))
    return out.sum()
