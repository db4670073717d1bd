"""The equation of motion behind a few addresses, which every integrator calls; compiled once.

Terms are called by address, so every case has the same types. Loops receive the addresses of the
functions here and contain only their own arithmetic. Optional parts (histories, moving supports and
rest angles, contact, a mass matrix that is not diagonal) are compiled on first use; a motion
without them has the address 0. Dead loads, drag and a diagonal mass, which nearly all motions have,
are built in, because calls cost time.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics import parts
from foldyn.dynamics.added_mass import observe_fluid, solve_with_fluid, turn_flow
from foldyn.dynamics.explicit_contact import ContactParts, contact_parts, slow_contacts
from foldyn.dynamics.inertia import lumped_energy
from foldyn.dynamics.motion_state import (
    AIR,
    DISSIPATED,
    HINGE,
    OUTCOME,
    WORK,
    WRONG,
    Course,
    Outcome,
    Samples,
    passed_through,
)
from foldyn.dynamics.parts import Setting
from foldyn.dynamics.record import record
from foldyn.dynamics.system import Entries, Packed, Scratch
from foldyn.jit.compiled import addressed, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at, run_at, value_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.heat import Warm, warm
from foldyn.mechanics.term import (
    ADDRESS,
    ADVANCE_CLOCK,
    EVERY,
    LIMIT,
    NUMBER,
    Model,
    Terms,
    forces_of,
    obstacles_to,
    states_of,
)
from foldyn.mechanics.threads import Team, largest, part, total, wait

DONE, NOT_FINITE = int(Outcome.DONE), int(Outcome.NOT_FINITE)
PENETRATION = int(Outcome.PENETRATION)


class Balance(NamedTuple):
    """Data for every acceleration; optional parts are addresses, or 0."""

    terms: Terms
    setting: int  # context of the parts
    histories: int  # address of their evaluation
    turn: int  # moves rest angles,
    carry: int  # moves supports
    presses: bool  # whether obstacles or air move
    follow: int  # loads that depend on the displacement
    turn_flow: int  # adds forces of added mass as it turns, and drag
    solve: int  # M^-1, 0 if M is diagonal
    kinetic: int  # kinetic energy, 0 likewise
    moving_power: int  # power of moving supports
    turning_power: int  # power of turning rest angles
    alpha: float
    diagonal: NDArray
    inverse: NDArray
    loads: Entries
    loads_own: NDArray  # (2,) first and last + 1 of the thread's loads
    factor: NDArray
    force: NDArray
    displacement: NDArray
    velocity: NDArray
    team: Team
    own: NDArray  # (2,) first and last + 1 of the thread's rows


class Recording(NamedTuple):
    """A case on one thread, and the destination of its samples."""

    setting: Setting
    course: Course
    out: Samples
    whole: int  # context of the setting
    fluid: int  # adds what moves the fluid; 0 without added mass
    warm: int  # evaluates the heat correction of the strain energies; 0 without heat,
    heat: int  # its context,
    lacking: NDArray  # (groups,) and its result, J


class Equation(NamedTuple):
    """Addresses that a loop needs, and its thread's share."""

    acceleration: int
    contact: ContactParts
    clock: int  # 0 without memory
    commit: int  # 0 without memory
    step_error: int  # 0 without memory
    offsets: int  # 0 if nothing turns
    spent: int  # 0 likewise, or in methods that end steps only at jumps
    sample: int
    balance: int  # contexts
    setting: int
    recording: int
    powers: NDArray  # (3,) in, out and to the air at the last acceleration, W
    before: NDArray  # (3,) and at the last step, for methods that keep them
    team: Team
    own: NDArray  # (2,)
    stage: NDArray  # (3, n, 3) work array of methods with several stages
    angle: NDArray  # (nh,) dihedrals at the last acceleration, rad


# ------------------------------------------------------------------ the equation
@addressed(ADDRESS, ADDRESS, NUMBER, ADDRESS, ADDRESS)
def _acceleration(m, q, w, t, out, powers):
    rows, first, last = m.force.shape[0], 3 * m.own[0], 3 * m.own[1]
    if m.histories != 0:
        run_at(m.histories, (m.setting, t))
    if m.turn != 0:
        run_at(m.turn, (m.setting,))
    if m.carry != 0:
        run_at(m.carry, (m.setting, q, w))
    if m.presses:
        obstacles_to(m.terms, m.factor)
    u = m.displacement if m.carry != 0 else rows_at(q, rows)
    v = m.velocity if m.carry != 0 else rows_at(w, rows)
    wait(m.team)  # for q and w of the other threads
    power_in, power_out = forces_of(m.terms, u, v, t, m.force)
    force, speed, loads = flat(m.force), flat(v), m.loads
    for k in range(m.loads_own[0], m.loads_own[1]):
        dof = loads.dof[k]
        load = loads.value[k] * m.factor[loads.row[k], 0]
        force[dof] -= load
        power_in += load * speed[dof]
    if m.follow != 0:
        power_in += value_at(m.follow, (m.setting, u, v))
    if m.turn_flow != 0:
        power_out += value_at(m.turn_flow, (m.setting, u, v))
    kinetic = 0.0
    if m.alpha > 0.0:
        if m.kinetic != 0:
            kinetic = value_at(m.kinetic, (m.setting, v))
        else:
            kinetic = lumped_energy(m.diagonal, v, m.own)
    accelerated, relative = flat(rows_at(out, rows))[first:last], flat(rows_at(w, rows))[first:last]
    if m.solve != 0:
        run_at(m.solve, (m.setting, out))
        for i in range(relative.size):
            accelerated[i] = -accelerated[i] - m.alpha * relative[i]
    else:
        bracket, inverse = force[first:last], flat(m.inverse)[first:last]
        for i in range(bracket.size):
            accelerated[i] = -bracket[i] * inverse[i] - m.alpha * relative[i]
    if m.alpha > 0.0:
        power_out += 2.0 * m.alpha * kinetic
    if m.moving_power != 0:  # without the change of the kinetic energy of S f'
        power_in += value_at(m.moving_power, (m.setting,))
    if m.turning_power != 0:
        power_in += value_at(m.turning_power, (m.setting,))
    found = numbers_at(powers, 3)
    found[0], found[1], found[2] = power_in, power_out, m.terms.powers[2]


# ------------------------------------------------------------------ what is seen of a motion
@addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER)
def _sample(r, u, v, a, t):
    m, course, out, rows = r.setting, r.course, r.out, r.setting.s.force.shape[0]
    k = course.tally.samples - out.first
    out.time[k] = t
    fluid = value_at(r.fluid, (r.whole, v, a)) if r.fluid != 0 else 0.0
    record(
        m.terms, m.system, m.mass, rows_at(u, rows), rows_at(v, rows), rows_at(a, rows),
        course.tally, m.s, out.displacement[k], out.velocity[k], out.reaction[k], out.energy[k],
    )  # fmt: skip
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
        if course.tally.samples == 0:  # energy stored at the start is not work
            course.tally.work -= total
            out.energy[k, last] -= total
        out.energy[k, last] += total
    states_of(m.terms, out.memory[k])
    sound = 0.0
    for c in range(out.energy.shape[1]):
        sound += out.energy[k, c]
    if not abs(sound) < np.inf:
        return float(NOT_FINITE)
    course.tally.samples += 1
    return float(DONE)


# ------------------------------------------------------------------ what loops call
@inner_scalar
def acceleration(equation, q, w, t, a):
    """Acceleration q'' (n, 3) at time t, q and w the displacement and velocity without S f.

    q'' = - M^-1 (F_int + beta K0 v - p) - alpha w on free dofs. Returns the power of loads,
    supports and actuators, and the power dissipated (W); the power lost to the air stays in
    `equation.powers`, and the bracket in `Scratch.force`.

    A team member computes its own nodes only, and may have changed q and w only there.
    """
    run_at(equation.acceleration, (equation.balance, q, w, t, a, equation.powers))
    return equation.powers[0], equation.powers[1]


@inner_scalar
def advance_clock(equation, since):
    """Tell laws with memory the time (s) from the last accepted step to the next evaluation."""
    if equation.clock != 0:
        run_at(equation.clock, (equation.setting, since))


@inner_scalar
def step_error(equation, scale):
    """Error ratio of laws with memory if the step that ends at the last evaluation is accepted.

    scale : displacement (m) that errors are relative to, unless turns cause larger ones.
    """
    if equation.step_error == 0:
        return 0.0
    return value_at(equation.step_error, (equation.setting, scale))


@inner_scalar
def work_of_offsets(equation, accepted):
    """Work (J) of offsets since the last step; see `actuation.offset_work`."""
    if equation.offsets == 0:
        return 0.0
    return value_at(equation.offsets, (equation.setting, 1.0 if accepted else 0.0))


@inner_scalar
def spent(equation, q):
    """Energy (J) stored and dissipated by terms, after `acceleration` at q."""
    return value_at(equation.spent, (equation.setting, q)) if equation.spent != 0 else 0.0


@inner_scalar
def sample(equation, u, v, a, t):
    """Write the next sample, after `acceleration` at u, v and t; returns an outcome."""
    return int(value_at(equation.sample, (equation.recording, u, v, a, t)))


@inner_scalar
def observe(equation, course, plan, a, step):
    """Finish a fixed step after its `acceleration`; every team member calls it.

    Adds up the members' works. Ends the motion if it is no longer finite or if panels pass through
    each other; writes a sample every plan.every steps. Returns (outcome, hinge), the same for all
    members.
    """
    team, tally = equation.team, course.tally
    wait(team)  # for accelerations, dihedrals and notes of the other threads
    t = plan.start + step * plan.dt
    if equation.offsets != 0:
        team.note[team.number, WORK] += work_of_offsets(equation, True)
        wait(team)
    wrong = total(team, WRONG)
    first, last = part(team, equation.angle.size)
    hinge = passed_through(equation.angle, course.angle, first, last)
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
        if wrong == 0.0 and hinge < 0 and equation.commit != 0:
            run_at(equation.commit, (equation.setting,))
        if wrong == 0.0 and hinge < 0 and step == tally.samples * plan.every:
            outcome = sample(equation, course.u, course.v, a, t)
        team.note[0, OUTCOME] = outcome
    wait(team)
    if wrong > 0.0:
        return NOT_FINITE, -1
    if hinge >= 0:
        return PENETRATION, hinge
    return int(team.note[0, OUTCOME]), -1


@kernel
def accelerate(equation, q, w, t, out):
    """`acceleration` for calls from Python."""
    return acceleration(equation, q, w, t, out)


@kernel
def write(equation, q, w, t, a):
    """Write the next sample at time t; a (n, 3) is a work array."""
    acceleration(equation, q, w, t, a)
    return sample(equation, q, w, a, t)


# ------------------------------------------------------------------ its owner
class EquationOfMotion:
    """The equation of motion of a case on one thread; it owns all contexts.

    Parameters
    ----------
    packed : Packed
    work : memory of the thread, one of `Assembly.workspaces`
    s : Scratch
    course : Course
    slows : bool, optional
        Whether the method gives inertia to slow contacts; None if contact does not limit its steps.

    Attributes
    ----------
    setting : Setting
    balance, still : Context
        Data for accelerations, and the equation without samples.
    """

    def __init__(
        self, packed: Packed, work: Any, s: Scratch, course: Course, slows: bool | None
    ) -> None:
        limited = slows is not None
        called = [kind for kind in EVERY if limited or kind != LIMIT]
        system, mass, model = packed.system, packed.mass, Model(packed.body, work, called)
        self._model, self._course, share = model, course, model.share
        self.setting = Setting(model.terms, system, mass, share, s, packed.added)
        self._whole = whole = Context(self.setting)
        self.balance = balance = Context(_balance(self.setting, whole))
        self._heat = packed.heat and Context(
            Warm(packed.heat, s.displacement, s.factor, np.zeros(system.energies))
        )
        self._slow = slow = slow_contacts(packed, work, s, balance.value) if slows else None
        remembers = model.terms.kernel[:, ADVANCE_CLOCK].any()
        equation = Equation(
            acceleration=_acceleration.at(balance),
            contact=contact_parts(whole, limited and system.touches, slow),
            clock=parts.clock.at(whole) if remembers else 0,
            commit=parts.commit.at(whole) if remembers else 0,
            step_error=parts.step_error.at(whole) if remembers and slows is not None else 0,
            offsets=parts.offsets.at(whole) if system.turns else 0,
            spent=parts.spent.at(whole) if system.turns and slows else 0,
            sample=0,
            balance=balance.address,
            setting=whole.address,
            recording=0,
            powers=np.zeros(3),
            before=s.powers,
            team=share.team,
            own=share.strips.own,
            stage=s.stage,
            angle=share.angle,
        )
        self.still = Context(equation)
        self._out: Samples | None = None

    def sampled(self, out: Samples) -> Context:
        """The equation with `out` as the destination of samples."""
        if self._out is not out:  # Python fills contexts: once per window of samples
            whole, heat = self._whole, self._heat
            fluid = observe_fluid.at(whole) if self.setting.added.acts else 0
            lacks: tuple[int, int, NDArray] = 0, 0, np.zeros(0)
            if heat:
                lacks = warm.at(heat), heat.address, heat.value.energy
            given = self.setting, self._course, out, whole.address, fluid
            self._recording = recording = Context(Recording(*given, *lacks))
            self._sampled = Context(
                self.still.value._replace(sample=_sample.at(recording), recording=recording.address)
            )
            self._out = out
        return self._sampled


def _balance(setting: Setting, whole: Context) -> Balance:
    """Data for accelerations of a case; `whole` is the context of the setting."""
    terms, system, mass, share, s, added = setting
    solve = parts.solve_constrained if len(mass.ties.slave) else parts.solve
    solve = solve_with_fluid if added.acts else solve
    diagonal = mass.lumped and not added.acts
    alpha = 0.0 if added.acts else system.alpha  # added mass handles the sheet's own drag
    return Balance(
        terms=terms,
        setting=whole.address,
        histories=parts.histories.at(whole) if system.varies else 0,
        turn=parts.turn.at(whole) if system.turns else 0,
        carry=parts.carry.at(whole) if system.moves else 0,
        presses=system.presses,
        follow=parts.follow.at(whole) if system.follows else 0,
        turn_flow=turn_flow.at(whole) if added.acts else 0,
        solve=0 if diagonal else solve.at(whole),
        kinetic=0 if diagonal or not alpha else parts.kinetic.at(whole),
        moving_power=parts.moving_power.at(whole) if system.moves else 0,
        turning_power=parts.turning_power.at(whole) if system.turns else 0,
        alpha=alpha,
        diagonal=mass.diagonal,
        inverse=mass.inverse,
        loads=system.loads,
        loads_own=s.loads,
        factor=s.factor,
        force=s.force,
        displacement=s.displacement,
        velocity=s.velocity,
        team=share.team,
        own=share.strips.own,
    )
