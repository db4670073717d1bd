"""Air drag of panels: a normal pressure, quadratic in the velocity relative to the air.

On each triangle, with v_n the velocity along its normal n relative to the air, the pressure is -1/2
rho Cd |v_n| v_n n. It is integrated at the side midpoints (a rule of degree 2): if v_n has the same
sign everywhere, the resultant is exact for any motion that keeps the triangle flat.

The air takes the power -F . v, with v the velocity of the sheet; a wind that drives the sheet
supplies power.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.model import ranks
from foldyn.mechanics.term import (
    FORCES,
    PLACE_OBSTACLES,
    CompiledTerm,
    Term,
    forces,
    place_obstacles,
)


class AirDrag(NamedTuple):
    """Arrays of t triangles in air, and results of the last evaluation."""

    triangles: NDArray  # (t, 3) nodes
    sides: NDArray  # (t, 2, 3) rest vectors from the first corner to the others, m
    wind: NDArray  # (3,) velocity of the air at factor 1, m/s
    factor: NDArray  # (1,) current factor of the wind
    normal: NDArray  # (t, 3) memory: unit normals
    slope: NDArray  # (t, 3) current d(force) / d(v_n) at each side midpoint, N s/m


def air_drag(x: NDArray, triangles: NDArray, wind: NDArray) -> AirDrag:
    """Arrays of triangles (t, 3), nodes x (n, 3) at rest, in air with velocity wind (3,), m/s."""
    corners = np.asarray(x, float)[triangles]
    return AirDrag(
        triangles=np.ascontiguousarray(triangles, np.int64),
        sides=np.ascontiguousarray(corners[:, 1:] - corners[:, :1]),
        wind=wind,
        factor=np.ones(1),
        normal=np.zeros((len(triangles), 3)),
        slope=np.zeros((len(triangles), 3)),
    )


class _Context(NamedTuple):
    air: AirDrag
    half: float  # 1/2 rho Cd, kg/m3
    row: int  # row of the wind's history
    histories: int
    rows: int


@inner_scalar
def put_normal(sides, corners, u, out):
    """Put a triangle's unit normal (3,) at u (n, 3) into `out`; return the triangle's area, m2."""
    first, second, third = corners[0], corners[1], corners[2]
    ax = sides[0, 0] + u[second, 0] - u[first, 0]
    ay = sides[0, 1] + u[second, 1] - u[first, 1]
    az = sides[0, 2] + u[second, 2] - u[first, 2]
    bx = sides[1, 0] + u[third, 0] - u[first, 0]
    by = sides[1, 1] + u[third, 1] - u[first, 1]
    bz = sides[1, 2] + u[third, 2] - u[first, 2]
    out[0], out[1], out[2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    if twice > 0.0:
        for c in range(3):
            out[c] /= twice
    return 0.5 * twice


@forces
def _forces(own, u, v, t, force, powers):
    air, taken = own.air, 0.0
    moved, speed, out = rows_at(u, own.rows), rows_at(v, own.rows), rows_at(force, own.rows)
    for e in range(air.triangles.shape[0]):
        corners, n = air.triangles[e], air.normal[e]
        area = put_normal(air.sides[e], corners, moved, n)
        blown = air.factor[0] * (n[0] * air.wind[0] + n[1] * air.wind[1] + n[2] * air.wind[2])
        for k in range(3):
            a, b, own_speed = corners[k], corners[(k + 1) % 3], 0.0
            for c in range(3):
                own_speed += 0.5 * n[c] * (speed[a, c] + speed[b, c])
            past = own_speed - blown
            half = own.half * abs(past) * area / 3.0
            resisted = half * past
            for c in range(3):
                out[a, c] += 0.5 * resisted * n[c]
                out[b, c] += 0.5 * resisted * n[c]
            taken += resisted * own_speed
            air.slope[e, k] = 2.0 * half
    numbers_at(powers, 3)[2] += taken


@place_obstacles
def _place(own, factors):
    own.air.factor[0] = rows_at(factors, own.histories)[own.row, 0]


class AirDragTerm(Term):
    """Air drag of panels as a term; see `Term`. The term's memory is in `AirDrag`.

    Parameters
    ----------
    air : AirDrag
    half : float
        1/2 rho Cd, kg/m3.
    row, histories : int
        Row of the wind's history, and number of histories; none if the wind is steady.
    """

    damps = True
    undifferentiated = "drag of the air"

    def __init__(self, air: AirDrag, half: float, row: int = 0, histories: int = 0) -> None:
        self.air, self.half, self.row, self._count = air, half, row, histories

    def driven(self, row: int, histories: int) -> AirDragTerm:
        """Copy with a wind that follows history number `row` of `histories`."""
        return AirDragTerm(self.air, self.half, row, histories)

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        rows = int(part.own[1])
        own = Context(_Context(self.air, self.half, self.row, self._count, rows))
        kernels = {FORCES: _forces} | ({PLACE_OBSTACLES: _place} if self._count else {})
        return CompiledTerm(own, kernels)

    @cached_property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's damping entries; see `Term`."""
        return places_of(pairs_within(self.air.triangles))

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Derivative of the forces with respect to the velocities of the last evaluation."""
        slope, n = 0.25 * self.air.slope, self.air.normal
        at_ends = np.eye(3) + np.roll(np.eye(3), 1, axis=1)  # side k has the corners k and k + 1
        ends = np.einsum("tk,ka,kb->tab", slope, at_ends, at_ends)
        return np.einsum("tab,ti,tj->tabij", ends, n, n).ravel()

    def placed(self, order: NDArray, before: Any) -> AirDragTerm:
        """The term with nodes in memory order; see `Term`."""
        here = self.air._replace(triangles=ranks(order)[self.air.triangles])
        return AirDragTerm(here, self.half, self.row, self._count)
