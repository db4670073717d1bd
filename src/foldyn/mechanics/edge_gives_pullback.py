"""Pullback of edge gives (`mechanics.pullback`).

With E the strains of a panel's bars, r their rates for nodal velocities equal to the weights, and h
the weights of the gives g,

    w . F = r^T A g + h^T A^T E + h^T K g.

Gives in balance have the same derivatives, with h = -K^-1 A^T r from their own change, as K is
symmetric.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import Addressed, inner
from foldyn.jit.context import Context, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.edge_gives import (
    NO_FACTOR,
    EdgeGives,
    Factor,
    add_strained,
    solve_factor,
    strain_panel,
    strained_gives,
)
from foldyn.mechanics.pullback import Pulled, pullback


class Gradient(NamedTuple):
    """Gradients with respect to arrays of `EdgeGives`."""

    vector: NDArray
    per_length2: NDArray
    across: NDArray
    stiffness: NDArray


class _Context(NamedTuple):
    gives: EdgeGives
    out: Gradient
    rows: int
    first: int  # dof of the first give
    memory: NDArray  # (3, g)
    factor: Factor


@inner
def pull_panel(gives, p, weight, g, h, out, product, by_g):
    """Add the derivatives for panel p, whose strains and vectors are in its scratch."""
    for i in range(gives.strain.size):
        a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
        excess, growth, stress, back = 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            rest, along = gives.vector[p, i, c], gives.along[i, c]
            excess += (along - rest) * (along + rest)
            growth += (weight[b, c] - weight[a, c]) * along
        rate = gives.per_length2[p, i] * growth
        for k in range(gives.number.shape[1]):
            n = gives.number[p, k]
            stress += gives.across[p, i, k] * g[n]
            back += gives.across[p, i, k] * h[n]
            by_g[n] += gives.across[p, i, k] * rate
            out.across[p, i, k] += rate * g[n] + gives.strain[i] * h[n]
        out.per_length2[p, i] += stress * growth + 0.5 * back * excess
        stress, back = stress * gives.per_length2[p, i], back * gives.per_length2[p, i]
        for c in range(3):
            rest, along = gives.vector[p, i, c], gives.along[i, c]
            by = stress * (weight[b, c] - weight[a, c]) + back * along
            out.vector[p, i, c] += by - back * rest
            product[b, c] += by
            product[a, c] -= by
    for k in range(gives.number.shape[1]):
        for j in range(gives.number.shape[1]):
            n, m = gives.number[p, k], gives.number[p, j]
            by_g[m] += gives.stiffness[p, k, j] * h[n]
            out.stiffness[p, k, j] += h[n] * g[m]


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    moved, weights, out = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    first, end = own.first, own.first + own.gives.count
    g, h, by_g = flat(moved)[first:end], flat(weights)[first:end], flat(out)[first:end]
    for p in range(own.gives.nodes.shape[0]):
        strain_panel(own.gives, moved, p)
        pull_panel(own.gives, p, weights, g, h, own.out, out, by_g)


@pullback
def _balanced_pullback(own, u, v, t, weight, product, rate):
    gives = own.gives
    moved, weights, out = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    g, h, none = own.memory
    strained_gives(gives, moved, g)
    h[:] = 0.0
    for p in range(gives.nodes.shape[0]):
        strain_panel(gives, moved, p)
        for i in range(gives.strain.size):  # their rates, in place of the strains
            a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
            growth = 0.0
            for c in range(3):
                growth += (weights[b, c] - weights[a, c]) * gives.along[i, c]
            gives.strain[i] = gives.per_length2[p, i] * growth
        add_strained(gives, p, 1.0, h)
    for k in range(g.size):
        g[k], h[k] = -g[k], -h[k]
    solve_factor(own.factor, g)
    solve_factor(own.factor, h)
    for p in range(gives.nodes.shape[0]):
        strain_panel(gives, moved, p)
        pull_panel(gives, p, weights, g, h, own.out, out, none)


def _pulled(kernel: Addressed, gives: EdgeGives, rows: int, first: int, factor: Factor) -> Pulled:
    out = Gradient(*(np.zeros_like(getattr(gives, name)) for name in Gradient._fields))
    own = _Context(gives, out, rows, first, np.zeros((3, gives.count)), factor)
    return Pulled(Context(own), kernel, out._asdict())


def gives_pulled(gives: EdgeGives, rows: int, first: int) -> Pulled:
    """Pullback of gives as dofs from `first` on."""
    return _pulled(_pullback, gives, rows, first, NO_FACTOR)


def balanced_pulled(gives: EdgeGives, rows: int) -> Pulled:
    """Pullback of gives in balance."""
    return _pulled(_balanced_pullback, gives, rows, 3 * rows, gives.factor())
