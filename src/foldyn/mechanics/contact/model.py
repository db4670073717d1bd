"""A model whose parts touch each other and planes: a further term of its energy."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload
from numpy.typing import NDArray

from foldyn.mechanics.contact.forces import add_contact
from foldyn.mechanics.contact.inertia import added_inertia, room_for
from foldyn.mechanics.contact.memory import Memory
from foldyn.mechanics.contact.planes import move_planes, plane_powers
from foldyn.mechanics.contact.rubbing import rub_power
from foldyn.mechanics.contact.share import energy_of_all
from foldyn.mechanics.contact.step_limit import limited
from foldyn.mechanics.contact.tables import Tables
from foldyn.mechanics.kernels import (
    contact_inertia,
    contact_limit,
    contact_powers,
    energies_of,
    folds_of,
    force_of,
    place_obstacles,
    room_for_inertia,
)
from foldyn.mechanics.threads import Team


class Touching(NamedTuple):
    """A model with contact."""

    inner: Any
    contact: Tables
    groups: int  # of the inner model's energies

    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of all hinges."""
        return self.inner.hinges


class TouchingWork(NamedTuple):
    """Memory of evaluations, one after the other."""

    inner: Any
    angle: NDArray  # (nh,) dihedrals, rad
    fold_angle: NDArray  # the inner model's
    strips: Any
    team: Team
    memory: Memory


@overload(force_of, inline="always")
def _force(model, u, force, work):
    if model.instance_class is not Touching:
        return None

    def touching(model, u, force, work):
        force_of(model.inner, u, force, work.inner)
        add_contact(model.contact, u, work.angle, force, work.memory)

    return touching


@overload(energies_of, inline="always")
def _energies(model, u, work, out):
    """The energy of contact is that of the last force, which samples are taken after.

    All members of a team have waited for each other then.
    """
    if model.instance_class is not Touching:
        return None

    def touching(model, u, work, out):
        energies_of(model.inner, u, work.inner, out[: model.groups])
        out[model.groups] = energy_of_all(work.memory)

    return touching


@overload(folds_of, inline="always")
def _folds(model):
    if model.instance_class is not Touching:
        return None
    return lambda model: folds_of(model.inner)


@overload(place_obstacles, inline="always")
def _obstacles(model, factor, work):
    if model.instance_class is not Touching:
        return None
    return lambda model, factor, work: move_planes(model.contact, factor, work.memory)


@overload(contact_powers, inline="always")
def _powers(model, v, work):
    if model.instance_class is not Touching:
        return None

    def powers(model, v, work):
        given, taken = plane_powers(model.contact, v, work.memory)
        if model.contact.friction > 0.0:
            taken += rub_power(model.contact, v, work.memory)
        return given, taken

    return powers


@overload(contact_limit, inline="always")
def _limit(model, u, v, a, dt, pace, lightness, work):
    if model.instance_class is not Touching:
        return None

    def touching(model, u, v, a, dt, pace, lightness, work):
        return limited(model.contact, u, v, a, work.angle, dt, pace, lightness, work.memory)

    return touching


@overload(room_for_inertia, inline="always")
def _room(model):
    if model.instance_class is not Touching:
        return None
    return lambda model: room_for(0)


@overload(contact_inertia, inline="always")
def _inertia(model, added, u, dt, beta, lightness, work):
    if model.instance_class is not Touching:
        return None

    def touching(model, added, u, dt, beta, lightness, work):
        return added_inertia(model.contact, added, u, dt, beta, lightness, work.memory)

    return touching
