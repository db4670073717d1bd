"""The functions of a model that compiled loops call, whatever its kind.

Each stands for one function per model: an `overload` for the class of its arrays, beside its
kernels. Those of bars and hinges are here; kernels on disk know the others by the sources of the
classes among their arguments (`jit.kept`). Arrays are (rows, 3), as in `mechanics.body`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload
from numpy.typing import NDArray

from foldyn.mechanics.energy import strain_energies
from foldyn.mechanics.force import internal_force
from foldyn.mechanics.model import BarsHinges

CONTACT = "contact"  # field of models with contact


class Whole(NamedTuple):
    """The share of a thread that works alone, in place of `Strips`: everything."""

    own: NDArray  # (2,) first and last + 1 of the rows


def force_of(model: Any, u: Any, force: Any, work: Any) -> Any:
    """Internal force (rows, 3) at u.

    Keeps all dihedrals in work.angle, and in work.fold_angle those that belong to `folds_of`.
    """
    raise NotImplementedError  # compiled code has one of those below


def energies_of(model: Any, u: Any, work: Any, out: Any) -> Any:
    """Strain energies (J) by group, to `out`."""
    raise NotImplementedError


def folds_of(model: Any) -> Any:
    """Rest angles (k,), parameters (k, 4) and stiffness (k,) of what actuators turn."""
    raise NotImplementedError


# ------------------------------------------------------------------ memory
def elapse(model: Any, time: Any) -> Any:
    """Tell a model with memory how long (s) after the last accepted step it is evaluated next."""
    raise NotImplementedError


def commit(model: Any) -> Any:
    """Tell it that the step has been accepted that ends where it was evaluated last."""
    raise NotImplementedError


def lost_of(model: Any) -> Any:
    """Energy (J) that its laws have dissipated up to where it was evaluated last."""
    raise NotImplementedError


def recall(model: Any, out: Any) -> Any:
    """Write the state of its branches (b, 2) there to `out`."""
    raise NotImplementedError


# ------------------------------------------------------------------ contact
# What models without contact have is here, too: nothing. Models with contact have a field of that
# name; those with memory ask the model within.
def place_obstacles(model: Any, factor: Any, work: Any) -> Any:
    """Put moving obstacles where the factors (h, 3) of histories and their derivatives say."""
    raise NotImplementedError


def contact_powers(model: Any, v: Any, work: Any) -> Any:
    """Power (W) of moving obstacles on nodes with velocities v, and of friction: after a force."""
    raise NotImplementedError


def contact_limit(
    model: Any, u: Any, v: Any, a: Any, dt: Any, pace: Any, lightness: Any, work: Any
) -> Any:
    """The longest step (s), at most dt, in which nothing is overrun that touches.

    To be called before each step, after the force where the last one ended.

    pace : see `contact.step_limit`; lightness : (n,) 1 / mass of the nodes, 1/kg.
    """
    raise NotImplementedError


def room_for_inertia(model: Any) -> Any:
    """Room for what `contact_inertia` finds; None for models without contact."""
    raise NotImplementedError


def contact_inertia(
    model: Any, added: Any, u: Any, dt: Any, beta: Any, lightness: Any, work: Any
) -> Any:
    """The inertia of contacts that a step from u (n, 3) does not resolve; None without contact.

    added : room for it, as of the last step; beta : radians of a contact's vibration that a step
    may take; lightness : (n,) 1 / mass of the nodes, 1/kg.
    """
    raise NotImplementedError


@overload(place_obstacles, inline="always")
def _no_obstacles(model, factor, work):
    if CONTACT in model.fields or remembers(model):
        return None
    return lambda model, factor, work: None


@overload(contact_powers, inline="always")
def _no_powers(model, v, work):
    if CONTACT in model.fields or remembers(model):
        return None
    return lambda model, v, work: (0.0, 0.0)


@overload(contact_limit, inline="always")
def _no_limit(model, u, v, a, dt, pace, lightness, work):
    if CONTACT in model.fields or remembers(model):
        return None
    return lambda model, u, v, a, dt, pace, lightness, work: dt


@overload(room_for_inertia, inline="always")
def _no_room(model):
    if CONTACT in model.fields:
        return None
    return lambda model: None


@overload(contact_inertia, inline="always")
def _no_inertia(model, added, u, dt, beta, lightness, work):
    if CONTACT in model.fields:
        return None
    return lambda model, added, u, dt, beta, lightness, work: None


@overload(force_of, inline="always")
def _force(model, u, force, work):
    if model.instance_class is BarsHinges:
        return lambda model, u, force, work: internal_force(model, u, force, work)
    return None


@overload(energies_of, inline="always")
def _energies(model, u, work, out):
    if model.instance_class is BarsHinges:
        return lambda model, u, work, out: strain_energies(model, u, out)
    return None


@overload(folds_of, inline="always")
def _folds(model):
    if model.instance_class is BarsHinges:
        return lambda model: (model.hinge_rest, model.hinge_parameters, model.hinge_stiffness)
    return None


def remembers(model: Any) -> bool:
    """Whether a model, given by its type, has laws with memory; those have overloads beside it."""
    return hasattr(model.instance_class, "hinges_with_memory")


@overload(elapse, inline="always")
def _elapse(model, time):
    return None if remembers(model) else lambda model, time: None


@overload(commit, inline="always")
def _commit(model):
    return None if remembers(model) else lambda model: None


@overload(lost_of, inline="always")
def _lost(model):
    return None if remembers(model) else lambda model: 0.0


@overload(recall, inline="always")
def _recall(model, out):
    return None if remembers(model) else lambda model, out: None
