"""Direct frequency response: one complex sparse solution for each frequency."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import FoldynWarning
from foldyn.linear.answer import Answer
from foldyn.linear.excitation import Drive
from foldyn.linear.linearized import Linearized
from foldyn.linear.transmissibility import drive_factor, drive_shape

LOST = 1e-3  # of the response: rounding above which it is a resonance without damping
PIVOT = 0.01  # of the largest entry in a column: what a pivot on the diagonal must have
_EPS = float(np.finfo(np.float64).eps)
_NAMED = 5  # frequencies that a message shows


@dataclass(frozen=True)
class Direct:
    """Options of the direct method: none."""


def direct(
    system: Linearized, drive: Drive, frequency: NDArray, options: Direct, report: Reporter
) -> Answer:
    """Solve (K - w^2 M + i w C) x = f at each frequency.

    The response is nan where the matrix is singular to rounding: at a resonance without damping,
    and at 0 Hz of a body that is free to move.

    Warns
    -----
    FoldynWarning
        There are such frequencies.
    """
    shape = drive_shape(system, drive)
    response = np.empty((len(frequency), len(shape)), np.complex128)
    for k, f in enumerate(frequency):
        omega = 2.0 * np.pi * f
        solution = solve(dynamic_stiffness(system, omega), shape)
        response[k] = solution * drive_factor(system, drive, omega)
        report(Progress(k + 1.0, float(len(frequency)), k + 1, 0.0))
    warn_of_resonances(frequency, response)
    return Answer(response, {}, {})


def dynamic_stiffness(system: Linearized, omega: float) -> sparse.csc_array:
    """K - w^2 M + i w C at an angular frequency (rad/s)."""
    undamped = system.stiffness - omega**2 * system.mass
    return sparse.csc_array(undamped + 1j * omega * system.damping)


def solve(matrix: sparse.csc_array, load: NDArray) -> NDArray[np.complex128]:
    """Solution of a complex symmetric system; nan where rounding leaves nothing of it.

    Rounding changes each entry of the matrix by a part of about eps. What changes of that size, all
    in phase with the solution, do to it is found by one more substitution: near a resonance, where
    the solution is nearly its mode, the worst that can happen.
    """
    lost = np.full(len(load), np.nan, np.complex128)
    try:
        factors = splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=PIVOT,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # exactly singular
        return lost
    solution = factors.solve(load.astype(np.complex128))
    solution += factors.solve(load - matrix @ solution)
    if not np.isfinite(solution).all():
        return lost
    size = np.abs(solution)
    phase = solution / np.where(size > np.finfo(float).tiny, size, 1.0)
    change = factors.solve(_EPS * phase * (abs(matrix) @ size))
    if not np.abs(change).max() <= LOST * size.max():
        return lost
    return solution


def warn_of_resonances(frequency: NDArray, response: NDArray) -> None:
    """Name the frequencies at which there is no response."""
    singular = frequency[np.isnan(response).any(axis=1)]
    if not singular.size:
        return
    shown = ", ".join(f"{f:.6g}" for f in singular[:_NAMED])
    more = " and others" if singular.size > _NAMED else ""
    warnings.warn(
        f"frequencies: there is no response at {shown} Hz{more} (nan): a resonance without "
        "damping, or 0 Hz of a body that is free to move; give the case damping, as "
        "Rayleigh(alpha=...), or leave these frequencies out",
        FoldynWarning,
        stacklevel=4,
    )
