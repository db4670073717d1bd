"""Common base of all measurements to which a case is fitted."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses.keys import parts
from foldyn.arguments import Check, Checked
from foldyn.cases import Case
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.values import number, numbers


def _keys(name: str, changes: Mapping[str, Any]) -> Mapping[str, Any]:
    for key in changes:
        parts(key)
    return changes


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement(Checked, ABC):
    """Measured values, and the model's predictions of them.

    Parameters
    ----------
    name : str
        Name of the measurement in messages and figures; by default its kind.
    label : str
        Label of the data in figures: "measured", or "synthetic" if a model made them.
    sigma : float, optional
        Standard error of one value, in the unit of the values. A fit to several measurements needs
        it for each of them as a weight. Some kinds take a list with an error for each value.
    held_out : bool
        Whether these data are not fitted, but only compared with the fit to the other data.
    case : path, optional
        Case file of this measurement, if it differs from the case file of the fit.
    changes : mapping of str to object
        Keys of the case file that have other values in this measurement, such as
        ``{"supports[3].displacement": 0.04}``.
    """

    name: str = ""
    label: str = "measured"
    sigma: Any = None
    held_out: bool = False
    case: str | Path | None = None
    changes: Annotated[Mapping[str, Any], Check(_keys)] = field(default_factory=dict)
    kind: ClassVar[str] = ""
    analysis: ClassVar[str] = ""
    each: ClassVar[bool] = False  # whether sigma may be a list
    unit: ClassVar[str] = "m"  # unit of the values; empty if they have none
    adapts: ClassVar[bool] = False  # whether predictions depend on the measured values
    # degrees of freedom that predictions take from the data: scales, shifts and trends
    absorbed: ClassVar[int] = 0

    def __post_init__(self) -> None:
        """Check the arguments, under the name of the measurement."""
        self._set(name=self.name or self.kind)
        super().__post_init__()

    @property
    def place(self) -> str:  # type: ignore[override]
        """Prefix of arguments in messages."""
        return f"{self.name}: "

    def agree(self) -> None:
        """Check the standard error, and in each kind its values."""
        listed = self.each and isinstance(self.sigma, Sequence | np.ndarray)
        if self.sigma is not None and not listed:
            number("sigma", self.sigma, above=0.0)

    def _of(self, name: str) -> str:
        """Name of a field in messages."""
        return f"{self.place}{name}"

    @abstractmethod
    def observed(self) -> NDArray[np.float64]:
        """Measured values, flat."""

    def errors(self) -> NDArray[np.float64]:
        """Standard error of each measured value; the spread of all values if unknown."""
        if isinstance(self.sigma, np.ndarray):
            return self.sigma
        observed = self.observed()
        return np.full(len(observed), self.sigma or spread(observed))

    @abstractmethod
    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case, or arguments of its analysis, that cannot predict these values."""

    @abstractmethod
    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values by a result, flattened in the same order."""

    def examine(self, result: xr.Dataset, case: Case) -> None:
        """Refuse a result in which the measured modes cannot be identified."""

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which a path is needed; none for other analyses."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False, kw_only=True)
class AtNodes(Measurement):
    """Values at nodes.

    Parameters
    ----------
    nodes : sequence of int, or str
        Node numbers of the structure, or an expression that selects vertices of the pattern.
    """

    nodes: int | str | Sequence[int] = ()
    word: ClassVar[str] = ""  # text that `nodes` may be in this kind only

    def agree(self) -> None:
        """Check the nodes."""
        super().agree()
        if not (isinstance(self.nodes, str) and self.nodes == self.word):
            self._set(nodes=check_nodes("nodes", self.nodes))

    def where(self, case: Case) -> NDArray[np.int64]:
        """Numbers of the nodes."""
        return resolve_nodes(case.structure, self.nodes, self._of("nodes"))


@dataclass(frozen=True, eq=False, kw_only=True)
class NodeValues(AtNodes):
    """Values of each node: `values`, with nodes along its second axis."""

    values: Any = ()

    @abstractmethod
    def modelled(self, result: xr.Dataset, case: Case) -> NDArray:
        """Values of a result in the place of the measured `values`, also where these are NaN."""

    def flat(self, values: NDArray) -> NDArray[np.float64]:
        """Those of the values that were measured, in one row."""
        return values[np.isfinite(self.values)]

    def observed(self) -> NDArray[np.float64]:
        """Measured values, flat."""
        return self.flat(self.values)

    def predicted(self, result: xr.Dataset, case: Case) -> NDArray[np.float64]:
        """Predictions of the measured values, in the order of `observed`."""
        return self.flat(self.modelled(result, case))

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case that cannot predict these values."""
        named, known = len(self.where(case)), self.values.shape[1]
        if named != known:
            raise InputError(f"{self._of('values')}: has {known} nodes, but {named} are named")

    @staticmethod
    def _per_node(values: NDArray, rows: int, what: str, field: str = "values") -> NDArray:
        """Values for a number of rows, a column for each node."""
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim != 2 or len(values) != rows:
            raise InputError(f": shape {values.shape}: must be ({rows} {what}, nodes)", field)
        return values


def column(name: str, values: Any, length: int | None = None) -> NDArray[np.float64]:
    """Finite numbers in one dimension, of a given length if specified."""
    array = numbers(name, values)
    if array.ndim != 1 or not array.size or (length is not None and len(array) != length):
        wanted = "a list of numbers" if length is None else f"a list of {length} numbers"
        raise InputError(f"{name}: shape {array.shape}: must be {wanted}")
    return array


def plain_array(name: str, values: Any) -> NDArray:
    """Numeric array, which may contain NaN."""
    try:
        return np.array(values)
    except ValueError:
        raise InputError(f"{name}: rows have different lengths") from None


def spread(observed: NDArray) -> float:
    """Spread of measured values, which stands for their standard error if that is unknown."""
    return float(np.std(observed)) or float(np.abs(observed).max()) or 1.0
