"""Dihedrals of hinges and their gradients at given positions, without a model."""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import kernel
from foldyn.mechanics.dihedral import dihedral_gradient


@kernel
def dihedrals_and_gradients(x, hinges):
    """Dihedrals (nh,), rad, of hinge rows (nh, 4) at positions x (n, 3); gradients (nh, 12), 1/m.

    A gradient is that with respect to the nodes j, k, i, l.
    """
    angle, gradient = np.empty(hinges.shape[0]), np.empty((hinges.shape[0], 12))
    for e in range(hinges.shape[0]):
        j, k, i, l = hinges[e, 0], hinges[e, 1], hinges[e, 2], hinges[e, 3]  # noqa: E741
        found = dihedral_gradient(
            x[j, 0], x[j, 1], x[j, 2], x[k, 0], x[k, 1], x[k, 2],
            x[i, 0], x[i, 1], x[i, 2], x[l, 0], x[l, 1], x[l, 2],
        )  # fmt: skip
        angle[e] = found[0]
        for c in range(12):
            gradient[e, c] = found[c + 1]
    return angle, gradient
