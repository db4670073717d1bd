"""The first term of a model: the sheet itself, which numbers the dofs.

A model is a named tuple of arrays, its kernels, a `SheetTerm` that compiles them, and a structure
that gives it, within its `mechanics.assembly.Assembly`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.materials import HingeLaw
from foldyn.mechanics.tangent import Sparsity
from foldyn.mechanics.term import Folds, Strains, Term

NO_DOF = np.iinfo(np.int64).max  # where there is none: no array has it as an index


class SoftHinges(NamedTuple):
    """Hinges of a law that has no slope at rest, h of them, in a state."""

    offset: NDArray  # (h,) angle from rest, rad
    stiffness: NDArray  # (h,) N m/rad
    gradient: sparse.csr_array  # (h, m) of their angles, 1/m


class FoldHinges(NamedTuple):
    """Hinges of the folds, k of them: a fold may have several in a row, each of them a part of it.

    The bends of a model of hinges are described likewise, each as a fold of one hinge.

    The angle by which a hinge folds is its dihedral, less `per_hidden` times its hidden dofs. Where
    panels give way without such dofs, a moment of the crease alone turns the dihedral by `softness`
    times it before the hinge resists (`materials.series`).
    """

    fold: NDArray  # (k,) number of the fold
    nodes: NDArray  # (k, 4) axis j, k, wings i, l
    corners: NDArray  # (k, 4, 3) where they are at rest, m
    hidden: NDArray  # (k, 2) dofs, or NO_DOF
    per_hidden: float  # rad/m
    rest: NDArray  # (k,) rad
    stiffness: NDArray  # (k,) N m/rad
    softness: NDArray  # (k,) rad/(N m), of the panels beside
    row: NDArray  # (k,) of each in `SheetTerm.series`
    beside: NDArray | float = np.inf  # (k,) N m/rad, of panels whose edge angles are in balance

    @property
    def length(self) -> NDArray:
        """Length of each (k,), m."""
        return np.linalg.norm(self.corners[:, 1] - self.corners[:, 0], axis=1)

    @property
    def share(self) -> NDArray:
        """Length of each (k,) over that of its whole fold."""
        length = self.length
        return length / np.bincount(self.fold, length)[self.fold]

    @property
    def remembers(self) -> NDArray:
        """Whether each turns by other than its crease (k,), so that dampers give it a memory."""
        return (self.softness > 0.0) | np.isfinite(self.beside)

    @property
    def hidden_turn(self) -> NDArray:
        """Turn (k, 2) of each per unit of its hidden dofs, rad/m: 0 where it has none."""
        return np.where(self.hidden == NO_DOF, 0.0, self.per_hidden)


def no_fold_hinges() -> FoldHinges:
    """None."""
    nodes, hidden = np.zeros((0, 4), np.int64), np.zeros((0, 2), np.int64)
    empty, none = np.zeros(0), nodes[:, 0]
    return FoldHinges(none, nodes, np.zeros((0, 4, 3)), hidden, 0.0, empty, empty, empty, none)


class Blocks(Protocol):
    """A tangent as 3x3 blocks, for the matrix of an implicit step.

    Attributes
    ----------
    pattern : Sparsity
        Where they stand.
    order : ndarray of int
        All dofs, 3 row + axis, in an order that keeps a factorization narrow.
    unused : ndarray of int
        Dofs that only fill up the last row.
    """

    pattern: Sparsity
    order: NDArray
    unused: NDArray

    def put(
        self, of: Any, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """Fill `out` (nnz, 3, 3) of a pattern that contains this one with the tangent at u.

        of : what has made the blocks, or the same with other rest angles.

        before : the start of the step or, `again`, the last iterate, from which stresses are
        extrapolated to u; all (rows, 3).
        """
        ...

    def put_mean(
        self, of: Any, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray, before: NDArray,
        again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """Fill it likewise with the derivative of the mean forces from u0 to u1 by u1.

        angle : (nh,) dihedrals at u0.
        """
        ...

    def filled(self, pattern: Sparsity) -> NDArray:
        """Which entries (nnz, 3, 3) of a pattern that contains this one `put` may fill."""
        ...


class SheetTerm(Term):
    """A sheet with its rest angles, m dofs; see `Term`.

    Its kernels write forces and energies; those of other terms add to them. What has a default here
    is that of a sheet without hinges and hidden dofs.

    Attributes
    ----------
    model : named tuple
        The arrays of its kernels.
    size, rows : int
        Number m of the dofs, and rows of the arrays that hold them.
    hidden : ndarray of int
        Dofs beside the displacements of the nodes: they have no mass.
    per_hidden : float
        Turn that a hidden dof of 1 m stands for, rad/m.
    offsets : int
        Folds whose panels give way to moments of the crease alone, nf, or dofs in balance; or none.
    """

    model: Any
    size: int
    rows: int
    hidden: NDArray = np.zeros(0, np.int64)
    per_hidden: float = 0.0
    offsets: int = 0
    shared = True

    # ------------------------------------------------------------------ mechanics
    @abstractmethod
    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Derivative (m, m) of its forces; slopes per unit stiffness below `floor` are raised."""

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """The matrix that a step of Newton's method takes at q, after one from `before`."""
        return self.tangent(q)

    def mean_tangent(
        self, q0: NDArray, q1: NDArray, angle: NDArray, before: NDArray, again: bool
    ) -> sparse.csr_array:
        """The matrix for its mean forces from q0 to q1; see `Blocks.put_mean`."""
        return 0.5 * self.step_tangent(0.5 * (q0 + q1))

    @abstractmethod
    def blocks(self) -> Blocks:
        """The same for implicit integrators; see `mechanics.step_tangent`."""

    @abstractmethod
    def workspaces(self, threads: int) -> Sequence[Any]:
        """Memory of the kernels on each thread, on fewer than asked for if need be."""

    def hinges_alone(self) -> SheetTerm | None:
        """The sheet with nothing but its hinges; None if it has none."""
        return None

    @property
    @abstractmethod
    def folds(self) -> Folds:
        """What actuators turn, as arrays that change in place."""

    @property
    def threads(self) -> int:
        """Threads on which a motion runs fastest."""
        return 1

    # ------------------------------------------------------------------ measures
    @abstractmethod
    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn (rad) of a part between two states; inf if parts collide."""

    def plate_energies(self, q: NDArray, turn: NDArray) -> NDArray:
        """Energy (p,), J, of bending of each panel, or of each triangle of a shell.

        turn : angles (rad) without stress of warm panels, as `Swelling` has them, or none, (0,).
        """
        return np.zeros(0)

    @abstractmethod
    def scale(self) -> NDArray:
        """Forces (m,), N, at the dofs under a strain of one, whose rounding errors stay."""

    @abstractmethod
    def longest(self) -> float:
        """Length (m) of the longest bar or side; the extent of the nodes where there is none."""

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """Hinges of the superlinear law; InputError where the model cannot do without slopes."""
        return SoftHinges(np.zeros(0), np.zeros(0), sparse.csr_array((0, self.size)))

    def soft_tangent(self, q: NDArray, slope: NDArray) -> sparse.csr_array:
        """Tangent (m, m) of these hinges alone, without moment and with given slopes / k (h,)."""
        return sparse.csr_array((self.size, self.size))

    def weakened(self, hinges: NDArray) -> Self:
        """The sheet without the stiffness of some of these hinges, a mask (h,)."""
        return self

    def own_strains(self) -> Strains | None:
        """Its bars and hinges; None where panels bend as plates."""
        return None

    # ------------------------------------------------------------------ rest angles
    @property
    def rest_angles(self) -> NDArray:
        """Rest angles (nr,), rad, that loads may change: of the folds first.

        The last `offsets` are no rest angles, but what the laws of folds see beside the dihedral,
        or forces on dofs in balance, N.
        """
        return np.zeros(0)

    def rest_law(self, number: int) -> HingeLaw:
        """Law of what has one of these rest angles."""
        raise IndexError(number)

    def fold_hinges(self) -> FoldHinges:
        """Hinges of the folds, of which every fold has one at least."""
        return no_fold_hinges()

    def bend_hinges(self) -> FoldHinges:
        """Hinges within panels, for models that bend by hinges."""
        return no_fold_hinges()

    def folded(self, rest: NDArray) -> Self:
        """The sheet with other rest angles (nr,), rad."""
        return self

    def actuated(self, numbers: NDArray) -> tuple[Self, NDArray, NDArray]:
        """A sheet whose rest angles may be changed in place, and what turns with some (a,).

        Rows (k,) of `folds`, and of each the place (k,) in `numbers`.
        """
        return self, np.zeros(0, np.int64), np.zeros(0, np.int64)

    def turned(self) -> tuple[NDArray, NDArray]:
        """Rest angles (rad) of what actuators turn, and the rows of `model.hinges` there."""
        return np.zeros(0), np.zeros(0, np.int64)

    def series(self) -> tuple[NDArray, NDArray]:
        """Of all that actuators turn: the share of the crease in a small turn, and offsets.

        Offsets (., 4) are what the laws see beside the dihedrals (rad), the moment of branches of
        laws with memory (N m), and both offset and whole moment at the last accepted step. Dofs in
        balance have their rows after those: force (N), dof (m), and both at that step. In a sheet
        from `actuated` they are changed in place.
        """
        count = len(self.turned()[0])
        return np.ones(count), np.zeros((count, 4))

    def offsets_under(self, moments: NDArray) -> NDArray:
        """The last `rest_angles` where moments (nf,), N m, act on creases alone."""
        return np.zeros(0)

    def lowest_nodes(self, turned: NDArray) -> NDArray:
        """Lowest node of what turns in these rows (k,): whose thread it is, where there are any."""
        return np.zeros(len(turned), np.int64)

    # ------------------------------------------------------------------ other sheets
    def renumbered(self) -> tuple[Self, NDArray]:
        """The sheet for long motions, and the nodes (n,) in the order in which it has them."""
        return self, np.arange((self.size - len(self.hidden)) // 3)


def largest_turn(largest: float, before: NDArray, after: NDArray) -> float:
    """The largest of a turn and those of hinges (rad); inf where one passes through another."""
    hinges = float(np.abs(after - before).max(initial=0.0))
    if hinges > math.pi or not np.isfinite(hinges + largest):
        return math.inf
    return max(largest, hinges)


def unit_rows(nodes: NDArray, entries: NDArray, size: int) -> sparse.csr_array:
    """Rows (s, size) of norm one with entries (s, 3k) at the dofs of nodes (s, k)."""
    columns = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), entries.shape[1])
    row = np.repeat(np.arange(len(nodes)), columns.shape[1])
    unit = entries / np.linalg.norm(entries, axis=1, keepdims=True)
    return sparse.csr_array((unit.ravel(), (row, columns.ravel())), (len(nodes), size))
