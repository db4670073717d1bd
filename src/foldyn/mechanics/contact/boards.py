"""Boards: the contact surfaces of panels hinged off their middle surfaces.

The contact surface of a board is its middle surface. Its corners ride on the mesh (`ride`), and
neighboring panels have separate corners. The nodes of the mesh follow in the arrays, for the guards
of hinges.

The middles of two boards are s = |h + h'| apart at a closed crease, h and h' the heights of its
hinge line above them. Between sheets, s = 0 (`tables`), and boards hinged in their faces, s = t,
which touch everywhere at once,

    d0 = s + (1 - s/t) d0 of sheets, but at most l,

with l the distance from the crease: boards that lie flat do not touch with their sides. Guards of
hinges begin at 1 - s/t of the angle for sheets: if the middle surfaces stay apart, their distance
already determines the side.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.contact.candidates import (
    ACROSS_CORNER,
    ACROSS_CREASE,
    Sheets,
    Tables,
    distances,
    panel_nodes,
    shared_nodes,
    starts,
    tables,
)
from foldyn.mechanics.contact.ride import Ride, carried, ride_on

JUST = 1.0 - 1e-9  # of d0: parts that just touch at rest exert no force
LEAST = 0.02  # of the guard angle for sheets: least angle of a guard


@dataclass(frozen=True, eq=False)
class BoardSheets(Sheets):
    """Contact surfaces of a mesh whose panels are boards; see `Sheets`.

    Parameters
    ----------
    middle : (t, 3, 3)
        Positions (m) of each triangle's corners on the boards' middle surfaces, at rest.
    """

    middle: NDArray

    def riding(self) -> tuple[Ride, NDArray, NDArray]:
        """Points at the corners of the boards; see `ride.ride_on`."""
        return ride_on(self.nodes, self.triangles, self.panel, self.middle)


def board_tables(
    sheets: BoardSheets, ride: Ride, panel: NDArray, node: NDArray, hinges: NDArray
) -> Tables:
    """Contact arrays for points of a panel (m,) and a node (m,), and hinges of the mesh."""
    mesh = Sheets(*(getattr(sheets, field.name) for field in fields(Sheets)))
    held = carried(ride, sheets.held)
    points = replace(mesh, nodes=ride.rest, triangles=ride.points, held=held)
    own, base = tables(points, np.zeros((0, 4), np.int64)), tables(mesh, hinges)
    first = len(ride.rest) - len(ride.x)
    panels, near, closed = _neighbors(sheets, ride, panel[:first], node[:first])
    no_panels: list = [[]] * len(ride.x)
    panels, near = panels + no_panels, near + no_panels
    d0 = [of[other] for of in near for other in sorted(of)]
    return own._replace(
        edge_nodes=node[own.edges],
        ranges=own.ranges._replace(
            own_start=starts(panels),
            own=np.array([p for of in panels for p in of], np.int64),
            near_start=starts(near),
            near=np.array([p for of in near for p in sorted(of)], np.int64),
            near_d0=np.array(d0, float),
        ),
        hinges=base.hinges + first,
        hinge_row=base.hinge_row,
        hinge_limit=base.hinge_limit * _guarded(base, closed),
        hinge_reach=base.hinge_reach,
        hinge_stiffness=base.hinge_stiffness,
        farthest=max([own.farthest, *d0]) if sheets.panels else 0.0,
    )


def _neighbors(
    sheets: BoardSheets, ride: Ride, panel: NDArray, node: NDArray
) -> tuple[list[list[int]], list[dict[int, float]], dict[tuple[int, int], float]]:
    """Panels of each point's node, its own first, and d0 (m) against others near it.

    Also returns s/t of panels that share a crease. Points belong to a panel (m,) and a node (m,).
    """
    at = {key: k for k, key in enumerate(zip(panel.tolist(), node.tolist(), strict=True))}
    sharing: list[list[int]] = [[] for _ in ride.x]
    for p, v in at:
        sharing[v].append(p)
    panels = [[p, *(other for other in sharing[v] if other != p)] for p, v in at]
    near: list[dict[int, float]] = [{} for _ in at]
    closed: dict[tuple[int, int], float] = {}
    above = _above(ride)
    for p, corners in enumerate(panel_nodes(sheets.triangles, sheets.panel)):
        mine = np.array([at[p, v] for v in corners.tolist()])
        for other, common in shared_nodes(p, corners, sharing).items():
            t = 0.5 * (sheets.thickness[p] + sheets.thickness[other])
            away = distances(ride.rest, mine, [at[p, v] for v in common])
            s, most = 0.0, ACROSS_CORNER
            if len(common) > 1:
                heights = [above[at[p, v]] + above[at[other, v]] for v in common]
                s, most = min(t, abs(float(np.mean(heights)))), ACROSS_CREASE
                closed[p, other] = s / t
            d0 = s + (t - s) * np.minimum(most, 2.0 * away / away.max())
            for k, value in zip(mine, (JUST * np.minimum(d0, away)).tolist(), strict=True):
                if other not in panels[k]:
                    near[k][other] = value
    return panels, near, closed


def _guarded(base: Tables, closed: dict[tuple[int, int], float]) -> NDArray[np.float64]:
    """Ratios (h,) of the guard angles for boards to the guard angles for sheets."""
    sides = dict(zip(map(tuple, base.edges.tolist()), base.edge_panels.tolist(), strict=True))
    axes = map(tuple, np.sort(base.hinges[:, :2], axis=1).tolist())
    apart = [closed.get(tuple(sides.get(axis, ())), 0.0) for axis in axes]
    return np.maximum(LEAST, 1.0 - np.array(apart))


def _above(ride: Ride) -> NDArray[np.float64]:
    """Height (m,) of the nodes above the points of boards, toward the front, at rest."""
    a, b, c = np.moveaxis(ride.rest[ride.points], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = ride.x[ride.nodes] - ride.rest[ride.points]
    out = np.zeros(len(ride.rest))
    out[ride.points] = np.einsum("tci,ti->tc", away, normal)
    return out
