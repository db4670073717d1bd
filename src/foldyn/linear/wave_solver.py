"""The lowest Bloch waves at given phases.

Small problems are solved with full matrices: hidden dofs are condensed, constraints are satisfied
by a basis of allowed motions. If the nodal mass is the same for all three axes, its factor is a
third as large. Large problems are solved by Lanczos iteration about a shift below zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from foldyn.errors import ComputationError, InputError
from foldyn.linear.bloch import Bloch, null_space
from foldyn.linear.group_velocity import Waves
from foldyn.threads import in_threads

DENSE = 500  # dofs up to which a problem is solved with full matrices
GUARD = 3  # extra waves, so that none is missed if several coincide
EPS = float(np.finfo(float).eps)
ROUNDING = 1e-15  # of |phi|' |K| |phi|: smaller counts as zero
NOISE = 30.0  # factor on the rounding errors of the largest entries: smaller counts as zero, too
SHIFT = 1e-6  # of the pencil's scale: the shift below zero


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
        stiffness, follow = whole, np.zeros((0, len(free)))
        if len(free) < bloch.size:
            stiffness = whole[np.ix_(free, free)]
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
    ) -> tuple[NDArray, NDArray, NDArray, float]:
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
        try:
            values, own = linalg.eigh(stiffness, own_mass, **wanted)
        except linalg.LinAlgError:
            raise ComputationError("a free node of the cell has no mass") from None
        scale = np.real(np.diag(stiffness)) / np.real(np.diag(own_mass))
        return values, basis @ own, mass @ (basis @ own), _zero(scale)

    def _lanczos(self, phase: NDArray) -> Waves:
        """Waves at a phase (d,), for large matrices."""
        bloch = self.bloch
        factors, kept = bloch.factors(phase), np.flatnonzero(~bloch.held)
        check_count(self.count, len(self.free) - GUARD - 1, phase)
        whole, whole_mass = bloch.stiffness.sparse_at(factors), bloch.mass.sparse_at(factors)
        stiffness, mass = (part[kept][:, kept] for part in (whole, whole_mass))
        shift = -SHIFT * float(stiffness.diagonal().real.sum() / mass.diagonal().real.sum())
        factor = splu(sparse.csc_array(stiffness - shift * mass))
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


def _zero(scale: NDArray) -> float:
    """Zero threshold of the eigenvalues, from diagonals of stiffness over mass (n,)."""
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
