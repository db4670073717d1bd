"""Base class of implicit schemes, and the convergence test of Newton's method."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.waveforms import unseen
from foldyn.dynamics.actuation import turn
from foldyn.dynamics.equation import EquationOfMotion, accelerate
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.inertia import kinetic_energy, moving_energy
from foldyn.dynamics.motion_state import MotionState
from foldyn.dynamics.system import PackedCase, Scratch, carried, place, scratch
from foldyn.dynamics.ties import follow_masters, hand_over
from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.air_drag import AirDragTerm
from foldyn.mechanics.constant_damping import DampingMatrix
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.following import following_force
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.mechanics.viscous import ViscousTerm

EPS = float(np.finfo(float).eps)
FAST = 0.3  # the matrix is reused if an iteration leaves less than this share of the residual
GROWTH = 1e8  # growth of the residual at which the iteration has diverged
# the residual has stalled at rounding errors if it is below one of these bounds
ENOUGH = 1e-8  # share of the forces at play
ROUNDING = 8.0  # multiple of the rounding error of forces
OF_MOTION = 1e-5  # largest residual, relative to the inertial force of the predicted step
STALL = 0.5  # it has stalled if an iteration leaves more than this share of it

SOLVED, GO_ON, NEW_MATRIX, NOT_CONVERGED, NOT_FINITE = range(5)


class Goal(NamedTuple):
    """Convergence criteria for the residual; forces in N."""

    tolerance: float  # largest residual, relative to the forces at play
    least: float  # lower bound for the forces at play
    most: float  # largest residual, for small motions about a state with large forces
    rounding: float  # rounding error of bar forces and, in very short steps, of inertia


@kernel
def judge(goal, norm, reference, last, lowest):
    """Decide how to go on, given the norm (N) of the residual now, before, and at its lowest.

    reference : forces at play, N.
    last : norm before; 0 if there is no matrix yet, inf before the first iteration with an old one.
    """
    if not norm < np.inf:
        return NOT_FINITE
    forces = max(reference, goal.least)
    if norm <= min(goal.tolerance * forces, goal.most):
        return SOLVED
    if norm > STALL * last and norm <= max(ENOUGH * forces, ROUNDING * goal.rounding) and last > 0:
        return SOLVED
    if norm > GROWTH * lowest:
        return NOT_CONVERGED
    return NEW_MATRIX if norm > FAST * last else GO_ON


class StepEnd(NamedTuple):
    """State at one time, in arrays (n, 3); q and w exclude support motion."""

    q: NDArray  # m
    w: NDArray  # m/s
    a: NDArray  # m/s2
    force: NDArray  # the bracket F_int + beta K0 v - p, N
    factor: NDArray  # (h, 3) factors of the histories
    pushed: NDArray  # forces of displacement-dependent loads, N; (0, 3) if there are none
    damped: NDArray  # forces of damping, N; empty if not needed
    resisted: NDArray  # forces of the air, N; empty if not needed


class Scheme(ABC):
    """A time step from `old` to `new`; the unknown is `shift`, the increment of displacement.

    Parameters
    ----------
    packed : PackedCase
        The case.
    state : MotionState
        Current state of the motion; its arrays are q, w and a of `old`.

    Attributes
    ----------
    symmetric : bool
        Whether the tangent is symmetric.
    tolerance : float
        Residual, relative to the forces at play, at which a step is accepted.
    facts : mapping
        Parameters of the scheme, for the result's attributes.
    """

    symmetric: bool
    tolerance: ClassVar[float]
    facts: Mapping[str, float] = {}

    def __init__(self, packed: PackedCase, state: MotionState) -> None:
        self.packed, self.state = packed, state
        self.part = packed.body.thread_parts(1)[0]
        self.scratch: Scratch = scratch(packed.system)
        self.equation = EquationOfMotion(packed, self.part, self.scratch, state, None)
        shape, histories = state.u.shape, self.scratch.factor.shape
        self.out, self.step = np.zeros(shape), np.zeros(shape)
        self.shift = np.zeros(shape)  # new.q - old.q, stored because subtracting would lose digits
        self.earlier = np.zeros(shape)  # new.q before the last iteration
        self._gap, self._pushed = np.zeros(histories[0]), np.zeros(shape)
        self.driven = np.flatnonzero([bool(term.histories) for term in packed.body.terms])
        air = [isinstance(term, AirDragTerm) for term in packed.body.terms]
        damps = [term.damps for term in packed.body.terms] & ~np.array(air)
        self.damping, self.drag = np.flatnonzero(damps), np.flatnonzero(air)
        self.rubbing = np.intersect1d(self.damping, self.driven)
        self.symmetric = self.symmetric and all(term.symmetric for term in packed.body.terms)
        kept = (np.zeros(shape if len(own) else (0, 3)) for own in (self.damping, self.drag))
        rest = np.zeros(shape), np.zeros(histories), np.zeros_like(self.scratch.pushed), *kept
        self.old = StepEnd(state.u, state.v, state.carry, *rest)
        self.new = StepEnd(*map(np.zeros_like, self.old))
        # mean velocity of the last step, and its rate of change between midpoints
        self._speed, self._growth, self._last = state.v.copy(), np.zeros(shape), 0.0
        self.massless = packed.mass.diagonal <= 0.0
        self.rounding = EPS * float(np.linalg.norm(packed.body.scale()))
        self.folds = np.zeros_like(self.part.fold_angle)  # fold angles at old.q, rad

    @abstractmethod
    def weights(self, h: float) -> Weights:
        """Weights of the matrices for a step h (s)."""

    @abstractmethod
    def residual(self, h: float, t: float) -> tuple[float, float]:
        """Compute the residual force of a step h (s) to the time t (s) into `out`.

        Updates `new` from `shift`. Returns the norms of the residual on the free dofs and of the
        forces at play, N.
        """

    @abstractmethod
    def tangent(self, matrix: StepMatrix, before: NDArray, again: bool) -> None:
        """Fill the stiffness blocks at new.q; see `Blocks.put` for `before` and `again`."""

    @abstractmethod
    def works(self, h: float) -> tuple[float, float, float]:
        """Work of loads, supports and actuators in a step, energy dissipated and lost to air, J."""

    @abstractmethod
    def change(self, h: float) -> NDArray:
        """Estimate (n, 3), m, of h^2/12 times the change of the acceleration over the step."""

    def contact_tangent(self, contact: ContactTerm, memory: Memory) -> sparse.csr_array:
        """Derivative (m, m), N/m, of the contact force at its last evaluation."""
        return contact.tangent_at(self.moved(), memory)

    def plane_push(self, before: NDArray, after: NDArray) -> NDArray:
        """Friction gradient and normal force of planes, N, that do the exact work of a step.

        before, after : (q, n, 4) at the ends of the step; see `mechanics.contact.contact_state`.
        """
        return 0.5 * (before + after)

    def rub(self, before: NDArray, after: NDArray) -> NDArray:
        """Gradient of friction between panels, N, that does the exact work of a step.

        before, after : (n, 3) at the ends of the step.
        """
        return 0.5 * (before + after)

    def iterate(
        self, matrix: StepMatrix, goal: Goal, h: float, t: float, last: float, lowest: float,
        most: int,
    ) -> tuple[int, float, int]:  # fmt: skip
        """Iterate with the current matrix; return `judge`'s verdict, residual, iterations."""
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
        """Make `old` the start of a motion, or of a part after a jump, at t (s)."""
        old, s = self.old, self.scratch
        accelerate(self.equation.handle, old.q, old.w, t, old.a)
        old.a[self.massless] = 0.0
        self._speed[:], self._last = old.w, 0.0
        self._growth[:] = 0.0
        old.force[:], old.factor[:], old.pushed[:] = s.force, s.factor, s.pushed
        self.folds[:] = self.part.fold_angle

    def settle(self, t: float) -> float:
        """Let massless parts follow loads that jump at t (s); return the work done on them, J.

        Offsets follow at once. So do massless dofs, except for turns of damped creases and for dofs
        in a damping matrix.
        """
        body, system, s = self.packed.body, self.packed.system, self.scratch
        matrix, viscous = body.find(DampingMatrix), body.find(ViscousTerm)
        hidden, memory = body.hidden, body.find(HingeMemory)
        follows = len(hidden) > 0
        if matrix is not None:
            follows = follows and not np.isin(hidden, matrix.damping_places[0]).any()
        if not (follows or system.turns):
            return 0.0
        place(system, self.old.q, self.old.w, t, s)
        start = settled = np.ravel(s.displacement)[: body.size]
        before = body.energies(start)
        if system.turns:
            turn(system.actuators, s.factor)
        if follows:
            push = following_force(system.following, start, s.factor)
            turns = sparse.csr_array((0, len(hidden))) if viscous is None else viscous.turns(hidden)
            held = start[hidden], turns
            settled = body.dofs(s.displacement[: len(system.order)], push, memory, held)
            self.old.q.ravel()[hidden] = settled[hidden]
        stored = float((body.energies(settled) - before).sum())
        return stored if memory is None else stored + float(memory.own.lost[1])

    def goal(self, h: float) -> Goal:
        """Convergence criteria for a step h (s)."""
        mass = self.packed.mass.diagonal[:, None]
        inertia = self.weights(h).mass * float(np.linalg.norm(mass * self.shift))
        rounding = self.rounding + EPS * inertia
        most = max(OF_MOTION * inertia, rounding)
        hinges = self.packed.body.hinge_forces(self.displacement())  # at play also at rest
        return Goal(self.tolerance, float(np.linalg.norm(hinges)), most, rounding)

    def displacement(self) -> NDArray:
        """Displacement (n, 3) at old.q, support motion included."""
        return self.carried(self.old.q, self.old.factor)

    def moved(self) -> NDArray:
        """Displacement (n, 3) at new.q, support motion included."""
        return self.carried(self.new.q, self.new.factor)

    def carried(self, q: NDArray, factor: NDArray) -> NDArray:
        """Displacement (n, 3) for q plus support motion at the factors (h, 3)."""
        return carried(self.packed.system.moved, factor[:, 0], q)

    def unseen(self, first: float, last: float) -> NDArray | None:
        """Force (n, 3), N, at the end of a step, equivalent to how histories vary within the step.

        None if the histories are linear within the step. The stored dihedrals remain those at the
        step's end.
        """
        packed, new = self.packed, self.new
        if not packed.system.varies:
            return None
        unseen(packed.system.waves, first, last, self.old.factor, new.factor, self._gap)
        return self.push(new, self._gap) if self._gap.any() else None

    def push(self, phase: StepEnd, change: NDArray) -> NDArray:
        """Force (n, 3), N, due to a change (h,) of the factors at a step end; overwrites `out`."""
        s = self.scratch
        for moved, force in ((change, self._pushed), (np.zeros_like(change), self.out)):
            s.factor[:], s.time[0] = phase.factor, 0.0  # as if they had been evaluated at time 0
            s.factor[:, 0] += moved
            accelerate(self.equation.handle, phase.q, phase.w, 0.0, self.earlier)
            force[:] = s.force
        s.time[0] = np.nan
        self._pushed -= self.out
        return self._pushed

    def predict(self, h: float) -> None:
        """Predict the shift by extrapolating the mean velocities of the last steps.

        If steps do not resolve a vibration, end velocities oscillate, but mean velocities do not.
        """
        ahead = 0.5 * (h + self._last)
        self.shift[:] = h * (self._speed + ahead * self._growth)

    def numbers(self) -> list[NDArray]:
        """Numbers that the next step depends on, without case and time; q, w and a come first."""
        old = self.old
        return [
            array.copy()
            for array in (old.q, old.w, old.a, self._speed, self._growth, np.array([self._last]))
        ]

    def resume(self, numbers: Sequence[NDArray]) -> None:
        """Resume from the values of `numbers`, after `begin` at their displacement and velocity."""
        own = (self.old.q, self.old.w, self.old.a, self._speed, self._growth)
        for array, kept in zip(own, numbers, strict=False):
            array[:] = kept
        self._last = float(numbers[len(own)][0])

    def origin(self) -> tuple[NDArray, ...]:
        """Arguments for `back`: the state in which `tangent` makes the matrix after `residual`."""
        own, memory = self, self.packed.body.find(HingeMemory)
        kept = () if memory is None else memory.snapshot()
        start = (*own.old[:3], own.old.factor)
        arrays = (*start, own.shift, own.new.factor, own.state.angle)
        return tuple(array.copy() for array in (*arrays, *kept))

    def back(self, h: float, origin: Sequence[NDArray]) -> None:
        """Return to the state where the matrix of a step h (s) was made; then call `resume`."""
        q, w, a, factor, shift, ahead, angle, *kept = origin
        old, memory, s = self.old, self.packed.body.find(HingeMemory), self.scratch
        if memory is not None:
            memory.recall(kept)
        old.q[:], old.factor[:], self.shift[:], self.state.angle[:] = q, factor, shift, angle
        old.w[:], old.a[:] = w, a  # for damping that depends on the velocity
        s.factor[:], s.time[0] = ahead, 0.0  # as if they had been evaluated at time 0
        self.residual(h, 0.0)
        s.time[0] = np.nan

    def accept(self, h: float) -> None:
        """Accept a step h (s): its end becomes the start of the next one."""
        speed = self.shift / h
        self._growth[:] = (speed - self._speed) / (0.5 * (h + self._last))
        self._speed[:], self._last = speed, h
        for old, new in zip(self.old, self.new, strict=True):
            old[:] = new
        self.folds[:] = self.part.fold_angle


@inner_scalar
def copy(source, out):
    """out = source, of equal size; Numba's own size check would have to compile a message."""
    values, given = flat(out), flat(source)
    for i in range(values.size):
        values[i] = given[i]


@inner
def norms(system, force, inertia, factor, following):
    """Norms of a residual (n, 3) on the free dofs, and of the forces at play, N.

    Sets the residual to zero at supports, where it is a reaction, and at slaves of constraints,
    which pass their residual on to their masters.

    inertia : sum of the squared inertial forces, N2.
    factor : (h, 3) factors of the histories, for the loads.
    following : displacement-dependent loads (n, 3), N; (0, 3) if there are none.
    """
    values, reactions, pushed, left = flat(force), 0.0, 0.0, 0.0
    for k in range(system.supported.size):
        dof = system.supported[k]
        reactions += values[dof] * values[dof]
        values[dof] = 0.0
    ties = system.ties
    if ties.slave.size > 0:
        for k in range(ties.slave.size):
            reactions += values[ties.slave[k]] * values[ties.slave[k]]
        hand_over(ties, values)
    loads = system.loads
    for k in range(loads.dof.size):
        load = loads.value[k] * factor[loads.row[k], 0]
        pushed += load * load
    for load in flat(following):
        pushed += load * load
    for i in range(values.size):
        left += values[i] * values[i]
    return np.sqrt(left), np.sqrt(max(inertia, reactions, pushed))


@inner
def settle_massless(step, h):
    """Set velocities and accelerations of massless nodes, and of slaves, at the end of a step."""
    mass, ties, d = step.case.mass, step.case.system.ties, flat(step.shift)
    w1, a1 = flat(step.new.w), flat(step.new.a)
    for node in range(mass.diagonal.size):
        if mass.diagonal[node] <= 0.0:  # otherwise velocities would ring forever
            for i in range(3 * node, 3 * node + 3):
                a1[i], w1[i] = 0.0, d[i] / h
    if ties.slave.size > 0:  # masters may be massless nodes
        follow_masters(ties, a1)
        follow_masters(ties, w1)


@kernel
def step_works(step, h, before, after):
    """Work (J) put in by loads and supports in a step, and energy (J) lost to the drag.

    before, after : brackets of forces (n, 3), N; their mean acts on moving supports.

    Leaves the displacement in the step in `Scratch.displacement`.
    """
    system, s, old, new = step.case.system, step.case.s, step.old, step.new
    loads, moved, du, speed = system.loads, system.moved, flat(s.displacement), flat(s.velocity)
    for i in range(du.size):
        du[i] = flat(step.shift)[i]
        speed[i] = 0.5 * (flat(old.w)[i] + flat(new.w)[i])
    done = lost = 0.0
    if system.alpha > 0.0:
        done = moving_energy(system.moved_mass, old.factor)
        done = (done + moving_energy(system.moved_mass, new.factor)) * (system.alpha * h)
        kinetic = kinetic_energy(step.case.mass, s.velocity, (0, s.velocity.shape[0]))
        lost = 2.0 * system.alpha * h * kinetic + done
    for k in range(moved.dof.size):
        dof, row = moved.dof[k], moved.row[k]
        along = moved.value[k] * (new.factor[row, 0] - old.factor[row, 0])
        du[dof] += along
        done += 0.5 * (flat(before)[dof] + flat(after)[dof]) * along
    for k in range(loads.dof.size):
        row = loads.row[k]
        mean = 0.5 * (old.factor[row, 0] + new.factor[row, 0])
        done += loads.value[k] * mean * du[loads.dof[k]]
    one, other = flat(old.pushed), flat(new.pushed)
    for i in range(one.size):
        done += 0.5 * (one[i] + other[i]) * du[i]
    return done, lost
