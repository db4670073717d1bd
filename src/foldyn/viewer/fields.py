"""Values that color a sheet on a page, at all samples of a motion or path."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.mechanics import angles
from foldyn.structures import Structure


class Field(NamedTuple):
    """Values (samples, elements) with what a legend says of them.

    on : "node", "panel", "crease" or "bar".
    signed : whether both signs occur.
    """

    label: str
    unit: str
    on: str
    values: NDArray
    signed: bool


def fields(case: Case, displacement: NDArray) -> dict[str, Field]:
    """Fields of displacements (samples, n, 3) by name; shells have none.

    Speeds are not among them: the page takes them from displacements.
    """
    structure, out = case.structure, {}
    if not isinstance(structure, Structure):
        return out
    strain = bar_strain(structure, displacement)
    out["bar_strain"] = Field("strain of bars", "1", "bar", strain, True)
    theta = fold_angles(structure, displacement)
    turn = np.degrees(theta - structure.fold_rest)
    out["turn"] = Field("turn of creases from rest", "°", "crease", turn, True)
    if structure.edge_plates is None:  # whose folds turn less than the panels beside them
        moment = structure.fold_stiffness * structure.fold_law.moment(
            theta, np.broadcast_to(structure.fold_rest, theta.shape)
        )
        out["fold_moment"] = Field("moment of creases", "N m", "crease", moment, True)
    return out


def bar_strain(structure: Structure, displacement: NDArray) -> NDArray:
    """Elongation of bars over their length (samples, nb)."""
    i, j = structure.bars.T
    apart = structure.nodes[j] - structure.nodes[i] + displacement[:, j] - displacement[:, i]
    return np.linalg.norm(apart, axis=2) / structure.bar_length - 1.0


def fold_angles(structure: Structure, displacement: NDArray) -> NDArray:
    """Dihedrals (samples, nf) of the folds, rad."""
    rows = structure.folds.astype(np.uint32)
    return np.array([angles(structure.nodes + u, rows) for u in displacement]).reshape(
        len(displacement), len(rows)
    )


def energies(case: Case, result: Any) -> dict[str, NDArray]:
    """Energies of a result (samples), J, by what they are, those that it has."""
    names = {"kinetic": "kinetic", **case.energy_groups, "dissipated": "dissipated", "work": "work"}
    return {
        text.removeprefix("strain energy of ").removeprefix("the "): np.asarray(result[name])
        for name, text in names.items()
        if name in result
    }
