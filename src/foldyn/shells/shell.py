"""`Shell`: a pattern as a thin shell with exact creases; `shell` makes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn.algebra.solvers import Fill
from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, LinearBar, LinearHinge
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import joined, moments, pushes
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.mechanics.plates import BarsPlates, handed_over
from foldyn.patterns import Pattern
from foldyn.patterns.pattern import Patterned
from foldyn.patterns.topology import Edge
from foldyn.ram_limit import check_memory
from foldyn.shells.mesh import (
    Sides,
    shell_mesh,
    sides,
    stiffness,
    triangle_plates,
    without_free_sides,
)
from foldyn.shells.recovery import Recovery, StressPoints, forces, recovery
from foldyn.shells.term import GROUPS, ShellTerm
from foldyn.structures import MASS_RULES, Sheet, calibration
from foldyn.structures.beyond_range import doubt_locking
from foldyn.structures.discretize import checked_kinds
from foldyn.structures.discretized import Discretized, read_only
from foldyn.structures.edge_angles import EdgePlates, plates_model
from foldyn.structures.fold_law import FoldLaws, laws_given
from foldyn.structures.graded import Grading, grading, smooth_vertices
from foldyn.structures.held_edges import boundary_edges
from foldyn.structures.material_axes import own_stretching
from foldyn.structures.membranes import PanelKind, swelling
from foldyn.structures.mesh import double_areas, hinge_angles, lengths
from foldyn.structures.rigid_plates import check_welds, checked_panels, rigid_panels
from foldyn.structures.swelling import Swelling, chord_turns
from foldyn.values import choice, length, show, whole

MASSES = {"lumped": "centroid", "consistent": "consistent"}  # and their mass rules
STIFF = 100.0  # in-plane stiffness factor for the rigid corners about vertices
RANDOM = 0.05  # sum of many random rounding errors, divided by its bound
PER_NODE = 20_000.0
"""Bytes per node with its tangent: measured 14,200 with 3,721 nodes, 16,000 with 14,641."""
PER_DOUBLING, LEAST = 5900.0, 1450
"""Memory of the tangent's factors, see `Fill`: 23 kB per dof with 21,963 dofs, 35 with 87,123."""


@dataclass(frozen=True)
class ShellOptions:
    """Arguments of `shell` other than pattern and sheet."""

    divisions: int = 16
    mass: str = "lumped"
    fold_law: FoldLaws = EnhancedLinear()
    crease_stiffness: calibration.Folds = None
    crease_rest: calibration.PerCrease = None
    clamped: tuple[Edge, ...] = ()
    rigid: str | tuple[int, ...] | None = None
    vertex_radius: float | None = None

    __post_init__ = calibration.check_creases


@dataclass(frozen=True, eq=False, repr=False)
class Shell(Discretized):
    """A pattern as a thin shell; made by `shell`.

    Attributes
    ----------
    nodes : (n, 3)
        Rest positions (m): the pattern's vertices in order, then the points of the mesh.
    triangles, triangle_panel : (nt, 3), (nt,)
        Counter-clockwise from the front, and the panel of each.
    sides : Sides
        Hinges and rotations at which the triangles meet.
    fold_stiffness : (nf,)
        Stiffness of the whole creases, in the order of `pattern.creases`, N m/rad.
    piece_rest : (c,)
        Rest dihedral of each piece of a crease, in the order of `sides`, rad.
    pattern, sheet, options
        Input from which the shell was made.
    graded : Grading or None
        How the mesh is refined about the vertices.
    by_folds : bool
        Whether the dofs of rotations are those of explicit methods; see `mechanics.plates`.
    """

    nodes: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    sides: Sides
    fold_stiffness: NDArray
    piece_rest: NDArray
    pattern: Pattern
    sheet: Sheet
    options: ShellOptions
    graded: Grading | None = None
    by_folds: bool = False

    def __repr__(self) -> str:
        """One line with the counts."""
        return (
            f"<Shell: {len(self.nodes)} nodes, {len(self.triangles)} triangles, "
            f"{len(self.fold_stiffness)} folds, mass {self.options.mass}>"
        )

    @property
    def divisions(self) -> int:
        """Pieces of every edge."""
        return self.options.divisions

    def meshed(self, divisions: int) -> Shell:
        """The shell with another number of pieces per edge."""
        return shell(self.pattern, self.sheet, **vars(replace(self.options, divisions=divisions)))

    kind: ClassVar[str] = "shell"
    energy_groups: ClassVar[Mapping[str, str]] = GROUPS

    @property
    def massless(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Description of the massless dofs; empty if all panels are rigid."""
        return "the rotations of a shell" if self.rotations else ""

    @property
    def fill(self) -> Fill:
        """Memory needed for the factors of the tangent."""
        return Fill(PER_DOUBLING, LEAST, f"divisions = {self.options.divisions}", "take fewer")

    @cached_property
    def body(self) -> Assembly:
        """The model for solvers."""
        laws = self.fold_law.at(self.sides.piece_crease), LinearHinge()
        sheet = ShellTerm(self.model, laws, self.sides.piece_crease, self._scale)
        return Assembly(sheet, *(MembranesTerm(own, sheet.rows) for _, own in self.membranes))

    @property
    def rotations(self) -> int:
        """Number of rotations, which are dofs in addition to the displacements."""
        return self.sides.rotations

    def swollen(self, strain: NDArray, curvature: NDArray) -> Swelling:
        """Effect of swelling; see `Discretized`.

        Triangles have free strains of their sides, and free rotations beta0 of the sheet about the
        sides (see `shells.mesh`). The energy changes linearly with these, so that their forces are
        constant.
        """
        panel, hinges, (plates, side, share) = self.triangle_panel, self.sides.hinges, self._plates
        bends = ~np.isin(panel, rigid_panels(self.options.rigid, len(self.pattern.faces)))
        parts, stretched, pushed = swelling(self.membranes, self.nodes, strain)
        corners = self.triangles[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]]
        turns = chord_turns(self.nodes[corners.reshape(-1, 3)]).reshape(-1, 3)
        rotated = np.where(bends, -curvature[panel], 0.0)[:, None] * turns  # of sides
        moment = share * np.einsum("tkm,tm->tk", self._stiffness[1], rotated).ravel()[side]
        on_hinge = plates.angle >= 0
        turning = np.bincount(plates.angle[on_hinge], moment[on_hinge], len(hinges))
        hidden = np.bincount(-1 - plates.angle[~on_hinge], moment[~on_hinge], self.rotations)
        turned, hidden = handed_over(self.model, self.model.per_reach * hidden)
        turning[: len(turned)] += turned
        rows = np.where(hinges < len(self.nodes), hinges, -1)
        points = np.concatenate([self.nodes, self.sides.wings])[hinges]
        behind = self.nodes.size + np.arange(self.rotations)
        parts = (*parts, moments(points, rows, turning), pushes(behind, hidden))
        # the last angle of a side gives it the whole rotation
        last = np.append(side[1:] != side[:-1], True)
        turned = np.where(last, rotated.ravel()[side] / share, 0.0)
        loads = joined((part, 0) for part in parts)
        return Swelling(np.zeros(len(self.folds)), loads, (stretched, turned), (pushed, moment))

    @cached_property
    def folds(self) -> NDArray:
        """Hinge row (nf, 4) of the first piece of each crease: axis j, k, wings i, l."""
        crease, first = np.unique(self.sides.piece_crease, return_index=True)
        rows = np.zeros((len(self.fold_stiffness), 4), np.int64)
        rows[crease] = self.sides.hinges[first]
        return read_only(rows)

    @cached_property
    def edge_nodes(self) -> NDArray:
        """See `Discretized`; p is divisions + 1, or more in a graded mesh."""
        ends = self.pattern.lines
        count = (self.graded.edge_pieces if self.graded else self.options.divisions) - 1
        inner = len(self.pattern.vertices) + np.arange(len(ends) * count).reshape(len(ends), count)
        return read_only(np.concatenate([ends[:, :1], inner, ends[:, 1:]], axis=1))

    @cached_property
    def clamped_nodes(self) -> tuple[NDArray, ...]:
        """Nodes along each clamped edge, from its lower to its higher vertex."""
        rows = {(int(row[0]), int(row[-1])): row for row in self.edge_nodes}
        return tuple(rows[edge] for edge in self.options.clamped)

    @cached_property
    def bars(self) -> NDArray:
        """Sides of the triangles (nb, 2), each once."""
        tri = self.triangles
        ends = np.stack([tri, np.roll(tri, -1, axis=1)], axis=2).reshape(-1, 2)
        return read_only(np.unique(np.sort(ends, axis=1), axis=0))

    @cached_property
    def fold_rest(self) -> NDArray:
        """Rest dihedrals of the folds (nf,), rad: the mean along each crease."""
        return read_only(self.body.sheet.rest_angles)

    @property
    def _reach(self) -> float:
        """Length (m) of a typical side, which converts rotations to displacements."""
        return 1.0 / self.model.per_reach

    @cached_property
    def _stiffness(self) -> tuple[NDArray, NDArray]:
        """Stiffness (nt, 3, 3) of triangles: for side strains, J, and for rotations, N m."""
        corners = self.nodes[self.triangles]
        membrane, bending = stiffness(corners, self.triangle_panel, self.sheet, self.pattern)
        if self.graded:
            vertices = np.flatnonzero(~smooth_vertices(self.pattern))
            membrane[np.isin(self.triangles, vertices).any(axis=1)] *= STIFF
        return membrane, without_free_sides(bending, self.sides.free)

    @cached_property
    def membranes(self) -> tuple[PanelKind, ...]:
        """The triangles as membranes, each with the material of its panel."""
        corners = self.nodes[self.triangles]
        side = np.roll(corners, -1, axis=1) - corners
        own = Membranes(
            nodes=self.triangles.copy(),
            ends=np.array([[0, 1], [1, 2], [2, 0]]),
            gives=np.zeros((len(side), 0), np.int64),
            vector=np.ascontiguousarray(side.transpose(1, 2, 0)),
            per_length2=np.ascontiguousarray(1.0 / np.einsum("tki,tki->kt", side, side)),
            stiffness=np.ascontiguousarray(self._stiffness[0].transpose(1, 2, 0)),
        )
        return (PanelKind(self.triangle_panel, own),)

    @cached_property
    def _plates(self) -> tuple[EdgePlates, NDArray, NDArray]:
        """See `triangle_plates`."""
        return triangle_plates(self.sides, self._stiffness[1])

    @cached_property
    def model(self) -> BarsPlates:
        """The arrays that the compiled kernels work on, without the membranes."""
        hinges, crease = self.sides.hinges, self.sides.piece_crease
        folds, bends, clamps = np.split(hinges, [len(crease), len(hinges) - len(self.sides.wings)])
        length = lengths(self.nodes, folds)
        whole = np.bincount(crease, length, len(self.fold_stiffness))
        model = plates_model(
            self.nodes, self.bars, np.ones(len(self.bars)), LinearBar(), folds,
            (self.fold_stiffness / whole)[crease] * length, self.piece_rest,
            self.fold_law.at(crease), bends, hinge_angles(self.nodes, bends), self._plates[0],
            clamps[:, :3], self.by_folds,
        )  # fmt: skip
        return model._replace(bars=model.bars._replace(bar_runs=model.bars.bar_runs[:0]))

    @cached_property
    def stress_points(self) -> StressPoints:
        """Points of the panels at which stresses are found."""
        return StressPoints.of(self.pattern, self.sheet, self.graded.radius if self.graded else 0.0)

    @cached_property
    def _recoveries(self) -> Recovery:
        """Tensors at the stress points of all panels in turn."""
        x, panel = self.nodes[self.triangles], self.triangle_panel
        stiff = np.flatnonzero(~smooth_vertices(self.pattern)) if self.graded else []
        rigid = np.asarray(np.isin(self.triangles, stiff).any(axis=1))
        parts = []
        points = self.stress_points
        for number in range(len(self.pattern.faces)):
            own, at = np.flatnonzero(panel == number), points.panel == number
            found = recovery(points.position[at], x[own], points.axes[number], rigid[own])
            sides = (3 * own[:, None] + np.arange(3)).ravel()
            put = sparse.eye_array(panel.size * 3, format="csr")[sides]
            parts.append([each @ put for each in found])
        whole = (sparse.csr_array(sparse.vstack(each)) for each in zip(*parts, strict=True))
        return Recovery(*whole)

    @cached_property
    def _stretching(self) -> NDArray:
        """Membrane stiffness (p, 3, 3), N/m, at the stress points."""
        own = own_stretching(self.pattern, self.sheet, self.stress_points.axes)
        return own[self.stress_points.panel]

    def resultants(self, q: NDArray, free: tuple[NDArray, NDArray] | None) -> NDArray[np.float64]:
        """Membrane forces, N/m, and moments, N, (p, 2, 3) at the stress points, xx, yy, xy.

        q : (m,) dofs of `body`.
        free : strains and angles at which panels have no stress, as `Swelling.free`.
        """
        x = self.nodes + q[: self.nodes.size].reshape(-1, 3)
        square = lengths(x, self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)) ** 2
        strain = 0.5 * (square.reshape(-1, 3) * self.membranes[0].membranes.per_length2.T - 1.0)
        sheet, (_, side, share) = self.body.sheet, self._plates
        assert isinstance(sheet, ShellTerm)
        angle = sheet.plate_angles(q)
        if free is not None:
            strain = strain - free[0].reshape(3, -1).T
            angle = angle - free[1]
        turned = np.bincount(side, share * angle, 3 * len(self.triangles)).reshape(-1, 3)
        moment = np.einsum("tkl,tl->tk", self._stiffness[1], turned)
        recovered = self._recoveries
        force = forces((recovered.strain @ strain.ravel()).reshape(-1, 3), self._stretching)
        return np.stack([force, (recovered.moment @ moment.ravel()).reshape(-1, 3)], axis=1)

    @property
    def _scale(self) -> NDArray:
        """In-plane stiffness of the triangles' sides, times side length, summed at nodes.

        Bending adds to this: rounding errors of positions, which grow with the distance from the
        middle of the nodes, turn the sides of small triangles. The errors are random: their sum is
        about a twentieth of its bound.
        """
        (membrane, bending), ((_, own),) = self._stiffness, self.membranes
        per_length = np.sqrt(own.per_length2.T)
        stiff = np.abs(membrane).sum(axis=2) * per_length
        double = np.linalg.norm(double_areas(self.nodes, self.triangles), axis=1)
        height = double * per_length.min(axis=1)
        reach = np.linalg.norm(self.nodes - self.nodes.mean(axis=0), axis=1).max(initial=0.0)
        stiff += RANDOM * np.abs(bending).sum(axis=2) * (reach / height**2)[:, None]
        nodal = np.zeros(len(self.nodes))
        for end in (0, -1):
            np.add.at(nodal, np.roll(self.triangles, end, axis=1), stiff)
        turning = np.abs(bending).sum(axis=(1, 2)).max(initial=0.0) / self._reach
        return np.concatenate([np.repeat(nodal, 3), np.full(self.rotations, turning)])

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg; one value serves the three axes. Rotations have no mass.

        Raises
        ------
        InputError
            The sheet has no density.
        """
        return MASS_RULES[MASSES[self.options.mass]](self.surface)

    def energies(self, u: ArrayLike, rotation: ArrayLike | None = None) -> Mapping[str, float]:
        """Strain energies (J) of membrane, bending and folds at displacement u (n, 3), m.

        rotation : (r,), rad; in balance by default.
        """
        u, x = self._state(u, rotation)
        energies = self.body.energies(np.append(u, x * self._reach))
        return dict(zip(GROUPS, energies.tolist(), strict=True))

    def energy(self, u: ArrayLike, rotation: ArrayLike | None = None) -> float:
        """Strain energy (J)."""
        return sum(self.energies(u, rotation).values())

    def forces(self, u: ArrayLike, rotation: ArrayLike) -> tuple[NDArray, NDArray]:
        """Derivatives of the energy: forces (n, 3), N, and moments about the rotations, N m."""
        u, x = self._state(u, rotation)
        force = self.body.internal(np.append(u, x * self._reach))
        return force[: u.size].reshape(-1, 3), force[u.size :] * self._reach

    def internal_force(self, u: ArrayLike) -> NDArray:
        """Internal force (n, 3), N, at displacement u (n, 3), m, with rotations in balance."""
        return self.forces(u, self.balanced(u))[0]

    def tangent(
        self, u: ArrayLike, rotation: ArrayLike | None = None, *, floor: float = -np.inf
    ) -> sparse.csr_array:
        """Second derivative (3n + r, 3n + r) of the energy; dofs 3 node + axis, then rotations."""
        u, x = self._state(u, rotation)
        matrix = self.body.tangent(np.append(u, x * self._reach), floor)
        units = np.repeat([1.0, self._reach], [u.size, x.size])
        matrix.data *= np.repeat(units, np.diff(matrix.indptr)) * units[matrix.indices]
        return matrix

    def balanced(self, u: ArrayLike) -> NDArray:
        """Rotations (r,) without moments at displacement u (n, 3)."""
        u, _ = self._state(u, np.zeros(self.rotations))
        return self.body.dofs(u)[u.size :] / self._reach

    def _state(self, u: ArrayLike, rotation: ArrayLike | None) -> tuple[NDArray, NDArray]:
        array = self._displacement(u)
        if rotation is None:
            return array, self.balanced(array)
        x = np.ascontiguousarray(rotation, float)
        if x.shape != (self.rotations,):
            raise InputError(f"rotation of shape {x.shape}: give ({self.rotations},)")
        return array, x


def shell(
    pattern: Pattern | Patterned,
    sheet: Sheet,
    *,
    divisions: int = 16,
    mass: str | None = None,
    fold_law: FoldLaws | None = None,
    crease_stiffness: calibration.Folds = None,
    crease_rest: calibration.PerCrease = None,
    clamped: str | Sequence[Sequence[int]] = (),
    rigid: str | Sequence[int] | None = None,
    vertex_radius: float | None = None,
) -> Shell:
    """Discretize a pattern as a thin shell of triangles with exact creases.

    Each panel bends and stretches as a separate sheet; along a crease the two sheets turn relative
    to each other with the stiffness of the fold, spread evenly over its length.

    Parameters
    ----------
    pattern : Pattern
    sheet : Sheet
        The sheet; its length-scale ratio determines the stiffness of the creases, as in
        `discretize`.
    divisions : int, default 16
        Pieces of every edge; the number of triangles grows with the square. With 16 or more,
        frequencies of the case studies are right to 1 %.
    mass : {"lumped", "consistent"}, default "lumped"
        A third of each triangle's mass at each corner, or rho A t / 12 [2 1 1; 1 2 1; 1 1 2].
    fold_law, crease_stiffness, crease_rest
        As in `discretize`.
    clamped : sequence of (vertex, vertex), or str
        Boundary edges along which the sheet keeps its rest tangent in space, even if they are
        moved; their nodes still need supports. A selection ("xmin") means the boundary edges with
        both ends in it.
    rigid : "all" or sequence of int, optional
        Panels that cannot bend at all, as in `discretize`. Their mesh has no rotations.
    vertex_radius : float, optional
        Distance from every vertex (m), about the thickness of the sheet, within which panels do not
        stretch, except at vertices of welds where no crease ends or turns. The mesh gets finer
        toward vertices, down to this radius; away from vertices it is about as fine as an even mesh
        with the same `divisions`, a multiple of 4. Without a radius, in-plane forces concentrate at
        points, and frequencies of large sheets and towers fall with every refinement.

    Returns
    -------
    Shell

    Raises
    ------
    InputError
        An argument out of range, or a panel that cannot be meshed.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01)
    >>> fd.shell(pattern, sheet, divisions=4)
    <Shell: 45 nodes, 64 triangles, 1 folds, mass lumped>
    """
    pattern, sheet = checked_kinds(pattern, sheet)
    radius = None if vertex_radius is None else length("vertex_radius", vertex_radius)
    divisions = whole("divisions", divisions, least=1)
    mass = ShellOptions.mass if mass is None else choice("mass", mass, MASSES)
    law, _ = laws_given(ShellOptions.fold_law if fold_law is None else fold_law)
    edges = boundary_edges(clamped, pattern, "clamped")
    plates = checked_panels(rigid, len(pattern.faces))
    check_welds(plates, pattern)
    options = ShellOptions(
        divisions, mass, law, crease_stiffness, crease_rest, edges, plates, radius
    )
    graded = None if radius is None else grading(pattern, divisions, radius)
    if graded:
        nodes = graded.nodes(pattern)
    else:
        nodes = divisions**2 * sum(1 if len(face) == 4 else len(face) / 2 for face in pattern.faces)
    check_memory(
        f"divisions = {show(divisions)}", f"a shell of about {float(nodes):.3g} nodes",
        PER_NODE * nodes, "take fewer",
    )  # fmt: skip
    calibration.check_sheet(sheet, pattern)
    mesh = shell_mesh(pattern, divisions, graded)
    ends = sides(mesh, pattern, edges, rigid_panels(plates, len(pattern.faces)))
    pieces = ends.hinges[: len(ends.piece_crease)]
    made = Shell(
        nodes=mesh.nodes,
        triangles=mesh.triangles,
        triangle_panel=mesh.panel,
        sides=ends,
        fold_stiffness=calibration.fold_stiffness(options.crease_stiffness, pattern, sheet),
        piece_rest=calibration.fold_rest(
            options.crease_rest, hinge_angles(mesh.nodes, pieces), pattern, ends.piece_crease
        ),
        pattern=pattern,
        sheet=sheet,
        options=options,
        graded=graded,
    )
    _ = made.plates  # refuse panels that are not flat
    doubt_locking(made)
    return made.marked()
