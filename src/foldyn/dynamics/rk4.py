"""The classic Runge-Kutta method of order 4, as the paper uses it, in one compiled loop."""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.outcome import DONE, NOT_FINITE
from foldyn.dynamics.stability import roots
from foldyn.dynamics.system import acceleration, observe
from foldyn.materials.compiled import kernel
from foldyn.mechanics.flat import flat

ORDER = 4
# abscissas of the stages; the loop needs each history's factors at these
STAGES = np.array([0.0, 0.5, 1.0])


def growth(omega, damping, dt):
    """Factor by which a step of dt multiplies a free vibration, at most, per frequency.

    |R(s dt)| over both roots of s^2 + damping s + omega^2 = 0, R the exponential series to the
    fourth power.
    """
    z = roots(omega, damping) * dt
    return np.abs(1.0 + z * (1.0 + z * (1.0 / 2.0 + z * (1.0 / 6.0 + z / 24.0)))).max(axis=0)


@kernel
def advance(
    model, system, mass, u, v, carry, tally, dt, first, last, every, factors, angle,
    displacement, velocity, reaction, energy, work, s,
):  # fmt: skip
    """Advance u, v (n, 3) from step `first` to step `last`, in place.

    Every `every` steps, counted from step 0, a sample goes to row step / every - ceil(first /
    every) of the output arrays. tally holds the work of the loads and the energy dissipated (J),
    integrated with the method's own weights. factors is (last - first + 1, 3 stages, histories);
    angle (nh,) the dihedrals at the last step seen, compared to find panels that passed through
    each other. carry (n, 3) is for methods that keep an acceleration. Returns (outcome, step,
    hinge).
    """
    n = u.size
    ut, vt = np.empty_like(u), np.empty_like(u)
    du, dv, a = np.empty_like(u), np.empty_like(u), np.empty_like(u)
    fu, fv, fut, fvt = flat(u), flat(v), flat(ut), flat(vt)
    fdu, fdv, fa = flat(du), flat(dv), flat(a)
    offset = (first + every - 1) // every
    for i in range(n):
        fut[i], fvt[i] = fu[i], fv[i]
    for step in range(first, last + 1):
        f = factors[step - first]
        work_in, work_out, wrong = 0.0, 0.0, 0
        for stage in range(4):
            column = (stage + 1) // 2
            power_in, power_out = acceleration(model, system, mass, ut, vt, f[column], a, work, s)
            weight = 2.0 if 0 < stage < 3 else 1.0
            work_in += weight * power_in
            work_out += weight * power_out
            ahead = 0.5 * dt if stage < 2 else dt
            if stage == 0:
                found, hinge = observe(
                    model, system, mass, u, v, a, tally, step, every, offset, angle,
                    displacement, velocity, reaction, energy, work, s,
                )  # fmt: skip
                if found != DONE:
                    return found, step, hinge
                if step == last:
                    return DONE, last, -1
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
        if wrong > 0:
            return NOT_FINITE, step + 1, -1
    return DONE, last, -1
