"""Discrete adjoint of Newmark's method and the generalized-alpha method.

The unknown of a step of `dynamics.generalized_alpha` is the shift d = q1 - q0. With c = 1/(beta
h^2),

    a1 = c (d - h w0) - (1/2 - beta)/beta a0,   w1 = w0 + h ((1 - gamma) a0 + gamma a1),
    M ((1 - am) a1 + am a0 + alpha ((1 - af) w1 + af w0)) + (1 - af) b1 + af b0 = 0

on the free dofs. In the backward pass, let lq, lw, la be the derivatives of a scalar with respect
to the end state, and z' the multipliers of the next step's balance, which also contains b1. The
multipliers z of this step solve

    A' z = lq - P' + c (la + h gamma (lw - R')),

with A the matrix at the end of the step, and P' and R' the derivatives of af z' . b1 with respect
to q1 and w1: the pullback of the forces (`mechanics.pullback`) has the total weights W = (1 - af) z
+ af z'. The equation is solved iteratively with the factors that the forward steps use, or with
factors from an earlier step. These neglect the rotation of dampers, but the pullback itself gives
the residual of the balance of z, and the gradient.

The gradient is exact for steps that are solved exactly. Newton's method stops at a residual of at
most `Scheme.tolerance`, usually far below it; this bounds the difference to the computed motion.

Steps are recomputed, bit for bit, from stored states at which an engine can resume. One segment of
steps is stored at a time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.adjoint import Adjoint
from foldyn.dynamics.implicit.engine import ImplicitEngine
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.newton import SAME_STEP
from foldyn.dynamics.implicit.scheme import StepEnd
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.motion_state import samples
from foldyn.dynamics.ties import hand_over
from foldyn.dynamics.timing import jumps
from foldyn.errors import ComputationError, InputError
from foldyn.threads import one_thread

METHODS = ("newmark", "generalized_alpha")
ROOM = 16e6  # memory for the states of a segment, bytes
ITERATIONS = 30
TOLERANCE = 1e-12  # relative residual of the balance of z
ENOUGH = 1e-7  # relative residual that is accepted if the iteration has stalled
FAST = 0.1  # an old matrix is renewed if an iteration leaves more than this share
STALL = 0.5  # the iteration has stalled if it leaves more than this share


class Reached(NamedTuple):
    """State at the start or end of a step, without support motion."""

    t: float  # time of the force evaluation, s
    q: NDArray  # (n, 3) m
    w: NDArray  # m/s
    a: NDArray  # m/s2


class Taken(NamedTuple):
    """An accepted step, or part of one."""

    number: int  # number of the step, from 0
    h: float  # length, s
    start: Reached
    end: Reached
    begins: bool  # whether `Scheme.begin` computed the step's start


class Segment(NamedTuple):
    """Start of a segment of steps, with everything that an engine needs to resume there."""

    number: int  # number of the first step
    state: Reached
    begins: bool
    engine: dict[str, NDArray]


class Retraced(ImplicitEngine):
    """A motion by fixed implicit steps, recomputed to yield its steps from last to first."""

    def __init__(self, motion: Any) -> None:
        _refuse(motion)
        packed, plan = motion.packed, motion.plan
        self._room = samples(
            1, len(packed.numbering.order), len(motion.case.reaction_dofs),
            motion.output.window.energy.shape[1],
        )  # fmt: skip
        unseen = plan._replace(every=plan.steps + 1)  # the start is the only sample
        given = packed, motion.beginning, unseen, jumps(motion.case)
        super().__init__(motion.method.scheme, *given)
        self.advance(self._room, 0)
        self._at, self._begins = self._reached(plan.start, self.scheme.old), True
        self._taken: list[Taken] = []
        apart = max(1, int(ROOM / (3 * self._at.q.nbytes)))
        self._places: list[Segment] = []
        for first in range(0, plan.steps, apart):
            arrays = self.checkpoint_arrays()
            self._places.append(Segment(first, self._at, self._begins, arrays))
            self._taken.clear()
            self.advance(self._room, min(apart, plan.steps - first))
        self._ends = [*(place.number for place in self._places[1:]), plan.steps]

    def back(self, first: int, last: int) -> Iterator[Taken]:
        """Return the steps from number `first` to `last`, in reverse order."""
        for place, end in zip(reversed(self._places), reversed(self._ends), strict=True):
            if place.number < last and end > first:
                if self._taken[0].number != place.number:
                    self._at, self._begins = place.state, place.begins
                    self.resume_from(place.engine)
                    self._taken.clear()
                    self.advance(self._room, end - place.number)
                numbers = [taken.number for taken in self._taken]
                low, high = np.searchsorted(numbers, (first, last))
                yield from reversed(self._taken[low:high])

    def changing(self) -> dict[str, Any]:
        """What the next steps depend on, without the engine's own counters."""
        return {name: part for name, part in super().changing().items() if name != "engine"}

    def _reached(self, t: float, at: StepEnd) -> Reached:
        return Reached(t, at.q.copy(), at.w.copy(), at.a.copy())

    def _accept(self, h: float, end: float, jump: float | None) -> None:
        t = end if jump is None else math.nextafter(min(end, jump), -math.inf)
        reached, number = self._reached(t, self.scheme.new), int(self._state.tally.steps)
        self._taken.append(Taken(number, h, self._at, reached, self._begins))
        super()._accept(h, end, jump)
        self._at = reached if jump is None else self._reached(max(end, jump), self.scheme.old)
        self._begins = jump is not None


class ImplicitAdjoint(Adjoint):
    """Backward pass through a motion by Newmark's or the generalized-alpha method; see `Adjoint`.

    Parameters
    ----------
    motion : Motion
    steps : Retraced
        The steps of the motion.
    """

    def __init__(self, motion: Any, steps: Retraced) -> None:
        super().__init__(motion)
        packed, self._steps = self._packed, steps
        self._matrix = StepMatrix(packed, True)
        self._scheme: Any = steps.scheme  # one with `parameters`
        shape = self._scheme.shift.shape
        free = np.zeros(shape, bool)
        free.ravel()[self._matrix.free] = True
        free.ravel()[packed.system.ties.slave] = True  # slaves pass their share to their masters
        self._kinds = free, free & ~self._scheme.massless[:, None]  # all, and those with mass
        # derivatives with respect to the current acceleration, and z of the following step
        self._by_a, self._z = np.zeros(shape), np.zeros(shape)
        self._made = 0.0  # length of the step of the factorized matrix
        self._forget()

    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from step number `last` to step number `first`; see `Adjoint`."""
        with one_thread():
            for taken in self._steps.back(first, last):
                self._back(taken, by_u, by_v)
                if taken.begins:
                    self._back_to_begin(taken.start, by_u, by_v)

    # ------------------------------------------------------------------ a step
    def _back(self, taken: Taken, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from the end of one step to its start; see the module docstring."""
        (am, af, beta, gamma), h = self._scheme.parameters, taken.h
        (_, _, w0, a0), (t, q, w1, a1) = taken.start, taken.end
        curvature, alpha, free, heavy = 1.0 / (beta * h * h), self._system.alpha, *self._kinds
        u, v = self._whole(t, q, w1)
        mass, kept = self._scheme.weights(h).mass, abs(h - self._made) <= SAME_STEP * h
        if not kept:
            self._factorize(u, h)
        self._forget()
        self._pull(u, v, af * self._z)
        z, inertia, change = (np.zeros_like(u) for _ in range(3))
        first, last, norm = 0.0, np.inf, 0.0
        for _ in range(ITERATIONS):
            by_w = by_v - self._rate
            by_shift = np.where(heavy, curvature * (self._by_a + h * gamma * by_w), by_w / h)
            left = free * (by_u - self._product + by_shift - mass * inertia)
            hand_over(self._system.ties, left.reshape(-1))
            norm = float(np.linalg.norm(left))
            first = first or norm
            if norm <= TOLERANCE * first or (norm > STALL * last and not kept):
                break
            if norm > FAST * last and kept:
                self._factorize(u, h)
                kept = False
            z += self._matrix.solve(left, change)
            times_mass(self._mass, z, inertia)
            self._pull(u, v, (1.0 - af) * change)
            last = norm
        if not norm <= ENOUGH * first:
            raise ComputationError(
                f"the gradient of the step to t = {t:.6g} s was not found: take shorter steps"
            )
        self._add_supports()
        self._add_mass(z, (1.0 - am) * a1 + am * a0, (1.0 - af) * w1 + af * w0)
        by_u -= self._product
        by_v -= self._rate + (1.0 - af) * alpha * inertia
        by_end = self._by_a - (1.0 - am) * inertia + h * gamma * by_v
        self._by_a[:] = (1.0 - gamma) * h * by_v - (0.5 - beta) / beta * by_end - am * inertia
        by_v -= curvature * h * by_end + af * alpha * inertia
        for each in (by_v, self._by_a):
            each *= heavy
        self._z = z

    def _back_to_begin(self, start: Reached, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward through a = -M^-1 b - alpha w, the acceleration at the start of a part."""
        weight = self._scheme.parameters.af * self._z + self._push(self._by_a)
        self._through(*start, weight, self._by_a, by_u, by_v)
        by_v *= self._kinds[0]
        self._by_a[:] = self._z[:] = 0.0

    # ------------------------------------------------------------------ parts
    def _factorize(self, u: NDArray, h: float) -> None:
        """Factorize the matrix of a step h (s) that ends at u."""
        matrix = self._matrix
        matrix.blocks.put(self._packed.body, matrix.pattern, u, u, False, matrix.stiffness)
        matrix.follow(u, 0.5)
        matrix.factorize(self._scheme.weights(h))
        self._made = h


def _refuse(motion: Any) -> None:
    """Refuse motions whose steps have no adjoint, with a remedy."""
    if motion.method.name not in METHODS:
        raise InputError(
            f" = {motion.method.name!r}: motions by this method have no gradients; take rk4, "
            f"central_difference, {' or '.join(METHODS)}",
            "method",
        )
    if not motion.plan.steps:
        raise InputError(
            ": gradients need fixed steps, which do not depend on the motion; give dt, and "
            "no tolerance",
            "dt",
        )
    if motion.continued:
        raise InputError(
            ": goes on from the end of another motion, whose acceleration has no derivative; give "
            "its displacement and velocity alone, fd.State(displacement, velocity)",
            "initial",
        )
    ties, massless = motion.packed.system.ties, motion.packed.mass.diagonal <= 0.0
    if massless[np.append(ties.slave, ties.masters.dof) // 3].any():
        raise InputError(
            "there are no gradients of motions in which constraints tie nodes without mass; give "
            "them mass, or vary the parameters by fd.sweep"
        )
    plan = motion.plan
    jumped = any(plan.start < jump <= plan.end for jump in jumps(motion.case))
    if len(motion.packed.body.hidden) and jumped:
        raise InputError(
            "there are no gradients of motions in which loads jump and rotations without mass "
            "follow at once; let them rise in a step, as by fd.Ramp"
        )
