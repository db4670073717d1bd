"""Dashpots: viscous dampers between nodes and the ground, or between two nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from foldyn.cases.connectors import Connector
from foldyn.values import brief, number


@brief
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

    coefficient: float
    nodes: int | str | Sequence[int] | None = None
    between: Sequence[int] | Sequence[Sequence[int]] | None = None
    direction: str | Sequence[float] | None = None

    keys = {
        "dashpot": "coefficient",
        "nodes": "nodes",
        "between": "between",
        "direction": "direction",
    }
    own = "dashpot"
    apart = "dashpots are a support of their own"
    asked = (
        "either nodes, which it ties to the ground, or between, the two nodes that it ties to each "
        "other"
    )
    no_line = ": nodes {a} and {b} are in one place, with no line between them; give a direction"

    def __post_init__(self) -> None:
        """Check the arguments."""
        coefficient = number("coefficient", self.coefficient, least=0.0)
        object.__setattr__(self, "coefficient", coefficient)
        self._check_ends()
