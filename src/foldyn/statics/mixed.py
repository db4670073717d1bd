"""Bar stresses extrapolated along the last step: Newton's method on a mixed form.

As a sheet bends, panels turn far while their bars hardly stretch. A step of Newton's method moves
nodes along straight lines, which stretches turning bars to second order, and the huge spurious
stresses then sit in the geometric stiffness of the next step: convergence is slow, worse so the
more slender the sheet. If the bars' stresses are unknowns of their own, Newton's method for both
gives, after these are eliminated, the same equations for the displacements but with a geometric
stiffness from

    S = S(u0) + S'(u0) (D0 . d) / L^2,    d the step from u0 to u of a bar with vector D0,

which knows nothing of the second order (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
Eng. 313, 2017). The residual is that of the displacements, so the solution is the same, and
convergence is quadratic as before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.materials import BarLaw
from foldyn.mechanics import BarsHinges, Sparsity


def add_extrapolated_stress(
    model: BarsHinges, pattern: Sparsity, law: BarLaw, u: NDArray, before: NDArray, data: NDArray
) -> None:
    """Replace the bars' stresses in the blocks of a tangent at u by those extrapolated to it.

    u, before : (n, 3) states after and before the last step; data : (nnz, 3, 3) blocks.
    """
    old, new = _relative(model, before), _relative(model, u)
    stretch = 1.0 + _extension(model, old)
    along = np.einsum("ij,ij->i", model.bar_vector + old, new - old) * model.bar_per_length2
    stress = law.stress(stretch) + law.slope(stretch) * along
    excess = model.bar_stiffness * (stress - law.stress(1.0 + _extension(model, new)))
    signs = np.array([[1.0, -1.0], [-1.0, 1.0]])
    weight = excess[:, None, None] * signs  # (nb, 2, 2) on the diagonals of the 3x3 blocks
    sums = np.bincount(pattern.bar_slots.ravel(), weight.ravel(), minlength=len(data))
    data[:, range(3), range(3)] += sums[:, None]


def _relative(model: BarsHinges, u: NDArray) -> NDArray:
    return u[model.bars[:, 1]] - u[model.bars[:, 0]]


def _extension(model: BarsHinges, apart: NDArray) -> NDArray:
    """Stretch less one of bars whose ends have moved apart by (nb, 3), without cancellation."""
    x = np.einsum("ij,ij->i", apart, 2.0 * model.bar_vector + apart) * model.bar_per_length2
    return x / (1.0 + np.sqrt(1.0 + x))
