"""Response to a moving base: absolute displacement over that of the base.

With x = t y + z, t the unit translation of all nodes along the axis of the base, y the motion of
the base and z the motion relative to it, the equation of motion M x'' + C x' + K x = 0 on the free
dofs becomes

    M z'' + C z' + K z = -(M t)_f (y'' + alpha y'),

because a translation strains nothing: K t = 0, and so is what beta K0 makes of it. Rayleigh's
alpha M damps the absolute motion, as air does, and therefore drags at the moving body; beta K0
damps the strain. For one mass m on a spring k

    x / y = (k + i w beta k) / (k - w^2 m + i w (alpha m + beta k)),

the textbook formula with c = beta k where alpha = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.supports import AXES
from foldyn.linear.excitation import Drive


def drive_shape(case: Case, drive: Drive) -> NDArray[np.float64]:
    """Load (n, 3) per unit of the drive: forces per N, or masses (kg) that the base accelerates."""
    if drive.axis is None:
        return drive.vector / drive.value
    shape = np.zeros(case.fixed.shape)
    shape[:, AXES.index(drive.axis)] = np.asarray(case.structure.mass.sum(axis=1)).ravel()
    return shape


def drive_factor(case: Case, drive: Drive, omega: float) -> complex:
    """Factor on the shape of the load at an angular frequency (rad/s)."""
    if drive.axis is None:
        return 1.0
    return omega**2 - 1j * omega * case.damping.alpha


def absolute(case: Case, drive: Drive, relative: NDArray) -> NDArray[np.complex128]:
    """Response (m, n, 3) to the drive from that of the free dofs (m, nf), relative to the base."""
    response = np.zeros((len(relative), case.fixed.size), np.complex128)
    response[:, case.free_dofs] = relative
    response = response.reshape(-1, *case.fixed.shape)
    if drive.axis is not None:
        response[:, :, AXES.index(drive.axis)] += 1.0
    return response
