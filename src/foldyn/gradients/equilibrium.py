"""What an equilibrium adds to gradients: the state follows the parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case
from foldyn.mechanics.pullback import Pullback


def equilibrium_seen(
    case: Case, q: NDArray, by_state: NDArray, pullback: Pullback, total: dict[str, NDArray],
    factor: float = 1.0,
) -> None:  # fmt: skip
    """Add to a gradient what comes by the state (m,), an equilibrium under loads times a factor.

    by_state : derivatives (m,) of the number by the dofs at constant numbers.
    """
    ties, body = case.constraints, case.body
    free = np.concatenate([case.free_dofs, body.hidden])
    tangent = sparse.csr_array(ties.matrix(body.tangent(q)))
    block = sparse.csc_array(tangent[free][:, free])
    adjoint = np.zeros(len(q))
    adjoint[free] = splu(block).solve(ties.force(by_state)[free])
    seen_through(case, q, by_state, ties.displacement(adjoint), pullback, total, factor)


def seen_through(
    case: Case, q: NDArray, by_state: NDArray, adjoint: NDArray, pullback: Pullback,
    total: dict[str, NDArray], factor: float,
) -> None:  # fmt: skip
    """Add -adjoint' dR to a gradient, R = F - factor p, and what supports move."""
    pullback.clear()
    product = pullback.at(q, adjoint)
    for name, out in pullback.gradient.items():
        total[name] -= out
    size = case.structure.nodes.size
    for k in range(len(case.load_terms)):
        pushed = factor * adjoint[:size].reshape(-1, 3)
        total[f"load.{k}"] += pushed
    for k in range(len(case.imposed_terms)):
        moved = factor * (by_state - product)[:size].reshape(-1, 3) * case.imposed
        total[f"imposed.{k}"] += moved
