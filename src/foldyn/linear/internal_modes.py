"""Internal amplitudes of panels, in small vibrations about a state (scheme n5b8e).

Each panel moves out of plane as in `structures.panel_modes`, with the mass of the plate in place of
the mass rule "condensed":

    M = sum over panels of (1 - n n') x R + n n' x F,    R from the rule, F from the plate,

with n the normal of the panel in the state. F also couples the heights of the panel's nodes with
the amplitudes and with the turns of creased edges, which thereby get mass. Amplitudes are numbered
after the m dofs of the body. Only creases couple amplitudes and dofs by stiffness: a crease of
length L that turns by theta_k P_k along it, k = 1, 2, ..., adds

    1/2 (stiffness per length) L / (2 k + 1) theta_k^2,    theta_k the sum of both edges' turns,

and is damped in the same way. The effect of stresses in a panel on its amplitudes is neglected.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import block_diag

from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly
from foldyn.structures import Structure
from foldyn.structures.bars_plates import BarsPlatesTerm
from foldyn.structures.discretized import Discretized
from foldyn.structures.mass import condensed_panels
from foldyn.structures.panel_modes import TURNS, panel_modes
from foldyn.structures.panel_plate import TRIANGLE_MASS
from foldyn.values import show, whole

MOST = 6  # most amplitudes of a panel: higher shapes of the meshes are less accurate


class Amplitudes(NamedTuple):
    """Contributions of k amplitudes, numbered after m dofs, to the matrices of a case.

    Attributes
    ----------
    stiffness : (m + k, m + k)
        Stiffness of the amplitudes, and of creases that turn unevenly, to be added, N/m.
    mass : (m + k, m + k)
        Mass to add to the mass of the nodes, kg.
    points : (q, 3)
        Midpoints of the edges and spokes of all panels in turn, at rest, m.
    between : (3 q, m + k)
        Displacements of `points` per unit of each dof.
    turns : (r, m + k)
        Amplitudes of the uneven turns P_k along the creases, 1/m.
    fold, share : (r,)
        Fold of each uneven turn, and the mean square of P_k, which is the fraction of the fold's
        stiffness and damping that resists the turn.
    count : int
        Number k of amplitudes.
    """

    stiffness: sparse.csr_array
    mass: sparse.csr_array
    points: NDArray
    between: sparse.csr_array
    turns: sparse.csr_array
    fold: NDArray
    share: NDArray
    count: int

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Dof numbers (k,) of the amplitudes."""
        size = self.mass.shape[0]
        return np.arange(size - self.count, size)

    def behind(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A matrix (m, m) with zero rows and columns added for the amplitudes."""
        if not self.count:
            return matrix
        none = sparse.csr_array((self.count, self.count))
        return sparse.csr_array(sparse.block_diag([matrix, none], format="csr"))

    def stiffened(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A stiffness (m, m), N/m, extended by the stiffness of the amplitudes."""
        return sparse.csr_array(self.behind(matrix) + self.stiffness) if self.count else matrix

    def damped(self, matrix: sparse.csr_array, damping: NDArray) -> sparse.csr_array:
        """A damping (m + k, m + k), N s/m, plus `damping` (nf,), N m s/rad, of uneven turns."""
        uneven = self.turns.T @ (self.turns * (damping[self.fold] * self.share)[:, None])
        return sparse.csr_array(matrix + uneven)

    def massed(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """A mass (m, m), kg, extended by the mass of the amplitudes."""
        return sparse.csr_array(self.behind(matrix) + self.mass) if self.count else matrix


def check_internal(structure: Discretized, internal: Any) -> int:
    """Return the checked number of internal amplitudes of each panel of a structure.

    Raises
    ------
    InputError
        Not a number from 0 to 6; a structure that has no amplitudes, for example because of welds.
    """
    count = whole("internal", internal, least=0, most=MOST, what="amplitudes of a panel")
    if not count:
        return 0
    if not isinstance(structure, Structure) or structure.edge_plates is None:
        raise InputError(
            f" = {count}: internal amplitudes need panels that bend as plates (scheme n5b8e); "
            'discretize with preset = "n5b8e", or leave it out',
            "internal",
        )
    if structure.pattern is not None and len(structure.pattern.welds):
        raise InputError(
            f" = {count}: internal amplitudes describe panels between creases, and the pattern has "
            f"welds ({len(structure.pattern.welds)}); leave it out, or take a shell",
            "internal",
        )
    if structure.node_mass is not None or structure.options.mass != "condensed":
        rule = "given by nodes" if structure.node_mass is not None else show(structure.options.mass)
        raise InputError(
            f" = {count}: internal amplitudes come with the mass of the plate, and the mass is "
            f'{rule}; take mass = "condensed", or leave it out',
            "internal",
        )
    return count


def amplitudes(structure: Discretized, body: Assembly, q: NDArray, count: int) -> Amplitudes:
    """Internal amplitudes of a structure, if any, in the state q (m,).

    Parameters
    ----------
    structure : Structure
        Structure of the scheme n5b8e and the mass rule condensed.
    body : Assembly
        The body of the structure, or a body with other rest angles and more terms.
    count : int
        Amplitudes of each panel, in addition to one for each edge without a crease. A panel gets
        one more if symmetry would make the last one and the next equal.
    """
    size = body.size
    if not count:
        none, rows = _matrix([], size, size), _matrix([], 0, size)
        whose, share = np.zeros(0, np.int64), np.zeros(0)
        return Amplitudes(none, none, np.zeros((0, 3)), rows, rows, whose, share, 0)
    displacement = q[: structure.nodes.size].reshape(-1, 3)
    assert isinstance(structure, Structure)
    plates, surface, sheet = structure.edge_plates, structure.surface, structure.sheet
    assert plates is not None
    assert isinstance(body.sheet, BarsPlatesTerm)
    kinds, kind = sheet.kinds(len(surface.faces))
    rule, total = condensed_panels(surface), surface.panel_mass
    angles, slope = body.sheet.turns(q)
    beside, side = _sides(body.sheet.model.fold_rotations)
    order = np.arange(1, TURNS + 1)
    stiffness, masses, between, uneven = [], [], [], []
    first, points = size, [np.zeros((0, 3))]
    for p, panel in enumerate(structure.outlines):
        if panel is None:
            continue
        own, corners = kinds[kind[p]], list(surface.faces[p])
        modes = panel_modes(panel, own.poissons_ratio, count + panel.creased.count(False))
        length2 = float(np.linalg.norm(_double_area(structure.nodes[corners])))  # an outline's is 1
        normal = _double_area(structure.nodes[corners] + displacement[corners])
        normal = normal / np.linalg.norm(normal)
        nodes = np.array(surface.nodes_of(p))
        rows = slice(plates.start[p], plates.start[p + 1])
        edges = -1 - plates.angle[rows][plates.angle[rows] < 0]
        turns = structure.nodes.size + edges
        inner = np.arange(first, first + len(modes.stiffness))
        first += len(inner)
        # heights of nodes, turns of edges, and amplitudes, as functions of the dofs
        height = np.kron(np.eye(len(nodes)), normal)
        turned = np.sqrt(length2) * body.sheet.per_hidden * np.eye(len(turns))
        by = block_diag(height, turned, np.eye(len(inner)))
        mass = total[p] * modes.mass
        mass[: len(nodes), : len(nodes)] -= rule.get(p, total[p] * TRIANGLE_MASS)
        dofs = np.concatenate([(3 * nodes[:, None] + np.arange(3)).ravel(), turns, inner])
        masses.append(_entries(dofs, dofs, by.T @ mass @ by))
        stiff = own.bending_modulus / length2 * modes.stiffness
        stiffness.append(_entries(inner, inner, stiff))
        # the two panels at an edge run along it from opposite ends
        own_turns = modes.turns @ angles[rows][:, dofs[: -len(inner)]].toarray()
        more = np.eye(len(own_turns), len(inner)) / np.sqrt(length2)
        sign = np.where(side[edges, None], (-1.0) ** order, 1.0).ravel()
        row = (TURNS * beside[edges, None] + order - 1).ravel()
        uneven.append(_entries(row, dofs, sign[:, None] * np.column_stack([own_turns, more])))
        ends = _ends(nodes, len(corners))
        along = np.kron(0.5 * ends, np.eye(3) - np.outer(normal, normal))
        across = np.kron(modes.between @ by, normal[:, None])
        across[:, : along.shape[1]] += along
        row = 3 * sum(map(len, points)) + np.arange(len(across))
        between.append(_entries(row, dofs, across))
        points.append(0.5 * ends @ structure.nodes[nodes])
    middle, fold = np.concatenate(points), np.repeat(np.arange(len(slope)), TURNS)
    share, turns = np.tile(1.0 / (2 * order + 1), len(slope)), _matrix(uneven, len(fold), first)
    creases = turns.T @ (turns * (slope[fold] * share)[:, None])
    return Amplitudes(
        sparse.csr_array(_matrix(stiffness, first, first) + creases),
        _matrix(masses, first, first),
        middle,
        _matrix(between, middle.size, first),
        turns, fold, share, first - size,
    )  # fmt: skip


def _sides(rotations: NDArray) -> tuple[NDArray, NDArray]:
    """Fold (r,) of each rotation, and its side of the fold (r,), from rotations (nf, 2)."""
    fold, side = np.nonzero(rotations >= 0)
    order = np.argsort(rotations[fold, side])
    return fold[order], side[order]


def _ends(nodes: NDArray, corners: int) -> NDArray:
    """Which nodes are ends of the edges and spokes of a panel: incidence (q, k)."""
    edges = np.eye(corners) + np.roll(np.eye(corners), 1, axis=1)
    if len(nodes) == corners:
        return edges
    spokes = np.column_stack([np.eye(corners), np.ones(corners)])
    return np.concatenate([np.pad(edges, ((0, 0), (0, 1))), spokes])


def _double_area(x: NDArray) -> NDArray:
    """Twice the area vector (3,) of a polygon with corners (k, 3)."""
    arm = x - x.mean(axis=0)
    return np.cross(arm, np.roll(arm, -1, axis=0)).sum(axis=0)


def _entries(rows: NDArray, columns: NDArray, matrix: NDArray) -> NDArray:
    """Values, rows and columns (3, r * c) of a matrix (r, c)."""
    r, c = matrix.shape
    return np.stack([matrix.ravel(), np.repeat(rows, c), np.tile(columns, r)])


def _matrix(entries: list[NDArray], rows: int, columns: int) -> sparse.csr_array:
    """Sum of matrices given by entries."""
    value, row, column = np.concatenate([np.zeros((3, 0)), *entries], axis=1)
    places = (row.astype(np.int64), column.astype(np.int64))
    return sparse.csr_array(sparse.coo_array((value, places), shape=(rows, columns)))
