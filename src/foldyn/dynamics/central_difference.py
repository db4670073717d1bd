"""Central differences as kick, drift, kick (velocity Verlet): one force evaluation per step.

Without damping the method is symplectic: the energy of a free motion stays bounded, and linear
and angular momentum are conserved to rounding. Damping forces use the velocity extrapolated to the
end of the step, v + dt a, which keeps order 2 without an equation to solve.
"""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.equation import acceleration, advance_clock, observe
from foldyn.dynamics.explicit_contact import longest_step
from foldyn.dynamics.motion_state import Outcome, post_totals, split_step
from foldyn.jit.compiled import shared
from foldyn.jit.intrinsics import borrowed, flat
from foldyn.mechanics.contact.step_limit import RESOLVED

ORDER = 2
NEWTON = 4  # iterations; few suffice, as c is small
ROUNDING = 1e-15


def growth(omega, damping, dt):
    """Largest factor by which a step of dt multiplies a free vibration, per frequency.

    With u' = u + v + a/2, a' = -w^2 u' - c (v + a) and v' = v + (a + a')/2, in units of the step,
    the factors are the roots of z^3 + p z^2 + q z + c/2. The root near -c/2 is found by Newton's
    method, the other two are the roots of a quadratic.
    """
    w, c = np.broadcast_arrays(omega * dt, damping * dt)
    p, q = w**2 - 2.0 + 1.5 * c, 1.0 - 2.0 * c
    z = np.zeros_like(w)
    with np.errstate(all="ignore"):
        for _ in range(NEWTON):
            value = ((z + p) * z + q) * z + 0.5 * c
            z = z - value / ((3.0 * z + 2.0 * p) * z + q)
        found = np.abs(((z + p) * z + q) * z + 0.5 * c) <= ROUNDING * (1.0 + np.abs(z)) ** 3
    half, product = 0.5 * (p + z), q + z * (p + z)
    apart = half**2 - product
    pair = np.sqrt(np.abs(product))
    pair = np.where(apart < 0.0, pair, np.abs(half) + np.sqrt(np.maximum(apart, 0.0)))
    out = np.maximum(np.abs(z), pair)
    if not found.all():  # damping is so strong that roots merge
        p, q, d = (each[~found] for each in (p, q, 0.5 * c))
        zero, one = np.zeros_like(p), np.ones_like(p)
        step = np.array([[-p, -q, -d], [one, zero, zero], [zero, one, zero]])
        out[~found] = np.abs(np.linalg.eigvals(np.moveaxis(step, -1, 0))).max(axis=-1)
    return out


@shared
def advance(handle, state, plan, room, stretch):
    """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge).

    `state.carry` is the acceleration, kept from step to step and from stretch to stretch; the tally
    keeps powers and energies. Each thread of a team advances its own nodes.
    """
    state = borrowed(state)
    team, stage, a, powers = handle.team, handle.stage, state.carry, handle.before
    low, high = 3 * handle.own[0], 3 * handle.own[1]
    u, v = flat(state.u)[low:high], flat(state.v)[low:high]
    fa, ahead = flat(a)[low:high], flat(stage[0])[low:high]
    begun = state.tally.steps
    end = min(begun + stretch, plan.steps)
    post_totals(team, 0.0, 0.0, 0.0, 0)
    for step in range(begun + 1 if begun > 0 else 0, end + 1):  # step 0 only records the start
        work_in, work_out, work_air, wrong = 0.0, 0.0, 0.0, 0
        span = plan.dt if step > 0 else 0.0
        left = span
        while True:  # one pass, unless contact needs shorter steps
            dt = 0.0
            if step > 0:
                dt = longest_step(handle, state.u, state.v, a, left, RESOLVED)
                dt = split_step(dt, left)
            for i in range(u.size):
                v[i] += 0.5 * dt * fa[i]
                u[i] += dt * v[i]
                ahead[i] = v[i] + 0.5 * dt * fa[i]
            left = 0.0 if dt == left else left - dt
            now = plan.start + step * plan.dt - left
            advance_clock(handle, span - left)
            new = acceleration(handle, state.u, stage[0], now, a)
            for i in range(u.size):
                v[i] += 0.5 * dt * fa[i]  # the kick that ends the step
                wrong += not abs(v[i]) < np.inf
            work_in += 0.5 * dt * (powers[0] + new[0])
            work_out += 0.5 * dt * (powers[1] + new[1])
            work_air += 0.5 * dt * (powers[2] + new[2])
            powers[0], powers[1], powers[2] = new
            if team.number == 0 and step > 0:
                state.tally.evaluations += 1
            if left == 0.0 or wrong > 0:
                break
        post_totals(team, work_in, work_out, work_air, wrong)
        outcome, hinge = observe(handle, state, plan, a, step)
        if outcome != Outcome.DONE:
            return outcome, hinge
    return Outcome.DONE, -1
