"""The lowest Bloch waves at given phases, and how they continue from one phase to the next.

Small problems are solved with full matrices: hidden dofs are condensed, constraints are satisfied
by a basis of allowed motions. If the nodal mass is the same for all three axes, only its matrix for
one axis is factored. Large problems are solved by Lanczos iteration about a shift below zero.

Derivatives of the frequencies with respect to phases follow from the Hellmann-Feynman theorem: for
waves with phi^H M phi = 1, d lambda = phi^H (dK - lambda dM) phi; constraints G(k) phi = 0 add the
work of their forces in dG phi. Waves of equal frequency are combined so that the matrix of d lambda
is diagonal along a direction: these combinations continue along it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from foldyn.algebra.superlu import unsymmetric
from foldyn.errors import ComputationError, InputError
from foldyn.linear.bloch import Bloch, null_space
from foldyn.threads import in_threads

DENSE = 500  # dofs up to which a problem is solved with full matrices
GUARD = 3  # additional waves, so that none is missed if several coincide
EPS = float(np.finfo(float).eps)
ROUNDING = 1e-15  # eigenvalues below this, relative to |phi|' |K| |phi|, count as zero
NOISE = 30.0  # eigenvalues below this many rounding errors of the largest entries are zero, too
SHIFT = 1e-6  # shift below zero, relative to the scale of the matrices
DEGENERATE = 1e-10  # eigenvalues closer than this, relative to the largest, count as equal


class Waves(NamedTuple):
    """Waves with one phase.

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
        """The waves, put in the given order."""
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
    """Groups of indices of eigenvalues that are equal to round-off; increasing in each group."""
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


def tracked(bloch: Bloch, phases: NDArray, waves: Sequence[Waves]) -> list[Waves]:
    """Waves at phases (n, d), sorted so that their shapes continue.

    The waves of neighboring phases are paired so that the sum of their mass-weighted MAC is
    greatest; waves of equal frequency are first combined as they continue along the step between
    the phases. A band that is no longer among the lowest after a crossing with a higher band ends
    there.
    """
    from scipy.optimize import linear_sum_assignment

    out = [waves[0]]
    for k in range(1, len(waves)):
        way = phases[k] - phases[k - 1]
        before = separated(bloch, phases[k - 1], out[-1], way)
        here = separated(bloch, phases[k], waves[k], way)
        overlap = np.abs(before.shapes.conj().T @ here.momentum) ** 2
        out.append(here.ordered(linear_sum_assignment(overlap, maximize=True)[1]))
    return out


@dataclass(frozen=True, eq=False)
class WaveSolver:
    """Solver for the `count` lowest waves of a cell."""

    bloch: Bloch
    count: int

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """Dofs with mass that are not held."""
        return np.flatnonzero(~self.bloch.held & ~self.bloch.hidden)

    @cached_property
    def hidden(self) -> NDArray[np.int64]:
        """Dofs without mass."""
        return np.flatnonzero(self.bloch.hidden)

    def at(self, phases: NDArray) -> list[Waves]:
        """Waves at each phase (n, d), on all processors."""
        return in_threads(self.waves, phases)

    def waves(self, phase: NDArray) -> Waves:
        """Waves at a phase (d,)."""
        bloch = self.bloch
        if bloch.size > DENSE and bloch.ties.empty:
            return self._lanczos(phase)
        factors = bloch.factors(phase)
        whole, free, hidden = bloch.stiffness.at(factors), self.free, self.hidden
        stiffness, follow = whole[np.ix_(free, free)], np.zeros((0, len(free)))
        if len(hidden):
            across = whole[np.ix_(hidden, free)]
            follow = -linalg.solve(whole[np.ix_(hidden, hidden)], across, assume_a="her")
            stiffness = stiffness + across.conj().T @ follow
        values, motions, momentum, noise = self._lowest(stiffness, factors, phase)
        shapes = np.zeros((2, bloch.size, len(values)), complex)
        shapes[0, free], shapes[1, free] = motions, momentum
        if len(hidden):
            shapes[0, hidden] = follow @ motions
            noise = np.maximum(noise, _noise(whole, shapes[0]))
        return Waves(np.where(np.abs(values) <= noise, 0.0, values), shapes[0], shapes[1])

    def _lowest(
        self, stiffness: NDArray, factors: NDArray, phase: NDArray
    ) -> tuple[NDArray, NDArray, NDArray, NDArray | float]:
        """Eigenvalues (k,), motions and M phi (n, k) of the free dofs, and the zero threshold."""
        bloch, free = self.bloch, self.free
        wanted = {"subset_by_index": [0, self.count - 1], "check_finite": False}
        diagonal = np.real(np.diag(stiffness))
        if bloch.ties.empty and bloch.lumped is not None:
            check_count(self.count, len(free), phase)
            mass = bloch.lumped[free]
            root = 1.0 / np.sqrt(mass)
            scaled = root[:, None] * stiffness * root
            values, own = linalg.eigh(scaled, driver="evx", **wanted)
            motions = root[:, None] * own
            return values, motions, mass[:, None] * motions, _zero(diagonal / mass)
        if bloch.ties.empty and bloch.nodal is not None and len(free) == 3 * bloch.nodal.shape[0]:
            check_count(self.count, len(free), phase)
            nodal = bloch.nodal.at(factors)
            inverse = _inverse_root(nodal)
            scaled = _by_nodes(inverse, _by_nodes(inverse, stiffness).conj().T)
            values, own = linalg.eigh(scaled, driver="evx", **wanted)
            motions = _by_nodes(inverse.conj().T, own)
            weights = np.repeat(np.real(np.diag(nodal)), 3)
            return values, motions, _by_nodes(nodal, motions), _zero(diagonal / weights)
        mass = bloch.mass.at(factors)[np.ix_(free, free)]
        basis = np.eye(len(free))
        if not bloch.ties.empty:
            basis = null_space(bloch.ties.at(factors)[:, free])
            stiffness = basis.conj().T @ stiffness @ basis
        check_count(self.count, basis.shape[1], phase)
        own_mass = basis.conj().T @ mass @ basis
        own = self._lowest_of(stiffness, own_mass)
        # far smaller rounding errors
        values, turn = linalg.eigh(*(own.conj().T @ (part @ own) for part in (stiffness, own_mass)))
        own = own @ turn
        scale = np.real(np.diag(stiffness)) / np.real(np.diag(own_mass))
        noise = np.maximum(_zero(scale), _noise(stiffness, own))
        return values, basis @ own, mass @ (basis @ own), noise

    def _lowest_of(self, stiffness: NDArray, mass: NDArray) -> NDArray[np.complex128]:
        """Motions (n, k) that span those of the lowest eigenvalues of matrices (n, n)."""
        most, last = self.count, len(mass) - 1
        shifted = stiffness + SHIFT * _scale(stiffness, mass) * mass
        try:
            return linalg.eigh(mass, shifted, subset_by_index=[last + 1 - most, last])[1]
        except linalg.LinAlgError:  # the state is unstable
            pass
        try:
            return linalg.eigh(stiffness, mass, subset_by_index=[0, most - 1])[1]
        except linalg.LinAlgError:
            raise ComputationError("a free node of the cell has no mass") from None

    def _lanczos(self, phase: NDArray) -> Waves:
        """Waves at a phase (d,), for large matrices."""
        bloch = self.bloch
        factors, kept = bloch.factors(phase), np.flatnonzero(~bloch.held)
        check_count(self.count, len(self.free) - GUARD - 1, phase)
        whole, whole_mass = bloch.stiffness.sparse_at(factors), bloch.mass.sparse_at(factors)
        stiffness, mass = (part[kept][:, kept] for part in (whole, whole_mass))
        shift = -SHIFT * _scale(stiffness, mass)
        factor = unsymmetric(sparse.csc_array(stiffness - shift * mass))
        inverse = LinearOperator(stiffness.shape, factor.solve, dtype=complex)
        parts = np.random.default_rng(0).normal(size=(2, len(kept)))
        values, motions = eigsh(
            stiffness, self.count + GUARD, mass, sigma=shift, OPinv=inverse,
            v0=parts[0] + 1j * parts[1],
        )  # fmt: skip
        order = np.argsort(values)[: self.count]
        shapes = np.zeros((bloch.size, self.count), complex)
        shapes[kept] = motions[:, order]
        momentum = whole_mass @ shapes
        size = np.sqrt(np.einsum("ik,ik->k", shapes.conj(), momentum).real)
        shapes, values = shapes / size, values[order]
        values = np.where(np.abs(values) <= _noise(whole, shapes), 0.0, values)
        return Waves(values, shapes, momentum / size)


def check_count(count: int, most: int, phase: NDArray) -> None:
    """Refuse more bands than a cell has motions at a phase (d,)."""
    if most < count:
        raise InputError(
            f" = {count}: supports, links and rigid panels leave {most} motions at the phases "
            f"{phase.round(6).tolist()}; ask for no more bands",
            "count",
        )


def _scale(stiffness: Any, mass: Any) -> float:
    """A large eigenvalue: the ratio of the traces of matrices (n, n)."""
    return float(stiffness.diagonal().real.sum() / mass.diagonal().real.sum())


def _zero(scale: NDArray) -> float:
    """Eigenvalue that counts as zero, from ratios (n,) of the diagonals of stiffness and mass."""
    return NOISE * EPS * float(scale.max())


def _noise(stiffness: NDArray | sparse.csc_array, shapes: NDArray) -> NDArray[np.float64]:
    """Rounding errors (k,) of the eigenvalues of shapes (n, k)."""
    size = np.abs(shapes)
    return ROUNDING * np.einsum("ik,ik->k", size, abs(stiffness) @ size)


def _inverse_root(mass: NDArray) -> NDArray[np.complex128]:
    """L^-1 of the nodal mass (n, n) = L L^H."""
    try:
        lower = linalg.cholesky(mass, lower=True, check_finite=False)
    except linalg.LinAlgError:
        raise ComputationError("a free node of the cell has no mass") from None
    return linalg.solve_triangular(lower, np.eye(len(mass)), lower=True, check_finite=False)


def _by_nodes(matrix: NDArray, values: NDArray) -> NDArray[np.complex128]:
    """Product of a nodal matrix (n, n) with values (3 n, k), axis by axis."""
    return (matrix @ values.reshape(len(matrix), -1)).reshape(values.shape)
