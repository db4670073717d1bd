"""Internal amplitudes of a panel (Craig and Bampton): plate motions with fixed interface.

A panel of the scheme n5b8e moves as the plate that follows the heights of its corners and center
and the turns beta of its creased edges statically (`structures.condensed_panel`). Other motions are
added by the lowest modes of the plate with these heights and turns held, so that
the heights are

    w = Psi_h h + Psi_beta beta + Psi_gamma gamma + Phi a,

with Psi the static shapes, and Phi the modes with the amplitudes a. Static shapes and
fixed-interface modes are not coupled by stiffness, but by mass. (R. R. Craig and M. C. C. Bampton,
AIAA Journal 6, 1968.)

Edges also turn unevenly, by beta_k P_k(s), with P_k the Legendre polynomials of the position s from
-1 to 1 along the edge. Without moments of the shape P_k a panel has beta_k = T phi, with phi its
angles (spokes and mean turns beta); the additional amplitudes gamma are deviations from T phi.
Stiffness does not couple gamma with phi, and gamma is held in the modes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import block_diag, null_space

from foldyn.algebra.eigen import Pencil, Spectrum, lowest
from foldyn.algebra.extrapolation import extrapolated
from foldyn.structures.condensed_panel import (
    COARSE,
    FINE,
    heights_and_slopes,
    least_heights,
)
from foldyn.structures.panel_plate import Outline, PanelPlate

TURNS = 3  # number of uneven turns of an edge: P_1, P_2, P_3
SPARE = 4  # additional modes, as finer meshes may change their order
EQUAL = 1e-3  # eigenvalues with a smaller relative difference count as equal and are kept together


class PanelModes(NamedTuple):
    """Internal amplitudes of a panel with size 1, bending stiffness 1 and mass 1; lengths in m.

    Attributes
    ----------
    stiffness : (k, k)
        Stiffness of the amplitudes: gamma of each edge that turns, then the modes, whose mass is 1.
    mass : (b + k, b + k)
        Mass of all coordinates: heights of corners and center, turns of creased edges that are not
        clamped, amplitudes.
    between : (q, b + k)
        Heights at the midpoints of the edges, then of the spokes, for unit coordinates.
    turns : (t, q)
        T: uneven turns per unit of the panel's angles, see `structures.condensed_panel`.
    """

    stiffness: NDArray
    mass: NDArray
    between: NDArray
    turns: NDArray


@lru_cache(maxsize=4096)
def panel_modes(panel: Outline, poissons_ratio: float, count: int) -> PanelModes:
    """Lowest modes of a panel with corners, center and edges held, and the mass of all shapes.

    Frequencies are extrapolated in the size of the mesh; masses come from the fine mesh, so that
    they belong to actual shapes and are positive definite. Modes of equal frequency are kept
    together: a panel with symmetries may have more than `count`.
    """
    from scipy.spatial import cKDTree

    coarse, fine = (PanelPlate(panel, poissons_ratio, n) for n in (COARSE, FINE))
    (low, before), (high, shapes) = (_held_modes(plate, count + SPARE) for plate in (coarse, fine))
    _, same = cKDTree(fine.points).query(coarse.points)
    partner = _partners(before[: len(same)], shapes[same])
    value = extrapolated(low[partner], high, FINE / COARSE)
    kept = np.argsort(value, kind="stable")
    value, shapes = value[kept], shapes[:, kept]
    if value[count] < (1.0 + EQUAL) * value[count - 1]:
        count += 1
    solved = [p.solved([*p.heights, *p.slopes, *p.uneven(TURNS)]) for p in (coarse, fine)]
    static, all_held = solved[1][0], extrapolated(solved[0][1], solved[1][1], FINE / COARSE)
    first = len(fine.heights) + len(fine.slopes)
    own = all_held[first:, first:]
    turns = np.linalg.solve(own, all_held[first:, :first])  # minus the slopes
    natural = static[:, :first] - static[:, first:] @ turns
    heights = np.column_stack([natural @ turning(panel), -static[:, first:], shapes[:, :count]])
    mass = heights.T @ (fine.mass @ heights)
    _, middle = cKDTree(fine.points).query(middles(panel))
    out = PanelModes(
        block_diag(0.5 * (own + own.T), np.diag(value[:count])),
        0.5 * (mass + mass.T),
        heights[middle],
        turns @ heights_and_slopes(panel) @ least_heights(panel, first),
    )
    for array in out:
        array.setflags(write=False)
    return out


def turning(panel: Outline) -> NDArray:
    """`heights_and_slopes` for a panel that is level at clamped edges, not relative to facets."""
    points = len(panel.corners) + (panel.center is not None)
    clamped = [c for c, there in zip(panel.clamped, panel.creased, strict=True) if there]
    level = points + np.flatnonzero(clamped)
    out = heights_and_slopes(panel)
    out[level] = 0.0
    return np.delete(out, level, axis=1)


def middles(panel: Outline) -> NDArray:
    """Midpoints (q, 2) of the edges of a panel, then of its spokes."""
    x = np.array(panel.corners)
    edges = 0.5 * (x + np.roll(x, -1, axis=0))
    return np.concatenate([edges, 0.5 * (x + panel.center)]) if panel.center else edges


def _partners(coarse: NDArray, fine: NDArray) -> NDArray:
    """Index of the coarse shape (n, k) for each fine shape (n, k), as their order may differ."""
    from scipy.optimize import linear_sum_assignment

    size = np.linalg.norm(fine, axis=0)[:, None] * np.linalg.norm(coarse, axis=0)
    return linear_sum_assignment((fine.T @ coarse / size) ** 2, maximize=True)[1]


def _held_modes(plate: PanelPlate, count: int) -> tuple[NDArray, NDArray]:
    """Eigenvalues (count,) and shapes (size, count) of a plate with its interface held."""
    basis = _basis(plate)
    pencil = Pencil(
        sparse.csc_array(basis.T @ plate.stiffness @ basis),
        sparse.csc_array(basis.T @ plate.mass @ basis),
        "superlu",
    )
    found: Spectrum = lowest(pencil, count, np.zeros((pencil.size, 0)))
    shapes = basis @ found.shapes
    sign = np.sign(shapes[np.abs(shapes).argmax(axis=0), np.arange(count)])
    return found.values, shapes * sign


def _basis(plate: PanelPlate) -> sparse.csc_array:
    """Basis of a plate's unknowns while corners, center and edges are held.

    Held heights are zero. So are heights along straight edges, as the ends of these are held, and
    slopes along clamped edges. Unknowns along other edges are orthogonal to the held components.
    """
    size = plate.stiffness.shape[0]
    still = {next(iter(entries)) for entries in (*plate.heights, *plate.lines)}
    held: dict[tuple[int, ...], list[list[float]]] = {}
    for entries in (*plate.slopes, *plate.uneven(TURNS)):
        held.setdefault(tuple(entries), []).append(list(entries.values()))
    rest = sorted(set(range(size)) - still - {side for edge in held for side in edge})
    places, blocks = rest, [sparse.eye_array(len(rest))]
    for edge, rows in held.items():
        free = [j for j, side in enumerate(edge) if side not in still]
        places = places + [edge[j] for j in free]
        blocks.append(null_space(np.array(rows)[:, free]))
    found = sparse.coo_array(sparse.block_diag(blocks))
    row, column = found.coords
    return sparse.csc_array((found.data, (np.array(places)[row], column)), (size, found.shape[1]))
