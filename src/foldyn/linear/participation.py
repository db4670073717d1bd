"""What a mode means for motions of the base: participation factors and effective masses.

With shapes of the modal mass 1, the participation factor along an axis is phi' M r, r the unit
translation of the free dofs along it, and its square the effective mass. Over all modes effective
masses add up to r' M r, the mass that is free to move along the axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.linear.linearized import Linearized


def unit_translations(linear: Linearized) -> NDArray:
    """Unit translations (nf, 3) of the free dofs along x, y, z."""
    on_nodes = linear.free < linear.displacement.size
    return (on_nodes[:, None] & (linear.free[:, None] % 3 == np.arange(3))).astype(float)


def participation_factors(linear: Linearized, shapes: NDArray) -> NDArray:
    """Participation factors (k, 3) of shapes (nf, k) of the modal mass 1."""
    return shapes.T @ (linear.mass @ unit_translations(linear))


def free_mass(linear: Linearized) -> NDArray:
    """Mass (3,), kg, that is free to move along x, y, z."""
    along = unit_translations(linear)
    return np.einsum("ia,ia->a", along, linear.mass @ along)
