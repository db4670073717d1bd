"""Mass rules: how the mass of panels is distributed to nodes.

A rule takes a `Surface` and returns the nodal mass matrix (n, n), kg; one value serves the three
axes. `MASS_RULES` is the registry.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.mechanics.block_matrix import of_elements
from foldyn.patterns.topology import around, edge_of
from foldyn.structures.condensed_panel import panel_mass
from foldyn.structures.panel_plate import TRIANGLE_MASS, outline

LEAST = 0.25  # least share of a node, in shares of the centroid rule; parallelograms need 1/2


class Surface(NamedTuple):
    """Panels and triangles of a structure with their areas (SI)."""

    nodes: NDArray  # (n, 3)
    faces: tuple[tuple[int, ...], ...]  # corners of each panel
    centers: NDArray  # (np,) center node of each panel, -1 without one
    triangles: NDArray  # (nt, 3)
    triangle_panel: NDArray  # (nt,)
    triangle_area: NDArray  # (nt,) m2
    areal_density: NDArray  # (np,) kg/m2
    welds: tuple[tuple[int, int], ...]  # edges (low, high) across which the sheet continues
    clamped: tuple[tuple[int, int], ...] = ()  # edges at which panels stay level

    @property
    def panel_mass(self) -> NDArray:
        """Mass of each panel (np,), kg."""
        area = np.bincount(self.triangle_panel, self.triangle_area, minlength=len(self.faces))
        return self.areal_density * area

    @property
    def triangle_mass(self) -> NDArray:
        """Mass of each triangle (nt,), kg."""
        return self.areal_density[self.triangle_panel] * self.triangle_area

    def nodes_of(self, panel: int) -> list[int]:
        """Corners of a panel, then its center node if it has one."""
        center = int(self.centers[panel])
        return [*self.faces[panel], center] if center >= 0 else list(self.faces[panel])


def equi_inertial(surface: Surface) -> sparse.csr_array:
    """Fixed shares for N5B8 quadrilaterals; the shorter diagonal connects the heavier corners.

    Shares are 4/9 (0.444) at the center, 1/4 at two opposite corners (if the diagonals are equal,
    corners 0 and 2), 1/36 (0.028) at the other two. For a rhombus of 60 degrees with half diagonals
    p and q, 1/4 and 1/36 are q^2/12p^2 and p^2/12q^2. Despite the name of the rule, the second
    moments of that rhombus in its plane are 1/3 (0.336 with the rounded 0.028) and 3 times the
    exact values. Source: Herkal et al., section 3.
    """
    return _distribute(surface, "equi_inertial", swapped=False)


def equi_inertial_acute(surface: Surface) -> sparse.csr_array:
    """Shares of `equi_inertial`, but the longer diagonal connects the heavier corners."""
    return _distribute(surface, "equi_inertial_acute", swapped=True)


def _distribute(surface: Surface, name: str, swapped: bool) -> sparse.csr_array:
    other = [p for p, c in enumerate(surface.centers) if len(surface.faces[p]) != 4 or c < 0]
    if other:
        raise InputError(
            f'mass = "{name}" is defined for N5B8 quadrilaterals only, panel {other[0]} is '
            'not one: use mass = "mixed_voronoi" (any panel) or "inertia_exact"'
        )
    corners = np.array(surface.faces, np.int64)
    x = surface.nodes[corners]
    even = np.linalg.norm(x[:, 2] - x[:, 0], axis=1)
    odd = np.linalg.norm(x[:, 3] - x[:, 1], axis=1)
    heavy_even = (even <= odd * (1.0 + 1e-9)) != swapped
    shares = np.where(heavy_even[:, None] == [True, False, True, False], 1.0 / 4.0, 1.0 / 36.0)
    total = surface.panel_mass[:, None]
    nodes = np.column_stack([corners, surface.centers])
    masses = np.column_stack([shares * total, 4.0 / 9.0 * total])
    return lumped(np.bincount(nodes.ravel(), masses.ravel(), minlength=len(surface.nodes)))


def panel(surface: Surface) -> sparse.csr_array:
    """Equal shares for all nodes of a panel, with its center (Herkal et al., section 3)."""
    mass = np.zeros(len(surface.nodes))
    for number, total in enumerate(surface.panel_mass):
        nodes = surface.nodes_of(number)
        mass[nodes] += total / len(nodes)
    return lumped(mass)


def centroid(surface: Surface) -> sparse.csr_array:
    """A third of each triangle for each of its corners (Herkal et al., section 3)."""
    return _from_triangle_shares(surface, np.full((len(surface.triangles), 3), 1.0 / 3.0))


def circumcenter(surface: Surface) -> sparse.csr_array:
    """Triangles split by the perpendicular bisectors of their sides (Herkal et al., section 3).

    Raises
    ------
    InputError
        A triangle is obtuse, so that a share is negative (below -1e-9 of the triangle's mass; right
        angles pass).
    """
    shares, _ = _circumcentric_shares(surface)
    worst = np.unravel_index(np.argmin(shares), shares.shape)
    if shares[worst] < -1e-9:
        corner = int(surface.triangles[worst])
        number = int(surface.triangle_panel[worst[0]])
        raise InputError(
            f'mass = "circumcenter": panel {number} has an obtuse triangle, which would give node '
            f"{corner} {shares[worst]:.3g} of that triangle's mass; use "
            'mass = "mixed_voronoi": the same on other triangles, and never negative'
        )
    return _from_triangle_shares(surface, np.maximum(shares, 0.0))


def mixed_voronoi(surface: Surface) -> sparse.csr_array:
    """Shares of `circumcenter`, but in an obtuse triangle 1/2 at the obtuse corner, else 1/4.

    Source: Meyer et al., Discrete differential-geometry operators for triangulated
    2-manifolds, 2003, section 3.3.
    """
    shares, obtuse = _circumcentric_shares(surface)
    shares = np.where(obtuse.any(axis=1, keepdims=True), np.where(obtuse, 0.5, 0.25), shares)
    return _from_triangle_shares(surface, shares)


def _circumcentric_shares(surface: Surface) -> tuple[NDArray, NDArray]:
    """Part of each triangle that is closest to each corner (nt, 3); whether corners are obtuse."""
    x = surface.nodes[surface.triangles]
    opposite = np.roll(x, -2, axis=1) - np.roll(x, -1, axis=1)
    squared = np.einsum("tkc,tkc->tk", opposite, opposite)
    others = squared.sum(axis=1, keepdims=True) - 2.0 * squared
    area = surface.triangle_area[:, None]
    cotangent = others / (4.0 * area)
    part = squared * cotangent / (8.0 * area)
    return np.roll(part, -1, axis=1) + np.roll(part, -2, axis=1), cotangent < 0.0


def consistent(surface: Surface) -> sparse.csr_array:
    """rho A t / 12 [2 1 1; 1 2 1; 1 1 2] of each triangle, assembled.

    The rotational inertia of a panel is exact about every axis in its plane.
    """
    matrices = surface.triangle_mass[:, None, None] * TRIANGLE_MASS
    return of_elements(surface.triangles, matrices, len(surface.nodes))


def bubble(surface: Surface) -> sparse.csr_array:
    """Consistent matrix of parallelograms that also twist and bulge as plates do.

    In a parallelogram with its center node in the middle, the displacement is bilinear between the
    corners, plus a bulge phi = 1 - (xi^2 + eta^2)/2 times the center's distance from the mean of
    the corners: N_i = bilinear_i - phi/4, N_0 = phi. The mean of phi is 2/3, the mean of phi^2 is
    22/45. The matrix is exact for translations, rotations, every change of shape that is linear
    over the panel, and a twist, whose inertia m w^2/9 no diagonal matrix reproduces. Other panels
    get the consistent matrix of their triangles.
    """
    triangle = np.ones(len(surface.faces), bool)
    panels = []
    for p, center in enumerate(surface.centers.tolist()):
        nodes = surface.nodes_of(p)
        if center >= 0 and len(nodes) == 5 and _is_parallelogram(surface.nodes[nodes]):
            panels.append(nodes)
            triangle[p] = False
    rest = _without(surface, ~triangle)
    nodes = np.array(panels, np.int64).reshape(-1, 5)
    matrices = surface.panel_mass[~triangle][:, None, None] * BUBBLE
    return consistent(rest) + of_elements(nodes, matrices, len(surface.nodes))


def _bubble_element() -> NDArray:
    """Mass matrix (5, 5) of a parallelogram of mass 1: its corners in order, then its center."""
    mean, square = 2.0 / 3.0, 22.0 / 45.0  # means of phi = 1 - (xi^2 + eta^2)/2 and of phi^2
    near = np.array([4.0, 2.0, 1.0, 2.0]) / 36.0  # mean products of bilinear functions
    element = np.empty((5, 5))
    element[:4, :4] = [np.roll(near, k) for k in range(4)]
    element[:4, :4] += (square - 2.0 * mean) / 16.0  # mean of phi bilinear_i: a fourth of phi's
    element[:4, 4] = element[4, :4] = (mean - square) / 4.0
    element[4, 4] = square
    return element


BUBBLE = _bubble_element()


def condensed(surface: Surface) -> sparse.csr_array:
    """Mass of panels that follow their corners and center as thin plates do.

    Between these points a panel has the shape of a plate without moments at its edges, whose
    creases are straight and whose welds bow; see `foldyn.structures.condensed_panel`. Panels
    without a center node have the consistent matrix of their triangles, except at clamped edges.
    The shape hardly depends on Poisson's ratio, which is set to 0.3.
    """
    panels = condensed_panels(surface)
    mass = consistent(_without(surface, np.isin(np.arange(len(surface.faces)), list(panels))))
    for size in {len(matrix) for matrix in panels.values()}:
        alike = [p for p, matrix in panels.items() if len(matrix) == size]
        nodes = np.array([surface.nodes_of(p) for p in alike])
        mass = mass + of_elements(nodes, np.array([panels[p] for p in alike]), len(surface.nodes))
    return mass


def condensed_panels(surface: Surface) -> dict[int, NDArray]:
    """Matrices (k, k), kg, of the rule `condensed`, by panel index; for panels with a center node.

    Rows are the corners, then the center. Triangles with a clamped edge are included.
    """
    edges = [edge_of(a, b) for face in surface.faces for a, b in around(face)]
    creases = {edge for edge, count in Counter(edges).items() if count > 1} - set(surface.welds)
    found, total, level = {}, surface.panel_mass, set(surface.clamped)
    for p, face in enumerate(surface.faces):
        edges = [edge_of(a, b) for a, b in around(face)]
        if surface.centers[p] < 0 and level.isdisjoint(edges):
            continue
        clamped = [edge in level for edge in edges]
        straight = [edge in creases or edge in level for edge in edges]
        x, m = surface.nodes[surface.nodes_of(p)], len(face)
        panel = outline(x[:m], x[m] if len(x) > m else None, clamped, straight, clamped=clamped)
        found[p] = total[p] * panel_mass(panel, 0.3)
    return found


def _without(surface: Surface, panels: NDArray) -> Surface:
    """The surface without the triangles of masked panels (np,)."""
    kept = ~panels[surface.triangle_panel]
    triangles, panel = surface.triangles[kept], surface.triangle_panel[kept]
    area = surface.triangle_area[kept]
    return surface._replace(triangles=triangles, triangle_panel=panel, triangle_area=area)


def inertia_exact(surface: Surface) -> sparse.csr_array:
    """Nodal masses with a panel's mass, center of mass and, as far as possible, inertia.

    On a parallelogram with a center node, 2/3 at the center and 1/12 at each corner have exactly
    the second moments of the panel about every axis. On other panels the masses start from the
    centroid rule, which has the exact total and center of mass, and move toward the closest masses
    that also have the second moments (or match them best, by least squares), as long as every node
    keeps a quarter of its start value: equations of motion need a mass at every node. In a triangle
    without a center node each corner has a third.
    """
    mass = np.zeros(len(surface.nodes))
    total = surface.panel_mass
    first = np.searchsorted(surface.triangle_panel, np.arange(len(surface.faces) + 1))
    for p in range(len(surface.faces)):
        nodes = surface.nodes_of(p)
        x = surface.nodes[nodes]
        if len(nodes) == 3:
            share = np.full(3, 1.0 / 3.0)
        elif len(nodes) == 5 and _is_parallelogram(x):
            share = np.array([1.0, 1.0, 1.0, 1.0, 8.0]) / 12.0
        else:
            inside = slice(first[p], first[p + 1])
            place = {node: k for k, node in enumerate(nodes)}
            corners = np.array([[place[v] for v in t] for t in surface.triangles[inside].tolist()])
            area = surface.triangle_area[inside]
            share = _shares(x, corners, area / area.sum())
        mass[nodes] += total[p] * share
    return lumped(mass)


def _is_parallelogram(x: NDArray) -> bool:
    """Whether corners x[:4] form a parallelogram and x[4] is its center."""
    off = np.abs([x[0] + x[2] - x[1] - x[3], x[0] + x[2] - 2.0 * x[4]])
    return bool(off.max() < 1e-9 * np.ptp(x, axis=0).max())


def _shares(x: NDArray, triangles: NDArray, part: NDArray) -> NDArray:
    """Shares of nodes x (m, 3) in a panel's mass; `part` is each triangle's share in it."""
    start = np.bincount(triangles.ravel(), np.repeat(part / 3.0, 3), minlength=len(x))
    x = x - start @ x
    x = x / np.abs(x).max()
    # integral of x x^T over a triangle: A/12 (sum of v v^T + s s^T), s the sum of its corners
    corners = x[triangles]
    s = corners.sum(axis=1)
    wanted = np.einsum("t,tka,tkb->ab", part / 12.0, corners, corners)
    wanted += np.einsum("t,ta,tb->ab", part / 12.0, s, s)
    missing = (wanted - np.einsum("k,ka,kb->ab", start, x, x)).ravel()
    # changes of the shares that preserve total and center of mass
    left, singular, _ = np.linalg.svd(np.column_stack([np.ones(len(x)), x]))
    free = left[:, int((singular > 1e-9 * singular[0]).sum()) :]
    products = np.einsum("ka,kb->abk", x, x).reshape(9, -1)
    change = free @ np.linalg.lstsq(products @ free, missing, rcond=1e-9)[0]
    down = change < 0.0
    allowed = (1.0 - LEAST) * start[down] / -change[down]
    return start + min(1.0, allowed.min(initial=1.0)) * change


def lumped(mass: NDArray) -> sparse.csr_array:
    """Diagonal mass matrix of nodal masses (n,)."""
    return sparse.csr_array(sparse.diags_array(mass))


def _from_triangle_shares(surface: Surface, shares: NDArray) -> sparse.csr_array:
    """Lumped matrix from shares (nt, 3) of each triangle's mass for its corners."""
    mass = shares * surface.triangle_mass[:, None]
    total = np.bincount(surface.triangles.ravel(), mass.ravel(), minlength=len(surface.nodes))
    return lumped(total)


MASS_RULES: Mapping[str, Callable[[Surface], sparse.csr_array]] = {
    rule.__name__: rule
    for rule in (
        equi_inertial,
        equi_inertial_acute,
        panel,
        centroid,
        circumcenter,
        consistent,
        mixed_voronoi,
        inertia_exact,
        bubble,
        condensed,
    )
}


def row_sums(mass: sparse.csr_array) -> NDArray:
    """Mass (n,) of each node, kg, from a nodal matrix (n, n)."""
    return np.asarray(mass.sum(axis=1)).ravel()


def center_of_mass(nodes: NDArray, mass: sparse.csr_array) -> NDArray:
    """Center (3,) of a nodal mass matrix (n, n) on nodes (n, 3), m."""
    return row_sums(mass) @ nodes / float(mass.sum())


def inertia_tensor(nodes: NDArray, mass: sparse.csr_array) -> NDArray:
    """Inertia tensor (3, 3) of nodal masses about their center, kg m2."""
    arm = nodes - center_of_mass(nodes, mass)
    second = arm.T @ (mass @ arm)
    return np.trace(second) * np.eye(3) - second
