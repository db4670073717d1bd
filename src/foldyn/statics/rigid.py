"""Rigid motions that supports leave free, the names of these motions, and inertia relief.

A free body under unbalanced loads accelerates as a rigid body. In the frame that moves with it the
inertia forces M R a balance the loads. Here R (3n, r) holds the free rigid motions in the current
configuration and a = (R' M R)^-1 R' p the accelerations along them. The difference p - M R a
deforms the body. The body's position is fixed by holding r dofs; their supports carry no force.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import qr

from foldyn.cases import Case
from foldyn.cases.constraints import Constraints
from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly

FREE = 1e-9  # motion of held dofs that counts as zero, relative to the size of the rigid motion
AXES = "xyz"
TIE = 1e-6  # difference between the weights of the first and last dof in the choice of pins


def rigid_motions(x: NDArray) -> NDArray:
    """Rigid motions (3n, 6) of points x (n, 3): translations along, then rotations about x, y, z.

    Rotations are small, about the mean point, and divided by the size of the body, so that all six
    motions are of similar size.
    """
    arm, size = x - x.mean(axis=0), _radius(x)
    motions = np.zeros((len(x), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arm / size)
    return motions.reshape(-1, 6)


def _radius(x: NDArray) -> float:
    """Root mean square distance (m) of points from their mean."""
    return float(np.sqrt(((x - x.mean(axis=0)) ** 2).sum() / max(len(x), 1))) or 1.0


def of_all_dofs(body: Assembly, x: NDArray, motions: NDArray) -> NDArray:
    """Rigid motions (m, r) of all dofs, from those (3n, r) of nodes at x (n, 3)."""
    out = np.zeros((body.size, motions.shape[1]))
    out[: x.size] = motions
    if body.sheet.rotated is not None:
        parts = np.linalg.lstsq(rigid_motions(x), motions, rcond=None)[0]
        out[body.hidden] = body.sheet.rotated @ parts[3:] / _radius(x)
    return out


def free_rigid_motions(
    x: NDArray, ties: Constraints, holds: sparse.csr_array | None = None
) -> NDArray:
    """Rigid motions (3n, r) of points x (n, 3) that supports and constraints allow.

    holds : further restraints, see `Assembly.holds`.
    """
    motions = rigid_motions(x)
    return motions @ _free_space(motions, ties, holds)


def _free_space(motions: NDArray, ties: Constraints, holds: sparse.csr_array | None) -> NDArray:
    """Combinations (6, r) of rigid motions that leave the held dofs still and move something."""
    still = motions[ties.held]
    if ties:
        still = np.concatenate([still, ties.rows @ motions])
    if holds is not None and holds.shape[0]:
        still = np.concatenate([still, holds[:, : len(motions)] @ motions])
    _, values, right = np.linalg.svd(np.linalg.qr(still, mode="r"))
    rank = int((values > FREE * np.sqrt(len(still))).sum())
    space = right[rank:].T
    # points on a line do not move when it turns about itself
    _, values, right = np.linalg.svd(motions @ space, full_matrices=False)
    return space @ right[values > FREE * np.sqrt(len(motions))].T


def name_rigid_motions(
    x: NDArray, ties: Constraints, holds: sparse.csr_array | None = None
) -> list[str]:
    """Free rigid motions in words, such as "translation along x" and "rotation about y"."""
    space = _free_space(rigid_motions(x), ties, holds)
    if not space.size:
        return []
    left, values, right = np.linalg.svd(space[3:])
    rank = int((values > 1e-8).sum())
    # rotations last: what remains once the translations are removed
    translations, rotations = (space @ right[rank:].T)[:3], left[:, :rank]
    return [
        *(f"translation along {_direction(t)}" for t in _tidy(translations)),
        *(f"rotation about {_direction(w)}" for w in _tidy(rotations)),
    ]


def _tidy(directions: NDArray) -> list[NDArray]:
    """Basis of the span of columns (3, k), along the axes where possible."""
    if not directions.size:
        return []
    basis, _ = np.linalg.qr(directions)
    inside = np.linalg.norm(basis @ basis.T, axis=0) > 1.0 - 1e-6
    chosen = list(np.eye(3)[inside])
    rest = basis - sum((np.outer(a, a @ basis) for a in chosen), np.zeros_like(basis))
    left, values, _ = np.linalg.svd(rest)
    chosen += [left[:, k] for k in range(int((values > 1e-6).sum()))]
    return chosen


def _direction(vector: NDArray) -> str:
    axis = int(np.argmax(np.abs(vector)))
    if abs(vector[axis]) > 1.0 - 1e-6:
        return AXES[axis]
    shown = vector / np.abs(vector).max() * (1 if vector[axis] > 0 else -1)
    shown = np.where(np.abs(shown) > FREE, shown, 0.0)
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in shown) + ")"


class Relief:
    """Inertia forces that balance the loads on a case whose supports leave rigid motions free."""

    def __init__(self, case: Case, start: NDArray) -> None:
        self._nodes, self._ties, self._body = case.structure.nodes, case.constraints, case.body
        try:
            self._mass = case.mass
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
        free = case.free_dofs
        first = np.linspace(1.0, 1.0 - TIE, len(free))  # of equally good dofs, the first is chosen
        _, _, order = qr(motions[free].T * first, mode="economic", pivoting=True)
        self.pins = np.sort(free[order[: self._count]])

    def _motions(self, u: NDArray) -> NDArray:
        x, holds = self._nodes + u.reshape(-1, 3), self._body.holds(u)
        return free_rigid_motions(x, self._ties, holds)

    def inertia(self, u: NDArray, force: NDArray) -> NDArray:
        """Inertia forces (3n,), N, that balance forces (3n,) at displacement u (3n,)."""
        motions = self._motions(u)
        if motions.shape[1] != self._count:
            return np.full(len(force), np.nan)  # the supports now hold the turned body
        carried = (self._mass @ motions.reshape(-1, 3 * self._count)).reshape(motions.shape)
        return carried @ np.linalg.solve(motions.T @ carried, motions.T @ force)
