"""Base of all structures: a discretized pattern, the form in which a case holds it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn.algebra.solvers import Fill
from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, HingeLaw, MemoryLaw, PlateSuperlinear
from foldyn.materials.plate_superlinear import onset_parameters
from foldyn.materials.series import in_series
from foldyn.mechanics import Hinges
from foldyn.mechanics.assembly import Assembly
from foldyn.patterns.pattern import refuse_junctions
from foldyn.patterns.picture import picture
from foldyn.patterns.topology import Edge
from foldyn.structures.fold_law import law_of_folds
from foldyn.structures.mass import Surface, center_of_mass, inertia_tensor, row_sums
from foldyn.structures.mesh import double_areas, lengths
from foldyn.structures.rigid_plates import Plate, rigid_plates
from foldyn.structures.sheet import Sheet
from foldyn.structures.swelling import Swelling


class HingeKind(NamedTuple):
    """Hinges of one kind and law: end nodes (k, 2 or more), stiffness and rest angle.

    onset : onset of each hinge (k,), rad, if the law has no onset of its own.
    softness : softness of the adjacent panels (k,), rad/(N m), if they are compliant.
    """

    name: str
    law: HingeLaw
    nodes: NDArray
    stiffness: NDArray
    rest: NDArray
    onset: NDArray | None = None
    softness: NDArray | None = None

    @property
    def share(self) -> NDArray:
        """Share (k,) of a small turn that the crease takes, or the hinge itself.

        The share is 1 for laws that lock, since the panels themselves meet, and for creases that
        yield or creep: such a crease takes nearly the whole turn, as little moment remains for the
        panels.
        """
        if self.softness is None:
            return np.ones(len(self.stiffness))
        share = 1.0 - self.softness * self.stiffness
        return self.law.each(
            lambda law, rows: np.ones(len(share[rows])) if _takes_all(law) else share[rows]
        )

    @property
    def by_law(self) -> tuple[HingeKind, ...]:
        """The hinges of each law."""
        parts = self.law.parts
        return (self,) if len(parts) == 1 else tuple(
            HingeKind(
                self.name, law, self.nodes[rows], self.stiffness[rows], self.rest[rows],
                softness=None if self.softness is None else self.softness[rows],
            )
            for law, rows in parts
        )  # fmt: skip

    def arrays(self, group: int) -> Hinges:
        """The hinges, of one law, for the compiled kernels; group : see `Hinges`."""
        parameters = None if self.onset is None else onset_parameters(self.onset)
        own = self.nodes, self.stiffness, self.rest, self.law, parameters, self.share
        return Hinges(*own, group)

    def law_of(self, row: int) -> HingeLaw:
        """Law of one hinge."""
        if self.onset is None:
            return self.law.at([row])
        return PlateSuperlinear(float(np.degrees(self.onset[row])))

    def energy(self, theta: NDArray, rest: NDArray) -> NDArray:
        """Energies / k (rad^2) of the hinges at dihedrals and rest angles (..., k), rad."""
        if self.onset is None:
            return in_series(self.law, theta, rest, self.share)[0]
        unit = PlateSuperlinear(float(np.degrees(1.0)))
        return self.onset**2 * unit.energy((theta - rest) / self.onset, 0.0)


def _takes_all(law: HingeLaw) -> bool:
    """Whether a crease takes the whole turn of its hinge; see `HingeKind.share`."""
    flows = isinstance(law, MemoryLaw) and not law.relaxes
    return flows or isinstance(law.elastic, EnhancedLinear)


class Distributed(NamedTuple):
    """Loads on the panels, edges and creases of a pattern; None is no load."""

    panels: NDArray | None = None  # (np, 3) force per area, N/m2
    edges: NDArray | None = None  # (ne, 3) force per length, N/m, in the order of `pattern.lines`
    creases: NDArray | None = None  # (nf,) moment that opens each crease, N m
    strain: NDArray | None = None  # (np, 3, 3) free strain of each panel
    curvature: NDArray | None = None  # (np,) and its free curvature, 1/m


def read_only(array: NDArray) -> NDArray:
    """Return the array, made read-only."""
    array.setflags(write=False)
    return array


class Discretized:
    """Base of the data classes for structures, with read-only arrays.

    Attributes
    ----------
    nodes, bars : (n, 3), (nb, 2)
        Rest positions (m), the pattern's vertices first; pairs of nodes that must not coincide.
    triangles, triangle_panel : (nt, 3), (nt,)
        Counter-clockwise from the front, and the panel of each.
    centers : (np,)
        Node number of each panel's center, -1 if it has none.
    mass : (n, n)
        Nodal mass matrix, kg; one value serves the three axes.
    folds, fold_rest : (nf, 4), (nf,)
        Hinge row and rest angle (rad) of each fold.
    body : Assembly
        Model for solvers.
    kind : str
        Name of this kind of structure in case files.
    hinge_kinds : tuple of HingeKind
        The folds, then other hinges, each kind with its law.
    membranes : sequence
        Membranes of the panels, if panels resist stretching as membranes.
    energy_groups : mapping of str to str
        Parts of the strain energy, with descriptions.
    plates : tuple of Plate
        The rigid panels; three corners of each determine all its nodes.
    linear : str
        Plural name of a model for small displacements about rest; empty for other models.
    massless : str
        Description of the massless dofs, such as "the rotations of a shell"; empty if none.
    fill : Fill
        Memory needed for the factors of the tangent.
    clamped_nodes : sequence of (k,)
        Nodes along each clamped edge of a mesh, from one end to the other.
    bowed_edges : collection of (low, high)
        Edges of the pattern that may bow between their ends without nodes there.
    by_folds : bool
        Whether dofs beside folds are those of explicit methods, see `foldyn.mechanics.plates`.
    as_made : bool
        Whether `discretize`, or the model's own function, made it and can rebuild it from pattern,
        sheet and options. `dataclasses.replace` resets it.
    """

    nodes: NDArray
    bars: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    pattern: Any
    sheet: Sheet
    options: Any
    mass: sparse.csr_array
    folds: NDArray
    fold_stiffness: NDArray
    fold_rest: NDArray
    body: Assembly
    fill: Fill
    energy_groups: ClassVar[Mapping[str, str]]
    kind: ClassVar[str]
    bar_law: Any = None  # BarLaw
    membranes: Sequence[Any]
    linear: ClassVar[str] = ""
    massless: ClassVar[str] = ""
    clamped_nodes: Sequence[NDArray] = ()
    bowed_edges: Collection[Edge] = ()
    by_folds: bool = False
    as_made: bool = False
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, read_only(np.array(value)))

    def marked(self) -> Self:
        """Set `as_made`; return the structure itself."""
        object.__setattr__(self, "as_made", True)
        return self

    def altered(self, **changes: Any) -> Self:
        """The structure with changes after which it can be rebuilt, if it can."""
        other = replace(self, **changes)
        return other.marked() if self.as_made else other

    @cached_property
    def fold_law(self) -> HingeLaw:
        """Law of the folds."""
        return law_of_folds(self.options.fold_law, self.pattern)

    @cached_property
    def centers(self) -> NDArray:
        """Center node (np,) of each panel; -1 for none."""
        return np.full(len(self.pattern.faces), -1)

    @property
    def hinge_kinds(self) -> tuple[HingeKind, ...]:
        """The folds, with their law: whole creases."""
        ends = self.pattern.creases
        return (HingeKind("fold", self.fold_law, ends, self.fold_stiffness, self.fold_rest),)

    @cached_property
    def bar_length(self) -> NDArray:
        """Rest lengths of the bars (nb,), m."""
        return read_only(lengths(self.nodes, self.bars))

    @cached_property
    def total_mass(self) -> float:
        """Mass (kg)."""
        return float(self.mass.sum())

    @cached_property
    def plates(self) -> tuple[Plate, ...]:
        """The rigid panels."""
        if self.pattern is None:
            return ()
        rigid, faces = getattr(self.options, "rigid", None), self.pattern.faces
        return rigid_plates(rigid, faces, self.nodes, self.triangles, self.triangle_panel)

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        return None if self.pattern is None else picture(self.pattern, repr(self))

    @cached_property
    def nodal_mass(self) -> NDArray:
        """Mass (n,) of each node, kg: the row sums of the mass matrix."""
        return read_only(row_sums(self.mass))

    @cached_property
    def center_of_mass(self) -> NDArray:
        """Center of mass (3,) at rest, m."""
        return read_only(center_of_mass(self.nodes, self.mass))

    @cached_property
    def inertia(self) -> NDArray:
        """Inertia tensor (3, 3) at rest about the center of mass, kg m2, by the mass rule.

        The consistent rule gives the panels' own inertia; lumped rules differ, see the page on mass
        rules.
        """
        return read_only(inertia_tensor(self.nodes, self.mass))

    @cached_property
    def edge_nodes(self) -> NDArray:
        """Nodes along each edge of the pattern (ne, p), from its lower to its higher vertex.

        Creases come first, then boundary edges and welds, ordered as `pattern.creases`,
        `pattern.boundary` and `pattern.welds`; p is 2, or more for a structure that cuts edges into
        pieces.
        """
        return read_only(np.array(self.pattern.lines))

    @property
    def divisions(self) -> int | None:
        """Pieces per edge of the mesh; None without a mesh."""
        return None

    def meshed(self, divisions: int) -> Discretized:
        """The structure with another mesh, if it has a mesh."""
        raise NotImplementedError

    @cached_property
    def for_explicit(self) -> Self:
        """The structure with the dofs that explicit methods take."""
        if not self.massless or self.by_folds:
            return self
        refuse_junctions(
            self.pattern,
            f"where explicit methods cannot integrate {self.massless}; take an implicit one, or "
            'bars and hinges of scheme = "n5b8"',
            "method",
        )
        return self.altered(by_folds=True)

    def held(self, edges: Mapping[int, NDArray]) -> Assembly:
        """Model for solvers if supports hold edges along their whole length.

        edges : mapping of edge, as numbered in `pattern.lines`, to the directions held (h, 3). Only
            models whose edges bow without nodes on them depend on it.
        """
        return self.body

    def spread(self, load: Distributed, edges: Mapping[int, NDArray]) -> NDArray:
        """Forces (m,), N, on all dofs of a linear model due to a distributed load.

        edges : edges that supports hold, as in `held`.
        """
        raise NotImplementedError

    def lifts(
        self, points: NDArray, panel: NDArray, *, edges: Mapping[int, NDArray]
    ) -> sparse.csr_array:
        """Displacements (k, m) normal to panels (k,) at points (k, 3) in them, in linear models.

        edges : edges that supports hold, as in `held`.
        """
        raise NotImplementedError

    def swollen(self, strain: NDArray, curvature: NDArray) -> Swelling:
        """Additions to the structure if panels swell: if they would stretch and curl when free.

        strain : (np, 3, 3) free strain of each panel, as a tensor.
        curvature : (np,) 1/m, positive toward the front.
        """
        raise InputError("this structure has no panels that could swell")

    @cached_property
    def board_share(self) -> NDArray | float:
        """Area of each thick panel's board, relative to the panel, (np,); 1 for a thin pattern."""
        if self.pattern is None or self.pattern.boards is None:
            return 1.0
        area = 0.5 * np.linalg.norm(double_areas(self.nodes, self.triangles), axis=1)
        return self.pattern.boards.areas / np.bincount(self.triangle_panel, area)

    @cached_property
    def surface(self) -> Surface:
        """Triangles with their masses, the input of mass rules.

        Raises
        ------
        InputError
            The sheet has no density.
        """
        if self.sheet.density is None:
            raise InputError("sheet: density is missing: give it (kg/m3), the mass needs it")
        faces = self.pattern.faces if self.pattern is not None else ()
        welds = self.pattern.welds.tolist() if self.pattern is not None else []
        count = max(len(faces), int(self.triangle_panel.max(initial=-1)) + 1)
        return Surface(
            nodes=self.nodes,
            faces=faces,
            centers=self.centers,
            triangles=self.triangles,
            triangle_panel=self.triangle_panel,
            triangle_area=0.5 * np.linalg.norm(double_areas(self.nodes, self.triangles), axis=1),
            areal_density=self.sheet.values("areal_density", count) * self.board_share,
            welds=tuple((low, high) for low, high in welds),
        )

    def _displacement(self, u: ArrayLike) -> NDArray:
        """Displacement (n, 3), checked."""
        array = np.ascontiguousarray(u, float)
        if array.shape not in (self.nodes.shape, (self.nodes.size,)):
            raise InputError(
                f"displacement of shape {np.shape(u)}: give {self.nodes.shape} (nodes, axes)"
            )
        return array.reshape(self.nodes.shape)
