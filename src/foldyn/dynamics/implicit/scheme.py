"""What an implicit scheme provides, and what its steps share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.waveforms import unseen
from foldyn.dynamics.course import Course
from foldyn.dynamics.implicit.convergence import GO_ON, NOT_CONVERGED, Goal, judge
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.system import Packed, Scratch, acceleration, scratch
from foldyn.jit.compiled import kernel
from foldyn.jit.intrinsics import flat

EPS = float(np.finfo(float).eps)


class Phase(NamedTuple):
    """State at one time: arrays (n, 3), those of q and w without the motion of the supports."""

    q: NDArray  # m
    w: NDArray  # m/s
    a: NDArray  # m/s2
    force: NDArray  # F_int + beta K0 v - p, N
    factor: NDArray  # (h, 3) of the histories


class Scheme(ABC):
    """Steps from `old` to `new`, whose unknown is the displacement in a step, `shift`.

    Parameters
    ----------
    packed : Packed
        The case.
    course : Course
        Where the motion stands: q, w and a of `old` are its arrays.

    Attributes
    ----------
    symmetric : bool
        Whether the tangent is.
    tolerance : float
        Residual, relative to the forces at play, with which a step is accepted.
    facts : mapping
        Parameters, for the result's attributes.
    """

    symmetric: ClassVar[bool]
    tolerance: ClassVar[float]
    facts: Mapping[str, float] = {}

    def __init__(self, packed: Packed, course: Course) -> None:
        self.packed, self.course = packed, course
        self.work: Any = packed.body.workspaces(1)[0]
        self.scratch: Scratch = scratch(packed.system)
        shape, histories = course.u.shape, self.scratch.factor.shape
        self.out, self.step = np.zeros(shape), np.zeros(shape)
        self.shift = np.zeros(shape)  # new.q - old.q: their difference would lose digits
        self.earlier = np.zeros(shape)  # new.q before the last iteration
        self._gap, self._pushed = np.zeros(histories[0]), np.zeros(shape)
        self.old = Phase(course.u, course.v, course.carry, np.zeros(shape), np.zeros(histories))
        q, w, a, force = (np.zeros(shape) for _ in range(4))
        self.new = Phase(q, w, a, force, np.zeros(histories))
        # mean velocity of the last step, and its change per time from the middle of one to another
        self._speed, self._growth, self._last = course.v.copy(), np.zeros(shape), 0.0
        self.massless = packed.mass.diagonal <= 0.0
        self.rounding = EPS * float(np.linalg.norm(packed.body.scale()))
        self.folds = np.zeros_like(self.work.fold_angle)  # at old.q, rad

    @abstractmethod
    def weights(self, h: float) -> Weights:
        """Factors of the matrices for a step h (s)."""

    @abstractmethod
    def residual(self, h: float, t: float) -> tuple[float, float]:
        """Out-of-balance force of the step to the time t (s), into `out`.

        Makes `new` what belongs to `shift`. Returns the norm of the force on the free dofs and that
        of the forces at play, N.
        """

    @abstractmethod
    def tangent(self, matrix: StepMatrix, before: NDArray, again: bool) -> None:
        """Fill the stiffness blocks at new.q; see `Blocks.put` for `before` and `again`."""

    @abstractmethod
    def works(self, h: float) -> tuple[float, float]:
        """Work of loads, supports and actuators in the step, and energy dissipated, J."""

    @abstractmethod
    def change(self, h: float) -> NDArray:
        """Estimate of h^2/12 times the change of the acceleration in the step (n, 3), m."""

    def iterate(
        self, matrix: StepMatrix, goal: Goal, h: float, t: float, last: float, lowest: float,
        most: int,
    ) -> tuple[int, float, int]:  # fmt: skip
        """Iterate with the matrix as it is; returns what `judge` says, the residual, how often."""
        norm = np.inf
        for steps in range(most):
            norm, reference = self.residual(h, t)
            verdict = judge(goal, norm, reference, last, lowest)
            if verdict != GO_ON:
                return verdict, norm, steps
            lowest, last = min(lowest, norm), norm
            self.earlier[:] = self.new.q
            self.shift -= matrix.solve(self.out, self.step)
        return NOT_CONVERGED, norm, most

    def begin(self, t: float) -> None:
        """Make `old` the beginning of a motion, or of its part after a jump, at t (s)."""
        old, s = self.old, self.scratch
        acceleration(*self.packed.arrays, old.q, old.w, t, old.a, self.work, s)
        old.a[self.massless] = 0.0
        self._speed[:], self._last = old.w, 0.0
        self._growth[:] = 0.0
        old.force[:], old.factor[:] = s.force, s.factor
        self.folds[:] = self.work.fold_angle

    def hinge_forces(self) -> float:
        """Norm of the hinges' forces at old.q, N: forces at play even where all is at rest."""
        forces = self.packed.body.hinge_forces(self.displacement(), self.work)
        return float(np.linalg.norm(forces))

    def displacement(self) -> NDArray:
        """Displacement (n, 3) of old.q with that of the supports."""
        return self.carried(self.old.q, self.old.factor)

    def moved(self) -> NDArray:
        """Displacement (n, 3) of new.q with that of the supports."""
        return self.carried(self.new.q, self.new.factor)

    def carried(self, q: NDArray, factor: NDArray) -> NDArray:
        """Displacement (n, 3) of q with that of the supports for factors (h, 3)."""
        moved = self.packed.system.moved
        if not len(moved.dof):
            return q
        out = q.copy()
        np.add.at(out.reshape(-1), moved.dof, moved.value * factor[moved.row, 0])
        return out

    def unseen(self, first: float, last: float) -> NDArray | None:
        """Force (n, 3) at the end of a step that what histories do within it would exert, N.

        None if they are straight lines there. The dihedrals of the last evaluation stay those of
        the end.
        """
        packed, new = self.packed, self.new
        if not packed.system.varies:
            return None
        unseen(packed.system.waves, first, last, self.old.factor, new.factor, self._gap)
        return self.push(new, self._gap) if self._gap.any() else None

    def push(self, phase: Phase, change: NDArray) -> NDArray:
        """Force (n, 3) that a change (h,) of the factors exerts at a phase, N; uses `out`."""
        s = self.scratch
        for moved, force in ((change, self._pushed), (np.zeros_like(change), self.out)):
            s.factor[:], s.time[0] = phase.factor, 0.0  # evaluated as if for this time
            s.factor[:, 0] += moved
            acceleration(*self.packed.arrays, phase.q, phase.w, 0.0, self.earlier, self.work, s)
            force[:] = s.force
        s.time[0] = np.nan
        self._pushed -= self.out
        return self._pushed

    def predict(self, h: float) -> None:
        """Move on as the mean velocities of the last steps go on.

        The velocities at the ends of steps that do not resolve a vibration ring; means do not.
        """
        ahead = 0.5 * (h + self._last)
        self.shift[:] = h * (self._speed + ahead * self._growth)

    def accept(self, h: float) -> None:
        """Make the end of a step h (s) the beginning of the next one."""
        speed = self.shift / h
        self._growth[:] = (speed - self._speed) / (0.5 * (h + self._last))
        self._speed[:], self._last = speed, h
        for old, new in zip(self.old, self.new, strict=True):
            old[:] = new
        self.folds[:] = self.work.fold_angle


@kernel
def clear_supported(system, force):
    """Sum of squares of a force (n, 3) at the supports, N2, where it becomes zero."""
    values, total = flat(force), 0.0
    for k in range(system.supported.size):
        dof = system.supported[k]
        total += values[dof] * values[dof]
        values[dof] = 0.0
    return total


@kernel
def load_square(system, factor):
    """Sum of squares of the loads for factors (h, 3), N2."""
    loads, total = system.loads, 0.0
    for k in range(loads.dof.size):
        load = loads.value[k] * factor[loads.row[k], 0]
        total += load * load
    return total
