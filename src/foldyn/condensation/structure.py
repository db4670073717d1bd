"""`Superelements`: a pattern as condensed panels, for linear analyses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import Fill
from foldyn.algebra.superlu import factorize
from foldyn.condensation.assembly import Whole
from foldyn.condensation.library import ALIKE, Meshes, groups
from foldyn.condensation.panel import BOW
from foldyn.condensation.resultants import resultants
from foldyn.condensation.shapes import FOR_BUCKLING, FOR_STRESSES, LEVELS, Level
from foldyn.condensation.term import GROUPS, SuperelementsTerm
from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, Superlinear
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import Following
from foldyn.mechanics.sheet_term import NO_DOF, CreaseTurns, FoldHinges
from foldyn.patterns import Pattern
from foldyn.patterns.pattern import Patterned
from foldyn.patterns.topology import Edge, edge_lookup
from foldyn.shells.recovery import StressPoints
from foldyn.shells.shell import LEAST, PER_DOUBLING
from foldyn.structures import MASS_RULES, Sheet, calibration
from foldyn.structures.discretize import checked_kinds
from foldyn.structures.discretized import Discretized, Distributed, read_only
from foldyn.structures.fold_law import FoldLaws, laws_given
from foldyn.structures.graded import grading
from foldyn.structures.held_edges import boundary_edges
from foldyn.structures.material_axes import material_axes
from foldyn.structures.rigid_plates import check_welds, checked_panels, rigid_panels
from foldyn.structures.swelling import Swelling
from foldyn.values import choice, length, whole

MASSES = ("consistent",)  # mass rules
EXTRAPOLATED = (8, 16, 24)
"""Divisions of the meshes from which panels are extrapolated."""


@dataclass(frozen=True)
class SuperelementsOptions:
    """Arguments of `superelements` other than pattern and sheet."""

    level: int = 5
    divisions: int | None = None
    mass: str = "consistent"
    fold_law: FoldLaws = EnhancedLinear()
    crease_stiffness: calibration.Folds = None
    crease_rest: calibration.PerCrease = None
    clamped: tuple[Edge, ...] = ()
    rigid: str | tuple[int, ...] | None = None
    vertex_radius: float | None = None

    __post_init__ = calibration.check_creases


@dataclass(frozen=True, eq=False, repr=False)
class Superelements(Discretized):
    """A pattern as condensed panels; made by `superelements`.

    Attributes
    ----------
    nodes : (n, 3)
        The pattern's vertices, m.
    triangles, triangle_panel : (nt, 3), (nt,)
        Triangles between corners of panels, for pictures and selections.
    folds : (nf, 4)
        Hinge rows of the creases.
    fold_stiffness, fold_rest : (nf,)
        Stiffness of the whole creases, N m/rad, and rest dihedrals, rad, in the order of
        `pattern.creases`.
    pattern, sheet, options
        Input from which it was made.
    meshes : Meshes
        How the panels are meshed.
    finer : Level, optional
        Shapes that the panels have instead of those of the level.
    """

    nodes: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    folds: NDArray
    fold_stiffness: NDArray
    fold_rest: NDArray
    pattern: Pattern
    sheet: Sheet
    options: SuperelementsOptions
    meshes: Meshes
    finer: Level | None = None

    kind: ClassVar[str] = "superelements"
    linear: ClassVar[str] = "superelements"
    energy_groups: ClassVar[Mapping[str, str]] = GROUPS
    fill: ClassVar[Fill] = Fill(PER_DOUBLING, LEAST, "level", "take a lower one")

    def __repr__(self) -> str:
        """One line with the counts."""
        return (
            f"<Superelements: {len(self.pattern.faces)} panels, {len(self.fold_stiffness)} folds, "
            f"level {self.options.level}, {self.body.size} dofs>"
        )

    def at_level(self, level: int) -> Superelements:
        """The same with panels of another level."""
        return self.altered(options=replace(self.options, level=level))

    @cached_property
    def for_stresses(self) -> Superelements:
        """The same with the shapes for stresses, or as many as the mesh can have."""
        return self.altered(finer=FOR_STRESSES)

    @cached_property
    def for_buckling(self) -> Superelements:
        """The same with the shapes for buckling."""
        return self.altered(finer=FOR_BUCKLING)

    @cached_property
    def bars(self) -> NDArray:
        """Edges of the pattern."""
        return read_only(self.pattern.lines.copy())

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg: the mass of the panels, distributed to their corners.

        Linear analyses use the mass of all dofs instead, `body.sheet.mass`.
        """
        return MASS_RULES["consistent"](self.surface)

    @cached_property
    def whole(self) -> Whole:
        """The condensed panels on all of their unknowns."""
        # the coarsest of several meshes is only for estimates of errors
        arcs = min(m.arcs for m in self.meshes.graded[-2:])
        level, meshes = LEVELS[self.options.level - 1], self.meshes
        if self.finer is not None:
            across = max(level.across, min(self.finer.across, 2 * arcs - 1))
            turns = max(level.turns, min(self.finer.turns, 2 * arcs - 1))
            level = self.finer._replace(across=across, turns=turns)
            meshes = meshes._replace(level=level)
        if level.across >= 2 * arcs:
            raise InputError(
                f" = {self.options.divisions}: edges have {2 * arcs - 1} points, and a level to "
                f"compute or compare with has {level.across} shapes; take more",
                "divisions",
            )
        (kinds, kind), share = self.sheet.kinds(len(self.pattern.faces)), self.board_share
        density = (np.round(share, ALIKE) * np.array([kinds[k].density for k in kind])).tolist()
        sheets = [replace(kinds[k], density=own) for k, own in zip(kind, density, strict=True)]
        made = groups(self.pattern, sheets, material_axes(self.pattern, self.sheet), meshes)
        return Whole(self.pattern, made, level, meshes.graded[-1])

    @cached_property
    def body(self) -> Assembly:
        """Model for solvers, with edges that no support holds."""
        return Assembly(self._term({}))

    def held(self, edges: Mapping[int, NDArray]) -> Assembly:
        """Model for solvers if supports hold edges; see `Discretized`."""
        return Assembly(self._term(edges)) if edges else self.body

    def changes(self, edges: Mapping[int, NDArray]) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Changes of stiffness and mass (m, m) if panels come from coarser meshes.

        edges : edges that supports hold, as in `held`.
        """
        return self.whole.matrices(self._dofs(edges), changes=True)

    def _term(self, edges: Mapping[int, NDArray]) -> SuperelementsTerm:
        """The sheet if supports hold edges, as in `held`."""
        made, dofs = self.whole, self._dofs(edges)
        rows, fold = made.crease_turns
        turns = CreaseTurns(sparse.csr_array(rows @ dofs), fold)
        panels, mass = made.matrices(dofs)
        parts = dofs.power(2).sum(axis=0)  # unknowns of each dof: two turns at welds, otherwise one
        rotated = (dofs.T @ made.rotated / parts[:, None])[self.nodes.size :]
        return SuperelementsTerm(
            panels, mass, turns, self.slope, self._fold_hinges, self.nodes, rotated,
            partial(made.parts, dofs, self.slope),
        )  # fmt: skip

    def _dofs(self, edges: Mapping[int, NDArray]) -> sparse.csr_array:
        """Unknowns of `whole` as combinations of dofs."""
        number = edge_lookup(self.pattern.lines)
        clamped = np.array([number[edge] for edge in self.options.clamped], np.int64)
        rigid = rigid_panels(self.options.rigid, len(self.pattern.faces))
        return self.whole.dofs(edges, clamped, rigid)

    def owners(self, edges: Mapping[int, NDArray]) -> list[tuple[int, int, int, int]]:
        """Kind, edge or panel, number, and time of each dof that is not one of a vertex.

        The time counts dofs of the same kind, edge or panel, and number.

        edges : edges that supports hold, as in `held`.
        """
        dofs = sparse.csc_array(self._dofs(edges))
        dofs.sort_indices()
        first = dofs.indices[dofs.indptr[self.nodes.size : -1]]
        kind, owner, number = self.whole.unknowns.owners(first)
        number = np.where(kind == BOW, number // 3, number)
        times: Counter[tuple[int, ...]] = Counter()
        found = []
        for one in zip(kind.tolist(), owner.tolist(), number.tolist(), strict=True):
            found.append((*one, times[one]))
            times[one] += 1
        return found

    def spread(self, load: Distributed, edges: Mapping[int, NDArray]) -> NDArray[np.float64]:
        """See `Discretized`."""
        return self._dofs(edges).T @ self.whole.spread(load)

    @cached_property
    def stress_points(self) -> StressPoints:
        """Points of the panels at which stresses are found."""
        return StressPoints.of(self.pattern, self.sheet, self.meshes.graded[-1].radius)

    def embedded(
        self, finer: Superelements, motions: NDArray, *, edges: Mapping[int, NDArray]
    ) -> NDArray:
        """The same motions (m, k) on the dofs of a structure with more shapes.

        edges : edges that supports hold, as in `held`.
        """
        own, other = self.whole.unknowns, finer.whole.unknowns
        places = own.places_in(other)
        unknown = np.zeros((other.size, motions.shape[1]), motions.dtype)
        unknown[places] = self._dofs(edges) @ motions
        dofs = finer._dofs(edges)
        solve = factorize(sparse.csc_array(dofs.T @ dofs)).solve
        parts = [np.real(dofs.T @ unknown), np.imag(dofs.T @ unknown)]
        real, imaginary = (solve(np.ascontiguousarray(part)) for part in parts)
        return real + 1j * imaginary if np.iscomplexobj(motions) else real

    def resultants(self, edges: Mapping[int, NDArray]) -> sparse.csr_array:
        """Membrane forces and moments (6 p, m) of the dofs; see `condensation.resultants`.

        edges : edges that supports hold, as in `held`.
        """
        return sparse.csr_array(resultants(self.whole) @ self._dofs(edges))

    def lifts(
        self, points: NDArray, panel: NDArray, *, edges: Mapping[int, NDArray]
    ) -> sparse.csr_array:
        """See `Discretized`."""
        return sparse.csr_array(self.whole.lifts(points, panel) @ self._dofs(edges))

    def swollen(self, strain: NDArray, curvature: NDArray) -> Swelling:
        """See `Discretized`; `spread` has the forces."""
        (free, push), none = self.whole.held(strain, curvature).reshape(2, -1), np.zeros(0)
        return Swelling(np.zeros(len(self.folds)), Following(), (free, none), (push, none))

    def along_axes(
        self, edges: Mapping[int, NDArray], panels: NDArray
    ) -> Iterator[tuple[sparse.csr_array, list[Any]]]:
        """See `Whole.along_axes`, with dofs in place of unknowns."""
        dofs = self._dofs(edges)
        for amplitudes, masses in self.whole.along_axes(panels):
            yield sparse.csr_array(amplitudes @ dofs), masses

    def between(self, edges: Mapping[int, NDArray]) -> tuple[NDArray, sparse.csr_array]:
        """Points (q, 3) on edges and in panels, and their displacements (3 q, m) for the dofs.

        edges : edges that supports hold, as in `held`.
        """
        points, motions = self.whole.between()
        return points, sparse.csr_array(motions @ self._dofs(edges))

    def on_edges(
        self, places: NDArray, *, edges: Mapping[int, NDArray]
    ) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Displacements (3 e p, m) at places (e, p) of edges, and turns (2 e (p - 1), m) between.

        edges : edges that supports hold, as in `held`.
        """
        made, dofs = self.whole, self._dofs(edges)
        between = 0.5 * (places[:, 1:] + places[:, :-1])
        moved, turned = made.on_edges(places), made.turns_on_edges(between)
        return sparse.csr_array(moved @ dofs), sparse.csr_array(turned @ dofs)

    @property
    def _fold_hinges(self) -> FoldHinges:
        count = len(self.folds)
        return FoldHinges(
            fold=np.arange(count),
            nodes=self.folds,
            corners=self.nodes[self.folds],
            hidden=np.full((count, 2), NO_DOF),
            per_hidden=0.0,
            rest=self.fold_rest,
            stiffness=self.fold_stiffness,
            softness=np.zeros(count),
            row=np.arange(count),
        )

    @property
    def slope(self) -> NDArray:
        """Stiffness of the folds at rest, N m/rad."""
        law = self.fold_law.elastic
        return self.fold_stiffness * law.slope(self.pattern.dihedrals, self.fold_rest)


def superelements(
    pattern: Pattern | Patterned,
    sheet: Sheet,
    *,
    level: int = 5,
    divisions: int | None = None,
    mass: str = "consistent",
    fold_law: FoldLaws = EnhancedLinear(),
    crease_stiffness: calibration.Folds = None,
    crease_rest: calibration.PerCrease = None,
    clamped: str | Sequence[Sequence[int]] = (),
    rigid: str | Sequence[int] | None = None,
    vertex_radius: float | None = None,
) -> Superelements:
    """Discretize a pattern as superelements: linear analyses with the accuracy of a shell.

    Each panel is a small shell, condensed onto shapes of its edges and a few vibrations with the
    edges held (Craig and Bampton, AIAA J. 6, 1968). Congruent panels are condensed once. The
    structure is linear about the rest state: modes, frequency responses and small static loads.

    Parameters
    ----------
    pattern : Pattern
    sheet : Sheet
        The sheet, with its density; its length-scale ratio determines the stiffness of creases.
    level : int, default 5
        Number of shapes, 1 to 5; each level contains the lower ones. Level 5 is within 1 % of a
        shell on the same mesh.
    divisions : int, optional
        Pieces of every edge, a multiple of 4. By default panels are extrapolated from meshes of 8,
        16 and 24 divisions, to the limit of fine meshes.
    mass : "consistent"
        The mass of the shells; there is no other rule.
    fold_law, crease_stiffness, crease_rest, clamped, rigid
        As in `shell`. Creases have the slope of the law at rest.
    vertex_radius : float, optional
        Distance from every vertex (m) within which panels do not stretch, as in `shell`; by default
        the largest thickness of the sheet.

    Returns
    -------
    Superelements

    Raises
    ------
    InputError
        An argument out of range; a panel that cannot be meshed.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(1e9, 0.3, thickness=0.01, density=1000.0)
    >>> fd.superelements(pattern, sheet, level=1)
    <Superelements: 2 panels, 1 folds, level 1, 114 dofs>
    """
    pattern, sheet = checked_kinds(pattern, sheet)
    level = whole("level", level, least=1, most=len(LEVELS))
    if divisions is not None:
        divisions = whole("divisions", divisions, least=4)
    fold_law, laws = laws_given(fold_law)
    for law in laws:
        if isinstance(law.elastic, Superlinear):
            raise InputError(
                f" = {law.name!r}: has no slope at rest, which superelements need; take "
                '"linear" or "enhanced"',
                "fold_law",
            )
    calibration.check_sheet(sheet, pattern)
    if sheet.density is None:
        raise InputError("sheet: density is missing: give it (kg/m3), the panels' mass needs it")
    radius = float(np.max(sheet.values("thickness", len(pattern.faces))))
    if vertex_radius is not None:
        radius = length("vertex_radius", vertex_radius)
    plates = checked_panels(rigid, len(pattern.faces))
    check_welds(plates, pattern)
    options = SuperelementsOptions(
        level, divisions, choice("mass", mass, MASSES), fold_law, crease_stiffness,
        crease_rest, boundary_edges(clamped, pattern, "clamped"), plates, vertex_radius,
    )  # fmt: skip
    pieces = EXTRAPOLATED if divisions is None else (divisions,)
    fans = [(face[0], *face[k : k + 2]) for face in pattern.faces for k in range(1, len(face) - 1)]
    panel = [number for number, face in enumerate(pattern.faces) for _ in face[2:]]
    made = Superelements(
        nodes=pattern.vertices,
        triangles=np.array(fans, np.int64),
        triangle_panel=np.array(panel),
        folds=_folds(pattern),
        fold_stiffness=calibration.fold_stiffness(options.crease_stiffness, pattern, sheet),
        fold_rest=calibration.fold_rest(options.crease_rest, pattern.dihedrals, pattern),
        pattern=pattern,
        sheet=sheet,
        options=options,
        meshes=Meshes(tuple(grading(pattern, n, radius) for n in pieces), pieces),
    )
    _ = made.plates  # refuse rigid panels that are not flat
    return made.marked()


def _folds(pattern: Pattern) -> NDArray:
    """Hinge rows (nf, 4) of the creases: axis j, k, then the next corners i, l of both panels."""
    rows = []
    for edge, panels, ways in zip(
        pattern.creases.tolist(), pattern.crease_faces.tolist(), pattern.crease_ways, strict=True
    ):
        wings = []
        for panel, forward in zip(panels, ways * [1, -1], strict=True):
            face, last = pattern.faces[panel], edge[:: int(forward)][1]
            wings.append(face[(face.index(last) + 1) % len(face)])
        rows.append((*edge, *wings))
    return np.array(rows, np.int64).reshape(-1, 4)
