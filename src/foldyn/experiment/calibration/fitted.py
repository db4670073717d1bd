"""What a fit has found, and how well the parameters are known."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import t as student

import foldyn
from foldyn.analyses.keys import replaced
from foldyn.errors import InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.results import netcdf
from foldyn.values import brief
from foldyn.writing import write_text

WEAK = 1e-5
"""Singular value, relative to the largest, below which a direction is not seen at all."""
PART = 0.1
"""Part of a parameter in such a direction from which on it counts as not determined."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its fitted value.

    Attributes
    ----------
    key : str
    value : float
    standard_error : float
        inf where the data do not determine the parameter, nan where a bound holds it.
    lower, upper : float
        Confidence interval.
    determined : bool
        Whether the data determine it.
    at_bound : bool
        Whether it ended at one of its bounds, which then decides its value.
    """

    key: str
    value: float
    standard_error: float
    lower: float
    upper: float
    determined: bool
    at_bound: bool

    @property
    def note(self) -> str:
        """Remark beside its numbers, if any."""
        if self.at_bound:
            return "at its bound: the data pull it further"
        return "" if self.determined else "the data do not determine it"


@brief
@dataclass(frozen=True)
class Descent:
    """A search from one start.

    Attributes
    ----------
    start, values : tuple of float
        Where it began and ended.
    cost : float
        Half the sum of squares of the weighted residuals at its end; inf where it failed.
    evaluations : int
        Steps of the search that were tried.
    message : str
        Why it ended.
    converged : bool
    """

    start: tuple[float, ...]
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
        Values compared.
    rms : float
        Root mean square of the misfit, in `unit`.
    unit : str
    relative : float
        `rms` over the root mean square of the measured values about their mean.
    """

    name: str
    held_out: bool
    count: int
    rms: float
    unit: str
    relative: float


@brief
@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters of a case fitted to measurements.

    Attributes
    ----------
    estimates : tuple of Estimate
    correlation : ndarray, shape (p, p)
        Of the estimates; nan with one that is not determined or at a bound.
    singular_values : ndarray, shape (p,)
        Of the weighted Jacobian by the parameters over their scales: a small one belongs to a
        change of the parameters, the same row of `directions`, that the data hardly see.
    directions : ndarray, shape (p, p)
    confidence : float
        Of the intervals.
    freedom : int
        Fitted values minus free parameters.
    misfit : float
        Root mean square of the weighted residuals per degree of freedom: about 1 where every
        `sigma` is given and both they and the model are right.
    scores : tuple of Score
        One a measurement.
    descents : tuple of Descent
        One a start, in the order of the starts.
    problem : Problem
    predicted : tuple of ndarray
        The model's prediction of each measurement.
    evaluations : int
        Of the model, in all.
    seconds : float
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
        """How many searches ended at the same smallest cost (within 1 %)."""
        costs = np.array([one.cost for one in self.descents])
        slack = 0.01 * costs.min() + 1e-9
        return int((costs <= costs.min() + slack).sum())

    def document(self) -> dict[str, Any]:
        """The case file with the values found."""
        return replaced(self.problem.document, self.problem.space.changes([*self.values.values()]))

    def write_case(self, path: str | os.PathLike[str]) -> None:
        """Write the case file with the values found; paths in it are relative to the new place."""
        path = Path(path)
        moved = os.path.relpath(self.problem.path.parent.resolve(), path.parent.resolve())
        text = f"# Fitted by Foldyn {foldyn.__version__} from {self.problem.path.name}.\n"
        write_text(path, text + tomli_w.dumps(_moved(self.document(), moved)))

    def summary(self) -> dict[str, Any]:
        """All numbers but the measured and predicted values, as JSON has them (nan is null)."""
        return {
            "foldyn_version": foldyn.__version__,
            "case": self.problem.path.name,
            "parameters": [_plain(vars(one) | {"note": one.note}) for one in self.estimates],
            "ties": {tie.key: tie.expression for tie in self.problem.space.ties},
            "confidence": self.confidence,
            "correlation": _plain(self.correlation.tolist()),
            "singular_values": self.singular_values.tolist(),
            "directions": self.directions.tolist(),
            "degrees_of_freedom": self.freedom,
            "misfit": _plain(self.misfit),
            "measurements": [_plain(vars(one)) for one in self.scores],
            "starts": [_plain(vars(one)) for one in self.descents],
            "evaluations": self.evaluations,
            "seconds": self.seconds,
        }

    def dataset(self) -> xr.Dataset:
        """Estimates, correlation, and measured beside predicted values, as a labelled dataset."""
        keys = list(self.values)
        data: dict[str, Any] = {
            name: ("parameter", np.array([getattr(one, name) for one in self.estimates]))
            for name in ("value", "standard_error", "lower", "upper", "determined", "at_bound")
        }
        data["correlation"] = (("parameter", "other"), self.correlation)
        data["singular_value"] = ("direction", self.singular_values)
        data["direction_of"] = (("direction", "parameter"), self.directions)
        both = zip(self.problem.measurements, self.predicted, strict=True)
        for i, (one, predicted) in enumerate(both):
            facts: dict[str, Any] = {"name": one.name, "kind": one.kind, "units": one.unit}
            facts["held_out"] = int(one.held_out)
            data[f"measured_{i}"] = (f"value_{i}", one.observed(), facts)
            data[f"predicted_{i}"] = (f"value_{i}", predicted, facts)
        attrs = {"foldyn_version": foldyn.__version__, "confidence": self.confidence}
        attrs |= {"misfit": self.misfit, "degrees_of_freedom": self.freedom}
        return xr.Dataset(data, {"parameter": keys, "other": keys}, attrs)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `summary` (``*.json``) or `dataset` (``*.nc``).

        Raises
        ------
        InputError
            The file's name has another ending, or its folder does not exist.
        """
        path = Path(path)
        if not path.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
        if path.suffix == ".json":
            text = json.dumps(self.summary(), indent=2, allow_nan=False)
            write_text(path, text + "\n")
        elif path.suffix == ".nc":
            netcdf.write(self.dataset(), path)
        else:
            raise InputError(f"{path}: a fit is written as .json or .nc; choose one of them")


@brief
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

    @classmethod
    def of(
        cls,
        jacobian: NDArray[np.float64],
        residual: NDArray[np.float64],
        scale: NDArray[np.float64],
        at_bound: NDArray[np.bool_],
        confidence: float,
    ) -> Uncertainty:
        """Linearized uncertainty of a fit at its optimum.

        With the singular values s_k and directions v_k of the Jacobian J, cov = misfit^2 sum v_k
        v_k^T / s_k^2, and the half width of an interval is the standard error times the quantile of
        Student's t of the degrees of freedom.

        The data do not see a direction whose singular value is below `WEAK` of the largest, and
        hardly see one whose standard error exceeds the scales of the parameters. Both are left out
        of the covariance, and parameters that take part in them are not determined.

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
        return cls(error, error * width, correlation, singular, rows, determined, freedom, misfit)

    def estimates(self, keys: Sequence[str], values: NDArray[np.float64]) -> tuple[Estimate, ...]:
        """Estimates of the parameters."""
        error, half = self.standard_error, self.half_width
        numbers = values, error, values - half, values + half, self.determined, np.isnan(error)
        rows = zip(keys, *(column.tolist() for column in numbers), strict=True)
        return tuple(Estimate(*row) for row in rows)


def score(one: Measurement, predicted: NDArray) -> Score:
    """Compare measured with predicted values."""
    observed = one.observed()
    rms = float(np.sqrt(np.mean((predicted - observed) ** 2)))
    return Score(one.name, one.held_out, len(observed), rms, one.unit, rms / spread(observed))


def spread(observed: NDArray) -> float:
    """Size of measured values, by which they are weighted where their error is not known."""
    return float(np.std(observed)) or float(np.abs(observed).max()) or 1.0


def _plain(value: Any) -> Any:
    """Value as JSON can hold it: what is not finite becomes null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _moved(value: Any, way: str) -> Any:
    """Document whose file names are relative to another folder."""
    if isinstance(value, dict):
        return {
            key: Path(way, item).as_posix() if key == "file" else _moved(item, way)
            for key, item in value.items()
        }
    return [_moved(item, way) for item in value] if isinstance(value, list) else value
