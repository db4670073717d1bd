"""The classic Runge-Kutta method of order 4, as the paper uses it, in one compiled loop."""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.outcome import DONE, NOT_FINITE, PENETRATION
from foldyn.dynamics.stability import roots
from foldyn.dynamics.system import acceleration, passed_through, record
from foldyn.materials.compiled import kernel

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
    n = u.shape[0]
    ut, vt = np.empty_like(u), np.empty_like(u)
    du, dv, a = np.empty_like(u), np.empty_like(u), np.empty_like(u)
    offset = (first + every - 1) // every
    for step in range(first, last + 1):
        f = factors[step - first]
        power_in, power_out = acceleration(model, system, mass, u, v, f[0], a, work, s)
        hinge = passed_through(work.angle, angle)
        if hinge >= 0:
            return PENETRATION, step, hinge
        if step % every == 0:
            k = step // every - offset
            record(
                model, system, mass, u, v, a, s,
                displacement[k], velocity[k], reaction[k], energy[k],
            )  # fmt: skip
            energy[k, 4], energy[k, 5] = tally[1], tally[0]
            if not np.isfinite(energy[k].sum()):
                return NOT_FINITE, step, -1
        if step == last:
            break
        work_in, work_out = power_in, power_out
        for i in range(n):
            for c in range(3):
                du[i, c], dv[i, c] = v[i, c], a[i, c]
                ut[i, c] = u[i, c] + 0.5 * dt * v[i, c]
                vt[i, c] = v[i, c] + 0.5 * dt * a[i, c]
        for stage in range(1, 4):
            column = 1 if stage < 3 else 2
            power_in, power_out = acceleration(model, system, mass, ut, vt, f[column], a, work, s)
            weight = 2.0 if stage < 3 else 1.0
            work_in += weight * power_in
            work_out += weight * power_out
            ahead = 0.5 * dt if stage == 1 else dt
            for i in range(n):
                for c in range(3):
                    du[i, c] += weight * vt[i, c]
                    dv[i, c] += weight * a[i, c]
                    ut[i, c] = u[i, c] + ahead * vt[i, c]
                    vt[i, c] = v[i, c] + ahead * a[i, c]
        total = 0.0
        for i in range(n):
            for c in range(3):
                u[i, c] += dt / 6.0 * du[i, c]
                v[i, c] += dt / 6.0 * dv[i, c]
                total += v[i, c]
        tally[0] += dt / 6.0 * work_in
        tally[1] += dt / 6.0 * work_out
        if not np.isfinite(total):
            return NOT_FINITE, step + 1, -1
    return DONE, last, -1
