"""The one compiled switch from a law's integer code to its formulas.

A new built-in law has its place in the list of its kind and a line in each function of it. A
user's law is called at `address`; an unknown code, which has none, gives nan (`Law.check` refuses
it earlier). Hinge parameters a, b, c, d are the four columns of `HingeLaw.parameters`.
"""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import inner_scalar, kernel, scalar
from foldyn.jit.intrinsics import call1, call2
from foldyn.materials import enhanced_linear, linear, ogden, plate_superlinear, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE

BAR_LAWS = (ogden.Ogden, linear.LinearBar)
HINGE_LAWS = (
    linear.LinearHinge, superlinear.Superlinear, enhanced_linear.EnhancedLinear,
    plate_superlinear.PlateSuperlinear,
)  # fmt: skip


@inner_scalar
def bar_energy(code, e, address):
    """W / E_y at e = stretch - 1."""
    if code == linear.CODE:
        return linear.bar_energy(e)
    if code == ogden.CODE:
        return ogden.energy(e)
    return call1(address, 1.0 + e) if address != 0 else np.nan


@inner_scalar
def bar_stress(code, e, address):
    """S / E_y at e = stretch - 1."""
    if code == linear.CODE:
        return linear.bar_stress(e)
    if code == ogden.CODE:
        return ogden.stress(e)
    return call1(address, 1.0 + e) if address != 0 else np.nan


@inner_scalar
def bar_slope(code, e, address):
    """(dS/dE) / E_y at e = stretch - 1."""
    if code == linear.CODE:
        return linear.bar_slope(e)
    if code == ogden.CODE:
        return ogden.slope(e)
    return call1(address, 1.0 + e) if address != 0 else np.nan


@inner_scalar
def hinge_energy(code, theta, rest, a, b, c, d, address):
    """Energy / k at dihedral theta."""
    if code == linear.CODE:
        return linear.hinge_energy(theta, rest)
    if code == superlinear.CODE:
        return superlinear.energy(theta, rest)
    if code == plate_superlinear.CODE:
        return plate_superlinear.energy(theta, rest, a)
    if code == AS_PUBLISHED:
        return enhanced_linear.energy(theta, rest, a, b)
    if code == STRESS_FREE:
        return enhanced_linear.energy(theta, rest, a, b) - c * (theta - rest) - d
    return call2(address, theta, rest) if address != 0 else np.nan


@inner_scalar
def hinge_moment(code, theta, rest, a, b, c, d, address):
    """Moment / k at dihedral theta."""
    if code == linear.CODE:
        return linear.hinge_moment(theta, rest)
    if code == superlinear.CODE:
        return superlinear.moment(theta, rest)
    if code == plate_superlinear.CODE:
        return plate_superlinear.moment(theta, rest, a)
    if code == AS_PUBLISHED:
        return enhanced_linear.moment(theta, rest, a, b)
    if code == STRESS_FREE:
        return enhanced_linear.moment(theta, rest, a, b) - c
    return call2(address, theta, rest) if address != 0 else np.nan


@inner_scalar
def hinge_slope(code, theta, rest, a, b, address):
    """Slope of the moment / k at dihedral theta."""
    if code == linear.CODE:
        return 1.0
    if code == superlinear.CODE:
        return superlinear.slope(theta, rest)
    if code == plate_superlinear.CODE:
        return plate_superlinear.slope(theta, rest, a)
    if (code == AS_PUBLISHED) | (code == STRESS_FREE):
        return enhanced_linear.slope(theta, a, b)
    return call2(address, theta, rest) if address != 0 else np.nan


@inner_scalar
def hinge_rest_slope(code, theta, rest, a, b, address):
    """Derivative of energy / k with respect to the rest angle; `address` is that of the energy."""
    if code == linear.CODE:
        return linear.hinge_rest_slope(theta, rest)
    if code == superlinear.CODE:
        return superlinear.rest_slope(theta, rest)
    if code == plate_superlinear.CODE:
        return plate_superlinear.rest_slope(theta, rest, a)
    if code == AS_PUBLISHED:
        return enhanced_linear.rest_slope(theta, rest)
    if code == STRESS_FREE:
        return enhanced_linear.stress_free_rest_slope(theta, rest, a, b)
    if address == 0:
        return np.nan
    h = 1e-5  # error 1e-10 of the energy's third derivative
    return (call2(address, theta, rest + h) - call2(address, theta, rest - h)) / (2.0 * h)


@inner_scalar
def hinge_moment_by(code, theta, rest, a, b, address):
    """Derivatives of the moment / k by the rest angle and by the parameters a, b and c."""
    if code == linear.CODE:
        return -1.0, 0.0, 0.0, 0.0
    if code == superlinear.CODE:
        return -superlinear.slope(theta, rest), 0.0, 0.0, 0.0
    if code == plate_superlinear.CODE:
        by_onset = plate_superlinear.onset_slope(theta, rest, a)
        return -plate_superlinear.slope(theta, rest, a), by_onset, 0.0, 0.0
    if (code == AS_PUBLISHED) | (code == STRESS_FREE):
        by_first, by_second = enhanced_linear.limit_slopes(theta, a, b)
        return -1.0, by_first, by_second, -1.0 if code == STRESS_FREE else 0.0
    if address == 0:
        return np.nan, 0.0, 0.0, 0.0
    h = 1e-5  # error 1e-10 of the moment's third derivative
    by_rest = (call2(address, theta, rest + h) - call2(address, theta, rest - h)) / (2.0 * h)
    return by_rest, 0.0, 0.0, 0.0


@scalar
def move_rest(code, rest, parameters):
    """Set what follows the rest angle in the four parameters of a hinge."""
    if code == STRESS_FREE:
        enhanced_linear.relieve(rest, parameters)


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
    """Rows (8, n) of one law at theta (n,): those of `HingeLaw.functions`, by a, b and c last."""
    out = np.empty((8, theta.size))
    for i in range(theta.size):
        t, r = theta[i], rest[i]
        out[0, i] = hinge_energy(code, t, r, p[i, 0], p[i, 1], p[i, 2], p[i, 3], address[0])
        out[1, i] = hinge_moment(code, t, r, p[i, 0], p[i, 1], p[i, 2], p[i, 3], address[1])
        out[2, i] = hinge_slope(code, t, r, p[i, 0], p[i, 1], address[2])
        out[3, i] = hinge_rest_slope(code, t, r, p[i, 0], p[i, 1], address[0])
        by = hinge_moment_by(code, t, r, p[i, 0], p[i, 1], address[1])
        out[4, i], out[5, i], out[6, i], out[7, i] = by
    return out
