"""Springs and dashpots, which tie nodes to the ground or to each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Part
from foldyn.cases.directions import Direction, Pairs, unit_vector
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.errors import InputError
from foldyn.mechanics.springs import GROUND, Springs, SpringsTerm
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
class Spring(Connector):
    """Linear springs: from nodes to the ground, or between nodes.

    A spring to the ground pulls its node back with k (u . d), with u the displacement of the node
    from its rest position and d a direction. The foot of the spring stands still in space, even if
    a base moves.

    A spring between nodes a and b pulls along the current line between them with k (l - l0), with l
    their distance. If a direction d is given, it pulls along d with k (u_b - u_a) . d, for any
    positions.

    Parameters
    ----------
    stiffness : float
        k of each spring (N/m), above 0.
    nodes : int, sequence of int, or str, optional
        Nodes with springs to the ground: numbers, or an expression that selects vertices.
    between : sequence of (int, int), optional
        Pairs of nodes, instead of `nodes`.
    direction : {"x", "y", "z", "-x", "-y", "-z"} or sequence of float, shape (3,), optional
        d, of any length. Without it, springs to the ground act along all three axes, and springs
        between nodes along the line between them.
    rest_length : float, optional
        l0 of springs between nodes without a direction (m); their distance at rest by default.
    """

    stiffness: Annotated[float, Check(number, above=0.0, unit="N/m")]
    nodes: Nodes | None = None
    between: Pairs | None = None
    direction: Direction | None = None
    rest_length: Annotated[float | None, Check(number, least=0.0, unit="m")] = None

    missing = {"stiffness": "give it (N/m) for springs, or dashpot (N s/m)"}
    apart = "springs are a support of their own"
    asked = "nodes, for springs to the ground, or between, for springs between nodes"
    no_line = (
        "[{k}] = [{a}, {b}]: these nodes coincide, so that the line between them has no direction; "
        'give direction, as in direction = "x"'
    )

    def agree(self) -> None:
        """Refuse a rest length for springs to the ground or along a direction."""
        super().agree()
        rest = self.rest_length
        if rest is not None and (self.between is None or self.direction is not None):
            raise InputError(
                f" = {rest:g}: only for springs along the line between nodes; leave it out, or "
                "give between and no direction",
                "rest_length",
            )

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Discretized) -> SpringsTerm:
        """See `Part`."""
        return SpringsTerm(packed(parts, structure))


def packed(parts: Iterable[tuple[str, Spring]], structure: Discretized) -> Springs:
    """Arrays of springs, each with its place for messages.

    Raises
    ------
    InputError
        A node is out of range, or the ends of a spring without a direction coincide.
    """
    x, pair, line, none = structure.nodes, np.zeros((0, 2), np.int64), np.zeros((0, 3)), np.zeros(0)
    ends, direction, stiffness = [pair], [line], [none]
    axial, vector, natural, along = [pair], [line], [none], [none]
    for place, spring in parts:
        pairs, axes = spring.ends(structure, place), spring.directions
        if axes is not None:
            ends.append(np.repeat(pairs, len(axes), axis=0))
            direction.append(np.tile(axes, (len(pairs), 1)))
            stiffness.append(np.full(len(pairs) * len(axes), spring.stiffness))
            continue
        apart = x[pairs[:, 1]] - x[pairs[:, 0]]
        length = np.linalg.norm(apart, axis=1)
        axial.append(pairs)
        vector.append(apart)
        rest = spring.rest_length
        natural.append(length if rest is None else np.full(len(length), rest))
        along.append(np.full(len(length), spring.stiffness))
    vectors = np.concatenate(vector)
    length = np.linalg.norm(vectors, axis=1)
    return Springs(
        ends=np.concatenate(ends).astype(np.int64),
        direction=np.concatenate(direction),
        stiffness=np.concatenate(stiffness),
        axial_ends=np.concatenate(axial).astype(np.int64),
        vector=vectors,
        length=length,
        stretch=length - np.concatenate(natural),
        axial_stiffness=np.concatenate(along),
    )


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
