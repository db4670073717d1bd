"""Supports, masses, damping and actuated creases of a cell, repeated in all cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from foldyn.cases import Case
from foldyn.cases.damping import CreaseDamping
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.loads import Actuate
from foldyn.cases.selection import resolve_creases, resolve_nodes
from foldyn.cases.supports import BaseMotion, Fix, Impose, Link
from foldyn.errors import InputError
from foldyn.linear.lattice import Lattice, Site, Step, Vertex, kinds_of, minus, plus
from foldyn.linear.unit_cell import rotation
from foldyn.patterns.crease_data import ASSIGNED
from foldyn.structures.discretized import Discretized

SAME_AXES = 1e-9  # tolerance for axes that a screw preserves


def tied_vertices(case: Case, lattice: Lattice) -> set[Vertex]:
    """Vertices tied to vertices of cell 0 by links and connectors."""
    found: set[Vertex] = set()
    count = len(lattice.vertices)
    for i, part in enumerate(case.supports):
        if isinstance(part, Link):
            nodes = resolve_nodes(case.structure, part.nodes, f"supports[{i}].nodes").tolist()
            groups = [[*nodes, *(part.to or ())]]
        else:
            groups = np.reshape(getattr(part, "between", None) or (), (-1, 2)).tolist()
        for group in groups:
            own = [lattice.vertices[v] for v in group if v < count]
            found |= {(minus(step, at), kind) for at, _ in own for step, kind in own}
    return found


@dataclass(frozen=True, eq=False)
class Repeated:
    """The parts of a cell's case, applied to all copies of its nodes and creases in a patch.

    Attributes
    ----------
    case : Case
        Case of the cell.
    lattice : Lattice
    structure : Structure or Shell
        The patch.
    own : sequence of Site
        Sites of the nodes of the cell's own structure.
    sites : sequence of Site
        Sites of the nodes of the patch.
    """

    case: Case
    lattice: Lattice
    structure: Discretized
    own: Sequence[Site]
    sites: Sequence[Site]

    def patch_case(self) -> Case:
        """The case of the patch."""
        case = self.case
        supports = [
            copy
            for i, part in enumerate(case.supports)
            for copy in self._supports(part, f"supports[{i}]")
        ]
        masses = [
            replace(part, nodes=self._nodes(part.nodes, f"masses[{i}].nodes"))
            for i, part in enumerate(case.masses)
        ]
        loads = [
            self._on_creases(load, f"loads[{i}]")
            for i, load in enumerate(case.loads)
            if isinstance(load, Actuate)
        ]
        damping = [
            self._on_creases(part, "damping") if isinstance(part, CreaseDamping) else part
            for part in case.dampings
        ]
        return Case(self.structure, supports, loads, damping, masses)

    # ------------------------------------------------------------------ nodes
    @cached_property
    def _number(self) -> dict[Site, int]:
        return {site: node for node, site in enumerate(self.sites)}

    @cached_property
    def _copies(self) -> dict[Any, list[tuple[Step, int]]]:
        """Cell and node of all copies, by their representative."""
        found: dict[Any, list[tuple[Step, int]]] = {}
        for node, (step, part) in enumerate(self.sites):
            found.setdefault(part, []).append((step, node))
        return found

    def _resolved(self, nodes: Any, field: str) -> list[int]:
        return resolve_nodes(self.case.structure, nodes, field).tolist()

    def _nodes(self, nodes: Any, field: str) -> list[int]:
        """All copies of some nodes."""
        parts = {self.own[v][1] for v in self._resolved(nodes, field)}
        return sorted(node for part in parts for _, node in self._copies[part])

    def _groups(self, nodes: Sequence[int]) -> list[tuple[Step, list[int]]]:
        """Complete copies of a group of nodes in the patch, each with its offset."""
        sites = [self.own[v] for v in nodes]
        base = sites[0][0]
        found = []
        for step, _ in self._copies[sites[0][1]]:
            by = minus(step, base)
            moved = [(plus(at, by), part) for at, part in sites]
            if all(each in self._number for each in moved):
                found.append((by, [self._number[each] for each in moved]))
        return found

    # ------------------------------------------------------------------ supports
    @cached_property
    def _turns(self) -> bool:
        return any(motion.turns for motion in self.lattice.cell.motions)

    def _supports(self, part: Any, field: str) -> list[Any]:
        """Copies of a support for all cells of the patch."""
        if isinstance(part, BaseMotion):  # a base at rest
            return []
        if isinstance(part, Impose):  # holds its nodes where the state puts them
            part = Fix(part.nodes, part.axis, part.direction, part.along)
        if isinstance(part, Link):
            return self._links(part, field)
        if getattr(part, "between", None) is not None:
            return self._between(part)
        nodes = self._resolved(part.nodes, f"{field}.nodes")
        if not self._turns or (
            isinstance(part, Fix) and part.axes is not None and len(part.axes) == 3
        ):
            return [replace(part, nodes=self._nodes(nodes, field))]
        if getattr(part, "axes", None) is not None:
            part = [replace(part, axes=None, direction=axis) for axis in part.axes or ""]
        elif part.direction is None:  # same in all directions
            return [replace(part, nodes=self._nodes(nodes, field))]
        first: dict[Any, Step] = {}  # partners count once
        for node in nodes:
            first.setdefault(self.own[node][1], self.own[node][0])
        return [
            self._turned(one, minus(step, base), nodes=[node])
            for one in (part if isinstance(part, list) else [part])
            for kind, base in first.items()
            for step, node in self._copies[kind]
        ]

    def _turned(self, part: Any, step: Step, **changes: Any) -> Any:
        """A copy, its direction (if any) turned with the cell."""
        if part.direction is None or not self._turns:
            return replace(part, **changes)
        way = rotation(self.lattice.cell.motions, step) @ unit_vector(part.direction)
        return replace(part, direction=tuple(way.tolist()), **changes)

    def _links(self, part: Link, field: str) -> list[Any]:
        """Copies of a link for all cells of the patch."""
        nodes, corners = self._resolved(part.nodes, f"{field}.nodes"), list(part.to or ())
        if part.axes is not None:
            self._check_axes(part.axes, field)
        count = len(nodes)
        return [
            replace(part, nodes=copy[:count], to=copy[count:] if corners else None)
            for _, copy in self._groups([*nodes, *corners])
        ]

    def _check_axes(self, axes: str, field: str) -> None:
        """Refuse axes that a screw turns into others."""
        ways = np.eye(3)[[AXES.index(axis) for axis in axes]]
        for motion in self.lattice.cell.motions:
            both = np.concatenate([ways, ways @ motion.rotation().T])
            if np.linalg.matrix_rank(both, SAME_AXES) > len(ways):
                raise InputError(
                    f' = "{axes}": a screw turns these axes, so that copies of the link would '
                    "differ; link along all three, along the screw or across it",
                    f"{field}.axes",
                )

    def _between(self, part: Any) -> list[Any]:
        """Connectors between nodes; partners count once."""
        found, seen = [], set()
        for pair in np.reshape(part.between, (-1, 2)).tolist():
            (at, one), (there, two) = sorted((self.own[v] for v in pair), key=repr)
            kind = one, two, minus(there, at)
            if kind not in seen:
                seen.add(kind)
                found += [self._turned(part, by, between=[copy]) for by, copy in self._groups(pair)]
        return found

    # ------------------------------------------------------------------ creases
    def _on_creases(self, part: Any, field: str) -> Any:
        """The part with all copies of its creases, by name if the patch has this name."""
        creases, pattern = part.creases, self.structure.pattern
        if isinstance(creases, str) and (creases in ASSIGNED or creases in pattern.families):
            return part
        rows = resolve_creases(self.case.structure, creases, f"{field}.creases")
        lattice = self.lattice
        kinds = {lattice.edge(*lattice.pattern.creases[row].tolist()).kind for row in rows}
        vertices = [(step, part_[1]) for step, part_ in self.sites[: len(pattern.vertices)]]
        found = kinds_of(pattern.creases, vertices)
        return replace(part, creases=[k for k, kind in enumerate(found) if kind in kinds])
