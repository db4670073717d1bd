"""Tangent of a shell for steps of Newton's method: what `mechanics.step_tangent` is for bars.

The strains that panels get from being moved along straight lines, of second order in their turn,
are kept out of the geometric stiffness of the next step; the residual sees the true ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.step_tangent import FLOOR
from foldyn.shells.kernels import ShellModel, ShellWork
from foldyn.shells.sparsity import ShellPattern
from foldyn.shells.tangent import shell_tangent


def shell_step_tangent(
    model: ShellModel, pattern: ShellPattern, u: NDArray, x: NDArray, work: ShellWork,
    before: NDArray | None,
) -> sparse.csr_array:  # fmt: skip
    """Tangent at displacements u (n, 3) and rotations x (r,), after a step from `before` (n, 3)."""
    own = model.code < 0  # slopes of a user's law may fall on purpose
    matrix = shell_tangent(model, pattern, u, x, work, -np.inf if own else FLOOR)
    if before is not None:
        add_extrapolated_strain(model, pattern, u, before, matrix.data)
    return matrix


def add_extrapolated_strain(
    model: ShellModel, pattern: ShellPattern, u: NDArray, before: NDArray, data: NDArray
) -> None:
    """Replace the stresses in a tangent's entries `data` at u by those extrapolated to it.

    u, before : (n, 3) states after and before the last step.
    """
    old, new = _apart(model, before), _apart(model, u)
    # e(u) - e(u0) - (D0 . d) / L^2 = |d|^2 / (2 L^2)
    second = 0.5 * np.einsum("tki,tki->tk", new - old, new - old) * model.per_length2
    excess = -np.einsum("tkl,tl->tk", model.membrane, second) * model.per_length2
    dof = pattern.triangle_dof[:, :3]
    diagonal = pattern.indptr[dof + 1] - pattern.indptr[dof] + 1  # from (0, 0) to (1, 1) of a block
    slots, values = [], []
    for k in range(3):
        ends = (k, (k + 1) % 3)
        for one in ends:
            for other in ends:
                for axis in range(3):
                    slots.append(pattern.triangle[:, one, other] + axis * diagonal[:, one])
                    values.append(excess[:, k] if one == other else -excess[:, k])
    data += np.bincount(np.concatenate(slots), np.concatenate(values), len(data))


def _apart(model: ShellModel, u: NDArray) -> NDArray:
    """Relative displacements (nt, 3, 3) of the ends of the sides."""
    return u[np.roll(model.triangles, -1, axis=1)] - u[model.triangles]
