# Public names and where they live; loaded with the package (facade.py)

from foldyn.mechanics.energy import angles as angles, strain_energies as strain_energies
from foldyn.mechanics.force import (
    ForceScratch as ForceScratch,
    force_scratch as force_scratch,
    force_scratches as force_scratches,
    internal_force as internal_force,
)
from foldyn.mechanics.model import BarsHinges as BarsHinges, Hinges as Hinges, build as build
from foldyn.mechanics.tangent import Sparsity as Sparsity, sparsity as sparsity, tangent as tangent
from foldyn.mechanics.threads import threads_for as threads_for
