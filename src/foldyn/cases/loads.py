"""Loads: forces on nodes, gravity, and the registry of all."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.actuation import Actuate
from foldyn.cases.function import as_history
from foldyn.cases.histories import History
from foldyn.cases.part import Load, given_keys
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.errors import FoldynWarning, InputError, within
from foldyn.values import show, vector

__all__ = ["LOADS", "Actuate", "Force", "Gravity", "Load"]


@dataclass(frozen=True)
class Force(Load):
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

    keys = {"nodes": "nodes", "force": "vector"}
    missing = dict.fromkeys(keys, "give its value")
    apart = "acts on some nodes"
    arrows = True

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "nodes", check_nodes(self.nodes))
        object.__setattr__(self, "vector", vector("vector", self.vector))
        object.__setattr__(self, "history", as_history(self.history))

    def loaded(self, structure: Any, place: str) -> NDArray[np.int64]:
        """See `Load`."""
        return resolve_nodes(structure, self.nodes, f"{place}.nodes")

    def forces(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        found = np.zeros((len(structure.nodes), 3))
        found[self.loaded(structure, place)] = self.vector
        return found

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a force that acts on held axes only; warn of one that does so in part."""
        nodes = self.loaded(structure, place)
        acts = np.flatnonzero(self.vector)
        held = fixed[np.ix_(nodes, acts)]
        if not held.any():
            return
        what = ", ".join(
            f"{node} ({''.join('xyz'[a] for a in acts[row])})"
            for node, row in zip(nodes, held, strict=True)
            if row.any()
        )
        what = what if len(what) < 80 else what[:76] + " ..."
        if held.all():
            raise InputError(
                f": the force {show(self.vector)} acts only where supports hold its nodes: "
                f"{what}; load other nodes or axes, or free these",
                place,
            )
        warnings.warn(
            f"{place}: the force {show(self.vector)} acts in part where supports hold its nodes: "
            f"{what}; that part goes into the reactions only",
            FoldynWarning,
            stacklevel=4,
        )


@dataclass(frozen=True)
class Gravity(Load):
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

    keys = {"gravity": "acceleration"}
    missing = dict.fromkeys(keys, "give its value")
    apart = "acts on the whole structure"

    def __post_init__(self) -> None:
        """Check the arguments."""
        given = vector("acceleration", self.acceleration, nonzero=True)
        object.__setattr__(self, "acceleration", given)
        object.__setattr__(self, "history", as_history(self.history))

    def forces(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        mass = np.asarray(structure.mass.sum(axis=1)).ravel()
        return mass[:, None] * np.array(self.acceleration)

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse gravity where the mass is not known."""
        with within(f"{place}: gravity needs the mass of the structure: "):
            _ = structure.mass


LOADS: tuple[type[Load], ...] = (Force, Gravity, Actuate)
"""All kinds; where a case file gives keys of several in one table, the last is meant."""


def load_from(table: Any, folder: Path | None = None) -> Load:
    """Load from its table in a case file; see `Part.of`."""
    given = given_keys(table, LOADS) - {"history"}
    if not given:
        raise InputError(f": give {', or '.join(' and '.join(kind.keys) for kind in LOADS)}")
    kind = next(kind for kind in reversed(LOADS) if given & set(kind.keys))
    others = [key for key in table if key in given and key not in kind.keys]
    if others:
        own = next(key for key in kind.keys if key in given)
        raise InputError(
            f": {kind.apart}; leave out {' and '.join(others)}, or write [[loads]] for each load",
            f".{own}",
        )
    return kind.of(table, folder)
