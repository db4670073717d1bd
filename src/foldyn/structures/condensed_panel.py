"""A panel as a thin plate, condensed to its bends and crease edge turns: scheme n5b8e.

The angles phi of a panel of m corners are the turns of its m spokes (none in a triangle) and, for
each crease edge, the turn beta of the sheet there relative to the adjacent facet, averaged along
the edge. Their energy 1/2 phi^T K phi is the least energy of a plate through the corners and the
center that has these mean turns and keeps straight edges straight; other edges are free. At a
clamped edge beta is the turn at every point, not the mean. A weld, along which the sheet continues
into the next panel, also has a bow: the mean distance of the sheet from the line between its ends,
divided by its length. The plate is made of triangles of constant curvature (Morley; in
`mechanics.triangle`), in two sizes, and K is extrapolated in the size.

Each facet of a panel is cut evenly: all its triangles are the same, half of them turned by 180
degrees. So each entry of a panel's stiffness is a sum of entries for its facets, as single
triangles, with factors that are equal for all panels with the same number of corners. A scale of
1/n multiplies the stiffness of heights by n^2, and leaves the stiffness of slopes unchanged.

The unknowns at an edge of n pieces, for any edge condition:

    heights   w_i = (1 - i/n) w_0 + i/n w_n + a_i L b + e_i - e_(i-1),    i = 1 ... n - 1
    slopes    s_i = s + d_i - d_(i-1),                                    i = 1 ... n

with the bow b, which is a parabola, a_i = 6 i (n - i)/(n^2 - 1), the mean slope s, and e and d,
which are 0 at both ends of the edge. On a straight edge, b and all e are 0; on a clamped edge all d
are 0. Such e and d are uncoupled in the matrix, with the stiffness 1. The paraboloid r^2 / 2 has
no e and d: what it would do to straight edges is in their b.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import block_diag, null_space
from scipy.sparse.linalg import splu

from foldyn.algebra.condensing import Condensing
from foldyn.algebra.extrapolation import extrapolated
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.structures.panel_plate import (
    Outline,
    across_edges,
    facets_of,
    mass_of,
    meshed,
    plane_slopes,
    plate_blocks,
    shared,
    sides_of,
    symmetric,
)

COARSE, FINE = 8, 16  # pieces per edge in the two meshes


@shared(lambda panel, nu: (len(panel.corners), panel.center is None, nu))
def panel_stiffness(kinds: Sequence[tuple[Outline, float]]) -> list[NDArray]:
    """Stiffness (q, q) of each panel's angles, for a bending stiffness E t^3/(12 (1 - nu^2)) of 1.

    `kinds` has the outline and Poisson's ratio of each panel. The angles are the turns of the
    spokes, in the order of the corners (none in a triangle), then the turns of the creased edges,
    then the bows, in the order of the edges. A turn is the increase of a dihedral, seen from the
    front; a bow is positive toward the front.
    """
    panels = [panel for panel, _ in kinds]
    coarse, fine = (condensed(panels, kinds[0][1], n) for n in (COARSE, FINE))
    found = []
    for panel, *both in zip(panels, coarse, fine, strict=True):
        held = heights_and_slopes(panel)
        stiffness = held.T @ extrapolated(*both, ratio=FINE / COARSE) @ held
        turned = least_heights(panel, len(stiffness))
        found.append(symmetric(turned.T @ stiffness @ turned))
    return found


@lru_cache(maxsize=4096)
def panel_moments(panel: Outline, poissons_ratio: float) -> NDArray:
    """Moments (q,) of the angles of a panel with free curvature 1 in both directions.

    The moments are divided by the bending stiffness. With phi the angles and kappa the curvature,
    the energy is 1/2 phi^T K phi - kappa phi^T m, up to terms in kappa alone.
    """
    coarse, fine = (_curled(panel, poissons_ratio, n) for n in (COARSE, FINE))
    moments = heights_and_slopes(panel).T @ extrapolated(coarse, fine, FINE / COARSE)
    return least_heights(panel, len(moments)).T @ moments


def least_heights(panel: Outline, size: int) -> NDArray:
    """Matrix (size, q) from angles to the least heights with the spoke turns, and other angles."""
    points, corners = _points(panel), len(panel.corners)
    spokes = spoke_turns(points, corners) if panel.center else np.zeros((0, len(points)))
    return block_diag(np.linalg.pinv(spokes, rcond=1e-9), np.eye(size - len(points)))


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


def spoke_turns(points: NDArray, corners: int) -> NDArray:
    """Turns (m, points) of the spokes, for heights of the points."""
    slopes = _planes(points, corners)
    return _across(points[:corners] - points[corners], np.roll(slopes, 1, axis=0) - slopes)


def _across(along: NDArray, slopes: NDArray) -> NDArray:
    """Slopes (m, points) to the left of lines (m, 2), from gradients (m, 2, points)."""
    x, y = (along / np.linalg.norm(along, axis=1)[:, None]).T
    return x[:, None] * slopes[:, 1] - y[:, None] * slopes[:, 0]


def _paraboloid(panel: Outline) -> NDArray:
    """Heights, and slopes and bows of all edges, of the paraboloid r^2 / 2."""
    corners = np.array(panel.corners)
    along = np.roll(corners, -1, axis=0) - corners
    length, middle = np.linalg.norm(along, axis=1), corners + 0.5 * along
    slopes = (along[:, 1] * middle[:, 0] - along[:, 0] * middle[:, 1]) / length
    return np.concatenate([0.5 * (_points(panel) ** 2).sum(axis=1), slopes, -length / 12.0])


def _curled(panel: Outline, poissons_ratio: float, n: int) -> NDArray:
    """Forces on heights, slopes and bows that hold the paraboloid r^2 / 2."""
    (stiffness,), (held,), (straight,) = _balanced([panel], poissons_ratio, n)
    # the mean over the points of a straight edge is less than that along the edge
    shape = _paraboloid(panel) * np.where(straight, 1.0 - 1.0 / n**2, 1.0)
    return (stiffness[:, held | straight] @ shape[held | straight])[held]


@lru_cache(maxsize=4096)
def panel_mass(panel: Outline, poissons_ratio: float) -> NDArray:
    """Mass matrix (points, points) of a panel of mass 1 that follows its corners and center.

    The panel follows them as a plate at rest, without edge moments except those that keep clamped
    edges level; exact for motions that are linear over the panel and level at clamped edges. Only
    clamped edges may be creased.
    """
    less, more = (mass_of(*_followed(panel, poissons_ratio, n)) for n in (COARSE, FINE))
    x = _points(panel)
    out = extrapolated(less, more, FINE / COARSE)
    # functions that are linear over the panel stay exact to the last digit, as on its facets
    edges = np.roll(x[: len(panel.corners)], -1, axis=0) - x[: len(panel.corners)]
    across = edges[list(panel.clamped)] @ [[0.0, -1.0], [1.0, 0.0]]
    level = null_space(across) if len(across) else np.eye(2)  # SciPy before 1.15 needs this
    linear = np.column_stack([np.ones(len(x)), x @ level])
    along = linear @ np.linalg.pinv(linear)
    facets = np.array(facets_of(x, len(panel.corners)))[: None if panel.center else 1]
    return symmetric(out + along.T @ (mass_of(x, facets, np.eye(len(x))) - out) @ along)


def _followed(panel: Outline, poissons_ratio: float, n: int) -> tuple[NDArray, NDArray, NDArray]:
    """Points and triangles of the mesh, and heights (points, k) for heights 1 of `_points`."""
    cut, entries, _ = _entries([panel], poissons_ratio, n)
    x, size = _points(panel), len(cut.edge)
    lower = sparse.coo_array((entries[:, 0], tuple(cut.pairs.T)), (size, size)).tocsc()
    matrix = sparse.csc_array(lower + sparse.tril(lower, -1).T)
    given = np.concatenate([np.ones(len(x), bool), panel.creased, panel.straight])
    kept = np.arange(size - len(given), size)
    loose, corners = np.setdiff1d(np.arange(size), kept[given]), kept[: len(x)]
    found = np.zeros((size, len(x)))
    found[corners] = np.eye(len(x))
    found[loose] = -splu(matrix[loose][:, loose]).solve(matrix[loose][:, corners].toarray())
    return cut.weights @ x, cut.triangles, (cut.basis @ found)[: len(cut.weights)]


class Cut(NamedTuple):
    """How plates of panels with m corners are cut and condensed.

    Attributes
    ----------
    weights, triangles : (p, corners and center), (nt, 3)
        Weights of corners and center that give each point; points of the triangles.
    basis : (size, size)
        Heights of the points, and slopes, for the unknowns.
    pairs : (k, 2)
        Unknowns with an entry in the stiffness. The last unknowns are kept: heights of corners and
        center, s of the edges, L b of the edges.
    factors : (k, 36 facets)
        Factors from entries of the facets' stiffness to these entries.
    edge : (size,)
        When an unknown is 0: k, if edge k is straight; m + k, if edge k is clamped; 2 m, never.
    condensing : Condensing
    """

    weights: NDArray
    triangles: NDArray
    basis: sparse.csr_array
    pairs: NDArray
    factors: sparse.csr_array
    edge: NDArray
    condensing: Condensing


@lru_cache(maxsize=64)
def _cut(m: int, center: bool, n: int) -> Cut:
    """Cut of panels with or without a center, with n pieces per edge, at least 2."""
    unit, facets = np.eye(m + center), m if center else 1
    weights, triangles, at, edges = meshed(unit[:m], unit[-1] if center else None, n)
    points = len(weights)
    # inverted triangles start at another corner, so that their sides match the facet's numbering
    triangles = triangles.reshape(facets, n * n, 3)
    turned = n * (n + 1) // 2
    triangles[:, turned:] = np.roll(triangles[:, turned:], -1, axis=2)
    triangles = triangles.reshape(-1, 3)
    side, sign, ends = sides_of(triangles)
    basis, edge = _basis(at, edges, across_edges(edges, ends, points), points + len(ends))
    size, count = len(edge), 36 * facets
    dofs = np.concatenate([triangles, points + side], axis=1)
    scale = np.concatenate([np.full(triangles.shape, float(n)), sign], axis=1)
    value = (scale[:, :, None] * scale[:, None, :]).ravel()
    row, column = pairs_within(dofs).T
    source = (36 * np.repeat(np.arange(facets), n * n)[:, None] + np.arange(36)).ravel()
    for _ in range(2):  # basis' A basis: first by rows, then by columns
        part = sparse.coo_array((value, (row, count * column + source)), shape=(size, count * size))
        found = sparse.coo_array(basis.T @ sparse.csr_array(part))
        value, (column, rest) = found.data, found.coords
        row, source = np.divmod(rest, count)
    lower = row >= column
    keys, place = np.unique(row[lower] * size + column[lower], return_inverse=True)
    pairs = np.stack(np.divmod(keys, size), axis=1)
    factors = sparse.csr_array((value[lower], (place, source[lower])), (len(pairs), count))
    condensing = Condensing(pairs, size, len(at) + 2 * m)
    return Cut(weights, triangles, basis, pairs, factors, edge, condensing)


def _basis(
    at: NDArray, edges: Sequence[NDArray], sides: Sequence[tuple[NDArray, NDArray]], size: int
) -> tuple[sparse.csr_array, NDArray]:
    """Matrix from unknowns to heights and slopes, and `Cut.edge` (size,) of the unknowns.

    at, edges : indices of the heights of corners and center; of the points (n + 1,) on each edge.
    sides : indices (n,) of the slopes across each edge's sides, and their signs, 1 if outward.
    """
    m, n = len(edges), len(sides[0][0])
    first = size - len(at) - 2 * m  # first of the kept unknowns
    own = 2 * n - 3  # e and d of an edge
    steps = np.arange(1, n) / n
    parabola, where = 6.0 * steps * (1.0 - steps) / (1.0 - 1.0 / n**2), np.full(size, 2 * m)
    inside = np.setdiff1d(np.arange(size), np.concatenate([at, *edges, *(s for s, _ in sides)]))
    stay = np.arange(first, size)
    parts = [(inside, np.arange(len(inside)), 1.0), (at, stay[: len(at)], 1.0)]
    for k, (points, (across, sign)) in enumerate(zip(edges, sides, strict=True)):
        between = points[1:-1]
        e, d = np.split(len(inside) + own * k + np.arange(own), [n - 2])
        mean, bow = stay[len(at) + k], stay[len(at) + m + k]
        where[e], where[d] = k, m + k
        parts += [
            (between, stay[k], 1.0 - steps), (between, stay[(k + 1) % m], steps),
            (between, bow, parabola), (between[:-1], e, 1.0), (between[1:], e, -1.0),
            (across, mean, sign), (across[:-1], d, sign[:-1]), (across[1:], d, -sign[1:]),
        ]  # fmt: skip
    each = zip(*(np.broadcast_arrays(*part) for part in parts), strict=True)
    rows, columns, values = map(np.concatenate, each)
    return sparse.csr_array((values, (rows, columns)), (size, size)), where


def condensed(panels: Sequence[Outline], poissons_ratio: float, n: int) -> list[NDArray]:
    """Stiffness of heights of corners and center, mean outward slopes of creases, and bows.

    For G = 1. At most eight panels, with the same number of corners.

    n : pieces of each edge.
    """
    stiffness, held, _ = _balanced(panels, poissons_ratio, n)
    return [own[np.ix_(kept, kept)] for own, kept in zip(stiffness, held, strict=True)]


def _entries(
    panels: Sequence[Outline], poissons_ratio: float, n: int
) -> tuple[Cut, NDArray, NDArray]:
    """The cut of panels, the entries (k, c) of their stiffness, and their `_points` (c, ., 2)."""
    m, center = len(panels[0].corners), panels[0].center is not None
    cut, points = _cut(m, center, n), np.array([_points(panel) for panel in panels])
    facets = points[:, facets_of(points[0], m)[: None if center else 1]].reshape(-1, 3, 2)
    blocks = plate_blocks(facets, np.ones((len(facets), 3)), poissons_ratio)
    free = 1.0 - np.array([[*own.straight, *own.clamped, False] for own in panels]).T[cut.edge]
    row, column = cut.pairs.T
    values = cut.factors @ blocks.reshape(len(panels), -1).T * (free[row] * free[column])
    values[row == column] += 1.0 - free
    return cut, values, points


def _balanced(
    panels: Sequence[Outline], poissons_ratio: float, n: int
) -> tuple[NDArray, NDArray, NDArray]:
    """Stiffness (c, k, k) of heights, slopes and bows; which are held, and which of straight edges.

    Slopes and bows that are neither are in balance.
    """
    cut, entries, points = _entries(panels, poissons_ratio, n)
    m = len(panels[0].corners)
    stiffness = cut.condensing(entries)
    lengths = np.linalg.norm(np.roll(points[:, :m], -1, axis=1) - points[:, :m], axis=2)
    scale = np.concatenate([np.ones((len(panels), stiffness.shape[1] - m)), lengths], axis=1)
    stiffness *= scale[:, :, None] * scale[:, None, :]
    held = np.ones((len(panels), stiffness.shape[1]), bool)
    held[:, points.shape[1] :] = [own.creased + own.bowed for own in panels]
    straight = np.zeros(held.shape, bool)
    straight[:, -m:] = [own.straight for own in panels]
    known = held | straight
    rows, columns = known[:, :, None], known[:, None, :]
    loose = np.where(rows | columns, 0.0, stiffness) + rows * np.eye(held.shape[1])
    across = np.where(~rows & columns, stiffness, 0.0)
    return stiffness - np.swapaxes(across, 1, 2) @ np.linalg.solve(loose, across), held, straight
