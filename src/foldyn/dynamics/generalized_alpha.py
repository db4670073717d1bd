"""The generalized-alpha method of Chung and Hulbert, J. Appl. Mech. 60, 1993, and Newmark's.

With accelerations a and the step h, displacements and velocities follow Newmark's formulas,

    q1 = q0 + h w0 + h^2 ((1/2 - beta) a0 + beta a1),   w1 = w0 + h ((1 - gamma) a0 + gamma a1),

and the equation of motion holds between both ends,

    M ((1 - am) a1 + am a0) + alpha M ((1 - af) w1 + af w0) + (1 - af) b1 + af b0 = 0,

with b = F_int + beta K0 v - p at each end. Forces are averaged rather than displacements, so that
b1 is what equilibrium at the end needs (Erlicher, Bonaventura and Bursi, Comput. Mech. 28, 2002).

Both methods have order 2 and are unconditionally stable for linear systems. A parameter of the
generalized-alpha method is the spectral radius r, the factor by which a step multiplies free
vibrations of infinite frequency: am = (2r - 1)/(r + 1), af = r/(r + 1), gamma = 1/2 - am + af,
beta = (1 - am + af)^2 / 4. Of all methods with this damping of the highest frequencies, it damps
low frequencies least.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.banded import substitute
from foldyn.dynamics.actuation import offset_work, power_of_part, turn
from foldyn.dynamics.equation import LoopHandle, acceleration, advance_clock
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.implicit.scheme import (
    GO_ON,
    NOT_CONVERGED,
    Goal,
    Scheme,
    StepEnd,
    copy,
    judge,
    norms,
    settle_massless,
    step_works,
)
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.motion_state import MotionState
from foldyn.dynamics.parts import ThreadCase
from foldyn.dynamics.system import PackedCase, carry
from foldyn.dynamics.ties import follow_masters
from foldyn.jit.compiled import inner, kernel
from foldyn.jit.context import Context, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.term import FORCES, PLACE_OBSTACLES

ORDER = 2
SPECTRAL_RADIUS = 0.8


class Parameters(NamedTuple):
    """Parameters of a method of the generalized-alpha family."""

    am: float
    af: float
    beta: float
    gamma: float


def parameters(spectral_radius: float) -> Parameters:
    """Parameters of the generalized-alpha method for a spectral radius from 0 to 1."""
    am = (2.0 * spectral_radius - 1.0) / (spectral_radius + 1.0)
    af = spectral_radius / (spectral_radius + 1.0)
    return Parameters(am, af, 0.25 * (1.0 - am + af) ** 2, 0.5 - am + af)


class AlphaStep(NamedTuple):
    """Data that the compiled functions of a step need."""

    handle: LoopHandle
    case: ThreadCase
    p: Parameters
    old: StepEnd
    new: StepEnd
    shift: NDArray
    out: NDArray
    earlier: NDArray
    damping: NDArray  # (k,) indices of the damping terms
    drag: NDArray  # (k,) indices of the air drag terms


class Alpha(Scheme):
    """A method of the generalized-alpha family; see `Scheme`."""

    symmetric, tolerance = True, 1e-7

    def __init__(
        self, packed: PackedCase, state: MotionState, parameters: Parameters,
        facts: Mapping[str, float] = Scheme.facts,
    ) -> None:  # fmt: skip
        super().__init__(packed, state)
        self.parameters, self.facts, equation = parameters, facts, self.equation
        self.context = Context(
            AlphaStep(
                equation.handle.value, equation.case.value, parameters, self.old, self.new,
                self.shift, self.out, self.earlier, self.damping, self.drag,
            )
        )  # fmt: skip

    def begin(self, t: float) -> None:
        """Make `old` the start of a motion, or of a part after a jump; see `Scheme.begin`."""
        super().begin(t)
        if len(self.damping) or len(self.drag):
            for old, new in zip(self.old, self.new, strict=True):
                new[:] = old
            _taken(self.context)
            self.old.damped[:], self.old.resisted[:] = self.new.damped, self.new.resisted

    def weights(self, h: float) -> Weights:
        """Weights of the step matrix, with alpha M included in the mass; see `Scheme.weights`."""
        am, af, beta, gamma = self.parameters
        rate = (1.0 - af) * gamma / (beta * h)
        mass = (1.0 - am) / (beta * h * h) + rate * self.packed.system.alpha
        return Weights(1.0 - af, mass, rate)

    def residual(self, h: float, t: float) -> tuple[float, float]:
        """Residual of the step to time t; see `Scheme.residual`."""
        return residual(self.context, h, t)

    def iterate(
        self, matrix: StepMatrix, goal: Goal, h: float, t: float, last: float, lowest: float,
        most: int,
    ) -> tuple[int, float, int]:  # fmt: skip
        """Iterate, for a band matrix in a single compiled function; see `Scheme.iterate`."""
        if matrix.band is None:
            return super().iterate(matrix, goal, h, t, last, lowest, most)
        return _iterate(self.context, h, t, matrix.band, matrix.free, goal, last, lowest, most)

    def tangent(self, matrix: StepMatrix, before: NDArray, again: bool) -> None:
        """Fill the stiffness blocks with the tangent at the step's end; see `Scheme.tangent`."""
        body, u = self.packed.body, self.moved()
        matrix.blocks.put(body, matrix.pattern, u, before, again, matrix.stiffness)
        matrix.add_following(u, self.new.factor, 1.0)
        matrix.follow(u, 0.5)  # dofs without mass have the step's mean velocity

    def works(self, h: float) -> tuple[float, float, float]:
        """Works of a step with averaged forces, exact for linear systems; see `Scheme.works`."""
        system = self.packed.system
        done, lost = step_works(self.context, h, self.old.force, self.new.force)
        to_air = 0.0
        if len(self.damping) or len(self.drag):
            damped, to_air = _taken(self.context)
            lost += damped
        if system.turns:
            done += _actuation(self.context, self.folds, self.part.fold_angle)
        if len(self.driven):
            done += _driving(self.context, self.driven, self.displacement(), self.moved(), h)
            # what winches do against friction has been taken off what it dissipates
            lost += _driving(self.context, self.rubbing, self.displacement(), self.moved(), h)
        return done, lost, to_air

    def change(self, h: float) -> NDArray:
        """Estimate of the displacement error of a step; see `Scheme.change`.

        Since a is the acceleration at t + (am - af) h, the error of the displacement is
        (am/2 - af/2 + beta - 1/6) h^3 times the third derivative of the displacement; for the
        trapezoidal rule this factor is 1/12.
        """
        am, af, beta, _ = self.parameters
        constant = 0.5 * (am - af) + beta - 1.0 / 6.0
        return constant * h * h * (self.new.a - self.old.a)


newmark = partial(Alpha, parameters=Parameters(am=0.0, af=0.0, beta=0.25, gamma=0.5))
"""Newmark's method with constant average acceleration, the trapezoidal rule.

N. M. Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85, 1959. It does
not damp: a linear system keeps its energy; a nonlinear system may gain energy in large steps.
"""


def scheme(spectral_radius: float = SPECTRAL_RADIUS) -> Callable[[PackedCase, MotionState], Alpha]:
    """Return a function that creates the steps of the method, for a spectral radius."""
    facts = {"spectral_radius": spectral_radius}
    return partial(Alpha, parameters=parameters(spectral_radius), facts=facts)


@inner
def move(step, h):
    """Set displacement, velocity and acceleration at the end of a step from its shift."""
    old, new, beta, gamma = step.old, step.new, step.p.beta, step.p.gamma
    q0, w0, a0, d = flat(old.q), flat(old.w), flat(old.a), flat(step.shift)
    q1, w1, a1 = flat(new.q), flat(new.w), flat(new.a)
    curvature = 1.0 / (beta * h * h)
    for i in range(q0.size):
        q1[i] = q0[i] + d[i]
        a1[i] = curvature * (d[i] - h * w0[i]) - (0.5 - beta) / beta * a0[i]
        w1[i] = w0[i] + h * ((1.0 - gamma) * a0[i] + gamma * a1[i])
    settle_massless(step, h)


@inner
def slowed(step):
    """Put acceleration plus alpha times velocity, on which the mass acts, into `moving`."""
    old, new, am, af = step.old, step.new, step.p.am, step.p.af
    w0, a0, w1, a1 = flat(old.w), flat(old.a), flat(new.w), flat(new.a)
    alpha, x = step.case.system.alpha, flat(step.case.s.moving)
    for i in range(x.size):
        drag = alpha * ((1.0 - af) * w1[i] + af * w0[i])
        x[i] = (1.0 - am) * a1[i] + am * a0[i] + drag


@kernel
def balanced(step, target, h):
    """Finish a step whose residual is `target` (n, 3), N: set the end force that leaves it."""
    af = step.p.af
    move(step, h)
    slowed(step)
    times_mass(step.case.mass, step.case.s.moving, step.out)
    b0, b1, inertia, left = flat(step.old.force), flat(step.new.force), flat(step.out), flat(target)
    for i in range(b0.size):
        b1[i] = (left[i] - inertia[i] - af * b0[i]) / (1.0 - af)


@kernel
def residual(step, h, t):
    """Put the residual of a step into `out`; return norms of it and of the forces at play, N."""
    handle, old, new, out = step.handle, step.old, step.new, step.out
    system, mass, s = step.case.system, step.case.mass, step.case.s
    af = step.p.af
    b0, b1, left = flat(old.force), flat(new.force), flat(out)
    move(step, h)
    advance_clock(handle, h)
    acceleration(handle, new.q, new.w, t, out)
    copy(s.force, new.force)
    copy(s.factor, new.factor)
    copy(s.pushed, new.pushed)
    slowed(step)
    times_mass(mass, s.moving, out)
    inertia = 0.0
    for i in range(b0.size):
        inertia += left[i] * left[i]
        left[i] += (1.0 - af) * b1[i] + af * b0[i]
    return norms(system, out, inertia, s.factor, new.pushed)


@kernel
def _iterate(step, h, t, band, free, goal, last, lowest, most):
    """Iterate with the factors of a band matrix; see `Scheme.iterate`."""
    d, left = flat(step.shift), flat(step.out)
    change, ties = np.empty(free.size), step.case.system.ties
    norm = np.inf
    for steps in range(most):
        norm, reference = residual(step, h, t)
        verdict = judge(goal, norm, reference, last, lowest)
        if verdict != GO_ON:
            return verdict, norm, steps
        lowest, last = min(lowest, norm), norm
        copy(step.new.q, step.earlier)
        for k in range(free.size):
            change[k] = left[free[k]]
        substitute(band, change)
        for k in range(free.size):
            d[free[k]] -= change[k]
        if ties.slave.size > 0:
            follow_masters(ties, d)
    return NOT_CONVERGED, norm, most


@kernel
def _taken(step):
    """Energies (J) dissipated by damping and lost to the air in a step, after `step_works`."""
    old, new, moved, s = step.old, step.new, step.case.system.moved, step.case.s
    carry(moved, new.factor[:, 0], new.q, s.product)
    carry(moved, new.factor[:, 1], new.w, s.velocity)
    damped = _taken_by(step, step.damping, old.damped, new.damped)
    return damped, _taken_by(step, step.drag, old.resisted, new.resisted)


@inner
def _taken_by(step, numbers, before, after):
    """Energy (J) dissipated in a step by the terms `numbers`: mean force times displacement."""
    terms, s = step.case.terms, step.case.s
    one, other, du, work = flat(before), flat(after), flat(s.displacement), 0.0
    for i in range(other.size):
        other[i] = 0.0
    for k in numbers:
        given = terms.context[k], s.product, s.velocity, 0.0, after, terms.powers
        run_at(terms.kernel[k, FORCES], given)
    for i in range(other.size):
        work += 0.5 * (one[i] + other[i]) * du[i]
    return work


@kernel
def _driving(step, driven, u0, u1, h):
    """Work (J) of histories on terms in a step h (s): mean power, at the mean rates of the step."""
    terms, s, done = step.case.terms, step.case.s, 0.0
    for after in range(2):
        for k in range(s.factor.shape[0]):
            s.factor[k, 0] = step.new.factor[k, 0] if after else step.old.factor[k, 0]
            s.factor[k, 1] = (step.new.factor[k, 0] - step.old.factor[k, 0]) / h
        u, end = (u1, step.new) if after else (u0, step.old)
        carry(step.case.system.moved, end.factor[:, 1], end.w, s.velocity)
        for k in driven:
            own, terms.powers[0] = terms.context[k], 0.0
            run_at(terms.kernel[k, PLACE_OBSTACLES], (own, s.factor))
            run_at(terms.kernel[k, FORCES], (own, u, s.velocity, 0.0, step.out, terms.powers))
            done += 0.5 * h * terms.powers[0]
    s.time[0] = np.nan  # the histories are to be evaluated again
    return done


@kernel
def _actuation(step, angle0, angle1):
    """Work (J) of the actuators in a step from the dihedrals angle0 to angle1."""
    actuators, old, new = step.case.system.actuators, step.old, step.new
    change, count = np.zeros_like(new.factor), actuators.hinge.size
    change[:, 1] = 0.5 * (new.factor[:, 0] - old.factor[:, 0])
    turn(actuators, old.factor)
    done = power_of_part(actuators, change, angle0, 0, count)
    turn(actuators, new.factor)
    done += power_of_part(actuators, change, angle1, 0, count)
    return done + offset_work(actuators, angle1, 0, count, True)
