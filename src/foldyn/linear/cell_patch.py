"""A cell among its neighbors: the patch of copies from which the matrices of a cell are taken.

Creases across the boundary of a cell are folds of the repeated sheet, between panels of two cells.
So the model is built of a patch of panels about one cell: all panels at its nodes, the panels
across their creases, with which forces on these nodes are complete, and the panels across those,
with which each of them is discretized as in the repeated sheet. The patch is discretized by the
recipe of the cell's own structure.

Vertices of the patch are numbered by cell first, in the order of R, then by kind, and so are panels.
Two vertices so stand in the same order in all cells, and with them whatever a discretization
decides by the order of numbers: directions of hinges, signs of rotations, ties.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.damping import CreaseDamping, ModalDamping
from foldyn.cases.loads import Actuate
from foldyn.cases.models import MODELS
from foldyn.cases.selection import resolve_creases, resolve_nodes
from foldyn.cases.supports import BaseMotion, Fix, Impose, Link
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.unit_cell import UnitCell, rotation
from foldyn.materials.inelastic_law import memory_of
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import ASSIGNED
from foldyn.patterns.topology import around, edge_of
from foldyn.structures.sheet import Sheet

RINGS = 2  # of panels about those at the nodes of the cell

Step = tuple[int, ...]  # R
Vertex = tuple[Step, int]  # cell and kind; in the order of the patch's numbers
Part = tuple[Any, ...]  # what stands for all copies of a node or a hidden dof


def _plus(one: Step, two: Step) -> Step:
    return tuple(a + b for a, b in zip(one, two, strict=True))


def _minus(one: Step, two: Step) -> Step:
    return tuple(a - b for a, b in zip(one, two, strict=True))


class Edge(NamedTuple):
    """An edge by its kind, the same in all cells, and the cell of its first vertex."""

    kind: tuple[int, int, Step]
    step: Step


def edge_between(one: Vertex, two: Vertex) -> Edge:
    """The edge of two vertices."""
    low, high = sorted((one, two))
    return Edge((low[1], high[1], _minus(high[0], low[0])), low[0])


class Lattice:
    """Panels and edges of a cell as those of all cells.

    Attributes
    ----------
    vertices : list of Vertex
        The cell's vertices.
    faces : list of list of Vertex
        Each of its panels, moved to where its first vertex is in cell 0.
    steps : list of Step
        The cell in which the panel of the pattern itself so is.
    """

    def __init__(self, cell: UnitCell) -> None:
        pattern: Pattern = cell.case.structure.pattern
        self.cell, self.pattern = cell, pattern
        offsets = [tuple(row) for row in cell.copies.offset.tolist()]
        self.vertices: list[Vertex] = list(zip(offsets, cell.copies.kind.tolist(), strict=True))
        self.faces: list[list[Vertex]] = []
        self.steps: list[Step] = []
        same: dict[tuple, int] = {}
        for f, face in enumerate(pattern.faces):
            corners = [self.vertices[v] for v in face]
            base = min(corners)[0]
            moved = [(_minus(step, base), kind) for step, kind in corners]
            twin = same.setdefault(tuple(sorted(moved)), f)
            if twin != f:
                raise InputError(
                    f": panels {twin} and {f} are copies of each other under these motions; the "
                    "pattern has more than one cell: give longer motions, or a smaller pattern",
                    "case",
                )
            self.faces.append(moved)
            self.steps.append(base)
        self.beside: dict[tuple, list[tuple[int, Step]]] = {}
        for f, face in enumerate(self.faces):
            for one, two in around(face):  # type: ignore[arg-type]
                edge = edge_between(one, two)  # type: ignore[arg-type]
                self.beside.setdefault(edge.kind, []).append((f, edge.step))
        crowded = next((kind for kind, both in self.beside.items() if len(both) > 2), None)
        if crowded is not None:
            a, b = (int(cell.copies.first[kind]) for kind in crowded[:2])
            raise InputError(
                f": {len(self.beside[crowded])} panels would meet at the edge of vertices {a} and "
                f"{b} and their copies; at most two may",
                "case",
            )

    def around_cell(self) -> list[tuple[Step, int]]:
        """Panels (R, f) of the patch, in order."""
        zero = (0,) * self.cell.dimensions
        found = {(_minus(zero, step), f) for f, face in enumerate(self.faces) for step, _ in face}
        for _ in range(RINGS):
            found |= {other for panel in found for other in self.across(*panel)}
        return sorted(found)

    def across(self, step: Step, f: int) -> Iterable[tuple[Step, int]]:
        """Panels on the other sides of the edges of one."""
        for one, two in around(self.faces[f]):  # type: ignore[arg-type]
            edge = edge_between(one, two)  # type: ignore[arg-type]
            for g, own in self.beside[edge.kind]:
                yield _minus(_plus(step, edge.step), own), g

    def edge(self, a: int, b: int) -> Edge:
        """The edge of two vertices of the pattern."""
        return edge_between(self.vertices[a], self.vertices[b])

    def new_creases(self) -> list[tuple[int, int]]:
        """Boundary edges of the pattern that are creases between cells, one of each kind."""
        kinds: dict[tuple, tuple[int, int]] = {}
        for a, b in self.pattern.boundary.tolist():
            kind = self.edge(a, b).kind
            if len(self.beside[kind]) == 2:
                kinds.setdefault(kind, (a, b))
        return list(kinds.values())


@dataclass(frozen=True, eq=False)
class Patch:
    """A patch of a repeated sheet, and its nodes and hidden dofs as copies of those of cell 0.

    Attributes
    ----------
    case : Case
        With copies of the supports, masses, damping and actuated creases.
    unit, step : (n,), (n, d)
        Number of the node of cell 0 that stands for each node, and R.
    hidden_unit, hidden_step : (h,), (h, d)
        The same of the hidden dofs.
    own_unit, own_step : (k,), (k, d)
        The same of the nodes of the cell's own structure.
    first : (m,)
        Node of the cell's own structure that stands for each node of cell 0.
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
        """Hidden dofs of a cell."""
        return int(self.hidden_unit.max(initial=-1)) + 1


def cell_patch(cell: UnitCell) -> Patch:
    """Patch about a cell.

    Raises
    ------
    InputError
        The case has what does not repeat.
    """
    case, structure = cell.case, cell.case.structure
    _check(case)
    lattice = Lattice(cell)
    panels = lattice.around_cell()
    groups = _Groups(lattice, case)
    vertices = {(_plus(step, own), kind) for step, f in panels for own, kind in lattice.faces[f]}
    vertices = sorted(vertices | groups.wanted)
    number = {vertex: k for k, vertex in enumerate(vertices)}
    pattern = _pattern(lattice, panels, vertices, number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        made = _structure(lattice, panels, pattern, number)
        labels = _node_labels(made, vertices, panels)
        own_vertices = [(step, kind) for step, kind in lattice.vertices]
        own_panels = list(zip(lattice.steps, range(len(lattice.faces)), strict=True))
        own = _node_labels(structure, own_vertices, own_panels)
        zero = (0,) * cell.dimensions
        units = {label: k for k, label in enumerate(_ordered(labels, zero))}
        place = {label: k for k, label in enumerate(labels)}
        unit = np.array([units.get(label, -1) for _, label in labels])
        step = np.array([at for at, _ in labels]).reshape(-1, cell.dimensions)
        repeated = groups.case(made, own, place, lattice)
    hidden = _hidden_labels(made, unit, step)
    of_hidden: dict[Part, int] = {}
    for at, label in hidden:
        if at == zero:
            of_hidden.setdefault(label, len(of_hidden))
    own_unit = np.array([units[label] for _, label in own])
    own_step = np.array([at for at, _ in own]).reshape(-1, cell.dimensions)
    first = np.full(len(units), -1)
    first[own_unit[::-1]] = np.arange(len(own))[::-1]
    return Patch(
        case=repeated,
        unit=unit,
        step=step,
        hidden_unit=np.array([of_hidden.get(label, -1) for _, label in hidden], np.int64),
        hidden_step=np.array([at for at, _ in hidden], np.int64).reshape(-1, cell.dimensions),
        own_unit=own_unit,
        own_step=own_step,
        first=first,
    )


def _check(case: Case) -> None:
    structure = case.structure
    if not structure.as_made:
        raise InputError(
            ": its structure is not as fd.discretize or fd.shell makes it, and copies cannot be "
            "made like it; give what differs to them",
            "case",
        )
    if structure.pattern.boards is not None:
        raise InputError(": its panels are thick; take the thin pattern", "case")
    if case.contact is not None:
        raise InputError(
            ": waves are about a smooth state, and cells do not touch each other; leave contact "
            "out of the case of a cell",
            "contact",
        )
    if case.modal_damping is not None:
        raise InputError(
            ": modes of one cell are not those of the repeated sheet; take Rayleigh, crease or "
            "strain damping",
            "damping",
        )
    for name in ("fold_law", "bend_law"):
        if (
            getattr(structure.options, name, None) is not None
            and memory_of(getattr(structure, name)) is not None
        ):
            raise InputError(
                f" = {getattr(structure, name).name!r}: has a memory, with which small motions "
                "have no constant matrices; take an elastic law",
                name,
            )


def _pattern(
    lattice: Lattice, panels: Sequence[tuple[Step, int]], vertices: Sequence[Vertex],
    number: dict[Vertex, int],
) -> Pattern:  # fmt: skip
    """The patch as a pattern, with letters, families and welds of the cell's."""
    own, cell = lattice.pattern, lattice.cell
    points = np.empty((len(vertices), 3))
    at = own.vertices[cell.copies.first]
    steps: dict[Step, list[int]] = {}
    for k, (step, _) in enumerate(vertices):
        steps.setdefault(step, []).append(k)
    for step, rows in steps.items():
        points[rows] = cell.images(at[[vertices[k][1] for k in rows]], step)
    faces = [
        [number[_plus(step, corner), kind] for corner, kind in lattice.faces[f]]
        for step, f in panels
    ]
    welds = {lattice.edge(*pair).kind for pair in own.welds.tolist()}
    pairs = _kinds({edge_of(a, b) for face in faces for a, b in around(face)}, vertices)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        bare = Pattern(
            points, faces, name=own.name,
            welds=[pair for pair, kind in pairs.items() if kind in welds and _shared(pair, faces)],
        )  # fmt: skip
        if any(bare.flipped):
            raise InputError(
                ": copies of the cell show their fronts on different sides; give motions that "
                "keep the front, over two cells if need be",
                "case",
            )
        letters = {
            lattice.edge(*pair).kind: letter
            for pair, letter in zip(own.creases.tolist(), own.assignments, strict=True)
        }
        flat = np.abs(bare.dihedrals - np.pi) < 1e-6
        given = {}
        for k, pair in enumerate(map(tuple, bare.creases.tolist())):
            kind = edge_between(vertices[pair[0]], vertices[pair[1]]).kind
            given[pair] = letters.get(kind, "U" if flat[k] else bare.assignments[k])
        creases = {pair: pairs[pair] for pair in map(tuple, bare.creases.tolist())}
        families = {}
        for name, rows in own.families.items():
            kinds = {lattice.edge(*own.creases[row].tolist()).kind for row in rows}
            families[name] = [pair for pair, kind in creases.items() if kind in kinds]
        return bare.changed(assignments=given, families={k: v for k, v in families.items() if v})


def _shared(pair: tuple[int, int], faces: Sequence[Sequence[int]]) -> bool:
    return sum(pair[0] in face and pair[1] in face for face in faces) == 2


def _kinds(
    pairs: Iterable[tuple[int, int]], vertices: Sequence[Vertex]
) -> dict[tuple[int, int], tuple]:
    return {pair: edge_between(vertices[pair[0]], vertices[pair[1]]).kind for pair in pairs}


def _structure(
    lattice: Lattice, panels: Sequence[tuple[Step, int]], pattern: Pattern,
    number: dict[Vertex, int],
) -> Any:  # fmt: skip
    """The patch, discretized as the cell is."""
    structure = lattice.cell.case.structure
    options = {
        item.name: getattr(structure.options, item.name) for item in fields(structure.options)
    }
    for name in ("crease_stiffness", "crease_rest"):
        options[name] = _per_crease(name, options[name], lattice, pattern, number)
    for name in ("clamped", "straight"):
        if options.get(name):
            options[name] = _edges(name, options[name], lattice, pattern, number)
    if options["rigid"] is not None and not isinstance(options["rigid"], str):
        chosen = set(options["rigid"])
        options["rigid"] = [k for k, (_, f) in enumerate(panels) if f in chosen]
    options = {name: value for name, value in options.items() if value is not None}
    kind = structure.kind
    if kind == "bars_and_hinges" and (structure.centers >= 0).any():
        options["centers"] = {
            k: lattice.cell.images(
                structure.nodes[structure.centers[f]], _minus(step, lattice.steps[f])
            )
            for k, (step, f) in enumerate(panels)
            if structure.centers[f] >= 0
        }
    return MODELS[kind].make(pattern, _sheet(structure.sheet, panels), **options)


def _sheet(sheet: Sheet, panels: Sequence[tuple[Step, int]]) -> Sheet:
    """The sheet with the panels that differ in all cells."""
    parts = []
    for part in sheet.panels:
        chosen = set(np.atleast_1d(part.panels).tolist())
        rows = [k for k, (_, f) in enumerate(panels) if f in chosen]
        if rows:
            parts.append(replace(part, panels=rows))
    return replace(sheet, panels=parts)


def _per_crease(
    name: str, given: Any, lattice: Lattice, pattern: Pattern, number: dict[Vertex, int]
) -> Any:
    """Values of the creases of the patch from those of the cell's."""
    new = lattice.new_creases()
    if given is None or isinstance(given, float):
        return given
    if isinstance(given, dict):
        words = [word for word in given if word not in ASSIGNED]
        if words and new:
            raise InputError(
                f": the crease of vertices {new[0]}, between two cells, is in no family; give "
                f"values by letter, as mountain and valley, or one for all, in place of "
                f'"{words[0]}"',
                name,
            )
        return {word: value for word, value in given.items() if word in ASSIGNED or not new}
    if new:
        raise InputError(
            f": has no value for the crease of vertices {new[0]}, between two cells; give values "
            "by letter, as mountain and valley, or one for all",
            name,
        )
    values = {
        lattice.edge(*pair).kind: value
        for pair, value in zip(lattice.pattern.creases.tolist(), given, strict=True)
    }
    vertices = sorted(number, key=number.__getitem__)
    return [
        values[kind] for kind in _kinds(map(tuple, pattern.creases.tolist()), vertices).values()
    ]


def _edges(
    name: str, given: Sequence[tuple[int, int]], lattice: Lattice, pattern: Pattern,
    number: dict[Vertex, int],
) -> list[tuple[int, int]]:  # fmt: skip
    """Boundary edges of the patch from those of the cell."""
    for a, b in given:
        if len(lattice.beside[lattice.edge(a, b).kind]) == 2:
            raise InputError(f": edge ({a}, {b}) is a crease between two cells; leave it out", name)
    kinds = {lattice.edge(a, b).kind for a, b in given}
    vertices = sorted(number, key=number.__getitem__)
    rim = _kinds(map(tuple, pattern.boundary.tolist()), vertices)
    return [pair for pair, kind in rim.items() if kind in kinds]


# ---------------------------------------------------------------------- nodes and hidden dofs
def _node_labels(
    structure: Any, vertices: Sequence[Vertex], panels: Sequence[tuple[Step, int]]
) -> list[tuple[Step, Part]]:
    """Cell and kind of each node: a vertex, a point of an edge, or one inside a panel."""
    labels: list[tuple[Step, Part] | None] = [None] * len(structure.nodes)
    for v, (step, kind) in enumerate(vertices):
        labels[v] = (step, ("vertex", kind))
    if structure.edge_nodes.shape[1] > 2:
        for row in structure.edge_nodes.tolist():
            edge = edge_between(vertices[row[0]], vertices[row[-1]])
            inner = row[1:-1] if vertices[row[0]] < vertices[row[-1]] else row[-2:0:-1]
            for k, node in enumerate(inner):
                labels[node] = (edge.step, ("edge", edge.kind, k))
    inside: list[list[int]] = [[] for _ in panels]
    seen = set()
    for triangle, panel in zip(
        structure.triangles.tolist(), structure.triangle_panel.tolist(), strict=True
    ):
        for node in triangle:
            if labels[node] is None and node not in seen:
                seen.add(node)
                inside[panel].append(node)
    for (step, f), nodes in zip(panels, inside, strict=True):
        for k, node in enumerate(sorted(nodes)):
            labels[node] = (step, ("panel", f, k))
    return labels  # type: ignore[return-value]  # each node is in a triangle, or a vertex


def _ordered(labels: Sequence[tuple[Step, Part]], zero: Step) -> list[Part]:
    """Kinds of the nodes of cell 0, in the order of their numbers."""
    return [label for step, label in labels if step == zero]


def _hidden_labels(structure: Any, unit: NDArray, step: NDArray) -> list[tuple[Step, Part]]:
    """Cell and kind of each hidden dof: rotations of sides, and gives of edges."""
    steps = [tuple(row) for row in step.tolist()]

    def label(ends: Iterable[int], what: tuple) -> tuple[Step, Part]:
        first, second = sorted((steps[v], int(unit[v])) for v in ends)
        return first[0], (first[1], second[1], _minus(second[0], first[0]), *what)

    found: list[tuple[Step, Part]] = []
    if structure.kind == "shell":
        sides = structure.sides
        ends: list[tuple[int, int]] = [(0, 0)] * sides.rotations
        corners = np.stack([structure.triangles, np.roll(structure.triangles, -1, axis=1)], axis=2)
        turned = sides.rotation >= 0
        for number, pair in zip(
            sides.rotation[turned].tolist(), corners[turned].tolist(), strict=True
        ):
            ends[number] = edge_of(*pair)
        count: dict[tuple[int, int], int] = {}
        for pair in ends:
            found.append(label(pair, ("turn", count.setdefault(pair, 0))))
            count[pair] += 1
        return found
    if structure.edge_plates is not None:
        hinges = np.concatenate([structure.folds, structure.bends])
        times: dict[int, int] = {}
        for hinge in structure.edge_plates.rotation_hinge.tolist():
            found.append(label(hinges[hinge, :2], ("turn", times.setdefault(hinge, 0))))
            times[hinge] += 1
    gives = structure.edge_gives
    if gives is not None:
        edges = {edge_of(*pair) for pair in gives.edge.tolist()}
        own: list[tuple[Step, Part]] = [((), ())] * gives.count
        for panel, numbers in zip(gives.panel.tolist(), gives.number.tolist(), strict=True):
            face = structure.pattern.faces[panel]
            sides_of = [(a, b) for a, b in around(face) if edge_of(a, b) in edges]
            ends_of = [(pair, end) for pair in sides_of for end in pair]
            for number, (pair, end) in zip(numbers, ends_of, strict=False):
                low = min(pair, key=lambda v: (steps[v], int(unit[v])))
                own[number] = label(pair, ("give", end != low))
        found += own
    return found


# ---------------------------------------------------------------------- supports, masses, damping
class _Groups:
    """Supports, masses, damping and actuated creases of a cell, and their copies.

    wanted : vertices with which those are complete at the nodes of cell 0.
    """

    def __init__(self, lattice: Lattice, case: Case) -> None:
        self.given, self.cell = case, lattice.cell
        self.wanted: set[Vertex] = set()
        structure, count = case.structure, len(lattice.vertices)
        for i, part in enumerate(case.supports):
            for nodes in _tied(structure, part, f"supports[{i}]"):
                own = [lattice.vertices[v] for v in nodes if v < count]
                for at, _ in own:
                    self.wanted |= {(_minus(step, at), kind) for step, kind in own}

    def case(
        self, made: Any, own: Sequence[tuple[Step, Part]],
        place: dict[tuple[Step, Part], int], lattice: Lattice,
    ) -> Case:  # fmt: skip
        """The case of the patch: own and place are the labels of the cell's nodes and the patch's."""
        self.own, self.place, self.lattice = own, place, lattice
        self.by_kind: dict[Part, list[tuple[Step, int]]] = {}
        for (step, label), node in place.items():
            self.by_kind.setdefault(label, []).append((step, node))
        given = self.given
        supports = [
            copy
            for i, part in enumerate(given.supports)
            for copy in self._supports(part, f"supports[{i}]")
        ]
        masses = [
            replace(part, nodes=self._nodes(part.nodes, f"masses[{i}].nodes"))
            for i, part in enumerate(given.masses)
        ]
        loads = [
            replace(load, creases=self._creases(load.creases, made, f"loads[{i}].creases"))
            for i, load in enumerate(given.loads)
            if isinstance(load, Actuate)
        ]
        damping = [
            replace(part, creases=self._creases(part.creases, made, "damping.creases"))
            if isinstance(part, CreaseDamping)
            else part
            for part in given.dampings
            if not isinstance(part, ModalDamping)
        ]
        return Case(made, supports, loads, damping, masses)

    def _resolved(self, nodes: Any, field: str) -> list[int]:
        return resolve_nodes(self.given.structure, nodes, field).tolist()

    def _nodes(self, nodes: Any, field: str) -> list[int]:
        """All copies of some nodes."""
        kinds = {self.own[v][1] for v in self._resolved(nodes, field)}
        return sorted(node for kind in kinds for _, node in self.by_kind[kind])

    def _groups(self, nodes: Sequence[int]) -> list[tuple[Step, list[int]]]:
        """Copies of nodes that belong together, as far as the patch has all of them."""
        labels = [self.own[v] for v in nodes]
        base = labels[0][0]
        found = []
        for step, _ in self.by_kind[labels[0][1]]:
            moved = [(_plus(_minus(at, base), step), kind) for at, kind in labels]
            if all(each in self.place for each in moved):
                found.append((_minus(step, base), [self.place[each] for each in moved]))
        return found

    def _supports(self, part: Any, field: str) -> list[Any]:
        if isinstance(part, BaseMotion):
            return []
        if isinstance(part, Impose):  # stands where the state has it
            axes = part.axis if part.direction is None else None
            part = Fix(part.nodes, axes, part.direction, part.along)
        if isinstance(part, Link):
            return self._links(part, field)
        if getattr(part, "between", None) is not None:
            return self._connectors(part)
        turns = any(motion.turns for motion in self.cell.motions)
        directed = [part]
        if (
            isinstance(part, Fix)
            and turns
            and part.direction is None
            and set(part.axes) != set("xyz")
        ):
            directed = [replace(part, axes=None, direction=axis) for axis in part.axes]
        if not turns or directed[0].direction is None:
            return [replace(part, nodes=self._nodes(part.nodes, f"{field}.nodes"))]
        seen: dict[Part, Step] = {}  # the same direction counts once, however many partners it has
        for node in self._resolved(part.nodes, f"{field}.nodes"):
            step, kind = self.own[node]
            seen.setdefault(kind, step)
        return [
            self._turned(one, _minus(step, base), nodes=[node])
            for one in directed
            for kind, base in seen.items()
            for step, node in self.by_kind[kind]
        ]

    def _turned(self, part: Any, step: Step, **changes: Any) -> Any:
        """A copy of a part with its direction, if it has one, turned as the cell is."""
        if getattr(part, "direction", None) is None:
            return replace(part, **changes)
        from foldyn.cases.directions import unit_vector

        way = rotation(self.cell.motions, step) @ unit_vector(part.direction)
        return replace(part, direction=tuple(way.tolist()), **changes)

    def _links(self, part: Link, field: str) -> list[Any]:
        nodes = self._resolved(part.nodes, f"{field}.nodes")
        corners = [] if part.to is None else list(part.to)
        turns = any(motion.turns for motion in self.cell.motions)
        if turns and corners == [] and set(part.axes or "") != set("xyz"):
            for motion in self.cell.motions:
                ways = np.eye(3)[["xyz".index(axis) for axis in part.axes or ""]]
                turned = ways @ motion.rotation().T
                if np.linalg.matrix_rank(np.concatenate([ways, turned]), 1e-9) > len(ways):
                    raise InputError(
                        f" = {part.axes!r}: a screw turns these axes, so that copies of the link "
                        "would differ; link all three, or axes across or along the screw",
                        f"{field}.axes",
                    )
        found = []
        for _, copy in self._groups([*nodes, *corners]):
            tied = copy[: len(nodes)]
            found.append(replace(part, nodes=tied, to=copy[len(nodes) :] if corners else None))
        return found

    def _connectors(self, part: Any) -> list[Any]:
        found, seen = [], set()
        for pair in np.atleast_2d(part.between).tolist():
            kind = edge_between(*[(self.own[v][0], v) for v in pair]).kind  # type: ignore[misc]
            labels = [self.own[v] for v in pair]
            ends = sorted(((step, str(label)) for step, label in labels))
            kind = (ends[0][1], ends[1][1], _minus(ends[1][0], ends[0][0]))
            if kind in seen:
                continue
            seen.add(kind)
            for step, nodes in self._groups(pair):
                found.append(self._turned(part, step, between=[nodes]))
        return found

    def _creases(self, creases: Any, made: Any, field: str) -> Any:
        """The same creases in all cells."""
        lattice, new = self.lattice, self.lattice.new_creases()
        if isinstance(creases, str) and (creases in ASSIGNED or not new):
            return creases
        rows = resolve_creases(self.given.structure, creases, field)
        kinds = {lattice.edge(*lattice.pattern.creases[row].tolist()).kind for row in rows}
        vertices = [(step, label[1]) for step, label in self.place][: len(made.pattern.vertices)]
        pairs = _kinds(map(tuple, made.pattern.creases.tolist()), vertices)
        return [k for k, kind in enumerate(pairs.values()) if kind in kinds]


def _tied(structure: Any, part: Any, field: str) -> Iterable[list[int]]:
    """Groups of nodes that a support ties together."""
    if isinstance(part, Link):
        nodes = resolve_nodes(structure, part.nodes, f"{field}.nodes").tolist()
        yield [*nodes, *(part.to or ())]
    elif getattr(part, "between", None) is not None:
        yield from np.atleast_2d(part.between).tolist()
