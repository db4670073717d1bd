"""Viscous panels, which resist strain rates in proportion to their stiffness.

With E the strains of a panel's bars, and S their coupling matrix (`mechanics.membranes`), the
stresses are C dE/dt, C = beta S. They dissipate the power dE/dt' C dE/dt, which is zero if a panel
only turns or folds.

All panels have the same array sizes: panels with fewer nodes or bars are padded with their first
node, and with bars of length^-2 = 0, which have no strain.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.term import FORCES, CompiledTerm, Term, forces, nodal

SCRATCH = ("along", "rate")  # scratch arrays of `ViscousPanels`


class ViscousPanels(NamedTuple):
    """Arrays of p panels with up to c nodes and b bars."""

    nodes: NDArray  # (p, c) rows
    ends: NDArray  # (p, b, 2) indices among a panel's nodes
    vector: NDArray  # (p, b, 3) rest vector from the first end to the second, m
    per_length2: NDArray  # (p, b) 1 / L^2
    resistance: NDArray  # (p, b, b) C, J s
    along: NDArray  # (b, 3) scratch of one panel: vectors of its bars, m
    rate: NDArray  # (b,) strain rates, 1/s


def viscous_panels(kinds: Sequence[Membranes], beta: float) -> ViscousPanels:
    """Viscous panels with the damping beta (s) times the stiffness of membranes."""
    corners = max((own.nodes.shape[1] for own in kinds), default=0)
    bars = max((len(own.ends) for own in kinds), default=0)
    count = sum(len(own.nodes) for own in kinds)
    out = ViscousPanels(
        np.zeros((count, corners), np.int64), np.zeros((count, bars, 2), np.int64),
        np.zeros((count, bars, 3)), np.zeros((count, bars)), np.zeros((count, bars, bars)),
        np.zeros((bars, 3)), np.zeros(bars),
    )  # fmt: skip
    end = 0
    for own in kinds:
        b, start, end = len(own.ends), end, end + len(own.nodes)
        out.nodes[start:end] = own.nodes[:, :1]
        out.nodes[start:end, : own.nodes.shape[1]] = own.nodes
        out.ends[start:end, :b] = own.ends
        out.vector[start:end, :b] = own.vector.transpose(2, 0, 1)
        out.per_length2[start:end, :b] = own.per_length2.T
        out.resistance[start:end, :b, :b] = beta * own.stiffness.transpose(2, 0, 1)
    return out


@inner_scalar
def _vectors(panels, p, u):
    """Vectors (m) of the bars of panel p at displacements u (rows, 3), to `along`."""
    for i in range(panels.rate.size):
        a = panels.nodes[p, panels.ends[p, i, 0]]
        b = panels.nodes[p, panels.ends[p, i, 1]]
        for c in range(3):
            panels.along[i, c] = panels.vector[p, i, c] + u[b, c] - u[a, c]


class _Context(NamedTuple):
    panels: ViscousPanels
    rows: int


@forces
def _forces(own, u, v, t, force, powers):
    panels, bars, power = own.panels, own.panels.rate.size, 0.0
    moved, speed, out = rows_at(u, own.rows), rows_at(v, own.rows), rows_at(force, own.rows)
    for p in range(panels.nodes.shape[0]):
        _vectors(panels, p, moved)
        for i in range(bars):
            a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
            rate = 0.0
            for c in range(3):
                rate += panels.along[i, c] * (speed[b, c] - speed[a, c])
            panels.rate[i] = panels.per_length2[p, i] * rate
        for i in range(bars):
            a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
            stress = 0.0
            for j in range(bars):
                stress += panels.resistance[p, i, j] * panels.rate[j]
            power += stress * panels.rate[i]
            for c in range(3):
                pull = stress * panels.per_length2[p, i] * panels.along[i, c]
                out[b, c] += pull
                out[a, c] -= pull
    numbers_at(powers, 2)[1] += power


class _Backward(NamedTuple):
    panels: ViscousPanels
    out: ViscousPanels  # gradients
    growth: (
        NDArray  # (2, b) length times length rate of a panel's bars, for weights and for velocities
    )
    stress: NDArray  # (2, b) C^T times strain rates for weights; C times strain rates for motion
    rows: int  # number of rows up to the last node


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    panels, bars, by = own.panels, own.panels.rate.size, own.out
    moved, speed, weights = (
        rows_at(u, own.rows), rows_at(v, own.rows), rows_at(weight, own.rows)
    )  # fmt: skip
    out, by_speed = rows_at(product, own.rows), rows_at(rate, own.rows)
    growth, stress = own.growth, own.stress
    for p in range(panels.nodes.shape[0]):
        _vectors(panels, p, moved)
        for i in range(bars):
            a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
            growth[0, i], growth[1, i] = 0.0, 0.0
            stress[0, i], stress[1, i] = 0.0, 0.0
            for c in range(3):
                growth[0, i] += panels.along[i, c] * (weights[b, c] - weights[a, c])
                growth[1, i] += panels.along[i, c] * (speed[b, c] - speed[a, c])
        for i in range(bars):
            back = panels.per_length2[p, i] * growth[0, i]
            for j in range(bars):
                ahead = panels.per_length2[p, j] * growth[1, j]
                stress[0, j] += panels.resistance[p, i, j] * back
                stress[1, i] += panels.resistance[p, i, j] * ahead
                by.resistance[p, i, j] += back * ahead
        for i in range(bars):
            a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
            by.per_length2[p, i] += stress[1, i] * growth[0, i] + stress[0, i] * growth[1, i]
            ahead = panels.per_length2[p, i] * stress[1, i]
            back = panels.per_length2[p, i] * stress[0, i]
            for c in range(3):
                pull = ahead * (weights[b, c] - weights[a, c]) + back * (speed[b, c] - speed[a, c])
                by.vector[p, i, c] += pull
                out[b, c] += pull
                out[a, c] -= pull
                by_speed[b, c] += back * panels.along[i, c]
                by_speed[a, c] -= back * panels.along[i, c]


@kernel
def panel_blocks(panels, u):
    """Damping matrices (p, c, c, 3, 3) at u (rows, 3), N s/m."""
    bars, (count, corners) = panels.rate.size, panels.nodes.shape
    out = np.zeros((count, corners, corners, 3, 3))
    for p in range(panels.nodes.shape[0]):
        _vectors(panels, p, u)
        for i in range(bars):
            for j in range(bars):
                scale = panels.resistance[p, i, j]
                scale *= panels.per_length2[p, i] * panels.per_length2[p, j]
                for c in range(3):
                    for d in range(3):
                        entry = scale * panels.along[i, c] * panels.along[j, d]
                        for k in range(2):
                            for m in range(2):
                                a, b = panels.ends[p, i, k], panels.ends[p, j, m]
                                out[p, a, b, c, d] += entry if k == m else -entry
    return out


class ViscousPanelsTerm(Term):
    """Viscous panels; see `Term`."""

    damps = True

    def __init__(self, panels: ViscousPanels) -> None:
        self.panels = panels

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        own = Context(_Context(self.panels, int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.panels, *SCRATCH)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        out = zeros_for(self.panels, *SCRATCH)
        growth, stress = np.zeros((2, 2, len(self.panels.rate)))
        rows = 1 + int(self.panels.nodes.max(initial=0))
        own = Context(_Backward(self.panels, out, growth, stress, rows))
        return Pulled(own, _pullback, arrays_of(out, *SCRATCH).numbers)

    @cached_property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's damping entries; see `Term`."""
        return places_of(pairs_within(self.panels.nodes))

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Damping entries; panels have no hidden dofs. See `Term`."""
        return panel_blocks(self.panels, nodal(q)).ravel()

    def placed(self, order: NDArray, before: Any) -> ViscousPanelsTerm:
        """The term with nodes in memory order; see `Term`."""
        return ViscousPanelsTerm(self.panels._replace(nodes=ranks(order)[self.panels.nodes]))
