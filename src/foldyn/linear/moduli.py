"""Moduli and Poisson's ratios of equivalent plates, beams and solids, from their stiffness."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

PAIRS = np.array([(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)])  # of directions
ANGLES = np.linspace(0.0, 180.0, 181)  # degrees
SOFT = 1e-12  # stiffness of a strain, relative to the stiffest, below which it counts as zero
BOUNDLESS = 1e60  # stands for an infinite compliance, m/N or 1/(N m)
NOISE = 1e-6  # shares of a strain below this are round-off


def of_plate(matrix: NDArray, loads: NDArray) -> dict[str, Any]:
    """Variables of a plate, from its stiffness (6, 6) and mean loads (6,)."""
    membrane, coupling, bending = matrix[:3, :3], matrix[:3, 3:], matrix[3:, 3:]
    square = ("load", "strain")
    found: dict[str, Any] = {
        "membrane": (square, membrane, {"units": "N/m"}),
        "coupling": (square, coupling, {"units": "N"}),
        "bending": (square, bending, {"units": "N m"}),
        "mean_force": ("load", loads[:3], {"units": "N/m"}),
        "mean_moment": ("load", loads[3:], {"units": "N"}),
    }
    free = bending - coupling.T @ np.linalg.pinv(membrane, SOFT, hermitian=True) @ coupling
    for name, shear, unit, eased in (
        ("", "shear_modulus", "N/m", compliance(membrane)),
        ("bending_", "twisting_modulus", "N m", compliance(free)),
    ):
        found |= {
            f"{name}modulus": ("direction", modulus(np.diag(eased)[:2]), {"units": unit}),
            f"{name}poissons_ratio": (
                "direction", -eased[[1, 0], [0, 1]] / np.diag(eased)[:2], {"units": "1"},
            ),
            shear: ((), modulus(eased[2, 2]), {"units": unit}),
            f"{name}modulus_along": ("angle", modulus(along_directions(eased)), {"units": unit}),
        }  # fmt: skip
    return found


def of_beam(matrix: NDArray, loads: NDArray) -> dict[str, Any]:
    """Variables of a beam, from its stiffness (4, 4) and mean loads (4,)."""
    across = matrix[2:, 2:] - np.outer(matrix[2:, 0], matrix[0, 2:]) / matrix[0, 0]
    return {
        "stiffness": (("load", "strain"), matrix, {"units": "N, N m, N m2"}),
        "mean_load": ("load", loads, {"units": "N, N m"}),
        "axial_stiffness": ((), matrix[0, 0], {"units": "N"}),
        "torsional_stiffness": ((), matrix[1, 1], {"units": "N m2"}),
        "stretch_twist": ((), matrix[0, 1], {"units": "N m"}),
        "bending_stiffness": ("bend", np.linalg.eigvalsh(across), {"units": "N m2"}),
    }


def of_solid(matrix: NDArray, loads: NDArray) -> dict[str, Any]:
    """Variables of a solid, from its stiffness (6, 6), Pa, and mean stress (6,)."""
    eased = compliance(matrix)
    own = np.diag(eased)
    first, across = PAIRS.T
    return {
        "stiffness": (("load", "strain"), matrix, {"units": "Pa"}),
        "mean_load": ("load", loads, {"units": "Pa"}),
        "modulus": ("direction", modulus(own[:3]), {"units": "Pa"}),
        "poissons_ratio": ("pair", -eased[across, first] / own[first], {"units": "1"}),
        "shear_modulus": ("plane", modulus(own[3:]), {"units": "Pa"}),
    }


def compliance(stiffness: NDArray) -> NDArray[np.float64]:
    """Inverse (n, n), with `BOUNDLESS` for a strain that costs no energy; nan if several do not."""
    values, ways = np.linalg.eigh(stiffness)
    size = np.abs(values)
    soft = size <= SOFT * size.max()
    if soft.sum() > 1:
        return np.full_like(stiffness, np.nan)
    ways[:, soft] *= np.abs(ways[:, soft]) > NOISE
    return (ways / np.where(soft, 1.0 / BOUNDLESS, values)) @ ways.T


def modulus(eased: NDArray) -> NDArray[np.float64]:
    """Moduli of compliances; 0 for boundless ones."""
    return np.where(eased > NOISE**2 * BOUNDLESS, 0.0, 1.0 / eased)


def along_directions(eased: NDArray) -> NDArray[np.float64]:
    """Compliance along directions at `ANGLES` from x, from a compliance (3, 3)."""
    c, s = np.cos(np.radians(ANGLES)), np.sin(np.radians(ANGLES))
    load = np.array([c * c, s * s, c * s])
    return np.einsum("ia,ij,ja->a", load, eased, load)
