"""Quadrilateral panels as thin plates, twisted by their corners and bent by edge moments.

The flexibilities of a plate with the bending stiffness G = 1, whose corners lie in a plane except
for a twist w (heights a_v w, a orthogonal to all planes) and whose edges carry total moments M_k,
evenly distributed: the twist and the mean outward slopes at the edges are

    (w, s_1 ... s_4) = F (T, M_1 ... M_4),  T the force on w.

Edges are straight, or free to bow. Ritz method: heights are polynomials in the bilinear coordinates
xi, eta from -1 to 1 (integrated Legendre polynomials, so that an edge without its own polynomials
stays straight), and F is extrapolated from the two `DEGREES`. Between straight edges that meet at
an angle alpha > pi/2 curvatures grow as r^(pi/alpha - 2), and errors fall with the power 4
(pi/alpha - 1) of the degree (Babuska and Suri, SIAM Review 36, 1994), of the degree + 1 for low
ones; corners of free edges converge about as slowly as the angle `OBTUSE`.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

DEGREES = (4, 6)
OBTUSE = 2.0 * np.pi / 3.0
POINTS = 8  # Gauss points in each direction
CHUNK = 256  # panels at a time
DIGITS = 11  # digits to which equal panels agree
SIGNS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # xi, eta of the corners


def flexibilities(x: NDArray, straight: NDArray, poissons_ratio: NDArray) -> NDArray:
    """Flexibilities F (p, 5, 5) of convex panels of about size 1; equal panels share them.

    Parameters
    ----------
    x : (p, 4, 2)
        Corners in the plane of each panel, counter-clockwise; edge k runs from k to k + 1.
    straight : (p, 4)
        Which edges stay straight.
    poissons_ratio : (p,)
    """
    told = np.concatenate([x.reshape(-1, 8), straight, poissons_ratio[:, None]], axis=1)
    _, first, same = np.unique(
        told.round(DIGITS) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    found = [np.zeros((0, 5, 5))]
    for start in range(0, len(first), CHUNK):
        part = first[start : start + CHUNK]
        found.append(_flexibilities(x[part], straight[part], poissons_ratio[part]))
    return np.concatenate(found)[same.ravel()]


def twists(x: NDArray) -> NDArray:
    """Heights (p, 4) of the corners x (p, 4, 2) in a twist, orthogonal to all planes."""
    planes = np.concatenate([np.ones((*x.shape[:2], 1)), x - x.mean(axis=1, keepdims=True)], axis=2)
    heights = np.stack([np.linalg.det(np.delete(planes, k, axis=1)) for k in range(4)], axis=1)
    heights *= np.array([1.0, -1.0, 1.0, -1.0])
    return heights / np.abs(heights).mean(axis=1, keepdims=True)


def _flexibilities(x: NDArray, straight: NDArray, poissons_ratio: NDArray) -> NDArray:
    nodes, weights = legendre.leggauss(POINTS)
    at = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=2).reshape(-1, 2)
    curvature, area = _curvatures(x, at)
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
        loads[:, :, 1 + k] = _mean_slope(x, k, nodes, 0.5 * weights)
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
    """Two linear functions (n, 2) of coordinates t, and those that vanish at both ends (n, d)."""
    linear, bows = (
        np.stack([legendre.legval(t, c) for c in group], axis=-1)
        for group in _polynomials(derivative)
    )
    return linear, bows


@cache
def _polynomials(derivative: int) -> tuple[list[NDArray], list[NDArray]]:
    """Legendre coefficients of these functions."""
    ends = [np.array([0.5, -0.5]), np.array([0.5, 0.5])]
    inner = [legendre.legint(np.eye(j + 1)[j], lbnd=-1.0) for j in range(1, DEGREES[1])]
    linear, bows = ([legendre.legder(c, derivative) for c in group] for group in (ends, inner))
    return linear, bows


def _shapes(heights: NDArray, at: NDArray, d: int, e: int) -> NDArray:
    """Derivatives (p, n, k), d times by xi and e by eta, of all shapes at points (n, 2)."""
    (ends, bows), (sides, lifts) = _line(at[:, 0], d), _line(at[:, 1], e)
    corners = np.stack([ends[:, i] * sides[:, j] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
    twist = (heights @ corners.T)[:, :, None]
    others = [
        (sides[:, :, None] * bows[:, None, :]).reshape(len(at), -1),  # of edges 0 and 2
        (ends[:, :, None] * lifts[:, None, :]).reshape(len(at), -1),  # of edges 3 and 1
        (bows[:, :, None] * lifts[:, None, :]).reshape(len(at), -1),
    ]
    rest = np.concatenate(others, axis=1)
    return np.concatenate([twist, np.broadcast_to(rest, (len(heights), *rest.shape))], axis=2)


def _jacobian(x: NDArray, at: NDArray) -> NDArray:
    """Derivatives (p, n, 2, 2) of x, y (rows) by xi, eta at points (n, 2)."""
    one = 1.0 + SIGNS[None] * at[:, None]
    by_xi = 0.25 * SIGNS[:, 0] * one[:, :, 1]
    by_eta = 0.25 * SIGNS[:, 1] * one[:, :, 0]
    return np.stack([np.swapaxes(by @ x, 1, 2) for by in (by_xi, by_eta)], axis=0).transpose(
        1, 3, 2, 0
    )


def _curvatures(x: NDArray, at: NDArray) -> tuple[NDArray, NDArray]:
    """Second derivatives (p, n, 3, k) by xx, yy and xy of all shapes, and areas (p, n)."""
    heights = twists(x)
    jacobian = _jacobian(x, at)
    inverse = np.linalg.inv(jacobian)  # rows xi, eta; columns x, y
    slopes = np.stack([_shapes(heights, at, 1, 0), _shapes(heights, at, 0, 1)], axis=2)
    by = np.swapaxes(inverse, 2, 3) @ slopes  # by x, y
    # d2 w/d xi2 etc., minus the effect of curved coordinates: x, y are bilinear
    mixed = 0.25 * np.einsum("v,pva->pa", SIGNS[:, 0] * SIGNS[:, 1], x)
    xi, eta = _shapes(heights, at, 2, 0), _shapes(heights, at, 0, 2)
    cross = _shapes(heights, at, 1, 1) - np.einsum("pa,pnak->pnk", mixed, by)
    a, b = inverse[:, :, 0, :, None], inverse[:, :, 1, :, None]

    def second(i: int, j: int) -> NDArray:
        both = a[:, :, i] * b[:, :, j] + a[:, :, j] * b[:, :, i]
        return a[:, :, i] * a[:, :, j] * xi + b[:, :, i] * b[:, :, j] * eta + both * cross

    curvature = np.stack([second(0, 0), second(1, 1), second(0, 1)], axis=2)
    return curvature, np.linalg.det(jacobian)


def _mean_slope(x: NDArray, k: int, nodes: NDArray, weights: NDArray) -> NDArray:
    """Mean outward slopes (p, k) of all shapes at edge k."""
    start, end = SIGNS[k], SIGNS[(k + 1) % 4]
    at = 0.5 * ((1.0 - nodes)[:, None] * start + (1.0 + nodes)[:, None] * end)
    heights = twists(x)
    slopes = np.stack([_shapes(heights, at, 1, 0), _shapes(heights, at, 0, 1)], axis=2)
    by = np.swapaxes(np.linalg.inv(_jacobian(x, at)), 2, 3) @ slopes
    along = x[:, (k + 1) % 4] - x[:, k]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outward /= np.linalg.norm(along, axis=1)[:, None]
    return np.einsum("pa,pnak,n->pk", outward, by, weights)
