"""Forces and moments in the panels of bars and hinges that bend as plates.

A panel is taken as the small shell of a superelement that follows its corners and its center, and
carries the moments of its creases; what else its edges are free to do leaves the least energy.
Creases and straight edges stay straight normal to the panel, and creases along themselves, as in
these models.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from foldyn.cases import Case
from foldyn.condensation import superelements
from foldyn.condensation.assembly import Whole
from foldyn.condensation.library import Group
from foldyn.condensation.panel import BOW, TURN, VERTEX, CondensedPanel
from foldyn.condensation.resultants import in_own_axes
from foldyn.errors import InputError
from foldyn.patterns.topology import Edge, around, edge_lookup, edge_of
from foldyn.shells.recovery import StressPoints
from foldyn.strength.creases import crease_moments
from foldyn.strength.loaded import LoadedSheet
from foldyn.structures.edge_angles import straight_creases
from foldyn.structures.mesh import lengths
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.structure import Structure

DIVISIONS = 12  # of the mesh of a panel
FREE, STRAIGHT, CREASED, CLAMPED = range(4)  # conditions of an edge


def has_plates(structure: Structure) -> bool:
    """Whether the panels of a structure bend as plates and stretch as membranes."""
    options = structure.options
    plates = options.scheme == "n5b8e" or options.calibration == "plate"
    return plates and options.membrane == "panel" and structure.pattern is not None


class _Kind(NamedTuple):
    """Congruent panels with the same conditions at their edges."""

    number: NDArray  # (p,) indices in the pattern
    nodes: NDArray  # (p, k) corners
    center: NDArray  # (p,) nodes of the centers, or -1
    frames: NDArray  # (p, 3, 3) axes, in rows
    edges: NDArray  # (p, k) creases, or -1
    maps: NDArray  # (p, points, 2, 3, inputs) see `_map`, in the panels' own axes


class PlateResultants:
    """Forces and moments of panels as plates; see `strength.resultants.Resultants`."""

    def __init__(self, case: Case) -> None:
        structure = case.structure
        assert isinstance(structure, Structure)
        assert structure.pattern is not None
        self.case, self._sheet = case, LoadedSheet(case)
        self._structure, self._pattern = structure, structure.pattern
        if len(self._pattern.welds):
            raise InputError(
                ": stresses across welds are not computed for bars and hinges; take superelements "
                "or the shell",
                "model",
            )
        if any(own.swelling(structure, "loads") is not None for own in case.loads):
            raise InputError(
                ": stresses of warm panels are not computed for bars and hinges; take "
                "superelements or the shell",
                "model",
            )
        self.points = StressPoints.of(self._pattern, structure.sheet)
        self._kinds = self._found()

    def at(self, q: NDArray, factors: NDArray) -> NDArray[np.float64]:
        """See `strength.resultants.Resultants`."""
        structure = self._structure
        x = structure.nodes + q[: structure.nodes.size].reshape(-1, 3)
        moment = crease_moments(structure, self._sheet.body(factors), q)
        moment = np.append(moment * self._lengths, 0.0)
        out = np.zeros((len(self.points.panel), 2, 3))
        for kind in self._kinds:
            place, turned = _moved(structure.nodes, x, kind)
            rises = place[:, -1:, 2] if (kind.center >= 0).all() else np.zeros((len(place), 0))
            corners = place[:, : kind.nodes.shape[1]].reshape(len(place), -1)
            inputs = np.concatenate([corners, moment[kind.edges], turned, rises], axis=1)
            for number, own, given in zip(kind.number, kind.maps, inputs, strict=True):
                out[self.points.panel == number] = own @ given
        return out

    @property
    def _lengths(self) -> NDArray:
        return lengths(self._pattern.vertices, self._pattern.creases)

    def _found(self) -> list[_Kind]:
        """The panels by kind, without rigid ones."""
        structure, pattern = self._structure, self._pattern
        sheet = structure.sheet
        if sheet.density is None:
            raise InputError("sheet: density is missing: panels are condensed with their mass")
        whole = superelements(pattern, sheet, divisions=DIVISIONS).whole
        rigid = set(rigid_panels(structure.options.rigid, len(pattern.faces)))
        straight = straight_creases(structure.nodes, structure.folds, pattern, sheet)
        creases, condition = edge_lookup(pattern.creases), {}
        for edge, k in creases.items():
            condition[edge] = CREASED if straight[k] else FREE
        condition |= dict.fromkeys(structure.options.straight, STRAIGHT)
        condition |= {(low, high): CREASED for low, high, _ in structure.options.guided}
        condition |= dict.fromkeys(structure.options.clamped, CLAMPED)
        found = []
        for group in whole.groups:
            alike: dict[tuple, list[int]] = {}
            for k, (number, face) in enumerate(zip(group.number, group.faces, strict=True)):
                edges = tuple(condition.get(edge_of(a, b), FREE) for a, b in around(face.tolist()))
                if int(number) not in rigid:
                    center = bool(structure.centers[number] >= 0)
                    alike.setdefault((edges, center), []).append(k)
            for (edges, center), members in alike.items():
                chosen = Group(
                    group.panel,
                    *(each[members] for each in (group.faces, group.frames, group.number)),
                )
                found.append(self._kind(whole, chosen, edges, center, creases))
        return found

    def _kind(
        self, whole: Whole, group: Group, edges: Sequence[int], center: bool,
        creases: Mapping[Edge, int],
    ) -> _Kind:  # fmt: skip
        """Panels of a group with the same conditions of their edges."""
        structure, faces = self._structure, group.faces
        centers, rise = structure.centers[group.number], np.zeros((0, len(group.panel.kind)))
        if center:
            away = structure.nodes[centers[0]] - structure.nodes[faces[0, 0]]
            rise = group.panel.lift((group.frames[0, :2] @ away)[None]).reshape(1, -1)
        maps = [own for _, own in in_own_axes(self._pattern, group, _map(group.panel, edges, rise))]
        pairs = [[edge_of(a, b) for a, b in around(face)] for face in faces.tolist()]
        numbers = np.array([[creases.get(edge, -1) for edge in row] for row in pairs])
        return _Kind(group.number, faces, centers, group.frames, numbers, np.array(maps))


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
    known = (what == VERTEX) | still | clamped
    free = np.flatnonzero(~known)
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
    nodes = np.column_stack([kind.nodes, kind.center]) if (kind.center >= 0).all() else kind.nodes
    corners = kind.nodes.shape[1]
    before, after = (place[nodes] - place[kind.nodes].mean(axis=1)[:, None] for place in (rest, x))
    both = np.einsum("pki,pkj->pij", before[:, :corners], after[:, :corners])
    left, _, right = np.linalg.svd(both)
    sign = np.sign(np.linalg.det(left @ right))
    left[:, :, 2] *= sign[:, None]
    rotation = np.swapaxes(left @ right, 1, 2)  # from rest to now
    local = np.einsum("pki,pij->pkj", after, rotation) - before
    angle = Rotation.from_matrix(rotation).as_rotvec()
    along = np.roll(before[:, :corners], -1, axis=1) - before[:, :corners]
    along /= np.linalg.norm(along, axis=2)[:, :, None]
    turned = -np.einsum("pi,pki->pk", angle, along)
    return np.einsum("pad,pkd->pka", kind.frames, local), turned
