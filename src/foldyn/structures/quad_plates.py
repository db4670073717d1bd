"""Quadrilateral panels whose corners move like a thin plate's: `calibration="plate"`.

Apart from planes, five nodes have two shapes: the twist w of the corners and the height w0 of the
center. With the stiffness kp of whole spokes on one diagonal and kq on the other, for G = 1, the
spokes have the energy

    1/2 (w, w0) H (w, w0)^T,  H = kp P + kq Q,  P and Q from the turns of the spokes,

and forces that act only on the corners move the center to w0 = y w. With F the flexibility of a
plate:

- forces twist both equally: kp and kq are scaled so that (1, y) H (1, y)^T = 1/F_ww;
- in that twist the facets turn at the creases as the plate's edges do, s_k + y r_k = F_wk/F_ww, in
  the sense of least squares over all creases: this sets y, and y sets the ratio kp/kq, within
  `LARGEST`;
- moments on creases turn edges as they turn the plate's. The twist contributes F_ww (s_k + y r_k)
  (s_l + y r_l) to the flexibility F_kl, and the center r_k r_l/H_00; R_kl is the rest. The
  compliance c is R_kk, or R_kk - R_kl if the opposite edge l is a crease too: in a folded sheet,
  which does not curl, opposite creases of a panel have opposite moments.

F is the flexibility of a plate with G = 1 whose corners lie in a plane except for a twist w
(heights a_v w, a orthogonal to all planes) and whose edges carry total moments M_k, evenly
distributed: the twist and the mean outward slopes at the edges are

    (w, s_1 ... s_4) = F (T, M_1 ... M_4),  T the force on w.

Edges are straight, or free to bow. Ritz method: heights are polynomials in the bilinear coordinates
xi, eta from -1 to 1 (integrated Legendre polynomials, so that an edge to which no polynomial
belongs stays straight), and F is extrapolated from the two `DEGREES`. Between straight edges that
meet at an angle alpha > pi/2, curvatures grow as r^(pi/alpha - 2), and errors fall with the power 4
(pi/alpha - 1) of the degree (Babuska and Suri, SIAM Review 36, 1994), for low degrees of the degree
+ 1. Errors at corners of free edges fall about as slowly as at the angle `OBTUSE`.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

LARGEST = 4.0  # kp/kq or kq/kp
SHARP = 0.1  # corner area/quad area, below which the quad counts as a parallelogram


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
        The only diagonal that bends: 0 between corners 0 and 2, 1 between corners 1 and 3; -1 if
        both diagonals bend.

    Returns
    -------
    (ndarray, ndarray)
        Stiffness (q, 4) of whole spokes, N m/rad, and c (q, 4), rad/(N m), 0 at free edges. If only
        one diagonal bends, the stiffnesses of its two spokes add up to its own; other spokes have
        0.
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

    With a hinge on one diagonal only, the spokes of the other diagonal do not turn.
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

    Two cases: a unit twist with the center at 0; the center at 1 with the corners at 0.
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


DEGREES = (4, 6)
OBTUSE = 2.0 * np.pi / 3.0
POINTS = 8  # Gauss points in each direction
CHUNK = 256  # panels at a time
DIGITS = 11  # panels that agree to so many digits count as equal
SIGNS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # xi, eta of the corners


def flexibilities(x: NDArray, straight: NDArray, poissons_ratio: NDArray) -> NDArray:
    """Flexibilities F (p, 5, 5) of convex panels of size about 1, computed once for equal panels.

    Parameters
    ----------
    x : (p, 4, 2)
        Corners in the plane of each panel, counter-clockwise; edge k runs from k to k + 1.
    straight : (p, 4)
        Which edges stay straight.
    poissons_ratio : (p,)
    """
    told = np.concatenate([x.reshape(-1, 8), straight, poissons_ratio[:, None]], axis=1)
    told = told.round(DIGITS) + 0.0
    _, first, same = np.unique(told, axis=0, return_index=True, return_inverse=True)
    found = [np.zeros((0, 5, 5))]
    for start in range(0, len(first), CHUNK):
        part = first[start : start + CHUNK]
        found.append(_flexibilities(x[part], straight[part], poissons_ratio[part]))
    return np.concatenate(found)[same.ravel()]


def twists(x: NDArray) -> NDArray:
    """Heights (p, 4) of corners x (p, 4, 2) in a unit twist; they are orthogonal to all planes."""
    planes = np.concatenate([np.ones((*x.shape[:2], 1)), x - x.mean(axis=1, keepdims=True)], axis=2)
    heights = np.stack([np.linalg.det(np.delete(planes, k, axis=1)) for k in range(4)], axis=1)
    heights *= np.array([1.0, -1.0, 1.0, -1.0])
    return heights / np.abs(heights).mean(axis=1, keepdims=True)


def _flexibilities(x: NDArray, straight: NDArray, poissons_ratio: NDArray) -> NDArray:
    _, weights = legendre.leggauss(POINTS)
    curvature, area = _curvatures(x)
    curvature = curvature * np.sqrt(area * np.outer(weights, weights).ravel())[:, :, None, None]
    nu = poissons_ratio[:, None, None]
    xx, yy, xy = (np.ascontiguousarray(curvature[:, :, k]) for k in range(3))
    total = xx + yy
    both = np.swapaxes(xx, 1, 2) @ yy
    energy = np.swapaxes(total, 1, 2) @ total - (1.0 - nu) * (
        both + np.swapaxes(both, 1, 2) - 2.0 * np.swapaxes(xy, 1, 2) @ xy
    )
    loads = np.zeros((len(x), energy.shape[1], 5))
    loads[:, 0, 0] = 1.0
    for k in range(4):
        loads[:, :, 1 + k] = _mean_slope(x, k, 0.5 * weights)
    own, degree = _edge_and_degree()
    held = (own >= 0) & straight[:, own]
    coarse, fine = (_solved(energy, loads, held | (degree > d)) for d in DEGREES)
    power = 4.0 * (np.pi / np.maximum(_obtuse(x, straight), OBTUSE) - 1.0)
    rest = 1.0 / (((1 + DEGREES[1]) / (1 + DEGREES[0])) ** power - 1.0)
    return fine + rest[:, None, None] * (fine - coarse)


def _solved(energy: NDArray, loads: NDArray, held: NDArray) -> NDArray:
    """Flexibilities (p, 5, 5) with the shapes `held` (p, k) removed."""
    energy = np.where(held[:, :, None] | held[:, None, :], 0.0, energy)
    energy += held[:, :, None] * np.eye(energy.shape[1])
    loads = np.where(held[:, :, None], 0.0, loads)
    return np.swapaxes(loads, 1, 2) @ np.linalg.solve(energy, loads)


def _obtuse(x: NDArray, straight: NDArray) -> NDArray:
    """Largest angle (p,) between two adjacent straight edges, 0 if there are none."""
    edge = np.roll(x, -1, axis=1) - x
    edge /= np.linalg.norm(edge, axis=2)[:, :, None]
    cosine = -(edge * np.roll(edge, 1, axis=1)).sum(axis=2)
    between = straight & np.roll(straight, 1, axis=1)
    return np.where(between, np.arccos(cosine.clip(-1.0, 1.0)), 0.0).max(axis=1)


def _edge_and_degree() -> tuple[NDArray, NDArray]:
    """Edge (k,) bowed by each shape, -1 for the twist and inner shapes; its degree (k,)."""
    extra = np.arange(2, DEGREES[1] + 1)
    within = np.maximum(extra[:, None], extra).ravel()
    edge = np.repeat([-1, 0, 2, 3, 1, -1], [1, *[len(extra)] * 4, len(within)])
    return edge, np.concatenate([[1], *[extra] * 4, within])


def _line(t: NDArray, derivative: int) -> tuple[NDArray, NDArray]:
    """Two linear functions (n, 2) of coordinates t, and d functions that are 0 at both ends."""
    linear, bows = (legendre.legval(t, group).T for group in _polynomials(derivative))
    return linear, bows


@cache
def _polynomials(derivative: int) -> tuple[NDArray, NDArray]:
    """Legendre coefficients of the functions of `_line`, in columns."""
    ends = np.array([[0.5, 0.5], [-0.5, 0.5]])
    inner = legendre.legint(np.eye(DEGREES[1])[:, 1:], lbnd=-1.0)
    return legendre.legder(ends, derivative), legendre.legder(inner, derivative)


@cache
def _points(edge: int | None) -> NDArray:
    """Coordinates xi, eta (n, 2) of the Gauss points of an edge, or of the whole panel."""
    nodes, _ = legendre.leggauss(POINTS)
    if edge is None:
        return np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=2).reshape(-1, 2)
    start, end = SIGNS[edge], SIGNS[(edge + 1) % 4]
    return 0.5 * ((1.0 - nodes)[:, None] * start + (1.0 + nodes)[:, None] * end)


@cache
def _functions(edge: int | None, d: int, e: int) -> tuple[NDArray, NDArray]:
    """Bilinear functions (n, 4) of the corners and all shapes but the twist (n, k - 1) there.

    They are derivatives, d times in xi, e times in eta.
    """
    at = _points(edge)
    (ends, bows), (sides, lifts) = _line(at[:, 0], d), _line(at[:, 1], e)
    corners = np.stack([ends[:, i] * sides[:, j] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
    others = [
        (sides[:, :, None] * bows[:, None, :]).reshape(len(at), -1),  # bows of edges 0 and 2
        (ends[:, :, None] * lifts[:, None, :]).reshape(len(at), -1),  # bows of edges 3 and 1
        (bows[:, :, None] * lifts[:, None, :]).reshape(len(at), -1),
    ]
    return corners, np.concatenate(others, axis=1)


def _shapes(heights: NDArray, edge: int | None, d: int, e: int) -> NDArray:
    """Derivatives (p, n, k) of all shapes at Gauss points: d times in xi, e times in eta."""
    corners, rest = _functions(edge, d, e)
    twist = (heights @ corners.T)[:, :, None]
    return np.concatenate([twist, np.broadcast_to(rest, (len(heights), *rest.shape))], axis=2)


def _jacobian(x: NDArray, at: NDArray) -> NDArray:
    """Derivatives (p, n, 2, 2) of x, y (rows) with respect to xi, eta at points (n, 2)."""
    one = 1.0 + SIGNS[None] * at[:, None]
    by_xi = 0.25 * SIGNS[:, 0] * one[:, :, 1]
    by_eta = 0.25 * SIGNS[:, 1] * one[:, :, 0]
    return np.stack([by_xi @ x, by_eta @ x], axis=-1)


def _gradients(x: NDArray, edge: int | None) -> tuple[NDArray, NDArray, NDArray]:
    """Jacobians and their inverses (p, n, 2, 2), and gradients (p, n, 2, k) of all shapes."""
    heights, jacobian = twists(x), _jacobian(x, _points(edge))
    inverse = np.linalg.inv(jacobian)  # rows xi, eta; columns x, y
    slopes = np.stack([_shapes(heights, edge, 1, 0), _shapes(heights, edge, 0, 1)], axis=2)
    return jacobian, inverse, np.swapaxes(inverse, 2, 3) @ slopes


def _curvatures(x: NDArray) -> tuple[NDArray, NDArray]:
    """Second derivatives (p, n, 3, k) of all shapes, xx, yy and xy; areas (p, n) at the points."""
    heights, (jacobian, inverse, by) = twists(x), _gradients(x, None)
    # d2 w/d xi2 etc., minus the effect of curved coordinates: x, y are bilinear
    mixed = 0.25 * np.einsum("v,pva->pa", SIGNS[:, 0] * SIGNS[:, 1], x)
    xi, eta = _shapes(heights, None, 2, 0), _shapes(heights, None, 0, 2)
    cross = _shapes(heights, None, 1, 1) - np.einsum("pa,pnak->pnk", mixed, by)
    a, b = inverse[:, :, 0, :, None], inverse[:, :, 1, :, None]

    def second(i: int, j: int) -> NDArray:
        both = a[:, :, i] * b[:, :, j] + a[:, :, j] * b[:, :, i]
        return a[:, :, i] * a[:, :, j] * xi + b[:, :, i] * b[:, :, j] * eta + both * cross

    return np.stack([second(0, 0), second(1, 1), second(0, 1)], axis=2), np.linalg.det(jacobian)


def _mean_slope(x: NDArray, k: int, weights: NDArray) -> NDArray:
    """Mean outward slopes (p, k) of all shapes at edge k."""
    _, _, by = _gradients(x, k)
    along = x[:, (k + 1) % 4] - x[:, k]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outward /= np.linalg.norm(along, axis=1)[:, None]
    return np.einsum("pa,pnak,n->pk", outward, by, weights)
