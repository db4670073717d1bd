"""What moves with the superposed motions of a drive: nodes, supports, panels and creases.

A quantity is the sum over powers p of (i w)^p R_p a(w), in which a has the amplitudes of the
motions that a drive superposes, with two more columns: the displacement of the base, and the drive
itself (the acceleration of the base, or the factor of the forces).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.linear.excitation import Drive
from foldyn.linear.frequency_domain import ModalResponse, SuperposedModes
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.stresses import small_motions
from foldyn.strength.dataset import MISES, face_stresses, point_coordinates
from foldyn.strength.resultants import (
    SuperelementResultants,
    check_stresses,
    for_stresses,
    has_stresses,
    resultants_of,
    without_rigid,
)


class Amounts(NamedTuple):
    """How much of a quantity belongs to each column of a drive."""

    rows: NDArray  # (powers, k, c) R_p of the k parts of the quantity
    powers: tuple[int, ...] = (0,)


class Parts:
    """A linearized case, and the quantities of its motions.

    Parameters
    ----------
    case, state, load_factor
        As in `linearize`.
    stresses, reactions : bool
        Which quantities are wanted beside displacements and accelerations.
    """

    def __init__(
        self, case: Case, state: State | str | None, *, load_factor: float, stresses: bool,
        reactions: bool,
    ) -> None:  # fmt: skip
        own, self._model = case, None
        if stresses:
            check_stresses(case, "stresses")
            own = for_stresses(case)
            self._model = resultants_of(own) if has_stresses(own.structure) else None
        self.system = linearize(own, state, load_factor=load_factor)
        self._at_rest, self._stresses, self._reactions = state is None, stresses, reactions
        if reactions:
            _check_reactions(self.system)

    @property
    def coordinates(self) -> dict[str, Any]:
        """Coordinates of the points of stresses."""
        return {} if self._model is None else point_coordinates(self._model.points)

    def amounts(self, drive: Drive, response: ModalResponse) -> dict[str, Amounts]:
        """All quantities by name."""
        found = _moving(self.system, drive, response)
        if self._reactions:
            found |= _reacting(self.system, drive, response)
        return found | self._stressed(drive, response) if self._stresses else found

    def _stressed(self, drive: Drive, response: ModalResponse) -> dict[str, Amounts]:
        """Forces and moments of panels, what makes up von Mises stresses, and creases' moments."""
        system, model = self.system, self._model
        motions, axis = system.whole(response.motions), drive.axis
        panels, creases = small_motions(
            system.case, model, system.displacement, motions, self._at_rest
        )
        rows = {"crease_moment": np.pad(creases, ((0, 2), (0, 0))).T}
        if panels is not None and model is not None:
            carried = np.zeros((2, *panels.shape[1:]))
            if axis is not None and isinstance(model, SuperelementResultants):
                carried[1] = model.accelerated(AXES.index(axis)).reshape(carried.shape[1:])
            panels = without_rigid(system.case, model.points, np.concatenate([panels, carried]))
            force, moment = np.moveaxis(panels, (2, 0), (0, -1))
            stress = np.moveaxis(face_stresses(panels, model.points.thickness), 0, -1)
            equivalent = np.einsum("ca,pfas->pfcs", np.linalg.cholesky(MISES).T, stress)
            rows |= {"membrane_force": force, "bending_moment": moment, "von_mises": equivalent}
        return {name: Amounts(own.reshape(1, -1, own.shape[-1])) for name, own in rows.items()}


def squared_parts(name: str, squares: NDArray) -> NDArray[np.float64]:
    """Mean squares (..., k) of a quantity from those of its parts.

    Those of the three combinations of components that make up a von Mises stress add up.
    """
    if name != "von_mises":
        return squares
    return squares[..., ::3] + squares[..., 1::3] + squares[..., 2::3]


def covered_mass(modes: SuperposedModes, moved: NDArray, axis: int, top: float) -> float:
    """Share of the mass that moves along an axis in the modes up to a frequency (Hz).

    moved : (nf,) forces on the free dofs if the whole structure has unit acceleration, kg.
    """
    system, basis = modes.system, modes.basis
    modal = basis.inertia > 0.0
    effective = (basis.shapes[:, modal].T @ moved) ** 2
    within = np.sqrt(basis.values[modal].clip(0.0)) <= 2.0 * np.pi * top
    along = (system.free < system.displacement.size) & (system.free % 3 == axis)
    whole = float(moved[along].sum())  # 0 if only edges and panels between held nodes move
    return float(effective[within].sum()) / whole if whole > 0.0 else 1.0


def _moving(system: Linearized, drive: Drive, response: ModalResponse) -> dict[str, Amounts]:
    """Displacements relative to the base, and absolute accelerations, of all nodes."""
    motions = np.pad(system.expanded(response.motions), ((0, 0), (0, 2)))
    absolute = motions
    if drive.axis is not None:
        absolute = motions.copy()
        absolute[AXES.index(drive.axis) :: 3, -2] = 1.0
    return {"displacement": Amounts(motions[None]), "acceleration": Amounts(absolute[None], (2,))}


def _check_reactions(system: Linearized) -> None:
    if system.responding is not None:
        raise InputError(
            ": creases with memory, or with dampers between compliant panels, push back with a "
            "force that depends on the frequency, which reactions leave out; take reactions = "
            "False, or an elastic law and Rayleigh or ModalDamping",
            "reactions",
        )
    if not system.reacting.held.shape[0]:
        raise InputError(": no support holds the case; take reactions = False", "reactions")


def _reacting(system: Linearized, drive: Drive, response: ModalResponse) -> dict[str, Amounts]:
    """Forces of supports: K x + C x' + M x'' of the absolute motion, less what drives them."""
    motions = np.pad(system.whole(response.motions), ((0, 0), (0, 2)))
    nodes = system.displacement.size
    if drive.axis is not None:
        motions[AXES.index(drive.axis) : nodes : 3, -2] = 1.0
    rows = system.reacting.of(motions)
    if drive.axis is None:
        rows[0, :, -1] -= system.reacting.held @ drive.vector.ravel()
    along = np.arange(3)[:, None] == system.case.reaction_dofs % 3
    total = along.astype(float) @ rows
    return {"reaction": Amounts(rows, (0, 1, 2)), "total_reaction": Amounts(total, (0, 1, 2))}
