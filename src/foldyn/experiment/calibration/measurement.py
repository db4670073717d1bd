"""What all measurements to which a case is fitted have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses.keys import parts
from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.values import number, numbers, show


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement(ABC):
    """Measured values, and the model's predictions of them.

    Parameters
    ----------
    name : str
        Its name in messages and figures; the kind by default.
    label : str
        What figures call the data: "measured"; "synthetic" where a model made them.
    sigma : float, optional
        Standard error of one value, in the unit of the values. A fit to several measurements needs
        it for each, to weight them. Some kinds take a list, one for each value.
    held_out : bool
        Not fitted, only compared with the result of the fit to the others.
    case : path, optional
        Case file of this measurement, where it differs from that of the whole fit.
    changes : mapping of str to object
        Keys of the case file that have other values in this measurement, such as
        ``{"supports[3].displacement": 0.04}``.
    """

    name: str = ""
    label: str = "measured"
    sigma: Any = None
    held_out: bool = False
    case: str | Path | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    kind: ClassVar[str] = ""
    analysis: ClassVar[str] = ""
    each: ClassVar[bool] = False  # whether sigma may be a list

    def __post_init__(self) -> None:
        """Check what all have."""
        self._set(name=self.name or self.kind)
        listed = self.each and isinstance(self.sigma, Sequence | np.ndarray)
        if self.sigma is not None and not listed:
            number(self._of("sigma"), self.sigma, above=0.0)
        for key in self.changes:
            parts(key)

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _of(self, name: str) -> str:
        """Name of a field in messages."""
        return f"{self.name or self.kind}: {name}"

    @property
    def unit(self) -> str:
        """Unit of the values; empty where they have none."""
        return "m"

    @property
    def adapts(self) -> bool:
        """Whether predictions depend on the measured values."""
        return False

    @property
    def absorbed(self) -> int:
        """Degrees of freedom that predictions take from the data: scales, shifts and trends."""
        return 0

    @abstractmethod
    def observed(self) -> NDArray[np.float64]:
        """Measured values, flat."""

    def errors(self) -> NDArray[np.float64]:
        """Standard error of each measured value; the spread of all where none is known."""
        observed = self.observed()
        return np.full(len(observed), self.sigma or spread(observed))

    @abstractmethod
    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case, or arguments of its analysis, that cannot give these values."""

    @abstractmethod
    def predicted(self, result: Any, case: Case) -> NDArray[np.float64]:
        """Values that a result gives for the measured ones, flat and in their order."""

    def examine(self, result: Any, case: Case) -> None:  # noqa: B027
        """Refuse a result that leaves open which of its values are the measured ones."""

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which a path is needed; none for what is no path."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False, kw_only=True)
class AtNodes(Measurement):
    """Values at nodes.

    Parameters
    ----------
    nodes : sequence of int, or str
        Nodes of the structure, or an expression over the pattern's vertices.
    """

    nodes: int | str | Sequence[int] = ()
    word: ClassVar[str] = ""  # for `nodes`, which only this kind understands

    def __post_init__(self) -> None:
        """Check the nodes."""
        super().__post_init__()
        if not (isinstance(self.nodes, str) and self.nodes == self.word):
            self._set(nodes=check_nodes(self._of("nodes"), self.nodes))

    def where(self, case: Case) -> NDArray[np.int64]:
        """Numbers of the nodes."""
        return resolve_nodes(case.structure, self.nodes, self._of("nodes"))


@dataclass(frozen=True, eq=False, kw_only=True)
class NodeValues(AtNodes):
    """Values of each of the nodes: `values`, its second axis along the nodes."""

    values: Any = ()

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """See `Measurement`."""
        named, known = len(self.where(case)), self.values.shape[1]
        if named != known:
            raise InputError(f"{self._of('values')}: are of {known} nodes, {named} are named")

    def _per_node(self, values: NDArray, rows: int, what: str, field: str = "values") -> NDArray:
        """The values of as many rows, a column for each node."""
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim != 2 or len(values) != rows:
            raise InputError(
                f"{self._of(field)}: shape {values.shape}: must be ({rows} {what}, nodes)"
            )
        return values


def column(name: str, values: Any, length: int | None = None) -> NDArray[np.float64]:
    """Finite numbers in a row, of a given length where one is given."""
    array = numbers(name, values)
    if array.ndim != 1 or not array.size or (length is not None and len(array) != length):
        wanted = "a list of numbers" if length is None else f"a list of {length} numbers"
        raise InputError(f"{name}: shape {array.shape}: must be {wanted}")
    return array


def plain_array(name: str, values: Any) -> NDArray:
    """Array of values of any kind, NaN among them."""
    try:
        return np.array(values)
    except ValueError:
        raise InputError(f"{name}: rows have different lengths") from None


def spread(observed: NDArray) -> float:
    """Size of measured values, by which they are weighted where their error is not known."""
    return float(np.std(observed)) or float(np.abs(observed).max()) or 1.0


def check_axes(name: str, axes: Any) -> None:
    """Refuse what is not letters of "xyz", each once."""
    sound = isinstance(axes, str) and axes and len(set(axes)) == len(axes) and {*axes} <= {*AXES}
    if not sound:
        raise InputError(f'{name} = {show(axes)}: must be letters of "xyz"')
