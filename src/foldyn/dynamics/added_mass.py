"""Added mass: the fluid that moves with a sheet; T = w'F w / 2 with w = B (v - U).

U(t) is the velocity of the wind, the same everywhere; the flow is the disturbance by the sheet.
B(u) turns velocities of the nodes into the flux at the unknowns of the flow. It is made of the area
vectors of the panels' triangles, which follow the motion. F is the flow (`cases.added_mass`) in one
state of folding. A rigid rotation leaves F unchanged, so it costs no accuracy; when a hinge has
turned by `TURN`, F is computed again (`renewed_flow`). With F constant, Lagrange's equations are

    (M + B'F B) a + B'F (B. (v - U) - B U.) + B.'F w - d(q.B (v - U))/du = p - F_int,   q = F w,

with B. and U. the time derivatives of B and U, and q held constant in the last term. The
accelerations follow from

    (F^-1 + B M^-1 B') z = B M^-1 r,   a = M^-1 (r - B'z),

which are solved by conjugate gradients; the initial guess uses the inverse of the matrix where F
was computed.

The forces f of the fluid take the power f.U from the wind. They add up to -P., where P =
sum of B'q is the momentum of the fluid: the air has received the energy U.P and the power -P.U.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, History
from foldyn.cases.added_mass import Fluid, fluid_at
from foldyn.dynamics.inertia import Inertia, kinetic_energy, substitute, times_mass
from foldyn.errors import InputError
from foldyn.jit.compiled import addressed, inner, kernel
from foldyn.jit.context import numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.air.added_mass import inverse
from foldyn.mechanics.term import ADDRESS
from foldyn.statics.rigid import free_rigid_motions
from foldyn.structures.mesh import double_areas

TURN = math.radians(3.0)  # turn of a hinge after which the flow is computed again
LOOK_EVERY = 16  # steps between two checks whether a hinge has turned by `TURN`
MOST = 1500  # largest number of unknowns of the flow
TOLERANCE = 1e-13  # relative residual to which accelerations are solved
ITERATIONS = 200
SCALED = 0.25, 4.0  # least and largest factor by which a new flow may scale the deformation energy


class AddedMass(NamedTuple):
    """The flow about t triangles with u unknowns, and scratch arrays."""

    triangles: NDArray  # (t, 3) nodes
    sides: NDArray  # (t, 2, 3) rest vectors from the first corner to the others, m
    start: NDArray  # (u + 1,) first entry of each unknown in `corner` and `catch`
    corner: NDArray  # (k,) corner of each entry: 3 t + c for corner c of triangle t
    catch: NDArray  # (k,) factor of area vector . velocity at that corner
    flow: NDArray  # (u, u) F, kg/m4
    resistance: NDArray  # (u, u) F^-1
    guess: NDArray  # (u, u) inverse of the matrix of the accelerations where F was computed
    area: NDArray  # (t, 3) memory: area vectors, m2
    rate: NDArray  # (t, 3) memory: rates of the area vectors, m2/s
    through: NDArray  # (3 t,) memory: one number per corner
    lines: NDArray  # (6, u) memory
    nodal: NDArray  # (2, rows, 3) memory
    vectors: NDArray  # (4, 3) memory: vectors of one triangle
    angle: NDArray  # (nh,) dihedrals where F was computed, rad
    made: NDArray  # (2,) number of flows since the start, and the energy (J) not conserved by them
    wind: NDArray  # (3,) velocity of the air at factor 1, m/s
    gust: int  # row of the wind's history, -1 where it is steady
    blown: NDArray  # (2, 3) memory: the air's velocity, m/s, and acceleration, m/s2
    carried: NDArray  # (1,) memory: U.P at the last sample, J

    @property
    def acts(self) -> bool:
        """Whether the case has added mass."""
        return len(self.flow) > 0


def added_mass(
    case: Case, start: NDArray | None, rank: NDArray, rows: int, hinges: int,
    histories: Sequence[History],
) -> AddedMass:  # fmt: skip
    """Added mass of a case; node i is stored at place rank[i] of `rows`.

    start : displacement (n, 3) where the motion began; rest by default. The flow is computed
        later, by `begin_flow`.
    histories : all histories of the case, including the wind's.

    Raises
    ------
    InputError
        The flow has too many unknowns, or supports move.
    """
    air, nodes = case.air, case.structure.nodes
    if air is None or not air.added_mass:
        return _with_memory(np.zeros((0, 3)), nodes, sparse.csr_array((0, 0)), 0, 0)
    if case.imposed_terms or case.base_terms:
        raise InputError(
            ": motions with moving supports cannot include added mass; give added_mass = false",
            "air",
        )
    unknown = int(case.boundary_elements.unknown.max(initial=-1)) + 1
    if unknown > MOST:
        raise InputError(
            f".resolution = {air.resolution}: the flow has {unknown} unknowns, and motions take at "
            f"most {MOST}; lower it, or give added_mass = false",
            "air",
        )
    fluid = fluid_at(case, np.zeros_like(nodes) if start is None else start)
    catch = _catch(fluid, nodes if start is None else nodes + start)
    added = _with_memory(fluid.triangles, nodes, catch, rows, hinges)
    added.wind[:] = added.blown[0] = air.velocity
    return added._replace(
        triangles=np.ascontiguousarray(rank[fluid.triangles], np.int64),
        gust=next((histories.index(history) for _, history in case.wind_terms), -1),
    )


def _with_memory(
    triangles: NDArray, nodes: NDArray, catch: sparse.csr_array, rows: int, hinges: int
) -> AddedMass:
    """Added mass of triangles (t, 3) on nodes (n, 3), and their matrix `catch` (u, 3t)."""
    unknown, count = catch.shape[0], len(triangles)
    corners = nodes[triangles.astype(np.int64)]
    square = unknown, unknown
    return AddedMass(
        triangles=triangles.astype(np.int64),
        sides=np.ascontiguousarray(corners[:, 1:] - corners[:, :1]),
        start=catch.indptr.astype(np.int64),
        corner=catch.indices.astype(np.int64),
        catch=catch.data,
        flow=np.zeros(square),
        resistance=np.zeros(square),
        guess=np.zeros(square),
        area=np.zeros((count, 3)),
        rate=np.zeros((count, 3)),
        through=np.zeros(3 * count),
        lines=np.zeros((6, unknown)),
        nodal=np.zeros((2, rows, 3)),
        vectors=np.zeros((4, 3)),
        angle=np.zeros(hinges),
        made=np.zeros(2),
        wind=np.zeros(3),
        gust=-1,
        blown=np.zeros((2, 3)),
        carried=np.zeros(1),
    )


def _catch(fluid: Fluid, x: NDArray) -> sparse.csr_array:
    """Matrix (u, 3t) from area vector . velocity of each corner to the unknowns of the flow."""
    area = 0.5 * np.linalg.norm(double_areas(x, fluid.triangles), axis=1)
    elements = np.arange(len(fluid.under)).repeat(3)
    columns = (3 * fluid.under[:, None] + np.arange(3)).ravel()
    shares = (fluid.shares / area[fluid.under, None]).ravel()
    spread = sparse.csr_array((shares, (elements, columns)), (len(fluid.under), 3 * len(area)))
    return sparse.csr_array(fluid.catch @ spread)


def begin_flow(case: Case, packed: Any, state: Any, place: NDArray) -> None:
    """Compute the flow at the start of a motion, at `place` (n, 3)."""
    own, inward = packed.added, packed.numbering.inward(place)
    if own.acts:
        _find_flow(case, own, packed.mass, place, inward)
        own.angle[:], own.made[:] = packed.body.angles(inward), 0.0
        put_areas(own, state.u)
        _blow(case, own, state)
        energy_of_flow(own, state.v)
        state.tally.air = -own.carried[0]


def renewed_flow(case: Case, packed: Any, state: Any) -> bool:
    """Compute the flow again if a hinge has turned by `TURN` since; return whether it was.

    The momentum of sheet and fluid is conserved on every free dof. The deforming part of the
    velocity is then scaled, which keeps the momenta, so that the energy in excess of the
    undisturbed wind is conserved, within the bounds `SCALED`. The rest counts as lost to the air.
    """
    own, mass, v = packed.added, packed.mass, state.v
    if np.abs(state.angle - own.angle).max(initial=0.0) <= TURN:
        return False
    line, jump = np.zeros(v.size), np.zeros(len(own.flow))
    push, change = np.zeros((2, *v.shape))
    put_areas(own, state.u)
    _blow(case, own, state)
    before = _conserved(own, mass, v)
    flux(own, own.area, v - own.blown[0], jump)
    lost = own.flow @ jump
    _find_flow(case, own, mass, packed.numbering.outward(state.u), state.u)
    add_push(own, own.area, lost - own.flow @ jump, push)
    solve(own, mass, push, change, line)
    v += change
    deforming = v - _rigid_part(case, packed, state)
    missed, least = before - _conserved(own, mass, v), whole_energy(own, mass, deforming)
    if least > 0.0:
        v += (math.sqrt(np.clip(1.0 + missed / least, *SCALED)) - 1.0) * deforming
    left = before - _conserved(own, mass, v)
    state.tally.air += left
    own.angle[:] = state.angle
    own.made[:] += 1.0, abs(left)
    return True


def _blow(case: Case, own: AddedMass, state: Any) -> None:
    """Set the wind velocity at the current time of the motion."""
    for _, history in case.wind_terms:
        own.blown[0] = history(float(state.tally.time)) * own.wind


def _conserved(own: AddedMass, mass: Inertia, v: NDArray) -> float:
    """Energy (J) that is conserved in a steady wind: of the sheet, of the flow, and U.P."""
    return whole_energy(own, mass, v) - energy_of_fluid(own, np.zeros_like(v) + own.blown[0])


def _rigid_part(case: Case, packed: Any, state: Any) -> NDArray:
    """Rigid motion (rows, 3) that the supports allow, with the momenta of sheet and fluid."""
    own, by, v = packed.added, packed.numbering, state.v
    place = case.structure.nodes + by.outward(state.u)
    free = free_rigid_motions(place, case.constraints).T
    shapes = np.array([by.inward(shape.reshape(-1, 3)) for shape in free]).reshape(-1, *v.shape)
    pushes, speed = np.zeros((len(shapes), *v.shape)), np.zeros(len(own.flow))
    for shape, force in zip(shapes, pushes, strict=True):
        times_mass(packed.mass, shape, force)
        flux(own, own.area, shape, speed)
        add_push(own, own.area, own.flow @ speed, force)
    inertia = np.tensordot(shapes, pushes, ((1, 2), (1, 2)))
    rates = np.linalg.lstsq(inertia, np.tensordot(pushes, v, 2), rcond=None)[0]
    return np.tensordot(rates, shapes, 1)


def _find_flow(case: Case, own: AddedMass, mass: Inertia, outward: NDArray, u: NDArray) -> None:
    """Compute the flow at displacements `outward` (n, 3), and u (rows, 3) in memory order."""
    flow: Any = fluid_at(case, outward).flow
    own.flow[:] = flow if isinstance(flow, np.ndarray) else flow.toarray()
    own.resistance[:] = inverse(own.flow.copy())
    put_areas(own, u)
    matrix, one, line = own.resistance.copy(), np.zeros(len(own.flow)), np.zeros(u.size)
    for k in range(len(one)):
        one[:] = 0.0
        one[k] = 1.0
        move(own, mass, one, matrix[k], line)
    own.guess[:] = inverse(0.5 * (matrix + matrix.T))


# ------------------------------------------------------------------ fluxes
@inner
def put_sides(own, u, t):
    """Put the vectors from corner 0 of triangle t to corners 1 and 2, at u, into `vectors[:2]`."""
    first, second, third = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
    for c in range(3):
        own.vectors[0, c] = own.sides[t, 0, c] + u[second, c] - u[first, c]
        own.vectors[1, c] = own.sides[t, 1, c] + u[third, c] - u[first, c]


@inner
def add_cross(factor, a, b, out):
    """Add factor a x b to `out`, all (3,)."""
    out[0] += factor * (a[1] * b[2] - a[2] * b[1])
    out[1] += factor * (a[2] * b[0] - a[0] * b[2])
    out[2] += factor * (a[0] * b[1] - a[1] * b[0])


@kernel
def put_areas(own, u):
    """Put the area vectors of triangles displaced by u (rows, 3)."""
    for t in range(own.triangles.shape[0]):
        put_sides(own, u, t)
        for c in range(3):
            own.area[t, c] = 0.0
        add_cross(0.5, own.vectors[0], own.vectors[1], own.area[t])


@inner
def put_rates(own, u, v):
    """Put the rates of the area vectors at velocities v (rows, 3)."""
    turn, lean = own.vectors[2], own.vectors[3]
    for t in range(own.triangles.shape[0]):
        first, second, third = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
        put_sides(own, u, t)
        for c in range(3):
            turn[c], lean[c] = v[second, c] - v[first, c], v[third, c] - v[first, c]
            own.rate[t, c] = 0.0
        add_cross(0.5, turn, own.vectors[1], own.rate[t])
        add_cross(0.5, own.vectors[0], lean, own.rate[t])


@kernel
def flux(own, area, v, out):
    """Put the flux (u,) of velocities v (rows, 3) through area vectors (t, 3) into `out`."""
    for t in range(area.shape[0]):
        for k in range(3):
            node, total = own.triangles[t, k], 0.0
            for c in range(3):
                total += area[t, c] * v[node, c]
            own.through[3 * t + k] = total
    for i in range(out.size):
        total = 0.0
        for e in range(own.start[i], own.start[i + 1]):
            total += own.catch[e] * own.through[own.corner[e]]
        out[i] = total


@kernel
def add_push(own, area, jump, force):
    """Add the nodal forces (rows, 3) of pressure jumps (u,), N/m2, through area vectors (t, 3)."""
    for e in range(own.through.size):
        own.through[e] = 0.0  # force per area vector at each corner
    for i in range(jump.size):
        for e in range(own.start[i], own.start[i + 1]):
            own.through[own.corner[e]] += own.catch[e] * jump[i]
    for t in range(area.shape[0]):
        for k in range(3):
            for c in range(3):
                force[own.triangles[t, k], c] += own.through[3 * t + k] * area[t, c]


@inner
def times(matrix, x, out):
    """out = A x for a symmetric matrix A; x and `out` (u,)."""
    for i in range(x.size):
        out[i] = 0.0
    for j in range(x.size):  # by columns, so that sums need no fixed order
        row, factor = matrix[j], x[j]
        for i in range(x.size):
            out[i] += row[i] * factor


@inner
def dot(x, y):
    """Dot product of x and y."""
    total = 0.0
    for i in range(x.size):
        total += x[i] * y[i]
    return total


@inner
def lighten(mass, force, out, line):
    """out = M^-1 force on free dofs, both (rows, 3); `line` is scratch memory."""
    if mass.lumped:
        inverse, given, found = flat(mass.inverse), flat(force), flat(out)
        for i in range(inverse.size):
            found[i] = inverse[i] * given[i]
    else:
        substitute(mass, force, out, line)


@kernel
def move(own, mass, jump, out, line):
    """Add B M^-1 B' jump to `out` (u,); M^-1 B' jump stays in the nodal scratch."""
    force, moved, found = own.nodal[0], own.nodal[1], own.lines[5]
    pushed = flat(force)
    for i in range(pushed.size):
        pushed[i] = 0.0
    add_push(own, own.area, jump, force)
    lighten(mass, force, moved, line)
    flux(own, own.area, moved, found)
    for i in range(out.size):
        out[i] += found[i]


# ------------------------------------------------------------------ parts of the equation of motion
@addressed(ADDRESS, ADDRESS, ADDRESS)
def turn_flow(m, u, v, powers):
    """Add the forces, N, due to turning area vectors and an accelerating wind, and drag alpha M v.

    Sets the second and third of the powers (3,) to the power dissipated by the drag and the power
    lost to the wind, W; the fluid has no other power.
    """
    own, rows, power, air = m.added, m.s.force.shape[0], 0.0, 0.0
    moved, speed, past, pushed = rows_at(u, rows), rows_at(v, rows), own.nodal[0], own.nodal[1]
    w, q, turned, driven = own.lines[0], own.lines[1], own.lines[2], own.lines[3]
    if own.gust >= 0:
        for c in range(3):
            own.blown[0, c] = m.s.factor[own.gust, 0] * own.wind[c]
            own.blown[1, c] = m.s.factor[own.gust, 1] * own.wind[c]
    put_relative(own, speed)
    put_areas(own, moved)
    put_rates(own, moved, speed)
    flux(own, own.rate, past, w)
    if own.gust >= 0:
        put_uniform(own.blown[1], pushed)
        flux(own, own.area, pushed, driven)
        for i in range(w.size):
            w[i] -= driven[i]
    times(own.flow, w, turned)
    add_push(own, own.area, turned, m.s.force)
    flux(own, own.area, past, w)
    times(own.flow, w, q)
    if own.gust >= 0:
        air -= dot(q, driven)
    add_push(own, own.rate, q, m.s.force)
    one, other, pressed, back = own.vectors[0], own.vectors[1], own.vectors[2], own.vectors[3]
    for t in range(own.triangles.shape[0]):  # q . B (v - U) is a sum of area . pressed
        put_sides(own, moved, t)
        for c in range(3):
            pressed[c], back[c] = 0.0, 0.0
            for k in range(3):
                pressed[c] += own.through[3 * t + k] * past[own.triangles[t, k], c]
        first, second, third = own.triangles[t, 0], own.triangles[t, 1], own.triangles[t, 2]
        add_cross(0.5, other, pressed, back)
        for c in range(3):
            m.s.force[second, c] -= back[c]
            m.s.force[first, c] += back[c]
            back[c] = 0.0
        add_cross(0.5, pressed, one, back)
        for c in range(3):
            m.s.force[third, c] -= back[c]
            m.s.force[first, c] += back[c]
    if m.system.alpha > 0.0:
        times_mass(m.mass, speed, m.s.product)
        for i in range(rows):
            for c in range(3):
                drag = m.system.alpha * m.s.product[i, c]
                m.s.force[i, c] += drag
                power += drag * speed[i, c]
    found = numbers_at(powers, 3)
    found[1], found[2] = power, air


@addressed(ADDRESS)
def solve_with_fluid(m, out):
    """Solve for accelerations with the mass and the added mass."""
    solve(m.added, m.mass, m.s.force, rows_at(out, m.s.force.shape[0]), m.s.line)


@kernel
def solve(own, mass, force, a, line):
    """Accelerations a (rows, 3), m/s2, due to `force`, with the stored area vectors."""
    lines = own.lines
    z, left, along, better, moved = lines[0], lines[1], lines[2], lines[3], lines[4]
    lighten(mass, force, a, line)
    flux(own, own.area, a, left)
    goal = TOLERANCE * math.sqrt(dot(left, left))
    times(own.guess, left, z)
    times(own.resistance, z, moved)
    move(own, mass, z, moved, line)
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
        times(own.resistance, along, moved)
        move(own, mass, along, moved, line)
        size = now / dot(along, moved)
        for i in range(z.size):
            z[i] += size * along[i]
            left[i] -= size * moved[i]
    move(own, mass, z, moved, line)
    found, taken = flat(a), flat(own.nodal[1])
    for i in range(found.size):
        found[i] -= taken[i]


@kernel
def energy_of_fluid(own, v):
    """Kinetic energy (J) of fluid in still air at velocities v (rows, 3), with the stored areas."""
    flux(own, own.area, v, own.lines[0])
    times(own.flow, own.lines[0], own.lines[1])
    return 0.5 * dot(own.lines[0], own.lines[1])


@inner
def put_uniform(velocity, out):
    """Give all nodes the same velocity (3,)."""
    for i in range(out.shape[0]):
        for c in range(3):
            out[i, c] = velocity[c]


@inner
def put_relative(own, v):
    """Put velocities (rows, 3) relative to the air into the first nodal scratch."""
    for i in range(v.shape[0]):
        for c in range(3):
            own.nodal[0, i, c] = v[i, c] - own.blown[0, c]


@kernel
def energy_of_flow(own, v):
    """Kinetic energy (J) of the flow for sheet velocities v (rows, 3); also stores U.P."""
    put_relative(own, v)
    energy = energy_of_fluid(own, own.nodal[0])
    put_uniform(own.blown[0], own.nodal[0])
    flux(own, own.area, own.nodal[0], own.lines[0])
    own.carried[0] = dot(own.lines[0], own.lines[1])
    return energy


@kernel
def whole_energy(own, mass, v):
    """Kinetic energy (J) of sheet and fluid together."""
    return kinetic_energy(mass, v, (0, v.shape[0])) + energy_of_fluid(own, v)


@addressed(ADDRESS, ADDRESS)
def observe_fluid(m, v, a):
    """Add the inertial force of the fluid, N, and remove the drag, to obtain the reactions.

    Returns the energy of the flow, J.
    """
    own, rows = m.added, m.s.force.shape[0]
    speed = rows_at(v, rows)
    times_mass(m.mass, speed, m.s.product)
    for i in range(rows):
        for c in range(3):
            m.s.force[i, c] -= m.system.alpha * m.s.product[i, c]
    flux(own, own.area, rows_at(a, rows), own.lines[0])
    times(own.flow, own.lines[0], own.lines[1])
    add_push(own, own.area, own.lines[1], m.s.force)
    return energy_of_flow(own, speed)
