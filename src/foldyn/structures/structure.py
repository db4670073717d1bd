"""`Structure`: nodes, bars, hinges and mass; its energy, internal force and tangent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn import materials, mechanics
from foldyn.algebra.solvers import Fill
from foldyn.arguments import Check, Checked
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import Following, joined, moments, pushes, tensions
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.mechanics.plates import RIDES, handed_over
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around, edge_lookup, edge_of
from foldyn.structures import edge_angles
from foldyn.structures.bars_hinges import GROUPS, BarsHingesTerm
from foldyn.structures.bars_plates import BarsPlatesTerm, ClampsTerm, balanced
from foldyn.structures.calibration import Folds, PerCrease, folds_given, per_crease
from foldyn.structures.discretized import Discretized, HingeKind, read_only
from foldyn.structures.fold_law import FoldLaws
from foldyn.structures.held_edges import Guided, clamp_points, straight_in_bending
from foldyn.structures.mass import MASS_RULES, Surface, lumped
from foldyn.structures.membranes import PanelKind, swelling
from foldyn.structures.mesh import double_areas, hinge_angles
from foldyn.structures.panel_plate import Outline
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.sheet import Sheet
from foldyn.structures.swelling import Chords, Swelling, chords, mean_of_neighbors
from foldyn.values import choice

FILL = Fill(2700.0, 340, "pattern", "take fewer panels, or an explicit method of motion")
"""Largest memory of `modes` and `trace` on flat lattices, measured with SuperLU: 13, 20 and 26 kB
per dof with 9,843, 60,603 and 241,203 dofs."""
SCHEMES = ("n5b8", "n4b5", "n5b8e")
CALIBRATIONS = ("standard", "merlin2", "plate")
MEMBRANES = ("bars", "panel")


@dataclass(frozen=True)
class ModelOptions(Checked):
    """All options of a structure; see `discretize` and `foldyn.structures.presets`."""

    scheme: Annotated[str, Check(choice, known=SCHEMES)] = "n5b8"
    mass: str = "consistent"
    bar_law: str | materials.BarLaw = "ogden"
    fold_law: FoldLaws = materials.EnhancedLinear()
    bend_law: str | materials.HingeLaw = "linear"
    calibration: Annotated[str, Check(choice, known=CALIBRATIONS)] = "plate"
    crease_stiffness: Annotated[Folds, Check(folds_given, unit="N m/rad per m")] = None
    crease_rest: Annotated[PerCrease, Check(per_crease, unit="degrees")] = None
    clamped: tuple[Edge, ...] = ()
    rigid: str | tuple[int, ...] | None = None
    straight: tuple[Edge, ...] = ()
    guided: tuple[Guided, ...] = ()
    membrane: Annotated[str, Check(choice, known=MEMBRANES)] = "bars"

    @property
    def bowed(self) -> bool:
        """Whether edges that are not `straight` bow between their ends."""
        return self.scheme == "n5b8e" or self.membrane == "panel"


def _none(width: int, kind: type = np.int64) -> NDArray:
    return np.zeros((0, width), kind) if width > 1 else np.zeros(0, kind)


@dataclass(frozen=True, eq=False, repr=False)
class Structure(Discretized):
    """A discretized pattern; usually made by `discretize`.

    Attributes
    ----------
    nodes : (n, 3)
        Rest positions (m): the pattern's vertices, then panel centers in panel order.
    bars, bar_length, bar_area : (nb, 2), (nb,), (nb,)
        Inner bars, then creases, then boundary edges; m and m2.
    folds, fold_stiffness, fold_rest : (nf, 4), (nf,), (nf,)
        Hinge rows (axis j, k, wings i, l) in the order of `pattern.creases`; stiffness of the
        whole crease (N m/rad); rest dihedral (rad).
    panel_softness : (nf,)
        Turn (rad/(N m)) of the panels at each crease per unit of its moment; it is part of the turn
        of the fold (`foldyn.materials.series`).
    bends, bend_stiffness, bend_rest : (nh, 4), (nh,), (nh,)
        The same for the hinges inside panels.
    bend_onset : (nh,)
        Turn (rad) above which bends with the law `PlateSuperlinear` are nonlinear, if the law has
        no onset of its own.
    triangles, triangle_panel : (nt, 3), (nt,)
        Triangles, counter-clockwise from the front, and the panel of each.
    centers : (np,)
        Node number of each panel's center, -1 if it has none.
    clamps, clamp_stiffness : (c, 3), (c,)
        Triangles at clamped edges, from the edge's first end; stiffness (N m/rad).
    edge_plates : EdgePlates or None
        Panels as plates, for the scheme n5b8e.
    membranes : tuple of PanelKind
        Coupling of the bars of panels, for `membrane = "panel"`, which does not use `bar_area`.
    edge_gives : (g, 2)
        Vertices of the edge of each give, by which edges give way near their ends in the plane of
        panels; for the scheme n5b8e.
    by_folds : bool
        Whether the dofs of edge angles are those of explicit methods; see `mechanics.plates`.
    pattern, sheet, options
        Input from which the structure was made.
    """

    nodes: NDArray
    bars: NDArray
    bar_area: NDArray
    sheet: Sheet
    options: ModelOptions = field(default_factory=ModelOptions)
    pattern: Pattern | None = None
    folds: NDArray = field(default_factory=lambda: _none(4))
    fold_stiffness: NDArray = field(default_factory=lambda: _none(1, float))
    fold_rest: NDArray = field(default_factory=lambda: _none(1, float))
    panel_softness: NDArray = field(default_factory=lambda: _none(1, float))
    bends: NDArray = field(default_factory=lambda: _none(4))
    bend_stiffness: NDArray = field(default_factory=lambda: _none(1, float))
    bend_rest: NDArray = field(default_factory=lambda: _none(1, float))
    bend_onset: NDArray = field(default_factory=lambda: _none(1, float))
    triangles: NDArray = field(default_factory=lambda: _none(3))
    triangle_panel: NDArray = field(default_factory=lambda: _none(1))
    centers: NDArray = field(default_factory=lambda: _none(1))
    node_mass: NDArray | None = None
    clamps: NDArray = field(default_factory=lambda: _none(3))
    clamp_stiffness: NDArray = field(default_factory=lambda: _none(1, float))
    edge_plates: edge_angles.EdgePlates | None = None
    membranes: tuple[PanelKind, ...] = ()
    edge_gives: NDArray = field(default_factory=lambda: _none(2))
    by_folds: bool = False

    def __repr__(self) -> str:
        """One line with the counts."""
        return (
            f"<Structure {self.options.scheme}: {len(self.nodes)} nodes, {len(self.bars)} bars, "
            f"{len(self.folds)} folds, {len(self.bends)} bends, mass {self.options.mass}>"
        )

    kind: ClassVar[str] = "bars_and_hinges"
    energy_groups: ClassVar[Mapping[str, str]] = GROUPS
    fill: ClassVar[Fill] = FILL

    @cached_property
    def bowed_edges(self) -> frozenset[Edge]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Edges that may bow between their ends; see `Discretized`."""
        if self.pattern is None or not self.options.bowed:
            return frozenset()
        return frozenset(edge_lookup(self.pattern.lines)) - {
            *self.options.straight,
            *((low, high) for low, high, _ in self.options.guided),
            *self.options.clamped,
        }

    @property
    def _softness(self) -> NDArray:
        """`panel_softness`, or zeros."""
        return self.panel_softness if len(self.panel_softness) else np.zeros(len(self.folds))

    @property
    def bar_stiffness(self) -> NDArray:
        """E A / L (nb,) of the bars, N/m."""
        return self.sheet.youngs_modulus * self.bar_area / self.bar_length

    @cached_property
    def bar_law(self) -> materials.BarLaw:
        """Law of the bars."""
        return materials.bar_law(self.options.bar_law)

    @cached_property
    def bend_law(self) -> materials.HingeLaw:
        """Law of the bends."""
        return materials.hinge_law(self.options.bend_law, "bend_law")

    @cached_property
    def model(self) -> mechanics.BarsHinges:
        """Arrays for the compiled kernels."""
        hinges = tuple(
            own.arrays(group) for group, kind in enumerate(self.hinge_kinds) for own in kind.by_law
        )
        return mechanics.build(self.nodes, self.bars, self.bar_stiffness, self.bar_law, hinges)

    @cached_property
    def body(self) -> Assembly:
        """The model for solvers."""
        if self.edge_plates is not None:
            return self._coupled(self._plates_term(self.edge_plates))
        rows = [self._rows(group, kind.nodes) for group, kind in enumerate(self.hinge_kinds)]
        laws = tuple((kind.law, len(kind.nodes)) for kind in self.hinge_kinds)
        body = self._coupled(BarsHingesTerm(self.model, np.concatenate(rows), laws, self._softness))
        if not len(self.clamps):
            return body
        clamps = edge_angles.clamps_model(self.nodes, self.clamps, self.clamp_stiffness)
        linear = materials.LinearHinge()
        return body.with_terms(ClampsTerm(clamps, (linear, linear)))

    def _coupled(self, sheet: BarsHingesTerm | BarsPlatesTerm) -> Assembly:
        """A body: the sheet, with the membranes of the panels in place of independent bars."""
        if not self.membranes:
            return Assembly(sheet)
        plates = self.edge_plates
        first = self.nodes.size + (0 if plates is None else len(plates.rotation_hinge))
        coupled = (own._replace(gives=first + own.gives) for _, own in self.membranes)
        terms = (MembranesTerm(own, sheet.rows) for own in coupled)
        return Assembly(sheet.hinges_alone(), *terms)

    @property
    def massless(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Description of the massless dofs; empty if there are none."""
        return "" if self.edge_plates is None else "the edge angles of the scheme n5b8e"

    @property
    def _axes(self) -> list[list[int]]:
        """Nodes on the axes of the hinges, folds first."""
        return np.concatenate([self.folds, self.bends])[:, :2].tolist()

    def _plates_term(self, plates: edge_angles.EdgePlates) -> BarsPlatesTerm:
        if len(self.edge_gives):  # unlike dofs of plates
            hinge = {frozenset(axis): k for k, axis in enumerate(self._axes)}
            gives = [hinge[frozenset(edge)] for edge in self.edge_gives.tolist()]
            plates = plates._replace(rotation_hinge=np.append(plates.rotation_hinge, gives))
        model = edge_angles.plates_model(
            self.nodes, self.bars, self.bar_stiffness, self.bar_law, self.folds,
            self.fold_stiffness, self.fold_rest, self.fold_law, self.bends, self.bend_rest, plates,
            self.clamps, self.by_folds,
        )  # fmt: skip
        return BarsPlatesTerm(model, (self.fold_law, self.bend_law))

    def _rows(self, group: int, hinges: NDArray) -> NDArray:
        """Rows in `model.hinges` of the folds (group 0) or bends (1), which may be interleaved."""
        there = np.flatnonzero(self.model.hinge_group == group)
        rows = np.empty(len(there), np.int64)
        rows[np.lexsort(hinges.T)] = there[np.lexsort(self.model.hinges[there].astype(np.int64).T)]
        return rows

    @property
    def hinge_kinds(self) -> tuple[HingeKind, ...]:
        """The folds and the bends, with their laws."""
        law = self.bend_law
        own = isinstance(law, materials.PlateSuperlinear) and law.onset is None
        onset = self.bend_onset if own else None
        folds = self.folds, self.fold_stiffness, self.fold_rest
        bends = self.bends, self.bend_stiffness, self.bend_rest
        fold = HingeKind("fold", self.fold_law, *folds, softness=self._softness)
        return fold, HingeKind("bend", law, *bends, onset=onset)

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg; one value serves the three axes.

        Raises
        ------
        InputError
            The sheet has no density, or the rule does not suit the structure.
        """
        if self.node_mass is not None:
            mass = lumped(self.node_mass)
        else:
            mass = MASS_RULES[self.options.mass](self.surface)
        mass.sum_duplicates()  # sorts, which read-only arrays no longer can
        for array in (mass.data, mass.indices, mass.indptr):
            read_only(array)
        return mass

    def swollen(self, strain: NDArray, curvature: NDArray) -> Swelling:
        """Effect of swelling; a bar between panels gets their mean strain. See `Discretized`."""
        stress, none = np.zeros(0), np.zeros(0)
        if self.membranes:
            parts, longer, push = swelling(self.membranes, self.nodes, strain)
        else:
            free = mean_of_neighbors(self.bars, self.triangles, strain[self.triangle_panel, 0, 0])
            stress, longer, push = self.bar_law.stress(1.0 + free), none, none
            parts = [tensions(self.nodes, self.bars, -self.bar_stiffness * stress)]
        if self.edge_plates is not None:
            sheet = self.body.sheet
            moment, on_edges, own = self._curled(self.edge_plates, curvature)
            if np.any(curvature):
                turning, on_edges = handed_over(sheet.model, on_edges)
                parts += [moment, pushes(sheet.hidden[: len(on_edges)], on_edges)]
                if turning.any():
                    parts.append(moments(self.nodes[self.folds], self.folds, turning))
            free = edge_angles.free_angles(self.edge_plates, own)
            forces = joined((part, 0) for part in parts)
            turns = np.zeros(len(sheet.rest_angles))
            return Swelling(turns, forces, (longer, free), (push, own), stress)
        of_hinges, of_clamps = self._chords
        turn, own = none, none
        if len(self.clamps):
            turn = of_clamps.turns(curvature)
            own = self.clamp_stiffness * turn
            parts.append(self._clamping(own))
        forces = joined((part, 0) for part in parts)
        return Swelling(of_hinges.turns(curvature), forces, (longer, turn), (push, own), stress)

    def _clamping(self, moment: NDArray) -> Following:
        """Moments (c,), N m, on the hinges of clamped edges."""
        points = clamp_points(self.nodes - self.nodes.mean(axis=0), self.clamps)
        return moments(points, np.column_stack([self.clamps, np.full(len(moment), RIDES)]), moment)

    def _curled(
        self, plates: edge_angles.EdgePlates, curvature: NDArray
    ) -> tuple[Following, NDArray, NDArray]:
        """Moments on the hinges of plates, and forces (r,), N, on the dofs of their edge angles.

        Also returns the moments (nq,), N m, of all angles of plates. All are linear in `curvature`,
        the free curvatures (np,), 1/m, of the panels.
        """
        assert self.pattern is not None
        area = 0.5 * np.linalg.norm(double_areas(self.nodes, self.triangles), axis=1)
        area = np.bincount(self.triangle_panel, area)
        hinges, on_hinge = np.concatenate([self.folds, self.bends]), plates.angle >= 0
        count = len(hinges)
        moment = edge_angles.curl_moments(
            plates, self.outlines, curvature, self.pattern, self.sheet, area, count
        )
        turning = np.bincount(plates.angle[on_hinge], moment[on_hinge], count + len(self.clamps))
        parts = [moments(self.nodes[hinges], hinges, turning[:count])]
        if len(self.clamps):
            parts.append(self._clamping(turning[count:]))
        push, count = self.body.sheet.per_hidden * moment[~on_hinge], len(plates.rotation_hinge)
        pushes = np.bincount(-1 - plates.angle[~on_hinge], push, minlength=count)
        return joined((part, 0) for part in parts), pushes, moment

    @cached_property
    def surface(self) -> Surface:
        """Triangles with masses; panels as plates are level at clamped edges. See `Discretized`."""
        made = super().surface
        if self.edge_plates is None:
            return made
        stiff = [made.faces[p] for p in rigid_panels(self.options.rigid, len(made.faces))]
        edges = {edge_of(a, b) for face in stiff for a, b in around(face)}
        return made._replace(clamped=tuple(e for e in self.options.clamped if e not in edges))

    @cached_property
    def outlines(self) -> list[Outline | None]:
        """Outlines of the panels as plates; None for rigid panels."""
        pattern, options = self.pattern, self.options
        assert pattern is not None
        hinges = np.concatenate([self.folds, self.bends[len(self.bends) - len(pattern.welds) :]])
        straight = straight_in_bending(options.straight, options.guided, pattern, self.sheet)
        return edge_angles.outlines(
            self.nodes, self.centers, hinges, pattern, self.sheet, straight,
            rigid_panels(options.rigid, len(pattern.faces)), options.clamped,
        )  # fmt: skip

    @cached_property
    def _chords(self) -> tuple[Chords, Chords]:
        """Turns of the hinges, folds first, per curvature of panels; the same for the clamps."""
        of_hinges, of_clamps = (
            chords(self.nodes, self.triangles, self.triangle_panel, rows)
            for rows in (np.concatenate([kind.nodes for kind in self.hinge_kinds]), self.clamps)
        )
        return of_hinges, of_clamps

    def energies(self, u: ArrayLike) -> Mapping[str, float]:
        """Strain energies (J) of bars, folds and bends at displacement u (n, 3), m."""
        energies = self.body.energies(self.body.dofs(self._displacement(u)))
        return dict(zip(GROUPS, energies.tolist(), strict=True))

    def energy(self, u: ArrayLike) -> float:
        """Strain energy (J) at displacement u (n, 3), m."""
        return sum(self.energies(u).values())

    def internal_force(self, u: ArrayLike) -> NDArray:
        """Internal force (n, 3), N, at displacement u (n, 3), m: the gradient of the energy."""
        nodal = self.body.internal(self.body.dofs(self._displacement(u)))[: self.nodes.size]
        return nodal.reshape(-1, 3)

    def tangent(self, u: ArrayLike, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent stiffness (3n, 3n), N/m, at displacement u (n, 3), m; dof = 3 node + axis.

        Edge angles of the scheme n5b8e stay in balance.

        Parameters
        ----------
        u : (n, 3)
            Displacement.
        floor : float, optional
            Lower bound for hinge slopes, relative to the hinge's stiffness. Without it the tangent
            is the exact second derivative of the energy: singular at rest where superlinear bends
            have no slope.
        """
        tangent = self.body.tangent(self.body.dofs(self._displacement(u)), floor)
        return balanced(tangent, self.body.hidden)

    def dihedrals(self, u: ArrayLike) -> tuple[NDArray, NDArray]:
        """Dihedrals (rad) of folds (nf,) and bends (nh,) at displacement u (n, 3), m."""
        x = self.nodes + self._displacement(u)
        return hinge_angles(x, self.folds), hinge_angles(x, self.bends)
