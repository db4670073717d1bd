"""Direct frequency response: one complex sparse solution for each frequency."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.complex_symmetric import solve
from foldyn.dynamics import Progress
from foldyn.dynamics.progress import Reporter
from foldyn.errors import FoldynWarning
from foldyn.linear.answer import Answer
from foldyn.linear.excitation import Drive
from foldyn.linear.linearized import Linearized
from foldyn.linear.transmissibility import drive_factor, drive_shape

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
