"""Membrane forces and moments of panels, by model."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.condensation import Superelements
from foldyn.condensation.resultants import held_resultants
from foldyn.errors import InputError
from foldyn.shells import Shell
from foldyn.shells.recovery import StressPoints
from foldyn.strength.creases import crease_lengths
from foldyn.strength.loaded import LoadedSheet
from foldyn.strength.plates import PlateResultants, check_plates, has_plates
from foldyn.structures import Structure
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.structures.rigid_plates import rigid_panels

HINGES = (
    ": panels that bend by single hinges and stretch by single bars have no stresses; their forces "
    "only represent those of a sheet. Take superelements, the shell, or the preset n5b8e or plate"
)


class Resultants(Protocol):
    """Membrane forces and moments of a case's panels.

    Attributes
    ----------
    case : Case
        The case with the model that they are computed with.
    points : StressPoints
    """

    case: Case
    points: StressPoints

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """Membrane forces, N/m, and moments, N, (p, 2, 3): components xx, yy, xy.

        q : (m,) dofs of the case's body.
        factors : (k,) of the loads of the case.
        """
        ...


class ShellResultants:
    """Forces and moments of a shell; see `Resultants`."""

    def __init__(self, case: Case) -> None:
        self.case, self._sheet = case, LoadedSheet(case)
        self._shell: Any = case.structure
        self.points = self._shell.stress_points

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `Resultants`."""
        return self._shell.resultants(q, self._sheet.free(factors))


class SuperelementResultants:
    """Forces and moments of superelements, with the shapes for stresses; see `Resultants`."""

    def __init__(self, case: Case) -> None:
        self.case = for_stresses(case)
        self.structure: Any = self.case.structure
        self.points = self.structure.stress_points
        self._sheet = LoadedSheet(self.case)

    @cached_property
    def rows(self) -> sparse.csr_array:
        """Forces and moments (6 p, m) of the dofs."""
        return self.structure.resultants(self.case.held_edges)

    @cached_property
    def crease_rows(self) -> sparse.csr_array:
        """Moments of creases per length (nf, m), N, of the dofs in small motions."""
        turns: Any = self.case.elastic_body.sheet.crease_turns
        per_turn = self.structure.slope / crease_lengths(self.structure)
        return sparse.csr_array(-per_turn[:, None] * turns.mean)

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `Resultants`."""
        held = held_resultants(self.structure.whole, self._sheet.distributed(factors))
        return (self.rows @ q + held).reshape(-1, 2, 3)

    def accelerated(self, axis: int) -> NDArray[np.float64]:
        """What panels with held edges add (6 p,) if all moves with 1 m/s2 along an axis."""
        structure = self.structure
        mass = structure.sheet.values("areal_density", len(structure.pattern.faces))
        force = np.zeros((len(mass), 3))
        force[:, axis] = -mass * structure.board_share
        return held_resultants(structure.whole, Distributed(panels=force))


def for_stresses(case: Case) -> Case:
    """The case with the model that its stresses are computed with."""
    structure = case.structure
    if not isinstance(structure, Superelements) or structure.finer is not None:
        return case
    return case.altered(structure=structure.for_stresses)


def has_stresses(structure: Discretized) -> bool:
    """Whether the panels of a structure have stresses."""
    hinged = isinstance(structure, Structure) and not has_plates(structure)
    return structure.pattern is not None and not hinged


def without_rigid(case: Case, points: StressPoints, resultants: NDArray) -> NDArray:
    """Forces and moments (..., p, 2, 3), which are 0 in rigid panels."""
    structure = case.structure
    rigid = rigid_panels(structure.options.rigid, len(structure.pattern.faces))
    return np.where(np.isin(points.panel, list(rigid))[:, None, None], 0.0, resultants)


def check_stresses(case: Case, field: str) -> None:
    """Refuse a case that has no stresses, or moments of creases, for any of its results."""
    if case.structure.pattern is None:
        raise InputError(": the structure has no pattern, and so no panels", field)
    if case.remembering:
        raise InputError(
            ": the creases have a law with memory, which stresses do not follow: take an elastic "
            "law",
            field,
        )
    if isinstance(case.structure, Structure) and has_stresses(case.structure):
        check_plates(case, field)


def resultants_of(case: Case) -> Resultants:
    """How the panels of a case have their forces and moments.

    Raises
    ------
    InputError
        Panels without stresses.
    """
    structure = case.structure
    if isinstance(structure, Superelements):
        return SuperelementResultants(case)
    if isinstance(structure, Shell):
        return ShellResultants(case)
    if has_stresses(structure):
        return PlateResultants(case)
    raise InputError(HINGES, "model")
