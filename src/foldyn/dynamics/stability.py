"""Largest stable time step of an explicit method, and the frequency that determines it.

A step is stable if no free vibration of a damped linear system grows. Each vibration satisfies
s^2 + c s + k = 0, with the quotients c = phi* C phi and k = phi* K phi of its complex shape phi,
phi* M phi = 1, and a method depends on nothing but c and k. So a step is stable if it is stable for
all k between 0 and the largest eigenvalue, and for all possible sums c of the damping parts.

Explicit methods give dofs without mass an inertia (`hidden_inertia`): as little as keeps their own
vibrations below the largest frequency that nodes have while these dofs are held. As no inertia
makes the largest frequency of all dofs smaller than that, a larger one would gain little.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse import linalg

from foldyn.algebra.superlu import SingularTangentError, factorize
from foldyn.cases import Case, Rayleigh
from foldyn.dynamics.dampers import dampers, damping_matrix
from foldyn.dynamics.hereditary import instant_stiffness
from foldyn.dynamics.inertia import is_lumped
from foldyn.dynamics.softening import check_lost, lost_stiffness
from foldyn.errors import ComputationError
from foldyn.values import of_kind

MARGIN = 0.9  # critical step relative to the stability limit, to allow for stiffening
_DENSE = 60  # dofs below which a dense eigensolver is faster and safer
# function of frequencies (n,), damping (n,) and step that returns growth factors (n,)
Growth = Callable[[NDArray, NDArray, float], NDArray]
_FRACTIONS = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 400)])
_RATES = np.linspace(0.0, 1.0, 5)[:, None]
_LEAST = 0.0  # least octaves of this eigenvalue above the local one, which ties would lower
_PER_OCTAVE = 2  # values per octave that the largest eigenvalue is rounded to, see `hidden_inertia`
ROUNDING = 1e-7  # tolerance for a factor of 1, as rigid motions have double eigenvalues


def roots(omega: NDArray, damping: NDArray) -> NDArray:
    """Both roots (2, n) of s^2 + damping s + omega^2 = 0, without cancellation."""
    root = np.sqrt((damping**2 - 4.0 * omega**2).astype(complex))
    fast = -0.5 * (damping + root)
    slow = np.where(np.abs(fast) > 0.0, omega**2 / np.where(fast == 0.0, 1.0, fast), 0.0)
    return np.stack([fast, slow])


def is_stable(
    growth: Growth, omega: float, damping: Rayleigh, dt: float, rate: float = 0.0
) -> bool:
    """Whether no free vibration with a frequency up to `omega` (rad/s) grows for steps of dt.

    Vibrations satisfy s^2 + c s + w^2 = 0 for all w from 0 to omega, with c between the damping
    rate at w and that rate plus `rate` (1/s).
    """
    w, c = _spectrum(omega, damping, rate)
    return bool((growth(w, c, dt) <= 1.0 + ROUNDING).all())


def _spectrum(omega: float, damping: Rayleigh, rate: float) -> tuple[NDArray, NDArray]:
    """Frequencies (k,), rad/s, and damping rates (k,), 1/s, for which a step must be stable."""
    w = omega * _FRACTIONS
    if rate == 0.0:
        return w, damping.rate(w)
    w, more = np.broadcast_arrays(w[::4], rate * _RATES)
    return w.ravel(), damping.rate(w.ravel()) + more.ravel()


def stability_limit(growth: Growth, omega: float, damping: Rayleigh, rate: float = 0.0) -> float:
    """Largest stable dt, as `is_stable` defines it.

    The result is inf for a system that neither vibrates nor decays.
    """
    if omega <= 0.0 and damping.alpha <= 0.0 and rate <= 0.0:
        return np.inf
    low, high = 0.0, 10.0 / np.abs(roots(*_spectrum(omega, damping, rate))).max()
    for _ in range(45):
        middle = 0.5 * (low + high)
        stable = is_stable(growth, omega, damping, middle, rate)
        low, high = (middle, high) if stable else (low, middle)
    return low


def limit_below(
    growth: Growth, case: Case, u: NDArray, dt: float, rate: float = 0.0
) -> float | None:
    """Stability limit (s) of a case at u (n, 3) if steps of dt are above it, else None.

    rate : largest rate of modal damping, 1/s.
    """
    rate += damper_rate(case, u)
    for frequency in (frequency_bound, largest_frequency):  # the first is cheaper
        omega = frequency(case, u)
        if np.isfinite(omega) and is_stable(growth, omega, case.rayleigh, dt, rate):
            return None
    return stability_limit(growth, omega, case.rayleigh, rate)


def largest_frequency(case: Case, u: ArrayLike | None = None) -> float:
    """Largest angular frequency (rad/s) of a case about displacement u (n, 3), rest by default.

    Hinges count with at least their nominal stiffness; otherwise superlinear bends, which have no
    stiffness at rest, would lower the result. Laws with memory count with their instant stiffness,
    and dofs without mass with the inertia that explicit methods give them.
    """
    case = explicit(of_kind("case", case, Case))
    return float(np.sqrt(max(_quotient_of(case, _tangent(case, u), *_moving(case)), 0.0)))


def explicit(case: Case) -> Case:
    """The case; its structure with the dofs that explicit methods take."""
    structure = case.structure.for_explicit
    return case if structure is case.structure else case.altered(structure=structure)


_known: WeakKeyDictionary[Case, NDArray] = WeakKeyDictionary()


def hidden_inertia(case: Case) -> NDArray:
    """Inertia (h,), kg, of the dofs without mass, for explicit methods.

    It is the sum of the absolute stiffnesses in the row of each dof at rest, divided by w^2, with w
    the largest frequency of the nodes while these dofs are held. w^2 is rounded, in relation to a
    number that depends smoothly on the case: equal cases with other rounding errors have the same
    inertia, and derivatives do not depend on how an eigenvalue was found. Ties that leave only slow
    motions do not make it larger.

    A crease counts with the least stiffness that its law leaves it, after yielding, say: it turns
    as fast as its panels let it then, and a crease that is stiff at rest has a shorter step.

    So that damping of these dofs, by creases or by beta K, does not shorten the step, the sum of
    its coefficients in the row, divided by w, adds to it: what is damped then follows its damper
    with a delay of 1 / w.
    """
    hidden = case.body.hidden
    if not len(hidden):
        return np.zeros(0)
    if case not in _known:
        stiffness = _tangent(case, None)
        whole = np.asarray(abs(stiffness[hidden][:, hidden]).sum(axis=1)).ravel()
        own = whole - lost_stiffness(case)
        check_lost(case, whole / own)
        mass, free = case.mass.diagonal(), ~case.fixed.all(axis=1)
        free &= mass > 0.0
        local = stiffness.diagonal()[: 3 * len(mass)].reshape(-1, 3).sum(axis=1)
        scale = float((local[free] / mass[free]).max())
        nodal = _quotient_of(case, stiffness, np.asarray(case.free_dofs), case.free_mass)
        rounded = max(round(_PER_OCTAVE * math.log2(nodal / scale)) / _PER_OCTAVE, _LEAST)
        damping = abs(damping_matrix(case, case.body.dofs(_state(case, None)), most=True))
        damped = np.asarray(damping[hidden][:, hidden].sum(axis=1)).ravel()
        damped += case.rayleigh.beta * whole
        square = scale * 2.0**rounded
        _known[case] = own / square + damped / math.sqrt(square)
    return _known[case]


def frequency_bound(case: Case, u: ArrayLike | None = None) -> float:
    """Upper bound (rad/s) for the largest frequency, at low cost.

    Gershgorin's theorem gives it from the largest absolute row sum of M^-1/2 K M^-1/2. The result
    is inf unless the mass is lumped.
    """
    if not is_lumped(case.free_mass):
        return np.inf
    (free, mass), k = _moving(case), case.constraints.matrix(_tangent(case, u))
    root = np.zeros(k.shape[0])
    root[free] = 1.0 / np.sqrt(mass.diagonal())
    return float(np.sqrt((root * (abs(k) @ root)).max()))


def damper_rate(case: Case, u: ArrayLike | None = None) -> float:
    """Largest damping rate (1/s) of dashpots, creases and strain damping about u (n, 3)."""
    if not dampers(case):
        return 0.0
    damping = damping_matrix(case, case.body.dofs(_state(case, u)), most=True)
    return _quotient_of(case, damping, *_moving(case))


def _tangent(case: Case, u: ArrayLike | None) -> sparse.csr_array:
    """Stiffness about u (n, 3) that limits the step."""
    state = _state(case, u)
    balanced = case.elastic_body.dofs(state, kept=[])
    tangent = case.elastic_body.tangent(balanced, 1.0)
    added = instant_stiffness(case, state)
    return tangent if added is None else sparse.csr_array(tangent + added)


def _state(case: Case, u: ArrayLike | None) -> NDArray:
    return np.zeros_like(case.structure.nodes) if u is None else np.asarray(u, float)


def _moving(case: Case) -> tuple[NDArray, sparse.csr_array]:
    """All dofs that move in explicit methods, and their mass."""
    own, free, mass = hidden_inertia(case), np.asarray(case.free_dofs), case.free_mass
    if not len(own):
        return free, mass
    free = np.concatenate([free, case.body.hidden])
    return free, sparse.csr_array(sparse.block_diag([mass, sparse.diags_array(own)]))


def _quotient_of(
    case: Case, matrix: sparse.csr_array, free: NDArray, mass: sparse.csr_array
) -> float:
    """Largest eigenvalue, relative to the mass (f, f), of a matrix (m, m) on the free dofs."""
    k = sparse.csr_array(case.constraints.matrix(matrix)[free][:, free])
    if not k.count_nonzero():
        return 0.0
    try:
        return _largest_eigenvalue(k, mass)
    except (RuntimeError, np.linalg.LinAlgError, SingularTangentError) as error:
        raise ComputationError(
            f"the largest frequency, which the critical step needs, cannot be computed: {error}"
        ) from error


def _largest_eigenvalue(k: sparse.csr_array, m: sparse.csr_array) -> float:
    if k.shape[0] <= _DENSE:
        return float(eigh(k.toarray(), m.toarray(), eigvals_only=True)[-1])
    if is_lumped(m):
        root = sparse.diags_array(1.0 / np.sqrt(m.diagonal()))
        return _largest(sparse.csr_array(root @ k @ root))
    solve = factorize(sparse.csc_array(m), symmetric=False).solve
    return _largest(k, m, linalg.LinearOperator(m.shape, matvec=solve, dtype=float))


def _largest(
    k: sparse.csr_array, m: sparse.csr_array | None = None, solve: object | None = None
) -> float:
    start = np.random.default_rng(0).standard_normal(k.shape[0])  # the same result in every run
    largest = linalg.eigsh(
        k, 1, m, which="LA", v0=start, tol=1e-4, Minv=solve, return_eigenvectors=False
    )
    return 1.0002 * float(largest[0])  # Lanczos values approach from below
