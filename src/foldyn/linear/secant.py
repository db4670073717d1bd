"""Equivalent slope of the superlinear law for an oscillation of finite amplitude.

A hinge that swings about its angle in the state, d = d0 + A cos(phi) from its rest angle, has the
moment M(d) = k sgn(d) |d|^p with p = 4/3. The harmonic in phase with the motion is that of a linear
hinge with the slope

    k_eq = (1 / (pi A)) int_0^2pi M(d0 + A cos phi) cos phi dphi = k A^(1/3) g(|d0| / A)

(describing function; harmonic balance: Krylov and Bogoliubov, Introduction to Non-linear
Mechanics, 1947). The integral is a Gauss hypergeometric function of a = |d0| / A:

    a <= 1:  g = 2/sqrt(pi) Gamma(p/2 + 1) / Gamma(p/2 + 3/2) F((1-p)/2, -(1+p)/2; 1/2; a^2)
    a >= 1:  g = p a^(p-1) F((1-p)/2, (2-p)/2; 2; 1/a^2)

About rest k_eq = 0.941 k A^(1/3), where the chord to the largest moment has k A^(1/3); far from
rest it is the slope there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gamma, hyp2f1

POWER = 4.0 / 3.0
AT_REST = float(2.0 / np.sqrt(np.pi) * gamma(0.5 * POWER + 1.0) / gamma(0.5 * POWER + 1.5))


def equivalent_slope(offset: ArrayLike, amplitude: float) -> NDArray:
    """Slope / k of the superlinear law equivalent to an oscillation (describing function).

    Parameters
    ----------
    offset : array_like
        Angles (rad) of the state from the rest angle, d0.
    amplitude : float
        Amplitude A (rad) of the oscillation about it.

    Returns
    -------
    ndarray
        k_eq / k, of the shape of `offset`.
    """
    ratio = np.abs(np.asarray(offset, float)) / amplitude
    inside = np.minimum(ratio, 1.0)
    outside = np.maximum(ratio, 1.0)
    near = AT_REST * hyp2f1(0.5 * (1.0 - POWER), -0.5 * (1.0 + POWER), 0.5, inside**2)
    far = POWER * outside ** (POWER - 1.0)
    far = far * hyp2f1(0.5 * (1.0 - POWER), 0.5 * (2.0 - POWER), 2.0, outside**-2.0)
    return amplitude ** (POWER - 1.0) * np.where(ratio <= 1.0, near, far)
