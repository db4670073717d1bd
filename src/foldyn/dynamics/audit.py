"""Energy audit: kinetic + strain + dissipated - work stays what it was at the start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# columns of the energy table that the compiled loops fill
AUDITED = ("strain_bars", "strain_folds", "strain_bends", "kinetic", "dissipated", "work")


def audited(groups: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the columns for a structure with these groups of strain energy."""
    return (*groups, *AUDITED[3:])


def energy_error(energy: NDArray) -> NDArray:
    """Kinetic + strain + dissipated - work minus its first value (J), per sample."""
    balance = energy[:, :5].sum(axis=1) - energy[:, 5]
    return balance - balance[0]


def energy_scale(energy: NDArray) -> float:
    """Largest energy at play (J): kinetic, change of strain, dissipated or work."""
    strain = energy[:, :3].sum(axis=1)
    moving = np.column_stack([strain - strain[0], energy[:, 3:]])
    return float(np.nanmax(np.abs(moving)))
