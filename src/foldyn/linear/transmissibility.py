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

from foldyn.cases.supports import AXES
from foldyn.linear.excitation import Drive
from foldyn.linear.linearized import Linearized


def drive_shape(system: Linearized, drive: Drive) -> NDArray[np.float64]:
    """Load (nf,) per unit of the drive: forces per N, or masses (kg) that the base accelerates."""
    if drive.axis is None:
        load = drive.vector / drive.value
    else:
        load = np.zeros_like(drive.vector)
        mass = np.asarray(system.case.structure.mass.sum(axis=1)).ravel()
        load[:, AXES.index(drive.axis)] = mass
    shape = np.zeros(len(system.free))
    nodal = system.free < load.size
    shape[nodal] = load.ravel()[system.free[nodal]]
    return shape


def drive_factor(system: Linearized, drive: Drive, omega: float) -> complex:
    """Factor on the shape of the load at an angular frequency (rad/s)."""
    if drive.axis is None:
        return 1.0
    return omega**2 - 1j * omega * system.case.damping.alpha


def absolute(system: Linearized, drive: Drive, relative: NDArray) -> NDArray[np.complex128]:
    """Response (m, n, 3) to the drive from that of the free dofs (m, nf), relative to the base."""
    response = np.zeros((len(relative), drive.vector.size), np.complex128)
    nodal = system.free < drive.vector.size
    response[:, system.free[nodal]] = relative[:, nodal]
    response = response.reshape(-1, *drive.vector.shape)
    if drive.axis is not None:
        response[:, :, AXES.index(drive.axis)] += 1.0
    return response
