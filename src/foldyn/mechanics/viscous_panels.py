"""Viscous panels: panels whose strain rates are resisted as their strains are.

With E the strains of a panel's bars, and S what couples them (`mechanics.membranes`), the stresses
are C dE/dt, C = beta S. They take the power dE/dt' C dE/dt, none where a panel turns or folds.

All panels are of one kind here: those with fewer nodes or bars are filled up with their first node,
and with bars of no length^-2, which feel nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.mechanics.membranes import Membranes


class ViscousPanels(NamedTuple):
    """Arrays of p panels with up to c nodes and b bars."""

    nodes: NDArray  # (p, c) rows
    ends: NDArray  # (p, b, 2) numbers among a panel's nodes
    vector: NDArray  # (p, b, 3) rest vector from the first end to the second, m
    per_length2: NDArray  # (p, b) 1 / L^2
    resistance: NDArray  # (p, b, b) C, J s
    along: NDArray  # (b, 3) memory of one panel: vectors of its bars, m
    rate: NDArray  # (b,) of their strains, 1/s


def viscous_panels(kinds: Sequence[Membranes], beta: float) -> ViscousPanels:
    """Those of panels with membranes, whose strain rates beta (s) times their stiffness resists."""
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


@inner_scalar
def _rate(panels, p, i, v):
    """Rate (1/s) of the strain of its bar i at velocities v (rows, 3)."""
    a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
    rate = 0.0
    for c in range(3):
        rate += panels.along[i, c] * (v[b, c] - v[a, c])
    return panels.per_length2[p, i] * rate


@inner_scalar
def _rates(panels, p, u, v):
    """Those of all its bars to `rate`, and their vectors at u to `along`."""
    _vectors(panels, p, u)
    for i in range(panels.rate.size):
        panels.rate[i] = _rate(panels, p, i, v)


@inner_scalar
def _stress(panels, p, i):
    """Stress (J) of its bar i at the rates of all."""
    stress = 0.0
    for j in range(panels.rate.size):
        stress += panels.resistance[p, i, j] * panels.rate[j]
    return stress


@kernel
def add_viscous_panels(panels, u, v, force):
    """Add their forces at u and v to `force`, all (rows, 3); returns the power taken, W."""
    power, bars = 0.0, panels.rate.size
    for p in range(panels.nodes.shape[0]):
        _rates(panels, p, u, v)
        for i in range(bars):
            stress = _stress(panels, p, i)
            power += stress * panels.rate[i]
            a, b = panels.nodes[p, panels.ends[p, i, 0]], panels.nodes[p, panels.ends[p, i, 1]]
            for c in range(3):
                pull = stress * panels.per_length2[p, i] * panels.along[i, c]
                force[b, c] += pull
                force[a, c] -= pull
    return power


@kernel
def viscous_panels_work(panels, u, v, shift):
    """Work (J) of their forces at u and v along a shift, all (rows, 3)."""
    work, bars = 0.0, panels.rate.size
    for p in range(panels.nodes.shape[0]):
        _rates(panels, p, u, v)
        for i in range(bars):
            work += _stress(panels, p, i) * _rate(panels, p, i, shift)
    return work


@kernel
def panel_blocks(panels, u):
    """Their matrices (p, c, c, 3, 3) at u (rows, 3), N s/m."""
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
