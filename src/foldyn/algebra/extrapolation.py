"""Limits of values on finer and finer meshes (Richardson's extrapolation).

With n pieces of every edge, an error of order p is c n^-p. If the order is known, two meshes give
the limit. Three meshes with n1 < n2 < n3 pieces also give the observed order p:

    (f2 - f1) / (f3 - f2) = (n1^-p - n2^-p) / (n2^-p - n3^-p).

An error estimate is only possible for meshes whose observed order is about 2, the order of the
elements (Roache, Annu. Rev. Fluid Mech. 29, 1997; Eca and Hoekstra, J. Comput. Phys. 262, 2014). If
errors of opposite signs compete, changes far from the limit may be small or have any sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

ORDER = 2.0  # order of the elements
LEAST, MOST = 1.0, 3.0  # range of observed orders that are close enough to it
SETTLED = 1e-3  # changes below this share of the value show no order


class Convergence(NamedTuple):
    """Observed order and limit on three meshes.

    Attributes
    ----------
    order : (k,)
        Observed order; 2 for values that hardly change; nan if it is not between 1 and 3, as the
        meshes have then not converged.
    limit : (k,)
        Limit of the values; nan if the order is nan.
    """

    order: NDArray[np.float64]
    limit: NDArray[np.float64]


def extrapolated(coarse: Any, fine: Any, ratio: float, order: Any = ORDER) -> Any:
    """Limit of values on two meshes; the fine mesh has `ratio` times the divisions."""
    return fine + (fine - coarse) / (ratio**order - 1.0)


def convergence(values: ArrayLike, divisions: Sequence[int]) -> Convergence:
    """Observed order and limit of values (3, k) on meshes with increasing divisions.

    For the limit, orders above 2 count as 2, which overestimates the error.
    """
    first, second, third = np.asarray(values, float)
    early, late = second - first, third - second
    order = np.array([_observed(*both, divisions) for both in zip(early, late, strict=True)])
    settled = np.maximum(np.abs(early), np.abs(late)) <= SETTLED * np.abs(third)
    order = np.where(settled, ORDER, order)
    ratio = divisions[2] / divisions[1]
    return Convergence(order, extrapolated(second, third, ratio, np.minimum(order, ORDER)))


def limits(values: ArrayLike, divisions: Sequence[int], *, observed: bool) -> NDArray[np.float64]:
    """Limits of values (3, k) by the order of the elements, or by the observed order if known.

    Elements reach their order on even meshes without singularities.
    """
    _, second, third = np.asarray(values, float)
    limit = extrapolated(second, third, divisions[2] / divisions[1])
    shown = convergence(values, divisions).limit
    return np.where(observed & ~np.isnan(shown), shown, limit)


def doubt(values: ArrayLike, divisions: Sequence[int]) -> NDArray[np.float64]:
    """Estimated relative errors (k,) of limits that use the observed order.

    Each is the largest of three numbers: the distance to the limit by the order of the elements, a
    quarter of the error of the finest mesh (Roache's factor of safety 1.25), and a thousandth, as
    such small changes show no order. If the meshes have not converged, it is the range of values.
    """
    values = np.asarray(values, float)
    limit = limits(values, divisions, observed=True)
    known = limits(values, divisions, observed=False)
    found = np.maximum(np.abs(limit - known), 0.25 * np.abs(values[2] - limit))
    lost = np.isnan(convergence(values, divisions).order)
    return np.maximum(np.where(lost, np.ptp(values, axis=0), found) / np.abs(limit), SETTLED)


def _observed(early: float, late: float, divisions: Sequence[int]) -> float:
    """Observed order for two changes; nan if it is not close to the order of the elements."""

    def miss(order: float) -> float:
        one, two, three = (float(n) ** -order for n in divisions)
        return early * (two - three) - late * (one - two)

    if not miss(LEAST) * miss(MOST) < 0.0:
        return np.nan
    from scipy.optimize import brentq  # the import takes a tenth of a second and is rarely needed

    return float(brentq(miss, LEAST, MOST))
