"""Contact in explicit steps: limits of the step length, and inertia for slow contacts.

These are optional parts of the equation of motion (`equation`), with the address 0 if unused. With
the inertia of slow contacts (`mechanics.contact.inertia`), (M + sum g g' / e) a = F is solved for
the contact forces y by conjugate gradients,

    (e + G M^-1 G') y = G (a0 + alpha w),    a = a0 - M^-1 G' y,

with a0 the accelerations without this inertia, including the drag -alpha w, and g the rows of G.
The drag acts on this inertia as on any mass; otherwise contact vibrations would never decay.
"""

from __future__ import annotations

from typing import NamedTuple

from foldyn.dynamics.parts import ThreadCase, kinetic
from foldyn.dynamics.system import PackedCase
from foldyn.jit.compiled import addressed, inlined, inner, inner_scalar
from foldyn.jit.context import Context, rows_at, run_at, value_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.contact.candidates import Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.inertia import Added, added_inertia, room_for
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.term import ADDRESS, NUMBER, limit_of
from foldyn.mechanics.threads import ThreadPart

ACCURATE = 1e-10  # relative accuracy of the contact accelerations
ITERATIONS = 200


class SlowContacts(NamedTuple):
    """A case on one thread, with the contacts that get inertia in a step."""

    case: ThreadCase
    tables: Tables
    memory: Memory
    added: Added


@addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER, NUMBER, NUMBER)
def _limit(m, q, w, a, dt, beta, energy):
    rows = m.s.force.shape[0]
    u = m.s.displacement if m.system.moves else rows_at(q, rows)
    v = m.s.velocity if m.system.moves else rows_at(w, rows)
    return limit_of(m.terms, u, v, a, dt, beta, energy, m.system.lightness)


@addressed(ADDRESS, NUMBER, NUMBER)
def _gather(m, u, dt, beta):
    moved, system = rows_at(u, m.case.s.force.shape[0]), m.case.system
    added_inertia(m.tables, m.added, moved, dt, beta, system.lightness, m.memory)


@inner
def _pushed(m, y, out):
    """out = M^-1 G' y (n, 3), computed via nodal forces."""
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

    m : a `SlowContacts`.
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


@addressed(ADDRESS, ADDRESS)
def _slow_down(m, w, a):
    rows = m.case.s.force.shape[0]
    slow_down(m, rows_at(w, rows), rows_at(a, rows))


@inner_scalar
def longest_step(handle, q, w, a, dt, pace):
    """Longest step (s), at most dt, that contact and cables allow, after `acceleration` at q and w.

    Call it once at the end of each step, before the next one.

    a : acceleration after the last step; pace : see `contact.step_limit`.
    """
    if handle.limit == 0:
        return dt
    return value_at(handle.limit, (handle.case, q, w, a, dt, pace.resolved, pace.energy))


@inner_scalar
def slow_energy(handle, w):
    """Kinetic energy (J) at velocities w if slow contacts get inertia, otherwise 0."""
    return value_at(handle.slow_kinetic, (handle.case, w)) if handle.slow_kinetic != 0 else 0.0


@inner_scalar
def gather_slow(handle, u, dt, beta):
    """Find the contacts that a step of dt (s) from u does not resolve, for `slow_contacts_down`.

    beta : largest angle (rad) by which a step may advance a contact's vibration.
    """
    if handle.gather != 0:
        run_at(handle.gather, (handle.slow, u, dt, beta))


@inner_scalar
def slow_contacts_down(handle, w, a):
    """Modify accelerations a at velocities w for the inertia of slow contacts."""
    if handle.slow_down != 0:
        run_at(handle.slow_down, (handle.slow, w, a))


def slow_contacts(packed: PackedCase, part: ThreadPart, case: ThreadCase) -> Context | None:
    """Context of slow contacts; None if their inertia would resist supports or planes.

    Boards have no such context either, as their contacts involve more nodes.
    """
    system, body, contact = packed.system, packed.body, packed.body.find(ContactTerm)
    if contact is None or not contact.eased or system.moves or system.presses:
        return None
    tables, memory = contact.tables, body.kept(part, ContactTerm)
    return Context(SlowContacts(case, tables, memory, room_for(tables, memory)))


def contact_parts(case: Context, limited: bool, slow: Context | None) -> dict[str, int]:
    """Fields of a `LoopHandle` for contact.

    case : context of a `ThreadCase`; limited : whether contact limits steps.
    """
    found = {"limit": _limit.at(case)} if limited else {}
    if slow is not None:
        found |= {"gather": _gather.at(slow), "slow_down": _slow_down.at(slow)}
        found |= {"slow_kinetic": kinetic.at(case), "slow": slow.address}
    return found
