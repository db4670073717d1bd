"""Results of a fit: estimates with standard errors, intervals and correlation, and scores."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import t as student

import foldyn
from foldyn.analyses.keys import files_moved, replaced
from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.experiment.calibration.measurement import Measurement, spread
from foldyn.results import netcdf
from foldyn.writing import plain, target_of, write_json, write_text

# Singular value, relative to the largest, below which a direction is not determined at all.
WEAK = 1e-5
# A parameter with a larger component along such a direction counts as not determined.
PART = 0.1


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
        Whether the data determine the parameter.
    at_bound : bool
        Whether the parameter ended at one of its bounds, which then determines the value.
    discretization : float
        Shift of the value in the limit of small time steps and, for a shell, of small elements. It
        follows by Richardson's extrapolation from the misfit at the optimum with half the step and
        half the element size. The interval is extended by this shift on that side. nan if the shift
        could not be computed.
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
        """Remark on the numbers of this estimate; "" if there is none."""
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
        Row k is the change of scaled parameters that belongs to singular value k.
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
        v_k^T / s_k^2. The half width of an interval is the standard error times a quantile of
        Student's t distribution with the given degrees of freedom.

        The data do not determine a direction whose singular value is below `WEAK` times the
        largest, and barely determine a direction whose standard error exceeds the parameter scales.
        Both kinds of directions are left out of the covariance, and parameters with a component
        along them count as not determined.

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
        determined = np.sqrt((rows[own & ~seen] ** 2).sum(axis=0)) < PART
        inverse = rows[seen].T / singular[seen] ** 2 @ rows[seen]
        cov = inverse * misfit**2
        influence = -scale[:, None] * (inverse @ jacobian.T)
        error = np.where(determined, np.sqrt(np.diag(cov)) * scale, np.inf)
        error[at_bound] = np.nan
        correlation = np.full((p, p), np.nan)
        some = np.flatnonzero(determined & ~at_bound)
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


RARE = 0.01  # a misfit with a lower probability cannot be explained by noise alone


@brief
@dataclass(frozen=True)
class Descent:
    """One search of a fit.

    Attributes
    ----------
    guess, values : tuple of float
        Parameters at the beginning and at the end of the search.
    cost : float
        Half the sum of squares of the weighted residuals at the end; inf if the search failed.
    evaluations : int
        Number of attempted steps.
    message : str
        Why the search ended.
    converged : bool
    """

    guess: tuple[float, ...]
    values: tuple[float, ...]
    cost: float
    evaluations: int
    message: str
    converged: bool


@dataclass(frozen=True)
class Score:
    """How well the model predicts a measurement.

    Attributes
    ----------
    name : str
    held_out : bool
    count : int
        Number of values compared.
    rms : float
        Root mean square of the misfit, in `unit`.
    unit : str
    relative : float
        `rms` divided by the root mean square deviation of the measured values from their mean.
    sigmas : float
        Root mean square of the misfit in standard errors of the data; nan without `sigma`.
    """

    name: str
    held_out: bool
    count: int
    rms: float
    unit: str
    relative: float
    sigmas: float


@brief
@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters of a case fitted to measurements.

    Attributes
    ----------
    estimates : tuple of Estimate
    correlation : ndarray, shape (p, p)
        Correlation of the estimates; nan for estimates that are undetermined or at a bound.
    singular_values : ndarray, shape (p,)
        Singular values of the weighted Jacobian with respect to scaled parameters. A small one
        means that the data barely determine the change of parameters in the same row of
        `directions`.
    directions : ndarray, shape (p, p)
    confidence : float
        Confidence level of the intervals.
    freedom : int
        Number of fitted values minus free parameters, minus scales, shifts and trends of the data.
    misfit : float
        Root mean square of the weighted residuals per degree of freedom, the root of the reduced
        chi-square: about 1 if every `sigma` is given, and both all `sigma` and the model are right.
    scores : tuple of Score
        One score for each measurement.
    descents : tuple of Descent
        One descent for each search, in order.
    problem : Problem
    predicted : tuple of ndarray
        The model's prediction of each measurement.
    evaluations : int
        Number of evaluations of the model.
    seconds : float
    quotients : tuple of str
        Names of the measurements whose derivatives are difference quotients of whole runs.
    """

    estimates: tuple[Estimate, ...]
    correlation: NDArray[np.float64]
    singular_values: NDArray[np.float64]
    directions: NDArray[np.float64]
    confidence: float
    freedom: int
    misfit: float
    scores: tuple[Score, ...]
    descents: tuple[Descent, ...]
    problem: Problem = field(repr=False)
    predicted: tuple[NDArray[np.float64], ...] = field(repr=False)
    evaluations: int
    seconds: float
    quotients: tuple[str, ...]

    def __getitem__(self, key: str) -> Estimate:
        """Estimate of a parameter."""
        estimates = {one.key: one for one in self.estimates}
        if key not in estimates:
            raise InputError(f"{key}: was not fitted; {', '.join(estimates)} were")
        return estimates[key]

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by their keys."""
        return {one.key: one.value for one in self.estimates}

    @property
    def agreeing(self) -> int:
        """Number of searches that ended at the same smallest cost (within 1 %)."""
        costs = np.array([one.cost for one in self.descents])
        slack = 0.01 * costs.min() + 1e-9
        return int((costs <= costs.min() + slack).sum())

    @property
    def weighed(self) -> bool:
        """Whether the misfit is in standard errors, which requires that all data have them."""
        return all(one.sigma is not None for one in self.problem.measurements if not one.held_out)

    @property
    def unlikely(self) -> str:
        """Remark on a misfit that noise in the data can hardly explain; "" otherwise."""
        if not self.weighed or not np.isfinite(self.misfit):
            return ""
        square = self.freedom * self.misfit**2
        if chi2.sf(square, self.freedom) < RARE:
            return "more than noise explains: the model is wrong, or sigma is too small"
        if chi2.cdf(square, self.freedom) < RARE:
            return "less than such noise causes: sigma is too large; intervals use the misfit"
        return ""

    @property
    def quality(self) -> str:
        """Describe the misfit in words, with conclusions on model and data."""
        if not np.isfinite(self.misfit):
            return "No degree of freedom is left to estimate the misfit."
        freedom = f"{self.freedom} degree{'s' if self.freedom != 1 else ''} of freedom"
        if not self.weighed:
            return (
                f"Misfit: {self.misfit:.3g} of the spread of the data ({freedom}; give sigma to "
                "compare it with noise)."
            )
        text = f"Misfit: {self.misfit:.3g} sigma (reduced chi-square {self.misfit**2:.3g}, "
        return text + f"{freedom})" + (f", {self.unlikely}." if self.unlikely else ".")

    def document(self) -> dict[str, Any]:
        """The case file with the fitted values."""
        return replaced(self.problem.document, self.problem.space.changes([*self.values.values()]))

    def write_case(self, path: str | os.PathLike[str]) -> None:
        """Write the case file with the fitted values; paths become relative to the new location."""
        path = Path(path)
        moved = os.path.relpath(self.problem.path.parent.resolve(), path.parent.resolve())
        text = f"# Fitted by Foldyn {foldyn.__version__} from {self.problem.path.name}.\n"
        write_text(text + tomli_w.dumps(files_moved(self.document(), moved)), path)

    def summary(self) -> dict[str, Any]:
        """All numbers except measured and predicted values, in types of JSON (nan becomes null)."""
        return {
            "foldyn_version": foldyn.__version__,
            "case": self.problem.path.name,
            "parameters": [plain(vars(one) | {"note": one.note}) for one in self.estimates],
            "ties": {tie.key: tie.expression for tie in self.problem.space.ties},
            "confidence": self.confidence,
            "correlation": plain(self.correlation.tolist()),
            "singular_values": self.singular_values.tolist(),
            "directions": self.directions.tolist(),
            "degrees_of_freedom": self.freedom,
            "misfit": plain(self.misfit),
            "quality": self.quality,
            "measurements": [plain(vars(one)) for one in self.scores],
            "searches": [plain(vars(one)) for one in self.descents],
            "evaluations": self.evaluations,
            "seconds": self.seconds,
            "quotients": list(self.quotients),
        }

    def dataset(self) -> xr.Dataset:
        """Estimates, correlation, and measured and predicted values, as a labeled dataset."""
        keys = list(self.values)
        data: dict[str, Any] = {
            item.name: ("parameter", np.array([getattr(one, item.name) for one in self.estimates]))
            for item in fields(Estimate)
            if item.name != "key"
        }
        data["correlation"] = (("parameter", "other"), self.correlation)
        data["singular_value"] = ("direction", self.singular_values)
        data["direction_of"] = (("direction", "parameter"), self.directions)
        every = zip(self.problem.measurements, self.predicted, self.scores, strict=True)
        for i, (one, predicted, score) in enumerate(every):
            facts: dict[str, Any] = {"name": one.name, "kind": one.kind, "units": one.unit or "1"}
            facts |= {"held_out": int(one.held_out), "misfit_in_sigmas": score.sigmas}
            data[f"measured_{i}"] = (f"value_{i}", one.observed(), facts)
            data[f"predicted_{i}"] = (f"value_{i}", predicted, facts)
        attrs = {"foldyn_version": foldyn.__version__, "confidence": self.confidence}
        attrs |= {"misfit": self.misfit, "degrees_of_freedom": self.freedom}
        attrs |= {"misfit_in_sigmas": int(self.weighed), "quality": self.quality}
        return xr.Dataset(data, {"parameter": keys, "other": keys}, attrs)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `summary` (``*.json``) or `dataset` (``*.nc``).

        Raises
        ------
        InputError
            The file's name has another ending, or its folder does not exist.
        """
        path = target_of(path)
        if path.suffix == ".json":
            write_json(self.summary(), path)
        elif path.suffix == ".nc":
            netcdf.write(self.dataset(), path)
        else:
            raise InputError(f"{path}: a fit is written as .json or .nc; choose one of them")


def score(one: Measurement, predicted: NDArray) -> Score:
    """Compare measured and predicted values."""
    observed = one.observed()
    misfit = predicted - observed
    rms = float(np.sqrt(np.mean(misfit**2)))
    sigmas = np.nan if one.sigma is None else float(np.sqrt(np.mean((misfit / one.errors()) ** 2)))
    relative = rms / spread(observed)
    return Score(one.name, one.held_out, len(observed), rms, one.unit, relative, sigmas)
