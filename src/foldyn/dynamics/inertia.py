"""The mass matrix inside compiled loops: M v and the solution of M a = r on free dofs.

A lumped matrix only needs divisions. A consistent matrix is factored once per distinct set of
supported nodes (axes with equal supports share the factors) and solved by sparse triangular
substitution. With constraints, v = Z v_free, the matrix Z' M Z of the free dofs of all axes is
factored, whether M is lumped or not, and a = Z (Z' M Z)^-1 Z' r.

For explicit methods the dofs beside those of nodes, such as edge angles, have an inertia of their
own (`dynamics.hidden_inertia`). For other methods they have none.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import factorize
from foldyn.dynamics.ties import Ties, follow_masters, hand_over, reduced
from foldyn.errors import InputError
from foldyn.jit.compiled import inner, inner_scalar, kernel, summing
from foldyn.jit.intrinsics import flat


class Inertia(NamedTuple):
    """Nodal mass matrix (CSR), with its inverse if it is diagonal, otherwise with its factors."""

    lumped: bool  # whether it is diagonal and there are no constraints
    diagonal: NDArray  # (n,) mass; with constraints, the least mass that the free dofs feel
    inverse: NDArray  # (n, 3) 1/m on free dofs, 0 on fixed ones; empty if not lumped
    indptr: NDArray
    indices: NDArray
    data: NDArray
    hidden: NDArray  # (rows - n, 3) inertia of the dofs after the nodes, kg; (0, 3) if massless
    ties: Ties
    factor_of_axis: NDArray  # (3,) index of the factor for each axis
    start: NDArray  # (factors + 1,) first row of each factor in the arrays below
    nodes: NDArray  # free nodes of each factor; with constraints, free dofs
    row_order: NDArray
    column_order: NDArray
    lower_ptr: NDArray  # strictly lower part of L, by columns
    lower_row: NDArray
    lower: NDArray
    upper_ptr: NDArray  # strictly upper part of U, by columns
    upper_row: NDArray
    upper: NDArray
    pivot: NDArray  # 1 / diagonal of U


def check_mass(mass: sparse.csr_array, fixed: NDArray) -> None:
    """Refuse free nodes without mass."""
    massless = np.flatnonzero((mass.diagonal() <= 0.0) & ~fixed.all(axis=1))
    if len(massless):
        shown = ", ".join(map(str, massless[:8])) + (", ..." if len(massless) > 8 else "")
        raise InputError(
            f"node {shown} is free but has no mass: fix it along x, y and z, attach a panel to "
            "it, or choose a mass rule that gives it mass"
        )


def is_lumped(mass: sparse.csr_array) -> bool:
    """Whether a mass matrix is diagonal."""
    return mass.count_nonzero() == np.count_nonzero(mass.diagonal())


def inertia(mass: sparse.csr_array, fixed: NDArray, ties: Ties, hidden: NDArray) -> Inertia:
    """Prepare the nodal mass matrix (n, n) for the supports `fixed` (n, 3).

    hidden : inertia of further dofs (h,), kg, which the last rows hold; (0,) if they have none.
    """
    rows = np.ones((-(-len(hidden) // 3), 3))  # padding has the inertia 1
    rows.ravel()[: len(hidden)] = hidden
    diagonal = mass.diagonal()
    lumped = is_lumped(mass) and not len(ties.slave)
    inverse, factor_of_axis, factors = np.zeros((0, 3)), np.zeros(3, np.int64), []
    if len(ties.slave):
        tied = reduced(sparse.kron(mass, sparse.eye_array(3), format="csr"), ties)
        least = np.full(len(diagonal), np.inf)
        np.minimum.at(least, ties.free // 3, tied.diagonal())
        diagonal = np.where(np.isfinite(least), least, diagonal)
        massless = sparse.diags_array((tied.diagonal() <= 0.0).astype(float))
        factors = [_factor(sparse.csr_array(tied + massless), ties.free)]
    elif lumped:
        inverse = np.where(fixed, 0.0, 1.0 / np.where(diagonal > 0.0, diagonal, 1.0)[:, None])
        inverse[len(inverse) - len(rows) :] = 1.0 / rows
    else:
        distinct, factor_of_axis = np.unique(fixed, axis=1, return_inverse=True)
        free = [np.flatnonzero(~held) for held in distinct.T]
        factors = [_factor(mass[nodes][:, nodes], nodes) for nodes in free]
    return Inertia(
        lumped, diagonal, inverse, mass.indptr.astype(np.int64), mass.indices.astype(np.int64),
        mass.data.astype(float), rows, ties, factor_of_axis.ravel(), *_join(factors),
    )  # fmt: skip


def lightness(mass: Inertia) -> NDArray:
    """Upper bound (n,) of the inverse mass of each node, 1/kg."""
    # a consistent matrix of triangles is at least half of its diagonal
    share = 1.0 if mass.lumped else 0.5
    own = share * mass.diagonal
    return np.divide(1.0, own, out=np.zeros_like(own), where=own > 0.0)


def _factor(mass: sparse.csr_array, nodes: NDArray) -> tuple:
    """Factors of the mass of `nodes`: free nodes, orders, L and U without diagonals, and pivots."""
    if not len(nodes):
        empty = sparse.csc_array((0, 0))
        return nodes, nodes, nodes, empty, empty, np.zeros(0)
    lu = factorize(sparse.csc_array(mass))
    lower = sparse.csc_array(sparse.tril(sparse.csc_array(lu.L), -1))
    upper = sparse.csc_array(lu.U)
    above = sparse.csc_array(sparse.triu(upper, 1))
    return nodes, lu.perm_r, lu.perm_c, lower, above, 1.0 / upper.diagonal()


def _join(factors: list[tuple]) -> tuple[NDArray, ...]:
    """Concatenate the arrays of all factors, with absolute column pointers."""

    def column(parts: Iterable[NDArray], kind: type) -> NDArray:
        return np.concatenate([np.zeros(0, kind), *parts]).astype(kind)

    parted = zip(*factors, strict=True) if factors else 6 * [()]
    nodes, rows, columns, lowers, uppers, pivots = parted
    joined = [column(parts, np.int64) for parts in (nodes, rows, columns)]
    for triangles in (lowers, uppers):
        # each factor ends with a closing pointer, so columns of factor k start at start[k] + k
        base = np.cumsum([0, *(m.nnz for m in triangles)])
        joined += [
            column((m.indptr + b for m, b in zip(triangles, base[:-1], strict=True)), np.int64),
            column((m.indices for m in triangles), np.int64),
            column((m.data for m in triangles), float),
        ]
    return (np.cumsum([0, *map(len, nodes)]), *joined, column(pivots, float))


@kernel
def times_mass(m, v, out):
    """out = M v, both (n, 3)."""
    for i in range(v.shape[0]):
        for c in range(3):
            out[i, c] = 0.0
        for p in range(m.indptr[i], m.indptr[i + 1]):
            j, value = m.indices[p], m.data[p]
            for c in range(3):
                out[i, c] += value * v[j, c]
    first = v.shape[0] - m.hidden.shape[0]
    for i in range(m.hidden.shape[0]):
        for c in range(3):
            out[first + i, c] = m.hidden[i, c] * v[first + i, c]


@kernel
def substitute(m, r, a, scratch):
    """Solve M a = r with the factors of a consistent matrix; a is zero on fixed dofs.

    scratch holds n numbers; 3 n with constraints.
    """
    if m.ties.slave.size > 0:
        solve_tied(m, flat(r), flat(a), scratch)
    else:
        solve_mass(m, r, a, scratch, 0, 1)


@inner_scalar
def _substitute(m, k, x):
    """Solve with factor k in place; on entry x has the order of rows, on return of columns."""
    first, offset = m.start[k], m.start[k] + k
    count = m.start[k + 1] - first
    for j in range(count):
        value = x[j]
        for p in range(m.lower_ptr[offset + j], m.lower_ptr[offset + j + 1]):
            x[m.lower_row[p]] -= m.lower[p] * value
    for j in range(count - 1, -1, -1):
        value = x[j] * m.pivot[first + j]
        x[j] = value
        for p in range(m.upper_ptr[offset + j], m.upper_ptr[offset + j + 1]):
            x[m.upper_row[p]] -= m.upper[p] * value


@inner
def solve_mass(m, r, a, scratch, member, members):
    """Solve without constraints; the threads of a team share the axes."""
    first = a.shape[0] - m.hidden.shape[0]
    for c in range(member, 3, members):
        for i in range(a.shape[0]):
            a[i, c] = 0.0
        k = m.factor_of_axis[c]
        for i in range(m.start[k], m.start[k + 1]):
            scratch[m.row_order[i]] = r[m.nodes[i], c]
        _substitute(m, k, scratch)
        for i in range(m.start[k], m.start[k + 1]):
            a[m.nodes[i], c] = scratch[m.column_order[i]]
        for i in range(m.hidden.shape[0]):
            a[first + i, c] = r[first + i, c] / m.hidden[i, c]


@inner
def solve_tied(m, r, a, scratch):
    """Solve with constraints; r, a (3n,)."""
    for i in range(a.size):
        a[i] = r[i]
    hand_over(m.ties, a)
    for i in range(m.nodes.size):
        scratch[m.row_order[i]] = a[m.nodes[i]]
    _substitute(m, 0, scratch)
    a[:] = 0.0
    for i in range(m.nodes.size):
        a[m.nodes[i]] = scratch[m.column_order[i]]
    follow_masters(m.ties, a)
    first, hidden = a.size - m.hidden.size, flat(m.hidden)
    for i in range(hidden.size):
        a[first + i] = r[first + i] / hidden[i]


@summing
def _lumped_sum(diagonal, v):
    total = 0.0
    for i in range(diagonal.size):
        total += diagonal[i] * (v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1] + v[i, 2] * v[i, 2])
    return total


@kernel
def moving_energy(mass, factor):
    """Kinetic energy (J) of support motion S f'; `mass` is `moved_mass`, `factor` is (h, 3)."""
    total = 0.0
    for k in range(mass.shape[0]):
        for l in range(mass.shape[0]):  # noqa: E741
            total += mass[k, l] * factor[k, 1] * factor[l, 1]
    return 0.5 * total


@inner_scalar
def _hidden_energy(m, v, own):
    """Kinetic energy (J) of dofs beside those of nodes."""
    first, total = v.shape[0] - m.hidden.shape[0], 0.0
    for i in range(max(own[0], first), own[1]):
        for c in range(3):
            total += m.hidden[i - first, c] * v[i, c] * v[i, c]
    return 0.5 * total


@inner_scalar
def lumped_energy(m, v, own):
    """Kinetic energy (J) for a diagonal matrix (n, n)."""
    nodal = 0.5 * _lumped_sum(m.diagonal[own[0] : own[1]], v[own[0] : own[1]])
    return nodal + _hidden_energy(m, v, own)


@inner_scalar
def kinetic_energy(m, v, own):
    """Kinetic energy v M v / 2 (J) of the rows own[0] to own[1] - 1; v (n, 3)."""
    if m.lumped:
        return lumped_energy(m, v, own)
    total = 0.0
    for i in range(own[0], own[1]):
        for c in range(3):
            product = 0.0
            for p in range(m.indptr[i], m.indptr[i + 1]):
                product += m.data[p] * v[m.indices[p], c]
            total += v[i, c] * product
    return 0.5 * total + _hidden_energy(m, v, own)
