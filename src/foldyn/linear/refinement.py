"""Convergence of a mesh, estimated from it and other meshes of the same pattern."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import convergence
from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.linear.reference import MeshModes, mesh_modes, same_modes, touched_clamp
from foldyn.structures.discretized import Discretized

MODES = 3
FINE = 16  # pieces: beyond, the estimate is expensive


class Refinement(NamedTuple):
    """Lowest frequencies of a structure on three meshes, and their extrapolated limits."""

    divisions: int  # of the structure
    meshes: tuple[int, ...]  # (3,) pieces of every edge, increasing, `divisions` among them
    frequencies: NDArray[np.float64]  # (3, k) Hz
    order: NDArray[np.float64]  # (k,) observed order; nan: not converged
    extrapolated: NDArray[np.float64]  # (k,) Hz; nan likewise
    touched: int | None  # vertex at which there is no limit; see `touched_clamp`

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies (k,) of the structure, Hz."""
        return self.frequencies[self.meshes.index(self.divisions)]

    @property
    def error(self) -> float:
        """The largest error of these frequencies, negative if the mesh is too soft.

        nan if one of them has not converged.
        """
        errors = self.frequency / self.extrapolated - 1.0
        return float(errors[np.abs(errors).argmax()])

    @property
    def changes(self) -> NDArray[np.float64]:
        """Relative changes (2,) between meshes of one frequency, if possible one not converged.

        This is the one that changes most in the last step; nan if a mesh lacks it.
        """
        changes = self.frequencies[1:] / self.frequencies[:-1] - 1.0
        return changes[:, (np.isnan(self.order) + np.abs(changes[1])).argmax()]

    def facts(self) -> dict[str, Any]:
        """Attributes of a result that describe its mesh."""
        return {
            "mesh_error": self.error,
            "mesh_frequencies": self.frequency,
            "mesh_divisions": list(self.meshes),
            "mesh_order": self.order,
            "mesh_changes": self.changes,
            "extrapolated": self.extrapolated,
            **({} if self.touched is None else {"touched_clamp": self.touched}),
        }


def refinement(case: Case, count: int = MODES) -> Refinement | None:
    """Estimate the error of a case's mesh from its lowest elastic frequencies at rest.

    Parameters
    ----------
    case : Case
        Its supports matter, its loads do not. The sheet needs no density here.
    count : int
        How many frequencies.

    Returns
    -------
    Refinement or None
        From this mesh and two with half and a quarter of its pieces per edge, or finer ones if
        there are no such meshes. None if the structure has no mesh, if its mesh is fine (more than
        16 pieces per edge), or if supports are given by nodes that another mesh lacks.
    """
    structure = case.structure
    divisions = structure.divisions
    if divisions is None or divisions > FINE:
        return None
    meshes = _meshes(divisions)
    try:
        found = {n: _modes(case, structure.meshed(n), count) for n in meshes}
    except InputError:  # nodes beyond the vertices
        return None
    frequencies = same_modes(found[divisions], list(found.values()), count)
    if not frequencies.size:
        return None
    order, limit = convergence(frequencies, meshes)
    touched = touched_clamp(structure)
    if touched is not None:
        order[:] = limit[:] = np.nan
    return Refinement(divisions, meshes, frequencies, order, limit, touched)


def _meshes(divisions: int) -> tuple[int, ...]:
    """Pieces of every edge in three meshes: `divisions`, half and a quarter, or finer ones."""
    coarser = [divisions >> halvings for halvings in range(3) if divisions >> halvings]
    return tuple(sorted([*coarser, *(divisions << k + 1 for k in range(3 - len(coarser)))]))


def _modes(case: Case, structure: Discretized, count: int) -> MeshModes:
    """Elastic modes of a case on another mesh, without loads, contact and air."""
    if structure.sheet.density is None:
        structure = replace(structure, sheet=replace(structure.sheet, density=1.0))
    bare = replace(case, structure=structure, loads=(), contact=None, air=None)
    return mesh_modes(bare, count)
