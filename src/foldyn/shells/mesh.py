"""Panels cut into small triangles that fit together along the creases."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around
from foldyn.structures.graded import Grading
from foldyn.structures.mesh import CUT, Triangle, check_triangles

EQUAL = 1e-6  # relative difference of diagonals that counts as none


@dataclass(frozen=True, eq=False)
class ShellMesh:
    """Triangles of all panels.

    Attributes
    ----------
    nodes : (n, 3)
        The pattern's vertices in order, then points of its edges, then points inside panels, m.
    triangles, panel : (nt, 3), (nt,)
        Counter-clockwise from the front, and the panel of each.
    edge_points : dict
        Nodes along each edge of the pattern, by (low, high) vertex, from low to high.
    """

    nodes: NDArray
    triangles: NDArray
    panel: NDArray
    edge_points: dict[Edge, list[int]]


class _Points:
    """Nodes as they are made."""

    def __init__(self, vertices: NDArray) -> None:
        self.all: list[NDArray] = list(vertices)

    def add(self, point: NDArray) -> int:
        self.all.append(point)
        return len(self.all) - 1

    def line(self, a: int, b: int, places: Iterable[float]) -> list[int]:
        """Nodes from a to b, both included, with new ones at places of (0, 1) between them."""
        x, y = self.all[a], self.all[b]
        return [a, *(self.add(x + (y - x) * place) for place in places), b]


def shell_mesh(pattern: Pattern, divisions: int, graded: Grading | None = None) -> ShellMesh:
    """Cut every edge of a pattern into `divisions` pieces and its panels into triangles.

    Quadrilaterals get a grid whose cells are cut in two, triangles are divided evenly, and other
    polygons are first cut into triangles about the mean of their corners. Where they are `graded`,
    that says how all are cut.
    """
    points = _Points(pattern.vertices)
    even = [step / divisions for step in range(1, divisions)]
    edges = {}
    for low, high in pattern.lines.tolist():
        length = float(np.linalg.norm(pattern.vertices[high] - pattern.vertices[low]))
        edges[low, high] = points.line(low, high, graded.places(length) if graded else even)
    triangles, panels = [], []
    for number, face in enumerate(pattern.faces):
        sides = [_side(edges, a, b) for a, b in around(face)]
        if graded:
            pieces = _graded(points, sides, graded)
        elif len(face) == 3:
            pieces = _divided(points, sides)
        elif len(face) == 4:
            pieces = _grid(points, sides)
        else:
            pieces = _fan(points, sides, even)
        triangles += pieces
        panels += [number] * len(pieces)
    nodes, rows, panel = np.array(points.all), np.array(triangles, np.int64), np.array(panels)
    remedy = f"the panel is not convex enough to be meshed; {CUT}"
    check_triangles(nodes, rows, panel, pattern, remedy)
    return ShellMesh(nodes, rows, panel, edges)


def _side(edges: dict[Edge, list[int]], a: int, b: int) -> list[int]:
    """Nodes from vertex a to vertex b."""
    return edges[a, b] if a < b else edges[b, a][::-1]


def _grid(points: _Points, sides: list[list[int]]) -> list[Triangle]:
    """Triangles of a quadrilateral with sides 0-1, 1-2, 2-3, 3-0."""
    bottom, right, top, left = sides[0], sides[1], sides[2][::-1], sides[3][::-1]
    n = len(bottom) - 1
    p, q = points.all[bottom[0]], points.all[bottom[-1]]
    r, s = points.all[top[-1]], points.all[top[0]]
    node = np.empty((n + 1, n + 1), np.int64)
    node[:, 0], node[:, n], node[0], node[n] = bottom, top, left, right
    for i in range(1, n):
        for j in range(1, n):
            x, y = i / n, j / n
            node[i, j] = points.add((1 - y) * ((1 - x) * p + x * q) + y * ((1 - x) * s + x * r))
    return _halves(node, np.array([points.all[k] for k in node.ravel()]).reshape(n + 1, n + 1, 3))


def _halves(node: NDArray, x: NDArray) -> list[Triangle]:
    """Triangles of a grid of nodes (n + 1, n + 1) at x (n + 1, n + 1, 3).

    Each cell is cut at its shorter diagonal, in a pattern that has the panel's own symmetries;
    cells with diagonals of one length alternate.
    """
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    ac = np.linalg.norm(x[1:, 1:] - x[:-1, :-1], axis=2)
    bd = np.linalg.norm(x[:-1, 1:] - x[1:, :-1], axis=2)
    odd = np.indices(a.shape).sum(axis=0) % 2 == 1
    cut_bd = np.where(np.abs(ac - bd) <= EQUAL * ac, odd, bd < ac)[:, :, None]
    one = np.where(cut_bd, np.stack([a, b, d], 2), np.stack([a, b, c], 2))
    two = np.where(cut_bd, np.stack([b, c, d], 2), np.stack([a, c, d], 2))
    return list(map(tuple, np.stack([one, two], axis=2).reshape(-1, 3).tolist()))


def _divided(points: _Points, sides: list[list[int]]) -> list[Triangle]:
    """Triangles of a triangle with sides 0-1, 1-2, 2-0."""
    n = len(sides[0]) - 1
    p, q, r = (points.all[side[0]] for side in sides)
    node = {}
    for k in range(n + 1):
        node[k, 0], node[n - k, k], node[0, n - k] = sides[0][k], sides[1][k], sides[2][k]
    for i in range(1, n):
        for j in range(1, n - i):
            node[i, j] = points.add(p + (q - p) * (i / n) + (r - p) * (j / n))
    out = []
    for i in range(n):
        for j in range(n - i):
            out.append((node[i, j], node[i + 1, j], node[i, j + 1]))
            if i + j < n - 1:
                out.append((node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]))
    return out


def _fan(points: _Points, sides: list[list[int]], even: list[float]) -> list[Triangle]:
    """Triangles of a polygon, cut along spokes from its corners to their mean."""
    corners = [side[0] for side in sides]
    center = points.add(np.mean([points.all[k] for k in corners], axis=0))
    spokes = [points.line(k, center, even) for k in corners]
    out = []
    for k, side in enumerate(sides):
        out += _divided(points, [side, spokes[(k + 1) % len(sides)], spokes[k][::-1]])
    return out


def _graded(points: _Points, sides: list[list[int]], graded: Grading) -> list[Triangle]:
    """Triangles of a polygon, graded toward its corners."""
    center = points.add(np.mean([points.all[side[0]] for side in sides], axis=0))
    cuts = [points.line(side[graded.arcs], center, graded.steps) for side in sides]
    out = []
    for k, side in enumerate(sides):
        before = sides[k - 1][::-1]
        patch = [side[0], cuts[k][0], center, cuts[k - 1][0]]
        x = graded.points(np.array([points.all[corner] for corner in patch]))
        node = np.empty(x.shape[:2], np.int64)
        node[:, 0], node[:, -1] = side[1 : graded.arcs + 1], before[1 : graded.arcs + 1]
        node[-1] = [*cuts[k], *cuts[k - 1][-2::-1]]
        for i, j in np.ndindex(len(x) - 1, x.shape[1] - 2):
            node[i, j + 1] = points.add(x[i, j + 1])
        out += [(side[0], *pair) for pair in pairwise(node[0].tolist())]
        out += _halves(node, np.array([points.all[k] for k in node.ravel()]).reshape(x.shape))
    return out
