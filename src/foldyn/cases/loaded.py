"""What the loads of a case do: forces, gravity, creases that fold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.history import History, as_history
from foldyn.cases.loads import Gravity, Load
from foldyn.cases.terms import Summands, Terms, summed, union
from foldyn.errors import InputError
from foldyn.mechanics.following import Following


class Loaded:
    """Loads of a case, which has `structure`, `loads` and `nodal_mass`; see `Case`."""

    structure: Any
    loads: Sequence[Load]
    nodal_mass: Any

    @cached_property
    def actuation_terms(self) -> Terms:
        """Changes (rad) of the folds' rest angles at factor 1, shape (nf,), with their history."""
        return summed(self._actuated())

    @cached_property
    def rest_terms(self) -> Terms:
        """Changes (rad) of all rest angles at factor 1, shape (nr,), with their history."""
        return summed(self._turned())

    def _turned(self) -> Summands:
        count = len(self.structure.body.sheet.rest_angles)
        for change, history in self.actuation_terms:
            yield np.pad(change, (0, count - len(change))), history
        for place, load in self._loads():
            turns = load.turns(self.structure, place)
            if turns is not None and turns.any():
                yield np.pad(turns, (0, count - len(turns))), load.history

    def _actuated(self) -> Summands:
        first: dict[int, str] = {}  # the load that actuates a crease
        for place, load in self._loads():
            actuated = load.rest_changes(self.structure, place)
            if actuated is None:
                continue
            creases, change = actuated
            for crease in creases.tolist():
                if crease in first:
                    raise InputError(
                        f"{place}.creases: crease {crease} is actuated by {first[crease]} already; "
                        "leave it out of one of the two"
                    )
                first[crease] = place
            vector = np.zeros(len(self.structure.folds))
            vector[creases] = change
            yield vector, load.history

    @cached_property
    def load_terms(self) -> Terms:
        """Forces (N) on all nodes, shape (n, 3), each with its history."""
        return summed(self._forces(self._loads()))

    @cached_property
    def force_terms(self) -> Terms:
        """The terms of `load_terms` without gravity."""
        return summed(self._forces(pair for pair in self._loads() if pair[1].arrows))

    def _forces(self, loads: Iterable[tuple[str, Load]]) -> Summands:
        for place, load in loads:
            forces = load.forces(self.structure, place)
            if isinstance(load, Gravity):
                forces = load.weight(self.nodal_mass)
            if forces is not None:
                yield forces, load.history

    @cached_property
    def following_terms(self) -> tuple[tuple[Following, History], ...]:
        """Forces that depend on the displacement, of each load that has them, with its history."""
        found = ((load.following(self.structure, place), load) for place, load in self._loads())
        return tuple((part, as_history(load.history)) for part, load in found if part is not None)

    @cached_property
    def gravity_terms(self) -> Terms:
        """Accelerations of gravity (m/s2), shape (3,), each with its history."""
        gravity = (load for _, load in self.placed(Gravity))
        return summed((np.array(load.acceleration), load.history) for load in gravity)

    @cached_property
    def loaded_nodes(self) -> NDArray[np.int64]:
        """Nodes on which a force acts, increasing; gravity, which acts on all, does not count."""
        return union([load.loaded(self.structure, place) for place, load in self._loads()])

    @cached_property
    def actuated_creases(self) -> NDArray[np.int64]:
        """Creases that a load actuates, increasing."""
        pairs = [load.rest_changes(self.structure, place) for place, load in self._loads()]
        return union([pair[0] for pair in pairs if pair is not None])

    def placed(self, kind: type) -> Iterator[tuple[str, Any]]:
        """Loads of one kind, with their places for messages."""
        return (pair for pair in self._loads() if isinstance(pair[1], kind))

    def _loads(self) -> Iterator[tuple[str, Load]]:
        """Loads with their places for messages."""
        return ((f"loads[{i}]", load) for i, load in enumerate(self.loads))


@dataclass(frozen=True, eq=False)
class SomeLoads(Loaded):
    """Some loads of a case, which has checked them, with their places in it.

    Parameters
    ----------
    case : Case
    numbers : sequence of int
        Their numbers among the loads of the case.
    """

    case: Loaded
    numbers: Sequence[int]

    @property
    def structure(self) -> Any:
        """The structure of the case."""
        return self.case.structure

    @property
    def nodal_mass(self) -> NDArray[np.float64]:
        """Mass (n,) that moves with each node in the case, kg."""
        return self.case.nodal_mass

    @property
    def loads(self) -> Sequence[Load]:
        """These loads."""
        return tuple(self.case.loads[i] for i in self.numbers)

    def _loads(self) -> Iterator[tuple[str, Load]]:
        pairs = zip(self.numbers, self.loads, strict=True)
        return ((f"loads[{i}]", load) for i, load in pairs)
