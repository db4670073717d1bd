"""Springs: from nodes to the ground, or between nodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from foldyn.arguments import Check
from foldyn.cases.connectors import Connector
from foldyn.cases.directions import Direction, Pairs
from foldyn.cases.selection import Nodes
from foldyn.errors import InputError
from foldyn.mechanics.springs import Springs, SpringsTerm
from foldyn.values import number


@dataclass(frozen=True)
class Spring(Connector):
    """Linear springs: from nodes to the ground, or between nodes.

    To the ground each node is pulled back with k (u . d), u its displacement from the rest position
    and d a direction. The foot stands still in space; no base motion moves it.

    Between two nodes a spring pulls along the current line between them with k (l - l0), l their
    distance; with a direction, along that with k (u_b - u_a) . d, wherever they are.

    Parameters
    ----------
    stiffness : float
        k of each spring (N/m), above 0.
    nodes : int, sequence of int, or str, optional
        Nodes that stand on the ground: numbers, or an expression over the pattern's vertices.
    between : sequence of (int, int), optional
        Pairs of nodes, instead of `nodes`.
    direction : {"x", "y", "z", "-x", "-y", "-z"} or sequence of float, shape (3,), optional
        d, of any length. Without it springs to the ground act along all three axes, and those
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
        """Refuse a length of springs that have none."""
        super().agree()
        rest = self.rest_length
        if rest is not None and (self.between is None or self.direction is not None):
            raise InputError(
                f" = {rest:g}: only for springs along the line between nodes; leave it out, or "
                "give between and no direction",
                "rest_length",
            )

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Any) -> SpringsTerm:
        """See `Part`."""
        return SpringsTerm(packed(parts, structure))


def packed(parts: Iterable[tuple[str, Spring]], structure: Any) -> Springs:
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
