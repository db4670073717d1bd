"""Slopes of Bloch frequencies over the phases, by the Hellmann-Feynman theorem.

For waves with phi^H M phi = 1, d lambda = phi^H (dK - lambda dM) phi; constraints G(k) phi = 0 add
the work of their forces in dG phi. Waves of equal frequency are combined so that this matrix is
diagonal along a direction: these combinations continue along it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.linear.bloch import Bloch

DEGENERATE = 1e-10  # of the largest eigenvalue: closer ones count as equal


class Waves(NamedTuple):
    """Waves of one phase.

    Attributes
    ----------
    values : (k,)
        Eigenvalues, rad2/s2.
    shapes, momentum : (n, k)
        Motions phi of all dofs of a cell, phi^H M phi = 1, and M phi.
    """

    values: NDArray
    shapes: NDArray
    momentum: NDArray

    def ordered(self, order: NDArray) -> Waves:
        """The waves in another order."""
        return Waves(self.values[order], self.shapes[:, order], self.momentum[:, order])


def slopes_of(bloch: Bloch, phase: NDArray, waves: Waves) -> NDArray[np.float64]:
    """d omega/d k (k, d), rad/s per rad, of waves by the Hellmann-Feynman theorem.

    d lambda = phi^H (dK - lambda dM) phi, plus the forces of constraints that change with the
    phase. Waves of equal frequency are combined as they continue along each period. nan if the
    frequency is zero, where bands have corners.
    """
    values = waves.values
    out = np.empty((len(values), bloch.steps.shape[1]))
    with np.errstate(divide="ignore", invalid="ignore"):
        per_omega = np.where(values > 0.0, 0.5 / np.sqrt(values), np.nan)
    for period in range(out.shape[1]):
        change = eigenvalue_slopes(bloch, phase, waves, np.eye(out.shape[1])[period])
        for group in degenerate(values):
            own = change[np.ix_(group, group)]
            out[group, period] = np.linalg.eigvalsh(own) if len(group) > 1 else own[0, 0].real
    return out * per_omega[:, None]


def eigenvalue_slopes(
    bloch: Bloch, phase: NDArray, waves: Waves, way: NDArray
) -> NDArray[np.complex128]:
    """phi^H (dK - lambda dM) phi, (k, k), along a direction (d,) of the phases."""
    values, shapes, momentum = waves
    slope = np.sum([part * bloch.slopes(phase, j) for j, part in enumerate(way)], axis=0)
    mean = 0.5 * (values[:, None] + values)
    change = shapes.conj().T @ (bloch.stiffness.sparse_at(slope) @ shapes)
    change = change - mean * (shapes.conj().T @ (bloch.mass.sparse_at(slope) @ shapes))
    if not bloch.ties.empty:
        factors = bloch.factors(phase)
        free = ~bloch.held & ~bloch.hidden
        force = bloch.stiffness.sparse_at(factors) @ shapes
        force = force - momentum * values
        rows = bloch.ties.at(factors)[:, free]
        push = -np.linalg.lstsq(rows.conj().T, force[free], rcond=None)[0]
        turning = push.conj().T @ (bloch.ties.sparse_at(slope) @ shapes)
        change = change + turning + turning.conj().T
    return 0.5 * (change + change.conj().T)


def degenerate(values: NDArray) -> list[list[int]]:
    """Indices of eigenvalues in groups equal to round-off, increasing in each."""
    order = np.argsort(values, kind="stable")
    near = DEGENERATE * np.abs(values).max(initial=0.0)
    gaps = np.flatnonzero(np.diff(values[order]) > near) + 1
    return [sorted(group.tolist()) for group in np.split(order, gaps)]


def separated(bloch: Bloch, phase: NDArray, waves: Waves, way: NDArray) -> Waves:
    """The waves, with equal frequencies combined as they continue along a direction (d,)."""
    groups = [group for group in degenerate(waves.values) if len(group) > 1]
    if not groups or not way.any():
        return waves
    change = eigenvalue_slopes(bloch, phase, waves, way)
    turn = np.eye(len(waves.values), dtype=complex)
    for group in groups:
        turn[np.ix_(group, group)] = np.linalg.eigh(change[np.ix_(group, group)])[1]
    return Waves(waves.values, waves.shapes @ turn, waves.momentum @ turn)
