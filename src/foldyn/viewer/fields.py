"""Fields that color a sheet on a page, at all samples of a motion or path."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.sampling import CONTACT_FORCE
from foldyn.errors import ComputationError
from foldyn.structures import Structure
from foldyn.viewer.states import (
    bar_strain,
    creases_known,
    energy_density,
    memory_acts,
    states,
)


class Field(NamedTuple):
    """Values (samples, elements) with texts for the legend.

    on : "node", "panel", "crease" or "bar".
    signed : whether both signs occur.
    """

    label: str
    unit: str
    on: str
    values: NDArray
    signed: bool


def fields(case: Case, result: Any, displacement: NDArray) -> dict[str, Field]:
    """Fields of a motion or path with displacements (samples, n, 3), by name.

    Fields that displacements do not determine are left out: moments and energies if laws have
    memory, and also crease angles if panels yield next to such creases or, in motions, next to
    damped ones, or reach no equilibrium. Speeds are not included: the page computes them from
    displacements.
    """
    structure, out = case.structure, {}
    if CONTACT_FORCE in result:
        touch = result[CONTACT_FORCE].values
        out["contact"] = Field("force of contact", "N", "node", touch, False)
    if isinstance(structure, Structure):
        out["bar_strain"] = _strain_field(bar_strain(structure, displacement))
    if not creases_known(case, result):
        return out
    try:
        found = states(case, result, displacement)
    except ComputationError:  # a motion that has diverged: its panels no longer reach equilibrium
        return out
    turn = np.degrees(found.turn)
    out["turn"] = Field("turn of creases from rest", "°", "crease", turn, True)
    if not memory_acts(case, result):
        out["fold_moment"] = Field("moment of creases", "N m", "crease", found.moment, True)
        density = energy_density(structure, displacement, found)
        out["energy"] = Field("strain energy per area", "J/m²", "panel", density, False)
    return out


def folding_fields(case: Case, displacement: NDArray, fold_angle: NDArray) -> dict[str, Field]:
    """Fields of a folding by name: fold angles (samples, nc), rad; it has no sheet."""
    angle = np.degrees(fold_angle)
    return {
        "bar_strain": _strain_field(bar_strain(case.structure, displacement)),
        "turn": Field("fold angle of creases, valleys positive", "°", "crease", angle, True),
    }


def _strain_field(strain: NDArray) -> Field:
    return Field("strain of bars", "1", "bar", strain, True)


def energies(case: Case, result: Any) -> dict[str, NDArray]:
    """Energies of a result (samples), J, by name, as far as it has them."""
    names = {"kinetic": "kinetic", **case.energy_groups, "dissipated": "dissipated"}
    names |= {"air": "lost to the air", "work": "work"}
    return {
        text.removeprefix("strain energy of ").removeprefix("the "): np.asarray(result[name])
        for name, text in names.items()
        if name in result
    }
