"""The one compiled switch from a law's integer code to its formulas.

A new built-in law adds one line to each function here. Negative codes are user laws, called at
`address`. Hinge parameters a, b, c, d are the four columns of `HingeLaw.parameters`.
"""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import kernel, scalar
from foldyn.materials import enhanced_linear, linear, ogden, superlinear
from foldyn.materials.call import call1, call2


@scalar
def bar_energy(code, e, address):
    """W / E_y at e = stretch - 1."""
    if code == 0:
        return linear.bar_energy(e)
    if code == 1:
        return ogden.energy(e)
    return call1(address, 1.0 + e)


@scalar
def bar_stress(code, e, address):
    """S / E_y at e = stretch - 1."""
    if code == 0:
        return linear.bar_stress(e)
    if code == 1:
        return ogden.stress(e)
    return call1(address, 1.0 + e)


@scalar
def bar_slope(code, e, address):
    """(dS/dE) / E_y at e = stretch - 1."""
    if code == 0:
        return linear.bar_slope(e)
    if code == 1:
        return ogden.slope(e)
    return call1(address, 1.0 + e)


@scalar
def hinge_energy(code, theta, rest, a, b, c, d, address):
    """Energy / k at dihedral theta."""
    if code == 0:
        return linear.hinge_energy(theta, rest)
    if code == 1:
        return superlinear.energy(theta, rest)
    if code == 2:
        return enhanced_linear.energy(theta, rest, a, b) - c * (theta - rest) - d
    return call2(address, theta, rest)


@scalar
def hinge_moment(code, theta, rest, a, b, c, d, address):
    """Moment / k at dihedral theta."""
    if code == 0:
        return linear.hinge_moment(theta, rest)
    if code == 1:
        return superlinear.moment(theta, rest)
    if code == 2:
        return enhanced_linear.moment(theta, rest, a, b) - c
    return call2(address, theta, rest)


@scalar
def hinge_slope(code, theta, rest, a, b, address):
    """Slope of the moment / k at dihedral theta."""
    if code == 0:
        return 1.0
    if code == 1:
        return superlinear.slope(theta, rest)
    if code == 2:
        return enhanced_linear.slope(theta, a, b)
    return call2(address, theta, rest)


@scalar
def hinge_rest_slope(code, theta, rest, a, b, stress_free, address):
    """Derivative of energy / k with respect to the rest angle; `address` is that of the energy.

    stress_free : whether the enhanced law's moment and energy at rest are subtracted.
    """
    if code == 1:
        return -superlinear.moment(theta, rest)
    if code == 2 and stress_free:
        return enhanced_linear.slope(rest, a, b) * (rest - theta)
    if code >= 0:
        return rest - theta
    h = 1e-5  # error 1e-10 of the energy's third derivative
    return (call2(address, theta, rest + h) - call2(address, theta, rest - h)) / (2.0 * h)


@kernel
def bar_table(code, e, address):
    """Energy, stress and slope rows (3, n) of one law at e (n,)."""
    out = np.empty((3, e.size))
    for i in range(e.size):
        out[0, i] = bar_energy(code, e[i], address[0])
        out[1, i] = bar_stress(code, e[i], address[1])
        out[2, i] = bar_slope(code, e[i], address[2])
    return out


@kernel
def hinge_table(code, theta, rest, p, address):
    """Energy, moment and slope rows (3, n) of one law at theta (n,)."""
    out = np.empty((3, theta.size))
    for i in range(theta.size):
        t, r = theta[i], rest[i]
        out[0, i] = hinge_energy(code, t, r, p[i, 0], p[i, 1], p[i, 2], p[i, 3], address[0])
        out[1, i] = hinge_moment(code, t, r, p[i, 0], p[i, 1], p[i, 2], p[i, 3], address[1])
        out[2, i] = hinge_slope(code, t, r, p[i, 0], p[i, 1], address[2])
    return out
