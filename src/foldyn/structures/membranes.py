"""Panels with coupled bars, so that their corners have the panel's membrane stiffness.

Independent bars that are exact in uniform strain are too stiff in other states: between its
corners, a panel of a folded sheet is up to six times softer (`structures.panel_membrane`). With B
the matrix of bar elongations for displacements in the panel's plane, and K the membrane stiffness
at the corners,

    S = B+^T K B+ + N (N^T k^-1 N)^-1 N^T,

with B+ the pseudoinverse of B. N spans the elongations that no in-plane displacement causes, which
occur in a panel that is no longer flat: only bars of stiffness k resist them. These bars also hold
the center, which the membrane leaves free, at the position that the corners imply.

Corners give way along edges, like the logarithm of L/t: with `giving` panels,
displacements near each end of an edge of length L gain

    g [1 - s/L - log(2 s/L) / log(2 t/L)],

with s the distance from that end, for s between the thickness t and L/2; within t displacements are
constant. Stresses around a force at a corner fall as 1/s. Panels share the amplitudes g of the edge
between them, its *gives*. Near a vertex where the sheet is smooth
(`graded.smooth_vertices`) the gain is g (s/L) (1 - s/L)^2, and the corner is not rigid.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.algebra.superlu import SingularTangentError
from foldyn.mechanics.block_matrix import of_elements
from foldyn.mechanics.following import Following, tensions
from foldyn.mechanics.membranes import Membranes
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around, edge_lookup, edge_of, edge_rows
from foldyn.structures.graded import smooth_vertices
from foldyn.structures.mesh import Mesh, hinge_angles, too_narrow
from foldyn.structures.panel_membrane import Kind, grading_of, membrane_stiffness
from foldyn.structures.panel_plate import Outline, outline
from foldyn.structures.sheet import Sheet

NONE = np.zeros(0, bool)
ROUNDING = 1e-13  # singular values smaller than this, relative to the largest, count as 0
STRAIGHT = 100.0  # resistance, divided by E t and the area, above which edges are straight


class PanelKind(NamedTuple):
    """Panels of one kind, and their membranes."""

    panels: NDArray  # (p,) panel of each membrane; a shell has a membrane per triangle
    membranes: Membranes


class Sides(NamedTuple):
    """A panel's edges: which are straight, and the resistance of the other edges to bowing."""

    outline: Outline
    resistance: tuple[float, ...]
    convex: bool = True  # a panel that is not convex has independent bars


def membranes(
    mesh: Mesh, pattern: Pattern, sheet: Sheet, straight: Collection[Edge], rigid: Collection[int],
    giving: bool, guided: Mapping[Edge, NDArray],
) -> tuple[tuple[PanelKind, ...], NDArray]:  # fmt: skip
    """Membranes of all panels, and the edges (g, 2) of the gives, by number.

    Parameters
    ----------
    mesh, pattern, sheet
    straight : boundary edges that neither bow nor give way; edges between coplanar panels do not
    bow.
    rigid : panels that do not bend.
    giving : whether other edges give way; never for panels that do not bend or are not convex.
    guided : directions in which boundary edges can bow; see `structures.held_edges`.
    """
    kinds: dict[tuple, list[tuple[int, NDArray, NDArray, NDArray]]] = {}
    sides, stiff = _sides(mesh, pattern, sheet, straight, rigid, guided), set(rigid)
    gives = [giving and own.convex and p not in stiff for p, own in enumerate(sides)]
    numbers = _numbers(pattern, gives)
    loose = {edge_of(a, b) for a, b in pattern.boundary.tolist()} - set(straight)
    properties, kind = sheet.kinds(len(pattern.faces))
    first = np.searchsorted(mesh.inner_panel, np.arange(len(pattern.faces) + 1))
    smooth = smooth_vertices(pattern)
    known = {
        p: _known(own, properties[kind[p]], pattern.face_areas[p], gives[p], smooth[[*face]])
        for p, (face, own) in enumerate(zip(pattern.faces, sides, strict=True))
        if own.convex
    }
    try:
        found = dict(zip(known, membrane_stiffness.each([*known.values()]), strict=True))
    except SingularTangentError as error:
        raise too_narrow(pattern) from error
    for p, (face, panel) in enumerate(zip(pattern.faces, sides, strict=True)):
        hub = mesh.centers[p]
        nodes = np.array([*face, hub] if hub >= 0 else face)
        inner = mesh.inner[first[p] : first[p + 1]]
        place = {int(node): k for k, node in enumerate(nodes)}
        ring = [(k, (k + 1) % len(face)) for k in range(len(face))]
        ends = (*ring, *((place[a], place[b]) for a, b in inner.tolist()))
        own = properties[kind[p]]
        own_ends = [(edge_of(a, b), end) for a, b in around(face) for end in (a, b)]
        number = np.array([numbers.get(end, -1) for end in own_ends])
        shared, free = number >= 0, np.array([edge in loose for edge, _ in own_ends])
        part = coupling(panel, ends, own.poissons_ratio, found.get(p), shared, free)
        part *= own.youngs_modulus * own.thickness
        alike = len(nodes), ends, int(shared.sum())
        kinds.setdefault(alike, []).append((p, nodes, number[shared], part))
    edges = np.array([edge for edge, _ in numbers], np.int64).reshape(-1, 2)
    parted = [(np.array(ends), zip(*own, strict=True)) for (_, ends, _), own in kinds.items()]
    return tuple(_packed(mesh.nodes, ends, *columns) for ends, columns in parted), edges


def _known(panel: Sides, sheet: Sheet, area: float, gives: bool, smooth: NDArray) -> Kind:
    """Data that determine the membrane of a panel."""
    radius = sheet.thickness / float(np.sqrt(2.0 * area))  # an outline's area is 1/2
    grading = grading_of(panel.outline, radius) if gives else None
    there = tuple(smooth.tolist()) if gives and smooth.any() else ()
    return Kind(panel.outline, sheet.poissons_ratio, panel.resistance, grading, there)


def _numbers(pattern: Pattern, gives: Sequence[bool]) -> dict[tuple[Edge, int], int]:
    """Indices of the gives of edges between two panels, by edge and vertex."""
    beside: dict[Edge, list[bool]] = {}
    for face, own in zip(pattern.faces, gives, strict=True):
        for edge in (edge_of(a, b) for a, b in around(face)):
            beside.setdefault(edge, []).append(own)
    edges = [edge for edge, own in beside.items() if len(own) > 1 and all(own)]
    return {(edge, end): 2 * k + j for k, edge in enumerate(edges) for j, end in enumerate(edge)}


def _sides(
    mesh: Mesh, pattern: Pattern, sheet: Sheet, straight: Collection[Edge], rigid: Collection[int],
    guided: Mapping[Edge, NDArray],
) -> list[Sides]:  # fmt: skip
    """Sides of each panel."""
    bent = edge_rows(pattern.creases)
    welded, stiff = set(edge_lookup(pattern.welds)) | set(straight), set(rigid)
    turn = np.pi - hinge_angles(mesh.nodes, mesh.folds)
    modulus, nu, thickness, youngs = (
        sheet.values(name, len(pattern.faces))
        for name in ("bending_modulus", "poissons_ratio", "thickness", "youngs_modulus")
    )
    edge_modulus = 0.5 * modulus * (1.0 - nu) * (3.0 + nu)
    found = []
    for p, face in enumerate(pattern.faces):
        edges = [edge_of(a, b) for a, b in around(face)]
        held, resistance = [edge in welded for edge in edges], [0.0] * len(edges)
        for k, edge in enumerate(edges):
            if held[k] or (edge not in bent and edge not in guided):
                continue
            area = float(pattern.face_areas[p])
            unit = youngs[p] * thickness[p] * 2.0 * area  # an outline's area is 1/2
            if edge in guided:
                cosine = float(guided[edge] @ pattern.face_normals[p])
                beside = [(p, np.sqrt(1.0 - cosine**2), cosine**2 * edge_modulus[p])]
            else:
                beside = []
                for crease in bent[edge]:  # several at a junction
                    if p in (both := pattern.crease_faces[crease]):
                        other, cosine = int(both.sum()) - p, np.cos(turn[crease])
                        own = edge_modulus[other] + cosine**2 * edge_modulus[p]
                        beside.append((other, np.sin(turn[crease]), own))
            for other, sine, both in beside:
                held[k] |= bool(both / unit > STRAIGHT * sine**2)
                held[k] |= not stiff.isdisjoint((p, other))
            if not held[k]:
                total = sum(both / unit / sine**2 for _, sine, both in beside)
                resistance[k] = float(f"{total:.10g}")
        x = pattern.vertices[list(face)]
        center = x.mean(axis=0) if len(face) > 3 else None
        if mesh.centers[p] >= 0:
            center = mesh.nodes[mesh.centers[p]]
        panel = outline(x, center, [False] * len(face), held)
        corners = np.array(panel.corners)
        spokes = corners - (panel.center or corners.mean(axis=0))
        turns = np.linalg.det(np.stack([spokes, np.roll(spokes, -1, axis=0)], axis=1))
        found.append(Sides(panel, tuple(resistance), bool(turns.min() > 0.0)))
    return found


def coupling(
    sides: Sides, ends: tuple[tuple[int, int], ...], poissons_ratio: float,
    stiff: NDArray | None = None, shared: NDArray = NONE, free: NDArray = NONE,
) -> NDArray:  # fmt: skip
    """Stiffness, divided by E t, for bar elongations (b,) between corners and center, and gives.

    stiff : stiffness of a convex panel; by default without gives.
    shared, free : (2m,) masks of the k gives that are kept, and of the gives that follow; other
        gives are absent. The result is (b + k, b + k).
    """
    panel = sides.outline
    bars, corners = np.array(ends), 2 * len(panel.corners)
    x = np.array([*panel.corners, *([panel.center] if panel.center else [])])[: bars.max() + 1]
    along = x[bars[:, 1]] - x[bars[:, 0]]
    length = np.linalg.norm(along, axis=1)
    longer = np.zeros((len(bars), len(x), 2))
    longer[np.arange(len(bars)), bars[:, 1]] = along / length[:, None]
    longer[np.arange(len(bars)), bars[:, 0]] = -along / length[:, None]
    longer = longer.reshape(len(bars), -1)
    alone = 1.0 / ((1.0 - poissons_ratio) * length.sum() * length)  # an outline's area is 1/2
    if not sides.convex:
        return np.diag(alone)
    if stiff is None:
        stiff = membrane_stiffness(panel, poissons_ratio, sides.resistance)
    if len(stiff) > corners:
        kept = np.concatenate([np.arange(corners), corners + np.flatnonzero(shared)])
        follow = corners + np.flatnonzero(free)
        across, own = stiff[np.ix_(follow, kept)], stiff[np.ix_(follow, follow)]
        stiff = stiff[np.ix_(kept, kept)] - across.T @ np.linalg.solve(own, across)
    whole = np.zeros((x.size, x.size))
    whole[:corners, :corners] = stiff[:corners, :corners]
    held = longer.T @ (alone[:, None] * longer)
    center = held[corners:, corners:]
    off = np.column_stack([np.linalg.solve(center, held[corners:, :corners]), np.eye(len(center))])
    whole += off.T @ center @ off
    left, size, right = np.linalg.svd(longer)
    rank = int((size > ROUNDING * size[0]).sum())
    back, curved = (right[:rank].T / size[:rank]) @ left[:, :rank].T, left[:, rank:]
    soft = curved.T @ (curved / alone[:, None])
    across = back[:corners].T @ stiff[:corners, corners:]
    between = back.T @ whole @ back + curved @ np.linalg.solve(soft, curved.T)
    return np.block([[between, across], [across.T, stiff[corners:, corners:]]])


def energies(
    kinds: Sequence[PanelKind], rest: NDArray, u: NDArray, panels: int,
    free: NDArray | None = None,
) -> NDArray:  # fmt: skip
    """Energy (samples, panels), J, of the membranes at displacements u (samples, n, 3), m.

    free : (samples, k) free strains of the bars of all panels in turn, as `swelling` returns them.
    """
    x, out, first, strains = rest + u, np.zeros((len(u), panels)), 0, []
    for _, own in kinds:
        start, end = (x[:, own.nodes[:, place]] for place in own.ends.T)
        square = np.einsum("spbc,spbc->bsp", end - start, end - start)
        strain = 0.5 * (square * own.per_length2[:, None] - 1.0)
        if free is not None:
            bars, samples, count = strain.shape
            end = first + bars * count
            own_free, first = free[:, first:end].reshape(samples, bars, count), end
            strain -= own_free.transpose(1, 0, 2)
        strains.append(strain)
    for (which, own), strain in zip(kinds, with_gives(kinds, strains), strict=True):
        energy = 0.5 * np.einsum("isp,ijp,jsp->sp", strain, own.stiffness, strain)
        np.add.at(out.T, which, energy.T)
    return out


def with_gives(kinds: Sequence[PanelKind], strains: Sequence[NDArray]) -> list[NDArray]:
    """Strains (b, samples, p) of each kind, followed by the gives (k, samples, p) in balance."""
    count = 1 + max((int(own.gives.max(initial=-1)) for _, own in kinds), default=-1)
    if not count:
        return list(strains)
    stiffness = sparse.csc_array((count, count))
    pull = np.zeros((count, strains[0].shape[1]))
    for (_, own), strain in zip(kinds, strains, strict=True):
        bars = len(strain)
        np.add.at(pull, own.gives.T, np.einsum("bkp,bsp->kps", own.stiffness[:bars, bars:], strain))
        alone = own.stiffness[bars:, bars:].transpose(2, 0, 1)
        stiffness = stiffness + of_elements(own.gives, alone, count)
    g = -np.reshape(splu(sparse.csc_array(stiffness)).solve(pull), pull.shape)
    return [
        np.concatenate([strain, g[own.gives.T].swapaxes(1, 2)])
        for (_, own), strain in zip(kinds, strains, strict=True)
    ]


def swelling(
    kinds: Sequence[PanelKind], x: NDArray, strain: NDArray
) -> tuple[list[Following], NDArray, NDArray]:
    """Forces of panels that would stretch by tensors `strain` (np, 3, 3) if they were free.

    Gives are measured from the swollen positions. Returns the free strains (k,) and the forces
    conjugate to them, J, for the bars of all panels in turn.

    x : (n, 3) rest positions of the nodes, m.
    """
    green, parts, pushes = strain + 0.5 * strain @ strain, [], []
    strains = []
    for which, own in kinds:
        stretch = np.einsum("bip,pij,bjp->bp", own.vector, green[which], own.vector)
        strains.append((stretch * own.per_length2)[:, None])
    for (_, own), both in zip(kinds, with_gives(kinds, strains), strict=True):
        push = np.einsum("ijp,jp->ip", own.stiffness[: len(own.ends)], both[:, 0])
        pushes.append(push.ravel())
        bars = own.nodes[:, own.ends].transpose(1, 0, 2).reshape(-1, 2)
        parts.append(tensions(x, bars, (-push * own.per_length2).ravel()))
    return parts, np.concatenate([own.ravel() for own in strains]), np.concatenate(pushes)


def _packed(
    x: NDArray, ends: NDArray, panels: tuple, nodes: tuple, gives: tuple, coupled: tuple
) -> PanelKind:
    """Panels of one kind with nodes (c,), gives (k,), and stiffness (b + k, b + k), N/m."""
    numbers = np.array(nodes, np.int64)
    vector = x[numbers[:, ends[:, 1]]] - x[numbers[:, ends[:, 0]]]
    length = np.linalg.norm(vector, axis=2)
    scale = np.pad(length, ((0, 0), (0, len(gives[0]))), constant_values=1.0)
    stiffness = np.array(coupled) * scale[:, :, None] * scale[:, None, :]
    stiffness = 0.5 * (stiffness + stiffness.swapaxes(1, 2))
    own = Membranes(
        nodes=numbers,
        ends=ends,
        gives=np.array(gives, np.int64).reshape(len(gives), -1),
        vector=np.ascontiguousarray(vector.transpose(1, 2, 0)),
        per_length2=np.ascontiguousarray(1.0 / length.T**2),
        stiffness=np.ascontiguousarray(stiffness.transpose(1, 2, 0)),
    )
    return PanelKind(np.array(panels), own)
