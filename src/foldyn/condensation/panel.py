"""A panel as a small shell, condensed onto shapes of its edges (Craig and Bampton, AIAA J. 1968).

The unknowns of the mesh are displacements u of its nodes and turns psi of the sheet about the sides
of its triangles. A side of a triangle is rotated relative to the plane of the corners by

    beta = phi - psi,    phi = n . (u_c - (1 - s) u_a - s u_b) / h,

with phi the turn of that plane about the side from a to b, c the third corner, h its height and s
its foot on the side; the triangle across the side has -psi. With the side strains e, the energy is

    1/2 sum over triangles of e' C_m e + beta' C_b beta,

as in `foldyn.shells` for small displacements. Displacements and turns psi on the edges of the panel
are sums of shapes; the inside is in balance, plus vibrations with all edges held. Creases, clamps
and welds, which connect the turns of edges, are not part of a panel.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from foldyn.algebra.superlu import factorize
from foldyn.condensation.shapes import Level, bows, turns
from foldyn.mechanics.block_matrix import of_elements
from foldyn.mechanics.triangle import triangle_stiffness, turned_axes
from foldyn.patterns import Pattern
from foldyn.patterns.topology import around
from foldyn.shells.mesh import shell_mesh, side_between
from foldyn.shells.recovery import forces, recovery, stress_points
from foldyn.shells.shell import STIFF
from foldyn.structures.graded import Grading
from foldyn.structures.panel_plate import TRIANGLE_MASS
from foldyn.structures.sheet import Sheet
from foldyn.structures.swelling import chord_turns

if TYPE_CHECKING:
    from scipy.interpolate import LinearNDInterpolator

VERTEX, BOW, TURN, INNER = range(4)
RIGID = 1e-13  # stiffness of rigid motions, and of shapes that hardly differ, over the largest
LOCKED = 0.1  # most that a coarse mesh is stiffer, relative to a fine one, to be extrapolated
SPARE = 4  # inner modes of a mesh among which those of another mesh are sought


@dataclass(frozen=True, eq=False)
class CondensedPanel:
    """Stiffness and mass of a panel for the amplitudes of its shapes, c of them.

    Attributes
    ----------
    stiffness, mass : (c, c)
        N/m and kg; turns are in rad.
    kind : (c, 3)
        Kind of each shape: (VERTEX, corner, axis), (BOW, 3 edge + axis, number), (TURN, edge,
        number) or (INNER, 0, mode).
    points : (p, 2)
        Points of the panel's plane.
    lifts : (p, c)
        Displacements of these points normal to the plane.
    center : (3, c)
        Displacement of the mean of the corners, in the panel's frame.
    products : (3, 3, c, c)
        Integrals of mass times displacements along two axes of the panel's frame, kg.
    thermal : (c, 4)
        Forces of a panel with a unit free strain xx, yy or twice xy, or a unit free curvature.
    held_energy : (4, 4)
        Twice the energy of such a panel with its edges held, as a quadratic form.
    changes : (2, c, c)
        Changes of stiffness and mass if the panel comes from coarser meshes; 0 of a single mesh.
    resultants : (2, p, 3, c)
        Membrane forces, N/m, and moments, N, at the panel's `stress_points`: xx, yy, xy.
    held_resultants : (2, p, 3, 7)
        The same of a panel with its edges held, under unit forces per area along the three axes of
        its frame, and with a unit free strain or curvature.
    """

    stiffness: NDArray
    mass: NDArray
    kind: NDArray
    points: NDArray
    lifts: NDArray
    center: NDArray
    products: NDArray
    thermal: NDArray
    held_energy: NDArray
    changes: NDArray
    resultants: NDArray
    held_resultants: NDArray

    def of(self, sheet: Sheet) -> CondensedPanel:
        """The panel of a sheet, from that of a sheet of unit modulus and density."""
        modulus, density = sheet.modulus, sheet.density
        assert density is not None
        return replace(
            self,
            stiffness=modulus * self.stiffness,
            mass=density * self.mass,
            products=np.float32(density) * self.products,
            thermal=modulus * self.thermal,
            held_energy=modulus * self.held_energy,
            changes=self.changes * np.array([modulus, density])[:, None, None],
            resultants=modulus * self.resultants,
            held_resultants=self.held_resultants * np.repeat([1.0, modulus], [3, 4]),
        )

    def lift(self, points: NDArray) -> NDArray[np.float64]:
        """Displacements (p, c) normal to the panel's plane at points (p, 2) of this plane."""
        from scipy.interpolate import LinearNDInterpolator

        return LinearNDInterpolator(self.points, self.lifts)(points)


def extrapolated(coarse: CondensedPanel, fine: CondensedPanel, ratio: float) -> CondensedPanel:
    """The limit of fine meshes, from two meshes; errors fall with the square of the mesh size.

    Motions that have hardly any mass would get a negative one. Motions that the coarse mesh makes
    far too stiff are not extrapolated in full: nearly flat sheets would find them, and be too soft.

    ratio : mesh size of `coarse` / mesh size of `fine`.
    """
    weight = 1.0 / (ratio**2 - 1.0)
    values, motions = eigh(fine.mass + weight * (fine.mass - coarse.mass))
    stiffness, ways = eigh(fine.stiffness)
    strained = stiffness > RIGID * stiffness[-1]
    ways = ways[:, strained] * np.sqrt(stiffness[strained])
    unit = ways / stiffness[strained]
    share, turned = eigh(unit.T @ (fine.stiffness - coarse.stiffness) @ unit)
    ways = ways @ turned
    return replace(
        fine,
        **{
            name: (1.0 + weight) * getattr(fine, name) - weight * getattr(coarse, name)
            for name in ("thermal", "held_energy", "resultants", "held_resultants")
        },
        stiffness=fine.stiffness + (ways * (weight * share.clip(min=-LOCKED))) @ ways.T,
        mass=(motions * values.clip(min=0.0)) @ motions.T,
    )


def beside(panel: CondensedPanel, other: CondensedPanel) -> CondensedPanel:
    """The panel, with its changes to another."""
    changes = other.stiffness - panel.stiffness, other.mass - panel.mass
    return replace(panel, changes=np.stack(changes))


def condense(
    corners: NDArray, smooth: Collection[int], sheet: Sheet, fibers: float, graded: Grading,
    level: Level, like: LinearNDInterpolator | None = None,
) -> tuple[CondensedPanel, LinearNDInterpolator]:  # fmt: skip
    """Condense a panel with corners (k, 3), m, onto the shapes of a level.

    Also returns the displacements (p, 3 q) of its inner modes at points (p, 2) of its plane.

    corners : in a frame whose third axis is nearly normal to the panel.
    smooth : corners that are not rigid within the radius.
    fibers : angle (rad) of direction 1 of an orthotropic sheet from the frame's first axis.
    like : the inner modes on another mesh, which are reproduced.
    """
    from scipy.interpolate import LinearNDInterpolator  # loads slowly: not for other models

    mesh = _Mesh(corners, smooth, sheet, fibers, graded)
    shapes, kind, held = _edge_shapes(mesh, graded.radius, level)
    inside = np.setdiff1d(np.arange(mesh.size), held)
    stiffness, mass = mesh.stiffness, mesh.mass
    own = sparse.csc_array(stiffness[inside][:, inside])
    factors, count = factorize(own), level.inner
    full = np.zeros((mesh.size, shapes.shape[1] + count))
    full[:, :-count] = shapes
    full[inside, :-count] = -factors.solve(stiffness[inside][:, held] @ shapes[held])
    inner, on_nodes = np.zeros((mesh.size, count + SPARE)), slice(3 * len(mesh.nodes))
    size = np.sqrt(mass[on_nodes, on_nodes].sum() / 3.0)  # modal masses are the panel's mass
    inner[inside] = size * _held_modes(
        own, sparse.csc_array(mass[inside][:, inside]), factors, inner.shape[1]
    )
    turned = np.eye(len(inner.T), count)
    if like is not None:
        theirs = like(mesh.nodes[:, :2]).reshape(-1, count)
        common = inner[on_nodes].T @ (mass[on_nodes, on_nodes] @ np.nan_to_num(theirs))
        left, _, right = np.linalg.svd(common, full_matrices=False)
        turned = left @ right
    full[:, -count:] = inner @ turned
    warm, energy = mesh.thermal
    pushed = np.concatenate([mesh.pressed, warm], axis=1)
    held_motion = np.zeros_like(pushed)
    held_motion[inside] = factors.solve(pushed[inside])
    reduced, carried = mesh.stiffness_of(full), full.T @ (mass @ full)
    along = full[on_nodes].reshape(len(mesh.nodes), 3, -1).swapaxes(0, 1)
    nodal = mass[on_nodes, on_nodes][::3, ::3]
    middle = np.linalg.norm(mesh.nodes - mesh.nodes[: mesh.corners].mean(axis=0), axis=1).argmin()
    panel = CondensedPanel(
        0.5 * (reduced + reduced.T),
        0.5 * (carried + carried.T),
        np.concatenate([kind, [(INNER, 0, k) for k in range(count)]]),
        mesh.nodes[:, :2],
        full[on_nodes][2::3].astype(np.float32),
        full[3 * middle + np.arange(3)],
        np.array([[a.T @ (nodal @ b) for b in along] for a in along], np.float32),
        np.concatenate([full[:, :-count].T @ warm, np.zeros((count, 4))]),
        energy - warm[inside].T @ held_motion[inside, 3:],
        np.zeros((2, *reduced.shape)),
        mesh.resultants(full),
        mesh.resultants(held_motion, thermal=True),
    )
    modes = full[on_nodes, -count:].reshape(len(mesh.nodes), -1)
    return panel, LinearNDInterpolator(mesh.nodes[:, :2], modes)


class _Mesh:
    """Triangles of a panel with corners (k, 3), and the rows of side strains and rotations."""

    def __init__(
        self, corners: NDArray, smooth: Collection[int], sheet: Sheet, fibers: float,
        graded: Grading,
    ) -> None:  # fmt: skip
        face = tuple(range(len(corners)))
        mesh = shell_mesh(Pattern(corners, [face]), 0, graded)
        self.nodes, self.triangles, self.corners = mesh.nodes, mesh.triangles, len(corners)
        points = mesh.edge_points
        self.edges = [np.array(side_between(points, a, b), np.int64) for a, b in around(face)]
        tri, x = self.triangles, self.nodes[self.triangles]
        n, nt, axes = len(self.nodes), len(tri), None
        stretching, bent = sheet.stretching, sheet.bending
        if sheet.orthotropic:
            stretching, bent = (turned_axes(each, fibers) for each in (stretching, bent))
            axes = np.tile([1.0, 0.0, 0.0], (nt, 1))
        membrane, bending = triangle_stiffness(x, stretching, bent, axes)
        stiff = np.setdiff1d(face, list(smooth))
        rigid = np.asarray(np.isin(tri, stiff).any(axis=1))
        membrane[rigid] *= STIFF
        self._elastic, self._stretching = (membrane, bending), stretching
        near = stress_points(self.nodes[: self.corners], max(sheet.thickness, graded.radius))
        self._recovery = recovery(near, x, np.eye(3)[:2], rigid)
        side = np.roll(x, -1, axis=1) - x
        length2 = np.einsum("tki,tki->tk", side, side)
        normal = np.cross(side[:, 0], side[:, 1])
        twice = np.linalg.norm(normal, axis=1)
        self._triangle_mass = 0.5 * twice * sheet.areal_density
        self.sides, number, sign = _sides(tri)
        self.size = 3 * n + len(self.sides)
        rows, a, b, c = (
            np.arange(3 * nt).reshape(nt, 3),
            tri,
            *(np.roll(tri, -k, 1) for k in (1, 2)),
        )
        per_length = side / length2[:, :, None]
        self._strains = _rows(self.size, 3 * nt, [(rows, b, per_length), (rows, a, -per_length)])
        foot = np.einsum("tki,tki->tk", np.roll(x, -2, axis=1) - x, side) / length2
        up = (normal / twice[:, None])[:, None] * (np.sqrt(length2) / twice[:, None])[:, :, None]
        phi = [
            (rows, c, up),
            (rows, a, (foot - 1.0)[:, :, None] * up),
            (rows, b, -foot[:, :, None] * up),
        ]
        psi = (rows.ravel(), 3 * n + number.ravel(), -sign.ravel())
        self._rotations = _rows(self.size, 3 * nt, phi, psi)
        curled = [chord_turns(x[:, (k, k - 2, k - 1)]) for k in range(3)]
        tx, ty = np.moveaxis(side[..., :2], 2, 0) / np.sqrt(length2)
        along = np.stack([tx * tx, 1.0 - tx * tx, tx * ty], axis=2)
        self._free = along, np.stack(curled, axis=1)[..., None]  # see `structures.swelling`
        self._area = 0.5 * twice

    @property
    def stiffness(self) -> sparse.csc_array:
        """Stiffness (m, m) of all unknowns."""
        parts = zip((self._strains, self._rotations), self._elastic, strict=True)
        return sparse.csc_array(sum(rows.T @ (block_diagonal(own) @ rows) for rows, own in parts))

    def stiffness_of(self, shapes: NDArray) -> NDArray:
        """Stiffness of shapes (m, c), summed over triangles: far smaller rounding errors."""
        out = np.zeros((shapes.shape[1], shapes.shape[1]))
        for rows, own in zip((self._strains, self._rotations), self._elastic, strict=True):
            strain = rows @ shapes
            out += strain.T @ (block_diagonal(own) @ strain)
        return out

    @property
    def thermal(self) -> tuple[NDArray, NDArray]:
        """Forces (m, 4) of unit free strains and a unit free curvature, and 2 energy (4, 4)."""
        held = [own @ free for own, free in zip(self._elastic, self._free, strict=True)]
        parts = zip((self._strains, self._rotations), held, strict=True)
        forces = [rows.T @ own.reshape(rows.shape[0], -1) for rows, own in parts]
        energy = np.zeros((4, 4))
        for part, free, own in zip((slice(3), slice(3, 4)), self._free, held, strict=True):
            energy[part, part] = np.einsum("tka,tkb->ab", free, own)
        return np.concatenate(forces, axis=1), energy

    @property
    def pressed(self) -> NDArray:
        """Forces (m, 3) of unit forces per area along the axes."""
        on_nodes = np.bincount(self.triangles.ravel(), np.repeat(self._area / 3.0, 3))
        return np.pad(np.kron(on_nodes[:, None], np.eye(3)), ((0, len(self.sides)), (0, 0)))

    def resultants(self, shapes: NDArray, thermal: bool = False) -> NDArray:
        """Membrane forces and moments (2, p, 3, c) at the stress points, of shapes (m, c).

        thermal : whether the last four shapes have unit free strains and a unit free curvature.
        """
        strain, rotation = self._strains @ shapes, self._rotations @ shapes
        if thermal:
            strain[:, -4:-1] -= self._free[0].reshape(-1, 3)
            rotation[:, -1] -= self._free[1].ravel()
        moment = -self._recovery.moment @ (block_diagonal(self._elastic[1]) @ rotation)
        found = (self._recovery.strain @ strain).reshape(-1, 3, strain.shape[1])
        force = forces(found.swapaxes(1, 2), self._stretching).swapaxes(1, 2)
        return np.stack([force, moment.reshape(found.shape)])

    @property
    def mass(self) -> sparse.csr_array:
        """Consistent mass (m, m) of all unknowns; turns have none."""
        matrices = self._triangle_mass[:, None, None] * TRIANGLE_MASS
        nodal = of_elements(self.triangles, matrices, len(self.nodes))
        whole = sparse.csr_array(sparse.kron(nodal, sparse.eye_array(3), format="csr"))
        whole.resize((self.size, self.size))
        return whole


def block_diagonal(blocks: NDArray) -> sparse.bsr_array:
    """Block diagonal matrix of blocks (n, a, b)."""
    return sparse.bsr_array((blocks, np.arange(len(blocks)), np.arange(len(blocks) + 1)))


def _rows(
    size: int, count: int, parts: list[tuple[NDArray, NDArray, NDArray]], more: tuple | None = None
) -> sparse.csr_array:
    """Matrix (count, size) with vectors (..., 3) in rows (...) at nodes (...); `more` entries."""
    row = [np.repeat(rows.ravel(), 3) for rows, _, _ in parts]
    column = [(3 * nodes.ravel()[:, None] + np.arange(3)).ravel() for _, nodes, _ in parts]
    value = [vectors.ravel() for _, _, vectors in parts]
    if more is not None:
        for entries, own in zip((row, column, value), more, strict=True):
            entries.append(own)
    entries = (np.concatenate(value), (np.concatenate(row), np.concatenate(column)))
    return sparse.csr_array(sparse.coo_array(entries, shape=(count, size)))


def _sides(tri: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Sides (s, 2), the number (nt, 3) of each triangle's sides, and signs (nt, 3).

    The sign is 1 in the first of the triangles at a side.
    """
    pairs = np.stack([tri, np.roll(tri, -1, axis=1)], axis=2)
    sides, number = np.unique(np.sort(pairs, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    number = number.reshape(tri.shape)
    first = np.full(len(sides), tri.size)
    np.minimum.at(first, number.ravel(), np.arange(tri.size))
    return sides, number, np.where(first[number] == np.arange(tri.size).reshape(-1, 3), 1.0, -1.0)


def _edge_shapes(mesh: _Mesh, cut_off: float, level: Level) -> tuple[NDArray, NDArray, NDArray]:
    """Shapes (m, c) on the edges, their kinds (c, 3), and the unknowns (b,) that they determine."""
    n, columns, kinds, held = len(mesh.nodes), [], [], []
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(mesh.sides)}
    corners = mesh.nodes[: mesh.corners]
    up = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    lengths = [
        float(np.linalg.norm(mesh.nodes[own[-1]] - mesh.nodes[own[0]])) for own in mesh.edges
    ]
    places = [
        np.linalg.norm(mesh.nodes[own] - mesh.nodes[own[0]], axis=1) / length
        for own, length in zip(mesh.edges, lengths, strict=True)
    ]

    def put(rows: NDArray, values: NDArray, kind: tuple[int, int, int]) -> None:
        columns.append(np.zeros(mesh.size))
        columns[-1][rows] = values
        kinds.append(kind)

    for corner in range(mesh.corners):
        hat = np.zeros(n)
        hat[mesh.edges[corner]] = 1.0 - places[corner]
        hat[mesh.edges[corner - 1]] = places[corner - 1]
        for axis in range(3):
            put(3 * np.arange(n) + axis, hat, (VERTEX, corner, axis))
    for edge, own in enumerate(mesh.edges):
        dofs = 3 * own[:, None] + np.arange(3)
        held.append(dofs.ravel())
        frame = edge_frame(mesh.nodes[own[-1]] - mesh.nodes[own[0]], up)
        for axis in range(3):
            own_bows = bows(places[edge], cut_off / lengths[edge], axis, level.on_edge[axis])
            for shape, values in enumerate(own_bows.T):
                put(dofs, values[:, None] * frame[axis], (BOW, 3 * edge + axis, shape))
    for edge, own in enumerate(mesh.edges):
        pairs = np.sort(np.stack([own[:-1], own[1:]], axis=1), axis=1)
        sides = 3 * n + np.array([number[int(a), int(b)] for a, b in pairs])
        held.append(sides)
        middle = 0.5 * (places[edge][1:] + places[edge][:-1])
        for shape, values in enumerate(turns(middle, level.turns).T):
            put(sides, values, (TURN, edge, shape))
    return np.stack(columns, axis=1), np.array(kinds), np.unique(np.concatenate(held))


def edge_frame(along: NDArray, up: NDArray) -> NDArray[np.float64]:
    """Unit vectors (..., 3, 3) along edges, across them in the plane normal to `up`, and normal."""
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    across = np.cross(up, along)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([along, across, np.cross(along, across)], axis=-2)


def _held_modes(
    stiffness: sparse.csc_array, mass: sparse.csc_array, factors: object, count: int
) -> NDArray:
    """The lowest vibrations (i, count), of unit modal mass, of a panel with its edges held."""
    inverse = LinearOperator(stiffness.shape, factors.solve, dtype=float)  # type: ignore[attr-defined]
    start = np.random.default_rng(0).standard_normal(stiffness.shape[0])
    values, modes = eigsh(stiffness, count, M=mass, sigma=0.0, OPinv=inverse, v0=start)
    modes = modes[:, np.argsort(values)]
    return modes / np.sqrt(np.einsum("ik,ik->k", modes, mass @ modes))
