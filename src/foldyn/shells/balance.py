"""The rotations of a shell that belong to displacements of its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import ComputationError
from foldyn.shells.kernels import ShellModel, shell_force, shell_work
from foldyn.shells.sparsity import ShellPattern
from foldyn.shells.tangent import shell_tangent

ITERATIONS = 50
BALANCED = 1e-13  # rad, of the last step
FLOOR = 1e-3  # of a fold's stiffness: its least slope in these steps


def balanced_rotations(model: ShellModel, pattern: ShellPattern, u: NDArray) -> NDArray:
    """Dofs (r,), m, of the rotations without moment at displacement u (n, 3), by Newton's method.

    Raises
    ------
    ComputationError
        There are none near zero.
    """
    work, x = shell_work(model), np.zeros(model.rotations)
    force, couple = np.empty_like(u), np.empty_like(x)
    for _ in range(ITERATIONS):
        shell_force(model, u, x, force, couple, work)
        if not couple.any():
            return x
        stiffness = shell_tangent(model, pattern, u, x, work, FLOOR)[u.size :][:, u.size :]
        step = splu(sparse.csc_array(stiffness)).solve(-couple)
        x = x + step
        if model.per_reach * np.abs(step).max(initial=0.0) <= BALANCED:
            return x
    raise ComputationError("the rotations of the shell find no balance at this displacement")
