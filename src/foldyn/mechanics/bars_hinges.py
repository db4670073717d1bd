"""Bars and hinges as a term of a model; see `mechanics.term`."""

from __future__ import annotations

from typing import NamedTuple

from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.discrete_gradient import add_bar_forces, add_hinge_forces
from foldyn.mechanics.energy import strain_energies
from foldyn.mechanics.force import ForceScratch, internal_force
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    energies,
    forces,
    mean_forces,
)


class _Context(NamedTuple):
    model: BarsHinges
    scratch: ForceScratch
    groups: int


@forces
def _forces(own, u, v, t, force, powers):
    rows = own.model.rest.shape[0]
    internal_force(own.model, rows_at(u, rows), rows_at(force, rows), own.scratch)


@energies
def _energies(own, u, out):
    moved = rows_at(u, own.model.rest.shape[0])
    strain_energies(own.model, moved, numbers_at(out, own.groups))


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    rows, angle = own.model.rest.shape[0], own.scratch.angle
    start, end, out = rows_at(u0, rows), rows_at(u1, rows), rows_at(force, rows)
    add_bar_forces(own.model, start, end, out)
    add_hinge_forces(own.model, start, end, numbers_at(before, angle.size), angle, out)


def bars_hinges_kernels(model: BarsHinges, scratch: ForceScratch, groups: int) -> CompiledTerm:
    """Compiled bars and hinges, with `groups` energy groups."""
    own = Context(_Context(model, scratch, groups))
    return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})
