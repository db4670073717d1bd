"""The lowest modes of a shell, extrapolated in mesh size, as the reference for models."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import convergence, limits
from foldyn.arguments import Unit, brief
from foldyn.cases import Case
from foldyn.errors import FoldynWarning
from foldyn.linear.modes import modes
from foldyn.linear.pairing import pairs
from foldyn.structures.discretized import Discretized

DIVISIONS = (6, 12)  # of every edge in the two finer meshes; a third one is half as fine
SPARE = 3  # extra modes of each mesh, which may swap with the ones compared
RIGID = 6  # most modes without stiffness of a sheet
SAME_PLACE = 1e-6  # of the pattern's size: largest distance of a matching node
FLAT = np.cos(np.radians(5.0))  # of the normals of panels nearly in one plane
NO_LIMIT = (
    "a panel touches a clamped edge at vertex {} alone, folded against it, where frequencies have "
    "no limit: meshes and programs differ by 20 %"
)


class MeshModes(NamedTuple):
    """Elastic modes of a shell on one mesh.

    Attributes
    ----------
    structure : Discretized
    frequency : (k,)
        Hz, increasing.
    shape : (k, n, 3)
    found : xarray.Dataset
        All modes computed, rigid ones included; empty if nothing can move.
    """

    structure: Discretized
    frequency: NDArray
    shape: NDArray
    found: xarray.Dataset

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Which points (m, 3) are nodes of the mesh (j,), and the shapes there (k, j, 3)."""
        from scipy.spatial import cKDTree

        apart, place = cKDTree(self.structure.nodes).query(nodes)
        seen = np.flatnonzero(apart < SAME_PLACE * self.structure.pattern.size)
        return seen, self.shape[:, place[seen]]


def mesh_modes(case: Case, count: int) -> MeshModes:
    """The lowest elastic modes on the mesh of a case: `count`, and a few spare ones."""
    structure = case.structure
    if not len(case.free_dofs):  # in a coarse mesh
        still = np.zeros((0, *structure.nodes.shape))
        return MeshModes(structure, np.zeros(0), still, xarray.Dataset())
    found = modes_at_rest(case, count + SPARE)
    return MeshModes(structure, *elastic(found, count + SPARE), found)


def same_modes(own: MeshModes, meshes: Sequence[MeshModes], count: int) -> NDArray[np.float64]:
    """Frequencies (meshes, k) of the lowest modes on one mesh, and of the same modes on others.

    Modes are paired by their shapes at the nodes that two meshes share, since a coarse mesh may
    swap close modes. At most `count`; nan for modes that a mesh lacks.
    """
    first, k = own.frequency[:count], min(count, len(own.frequency))
    frequencies = np.full((len(meshes), k), np.nan)
    for row, mesh in zip(frequencies, meshes, strict=True):
        seen, shape = own.at(mesh.structure.nodes)
        weights = np.ones(len(seen))
        for pair in pairs(first, shape[:k], mesh.frequency, mesh.shape[:, seen], weights):
            row[pair.first] = mesh.frequency[pair.second]
    return frequencies


@brief
@dataclass(frozen=True, eq=False)
class Reference:
    """Elastic modes of a shell.

    Attributes
    ----------
    frequency : (k,)
        Frequencies extrapolated from the meshes, Hz.
    mesh_error : (k,)
        Relative errors of the finest mesh, by the order observed with the two coarser ones; nan if
        the meshes have not converged, or there is no limit.
    mesh_frequency : (3, k)
        Frequencies of these modes on each mesh, Hz; nan if a coarse mesh lacks one.
    shape : (k, n, 3)
        Shapes of the fine mesh.
    case : Case
        The case with the shell of the fine mesh.
    found : xarray.Dataset
        All modes of this mesh, rigid ones included.
    """

    frequency: Annotated[NDArray, Unit("Hz")]
    mesh_error: NDArray
    mesh_frequency: NDArray
    shape: NDArray
    case: Case
    found: xarray.Dataset

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Which points (m, 3) are nodes of the mesh (j,), and the shapes there (k, j, 3)."""
        return MeshModes(self.case.structure, self.frequency, self.shape, self.found).at(nodes)


def elastic(
    found: xarray.Dataset, count: int | None = None, shape: str = "shape"
) -> tuple[NDArray, NDArray]:
    """Frequencies (k,), Hz, and shapes (k, n, 3) of the modes with stiffness."""
    kept = np.flatnonzero(found["eigenvalue"].values > 0.0)[:count]
    return found["frequency"].values[kept], found[shape].values[kept]


def modes_at_rest(
    case: Case, count: int, secant: float | None = None, internal: int = 0
) -> xarray.Dataset:
    """At least `count` elastic modes of a case about rest, or as many as it has.

    Warnings about the case's loads are suppressed: none acts at rest.
    """
    asked = min(count + RIGID, len(case.free_dofs))
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = modes(case, asked, secant=secant, internal=internal)
        missing = count - int((found["eigenvalue"].values > 0.0).sum())
        most = int(found.attrs["free_dofs"])  # includes internal amplitudes
        if missing <= 0 or asked == most:
            return found
        asked = min(max(asked + missing, 2 * asked), most)


def reference_modes(cases: Sequence[Case], count: int) -> Reference:
    """The lowest elastic modes of a shell, from three meshes with the same supports.

    Parameters
    ----------
    cases : (Case, Case, Case)
        Shells of increasing `divisions`. The last two give the frequencies, all three their error;
        with a vertex radius all three give both, since such meshes have an order below 2.
    count : int
        Number of modes, at most as many as the last two meshes have.
    """
    _, coarse, fine = meshes = [mesh_modes(case, count) for case in cases]
    values = same_modes(fine, meshes, min(count, len(coarse.frequency)))
    divisions = [case.structure.options.divisions for case in cases]
    limit = limits(values, divisions, observed=is_graded(cases[-1]))
    error = values[2] / convergence(values, divisions).limit - 1.0
    if touched_clamp(cases[-1].structure) is not None:
        error[:] = np.nan
    rank = np.argsort(limit, kind="stable")  # extrapolation may swap close modes of a coarse mesh
    return Reference(
        limit[rank], error[rank], values[:, rank], fine.shape[rank], cases[-1], fine.found
    )


def is_graded(case: Case) -> bool:
    """Whether the mesh of a case's shell has a vertex radius."""
    return case.structure.options.vertex_radius is not None


def touched_clamp(structure: Discretized) -> int | None:
    """A vertex at which a panel only touches the clamped edges of others, folded against them.

    Its membrane meets the clamp at this point, which holds it more strongly the finer the mesh is
    there; with a vertex radius the result depends on the radius.
    """
    pattern, clamped = structure.pattern, [set(edge) for edge in structure.options.clamped]
    for vertex in sorted(set().union(*clamped)):
        edges = [edge for edge in clamped if vertex in edge]
        about = [face for face in pattern.faces if vertex in face]
        held = np.array([any(edge <= set(face) for edge in edges) for face in about])
        normals = np.array([_normal(pattern.vertices[list(face)]) for face in about])
        along = np.abs(normals @ normals[held].T)
        if (along.max(axis=1) < FLAT).any():
            return int(vertex)
    return None


def _normal(corners: NDArray) -> NDArray:
    """Unit normal (3,) of a panel with corners (k, 3)."""
    twice = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return twice / np.linalg.norm(twice)
