"""Contact as loops see it: a term whose parts touch each other and planes."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.contact.forces import add_contact
from foldyn.mechanics.contact.memory import Memory
from foldyn.mechanics.contact.planes import move_planes, plane_powers
from foldyn.mechanics.contact.rubbing import rub_power
from foldyn.mechanics.contact.share import energy_of_all
from foldyn.mechanics.contact.step_limit import Pace, limited
from foldyn.mechanics.contact.tables import HISTORY, Tables
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    LIMIT,
    PLACE_OBSTACLES,
    Compiled,
    energies,
    forces,
    limit,
    place_obstacles,
)


class _Context(NamedTuple):
    tables: Tables
    memory: Memory
    angle: NDArray
    group: int  # of the energies
    rows: int
    histories: int  # as far as planes move with them


@forces
def _forces(own, u, v, t, force, powers):
    speed, both = rows_at(v, own.rows), numbers_at(powers, 2)
    add_contact(own.tables, rows_at(u, own.rows), own.angle, rows_at(force, own.rows), own.memory)
    given, taken = plane_powers(own.tables, speed, own.memory)
    if own.tables.friction > 0.0:
        taken += rub_power(own.tables, speed, own.memory)
    both[0] += given
    both[1] += taken


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


def contact_kernels(tables: Tables, memory: Memory, angle: NDArray, group: int) -> Compiled:
    """Contact of what the tables hold, with the group of its energy.

    That is the energy at the last force; all members of a team have waited for each other then.
    """
    histories = 1 + int(tables.planes[:, HISTORY].max(initial=-1.0))
    rows = len(tables.rest)
    own = Context(_Context(tables, memory, angle, group, rows, histories))
    kernels = {FORCES: _forces, ENERGIES: _energies, LIMIT: _limit}
    return Compiled(own, kernels | ({PLACE_OBSTACLES: _place} if histories else {}))
