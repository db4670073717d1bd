"""`Shell`: a pattern as a thin shell with exact creases; `shell` makes it."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn import mechanics
from foldyn.algebra.solvers import Fill
from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, HingeLaw, hinge_law
from foldyn.memory import check_memory
from foldyn.patterns import Pattern
from foldyn.shells.body import GROUPS, ShellBody
from foldyn.shells.element import side_stiffness, without_free_sides
from foldyn.shells.kernels import ShellModel
from foldyn.shells.mesh import Edge, shell_mesh
from foldyn.shells.sides import Sides, sides
from foldyn.shells.sparsity import ShellPattern
from foldyn.structures import Sheet
from foldyn.structures.calibration import check_scale, fold_stiffness
from foldyn.structures.discretize import edge_lengths, per_crease
from foldyn.structures.discretize import fold_rest as rest_of
from foldyn.structures.discretized import Discretized, HingeKind
from foldyn.structures.mass import MASS_RULES
from foldyn.values import show, whole

MASSES = {"lumped": "centroid", "consistent": "consistent"}  # and the rules they are
PER_NODE = 16_000.0
"""Bytes a node with its tangent: 14,200 and 16,000 measured with 3,721 and 14,641 nodes."""
PER_DOUBLING, LEAST = 5900.0, 1450
"""Memory of its factors, see `Fill`: 23 and 35 kB a dof with 21,963 and 87,123 dofs."""


@dataclass(frozen=True)
class ShellOptions:
    """Arguments of `shell` beside pattern and sheet; see there."""

    divisions: int = 16
    mass: str = "lumped"
    fold_law: str | HingeLaw = EnhancedLinear()
    crease_stiffness: float | Sequence[float] | None = None
    crease_rest: float | Sequence[float] | None = None
    clamped: tuple[Edge, ...] = ()


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
        How the triangles meet.
    fold_stiffness : (nf,)
        Stiffness of the whole creases, in the order of `pattern.creases`, N m/rad.
    piece_rest : (c,)
        Rest dihedral of each piece of a crease, in the order of `sides`, rad.
    pattern, sheet, options
        What it was made of.
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

    def __repr__(self) -> str:
        """One line with the counts."""
        return (
            f"<Shell: {len(self.nodes)} nodes, {len(self.triangles)} triangles, "
            f"{len(self.fold_stiffness)} folds, mass {self.options.mass}>"
        )

    kind: ClassVar[str] = "shell"
    energy_groups: ClassVar[Mapping[str, str]] = GROUPS
    massless: ClassVar[str] = "the rotations of a shell"
    bar_law: ClassVar[None] = None

    @property
    def fill(self) -> Fill:
        """Memory of the factors of its tangent."""
        return Fill(PER_DOUBLING, LEAST, f"divisions = {self.options.divisions}", "take fewer")

    @property
    def hinge_kinds(self) -> tuple[HingeKind, ...]:
        """Its folds, with their law."""
        ends = self.pattern.creases  # its hinges are pieces of creases
        return (HingeKind("fold", self.fold_law, ends, self.fold_stiffness, self.fold_rest),)

    @cached_property
    def centers(self) -> NDArray:
        """No panel has a center node."""
        return np.full(len(self.pattern.faces), -1)

    @cached_property
    def body(self) -> ShellBody:
        """What solvers take."""
        return ShellBody(self.model, self.sides.piece_crease, self.fold_law)

    @property
    def rotations(self) -> int:
        """Number of rotations beside the displacements."""
        return self.sides.rotations

    @cached_property
    def fold_law(self) -> HingeLaw:
        """Law of the folds."""
        return hinge_law(self.options.fold_law, "fold_law")

    @cached_property
    def folds(self) -> NDArray:
        """Hinge row (nf, 4) of the first piece of each crease: axis j, k, wings i, l."""
        crease, first = np.unique(self.sides.piece_crease, return_index=True)
        rows = np.zeros((len(self.fold_stiffness), 4), np.int64)
        rows[crease] = self.sides.hinges[self.sides.piece_hinge[first]]
        rows.setflags(write=False)
        return rows

    @cached_property
    def edge_nodes(self) -> NDArray:
        """Nodes along each edge (ne, divisions + 1), from its lower to its higher vertex.

        The creases come first, in their order, then the boundary edges in that of
        `pattern.boundary`.
        """
        ends = np.concatenate([self.pattern.creases, self.pattern.boundary]).reshape(-1, 2)
        count = self.options.divisions - 1
        inner = len(self.pattern.vertices) + np.arange(len(ends) * count).reshape(len(ends), count)
        found = np.concatenate([ends[:, :1], inner, ends[:, 1:]], axis=1)
        found.setflags(write=False)
        return found

    @cached_property
    def bars(self) -> NDArray:
        """Sides of the triangles (nb, 2), each once."""
        tri = self.triangles
        ends = np.stack([tri, np.roll(tri, -1, axis=1)], axis=2).reshape(-1, 2)
        found = np.unique(np.sort(ends, axis=1), axis=0)
        found.setflags(write=False)
        return found

    @cached_property
    def fold_rest(self) -> NDArray:
        """Rest dihedrals of the folds (nf,), rad: the mean along each crease."""
        rest = self.body.fold_rest
        rest.setflags(write=False)
        return rest

    @cached_property
    def _reach(self) -> float:
        """Length (m) by which a rotation becomes a displacement: that of a side."""
        return float(np.sqrt((self.bar_length**2).mean()))

    @cached_property
    def model(self) -> ShellModel:
        """The arrays that the compiled kernels work on."""
        corners, found, law = self.nodes[self.triangles], self.sides, self.fold_law
        side = np.roll(corners, -1, axis=1) - corners
        membrane, bending = side_stiffness(corners, self.sheet)
        rest = np.concatenate([self.nodes, found.wings]) - self.nodes.mean(axis=0)
        hinge_rest = mechanics.angles(rest, found.hinges.astype(np.uint32))
        along = self.nodes[found.hinges[found.piece_hinge, 1]]
        along = along - self.nodes[found.hinges[found.piece_hinge, 0]]
        length = np.linalg.norm(along, axis=1)
        whole = np.bincount(found.piece_crease, length, len(self.fold_stiffness))
        return ShellModel(
            nodes=len(self.nodes),
            rotations=self.rotations,
            per_reach=1.0 / self._reach,
            rest=rest,
            triangles=self.triangles.copy(),
            side=np.ascontiguousarray(side),
            per_length2=1.0 / np.einsum("tki,tki->tk", side, side),
            membrane=np.ascontiguousarray(membrane),
            bending=np.ascontiguousarray(without_free_sides(bending, found.free)),
            hinges=found.hinges,
            hinge_rest=hinge_rest,
            hinge=found.hinge,
            weight=found.weight,
            rotation=found.rotation,
            sign=found.sign,
            piece_hinge=found.piece_hinge,
            piece_rotations=found.piece_rotations,
            piece_stiffness=(self.fold_stiffness / whole)[found.piece_crease] * length,
            piece_rest=self.piece_rest.copy(),
            piece_parameters=law.parameters(self.piece_rest).reshape(-1, 4),
            code=int(law.code),
            addresses=np.array(law.addresses or (0, 0, 0), np.int64),
        )

    @property
    def sparsity(self) -> ShellPattern:
        """Pattern of the tangent."""
        return self.body.sparsity

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg; one value serves the three axes. Rotations have none.

        Raises
        ------
        InputError
            The sheet has no density.
        """
        return MASS_RULES[MASSES[self.options.mass]](self.surface)

    def energies(self, u: ArrayLike, rotation: ArrayLike | None = None) -> Mapping[str, float]:
        """Strain energies (J) of membrane, bending and folds at displacement u (n, 3), m.

        rotation : (r,), rad; without it the one in balance.
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
        u, x = self._state(u, None)
        return self.forces(u, x)[0]

    def tangent(
        self, u: ArrayLike, rotation: ArrayLike | None = None, floor: float = -np.inf
    ) -> sparse.csr_array:
        """Second derivative (3n + r, 3n + r) of the energy: 3 node + axis, then the rotations."""
        u, x = self._state(u, rotation)
        matrix = self.body.tangent(np.append(u, x * self._reach), floor)
        units = np.repeat([1.0, self._reach], [u.size, x.size])
        matrix.data *= np.repeat(units, np.diff(matrix.indptr)) * units[matrix.indices]
        return matrix

    def balanced(self, u: ArrayLike) -> NDArray:
        """Rotations (r,) about which there is no moment at displacement u (n, 3)."""
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
    pattern: Pattern,
    sheet: Sheet,
    divisions: int = 16,
    mass: str = "lumped",
    fold_law: str | HingeLaw = EnhancedLinear(),
    crease_stiffness: float | Sequence[float] | None = None,
    crease_rest: float | Sequence[float] | None = None,
    clamped: Sequence[Sequence[int]] = (),
) -> Shell:
    """Discretize a pattern as a thin shell of triangles with exact creases.

    Each panel bends and stretches as a sheet of its own; along a crease the sheets turn against
    each other with the stiffness of the fold, spread evenly over its length.

    Parameters
    ----------
    pattern : Pattern
    sheet : Sheet
        Its length-scale ratio enters the stiffness of the creases, as in `discretize`.
    divisions : int, default 16
        Pieces of every edge; the number of triangles grows with its square. Frequencies of the
        case studies are right to 1 % from 16 on.
    mass : {"lumped", "consistent"}
        A third of each triangle to its corners, or rho A t / 12 [2 1 1; 1 2 1; 1 1 2].
    fold_law, crease_stiffness, crease_rest
        As in `discretize`.
    clamped : sequence of (vertex, vertex)
        Boundary edges along which the sheet keeps its rest tangent in space; their nodes need a
        support of their own.

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
    if not isinstance(pattern, Pattern):
        raise InputError(f"pattern: got {type(pattern).__name__}, give a Pattern")
    if not isinstance(sheet, Sheet):
        raise InputError(f"sheet: got {type(sheet).__name__}, give a Sheet")
    divisions = whole("divisions", divisions, least=1)
    if not isinstance(mass, str) or mass not in MASSES:
        raise InputError(f"mass = {mass!r}: choose one of {', '.join(MASSES)}")
    hinge_law(fold_law, "fold_law")
    edges = _clamped(clamped, pattern)
    nodes = sum(divisions**2 * (1 if len(face) == 4 else len(face) / 2) for face in pattern.faces)
    check_memory(
        f"divisions = {show(divisions)}", f"a shell of about {float(nodes):.3g} nodes",
        PER_NODE * nodes, "take fewer",
    )  # fmt: skip
    check_scale(sheet, edge_lengths(pattern))
    mesh = shell_mesh(pattern, divisions)
    found = sides(mesh, pattern, edges)
    x = mesh.nodes
    length = np.linalg.norm(x[pattern.creases[:, 1]] - x[pattern.creases[:, 0]], axis=1)
    if crease_stiffness is None:
        stiffness = fold_stiffness(length, sheet)
    else:
        stiffness = per_crease("crease_stiffness", crease_stiffness, pattern) * length
        if (stiffness < 0.0).any():
            raise InputError("crease_stiffness: must not be negative")
    rest = rest_of(crease_rest, found.hinges[found.piece_hinge], x, pattern, found.piece_crease)
    return Shell(
        nodes=x,
        triangles=mesh.triangles,
        triangle_panel=mesh.panel,
        sides=found,
        fold_stiffness=stiffness,
        piece_rest=rest,
        pattern=pattern,
        sheet=sheet,
        options=ShellOptions(divisions, mass, fold_law, crease_stiffness, crease_rest, edges),
    ).marked()


def _clamped(given: Sequence[Sequence[int]], pattern: Pattern) -> tuple[Edge, ...]:
    boundary = {tuple(edge) for edge in pattern.boundary.tolist()}
    try:
        pairs = [tuple(sorted(operator.index(k) for k in edge)) for edge in given]
    except TypeError:
        why = f" = {show(given)}: give pairs of vertices, as in clamped=[(0, 1), (1, 2)]"
        raise InputError(why, "clamped") from None
    if inner := [pair for pair in pairs if pair not in boundary]:
        raise InputError(f": {inner[0]} is no boundary edge of the pattern", "clamped")
    return tuple((pair[0], pair[1]) for pair in pairs)
