"""Contact in explicit steps: limits of their length, and inertia for slow contacts.

Optional parts of the equation of motion (`equation`): their address is 0 if unused.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from foldyn.dynamics.parts import kinetic
from foldyn.dynamics.slow_contacts import slow_down
from foldyn.dynamics.system import Packed, Scratch, System
from foldyn.jit.compiled import addressed, inner_scalar
from foldyn.jit.context import Context, rows_at, run_at, value_at
from foldyn.mechanics.contact.candidates import Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.inertia import Added, added_inertia, room_for
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.term import ADDRESS, NUMBER, limit_of


class SlowContacts(NamedTuple):
    """A case on one thread, and the contacts that get inertia in a step."""

    system: System
    setting: int  # context of the parts of the equation
    solve: int  # M^-1 of that setting, 0 if M is diagonal
    inverse: NDArray
    s: Scratch
    tables: Tables
    memory: Memory
    added: Added


class ContactParts(NamedTuple):
    """Addresses of contact kernels, and the context of slow contacts."""

    limit: int  # 0 without contact
    gather: int  # 0 if slow contacts get no inertia
    slow_down: int
    kinetic: int
    slow: int


@addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER, NUMBER, NUMBER)
def _limit(m, q, w, a, dt, beta, energy):
    rows = m.s.force.shape[0]
    u = m.s.displacement if m.system.moves else rows_at(q, rows)
    v = m.s.velocity if m.system.moves else rows_at(w, rows)
    return limit_of(m.terms, u, v, a, dt, beta, energy, m.system.lightness)


@addressed(ADDRESS, NUMBER, NUMBER)
def _gather(m, u, dt, beta):
    moved = rows_at(u, m.s.force.shape[0])
    added_inertia(m.tables, m.added, moved, dt, beta, m.system.lightness, m.memory)


@addressed(ADDRESS, ADDRESS)
def _slow_down(m, w, a):
    rows = m.s.force.shape[0]
    slow_down(m, rows_at(w, rows), rows_at(a, rows))


@inner_scalar
def longest_step(equation, q, w, a, dt, pace):
    """Longest step (s), at most dt, that contact allows, after `acceleration` at q and w.

    Call it once before each step, at the end of the last one.

    a : the acceleration there; pace : see `contact.step_limit`.
    """
    if equation.contact.limit == 0:
        return dt
    given = (equation.setting, q, w, a, dt, pace.resolved, pace.energy)
    return value_at(equation.contact.limit, given)


@inner_scalar
def slow_energy(equation, w):
    """Kinetic energy (J) at velocities w if slow contacts get inertia, else 0."""
    if equation.contact.kinetic == 0:
        return 0.0
    return value_at(equation.contact.kinetic, (equation.setting, w))


@inner_scalar
def gather_slow(equation, u, dt, beta):
    """Find the contacts that a step of dt (s) from u does not resolve, for `slow_contacts_down`.

    beta : radians of a contact's vibration that a step may take.
    """
    if equation.contact.gather != 0:
        run_at(equation.contact.gather, (equation.contact.slow, u, dt, beta))


@inner_scalar
def slow_contacts_down(equation, w, a):
    """Modify accelerations a at velocities w for the inertia of slow contacts."""
    if equation.contact.slow_down != 0:
        run_at(equation.contact.slow_down, (equation.contact.slow, w, a))


def slow_contacts(packed: Packed, work: Any, s: Scratch, balance: Any) -> Context | None:
    """Context of slow contacts; None if their inertia would resist supports or planes.

    Boards have none either, as their contacts involve more nodes.
    """
    system, body, contact = packed.system, packed.body, packed.body.find(ContactTerm)
    if contact is None or not contact.eased or system.moves or system.presses:
        return None
    tables, memory = contact.tables, body.kept(work, ContactTerm)
    parts = balance.setting, balance.solve, balance.inverse
    return Context(SlowContacts(system, *parts, s, tables, memory, room_for(tables, memory)))


def contact_parts(whole: Context, limited: bool, slow: Context | None) -> ContactParts:
    """Contact parts of a motion; `whole` is the context of its setting."""
    limit = _limit.at(whole) if limited else 0
    if slow is None:
        return ContactParts(limit, 0, 0, 0, 0)
    return ContactParts(
        limit, _gather.at(slow), _slow_down.at(slow), kinetic.at(whole), slow.address
    )
