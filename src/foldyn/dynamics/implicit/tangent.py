"""Tangent stiffness of an iteration: floored slopes, and bar stresses that Newton's method can use.

Newton's method moves nodes along straight lines, which stretches turning bars to second order; the
huge spurious stresses must not enter the next matrix. The stresses of the start of the step, and
after the first iteration those extrapolated from the last one (see `statics.mixed`), take their
place there. The residual never sees any of this.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import kernel
from foldyn.materials.switch import bar_slope, bar_stress
from foldyn.mechanics import BarsHinges, Sparsity, add_tangent
from foldyn.mechanics.energy import bar_extension
from foldyn.statics.body import FLOOR


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
