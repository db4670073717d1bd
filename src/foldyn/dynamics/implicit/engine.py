"""Implicit engine: solves one step after the other, writes samples, controls the error.

The step loop runs in Python, as a step's tangent and factorization cost far more than the
interpreter. Force, residual and tangent are compiled.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.actuation import note_offsets
from foldyn.dynamics.checkpoint import state_parts
from foldyn.dynamics.engine import Engine
from foldyn.dynamics.equation import accelerate, write
from foldyn.dynamics.implicit.contact_newton import TouchingNewton
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.implicit.newton import Newton
from foldyn.dynamics.implicit.scheme import NOT_FINITE, SOLVED, Scheme
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.motion_state import MotionState, Outcome, Samples, StepPlan
from foldyn.dynamics.system import PackedCase
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.threads import one_thread

LEAST_STEP = 2.0**-20  # the motion fails if Newton's method fails below this share of a step
LEAST_TIME = 1e-13  # smallest step relative to the end time of the motion
TURN = math.pi  # largest change of a dihedral per step, unless panels collide
MEMORY = 0.9  # factor per step by which an earlier error counts less
SAME_TIME = 1e-9  # times closer than this share of a step are equal
SAME_STATE = 1e-9  # relative difference below which states and forces are equal
# step size control
SAFETY = 0.9
GROWTH = 2.0  # largest factor from one step to the next
WORTHWHILE = 1.25  # for a smaller growth, the step and its matrix are kept
NEAR, CUT = 0.95, 0.85  # below the first factor, the step shrinks in advance by the second
LEAST = 0.2  # least factor from a rejected step to the next attempt
# measures of the motion that the next step depends on
MEASURED = ("wanted", "last", "error", "farthest")
OUTCOMES = {SOLVED: Outcome.DONE, NOT_FINITE: Outcome.NOT_FINITE}


class ImplicitEngine(Engine):
    """Advances a motion with an implicit scheme.

    Parameters
    ----------
    make : callable
        Creates the scheme from a case and its state.
    packed : PackedCase
    state : MotionState
    plan : StepPlan
    jumps : tuple of float
        Sorted times (s) at which loads jump. Steps end there, so that no step contains a jump.

    Attributes
    ----------
    continues : bool
        Whether the motion continues from the end of another motion.
    """

    def __init__(
        self, make: Callable[[PackedCase, MotionState], Scheme], packed: PackedCase,
        state: MotionState, plan: StepPlan, jumps: tuple[float, ...],
    ) -> None:  # fmt: skip
        self._packed, self._state, self._plan, self._jumps = packed, state, plan, jumps
        self.scheme = make(packed, state)
        self._matrix = StepMatrix(packed, self.scheme.symmetric)
        touches = packed.system.touches
        self._touching = TouchingNewton(self.scheme, self._matrix) if touches else None
        self._newton = self._touching or Newton(self.scheme, self._matrix)
        self._halved = 0
        self._horizon = 0.0  # duration of an impulse's effect, s
        self._end: NDArray | None = None
        self.continues = False

    @property
    def _memory(self) -> HingeMemory | None:
        return self._packed.body.find(HingeMemory)

    def facts(self) -> dict[str, Any]:
        """Statistics of the run; see `Engine`."""
        facts = dict(self.scheme.facts) | {
            "iterations": self._newton.iterations,
            "factorizations": self._matrix.factorizations,
            "linear_solver": self._matrix.solver,
            "halved_steps": self._halved,
        }
        if self._touching is not None:
            facts["contact_lists"] = int(self._touching.memory.counts.lists)
        return facts

    def continuation(self) -> NDArray:
        """All numbers (k,) that the next steps depend on; see `continue_from`."""
        state = [*self._numbers(), self._acceleration()]
        return np.concatenate([array.ravel() for array in state])

    def continue_from(self, values: NDArray) -> None:
        """Continue like the motion whose `continuation` was `values`.

        Displacement, velocity and the resulting acceleration must equal the stored ones. If they do
        not, the state or the case has been changed, and the motion begins at a start of its own.
        After the first sample, `continues` holds which of the two happened.
        """
        self._end = values

    def _resume(self, values: NDArray) -> bool:
        """Resume from the numbers of `continuation`; return whether they fit this motion."""
        scheme, old, tally = self.scheme, self.scheme.old, self._state.tally
        own = [*self._numbers(), old.a]
        if values.shape != (sum(array.size for array in own),) or not np.isfinite(values).all():
            return False
        parts = np.split(values, np.cumsum([array.size for array in own])[:-1])
        state = [part.reshape(array.shape) for part, array in zip(parts, own, strict=True)]
        nodes = len(self._packed.system.order)
        if not _same(old.q[:nodes], state[0][:nodes]) or not _same(old.w[:nodes], state[1][:nodes]):
            return False
        old.q[:], old.w[:] = state[:2]
        scheme.begin(self._plan.start)
        if not _same(old.a, state[-1]):
            old.q[:], old.w[:] = own[:2]
            scheme.begin(self._plan.start)
            return False
        counted = len(scheme.numbers())
        memory, factor = self._memory, old.factor.copy()
        branches = () if memory is None else memory.snapshot()
        with one_thread():
            self._newton.resume(state[counted + 2 : -1])
        if memory is not None:
            memory.recall(branches)
        old.factor[:] = factor
        scheme.resume(state[:counted])
        self._state.angle[:] = state[counted]
        *measured, self._horizon = state[counted + 1]
        for name, value in zip(MEASURED, measured, strict=True):
            tally[name] = value
        return True

    def _acceleration(self) -> NDArray:
        """Current acceleration (n, 3); zero for nodes without mass."""
        scheme, memory, t = self.scheme, self._memory, float(self._state.tally.time)
        old, out = scheme.old, np.zeros_like(scheme.old.a)
        if memory is not None:
            memory.still()
        accelerate(scheme.equation.handle, old.q, old.w, t, out)
        out[scheme.massless] = 0.0
        return out

    def _numbers(self) -> list[NDArray]:
        """Numbers that the next steps depend on, apart from the case and the time."""
        measured = [float(self._state.tally[name]) for name in MEASURED]
        state = [self._state.angle.copy(), np.array([*measured, self._horizon])]
        return [*self.scheme.numbers(), *state, *self._newton.numbers()]

    def checkpoint_arrays(self) -> dict[str, NDArray]:
        """All arrays and numbers of `changing`, by name; see `Engine`."""
        made = np.array([self._matrix.factorized, self._matrix.factorizations])
        origin = {f"origin.{k}": array for k, array in enumerate(self._newton.origin)}
        return super().checkpoint_arrays() | {"factorized": made} | origin

    def resume_from(self, arrays: Mapping[str, NDArray]) -> None:
        """Resume from checkpoint arrays."""
        super().resume_from(arrays)
        made, count = arrays["factorized"].tolist()
        if made:
            with one_thread():
                self._newton.remake()
        self._matrix.factorizations = count
        count = sum(name.startswith("origin.") for name in arrays)
        self._newton.origin = tuple(arrays[f"origin.{k}"] for k in range(count))

    def changing(self) -> dict[str, Any]:
        """What the next steps depend on; see `Engine`."""
        own = {"engine": self, "scheme": self.scheme, "newton": self._newton}
        return state_parts(self._packed, self._state) | own | {"matrices": self._matrix.changing}

    def advance(self, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance the motion by at most `stretch` steps; returns (outcome, hinge)."""
        with one_thread():
            return self._advance(out, stretch)

    def _advance(self, out: Samples, stretch: int) -> tuple[int, int]:
        plan, tally = self._plan, self._state.tally
        if tally.samples == 0:
            outcome = self._begin(out)
            if outcome != Outcome.DONE:
                return outcome, -1
        last = tally.steps + stretch
        advance = self._fixed if plan.steps else self._adaptive
        end = min(last, plan.steps) if plan.steps else last
        while tally.steps < end and (plan.steps or tally.time < plan.end):
            if plan.every and not plan.steps and tally.samples == out.end:
                return Outcome.FULL, -1
            outcome, hinge = advance(out)
            tally.evaluations = self._newton.evaluations
            if outcome != Outcome.DONE:
                return outcome, hinge
        return Outcome.DONE, -1

    def _begin(self, out: Samples) -> int:
        scheme, plan, packed = self.scheme, self._plan, self._packed
        scheme.begin(plan.start)
        self._state.tally.farthest = _largest(scheme.displacement())
        if packed.system.varies and not plan.steps:
            whole = plan.end - plan.start
            self._horizon = impulse_duration(scheme, self._matrix, packed, whole)
        if self._touching is not None:
            self._touching.begin()
        self._newton.prepare(plan.dt, plan.start)
        if self._memory is not None:
            self._memory.still()
        self.continues = self._end is not None and self._resume(self._end)
        return self._sample(plan.start, out)

    def _sample(self, t: float, out: Samples) -> int:
        """Write a sample."""
        scheme, state = self.scheme, self._state
        return write(scheme.equation.recording(out), state.u, state.v, t, scheme.out)

    def _fixed(self, out: Samples) -> tuple[int, int]:
        """Take one step of dt, divided at load jumps and where Newton's method fails."""
        plan, tally = self._plan, self._state.tally
        step = int(tally.steps) + 1
        t, end, h = float(tally.time), plan.start + step * plan.dt, plan.dt
        whole = True
        while t < end - SAME_TIME * plan.dt:
            goal, jump = self._next_jump(t, end, SAME_TIME * plan.dt)
            part, stop, jump = equal_step(t, goal, h, jump)
            if abs(part - plan.dt) <= SAME_TIME * plan.dt:
                part = plan.dt  # dt itself, free of rounding errors of times
            outcome, hinge = self._attempt(part, stop, jump)
            if outcome == Outcome.DONE:
                self._accept(part, stop, jump)
                t = stop
                continue
            if self._hopeless(part):
                tally.time = t
                return outcome, hinge
            h, whole = 0.5 * part, False
        self._halved += not whole
        tally.steps, tally.time = step, end
        if step % plan.every == 0:
            return self._sample(end, out), -1
        return Outcome.DONE, -1

    def _adaptive(self, out: Samples) -> tuple[int, int]:
        """Take one step whose error is within the tolerance."""
        plan, tally = self._plan, self._state.tally
        t = float(tally.time)
        due, waits = self._due(out)
        while True:
            wanted = min(float(tally.wanted), plan.dt)
            if wanted < LEAST_TIME * max(abs(plan.end), abs(t)):
                return Outcome.STUCK, -1
            near = SAME_TIME * wanted
            goal, jump = self._next_jump(t, next_stop(plan, t, due, near), near)
            h, end, jump = equal_step(t, goal, wanted, jump)
            outcome, hinge = self._attempt(h, end, jump)
            if outcome != Outcome.DONE:
                if self._hopeless(h):
                    return outcome, hinge
                tally.wanted = 0.5 * h
                tally.refused += 1
                continue
            error, scale = self._error(t, h)
            if error <= 1.0:
                break
            tally.wanted = smaller_step(h, error)
            tally.refused += 1
        self._accept(h, end, jump)
        tally.steps += 1
        tally.time, tally.farthest = end, scale
        # the error of a vibration vanishes twice per period; therefore earlier errors still count
        error = max(error, MEMORY * tally.error * (h / (tally.last or h)) ** 3)
        tally.error, tally.last = error, h
        tally.wanted = max(wanted if end == goal else 0.0, next_step(h, error))
        tally.shortest, tally.longest = min(tally.shortest, h), max(tally.longest, h)
        if tally.steps % plan.every == 0 if plan.every else waits and end == due:
            return self._sample(end, out), -1
        return Outcome.DONE, -1

    def _due(self, out: Samples) -> tuple[float, bool]:
        """Time (s) by which the next steps must end, and whether a sample is due there."""
        plan, number = self._plan, int(self._state.tally.samples)
        if plan.every or number == out.end:
            return plan.end, False
        time = plan.start + number * plan.interval
        if time < plan.end - SAME_TIME * plan.interval:
            return time, True
        return plan.end, time < plan.end + SAME_TIME * plan.interval

    def _next_jump(self, t: float, end: float, near: float) -> tuple[float, float | None]:
        """Latest end of a step from t, and the load jump at this end, if any."""
        k = bisect_right(self._jumps, t + near)
        if k == len(self._jumps) or self._jumps[k] > end + near:
            return end, None
        jump = self._jumps[k]
        return (end if abs(jump - end) <= near else jump), jump

    def _attempt(self, h: float, end: float, jump: float | None) -> tuple[int, int]:
        """Solve a step that ends just before the jump, if any; returns (outcome, hinge)."""
        self.scheme.predict(h)
        moment = end if jump is None else math.nextafter(min(end, jump), -math.inf)
        verdict = self._newton.solve(h, moment)
        if self._packed.callbacks.error is not None:
            return Outcome.NOT_FINITE, -1
        turned = np.abs(self.scheme.part.angle - self._state.angle)
        if turned.max(initial=0.0) > TURN:
            return Outcome.PENETRATION, int(turned.argmax())
        return OUTCOMES.get(verdict, Outcome.NOT_CONVERGED), -1

    def _hopeless(self, h: float) -> bool:
        """Whether smaller steps would fail as well."""
        return h < LEAST_STEP * self._plan.dt or self._packed.callbacks.error is not None

    def _accept(self, h: float, end: float, jump: float | None) -> None:
        scheme, state = self.scheme, self._state
        done, lost, to_air = scheme.works(h)
        state.tally.work += done
        state.tally.dissipated += lost
        state.tally.air += to_air
        if self._touching is not None:
            given, taken = self._touching.works()
            state.tally.work += given
            state.tally.dissipated += taken
            self._touching.begin()
        state.angle[:] = scheme.part.angle
        scheme.accept(h)
        if self._memory is not None:
            self._memory.commit()
        if jump is not None:
            state.tally.work += scheme.settle(max(end, jump))
            scheme.begin(max(end, jump))
            system = self._packed.system
            if self._memory is not None:  # creases with memory turn instantly
                self._memory.commit()
            if system.turns:
                note_offsets(system.actuators, scheme.part.fold_angle)
            if self._touching is not None:
                self._touching.begin()

    def _error(self, t: float, h: float) -> tuple[float, float]:
        """Error of the worst node in a step from t relative to the tolerance, and the new scale.

        The scale is the largest displacement so far. Solving with the step matrix turns the change
        of the acceleration into a displacement, which filters out stiff bars. The load variation
        that the method misses within the step is treated in the same way. In a slow motion, it
        causes a displacement error of order h^2 at once. The error of the whole motion is also of
        this order, so this error may reach the tolerance to the power 2/3. In a step shorter than a
        vibration, it acts as an impulse: its error is the displacement that it causes later.
        """
        scheme, matrix, plan = self.scheme, self._matrix, self._plan
        scale = max(float(self._state.tally.farthest), _largest(scheme.moved()))
        reference, error, force = max(scale, plan.floor), 0.0, scheme.unseen(t, t + h)
        if force is not None:
            if not matrix.factorized and not self._newton.renew(h):
                return math.inf, scale
            moved = matrix.solve(force, scheme.step) / reference
            error = _largest(moved) ** 1.5
            if h < self._horizon:
                error = max(error, _largest(moved[~scheme.massless]) * self._horizon / h)
        change = scheme.change(h)
        if change.any() and matrix.factorized:
            times_mass(self._packed.mass, scheme.weights(h).mass * change, scheme.out)
            error = max(error, _largest(matrix.solve(scheme.out, scheme.step)) / reference)
        return error / plan.tolerance, scale


def _same(now: NDArray, then: NDArray) -> bool:
    return _largest(now - then) <= SAME_STATE * _largest(then)


def _largest(values: NDArray) -> float:
    return float(np.abs(values).max(initial=0.0))


def next_step(h: float, error: float) -> float:
    """Next step (s) after an accepted step h (s), with the error relative to the tolerance."""
    factor = GROWTH if error <= 0.0 else min(GROWTH, SAFETY * error ** (-1.0 / 3.0))
    if factor < NEAR:
        return h * CUT
    return h if factor < WORTHWHILE else h * factor


def smaller_step(h: float, error: float) -> float:
    """Next step (s) after a rejected step h (s), with the error relative to the tolerance."""
    return h * min(0.9, max(LEAST, SAFETY * error ** (-1.0 / 3.0)))


def next_stop(plan: StepPlan, t: float, end: float, near: float) -> float:
    """Latest end of a step from t, given the knots of the histories."""
    k = int(np.searchsorted(plan.stops, t + near, side="right"))
    return plan.stops[k] if k < len(plan.stops) and plan.stops[k] < end - near else end


def equal_step(
    t: float, goal: float, wanted: float, jump: float | None
) -> tuple[float, float, float | None]:
    """First of equal steps from t to the goal, the end of this step, and the jump there, if any."""
    parts = max(1, math.ceil((goal - t) / wanted * (1.0 - SAME_TIME)))
    h = (goal - t) / parts
    return (h, goal, jump) if parts == 1 else (h, t + h, None)


def impulse_duration(
    scheme: Scheme, matrix: StepMatrix, packed: PackedCase, duration: float
) -> float:
    """Time (s) during which an impulse acts on a motion; at most `duration`.

    It is 1/omega of the vibration that the histories cause. Rayleigh's quotient of the
    displacements under slow loads (as slow as the duration, for bodies without supports) gives
    omega^2. Hinges count with their nominal stiffness.
    """
    u = scheme.displacement()
    force = scheme.push(scheme.old, np.ones(len(scheme.old.factor)))
    matrix.blocks.put(packed.body.nominal(u), matrix.pattern, u, u, False, matrix.stiffness)
    slow = (2.0 * math.pi / duration) ** 2
    try:
        matrix.factorize(Weights(stiffness=1.0, mass=slow, damping=0.0))
    except SingularTangentError:
        return duration
    scheme.step[:] = 0.0
    x = matrix.solve(force, scheme.step)
    matrix.forget()
    times_mass(packed.mass, x, scheme.out)
    inertia, work = float((x * scheme.out).sum()), float((x * force).sum())
    square = work / inertia - slow if inertia > 0.0 else 0.0
    return 1.0 / math.sqrt(square) if square * duration * duration > 1.0 else duration
