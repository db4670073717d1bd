"""The lowest modes of a shell, extrapolated in mesh size: the reference for models.

Modes of a model are paired with the modes of the shell. The error of the mesh of a case is also
estimated here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import convergence, limits
from foldyn.arguments import Unit, brief
from foldyn.cases import Case
from foldyn.errors import InputError, quietly
from foldyn.linear.mac import pairs, same_places
from foldyn.linear.model_error import LEAST, SPARE
from foldyn.linear.modes import elastic, modes, points_of
from foldyn.linear.shell_of import with_structure
from foldyn.structures.discretized import Discretized

SWAPPED = 3  # additional modes of each mesh, as they may swap with the compared modes
RIGID = 6  # most modes of a sheet without stiffness
FLAT = np.cos(np.radians(5.0))  # cosine between the normals of panels nearly in one plane
NO_LIMIT = (
    "a panel touches a clamped edge at vertex {} alone, folded against it, where frequencies have "
    "no limit: meshes and programs differ by 20 %"
)
MODES = 3
FINE = 16  # pieces per edge: with more, the estimate is expensive


class MeshModes(NamedTuple):
    """Elastic modes of a shell on one mesh.

    Attributes
    ----------
    structure : Discretized
    frequency : (k,)
        Frequencies, Hz, increasing.
    shape : (k, n, 3)
    found : xarray.Dataset
        All modes computed, rigid modes included; empty if nothing can move.
    """

    structure: Discretized
    frequency: NDArray
    shape: NDArray
    found: xarray.Dataset


def mesh_modes(case: Case, count: int) -> MeshModes:
    """The lowest elastic modes on the mesh of a case: `count`, and a few in reserve."""
    structure = case.structure
    if not len(case.free_dofs):  # possible in a coarse mesh
        still = np.zeros((0, *structure.nodes.shape))
        return MeshModes(structure, np.zeros(0), still, xarray.Dataset())
    found = modes_at_rest(case, count + SWAPPED)
    return MeshModes(structure, *elastic(found, count + SWAPPED), found)


def same_modes(own: MeshModes, meshes: Sequence[MeshModes], count: int) -> NDArray[np.float64]:
    """Frequencies (meshes, k) of the lowest modes on one mesh, and of these modes on others.

    Modes are paired by their shapes at the nodes that two meshes share, since a coarse mesh may
    swap close modes. At most `count`; nan for modes that a mesh lacks.
    """
    first, k = own.frequency[:count], min(count, len(own.frequency))
    frequencies = np.full((len(meshes), k), np.nan)
    for row, mesh in zip(frequencies, meshes, strict=True):
        size = own.structure.pattern.size
        seen, place = same_places(own.structure.nodes, mesh.structure.nodes, size)
        shape, weights = own.shape[:k, place], np.ones(len(seen))
        found = pairs(first, shape, mesh.frequency, mesh.shape[:, seen], weights)
        row[found.first] = mesh.frequency[found.second]
    return frequencies


@brief
@dataclass(frozen=True, eq=False)
class Reference:
    """Elastic modes of a shell, or of superelements.

    Attributes
    ----------
    frequency : (k,)
        Frequencies extrapolated from the meshes, Hz.
    mesh_error : (k,)
        Relative errors: of the finest mesh, from the order of convergence observed with all meshes,
        nan if the meshes have not converged, or there is no limit; of superelements, as they
        estimate them.
    mesh_frequency : (m, k)
        Frequencies of the modes on each mesh, Hz; nan if a coarse mesh lacks a mode.
    shape : (k, p, 3)
        Shapes of the fine mesh.
    points : (p, 3)
        Where the shapes are known, m.
    case : Case
        The case with the shell of the fine mesh, or with superelements.
    found : xarray.Dataset
        All modes of the fine mesh, rigid modes included.
    """

    frequency: Annotated[NDArray, Unit("Hz")]
    mesh_error: NDArray
    mesh_frequency: NDArray
    shape: NDArray
    points: Annotated[NDArray, Unit("m")]
    case: Case
    found: xarray.Dataset

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Numbers (j,) of the points (m, 3) that are nodes of the mesh, and shapes (k, j, 3)."""
        seen, place = same_places(self.points, nodes, self.case.structure.pattern.size)
        return seen, self.shape[:, place]


def modes_at_rest(case: Case, count: int, secant: float | None = None) -> xarray.Dataset:
    """At least `count` elastic modes of a case about rest, or as many as it has.

    Warnings about the case's loads are suppressed: none acts at rest.
    """
    asked = max(min(count + RIGID, len(case.free_dofs)), 1)  # superelements have other dofs, too
    while True:
        with quietly():
            found = modes(case, asked, secant=secant, check_model=False)
        missing = count - int((found["eigenvalue"].values > 0.0).sum())
        most = int(found.attrs["free_dofs"])
        if missing <= 0 or asked == most:
            return found
        asked = min(max(asked + missing, 2 * asked), most)


def reference_modes(cases: Sequence[Case], count: int) -> Reference:
    """The lowest elastic modes of a shell, from three meshes with the same supports.

    Parameters
    ----------
    cases : (Case, Case, Case)
        Shells of increasing `divisions`. Frequencies follow from the last two, their errors from
        all three; with a vertex radius both follow from all three, since such meshes have an order
        below 2.
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
        limit[rank], error[rank], values[:, rank], fine.shape[rank], fine.structure.nodes,
        cases[-1], fine.found,
    )  # fmt: skip


def superelement_modes(case: Case, count: int) -> Reference:
    """The lowest modes of superelements, at most `count`."""
    found = modes_at_rest(case, count)
    frequency, shape = elastic(found, count)
    error = found["frequency_error"].values[found["eigenvalue"].values > 0.0][:count] / frequency
    return Reference(frequency, error, frequency[None], shape, points_of(case, found), case, found)


def is_graded(case: Case) -> bool:
    """Whether the mesh of a case's shell has a vertex radius."""
    return case.structure.options.vertex_radius is not None


def touched_clamp(structure: Discretized) -> int | None:
    """A vertex at which a panel only touches clamped edges of other panels and is folded there.

    The membrane of this panel meets the clamp at a point only. The finer the mesh, the more
    strongly the point holds it; with a vertex radius the result depends on the radius.
    """
    pattern, clamped = structure.pattern, [set(edge) for edge in structure.options.clamped]
    for vertex in sorted(set().union(*clamped)):
        edges = [edge for edge in clamped if vertex in edge]
        about = [p for p, face in enumerate(pattern.faces) if vertex in face]
        held = np.array([any(edge <= set(pattern.faces[p]) for edge in edges) for p in about])
        normals = pattern.face_normals[about]
        along = np.abs(normals @ normals[held].T)
        if (along.max(axis=1) < FLAT).any():
            return int(vertex)
    return None


class Shown(Protocol):
    """Modes of a shell."""

    @property
    def frequency(self) -> NDArray:
        """Frequencies (k,), Hz, increasing."""
        ...

    def at(self, nodes: NDArray) -> tuple[NDArray, NDArray]:
        """Numbers (j,) of the points (m, 3) that have shapes, and these shapes (k, j, 3)."""
        ...


class Matched(NamedTuple):
    """The counterpart in a model of each mode of a shell.

    Attributes
    ----------
    frequency : (k,)
        Frequency of the partner, Hz; nan if the mode is lost, i.e. no MAC is 0.5 or more.
    error : (k,)
        Relative error of this frequency; nan if the mode is lost.
    mac : (k,)
        MAC of the partner, or of the best candidate.
    """

    frequency: NDArray
    error: NDArray
    mac: NDArray


def matched(true: Shown, count: int, case: Case, found: xarray.Dataset) -> Matched:
    """Pair the first modes of a shell with modes of a model.

    Parameters
    ----------
    true : Shown
        Modes of the shell, such as a `Reference`.
    count : int
        Number of modes of the shell.
    case, found : Case, xarray.Dataset
        The model, and its modes, `SPARE` more than `count`. Shapes are compared at the model's
        nodes, of superelements also between these, where the shell's mesh has nodes.
    """
    points, weights = _points(case, found)
    seen, shape = true.at(points)
    wanted = true.frequency[:count]
    frequency, own = elastic(found, count + SPARE)
    partner, mac = np.full(len(wanted), np.nan), np.zeros(len(wanted))
    both = pairs(wanted, shape[:count], frequency, own[:, seen], weights[seen])
    mac[both.first] = both.mac
    alike = both.mac >= LEAST
    partner[both.first[alike]] = frequency[both.second[alike]]
    return Matched(partner, partner / wanted - 1.0, mac)


def _points(case: Case, found: xarray.Dataset) -> tuple[NDArray, NDArray]:
    """Points (p, 3) where modes are compared, and their weights (p,) in the MAC.

    The points are the nodes, with the same weights for all mass rules. Of superelements,
    points between nodes are added; the total weight stays the same.
    """
    structure = case.structure
    even = replace(structure, options=replace(structure.options, mass="mixed_voronoi"))
    weights = with_structure(case, even).nodal_mass
    points = points_of(case, found)
    between = len(points) - len(weights)
    return points, np.append(weights, np.full(between, weights.sum() / max(between, 1)))


class Refinement(NamedTuple):
    """Lowest frequencies of a structure on three meshes, and their extrapolated limits."""

    divisions: int  # pieces of every edge of the structure
    meshes: tuple[int, ...]  # (3,) pieces of every edge, increasing, `divisions` among them
    frequencies: NDArray[np.float64]  # (3, k) Hz
    order: NDArray[np.float64]  # (k,) observed order; nan: not converged
    extrapolated: NDArray[np.float64]  # (k,) Hz; nan: not converged
    touched: int | None  # vertex because of which frequencies have no limit; see `touched_clamp`

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies (k,) of the structure, Hz."""
        return self.frequencies[self.meshes.index(self.divisions)]

    @property
    def error(self) -> float:
        """The largest relative error of `frequency`; negative if the mesh is too soft.

        nan if a frequency has not converged.
        """
        errors = self.frequency / self.extrapolated - 1.0
        return float(errors[np.abs(errors).argmax()])

    @property
    def changes(self) -> NDArray[np.float64]:
        """Relative changes (2,), from mesh to mesh, of the frequency that changes most at the end.

        A frequency that has not converged is preferred; nan if a mesh lacks the frequency.
        """
        changes = self.frequencies[1:] / self.frequencies[:-1] - 1.0
        return changes[:, (np.isnan(self.order) + np.abs(changes[1])).argmax()]

    def facts(self) -> dict[str, Any]:
        """Attributes for results, which describe the mesh."""
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
        The case; only its structure and supports matter. The sheet needs no density here.
    count : int
        Number of frequencies.

    Returns
    -------
    Refinement or None
        Estimate from this mesh and two meshes with half and a quarter of its pieces per edge, or
        from finer meshes if coarser meshes do not exist. None if the structure has no mesh, if its
        mesh is fine (more than 16 pieces per edge), or if supports are given by nodes that another
        mesh lacks.
    """
    structure = case.structure
    divisions = structure.divisions
    if divisions is None or divisions > FINE:
        return None
    meshes = _meshes(divisions)
    try:
        found = {n: _modes(case, structure.meshed(n), count) for n in meshes}
    except InputError:  # supports name nodes other than vertices
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
    """Pieces of every edge in three meshes: `divisions`, half and a quarter; or finer meshes."""
    coarser = [divisions >> halvings for halvings in range(3) if divisions >> halvings]
    return tuple(sorted([*coarser, *(divisions << k + 1 for k in range(3 - len(coarser)))]))


def _modes(case: Case, structure: Discretized, count: int) -> MeshModes:
    """Elastic modes of a case on another mesh, without loads, contact and air."""
    if structure.sheet.density is None:
        structure = replace(structure, sheet=structure.sheet.weighed)
    return mesh_modes(replace(case, structure=structure, loads=(), contact=None, air=None), count)
