"""Loads that follow the sheet: pressure on panels and moments of creases, as pictures show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn import mechanics
from foldyn.cases import Case, CreaseMoment, Pressure, Temperature
from foldyn.cases.selection import resolve_panels
from foldyn.structures.discretized import Discretized

if TYPE_CHECKING:
    from foldyn.plots.scene import Points

STEPS = 12  # radius of an arc
NEAR, FAR = 0.15, 1.0  # rad, largest angle from a panel to the end of an arc


class Share(NamedTuple):
    """A load on some panels (Pa, K) or creases (N m), with its history."""

    numbers: NDArray[np.int64]
    value: NDArray[np.float64]
    history: Any


def on_panels(case: Case, kind: type[Pressure] | type[Temperature]) -> list[Share]:
    """Pressure (Pa) or temperature changes (K) of panels, one for each load of a kind."""
    structure, found = case.structure, []
    for place, load in case.loads_of(kind):
        triangles = resolve_panels(structure, load.panels, f"{place}.panels")
        panels = np.unique(structure.triangle_panel[triangles])
        value = load.pressure if kind is Pressure else load.change
        found.append(Share(panels, np.full(len(panels), value), load.history))
    return found


def moments(case: Case) -> list[Share]:
    """Moments of whole creases, one for each load."""
    found = []
    for place, load in case.loads_of(CreaseMoment):
        creases, moment = load.of_creases(case.structure, place)
        found.append(Share(creases, moment, load.history))
    return found


def panel_middles(structure: Discretized, points: Points, share: Share) -> Points:
    """Mean corners (k, 3) of panels."""
    faces = structure.pattern.faces
    return np.array([points[list(faces[panel])].mean(axis=0) for panel in share.numbers])


def panel_arrows(case: Case, points: Points, share: Share) -> tuple[Points, Points]:
    """Mean corners of panels (k, 3) and pressure vectors (k, 3), Pa, there."""
    structure = case.structure
    middles, vectors = [], []
    for panel, pressure in zip(share.numbers, share.value, strict=True):
        corners = points[structure.triangles[structure.triangle_panel == panel]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(normal, axis=1)
        middles.append(area @ corners.mean(axis=1) / area.sum())
        along = normal.sum(axis=0)
        vectors.append(pressure * along / np.linalg.norm(along))
    return np.array(middles), np.array(vectors)


def crease_arcs(case: Case, points: Points, share: Share, radius: float) -> Points:
    """Arcs (m, STEPS, 3) about the middles of creases, two for each, that end at a head.

    They lie on the front. For a positive moment, which opens the crease, they point towards the
    panels; for a negative one, away from them.
    """
    pieces, arcs = case.structure.body.sheet.fold_hinges(), []
    for crease, moment in zip(share.numbers, share.value, strict=True):
        own = pieces.nodes[pieces.fold == crease]
        ends = points[own[:, :2]].reshape(-1, 3)
        middle = own[np.linalg.norm(points[own[:, :2]].mean(1) - ends.mean(0), axis=1).argmin()]
        j, k, i, _ = points[middle]
        angle = float(mechanics.angles(points - points.mean(0), middle[None].astype(np.uint32))[0])
        axis = (k - j) / np.linalg.norm(k - j)
        wing = (i - j) - axis * ((i - j) @ axis)
        wing = wing / np.linalg.norm(wing)
        turn = np.linspace(max(NEAR, min(FAR, 0.45 * angle)), NEAR, STEPS)
        turn = turn if moment > 0.0 else turn[::-1]
        for way in (turn, angle - turn):
            across = np.outer(np.cos(way), wing) + np.outer(np.sin(way), np.cross(axis, wing))
            arcs.append(ends.mean(axis=0) + radius * across)
    return np.array(arcs).reshape(-1, STEPS, 3)
