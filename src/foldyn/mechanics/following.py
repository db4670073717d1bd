"""Loads that depend on the displacement: pressure, moments of creases, tension of bars.

Each entry stores its rest geometry, its value at factor 1 and the row of its history. With x the
positions of its nodes and p, M, N its value times the factor:

- a triangle with corners x1, x2, x3 under pressure p: p/6 (x2 - x1) x (x3 - x1) on each corner.
  On a closed surface this is p times the gradient of the volume inside;
- a hinge with moment M: M times the gradient of its dihedral, potential -M angle. A virtual wing
  follows the mean displacement of the axis ends;
- a bar from a to b with tension N (N/m, the second Piola-Kirchhoff force per rest length):
  -N d on b and N d on a, d = x_b - x_a. Potential N (|d|^2 - |d at rest|^2) / 2;
- a hidden dof with a constant force (on a side rotation of a shell, it is a moment).

The derivative of the pressure forces on one triangle is not symmetric. Summed over a closed
surface, or over an open surface whose rim is held, it is symmetric (Hibbitt, Int. J. Solids Struct.
15, 1979).

Vectors of dofs are flat (3 node + axis, then the hidden dofs), or arrays with rows of three.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.mechanics.dihedral import add_hessian, carry_wing, gradient_at

ASYMMETRIC = 1e-3  # asymmetric share of the load stiffness that must not be neglected
NO_POTENTIAL = (
    "the pressure acts on panels with free edges and has no potential: {:.0%} of its stiffness is "
    "not symmetric;"
)


def _none(*shape: int, kind: type = float) -> NDArray:
    return np.zeros((0, *shape), kind)


class Following(NamedTuple):
    """Entries of t triangles, h hinges, b bars, d hidden dofs; `row` numbers histories."""

    triangles: NDArray = _none(3, kind=int)  # (t, 3) nodes, counter-clockwise from the front
    sides: NDArray = _none(2, 3)  # (t, 2, 3) rest vectors from the first corner to the others, m
    pressure: NDArray = _none()  # (t,) Pa, positive along the front's normal
    pressure_row: NDArray = _none(kind=int)  # (t,)
    hinges: NDArray = _none(4, kind=int)  # (h, 4) axis j, k, wings i, l; -1 for a virtual l
    corners: NDArray = _none(4, 3)  # (h, 4, 3) rest positions from any origin nearby, m
    moment: NDArray = _none()  # (h,) N m, positive if it opens the dihedral
    moment_row: NDArray = _none(kind=int)  # (h,)
    bars: NDArray = _none(2, kind=int)  # (b, 2) nodes
    vectors: NDArray = _none(3)  # (b, 3) rest vectors from the first to the second, m
    tension: NDArray = _none()  # (b,) N/m
    tension_row: NDArray = _none(kind=int)  # (b,)
    hidden: NDArray = _none(kind=int)  # (d,) dofs
    push: NDArray = _none()  # (d,) N
    push_row: NDArray = _none(kind=int)  # (d,)

    @property
    def acts(self) -> bool:
        """Whether there are entries."""
        return any(map(len, (self.pressure, self.moment, self.tension, self.push)))

    def placed(self, rank: NDArray) -> Following:
        """Copy for nodes that are stored at the places rank (n,)."""
        triangles, bars = _whole(rank[self.triangles]), _whole(rank[self.bars])
        hinges = _whole(np.append(rank, -1)[self.hinges])
        return self._replace(triangles=triangles, hinges=hinges, bars=bars)


def pressures(x: NDArray, triangles: NDArray, pressure: NDArray) -> Following:
    """Pressure (t,), Pa, on triangles (t, 3) of nodes at x (n, 3)."""
    corners = x[triangles]
    return Following(
        triangles=_whole(triangles),
        sides=_real(corners[:, 1:] - corners[:, :1]),
        pressure=_real(pressure),
        pressure_row=np.zeros(len(triangles), np.int64),
    )


def moments(corners: NDArray, hinges: NDArray, moment: NDArray) -> Following:
    """Moments (h,), N m, on hinges (h, 4) with rest positions corners (h, 4, 3)."""
    return Following(
        hinges=_whole(hinges),
        corners=_real(corners - corners.mean(axis=1, keepdims=True)),
        moment=_real(moment),
        moment_row=np.zeros(len(hinges), np.int64),
    )


def tensions(x: NDArray, bars: NDArray, tension: NDArray) -> Following:
    """Tension (b,), N/m, of bars (b, 2) between nodes at x (n, 3)."""
    return Following(
        bars=_whole(bars),
        vectors=_real(x[bars[:, 1]] - x[bars[:, 0]]),
        tension=_real(tension),
        tension_row=np.zeros(len(bars), np.int64),
    )


def pushes(dofs: NDArray, push: NDArray) -> Following:
    """Constant forces (d,), N, on hidden dofs (d,)."""
    row = np.zeros(len(dofs), np.int64)
    return Following(hidden=_whole(dofs), push=_real(push), push_row=row)


def joined(parts: Iterable[tuple[Following, int]]) -> Following:
    """All entries of several parts, each given with the row of its history."""
    numbered = [Following()]
    for part, row in parts:
        names = "pressure_row", "moment_row", "tension_row", "push_row"
        rows = {name: np.full_like(getattr(part, name), row) for name in names}
        numbered.append(part._replace(**rows))
    return Following(*map(np.concatenate, zip(*numbered, strict=True)))


def _whole(values: NDArray) -> NDArray:
    return np.ascontiguousarray(values, np.int64)


def _real(values: NDArray) -> NDArray:
    return np.ascontiguousarray(values, float)


def following_force(loads: Following, u: NDArray, factor: NDArray) -> NDArray:
    """Forces (m,), N, on all dofs at u (m,); column 0 of `factor` (h, k) has the factors."""
    out = np.zeros(u.size)
    if loads.acts:
        add_following(loads, np.ascontiguousarray(u, float).reshape(-1), factor, out)
    return out


def following_tangent(loads: Following, u: NDArray, factor: NDArray) -> sparse.csr_array:
    """Minus the derivative (m, m) of `following_force`, N/m: the loads' share of the stiffness."""
    row, column = following_places(loads)
    values = np.empty(len(row))
    put_following(loads, np.ascontiguousarray(u, float).reshape(-1), factor, False, values)
    return sparse.csr_array((values, (row, column)), (u.size, u.size))


def asymmetry(matrix: sparse.csr_array) -> float:
    """Ratio of the norm of a matrix's antisymmetric part to the matrix's norm; 0 for zeros."""
    whole = float(np.linalg.norm(matrix.data))
    apart = sparse.csr_array(matrix - matrix.T)
    return 0.5 * float(np.linalg.norm(apart.data)) / whole if whole else 0.0


def following_places(loads: Following) -> tuple[NDArray, NDArray]:
    """Row and column (e,) of each entry of `put_following`."""
    # entries of a virtual wing are zeros, placed at the first node
    hinges = np.where(loads.hinges < 0, loads.hinges[:, :1], loads.hinges)
    pairs = []
    for nodes in (loads.triangles, hinges, loads.bars):
        dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 3 * nodes.shape[1])
        pairs.append(pairs_within(dofs))
    row, column = np.concatenate(pairs).T
    return row, column


@inner
def _edges(loads, u, t, a, b):
    """Write the vectors from a triangle's first corner to the other two into a and b (3,)."""
    first, second, third = loads.triangles[t, 0], loads.triangles[t, 1], loads.triangles[t, 2]
    for c in range(3):
        a[c] = loads.sides[t, 0, c] + u[3 * second + c] - u[3 * first + c]
        b[c] = loads.sides[t, 1, c] + u[3 * third + c] - u[3 * first + c]


@inner
def hinge_of(loads, u, h, points, gradient):
    """Put the corners of a hinge and the gradient of its dihedral, (4, 3); return the dihedral."""
    j, k = loads.hinges[h, 0], loads.hinges[h, 1]
    for v in range(4):
        for c in range(3):
            node = loads.hinges[h, v]
            moved = 0.5 * (u[3 * j + c] + u[3 * k + c]) if node < 0 else u[3 * node + c]
            points[v, c] = loads.corners[h, v, c] + moved
    found, g = gradient_at(points), flat(gradient)
    for i in range(12):
        g[i] = found[1 + i]
    return found[0]


@kernel
def add_following(loads, u, factor, out):
    """Add the forces (N) at u for the factors (h, k), in column 0, to `out`; all flat."""
    a, b = np.empty(3), np.empty(3)
    points, gradient = np.empty((4, 3)), np.empty((4, 3))
    for t in range(loads.pressure.size):
        p = loads.pressure[t] * factor[loads.pressure_row[t], 0] / 6.0
        _edges(loads, u, t, a, b)
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            push = p * (a[d] * b[e] - a[e] * b[d])
            for v in range(3):
                out[3 * loads.triangles[t, v] + c] += push
    for h in range(loads.moment.size):
        moment = loads.moment[h] * factor[loads.moment_row[h], 0]
        hinge_of(loads, u, h, points, gradient)
        rides = loads.hinges[h, 3] < 0
        for c in range(3):
            if rides:
                gradient[0, c] += 0.5 * gradient[3, c]
                gradient[1, c] += 0.5 * gradient[3, c]
            for v in range(3 if rides else 4):
                out[3 * loads.hinges[h, v] + c] += moment * gradient[v, c]
    for e in range(loads.tension.size):
        pull = loads.tension[e] * factor[loads.tension_row[e], 0]
        first, second = loads.bars[e, 0], loads.bars[e, 1]
        for c in range(3):
            along = pull * (loads.vectors[e, c] + u[3 * second + c] - u[3 * first + c])
            out[3 * first + c] += along
            out[3 * second + c] -= along
    for e in range(loads.push.size):
        out[loads.hidden[e]] += loads.push[e] * factor[loads.push_row[e], 0]


@inner
def push_following(loads, u, v, factor, pushed, bracket):
    """Move the forces at u from `bracket` to `pushed`; returns the forces' power at v, W.

    All arrays are (rows, 3).
    """
    force, left, speed = flat(pushed), flat(bracket), flat(v)
    for i in range(force.size):
        force[i] = 0.0
    add_following(loads, flat(u), factor, force)
    power = 0.0
    for i in range(force.size):
        left[i] -= force[i]
        power += force[i] * speed[i]
    return power


@kernel
def put_following(loads, u, factor, symmetric, out):
    """Write minus the derivative of the forces to out (e,), in the order of `following_places`.

    symmetric : whether to write only the symmetric part of the derivative.
    """
    a, b, side = np.empty(3), np.empty(3), np.empty((3, 3))
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    at = 0
    for t in range(loads.pressure.size):
        p = loads.pressure[t] * factor[loads.pressure_row[t], 0] / 6.0
        _edges(loads, u, t, a, b)
        for c in range(3):  # the side opposite to each corner: d(a x b) = sum of s x dx
            side[0, c], side[1, c], side[2, c] = b[c] - a[c], -b[c], a[c]
        for v in range(3):
            for c in range(3):
                for w in range(3):
                    for d in range(3):
                        value = _cross(side, w, c, d)
                        if symmetric:
                            value = 0.5 * (value + _cross(side, v, d, c))
                        out[at] = -p * value
                        at += 1
    for h in range(loads.moment.size):
        hinge_of(loads, u, h, points, gradient)
        rides = loads.hinges[h, 3] < 0
        block[:] = 0.0
        add_hessian(points, gradient, -loads.moment[h] * factor[loads.moment_row[h], 0], block)
        if rides:
            carry_wing(block)
            block[3] = 0.0
            block[:, :, 3] = 0.0
        values = flat(block)
        for k in range(values.size):
            out[at + k] = values[k]
        at += values.size
    for e in range(loads.tension.size):
        pull = loads.tension[e] * factor[loads.tension_row[e], 0]
        for p in range(6):
            for q in range(6):
                out[at] = 0.0 if p % 3 != q % 3 else pull if p == q else -pull
                at += 1


@inner
def _cross(side, w, c, d):
    """Entry (c, d) of the matrix of the cross product with row w of `side`."""
    if c == d:
        return 0.0
    other = 3 - c - d
    return -side[w, other] if (c + 1) % 3 == d else side[w, other]
