"""How far a mesh is from what finer ones tend to, from it and a coarser one."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.cases import Case
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.modes import modes

MODES = 3
FINE = 16  # pieces: beyond, errors are below 0.5 % and the judgement is dear


class Refinement(NamedTuple):
    """Lowest frequencies of a structure with a mesh, and what finer meshes tend to."""

    divisions: int
    frequency: NDArray[np.float64]  # (k,) Hz
    extrapolated: NDArray[np.float64]  # (k,) Hz

    @property
    def error(self) -> float:
        """The largest error of these frequencies; negative where the mesh is too soft."""
        errors = self.frequency / self.extrapolated - 1.0
        return float(errors[np.abs(errors).argmax()])

    def facts(self) -> dict[str, Any]:
        """What a result says of its mesh: attributes."""
        return {
            "mesh_error": self.error,
            "mesh_frequencies": self.frequency,
            "extrapolated": self.extrapolated,
        }


def refinement(case: Case, count: int = MODES) -> Refinement | None:
    """Judge the mesh of a case by its lowest elastic frequencies at rest.

    Parameters
    ----------
    case : Case
        Its supports count, its loads do not. The sheet needs no density here.
    count : int
        How many frequencies.

    Returns
    -------
    Refinement or None
        None where the structure has no mesh that could be finer, where its mesh is the coarsest
        there is or is fine enough (more than 16 pieces of every edge), or where supports are given
        by nodes that a coarser mesh does not have.
    """
    structure = case.structure
    coarser = structure.coarser
    if coarser is None or structure.options.divisions > FINE:
        return None
    try:
        fine, coarse = (_frequencies(case, one, count) for one in (structure, coarser))
    except InputError:  # nodes beyond the vertices
        return None
    if len(fine) != len(coarse) or not len(fine):
        return None
    ratio = structure.options.divisions / coarser.options.divisions
    return Refinement(structure.options.divisions, fine, extrapolated(coarse, fine, ratio))


def _frequencies(case: Case, structure: Any, count: int) -> NDArray[np.float64]:
    if structure.sheet.density is None:
        structure = replace(structure, sheet=replace(structure.sheet, density=1.0))
    bare = replace(case, structure=structure, loads=())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        found = modes(bare, count + 6)
    elastic = found["frequency"].values[found["eigenvalue"].values > 0.0]
    return elastic[:count]
