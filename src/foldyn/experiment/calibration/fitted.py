"""Results of a fit, with the uncertainty of the parameters."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import chi2

import foldyn
from foldyn.analyses.keys import files_moved, replaced
from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.experiment.calibration.measurement import Measurement, spread
from foldyn.experiment.calibration.uncertainty import Estimate
from foldyn.results import netcdf
from foldyn.writing import plain, write_json, write_text

RARE = 0.01
"""Probability of a misfit by noise alone, below which there must be another cause."""


@brief
@dataclass(frozen=True)
class Descent:
    """One search.

    Attributes
    ----------
    guess, values : tuple of float
        Parameters at its beginning and end.
    cost : float
        Half the sum of squares of the weighted residuals at its end; inf if it failed.
    evaluations : int
        Number of attempted steps.
    message : str
        Why it ended.
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
        `rms` over the root mean square of the measured values about their mean.
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
        chi-square: about 1 if every `sigma` is given and both these and the model are right.
    scores : tuple of Score
        One per measurement.
    descents : tuple of Descent
        One per search, in order.
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
        """Whether the misfit is in standard errors, because all data have one."""
        return all(one.sigma is not None for one in self.problem.measurements if not one.held_out)

    @property
    def unlikely(self) -> str:
        """Remark on a misfit that noise in the data can hardly explain; "" for others."""
        if not self.weighed or not np.isfinite(self.misfit):
            return ""
        square = self.freedom * self.misfit**2
        if chi2.sf(square, self.freedom) < RARE:
            return "more than noise explains: the model is wrong somewhere, or sigma is too small"
        if chi2.cdf(square, self.freedom) < RARE:
            return "less than such noise leaves: sigma is too large, and intervals go by the misfit"
        return ""

    @property
    def quality(self) -> str:
        """Describe the misfit in words, with conclusions on model and data."""
        if not np.isfinite(self.misfit):
            return "No degree of freedom is left to tell the misfit."
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
        write_text(path, text + tomli_w.dumps(files_moved(self.document(), moved)))

    def summary(self) -> dict[str, Any]:
        """All numbers except measured and predicted values, as JSON types (nan is null)."""
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
            name: ("parameter", np.array([getattr(one, name) for one in self.estimates]))
            for name in (
                "value", "standard_error", "lower", "upper", "determined", "at_bound",
                "discretization",
            )
        }  # fmt: skip
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
        path = Path(path)
        if not path.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
        if path.suffix == ".json":
            write_json(path, self.summary())
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
    return Score(
        one.name, one.held_out, len(observed), rms, one.unit, rms / spread(observed), sigmas
    )
