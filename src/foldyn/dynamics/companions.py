"""Motions of slightly different cases, computed along the implicit steps of one main motion.

A companion uses the matrices of the main motion. The difference between the two is smooth in time.
After each step of the main motion, a parabola through the last differences predicts the companion.
Newton iterations with the main motion's factors then bring the companion's residual to the residual
that the main motion has left. Both are then equally close to their solutions, so their difference
is the difference of the solutions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.banded import substitute
from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.generalized_alpha import Alpha, balanced, residual
from foldyn.dynamics.implicit.engine import ImplicitEngine
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.newton import SAME_STEP
from foldyn.dynamics.implicit.scheme import Scheme
from foldyn.dynamics.motion_state import MotionState, Samples, StepPlan
from foldyn.dynamics.system import PackedCase
from foldyn.dynamics.ties import follow_masters
from foldyn.errors import ComputationError
from foldyn.jit.compiled import kernel
from foldyn.jit.intrinsics import flat

MOST = 20  # largest number of iterations
FADED = 1e-2  # smaller differences are measured against this share of the largest difference
ROUNDING = 1e-13  # changes below this share of a step's displacement count as zero
# rounding stops the iteration if a change exceeds the first share of the last change, and is
# below the second share of the difference
STALL, ENOUGH = 0.5, 1e-3


class Companion(NamedTuple):
    """A companion motion: its case, and its current state."""

    packed: PackedCase
    state: MotionState


class Accompanied(ImplicitEngine):
    """An implicit motion by fixed steps with companions; see `ImplicitEngine`.

    Parameters
    ----------
    others : sequence of Companion
        Cases with the same dofs, without contact and without laws with memory.
    share : float
        Relative change of a difference at which the iteration ends.

    Attributes
    ----------
    displacement : list of list of ndarray (n, 3)
        Displacement of each companion at the samples, m.
    """

    def __init__(
        self, make: Callable[[PackedCase, MotionState], Alpha], packed: PackedCase,
        state: MotionState, plan: StepPlan, jumps: tuple[float, ...], others: Sequence[Companion],
        share: float,
    ) -> None:  # fmt: skip
        super().__init__(make, packed, state, plan, jumps)
        self._others = [_Beside(make(*other), share) for other in others]
        self._spare: StepMatrix | None = None
        self.displacement: list[list[NDArray]] = [[] for _ in others]

    def _begin(self, out: Samples) -> int:
        for other in self._others:
            other.scheme.begin(self._plan.start)
        return super()._begin(out)

    def _accept(self, h: float, end: float, jump: float | None) -> None:
        t = end if jump is None else math.nextafter(min(end, jump), -math.inf)
        matrix = self._factors(h)
        for other in self._others:
            other.follow(self.scheme, matrix, h, t)
        super()._accept(h, end, jump)
        if jump is not None:
            for other in self._others:
                other.scheme.settle(max(end, jump))
                other.scheme.begin(max(end, jump))

    def _factors(self, h: float) -> StepMatrix:
        """Factors of the matrix for a step h (s), or the last ones if their step is close to h."""
        made = self._newton.origin
        if self._matrix.factorized and len(made) and abs(h - made[0][0]) <= SAME_STEP * h:
            return self._matrix
        self._spare = self._spare or StepMatrix(self._packed, self.scheme.symmetric)
        try:
            self.scheme.tangent(self._spare, self.scheme.moved(), False)
            self._spare.factorize(self.scheme.weights(h))
        except SingularTangentError as error:
            raise ComputationError(str(error)) from None
        return self._spare

    def _sample(self, t: float, out: Samples) -> int:
        outward = self._packed.numbering.outward
        for other, found in zip(self._others, self.displacement, strict=True):
            found.append(outward(other.scheme.displacement()))
        return super()._sample(t, out)


class _Beside:
    """Steps of one companion."""

    def __init__(self, scheme: Alpha, share: float) -> None:
        self.scheme, self._share = scheme, share
        shape = scheme.shift.shape
        self._apart = np.zeros((3, *shape))  # last three differences of shifts, the newest first
        self._known, self._h, self._largest = 0, 0.0, 0.0

    def follow(self, one: Scheme, matrix: StepMatrix, h: float, t: float) -> None:
        """Repeat the main motion's step h (s) to the time t (s)."""
        scheme, apart = self.scheme, self._apart
        if abs(h - self._h) > SAME_STEP * h:
            self._known, self._h = 0, h
        first, second, third = ((0, 0, 0), (1, 0, 0), (2, -1, 0), (3, -3, 1))[self._known]
        scheme.shift[:] = one.shift + first * apart[0] + second * apart[1] + third * apart[2]
        if self._solve(one, matrix, h, t) == MOST:
            raise ComputationError(f"no companion motion was found at t = {t:.6g} s")
        apart[1:] = apart[:-1]
        apart[0] = scheme.shift - one.shift
        self._largest = max(self._largest, float(np.linalg.norm(apart[0])))
        self._known = min(self._known + 1, 3)
        scheme.accept(h)

    def _solve(self, one: Scheme, matrix: StepMatrix, h: float, t: float) -> int:
        scheme, least = self.scheme, FADED * self._largest
        if matrix.band is not None:
            given = scheme.context, one.shift, one.out, h, t, matrix.band, matrix.free
            return follow(*given, least, self._share, MOST)
        last = math.inf
        for steps in range(MOST):
            scheme.residual(h, t)
            change = matrix.solve(scheme.out - one.out, scheme.step)
            scheme.shift -= change
            size, whole = np.linalg.norm(change), np.linalg.norm(scheme.shift)
            apart = np.linalg.norm(scheme.shift - one.shift)
            if _found(size, max(apart, least), whole, last, self._share):
                balanced(scheme.context, one.out, h)
                return steps
            last = size
        return MOST


@kernel
def _found(size, apart, whole, last, share):
    """Whether a change of norm `size`, after the change `last`, ends the iteration."""
    stalled = size > STALL * last and size <= ENOUGH * apart
    return size <= max(share * apart, ROUNDING * whole) or stalled


@kernel
def follow(step, shift, target, h, t, band, free, least, share, most):
    """Iterate from a step's shift until the residual (n, 3), N, equals `target`; return the count.

    shift : (n, 3) of the main motion, m. The iteration ends when the change of the difference to it
    falls below `share` times the norm of this difference, or times `least` if that is larger.
    """
    d, left, own, goal = flat(step.shift), flat(step.out), flat(shift), flat(target)
    change, ties, last = np.empty(free.size), step.case.system.ties, np.inf
    for steps in range(most):
        residual(step, h, t)
        size = apart = whole = 0.0
        for k in range(free.size):
            change[k] = left[free[k]] - goal[free[k]]
        substitute(band, change)
        for k in range(free.size):
            dof = free[k]
            d[dof] -= change[k]
            size += change[k] * change[k]
            apart += (d[dof] - own[dof]) * (d[dof] - own[dof])
            whole += d[dof] * d[dof]
        if ties.slave.size > 0:
            follow_masters(ties, d)
        size = np.sqrt(size)
        if _found(size, max(np.sqrt(apart), least), np.sqrt(whole), last, share):
            balanced(step, target, h)
            return steps
        last = size
    return most
