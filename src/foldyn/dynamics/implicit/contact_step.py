"""Contact in a step of the conserving method: forces that do exactly the potential's work.

Pairs are in `contact_pairs`. Guards of hinges: the difference quotient of the energy with respect
to the dihedral, times the discrete gradient of the dihedral, as for hinge moments. Planes: the
difference quotient of the energy with respect to the distance, along the normal. Friction: the
force of the spring at mid-step, limited by the normal force at the start of the step.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.dynamics.implicit.contact_measure import new_move
from foldyn.dynamics.implicit.contact_pairs import edges_step, vertex_step
from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.candidates import FRICTION, NORMAL
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.distances import (
    EDGES,
    VERTEX,
    closest_of,
    gap_of,
    nodes_of,
    put_corners,
)
from foldyn.mechanics.contact.hinge_guards import TURN, gradient_at
from foldyn.mechanics.contact.panel_friction import add_rub, add_rub_tangent
from foldyn.mechanics.contact.planes import farthest_stretch, height, move_planes, stretch_of
from foldyn.mechanics.contact.potential import barrier, difference_quotient
from foldyn.mechanics.contact.search import farthest, fastest, list_pairs, place, use_all
from foldyn.mechanics.contact.tangent import friction_tangent, of_contacts
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.discrete_gradient import discrete_gradient


class StepContact:
    """Contact forces in the steps of a motion.

    Parameters
    ----------
    contact : ContactTerm
    memory : Memory
        Contact memory, whose positions, planes and energy are updated to the end of each step.
    rows : int
        Number of rows of nodal arrays.

    Attributes
    ----------
    force : ndarray, shape (rows, 3)
        Mean gradient (N) of potential and friction in a step.
    push : ndarray, shape (q, m, 4)
        Mean friction gradient (N) of each plane at each contact point, and mean normal force.
    rub : ndarray, shape (m, 3)
        Mean gradient (N) of friction between panels.
    """

    def __init__(self, contact: ContactTerm, memory: Memory, rows: int) -> None:
        self._contact, self._tables, self._memory = contact, contact.tables, memory
        self._ends = np.zeros((rows, 3)), np.zeros((rows, 3))
        self._on_points = np.zeros_like(memory.x)
        tables = contact.tables
        self.force, self.push = np.zeros((rows, 3)), np.zeros_like(memory.friction)
        self.rub = np.zeros_like(memory.x)
        self._start, self._middle = np.zeros((2, *memory.x.shape))
        self._moved = np.zeros((2, len(tables.planes), 3))
        self._pairs = np.zeros((2, memory.d0.shape[1]), np.int64)
        self._move = new_move()

    def put(self, u0: NDArray, u1: NDArray, factor0: NDArray, factor1: NDArray) -> None:
        """Compute `force` for a step from displacement u0 to u1 (rows, 3).

        factor0, factor1 : (h, 3) factors of the histories at the start and the end.
        """
        own, kept, force = self._tables, self._memory, self._on_points
        for moved, factor in zip(self._moved, (factor0, factor1), strict=True):
            move_planes(own, factor, kept)
            moved[:] = kept.moved[:, :3]
        for end, u in zip(self._ends, (u0, u1), strict=True):
            end[:] = u  # the contact term changes planes and factors in place
        p0, p1, middle = self._contact.points(u0), self._contact.points(u1), self._middle
        force[:] = 0.0
        self._counts = _find(own, p0, p1, self._start, middle, kept, self._pairs)
        kept.facts.energy = self._steps(False, force)[2]
        if own.friction > 0.0:
            _add_rubs(own, middle, kept, self._pairs, *self._counts, self.rub, force)
        _add_others(own, self._start, middle, self._moved, kept, self._move, self.push, force)
        back = self._contact.step_back(*self._ends, force)
        self.force[: len(back)] = back

    def _steps(self, tangent: bool, force: NDArray) -> tuple[NDArray, NDArray, float]:
        """Add the forces of touching pairs; return nodes (k, 4), tangents (k, 12, 12), energy (J).

        Tangents are only computed if `tangent`; otherwise they are zero.
        """
        count = sum(self._counts)
        nodes, blocks = np.empty((count, 4), np.int64), np.zeros((count, 12, 12))
        energy = _pair_steps(
            self._tables, self._start, self._middle, self._memory, self._pairs, *self._counts,
            self._move, tangent, nodes, blocks, force,
        )  # fmt: skip
        return nodes, blocks, energy

    def tangent(self) -> sparse.csr_array:
        """Derivative (m, m), N/m, of the last step's force with respect to the end displacement."""
        own, kept = self._tables, self._memory
        nodes, blocks, _ = self._steps(True, np.zeros_like(self._on_points))
        guards = np.zeros((len(own.hinge_limit), 4, 3, 4, 3))
        acts = _guard_tangents(own, self._start, kept.x, self._move, guards)
        at_planes = np.zeros((*kept.x.shape, 3))
        if len(own.planes):
            _plane_tangents(own, self._start, self._middle, self._moved, kept, at_planes)
        hinges, size = own.hinges[acts], self._on_points.size
        inner = of_contacts(nodes, blocks, hinges, guards[acts], at_planes, size)
        return self._contact.step_tangent(*self._ends, self._on_points, inner)


@kernel
def _find(tables, u0, u1, start, middle, memory, pairs):
    """Set the positions of a step, and find the pairs that touch at the start or the end.

    Writes pair indices to `pairs`; returns the number of pairs of each kind.
    """
    place(tables, u0, memory)
    start[:] = memory.x
    if memory.d0.shape[1] > 0:
        _list(tables, u0, u1, memory)
    place(tables, u1, memory)
    middle[:] = 0.5 * (start + memory.x)
    # bound for the difference between a distance at the midpoint and at the ends
    reach, found = fastest(memory.x - start, len(start)), np.zeros(2, np.int64)
    triangles, edges = tables.triangles, tables.edges
    for kind in range(2):
        listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
        for k in range(listed):
            one, other, d0 = memory.pairs[kind, k, 0], memory.pairs[kind, k, 1], memory.d0[kind, k]
            if not gap_of(triangles, edges, middle, kind, one, other) < d0 + reach:
                continue
            before = gap_of(triangles, edges, start, kind, one, other)
            after = gap_of(triangles, edges, memory.x, kind, one, other)
            if min(before, after) < d0:
                pairs[kind, found[kind]] = k
                found[kind] += 1
    return found[0], found[1]


@inner
def _list(tables, u0, u1, memory):
    """List all pairs that come close between u0 and u1; no pairs if the motion is too long."""
    far = math.inf
    if memory.counts.has_list == 1:
        far = max(farthest(u0, memory), farthest(u1, memory))
    if not far < 0.5 * memory.facts.skin:
        middle = 0.5 * (u0 + u1)
        place(tables, middle, memory)
        list_pairs(tables, middle, memory)
        use_all(memory)
        if not farthest(u0, memory) < 0.5 * memory.facts.skin:
            memory.counts.full, memory.counts.has_list = 1, 0


@kernel
def _pair_steps(
    tables, start, middle, memory, pairs, first, second, move, tangent, nodes, blocks, force
):  # fmt: skip
    """Compute nodes (k, 4), tangents (k, 12, 12) and forces of touching pairs; return energy (J).

    first, second : number of pairs of each of the two kinds.
    """
    push, energy = np.empty(12), 0.0
    triangles, edges = tables.triangles, tables.edges
    for k in range(first + second):
        kind = VERTEX if k < first else EDGES
        pair = pairs[kind, k if k < first else k - first]
        one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
        own, d0 = nodes_of(triangles, edges, kind, one, other), memory.d0[kind, pair]
        nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3] = own
        put_corners(start, own, move.start)
        put_corners(memory.x, own, move.end)
        push[:] = 0.0
        if kind == VERTEX:
            energy += vertex_step(tables, other, d0, move, tangent, push, blocks[k])
        else:
            energy += edges_step(tables, one, other, d0, move, tangent, push, blocks[k])
        for i in range(12):
            force[nodes[k, i // 3], i % 3] += push[i]
        if tables.friction > 0.0 and tangent:
            add_rub_tangent(tables, memory, middle, kind, pair, 0.5, blocks[k])
    return energy


@kernel
def _add_rubs(tables, middle, memory, pairs, first, second, rub, force):
    """Add friction of touching pairs, by springs at mid-step, to `rub` and `force`."""
    rub[:] = 0.0
    for k in range(first + second):
        kind = VERTEX if k < first else EDGES
        pair = pairs[kind, k if k < first else k - first]
        one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
        p, q, inside = closest_of(tables.triangles, tables.edges, middle, kind, one, other)
        if inside:
            add_rub(tables, memory, middle, rub, kind, pair, math.inf, p, q)
    for i in range(len(rub)):
        for c in range(3):
            force[i, c] += rub[i, c]


@inner
def _guard(tables, h, theta0, theta1):
    """Mean moment (N m) of a guard, its slope, and the end energy (J).

    The slope is the derivative with respect to the dihedral at the end.
    """
    limit, k = tables.hinge_limit[h], tables.hinge_stiffness[h]
    moment, slope, energy = 0.0, 0.0, 0.0
    for sign in (1.0, -1.0):
        x0 = (theta0 if sign > 0.0 else TURN - theta0) / limit
        x1 = (theta1 if sign > 0.0 else TURN - theta1) / limit
        value, rate = difference_quotient(x0, x1)
        moment += sign * k * limit * value
        slope += k * rate
        energy += k * limit * limit * barrier(x1)[0] if x1 < 1.0 else 0.0
    return moment, slope, energy


@inner
def _turn(tables, h, start, end, move, points, plain, gradient):
    """Discrete gradient of a guarded hinge's dihedral, both dihedrals, and the end gradient.

    See `discrete_gradient`.
    """
    before, after = gradient_at(tables, start, h), gradient_at(tables, end, h)
    for v in range(4):
        node = tables.hinges[h, v]
        for c in range(3):
            move.middle[v, c] = 0.5 * (start[node, c] + end[node, c])
            move.motion[v, c] = end[node, c] - start[node, c]
            move.deform[v, c] = after[1 + 3 * v + c]
    change = after[0] - before[0]
    discrete_gradient(move.middle, move.motion, change, points, plain, gradient)


@inner
def _add_guards(tables, start, memory, move, force):
    """Add the moments of the guards; add the energy at the end to the energy of contact."""
    points, plain, gradient = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    for h in range(tables.hinge_limit.size):
        theta0 = gradient_at(tables, start, h)[0]
        theta1 = gradient_at(tables, memory.x, h)[0]
        moment, _, energy = _guard(tables, h, theta0, theta1)
        memory.facts.energy += energy
        if moment == 0.0:
            continue
        _turn(tables, h, start, memory.x, move, points, plain, gradient)
        for v in range(4):
            for c in range(3):
                force[tables.hinges[h, v], c] += moment * gradient[v, c]


@kernel
def _guard_tangents(tables, start, end, move, blocks):
    """Derivatives (h, 4, 3, 4, 3) of the guards' forces, and whether each guard acts (h,).

    Derivatives of discrete gradients are accurate to first order in the step, as for other hinges.
    """
    acts = np.zeros(tables.hinge_limit.size, np.bool_)
    points, plain, gradient = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    for h in range(tables.hinge_limit.size):
        theta0, theta1 = gradient_at(tables, start, h)[0], gradient_at(tables, end, h)[0]
        moment, slope, _ = _guard(tables, h, theta0, theta1)
        if moment == 0.0:
            continue
        acts[h] = True
        _turn(tables, h, start, end, move, points, plain, gradient)
        for v in range(12):
            for w in range(12):
                turned = slope * gradient[v // 3, v % 3] * move.deform[w // 3, w % 3]
                blocks[h, v // 3, v % 3, w // 3, w % 3] = turned
        add_hessian(points, plain, 0.5 * moment, blocks[h])
    return acts


@kernel
def _add_others(tables, start, middle, moved, memory, move, push, force):
    """Add the forces of guards and planes."""
    if memory.d0.shape[1] > 0:
        _add_guards(tables, start, memory, move, force)
        if memory.counts.full == 1:
            memory.facts.energy = np.nan
            force[tables.surface[0], 0] = np.nan
    if len(tables.planes) > 0:
        _add_planes(tables, start, middle, moved, memory, push, force)


@inner
def _plane_quotient(tables, start, moved, memory, p, i):
    """Mean normal force of node i at plane p divided by -k d0, its slope, and the end energy (J).

    moved : (2, q, 3) displacements of the planes at the start and the end.
    """
    d0 = 0.5 * tables.node_thickness[i]
    before = height(tables, start, moved[0], p, i) / d0
    after = height(tables, memory.x, moved[1], p, i) / d0
    energy = tables.stiffness * d0 * d0 * barrier(after)[0] if after < 1.0 else 0.0
    value, slope = difference_quotient(before, after)
    return value, slope, energy


@inner
def _add_planes(tables, start, middle, moved, memory, push, force):
    """Add the forces of the planes to `force`, and to `push` (q, n, 4)."""
    k, halfway = tables.stiffness, 0.5 * (moved[0] + moved[1])
    push[:] = 0.0
    for p in range(len(tables.planes)):
        plane = tables.planes[p]
        for m in range(tables.meeting.size):
            i = tables.meeting[m]
            value, _, energy = _plane_quotient(tables, start, moved, memory, p, i)
            if value == 0.0:
                continue
            memory.facts.energy += energy
            push[p, i, 3] = -0.5 * k * tables.node_thickness[i] * value
            for c in range(3):
                force[i, c] -= push[p, i, 3] * plane[NORMAL + c]
            if plane[FRICTION] > 0.0 and memory.anchor[p, i, 3] > 0.0:
                stretch = stretch_of(tables, middle, halfway, memory, p, i)
                most = farthest_stretch(tables, memory, p, i)
                share = k if stretch[3] <= most else k * most / stretch[3]
                for c in range(3):
                    push[p, i, c] = share * stretch[c]
                    force[i, c] += push[p, i, c]


@kernel
def _plane_tangents(tables, start, middle, moved, memory, out):
    """Derivatives (n, 3, 3) of the planes' forces on each node."""
    spring, halfway = np.empty((3, 3)), 0.5 * (moved[0] + moved[1])
    for p in range(len(tables.planes)):
        plane = tables.planes[p]
        for m in range(tables.meeting.size):
            i = tables.meeting[m]
            value, slope, _ = _plane_quotient(tables, start, moved, memory, p, i)
            if value == 0.0:
                continue
            for a in range(3):
                for b in range(3):
                    normal = plane[NORMAL + a] * plane[NORMAL + b]
                    out[i, a, b] += tables.stiffness * slope * normal
            if plane[FRICTION] > 0.0 and memory.anchor[p, i, 3] > 0.0:
                spring[:] = 0.0
                friction_tangent(tables, middle, halfway, memory, p, i, 0.0, spring)
                for a in range(3):
                    for b in range(3):
                        out[i, a, b] += 0.5 * spring[a, b]
