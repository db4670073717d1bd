"""The fluid that moves with a sheet, and its mass."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.air import LOCAL
from foldyn.errors import InputError
from foldyn.mechanics.air.added_mass import AddedMass, Flow, caught, flow_of, normal_velocities
from foldyn.mechanics.air.gaps import APART, JOINED, narrow_gap
from foldyn.patterns.pattern import Pattern
from foldyn.ram_limit import check_memory
from foldyn.structures.boundary_elements import BoundaryElements, boundary_elements

MOST_COUPLED = 3000  # most dofs that may be coupled with each other in a matrix
COPIES = 3  # copies of the flow's matrix that exist while it is made


@dataclass(frozen=True, eq=False)
class Fluid:
    """The fluid around a sheet in one of its states.

    Attributes
    ----------
    triangles : ndarray of int, shape (nt, 3)
        Corners of the structure's triangles.
    under, shares : ndarray, shape (k,) and (k, 3)
        The triangle under the center of each boundary element, and the weights of the triangle's
        nodes. An element whose center lies between two triangles appears once for each.
    catch : sparse array, shape (u, k)
        Integrals of the flow's functions over these elements, m2.
    """

    triangles: NDArray[np.int64]
    under: NDArray[np.int64]
    shares: NDArray[np.float64]
    catch: sparse.csr_array
    _density: float
    _surface: tuple[NDArray, ...]  # arguments of `flow_of`
    _lifts: sparse.csr_array | None = None  # (k, m) normal velocities, in linear models

    @cached_property
    def flow(self) -> Flow:
        """The matrix rho D^-1 (u, u), kg/m4.

        For normal velocities y the energy of the fluid is (catch y)' flow (catch y) / 2.
        """
        return self._density * flow_of(*self._surface)

    def on(self, x: NDArray) -> AddedMass:
        """Added mass with the normals of the triangles when the nodes are at x (n, 3), m.

        In linear models it acts on all dofs, and the normals are those at rest.
        """
        normal = self._lifts
        if normal is None:
            normal = normal_velocities(x, self.triangles, self.under, self.shares)
        return AddedMass(sparse.csr_array(self.catch @ normal), self.flow)


def elements_of(case: Any) -> BoundaryElements:
    """Boundary elements of a case in air."""
    air, structure = case.air, case.structure
    count = sum(len(face) for face in structure.pattern.faces) if structure.pattern else 0
    unknowns = count * (air.resolution // 2) ** 2
    if air.added_mass is True:
        check_memory(
            "air.resolution", f"the flow about {unknowns:.3g} boundary elements",
            8.0 * COPIES * unknowns**2, f'give a lower one, or added_mass = "{LOCAL}"',
        )  # fmt: skip
    return boundary_elements(structure, air.resolution, air.added_mass == LOCAL)


def fluid_at(case: Any, displacement: NDArray) -> Fluid:
    """The fluid around the sheet of a case at a displacement (n, 3), m.

    Raises
    ------
    InputError
        The case has no added mass; panels nearly touch.
    """
    if case.air is None or not case.air.added_mass:
        raise InputError(": the case has no added mass; give it air with added_mass", "air")
    elements, structure = case.boundary_elements, case.structure
    local = case.air.added_mass == LOCAL
    points = elements.weights @ (structure.nodes + displacement)
    if not local:
        _check_gaps(structure.pattern, elements, points)
    surface = points, elements.triangles, elements.unknown
    catch, lifts = sparse.csc_array(caught(*surface)), None
    if structure.linear:
        centers = points[elements.triangles].mean(axis=1)
        lifts = structure.lifts(centers, elements.panel, edges=case.held_edges)
    else:
        catch = catch[:, elements.element]
    given = structure.triangles, elements.under, elements.shares, sparse.csr_array(catch)
    made = (*surface, elements.panel) if local else surface
    return Fluid(*given, case.air.density, made, lifts)


def operator_at(case: Any, displacement: NDArray) -> tuple[AddedMass, bool] | None:
    """Added mass at a displacement (n, 3) and whether it fits in a matrix; None without any.

    It does not fit if it couples too many dofs.
    """
    if case.air is None or not case.air.added_mass:
        return None
    added = fluid_at(case, displacement).on(case.structure.nodes + displacement)
    return added, case.air.added_mass == LOCAL or len(added.moving) <= MOST_COUPLED


def added_mass_at(case: Any, displacement: NDArray) -> sparse.csr_array | None:
    """Added mass (3n, 3n) of a case at a displacement (n, 3), kg; None if it has none.

    Raises
    ------
    InputError
        Panels nearly touch, or the added mass couples too many dofs for a matrix.
    """
    found = operator_at(case, displacement)
    if found is None:
        return None
    added, fits = found
    if not fits:
        raise InputError(
            f": the fluid couples {len(added.moving)} dofs with each other, and a full matrix may "
            f"have {MOST_COUPLED} at most; take fewer divisions, the scheme n4b5, or added_mass = "
            f'"{LOCAL}"',
            "air",
        )
    return added.sparse


def _check_gaps(pattern: Pattern, elements: BoundaryElements, points: NDArray) -> None:
    """Refuse a state in which panels are closer than their boundary elements can resolve."""
    panels = np.repeat(np.arange(len(pattern.faces)), [len(face) for face in pattern.faces])
    corners = np.concatenate([np.array(face) for face in pattern.faces])
    members = sparse.csr_array((np.ones(len(corners)), (panels, corners)))
    joined = sparse.csr_array(members @ members.T)
    gap = narrow_gap(points, elements.triangles, elements.panel, joined)
    if gap is None:
        return
    one, other = sorted(elements.panel[[gap.one, gap.other]].tolist())
    least = JOINED if joined[one, other] else APART
    raise InputError(
        f": panels {one} and {other} are {gap.distance:.3g} m apart, less than {least:g} of the "
        f"size of their boundary elements, {gap.size:.3g} m, which then miss the flow between "
        "them; open the sheet, or give a higher resolution",
        "air",
    )
