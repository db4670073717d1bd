"""The equation of motion behind a few addresses that every integrator calls; compiled once.

Terms are called by address, so all cases have the same types. Loops receive the addresses of the
functions in this module and contain only their own arithmetic. Optional parts (histories, moving
supports and rest angles, contact, a mass matrix that is not diagonal) are compiled on first use;
the address of an unused part is 0. Dead loads, drag and a diagonal mass, which nearly all motions
have, are built in, because calls cost time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics import parts
from foldyn.dynamics.added_mass import observe_fluid, solve_with_fluid, turn_flow
from foldyn.dynamics.explicit_contact import contact_parts, slow_contacts
from foldyn.dynamics.inertia import kinetic_energy, lumped_energy, moving_energy, times_mass
from foldyn.dynamics.motion_state import (
    AIR,
    DISSIPATED,
    HINGE,
    OUTCOME,
    WORK,
    WRONG,
    MotionState,
    Outcome,
    Samples,
    passed_through,
)
from foldyn.dynamics.parts import ThreadCase
from foldyn.dynamics.system import PackedCase, Scratch, carry
from foldyn.dynamics.ties import add_reactions
from foldyn.jit.compiled import addressed, inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at, run_at, value_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.heat import Warm, warm
from foldyn.mechanics.term import (
    ADDRESS,
    ADVANCE_CLOCK,
    BRANCH_STATES,
    EVERY,
    LIMIT,
    NUMBER,
    PLACE_OBSTACLES,
    Terms,
    ThreadTerms,
    dissipated_by,
    energies_of,
    forces_of,
    run_each,
)
from foldyn.mechanics.threads import Team, ThreadPart, largest, part, total, wait

DONE, NOT_FINITE = int(Outcome.DONE), int(Outcome.NOT_FINITE)
PENETRATION = int(Outcome.PENETRATION)


class LoopHandle(NamedTuple):
    """What a time loop knows of the equation: addresses, and arrays of its thread.

    The address of a part that the case lacks is 0.
    """

    acceleration: int
    case: int  # context of the `ThreadCase`
    powers: NDArray  # (3,) power in, out and to the air at the last acceleration, W
    before: NDArray  # (3,) the same at the last step, for methods that keep them
    team: Team
    own: NDArray  # (2,) first and last + 1 of the thread's rows
    stage: NDArray  # (3, n, 3) scratch of methods with several stages
    angle: NDArray  # (nh,) dihedrals at the last acceleration, rad
    clock: int = 0  # sets the time of laws with memory
    commit: int = 0  # accepts a step of laws with memory
    step_error: int = 0  # error ratio of laws with memory
    offsets: int = 0  # work of offsets; 0 if no rest angles change
    spent: int = 0  # energy of terms; 0 if no rest angles change, or with fixed steps
    limit: int = 0  # longest step that contact and cables allow
    gather: int = 0  # finds slow contacts, which get inertia
    slow_down: int = 0  # changes accelerations for this inertia
    slow_kinetic: int = 0  # kinetic energy of this inertia
    slow: int = 0  # context of the functions for slow contacts
    sample: int = 0
    recorder: int = 0  # context of `sample`


class Recorder(NamedTuple):
    """A case on one thread, and where its samples go."""

    case: ThreadCase
    state: MotionState
    out: Samples
    fluid: int  # adds the force that moves the fluid; 0 without added mass
    warm: int  # evaluates the heat correction of the strain energies; 0 without heat
    heat: int  # context of `warm`
    lacking: NDArray  # (groups,) result of `warm`, J


# ------------------------------------------------------------------ the equation
@addressed(ADDRESS, ADDRESS, NUMBER, ADDRESS, ADDRESS)
def _acceleration(m, q, w, t, out, powers):
    """See `acceleration`; m is the `ThreadCase`."""
    force, factor, system, mass = m.s.force, m.s.factor, m.system, m.mass
    rows, first, last = force.shape[0], 3 * m.own[0], 3 * m.own[1]
    if m.histories != 0:
        run_at(m.histories, (m, t))
    if m.turn != 0:
        run_at(m.turn, (m,))
    if m.carry != 0:
        run_at(m.carry, (m, q, w))
    if system.presses:
        run_each(m.terms, PLACE_OBSTACLES, (factor,))
    u = m.s.displacement if m.carry != 0 else rows_at(q, rows)
    v = m.s.velocity if m.carry != 0 else rows_at(w, rows)
    wait(m.team)  # until the other threads have written q and w
    power_in, power_out, power_air = forces_of(m.terms, u, v, t, force)
    bracket, speed, loads, found = flat(force), flat(v), system.loads, numbers_at(powers, 3)
    for k in range(m.s.loads[0], m.s.loads[1]):
        dof = loads.dof[k]
        load = loads.value[k] * factor[loads.row[k], 0]
        bracket[dof] -= load
        power_in += load * speed[dof]
    if m.follow != 0:
        power_in += value_at(m.follow, (m, u, v))
    if m.turn_flow != 0:
        run_at(m.turn_flow, (m, u, v, powers))
        power_out += found[1]
        power_air += found[2]
    kinetic = 0.0
    if m.drag > 0.0:
        kinetic = value_at(m.kinetic, (m, v)) if m.kinetic != 0 else lumped_energy(mass, v, m.own)
    accelerated, relative = flat(rows_at(out, rows))[first:last], flat(rows_at(w, rows))[first:last]
    if m.solve != 0:
        run_at(m.solve, (m, out))
        for i in range(relative.size):
            accelerated[i] = -accelerated[i] - m.drag * relative[i]
    else:
        own, inverse = bracket[first:last], flat(mass.inverse)[first:last]
        for i in range(own.size):
            accelerated[i] = -own[i] * inverse[i] - m.drag * relative[i]
    if m.drag > 0.0:
        power_out += 2.0 * m.drag * kinetic
    if m.moving_power != 0:  # without the change of the kinetic energy of S f'
        power_in += value_at(m.moving_power, (m,))
    if m.turning_power != 0:
        power_in += value_at(m.turning_power, (m,))
    found[0], found[1], found[2] = power_in, power_out, power_air


# ------------------------------------------------------------------ what is seen of a motion
@inner
def _record(m, tally, q, w, a, out, k):
    """Write row k of the samples after `acceleration` at q and w (n, 3).

    The reaction is the force of the supports: M (a + alpha v) + F_int + beta K0 v - p on their
    dofs. The energies are the strain energies, the energy lost to air (if the sheet is in air), the
    kinetic energy, the dissipated energy and the work.
    """
    system, s, reactions = m.system, m.s, m.system.ties.reactions
    displacement, velocity = out.displacement[k], out.velocity[k]
    reaction, energy = out.reaction[k], out.energy[k]
    carry(system.moved, s.factor[:, 0], q, s.displacement)
    carry(system.moved, s.factor[:, 1], w, s.velocity)
    carry(system.moved, s.factor[:, 2], a, s.moving)
    for i in range(system.order.size):
        for c in range(3):
            displacement[system.order[i], c] = s.displacement[i, c]
            velocity[system.order[i], c] = s.velocity[i, c]
    product = flat(s.product)
    times_mass(m.mass, s.moving, s.product)
    reaction[:] = 0.0
    add_reactions(reactions, product, 1.0, reaction)
    add_reactions(reactions, flat(s.force), 1.0, reaction)
    groups, last = s.energy.size, energy.size - 1
    energy[last - 2] = kinetic_energy(m.mass, s.velocity, (0, s.velocity.shape[0]))
    times_mass(m.mass, s.velocity, s.product)
    add_reactions(reactions, product, system.alpha, reaction)
    energies_of(m.terms, s.displacement, s.energy)
    for g in range(groups):
        energy[g] = s.energy[g]
    if last - 2 > groups:
        energy[groups] = tally.air
    energy[last - 1] = tally.dissipated + dissipated_by(m.terms)
    # work includes the energy for accelerating supports, whose velocity may jump
    energy[last] = tally.work + moving_energy(system.moved_mass, s.factor)


@addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER)
def _sample(r, u, v, a, t):
    """See `sample`; r is the `Recorder`."""
    m, state, out, rows = r.case, r.state, r.out, r.case.s.force.shape[0]
    k = state.tally.samples - out.first
    out.time[k] = t
    fluid = value_at(r.fluid, (m, v, a)) if r.fluid != 0 else 0.0
    _record(m, state.tally, rows_at(u, rows), rows_at(v, rows), rows_at(a, rows), out, k)
    last = out.energy.shape[1] - 1
    if r.fluid != 0:
        out.energy[k, last - 3] += m.added.carried[0]
        out.energy[k, last - 2] += fluid
    if r.warm != 0:
        run_at(r.warm, (r.heat,))
        total = 0.0
        for g in range(r.lacking.size):
            out.energy[k, g] += r.lacking[g]
            total += r.lacking[g]
        if state.tally.samples == 0:  # energy that is stored at the start does not count as work
            state.tally.work -= total
            out.energy[k, last] -= total
        out.energy[k, last] += total
    run_each(m.terms, BRANCH_STATES, (out.memory[k],))
    sound = 0.0
    for c in range(out.energy.shape[1]):
        sound += out.energy[k, c]
    if not abs(sound) < np.inf:
        return float(NOT_FINITE)
    state.tally.samples += 1
    return float(DONE)


# ------------------------------------------------------------------ what loops call
@inner_scalar
def acceleration(handle, q, w, t, a):
    """Acceleration q'' (n, 3) at time t; q and w are displacement and velocity without S f.

    q'' = - M^-1 (F_int + beta K0 v - p) - alpha w on free dofs. Returns three powers, W: of loads,
    supports and actuators, the power dissipated, and the power lost to the air. `Scratch.force`
    then holds the bracket.

    A team member computes its own nodes only, and must have changed q and w only there.
    """
    run_at(handle.acceleration, (handle.case, q, w, t, a, handle.powers))
    return handle.powers[0], handle.powers[1], handle.powers[2]


@inner_scalar
def advance_clock(handle, since):
    """Give laws with memory the time (s) from the last accepted step to the next evaluation."""
    if handle.clock != 0:
        run_at(handle.clock, (handle.case, since))


@inner_scalar
def step_error(handle, scale):
    """Error ratio of laws with memory, if the step that ends at the last evaluation is accepted.

    scale : displacement (m) that errors are relative to, unless turns of hinges cause larger ones.
    """
    if handle.step_error == 0:
        return 0.0
    return value_at(handle.step_error, (handle.case, scale))


@inner_scalar
def work_of_offsets(handle, accepted):
    """Work (J) of offsets since the last step; see `actuation.offset_work`."""
    if handle.offsets == 0:
        return 0.0
    return value_at(handle.offsets, (handle.case, 1.0 if accepted else 0.0))


@inner_scalar
def spent(handle, q):
    """Energy (J) that terms store and have dissipated, after `acceleration` at q."""
    return value_at(handle.spent, (handle.case, q)) if handle.spent != 0 else 0.0


@inner_scalar
def sample(handle, u, v, a, t):
    """Write the next sample, after `acceleration` at u, v and t; returns an outcome."""
    return int(value_at(handle.sample, (handle.recorder, u, v, a, t)))


@inner_scalar
def observe(handle, state, plan, a, step):
    """Finish a fixed step after its `acceleration`; every team member calls it.

    Adds up the works of the members. Ends the motion if it is no longer finite or if panels pass
    through each other. Writes a sample every plan.every steps. Returns (outcome, hinge), the same
    for all members.
    """
    team, tally = handle.team, state.tally
    wait(team)  # until the other threads have written accelerations, dihedrals and notes
    t = plan.start + step * plan.dt
    if handle.offsets != 0:
        team.note[team.number, WORK] += work_of_offsets(handle, True)
        wait(team)
    wrong = total(team, WRONG)
    first, last = part(team, handle.angle.size)
    hinge = passed_through(handle.angle, state.angle, first, last)
    team.note[team.number, HINGE] = hinge
    wait(team)
    hinge = int(largest(team, HINGE))
    if team.number == 0:
        tally.work += total(team, WORK)
        tally.dissipated += total(team, DISSIPATED)
        tally.air += total(team, AIR)
        tally.time = t
        tally.steps = step
        outcome = DONE
        if wrong == 0.0 and hinge < 0 and handle.commit != 0:
            run_at(handle.commit, (handle.case,))
        if wrong == 0.0 and hinge < 0 and step == tally.samples * plan.every:
            outcome = sample(handle, state.u, state.v, a, t)
        team.note[0, OUTCOME] = outcome
    wait(team)
    if wrong > 0.0:
        return NOT_FINITE, -1
    if hinge >= 0:
        return PENETRATION, hinge
    return int(team.note[0, OUTCOME]), -1


@kernel
def accelerate(handle, q, w, t, out):
    """`acceleration` for calls from Python."""
    return acceleration(handle, q, w, t, out)


@kernel
def write(handle, q, w, t, a):
    """Write the next sample at time t; a (n, 3) is scratch."""
    acceleration(handle, q, w, t, a)
    return sample(handle, q, w, a, t)


# ------------------------------------------------------------------ owner of the contexts
class EquationOfMotion:
    """The equation of motion of a case on one thread; it owns all contexts.

    Parameters
    ----------
    packed : PackedCase
    own : ThreadPart
        An item of `Assembly.thread_parts`.
    s : Scratch
    state : MotionState
    slows : bool, optional
        Whether the method gives inertia to slow contacts; None if contact does not limit its steps.

    Attributes
    ----------
    case : Context
        Context of the `ThreadCase`.
    handle : Context
        Context of a `LoopHandle` that writes no samples.
    """

    def __init__(
        self, packed: PackedCase, own: ThreadPart, s: Scratch, state: MotionState,
        slows: bool | None,
    ) -> None:  # fmt: skip
        limited = slows is not None
        called = [kind for kind in EVERY if limited or kind != LIMIT]
        system, self._state = packed.system, state
        self._held = held = ThreadTerms(packed.body, own, called)
        self.case = case = _thread_case(packed, own, held.terms, s)
        self._heat = packed.heat and Context(
            Warm(packed.heat, s.displacement, s.factor, np.zeros(system.energies))
        )
        self._slow = slow = slow_contacts(packed, own, case.value) if slows else None
        remembers = held.terms.kernel[:, ADVANCE_CLOCK].any()
        self.handle = Context(
            LoopHandle(
                acceleration=_acceleration.at(case),
                case=case.address,
                powers=np.zeros(3),
                before=s.powers,
                team=case.value.team,
                own=case.value.own,
                stage=s.stage,
                angle=case.value.angle,
                clock=parts.clock.at(case) if remembers else 0,
                commit=parts.commit.at(case) if remembers else 0,
                step_error=parts.step_error.at(case) if remembers and limited else 0,
                offsets=parts.offsets.at(case) if system.turns else 0,
                spent=parts.spent.at(case) if system.turns and slows else 0,
                **contact_parts(case, bool(held.terms.kernel[:, LIMIT].any()), slow),
            )
        )
        self._out: Samples | None = None

    def recording(self, out: Samples) -> Context:
        """Context of a `LoopHandle` that writes samples to `out`."""
        if self._out is not out:  # filling a context in Python is slow: once per window
            case, heat = self.case, self._heat
            fluid = observe_fluid.at(case) if case.value.added.acts else 0
            lacks: tuple[int, int, NDArray] = 0, 0, np.zeros(0)
            if heat:
                lacks = warm.at(heat), heat.address, heat.value.energy
            recorder = Context(Recorder(case.value, self._state, out, fluid, *lacks))
            self._sampled = Context(
                self.handle.value._replace(sample=_sample.at(recorder), recorder=recorder.address)
            )
            self._out, self._recorder = out, recorder
        return self._sampled


def _thread_case(packed: PackedCase, own: ThreadPart, terms: Terms, s: Scratch) -> Context:
    """Context of a case on a thread."""
    system, mass, added = packed.system, packed.mass, packed.added
    drag = 0.0 if added.acts else system.alpha
    case = ThreadCase(
        terms, system, mass, added, s, own.angle, own.fold_angle, own.own, own.team, drag
    )
    at = Context(case)  # has the type that the parts are compiled for
    solve = parts.solve_constrained if len(mass.ties.slave) else parts.solve
    solve = solve_with_fluid if added.acts else solve
    diagonal = mass.lumped and not added.acts
    return Context(
        case._replace(
            histories=parts.histories.at(at) if system.varies else 0,
            turn=parts.turn.at(at) if system.turns else 0,
            carry=parts.carry.at(at) if system.moves else 0,
            follow=parts.follow.at(at) if system.follows else 0,
            turn_flow=turn_flow.at(at) if added.acts else 0,
            solve=0 if diagonal else solve.at(at),
            kinetic=0 if diagonal or not drag else parts.kinetic.at(at),
            moving_power=parts.moving_power.at(at) if system.moves else 0,
            turning_power=parts.turning_power.at(at) if system.turns else 0,
        )
    )
