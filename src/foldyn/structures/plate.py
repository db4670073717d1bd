"""Stiffness of bends and folds that makes panels bend as thin plates: `calibration="plate"`.

With G = E t^3 / (12 (1 - nu^2)) and A the area of a panel:

quads                       bends G k and compliance c of creases such that the nodes move as the
                            corners of a plate do under forces that twist it and moments on its
                            creases (`structures.quad_plates`);
spoke of a larger polygon   4 (1 - nu) G A p / sum (h1^2 + h2^2), h1 and h2 the turns of its spokes
                            in the two curvatures of size 1 that have no mean; p from `POLYGON`,
                            because a plate bent by its corners only is softer;
its diagonals (N4B5)        2 (1 - nu) G A / D^2, A the area of the two adjacent triangles;
fold of length Lf           1/kf' = 1/kf + sum over its two panels of c/G, with c = 0 for rigid
                            panels, and `COMPLIANCE` or `TRIANGLE` times A/Lf^2 for panels that
                            are not quads;
weld of length Lf           1/k = sum over its two panels of c/G, like a crease that does not turn.
                            c is A/Lf^2 times `COMPLIANCE`, in quads with no other crease times
                            `WELDED_ALONE`, in triangles times 2/3: a third of height/length, the
                            sheet between the middles of the two panels.

In these plates, creases and welds between panels in different planes stay straight; other edges may
bow.
Derivation and errors: docs/fidelity.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.topology import Lines, around, edge_lookup, edge_of, edge_rows
from foldyn.structures.condensed_panel import spoke_turns
from foldyn.structures.edge_angles import straight_creases
from foldyn.structures.mesh import Mesh, double_areas, lengths, quad_centers
from foldyn.structures.quad_plates import quad_bends
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.sheet import Sheet

COMPLIANCE = 0.12  # c Lf^2/A of panels with more than four corners, and at most welds
TRIANGLE = (0.22, 0.6)  # c Lf^2/A of triangles without a free edge, and with free edges
POLYGON = (0.77, 0.87, 0.91, 0.93)  # p of regular polygons of 5, 6, 7 and more corners (the shell)
WELDED_TRIANGLE, WELDED_ALONE = 2.0 / 3.0, 0.19  # c Lf^2/A at welds: triangles; quads, no crease
Panel = tuple[NDArray, NDArray]  # stiffness of bends, compliance c of edges, for G = 1


class Plates(NamedTuple):
    """Stiffness and compliance that a structure gets from panels that bend as plates.

    Attributes
    ----------
    bends : (nh,)
        Stiffness of whole bends, N m/rad, in the mesh's order.
    creases : (nf,)
        Compliance of a crease's two panels together to the crease's moment, rad/(N m).
    """

    bends: NDArray
    creases: NDArray

    def folds(self, crease: NDArray) -> NDArray:
        """Stiffness (nf,) of whole folds, N m/rad: creases in series with their panels."""
        return crease / (1.0 + crease * self.creases)


def panel_plates(
    mesh: Mesh, pattern: Pattern, sheet: Sheet, rigid: str | Sequence[int] | None = None
) -> Plates:
    """Panels of a mesh as plates; rigid panels add no compliance."""
    count = len(pattern.faces)
    number = edge_lookup(np.concatenate([pattern.creases, pattern.welds]))
    edges = [[number.get(edge_of(a, b), -1) for a, b in around(face)] for face in pattern.faces]
    modulus, nu = (sheet.values(name, count) for name in ("bending_modulus", "poissons_ratio"))
    first = np.searchsorted(mesh.inner_panel, np.arange(count + 1))
    stiff = set(rigid_panels(rigid, count))
    quads = _quads(mesh, pattern, sheet, edges)
    rows = edge_rows(pattern.creases)
    bends, creases = np.empty(len(mesh.inner)), np.zeros(len(pattern.creases))
    for p in range(count):
        own = slice(first[p], first[p + 1])
        free = -1 in edges[p]
        stiffness, compliance = quads.get(p) or _other(mesh, pattern, p, own, float(nu[p]), free)
        bends[own] = modulus[p] * stiffness
        for (a, b), c in zip(around(pattern.faces[p]), compliance.tolist(), strict=True):
            for k in rows.get(edge_of(a, b), ()):
                if p not in stiff and p in pattern.crease_faces[k]:
                    creases[k] += c / modulus[p]
    return Plates(bends, creases)


def weld_stiffness(pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of whole welds (nw,), N m/rad: the panels on both sides in series.

    Panels of stiffness g about a junction that has no moment of its own are springs g_i g_j / sum g
    between each two of them.
    """
    free = set(edge_lookup(pattern.boundary))
    modulus = sheet.values("bending_modulus", len(pattern.faces)).tolist()
    line = Lines.of(pattern.welds).number.tolist()
    beside: list[dict[int, float]] = [{} for _ in line]
    for k, both in zip(line, pattern.weld_faces.tolist(), strict=True):
        for p in both:
            edges = [edge_of(a, b) for a, b in around(pattern.faces[p])]
            alone = len(edges) == 4 and len(free.intersection(edges)) == 3
            c = WELDED_TRIANGLE if len(edges) == 3 else WELDED_ALONE if alone else COMPLIANCE
            beside[k][p] = modulus[p] / (c * float(pattern.face_areas[p]))
    between = [
        beside[k][one] * beside[k][two] / sum(beside[k].values())
        for k, (one, two) in zip(line, pattern.weld_faces.tolist(), strict=True)
    ]
    return lengths(pattern.vertices, pattern.welds) ** 2 * np.array(between)


def _quads(mesh: Mesh, pattern: Pattern, sheet: Sheet, edges: list[list[int]]) -> dict[int, Panel]:
    """Panels with four corners, by index; `edges` has the crease or weld on each edge, or -1."""
    faces = pattern.faces
    quads = np.array([p for p, face in enumerate(faces) if len(face) == 4], np.int64)
    corner = np.array([faces[p] for p in quads], np.int64).reshape(-1, 4)
    crease = np.array([edges[p] for p in quads], np.int64).reshape(-1, 4)
    hinges = np.concatenate([mesh.folds, mesh.welds])
    straight = np.append(straight_creases(mesh.nodes, hinges, pattern, sheet), False)
    x, center = pattern.vertices[corner], mesh.centers[quads]
    points = np.where((center >= 0)[:, None], mesh.nodes[center], quad_centers(x))
    cut = mesh.inner[np.searchsorted(mesh.inner_panel, quads)]  # first bar of each
    hinged = np.where(center < 0, (cut != corner[:, :1]).all(axis=1), -1)
    nu = sheet.values("poissons_ratio", len(faces))[quads]
    spokes, compliance = quad_bends(x, points, crease >= 0, straight[crease], nu, hinged)
    bends = [own if hub >= 0 else own.sum() for own, hub in zip(spokes, center, strict=True)]
    return dict(zip(quads.tolist(), zip(bends, compliance, strict=True), strict=True))


def _other(mesh: Mesh, pattern: Pattern, p: int, rows: slice, nu: float, free: bool) -> Panel:
    """A panel with three or more than four corners; `free` if an edge is free."""
    x, area = pattern.vertices[list(pattern.faces[p])], float(pattern.face_areas[p])
    shape = area / ((np.roll(x, -1, axis=0) - x) ** 2).sum(axis=1)
    if len(x) == 3:
        return np.zeros(0), TRIANGLE[free] * shape
    if mesh.centers[p] < 0:
        both = _wings(mesh.nodes, mesh.bends[rows])
        bends = 2.0 * (1.0 - nu) * both / lengths(mesh.nodes, mesh.inner[rows]) ** 2
    else:
        soft = POLYGON[min(len(x), 8) - 5]
        turns = _twisted(x - mesh.nodes[mesh.centers[p]])
        bends = np.full(len(x), 4.0 * (1.0 - nu) * area * soft / turns)
    return bends, COMPLIANCE * shape


def _wings(x: NDArray, bends: NDArray) -> NDArray:
    """Area (nh,) of the two triangles at each bend (axis j, k, wings i, l)."""
    left, right = double_areas(x, bends[:, [0, 1, 2]]), double_areas(x, bends[:, [1, 0, 3]])
    return 0.5 * (np.linalg.norm(left, axis=1) + np.linalg.norm(right, axis=1))


def _twisted(spokes: NDArray) -> float:
    """Sum of the squared turns (m^2) of spokes (m, 3) for the curvatures diag(1, -1) and xy."""
    _, _, axes = np.linalg.svd(spokes - spokes.mean(axis=0))
    points = np.concatenate([spokes @ axes[:2].T, np.zeros((1, 2))])
    x, y = points.T
    turns = spoke_turns(points, len(spokes)) @ np.column_stack([0.5 * (x**2 - y**2), x * y])
    return float((turns**2).sum())
