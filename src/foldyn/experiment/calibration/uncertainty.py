"""Uncertainty of fitted parameters: standard errors, intervals, correlation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from foldyn.arguments import brief

WEAK = 1e-5
"""Singular value, relative to the largest, below which a direction is not determined at all."""
PART = 0.1
"""Component of a parameter along such a direction above which it counts as not determined."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its fitted value.

    Attributes
    ----------
    key : str
    value : float
    standard_error : float
        inf if the data do not determine the parameter, nan if it is at a bound.
    lower, upper : float
        Confidence interval, widened by the discretization.
    determined : bool
        Whether the data determine it.
    at_bound : bool
        Whether it ended at one of its bounds, which then determines its value.
    discretization : float
        Shift of the value in the limit of small time steps and, for a shell, elements, by
        Richardson's extrapolation of the misfit at the optimum with these halved. The interval is
        extended by it on that side. nan if it could not be computed.
    """

    key: str
    value: float
    standard_error: float
    lower: float
    upper: float
    determined: bool
    at_bound: bool
    discretization: float = 0.0

    @property
    def note(self) -> str:
        """Remark on its numbers, if any."""
        if self.at_bound:
            return "at its bound: the data pull it further"
        return "" if self.determined else "the data do not determine it"


@brief
@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors, intervals and correlation of p parameters.

    Attributes
    ----------
    standard_error : ndarray, shape (p,)
        inf if not determined, nan if at a bound.
    half_width : ndarray, shape (p,)
        Half width of the confidence intervals.
    correlation : ndarray, shape (p, p)
        nan for parameters not determined or at a bound.
    singular_values : ndarray, shape (p,)
        Singular values of the weighted Jacobian with respect to scaled parameters, decreasing; 0
        for parameters at a bound.
    directions : ndarray, shape (p, p)
        Row k: the change of scaled parameters that belongs to singular value k.
    determined : ndarray of bool, shape (p,)
    freedom : int
        Number of values minus free parameters.
    misfit : float
        Root mean square of the weighted residuals per degree of freedom: about 1 if both the model
        and the standard errors of the data are right.
    influence : ndarray, shape (p, n)
        Derivative of each estimate with respect to each weighted residual; 0 for parameters not
        determined or at a bound.
    """

    standard_error: NDArray[np.float64]
    half_width: NDArray[np.float64]
    correlation: NDArray[np.float64]
    singular_values: NDArray[np.float64]
    directions: NDArray[np.float64]
    determined: NDArray[np.bool_]
    freedom: int
    misfit: float
    influence: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        jacobian: NDArray[np.float64],
        residual: NDArray[np.float64],
        scale: NDArray[np.float64],
        at_bound: NDArray[np.bool_],
        confidence: float,
        absorbed: int = 0,
    ) -> Uncertainty:
        """Linearized uncertainty of a fit at its optimum.

        With the singular values s_k and directions v_k of the Jacobian J, cov = misfit^2 sum v_k
        v_k^T / s_k^2, and the half width of an interval is the standard error times the quantile of
        Student's t of the degrees of freedom.

        The data do not determine a direction whose singular value is below `WEAK` of the largest,
        and barely determine one whose standard error exceeds the parameter scales. Both are left
        out of the covariance, and parameters with a part in them count as not determined.

        Parameters
        ----------
        jacobian : ndarray, shape (n, p)
            Derivatives of weighted residuals with respect to scaled parameters.
        residual : ndarray, shape (n,)
            Weighted residuals.
        scale : ndarray, shape (p,)
        at_bound : ndarray of bool, shape (p,)
            Parameters at a bound, which count as known.
        confidence : float
            Confidence level of the intervals, 0.95 for 95 %.
        absorbed : int
            Degrees of freedom that predictions take from the data.
        """
        n, p = jacobian.shape
        free = np.flatnonzero(~at_bound)
        freedom = n - absorbed - len(free)
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
        inverse = rows[seen].T / singular[seen] ** 2 @ rows[seen]
        cov = inverse * misfit**2
        influence = -scale[:, None] * (inverse @ jacobian.T)
        error = np.where(determined, np.sqrt(np.diag(cov)) * scale, np.inf)
        error[at_bound] = np.nan
        usable = determined & ~at_bound
        correlation = np.full((p, p), np.nan)
        some = np.flatnonzero(usable)
        root = np.sqrt(np.diag(cov))[some]
        with np.errstate(divide="ignore", invalid="ignore"):
            correlation[np.ix_(some, some)] = cov[np.ix_(some, some)] / np.outer(root, root)
        width = float(student.ppf(0.5 + 0.5 * confidence, freedom)) if freedom > 0 else np.nan
        return cls(
            error, error * width, correlation, singular, rows, determined, freedom, misfit,
            influence,
        )  # fmt: skip

    def estimates(
        self, keys: Sequence[str], values: NDArray[np.float64], shifts: Sequence[NDArray]
    ) -> tuple[Estimate, ...]:
        """Estimates of the parameters, given shifts (p,) for each kind of discretization."""
        error, half = self.standard_error, self.half_width
        moved = np.reshape(shifts, (-1, len(values)))
        known = np.nan_to_num(moved)
        below, above = np.minimum(known, 0.0).sum(axis=0), np.maximum(known, 0.0).sum(axis=0)
        numbers = (
            values, error, values - half + below, values + half + above, self.determined,
            np.isnan(error), moved.sum(axis=0),
        )  # fmt: skip
        rows = zip(keys, *(column.tolist() for column in numbers), strict=True)
        return tuple(Estimate(*row) for row in rows)
