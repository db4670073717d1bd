"""Membranes: coupled bars that give a panel its in-plane stiffness between corners.

The strains of a panel are the strains of its b bars, E = (stretch^2 - 1)/2, quadratic in the
positions. Its energy is 1/2 E^T S E with a full matrix S (`structures.membranes`), which couples
all bars; independent bars would have a diagonal matrix. A panel that only turns, or folds along
bars, has no strain.

Edges that give way near their ends add k gives g (m) to E, by which their points slide along them:
hidden dofs, which do not turn with the sheet and have no mass.

A term has all panels of one kind: with equal numbers of nodes and gives, and bars between the same
nodes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.eights import eight, put
from foldyn.mechanics.lanes import WIDTH, add, increase, take


class Membranes(NamedTuple):
    """Arrays of p panels with c nodes, b bars and k gives each; e = b + k."""

    nodes: NDArray  # (p, c)
    ends: NDArray  # (b, 2) numbers among a panel's nodes
    gives: NDArray  # (p, k) their dofs; in a structure, their numbers
    vector: NDArray  # (b, 3, p) rest vector from the first end to the second, m
    per_length2: NDArray  # (b, p) 1 / L^2
    stiffness: NDArray  # (e, e, p) S; J, J/m beside a give, N/m of gives


class Packed(NamedTuple):
    """Panels packed for the force kernel: flat arrays of groups of eight panels, padded with 0."""

    count: int  # p
    corners: int  # c
    ends: NDArray  # (b, 2)
    nodes: NDArray  # rows (c, 8) of each group, uint32: signed would be tested for wraparound
    given: int  # k
    gives: NDArray  # rows (k, 8), uint32
    vector: NDArray  # rows (3 b, 8)
    per_length2: NDArray  # rows (b, 8)
    stiffness: NDArray  # rows (e (e + 1) / 2, 8), the lower half
    moved: NDArray  # (24 c,) memory of a group: displacements
    along: NDArray  # (24 b,) vectors of the bars
    strain: NDArray  # (8 e,)
    stress: NDArray  # (8 e,) S E
    force: NDArray  # (24 c,)


def packed(membranes: Membranes) -> Packed:
    """Panels packed for one thread, with work arrays."""
    count, corners = membranes.nodes.shape
    bars, given = len(membranes.ends), membranes.gives.shape[1]
    lower = np.tril_indices(bars + given)

    def groups(array: NDArray, kind: type = float) -> NDArray:
        """Groups of eight from rows (..., p)."""
        rows = array.reshape(math.prod(array.shape[:-1]), count)
        filled = np.zeros((len(rows), -(-count // WIDTH) * WIDTH), kind)
        filled[:, :count] = rows
        return filled.reshape(len(rows), filled.shape[1] // WIDTH, WIDTH).swapaxes(0, 1).ravel()

    return Packed(
        count, corners, membranes.ends, groups(membranes.nodes.T, np.uint32),
        given, groups(membranes.gives.T, np.uint32),
        groups(membranes.vector), groups(membranes.per_length2), groups(membranes.stiffness[lower]),
        *(
            np.zeros(rows * WIDTH)
            for rows in (3 * corners, 3 * bars, bars + given, bars + given, 3 * corners)
        ),
    )  # fmt: skip


def taken(membranes: Membranes, which: NDArray) -> Membranes:
    """Some of the panels, or all in another order."""
    return Membranes(
        membranes.nodes[which], membranes.ends, membranes.gives[which],
        *(np.ascontiguousarray(array[..., which]) for array in membranes[3:]),
    )  # fmt: skip


@inner_scalar
def strain_of(membranes, u, p, i, along):
    """Strain of bar i of panel p; puts the bar's vector (m) into `along` (3,)."""
    a = membranes.nodes[p, membranes.ends[i, 0]]
    b = membranes.nodes[p, membranes.ends[i, 1]]
    excess = 0.0
    for c in range(3):
        apart, rest = u[b, c] - u[a, c], membranes.vector[i, c, p]
        along[c] = rest + apart
        excess += apart * (2.0 * rest + apart)
    return 0.5 * membranes.per_length2[i, p] * excess


@inner_scalar
def _gather(own, first, values, out):
    """Put the values of the nodes (flat) of the group of eight panels from `first` on into out."""
    at = own.corners * first
    for v in range(own.corners):
        for q in range(min(WIDTH, own.count - first)):
            row = 3 * own.nodes[at + v * WIDTH + q]
            for c in range(3):
                out[(3 * v + c) * WIDTH + q] = values[row + c]


@inner_scalar
def _gather_gives(own, first, values, out):
    """Put the values of the gives of a group into out, after those of the bars."""
    at, bars = own.given * first, own.ends.shape[0]
    for k in range(own.given):
        for q in range(min(WIDTH, own.count - first)):
            out[(bars + k) * WIDTH + q] = values[own.gives[at + k * WIDTH + q]]


@inner_scalar
def _multiply(own, first, strain, stress):
    """stress = S strain in a group of panels, from the lower half of S."""
    count = own.ends.shape[0] + own.given
    row = (first // WIDTH) * (count * (count + 1) // 2) * WIDTH
    for i in range(count):
        one = eight(strain, i * WIDTH)
        total = 0.0 * one
        for j in range(i):
            stiffness = eight(own.stiffness, row)
            total = total + stiffness * eight(strain, j * WIDTH)
            increase(stress, j * WIDTH, stiffness * one)
            row += WIDTH
        put(stress, i * WIDTH, total + eight(own.stiffness, row) * one)
        row += WIDTH


@inner
def add_membrane_forces(own, u, low, high, force):
    """Add the forces of all panels on the nodes from low to high; u and force are flat."""
    bars = own.ends.shape[0]
    for first in range(0, own.count, WIDTH):
        _gather(own, first, u, own.moved)
        own.force[:] = 0.0
        at = bars * (first // WIDTH)
        for i in range(bars):
            x1, y1, z1 = take(own.moved, own.ends[i, 0])
            x2, y2, z2 = take(own.moved, own.ends[i, 1])
            vx, vy, vz = take(own.vector, at + i)
            dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
            excess = dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
            put(own.strain, i * WIDTH, 0.5 * eight(own.per_length2, (at + i) * WIDTH) * excess)
            put(own.along, 3 * i * WIDTH, vx + dx)
            put(own.along, (3 * i + 1) * WIDTH, vy + dy)
            put(own.along, (3 * i + 2) * WIDTH, vz + dz)
        _gather_gives(own, first, u, own.strain)
        _multiply(own, first, own.strain, own.stress)
        for i in range(bars):
            pull = eight(own.stress, i * WIDTH) * eight(own.per_length2, (at + i) * WIDTH)
            x, y, z = take(own.along, i)
            add(own.force, own.ends[i, 0], -pull * x, -pull * y, -pull * z)
            add(own.force, own.ends[i, 1], pull * x, pull * y, pull * z)
        at = own.corners * first
        for v in range(own.corners):
            for q in range(min(WIDTH, own.count - first)):
                node = own.nodes[at + v * WIDTH + q]
                if low <= node < high:
                    for c in range(3):
                        force[3 * node + c] += own.force[(3 * v + c) * WIDTH + q]
        at = own.given * first
        for k in range(own.given):
            for q in range(min(WIDTH, own.count - first)):
                dof = own.gives[at + k * WIDTH + q]
                if 3 * low <= dof < 3 * high:
                    force[dof] += own.stress[(bars + k) * WIDTH + q]


@kernel
def strains_toward(membranes, u0, u1):
    """Strains (b, p) at u1, linearized about u0.

    This leaves out the stretch of turning bars whose nodes move along straight lines, which is of
    second order; see `mechanics.step_tangent`.
    """
    count, bars = membranes.nodes.shape[0], membranes.ends.shape[0]
    out, along = np.empty((bars, count)), np.empty(3)
    for i in range(bars):
        for p in range(count):
            a = membranes.nodes[p, membranes.ends[i, 0]]
            b = membranes.nodes[p, membranes.ends[i, 1]]
            out[i, p] = strain_of(membranes, u0, p, i, along)
            for c in range(3):
                way = u1[b, c] - u1[a, c] - (u0[b, c] - u0[a, c])
                out[i, p] += membranes.per_length2[i, p] * along[c] * way
    return out


@kernel
def membrane_blocks(membranes, u0, u1, strain):
    """Tangent (p, c, c, 3, 3), N/m, of all panels at u0 = u1, with the stresses of strains (e, p).

    If u1 differs from u0, this is twice the derivative of the panels' mean forces with respect to
    u1.
    """
    count, bars = membranes.nodes.shape[1], membranes.ends.shape[0]
    out = np.zeros((membranes.nodes.shape[0], count, count, 3, 3))
    first, last = np.empty((bars, 3)), np.empty((bars, 3))
    rate, pulled = np.empty((bars, 2, 3)), np.empty((bars, count, 3))
    for p in range(out.shape[0]):
        pulled[:] = 0.0
        for i in range(bars):
            strain_of(membranes, u0, p, i, first[i])
            strain_of(membranes, u1, p, i, last[i])
            for c in range(3):
                middle = 0.5 * (first[i, c] + last[i, c])
                rate[i, 1, c] = membranes.per_length2[i, p] * middle
                rate[i, 0, c] = -rate[i, 1, c]
        for i in range(bars):
            pull = 0.0
            for j in range(strain.shape[0]):
                pull += membranes.stiffness[i, j, p] * strain[j, p]
            for j in range(bars):
                stiff = membranes.stiffness[i, j, p]
                for c in range(3):
                    along = stiff * membranes.per_length2[j, p] * last[j, c]
                    pulled[i, membranes.ends[j, 1], c] += along
                    pulled[i, membranes.ends[j, 0], c] -= along
            pull *= membranes.per_length2[i, p]
            for end in range(2):
                v, w = membranes.ends[i, end], membranes.ends[i, 1 - end]
                for c in range(3):
                    out[p, v, v, c, c] += pull
                    out[p, v, w, c, c] -= pull
                    for k in range(count):
                        for d in range(3):
                            out[p, v, k, c, d] += rate[i, end, c] * pulled[i, k, d]
    return out


def give_entries(membranes: Membranes, u0: NDArray, u1: NDArray) -> list[NDArray]:
    """Tangents (p, 3c, k), (p, k, 3c) and (p, k, k), N/m, between nodes and gives, and of gives.

    See `membrane_blocks`; the first has the forces of nodes, the second those of gives.
    """
    count, corners = membranes.nodes.shape
    bars, ends = len(membranes.ends), membranes.ends
    ways = np.zeros((bars, corners))  # -1 and 1 at the ends of the bars
    ways[np.arange(bars), ends[:, 0]], ways[np.arange(bars), ends[:, 1]] = -1.0, 1.0
    first, last = (
        membranes.vector + (u[membranes.nodes[:, ends[:, 1]]] - u[membranes.nodes[:, ends[:, 0]]])
        .transpose(1, 2, 0)
        for u in (u0, u1)
    )  # fmt: skip
    across = membranes.per_length2[:, None] * membranes.stiffness[:bars, bars:]
    pulls, slides = (
        np.einsum("bc,bxp,bkp->pcxk", ways, along, across).reshape(count, 3 * corners, -1)
        for along in (0.5 * (first + last), last)
    )
    return [pulls, slides.swapaxes(1, 2), membranes.stiffness[bars:, bars:].transpose(2, 0, 1)]


class Back(NamedTuple):
    """Work arrays of the pullback for a group of eight panels, and the gradients."""

    weight: NDArray  # (24 c,) of the nodes
    between: NDArray  # (24 b,) differences of the weights at the bars' ends
    excess: NDArray  # (8 b,) squared length minus squared rest length, m2
    growth: NDArray  # (8 b,) rate of `excess` for nodal velocities of half the weights
    rate: NDArray  # (8 e,) r, rates of the strains, and weights of the gives
    pulled: NDArray  # (8 e,) S r
    vector: NDArray  # (3 b, p') gradient, p' the panels with room for whole groups
    per_length2: NDArray  # (b, p')
    stiffness: NDArray  # (e e, p') of the lower half, which stands for both


def back(membranes: Membranes) -> Back:
    """Memory for panels."""
    count, corners = membranes.nodes.shape
    bars = len(membranes.ends)
    both = bars + membranes.gives.shape[1]
    # an odd number of groups: otherwise rows may compete for the same cache lines
    room = WIDTH * (-(-count // WIDTH) | 1)
    return Back(
        *(np.zeros(rows * WIDTH) for rows in (3 * corners, 3 * bars, bars, bars, both, both)),
        *(np.zeros((rows, room)) for rows in (3 * bars, bars, both * both)),
    )


@inner
def pull_membranes(own, back, u, weight, product):
    """Add the derivatives of weight . F = r^T S E to `product` and the gradients; all flat."""
    bars, room = own.ends.shape[0], back.vector.shape[1]
    both = bars + own.given
    for first in range(0, own.count, WIDTH):
        _gather(own, first, u, own.moved)
        _gather(own, first, weight, back.weight)
        own.force[:] = 0.0
        at = bars * (first // WIDTH)
        for i in range(bars):
            x1, y1, z1 = take(own.moved, own.ends[i, 0])
            x2, y2, z2 = take(own.moved, own.ends[i, 1])
            vx, vy, vz = take(own.vector, at + i)
            dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
            excess = dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
            put(back.excess, i * WIDTH, excess)
            put(own.strain, i * WIDTH, 0.5 * eight(own.per_length2, (at + i) * WIDTH) * excess)
            x1, y1, z1 = take(back.weight, own.ends[i, 0])
            x2, y2, z2 = take(back.weight, own.ends[i, 1])
            wx, wy, wz = x2 - x1, y2 - y1, z2 - z1
            growth = wx * (vx + dx) + wy * (vy + dy) + wz * (vz + dz)
            put(back.growth, i * WIDTH, growth)
            put(back.rate, i * WIDTH, eight(own.per_length2, (at + i) * WIDTH) * growth)
            row = 3 * i * WIDTH
            put(own.along, row, dx)
            put(own.along, row + WIDTH, dy)
            put(own.along, row + 2 * WIDTH, dz)
            put(back.between, row, wx)
            put(back.between, row + WIDTH, wy)
            put(back.between, row + 2 * WIDTH, wz)
        _gather_gives(own, first, u, own.strain)
        _gather_gives(own, first, weight, back.rate)
        _multiply(own, first, own.strain, own.stress)
        _multiply(own, first, back.rate, back.pulled)
        for i in range(both):
            rate, strain = eight(back.rate, i * WIDTH), eight(own.strain, i * WIDTH)
            increase(back.stiffness, (i * both + i) * room + first, rate * strain)
            for j in range(i):
                by = rate * eight(own.strain, j * WIDTH) + strain * eight(back.rate, j * WIDTH)
                increase(back.stiffness, (i * both + j) * room + first, by)
        for i in range(bars):
            per_length2 = eight(own.per_length2, (at + i) * WIDTH)
            stress, pulled = eight(own.stress, i * WIDTH), eight(back.pulled, i * WIDTH)
            growth, excess = eight(back.growth, i * WIDTH), eight(back.excess, i * WIDTH)
            increase(back.per_length2, i * room + first, stress * growth + 0.5 * pulled * excess)
            stress, pulled = stress * per_length2, pulled * per_length2
            one, other = own.ends[i, 0], own.ends[i, 1]
            for c in range(3):
                by = stress * eight(back.between, (3 * i + c) * WIDTH)
                by = by + pulled * eight(own.along, (3 * i + c) * WIDTH)
                increase(back.vector, (3 * i + c) * room + first, by)
                by = by + pulled * eight(own.vector, (3 * (at + i) + c) * WIDTH)
                increase(own.force, (3 * other + c) * WIDTH, by)
                increase(own.force, (3 * one + c) * WIDTH, -by)
        at = own.corners * first
        for v in range(own.corners):
            for q in range(min(WIDTH, own.count - first)):
                row = 3 * own.nodes[at + v * WIDTH + q]
                for c in range(3):
                    product[row + c] += own.force[(3 * v + c) * WIDTH + q]
        at = own.given * first
        for k in range(own.given):
            for q in range(min(WIDTH, own.count - first)):
                product[own.gives[at + k * WIDTH + q]] += back.pulled[(bars + k) * WIDTH + q]
