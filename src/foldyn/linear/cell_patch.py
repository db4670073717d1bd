"""A cell among its neighbors: the patch of copies that yields the matrices of a cell.

Creases across the boundary of a cell are folds of the repeated sheet, between panels of two cells.
So the model is built on a patch of panels around one cell: all panels at the nodes of the cell; a
ring of panels across the edges of these, which completes the forces on the nodes; and a second
ring, so that the first ring is discretized as in the repeated sheet. The patch is discretized with
the options of the cell's own structure, and has copies of the cell's supports, masses, damping and
actuated creases.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Actuate, BaseMotion, Case, CreaseDamping, Fix, Impose, Latch, Link, Stop
from foldyn.cases.air import refuse_air
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.models import BARS_AND_HINGES, MODELS
from foldyn.cases.selection import resolve_creases, resolve_nodes
from foldyn.cases.springs import refuse_cables, refuse_varying
from foldyn.condensation import Superelements
from foldyn.condensation.panel import INNER
from foldyn.errors import InputError, quietly
from foldyn.linear.lattice import (
    Lattice,
    Panel,
    Site,
    Step,
    Vertex,
    edge_between,
    kinds_of,
    minus,
    plus,
)
from foldyn.linear.unit_cell import UnitCell, rotation
from foldyn.materials import HingeLaw
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import ASSIGNED
from foldyn.patterns.topology import around, edge_of
from foldyn.shells import Shell
from foldyn.structures import Sheet, Strip
from foldyn.structures.discretized import Discretized
from foldyn.structures.fold_law import OTHERS

SAME_AXES = 1e-9  # tolerance for axes that a screw preserves


@dataclass(frozen=True, eq=False)
class Patch:
    """A patch of a repeated sheet, with its nodes and hidden dofs as copies of cell 0.

    Attributes
    ----------
    case : Case
        Case of the patch, with copies of supports, masses, damping and actuated creases.
    unit, step : (n,), (n, d)
        For each node, the node of cell 0 of which it is a copy, and R.
    hidden_unit, hidden_step : (h,), (h, d)
        The same for the hidden dofs, all those that are not of nodes; -1 if the patch lacks the
        hidden dof of cell 0.
    own_unit, own_step : (k,), (k, d)
        The same for the nodes of the cell's own structure.
    first : (m,)
        Representative of each node of cell 0 in the cell's own structure.
    """

    case: Case
    unit: NDArray[np.int64]
    step: NDArray[np.int64]
    hidden_unit: NDArray[np.int64]
    hidden_step: NDArray[np.int64]
    own_unit: NDArray[np.int64]
    own_step: NDArray[np.int64]
    first: NDArray[np.int64]

    @property
    def hidden(self) -> int:
        """Number of hidden dofs of a cell."""
        return int(self.hidden_unit.max(initial=-1)) + 1

    @property
    def own_nodes(self) -> NDArray[np.int64]:
        """Nodes of cell 0 in the patch."""
        return np.flatnonzero((self.step == 0).all(axis=1))

    @property
    def determined(self) -> NDArray[np.bool_]:
        """Whether each node of cell 0 is held along each axis, or follows other nodes, (m, 3)."""
        return self.case.constraints.determined[self.own_nodes]

    def own_pairs(self, k: int) -> NDArray[np.int64]:
        """Pairs (m, 2) of nodes of the cell's own structure, one period k apart."""
        steps = map(tuple, self.own_step.tolist())
        at = {site: v for v, site in enumerate(zip(self.own_unit.tolist(), steps, strict=True))}
        pairs = []
        for (unit, step), node in at.items():
            after = unit, tuple(x + (j == k) for j, x in enumerate(step))
            if after in at:
                pairs.append((node, at[after]))
        return np.array(pairs, np.int64).reshape(-1, 2)


def cell_patch(cell: UnitCell) -> Patch:
    """Patch around a cell.

    Raises
    ------
    InputError
        The case has parts that do not repeat.
    """
    case, structure = cell.case, cell.case.structure
    _check(case)
    lattice = Lattice(cell)
    panels = lattice.around_cell()
    vertices = sorted(lattice.vertices_of(panels) | tied_vertices(case, lattice))
    with quietly():
        made = _structure(lattice, panels, lattice.patch_pattern(panels, vertices), vertices)
        sites = node_sites(made, vertices, panels)
        own_panels = list(zip(lattice.steps, range(len(lattice.faces)), strict=True))
        own = node_sites(structure, lattice.vertices, own_panels)
        repeated = Repeated(case, lattice, made, own, sites).patch_case()
    zero = lattice.zero
    unit_of = {part: k for k, part in enumerate(part for step, part in sites if step == zero)}
    unit, step = _numbered(sites, unit_of, cell.dimensions)
    hidden = hidden_sites(repeated, unit, step, panels)
    hidden_of = {part: k for k, part in enumerate(part for at, part in hidden if at == zero)}
    own_unit, own_step = _numbered(own, unit_of, cell.dimensions)
    first = np.full(len(unit_of), -1)
    first[own_unit[::-1]] = np.arange(len(own))[::-1]
    return Patch(
        repeated, unit, step, *_numbered(hidden, hidden_of, cell.dimensions), own_unit, own_step,
        first,
    )  # fmt: skip


def _numbered(
    sites: Sequence[Site], number: Mapping[tuple, int], dimensions: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number (n,) of the representative of each site, and R (n, d) of the site."""
    units = np.array([number.get(part, -1) for _, part in sites], np.int64)
    return units, np.array([step for step, _ in sites], np.int64).reshape(-1, dimensions)


def _check(case: Case) -> None:
    """Refuse a case that cannot be repeated from cell to cell."""
    structure = case.structure
    if not structure.as_made:
        raise InputError(
            ": its structure was changed after fd.discretize or fd.shell made it, and cannot be "
            "copied; give the changes to these functions",
            "case",
        )
    if structure.pattern.boards is not None:
        raise InputError(": its panels are thick; take the thin pattern", "case")
    if case.contact is not None:
        raise InputError(
            ": cells do not touch each other; leave contact out of the case of a cell", "contact"
        )
    refuse_air(case, "an infinite sheet of cells")
    refuse_cables(case)
    refuse_varying(case)
    if case.modal_damping is not None:
        raise InputError(
            ": modes of one cell differ from modes of the sheet; take Rayleigh, crease or "
            "strain damping",
            "damping",
        )
    for name in ("fold_law", "bend_law"):
        law = getattr(structure, name, None)
        if law is not None and law.elastic is not law:
            raise InputError(
                f' = "{law.name}": has memory, so that its stiffness depends on the '
                "frequency; take an elastic law",
                name,
            )


# ---------------------------------------------------------------------- the structure
def _structure(
    lattice: Lattice, panels: Sequence[Panel], pattern: Pattern, vertices: Sequence[Vertex]
) -> Any:
    """The patch, discretized like the cell."""
    own = lattice.cell.case.structure
    options = {item.name: getattr(own.options, item.name) for item in fields(own.options)}
    for name in ("crease_stiffness", "crease_rest", "fold_law"):
        options[name] = _per_crease(name, options[name], lattice, pattern, vertices)
    for name in ("clamped", "straight"):
        if options.get(name):
            options[name] = _edges(name, options[name], lattice, pattern, vertices)
    if options.get("guided"):
        by_axis: dict[Any, list[tuple[int, int]]] = {}
        for low, high, axis in options["guided"]:
            by_axis.setdefault(axis, []).append((low, high))
        options["guided"] = {
            axis: _edges("guided", edges, lattice, pattern, vertices)
            for axis, edges in sorted(by_axis.items())
        }
    if not isinstance(options["rigid"], str | None):
        options["rigid"] = _copied(options["rigid"], panels)
    options = {name: value for name, value in options.items() if value is not None}
    if own.kind == BARS_AND_HINGES:
        options["centers"] = {
            k: lattice.cell.images(own.nodes[own.centers[f]], minus(step, lattice.steps[f]))
            for k, (step, f) in enumerate(panels)
            if own.centers[f] >= 0
        }
    made = MODELS[own.kind].make(pattern, _sheet(own.sheet, panels), **options)
    finer = getattr(own, "finer", None)  # shapes of superelements
    return made if finer is None else replace(made, finer=finer).marked()


def _copied(chosen: Iterable[int], panels: Sequence[Panel]) -> list[int]:
    """Panels of the patch that are copies of chosen panels of the cell."""
    kinds = set(chosen)
    return [k for k, (_, f) in enumerate(panels) if f in kinds]


def _sheet(sheet: Sheet, panels: Sequence[Panel]) -> Sheet:
    """The sheet, with panels that differ from it repeated in all cells."""
    copied = [(part, _copied(np.ravel(part.panels).tolist(), panels)) for part in sheet.panels]
    return replace(sheet, panels=[replace(part, panels=rows) for part, rows in copied if rows])


def _per_crease(
    name: str, given: Any, lattice: Lattice, pattern: Pattern, vertices: Sequence[Vertex]
) -> Any:
    """Values for the creases of the patch, from the values for the cell."""
    if given is None or isinstance(given, float | Strip | str | HingeLaw):
        return given
    seams, families = lattice.seams(), lattice.families()
    if isinstance(given, Mapping):
        lattice.refuse_letters(given, name)
        every = {*ASSIGNED, OTHERS}
        words = [word for word in given if word not in every]
        named = set().union(*(families[word] for word in words))
        lost = [pair for pair in seams if lattice.edge(*pair).kind not in named]
        if words and lost and not every & {*given}:
            raise InputError(
                f": no name in it applies to the crease between cells at vertices {lost[0]}; "
                'give values by letter too, as {"mountain": ..., "valley": ...}, or one for all',
                name,
            )
        return {word: value for word, value in given.items()
                if word in every or word in pattern.families}  # fmt: skip
    if seams:
        raise InputError(
            f": has no value for the crease between cells at vertices {seams[0]}; give values by "
            "letter or family, or one for all",
            name,
        )
    values: dict[Any, Any] = {}
    for kind, value in zip(kinds_of(lattice.pattern.creases, lattice.vertices), given, strict=True):
        if values.setdefault(kind, value) != value:
            raise InputError(
                ": has different values for the creases of one junction; give one value there", name
            )
    return [values[kind] for kind in kinds_of(pattern.creases, vertices)]


def _edges(
    name: str, given: Sequence[tuple[int, int]], lattice: Lattice, pattern: Pattern,
    vertices: Sequence[Vertex],
) -> list[tuple[int, int]]:  # fmt: skip
    """Boundary edges of the patch that are copies of chosen edges of the cell."""
    kinds = {lattice.edge(a, b).kind: (a, b) for a, b in given}
    inside = [pair for kind, pair in kinds.items() if len(lattice.beside[kind]) > 1]
    if inside:
        raise InputError(f": edge {inside[0]} is a crease between cells; leave it out", name)
    rim = zip(pattern.boundary.tolist(), kinds_of(pattern.boundary, vertices), strict=True)
    return [(a, b) for (a, b), kind in rim if kind in kinds]


# ---------------------------------------------------------------------- nodes and hidden dofs
def node_sites(
    structure: Discretized, vertices: Sequence[Vertex], panels: Sequence[Panel]
) -> list[Site]:
    """Sites of the nodes of a structure: vertices, points of edges, and points inside panels."""
    sites: dict[int, Site] = {v: (at, ("vertex", kind)) for v, (at, kind) in enumerate(vertices)}
    for first, *inner, last in structure.edge_nodes.tolist() if len(structure.edge_nodes) else ():
        if inner:
            edge = edge_between(vertices[first], vertices[last])
            if vertices[first] > vertices[last]:
                inner.reverse()
            sites |= {node: (edge.step, ("edge", edge.kind, k)) for k, node in enumerate(inner)}
    inside: list[set[int]] = [set() for _ in panels]
    for nodes, panel in zip(structure.triangles, structure.triangle_panel, strict=True):
        inside[panel] |= set(nodes.tolist()) - sites.keys()
    for (step, f), nodes in zip(panels, inside, strict=True):
        sites |= {node: (step, ("panel", f, k)) for k, node in enumerate(sorted(nodes))}
    return [sites[node] for node in range(len(structure.nodes))]


def hidden_sites(case: Case, unit: NDArray, step: NDArray, panels: Sequence[Panel]) -> list[Site]:
    """Sites of the dofs of a patch that are not of nodes.

    They are rotations about sides, gives of edges, or of superelements those of edges and panels.

    unit, step : for each node, the node of cell 0 of which it is a copy (n,), and R (n, d).
    """
    structure: Any = case.structure
    place = list(zip(map(tuple, step.tolist()), unit.tolist(), strict=True))

    def site(ends: Iterable[int], what: tuple) -> Site:
        edge = edge_between(*(place[v] for v in ends))
        return edge.step, (edge.kind, *what)

    def turns(ends: Iterable[Iterable[int]]) -> list[Site]:
        """Rotations about sides, in order; a side may have several rotations."""
        times: dict[Any, int] = {}
        found = []
        for pair in map(tuple, ends):
            found.append(site(pair, ("turn", times.setdefault(pair, 0))))
            times[pair] += 1
        return found

    if isinstance(structure, Shell):
        sides = structure.sides
        ends = np.stack([structure.triangles, np.roll(structure.triangles, -1, axis=1)], axis=2)
        about = np.zeros((sides.rotations, 2), np.int64)
        about[sides.rotation[sides.rotation >= 0]] = np.sort(ends[sides.rotation >= 0], axis=1)
        return turns(about.tolist())
    if isinstance(structure, Superelements):
        lines = structure.pattern.lines.tolist()
        return [
            (panels[owner][0], ("panel", panels[owner][1], *what))
            if kind == INNER
            else site(lines[owner], (kind, *what))
            for kind, owner, *what in structure.owners(case.held_edges)
        ]
    found: list[Site] = []
    if structure.edge_plates is not None:
        axes = np.concatenate([structure.folds, structure.bends])[:, :2]
        found += turns(axes[structure.edge_plates.rotation_hinge].tolist())
    edges = {edge_of(a, b) for a, b in structure.edge_gives.tolist()}
    of_give: dict[int, Site] = {}
    for which, own in structure.membranes:
        for panel, numbers in zip(which.tolist(), own.gives.tolist(), strict=True):
            sides_ = [s for s in around(structure.pattern.faces[panel]) if edge_of(*s) in edges]
            ends_ = [(side, end) for side in sides_ for end in side]  # in the panel's order
            for number, (side, end) in zip(numbers, ends_, strict=False):
                of_give[number] = site(side, ("give", place[end] == min(place[v] for v in side)))
    found += [of_give[number] for number in range(len(structure.edge_gives))]
    return found


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
        supports = []
        for i, part in enumerate(case.supports):
            supports += self._supports(part, f"supports[{i}]")
        masses = [
            replace(part, nodes=self._nodes(part.nodes, f"masses[{i}].nodes"))
            for i, part in enumerate(case.masses)
        ]
        folding = [(i, load) for i, load in enumerate(case.loads) if isinstance(load, Actuate)]
        loads = [self._on_creases(load, f"loads[{i}]") for i, load in folding]
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
        """Complete copies of a group of nodes in the patch, each with its R."""
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
        if isinstance(part, Impose):  # its nodes are held at their places in the state
            part = Fix(part.nodes, part.axis, part.direction, part.along)
        if isinstance(part, Link):
            return self._links(part, field)
        if isinstance(part, Stop | Latch):
            return [self._on_creases(part, field)]
        if getattr(part, "between", None) is not None:
            return self._between(part)
        nodes = self._resolved(part.nodes, f"{field}.nodes")
        along_all = isinstance(part, Fix) and len(part.axes or "") == 3
        if along_all or not self._turns:
            return [replace(part, nodes=self._nodes(nodes, field))]
        if getattr(part, "axes", None) is not None:
            part = [replace(part, axes=None, direction=axis) for axis in part.axes or ""]
        elif part.direction is None:  # acts the same in all directions
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
        """A copy of a support, with its direction (if any) turned with the cell."""
        if getattr(part, "direction", None) is None or not self._turns:
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
        """The part for all copies of its creases; named as before if the patch has the name."""
        creases, pattern = part.creases, self.structure.pattern
        if isinstance(creases, str) and (creases in ASSIGNED or creases in pattern.families):
            self.lattice.refuse_letters([creases], f"{field}.creases")
            return part
        rows = resolve_creases(self.case.structure, creases, f"{field}.creases")
        lattice = self.lattice
        own = lattice.pattern.creases
        kinds = {lattice.edge(*own[row].tolist()).kind for row in rows}
        if sum(kind in kinds for kind in kinds_of(own, lattice.vertices)) != len(rows):
            raise InputError(": has some creases of a junction; take all", f"{field}.creases")
        vertices = [(step, part_[1]) for step, part_ in self.sites[: len(pattern.vertices)]]
        found = kinds_of(pattern.creases, vertices)
        return replace(part, creases=[k for k, kind in enumerate(found) if kind in kinds])
