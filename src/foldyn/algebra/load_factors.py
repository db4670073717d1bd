"""Load factors at which K0 + f K1 is singular, nearest to zero on each side, none missed.

K0 is positive definite, so -K1 phi = m K0 phi has real m = 1 / f, and the factors nearest to zero
belong to the extreme m: the largest are the lowest positive factors, the smallest the negative ones
nearest to zero. Lanczos' method (ARPACK) with one factorization of K0 finds the extremes first.

K0 + s K1 has as many negative eigenvalues as there are factors between 0 and s (Sylvester's law of
inertia). A count at an s beyond the last factor found proves that none was missed; missed ones are
searched for again, orthogonal to those found.

Rounding errors in K1 give factors too, far from zero, which are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, eigh
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from foldyn.algebra.eigen import gap_near
from foldyn.algebra.superlu import Factorization, Factorizer, SingularTangentError
from foldyn.errors import ComputationError

DENSE = 120  # dofs up to which all factors are computed at once
NEAR = 10.0  # factors up to this many times the one nearest to zero always count
LEAST_BASIS = 40  # least number of Lanczos vectors, which more than pay where factors are close
RESTARTS = 500
TOLERANCE = 1e-10  # relative residual; the error of a factor is its square
GUARD = 3  # number of additional factors in which to search for a gap
GAP = 1e-6  # relative distance of factors that a count can separate
BEYOND = 1.5  # where to count beyond the last factor, if there are no more
ROUNDS = 8  # largest number of searches for missed factors
ROUNDING = 5.0 * float(np.finfo(float).eps)  # of phi' K0 phi, relative to |phi|' |K0| |phi|


class LoadFactors(NamedTuple):
    """Factors (k,) of one sign, from the one nearest to zero on, and their shapes (n, k)."""

    values: NDArray
    shapes: NDArray  # phi' K0 phi = 1
    complete: int  # number of factors, nearest to zero, that a count proves to be complete


class Softening:
    """K0 and K1 (n, n), with the factors of K0.

    Parameters
    ----------
    stiffness : csc_array
        K0, positive definite.
    change : csc_array
        K1, symmetric.
    factors : Factorization
        Of K0.
    factorize : callable
        Factorizes K0 + s K1.
    rounding : float
        Rounding errors of K1's entries, relative to K0's, over the machine's precision.
    farthest : float
        Size of the largest factor that means anything, unless all are larger. Beyond it factors lie
        so close together that Lanczos' method finds them slowly.
    """

    def __init__(
        self, stiffness: sparse.csc_array, change: sparse.csc_array, factors: Factorization,
        factorize: Factorizer, rounding: float, farthest: float,
    ) -> None:  # fmt: skip
        self.stiffness, self.change, self._sizes = stiffness, change, abs(stiffness)
        self._factors, self._factorize = factors, factorize
        self._rounding, self._farthest = rounding, farthest
        self.size = stiffness.shape[0]

    def nearest(self, count: int) -> tuple[LoadFactors, LoadFactors]:
        """At most `count` positive and `count` negative factors, those nearest to zero.

        Raises
        ------
        ComputationError
            Lanczos did not converge, or factors were missed.
        """
        if self.size <= DENSE:
            return self._of_all(count)
        first, shape = self._lanczos(1, "LM", np.zeros((self.size, 0)))
        if not self._real(first, shape).any():
            return self._none, self._none
        farthest = max(self._farthest, NEAR * abs(float(first[0])))
        return self._of_sign(count, farthest), self._of_sign(count, -farthest)

    def _real(self, values: NDArray, shapes: NDArray) -> NDArray[np.bool_]:
        """Which factors (k,) are more than rounding errors of K1."""
        size = np.abs(shapes)
        noise = self._rounding * ROUNDING * np.einsum("ik,ik->k", size, self._sizes @ size)
        return np.abs(values) * noise < 1.0

    @property
    def _none(self) -> LoadFactors:
        return LoadFactors(np.zeros(0), np.zeros((self.size, 0)), 0)

    def _of_all(self, count: int) -> tuple[LoadFactors, LoadFactors]:
        """Factors of both signs, by a full matrix."""
        try:
            _, shapes = eigh(-self.change.toarray(), self.stiffness.toarray())
        except LinAlgError as error:
            raise ComputationError(f"buckling: {error}") from error
        values, shapes = self._kept(shapes)
        real = self._real(values, shapes)
        first = float(np.abs(values[real]).min(initial=np.inf))
        real &= np.abs(values) <= max(self._farthest, NEAR * first)
        found = []
        for sign in (1.0, -1.0):
            chosen = np.flatnonzero(real & (sign * values > 0.0))[:count]
            found.append(LoadFactors(values[chosen], shapes[:, chosen], len(chosen)))
        return found[0], found[1]

    def _of_sign(self, count: int, farthest: float) -> LoadFactors:
        """Factors between 0 and `farthest`."""
        which, there = ("LA" if farthest > 0.0 else "SA"), self._within(farthest)
        if not there:
            return self._none
        values, shapes = np.zeros(0), np.zeros((self.size, 0))
        wanted, at = min(count + GUARD, there), 0
        for _ in range(ROUNDS):
            more, others = self._lanczos(wanted, which, shapes)
            own = more * farthest > 0.0
            values, shapes = _sorted(np.r_[values, more[own]], np.hstack([shapes, others[:, own]]))
            at, edge = _gap(values, count)
            wanted = self._within(edge) - at if at else 0
            if wanted <= 0:
                real = np.flatnonzero(self._real(values, shapes))[:count]
                return LoadFactors(values[real], shapes[:, real], min(at, len(real)))
            wanted = min(wanted + GUARD, there)
        raise ComputationError("buckling: load factors were missed; ask for another count")

    def _within(self, edge: float) -> int:
        """Number of factors between 0 and `edge`."""
        try:
            return self._factorize(sparse.csc_array(self.stiffness + edge * self.change)).negative()
        except SingularTangentError as error:
            raise ComputationError(f"buckling: {error}") from error

    def _lanczos(self, count: int, which: str, beside: NDArray) -> tuple[NDArray, NDArray]:
        """Factors at an end of the spectrum, K0-orthogonal to `beside` (n, r)."""
        held, shape = self.stiffness @ beside, (self.size, self.size)

        def apart(force: NDArray) -> NDArray:
            return force - held @ (beside.T @ force)

        def softened(motion: NDArray) -> NDArray:
            return -apart(self.change @ (motion - beside @ (held.T @ motion)))

        inverse = LinearOperator(shape, matvec=self._factors.solve, dtype=float)
        operator = LinearOperator(shape, matvec=softened, dtype=float)
        start = np.random.default_rng(beside.shape[1]).standard_normal(self.size)
        start = self._factors.solve(apart(self.stiffness @ start))
        count = min(count, self.size - 2)
        basis = min(max(2 * count + 1, LEAST_BASIS), self.size - 1)
        try:
            _, shapes = eigsh(
                operator, k=count, M=self.stiffness, Minv=inverse, which=which, v0=start,
                ncv=basis, tol=TOLERANCE, maxiter=RESTARTS,
            )  # fmt: skip
        except ArpackNoConvergence as error:  # the others are searched for again if they count
            shapes = error.eigenvectors
            if not shapes.shape[1]:
                raise ComputationError(
                    f"buckling: none of {count} load factors converged; ask for another count"
                ) from error
        return self._kept(shapes)

    def _kept(self, shapes: NDArray) -> tuple[NDArray, NDArray]:
        """Factors and their shapes with phi' K0 phi = 1, sorted."""
        shapes = shapes / np.sqrt(np.einsum("ik,ik->k", shapes, self.stiffness @ shapes))
        # quotients are more accurate than eigenvalues of a full matrix
        inverse = -np.einsum("ik,ik->k", shapes, self.change @ shapes)
        finite = inverse != 0.0
        return _sorted(1.0 / inverse[finite], shapes[:, finite])


def _sorted(values: NDArray, shapes: NDArray) -> tuple[NDArray, NDArray]:
    order = np.argsort(np.abs(values), kind="stable")
    return values[order], shapes[:, order]


def _gap(values: NDArray, count: int) -> tuple[int, float]:
    """Number of sorted factors before a gap near number `count`, and a factor in the gap."""
    if not len(values):
        return 0, 0.0
    if len(values) <= count:
        return len(values), BEYOND * float(values[-1])
    return gap_near(values, np.abs(np.diff(values)) > GAP * np.abs(values[1:]), count)
