"""Creases in series with compliant panels, where a hinge turns by more than its crease.

Panels that bend like plates also give way at their creases. The dihedral theta of such a hinge is
the dihedral phi of the crease plus the turn of the panels, a linear spring of compliance c. The law
m of the crease (per unit of its stiffness K) and the spring transmit the same moment,

    M = K m(phi) = (theta - phi) / c.

Let s = 1/(1 + c K) be the share of the crease in small turns. Per unit of the stiffness k = K s of
the whole hinge, M / k = m(phi) / s = (theta - phi) / (1 - s). If m is linear, this equals m(theta);
otherwise Newton's method finds phi. A moment Q on the crease alone, which turns phi but not the
panels, acts like Q on the whole hinge with a law that sees theta + c Q.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.law import HingeLaw
from foldyn.materials.linear import CODE as LINEAR
from foldyn.materials.switch import (
    hinge_energy,
    hinge_moment,
    hinge_moment_by,
    hinge_rest_slope,
    hinge_slope,
)

ITERATIONS = 100
ACCURACY = 4e-15  # rad, relative to angles above 1
TWO_PI = 2.0 * math.pi


@inner
def crease_angle(code, theta, rest, a, b, c, d, share, address):
    """Dihedral phi (rad) of the crease of a hinge at theta; nan if Newton's method fails.

    address : (3,) addresses of the law's energy, moment and slope.
    """
    if share == 1.0:
        return theta
    if code == LINEAR:
        return rest + share * (theta - rest)
    locks = (code == STRESS_FREE) | (code == AS_PUBLISHED)  # phi stays between 0 and 2 pi
    soft = (1.0 - share) / share
    phi = share * theta + (1.0 - share) * (rest + c * locks)
    if locks:
        phi = min(max(phi, 1e-3), TWO_PI - 1e-3)
    for _ in range(ITERATIONS):
        beyond = phi - theta + soft * hinge_moment(code, phi, rest, a, b, c, d, address[1])
        slope = 1.0 + soft * hinge_slope(code, phi, rest, a, b, c, d, address[2])
        step = beyond / slope
        if locks:
            step = min(max(step, 0.5 * (phi - TWO_PI)), 0.5 * phi)
        phi -= step
        if abs(step) <= ACCURACY * max(1.0, abs(phi)):
            return phi
    return math.nan


@inner_scalar
def straight(code, share):
    """Whether the crease's law holds for the whole hinge, as panels are stiff or it is linear."""
    return (share == 1.0) | (code == LINEAR)


@inner
def series_energy(code, theta, rest, a, b, c, d, share, address):
    """Energy / k of a hinge at theta, including the energy of the panels."""
    if straight(code, share):
        return hinge_energy(code, theta, rest, a, b, c, d, address[0])
    phi = crease_angle(code, theta, rest, a, b, c, d, share, address)
    own = hinge_energy(code, phi, rest, a, b, c, d, address[0])
    return own / share + 0.5 * (theta - phi) ** 2 / (1.0 - share)


@inner
def series_moment(code, theta, rest, a, b, c, d, share, address):
    """Moment / k of a hinge at theta."""
    if straight(code, share):
        return hinge_moment(code, theta, rest, a, b, c, d, address[1])
    phi = crease_angle(code, theta, rest, a, b, c, d, share, address)
    return hinge_moment(code, phi, rest, a, b, c, d, address[1]) / share


@inner
def series_slope(code, theta, rest, a, b, c, d, share, address):
    """Slope of the moment / k of a hinge at theta."""
    if straight(code, share):
        return hinge_slope(code, theta, rest, a, b, c, d, address[2])
    phi = crease_angle(code, theta, rest, a, b, c, d, share, address)
    own = hinge_slope(code, phi, rest, a, b, c, d, address[2])
    return own / (share + (1.0 - share) * own)


@inner
def series_rest_slope(code, theta, rest, a, b, c, d, share, address):
    """Derivative of energy / k of a hinge with respect to its rest angle."""
    if straight(code, share):
        return hinge_rest_slope(code, theta, rest, a, b, c, d, address[0])
    phi = crease_angle(code, theta, rest, a, b, c, d, share, address)
    return hinge_rest_slope(code, phi, rest, a, b, c, d, address[0]) / share


@inner
def series_derivatives(code, theta, rest, a, b, c, d, share, address):
    """Moment / k of a hinge at theta, its slope, and further derivatives.

    These are the derivatives with respect to the rest angle, the parameters a, b and c, and the
    share.
    """
    phi = theta
    if not straight(code, share):
        phi = crease_angle(code, theta, rest, a, b, c, d, share, address)
    own = hinge_moment(code, phi, rest, a, b, c, d, address[1])
    slope = hinge_slope(code, phi, rest, a, b, c, d, address[2])
    by_rest, by_a, by_b, by_c = hinge_moment_by(code, phi, rest, a, b, c, d, address[1])
    if straight(code, share):
        return own, slope, by_rest, by_a, by_b, by_c, 0.0
    whole = 1.0 / (share + (1.0 - share) * slope)
    by_share = own / share**2 * (slope * whole - 1.0)
    return (
        own / share, slope * whole, by_rest * whole, by_a * whole, by_b * whole, by_c * whole,
        by_share,
    )  # fmt: skip


@kernel
def _table(code, theta, rest, p, share, address):
    out = np.empty((2, theta.size))
    for i in range(theta.size):
        t, r, a, b, c, d = theta[i], rest[i], p[i, 0], p[i, 1], p[i, 2], p[i, 3]
        out[0, i] = series_energy(code, t, r, a, b, c, d, share[i], address)
        out[1, i] = series_moment(code, t, r, a, b, c, d, share[i], address)
    return out


def in_series(
    law: HingeLaw, theta: ArrayLike, rest: ArrayLike, share: ArrayLike
) -> tuple[NDArray, NDArray]:
    """Energy / k (rad^2) and moment / k (rad) of hinges whose crease has a share in small turns.

    theta, rest : dihedrals (rad); arrays that broadcast with the shares.
    """
    arrays = np.broadcast_arrays(theta, rest, share)
    rows = [np.atleast_1d(each) for each in arrays]
    energy, moment = law.each(lambda own, here: _of_one(own, *(each[..., here] for each in rows)))
    return energy.reshape(arrays[0].shape), moment.reshape(arrays[0].shape)


def _of_one(law: HingeLaw, *arrays: NDArray) -> NDArray:
    """Energies and moments (2, ...) of hinges of one law; see `in_series`."""
    # copies: read-only arrays would compile the table again
    flat, at_rest, part = (np.array(each, float, order="C").ravel() for each in arrays)
    parameters = np.ascontiguousarray(law.parameters(at_rest))
    address = np.array(law.addresses or (0, 0, 0), np.int64)
    table = _table(law.code, flat, at_rest, parameters, part, address)
    return table.reshape((2, *arrays[0].shape))
