"""The classic Runge-Kutta method of order 4, as the paper uses it, in one compiled loop."""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.course import observe
from foldyn.dynamics.outcome import DONE, NOT_FINITE
from foldyn.dynamics.stability import roots
from foldyn.dynamics.system import acceleration
from foldyn.materials.compiled import kernel
from foldyn.mechanics.borrow import borrowed
from foldyn.mechanics.flat import flat

ORDER = 4


def growth(omega, damping, dt):
    """Factor by which a step of dt multiplies a free vibration, at most, per frequency.

    |R(s dt)| over both roots of s^2 + damping s + omega^2 = 0, R the exponential series to the
    fourth power.
    """
    z = roots(omega, damping) * dt
    return np.abs(1.0 + z * (1.0 + z * (1.0 / 2.0 + z * (1.0 / 6.0 + z / 24.0)))).max(axis=0)


@kernel
def advance(model, system, mass, course, plan, out, work, s, stretch):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    Work and dissipated energy are integrated with the method's own weights.
    """
    model, system, mass, work = borrowed(model), borrowed(system), borrowed(mass), borrowed(work)
    course, out, s = borrowed(course), borrowed(out), borrowed(s)
    u, v, dt = course.u, course.v, plan.dt
    count, tally, angle, angle_now = course.count, course.tally, course.angle, work.angle
    n = u.size
    ut, vt = np.empty_like(u), np.empty_like(u)
    du, dv, a = np.empty_like(u), np.empty_like(u), np.empty_like(u)
    fu, fv, fut, fvt = flat(u), flat(v), flat(ut), flat(vt)
    fdu, fdv, fa = flat(du), flat(dv), flat(a)
    for i in range(n):
        fut[i], fvt[i] = fu[i], fv[i]
    begun = count[0]
    for step in range(begun, min(begun + stretch, plan.steps) + 1):
        now = plan.start + step * dt
        count[0] = step
        work_in, work_out, wrong = 0.0, 0.0, 0
        for stage in range(4):
            t = now + 0.5 * ((stage + 1) // 2) * dt
            power_in, power_out = acceleration(model, system, mass, ut, vt, t, a, work, s)
            weight = 2.0 if 0 < stage < 3 else 1.0
            work_in += weight * power_in
            work_out += weight * power_out
            ahead = 0.5 * dt if stage < 2 else dt
            if stage == 0:
                found, hinge = observe(
                    model, system, mass, course, a, now, count, plan.every, angle_now, angle, out, s
                )
                if found != DONE or step == begun + stretch or step == plan.steps:
                    course.clock[0] = now
                    return found, hinge
                for i in range(n):
                    fdu[i], fdv[i] = fvt[i], fa[i]
                    fut[i] = fu[i] + ahead * fvt[i]
                    fvt[i] = fv[i] + ahead * fa[i]
            elif stage < 3:
                for i in range(n):
                    fdu[i] += 2.0 * fvt[i]
                    fdv[i] += 2.0 * fa[i]
                    fut[i] = fu[i] + ahead * fvt[i]
                    fvt[i] = fv[i] + ahead * fa[i]
            else:
                for i in range(n):
                    fu[i] += dt / 6.0 * (fdu[i] + fvt[i])
                    fv[i] += dt / 6.0 * (fdv[i] + fa[i])
                    fut[i], fvt[i] = fu[i], fv[i]
                    wrong += not abs(fv[i]) < np.inf
        tally[0] += dt / 6.0 * work_in
        tally[1] += dt / 6.0 * work_out
        count[3] += 4
        if wrong > 0:
            course.clock[0] = now + dt
            return NOT_FINITE, -1
    return DONE, -1
