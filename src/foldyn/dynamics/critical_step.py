"""The largest stable time step of an explicit method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse import linalg

from foldyn.cases import Case

MARGIN = 0.9  # of the stability limit: room for stiffening
_DENSE = 60  # dofs below which a dense eigensolver is quicker and safer


def largest_frequency(case: Case, u: ArrayLike | None = None) -> float:
    """Largest angular frequency (rad/s) of a case about displacement u (n, 3), rest by default.

    Hinges count with at least their nominal stiffness, so that superlinear bends, which have
    none at rest, cannot make the answer too small.
    """
    structure, free = case.structure, np.asarray(case.free_dofs)
    if not len(free):
        return 0.0
    state = np.zeros_like(structure.nodes) if u is None else np.asarray(u, float)
    k = structure.tangent(state, floor=1.0)[free][:, free]
    m = sparse.kron(structure.mass, sparse.eye_array(3), format="csr")[free][:, free]
    if len(free) <= _DENSE:
        values = _dense(k.toarray(), m.toarray())
    elif _is_diagonal(m):
        root = sparse.diags_array(1.0 / np.sqrt(m.diagonal()))
        values = _largest(sparse.csr_array(root @ k @ root))
    else:
        solve = linalg.splu(sparse.csc_array(m)).solve
        values = _largest(k, m, linalg.LinearOperator(m.shape, matvec=solve, dtype=float))
    return float(np.sqrt(max(values, 0.0)))


def _is_diagonal(m: sparse.csr_array) -> bool:
    return (m - sparse.diags_array(m.diagonal())).count_nonzero() == 0


def _dense(k: NDArray, m: NDArray) -> float:
    root = np.linalg.inv(np.linalg.cholesky(m))
    return float(np.linalg.eigvalsh(root @ k @ root.T)[-1])


def _largest(
    k: sparse.csr_array, m: sparse.csr_array | None = None, solve: object | None = None
) -> float:
    start = np.random.default_rng(0).standard_normal(k.shape[0])  # same answer in every run
    found = linalg.eigsh(
        k, 1, m, which="LA", v0=start, tol=1e-4, Minv=solve, return_eigenvectors=False
    )
    return 1.0002 * float(found[0])  # Lanczos values come from below


def stability_limit(
    amplification: Callable[[NDArray], NDArray], omega: float, alpha: float, beta: float
) -> float:
    """Largest dt with ``|R(s dt)| <= 1`` over the damped spectrum up to `omega` (rad/s).

    The spectrum is s^2 + (alpha + beta w^2) s + w^2 = 0 for all w from 0 to omega.
    Infinite for a system that neither vibrates nor decays.
    """
    if omega <= 0.0 and alpha <= 0.0:
        return np.inf
    w = omega * np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 600)])
    c = alpha + beta * w**2
    root = np.sqrt((c**2 - 4.0 * w**2).astype(complex))
    # the smaller root of an overdamped pair without cancellation: product of the roots is w^2
    fast = -0.5 * (c + root)
    slow = np.where(np.abs(fast) > 0.0, w**2 / np.where(fast == 0.0, 1.0, fast), 0.0)
    s = np.concatenate([fast, slow])
    rate = np.abs(s).max()

    def stable(dt: float) -> bool:
        return bool((np.abs(amplification(s * dt)) <= 1.0 + 1e-9).all())

    low, high = 0.0, 10.0 / rate
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def critical_step(case: Case, method: str = "rk4", u: ArrayLike | None = None) -> float:
    """Critical time step (s) of an explicit method for a case: 0.9 of its stability limit.

    Parameters
    ----------
    case : Case
    method : {"rk4"}
    u : (n, 3), optional
        Displacement (m) about which the stiffness is taken; rest by default.

    Notes
    -----
    With the damped spectrum s^2 + (alpha + beta w^2) s + w^2 = 0, the limit is the largest dt
    with ``|R(s dt)| <= 1`` for all frequencies w up to the highest of the structure.
    """
    from foldyn.dynamics.methods import method_of

    alpha, beta = case.damping.alpha, case.damping.beta
    omega = largest_frequency(case, u)
    return MARGIN * stability_limit(method_of(method).amplification, omega, alpha, beta)
