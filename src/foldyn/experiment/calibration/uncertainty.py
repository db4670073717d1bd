"""How well the parameters of a least squares fit are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

WEAK = 1e-5
"""Singular value, relative to the largest, below which a direction is not seen at all."""
PART = 0.1
"""Part of a parameter in such a direction from which on it counts as not determined."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors, intervals and correlation of p parameters.

    Attributes
    ----------
    standard_error : ndarray, shape (p,)
        inf of what is not determined, nan of what lies at a bound.
    half_width : ndarray, shape (p,)
        Of the confidence intervals.
    correlation : ndarray, shape (p, p)
        nan with what is not determined or at a bound.
    singular_values : ndarray, shape (p,)
        Of the weighted Jacobian by the parameters over their scales, decreasing; 0 for parameters
        at a bound.
    directions : ndarray, shape (p, p)
        Row k: the change of the parameters (in their scales) that belongs to singular value k.
    determined : ndarray of bool, shape (p,)
    freedom : int
        Values minus parameters that are free.
    misfit : float
        Root mean square of the weighted residuals per degree of freedom: 1 where the model is
        right and the standard errors of the data are.
    """

    standard_error: NDArray[np.float64]
    half_width: NDArray[np.float64]
    correlation: NDArray[np.float64]
    singular_values: NDArray[np.float64]
    directions: NDArray[np.float64]
    determined: NDArray[np.bool_]
    freedom: int
    misfit: float


def uncertainty(
    jacobian: NDArray[np.float64],
    residual: NDArray[np.float64],
    scale: NDArray[np.float64],
    at_bound: NDArray[np.bool_],
    confidence: float,
) -> Uncertainty:
    """Linearized uncertainty of a fit at its optimum.

    With the singular values s_k and directions v_k of the Jacobian J, cov = misfit^2 sum v_k v_k^T
    / s_k^2, and the half width of an interval is the standard error times the quantile of
    Student's t of the degrees of freedom.

    A direction with a singular value below `WEAK` of the largest is one that the data do not see;
    one whose standard error exceeds the scales of the parameters is one that they hardly see. Both
    are left out of the covariance, and parameters that take part in them are not determined.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Weighted residuals by the parameters over their scales.
    residual : ndarray, shape (n,)
        Weighted residuals.
    scale : ndarray, shape (p,)
    at_bound : ndarray of bool, shape (p,)
        Parameters that a bound holds: they count as known.
    confidence : float
        Of the intervals, 0.95 for 95 %.
    """
    n, p = jacobian.shape
    free = np.flatnonzero(~at_bound)
    freedom = n - len(free)
    misfit = float(np.sqrt(residual @ residual / freedom)) if freedom > 0 else np.nan
    singular, rows = np.zeros(p), np.zeros((p, p))
    if len(free):
        _, some, directions = np.linalg.svd(jacobian[:, free], full_matrices=False)
        singular[: len(some)] = some
        rows[np.ix_(np.arange(len(directions)), free)] = directions
    own = np.arange(p) < len(free)
    seen = own & (singular > WEAK * singular[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        seen &= ~(misfit / singular > 1.0)
    weak = np.sqrt((rows[own & ~seen] ** 2).sum(axis=0))
    determined = weak < PART
    cov = (rows[seen].T / singular[seen] ** 2) @ rows[seen] * misfit**2
    error = np.where(determined, np.sqrt(np.diag(cov)) * scale, np.inf)
    error[at_bound] = np.nan
    usable = determined & ~at_bound
    correlation = np.full((p, p), np.nan)
    some = np.flatnonzero(usable)
    root = np.sqrt(np.diag(cov))[some]
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation[np.ix_(some, some)] = cov[np.ix_(some, some)] / np.outer(root, root)
    width = float(student.ppf(0.5 + 0.5 * confidence, freedom)) if freedom > 0 else np.nan
    return Uncertainty(
        error, error * width, correlation, singular, rows, determined, freedom, misfit
    )
