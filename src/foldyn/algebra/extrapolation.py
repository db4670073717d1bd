"""Limits of values on finer and finer meshes (Richardson's extrapolation).

With n pieces of every edge an error of order p is c n^-p. Where the order is known, two meshes give
the limit; of three meshes with n1 < n2 < n3 pieces the changes also give the order that they show:

    (f2 - f1) / (f3 - f2) = (n1^-p - n2^-p) / (n2^-p - n3^-p).

Only meshes that show about the order of the elements, 2, tell their error (Roache, Annu. Rev.
Fluid Mech. 29, 1997; Eca and Hoekstra, J. Comput. Phys. 262, 2014): where errors of opposite signs
compete, the changes may be small, or of any sign, far from the limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

ORDER = 2.0  # of the elements
LEAST, MOST = 1.0, 3.0  # observed orders that are near it
SETTLED = 1e-3  # of the value: changes that are no error worth an order


class Convergence(NamedTuple):
    """What three meshes show.

    Attributes
    ----------
    order : (k,)
        Observed; 2 of values that hardly change; nan where it is not between 1 and 3: the meshes
        have not converged.
    limit : (k,)
        What the values tend to; nan likewise.
    """

    order: NDArray[np.float64]
    limit: NDArray[np.float64]


def extrapolated(coarse: Any, fine: Any, ratio: float, order: Any = ORDER) -> Any:
    """What values tend to that two meshes have, the fine one with `ratio` times the divisions."""
    return fine + (fine - coarse) / (ratio**order - 1.0)


def convergence(values: ArrayLike, divisions: Sequence[int]) -> Convergence:
    """Observed order and limit of values (3, k) on meshes of so many divisions, increasing.

    Orders above 2 count as 2 in the limit, which makes the error the larger.
    """
    first, second, third = np.asarray(values, float)
    early, late = second - first, third - second
    order = np.array([_observed(*both, divisions) for both in zip(early, late, strict=True)])
    settled = np.maximum(np.abs(early), np.abs(late)) <= SETTLED * np.abs(third)
    order = np.where(settled, ORDER, order)
    ratio = divisions[2] / divisions[1]
    return Convergence(order, extrapolated(second, third, ratio, np.minimum(order, ORDER)))


def limits(values: ArrayLike, divisions: Sequence[int], *, observed: bool) -> NDArray[np.float64]:
    """What values (3, k) tend to by the order of the elements, or by that which they show, if any.

    Elements have their order on even meshes where nothing is singular.
    """
    _, second, third = np.asarray(values, float)
    limit = extrapolated(second, third, divisions[2] / divisions[1])
    shown = convergence(values, divisions).limit
    return np.where(observed & ~np.isnan(shown), shown, limit)


def doubt(values: ArrayLike, divisions: Sequence[int]) -> NDArray[np.float64]:
    """About how far limits by the observed order are off, relative (k,).

    The distance to the limit by the order of the elements, or a quarter of what the finest mesh is
    off (Roache's factor of safety 1.25), whichever is larger, and a thousandth at least: changes as
    small as that show no order. Where the meshes have not converged, all that they differ by.
    """
    values = np.asarray(values, float)
    limit = limits(values, divisions, observed=True)
    known = limits(values, divisions, observed=False)
    found = np.maximum(np.abs(limit - known), 0.25 * np.abs(values[2] - limit))
    lost = np.isnan(convergence(values, divisions).order)
    return np.maximum(np.where(lost, np.ptp(values, axis=0), found) / np.abs(limit), SETTLED)


def _observed(early: float, late: float, divisions: Sequence[int]) -> float:
    """Order that two changes show; nan where it is not near that of the elements."""

    def miss(order: float) -> float:
        one, two, three = (float(n) ** -order for n in divisions)
        return early * (two - three) - late * (one - two)

    if not miss(LEAST) * miss(MOST) < 0.0:
        return np.nan
    from scipy.optimize import brentq  # takes a tenth of a second that most runs do not need

    return float(brentq(miss, LEAST, MOST))
