"""Optional parts of the equation of motion, as kernels called by address.

A part is compiled on first use; in a motion without it, its address is 0. Parts for contact are in
`explicit_contact`.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from foldyn.cases.waveforms import evaluate
from foldyn.dynamics.actuation import offset_work, power_of_part, turn_part
from foldyn.dynamics.added_mass import AddedMass
from foldyn.dynamics.inertia import Inertia, kinetic_energy, moving_energy, solve_mass, solve_tied
from foldyn.dynamics.system import Scratch, System, carry_part, power_of_moved
from foldyn.jit.compiled import addressed
from foldyn.jit.context import rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.following import push_following
from foldyn.mechanics.term import (
    ADDRESS,
    ADVANCE_CLOCK,
    COMMIT,
    NUMBER,
    Terms,
    dissipated_by,
    energies_of,
    run_each,
    step_error_of,
)
from foldyn.mechanics.threads import Team, wait


class ThreadCase(NamedTuple):
    """A case on one thread: its arrays, and addresses of the optional parts, 0 if unused.

    Each part takes this record as its context.
    """

    terms: Terms
    system: System
    mass: Inertia
    added: AddedMass
    s: Scratch
    angle: NDArray  # (nh,) dihedrals at the last force evaluation, rad
    fold_angle: NDArray  # (k,) dihedrals of the actuated hinges, rad
    own: NDArray  # (2,) first and last + 1 of the thread's rows
    team: Team
    drag: float  # alpha, 1/s; 0 with added mass, which adds the drag of the sheet
    histories: int = 0  # evaluates the histories
    turn: int = 0  # changes rest angles
    carry: int = 0  # moves supports
    follow: int = 0  # adds loads that depend on the displacement
    turn_flow: int = 0  # adds forces due to turning panels with added mass, and drag
    solve: int = 0  # M^-1; 0 if M is diagonal
    kinetic: int = 0  # kinetic energy; 0 if M is diagonal
    moving_power: int = 0  # power of moving supports
    turning_power: int = 0  # power of changing rest angles


@addressed(NUMBER)
def histories(m, t):
    """Evaluate the histories at t, unless done: successive stages may have the same time."""
    if t != m.s.time[0]:
        derive = m.system.moves or m.system.turns or m.system.presses
        evaluate(m.system.waves, t, derive, m.s.factor)
        m.s.time[0] = t


@addressed()
def turn(m):
    """Set the rest angles from the histories."""
    turn_part(m.system.actuators, m.s.factor, m.s.turned[0], m.s.turned[1])


@addressed(ADDRESS, ADDRESS)
def carry(m, q, w):
    """Add support motion to displacement q and velocity w."""
    rows, own = m.s.force.shape[0], m.own
    dofs, supports = (3 * own[0], 3 * own[1]), (m.s.moved[0], m.s.moved[1])
    here, there, moved = flat(m.s.displacement), flat(m.s.velocity), m.system.moved
    carry_part(moved, m.s.factor[:, 0], flat(rows_at(q, rows)), here, dofs, supports)
    carry_part(moved, m.s.factor[:, 1], flat(rows_at(w, rows)), there, dofs, supports)


@addressed(ADDRESS, ADDRESS)
def follow(m, u, v):
    """Add displacement-dependent loads; returns their power, W. Runs on one thread only."""
    rows, loads = m.s.force.shape[0], m.system.following
    moved, speed = rows_at(u, rows), rows_at(v, rows)
    return push_following(loads, moved, speed, m.s.factor, m.s.pushed, m.s.force)


@addressed(ADDRESS)
def solve(m, out):
    """Solve with a mass matrix that is not diagonal."""
    rows, team = m.s.force.shape[0], m.team
    wait(team)  # until the others have written forces and read this member's velocities
    solve_mass(m.mass, m.s.force, rows_at(out, rows), m.s.line, team.number, team.size)
    wait(team)  # until all members have solved for their axes


@addressed(ADDRESS)
def solve_constrained(m, out):
    """Solve with constraints. Runs on one thread only."""
    values = flat(rows_at(out, m.s.force.shape[0]))
    solve_tied(m.mass, flat(m.s.force), values, m.s.line)


@addressed(ADDRESS)
def kinetic(m, v):
    """Kinetic energy (J) of a thread's nodes with a mass matrix that is not diagonal."""
    return kinetic_energy(m.mass, rows_at(v, m.s.force.shape[0]), m.own)


@addressed()
def moving_power(m):
    """Power (W) of moving supports, without the change of the kinetic energy of S f'."""
    power = power_of_moved(m.system.moved, m.s.force, m.s.factor, m.s.moved[0], m.s.moved[1])
    if m.team.number == 0:
        power += 2.0 * m.system.alpha * moving_energy(m.system.moved_mass, m.s.factor)
    return power


@addressed()
def turning_power(m):
    """Power (W) of changing rest angles."""
    first, last = m.s.turned[0], m.s.turned[1]
    return power_of_part(m.system.actuators, m.s.factor, m.fold_angle, first, last)


@addressed(NUMBER)
def offsets(m, accepted):
    """Work (J) of offsets since the last step; see `actuation.offset_work`."""
    first, last = m.s.turned[0], m.s.turned[1]
    return offset_work(m.system.actuators, m.fold_angle, first, last, accepted > 0.0)


@addressed(ADDRESS)
def spent(m, q):
    """Energy (J) that terms store and have dissipated, at q, where they were last evaluated."""
    u = m.s.displacement if m.system.moves else rows_at(q, m.s.force.shape[0])
    energies_of(m.terms, u, m.s.energy)
    return m.s.energy.sum() + dissipated_by(m.terms)


@addressed(NUMBER)
def clock(m, since):
    """Set the time (s) from the last accepted step to the next evaluation."""
    run_each(m.terms, ADVANCE_CLOCK, (since,))


@addressed()
def commit(m):
    """Accept the step that ends at the last evaluation."""
    run_each(m.terms, COMMIT, ())


@addressed(NUMBER)
def step_error(m, scale):
    """Error ratio of laws with memory if the step is accepted; see `mechanics.term`."""
    return step_error_of(m.terms, scale)
