"""A panel as a thin plate, condensed to its bends and crease edge turns: scheme n5b8e.

The angles of a panel of m corners are the turns of its m spokes (none in a triangle) and, for each
crease edge, the turn beta of the sheet there relative to the adjacent facet, averaged along the
edge. Their energy 1/2 phi^T K phi is the minimum over all plates through the corners and the center
with straight edges kept straight and these mean turns; other edges are free. At a clamped edge beta
is the turn at every point, not the mean. A weld, along which the sheet continues into the next
panel, also has a bow: the mean distance of the sheet from the line between its ends, over its
length. The plate is made of triangles of constant curvature (Morley; in `mechanics.triangle`),
twice, and K extrapolated in their size.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from foldyn.algebra.extrapolation import extrapolated
from foldyn.structures.panel_plate import Outline, PanelPlate, facets_of, mass_of, plane_slopes
from foldyn.structures.plate_boundary import condensed
from foldyn.structures.shared import shared

COARSE, FINE = 8, 16  # pieces per edge in the two meshes


@shared(lambda panel, nu: (len(panel.corners), panel.center is None, nu))
def panel_stiffness(kinds: Sequence[tuple[Outline, float]]) -> list[NDArray]:
    """Stiffness (q, q) of a panel's angles over its bending stiffness E t^3/(12 (1 - nu^2)).

    By its outline and Poisson's ratio. The angles: turns of the spokes, in the order of the corners
    (none in a triangle), then of the creased edges, then the bows, in their order. A turn is the
    increase of a dihedral, seen from the front; a bow is positive toward the front.
    """
    panels = [panel for panel, _ in kinds]
    coarse, fine = (condensed(panels, kinds[0][1], n) for n in (COARSE, FINE))
    found = []
    for panel, *both in zip(panels, coarse, fine, strict=True):
        held = heights_and_slopes(panel)
        stiffness = held.T @ extrapolated(*both, ratio=FINE / COARSE) @ held
        turned = least_heights(panel, len(stiffness))
        out = turned.T @ stiffness @ turned
        out = 0.5 * (out + out.T)
        out.setflags(write=False)
        found.append(out)
    return found


@lru_cache(maxsize=4096)
def panel_moments(panel: Outline, poissons_ratio: float) -> NDArray:
    """Moments (q,) of these angles for a panel with curvature 1 in both directions.

    Over its bending stiffness. With phi the angles and kappa the curvature, the energy is 1/2 phi^T
    K phi - kappa phi^T m, up to terms in kappa alone.
    """
    coarse, fine = (_curled(panel, poissons_ratio, n) for n in (COARSE, FINE))
    stiffness, held_back = (
        extrapolated(a, b, FINE / COARSE) for a, b in zip(coarse, fine, strict=True)
    )
    moments = heights_and_slopes(panel).T @ (stiffness @ _paraboloid(panel) - held_back)
    return least_heights(panel, len(moments)).T @ moments


def least_heights(panel: Outline, size: int) -> NDArray:
    """Matrix (size, q): least heights for given spoke turns; other angles unchanged."""
    points, corners = _points(panel), len(panel.corners)
    spokes = _spoke_turns(points, corners) if panel.center else np.zeros((0, len(points)))
    out = np.zeros((size, len(spokes) + size - len(points)))
    out[: len(points), : len(spokes)] = np.linalg.pinv(spokes, rcond=1e-9)
    out[len(points) :, len(spokes) :] = np.eye(size - len(points))
    return out


def heights_and_slopes(panel: Outline) -> NDArray:
    """Matrix from heights, turns and bows to heights of corners and center, slopes and bows.

    The turns beta replace the outward slopes of creases.
    """
    points, edges = _points(panel), np.flatnonzero(panel.creased)
    turning = slice(len(points), len(points) + len(edges))
    out = np.eye(turning.stop + sum(panel.bowed))
    out[turning, : len(points)] = _facet_slopes(points, len(panel.corners))[edges]
    out[turning, turning] *= -1.0
    return out


def _points(panel: Outline) -> NDArray:
    """Corners and center (points, 2)."""
    return np.array([*panel.corners, panel.center] if panel.center else panel.corners)


def _planes(points: NDArray, corners: int) -> NDArray:
    """Slopes (m, 2, points) of the facets, for heights of the points."""
    facets = np.array(facets_of(points, corners))
    slopes = np.zeros((corners, 2, len(points)))
    np.put_along_axis(slopes, facets[:, None], plane_slopes(points[facets]), axis=2)
    return slopes


def _facet_slopes(points: NDArray, corners: int) -> NDArray:
    """Outward slopes (m, points) of the facets across their edges, for heights of the points."""
    along = np.roll(points[:corners], -1, axis=0) - points[:corners]
    return _across(-along, _planes(points, corners))


def _spoke_turns(points: NDArray, corners: int) -> NDArray:
    """Turns (m, points) of the spokes, for heights of the points."""
    slopes = _planes(points, corners)
    along = points[:corners] - points[corners]
    return _across(along, np.roll(slopes, 1, axis=0) - slopes)


def _across(along: NDArray, slopes: NDArray) -> NDArray:
    """Slopes (m, points) to the left of lines (m, 2), from gradients (m, 2, points)."""
    x, y = (along / np.linalg.norm(along, axis=1)[:, None]).T
    return x[:, None] * slopes[:, 1] - y[:, None] * slopes[:, 0]


def _paraboloid(panel: Outline) -> NDArray:
    """Heights, crease slopes and bows of the paraboloid r^2 / 2."""
    corners = np.array(panel.corners)
    along = np.roll(corners, -1, axis=0) - corners
    length, middle = np.linalg.norm(along, axis=1), corners + 0.5 * along
    slopes = (along[:, 1] * middle[:, 0] - along[:, 0] * middle[:, 1]) / length
    heights = 0.5 * (_points(panel) ** 2).sum(axis=1)
    creased, bowed = (np.flatnonzero(which) for which in (panel.creased, panel.bowed))
    return np.concatenate([heights, slopes[creased], -length[bowed] / 12.0])


def _curled(panel: Outline, poissons_ratio: float, n: int) -> tuple[NDArray, NDArray]:
    """Stiffness of heights, slopes and bows, and forces missing to hold the paraboloid.

    Forces are missing at edges that stay straight.
    """
    plate = PanelPlate(panel, poissons_ratio, n)
    held = [*plate.heights, *plate.slopes, *plate.bows]
    shapes, stiffness = plate.solved(held)
    whole = plate.paraboloid
    there = [sum(share * whole[k] for k, share in entries.items()) for entries in held]
    return stiffness, stiffness @ there - shapes.T @ (plate.stiffness @ whole)


@lru_cache(maxsize=4096)
def panel_mass(panel: Outline, poissons_ratio: float) -> NDArray:
    """Mass matrix (points, points) of a panel of mass 1 that follows its corners and center.

    The panel follows them as a plate at rest, without edge moments except those that keep clamped
    edges level; exact for motions that are linear over the panel and level at clamped edges. Only
    clamped edges may be creased.
    """
    coarse, fine = (PanelPlate(panel, poissons_ratio, n) for n in (COARSE, FINE))
    x = _points(panel)
    less, more = (
        mass_of(
            plate.points, plate.triangles,
            plate.solved([*plate.heights, *plate.slopes])[0][:, : len(x)],
        )
        for plate in (coarse, fine)
    )  # fmt: skip
    out = extrapolated(less, more, FINE / COARSE)
    # keeps linear functions over the panel exact to the last digit, as its facets have them
    edges = np.roll(x[: len(panel.corners)], -1, axis=0) - x[: len(panel.corners)]
    across = edges[list(panel.clamped)] @ [[0.0, -1.0], [1.0, 0.0]]
    level = null_space(across) if len(across) else np.eye(2)  # SciPy before 1.15 needs this
    linear = np.column_stack([np.ones(len(x)), x @ level])
    along = linear @ np.linalg.pinv(linear)
    facets = np.array(facets_of(x, len(panel.corners)))[: None if panel.center else 1]
    out = out + along.T @ (mass_of(x, facets, np.eye(len(x))) - out) @ along
    out = 0.5 * (out + out.T)
    out.setflags(write=False)
    return out
