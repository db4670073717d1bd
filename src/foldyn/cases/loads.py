"""Loads: forces on nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from foldyn.cases.histories import History, as_history
from foldyn.cases.selection import check_nodes
from foldyn.cases.values import vector


@dataclass(frozen=True)
class Force:
    """The same force on each of some nodes, times a history.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression over the pattern's vertices ("xmin", "zmax and y>0").
    vector : sequence of float, shape (3,)
        Force (N) on each of these nodes.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    nodes: int | str | Sequence[int]
    vector: Sequence[float]
    history: History | Callable[[Any], Any] | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        object.__setattr__(self, "vector", vector("vector", self.vector))
        object.__setattr__(self, "history", as_history(self.history))
