"""Boards: what may touch of panels that are hinged beside their middle surfaces.

What touches of a board is its middle surface, whose corners ride on the mesh (`ride`), those of each
panel apart from those of its neighbors. After them come the nodes of the mesh, between which hinges
are guarded.

Boards beside a crease are s = |h + h'| apart where it is closed, h and h' the heights of the hinge
line above their middles. Between the two limits that this has, thin sheets (s = 0, see `tables`)
and boards hinged in their faces (s = t), which touch everywhere at once,

    d0 = s + (1 - s/t) d0 of sheets, but at most l,

l the distance from the crease: boards that lie flat do not touch with their sides. Hinges are
guarded from 1 - s/t of the angle on at which those of sheets are: where middles stay apart their
distance tells on which side they are.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.contact.ride import Ride, ride_on
from foldyn.mechanics.contact.tables import (
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

JUST = 1.0 - 1e-9  # of d0: what just touches at rest does not push
LEAST = 0.02  # of the angle at which sheets are guarded: least angle of a guard


@dataclass(frozen=True, eq=False)
class BoardSheets(Sheets):
    """What may touch, of a mesh whose panels are boards: see `Sheets`.

    Parameters
    ----------
    middle : (t, 3, 3)
        Places (m) in the boards' middle surfaces of the corners of each triangle, at rest.
    """

    middle: NDArray

    def riding(self) -> tuple[Ride, NDArray, NDArray]:
        """See `ride.ride_on`."""
        return ride_on(self.nodes, self.triangles, self.panel, self.middle)


def board_tables(
    sheets: BoardSheets, ride: Ride, panel: NDArray, node: NDArray, hinges: NDArray
) -> Tables:
    """Arrays of what may touch: points of a panel (m,) and a node (m,); hinges of the mesh."""
    first, t = len(ride.rest) - len(ride.x), sheets.thickness
    mesh = Sheets(*(getattr(sheets, field.name) for field in fields(Sheets)))
    held = np.ones(len(ride.rest), bool)
    np.logical_and.at(held, ride.points, sheets.held[ride.nodes].all(axis=1)[:, None])
    points = replace(mesh, nodes=ride.rest, triangles=ride.points, held=held)
    own, base = tables(points, np.zeros((0, 4), np.int64)), tables(mesh, hinges)
    panels = [[] if p < 0 else [p] for p in panel.tolist()]
    at = {(p, v): k for k, (p, v) in enumerate(zip(panel[:first].tolist(), node[:first].tolist()))}
    sharing: list[list[int]] = [[] for _ in ride.x]
    for p, v in at:
        sharing[v].append(p)
    for (p, v), k in at.items():
        panels[k] += [other for other in sharing[v] if other != p]
    near: list[dict[int, float]] = [{} for _ in panels]
    closed: dict[tuple[int, int], float] = {}  # s/t of panels that share a crease
    above = _above(ride)
    for p, corners in enumerate(panel_nodes(sheets.triangles, sheets.panel)):
        mine = np.array([at[p, v] for v in corners.tolist()])
        for other, common in shared_nodes(p, corners, sharing).items():
            both = above[[[at[one, v] for v in common] for one in (p, other)]].sum(axis=0)
            mean, crease = 0.5 * (t[p] + t[other]), len(common) > 1
            closed[p, other] = s = min(1.0, abs(both.mean()) / mean) if crease else 0.0
            away = distances(ride.rest, mine, [at[p, v] for v in common])
            most = ACROSS_CREASE if crease else ACROSS_CORNER
            d0 = s * mean + (1.0 - s) * mean * np.minimum(most, 2.0 * away / away.max())
            for k, value in zip(mine.tolist(), (JUST * np.minimum(d0, away)).tolist()):
                if other not in panels[k]:
                    near[k][other] = value
    d0 = [of[other] for of in near for other in sorted(of)]
    sides = {tuple(ends): tuple(of) for ends, of in zip(base.edges.tolist(), base.edge_panels.tolist())}
    axes = map(tuple, np.sort(base.hinges[:, :2], axis=1).tolist())
    share = np.array([1.0 - closed.get(sides.get(axis, ()), 0.0) for axis in axes])
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
        hinge_limit=base.hinge_limit * np.maximum(LEAST, share),
        hinge_reach=base.hinge_reach,
        hinge_stiffness=base.hinge_stiffness,
        farthest=max(own.farthest, *d0, 0.0),
    )


def _above(ride: Ride) -> NDArray[np.float64]:
    """Height (m,) of the nodes above the points of boards, towards the front, at rest."""
    a, b, c = np.moveaxis(ride.rest[ride.points], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = ride.x[ride.nodes] - ride.rest[ride.points]
    out = np.zeros(len(ride.rest))
    out[ride.points] = np.einsum("tci,ti->tc", away, normal)
    return out
