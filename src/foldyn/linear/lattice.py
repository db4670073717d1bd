"""Panels, edges and vertices named by cell and kind, for all cells, and patches of panels.

A vertex of the repeated sheet is named by its cell and its kind: (R, kind). Vertices are ordered by
cell first, then by kind, and so are panels. Any two of them are therefore in the same order in all
cells. So choices of a discretization that depend on this order are the same in all cells:
directions of hinges, signs of rotations, ties.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, quietly
from foldyn.linear.unit_cell import Step, UnitCell, Vertex, minus
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import ASSIGNED
from foldyn.patterns.topology import around, edge_of

RINGS = 2  # rings of panels around the panels at the nodes of the cell
FLAT = 1e-6  # rad: a crease between cells whose dihedral is closer to pi counts as flat

Panel = tuple[Step, int]  # cell and number
Site = tuple[Step, tuple[Any, ...]]  # cell, and representative of a node or hidden dof
Kind = tuple[int, int, Step]  # kind of an edge: kinds of its vertices, R between them


def plus(one: Step, two: Step) -> Step:
    """Sum of two R."""
    return tuple(a + b for a, b in zip(one, two, strict=True))


class Edge(NamedTuple):
    """An edge: its kind, which is the same in all cells, and the cell of its first vertex."""

    kind: Kind
    step: Step


def edge_between(one: Vertex, two: Vertex) -> Edge:
    """The edge between two vertices."""
    low, high = sorted((one, two))
    return Edge((low[1], high[1], minus(high[0], low[0])), low[0])


def kinds_of(pairs: NDArray, vertices: Sequence[Vertex]) -> list[Kind]:
    """Kinds of edges (m, 2), given as pairs of indices in `vertices`."""
    return [edge_between(vertices[a], vertices[b]).kind for a, b in pairs.tolist()]


class Lattice:
    """A cell whose panels, edges and vertices have names that are valid in all cells.

    Parameters
    ----------
    cell : UnitCell

    Attributes
    ----------
    vertices : list of Vertex
        Vertices of the cell itself.
    faces : list of list of Vertex
        Corners of each panel, moved so that the lowest corner is in cell 0.
    steps : list of Step
        R of the cell in which each panel of the pattern lies in this naming.
    beside : dict
        For each kind of edge, the panels at it, with the cell of the edge if the panel is in cell
        0.
    """

    def __init__(self, cell: UnitCell) -> None:
        pattern: Pattern = cell.case.structure.pattern
        self.cell, self.pattern, self.zero = cell, pattern, (0,) * cell.dimensions
        self.vertices = cell.copies.named
        panels = cell.copies.panels(pattern)
        self.steps = [step for step, _ in panels]
        self.faces = [corners for _, corners in panels]
        self.beside: dict[Kind, list[tuple[int, Step]]] = {}
        for f in range(len(self.faces)):
            for edge in self._edges(f):
                self.beside.setdefault(edge.kind, []).append((f, edge.step))

    def _edges(self, f: int) -> Iterator[Edge]:
        face = self.faces[f]
        return (edge_between(a, b) for a, b in zip(face, [*face[1:], face[0]], strict=True))

    def edge(self, a: int, b: int) -> Edge:
        """The edge between two vertices of the pattern."""
        return edge_between(self.vertices[a], self.vertices[b])

    def seams(self) -> list[tuple[int, int]]:
        """Boundary edges of the pattern that are creases between cells, one for each kind."""
        kinds: dict[Kind, tuple[int, int]] = {}
        for a, b in self.pattern.boundary.tolist():
            kind = self.edge(a, b).kind
            if len(self.beside[kind]) > 1:
                kinds.setdefault(kind, (a, b))
        return list(kinds.values())

    def families(self) -> dict[str, set[Kind]]:
        """Kinds of the edges of each family, including creases between cells."""
        own = self.pattern
        found = {}
        for name, rows in own.families.items():
            rim = own.boundary[own.rim_families.get(name, np.zeros(0, np.int64))]
            found[name] = set(kinds_of(np.concatenate([own.creases[rows], rim]), self.vertices))
        return found

    def refuse_letters(self, words: Iterable[str], field: str) -> None:
        """Refuse letters if creases of the cell are junctions of it, whose letters are others."""
        letters = sorted({*words} & (ASSIGNED.keys() - {"all"}))
        own = kinds_of(self.pattern.creases, self.vertices)
        if letters and any(len(self.beside[kind]) > 2 for kind in own):
            raise InputError(
                f": {', '.join(letters)}: creases at which more than two panels meet have no "
                "letters of their own; name families, or all",
                field,
            )

    # ------------------------------------------------------------------ a patch
    def around_cell(self) -> list[Panel]:
        """Panels around cell 0, sorted: panels at its nodes, and rings of panels around these.

        Two panels alone would share a front: none are left alone at a junction of several.
        """
        found = {(minus(self.zero, step), f) for f, own in enumerate(self.faces) for step, _ in own}
        for _ in range(RINGS):
            found |= {other for panel in found for other in self._across(*panel)}
        while missing := self._beside_pairs(found) - found:
            found |= missing
        return sorted(found)

    def _beside_pairs(self, panels: set[Panel]) -> set[Panel]:
        """All panels at junctions at which there are two of the given panels."""
        at: Counter[tuple[Kind, Step]] = Counter()
        for step, f in panels:
            at.update((edge.kind, plus(step, edge.step)) for edge in self._edges(f))
        twice = [place for place, count in at.items() if count == 2]
        return {(minus(step, cell), f) for kind, step in twice for f, cell in self.beside[kind]}

    def _across(self, step: Step, f: int) -> Iterator[Panel]:
        """Panels across the edges of a panel."""
        for edge in self._edges(f):
            for other, at in self.beside[edge.kind]:
                yield minus(plus(step, edge.step), at), other

    def vertices_of(self, panels: Iterable[Panel]) -> set[Vertex]:
        """Vertices of panels."""
        return {(plus(step, at), kind) for step, f in panels for at, kind in self.faces[f]}

    def patch_pattern(self, panels: Sequence[Panel], vertices: Sequence[Vertex]) -> Pattern:
        """Panels as a pattern, with the letters, families and welds of the cell.

        Creases between cells get the letter of their dihedral, "U" if flat.
        """
        own, cell = self.pattern, self.cell
        number = {vertex: k for k, vertex in enumerate(vertices)}
        places = own.vertices[cell.copies.first]
        points = np.empty((len(vertices), 3))
        steps = np.array([step for step, _ in vertices]).reshape(-1, cell.dimensions)
        kinds = np.array([kind for _, kind in vertices])
        for step in np.unique(steps, axis=0):
            rows = (steps == step).all(axis=1)
            points[rows] = cell.images(places[kinds[rows]], step)
        faces = [[number[plus(step, at), kind] for at, kind in self.faces[f]] for step, f in panels]
        welded = set(kinds_of(own.welds, self.vertices))
        letters = dict(zip(kinds_of(own.creases, self.vertices), own.assignments, strict=True))
        sides = [edge_of(a, b) for face in faces for a, b in around(face)]
        shared, times = np.unique(np.array(sides), axis=0, return_counts=True)
        shared = shared[times > 1]
        welds = [kind in welded for kind in kinds_of(shared, vertices)]
        with quietly():  # warnings came with the pattern of the cell
            bare = Pattern(points, faces, name=own.name, welds=shared[welds])
            if any(bare.flipped):
                raise InputError(
                    ": neighboring cells show opposite sides; take two of them as one cell", "case"
                )
            flat = np.abs(bare.dihedrals - np.pi) < FLAT
            of_crease = kinds_of(bare.creases, vertices)
            geometric = np.where(flat, "U", np.array(bare.assignments, np.str_))
            pairs = map(tuple, bare.creases.tolist())
            each = zip(pairs, of_crease, geometric.tolist(), strict=True)
            given = {pair: letters.get(kind, letter) for pair, kind, letter in each}
            families = {
                name: [tuple(bare.creases[k]) for k, kind in enumerate(of_crease) if kind in own_]
                for name, own_ in self.families().items()
            }
            kept = {name: pairs for name, pairs in families.items() if pairs}
            return bare.changed(assignments=given, families=kept)
