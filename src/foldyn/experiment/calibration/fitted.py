"""What a fit has found."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

import foldyn
from foldyn.errors import InputError
from foldyn.experiment.calibration.fit_problem import Problem
from foldyn.experiment.calibration.parameters import replaced
from foldyn.results import netcdf
from foldyn.writing import write_text


@dataclass(frozen=True)
class Estimate:
    """A parameter as it was found.

    Attributes
    ----------
    key : str
    value : float
    standard_error : float
        inf where the data do not determine it, nan where a bound holds it.
    lower, upper : float
        Confidence interval.
    determined : bool
        Whether the data determine it.
    at_bound : bool
        Whether it ended at one of its bounds, which then decided its value.
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
        """What is to be said of it beside its numbers."""
        if self.at_bound:
            return "at its bound: the data pull it further"
        return "" if self.determined else "the data do not determine it"


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
    """How well the model says what was measured.

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
        What the model says of each measurement.
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
        for one in self.estimates:
            if one.key == key:
                return one
        raise InputError(f"{key}: was not fitted; {', '.join(self.values)} were")

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
        """What the case file says, with the values found."""
        return replaced(self.problem.document, self.problem.space.changes([*self.values.values()]))

    def write_case(self, path: str | os.PathLike[str]) -> None:
        """Write the case file with the values found; files that it names are found from there."""
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
        told = {"foldyn_version": foldyn.__version__, "confidence": self.confidence}
        told |= {"misfit": self.misfit, "degrees_of_freedom": self.freedom}
        return xr.Dataset(data, {"parameter": keys, "other": keys}, told)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write `summary` (``*.json``) or `dataset` (``*.nc``).

        Raises
        ------
        InputError
            The file's name ends otherwise, or its folder does not exist.
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


def score(name: str, held_out: bool, unit: str, observed: NDArray, predicted: NDArray) -> Score:
    """Compare measured with predicted values."""
    rms = float(np.sqrt(np.mean((predicted - observed) ** 2)))
    spread = float(np.std(observed)) or float(np.abs(observed).max()) or 1.0
    return Score(name, held_out, len(observed), rms, unit, rms / spread)


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
    """Document with the files that it names found from another folder."""
    if isinstance(value, dict):
        return {
            key: Path(way, item).as_posix() if key == "file" else _moved(item, way)
            for key, item in value.items()
        }
    return [_moved(item, way) for item in value] if isinstance(value, list) else value
