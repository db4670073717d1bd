"""Gradients through an equilibrium, whose state depends on the parameters."""

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

SINGULAR = 1e-13  # of the largest stiffness: a motion with less belongs to a critical point


def free_block(
    case: Case, q: NDArray, free: NDArray | None = None
) -> tuple[NDArray, sparse.csc_array]:
    """Free dofs (nf,), all by default, and their tangent (nf, nf)."""
    if free is None:
        free = np.concatenate([case.free_dofs, case.body.hidden])
    tangent = sparse.csr_array(case.constraints.matrix(case.body.tangent(q)))
    return free, sparse.csc_array(tangent[free][:, free])


class Balance:
    """An equilibrium (m,) of a case, and its response to forces.

    The factors of its tangent are reused for all derivatives.

    Parameters
    ----------
    case : Case
    q : ndarray, shape (m,)
    free : ndarray of int, shape (nf,), optional
        Dofs in equilibrium, all free ones by default; the others are fixed.
    """

    def __init__(self, case: Case, q: NDArray, free: NDArray | None = None) -> None:
        self.case, self.q, self._free = case, q, free

    @cached_property
    def _factors(self) -> tuple[NDArray, float, Any]:
        """Free dofs, the largest stiffness (N/m), and factors; None if the tangent is singular."""
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
            The equilibrium is a critical point, without such a motion.
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
        """Add to a gradient the part due to the change of the state, with loads times a factor.

        by_state : derivatives (m,) of the quantity by the dofs with the numbers fixed.
        """
        adjoint = self.under(by_state)
        seen_through(self.case, self.q, by_state, adjoint, pullback, total, factor)


def seen_through(
    case: Case, q: NDArray, by_state: NDArray, adjoint: NDArray, pullback: Pullback,
    total: dict[str, NDArray], factor: float,
) -> None:  # fmt: skip
    """Add -adjoint' dR, R = F - factor p, and the effect of imposed displacements to a gradient."""
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
