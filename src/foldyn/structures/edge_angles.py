"""The scheme n5b8e: bars and hinges whose panels bend as condensed plates, with edge angles.

Nodes and bars are those of N5B8. Each panel has one constant matrix for the turns of its spokes and
of its creased edges (`structures.condensed_panel`); a fold acts between the two edges beside it,
with the stiffness of the crease alone.

A crease between panels that are not in one plane stays straight, because bowing would stretch them:
by w^2 for a bow w out of the plane of one is w sin(fold) in the plane of the other, against t^2.
It counts as such above `STRAIGHT` t/L, t the thickness and L its length.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn import mechanics
from foldyn.materials import BarLaw, HingeLaw
from foldyn.mechanics.plates import BarsPlates
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around, edge_lookup, edge_of
from foldyn.structures.condensed_panel import panel_stiffness
from foldyn.structures.mesh import hinge_angles, lengths
from foldyn.structures.panel_plate import Outline, outline
from foldyn.structures.sheet import Sheet

STRAIGHT = 3.0


class EdgePlates(NamedTuple):
    """Panels as plates: what `BarsPlates` has of them."""

    fold_rotations: NDArray
    start: NDArray
    angle: NDArray
    entry: NDArray
    stiffness: NDArray


def edge_plates(
    nodes: NDArray, centers: NDArray, folds: NDArray, pattern: Pattern, sheet: Sheet,
    straight_edges: Collection[Edge] = (), rigid: Collection[int] = (),
) -> EdgePlates:  # fmt: skip
    """Panels of a mesh with center nodes as plates.

    straight_edges : boundary edges (low, high) that stay straight.
    rigid : numbers of rigid panels, which have no angles.
    """
    kinds, kind = sheet.kinds(len(pattern.faces))
    crease = edge_lookup(pattern.creases)
    panels = outlines(nodes, centers, folds, pattern, sheet, straight_edges, rigid)
    spokes = [len(face) if centers[p] >= 0 else 0 for p, face in enumerate(pattern.faces)]
    first = len(folds) + np.concatenate([[0], np.cumsum(spokes)])
    rotations = np.full((len(folds), 2), -1)
    angles: list[list[int]] = []
    matrices: list[NDArray] = []
    count = 0
    for p, face in enumerate(pattern.faces):
        panel = panels[p]
        if panel is None:
            angles.append([])
            continue
        turned = list(range(first[p], first[p + 1]))
        for k in (crease[edge_of(a, b)] for a, b in around(face) if edge_of(a, b) in crease):
            rotations[k, int(rotations[k, 0] >= 0)] = count
            turned.append(-1 - count)
            count += 1
        own = kinds[kind[p]]
        matrices.append(own.bending_modulus * panel_stiffness(panel, own.poissons_ratio))
        angles.append(turned)
    sizes = [len(turned) for turned in angles]
    return EdgePlates(
        fold_rotations=rotations,
        start=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        angle=np.array([k for turned in angles for k in turned], np.int64),
        entry=np.concatenate([[0], np.cumsum(np.square(sizes))]).astype(np.int64),
        stiffness=np.concatenate([np.zeros(0), *(matrix.ravel() for matrix in matrices)]),
    )


def outlines(
    nodes: NDArray, centers: NDArray, folds: NDArray, pattern: Pattern, sheet: Sheet,
    straight_edges: Collection[Edge] = (), rigid: Collection[int] = (),
) -> list[Outline | None]:  # fmt: skip
    """Outline of each panel; None of a rigid one. Arguments as of `edge_plates`."""
    crease = edge_lookup(pattern.creases)
    straight = straight_creases(nodes, folds, pattern, sheet)
    found: list[Outline | None] = []
    for p, face in enumerate(pattern.faces):
        if p in rigid:
            found.append(None)
            continue
        edges = [crease.get(edge_of(a, b), -1) for a, b in around(face)]
        center = nodes[centers[p]] if centers[p] >= 0 else None
        held = [
            bool(straight[k]) if k >= 0 else edge_of(a, b) in straight_edges
            for k, (a, b) in zip(edges, around(face), strict=True)
        ]
        x = pattern.vertices[list(face)]
        found.append(outline(x, center, [k >= 0 for k in edges], held))
    return found


def straight_creases(nodes: NDArray, folds: NDArray, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Which creases (nf,) stay straight, for the hinges `folds` on them."""
    thickness = sheet.values("thickness", len(pattern.faces))[pattern.crease_faces].max(axis=1)
    slender = thickness / lengths(pattern.vertices, pattern.creases)
    return np.abs(np.sin(hinge_angles(nodes, folds))) > STRAIGHT * slender


def plates_model(
    nodes: NDArray, bars: NDArray, bar_stiffness: NDArray, bar_law: BarLaw, folds: NDArray,
    fold_stiffness: NDArray, fold_rest: NDArray, fold_law: HingeLaw, bends: NDArray,
    bend_rest: NDArray, plates: EdgePlates,
) -> BarsPlates:  # fmt: skip
    """Arrays of the model: bars with the stiffness E A / L, folds, and what `edge_plates` gives."""
    length = lengths(nodes, bars)
    return BarsPlates(
        bars=mechanics.build(nodes, bars, bar_stiffness, bar_law, ()),
        rotations=int((plates.fold_rotations >= 0).sum()),
        per_reach=1.0 / float(np.sqrt((length**2).mean())),
        hinges=np.concatenate([folds, bends]).astype(np.int64),
        fold_stiffness=np.array(fold_stiffness, float),
        fold_rest=np.array(fold_rest, float),
        fold_parameters=fold_law.parameters(fold_rest).reshape(-1, 4),
        code=int(fold_law.code),
        addresses=np.array(fold_law.addresses or (0, 0, 0), np.int64),
        bend_rest=np.array(bend_rest, float),
        **plates._asdict(),
    )


def spoke_stiffness(plates: EdgePlates, folds: int, bends: int) -> NDArray:
    """Stiffness (nb,), N m/rad, of each spoke if no other angle of its panel turns."""
    out = np.zeros(bends)
    for p, first in enumerate(plates.start[:-1]):
        count = plates.start[p + 1] - first
        own = plates.angle[first : first + count]
        diagonal = plates.stiffness[plates.entry[p] : plates.entry[p + 1]][:: count + 1]
        out[own[own >= 0] - folds] = diagonal[own >= 0]
    return out
