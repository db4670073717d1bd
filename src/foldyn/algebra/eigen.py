"""The lowest modes of K phi = lambda M phi, without missing any.

Small problems are solved as full matrices, others by shift-invert Lanczos (ARPACK) with one
factorization of K - s M. The shift s is below every eigenvalue: K - s M is then positive definite
even if K is singular or indefinite, and the modes closest to the shift are the lowest. The
eigenvalues below the shift, and those below a gap after the last mode, are counted. Lanczos may
miss modes of multiple eigenvalues; missed modes are searched for again, orthogonal to known ones.

A factorization of K - s M has as many negative eigenvalues as the problem has eigenvalues below s
(Sylvester's law of inertia). Two counts, below and above a set of computed modes, prove that none
between them was missed. M is positive definite, except for massless dofs that follow the others
(edge rotations of shells) and motions of superelements on coarse meshes. These have no modes and,
as K is positive definite on them, do not count.

Modes known beforehand (rigid motions) are excluded from the search, so that they remain exact.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh

from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import Factorization, SingularTangentError
from foldyn.algebra.woodbury import Counted, Squared
from foldyn.errors import ComputationError, InputError

MOST_DENSE = 6000  # dofs up to which nearly all modes may be requested
DENSE = 60  # dofs up to which all modes are computed at once (equally fast)
SHIFT = 1e-10  # first shift below zero, relative to the pencil's scale
LOWER = 16.0  # factor from one shift to the next
LOWERINGS = 12
LEAST_BASIS = 20  # least number of Lanczos vectors, as Lanczos breaks down with few
GUARD = 3  # number of additional modes in which to search for a gap
GAP = 1e-6  # relative distance of eigenvalues that a count can separate
ROUNDS = 12  # largest number of searches for missed modes
EPS = float(np.finfo(float).eps)
ROUNDING = 5.0 * EPS  # rounding error of an eigenvalue at zero, relative to |phi|' |K| |phi|
NUDGES = 4  # largest number of small moves of a shift that hits an eigenvalue
NUDGE = 1e-7
LIGHT = 1e-6  # share of the mass of its dofs that a motion of usual matrices carries at least
WEIGHTLESS = 1e-12  # 1 / lambda of motions that carry no mass, relative to the largest one


class Pencil:
    """Stiffness and mass (n, n) of free dofs, with the solver that factorizes K - s M."""

    def __init__(
        self, stiffness: sparse.csc_array, mass: sparse.csc_array | Squared, solver: str = "auto"
    ) -> None:
        self.stiffness, self.mass = stiffness, mass
        self.size = stiffness.shape[0]
        self.backend, self._factorize = factorizer(solver, self.size)
        self.factorizations = 0
        self.heavy = mass.diagonal() > 0.0
        self.finite = int(self.heavy.sum())  # number of modes
        self._sizes = abs(stiffness)

    @property
    def scale(self) -> float:
        """Ratio of the mean diagonals of K and M, rad2/s2, large beside low modes; 1 without K."""
        stiffness = np.abs(self.stiffness.diagonal())[self.heavy]
        return float(stiffness.sum() / self.mass.diagonal().sum()) or 1.0

    def factorize(self, shift: float) -> Factorization:
        """Factors of K - s M; s is moved slightly if this matrix is singular."""
        for attempt in range(NUDGES):
            moved = shift + NUDGE * attempt * (abs(shift) or self.scale * EPS)
            self.factorizations += 1
            try:
                return self._factors(moved)
            except SingularTangentError:
                if attempt == NUDGES - 1:
                    raise
        raise AssertionError("unreachable")

    def _factors(self, shift: float) -> Factorization:
        mass = self.mass.matrix if isinstance(self.mass, Squared) else self.mass
        factors = self._factorize(sparse.csc_array(self.stiffness - shift * mass))
        factors.negative()
        if shift and isinstance(self.mass, Squared):
            return Counted(factors, self.mass.rows, -shift)
        return factors

    def below(self, shift: float) -> int:
        """Number of eigenvalues below s."""
        return self.factorize(shift).negative()

    def noise(self, shapes: NDArray) -> NDArray:
        """Rounding errors (k,) in the eigenvalues of shapes (n, k)."""
        size = np.abs(shapes)
        modal = np.einsum("ik,ik->k", shapes, self.mass @ shapes)
        return ROUNDING * np.einsum("ik,ik->k", size, self._sizes @ size) / modal

    def quotients(self, shapes: NDArray) -> NDArray:
        """Rayleigh quotients (k,) of shapes (n, k)."""
        modal = np.einsum("ik,ik->k", shapes, self.mass @ shapes)
        return np.einsum("ik,ik->k", shapes, self.stiffness @ shapes) / modal

    def residuals(self, values: NDArray, shapes: NDArray) -> NDArray:
        """Norm of K phi - lambda M phi relative to both terms (k,); nan for shapes of zeros."""
        inertia = (self.mass @ shapes) * values
        terms = np.linalg.norm(self._sizes @ np.abs(shapes), axis=0)
        left = np.linalg.norm(self.stiffness @ shapes - inertia, axis=0)
        free = np.where(shapes.any(axis=0), 0.0, np.nan)  # of motions without any stiffness
        return np.divide(left, terms, out=free, where=terms > 0.0)


@dataclass(frozen=True)
class Spectrum:
    """The lowest eigenvalues (k,), rad2/s2, their M-orthonormal shapes (n, k), and the checks."""

    values: NDArray
    shapes: NDArray
    shift: float  # no eigenvalue is below this shift; nan if all were computed
    checked: int  # number of lowest modes that a count proves to be complete
    missed: int  # number of modes that were counted but not found


def lowest(pencil: Pencil, count: int, known: NDArray, verify: bool = True) -> Spectrum:
    """The `count` lowest modes of a pencil; fewer if other motions carry no mass.

    Parameters
    ----------
    pencil : Pencil
    count : int
        Number of modes; at most as many as the pencil has.
    known : (n, r)
        M-orthonormal modes with the eigenvalue zero.
    verify : bool
        Whether to count the eigenvalues below a gap after the last mode; this takes another
        factorization.

    Raises
    ------
    InputError
        `count` exceeds the number of modes, or half of it if there are many dofs.
    ComputationError
        Lanczos did not converge, or the pencil cannot be factorized.
    """
    if count > pencil.finite:
        raise InputError(f" = {count}: the case has only {pencil.finite} free dofs", "count")
    if not np.isfinite(pencil.stiffness.data).all():
        raise ComputationError("modes: the tangent in this state is not finite")
    basis = max(2 * (count + GUARD) + 1, LEAST_BASIS)
    try:
        if pencil.size > DENSE and basis < pencil.finite - known.shape[1]:
            with suppress(ArpackError):  # fewer motions than Lanczos vectors carry mass
                return _sparse(pencil, count, known, verify)
        if pencil.size > MOST_DENSE:
            raise InputError(
                f" = {count}: ask for fewer than half of the modes of {pencil.size} free dofs",
                "count",
            )
        values, shapes = _sorted(pencil, *_all(pencil, known), known)
    except SingularTangentError as error:
        raise ComputationError(f"modes: {error}") from error
    values, shapes = values[:count], shapes[:, :count]
    return Spectrum(values, shapes, float("nan"), len(values), 0)


def _all(pencil: Pencil, known: NDArray) -> tuple[NDArray, NDArray]:
    """All modes except the known ones.

    Known ones are shifted above all others. Where some motions hardly carry any mass, as those of
    superelements, the largest 1 / lambda are accurate, and the smallest lambda would not be.
    """
    heavy, light = np.flatnonzero(pencil.heavy), np.flatnonzero(~pencil.heavy)
    mass = pencil.mass.toarray()[np.ix_(heavy, heavy)]
    stiffness = pencil.stiffness[heavy][:, heavy].toarray()
    follow = np.zeros((0, len(heavy)))
    if len(light):  # massless dofs follow the others statically
        across = pencil.stiffness[light][:, heavy].toarray()
        follow = -np.linalg.solve(pencil.stiffness[light][:, light].toarray(), across)
        stiffness = stiffness + across.T @ follow
    carried, modes = mass @ known[heavy], len(heavy) - known.shape[1]
    size = np.sqrt(mass.diagonal())
    lightest = float(np.linalg.eigvalsh(mass / np.outer(size, size))[0])
    if lightest > LIGHT:
        far = 4.0 * np.abs(stiffness).sum(axis=1).max() / mass.diagonal().min()
        _, vectors = eigh(stiffness + far * (carried @ carried.T), mass)
    else:
        stiffness = stiffness - _shift(pencil)[0] * mass + carried @ (pencil.scale * carried.T)
        inverse, vectors = eigh(mass - carried @ carried.T, stiffness)
        if lightest < ROUNDING * len(heavy):
            modes = int((inverse > WEIGHTLESS * inverse[-1]).sum())
        vectors = vectors[:, ::-1]
    vectors = vectors[:, :modes]
    shapes = np.zeros((pencil.size, vectors.shape[1]))
    shapes[heavy], shapes[light] = vectors, follow @ vectors
    shapes /= np.sqrt(np.einsum("ik,ik->k", shapes, pencil.mass @ shapes))
    return pencil.quotients(shapes), shapes  # more accurate than the eigenvalues of a full matrix


def _sparse(pencil: Pencil, count: int, known: NDArray, verify: bool) -> Spectrum:
    shift, factors, unstable = _shift(pencil)
    wanted = max(count - known.shape[1], min(unstable, count)) + GUARD
    values, shapes = _lanczos(pencil, shift, factors, wanted, known)
    missed, checked = 0, 0
    for _ in range(ROUNDS if verify else 0):
        ordered, _ = _sorted(pencil, values, shapes, known)
        checked, edge = _gap(pencil, ordered, count)
        missed = pencil.below(edge) - checked if checked else 0
        if missed <= 0:
            break
        more, others = _lanczos(pencil, shift, factors, missed + GUARD, np.hstack([known, shapes]))
        values, shapes = np.r_[values, more], np.hstack([shapes, others])
    values, shapes = _sorted(pencil, values, shapes, known)
    return Spectrum(values[:count], shapes[:, :count], shift, min(checked, count), missed)


def _shift(pencil: Pencil) -> tuple[float, Factorization, int]:
    """A shift below every eigenvalue, the factors, and the number of negative eigenvalues."""
    shift, unstable = -SHIFT * pencil.scale, 0
    for attempt in range(LOWERINGS):
        factors = pencil.factorize(shift)
        negative = factors.negative()
        if attempt == 0:
            unstable = negative
        if not negative:
            return shift, factors, unstable
        shift *= LOWER
    raise ComputationError(
        f"modes: {unstable} eigenvalues of the tangent are negative, some beyond {shift:.3g} "
        "rad2/s2: the state is far from a stable equilibrium"
    )


def _lanczos(
    pencil: Pencil, shift: float, factors: Factorization, count: int, beside: NDArray
) -> tuple[NDArray, NDArray]:
    """The `count` lowest modes M-orthogonal to `beside` (n, r)."""
    size, mass = pencil.size, pencil.mass
    count = min(count, pencil.finite - beside.shape[1] - 1)
    carried = mass @ beside

    def inverse(force: NDArray) -> NDArray:
        motion = factors.solve(force - carried @ (beside.T @ force))
        return motion - beside @ (carried.T @ motion)

    start = np.random.default_rng(0).standard_normal(size)
    operator = LinearOperator((size, size), matvec=inverse, dtype=float)
    start = inverse(mass @ start)
    try:
        weight = mass
        if isinstance(mass, Squared):
            weight = LinearOperator((size, size), matvec=mass.__matmul__, dtype=float)
        _, shapes = eigsh(pencil.stiffness, count, weight, sigma=shift, OPinv=operator, v0=start)
    except ArpackNoConvergence as error:
        raise ComputationError(
            f"modes: {len(error.eigenvalues)} of {count} modes converged; ask for fewer, or for "
            "more if many frequencies coincide"
        ) from error
    if pencil.finite < size:  # M is zero on massless dofs
        shapes = np.stack([inverse(force) for force in (mass @ shapes).T], axis=1)
    shapes = shapes / np.sqrt(np.einsum("ik,ik->k", shapes, mass @ shapes))
    return pencil.quotients(shapes), shapes


def _sorted(
    pencil: Pencil, values: NDArray, shapes: NDArray, known: NDArray
) -> tuple[NDArray, NDArray]:
    """All modes sorted by eigenvalue, known modes first; eigenvalues at rounding level are zero."""
    rounding = pencil.noise(shapes) + EPS * SHIFT * pencil.scale
    values = np.where(np.abs(values) <= rounding, 0.0, values)
    values = np.r_[np.zeros(known.shape[1]), values]
    order = np.argsort(values, kind="stable")
    return values[order], np.hstack([known, shapes])[:, order]


def _gap(pencil: Pencil, values: NDArray, count: int) -> tuple[int, float]:
    """Number of sorted values (m,) below a gap near number `count`, and the middle of the gap.

    A gap after the last requested mode proves that all were found. If a multiple eigenvalue leaves
    no gap there, the last gap before it is used: the requested modes are then an arbitrary choice
    among the modes of that eigenvalue.
    """
    apart = np.diff(values)
    clear = apart > GAP * (np.abs(values[:-1]) + np.abs(values[1:])) + SHIFT * pencil.scale * 1e-3
    return gap_near(values, clear, count)


def gap_near(values: NDArray, clear: NDArray, count: int) -> tuple[int, float]:
    """Number of values (m,) below the clear gap (m - 1,) near number `count`, and its middle."""
    gaps = np.flatnonzero(clear) + 1
    if not len(gaps):
        return 0, 0.0
    behind = gaps[gaps >= count]
    at = int(behind[0]) if len(behind) else int(gaps[-1])
    return at, 0.5 * float(values[at - 1] + values[at])
