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
