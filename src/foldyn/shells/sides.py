"""Triangles by their sides: stiffness, and the hinges and rotations by which they meet.

A triangle has constant strains, from the lengths of its sides, and constant curvatures, from
rotations about them. With the unit tangents t_k and outward normals n_k of the sides (in the plane
of the triangle), their lengths L_k and the area A:

membrane   t_k . eps t_k = e_k,  e_k = (l_k^2 / L_k^2 - 1) / 2 the Green strain along side k,
bending    kappa = sum_k (L_k / A) beta_k n_k n_k^T,  beta_k the rotation, about side k, of the
           sheet at the middle of that side against the plane of the triangle

(Morley, Aeronaut. Quart. 19, 1968; for large rotations with hinges: Phaal and Calladine, Int. J.
Numer. Methods Eng. 35, 1992). Plane stress with E, nu, t gives energies e K_m e / 2 and
beta K_b beta / 2.

On a side shared by two triangles of one panel, and along a weld of two panels, the sheet is smooth:
with d the change of the dihedral there, one side turns by d/2 + x and the other by d/2 - x, x a
rotation without mass. On a crease each side has a rotation of its own, and the crease turns by what
is left of the dihedral, d - x - y. Free sides have no moment: their rotation is eliminated in the
triangle. A clamped side keeps its rest tangent in space: its hinge has a wing that is no node and
rides on the mean displacement of the side's ends. The sides of rigid panels, which stay flat, have
no rotations.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.triangle import triangle_stiffness
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, edge_lookup, edge_of
from foldyn.shells.mesh import ShellMesh
from foldyn.structures import Sheet
from foldyn.structures.clamps import opposite
from foldyn.structures.edge_angles import EdgePlates


class Sides(NamedTuple):
    """nt triangles with nh hinges, x rotations, c pieces of creases and g wings of clamped sides.

    Side k of a triangle runs from its corner k to k + 1; its rotation is
    beta = weight d[hinge] + sign x[rotation], where there is a hinge or a rotation (else -1).
    """

    hinges: NDArray  # (nh, 4) axis j, k, wings i, l; first of the pieces of creases, last of the
    # clamped sides, whose nodes from n on are wings that ride
    hinge: NDArray  # (nt, 3)
    weight: NDArray  # (nt, 3)
    rotation: NDArray  # (nt, 3)
    sign: NDArray  # (nt, 3)
    free: NDArray  # (nt, 3) bool
    rotations: int
    piece_rotations: NDArray  # (c, 2) -1 where there is none
    piece_crease: NDArray  # (c,) number of the pattern's crease
    wings: NDArray  # (g, 3) m


def sides(
    mesh: ShellMesh, pattern: Pattern, clamped: Collection[Edge] = (), rigid: Collection[int] = ()
) -> Sides:
    """Find hinges and rotations of a mesh.

    clamped : boundary edges (low, high).
    rigid : numbers of rigid panels.
    """
    crease_of = {
        pair: number
        for edge, number in edge_lookup(pattern.creases).items()
        for pair in _pieces(mesh.edge_points[edge])
    }
    held = {pair for edge in clamped for pair in _pieces(mesh.edge_points[edge])}
    tri = mesh.triangles
    n, count = len(mesh.nodes), len(tri)
    a, b, third = tri.ravel(), np.roll(tri, -1, 1).ravel(), np.roll(tri, -2, 1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort((a > b, high, low))  # the triangle that runs low to high comes first
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    one, two = order[:-1][same], order[1:][same]
    alone = np.setdiff1d(np.arange(3 * count), np.concatenate([one, two]))

    folded = mesh.panel[one // 3] != mesh.panel[two // 3]
    between = zip(low[one[folded]].tolist(), high[one[folded]].tolist(), strict=True)
    folded[folded] = [pair in crease_of for pair in between]
    first = np.argsort(~folded, kind="stable")  # pieces of creases come first
    one, two, folded = one[first], two[first], folded[first]
    hinges = [np.stack([low[one], high[one], third[one], third[two]], axis=1)]
    hinge, rotation = np.full((2, 3 * count), -1)
    weight, sign = np.zeros((2, 3 * count))
    numbers, smooth = np.arange(len(one)), ~folded
    for side, turn in ((one, 1.0), (two, -1.0)):
        hinge[side[smooth]], weight[side[smooth]] = numbers[smooth], 0.5
        sign[side] = turn
    rotation[one[smooth]] = rotation[two[smooth]] = np.arange(smooth.sum())
    pieces = smooth.sum() + np.arange(2 * folded.sum()).reshape(-1, 2)
    rotation[one[folded]], rotation[two[folded]] = pieces.T
    sign[one[folded]] = sign[two[folded]] = 1.0

    stiff = [k for k in alone.tolist() if (int(low[k]), int(high[k])) in held]
    wings = []
    for k in stiff:
        hinge[k], weight[k] = len(numbers) + len(wings), 1.0
        row = (a[k], b[k], third[k], n + len(wings))
        hinges.append(np.array([row]))
        wings.append(opposite(mesh.nodes[[a[k], b[k], third[k]]]))
    free = np.zeros(3 * count, bool)
    free[alone] = True
    free[stiff] = False
    rotation, pieces, rotations = _without(
        np.isin(mesh.panel, list(rigid)), rotation, pieces, int(smooth.sum() + 2 * folded.sum())
    )
    sign[rotation < 0] = 0.0
    pairs = zip(low[one[folded]].tolist(), high[one[folded]].tolist(), strict=True)
    return Sides(
        hinges=np.concatenate(hinges).astype(np.int64),
        hinge=hinge.reshape(-1, 3),
        weight=weight.reshape(-1, 3),
        rotation=rotation.reshape(-1, 3),
        sign=sign.reshape(-1, 3),
        free=free.reshape(-1, 3),
        rotations=rotations,
        piece_rotations=pieces,
        piece_crease=np.array([crease_of[pair] for pair in pairs], np.int64),
        wings=np.array(wings).reshape(-1, 3),
    )


def _without(
    rigid: NDArray, rotation: NDArray, pieces: NDArray, count: int
) -> tuple[NDArray, NDArray, int]:
    """Rotations (3 nt,) and those of creases (c, 2) without those of rigid triangles (nt,)."""
    kept = np.ones(count + 1, bool)  # the last entry stands for none
    kept[rotation[np.repeat(rigid, 3)]] = False
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    number[-1] = -1
    return number[rotation], number[pieces], int(kept[:-1].sum())


def _pieces(points: list[int]) -> list[Edge]:
    """Pairs (low, high) of neighbors along an edge."""
    return [edge_of(a, b) for a, b in pairwise(points)]


def stiffness(corners: NDArray, panel: NDArray, sheet: Sheet) -> tuple[NDArray, NDArray]:
    """Membrane and bending stiffness (nt, 3, 3) of triangles (nt, 3, 3), each in a panel (nt,)."""
    kinds, kind = sheet.kinds(int(panel.max()) + 1)
    membrane, bending = np.empty((2, len(corners), 3, 3))
    for number, own in enumerate(kinds):
        rows, nu = kind[panel] == number, own.poissons_ratio
        stretching = own.youngs_modulus * own.thickness / (1.0 - nu**2)
        membrane[rows], bending[rows] = triangle_stiffness(
            corners[rows], nu, stretching, own.bending_modulus
        )
    return membrane, bending


def triangle_plates(ends: Sides, bending: NDArray) -> tuple[EdgePlates, NDArray, NDArray]:
    """Triangles as plates, with the stiffness `bending` (nt, 3, 3) of rotations of their sides.

    And of each angle (nq,) the side that it turns, 3 t + k of triangle t, and how far in a turn of
    one.
    """
    size = (len(bending), 6)
    angle = np.stack([ends.hinge, -1 - ends.rotation], axis=2).reshape(size)
    share = np.stack([ends.weight, ends.sign], axis=2).reshape(size)
    there, side = share != 0.0, np.repeat(np.arange(3), 2)
    whole = share[:, :, None] * bending[:, side][:, :, side] * share[:, None]
    count = there.sum(axis=1)
    at = np.zeros(ends.rotations, np.int64)
    smooth = (ends.hinge >= 0) & (ends.rotation >= 0)
    at[ends.rotation[smooth]] = ends.hinge[smooth]
    piece, beside = np.nonzero(ends.piece_rotations >= 0)
    at[ends.piece_rotations[piece, beside]] = piece
    plates = EdgePlates(
        rotation_hinge=at,
        fold_rotations=ends.piece_rotations,
        start=np.concatenate([[0], np.cumsum(count)]),
        angle=angle[there],
        entry=np.concatenate([[0], np.cumsum(count**2)]),
        stiffness=whole[there[:, :, None] & there[:, None]],
    )
    return plates, (3 * np.arange(len(bending))[:, None] + side)[there], share[there]


def without_free_sides(bending: NDArray, free: NDArray) -> NDArray:
    """Bending stiffness (nt, 3, 3) without moment about the sides `free` (nt, 3)."""
    out = bending.copy()
    for k in range(3):
        rows = np.flatnonzero(free[:, k])
        part = out[rows]
        column = part[:, :, k]
        pivot = np.where(column[:, k] > 0.0, column[:, k], 1.0)
        part = part - np.einsum("ti,tj->tij", column, column) / pivot[:, None, None]
        part[:, k, :] = part[:, :, k] = 0.0
        out[rows] = part
    return out
