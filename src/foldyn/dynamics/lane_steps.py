"""Central differences of up to WIDTH motions side by side, in the lanes of `mechanics.lanes`.

All motions take the same steps; each motion is checked on the way like a single motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import Samples
from foldyn.jit.compiled import inner, shared
from foldyn.jit.eights import eight, put
from foldyn.jit.intrinsics import borrowed
from foldyn.mechanics.lanes import SHARED, WIDTH, add_bars, add_hinges, lanes, side_by_side
from foldyn.structures.bars_hinges import BarsHingesTerm


class LaneState(NamedTuple):
    """State of WIDTH models with d dofs."""

    dofs: NDArray  # (5, d WIDTH) displacement, velocity, acceleration, force, position (SI)
    angle: NDArray  # (nh WIDTH,) dihedrals at the last step, rad
    work: NDArray  # (4, WIDTH) work and dissipated energy, J, and the powers of both, W
    wrong: NDArray  # (WIDTH,) nonzero after a value that is not finite, or a hinge jump by pi


class LaneLoads(NamedTuple):
    """Loads on k dofs, in t terms with one history each, with masses and drag."""

    dof: NDArray  # (k,)
    value: NDArray  # (t, k WIDTH) loads, N
    inverse: NDArray  # (d WIDTH,) 1/kg, 0 on fixed dofs
    mass: NDArray  # (d WIDTH,) kg
    alpha: NDArray  # (WIDTH,) factor of the drag alpha M v, 1/s


class LanePlaces(NamedTuple):
    """Places in the results for lane data: n nodes, s supported dofs."""

    motion: NDArray  # (models,) number of the motion in each lane
    node: NDArray  # (n,) node number at each place in memory
    supported: NDArray  # (s,) dofs, in memory order


@inner
def write_samples(mass, state, strain, places, out, k):
    """Write sample k of each model."""
    u, v, force = state.dofs[0], state.dofs[1], state.dofs[3]
    for q in range(places.motion.size):
        m, kinetic, energy = places.motion[q], 0.0, out.energy[places.motion[q], k]
        for i in range(places.node.size):
            for c in range(3):
                at = (3 * i + c) * WIDTH + q
                out.displacement[m, k, places.node[i], c] = u[at]
                out.velocity[m, k, places.node[i], c] = v[at]
                kinetic += 0.5 * mass[at] * v[at] * v[at]
        for s in range(places.supported.size):
            out.reaction[m, k, s] = force[places.supported[s] * WIDTH + q]
        energy[:-3] = strain[:, q]
        energy[-3], energy[-2], energy[-1] = kinetic, state.work[1, q], state.work[0, q]
        state.wrong[q] += 0.0 * energy.sum()  # nan if an energy is not finite


@shared
def advance_lanes(model, loads, factor, state, plan, places, out, first, last):
    """Advance WIDTH models from step first to last; step 0 is the start.

    factor : (last - first + 1, t WIDTH) factors of the histories, at the ends of the steps.
    """
    model, loads, state = borrowed(model), borrowed(loads), borrowed(state)
    dofs, work, groups, scratch = state.dofs, state.work, out.energy.shape[2] - 3, np.zeros(WIDTH)
    u, v, a, force, position = dofs[0], dofs[1], dofs[2], dofs[3], dofs[4]
    terms, count, strain = loads.value.shape[0], loads.dof.size, np.zeros((groups, WIDTH))
    zero, slowed = eight(scratch, 0), eight(loads.alpha, 0)
    for step in range(first, last + 1):
        h = plan.dt if step > 0 else 0.0
        for i in range(0, u.size, WIDTH):
            speed = eight(v, i) + 0.5 * h * eight(a, i)
            put(v, i, speed)
            put(u, i, eight(u, i) + h * speed)
            put(position, i, eight(model.rest, i) + eight(u, i))
            put(force, i, zero)
        sampled, strain[:] = step % plan.every == 0, 0.0
        if sampled:
            add_bars(model, u, force, scratch, strain)
            add_hinges(model, position, force, state.angle, state.wrong, scratch, strain)
        else:
            add_bars(model, u, force, scratch, None)
            add_hinges(model, position, force, state.angle, state.wrong, scratch, None)
        power_in, drag, wrong = zero, zero, eight(state.wrong, 0)
        for term in range(terms):
            now = eight(factor, ((step - first) * terms + term) * WIDTH)
            for k in range(count):
                at = loads.dof[k] * WIDTH
                load = eight(loads.value, (term * count + k) * WIDTH) * now
                put(force, at, eight(force, at) - load)
                power_in = power_in + load * (eight(v, at) + 0.5 * h * eight(a, at))
        for i in range(0, u.size, WIDTH):
            ahead = eight(v, i) + 0.5 * h * eight(a, i)  # velocity for the drag
            new = -eight(force, i) * eight(loads.inverse, i) - slowed * ahead
            speed = eight(v, i) + 0.5 * h * new
            put(a, i, new)
            put(v, i, speed)
            drag = drag + eight(loads.mass, i) * ahead * ahead
            wrong = wrong + zero * speed  # nan after an inf or nan
        for row, power in enumerate((power_in, drag * slowed)):
            before = eight(work, (2 + row) * WIDTH)
            put(work, row * WIDTH, eight(work, row * WIDTH) + 0.5 * h * (before + power))
            put(work, (2 + row) * WIDTH, power)
        put(state.wrong, 0, wrong)
        if sampled:
            write_samples(loads.mass, state, strain, places, out, step // plan.every)


def topology(motion: Motion) -> tuple[bytes, ...]:
    """Properties that motions in one set of lanes share; () if lanes do not support the motion.

    Lanes support bars and hinges with the package's laws, lumped masses, drag, and dead loads.
    """
    packed, system = motion.packed, motion.packed.system
    drives = system.moves, system.turns, system.follows
    plain = isinstance(packed.body.sheet, BarsHingesTerm) and packed.mass.lumped
    plain = plain and not packed.added.acts
    if not plain or packed.body.others or any(drives) or packed.model.addresses.any():
        return ()
    arrays = [getattr(packed.model, name) for name in SHARED]
    return tuple(array.tobytes() for array in (*arrays, system.order, system.supported))


def integrate(motions: Sequence[tuple[int, Motion]], out: Samples) -> set[int]:
    """Integrate up to WIDTH motions of one topology and plan; return the indices of failures.

    motions : each with its number in `out`.
    out : sample arrays: time (k,), all others (m, k, ...).
    """
    numbers, own = zip(*motions, strict=True)
    plan, system = own[0].plan, own[0].packed.system
    filled = [*own, *own[-1:] * (WIDTH - len(own))]
    model = lanes([motion.packed.model for motion in filled])
    state, loads = _start(filled), _loads(filled)
    places = LanePlaces(np.array(numbers), system.order, system.supported)
    sound, done = set(range(len(own))), -1
    while sound and done < plan.steps:
        first, done = done + 1, min(plan.steps, max(0, done) + own[0].recheck_after)
        times = plan.start + plan.dt * np.arange(first, done + 1)
        factor = _factors(filled, times, len(loads.value))
        advance_lanes(model, loads, factor, state, plan, places, out, first, done)
        sound = {lane for lane in sound if _is_sound(own[lane], lane, state, done)}
    return {number for lane, number in enumerate(numbers) if lane not in sound}


def _is_sound(motion: Motion, lane: int, state: LaneState, step: int) -> bool:
    """Whether a motion may continue after a step."""
    if state.wrong[lane] != 0.0:
        return False
    motion.state.tally.samples = step // motion.plan.every + 1
    return motion.may_continue(step, state.dofs[0, lane::WIDTH].reshape(-1, 3))


def _start(motions: Sequence[Motion]) -> LaneState:
    """Initial state of the models."""
    states = [motion.state for motion in motions]
    dofs = side_by_side([np.stack([c.u, c.v, *np.zeros((3, *c.u.shape))]) for c in states])
    angle = side_by_side([state.angle for state in states])
    return LaneState(dofs.reshape(5, -1), angle, np.zeros((4, WIDTH)), np.zeros(WIDTH))


def _loads(motions: Sequence[Motion]) -> LaneLoads:
    """Loads, masses and drag."""
    masses = [motion.packed.mass for motion in motions]
    terms = max(len(motion.case.load_terms) for motion in motions)
    value = np.zeros((terms, masses[0].inverse.size, WIDTH))
    for lane, motion in enumerate(motions):
        for term, (vector, _) in enumerate(motion.case.load_terms):
            value[term, :, lane] = motion.packed.numbering.inward(vector).ravel()
    dof = np.flatnonzero(value.any(axis=(0, 2)))
    return LaneLoads(
        dof, value[:, dof].reshape(len(value), len(dof) * WIDTH),
        side_by_side([mass.inverse for mass in masses]),
        side_by_side([np.repeat(mass.diagonal, 3) for mass in masses]),
        np.array([motion.packed.system.alpha for motion in motions]),
    )  # fmt: skip


def _factors(motions: Sequence[Motion], times: NDArray, terms: int) -> NDArray:
    """Factors of all histories at times (k,), (k, terms WIDTH)."""
    out = np.zeros((len(times), terms, WIDTH))
    for lane, motion in enumerate(motions):
        for term, (_, history) in enumerate(motion.case.load_terms):
            out[:, term, lane] = history(times)
    return out.reshape(len(times), -1)
