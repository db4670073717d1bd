"""The Runge-Kutta pair of order 5(4) of Dormand and Prince, with error control and dense output.

Coefficients: Dormand and Prince, J. Comput. Appl. Math. 6, 1980. Interpolant of order 4: Shampine,
Math. Comput. 46, 1986. Step control: Hairer, Norsett and Wanner, Solving Ordinary Differential
Equations I, section II.4 (the proportional and integral control of Gustafsson). The last stage of a
step is the first stage of the next step: six force evaluations per step.
"""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.equation import (
    acceleration,
    advance_clock,
    sample,
    spent,
    step_error,
    work_of_offsets,
)
from foldyn.dynamics.explicit_contact import (
    gather_slow,
    longest_step,
    slow_contacts_down,
    slow_energy,
)
from foldyn.dynamics.motion_state import Outcome, passed_through
from foldyn.dynamics.stability import roots
from foldyn.jit.compiled import inner, kernel
from foldyn.jit.context import run_at
from foldyn.jit.intrinsics import borrowed, flat
from foldyn.mechanics.contact.step_limit import Pace

ORDER = 5

C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
# weights of the solution of order 5 minus those of order 4
E = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
# column j: the weights of theta^(j+1) at the fraction theta of a step
P = np.array(
    [
        [1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
        [0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
        [0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
        [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
        [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
    ]
)
SMALLEST = 1e-13  # smallest step relative to the end time of the motion
RESOLVED = 0.6  # radians of a contact's vibration per step; error control does the rest
EASED = 0.1  # energy of unresolved slow contacts, relative to tolerance times kinetic energy
ROUNDING = 1e-9  # how far a sample may lie beyond the end of a step, relative to the step


def growth(omega, damping, dt):
    """Largest factor by which a step of dt multiplies a free vibration, per frequency.

    The factor is the exponential series to the fifth power, plus z^6 / 600.
    """
    z = roots(omega, damping) * dt
    series = 1 / 2 + z * (1 / 6 + z * (1 / 24 + z * (1 / 120 + z / 600)))
    return np.abs(1.0 + z * (1.0 + z * series)).max(axis=0)


@inner
def _combine(base, slopes, weights, h, count, out):
    """out = base + h sum of weights times the first `count` slopes; arrays (., n), weights (.,)."""
    for i in range(base.size):
        total = 0.0
        for j in range(count):
            total += weights[j] * slopes[j, i]
        out[i] = base[i] + h * total


@inner
def _integral(start, slopes, h, weights, count):
    """Return start + h times the sum of weights times the first `count` slopes."""
    for j in range(count):
        start += h * weights[j] * slopes[j]
    return start


@inner
def _keep(found, powers, stage):
    """Store the powers that `acceleration` has computed for a stage."""
    powers[0, stage], powers[1, stage], powers[2, stage] = found


@inner
def _largest(values):
    out = 0.0
    for i in range(values.size):
        out = max(out, abs(values[i]))
    return out


@inner
def _error(slopes, h):
    """Largest entry of h times the sum of E times slopes (7, n); nan if any entry is nan."""
    out, wrong = 0.0, 0
    for i in range(slopes.shape[1]):
        total = 0.0
        for j in range(7):
            total += E[j] * slopes[j, i]
        wrong += not abs(total) < np.inf
        out = max(out, abs(total))
    return np.nan if wrong > 0 else h * out


@inner
def _weights(theta, out):
    """Weights (7,) of the slopes in the change up to the fraction theta of a step, per step."""
    for j in range(7):
        p = P[j]
        out[j] = theta * (p[0] + theta * (p[1] + theta * (p[2] + theta * p[3])))


@inner
def _longest(handle, q, w, a, plan, tally):
    """Longest step that contact allows; slow contacts that can get inertia may stay unresolved."""
    tally.kinetic = max(tally.kinetic, slow_energy(handle, w))
    pace = Pace(RESOLVED, EASED * plan.tolerance * tally.kinetic)
    return longest_step(handle, q, w, a, plan.dt, pace)


@kernel
def advance(handle, state, plan, room, stretch):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    The error of a step is the error of the worst node, relative to the largest displacement and the
    largest velocity that the motion has had so far. Steps end at the stops of the plan, where loads
    may jump.
    """
    state = borrowed(state)
    tally, n = state.tally, state.u.size
    u, v = flat(state.u), flat(state.v)
    speeds, accelerations = np.empty((7, n)), np.empty((7, n))
    powers, weights = np.empty((3, 7)), np.empty(7)
    ut, vt, a = np.empty_like(state.u), np.empty_like(state.u), np.empty_like(state.u)
    fut, fvt, fa = flat(ut), flat(vt), flat(a)
    raw = flat(state.carry)  # acceleration at the step's start, without inertia of contacts
    if tally.steps == 0:
        _keep(acceleration(handle, state.u, state.v, plan.start, a), powers, 0)
        for i in range(n):
            raw[i] = fa[i]
        longest = _longest(handle, state.u, state.v, a, plan, tally)
        tally.wanted = min(tally.wanted, longest)
        if tally.samples == 0:
            tally.farthest, tally.fastest = _largest(u), _largest(v)
            outcome = sample(handle, state.u, state.v, a, plan.start)
            if outcome != Outcome.DONE:
                return outcome, -1
    else:
        powers[0, 0], powers[1, 0] = tally.power_in, tally.power_out
        powers[2, 0] = tally.power_air
    for i in range(n):
        speeds[0, i] = v[i]
    last, stop = tally.steps + stretch, 0
    while tally.steps < last and tally.time < plan.end:
        if plan.every > 0 and tally.samples == room:
            break
        t, wanted = tally.time, tally.wanted
        while stop < plan.stops.size and plan.stops[stop] <= t:
            stop += 1
        stops = stop < plan.stops.size
        goal = plan.stops[stop] if stops else plan.end
        h = min(wanted, goal - t)
        if t + 1.01 * h >= goal:  # avoid a tiny last step
            h = goal - t
        stops = stops and h == goal - t
        if h < SMALLEST * max(abs(plan.end), abs(t)):
            return Outcome.STUCK, -1
        gather_slow(handle, state.u, h, RESOLVED)
        for i in range(n):
            accelerations[0, i] = raw[i]
        slow_contacts_down(handle, state.v, accelerations[0])
        for stage in range(1, 7):
            _combine(u, speeds, A[stage], h, stage, fut)
            _combine(v, accelerations, A[stage], h, stage, fvt)
            moment = t + C[stage] * h
            if stops and C[stage] == 1.0:  # just before a jump
                moment = np.nextafter(goal, -np.inf)
            advance_clock(handle, C[stage] * h)
            _keep(acceleration(handle, ut, vt, moment, a), powers, stage)
            for i in range(n):
                speeds[stage, i], accelerations[stage, i] = fvt[i], fa[i]
            slow_contacts_down(handle, vt, accelerations[stage])
        tally.evaluations += 6
        scale_u = max(tally.farthest, _largest(fut), plan.floor) * plan.tolerance
        scale_v = max(tally.fastest, _largest(fvt), plan.floor / plan.dt) * plan.tolerance
        error_u, error_v = _error(speeds, h), _error(accelerations, h)
        error = step_error(handle, scale_u / plan.tolerance) / plan.tolerance
        if error_u > 0.0 or error_v > 0.0:
            error = max(error, error_u / scale_u, error_v / scale_v)
        if not abs(error) < np.inf:  # diverged: try a shorter step
            tally.wanted = 0.2 * h
            tally.refused += 1
            if tally.wanted < SMALLEST * max(abs(plan.end), abs(t)):
                return Outcome.NOT_FINITE, -1
            continue
        factor = 5.0 if error == 0.0 else 0.9 * error**-0.17 * tally.error**0.04
        if error > 1.0:
            tally.wanted = h * max(0.2, min(factor, 0.9))
            tally.refused += 1
            continue
        hinge = passed_through(handle.angle, state.angle, 0, handle.angle.size)
        if hinge >= 0:
            return Outcome.PENETRATION, hinge
        longest = _longest(handle, ut, vt, accelerations[6], plan, tally)
        for i in range(n):
            raw[i] = fa[i]
        after = goal if h == goal - t else t + h
        tally.steps += 1
        tally.shortest, tally.longest = min(tally.shortest, h), max(tally.longest, h)
        due = plan.start + tally.samples * plan.interval
        done, first = work_of_offsets(handle, True), tally.samples
        begun = tally.work + done, tally.dissipated, tally.air
        near = after - ROUNDING * h if stops else after + ROUNDING * h  # just after a jump
        while plan.every == 0 and tally.samples < room and due <= near:
            _weights(min(1.0, (due - t) / h), weights)
            _combine(u, speeds, weights, h, 7, fut)
            _combine(v, accelerations, weights, h, 7, fvt)
            tally.work = _integral(begun[0], powers[0], h, weights, 7)
            tally.dissipated = _integral(begun[1], powers[1], h, weights, 7)
            tally.air = _integral(begun[2], powers[2], h, weights, 7)
            advance_clock(handle, min(due - t, h))
            acceleration(handle, ut, vt, due, a)
            tally.evaluations += 1
            tally.work += work_of_offsets(handle, False)
            outcome = sample(handle, ut, vt, a, due)
            if outcome != Outcome.DONE:
                return outcome, -1
            due = plan.start + tally.samples * plan.interval
        tally.work = _integral(begun[0], powers[0], h, A[6], 6)
        tally.dissipated = _integral(begun[1], powers[1], h, A[6], 6)
        tally.air = _integral(begun[2], powers[2], h, A[6], 6)
        _combine(u, speeds, A[6], h, 6, fut)
        for i in range(n):
            u[i], v[i] = fut[i], speeds[6, i]
            speeds[0, i] = speeds[6, i]
        jumps = stops and handle.spent != 0
        # samples have evaluated the terms before the step's end
        if tally.samples > first and (handle.commit != 0 or jumps):
            advance_clock(handle, h)
            acceleration(handle, state.u, state.v, moment, a)
            tally.evaluations += 1
        if handle.commit != 0:
            run_at(handle.commit, (handle.case,))
        for k in range(3):
            powers[k, 0] = powers[k, 6]
        tally.time, tally.error = after, max(error, 1e-4)
        tally.farthest, tally.fastest = scale_u / plan.tolerance, scale_v / plan.tolerance
        tally.wanted = min(plan.dt, h * max(0.2, min(factor, 5.0)))
        if stops:
            tally.wanted = max(tally.wanted, min(wanted, plan.dt))
            tally.work -= spent(handle, state.u)
            _keep(acceleration(handle, state.u, state.v, after, a), powers, 0)
            tally.evaluations += 1
            tally.work += spent(handle, state.u)  # work of offsets that jumped, for any law
            work_of_offsets(handle, True)
            for i in range(n):
                raw[i] = fa[i]
            if plan.every == 0 and tally.samples < room and due <= after + ROUNDING * h:
                outcome = sample(handle, state.u, state.v, a, due)
                if outcome != Outcome.DONE:
                    return outcome, -1
            if handle.commit != 0:  # a jump takes no time
                run_at(handle.commit, (handle.case,))
        tally.wanted = min(tally.wanted, longest)
        if plan.every > 0 and tally.steps % plan.every == 0:
            acceleration(handle, state.u, state.v, after, a)
            tally.evaluations += 1
            outcome = sample(handle, state.u, state.v, a, after)
            if outcome != Outcome.DONE:
                return outcome, -1
    tally.power_in, tally.power_out, tally.power_air = powers[0, 0], powers[1, 0], powers[2, 0]
    full = plan.every > 0 and tally.samples == room and tally.time < plan.end
    return (Outcome.FULL if full else Outcome.DONE), -1
