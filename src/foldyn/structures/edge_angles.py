"""The scheme n5b8e: bars and hinges whose panels bend as condensed plates, with edge angles.

Nodes and bars are as in N5B8. Each panel has one constant matrix for the turns of its spokes and of
its creased edges (`structures.condensed_panel`); a fold acts between its two adjacent edges, with
the stiffness of the crease alone.

A crease between panels in different planes stays straight, because bowing would stretch them: a bow
w out of the plane of one panel is w sin(fold) in the plane of the other (energies of stretching and
bending are in the ratio w^2 : t^2). Panels count as lying in different planes if sin(fold) is above
`STRAIGHT` t/L, with t the thickness and L the length of the crease.

Along a weld the sheet is smooth: with d the change of the dihedral between the facets at the weld,
one panel turns by d/2 + x and the other by d/2 - x, with x a shared rotation. A weld that does not
stay straight also has a shared bow. At a welded junction of several panels x is the turn of the
first of them, and the others turn by d - x or x - d, with d between the first panel and theirs.

A clamped edge has no rotation of its own: relative to the facet the sheet turns there by the
dihedral between the facet and the mirror image that the facet has at rest, minus pi.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from foldyn import mechanics
from foldyn.algebra.superlu import SingularTangentError
from foldyn.materials import BarLaw, HingeLaw, LinearBar, LinearHinge
from foldyn.mechanics.plates import BarsPlates
from foldyn.patterns import Pattern, topology
from foldyn.structures.condensed_panel import panel_moments, panel_stiffness
from foldyn.structures.held_edges import clamp_points
from foldyn.structures.mesh import Mesh, hinge_angles, lengths, too_narrow
from foldyn.structures.panel_plate import Outline, outline
from foldyn.structures.sheet import Sheet

STRAIGHT = 3.0


class EdgePlates(NamedTuple):
    """Panels as plates: the fields of `BarsPlates` that describe them."""

    rotation_hinge: NDArray
    fold_rotations: NDArray
    fold_ways: NDArray
    start: NDArray
    angle: NDArray
    entry: NDArray
    stiffness: NDArray


def edge_plates(
    mesh: Mesh, pattern: Pattern, sheet: Sheet, straight: Collection[topology.Edge],
    rigid: Collection[int], clamped: Mapping[topology.Edge, float],
) -> EdgePlates:  # fmt: skip
    """Panels of a mesh with center nodes as plates.

    straight : boundary edges (low, high) that stay straight.
    rigid : indices of rigid panels, which have angles only at clamped edges.
    clamped : boundary edges that are clamped, with the stiffness, N m/rad, for rigid panels. Their
        hinges follow the hinges of bends and welds, in this order.
    """
    kinds, kind = sheet.kinds(len(pattern.faces))
    folds, bends = len(mesh.folds), len(mesh.bends)
    creases, welds = topology.edge_rows(pattern.creases), weld_turns(pattern)
    hinge = {edge: folds + bends + k for edge, k in topology.edge_lookup(pattern.welds).items()}
    hinges = np.concatenate([mesh.folds, mesh.welds])
    hinge |= {edge: bends + len(hinges) + k for k, edge in enumerate(clamped)}
    panels = outlines(mesh.nodes, mesh.centers, hinges, pattern, sheet, straight, rigid, clamped)
    spokes = [len(face) if mesh.centers[p] >= 0 else 0 for p, face in enumerate(pattern.faces)]
    first = folds + np.concatenate([[0], np.cumsum(spokes)])
    rotations, ways = np.full((folds, 2), -1), np.ones((folds, 2))
    beside: list[int] = []
    shared: dict[tuple[int, str], int] = {}

    def number(k: int, what: str) -> int:
        """Index of the rotation that both sides of a weld share."""
        if (k, what) not in shared:
            shared[k, what] = len(beside)
            beside.append(k)
        return shared[k, what]

    bending = [(panel, kinds[kind[p]].poissons_ratio) for p, panel in enumerate(panels) if panel]
    try:
        found = iter(panel_stiffness.each(bending))
    except SingularTangentError as error:
        raise too_narrow(pattern) from error
    angles: list[list[int]] = []
    matrices: list[NDArray] = []
    for p, face in enumerate(pattern.faces):
        panel, edges = panels[p], [topology.edge_of(a, b) for a, b in topology.around(face)]
        if panel is None:
            held = [edge for edge in edges if edge in clamped]
            angles.append([hinge[edge] for edge in held])
            matrices.append(np.diag([clamped[edge] for edge in held]))
            continue
        turned = list(range(first[p], first[p + 1]))
        parts = [np.eye(len(turned))]
        for edge in edges:
            if edge in creases:
                for k in creases[edge]:
                    if p in pattern.crease_faces[k]:
                        own, side = pattern.crease_faces[k] == p, int(rotations[k, 0] >= 0)
                        rotations[k, side] = len(beside)
                        ways[k, side] = pattern.crease_ways[k][own][0]
                turned.append(-1 - len(beside))
                parts.append(np.ones((1, 1)))
                beside.append(creases[edge][0])
            elif edge in clamped:
                turned.append(hinge[edge])
                parts.append(np.ones((1, 1)))
            elif edge in hinge:  # the dihedral at the weld, and the shared rotation
                k, share, way = welds[p, edge]
                turned += [folds + bends + k] * (share != 0.0)
                turned.append(-1 - number(hinge[edge], "turn"))
                parts.append(np.array([[share, way] if share else [way]]))
        for edge in (edge for edge, bow in zip(edges, panel.bowed, strict=True) if bow):
            turned.append(-1 - number(hinge[edge], "bow"))
            parts.append(np.ones((1, 1)))
        matrix = kinds[kind[p]].bending_modulus * next(found)
        if any(k >= folds + bends for k in turned):
            turns = block_diag(*parts)
            matrix = turns.T @ matrix @ turns
        matrices.append(matrix)
        angles.append(turned)
    sizes = [len(turned) for turned in angles]
    return EdgePlates(
        rotation_hinge=np.array(beside, np.int64),
        fold_rotations=rotations,
        fold_ways=ways,
        start=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        angle=np.array([k for turned in angles for k in turned], np.int64),
        entry=np.concatenate([[0], np.cumsum(np.square(sizes))]).astype(np.int64),
        stiffness=np.concatenate([np.zeros(0), *(matrix.ravel() for matrix in matrices)]),
    )


def weld_turns(pattern: Pattern) -> dict[tuple[int, topology.Edge], tuple[int, float, float]]:
    """Row of the weld, and factors of its dihedral and of the shared rotation, by panel and edge.

    The sheet turns by their sum relative to the panel, see the top of this module.
    """
    found: dict[tuple[int, topology.Edge], tuple[int, float, float]] = {}
    at_junction = topology.at_junctions(pattern.welds)
    for row, (a, b) in enumerate(pattern.welds.tolist()):
        (one, two), (way, other) = pattern.weld_faces[row].tolist(), pattern.weld_ways[row].tolist()
        if at_junction[row]:  # the rows of the first panel come first
            found.setdefault((one, (a, b)), (row, 0.0, 1.0))
            found.setdefault((two, (a, b)), (row, other, -other * way))
        else:
            found[one, (a, b)], found[two, (a, b)] = (row, 0.5, 1.0), (row, 0.5, -1.0)
    return found


def curl_moments(
    plates: EdgePlates, panels: Sequence[Outline | None], curvature: NDArray, pattern: Pattern,
    sheet: Sheet, area: NDArray, clamps: int,
) -> NDArray:  # fmt: skip
    """Moments (nq,), N m, of the angles of plates with given free curvatures.

    panels : see `outlines`.
    curvature : (np,), 1/m.
    area : (np,), m2.
    clamps : index of the first hinge of a clamped edge.
    """
    kinds, kind = sheet.kinds(len(panels))
    out, turns = np.zeros(len(plates.angle)), weld_turns(pattern)
    for p, panel in enumerate(panels):
        if panel is None:
            continue
        own, size = kinds[kind[p]], np.sqrt(2.0 * area[p])  # an outline's size is 1
        scale, place = own.bending_modulus * curvature[p] * size, plates.start[p]
        spokes = len(panel.corners) if panel.center else 0
        edges = ((p, topology.edge_of(a, b)) for a, b in topology.around(pattern.faces[p]))
        by_weld = iter([turns[edge][1:] for edge in edges if edge in turns and turns[edge][1]])
        for k, moment in enumerate(scale * panel_moments(panel, own.poissons_ratio)):
            if k < spokes or not 0 <= plates.angle[place] < clamps:
                out[place] = moment
                place += 1
                continue
            out[place : place + 2] = moment * np.array(next(by_weld))  # see `edge_plates`
            place += 2
    return out


def free_angles(plates: EdgePlates, moment: NDArray) -> NDArray:
    """Angles (nq,), rad, at which plates under moments (nq,), N m, have no stress."""
    out = np.zeros(len(moment))
    for p, (start, end) in enumerate(pairwise(plates.start)):
        if np.any(moment[start:end]):
            stiffness = plates.stiffness[plates.entry[p] : plates.entry[p + 1]]
            square = stiffness.reshape(end - start, end - start)
            out[start:end] = np.linalg.pinv(square, hermitian=True) @ moment[start:end]
    return out


def outlines(
    nodes: NDArray, centers: NDArray, hinges: NDArray, pattern: Pattern, sheet: Sheet,
    straight_edges: Collection[topology.Edge] = (), rigid: Collection[int] = (),
    clamped: Collection[topology.Edge] = (),
) -> list[Outline | None]:  # fmt: skip
    """Outline of each panel; None for rigid panels. Welds count as creases that may bow.

    See `straight_creases` and `edge_plates` for the arguments.
    """
    bent = np.concatenate([pattern.creases, pattern.welds])
    straight = set(topology.edge_lookup(bent[straight_creases(nodes, hinges, pattern, sheet)]))
    straight |= {*straight_edges, *clamped}
    hinged, welds = topology.edge_lookup(bent), topology.edge_lookup(pattern.welds)
    found: list[Outline | None] = []
    for p, face in enumerate(pattern.faces):
        if p in rigid:
            found.append(None)
            continue
        edges = [topology.edge_of(a, b) for a, b in topology.around(face)]
        found.append(
            outline(
                pattern.vertices[list(face)],
                nodes[centers[p]] if centers[p] >= 0 else None,
                [edge in hinged or edge in clamped for edge in edges],
                [edge in straight for edge in edges],
                [edge in welds and edge not in straight for edge in edges],
                [edge in clamped for edge in edges],
            )
        )
    return found


def straight_creases(nodes: NDArray, hinges: NDArray, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Mask (nf + nw,) of the creases, then welds, that stay straight, from their hinge rows."""
    edges = np.concatenate([pattern.creases, pattern.welds])
    faces = np.concatenate([pattern.crease_faces, pattern.weld_faces])
    thickness = sheet.values("thickness", len(pattern.faces))[faces].max(axis=1)
    slender = thickness / lengths(pattern.vertices, edges)
    straight = np.abs(np.sin(hinge_angles(nodes, hinges))) > STRAIGHT * slender
    line = topology.Lines.of(edges).number  # junctions are several creases
    return np.bincount(line, straight)[line] > 0.0


def plates_model(
    nodes: NDArray, bars: NDArray, bar_stiffness: NDArray, bar_law: BarLaw, folds: NDArray,
    fold_stiffness: NDArray, fold_rest: NDArray, fold_law: HingeLaw, bends: NDArray,
    bend_rest: NDArray, plates: EdgePlates, clamps: NDArray, by_folds: bool,
) -> BarsPlates:  # fmt: skip
    """Model arrays: bars with the stiffness E A / L, folds, and the result of `edge_plates`.

    clamps : (c, 3) nodes of the triangles at clamped edges.
    by_folds : whether the dofs beside a fold are those of explicit methods.
    """

    def called_by(law: HingeLaw, rows: Any) -> NDArray[np.int64]:
        numbers = np.array([law.code, *(law.addresses or (0, 0, 0))], np.int64)
        return np.repeat(numbers[:, None], len(fold_rest[rows]), axis=1)

    called = fold_law.each(called_by)
    return BarsPlates(
        bars=mechanics.build(nodes, bars, bar_stiffness, bar_law, ()),
        rotations=len(plates.rotation_hinge),
        per_reach=1.0 / float(np.sqrt((lengths(nodes, bars) ** 2).mean())) if len(bars) else 1.0,
        hinges=np.concatenate([folds, bends, clamps[:, [0, 1, 2, 0]]]).astype(np.int64),
        wings=clamp_points(nodes, clamps)[:, 3] - nodes[clamps[:, :2]].mean(axis=1),
        unmoved=hinge_angles(nodes, folds) if by_folds else np.zeros(0),
        fold_stiffness=np.array(fold_stiffness, float),
        fold_rest=np.array(fold_rest, float),
        fold_parameters=fold_law.parameters(fold_rest).reshape(-1, 4),
        code=called[0].copy(),
        addresses=np.ascontiguousarray(called[1:].T),
        bend_rest=np.append(bend_rest, np.full(len(clamps), np.pi)),
        **plates._asdict(),
    )


def clamps_model(nodes: NDArray, clamps: NDArray, stiffness: NDArray) -> BarsPlates:
    """Clamped edges (c, 3) alone, as plates of one angle each with the given stiffness (c,)."""
    none, number = np.zeros((0, 4), np.int64), np.arange(len(clamps) + 1)
    entries = np.array(stiffness)  # writable, for which the kernels of plates are compiled
    ways = np.zeros((0, 2))
    plates = EdgePlates(none[:, 0], none[:, :2], ways, number, number[:-1], number, entries)
    model = plates_model(
        nodes, none[:, :2], np.zeros(0), LinearBar(), none, np.zeros(0), np.zeros(0), LinearHinge(),
        none, np.zeros(0), plates, clamps, False,
    )  # fmt: skip
    return model._replace(bars=model.bars._replace(bar_runs=model.bars.bar_runs[:0]))


def spoke_stiffness(plates: EdgePlates, folds: int, bends: int) -> NDArray:
    """Stiffness (nb,), N m/rad, of each bend while the panel's other angles are fixed."""
    out = np.zeros(bends)
    for p, first in enumerate(plates.start[:-1]):
        count = plates.start[p + 1] - first
        own = plates.angle[first : first + count]
        diagonal = plates.stiffness[plates.entry[p] : plates.entry[p + 1]][:: count + 1]
        out[own[own >= 0] - folds] += diagonal[own >= 0]
    return out
