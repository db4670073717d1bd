"""Accelerations when slow contacts have inertia; see `mechanics.contact.inertia`.

(M + sum g g' / e) a = F is solved for the contact forces y by conjugate gradients,

    (e + G M^-1 G') y = G (a0 + alpha w),    a = a0 - M^-1 G' y,

with a0 the accelerations without this inertia, including the drag -alpha w, and g the rows of G.
The drag acts on this inertia as on all mass; otherwise its vibrations would never decay.
"""

from __future__ import annotations

from foldyn.jit.compiled import inlined, inner
from foldyn.jit.context import run_at
from foldyn.jit.intrinsics import flat

ACCURATE = 1e-10  # of the contact accelerations
ITERATIONS = 200


@inner
def _pushed(m, y, out):
    """out = M^-1 G' y (n, 3), via the nodal forces."""
    added, r = m.added, m.case.s.force
    for i in range(len(r)):
        for c in range(3):
            r[i, c] = 0.0
    for k in range(added.count[0]):
        for i in range(4):
            for c in range(3):
                r[added.nodes[k, i], c] += added.gradient[k, i, c] * y[k]
    if m.case.solve != 0:
        run_at(m.case.solve, (m.case, out))
    else:
        values, given, inverse = flat(out), flat(r), flat(m.case.mass.inverse)
        for i in range(values.size):
            values[i] = inverse[i] * given[i]


@inner
def _along(added, k, a):
    """Acceleration of contact k for nodal accelerations (n, 3)."""
    total = 0.0
    for i in range(4):
        for c in range(3):
            total += added.gradient[k, i, c] * a[added.nodes[k, i], c]
    return total


@inlined
def slow_down(m, w, a):
    """Modify accelerations a (n, 3) at velocities w for the inertia of slow contacts.

    m : see `explicit_contact.SlowContacts`.
    """
    added, alpha, out = m.added, m.case.system.alpha, m.case.s.stage[0]
    size = added.count[0]
    if size == 0:
        return
    ease, lightness = added.ease, added.lightness
    y, left, p, q = added.lines[0], added.lines[1], added.lines[2], added.lines[3]
    before = 0.0
    for k in range(size):
        y[k], left[k] = 0.0, _along(added, k, a) + alpha * _along(added, k, w)
        p[k] = left[k] / (ease[k] + lightness[k])
        before += left[k] * p[k]
    goal = before * ACCURATE * ACCURATE
    for _ in range(ITERATIONS):
        if not before > goal:
            break
        _pushed(m, p, out)
        along, now = 0.0, 0.0
        for k in range(size):
            q[k] = ease[k] * p[k] + _along(added, k, out)
            along += p[k] * q[k]
        for k in range(size):
            y[k] += before / along * p[k]
            left[k] -= before / along * q[k]
            now += left[k] * left[k] / (ease[k] + lightness[k])
        for k in range(size):
            p[k] = left[k] / (ease[k] + lightness[k]) + now / before * p[k]
        before = now
    _pushed(m, y, out)
    for i in range(len(a)):
        for c in range(3):
            a[i, c] -= out[i, c]
