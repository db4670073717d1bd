"""Internal force of bars and hinges: gather a block, compute without branches, scatter.

The compute passes run over blocks of 64 elements in structure-of-arrays form, which the compiler
vectorizes; the moment pass is separate, so that laws with branches or powers do not prevent
vectorization. The scratch arrays are flat and addressed as row * BLOCK + lane: with a stride known
at compile time, the compiler proves that loads and stores do not overlap (two-dimensional scratch
is 5 times slower). Nodal values are in buffers with rows of four, which load and store as vectors
(`rows`), and which hold a window of a large sheet (`strips`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inlined, inner, inner_scalar
from foldyn.jit.intrinsics import flat, prefetch_range
from foldyn.jit.rows import LANES, add_rows, load_rows
from foldyn.materials import ogden, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.linear import CODE as LINEAR
from foldyn.materials.series import series_moment
from foldyn.materials.switch import bar_stress
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.model import BLOCK, BarsHinges
from foldyn.mechanics.strips import Strips, strips
from foldyn.mechanics.threads import Team, team, wait

LINE = 8  # numbers in a cache line
SHIFT = 5 * LINE  # offset of scratch arrays: multiples of 4096 bytes would cause cache conflicts


class ForceScratch(NamedTuple):
    """Scratch of the force kernels on one thread, made once for all evaluations."""

    points: NDArray  # (12 * BLOCK,)
    gradient: NDArray  # (13 * BLOCK,), the last row the angle
    value: NDArray  # (2 * BLOCK,)
    position: NDArray  # (r, 4) buffers of nodal values, see `strips`
    displacement: NDArray  # (r, 4)
    sums: NDArray  # (r, 4) forces
    angle: NDArray  # (nh,) dihedrals of the last evaluation, rad; shared by all threads
    fold_angle: NDArray  # (nh,) the same array: dihedrals of actuated hinges
    strips: Strips
    team: Team

    @property
    def own(self) -> NDArray:
        """First and last + 1 of the nodes whose force the thread finishes."""
        return self.strips.own


def force_scratch(model: BarsHinges) -> ForceScratch:
    """Scratch for `model` on one thread."""
    return force_scratches(model, 1)[0]


def force_scratches(model: BarsHinges, threads: int) -> list[ForceScratch]:
    """Scratch of each thread; fewer threads than requested if the model has too few parts."""
    parts = strips(model, threads)
    angle = np.empty(len(model.hinges))
    each = zip(parts, team(len(parts)), strict=True)
    return [ForceScratch._make([*_aligned(own.rows), angle, angle, own, one]) for own, one in each]


def _aligned(rows: int) -> list[NDArray]:
    """The first six arrays of `ForceScratch`, each from the start of a cache line."""
    shapes = [(12 * BLOCK,), (13 * BLOCK,), (2 * BLOCK,), (rows, 4), (rows, 4), (rows, 4)]
    sizes = [math.prod(shape) for shape in shapes]
    starts = np.cumsum([0, *(math.ceil(size / LINE) * LINE + SHIFT for size in sizes)])
    room = np.zeros(starts[-1] + LINE)  # lanes beyond a block's end are computed too
    room = room[-room.ctypes.data % (8 * LINE) // 8 :]
    return [
        room[start : start + size].reshape(shape)
        for shape, start, size in zip(shapes, starts[:-1], sizes, strict=True)
    ]


@inner_scalar
def put_dihedral(x, q, g):
    """Put the gradient of hinge q of a block, and in the last row its angle, for points x."""
    (
        g[12 * BLOCK + q],
        g[q], g[BLOCK + q], g[2 * BLOCK + q],
        g[3 * BLOCK + q], g[4 * BLOCK + q], g[5 * BLOCK + q],
        g[6 * BLOCK + q], g[7 * BLOCK + q], g[8 * BLOCK + q],
        g[9 * BLOCK + q], g[10 * BLOCK + q], g[11 * BLOCK + q],
    ) = dihedral_gradient(
        x[q], x[BLOCK + q], x[2 * BLOCK + q],
        x[3 * BLOCK + q], x[4 * BLOCK + q], x[5 * BLOCK + q],
        x[6 * BLOCK + q], x[7 * BLOCK + q], x[8 * BLOCK + q],
        x[9 * BLOCK + q], x[10 * BLOCK + q], x[11 * BLOCK + q],
    )  # fmt: skip


@inner_scalar
def whole_lanes(m):
    """Number of lanes to compute for m elements: rounded up to whole vectors."""
    return (m + LANES - 1) // LANES * LANES


@inner_scalar
def gather(rows, mask, nodes, width, v, first, m, out, at):
    """Copy coordinates of node v of m elements, rows of `width` nodes, to rows from out[at]."""
    whole = m // LANES * LANES
    for q in range(0, whole, LANES):
        load_rows(rows, nodes, width * (first + q) + v, width, mask, out, at + q, BLOCK)
    for q in range(whole, m):
        row = 4 * (nodes[width * (first + q) + v] & mask)
        for c in range(3):
            out[at + c * BLOCK + q] = rows[row + c]


@inner_scalar
def scatter(rows, mask, nodes, width, v, first, m, vector, at, factor, start):
    """Add factor[start + q] times a vector, three rows from vector[at], to node v of elements."""
    whole = m // LANES * LANES
    for q in range(0, whole, LANES):
        node = width * (first + q) + v
        add_rows(rows, nodes, node, width, mask, vector, at + q, BLOCK, factor, start + q)
    for q in range(whole, m):
        row = 4 * (nodes[width * (first + q) + v] & mask)
        for c in range(3):
            rows[row + c] += factor[start + q] * vector[at + c * BLOCK + q]


@inner_scalar
def first_above(nodes, width, start, end, node):
    """First of the elements start to end whose lowest node is at least `node`."""
    while start < end:
        middle = (start + end) // 2
        low = nodes[width * middle]
        for v in range(1, width):
            low = min(low, nodes[width * middle + v])
        if low < node:
            start = middle + 1
        else:
            end = middle
    return start


@inner_scalar
def elements_of(nodes, width, run, low, high, n):
    """Elements of a run with lowest nodes from low to high, multiples of GROUP or the end n."""
    start, end = run[0], run[1]
    if low > 0:
        start = first_above(nodes, width, start, end, low)
    if high < n:
        end = first_above(nodes, width, start, end, high)
    return start, end


@inner
def add_bar_forces(model, low, high, scratch):
    """Add the forces of the bars with lowest nodes from low to high to scratch.sums."""
    x, s, mask = scratch.points, scratch.value, scratch.strips.mask
    u, sums = flat(scratch.displacement), flat(scratch.sums)
    bars, vector = flat(model.bars), flat(model.bar_vector)
    per_length2, stiffness = model.bar_per_length2, model.bar_stiffness
    far = scratch.strips.lowest.shape[0] > 1
    for run in range(model.bar_runs.shape[0]):
        code = model.bar_runs[run, 2]
        address = model.addresses[model.bar_runs[run, 3], 1]
        start, end = elements_of(bars, 2, model.bar_runs[run], low, high, model.rest.shape[0])
        for first in range(start, end, BLOCK):
            m = min(BLOCK, end - first)
            lanes = whole_lanes(m)
            after = first + BLOCK
            for v in range(2):
                gather(u, mask, bars, 2, v, first, m, x, 3 * v * BLOCK)
            if far:
                prefetch_range(vector, 3 * after, 3 * BLOCK)
                prefetch_range(bars, 2 * after, 2 * BLOCK)
                prefetch_range(per_length2, after, BLOCK)
                prefetch_range(stiffness, after, BLOCK)
            for q in range(m):
                e = first + q
                for c in range(3):
                    x[(6 + c) * BLOCK + q] = vector[3 * e + c]
                s[q] = per_length2[e]
            for q in range(lanes):
                # lambda^2 - 1 from displacements, without cancellation
                dx, vx = x[3 * BLOCK + q] - x[q], x[6 * BLOCK + q]
                dy, vy = x[4 * BLOCK + q] - x[BLOCK + q], x[7 * BLOCK + q]
                dz, vz = x[5 * BLOCK + q] - x[2 * BLOCK + q], x[8 * BLOCK + q]
                s[q] *= dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
                x[q], x[BLOCK + q], x[2 * BLOCK + q] = vx + dx, vy + dy, vz + dz
            if code == ogden.CODE:
                for q in range(lanes):
                    s[q] = ogden.stress_of_excess(s[q])
            else:
                for q in range(m):
                    s[q] = bar_stress(code, s[q] / (1.0 + math.sqrt(1.0 + s[q])), address)
            for q in range(m):
                s[q] *= stiffness[first + q]
                s[BLOCK + q] = -s[q]
            scatter(sums, mask, bars, 2, 0, first, m, x, 0, s, BLOCK)
            scatter(sums, mask, bars, 2, 1, first, m, x, 0, s, 0)


@inner_scalar
def linear_moments(stiffness, rest, offset, first, m, angle, value):
    """Moments of hinges of the linear law."""
    for q in range(m):
        e = first + q
        value[q] = stiffness[e] * (angle[q] + offset[4 * e] - rest[e])


@inner_scalar
def gives_way(share, first, m):
    """Whether any crease of a block has compliant panels."""
    soft = 0
    for q in range(m):
        soft += share[first + q] < 1.0
    return soft > 0


@inner_scalar
def enhanced_moments(
    code, address, stiffness, rest, p, share, offset, low, high, first, m, angle, value
):
    """Hinge moments of the enhanced linear law; creases between low and high are linear."""
    beyond = 0
    for q in range(m):
        e = first + q
        turn, middle = angle[q] + offset[4 * e], rest[e] + p[4 * e + 2]
        crease = share[e] * turn + (1.0 - share[e]) * middle
        beyond += (crease < low) | (crease > high)
        value[q] = stiffness[e] * (turn - rest[e] - p[4 * e + 2])
    if beyond > 0:
        for q in range(m):
            e = first + q
            turn, middle = angle[q] + offset[4 * e], rest[e] + p[4 * e + 2]
            crease = share[e] * turn + (1.0 - share[e]) * middle
            if (crease < low) | (crease > high):
                at = series_moment(
                    code, turn, rest[e], low, high, p[4 * e + 2], 0.0, share[e], address
                )
                value[q] = stiffness[e] * at


@inner_scalar
def superlinear_moments(stiffness, rest, first, m, angle, value):
    """Hinge moments of the superlinear law without panel compliance."""
    for q in range(m):
        e = first + q
        value[q] = stiffness[e] * superlinear.moment(angle[q] - rest[e])


@inner
def hinge_moments(code, address, stiffness, rest, p, share, offset, first, m, angle, value):
    """Moment (N m) of the m hinges of a block with dihedrals `angle`, all of one law."""
    for q in range(m):
        e = first + q
        value[q] = stiffness[e] * series_moment(
            code, angle[q] + offset[4 * e], rest[e],
            p[4 * e], p[4 * e + 1], p[4 * e + 2], p[4 * e + 3], share[e], address,
        )  # fmt: skip


@inner
def add_hinge_forces(model, low, high, scratch):
    """Add the forces of the hinges with lowest nodes from low to high to scratch.sums.

    Writes their dihedrals to scratch.angle.
    """
    x, g, value, mask = scratch.points, scratch.gradient, scratch.value, scratch.strips.mask
    position, sums, hinges = flat(scratch.position), flat(scratch.sums), flat(model.hinges)
    stiffness, rest, kept = model.hinge_stiffness, model.hinge_rest, scratch.angle
    p, angle = flat(model.hinge_parameters), g[12 * BLOCK :]
    share, offset = model.hinge_share, flat(model.hinge_offset)
    far = scratch.strips.lowest.shape[0] > 1
    for run in range(model.hinge_runs.shape[0]):
        code = model.hinge_runs[run, 2]
        address = model.addresses[model.hinge_runs[run, 3]]
        start, end = elements_of(hinges, 4, model.hinge_runs[run], low, high, model.rest.shape[0])
        for first in range(start, end, BLOCK):
            m = min(BLOCK, end - first)
            after = first + BLOCK
            for v in range(4):
                gather(position, mask, hinges, 4, v, first, m, x, 3 * v * BLOCK)
            if far:
                prefetch_range(hinges, 4 * after, 4 * BLOCK)
                prefetch_range(stiffness, after, BLOCK)
                prefetch_range(rest, after, BLOCK)
            for q in range(whole_lanes(m)):
                put_dihedral(x, q, g)
            for q in range(m):
                kept[first + q] = angle[q]
            if code == LINEAR:
                linear_moments(stiffness, rest, offset, first, m, angle, value)
            elif (code == superlinear.CODE) and not gives_way(share, first, m):
                superlinear_moments(stiffness, rest, first, m, angle, value)
            elif (code == STRESS_FREE) | (code == AS_PUBLISHED):  # theta1, theta2 hold for the run
                enhanced_moments(
                    code, address, stiffness, rest, p, share, offset,
                    p[4 * start], p[4 * start + 1], first, m, angle, value,
                )  # fmt: skip
            else:
                hinge_moments(
                    code, address, stiffness, rest, p, share, offset, first, m, angle, value
                )
            for v in range(4):
                scatter(sums, mask, hinges, 4, v, first, m, g, 3 * v * BLOCK, value, 0)


@inner_scalar
def place(at_rest, u, scratch, start, end):
    """Put the nodes start to end, flat rows of three, into the buffers with rows of four."""
    mask, last = np.uint32(scratch.strips.mask), at_rest.size // 3 - 1
    position, displacement = flat(scratch.position), flat(scratch.displacement)
    sums = flat(scratch.sums)
    for i in range(start, min(end, last)):
        node = np.uint32(i)  # unsigned: no wraparound test
        at, row = 3 * node, 4 * (node & mask)
        # the fourth number belongs to the next node and is unused: four make a vector
        a, b, c, d = u[at], u[at + 1], u[at + 2], u[at + 3]
        e, f, g, h = at_rest[at], at_rest[at + 1], at_rest[at + 2], at_rest[at + 3]
        displacement[row], displacement[row + 1] = a, b
        displacement[row + 2], displacement[row + 3] = c, d
        position[row], position[row + 1] = a + e, b + f
        position[row + 2], position[row + 3] = c + g, d + h
        sums[row], sums[row + 1], sums[row + 2], sums[row + 3] = 0.0, 0.0, 0.0, 0.0
    if start <= last < end:
        row = 4 * (np.uint32(last) & mask)
        for c in range(3):
            displacement[row + c], sums[row + c] = u[3 * last + c], 0.0
            position[row + c] = at_rest[3 * last + c] + u[3 * last + c]


@inner_scalar
def finish(force, scratch, start, end):
    """Copy the sums of the nodes start to end from the buffer to flat rows of three."""
    mask, sums = np.uint32(scratch.strips.mask), flat(scratch.sums)
    for i in range(start, end - 1):
        node = np.uint32(i)
        at, row = 3 * node, 4 * (node & mask)
        # the next node's first number overwrites the fourth
        a, b, c, d = sums[row], sums[row + 1], sums[row + 2], sums[row + 3]
        force[at], force[at + 1], force[at + 2], force[at + 3] = a, b, c, d
    for i in range(max(start, end - 1), end):
        for c in range(3):
            force[3 * i + c] = sums[4 * (i & scratch.strips.mask) + c]


@inner_scalar
def finish_edge(force, scratch, start, end):
    """Add the sums of the nodes start to end to the sums of an edge strip."""
    mask, sums = scratch.strips.mask, flat(scratch.sums)
    for i in range(start, end):
        for c in range(3):
            force[3 * i + c] += sums[4 * (i & mask) + c]


@inlined
def strip_force(model, s, u, force, scratch):
    """Force (n, 3) on the nodes scratch.strips.finished[s], for each strip s in turn.

    Members of a team must `wait` for each other before strip scratch.strips.edge.
    """
    plan = scratch.strips
    place(flat(model.rest), flat(u), scratch, plan.fresh[s, 0], plan.fresh[s, 1])
    add_bar_forces(model, plan.lowest[s, 0], plan.lowest[s, 1], scratch)
    add_hinge_forces(model, plan.lowest[s, 0], plan.lowest[s, 1], scratch)
    if plan.adds[s]:
        finish_edge(flat(force), scratch, plan.finished[s, 0], plan.finished[s, 1])
    else:
        finish(flat(force), scratch, plan.finished[s, 0], plan.finished[s, 1])


@inlined
def internal_force(model, u, force, scratch):
    """Internal force (n, 3), N, at displacement u (n, 3), m; dihedrals go to scratch.angle.

    A team member computes the force on its own nodes, scratch.strips.own; u must be complete before
    any member starts, and a member may change u on its own nodes once it is done.
    """
    for s in range(scratch.strips.lowest.shape[0]):
        if s == scratch.strips.edge:
            wait(scratch.team)
        strip_force(model, s, u, force, scratch)
