"""The compiled switch from a law's integer code to the formulas of that law.

A new built-in law is added to the list of its kind; the switch consists of the formulas that laws
declare. A user's law is called at `address`; an unknown code without an address gives nan
(`Law.check` refuses it earlier). Hinge parameters a, b, c, d are the four columns of
`HingeLaw.parameters`.
"""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.intrinsics import call1, call2
from foldyn.jit.switches import by_code, switch
from foldyn.materials import enhanced_linear, linear, ogden, plate_superlinear, superlinear

BAR_LAWS = (ogden.Ogden, linear.LinearBar)
HINGE_LAWS = (
    linear.LinearHinge, superlinear.Superlinear, enhanced_linear.EnhancedLinear,
    plate_superlinear.PlateSuperlinear,
)  # fmt: skip
BARS, HINGES = (
    by_code({law.__name__: law.formulas for law in laws}) for laws in (BAR_LAWS, HINGE_LAWS)
)
_HINGE = "code, theta, rest, a, b, c, d, address"


@inner_scalar
def _by_rest(address, theta, rest):
    if address == 0:
        return np.nan
    h = 1e-5  # the error is 1e-10 times the third derivative
    return (call2(address, theta, rest + h) - call2(address, theta, rest - h)) / (2.0 * h)


# W, S and dS/dE per unit modulus at e = stretch - 1
bar_energy, bar_stress, bar_slope = (
    switch(
        __name__, f"bar_{name}", "code, e, address",
        {code: ("{0}(e)", (getattr(law, name),)) for code, law in BARS.items()},
        ("{0}(address, 1.0 + e) if address != 0 else nan", (call1,)),
    )
    for name in ("energy", "stress", "slope")
)  # fmt: skip
# energy, moment and slope of the moment per unit stiffness at the dihedral theta
hinge_energy, hinge_moment, hinge_slope = (
    switch(
        __name__, f"hinge_{name}", _HINGE, {code: law.value(name) for code, law in HINGES.items()},
        ("{0}(address, theta, rest) if address != 0 else nan", (call2,)),
    )
    for name in ("energy", "moment", "slope")
)  # fmt: skip
# derivative of the energy with respect to the rest angle; `address` is the energy's
hinge_rest_slope = switch(
    __name__, "hinge_rest_slope", _HINGE,
    {code: law.energy_slope() for code, law in HINGES.items()},
    ("{0}(address, theta, rest)", (_by_rest,)),
)  # fmt: skip
# derivatives of the moment with respect to the rest angle and to a, b and c; `address` is the
# moment's
hinge_moment_by = switch(
    __name__, "hinge_moment_by", _HINGE,
    {code: law.moment_slopes() for code, law in HINGES.items()},
    ("({0}(address, theta, rest), 0.0, 0.0, 0.0)", (_by_rest,)),
)  # fmt: skip
# sets the parameters of a hinge that follow its rest angle
move_rest = switch(
    __name__, "move_rest", "code, rest, parameters",
    {
        code: ("{0}(rest, parameters)", (law.follow,))
        for code, law in HINGES.items() if law.follow is not None
    },
    ("None", ()),
)  # fmt: skip


@kernel
def bar_table(code, e, address):
    """Rows (3, n) of one law at e (n,): energy, stress and slope."""
    out = np.empty((3, e.size))
    for i in range(e.size):
        out[0, i] = bar_energy(code, e[i], address[0])
        out[1, i] = bar_stress(code, e[i], address[1])
        out[2, i] = bar_slope(code, e[i], address[2])
    return out


@kernel
def hinge_slopes(code, theta, rest, p, address):
    """Slopes (1, n) of one law at theta (n,)."""
    out = np.empty((1, theta.size))
    for i in range(theta.size):
        a, b, c, d = p[i, 0], p[i, 1], p[i, 2], p[i, 3]
        out[0, i] = hinge_slope(code, theta[i], rest[i], a, b, c, d, address[2])
    return out


@kernel
def hinge_table(code, theta, rest, p, address):
    """Rows (7, n) of one law at theta (n,): energy, moment, and derivatives.

    These are the derivative of the energy with respect to the rest angle, and the derivatives of
    the moment with respect to the rest angle and to a, b and c.
    """
    out = np.empty((7, theta.size))
    for i in range(theta.size):
        t, r, a, b, c, d = theta[i], rest[i], p[i, 0], p[i, 1], p[i, 2], p[i, 3]
        out[0, i] = hinge_energy(code, t, r, a, b, c, d, address[0])
        out[1, i] = hinge_moment(code, t, r, a, b, c, d, address[1])
        out[2, i] = hinge_rest_slope(code, t, r, a, b, c, d, address[0])
        by = hinge_moment_by(code, t, r, a, b, c, d, address[1])
        out[3, i], out[4, i], out[5, i], out[6, i] = by
    return out
