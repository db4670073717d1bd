"""An implicit method at work: steps solved one after the other, samples, error control.

The loop over the steps is Python. A step's tangent and its factorization cost far more than the
interpreter; the force, the residual and the tangent are compiled.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.banded import one_thread
from foldyn.dynamics.course import Course, Outcome, Plan, Samples, sample
from foldyn.dynamics.implicit import convergence
from foldyn.dynamics.implicit.control import next_step, remembered, smaller_step
from foldyn.dynamics.implicit.horizon import horizon
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.newton import Newton
from foldyn.dynamics.implicit.scheme import Bench, Scheme
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.system import Packed, acceleration
from foldyn.jit.compiled import kernel

SAME_TIME = 1e-9  # of a step: times as near as that are one
LEAST_STEP = 2.0**-20  # of the step wanted: where Newton's method fails with less, it fails
LEAST_TIME = 1e-13  # step relative to the end of the motion
TURN = math.pi  # by which no dihedral jumps in a step unless panels collide


class Implicit:
    """An implicit scheme that advances a motion; see `foldyn.dynamics.engine.Engine`.

    Parameters
    ----------
    make : callable
        The scheme from a bench.
    packed : Packed
    jumps : tuple of float
        Times (s), in order, at which loads jump: steps end there, so that no step sees a jump.
    """

    threads = 1

    def __init__(
        self, make: Callable[[Bench], Scheme], packed: Packed, jumps: tuple[float, ...]
    ) -> None:
        self._make, self._packed, self._jumps = make, packed, jumps
        self._newton: Newton | None = None
        self._halved = 0
        self._horizon = 0.0  # s in which a vibration moves on

    def facts(self) -> dict[str, Any]:
        """Statistics of the run."""
        newton = self._newton
        if newton is None:
            return {}
        return dict(newton.scheme.facts) | {
            "iterations": newton.iterations,
            "factorizations": newton.matrix.factorizations,
            "linear_solver": newton.matrix.solver,
            "halved_steps": self._halved,
        }

    def advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        """See `Engine`."""
        with one_thread():
            return self._advance(course, plan, out, stretch)

    def _advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        if self._newton is None:
            found = self._begin(course, plan, out)
            if found != Outcome.DONE:
                return found, -1
        newton = self._newton
        assert newton is not None
        last = course.tally.steps + stretch
        advance = self._fixed if plan.steps else self._adaptive
        end = min(last, plan.steps) if plan.steps else last
        while course.tally.steps < end and (plan.steps or course.tally.time < plan.end):
            if plan.every and not plan.steps and course.tally.samples == len(out.time):
                return Outcome.FULL, -1
            found, hinge = advance(newton, course, plan, out)
            course.tally.evaluations = newton.evaluations
            if found != Outcome.DONE:
                return found, hinge
        return Outcome.DONE, -1

    def _begin(self, course: Course, plan: Plan, out: Samples) -> int:
        bench = Bench(self._packed, course)
        scheme = self._make(bench)
        newton = Newton(scheme, StepMatrix(self._packed, scheme.symmetric))
        scheme.begin(plan.start)
        course.tally.farthest = _largest(bench.displacement())
        if self._packed.system.varies and not plan.steps:
            self._horizon = horizon(bench, newton.matrix, plan.end - plan.start)
        newton.prepare(plan.dt, plan.start)
        self._newton = newton
        return self._note(newton, course, plan.start, out)

    def _note(self, newton: Newton, course: Course, t: float, out: Samples) -> int:
        """Write a sample."""
        packed, bench = self._packed, newton.scheme.bench
        return _write(
            packed.model, packed.system, packed.mass, course, t, out, bench.work, bench.scratch,
            bench.out,
        )  # fmt: skip

    def _fixed(self, newton: Newton, course: Course, plan: Plan, out: Samples) -> tuple[int, int]:
        """One step of dt, in parts where a load jumps or Newton's method fails."""
        step = int(course.tally.steps) + 1
        t, end, h = float(course.tally.time), plan.start + step * plan.dt, plan.dt
        whole = True
        while t < end - SAME_TIME * plan.dt:
            goal, jump = self._next_jump(t, end, SAME_TIME * plan.dt)
            part, stop, jump = _divide(t, goal, h, jump)
            found, hinge = self._attempt(newton, part, stop, jump)
            if found == Outcome.DONE:
                self._accept(newton, course, part, stop, jump)
                t = stop
                continue
            if self._hopeless(part, plan.dt):
                course.tally.time = t
                return found, hinge
            h, whole = 0.5 * part, False
        self._halved += not whole
        course.tally.steps, course.tally.time = step, end
        if step % plan.every == 0:
            return self._note(newton, course, end, out), -1
        return Outcome.DONE, -1

    def _adaptive(
        self, newton: Newton, course: Course, plan: Plan, out: Samples
    ) -> tuple[int, int]:
        """One step whose error is within the tolerance."""
        tally = course.tally
        t = float(tally.time)
        due, waits = self._due(plan, course, out)
        while True:
            wanted = min(float(tally.wanted), plan.dt)
            if wanted < LEAST_TIME * max(abs(plan.end), abs(t)):
                return Outcome.STUCK, -1
            near = SAME_TIME * wanted
            goal, jump = self._next_jump(t, _next_stop(plan, t, due, near), near)
            h, end, jump = _divide(t, goal, wanted, jump)
            found, hinge = self._attempt(newton, h, end, jump)
            if found != Outcome.DONE:
                if self._hopeless(h, plan.dt):
                    return found, hinge
                tally.wanted = 0.5 * h
                tally.refused += 1
                continue
            error, scale = self._error(newton, plan, t, h, float(tally.farthest))
            if error <= 1.0:
                break
            tally.wanted = smaller_step(h, error)
            tally.refused += 1
        self._accept(newton, course, h, end, jump)
        tally.steps += 1
        tally.time, tally.farthest = end, scale
        error = remembered(error, tally.error, h, tally.last or h)
        tally.error, tally.last = error, h
        tally.wanted = max(wanted if end == goal else 0.0, next_step(h, error))
        tally.shortest, tally.longest = min(tally.shortest, h), max(tally.longest, h)
        if tally.steps % plan.every == 0 if plan.every else waits and end == due:
            return self._note(newton, course, end, out), -1
        return Outcome.DONE, -1

    def _due(self, plan: Plan, course: Course, out: Samples) -> tuple[float, bool]:
        """Time (s) by which the next steps end, and whether a sample waits there."""
        number = int(course.tally.samples)
        if plan.every or number == len(out.time):
            return plan.end, False
        time = plan.start + number * plan.interval
        if time < plan.end - SAME_TIME * plan.interval:
            return time, True
        return plan.end, time < plan.end + SAME_TIME * plan.interval

    def _next_jump(self, t: float, end: float, near: float) -> tuple[float, float | None]:
        """Where a step from t has to end at the latest, and the jump of a load there."""
        k = bisect_right(self._jumps, t + near)
        if k == len(self._jumps) or self._jumps[k] > end + near:
            return end, None
        jump = self._jumps[k]
        return (end if abs(jump - end) <= near else jump), jump

    def _attempt(self, newton: Newton, h: float, end: float, jump: float | None) -> tuple[int, int]:
        """Solve a step that ends before the jump, if there is one; returns (outcome, hinge)."""
        bench = newton.scheme.bench
        bench.predict(h)
        found = newton.solve(h, end if jump is None else math.nextafter(min(end, jump), -math.inf))
        if self._packed.callbacks.error is not None:
            return Outcome.NOT_FINITE, -1
        turned = np.abs(bench.work.angle - bench.course.angle)
        if turned.max(initial=0.0) > TURN:
            return Outcome.PENETRATION, int(turned.argmax())
        if found == convergence.SOLVED:
            return Outcome.DONE, -1
        return (
            Outcome.NOT_FINITE if found == convergence.NOT_FINITE else Outcome.NOT_CONVERGED
        ), -1

    def _hopeless(self, h: float, wanted: float) -> bool:
        """Whether a smaller step would not help either."""
        return h < LEAST_STEP * wanted or self._packed.callbacks.error is not None

    def _accept(
        self, newton: Newton, course: Course, h: float, end: float, jump: float | None
    ) -> None:
        scheme = newton.scheme
        done, lost = scheme.works(h)
        course.tally.work += done
        course.tally.dissipated += lost
        course.angle[:] = scheme.bench.work.angle
        scheme.accept(h)
        if jump is not None:
            scheme.begin(max(end, jump))

    def _error(
        self, newton: Newton, plan: Plan, t: float, h: float, scale: float
    ) -> tuple[float, float]:
        """Error of the worst node in a step from t, over the tolerance, and the new scale.

        The scale is the largest displacement so far. The change of the acceleration goes through
        the matrix of the step, which takes away what stiff bars add to it and displacements do not
        feel. So does what loads do between the ends of the step and the method does not see. The
        displacement of a slow motion errs by this at once, by the square of the step as the whole
        motion does, and may do so by the tolerance to the power 2/3, which is the error of the
        whole motion. In a step shorter than a vibration it is an impulse that lasts: its error is
        the displacement that it leads to later.
        """
        scheme, bench = newton.scheme, newton.scheme.bench
        scale = max(scale, _largest(bench.moved()))
        reference, error, force = max(scale, plan.floor), 0.0, bench.unseen(t, t + h)
        if force is not None:
            if not newton.matrix.factorized and not newton.renew(h):
                return math.inf, scale
            moved = newton.matrix.solve(force, bench.step) / reference
            error = _largest(moved) ** 1.5
            if h < self._horizon:
                error = max(error, _largest(moved[~bench.massless]) * self._horizon / h)
        change = scheme.change(h)
        if change.any() and newton.matrix.factorized:
            times_mass(self._packed.mass, scheme.weights(h).mass * change, bench.out)
            error = max(error, _largest(newton.matrix.solve(bench.out, bench.step)) / reference)
        return error / plan.tolerance, scale


def _largest(values: NDArray) -> float:
    return float(np.abs(values).max(initial=0.0))


def _next_stop(plan: Plan, t: float, end: float, near: float) -> float:
    """Where a step from t has to end at the latest, for the knots of the histories."""
    k = int(np.searchsorted(plan.stops, t + near, side="right"))
    return plan.stops[k] if k < len(plan.stops) and plan.stops[k] < end - near else end


def _divide(
    t: float, goal: float, wanted: float, jump: float | None
) -> tuple[float, float, float | None]:
    """Step from t, the first of equal ones to the goal, its end, and the jump if it is there."""
    parts = max(1, math.ceil((goal - t) / wanted * (1.0 - SAME_TIME)))
    h = (goal - t) / parts
    return (h, goal, jump) if parts == 1 else (h, t + h, None)


@kernel
def _write(model, system, mass, course, t, out, work, s, a):
    """Write the next sample at time t."""
    acceleration(model, system, mass, course.u, course.v, t, a, work, s)
    return sample(model, system, mass, course.u, course.v, a, t, course, out, work, s)
