"""Compiled mechanics of bars and hinges: energy, internal force, tangent."""

from foldyn.mechanics.energy import angles, strain_energies
from foldyn.mechanics.force import (
    ForceScratch,
    force_scratch,
    force_scratches,
    internal_force,
)
from foldyn.mechanics.model import BarsHinges, Hinges, build
from foldyn.mechanics.tangent import Sparsity, sparsity, tangent
from foldyn.mechanics.threads import threads_for

__all__ = [
    "BarsHinges",
    "ForceScratch",
    "Hinges",
    "Sparsity",
    "angles",
    "build",
    "force_scratch",
    "force_scratches",
    "internal_force",
    "sparsity",
    "strain_energies",
    "tangent",
    "threads_for",
]
