"""What springs and dashpots have in common: they tie nodes to the ground, or to each other."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.decode import Part
from foldyn.cases.directions import Direction, Pairs, unit_vector
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.mechanics.springs import GROUND

NEAR = 1e-9  # of the structure's size: nodes closer than that have no line between them


class Connector(Part):
    """Base of the frozen data classes that tie nodes to the ground, or to each other.

    Attributes
    ----------
    nodes, between, direction
        Nodes on the ground or, instead, pairs of nodes; the direction in which it acts, if it is a
        fixed one.
    asked, no_line : str
        Messages where not one of `nodes` and `between` is given, and where the nodes a and b of
        pair k are in one place and have no direction.
    """

    nodes: Nodes | None
    between: Pairs | None
    direction: Direction | None

    asked: ClassVar[str]
    no_line: ClassVar[str]

    def agree(self) -> None:
        """Ask for one of what it may tie."""
        if (self.nodes is None) == (self.between is None):
            raise InputError(f": give {self.asked}", "nodes" if self.between is None else "between")

    def ends(self, structure: Any, place: str) -> NDArray[np.int64]:
        """Ends (k, 2); `GROUND` in place of the second.

        Raises
        ------
        InputError
            A node is out of range; or without a direction, two ends are in one place.
        """
        if self.nodes is not None:
            nodes = resolve_nodes(structure, self.nodes, f"{place}.nodes")
            return np.stack([nodes, np.full(len(nodes), GROUND)], axis=1)
        pairs = np.array(self.between, np.int64)
        for k, pair in enumerate(pairs.tolist()):
            resolve_nodes(structure, pair, f"{place}.between[{k}]")
        apart = np.linalg.norm(np.diff(structure.nodes[pairs], axis=1)[:, 0], axis=1)
        meet = np.flatnonzero(apart <= NEAR * np.ptp(structure.nodes, axis=0).max())
        if meet.size and self.direction is None:
            a, b = pairs[meet[0]].tolist()
            raise InputError(self.no_line.format(k=meet[0], a=a, b=b), f"{place}.between")
        return pairs

    @property
    def directions(self) -> NDArray[np.float64] | None:
        """Unit vectors (k, 3) along which it acts; None of the line between its ends."""
        if self.direction is not None:
            return unit_vector(self.direction)[None]
        return np.eye(3) if self.nodes is not None else None
