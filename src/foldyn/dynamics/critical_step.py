"""The largest stable time step of an explicit method."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse import linalg

from foldyn.cases import Case
from foldyn.dynamics.methods import suited
from foldyn.dynamics.stability import stability_limit
from foldyn.errors import ComputationError

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
    k = structure.body.tangent(state, 1.0)[free][:, free]
    m = sparse.kron(structure.mass, sparse.eye_array(3), format="csr")[free][:, free]
    try:
        return _largest_frequency(k, m)
    except (linalg.ArpackError, np.linalg.LinAlgError, RuntimeError) as error:
        raise ComputationError(
            f"the largest frequency, which the critical step needs, cannot be computed: {error}"
        ) from error


def _largest_frequency(k: sparse.csr_array, m: sparse.csr_array) -> float:
    if k.shape[0] <= _DENSE:
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


def critical_step(case: Case, method: str = "rk4", u: ArrayLike | None = None) -> float:
    """Critical time step (s) of an explicit method for a case: 0.9 of its stability limit.

    Parameters
    ----------
    case : Case
    method : str
        One of `foldyn.dynamics.METHODS`; nothing but accuracy limits the step of an implicit one:
        inf.
    u : (n, 3), optional
        Displacement (m) about which the stiffness is taken; rest by default.

    Notes
    -----
    With the damped spectrum s^2 + (alpha + beta w^2) s + w^2 = 0, the limit is the largest dt
    with which no vibration grows, for all frequencies w up to the highest of the structure: for
    RK4 ``|R(s dt)| <= 1``.
    """
    growth = suited(method, case.structure).growth
    if growth is None:
        return np.inf
    omega = largest_frequency(case, u)
    return MARGIN * stability_limit(growth, omega, case.damping)
