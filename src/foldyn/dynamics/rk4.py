"""The classic Runge-Kutta method of order 4, as the paper uses it, in one compiled loop."""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.equation import acceleration, advance_clock, observe
from foldyn.dynamics.explicit_contact import longest_step
from foldyn.dynamics.motion_state import Outcome, post_totals, split_step
from foldyn.dynamics.stability import roots
from foldyn.jit.compiled import shared
from foldyn.jit.intrinsics import borrowed, flat
from foldyn.mechanics.contact.step_limit import RESOLVED

ORDER = 4


def growth(omega, damping, dt):
    """Factor by which a step of dt multiplies a free vibration, at most, per frequency.

    |R(s dt)| over both roots of s^2 + damping s + omega^2 = 0, R the exponential series to the
    fourth power.
    """
    z = roots(omega, damping) * dt
    return np.abs(1.0 + z * (1.0 + z * (1.0 / 2.0 + z * (1.0 / 6.0 + z / 24.0)))).max(axis=0)


@shared
def advance(equation, course, plan, room, stretch):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    Work and dissipated energy are integrated with the method's own weights. Each thread of a team
    advances its own nodes.
    """
    course = borrowed(course)
    team, stage = equation.team, equation.stage
    low, high = 3 * equation.own[0], 3 * equation.own[1]
    stage_u, stage_v, a = stage[0], stage[1], stage[2]
    u, v = flat(course.u)[low:high], flat(course.v)[low:high]
    ut, vt, fa = flat(stage_u)[low:high], flat(stage_v)[low:high], flat(a)[low:high]
    du, dv = np.empty_like(u), np.empty_like(v)
    for i in range(u.size):
        ut[i], vt[i] = u[i], v[i]
    begun = course.tally.steps
    end = min(begun + stretch, plan.steps)
    post_totals(team, 0.0, 0.0, 0.0, 0)
    for step in range(begun, end + 1):
        work_in, work_out, work_air, wrong, left = 0.0, 0.0, 0.0, 0, plan.dt
        while left > 0.0:  # once, unless contact asks for shorter steps
            first = left == plan.dt
            now = plan.start + step * plan.dt + (plan.dt - left)
            part_in, part_out, part_air, dt = 0.0, 0.0, 0.0, left
            for stage in range(4):
                since = 0.5 * ((stage + 1) // 2) * dt
                t = now + since
                if stage > 0:
                    advance_clock(equation, plan.dt - left + since)
                power_in, power_out = acceleration(equation, stage_u, stage_v, t, a)
                weight = 2.0 if 0 < stage < 3 else 1.0
                part_in += weight * power_in
                part_out += weight * power_out
                part_air += weight * equation.powers[2]
                if stage == 0:
                    if first:
                        outcome, hinge = observe(equation, course, plan, a, step)
                        if outcome != Outcome.DONE or step == end:
                            return outcome, hinge
                    dt = longest_step(equation, course.u, course.v, a, left, RESOLVED)
                    dt = split_step(dt, left)
                ahead = 0.5 * dt if stage < 2 else dt
                if stage == 0:
                    for i in range(u.size):
                        du[i], dv[i] = vt[i], fa[i]
                        ut[i] = u[i] + ahead * vt[i]
                        vt[i] = v[i] + ahead * fa[i]
                elif stage < 3:
                    for i in range(u.size):
                        du[i] += 2.0 * vt[i]
                        dv[i] += 2.0 * fa[i]
                        ut[i] = u[i] + ahead * vt[i]
                        vt[i] = v[i] + ahead * fa[i]
                else:
                    for i in range(u.size):
                        u[i] += dt / 6.0 * (du[i] + vt[i])
                        v[i] += dt / 6.0 * (dv[i] + fa[i])
                        wrong += not abs(v[i]) < np.inf
                    for i in range(u.size):
                        ut[i], vt[i] = u[i], v[i]
            work_in += dt / 6.0 * part_in
            work_out += dt / 6.0 * part_out
            work_air += dt / 6.0 * part_air
            left = 0.0 if dt == left or wrong > 0 else left - dt
            if team.number == 0:
                course.tally.evaluations += 4
        post_totals(team, work_in, work_out, work_air, wrong)
    return Outcome.DONE, -1
