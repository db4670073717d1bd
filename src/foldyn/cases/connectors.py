"""Connectors tie nodes to the ground or to each other; dashpots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Part
from foldyn.cases.directions import Direction, Pairs, unit_vector
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.mechanics.lines import GROUND
from foldyn.structures.discretized import Discretized
from foldyn.values import number

NEAR = 1e-9  # nodes closer than this fraction of the structure's size have no line between them


class Connector(Part):
    """Base of frozen data classes that tie nodes to the ground or to each other.

    Attributes
    ----------
    nodes, between, direction
        Nodes tied to the ground, or instead pairs of nodes tied to each other; the direction, if it
        is fixed.
    asked, no_line : str
        Messages if not exactly one of `nodes` and `between` is given, and if the nodes a and b of
        pair k coincide and no direction is given.
    """

    nodes: Nodes | None
    between: Pairs | None
    direction: Direction | None

    asked: ClassVar[str]
    no_line: ClassVar[str]

    def agree(self) -> None:
        """Require exactly one of `nodes` and `between`."""
        if (self.nodes is None) == (self.between is None):
            raise InputError(f": give {self.asked}", "nodes" if self.between is None else "between")

    def ends(self, structure: Discretized, place: str) -> NDArray[np.int64]:
        """Pairs of ends (k, 2); the second is `GROUND` for nodes on the ground.

        Raises
        ------
        InputError
            A node is out of range, or two ends coincide and no direction is given.
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
        """Unit vectors (k, 3) of fixed directions; None: along the lines between the ends."""
        if self.direction is not None:
            return unit_vector(self.direction)[None]
        return np.eye(3) if self.nodes is not None else None


@dataclass(frozen=True)
class Dashpot(Connector):
    """Viscous dampers: the force is c times a velocity and opposes it.

    A dashpot acts between a node and the ground, which stays at rest even if a base moves; or
    between two nodes, against the rate of their distance, or against the component of their
    relative velocity along a fixed direction.

    Parameters
    ----------
    coefficient : float
        Damping c of each dashpot, N s/m, at least 0.
    nodes : int, sequence of int, or str, optional
        Nodes that each get a dashpot to the ground.
    between : sequence of int, or of pairs of them, optional
        Instead of `nodes`: two nodes, such as (0, 5), or several pairs with a dashpot each.
    direction : {"x", "y", "z", "-x", "-y", "-z"} or sequence of float, shape (3,), optional
        The only direction in which the dashpot acts, fixed in space. Without it, a dashpot to the
        ground acts against any motion of its node, and a dashpot between nodes along the current
        line between them.
    """

    coefficient: Annotated[float, Check(number, least=0.0, unit="N s/m"), Key("dashpot")]
    nodes: Nodes | None = None
    between: Pairs | None = None
    direction: Direction | None = None

    apart = "dashpots are a support of their own"
    asked = (
        "either nodes, which it ties to the ground, or between, the two nodes that it ties to each "
        "other"
    )
    no_line = ": nodes {a} and {b} are in one place, with no line between them; give a direction"
