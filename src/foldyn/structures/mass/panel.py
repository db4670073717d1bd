"""Rule `panel`: equal shares of a panel's mass for all its nodes, the center included."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from foldyn.structures.mass.surface import Surface, lumped


def panel(surface: Surface) -> sparse.csr_array:
    """Equal shares for all nodes of a panel (Herkal et al., section 3)."""
    mass = np.zeros(len(surface.nodes))
    for face, center, total in zip(
        surface.faces, surface.centers.tolist(), surface.panel_mass, strict=True
    ):
        nodes = [*face, center] if center >= 0 else list(face)
        mass[nodes] += total / len(nodes)
    return lumped(mass)
