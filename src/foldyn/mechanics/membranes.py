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
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.mechanics.lanes import WIDTH, add, increase, place, take


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
    moved: NDArray  # (24 c,) memory of a group: values of the nodes
    force: NDArray  # (24 c,)
    apart: NDArray  # (24 b,) differences of displacements at the ends of the bars
    strain: NDArray  # (8 e,)
    stress: NDArray  # (8 e,) S E
    other_apart: NDArray  # the same of another state, of velocities or of weights
    other_strain: NDArray
    other_stress: NDArray


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
            for rows in (3 * corners, 3 * corners, *(3 * bars, bars + given, bars + given) * 2)
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
def _put_differences(own, first, values, apart, strain):
    """Put what the group of eight panels from `first` on has of values (flat) of dofs.

    These are the differences between the ends of bars, into `apart`, and the values of the gives,
    into `strain` after the strains of the bars.
    """
    at, bars = own.corners * first, own.ends.shape[0]
    for v in range(own.corners):
        for q in range(min(WIDTH, own.count - first)):
            row = 3 * own.nodes[at + v * WIDTH + q]
            for c in range(3):
                own.moved[(3 * v + c) * WIDTH + q] = values[row + c]
    for i in range(bars):
        x1, y1, z1 = take(own.moved, own.ends[i, 0])
        x2, y2, z2 = take(own.moved, own.ends[i, 1])
        place(apart, i, x2 - x1, y2 - y1, z2 - z1)
    at = own.given * first
    for k in range(own.given):
        for q in range(min(WIDTH, own.count - first)):
            strain[(bars + k) * WIDTH + q] = values[own.gives[at + k * WIDTH + q]]


@inner_scalar
def put_strains(own, first, u, apart, strain):
    """Put the strains of a group at displacements u (flat), and their gives, into `strain`."""
    _put_differences(own, first, u, apart, strain)
    at = own.ends.shape[0] * (first // WIDTH)
    for i in range(own.ends.shape[0]):
        excess = _excess(take(own.vector, at + i), take(apart, i))
        put(strain, i * WIDTH, 0.5 * eight(own.per_length2, (at + i) * WIDTH) * excess)


@inner_scalar
def put_rates(own, first, v, apart, strain):
    """Put the rates of the strains for velocities v (flat), at own.apart; see `put_strains`."""
    _put_differences(own, first, v, apart, strain)
    at = own.ends.shape[0] * (first // WIDTH)
    for i in range(own.ends.shape[0]):
        half = growth(take(own.vector, at + i), take(own.apart, i), take(apart, i))
        put(strain, i * WIDTH, eight(own.per_length2, (at + i) * WIDTH) * half)


@inner_scalar
def _excess(v, d):
    """Squared length minus squared rest length of the vector v + d, without cancellation."""
    (vx, vy, vz), (dx, dy, dz) = v, d
    return dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)


@inner_scalar
def growth(v, d, w):
    """Half the rate of this for rates w of d."""
    (vx, vy, vz), (dx, dy, dz), (wx, wy, wz) = v, d, w
    return wx * (vx + dx) + wy * (vy + dy) + wz * (vz + dz)


@inner_scalar
def multiply(own, first, strain, stress):
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
def add_pulls(own, first, apart, low, high, force):
    """Add the forces (flat) of own.stress in a group on the nodes from low to high, and on gives.

    apart : differences of displacements, as `put_strains` puts them.
    """
    bars, at = own.ends.shape[0], own.ends.shape[0] * (first // WIDTH)
    own.force[:] = 0.0
    for i in range(bars):
        (vx, vy, vz), (dx, dy, dz) = take(own.vector, at + i), take(apart, i)
        pull = eight(own.stress, i * WIDTH) * eight(own.per_length2, (at + i) * WIDTH)
        along = pull * (vx + dx), pull * (vy + dy), pull * (vz + dz)
        pull_apart(own.force, own.ends, i, along)
    scatter(own, first, own.force, own.stress, low, high, force)


@inner_scalar
def pull_apart(force, ends, i, pull):
    """Add a force at the second end of bar i, and the opposite one at its first end."""
    x, y, z = pull
    add(force, ends[i, 0], -x, -y, -z)
    add(force, ends[i, 1], x, y, z)


@inner_scalar
def scatter(own, first, force, stress, low, high, out):
    """Add the forces of a group on the nodes from low to high, and on gives, to `out` (flat)."""
    at = own.corners * first
    for v in range(own.corners):
        for q in range(min(WIDTH, own.count - first)):
            node = own.nodes[at + v * WIDTH + q]
            if low <= node < high:
                for c in range(3):
                    out[3 * node + c] += force[(3 * v + c) * WIDTH + q]
    at, bars = own.given * first, own.ends.shape[0]
    for k in range(own.given):
        for q in range(min(WIDTH, own.count - first)):
            dof = own.gives[at + k * WIDTH + q]
            if 3 * low <= dof < 3 * high:
                out[dof] += stress[(bars + k) * WIDTH + q]


@inner_scalar
def work_of(own):
    """Sum of the strains of a group times their stresses."""
    total = 0.0
    for k in range(own.strain.size):
        total += own.strain[k] * own.stress[k]
    return total


@inner
def add_membrane_forces(own, u, low, high, force):
    """Add the forces of all panels on the nodes from low to high; u and force are flat."""
    for first in range(0, own.count, WIDTH):
        put_strains(own, first, u, own.apart, own.strain)
        multiply(own, first, own.strain, own.stress)
        add_pulls(own, first, own.apart, low, high, force)


def strain_places(membranes: Membranes) -> tuple[NDArray, NDArray]:
    """Rows and columns (k,) of the entries of `membrane_blocks`."""
    nodal = (3 * membranes.nodes[:, :, None] + np.arange(3)).reshape(len(membranes.nodes), -1)
    row, column = pairs_within(np.concatenate([nodal, membranes.gives], axis=1)).T
    return row, column


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
    """Tangent (p, m, m), N/m, of all panels at u0 = u1, with the stresses of strains (e, p).

    The m dofs of a panel are those of its nodes, then its gives. If u1 differs from u0, this is
    twice the derivative of the panels' mean forces with respect to u1.
    """
    bars, given = membranes.ends.shape[0], membranes.gives.shape[1]
    nodal = 3 * membranes.nodes.shape[1]
    size = nodal + given
    out = np.zeros((membranes.nodes.shape[0], size, size))
    first, last = np.empty((bars, 3)), np.empty((bars, 3))
    pulled = np.empty((bars + given, size))  # rates of the stresses
    for p in range(out.shape[0]):
        pulled[:] = 0.0
        for j in range(bars):
            strain_of(membranes, u0, p, j, first[j])
            strain_of(membranes, u1, p, j, last[j])
            one, other = 3 * membranes.ends[j, 0], 3 * membranes.ends[j, 1]
            for i in range(bars + given):
                stiff = membranes.stiffness[i, j, p] * membranes.per_length2[j, p]
                for c in range(3):
                    pulled[i, other + c] += stiff * last[j, c]
                    pulled[i, one + c] -= stiff * last[j, c]
        for i in range(bars + given):
            for k in range(given):
                pulled[i, nodal + k] = membranes.stiffness[i, bars + k, p]
        for i in range(bars):
            pull = 0.0
            for j in range(strain.shape[0]):
                pull += membranes.stiffness[i, j, p] * strain[j, p]
            pull *= membranes.per_length2[i, p]
            for c in range(3):
                one, other = 3 * membranes.ends[i, 0] + c, 3 * membranes.ends[i, 1] + c
                out[p, one, one] += pull
                out[p, other, other] += pull
                out[p, one, other] -= pull
                out[p, other, one] -= pull
                rate = 0.5 * membranes.per_length2[i, p] * (first[i, c] + last[i, c])
                for d in range(size):
                    out[p, other, d] += rate * pulled[i, d]
                    out[p, one, d] -= rate * pulled[i, d]
        for k in range(given):
            for d in range(size):
                out[p, nodal + k, d] = pulled[bars + k, d]
    return out


class Back(NamedTuple):
    """Gradients that pullbacks add to; p' are the panels with room for whole groups."""

    vector: NDArray  # (3 b, p')
    per_length2: NDArray  # (b, p')
    stiffness: NDArray  # (e e, p') of the lower half, which stands for both

    def of(self, membranes: Membranes) -> dict[str, NDArray]:
        """The gradients with the shapes of the arrays of panels, by name."""
        count, fields = len(membranes.nodes), self._asdict().items()
        shapes = {name: getattr(membranes, name).shape[:-1] for name, _ in fields}
        return {name: rows.reshape(*shapes[name], -1)[..., :count] for name, rows in fields}


def back(membranes: Membranes) -> Back:
    """Gradients of zeros."""
    count, bars = len(membranes.nodes), len(membranes.ends)
    # an odd number of groups: otherwise rows may compete for the same cache lines
    room = WIDTH * (-(-count // WIDTH) | 1)
    sizes = 3 * bars, bars, len(membranes.stiffness) ** 2
    return Back(*(np.zeros((rows, room)) for rows in sizes))


@inner_scalar
def combined(a, x, b, y):
    """The vector a x + b y."""
    return a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]


@inner_scalar
def pull_stiffness(own, back, first):
    """Multiply strains E and other strains r by S; add the derivatives of r^T S E by S."""
    size, room = own.ends.shape[0] + own.given, back.vector.shape[1]
    multiply(own, first, own.strain, own.stress)
    multiply(own, first, own.other_strain, own.other_stress)
    for i in range(size):
        rate, strain = eight(own.other_strain, i * WIDTH), eight(own.strain, i * WIDTH)
        increase(back.stiffness, (i * size + i) * room + first, rate * strain)
        for j in range(i):
            by = rate * eight(own.strain, j * WIDTH) + strain * eight(own.other_strain, j * WIDTH)
            increase(back.stiffness, (i * size + j) * room + first, by)


@inner_scalar
def pull_vector(back, first, i, by):
    """Add derivatives by the vector of bar i."""
    room = back.vector.shape[1]
    at = 3 * i * room + first
    increase(back.vector, at, by[0])
    increase(back.vector, at + room, by[1])
    increase(back.vector, at + 2 * room, by[2])


@inner
def pull_membranes(own, back, u, weight, high, product):
    """Add the derivatives of weight . F = r^T S E to `product` and the gradients; all flat.

    r : rates of the strains for velocities `weight`.
    high : number of rows.
    """
    for first in range(0, own.count, WIDTH):
        put_strains(own, first, u, own.apart, own.strain)
        put_rates(own, first, weight, own.other_apart, own.other_strain)
        pull_stiffness(own, back, first)
        own.force[:] = 0.0
        at = own.ends.shape[0] * (first // WIDTH)
        for i in range(own.ends.shape[0]):
            v, d, w = take(own.vector, at + i), take(own.apart, i), take(own.other_apart, i)
            stress, pulled = eight(own.stress, i * WIDTH), eight(own.other_stress, i * WIDTH)
            by = stress * growth(v, d, w) + 0.5 * pulled * _excess(v, d)
            increase(back.per_length2, i * back.per_length2.shape[1] + first, by)
            per_length2 = eight(own.per_length2, (at + i) * WIDTH)
            stress, pulled = stress * per_length2, pulled * per_length2
            by = combined(stress, w, pulled, d)
            pull_vector(back, first, i, by)
            pull_apart(own.force, own.ends, i, combined(pulled, v, 1.0, by))
        scatter(own, first, own.force, own.other_stress, 0, high, product)
