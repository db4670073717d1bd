"""Dashpots: viscous dampers between nodes and the ground, or between two nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from foldyn.arguments import Check, Key
from foldyn.cases.connectors import Connector
from foldyn.cases.directions import Direction, Pairs
from foldyn.cases.selection import Nodes
from foldyn.values import number


@dataclass(frozen=True)
class Dashpot(Connector):
    """Viscous dampers: a force c times a velocity, against it.

    From a node to the ground, which stands still even where a base moves; or between two nodes,
    against the rate of their distance, or of its component along a fixed direction.

    Parameters
    ----------
    coefficient : float
        Damping c of each dashpot, N s/m, at least 0.
    nodes : int, sequence of int, or str, optional
        Nodes that have one each to the ground.
    between : sequence of int, or of pairs of them, optional
        Instead of `nodes`: two nodes, as (0, 5), or several pairs, with a dashpot each.
    direction : {"x", "y", "z", "-x", "-y", "-z"} or sequence of float, shape (3,), optional
        The only direction in which it acts, fixed in space. Without it a dashpot to the ground acts
        against any motion of its node, and one between nodes along the line from one to the other,
        as it is now.
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
