"""How far a mesh is from what finer ones tend to, from it and others of the same pattern."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import convergence
from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.linear.reference import MeshModes, mesh_modes, same_modes, touched_clamp

MODES = 3
FINE = 16  # pieces: beyond, the judgement is dear


class Refinement(NamedTuple):
    """Lowest frequencies of a structure on three meshes, and what finer meshes tend to."""

    divisions: int  # of the structure
    meshes: tuple[int, ...]  # (3,) pieces of every edge, increasing: its own among them
    frequencies: NDArray[np.float64]  # (3, k) Hz
    order: NDArray[np.float64]  # (k,) that the meshes show; nan: they have not converged
    extrapolated: NDArray[np.float64]  # (k,) Hz; nan likewise
    touched: int | None  # vertex at which there is no limit; see `touched_clamp`

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies (k,) of the structure, Hz."""
        return self.frequencies[self.meshes.index(self.divisions)]

    @property
    def error(self) -> float:
        """The largest error of these frequencies, negative where the mesh is too soft.

        nan where one of them has not converged.
        """
        errors = self.frequency / self.extrapolated - 1.0
        return float(errors[np.abs(errors).argmax()])

    @property
    def changes(self) -> NDArray[np.float64]:
        """Relative changes (2,) from mesh to mesh of a frequency that has not converged, or of one.

        Of that which changes most in the end; nan where a mesh does not have it.
        """
        changes = self.frequencies[1:] / self.frequencies[:-1] - 1.0
        return changes[:, (np.isnan(self.order) + np.abs(changes[1])).argmax()]

    def facts(self) -> dict[str, Any]:
        """What a result says of its mesh: attributes."""
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
        From this mesh and two with half and a quarter of its pieces of every edge; where there
        are no such meshes, finer ones stand in. None where the structure has no mesh, where that
        is fine (more than 16 pieces of every edge), or where supports are given by nodes that
        another mesh does not have.
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
    """Pieces of every edge in three meshes: the same, half as many, a quarter."""
    coarser = [divisions >> halvings for halvings in range(3) if divisions >> halvings]
    return tuple(sorted([*coarser, *(divisions << k + 1 for k in range(3 - len(coarser)))]))


def _modes(case: Case, structure: Any, count: int) -> MeshModes:
    if structure.sheet.density is None:
        structure = replace(structure, sheet=replace(structure.sheet, density=1.0))
    bare = replace(case, structure=structure, loads=(), contact=None, air=None)
    return mesh_modes(bare, count)
