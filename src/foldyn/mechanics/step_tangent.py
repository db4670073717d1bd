"""Tangent for steps of Newton's method: floored slopes, and bar stresses that it can use.

As a sheet bends, panels turn far while their bars hardly stretch. A step of Newton's method moves
nodes along straight lines, which stretches turning bars to second order, and the huge spurious
stresses would sit in the geometric stiffness of the next step: convergence would be slow, worse so
the more slender the sheet. If the bars' stresses are unknowns of their own, Newton's method for
both gives, after these are eliminated, the same equations for the displacements but with a
geometric stiffness from

    S = S(u0) + S'(u0) (D0 . d) / L^2,    d the step from u0 to u of a bar with vector D0,

which knows nothing of the second order (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
Eng. 313, 2017). The residual is that of the displacements and never sees any of this, so the
solution is the same, and convergence is quadratic as before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import kernel
from foldyn.materials.switch import bar_slope, bar_stress
from foldyn.mechanics.energy import bar_extension
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.tangent import Sparsity, add_tangent

FLOOR = 1e-3  # of a hinge's stiffness: its least slope in steps, as in MERLIN2


def put_tangent(
    model: BarsHinges, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
) -> None:
    """Tangent blocks (nnz, 3, 3) at displacement u (n, 3), with bar stresses from `before`.

    Parameters
    ----------
    model, pattern
    u, before : ndarray, shape (n, 3)
        The iterate; the start of the step, or, `again`, the last iterate, from which stresses are
        extrapolated to u.
    again : bool
    out : ndarray, shape (nnz, 3, 3)
    """
    out[:] = 0.0
    add_floored_tangent(model, pattern, u, out)
    stress = np.empty(len(model.bars))
    expected_stress(model, u, before, again, stress)
    _replace_stress(model, u, stress, pattern.bar_slots, out)


def add_floored_tangent(model: BarsHinges, pattern: Sparsity, u: NDArray, out: NDArray) -> None:
    """Add tangent blocks with slopes of the built-in laws of at least `FLOOR` times the stiffness.

    Those of a user's law, which may fall on purpose, stay.
    """
    runs = model.hinge_runs
    own = runs[:, 2] < 0
    add_tangent(model._replace(hinge_runs=runs[~own]), pattern, u, FLOOR, out)
    if own.any():
        exact = model._replace(hinge_runs=runs[own], bar_runs=model.bar_runs[:0])
        add_tangent(exact, pattern, u, -np.inf, out)


@kernel
def expected_stress(model, u, before, again, out):
    """Stress S / E_y of the bars (nb,) at `before`, or `again` extrapolated from there to u."""
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            a, b = model.bars[e, 0], model.bars[e, 1]
            x = bar_extension(model, before, e)
            out[e] = bar_stress(code, x, address[1])
            if again:
                along = 0.0
                for c in range(3):
                    d = before[b, c] - before[a, c]
                    along += (model.bar_vector[e, c] + d) * (u[b, c] - u[a, c] - d)
                out[e] += bar_slope(code, x, address[2]) * along * model.bar_per_length2[e]


@kernel
def _replace_stress(model, u, stress, slots, data):
    """Replace the bars' stresses in blocks at u by `stress` (nb,)."""
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            value = stress[e] - bar_stress(code, bar_extension(model, u, e), address[1])
            value *= model.bar_stiffness[e]
            for c in range(3):
                data[slots[e, 0, 0], c, c] += value
                data[slots[e, 1, 1], c, c] += value
                data[slots[e, 0, 1], c, c] -= value
                data[slots[e, 1, 0], c, c] -= value
