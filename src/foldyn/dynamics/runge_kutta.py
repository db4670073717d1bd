"""Explicit Runge-Kutta methods of fixed step, in one compiled loop for any `Tableau`.

RK4 is the classic method of order 4, which the paper uses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.equation import acceleration, advance_clock, observe
from foldyn.dynamics.explicit_contact import longest_step
from foldyn.dynamics.motion_state import Outcome, post_totals, split_step
from foldyn.dynamics.stability import roots
from foldyn.jit.compiled import inner_scalar, shared
from foldyn.jit.intrinsics import borrowed, flat
from foldyn.mechanics.contact.step_limit import RESOLVED


class Coefficients(NamedTuple):
    """An explicit Runge-Kutta method of s stages, as compiled loops use it."""

    time: NDArray  # (s,) times of the stages, in steps
    ahead: NDArray  # (s, s) weights, for each stage, of the slopes of earlier stages
    mixed: int  # 1 if a stage uses slopes other than the last one, else 0
    weight: NDArray  # (s,) weights of the slopes in the step, times `whole`
    whole: float


class Tableau(NamedTuple):
    """An explicit Runge-Kutta method (J. C. Butcher, Numerical Methods for ODEs, 2016).

    Parameters
    ----------
    name : str
    order : int
        Order of convergence, checked by tests.
    stages : tuple of tuples of float
        For each stage except the first, the weights of the slopes of all earlier stages.
    weights : tuple of float
        Weights of the slopes of all stages in the step, up to a common factor.
    """

    name: str
    order: int
    stages: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]

    @property
    def coefficients(self) -> Coefficients:
        """The tableau as arrays."""
        count = len(self.weights)
        if [*map(len, self.stages)] != [*range(1, count)]:
            raise TypeError(f"{self.name}: stages must have 1, 2, ..., {count - 1} shares")
        ahead = np.zeros((count, count))
        for s, shares in enumerate(self.stages, 1):
            ahead[s, :s] = shares
        mixed = int(np.tril(ahead, -2).any())
        weight = np.array(self.weights, float)
        return Coefficients(ahead.sum(axis=1), ahead, mixed, weight, float(weight.sum()))

    @property
    def looks(self) -> tuple[float, ...]:
        """Fractions of a step, from 0 to 1, at which the method evaluates the loads."""
        return tuple(sorted({0.0, 1.0, *self.coefficients.time.tolist()}))

    def growth(self, omega: NDArray, damping: NDArray, dt: float) -> NDArray:
        """Largest factor by which a step of dt multiplies a free vibration, per frequency.

        The larger |R(s dt)| of the two roots of s^2 + damping s + omega^2 = 0, where R(z) is the
        factor of a step of y' = z y.
        """
        z, own = roots(omega, damping) * dt, self.coefficients
        slopes = np.zeros((len(own.weight), *z.shape), complex)
        for s in range(len(slopes)):
            slopes[s] = 1.0 + z * np.tensordot(own.ahead[s], slopes, 1)
        step = 1.0 + z * np.tensordot(own.weight / own.whole, slopes, 1)
        return np.abs(step).max(axis=0)


RK4 = Tableau("rk4", 4, ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1.0, 2.0, 2.0, 1.0))


@inner_scalar
def _keep_slopes(method, k, dt, vt, fa, others):
    """Add the weighted slopes of stage k to `others` (s, 2, n), for the stages after the next."""
    for later in range(k + 2, others.shape[0]):
        ahead = method.ahead[later, k] * dt
        if ahead != 0.0:
            for i in range(vt.size):
                others[later, 0, i] += ahead * vt[i]
                others[later, 1, i] += ahead * fa[i]


@inner_scalar
def _add_kept(k, others, ut, vt):
    """Add the stored slopes of earlier stages to stage k, and reset them."""
    for i in range(ut.size):
        ut[i] += others[k, 0, i]
        vt[i] += others[k, 1, i]
        others[k, 0, i], others[k, 1, i] = 0.0, 0.0


@inner_scalar
def next_stage(method, k, dt, u, v, ut, vt, fa, du, dv, others):
    """Add the slopes vt, fa of stage k to those of the step, and set ut, vt to stage k + 1.

    `others` is (s, 2, n) or (0, ...); all other arrays have n entries.
    """
    weight, ahead = method.weight[k], method.ahead[k + 1, k] * dt
    if method.mixed > 0:
        _keep_slopes(method, k, dt, vt, fa, others)
    for i in range(u.size):
        du[i] += weight * vt[i]
        dv[i] += weight * fa[i]
        ut[i] = u[i] + ahead * vt[i]
        vt[i] = v[i] + ahead * fa[i]
    if method.mixed > 0:
        _add_kept(k + 1, others, ut, vt)


@shared
def advance(handle, state, plan, room, stretch, method):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    method : a `Coefficients`.

    The weights of the method also integrate work and dissipated energy. Each thread of a team
    advances its own nodes.
    """
    state = borrowed(state)
    team, stage = handle.team, handle.stage
    low, high = 3 * handle.own[0], 3 * handle.own[1]
    stage_u, stage_v, a = stage[0], stage[1], stage[2]
    u, v = flat(state.u)[low:high], flat(state.v)[low:high]
    ut, vt, fa = flat(stage_u)[low:high], flat(stage_v)[low:high], flat(a)[low:high]
    stages = method.weight.size
    du, dv = np.zeros_like(u), np.zeros_like(v)  # slopes of the step, and for other stages
    others = np.zeros((stages * method.mixed, 2, u.size))
    for i in range(u.size):
        ut[i], vt[i] = u[i], v[i]
    begun = state.tally.steps
    end = min(begun + stretch, plan.steps)
    post_totals(team, 0.0, 0.0, 0.0, 0)
    for step in range(begun, end + 1):
        work_in, work_out, work_air, wrong, left = 0.0, 0.0, 0.0, 0, plan.dt
        while left > 0.0:  # one pass, unless contact needs shorter steps
            first = left == plan.dt
            now = plan.start + step * plan.dt + (plan.dt - left)
            part_in, part_out, part_air, dt = 0.0, 0.0, 0.0, left
            for k in range(stages):
                since, weight = method.time[k] * dt, method.weight[k]
                if k > 0:
                    advance_clock(handle, plan.dt - left + since)
                powers = acceleration(handle, stage_u, stage_v, now + since, a)
                part_in += weight * powers[0]
                part_out += weight * powers[1]
                part_air += weight * powers[2]
                if k == 0:
                    if first:
                        outcome, hinge = observe(handle, state, plan, a, step)
                        if outcome != Outcome.DONE or step == end:
                            return outcome, hinge
                    dt = longest_step(handle, state.u, state.v, a, left, RESOLVED)
                    dt = split_step(dt, left)
                if k + 1 < stages:
                    next_stage(method, k, dt, u, v, ut, vt, fa, du, dv, others)
            share = dt / method.whole
            for i in range(u.size):
                u[i] += share * (du[i] + weight * vt[i])
                v[i] += share * (dv[i] + weight * fa[i])
                du[i], dv[i] = 0.0, 0.0
                wrong += not abs(v[i]) < np.inf
            for i in range(u.size):
                ut[i], vt[i] = u[i], v[i]
            work_in += share * part_in
            work_out += share * part_out
            work_air += share * part_air
            left = 0.0 if dt == left or wrong > 0 else left - dt
            if team.number == 0:
                state.tally.evaluations += stages
        post_totals(team, work_in, work_out, work_air, wrong)
    return Outcome.DONE, -1
