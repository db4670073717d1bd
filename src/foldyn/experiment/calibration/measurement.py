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
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.values import number, numbers


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement(ABC):
    """Measured values, and the model's predictions of them.

    Parameters
    ----------
    nodes : sequence of int, or str
        Nodes of the structure, or an expression over the pattern's vertices.
    name : str
        Its name in messages and figures; the kind by default.
    label : str
        What figures call the data: "measured"; "synthetic" where a model made them.
    sigma : float, optional
        Standard error of one value, in the unit of the values. A fit to several measurements needs
        it for each, to weight them.
    held_out : bool
        Not fitted, only compared with the result of the fit to the others.
    case : path, optional
        Case file of this measurement, where it differs from that of the whole fit.
    changes : mapping of str to object
        Keys of the case file that have other values in this measurement, such as
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
    word: ClassVar[str] = ""  # for `nodes`, which only this kind understands

    def __post_init__(self) -> None:
        """Check what all have."""
        self._set(name=self.name or self.kind)
        if not (isinstance(self.nodes, str) and self.nodes == self.word):
            self._set(nodes=check_nodes(self.nodes, self._of("nodes")))
        if self.sigma is not None:
            number(self._of("sigma"), self.sigma, above=0.0)
        for key in self.changes:
            parts(key)

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

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
        """Values that a result gives for the measured ones, flat and in their order."""

    def factors(self, case: Case) -> NDArray[np.float64]:
        """Load factors at which a path is needed; none for a motion."""
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
