"""Contact as compiled loops see it: a term whose parts touch each other and planes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.contact.boards import Ride, add_back, put_lightness, put_points, put_rates
from foldyn.mechanics.contact.candidates import HISTORY, Tables
from foldyn.mechanics.contact.contact_state import ENERGY, Memory, energy_of_all, finish, reaches
from foldyn.mechanics.contact.distances import VERTEX, nodes_of
from foldyn.mechanics.contact.hinge_guards import add_guards
from foldyn.mechanics.contact.pair_potentials import edge_edge, vertex_triangle
from foldyn.mechanics.contact.panel_friction import add_rubs, rub_power
from foldyn.mechanics.contact.planes import add_planes, move_planes, plane_powers
from foldyn.mechanics.contact.search import follow, place
from foldyn.mechanics.contact.step_limit import Pace, limited
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    LIMIT,
    PLACE_OBSTACLES,
    CompiledTerm,
    energies,
    forces,
    limit,
    place_obstacles,
)
from foldyn.mechanics.threads import part, wait


@inner
def _add_pairs(tables, angle, force, memory):
    """Energy (J) of a member's share of near pairs and guards.

    Adds the gradient of this energy, and friction, to force (n, 3). Records the range of affected
    nodes.
    """
    counts, team, x, energy = memory.counts, memory.share.team, memory.x, 0.0
    low, high = len(x), 0
    for kind in range(2):
        first, last = part(team, counts.near_first if kind == VERTEX else counts.near_second)
        for k in range(first, last):
            p = memory.near[kind, k]
            one, other, d0 = memory.pairs[kind, p, 0], memory.pairs[kind, p, 1], memory.d0[kind, p]
            if kind == VERTEX:
                energy += vertex_triangle(tables, x, force, one, other, d0)[0]
            else:
                energy += edge_edge(tables, x, force, one, other, d0)[0]
            for node in nodes_of(tables.triangles, tables.edges, kind, one, other):
                low, high = min(low, node), max(high, node + 1)
    if counts.watched == 0 or counts.hinges > 0:
        first, last = part(team, tables.hinge_limit.size)
        energy += add_guards(tables, x, angle, force, first, last)
        low, high = 0, len(x)
    if counts.full == 1:
        energy = np.nan
        force[tables.surface[0], 0] = np.nan
        low, high = 0, len(x)
    reaches(team, low, high)
    return energy


@kernel
def add_contact(tables, u, angle, force, memory):
    """Add the gradient (N) of the contact energy at u, and friction, to force, both (rows, 3).

    angle : dihedrals (nh,) of the model, rad. The energy (J) is stored in memory.facts. Each team
    member completes the force on its own nodes; see `contact_state`.
    """
    counts, share, energy = memory.counts, memory.share, 0.0
    team = share.team
    near = counts.watched == 0 or counts.near_first + counts.near_second + counts.hinges > 0
    near = near and memory.d0.shape[1] > 0
    if near or len(tables.planes) > 0:
        place(tables, u, memory)
    if near:
        wait(team)  # for positions and dihedrals of the other members
        if counts.watched == 0:
            follow(tables, u, memory)
        into = force if team.size == 1 else share.sums[team.number]
        energy += _add_pairs(tables, angle, into, memory)
        if tables.friction > 0.0:
            add_rubs(tables, memory, into)
    if len(tables.planes) > 0:
        energy += add_planes(tables, memory.x, memory, force)
    memory.facts.energy = team.note[team.number, ENERGY] = energy
    if near and team.size > 1:
        finish(share, force)


class _Context(NamedTuple):
    tables: Tables
    memory: Memory
    angle: NDArray
    group: int  # energy group
    rows: int
    histories: int  # number of histories that move planes


@inner_scalar
def _add_powers(own, speed, powers):
    """Add the powers (W) that planes supply and friction dissipates."""
    both = numbers_at(powers, 2)
    given, taken = plane_powers(own.tables, speed, own.memory)
    if own.tables.friction > 0.0:
        taken += rub_power(own.tables, speed, own.memory)
    both[0] += given
    both[1] += taken


@forces
def _forces(own, u, v, t, force, powers):
    speed = rows_at(v, own.rows)
    add_contact(own.tables, rows_at(u, own.rows), own.angle, rows_at(force, own.rows), own.memory)
    _add_powers(own, speed, powers)


@energies
def _energies(own, u, out):
    numbers_at(out, own.group + 1)[own.group] = energy_of_all(own.memory)


@place_obstacles
def _place(own, factors):
    move_planes(own.tables, rows_at(factors, own.histories), own.memory)


@limit
def _limit(own, u, v, a, dt, beta, energy, lightness):
    pace, light = Pace(beta, energy), numbers_at(lightness, own.rows)
    moved, speed, change = rows_at(u, own.rows), rows_at(v, own.rows), rows_at(a, own.rows)
    return limited(own.tables, moved, speed, change, own.angle, dt, pace, light, own.memory)


class _Riding(NamedTuple):
    ride: Ride
    tables: Tables
    memory: Memory
    angle: NDArray
    moved: NDArray  # (m, 3) this and the next three: of the points, in place of nodes
    speed: NDArray
    change: NDArray
    push: NDArray
    lightness: NDArray  # (m,)
    group: int
    rows: int
    histories: int


@forces
def _board_forces(own, u, v, t, force, powers):
    at = rows_at(u, own.rows)
    put_points(own.ride, at, own.moved)
    put_rates(own.ride, at, rows_at(v, own.rows), own.speed)
    own.push[:] = 0.0
    add_contact(own.tables, own.moved, own.angle, own.push, own.memory)
    _add_powers(own, own.speed, powers)
    add_back(own.ride, at, own.push, rows_at(force, own.rows))


@limit
def _board_limit(own, u, v, a, dt, beta, energy, lightness):
    at = rows_at(u, own.rows)
    put_points(own.ride, at, own.moved)
    put_rates(own.ride, at, rows_at(v, own.rows), own.speed)
    put_rates(own.ride, at, rows_at(a, own.rows), own.change)
    put_lightness(own.ride, numbers_at(lightness, own.rows), own.lightness)
    pace, light, memory = Pace(beta, energy), own.lightness, own.memory
    return limited(own.tables, own.moved, own.speed, own.change, own.angle, dt, pace, light, memory)


def board_kernels(
    ride: Ride, tables: Tables, memory: Memory, angle: NDArray, group: int
) -> CompiledTerm:
    """Contact kernels for points that ride on a mesh."""
    histories = 1 + int(tables.planes[:, HISTORY].max(initial=-1.0))
    shape = ride.rest.shape
    moved, speed, change, push = (np.zeros(shape) for _ in range(4))
    own = Context(
        _Riding(
            ride, tables, memory, angle, moved, speed, change, push, np.zeros(shape[0]), group,
            len(ride.x), histories,
        )
    )  # fmt: skip
    kernels = {FORCES: _board_forces, ENERGIES: _energies, LIMIT: _board_limit}
    return CompiledTerm(own, kernels | ({PLACE_OBSTACLES: _place} if histories else {}))


def contact_kernels(tables: Tables, memory: Memory, angle: NDArray, group: int) -> CompiledTerm:
    """Contact kernels for these tables, with their energy group.

    The energy belongs to the last force evaluation, after which all team members have synchronized.
    """
    histories = 1 + int(tables.planes[:, HISTORY].max(initial=-1.0))
    rows = len(tables.rest)
    own = Context(_Context(tables, memory, angle, group, rows, histories))
    kernels = {FORCES: _forces, ENERGIES: _energies, LIMIT: _limit}
    return CompiledTerm(own, kernels | ({PLACE_OBSTACLES: _place} if histories else {}))
