"""Boards: contact surfaces, riding on the mesh, of panels hinged off their middle surfaces.

The contact surface of a board is its middle surface. Neighboring boards have separate corners.
Arrays hold the corners first and then the nodes of the mesh, for the guards of hinges.

When a crease is closed, the middle surfaces of its two boards are s = |h + h'| apart, where h and
h' are the heights of the hinge line above each of them. For thin panels s = 0 (`candidates`). For
boards of thickness t hinged in their faces s = t, and they touch everywhere at once. With d0' the
contact distance of thin panels and l the distance from the crease, the contact distance is

    d0 = min(s + (1 - s/t) d0', l),

where l keeps boards that lie flat from touching with their sides. Guards of hinges begin at
1 - s/t times the guard angle of thin panels: they tell on which side of each other two panels lie,
and the farther middle surfaces stay apart, the better their distance tells it already.

Corners of boards ride on the triangles of the mesh at an offset. A point that rides on a triangle
of nodes x_i, with N = (x_b - x_a) x (x_c - x_a), n = N / |N|, is

    y = sum w_i x_i + h n,    sum w_i = 1;

a corner that several triangles share is the mean of its points on these triangles. With the edge
e_i opposite to node i, dN/dx_i = [e_i x], so that

    dy/dx_i = w_i I + h P [e_i x] / |N|,    P = I - n n'.

Points follow rigid motions of the mesh, so forces f on points, mapped to the nodes by the
transpose, keep their resultant and their moment. The second derivative of f.y has terms with h,

    [e_i x]' H [e_j x] and, from N itself, -+[g x],    H = -(p n' + n p' + f.n P) h / |N|^2,

p = P f and g = h p / |N|.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.block_matrix import assembled, pairs_within, places_of
from foldyn.mechanics.contact.candidates import (
    ACROSS_CORNER,
    ACROSS_CREASE,
    Sheets,
    Tables,
    beside_nodes,
    distances,
    panel_nodes,
    shared_nodes,
    tables,
)
from foldyn.mechanics.contact.distances import cross, dot, minus, point
from foldyn.mechanics.triangle import normals_of

NOISE = 16.0 * float(np.finfo(float).eps)  # relative rounding error of a normal
LEVI_CIVITA = np.zeros((3, 3, 3))
LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


class Ride(NamedTuple):
    """m points on t triangles of n nodes; the last n points are the nodes."""

    x: NDArray  # (n, 3) nodes at rest, m
    rest: NDArray  # (m, 3) points at rest, m
    nodes: NDArray  # (t, 3)
    points: NDArray  # (t, 3) points at the corners
    weights: NDArray  # (t, 3, 3) w of the nodes for each corner, divided by its number of triangles
    heights: NDArray  # (t, 3) h, m, divided by the same number
    reach: NDArray  # (t, 3, 3) bounds of (motion of a corner / motion of a node)^2, to be added


def ride_on(
    x: NDArray, triangles: NDArray, panel: NDArray, middle: NDArray
) -> tuple[Ride, NDArray, NDArray]:
    """Points at positions `middle` (t, 3, 3) at rest, one for each node of a panel.

    Also returns the panel and node of each point; for mesh nodes, panel -1 and the node's own
    number.
    """
    n = len(x)
    key, points = np.unique(panel[:, None] * n + triangles, return_inverse=True)
    points = points.reshape(-1, 3)
    m = len(key)
    share = 1.0 / np.bincount(points.ravel(), minlength=m)[points]
    (normal, area), (a, b, c) = normals_of(x[triangles]), np.moveaxis(x[triangles], 1, 0)
    twice = 2.0 * area
    away = middle - a[:, None]
    heights = np.einsum("tci,ti->tc", away, normal)
    # weights from the areas spanned by a point and two nodes
    weights = np.empty((len(triangles), 3, 3))
    for i, (p, q) in enumerate(((b, c), (c, a), (a, b))):
        span = np.cross((q - p)[:, None], middle - p[:, None])
        weights[:, :, i] = np.einsum("tci,ti->tc", span, normal) / twice[:, None]
    edges = np.linalg.norm(np.stack([c - b, a - c, b - a], axis=1), axis=2)
    moved = np.abs(weights) + np.abs(heights)[:, :, None] * (edges / twice[:, None])[:, None]
    rest = np.zeros((m, 3))
    np.add.at(rest, points, share[:, :, None] * middle)
    ride = Ride(
        x=np.ascontiguousarray(x, float),
        rest=np.concatenate([rest, x]),
        nodes=np.ascontiguousarray(triangles, np.int64),
        points=np.ascontiguousarray(points, np.int64),
        weights=weights * share[:, :, None],
        heights=heights * share,
        reach=moved**2 * share[:, :, None],
    )
    panels = np.concatenate([key // n, np.full(n, -1)]).astype(np.int64)
    return ride, panels, np.concatenate([key % n, np.arange(n)]).astype(np.int64)


def carried(ride: Ride, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Points (m,) that depend on the chosen nodes (n,) only."""
    out = np.concatenate([np.ones(len(ride.rest) - len(ride.x), bool), chosen])
    np.logical_and.at(out, ride.points, chosen[ride.nodes].all(axis=1, keepdims=True))
    return out


@inner_scalar
def _moved(ride, u, i):
    """Position of node i at displacements u."""
    return ride.x[i, 0] + u[i, 0], ride.x[i, 1] + u[i, 1], ride.x[i, 2] + u[i, 2]


@inner_scalar
def _normal(ride, u, t):
    """Positions of a triangle's corners, its unit normal, and |N|."""
    a = _moved(ride, u, ride.nodes[t, 0])
    b = _moved(ride, u, ride.nodes[t, 1])
    c = _moved(ride, u, ride.nodes[t, 2])
    normal = cross(minus(b, a), minus(c, a))
    size = np.sqrt(dot(normal, normal))
    return a, b, c, (normal[0] / size, normal[1] / size, normal[2] / size), size


@kernel
def put_points(ride, u, out):
    """Write the points' displacements (m, 3) to `out`, given the nodes' (rows, 3), all in m."""
    first = len(out) - len(ride.x)
    for p in range(first):
        for axis in range(3):
            out[p, axis] = -ride.rest[p, axis]
    for i in range(len(ride.x)):
        for axis in range(3):
            out[first + i, axis] = u[i, axis]
    for t in range(len(ride.nodes)):
        a, b, c, n, _ = _normal(ride, u, t)
        for corner in range(3):
            w, h, p = ride.weights[t, corner], ride.heights[t, corner], ride.points[t, corner]
            for axis in range(3):
                out[p, axis] += w[0] * a[axis] + w[1] * b[axis] + w[2] * c[axis] + h * n[axis]


@kernel
def put_rates(ride, u, v, out):
    """Write the points' velocities (m, 3) to `out`, given the nodes' (rows, 3), all in m/s."""
    first = len(out) - len(ride.x)
    out[:first] = 0.0
    for i in range(len(ride.x)):
        for axis in range(3):
            out[first + i, axis] = v[i, axis]
    for t in range(len(ride.nodes)):
        a, b, c, n, size = _normal(ride, u, t)
        va, vb = point(v, ride.nodes[t, 0]), point(v, ride.nodes[t, 1])
        vc = point(v, ride.nodes[t, 2])
        one = cross(minus(vb, va), minus(c, a))
        other = cross(minus(b, a), minus(vc, va))
        turned = (one[0] + other[0], one[1] + other[1], one[2] + other[2])
        along = dot(turned, n)
        for corner in range(3):
            w, p = ride.weights[t, corner], ride.points[t, corner]
            h = ride.heights[t, corner] / size
            for axis in range(3):
                out[p, axis] += w[0] * va[axis] + w[1] * vb[axis] + w[2] * vc[axis]
                out[p, axis] += h * (turned[axis] - along * n[axis])


@kernel
def add_back(ride, u, push, force):
    """Add point forces push (m, 3) to nodal forces (rows, 3), N."""
    first = len(push) - len(ride.x)
    for i in range(len(ride.x)):
        for axis in range(3):
            force[i, axis] += push[first + i, axis]
    for t in range(len(ride.nodes)):
        one, two, three = ride.points[t, 0], ride.points[t, 1], ride.points[t, 2]
        p, q, r = point(push, one), point(push, two), point(push, three)
        if dot(p, p) + dot(q, q) + dot(r, r) == 0.0:
            continue
        a, b, c, n, size = _normal(ride, u, t)
        w, h = ride.weights[t], ride.heights[t]
        lever = (
            (h[0] * p[0] + h[1] * q[0] + h[2] * r[0]) / size,
            (h[0] * p[1] + h[1] * q[1] + h[2] * r[1]) / size,
            (h[0] * p[2] + h[1] * q[2] + h[2] * r[2]) / size,
        )
        along = dot(lever, n)
        g = (lever[0] - along * n[0], lever[1] - along * n[1], lever[2] - along * n[2])
        at_a, at_b, at_c = cross(minus(b, c), g), cross(minus(c, a), g), cross(minus(a, b), g)
        i, j, k = ride.nodes[t, 0], ride.nodes[t, 1], ride.nodes[t, 2]
        for axis in range(3):
            x, y, z = p[axis], q[axis], r[axis]
            force[i, axis] += at_a[axis] + w[0, 0] * x + w[1, 0] * y + w[2, 0] * z
            force[j, axis] += at_b[axis] + w[0, 1] * x + w[1, 1] * y + w[2, 1] * z
            force[k, axis] += at_c[axis] + w[0, 2] * x + w[1, 2] * y + w[2, 2] * z


@inner
def put_lightness(ride, lightness, out):
    """Write upper bounds (m,) of the points' 1 / mass to `out`, given the nodes' (n,), 1/kg."""
    first = len(out) - len(ride.x)
    out[:first] = 0.0
    for i in range(len(ride.x)):
        out[first + i] = lightness[i]
    for t in range(len(ride.nodes)):
        for corner in range(3):
            for i in range(3):
                own = ride.reach[t, corner, i] * lightness[ride.nodes[t, i]]
                out[ride.points[t, corner]] += own


def _frames(ride: Ride, u: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """[e_i x] (t, 3, 3, 3), unit normals (t, 3), |N| (t,) and P (t, 3, 3) of all triangles."""
    corners = (ride.x + u[: len(ride.x)])[ride.nodes]
    (a, b, c), (normal, area) = np.moveaxis(corners, 1, 0), normals_of(corners)
    across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    return _crossing(np.stack([c - b, a - c, b - a], axis=1)), normal, 2.0 * area, across


def _crossing(e: NDArray) -> NDArray:
    """[e x] (..., 3, 3) of vectors (..., 3)."""
    return -np.einsum("abc,...c->...ab", LEVI_CIVITA, e)


def jacobian(ride: Ride, u: NDArray, size: int) -> sparse.csr_array:
    """Matrix dy/dx (3 m, size) at displacements u (rows, 3)."""
    turn, _, area, across = _frames(ride, u)
    return _motion(ride, across[:, None] @ turn / area[:, None, None, None], size)


def _motion(ride: Ride, turned: NDArray, size: int) -> sparse.csr_array:
    """Matrix dy/dx (3 m, size), given the derivatives dn/dx `turned` (t, 3, 3, 3) of normals."""
    blocks = ride.heights[:, :, None, None, None] * turned[:, None]
    blocks += ride.weights[:, :, :, None, None] * np.eye(3)
    n, first = ride.x.size, ride.rest.size - ride.x.size
    pairs = np.broadcast_arrays(ride.points[:, :, None], ride.nodes[:, None, :])
    places = places_of(np.stack(pairs, axis=-1).reshape(-1, 2))
    entries = np.concatenate([blocks.ravel(), np.ones(n)])
    places = np.hstack([places, [first + np.arange(n), np.arange(n)]])
    return sparse.csr_array((entries, tuple(places)), (first + n, size))


def step_jacobian(ride: Ride, u0: NDArray, u1: NDArray, size: int) -> sparse.csr_array:
    """Matrix G (3 m, size) with y1 - y0 = G (u1 - u0) that moves points rigidly with the mesh.

    Rigidity refers to mid-step: for a rotation w, G gives w x (y0 + y1) / 2. Let m be the normal at
    mid-step and A its derivative, `mean` the mean of the normals at both ends, and W z the rotation
    closest to nodal motions z. Then A + [(m - mean) x] W moves points rigidly; the remaining
    difference is corrected along the deforming part of u1 - u0 (Gonzalez, J. Nonlinear Sci. 6,
    1996).
    """
    n = len(ride.x)
    turn, normal, area, across = _frames(ride, 0.5 * (u0 + u1))
    before, after = _frames(ride, u0)[1], _frames(ride, u1)[1]
    arm, step = ((x - x.mean(axis=1, keepdims=True)) for x in (
        (ride.x + 0.5 * (u0 + u1)[:n])[ride.nodes], (u1 - u0)[ride.nodes]
    ))  # fmt: skip
    moment = _crossing(arm)
    inertia = moment.swapaxes(2, 3) @ moment
    nearest = np.linalg.solve(inertia.sum(axis=1)[:, None], moment)
    turned = across[:, None] @ turn / area[:, None, None, None]
    turned = turned + _crossing(normal - 0.5 * (before + after))[:, None] @ nearest
    spin = np.einsum("tiab,tib->ta", nearest, step)
    deform = step - np.cross(spin[:, None], arm)
    missed = after - before - np.einsum("tiab,tib->ta", turned, step)
    square = (deform**2).sum(axis=(1, 2))
    acts = (np.abs(missed).max(axis=1, initial=0.0) > NOISE) & (square > 0.0)
    missed[acts] /= square[acts, None]
    missed[~acts] = 0.0
    return _motion(ride, turned + missed[:, None, :, None] * deform[:, :, None, :], size)


def curvature(ride: Ride, u: NDArray, push: NDArray, size: int) -> sparse.csr_array:
    """Second derivative (size, size) of the sum of f.y for point forces f (m, 3)."""
    lever = np.einsum("tc,tca->ta", ride.heights, push[ride.points])
    acts = lever.any(axis=1)
    ride, lever = ride._replace(nodes=ride.nodes[acts]), lever[acts]
    turn, normal, area, across = _frames(ride, u)
    inside = np.einsum("tab,tb->ta", across, lever)
    along = np.einsum("ta,ta->t", lever, normal)
    mixed = inside[:, :, None] * normal[:, None, :]
    bend = -(mixed + mixed.swapaxes(1, 2) + along[:, None, None] * across)
    bend /= area[:, None, None] ** 2
    blocks = np.einsum("tiba,tbc,tjcd->tijad", turn, bend, turn)
    spin = _crossing(inside / area[:, None])
    for i, j in ((0, 1), (1, 2), (2, 0)):
        blocks[:, i, j] -= spin
        blocks[:, j, i] += spin
    return assembled(pairs_within(ride.nodes), blocks, size)


def largest_turn(ride: Ride, u: NDArray, step: NDArray) -> float:
    """Largest turn (rad) of a triangle's normal in a step (rows, 3) from u, linearized."""
    turn, _, area, across = _frames(ride, u)
    moved = np.einsum("tab,tibc,tic->ta", across, turn, step[ride.nodes]) / area[:, None]
    return float(np.linalg.norm(moved, axis=1).max(initial=0.0))


JUST = 1.0 - 1e-9  # factor on d0, so that parts that just touch at rest exert no force
LEAST = 0.02  # least angle of a guard, relative to the guard angle for sheets


@dataclass(frozen=True, eq=False)
class BoardSheets(Sheets):
    """Contact surfaces of a mesh whose panels are boards; see `Sheets`.

    Parameters
    ----------
    middle : (t, 3, 3)
        Positions (m) of each triangle's corners on the boards' middle surfaces, at rest.
    """

    middle: NDArray


def board_tables(
    sheets: BoardSheets, ride: Ride, panel: NDArray, node: NDArray, hinges: NDArray
) -> Tables:
    """Contact arrays, given the panel (m,) and node (m,) of each point and the mesh's hinges."""
    mesh = Sheets(*(getattr(sheets, field.name) for field in fields(Sheets)))
    held = carried(ride, sheets.held)
    points = replace(mesh, nodes=ride.rest, triangles=ride.points, held=held)
    own, base = tables(points, np.zeros((0, 4), np.int64)), tables(mesh, hinges)
    first = len(ride.rest) - len(ride.x)
    panels, near, closed = _neighbors(sheets, ride, panel[:first], node[:first])
    beside = beside_nodes(panels + [[] for _ in ride.x], near + [{} for _ in ride.x])
    return own._replace(
        edge_nodes=node[own.edges],
        ranges=own.ranges._replace(**beside),
        hinges=base.hinges + first,
        hinge_row=base.hinge_row,
        hinge_limit=base.hinge_limit * _guarded(base, closed),
        hinge_reach=base.hinge_reach,
        hinge_stiffness=base.hinge_stiffness,
        farthest=float(beside["near_d0"].max(initial=own.farthest)) if sheets.panels else 0.0,
    )


def _neighbors(
    sheets: BoardSheets, ride: Ride, panel: NDArray, node: NDArray
) -> tuple[list[list[int]], list[dict[int, float]], dict[tuple[int, int], float]]:
    """Panels at each point's node, the point's own first, and d0 (m) against nearby panels.

    Also returns s/t of panels that share a crease. panel, node : (m,) that each point belongs to.
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
    normal, _ = normals_of(ride.rest[ride.points])
    away = ride.x[ride.nodes] - ride.rest[ride.points]
    out = np.zeros(len(ride.rest))
    out[ride.points] = np.einsum("tci,ti->tc", away, normal)
    return out
