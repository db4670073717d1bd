"""Sides of a pattern's edges: where panels meet them, two or, at junctions, more."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.topology import around, edge_lookup, edge_of


class EdgeSides(NamedTuple):
    """The s sides of e edges: two of each edge in turn, then further ones of junctions.

    The first side of an edge that is no junction has the panel that runs from its lower to its
    higher vertex, the second the other, if there is one.

    Attributes
    ----------
    edge, rank, way : (s,)
        Edge in the order of `Pattern.lines`, number among the edge's sides, and 1 if the panel runs
        along the edge from its lower to its higher vertex, else -1.
    of : dict
        Side by panel and edge.
    creases : (nc, 2)
        Sides of both panels at each crease.
    crease_edge : (nc,)
        Edge of each crease.
    """

    edge: NDArray[np.int64]
    rank: NDArray[np.int64]
    way: NDArray[np.int64]
    of: dict[tuple[int, int], int]
    creases: NDArray[np.int64]
    crease_edge: NDArray[np.int64]

    @property
    def along(self) -> list[NDArray[np.int64]]:
        """Sides of each edge."""
        order = np.lexsort((self.rank, self.edge))
        return np.split(order, np.flatnonzero(np.diff(self.edge[order])) + 1)


def edge_sides(pattern: Pattern) -> EdgeSides:
    """Sides of a pattern's edges."""
    number, junctions = edge_lookup(pattern.lines), edge_lookup(pattern.junctions)
    edge = np.repeat(np.arange(len(number)), 2).tolist()
    rank, way = [0, 1] * len(number), [1, -1] * len(number)
    taken, of = dict.fromkeys(junctions, 0), {}
    for panel, face in enumerate(pattern.faces):
        for a, b in around(face):
            pair = edge_of(a, b)
            row = number[pair]
            side = 2 * row + int(a > b)
            if pair in junctions:
                side = 2 * row + taken[pair] if taken[pair] < 2 else len(edge)
                if side == len(edge):
                    edge.append(row)
                    rank.append(taken[pair])
                    way.append(1)
                way[side] = 1 if a < b else -1
                taken[pair] += 1
            of[panel, row] = side
    crease_edge = [number[a, b] for a, b in pattern.creases.tolist()]
    beside = zip(crease_edge, pattern.crease_faces.tolist(), strict=True)
    creases = [[of[panel, row] for panel in both] for row, both in beside]
    return EdgeSides(
        np.array(edge), np.array(rank), np.array(way), of,
        np.array(creases, np.int64).reshape(-1, 2), np.array(crease_edge, np.int64),
    )  # fmt: skip
