"""Superelements of a whole pattern: their common unknowns, stiffness and mass.

The unknowns, from which each panel takes the amplitudes of its shapes, are

- displacements of the vertices (3 v + axis),
- a vector along x, y, z for each edge and each of its functions,
- turns of the sheet on all sides of each edge, see `EdgeSides`; positive where the sheet lifts
  toward the front of the panel,
- vibrations of each panel with its edges held.

Supports, clamps, welds and rigid panels leave some of these, or combinations of them, as dofs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy import sparse

from foldyn.condensation.edge_sides import EdgeSides, edge_sides
from foldyn.condensation.library import Group
from foldyn.condensation.panel import (
    BOW,
    INNER,
    TURN,
    VERTEX,
    CondensedPanel,
    block_diagonal,
    edge_frame,
)
from foldyn.condensation.shapes import ACROSS, ALONG, Level, bows, turns
from foldyn.condensation.term import Parts, matrix
from foldyn.mechanics.block_matrix import of_elements
from foldyn.mechanics.sheet_term import CreaseTurns
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Lines, edge_lookup
from foldyn.structures.discretized import Distributed
from foldyn.structures.graded import Grading

FUNCTION = np.array([ACROSS.index(shape) for shape in ALONG])
"""Index in `ACROSS` of each shape along an edge."""
PLACES = (0.25, 0.5, 0.75)  # of points on edges for pictures and comparisons
HELD = 1e-9  # part of a unit vector below which supports hold a direction
AT_ONCE = 64  # panels of which full matrices are made at once
NEGLIGIBLE = 1e-6  # part of a unit vector that gives no further direction
POINTS = 96  # of Gauss' rule for means along edges


class Unknowns(NamedTuple):
    """Indices of the unknowns of a pattern; each method takes numbers or arrays."""

    vertices: int
    edges: int
    panels: int
    sides: EdgeSides
    level: Level

    @property
    def functions(self) -> int:
        """Number of functions of each edge, in any direction."""
        return int(max(self.level.across, *(FUNCTION[: self.level.along] + 1)))

    @property
    def size(self) -> int:
        """Number of all unknowns."""
        return self.inner(self.panels, 0)

    def bow(self, edge: Any, function: Any) -> Any:
        """First of the three unknowns of a function of an edge."""
        return 3 * (self.vertices + edge * self.functions + function)

    def turn(self, side: Any, number: Any) -> Any:
        """A turn of a side."""
        return self.bow(self.edges, 0) + side * self.level.turns + number

    def inner(self, panel: Any, mode: Any) -> Any:
        """A vibration of a panel."""
        return self.turn(len(self.sides.edge), 0) + panel * self.level.inner + mode

    def places_in(self, other: Unknowns) -> NDArray[np.int64]:
        """Index (m,) of each unknown among those of a level that contains this one."""
        edge, panel = np.arange(self.edges), np.arange(self.panels)
        vertices = np.arange(3 * self.vertices)
        bows = other.bow(edge[:, None, None], np.arange(self.functions)[:, None]) + np.arange(3)
        turned = other.turn(np.arange(len(self.sides.edge))[:, None], np.arange(self.level.turns))
        inner = other.inner(panel[:, None], np.arange(self.level.inner))
        return np.concatenate([vertices, bows.ravel(), turned.ravel(), inner.ravel()])

    def owners(self, unknown: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Kinds (k,) of unknowns, `BOW`, `TURN` or `INNER`; their edges or panels; their numbers.

        The numbers begin with 0 at each edge and panel.
        """
        begin = np.array([self.bow(0, 0), self.turn(0, 0), self.inner(0, 0)])
        each = np.array([3 * self.functions, self.level.turns, self.level.inner])
        kind = np.searchsorted(begin, unknown, side="right") - 1
        owner, number = np.divmod(unknown - begin[kind], each[kind])
        turned = kind == 1
        number[turned] += self.level.turns * self.sides.rank[owner[turned]]
        owner[turned] = self.sides.edge[owner[turned]]
        return kind + BOW, owner, number


class Whole:
    """Superelements of a pattern on all of their unknowns, m of them.

    Parameters
    ----------
    pattern : Pattern
    groups : sequence of Group
    level : Level
    graded : Grading
        The finest mesh of the panels.
    """

    def __init__(
        self, pattern: Pattern, groups: list[Group], level: Level, graded: Grading
    ) -> None:
        self.pattern, self.groups, self.level, self._graded = pattern, groups, level, graded
        self.edges = pattern.lines
        x, faces = pattern.vertices, pattern.faces
        self.sides = edge_sides(pattern)
        self.unknowns = Unknowns(len(x), len(self.edges), len(faces), self.sides, level)
        self._along = x[self.edges[:, 1]] - x[self.edges[:, 0]]

    @cached_property
    def amplitudes(self) -> list[tuple[NDArray, sparse.csr_array]]:
        """Shapes (c,) of each group that the level has, and their amplitudes as unknowns.

        The rows of the matrix (p c, m) are amplitudes of panel after panel.
        """
        return [self._placed(group) for group in self.groups]

    def _placed(self, group: Group) -> tuple[NDArray, sparse.csr_array]:
        """See `amplitudes`."""
        kind, level, own = group.panel.kind, self.level, self.unknowns
        most = {VERTEX: 3, TURN: level.turns, INNER: level.inner}
        counts = np.array(
            [level.on_edge[at % 3] if what == BOW else most[what] for what, at, _ in kind.tolist()]
        )
        kept = np.flatnonzero(kind[:, 2] < counts)
        p = len(group.faces)
        edge, backwards = self._edges_of(group.faces)
        frames, sides = self._edge_frames(group, edge, backwards), self.sides_of(group)
        row = len(kept) * np.arange(p)
        rows, columns, values = [], [], []
        for i, (what, where, shape) in enumerate(kind[kept].tolist()):
            if what == VERTEX:
                first, vector = 3 * group.faces[:, where], group.frames[:, shape]
            elif what == BOW:
                e, axis = divmod(where, 3)
                degree = (ALONG if axis == 0 else ACROSS)[shape][1]
                first = own.bow(edge[:, e], FUNCTION[shape] if axis == 0 else shape)
                sign = np.where(backwards[:, e], (-1.0) ** degree, 1.0)
                vector = sign[:, None] * frames[:, e, axis]
            elif what == TURN:
                first = own.turn(sides[:, where], shape)
                vector = np.where(backwards[:, where], (-1.0) ** shape, 1.0)[:, None]
            else:
                first, vector = own.inner(group.number, shape), np.ones((p, 1))
            for d in range(vector.shape[1]):
                rows.append(row + i)
                columns.append(first + d)
                values.append(vector[:, d])
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        shape = (p * len(kept), own.size)
        return kept, sparse.csr_array(sparse.coo_array(entries, shape=shape))

    def _edges_of(self, faces: NDArray) -> tuple[NDArray, NDArray]:
        """Edges (p, k) of panels (p, k), and whether they run from higher to lower vertices."""
        number = edge_lookup(self.edges)
        ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
        low_high = np.sort(ends, axis=2).reshape(-1, 2).tolist()
        found = np.array([number[low, high] for low, high in low_high]).reshape(faces.shape)
        return found, ends[:, :, 0] > ends[:, :, 1]

    def sides_of(self, group: Group) -> NDArray[np.int64]:
        """Sides (p, k) of a group's panels, edge by edge; see `EdgeSides`."""
        edge, _ = self._edges_of(group.faces)
        panels = np.repeat(group.number, edge.shape[1]).tolist()
        found = [self.sides.of[pair] for pair in zip(panels, edge.ravel().tolist(), strict=True)]
        return np.reshape(found, edge.shape)

    def _edge_frames(self, group: Group, edge: NDArray, backwards: NDArray) -> NDArray:
        """Directions (p, k, 3, 3) along edges, across them in the plane, and normal to both."""
        x = self.pattern.vertices[group.faces]
        area = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
        along = np.where(backwards[:, :, None], -1.0, 1.0) * self._along[edge]
        return edge_frame(along, area[:, None])

    def matrices(
        self, dofs: sparse.csr_array, changes: bool = False
    ) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Stiffness and mass (d, d) of all panels for dofs, of which unknowns (m, d) are made.

        changes : whether to give their changes, see `CondensedPanel`.
        """
        size = dofs.shape[1]
        total = [sparse.csr_array((size, size)) for _ in range(2)]
        for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
            own = group.panel
            parts = own.changes if changes else (own.stiffness, own.mass)
            amplitudes, count = sparse.csr_array(placed @ dofs), len(kept)
            for first in range(0, amplitudes.shape[0], AT_ONCE * count):
                columns, motion = _by_panel(amplitudes[first : first + AT_ONCE * count], count)
                for k, part in enumerate(parts):
                    blocks = motion.swapaxes(1, 2) @ (part[np.ix_(kept, kept)] @ motion)
                    total[k] = sparse.csr_array(total[k] + of_elements(columns, blocks, size))
        return total[0], total[1]

    def along_axes(self, chosen: NDArray) -> Iterator[tuple[sparse.csr_array, list[Any]]]:
        """Amplitudes (a, m) of shapes of chosen panels, and their masses along x, y, z (a, a)."""
        for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
            there = np.isin(group.number, chosen)
            frames, own = group.frames[there], group.panel.products[:, :, kept[:, None], kept]
            masses = np.einsum("pad,pbd,abij->dpij", frames, frames, own, optimize=True)
            yield placed[np.repeat(there, len(kept))], [block_diagonal(each) for each in masses]

    def lifts(self, points: NDArray, panel: NDArray) -> sparse.csr_array:
        """Displacements (k, m) normal to panels (k,) at points (k, 3) in them."""
        total = sparse.csr_array((len(points), self.unknowns.size))
        for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
            own = np.stack([np.flatnonzero(panel == number) for number in group.number])
            away = points[own] - self.pattern.vertices[group.faces[:, :1]]
            local = np.einsum("pei,pdi->ped", away, group.frames[:, :2])
            shapes = group.panel.lift(local)[:, :, kept]
            put = sparse.eye_array(len(points), format="csr")[:, own.ravel()]
            total = total + put @ (block_diagonal(shapes).tocsr() @ placed)
        return sparse.csr_array(total)

    def between(self) -> tuple[NDArray, sparse.csr_array]:
        """Points (q, 3) on edges and at the means of panels' corners; their motions (3 q, m)."""
        own, x, axis = self.unknowns, self.pattern.vertices, np.arange(3)
        ends = x[self.edges]
        points = [(1.0 - place) * ends[:, 0] + place * ends[:, 1] for place in PLACES]
        on_edges = [self.on_edges(np.full((own.edges, 1), place)) for place in PLACES]
        centers = sparse.csr_array((3 * own.panels, own.size))
        for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
            local = np.einsum("pad,ac->pdc", group.frames, group.panel.center[:, kept])
            rows = (3 * group.number[:, None] + axis).ravel()
            put = sparse.eye_array(3 * own.panels, format="csr")[:, rows]
            centers = centers + put @ (block_diagonal(local).tocsr() @ placed)
        points.append(np.array([x[list(face)].mean(axis=0) for face in self.pattern.faces]))
        return np.concatenate(points), sparse.csr_array(sparse.vstack([*on_edges, centers]))

    def on_edges(self, places: NDArray) -> sparse.csr_array:
        """Displacements (3 e p, m) of points at places (e, p), from 0 to 1, of all edges."""
        own, (edges, count) = self.unknowns, places.shape
        cut_off = np.repeat(self._graded.radius / np.linalg.norm(self._along, axis=1), count)
        share = bows(places.ravel(), cut_off, 1)[:, : own.functions]
        weight = np.column_stack([1.0 - places.ravel(), places.ravel(), share])
        bow = own.bow(np.arange(edges)[:, None], np.arange(own.functions)) // 3
        column = np.repeat(np.hstack([self.edges, bow]), count, axis=0)
        begin = weight.shape[1] * np.arange(len(weight) + 1)
        shape = (len(weight), own.turn(0, 0) // 3)
        out = sparse.kron(
            sparse.csr_array((weight.ravel(), column.ravel(), begin), shape=shape),
            sparse.eye_array(3), format="csr",
        )  # fmt: skip
        out.resize((out.shape[0], own.size))
        return sparse.csr_array(out)

    def turns_on_edges(self, places: NDArray) -> sparse.csr_array:
        """Turns (2 e p, m) of the sheet on both sides of points at places (e, p) of all edges.

        Junctions have further sides, which are left out.
        """
        own, (edges, count) = self.unknowns, places.shape
        value = np.repeat(turns(places.ravel(), self.level.turns), 2, axis=0)
        side = 2 * np.repeat(np.arange(edges), 2 * count) + np.tile([0, 1], edges * count)
        column = own.turn(side[:, None], np.arange(self.level.turns))
        begin = self.level.turns * np.arange(len(value) + 1)
        shape = (len(value), own.size)
        return sparse.csr_array((value.ravel(), column.ravel(), begin), shape=shape)

    def spread(self, load: Distributed) -> NDArray[np.float64]:
        """Forces (m,), N, on the unknowns due to a distributed load."""
        own, out = self.unknowns, np.zeros(self.unknowns.size)
        if load.creases is not None:
            out -= self.crease_turns.mean.T @ load.creases
        if load.edges is not None:
            force = np.linalg.norm(self._along, axis=1)[:, None] * load.edges
            np.add.at(out[: 3 * own.vertices].reshape(-1, 3), self.edges.T, 0.5 * force)
            z, share = leggauss(POINTS)
            places = 0.5 * (1.0 + z)
            for edge in np.flatnonzero(force.any(axis=1)).tolist():
                cut_off = self._graded.radius / float(np.linalg.norm(self._along[edge]))
                mean = 0.5 * share @ bows(places, cut_off, 1)[:, : own.functions]
                first = own.bow(edge, 0)
                out[first : first + 3 * own.functions] += np.outer(mean, force[edge]).ravel()
        if load.strain is not None and load.curvature is not None:
            for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
                forces = group.swollen(load.strain, load.curvature) @ group.panel.thermal[kept].T
                out += placed.T @ forces.ravel()
        return out if load.panels is None else out + self._on_panels(load.panels)

    def _on_panels(self, density: NDArray) -> NDArray[np.float64]:
        """Forces (m,), N, on the unknowns due to forces on panels (np, 3), N/m2."""
        out = np.zeros(self.unknowns.size)
        for group, (kept, placed) in zip(self.groups, self.amplitudes, strict=True):
            own = np.einsum("pad,pd->pa", group.frames, density[group.number])
            out += placed.T @ (own @ self.per_area(group, kept).T).ravel()
        return out

    def per_area(self, group: Group, kept: NDArray) -> NDArray[np.float64]:
        """Forces (c, 3) on a panel's shapes due to unit forces per area along its axes.

        They follow from the inertia forces of a translation, which are evenly spread, too.
        """
        what, _, axis = group.panel.kind[kept].T
        moved = (what == VERTEX)[:, None] & (axis[:, None] == np.arange(3))
        inertia = group.panel.mass[np.ix_(kept, kept)] @ moved
        return inertia * self.pattern.face_areas[group.number[0]] / (moved[:, 0] @ inertia[:, 0])

    def held(self, strain: NDArray, curvature: NDArray) -> NDArray[np.float64]:
        """Free strains and curvatures of panels with held edges, and their forces (2, np, 4)."""
        out = np.zeros((2, self.unknowns.panels, 4))
        for group in self.groups:
            free = group.swollen(strain, curvature)
            out[:, group.number] = free, free @ group.panel.held_energy
        return out

    @property
    def rotated(self) -> NDArray[np.float64]:
        """Unknowns (m, 3) other than displacements, in rotations by 1 rad about x, y, z."""
        along = self._along / np.linalg.norm(self._along, axis=1)[:, None]
        out, sides = np.zeros((self.unknowns.size, 3)), self.sides
        turned = self.unknowns.turn(np.arange(len(sides.edge)), 0)
        out[turned] = sides.way[:, None] * along[sides.edge]
        return out

    @property
    def _turns(self) -> sparse.csr_array:
        """Turns (nf * turns, m) of both sides of the creases relative to each other."""
        own, number = self.unknowns, np.arange(self.level.turns)
        column = own.turn(self.sides.creases.T[:, :, None], number).reshape(2, -1)
        row = np.tile(np.arange(column.shape[1]), 2)
        ways = np.repeat(self.pattern.crease_ways.T.astype(float), len(number), axis=1)
        return sparse.csr_array((ways.ravel(), (row, column.ravel())), (column.shape[1], own.size))

    @cached_property
    def _roots(self) -> NDArray[np.float64]:
        """Roots (nf, turns, turns) of the mean squares of the turns of each crease.

        Creases turn by what they do at the middles of the pieces of a mesh, as panels do.
        """
        count, creases = self.level.turns, len(self.pattern.creases)
        roots = np.zeros((creases, count, count))
        for crease, along in enumerate(self._along[self.sides.crease_edge]):
            places = np.append(0.0, self._graded.places(float(np.linalg.norm(along))))
            share = np.diff(places, append=1.0)
            shapes = turns(places + 0.5 * share, count)
            roots[crease] = np.linalg.cholesky(shapes.T @ (share[:, None] * shapes)).T
        return roots

    @cached_property
    def crease_turns(self) -> CreaseTurns:
        """Turns of both sides of the creases relative to each other."""
        rows, count = self._turns, self.level.turns
        if rows.shape[0]:
            rows = sparse.csr_array(block_diagonal(self._roots).tocsr() @ rows)
        return CreaseTurns(rows, np.repeat(np.arange(rows.shape[0] // count), count))

    def parts(self, dofs: sparse.csr_array, slope: NDArray) -> Parts:
        """Parts of the sheet for dofs (m, d), with creases of stiffness `slope` (nf,), N m/rad."""
        rows, number, size, stiffness, mass = [], [], [], [], []
        for k, (group, (kept, placed)) in enumerate(zip(self.groups, self.amplitudes, strict=True)):
            smooth = _smooth(group.panel, kept)
            back = sparse.kron(sparse.eye_array(len(group.number)), smooth.T, format="csr")
            rows.append(back @ placed)
            number += [k] * len(group.number)
            size += [len(kept)] * len(group.number)
            for out, each in (stiffness, group.panel.stiffness), (mass, group.panel.mass):
                out.append((smooth.T @ each[np.ix_(kept, kept)] @ smooth).ravel())
        squares = slope[:, None, None] * (self._roots.swapaxes(1, 2) @ self._roots)
        number += [len(stiffness) + k for k in range(len(slope))]
        size += [self.level.turns] * len(slope)
        stiffness += [square.ravel() for square in squares]
        place = np.cumsum([0, *map(len, stiffness)])
        every = sparse.csr_array(sparse.vstack([*rows, self._turns]) @ dofs)
        return Parts(
            matrix(every), np.cumsum([0, *size]), place[number], np.concatenate(stiffness),
            np.concatenate(mass), self.unknowns.panels, np.zeros((2, max(size))),
        )  # fmt: skip

    # ------------------------------------------------------------------ supports
    @cached_property
    def _across(self) -> NDArray:
        """Directions (e, 3, 3) along each edge, and two across it, which turn with its panels."""
        up = np.zeros((self.unknowns.edges, 2, 3))
        for group in self.groups:
            edge, backwards = self._edges_of(group.faces)
            up[edge, backwards.astype(int)] = group.frames[:, None, 2]
        one, other = up.swapaxes(0, 1)
        return edge_frame(self._along, np.where(one.any(axis=1, keepdims=True), one, other))

    def dofs(
        self, held: Mapping[int, NDArray], clamped: NDArray, rigid: Collection[int]
    ) -> sparse.csr_array:
        """Unknowns (m, d) as combinations of dofs; the first dofs are those of the vertices.

        Parameters
        ----------
        held : mapping of edge to (h, 3)
            Directions in which supports hold an edge along its whole length.
        clamped : (k,)
            Edges whose tangent is held.
        rigid : collection of int
            Rigid panels.
        """
        own, level, columns = self.unknowns, self.level, _Columns()
        columns.add(np.arange(3 * own.vertices)[:, None])
        bends, turned = self._panels(rigid)
        straight = {int(self.sides.edge[side]): np.eye(3) for side in np.flatnonzero(turned >= 0)}
        self._add_bows(columns, {**held, **straight})
        welds = own.edges - len(Lines.of(self.pattern.welds).first)  # the first of them
        number, edge = np.arange(level.turns), self.sides.edge
        loose = np.flatnonzero(bends & ~np.isin(edge, clamped) & (edge < welds))
        columns.add(own.turn(loose[:, None], number).reshape(-1, 1))
        for sides in self.sides.along[welds:]:
            columns.add(own.turn(sides, number[:, None]), self.sides.way[sides].astype(float))
        panels = np.setdiff1d(np.arange(own.panels), list(rigid))
        columns.add(own.inner(panels[:, None], np.arange(level.inner)).reshape(-1, 1))
        for side in np.flatnonzero(turned >= 0).tolist():
            dofs, factors = self._facet_turn(int(turned[side]), side)
            columns.put(np.full(len(dofs), own.turn(side, 0)), dofs, factors)
        return columns.matrix(own.size)

    def _panels(self, rigid: Collection[int]) -> tuple[NDArray, NDArray]:
        """Whether each side (s,) has a panel that bends, and its rigid panel or -1."""
        bends = np.zeros(len(self.sides.edge), bool)
        turned = np.full(len(bends), -1)
        for (panel, _), side in self.sides.of.items():
            bends[side] = panel not in rigid
            turned[side] = panel if panel in rigid else -1
        return bends, turned

    def _facet_turn(self, panel: int, side: int) -> tuple[NDArray, NDArray]:
        """Dofs (9,) of vertices and factors (9,), 1/m, of the turn of a panel about a side."""
        x, face = self.pattern.vertices, np.array(self.pattern.faces[panel])
        a, b = self.edges[self.sides.edge[side]][:: self.sides.way[side]]
        along = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
        away = x[face] - x[a]
        height = np.linalg.norm(away - np.outer(away @ along, along), axis=1)
        c = face[height.argmax()]
        foot = float((x[c] - x[a]) @ along / np.linalg.norm(x[b] - x[a]))
        up = self.pattern.face_normals[panel] / height.max()
        dofs = 3 * np.array([c, a, b])[:, None] + np.arange(3)
        return dofs.ravel(), np.outer(np.array([1.0, foot - 1.0, -foot]), up).ravel()

    def _add_bows(self, columns: _Columns, held: Mapping[int, NDArray]) -> None:
        """Add the displacements of edges that no support holds."""
        own, along = self.unknowns, np.zeros(self.unknowns.functions, bool)
        along[FUNCTION[: self.level.along]] = True
        across = np.arange(own.functions) < self.level.across
        taken = np.stack([along, across, across], axis=1)  # directions of each function
        loose = np.setdiff1d(np.arange(own.edges), list(held))
        function, direction = np.nonzero(taken)
        row = own.bow(loose[:, None, None], function[:, None]) + np.arange(3)
        columns.add(row.reshape(-1, 3), self._across[loose][:, direction].reshape(-1, 3))
        for edge, directions in held.items():
            for function, own_directions in enumerate(taken):
                free = _left(self._across[edge][own_directions], directions)
                columns.add(np.tile(own.bow(edge, function) + np.arange(3), (len(free), 1)), free)


def _by_panel(amplitudes: sparse.csr_array, count: int) -> tuple[NDArray, NDArray]:
    """Dofs (p, u) that p panels depend on, and their amplitudes (p, count, u) for these.

    Panels with fewer than u dofs repeat their first one, with amplitudes of 0.

    amplitudes : (p count, d) of panel after panel for all dofs.
    """
    entries, size = sparse.coo_array(amplitudes), amplitudes.shape[1]
    panel, row = np.divmod(entries.row, count)
    used, place = np.unique(panel.astype(np.int64) * size + entries.col, return_inverse=True)
    begin = np.searchsorted(used, size * np.arange(amplitudes.shape[0] // count + 1))
    number = np.arange(np.diff(begin).max(initial=0))
    there = number < np.diff(begin)[:, None]
    columns = used[np.where(there, begin[:-1, None] + number, begin[:-1, None])] % size
    motion = np.zeros((len(columns), count, len(number)))
    motion[panel, row, place - begin[panel]] = entries.data
    return columns, motion


def _smooth(panel: CondensedPanel, kept: NDArray) -> NDArray[np.float64]:
    """Shapes (c, c) of a panel by its own that change smoothly with its sheet.

    Vibrations have no sign, and those of one frequency are any combination of them: here they are
    combined so that their mass with some motions of the edges is symmetric and positive.
    """
    out, inner = np.eye(len(kept)), panel.kind[kept, 0] == INNER
    mass = panel.mass[np.ix_(kept[inner], kept[~inner])]
    left, _, right = np.linalg.svd(mass @ np.random.default_rng(0).standard_normal(mass.shape).T)
    out[np.ix_(inner, inner)] = left @ right
    return out


class _Columns:
    """Columns of a matrix."""

    def __init__(self) -> None:
        self.count = 0
        self._parts: list[tuple[NDArray, NDArray, NDArray]] = []

    def add(self, rows: NDArray, values: NDArray | float = 1.0) -> None:
        """Add a column for each row of `rows` (c, r), with `values` in these rows."""
        number = np.repeat(self.count + np.arange(len(rows)), rows.shape[1])
        self.put(rows.ravel(), number, np.broadcast_to(values, rows.shape).ravel())
        self.count += len(rows)

    def put(self, rows: NDArray, columns: NDArray, values: NDArray) -> None:
        """Put entries (k,) into columns."""
        self._parts.append((rows, columns, values))

    def matrix(self, rows: int) -> sparse.csr_array:
        """The matrix (rows, count), without zeros."""
        row, column, value = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        there = value != 0.0
        entries = (value[there], (row[there], column[there]))
        return sparse.csr_array(sparse.coo_array(entries, shape=(rows, self.count)))


def _left(vectors: NDArray, held: NDArray) -> NDArray:
    """Orthonormal vectors (k, 3) in the span of `vectors` (n, 3), normal to directions (h, 3)."""
    _, size, basis = np.linalg.svd(held @ vectors.T, full_matrices=False)
    taken = basis[size > HELD]
    left, found = np.eye(len(vectors)) - taken.T @ taken, np.zeros((0, len(vectors)))
    for part in left:  # in order, so that bases turn with the vectors
        part = part - found.T @ (found @ part)
        if np.linalg.norm(part) > NEGLIGIBLE:
            found = np.vstack([found, part / np.linalg.norm(part)])
    return found @ vectors
