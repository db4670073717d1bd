"""Loads: forces on nodes, and gravity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from foldyn.cases.function import as_history
from foldyn.cases.histories import History
from foldyn.cases.selection import check_nodes
from foldyn.values import vector


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


@dataclass(frozen=True)
class Gravity:
    """Gravity on the whole structure, times a history.

    Each node gets the sum of its row of the mass matrix times the acceleration, so that the
    weight is exact with every mass rule and a free structure falls with the acceleration itself.
    What supports hold goes into the reactions.

    Parameters
    ----------
    acceleration : sequence of float, shape (3,)
        Acceleration (m/s2) of free fall, as (0, 0, -9.81); not zero.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    acceleration: Sequence[float]
    history: History | Callable[[Any], Any] | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        given = vector("acceleration", self.acceleration, nonzero=True)
        object.__setattr__(self, "acceleration", given)
        object.__setattr__(self, "history", as_history(self.history))
