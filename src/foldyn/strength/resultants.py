"""Membrane forces and moments of panels, by model.

A panel of bars and hinges that bends as a plate is taken as the small shell of a superelement that
follows its corners and its center, and carries the moments of its creases; what else its edges are
free to do leaves the least energy. Creases and straight edges stay straight normal to the panel,
and creases along themselves, as in these models.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.condensation import Superelements, superelements
from foldyn.condensation.assembly import Whole
from foldyn.condensation.library import ALIKE, Group
from foldyn.condensation.panel import BOW, TURN, VERTEX, CondensedPanel
from foldyn.condensation.resultants import held_resultants, in_own_axes
from foldyn.errors import InputError
from foldyn.patterns.screw import closest_rotations
from foldyn.patterns.topology import around, edge_lookup, edge_of
from foldyn.shells import Shell
from foldyn.shells.recovery import StressPoints
from foldyn.strength.loaded import LoadedSheet, crease_lengths, crease_moments
from foldyn.structures import Structure
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.structures.edge_angles import straight_creases
from foldyn.structures.rigid_plates import rigid_panels

HINGES = (
    ": panels that bend by single hinges and stretch by single bars have no stresses; their forces "
    "only represent those of a sheet. Take superelements, the shell, or the preset n5b8e or plate"
)
DIVISIONS = 12  # of the mesh of a panel
FLAT = 1e-9  # singular values of elongations, relative to the largest, that are rigid motions
THIN = 1e-4
"""Thickness over the longest edge, below which rounding hides bending: moments are 1.4 % off."""
FREE, STRAIGHT, CREASED, CLAMPED = range(4)  # conditions of an edge


class Resultants(Protocol):
    """Membrane forces and moments of a case's panels.

    Attributes
    ----------
    case : Case
        The case with the model that they are computed with.
    points : StressPoints
    """

    case: Case
    points: StressPoints

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """Membrane forces, N/m, and moments, N, (p, 2, 3): components xx, yy, xy.

        q : (m,) dofs of the case's body.
        factors : (k,) of the loads of the case.
        """
        ...


class ShellResultants:
    """Forces and moments of a shell; see `Resultants`."""

    def __init__(self, case: Case) -> None:
        self.case, self._sheet = case, LoadedSheet(case)
        self._shell: Any = case.structure
        self.points = self._shell.stress_points

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `Resultants`."""
        return self._shell.resultants(q, self._sheet.free(factors))


class SuperelementResultants:
    """Forces and moments of superelements, with the shapes for stresses; see `Resultants`."""

    def __init__(self, case: Case) -> None:
        self.case = for_stresses(case)
        self.structure: Any = self.case.structure
        self.points = self.structure.stress_points
        self._sheet = LoadedSheet(self.case)

    @cached_property
    def rows(self) -> sparse.csr_array:
        """Forces and moments (6 p, m) of the dofs."""
        return self.structure.resultants(self.case.held_edges)

    @cached_property
    def crease_rows(self) -> sparse.csr_array:
        """Moments of creases per length (nf, m), N, of the dofs in small motions."""
        turns: Any = self.case.elastic_body.sheet.crease_turns
        per_turn = self.structure.slope / crease_lengths(self.structure)
        return sparse.csr_array(-per_turn[:, None] * turns.mean)

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `Resultants`."""
        held = held_resultants(self.structure.whole, self._sheet.distributed(factors))
        return (self.rows @ q + held).reshape(-1, 2, 3)

    def accelerated(self, axis: int) -> NDArray[np.float64]:
        """What panels with held edges add (6 p,) if all moves with 1 m/s2 along an axis."""
        structure = self.structure
        mass = structure.sheet.values("areal_density", len(structure.pattern.faces))
        force = np.zeros((len(mass), 3))
        force[:, axis] = -mass * structure.board_share
        return held_resultants(structure.whole, Distributed(panels=force))


def for_stresses(case: Case) -> Case:
    """The case with the model that its stresses are computed with."""
    structure = case.structure
    if not isinstance(structure, Superelements) or structure.finer is not None:
        return case
    return case.altered(structure=structure.for_stresses)


def has_stresses(structure: Discretized) -> bool:
    """Whether the panels of a structure have stresses."""
    hinged = isinstance(structure, Structure) and not has_plates(structure)
    return structure.pattern is not None and not hinged


def without_rigid(case: Case, points: StressPoints, resultants: NDArray) -> NDArray:
    """Forces and moments (..., p, 2, 3), which are 0 in rigid panels."""
    structure = case.structure
    rigid = rigid_panels(structure.options.rigid, len(structure.pattern.faces))
    return np.where(np.isin(points.panel, list(rigid))[:, None, None], 0.0, resultants)


def check_stresses(case: Case, field: str) -> None:
    """Refuse a case that has no stresses, or moments of creases, for any of its results."""
    if case.structure.pattern is None:
        raise InputError(": the structure has no pattern, and so no panels", field)
    if case.remembering:
        raise InputError(
            ": the creases have a law with memory or latches, which stresses do not follow: take "
            "an elastic law, and no latches",
            field,
        )
    if isinstance(case.structure, Structure) and has_stresses(case.structure):
        check_plates(case, field)


def resultants_of(case: Case) -> Resultants:
    """How the panels of a case have their forces and moments.

    Raises
    ------
    InputError
        Panels without stresses.
    """
    structure = case.structure
    if isinstance(structure, Superelements):
        return SuperelementResultants(case)
    if isinstance(structure, Shell):
        return ShellResultants(case)
    if has_stresses(structure):
        return PlateResultants(case)
    raise InputError(HINGES, "model")


def has_plates(structure: Structure) -> bool:
    """Whether the panels of a structure bend as plates and stretch as membranes."""
    options = structure.options
    plates = options.scheme == "n5b8e" or options.calibration == "plate"
    return plates and options.membrane == "panel" and structure.pattern is not None


def check_plates(case: Case, field: str) -> None:
    """Refuse what the stresses of plates do not follow."""
    structure, reason = case.structure, ""
    if len(structure.pattern.welds):
        reason = "across welds"
    elif structure.sheet.values("thickness", len(structure.pattern.faces)).min() < (
        THIN * max(sides.max() for sides in structure.pattern.sides)
    ):
        reason = f"of panels thinner than {THIN:g} of their edges"
    elif any(load.swelling(structure, "loads") is not None for load in case.loads):
        reason = "of warm panels"
    if reason:
        raise InputError(
            f": stresses {reason} are not computed for bars and hinges; take superelements or the "
            "shell",
            field,
        )


class _Kind(NamedTuple):
    """Congruent panels with the same conditions at their edges."""

    number: NDArray  # (p,) indices in the pattern
    nodes: NDArray  # (p, k) corners
    center: NDArray  # (p,) nodes of the centers, or -1
    frames: NDArray  # (p, 3, 3) axes, in rows
    edges: NDArray  # (p, k) sides, see `EdgeSides`
    maps: NDArray  # (p, points, 2, 3, inputs) see `_map`, in the panels' own axes


class PlateResultants:
    """Forces and moments of panels as plates; see `Resultants`."""

    def __init__(self, case: Case) -> None:
        structure: Any = case.structure
        self.case, self._sheet = case, LoadedSheet(case)
        self._structure, self._pattern = structure, structure.pattern
        sheet = structure.sheet.weighed  # panels do not vibrate here
        panels = superelements(self._pattern, sheet, divisions=DIVISIONS)
        self.points, self._kinds = panels.stress_points, self._found(panels.whole)
        sides = panels.whole.sides
        row, ways = np.arange(len(sides.creases)), self._pattern.crease_ways
        entries = (ways.ravel().astype(float), (sides.creases.ravel(), np.repeat(row, 2)))
        self._on_sides = sparse.csr_array(entries, shape=(len(sides.edge), len(row)))

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `Resultants`."""
        structure = self._structure
        x = structure.nodes + q[: structure.nodes.size].reshape(-1, 3)
        moment = crease_moments(structure, self._sheet.body(factors), q) * crease_lengths(structure)
        opened = self._sheet.distributed(factors).creases  # acts on the panels beside a crease
        moment = np.append(self._on_sides @ (moment if opened is None else moment - opened), 0.0)
        out = np.zeros((len(self.points.panel), 2, 3))
        for kind in self._kinds:
            place, turned = _moved(structure.nodes, x, kind)
            rises = place[:, -1:, 2] if (kind.center >= 0).all() else np.zeros((len(place), 0))
            corners = place[:, : kind.nodes.shape[1]].reshape(len(place), -1)
            inputs = np.concatenate([corners, moment[kind.edges], turned, rises], axis=1)
            for number, own, given in zip(kind.number, kind.maps, inputs, strict=True):
                out[self.points.panel == number] = own @ given
        return out

    def _found(self, whole: Whole) -> list[_Kind]:
        """The panels by kind, without rigid ones."""
        structure, pattern = self._structure, self._pattern
        rigid = set(rigid_panels(structure.options.rigid, len(pattern.faces)))
        straight = straight_creases(structure.nodes, structure.folds, pattern, structure.sheet)
        condition = {e: CREASED for e, k in edge_lookup(pattern.creases).items() if straight[k]}
        condition |= dict.fromkeys(structure.options.straight, STRAIGHT)
        condition |= {(low, high): CREASED for low, high, _ in structure.options.guided}
        condition |= dict.fromkeys(structure.options.clamped, CLAMPED)
        found = []
        for group in whole.groups:
            alike: dict[tuple, list[int]] = {}
            for k, (number, face) in enumerate(zip(group.number, group.faces, strict=True)):
                edges = tuple(condition.get(edge_of(a, b), FREE) for a, b in around(face.tolist()))
                if int(number) not in rigid:
                    alike.setdefault((edges, self._center(group, k)), []).append(k)
            for (edges, center), members in alike.items():
                own = group.faces[members], group.frames[members], group.number[members]
                chosen = Group(group.panel, *own)
                found.append(self._kind(whole, chosen, edges, center))
        return found

    def _center(self, group: Group, k: int) -> tuple[float, ...] | None:
        """Where the center of panel k of a group is in its frame, relative to its size."""
        center = int(self._structure.centers[group.number[k]])
        if center < 0:
            return None
        nodes, size = self._structure.nodes, self._pattern.size
        away = group.frames[k, :2] @ (nodes[center] - nodes[group.faces[k, 0]])
        return tuple((np.round(away / size, ALIKE) * size).tolist())

    def _kind(
        self, whole: Whole, group: Group, edges: Sequence[int], center: tuple[float, ...] | None
    ) -> _Kind:
        """Panels of a group with the same conditions of their edges, and center."""
        faces, centers = group.faces, self._structure.centers[group.number]
        rise = np.zeros((0, len(group.panel.kind)))
        if center is not None:
            rise = group.panel.lift(np.array([center])).reshape(1, -1)
        maps = [own for _, own in in_own_axes(self._pattern, group, _map(group.panel, edges, rise))]
        sides = whole.sides_of(group)
        return _Kind(group.number, faces, centers, group.frames, sides, np.array(maps))


def _map(panel: CondensedPanel, conditions: Sequence[int], rise: NDArray) -> NDArray[np.float64]:
    """Forces and moments (2, points, 3, inputs) per displacement, moment, turn and rise.

    The inputs are displacements of corners, moments of creases and turns of clamped edges by edge,
    and the rise of the center, in the frame of the panel.

    rise : (0 or 1, c) rise of the center by shape.
    """
    what, where, number = panel.kind.T
    edge = np.where(what == BOW, where // 3, where)
    condition = np.array([*conditions])[np.where(what == VERTEX, 0, edge) % len(conditions)]
    still = (what == BOW) & (condition != FREE) & ((where % 3 != 1) | (condition == STRAIGHT))
    still |= (what == BOW) & (condition == CLAMPED)
    clamped = (what == TURN) & (condition == CLAMPED)
    corners, count = 3 * len(conditions), len(conditions)
    inputs = corners + 2 * count + len(rise)
    given, push = np.zeros((2, len(panel.kind), inputs))
    for k in np.flatnonzero(what == VERTEX):
        given[k, 3 * where[k] + number[k]] = 1.0
    for k in np.flatnonzero((what == TURN) & (number == 0)):
        push[k, corners + where[k]] = 1.0
        if clamped[k]:
            given[k, corners + count + where[k]] = 1.0
    free = np.flatnonzero(~((what == VERTEX) | still | clamped))
    right = push[free] - panel.stiffness[free] @ given
    level = np.zeros((len(rise), inputs))
    level[:, inputs - len(rise) :] = 1.0
    both = np.block(
        [[panel.stiffness[np.ix_(free, free)], rise[:, free].T],
         [rise[:, free], np.zeros((len(rise), len(rise)))]]
    )  # fmt: skip
    scale = 1.0 / np.sqrt(np.abs(np.diag(both)).clip(min=1e-300))
    scale[len(free) :] = np.sqrt(np.abs(np.diag(both)).max())
    solved = np.linalg.solve(
        scale[:, None] * both * scale, scale[:, None] * np.vstack([right, level - rise @ given])
    )
    given[free] = (scale[:, None] * solved)[: len(free)]
    return panel.resultants @ given


def _moved(rest: NDArray, x: NDArray, kind: _Kind) -> tuple[NDArray, NDArray]:
    """Displacements (p, k or k + 1, 3) in the panels' frames, and turns (p, k) of clamped edges.

    Corners, then the center, relative to the place to which the panel moves as a rigid body.
    """
    from scipy.spatial.transform import Rotation  # loads slowly: not for other models

    nodes = np.column_stack([kind.nodes, kind.center]) if (kind.center >= 0).all() else kind.nodes
    corners = kind.nodes.shape[1]
    before, after = (place[nodes] - place[kind.nodes].mean(axis=1)[:, None] for place in (rest, x))
    both = np.einsum("pki,pkj->pij", before[:, :corners], after[:, :corners])
    rotation = np.swapaxes(closest_rotations(both), 1, 2)  # from rest to now
    local = np.einsum("pki,pij->pkj", after, rotation) - before
    local = np.einsum("pad,pkd->pka", kind.frames, local)
    local[..., :2] = _stretched(np.einsum("pad,pkd->pka", kind.frames, before), after, corners)
    angle = Rotation.from_matrix(rotation).as_rotvec()
    along = np.roll(before[:, :corners], -1, axis=1) - before[:, :corners]
    along /= np.linalg.norm(along, axis=2)[:, :, None]
    return local, -np.einsum("pi,pki->pk", angle, along)


def _stretched(rest: NDArray, after: NDArray, corners: int) -> NDArray[np.float64]:
    """Displacements (p, k, 2) in the plane that stretch a panel as its edges and spokes are.

    Those of a panel that bends contain the shortening of its chords, which strains nothing.

    rest, after : (p, k, 3) corners, then maybe the center; `rest` in the frame of the panel.
    """
    ring = np.arange(corners)
    ends = np.stack([ring, np.roll(ring, -1)], axis=1)
    if rest.shape[1] > corners:
        ends = np.concatenate([ends, np.stack([ring, np.full(corners, corners)], axis=1)])
    before, now = (x[:, ends[:, 1]] - x[:, ends[:, 0]] for x in (rest, after))
    square = np.einsum("pbi,pbi->pb", before, before)
    strain = 0.5 * (np.einsum("pbi,pbi->pb", now, now) / square - 1.0)
    rows = np.zeros((*square.shape, rest.shape[1], 2))
    for sign, end in ((1.0, 1), (-1.0, 0)):
        rows[:, np.arange(len(ends)), ends[:, end]] += sign * before[..., :2] / square[..., None]
    inverse = np.linalg.pinv(rows.reshape(*square.shape, -1), rcond=FLAT)
    return np.einsum("pub,pb->pu", inverse, strain).reshape(len(rest), -1, 2)
