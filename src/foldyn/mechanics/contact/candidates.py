"""Parts of a sheet that can touch, and their contact distances, constant during a motion.

Parts of one panel never touch. Two panels that share a crease or a corner are always close to each
other there. So the contact distance d0 of a vertex of one panel against the other panel is reduced:

    d0 = t min(2, 2 l / w) near a crease,    d0 = t min(1, 2 l / w) near a corner,

with l the vertex's distance from the shared crease or corner at rest, and w the largest l of the
vertex's panel. Panels hinged at a crease then meet everywhere at once, at a dihedral of 2 t / w,
and N layers stack to N t. Elsewhere d0 = t, the mean thickness of both. For two edges, d0 is the
mean of d0 of both ends of one edge against a panel of the other edge; the smallest mean of all
combinations counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.model import ranks

ACROSS_CREASE, ACROSS_CORNER = 2.0, 1.0  # largest d0 / t of panels that share a crease or a corner
POINT, NORMAL, FRICTION, MOTION, HISTORY = 0, 3, 6, 7, 10  # columns of the table of planes
PLANE_COLUMNS = 11


@dataclass(frozen=True, eq=False)
class Sheets:
    """Contact surfaces: n nodes, t triangles of p panels, and q planes.

    Parameters
    ----------
    nodes : (n, 3)
        Positions at rest, m.
    triangles, panel : (t, 3), (t,)
    thickness : (p,)
        Thickness of each panel, m.
    stiffness : float
        k of the potential, N/m.
    panels : bool
        Whether panels touch each other.
    friction : float
        Friction coefficient between panels.
    planes : (q, 11)
        For each plane: a point (m), the unit normal toward the sheet, the friction coefficient, the
        displacement (m) at factor 1, and the row of its history.
    held : (n,)
        Fixed nodes, on which planes do not act.
    """

    nodes: NDArray
    triangles: NDArray
    panel: NDArray
    thickness: NDArray
    stiffness: float
    panels: bool
    friction: float
    planes: NDArray
    held: NDArray

    def placed(self, order: NDArray) -> Sheets:
        """Copy with node order[k] at place k."""
        triangles = ranks(order)[self.triangles]
        return replace(self, nodes=self.nodes[order], triangles=triangles, held=self.held[order])


class Ranges(NamedTuple):
    """Data for d0 of nodes and panels, separate because small tuples are passed much faster."""

    node_thickness: NDArray  # (n,) m
    panel_thickness: NDArray  # (p,) m
    own_start: NDArray  # (n + 1,) start of each node's panels in `own`
    own: NDArray
    near_start: NDArray  # (n + 1,) start of the panels near each node's panels, in `near`
    near: NDArray
    near_d0: NDArray  # d0 against the panels in `near`, m


class Tables(NamedTuple):
    """Contact data as arrays for compiled code, with e edges and h guarded hinges."""

    rest: NDArray  # (n, 3) m
    triangles: NDArray  # (t, 3)
    edges: NDArray  # (e, 2)
    edge_nodes: NDArray  # (e, 2) mesh nodes at the ends; edges with a common node do not touch
    edge_square: NDArray  # (e,) squared lengths at rest, m2
    shared_side: NDArray  # (t, 3) 1/k for sides of k triangles, 0 for free sides
    shared_corner: NDArray  # (n,) 1/k for nodes enclosed by k triangles, else 0
    panel: NDArray  # (t,)
    edge_panels: NDArray  # (e, 2 or more) panels, in order; -1 for none
    node_thickness: NDArray  # (n,) m
    ranges: Ranges
    surface: NDArray  # (s,) nodes of triangles
    meeting: NDArray  # (m,) nodes that planes may meet
    hinges: NDArray  # (h, 4) nodes j, k, i, l
    hinge_row: NDArray  # (h,) position in the model's dihedrals
    hinge_limit: NDArray  # (h,) dihedral below which a hinge is guarded, rad
    hinge_reach: NDArray  # (h,) largest turn per nodal displacement, rad/m
    hinge_stiffness: NDArray  # (h,) N m/rad
    planes: NDArray  # (q, 11)
    stiffness: float  # N/m
    friction: float  # friction coefficient between panels
    farthest: float  # largest d0, m
    skin: float  # skin of pair lists, m


SKIN = 0.15  # extra distance beyond d0 of listed pairs, relative to the mean edge
GUARDED = 1.0  # rad: largest dihedral at which a guard may begin


def tables(sheets: Sheets, hinges: NDArray) -> Tables:
    """Contact arrays of sheets and of the hinges (h, 4) of a model; -1 marks a virtual wing."""
    nodes, triangles = np.ascontiguousarray(sheets.nodes, float), _whole(sheets.triangles)
    panel = _whole(sheets.panel)
    edges, side = edges_of(triangles)
    uses = np.bincount(side.ravel(), minlength=len(edges))
    around = np.bincount(triangles.ravel(), minlength=len(nodes))
    rim = np.zeros(len(nodes), bool)
    rim[edges[uses == 1].ravel()] = True
    closed = (around > 0) & ~rim
    members = panel_nodes(triangles, panel)
    own = _panels_of_nodes(members, len(nodes))
    near = near_panels(nodes, members, own, sheets.thickness)
    thickest = np.array([sheets.thickness[of].max() if len(of) else 0.0 for of in own])
    apart = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    square = np.einsum("ij,ij->i", apart, apart)
    sides = _panels_of_edges(side, panel, len(edges))
    pieces = crease_pieces(nodes, edges, sides, members)
    guarded, limit, reach, stiffness = hinge_guards(
        nodes, hinges, thickest, sheets.stiffness, pieces
    )
    if not sheets.panels:
        guarded = guarded[:0]
    surface = np.unique(triangles)
    beside = beside_nodes(own, near)
    return Tables(
        rest=nodes,
        triangles=triangles,
        edges=edges,
        edge_nodes=edges,
        edge_square=square,
        shared_side=np.where(uses[side] > 1, 1.0 / uses[side], 0.0),
        shared_corner=np.where(closed, 1.0 / np.maximum(around, 1), 0.0),
        panel=panel,
        edge_panels=sides,
        node_thickness=thickest,
        ranges=Ranges(
            node_thickness=thickest,
            panel_thickness=np.ascontiguousarray(sheets.thickness, float),
            **beside,
        ),
        surface=_whole(surface),
        meeting=_whole(surface[~sheets.held[surface]]),
        hinges=_whole(hinges[guarded]).reshape(-1, 4),
        hinge_row=_whole(guarded),
        hinge_limit=limit[guarded],
        hinge_reach=reach[guarded],
        hinge_stiffness=stiffness[guarded],
        planes=np.ascontiguousarray(sheets.planes, float).reshape(-1, PLANE_COLUMNS),
        stiffness=float(sheets.stiffness),
        friction=float(sheets.friction) if sheets.panels else 0.0,
        farthest=float(np.append(beside["near_d0"], thickest).max()) if sheets.panels else 0.0,
        skin=SKIN * float(np.sqrt(square).mean()),
    )


def edges_of(triangles: NDArray) -> tuple[NDArray, NDArray]:
    """Edges (e, 2); and each triangle's edges (t, 3) that begin at its corners 0, 1 and 2."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, side = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return _whole(edges), side.reshape(-1, 3)


def panel_nodes(triangles: NDArray, panel: NDArray) -> list[NDArray]:
    """Nodes of each panel, increasing."""
    order = np.argsort(panel, kind="stable")
    cut = np.searchsorted(panel[order], np.arange(int(panel.max(initial=-1)) + 2))
    return [np.unique(triangles[order[first:last]]) for first, last in pairwise(cut)]


def _panels_of_nodes(members: list[NDArray], count: int) -> list[list[int]]:
    own: list[list[int]] = [[] for _ in range(count)]
    for panel, nodes in enumerate(members):
        for node in nodes.tolist():
            own[node].append(panel)
    return own


def _panels_of_edges(side: NDArray, panel: NDArray, count: int) -> NDArray:
    """Panels (e, 2 or more) of each edge, in order; -1 for none."""
    edge, of = np.unique(np.stack([side.ravel(), np.repeat(panel, 3)]), axis=1)
    place = np.arange(len(edge)) - np.searchsorted(edge, edge)
    out = np.full((count, max(2, int(place.max(initial=0)) + 1)), -1, np.int64)
    out[edge, place] = of
    return out


def near_panels(
    nodes: NDArray, members: list[NDArray], own: list[list[int]], thickness: NDArray
) -> list[dict[int, float]]:
    """For each node, d0 (m) against the panels that share nodes with one of its panels."""
    near: list[dict[int, float]] = [{} for _ in own]
    for panel, corners in enumerate(members):
        for other, common in shared_nodes(panel, corners, own).items():
            away = distances(nodes, corners, common)
            most = ACROSS_CORNER if len(common) == 1 else ACROSS_CREASE
            t = 0.5 * (thickness[panel] + thickness[other])
            d0 = t * np.minimum(most, 2.0 * away / away.max())
            for node, value in zip(corners.tolist(), d0.tolist(), strict=True):
                if other not in own[node]:
                    near[node][other] = min(near[node].get(other, np.inf), value)
    return near


def shared_nodes(panel: int, corners: NDArray, own: list[list[int]]) -> dict[int, list[int]]:
    """Other panels at the corners of a panel, and the corners that each shares with it."""
    shared: dict[int, list[int]] = {}
    for node in corners.tolist():
        for other in own[node]:
            if other != panel:
                shared.setdefault(other, []).append(node)
    return shared


def distances(nodes: NDArray, corners: NDArray, common: list[int]) -> NDArray:
    """Distances (k,) of corners from a common node, or from the segment along several."""
    away = nodes[corners] - nodes[common[0]]
    if len(common) == 1:
        return np.linalg.norm(away, axis=1)
    spread = np.linalg.norm(nodes[common] - nodes[common[0]], axis=1)
    axis = nodes[common[int(spread.argmax())]] - nodes[common[0]]
    along = np.clip(away @ axis / (axis @ axis), 0.0, 1.0)
    return np.linalg.norm(away - along[:, None] * axis, axis=1)


class Pieces(NamedTuple):
    """The c edges that are pieces of a crease between two panels."""

    ends: NDArray  # (c, 2) nodes, the lower first
    height: NDArray  # (c,) half the width of the narrower panel normal to the crease, m
    share: NDArray  # (c,) share of the length of the crease


def crease_pieces(
    nodes: NDArray, edges: NDArray, edge_panels: NDArray, members: list[NDArray]
) -> Pieces:
    """Find pieces of creases: none if each crease has one hinge, as in bars and hinges."""
    between = np.flatnonzero(edge_panels[:, 1] >= 0)
    pairs, which, count = np.unique(
        np.sort(edge_panels[between], axis=1), axis=0, return_inverse=True, return_counts=True
    )
    which, start = which.ravel(), nodes[edges[between, 0]]
    along = nodes[edges[between, 1]] - start
    length = np.linalg.norm(along, axis=1)
    share = length / np.bincount(which, length)[which]
    several = np.flatnonzero(count[which] > 1)
    height = np.empty(len(several))
    for at, k in enumerate(several.tolist()):
        arms = [nodes[members[panel]] - start[k] for panel in pairs[which[k]] if panel >= 0]
        widths = [np.linalg.norm(np.cross(arm, along[k]), axis=1).max() for arm in arms]
        height[at] = 0.5 * min(widths) / length[k]
    return Pieces(edges[between[several]], height, share[several])


def hinge_guards(
    nodes: NDArray, hinges: NDArray, thickness: NDArray, stiffness: float, pieces: Pieces
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Guarded hinges, and for all hinges: start of the guard (rad), reach (rad/m), stiffness.

    Faces of thickness t, with the lower wing at height h above the axis, meet at a dihedral of
    about t / h; the guard has the stiffness k h^2, like a contact at the wing. On a piece of a
    crease the wings are parts of panels, and h is the panels' height: the guards of all pieces
    begin when the panels meet, and share the stiffness of one guard.
    """
    whole = np.flatnonzero(((hinges >= 0) & (hinges < len(nodes))).all(axis=1))
    limit, reach, strength = np.zeros((3, len(hinges)))
    j, k, i, l = hinges[whole].T  # noqa: E741
    axis = nodes[k] - nodes[j]
    length = np.linalg.norm(axis, axis=1)
    heights = [np.linalg.norm(np.cross(nodes[w] - nodes[j], axis), axis=1) for w in (i, l)]
    height = np.minimum(*heights) / length
    reach[whole] = 2.0 / height
    share, row = np.ones(len(whole)), {(a, b): c for c, (a, b) in enumerate(pieces.ends.tolist())}
    for at, (a, b) in enumerate(np.sort(hinges[whole, :2], axis=1).tolist()):
        if (a, b) in row:
            height[at], share[at] = pieces.height[row[a, b]], pieces.share[row[a, b]]
    limit[whole] = np.minimum(GUARDED, thickness[j] / height)
    strength[whole] = stiffness * height**2 * share
    return whole, limit, reach, strength


def beside_nodes(own: list[list[int]], near: list[dict[int, float]]) -> dict[str, NDArray]:
    """Arrays of `Ranges`: each node's own panels, and panels near these with their d0 (m)."""
    pairs = [pair for of in near for pair in sorted(of.items())]
    return {
        "own_start": starts(own),
        "own": _whole([panel for of in own for panel in of]),
        "near_start": starts(near),
        "near": _whole([panel for panel, _ in pairs]),
        "near_d0": np.array([d0 for _, d0 in pairs], float),
    }


def starts(lists: list) -> NDArray:
    """Start indices of several lists that are concatenated."""
    return np.concatenate([[0], np.cumsum([len(of) for of in lists])]).astype(np.int64)


def _whole(values) -> NDArray:
    return np.ascontiguousarray(values, np.int64)
