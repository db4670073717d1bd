"""Rigid motions: which ones supports leave free, and their names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FREE = 1e-9  # of a rigid motion's size: what held dofs may move in it
AXES = "xyz"


def rigid_motions(x: NDArray) -> NDArray:
    """Translations along and small rotations about x, y, z (3n, 6) of points x (n, 3).

    Rotations are about the mean point and per unit of size, so that all six are alike in size.
    """
    arm = x - x.mean(axis=0)
    size = float(np.sqrt((arm**2).sum() / max(len(x), 1))) or 1.0
    motions = np.zeros((len(x), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arm / size)
    return motions.reshape(-1, 6)


def free_rigid_motions(x: NDArray, held: NDArray) -> NDArray:
    """Rigid motions (3n, r) of points x (n, 3) that leave the dofs of the mask held (3n,) still."""
    motions = rigid_motions(x)
    return motions @ _free_space(motions, held)


def _free_space(motions: NDArray, held: NDArray) -> NDArray:
    """Combinations (6, r) of the rigid motions that leave held dofs still, but not everything."""
    _, values, right = np.linalg.svd(np.linalg.qr(motions[held], mode="r"))
    rank = int((values > FREE * np.sqrt(held.sum())).sum())
    space = right[rank:].T
    # points on a line stand still as it turns about itself
    _, values, right = np.linalg.svd(motions @ space, full_matrices=False)
    return space @ right[values > FREE * np.sqrt(len(motions))].T


def name_rigid_motions(x: NDArray, held: NDArray) -> list[str]:
    """Free rigid motions in words, such as "translation along x" and "rotation about y"."""
    motions = rigid_motions(x)
    space = _free_space(motions, held)
    if not space.size:
        return []
    # rotations last: those that remain once the translations are taken out
    still = space @ _null_directions(space[3:])
    names = [f"translation along {_direction(t)}" for t in _tidy(still[:3])]
    turning = _tidy(_range_directions(space[3:]))
    names += [f"rotation about {_direction(w)}" for w in turning]
    return names


def _null_directions(block: NDArray) -> NDArray:
    """Combinations of the columns of a (3, r) block that vanish."""
    _, values, right = np.linalg.svd(block, full_matrices=True)
    rank = int((values > 1e-8).sum())
    return right[rank:].T


def _range_directions(block: NDArray) -> NDArray:
    left, values, _ = np.linalg.svd(block)
    return left[:, : int((values > 1e-8).sum())]


def _tidy(directions: NDArray) -> list[NDArray]:
    """A basis of the span of columns (3, k), along the axes as far as they lie in it."""
    if not directions.size:
        return []
    basis, _ = np.linalg.qr(directions)
    chosen: list[NDArray] = []
    for axis in np.eye(3):
        if np.linalg.norm(basis @ (basis.T @ axis)) > 1.0 - 1e-6:
            chosen.append(axis)
    rest = basis - sum((np.outer(a, a @ basis) for a in chosen), np.zeros_like(basis))
    left, values, _ = np.linalg.svd(rest)
    chosen += [left[:, k] for k in range(int((values > 1e-6).sum()))]
    return chosen


def _direction(vector: NDArray) -> str:
    axis = int(np.argmax(np.abs(vector)))
    if abs(vector[axis]) > 1.0 - 1e-6:
        return AXES[axis]
    shown = vector / np.abs(vector).max() * (1 if vector[axis] > 0 else -1)
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in shown) + ")"
