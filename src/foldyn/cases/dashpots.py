"""Dashpots: viscous dampers between nodes and the ground, or between two nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.decode import Part
from foldyn.cases.directions import check_direction, check_pairs, unit_vector
from foldyn.cases.selection import check_nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.values import brief, number, show

NEAR = 1e-12  # of the structure's size: nodes closer than that have no line between them


@brief
@dataclass(frozen=True)
class Dashpot(Part):
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
    apart = "dashpots are a support of their own"

    def __post_init__(self) -> None:
        """Check the arguments."""
        coefficient = number("coefficient", self.coefficient, least=0.0)
        object.__setattr__(self, "coefficient", coefficient)
        if (self.nodes is None) == (self.between is None):
            raise InputError(
                ": give either nodes, which it ties to the ground, or between, the two nodes that "
                "it ties to each other",
                "nodes" if self.between is None else "between",
            )
        if self.nodes is not None:
            object.__setattr__(self, "nodes", check_nodes(self.nodes))
        else:
            object.__setattr__(self, "between", check_pairs("between", self.between))
        if self.direction is not None:
            object.__setattr__(self, "direction", check_direction("direction", self.direction))

    def ends(self, structure: Any, place: str) -> NDArray[np.int64]:
        """Nodes (k, 1) that are tied to the ground, or pairs (k, 2) of nodes."""
        if self.between is None:
            assert self.nodes is not None
            return resolve_nodes(structure, self.nodes, f"{place}.nodes")[:, None]
        pairs = np.array(self.between, np.int64)
        bad = pairs[pairs >= len(structure.nodes)]
        if bad.size:
            raise InputError(
                f" = {show(self.between)}: node {bad[0]} is out of range; this structure has nodes "
                f"0 to {len(structure.nodes) - 1}",
                f"{place}.between",
            )
        apart = np.linalg.norm(np.diff(structure.nodes[pairs], axis=1)[:, 0], axis=1)
        short = pairs[apart <= NEAR * np.ptp(structure.nodes, axis=0).max()]
        if short.size and self.direction is None:
            a, b = short[0].tolist()
            raise InputError(
                f": nodes {a} and {b} are in one place, with no line between them; give a "
                "direction",
                f"{place}.between",
            )
        return pairs

    @property
    def along(self) -> NDArray[np.float64] | None:
        """Unit vector (3,) in which it acts; None without a fixed direction."""
        return None if self.direction is None else unit_vector(self.direction)
