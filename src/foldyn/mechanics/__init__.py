"""Compiled mechanics of bars and hinges: energy, internal force, tangent."""

from foldyn.mechanics.energy import angles, strain_energies
from foldyn.mechanics.force import Workspace, internal_force, workspace, workspaces
from foldyn.mechanics.model import BarsHinges, Hinges, build
from foldyn.mechanics.renumber import node_order, renumber
from foldyn.mechanics.tangent import Sparsity, add_tangent, sparsity, tangent
from foldyn.mechanics.threads import (
    largest,
    part,
    run_together,
    threads_for,
    total,
    wait,
)

__all__ = [
    "BarsHinges",
    "Hinges",
    "Sparsity",
    "Workspace",
    "add_tangent",
    "angles",
    "build",
    "internal_force",
    "largest",
    "node_order",
    "part",
    "renumber",
    "run_together",
    "sparsity",
    "strain_energies",
    "tangent",
    "threads_for",
    "total",
    "wait",
    "workspace",
    "workspaces",
]
