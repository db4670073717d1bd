"""Internal amplitudes of a panel (Craig and Bampton): what its plate does between what is held.

A panel of the scheme n5b8e moves as the plate that follows the heights of its corners and center
and the turns beta of its creased edges statically (`structures.condensed_panel`). The lowest modes
of the plate with all these held add what it does besides: heights

    w = Psi_h h + Psi_beta beta + Phi a,

Psi the static shapes, Phi the modes with the amplitudes a. Static shapes and modes with held ends
have no stiffness in common; their masses have. (R. R. Craig and M. C. C. Bampton, AIAA Journal 6,
1968.)
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.eigen import Pencil, Spectrum, lowest
from foldyn.algebra.extrapolation import extrapolated
from foldyn.structures.condensed_panel import COARSE, FINE, heights_and_slopes
from foldyn.structures.panel_plate import Outline, PanelPlate

SPARE = 4  # modes beyond those asked for, whose order finer meshes may change
EQUAL = 1e-3  # relative distance of eigenvalues that belong together: neither is taken alone


class PanelModes(NamedTuple):
    """Internal amplitudes of a panel of size 1, bending stiffness 1 and mass 1, lengths in m.

    Attributes
    ----------
    stiffness : (k,)
        Of the amplitudes, whose mass is 1.
    mass : (b + k, b + k)
        Of all its heights w: the heights of corners and center, the turns of creased edges that
        are not clamped, the amplitudes.
    between : (q, b + k)
        Heights by these in the middles of the edges, then of the spokes.
    """

    stiffness: NDArray
    mass: NDArray
    between: NDArray


@lru_cache(maxsize=4096)
def panel_modes(panel: Outline, poissons_ratio: float, count: int) -> PanelModes:
    """The lowest modes of a panel whose corners, center and edges are held, and their masses.

    Frequencies are extrapolated in the size of the mesh; masses are those of the fine one, so that
    they are of real shapes and positive definite. Modes of one frequency are taken together: of a
    panel with symmetries there may be more than `count`.
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
    static = fine.solved([*fine.heights, *fine.slopes])[0] @ turning(panel)
    heights = np.column_stack([static, shapes[:, :count]])
    mass = heights.T @ (fine.mass @ heights)
    _, middle = cKDTree(fine.points).query(middles(panel))
    out = PanelModes(value[:count].copy(), 0.5 * (mass + mass.T), heights[middle])
    for array in out:
        array.setflags(write=False)
    return out


def turning(panel: Outline) -> NDArray:
    """`heights_and_slopes` of a panel that stays level at its clamped edges, not against facets."""
    points = len(panel.corners) + (panel.center is not None)
    clamped = [c for c, there in zip(panel.clamped, panel.creased, strict=True) if there]
    level = points + np.flatnonzero(clamped)
    out = heights_and_slopes(panel)
    out[level] = 0.0
    return np.delete(out, level, axis=1)


def middles(panel: Outline) -> NDArray:
    """Middles (q, 2) of the edges of a panel, then of its spokes."""
    x = np.array(panel.corners)
    edges = 0.5 * (x + np.roll(x, -1, axis=0))
    return np.concatenate([edges, 0.5 * (x + panel.center)]) if panel.center else edges


def _partners(coarse: NDArray, fine: NDArray) -> NDArray:
    """Which of the coarse shapes (n, k) each fine one (n, k) is like; their order may differ."""
    from scipy.optimize import linear_sum_assignment

    size = np.linalg.norm(fine, axis=0)[:, None] * np.linalg.norm(coarse, axis=0)
    return linear_sum_assignment((fine.T @ coarse / size) ** 2, maximize=True)[1]


def _held_modes(plate: PanelPlate, count: int) -> tuple[NDArray, NDArray]:
    """Eigenvalues (count,) and shapes (size, count) of a plate whose interface is held."""
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
    """Unknowns of a plate by those that are left when corners, center and edges are held.

    Held heights are zero; those along straight edges, too, since their ends are, and slopes along
    clamped ones. Of the slopes of an edge the last is the one that makes their mean zero.
    """
    size = plate.stiffness.shape[0]
    still = {next(iter(entries)) for entries in (*plate.heights, *plate.lines)}
    last = {next(reversed(entries)): entries for entries in plate.slopes}
    free = [k for k in range(size) if k not in still and k not in last]
    column = {k: j for j, k in enumerate(free)}
    entries = [(k, j, 1.0) for k, j in column.items()]
    for k, mean in last.items():
        entries += [(k, column[other], -mean[other] / mean[k]) for other in mean if other in column]
    row, place, value = (np.array(each) for each in zip(*entries, strict=True))
    return sparse.csc_array((value, (row, place)), shape=(size, len(free)))
