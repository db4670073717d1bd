"""Central differences as kick, drift, kick (velocity Verlet): one force evaluation a step.

Without damping the method is symplectic: the energy of a free motion stays bounded, and linear
and angular momentum are kept to rounding. Damping forces take the velocity extrapolated to the
end of the step, v + dt a, which keeps the second order without solving for it.
"""

from __future__ import annotations

import numpy as np

from foldyn.dynamics.outcome import DONE, NOT_FINITE
from foldyn.dynamics.system import acceleration, observe
from foldyn.materials.compiled import kernel

ORDER = 2
STAGES = np.array([0.0])


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
def advance(
    model, system, mass, u, v, carry, tally, dt, first, last, every, factors, angle,
    displacement, velocity, reaction, energy, work, s,
):  # fmt: skip
    """Advance u, v (n, 3) from step `first` to step `last`, in place; see `rk4.advance`.

    carry (n, 3) is the acceleration at step `first`, kept from one stretch to the next; at step
    0 it is computed.
    """
    n = u.shape[0]
    ahead = np.empty_like(u)
    offset = (first + every - 1) // every
    power_in, power_out = tally[2], tally[3]
    for step in range(first, last + 1):
        if step == 0:
            power_in, power_out = acceleration(
                model, system, mass, u, v, factors[0, 0], carry, work, s
            )
        elif step > first:
            before_in, before_out = power_in, power_out
            power_in, power_out = acceleration(
                model, system, mass, u, ahead, factors[step - first, 0], carry, work, s
            )
            tally[0] += 0.5 * dt * (before_in + power_in)
            tally[1] += 0.5 * dt * (before_out + power_out)
            total = 0.0
            for i in range(n):
                for c in range(3):
                    v[i, c] += 0.5 * dt * carry[i, c]  # the kick that ends the step
                    total += v[i, c]
            if not np.isfinite(total):
                return NOT_FINITE, step, -1
        if step == 0 or step > first:  # else the last stretch has done this
            found, hinge = observe(
                model, system, mass, u, v, carry, tally, step, every, offset, angle,
                displacement, velocity, reaction, energy, work, s,
            )  # fmt: skip
            if found != DONE:
                return found, step, hinge
        if step == last:
            break
        for i in range(n):
            for c in range(3):
                v[i, c] += 0.5 * dt * carry[i, c]
                u[i, c] += dt * v[i, c]
                ahead[i, c] = v[i, c] + 0.5 * dt * carry[i, c]
    tally[2], tally[3] = power_in, power_out
    return DONE, last, -1
