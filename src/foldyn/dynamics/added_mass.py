"""Mass of the fluid that moves with a sheet, in motions: T = w'F w / 2, w = B v.

B(u) takes the velocities of the nodes to the flux of the boundary elements, by their area vectors,
which follow the motion; F is the flow of `mechanics.air` at one state of folding. A sheet that
turns as a whole keeps its F, so that nothing of its motion is lost; one that folds gets a new F
when a hinge has turned by `TURN`. With F constant Lagrange's equations are

    (M + B'F B) a + B'F B. v + B.'F w - d(w.F B v)/du = p - F_int,

B. the change of B and w not varied in the last term. The accelerations follow from
(F^-1 + B M^-1 B') z = B M^-1 r, a = M^-1 (r - B'z), by conjugate gradients; what they start from
is the inverse of that matrix where F was made.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from foldyn.cases import Case, State
from foldyn.dynamics.inertia import Inertia, kinetic_energy, solve_mass, solve_tied, substitute
from foldyn.errors import InputError
from foldyn.jit.compiled import addressed, inner, kernel
from foldyn.jit.context import rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.term import ADDRESS
from foldyn.structures.boundary_elements import boundary_elements

TURN = math.radians(2.0)  # of a hinge, after which the flow is found anew
LOOK_EVERY = 16  # steps between two looks at that
MOST = 1500  # unknowns of the flow
TOLERANCE = 1e-13  # of the accelerations' residual
ITERATIONS = 200


class AddedMass(NamedTuple):
    """Boundary elements, p corners in t triangles with u unknowns, the flow, and memory."""

    start: NDArray  # (p + 1,) first of the weights of each corner, of k
    node: NDArray  # (k,)
    weight: NDArray  # (k,)
    triangles: NDArray  # (t, 3)
    unknown: NDArray  # (p,) -1 on open edges
    rest: NDArray  # (p, 3) m
    flow: NDArray  # (u, u) F, kg/m4
    resistance: NDArray  # (u, u) its inverse
    guess: NDArray  # (u, u) inverse of the matrix of the accelerations where F was made
    place: NDArray  # (p, 3) memory: corners, m,
    speed: NDArray  # (p, 3) their velocities,
    push: NDArray  # (p, 3) and forces, N
    area: NDArray  # (t, 3) memory: area vectors, m2,
    rate: NDArray  # (t, 3) and their changes, m2/s
    lines: NDArray  # (6, u) memory
    nodal: NDArray  # (2, rows, 3) memory
    sides: NDArray  # (4, 3) memory of one triangle
    angle: NDArray  # (nh,) dihedrals where F was made, rad
    made: NDArray  # (2,) how often it was since the start, and the energies (J) that it changed by

    @property
    def acts(self) -> bool:
        """Whether there is any."""
        return len(self.flow) > 0


def no_added_mass() -> AddedMass:
    """Of a sheet in vacuum."""
    rows, whole, square = np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 0))
    return AddedMass(
        np.zeros(1, np.int64), whole, np.zeros(0), np.zeros((0, 3), np.int64), whole, rows,
        square, square, square, rows, rows, rows, rows, rows, np.zeros((6, 0)),
        np.zeros((2, 0, 3)), rows, np.zeros(0), np.zeros(2),
    )  # fmt: skip


def added_mass(case: Case, rank: NDArray, rows: int, hinges: int) -> AddedMass:
    """Added mass of a case whose nodes stand at the places rank (n,) of `rows`, without a flow yet.

    Raises
    ------
    InputError
        Too many unknowns; supports that move.
    """
    air = case.air
    if air is None or not air.added_mass:
        return no_added_mass()
    if case.imposed_terms or case.base_terms:
        raise InputError(
            ": motions with supports that move do not take added mass; give added_mass = false",
            "air",
        )
    elements = boundary_elements(case.structure, air.resolution, air.added_mass == "local")
    size, triangles = int(elements.unknown.max(initial=-1)) + 1, len(elements.triangles)
    if size > MOST:
        raise InputError(
            f".resolution = {air.resolution}: the flow has {size} unknowns, and motions take at "
            f"most {MOST}; lower it, or give added_mass = false",
            "air",
        )
    weights = elements.weights
    corners = len(elements.unknown)
    square, lines = np.zeros((3, size, size)), np.zeros((6, size))
    place, speed, push = np.zeros((3, corners, 3))
    area, rate = np.zeros((2, triangles, 3))
    return AddedMass(
        weights.indptr.astype(np.int64), rank[weights.indices], weights.data.astype(float),
        elements.triangles.astype(np.int64), elements.unknown.astype(np.int64),
        np.ascontiguousarray(weights @ case.structure.nodes), *square, place, speed, push,
        area, rate, lines, np.zeros((2, rows, 3)), np.zeros((4, 3)), np.zeros(hinges), np.zeros(2),
    )  # fmt: skip


def begin_flow(case: Case, packed: Any, course: Any, outward: NDArray) -> None:
    """Find the flow where a motion starts, at `outward` (n, 3) in the order of the case."""
    own = packed.added
    if own.acts:
        find_flow(case, own, packed.mass, outward, course.u)
        own.angle[:], own.made[:] = course.angle, 0.0


def renewed_flow(case: Case, packed: Any, course: Any) -> bool:
    """Find the flow anew, and tell so, where hinges have turned by `TURN` since it was found.

    What the energy of the fluid changes by, at the same velocity, the air has given or taken.
    """
    own = packed.added
    if np.abs(course.angle - own.angle).max(initial=0.0) <= TURN:
        return False
    put_areas(own, course.u)
    before = energy_of_fluid(own, course.v)
    find_flow(case, own, packed.mass, packed.numbering.outward(course.u), course.u)
    change = energy_of_fluid(own, course.v) - before
    course.tally.air -= change
    own.angle[:] = course.angle
    own.made += 1.0, abs(change)
    return True


def find_flow(case: Case, own: AddedMass, mass: Inertia, outward: NDArray, u: NDArray) -> None:
    """Find the flow where the sheet stands.

    outward : displacement (n, 3) in the order of the case; u : (rows, 3) as it stands in memory.
    """
    flow = case.added_mass(State(displacement=outward)).flow
    own.flow[:] = flow if isinstance(flow, np.ndarray) else flow.toarray()
    own.resistance[:] = _inverse(own.flow)
    matrix, column = own.resistance.copy(), np.zeros(len(own.flow))
    put_areas(own, u)
    line = np.zeros(u.size)
    for k in range(len(column)):
        column[:] = 0.0
        column[k] = 1.0
        own.nodal[0] = 0.0
        push_back(own, own.area, column, own.nodal[0])
        lighten(mass, own.nodal[0], own.nodal[1], line)
        flux(own, own.area, own.nodal[1], column)
        matrix[k] += column
    own.guess[:] = _inverse(0.5 * (matrix + matrix.T))


def _inverse(matrix: NDArray) -> NDArray:
    """Inverse of a symmetric positive definite matrix."""
    factor, wrong = lapack.dpotrf(matrix, lower=1)
    out, _ = lapack.dpotri(factor, lower=1)
    assert not wrong  # the flow's matrix is definite, or it would have been refused
    return np.tril(out) + np.tril(out, -1).T


# ------------------------------------------------------------------ fluxes
@inner
def gather(own, values, out):
    """Values (rows, 3) of the nodes at the corners, to `out` (p, 3)."""
    for p in range(out.shape[0]):
        for c in range(3):
            out[p, c] = 0.0
        for k in range(own.start[p], own.start[p + 1]):
            for c in range(3):
                out[p, c] += own.weight[k] * values[own.node[k], c]


@inner
def spread(own, values, out):
    """Add forces (p, 3) on the corners to those (rows, 3) on the nodes."""
    for p in range(values.shape[0]):
        for k in range(own.start[p], own.start[p + 1]):
            for c in range(3):
                out[own.node[k], c] += own.weight[k] * values[p, c]


@inner
def add_cross(factor, a, b, out):
    """Add factor a x b to `out` (3,)."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])


@kernel
def put_areas(own, u):
    """Put the area vectors where the nodes are displaced by u (rows, 3)."""
    gather(own, u, own.place)
    one, other = own.sides[0], own.sides[1]
    for i in range(own.place.shape[0]):
        for c in range(3):
            own.place[i, c] += own.rest[i, c]
    for t in range(own.triangles.shape[0]):
        a, b, d = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
        for c in range(3):
            one[c], other[c] = own.place[b, c] - own.place[a, c], own.place[d, c] - own.place[a, c]
            own.area[t, c] = 0.0
        add_cross(0.5, one, other, own.area[t])


@inner
def put_rates(own):
    """Put the changes of the area vectors with the velocities of the corners."""
    one, other, turn, lean = own.sides[0], own.sides[1], own.sides[2], own.sides[3]
    for t in range(own.triangles.shape[0]):
        a, b, d = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
        for c in range(3):
            one[c], other[c] = own.place[b, c] - own.place[a, c], own.place[d, c] - own.place[a, c]
            turn[c], lean[c] = own.speed[b, c] - own.speed[a, c], own.speed[d, c] - own.speed[a, c]
            own.rate[t, c] = 0.0
        add_cross(0.5, turn, other, own.rate[t])
        add_cross(0.5, one, lean, own.rate[t])


@inner
def flux_of_corners(own, area, speed, out):
    """Flux (u,) of velocities (p, 3) of the corners through area vectors (t, 3)."""
    for i in range(out.size):
        out[i] = 0.0
    for t in range(area.shape[0]):
        total = 0.0
        for j in range(3):
            for c in range(3):
                total += area[t, c] * speed[own.triangles[t, j], c]
        for j in range(3):
            at = own.unknown[own.triangles[t, j]]
            if at >= 0:
                alone = 0.0
                for c in range(3):
                    alone += area[t, c] * speed[own.triangles[t, j], c]
                out[at] += (total + alone) / 12.0


@inner
def add_push(own, area, jump, out):
    """Add the forces (p, 3) on the corners of jumps (u,) through area vectors (t, 3)."""
    share = own.sides[3]
    for t in range(area.shape[0]):
        total = 0.0
        for j in range(3):
            at = own.unknown[own.triangles[t, j]]
            share[j] = jump[at] if at >= 0 else 0.0
            total += share[j]
        for j in range(3):
            for c in range(3):
                out[own.triangles[t, j], c] += (total + share[j]) / 12.0 * area[t, c]


@kernel
def flux(own, area, v, out):
    """B v (u,) of velocities v (rows, 3)."""
    gather(own, v, own.speed)
    flux_of_corners(own, area, own.speed, out)


@kernel
def push_back(own, area, jump, out):
    """Add B'z of jumps z (u,) to forces (rows, 3)."""
    for i in range(own.push.shape[0]):
        for c in range(3):
            own.push[i, c] = 0.0
    add_push(own, area, jump, own.push)
    spread(own, own.push, out)


@inner
def times(matrix, x, out):
    """out = A x, both (u,)."""
    for i in range(x.size):
        row, total = matrix[i], 0.0
        for j in range(x.size):
            total += row[j] * x[j]
        out[i] = total


@inner
def dot(x, y):
    """x . y."""
    total = 0.0
    for i in range(x.size):
        total += x[i] * y[i]
    return total


@kernel
def lighten(mass, force, out, line):
    """out = M^-1 force on free dofs, both (rows, 3), without added mass."""
    if mass.lumped:
        inverse, given, found = flat(mass.inverse), flat(force), flat(out)
        for i in range(inverse.size):
            found[i] = inverse[i] * given[i]
    else:
        substitute(mass, force, out, line)


# ------------------------------------------------------------------ parts of the equation of motion
@addressed(ADDRESS, ADDRESS)
def turn_flow(m, u, v):
    """Add what the turning of the area vectors takes to the forces, N."""
    own, rows = m.added, m.s.force.shape[0]
    w, q, r = own.lines[0], own.lines[1], own.lines[2]
    put_areas(own, rows_at(u, rows))
    flux(own, own.area, rows_at(v, rows), w)
    put_rates(own)
    times(own.flow, w, q)
    flux_of_corners(own, own.rate, own.speed, w)
    times(own.flow, w, r)
    for i in range(own.push.shape[0]):
        for c in range(3):
            own.push[i, c] = 0.0
    add_push(own, own.area, r, own.push)
    add_push(own, own.rate, q, own.push)
    one, other, g, share = own.sides[0], own.sides[1], own.sides[2], own.sides[3]
    for t in range(own.triangles.shape[0]):
        a, b, d = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
        total = 0.0
        for j in range(3):
            at = own.unknown[own.triangles[t, j]]
            share[j] = q[at] if at >= 0 else 0.0
            total += share[j]
        for c in range(3):
            one[c], other[c] = own.place[b, c] - own.place[a, c], own.place[d, c] - own.place[a, c]
            g[c] = 0.0
            for j in range(3):
                g[c] += (total + share[j]) / 12.0 * own.speed[own.triangles[t, j], c]
        # w.F B v = sum of area . g: its derivative by the sides of each triangle
        add_cross(-0.5, other, g, own.push[b])
        add_cross(-0.5, g, one, own.push[d])
        add_cross(0.5, other, g, own.push[a])
        add_cross(0.5, g, one, own.push[a])
    spread(own, own.push, m.s.force)


@inner
def impedance(own, mass, x, out, line):
    """out = (F^-1 + B M^-1 B') x, both (u,)."""
    force, moved = own.nodal[0], own.nodal[1]
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] = 0.0
    push_back(own, own.area, x, force)
    lighten(mass, force, moved, line)
    flux(own, own.area, moved, own.lines[5])
    times(own.resistance, x, out)
    for i in range(out.size):
        out[i] += own.lines[5][i]


@addressed(ADDRESS)
def solve_with_fluid(m, out):
    """Solve with the mass and the added mass."""
    own, mass, line, rows = m.added, m.mass, m.s.line, m.s.force.shape[0]
    a = rows_at(out, rows)
    z, left, along, better, moved = (
        own.lines[0], own.lines[1], own.lines[2], own.lines[3], own.lines[4]
    )  # fmt: skip
    lighten(mass, m.s.force, a, line)
    flux(own, own.area, a, left)
    goal = TOLERANCE * math.sqrt(dot(left, left))
    times(own.guess, left, z)
    impedance(own, mass, z, moved, line)
    for i in range(z.size):
        left[i] -= moved[i]
    ahead = 0.0
    for step in range(ITERATIONS):
        if not math.sqrt(dot(left, left)) > goal:
            break
        times(own.guess, left, better)
        now = dot(left, better)
        for i in range(z.size):
            along[i] = better[i] + (now / ahead * along[i] if step > 0 else 0.0)
        ahead = now
        impedance(own, mass, along, moved, line)
        size = now / dot(along, moved)
        for i in range(z.size):
            z[i] += size * along[i]
            left[i] -= size * moved[i]
    force = own.nodal[0]
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] = 0.0
    push_back(own, own.area, z, force)
    lighten(mass, force, own.nodal[1], line)
    found, taken = flat(a), flat(own.nodal[1])
    for i in range(found.size):
        found[i] -= taken[i]


@kernel
def energy_of_fluid(own, v):
    """Kinetic energy (J) of the fluid at velocities v (rows, 3), with the area vectors as put."""
    flux(own, own.area, v, own.lines[0])
    times(own.flow, own.lines[0], own.lines[1])
    return 0.5 * dot(own.lines[0], own.lines[1])


@addressed(ADDRESS)
def kinetic_with_fluid(m, v):
    """Kinetic energy (J) of the sheet and of the fluid."""
    speed = rows_at(v, m.s.force.shape[0])
    return kinetic_energy(m.mass, speed, m.share.strips.own) + energy_of_fluid(m.added, speed)


@addressed(ADDRESS, ADDRESS)
def observe_fluid(m, v, a):
    """Add what accelerates the fluid to the forces, N, for reactions; returns its energy, J."""
    own, rows = m.added, m.s.force.shape[0]
    moving, speed, accelerated = m.s.moving, rows_at(v, rows), rows_at(a, rows)
    for i in range(rows):
        for c in range(3):
            moving[i, c] = accelerated[i, c] + m.system.alpha * speed[i, c]
    flux(own, own.area, moving, own.lines[0])
    times(own.flow, own.lines[0], own.lines[1])
    push_back(own, own.area, own.lines[1], m.s.force)
    return energy_of_fluid(own, speed)
