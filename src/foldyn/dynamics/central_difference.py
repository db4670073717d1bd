"""Central differences as kick, drift, kick (velocity Verlet): one force evaluation a step.

Without damping the method is symplectic: the energy of a free motion stays bounded, and linear
and angular momentum are kept to rounding. Damping forces take the velocity extrapolated to the
end of the step, v + dt a, which keeps the second order without solving for it.
"""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.course import observe
from foldyn.dynamics.outcome import DONE, NOT_FINITE
from foldyn.dynamics.system import acceleration
from foldyn.materials.compiled import kernel
from foldyn.mechanics.borrow import borrowed
from foldyn.mechanics.flat import flat

ORDER = 2


def growth(omega, damping, dt):
    """Factor by which a step of dt multiplies a free vibration, at most, per frequency.

    Spectral radius of the step as a matrix on (u, v, a).
    """
    w, c = np.broadcast_arrays(omega * dt, damping * dt)
    one, zero = np.ones_like(w), np.zeros_like(w)
    # in units of the step: u' = u + v + a/2, a' = -w^2 u' - c (v + a), v' = v + (a + a')/2
    a_row = [-(w**2), -(w**2) - c, -0.5 * w**2 - c]
    step = np.stack(
        [
            np.stack([one, one, 0.5 * one], -1),
            np.stack([0.5 * a_row[0], one + 0.5 * a_row[1], 0.5 * one + 0.5 * a_row[2]], -1),
            np.stack([*a_row[:2], a_row[2] + zero], -1),
        ],
        -2,
    )
    return np.abs(np.linalg.eigvals(step)).max(axis=-1)


@kernel
def advance(model, system, mass, course, plan, out, work, s, stretch):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    `course.carry` is the acceleration, kept from one step and stretch to the next; the tally keeps
    the powers beside the energies.
    """
    model, system, mass, work = borrowed(model), borrowed(system), borrowed(mass), borrowed(work)
    course, out, s = borrowed(course), borrowed(out), borrowed(s)
    dt, tally, count, a = plan.dt, course.tally, course.count, course.carry
    angle, angle_now = course.angle, work.angle
    ahead = np.empty_like(course.v)
    u, v, fa, fahead = flat(course.u), flat(course.v), flat(a), flat(ahead)
    last = min(count[0] + stretch, plan.steps)
    if count[0] == 0:
        tally[2], tally[3] = acceleration(
            model, system, mass, course.u, course.v, plan.start, a, work, s
        )
        found, hinge = observe(
            model, system, mass, course, a, plan.start, count, plan.every, angle_now, angle, out, s
        )
        if found != DONE:
            return found, hinge
    while count[0] < last:
        for i in range(u.size):
            v[i] += 0.5 * dt * fa[i]
            u[i] += dt * v[i]
            fahead[i] = v[i] + 0.5 * dt * fa[i]
        count[0] += 1
        count[3] += 1
        now = plan.start + count[0] * dt
        course.clock[0] = now
        power_in, power_out = acceleration(model, system, mass, course.u, ahead, now, a, work, s)
        tally[0] += 0.5 * dt * (tally[2] + power_in)
        tally[1] += 0.5 * dt * (tally[3] + power_out)
        tally[2], tally[3] = power_in, power_out
        wrong = 0
        for i in range(u.size):
            v[i] += 0.5 * dt * fa[i]  # the kick that ends the step
            wrong += not abs(v[i]) < np.inf
        if wrong > 0:
            return NOT_FINITE, -1
        found, hinge = observe(
            model, system, mass, course, a, now, count, plan.every, angle_now, angle, out, s
        )
        if found != DONE:
            return found, hinge
    return DONE, -1
