"""Contact as compiled loops see it: a term whose parts touch each other and planes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.contact.candidates import HISTORY, Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.forces import add_contact
from foldyn.mechanics.contact.panel_friction import rub_power
from foldyn.mechanics.contact.planes import move_planes, plane_powers
from foldyn.mechanics.contact.ride import (
    Ride,
    add_back,
    put_lightness,
    put_points,
    put_rates,
)
from foldyn.mechanics.contact.step_limit import Pace, limited
from foldyn.mechanics.contact.thread_partition import energy_of_all
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
    moved: NDArray  # (m, 3) of the points, as of nodes elsewhere,
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
