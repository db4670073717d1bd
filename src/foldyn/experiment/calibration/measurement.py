"""What all measurements have that a case is fitted to."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.cases.supports import AXES
from foldyn.errors import InputError
from foldyn.experiment.calibration.key_paths import parts
from foldyn.values import number, numbers, show


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement(ABC):
    """Measured values, and what the model says of them.

    Parameters
    ----------
    nodes : sequence of int, or str
        Nodes of the structure, or an expression over the pattern's vertices.
    name : str
        For messages and figures; the kind by default.
    label : str
        What figures call the data: "measured"; "synthetic" where a model made them.
    sigma : float, optional
        Standard error of one value, in the unit of the values. A fit to several measurements needs
        it of each: it is what they are weighed by.
    held_out : bool
        Not fitted: only scored with what the others give.
    case : path, optional
        Case file of this measurement, where it is not that of the whole fit.
    changes : mapping of str to object
        Keys of the case file that have other values in this measurement, as
        ``{"supports[3].displacement": 0.04}``.
    """

    nodes: int | str | Sequence[int] = ()
    name: str = ""
    label: str = "measured"
    sigma: float | None = None
    held_out: bool = False
    case: str | Path | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    kind: ClassVar[str] = ""
    analysis: ClassVar[str] = ""
    unit: ClassVar[str] = "m"
    word: ClassVar[str] = ""  # that selects nodes in a way of its own

    def __post_init__(self) -> None:
        """Check what all have."""
        object.__setattr__(self, "name", self.name or self.kind)
        if not (isinstance(self.nodes, str) and self.nodes == self.word):
            object.__setattr__(self, "nodes", check_nodes(self.nodes, self._of("nodes")))
        if self.sigma is not None:
            number(self._of("sigma"), self.sigma, above=0.0)
        for key in self.changes:
            parts(key)

    def _of(self, name: str) -> str:
        """Name of a field in messages."""
        return f"{self.name or self.kind}: {name}"

    def where(self, case: Case) -> NDArray[np.int64]:
        """Numbers of the nodes."""
        return resolve_nodes(case.structure, self.nodes, self._of("nodes"))

    @abstractmethod
    def observed(self) -> NDArray[np.float64]:
        """Measured values, flat."""

    @abstractmethod
    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """Refuse a case, or arguments of its analysis, that cannot give these values."""

    @abstractmethod
    def predicted(self, result: Any, case: Case) -> NDArray[np.float64]:
        """What a result says of the measured values, flat and in their order."""

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which a path is needed; none where it is a motion."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False, kw_only=True)
class NodeValues(Measurement):
    """Values of each of the nodes: `values`, its second axis along the nodes."""

    values: Any = ()

    def check(self, case: Case, arguments: Mapping[str, Any]) -> None:
        """See `Measurement`."""
        named, known = len(self.where(case)), self.values.shape[1]
        if named != known:
            raise InputError(f"{self._of('values')}: are of {known} nodes, {named} are named")

    def _per_node(self, values: NDArray[np.float64], rows: int, what: str) -> NDArray[np.float64]:
        """The values of as many rows, a column for each node."""
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim != 2 or len(values) != rows:
            raise InputError(
                f"{self._of('values')}: shape {values.shape}: must be ({rows} {what}, nodes)"
            )
        return values


def column(name: str, values: Any, length: int | None = None) -> NDArray[np.float64]:
    """Finite numbers in a row, of a given length where one is given."""
    array = numbers(name, values)
    if array.ndim != 1 or not array.size or (length is not None and len(array) != length):
        wanted = "a list of numbers" if length is None else f"a list of {length} numbers"
        raise InputError(f"{name}: shape {array.shape}: must be {wanted}")
    return array


def axis_number(name: str, axis: Any) -> int:
    """Number of an axis by its letter."""
    if not isinstance(axis, str) or len(axis) != 1 or axis not in AXES:
        raise InputError(f'{name} = {show(axis)}: must be "x", "y" or "z"')
    return AXES.index(axis)
