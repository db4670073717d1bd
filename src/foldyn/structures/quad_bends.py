"""Bends of quadrilateral panels that move like the corners of a plate: `calibration="plate"`.

Five nodes have two shapes apart from planes: the twist w of the corners and the height w0 of the
center. Their spokes, kp (whole) on one diagonal and kq on the other, for G = 1, have the energy

    1/2 (w, w0) H (w, w0)^T,  H = kp P + kq Q,  P and Q from the turns of the spokes,

and forces on the corners alone move the center to w0 = y w. With F the flexibility of a plate
(`structures.quad_plates`):

- forces twist both equally: kp and kq are scaled so that (1, y) H (1, y)^T = 1/F_ww; - in that
twist the facets turn at the creases as the plate's edges do, s_k + y r_k = F_wk/F_ww, in
  the least squares of all creases: that sets y, and by y the ratio kp/kq, which `LARGEST` bounds;
- moments on creases turn their edges as the plate's. Of the flexibility F_kl the twist gives
  F_ww (s_k + y r_k) (s_l + y r_l) and the center r_k r_l/H_00; with R_kl the rest, c is R_kk, and
  R_kk - R_kl where the opposite edge l is a crease too: in a folded sheet, which does not curl,
  opposite creases of a panel have opposite moments.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.structures.quad_plates import flexibilities, twists

LARGEST = 4.0  # kp/kq or kq/kp
SHARP = 0.1  # area of a corner over the quad's, below which the quad counts as a parallelogram


def quad_bends(
    corners: NDArray, centers: NDArray, creased: NDArray, straight: NDArray,
    poissons_ratio: NDArray, hinged: NDArray,
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """Stiffness of spokes and compliance of creases, for the bending stiffness G = 1 N m.

    Both are independent of the panel's size.

    Parameters
    ----------
    corners : (q, 4, 3)
        In order, m; edge k runs from corner k to k + 1.
    centers : (q, 3)
    creased, straight : (q, 4)
        Which edges are creases, and which stay straight.
    poissons_ratio : (q,)
    hinged : (q,)
        The only diagonal that bends, 0 of corners 0 and 2, 1 of corners 1 and 3; -1 if both do.

    Returns
    -------
    (ndarray, ndarray)
        Stiffness (q, 4) of whole spokes, N m/rad, and c (q, 4), rad/(N m), 0 of free edges. If only
        one diagonal bends, its two spokes add up to its stiffness; the others have 0.
    """
    x, center = _in_plane(corners, centers)
    turns, slopes = _facets(x, center)
    p, q = (np.einsum("nik,njk->nij", t, t) for t in (turns[:, :, ::2], turns[:, :, 1::2]))
    flexibility = flexibilities(x, straight, poissons_ratio)
    twist = flexibility[:, 0, 0]
    rise = np.where(creased, slopes[:, 1], 0.0)  # r
    missing = flexibility[:, 0, 1:] / twist[:, None] - slopes[:, 0]
    square = (rise**2).sum(axis=1)
    wanted = (rise * missing).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    y = _height(p, q, np.where(square > 0.0, wanted, _balanced(p, q, 1.0)), hinged)
    kp, kq = _shares(p, q, y, hinged)
    bent = kp * _energy(p, y) + kq * _energy(q, y)
    kp, kq = kp / (bent * twist), kq / (bent * twist)
    lifted = np.where(hinged < 0, kp * p[:, 1, 1] + kq * q[:, 1, 1], np.inf)  # H_00
    by_twist = slopes[:, 0] + y[:, None] * slopes[:, 1]
    rest = flexibility[:, 1:, 1:] - twist[:, None, None] * _products(by_twist)
    rest -= _products(slopes[:, 1]) / lifted[:, None, None]
    compliance = np.diagonal(rest, axis1=1, axis2=2).copy()
    opposite = creased & np.roll(creased, 2, axis=1)
    compliance -= np.where(opposite, rest[:, range(4), [2, 3, 0, 1]], 0.0)
    return np.stack([kp, kq, kp, kq], axis=1), np.where(creased, compliance.clip(0.0), 0.0)


def _balanced(p: NDArray, q: NDArray, ratio: float) -> NDArray:
    """Height y (n,) of the center in balance, for kq = ratio kp."""
    return -(p[:, 0, 1] + ratio * q[:, 0, 1]) / (p[:, 1, 1] + ratio * q[:, 1, 1])


def _height(p: NDArray, q: NDArray, wanted: NDArray, hinged: NDArray) -> NDArray:
    """Possible height (n,) closest to `wanted`; fixed if only one diagonal bends.

    With a hinge on one diagonal only, the spokes on the other do not turn.
    """
    ends = _balanced(p, q, 1.0 / LARGEST), _balanced(p, q, LARGEST)
    y = np.clip(wanted, np.minimum(*ends), np.maximum(*ends))
    only = [-other[:, 0, 1] / other[:, 1, 1] for other in (q, p)]
    return np.select([hinged == 0, hinged == 1], only, y)


def _shares(p: NDArray, q: NDArray, y: NDArray, hinged: NDArray) -> tuple[NDArray, NDArray]:
    """Relative values of kp and kq (n,)."""
    pull, push = p[:, 0, 1] + y * p[:, 1, 1], -(q[:, 0, 1] + y * q[:, 1, 1])
    one = np.where(hinged == 1, 0.0, np.abs(push))
    other = np.where(hinged == 0, 0.0, np.abs(pull))
    return np.where(hinged == 0, 1.0, one), np.where(hinged == 1, 1.0, other)


def _products(values: NDArray) -> NDArray:
    """Products (n, 4, 4) of all pairs of the values (n, 4)."""
    return values[:, :, None] * values[:, None, :]


def _energy(matrix: NDArray, y: NDArray) -> NDArray:
    """(1, y) M (1, y)^T for matrices M (n, 2, 2)."""
    return matrix[:, 0, 0] + 2.0 * y * matrix[:, 0, 1] + y**2 * matrix[:, 1, 1]


def _in_plane(corners: NDArray, centers: NDArray) -> tuple[NDArray, NDArray]:
    """Corners (q, 4, 2) and centers (q, 2) in the planes of the panels, scaled to size 1.

    Corners are counter-clockwise, with the diagonal of corners 0 and 2 along the first axis.

    A panel with a nearly straight or reentrant corner is not the image of a square: the
    parallelogram with the same diagonals replaces it.
    """
    middle = corners.mean(axis=1)
    one, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    normal = np.cross(one, other)
    first = one / np.linalg.norm(one, axis=1)[:, None]
    second = np.cross(normal, first)
    second /= np.linalg.norm(second, axis=1)[:, None]
    axes = np.stack([first, second], axis=2)
    points = np.concatenate([corners, centers[:, None]], axis=1) - middle[:, None]
    points = points @ axes / np.sqrt(0.5 * np.linalg.norm(normal, axis=1))[:, None, None]
    x, center = points[:, :4], points[:, 4]
    edge = np.roll(x, -1, axis=1) - x
    before = np.roll(edge, 1, axis=1)
    area = before[:, :, 0] * edge[:, :, 1] - before[:, :, 1] * edge[:, :, 0]
    sharp = area.min(axis=1) < SHARP * area.mean(axis=1)
    half = 0.5 * np.stack([x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]], axis=1)
    x[sharp] = np.concatenate([-half, half], axis=1)[sharp]
    center[sharp] = 0.0
    return x, center


def _facets(x: NDArray, center: NDArray) -> tuple[NDArray, NDArray]:
    """Turns of the spokes and outward slopes of the facets at the edges, both (n, 2, 4).

    For a unit twist with the center at 0, and for the center at 1 with the corners at 0.
    """
    here = x - center[:, None]
    there = np.roll(here, -1, axis=1)
    heights = np.stack([twists(x), np.full(x.shape[:2], -1.0)], axis=1)  # relative to the center
    after = np.roll(heights, -1, axis=2)
    cross = (here[:, :, 0] * there[:, :, 1] - here[:, :, 1] * there[:, :, 0])[:, None]
    by_x = (heights * there[:, None, :, 1] - after * here[:, None, :, 1]) / cross
    by_y = (after * here[:, None, :, 0] - heights * there[:, None, :, 0]) / cross
    slope = np.stack([by_x, by_y], axis=3)
    edge, spoke = there - here, here / np.linalg.norm(here, axis=2)[:, :, None]
    outward = np.stack([edge[:, :, 1], -edge[:, :, 0]], axis=2)
    outward /= np.linalg.norm(edge, axis=2)[:, :, None]
    left = np.stack([-spoke[:, :, 1], spoke[:, :, 0]], axis=2)
    turns = np.einsum("nka,nika->nik", left, np.roll(slope, 1, axis=2) - slope)
    return turns, np.einsum("nka,nika->nik", outward, slope)
