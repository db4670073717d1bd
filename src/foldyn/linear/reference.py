"""The lowest modes of a shell, extrapolated in the size of its mesh, to compare models with."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.cases import Case
from foldyn.errors import FoldynWarning
from foldyn.linear.modes import modes
from foldyn.values import brief

DIVISIONS = (6, 12)  # of every edge in the two meshes
RIGID = 6  # modes without stiffness that a sheet may have
SAME_PLACE = 1e-6  # of the pattern's size: how near a node of the mesh must be


@brief
@dataclass(frozen=True, eq=False)
class Reference:
    """Elastic modes of a shell.

    Attributes
    ----------
    frequency, coarse, fine : (k,)
        Frequencies extrapolated from two meshes, and those of the meshes, Hz.
    shape : (k, n, 3)
        Shapes of the fine mesh.
    case : Case
        The shell of the fine mesh, held.
    found : xarray.Dataset
        Its modes as they were computed, rigid ones included.
    """

    frequency: NDArray
    coarse: NDArray
    fine: NDArray
    shape: NDArray
    case: Case
    found: xarray.Dataset

    @property
    def mesh_error(self) -> NDArray:
        """Relative errors (k,) of the fine mesh against the extrapolated frequencies."""
        return self.fine / self.frequency - 1.0

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Which of points (m, 3) are nodes of the mesh (j,), and the shapes there (k, j, 3)."""
        from scipy.spatial import cKDTree

        structure = self.case.structure
        apart, place = cKDTree(structure.nodes).query(nodes)
        seen = np.flatnonzero(apart < SAME_PLACE * structure.pattern.size)
        return seen, self.shape[:, place[seen]]


def elastic(
    found: xarray.Dataset, count: int | None = None, shape: str = "shape"
) -> tuple[NDArray, NDArray]:
    """Frequencies (k,), Hz, and shapes (k, n, 3) of the modes that something resists."""
    kept = np.flatnonzero(found["eigenvalue"].values > 0.0)[:count]
    return found["frequency"].values[kept], found[shape].values[kept]


def modes_at_rest(
    case: Case, count: int, secant: float | None = None, internal: int = 0
) -> xarray.Dataset:
    """At least `count` elastic modes of a case about its rest state, as far as it has as many.

    What the case's loads would warn of is left unsaid: none acts at rest.
    """
    asked = min(count + RIGID, len(case.free_dofs))
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = modes(case, asked, secant=secant, internal=internal)
        missing = count - int((found["eigenvalue"].values > 0.0).sum())
        most = int(found.attrs["free_dofs"])  # with internal amplitudes among them
        if missing <= 0 or asked == most:
            return found
        asked = min(max(asked + missing, 2 * asked), most)


def reference_modes(coarse: Case, fine: Case, count: int) -> Reference:
    """The lowest elastic modes of a shell, from two meshes of it, held alike.

    Parameters
    ----------
    coarse, fine : Case
        Shells of different `divisions`.
    count : int
        How many modes, if both have as many.
    """
    (low, _), found = elastic(modes_at_rest(coarse, count), count), modes_at_rest(fine, count)
    high, shape = elastic(found, count)
    k = min(len(low), len(high))
    ratio = fine.structure.options.divisions / coarse.structure.options.divisions
    limit = extrapolated(low[:k], high[:k], ratio)
    rank = np.argsort(limit, kind="stable")  # which close modes of a coarse mesh may change
    return Reference(limit[rank], low[rank], high[rank], shape[rank], fine, found)
