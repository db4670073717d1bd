"""Inertia relief: the loads of a body that is free to move, balanced by its inertia.

A free body under loads that do not balance accelerates as a rigid body. In the frame that moves
with it the inertia forces M R a balance the loads, with R (3n, r) its free rigid motions in the
current configuration and a = (R' M R)^-1 R' p their accelerations. What deforms the body is the
difference p - M R a. Its place in space is fixed by holding r of its dofs, whose supports carry
nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.statics.rigid import free_rigid_motions

TIE = 1e-6  # by how much the last dof counts less than the first one where pins are chosen


class Relief:
    """Balance of the loads of a case whose supports leave it free to move as a rigid body."""

    def __init__(self, case: Case, start: NDArray) -> None:
        self._nodes, self._held = case.structure.nodes, case.fixed.ravel()
        try:
            self._mass = case.structure.mass
        except InputError as error:
            raise InputError(
                f": needs the mass of the structure: {error}", "inertia_relief"
            ) from None
        motions = self._motions(start)
        self._count = motions.shape[1]
        if not self._count:
            raise InputError(
                ": the supports leave no rigid motion free: leave it out", "inertia_relief"
            )
        free = np.flatnonzero(~self._held)
        first = np.linspace(1.0, 1.0 - TIE, len(free))  # of dofs that hold it as well, the first
        _, _, order = qr(motions[free].T * first, mode="economic", pivoting=True)
        self.pins = np.sort(free[order[: self._count]])

    def _motions(self, u: NDArray) -> NDArray:
        return free_rigid_motions(self._nodes + u.reshape(-1, 3), self._held)

    def inertia(self, u: NDArray, force: NDArray) -> NDArray:
        """Inertia forces (3n,), N, that balance forces (3n,) at displacement u (3n,)."""
        motions = self._motions(u)
        if motions.shape[1] != self._count:
            return np.full(len(force), np.nan)  # the supports have come to hold a turned body
        carried = (self._mass @ motions.reshape(-1, 3 * self._count)).reshape(motions.shape)
        return carried @ np.linalg.solve(motions.T @ carried, motions.T @ force)
