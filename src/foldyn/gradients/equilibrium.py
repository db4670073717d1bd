"""What an equilibrium adds to gradients: the state follows the parameters."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.mechanics.pullback import Pullback

SINGULAR = 1e-13  # of the stiffness at play: a motion that meets no more is a critical point's


def free_block(
    case: Case, q: NDArray, free: NDArray | None = None
) -> tuple[NDArray, sparse.csc_array]:
    """Free dofs (nf,), all by default, and the tangent (nf, nf) there."""
    if free is None:
        free = np.concatenate([case.free_dofs, case.body.hidden])
    tangent = sparse.csr_array(case.constraints.matrix(case.body.tangent(q)))
    return free, sparse.csc_array(tangent[free][:, free])


class Balance:
    """An equilibrium (m,) of a case, and its motions under forces.

    The factors of its tangent serve for all numbers of which derivatives are taken.

    Parameters
    ----------
    case : Case
    q : ndarray, shape (m,)
    free : ndarray of int, shape (nf,), optional
        Dofs that are in balance there, all free ones by default; the others stand.
    """

    def __init__(self, case: Case, q: NDArray, free: NDArray | None = None) -> None:
        self.case, self.q, self._free = case, q, free

    @cached_property
    def _factors(self) -> tuple[NDArray, float, Any]:
        """Free dofs, the stiffness at play (N/m), and factors; None where it is singular."""
        free, block = free_block(self.case, self.q, self._free)
        try:
            return free, float(np.abs(block).max()), splu(block)
        except RuntimeError:  # exactly singular
            return free, float(np.abs(block).max()), None

    def under(self, force: NDArray) -> NDArray:
        """Motion (m,) under a force (m,).

        Raises
        ------
        InputError
            At a critical point, where there is none.
        """
        free, stiffness, factors = self._factors
        load, out = self.case.constraints.force(force)[free], np.zeros(len(self.q))
        out[free] = np.inf if factors is None else factors.solve(load)
        met = float(np.abs(load).max(initial=0.0))
        if not met >= SINGULAR * stiffness * float(np.abs(out).max(initial=0.0)):
            raise InputError(
                "the equilibrium is a limit point or a bifurcation, where displacements have no "
                "derivative; ask for the load factor (limit_load), or take another load factor"
            )
        return self.case.constraints.displacement(out)

    def add_seen(
        self, by_state: NDArray, pullback: Pullback, total: dict[str, NDArray], factor: float = 1.0
    ) -> None:
        """Add to a gradient what comes by the state, under loads times a factor.

        by_state : derivatives (m,) of the number by the dofs at constant numbers.
        """
        adjoint = self.under(by_state)
        seen_through(self.case, self.q, by_state, adjoint, pullback, total, factor)


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
