"""The first term of a model: the sheet, which numbers the dofs.

A sheet model consists of a named tuple of arrays, its kernels, a `SheetTerm` that compiles them,
and a structure that puts this term into a `mechanics.assembly.Assembly`.
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

NO_DOF = np.iinfo(np.int64).max  # stands for no dof: no array has this index


class SoftHinges(NamedTuple):
    """State of h hinges whose law has no slope at rest."""

    offset: NDArray  # (h,) angle from rest, rad
    stiffness: NDArray  # (h,) N m/rad
    gradient: sparse.csr_array  # (h, m) of the hinge angles, 1/m


class FoldHinges(NamedTuple):
    """The k hinges of the folds; a fold may consist of several hinges in a row.

    The bends of hinge models have the same form, each like a fold of one hinge.

    The fold angle of a hinge is its dihedral minus `per_hidden` times its hidden dofs; of one that
    has a hidden dof twice, the dihedral at rest takes the place of the dihedral. If panels
    are compliant without such dofs, a moment on the crease alone turns the dihedral by `softness`
    times the moment before the hinge resists (`materials.series`).
    """

    fold: NDArray  # (k,) index of the fold
    nodes: NDArray  # (k, 4) axis j, k, wings i, l
    corners: NDArray  # (k, 4, 3) rest positions, m
    hidden: NDArray  # (k, 2) dofs, or NO_DOF
    per_hidden: NDArray | float  # (k, 2) or one for all, rad/m
    rest: NDArray  # (k,) rad
    stiffness: NDArray  # (k,) N m/rad
    softness: NDArray  # (k,) rad/(N m), softness of the adjacent panels
    row: NDArray  # (k,) row of each hinge in `SheetTerm.series`

    @property
    def length(self) -> NDArray:
        """Length (k,) of each hinge, m."""
        return np.linalg.norm(self.corners[:, 1] - self.corners[:, 0], axis=1)

    def some(self, rows: NDArray) -> FoldHinges:
        """Some of the hinges."""
        chosen: Any = (np.asarray(each)[rows] if np.ndim(each) else each for each in self)
        return FoldHinges(*chosen)

    @property
    def share(self) -> NDArray:
        """Ratio (k,) of each hinge's length to the length of its whole fold."""
        length = self.length
        return length / np.bincount(self.fold, length)[self.fold]

    @property
    def alone(self) -> NDArray:
        """Whether each hinge (k,) turns by a hidden dof alone."""
        return (self.hidden[:, 0] == self.hidden[:, 1]) & (self.hidden[:, 0] != NO_DOF)

    @property
    def remembers(self) -> NDArray:
        """Whether each hinge (k,) turns by more than its crease, so that dampers need a memory."""
        return self.softness > 0.0

    @property
    def hidden_turn(self) -> NDArray:
        """Turn (k, 2) of each hinge per unit of its hidden dofs, rad/m: 0 if it has none."""
        return np.where(self.hidden == NO_DOF, 0.0, self.per_hidden)


def no_fold_hinges() -> FoldHinges:
    """`FoldHinges` without hinges."""
    nodes, hidden = np.zeros((0, 4), np.int64), np.zeros((0, 2), np.int64)
    empty, none = np.zeros(0), nodes[:, 0]
    return FoldHinges(none, nodes, np.zeros((0, 4, 3)), hidden, 0.0, empty, empty, empty, none)


class CreaseTurns(NamedTuple):
    """Turns of creases that vary along them, as r numbers.

    Squares of the numbers of a fold add up to the mean square of its turn along it; the first
    number is the mean turn.
    """

    rows: sparse.csr_array  # (r, m) numbers of the dofs, rad/m
    fold: NDArray  # (r,) index of the fold

    @property
    def mean(self) -> sparse.csr_array:
        """Rows (nf, m) of the mean turns, rad/m."""
        return self.rows[np.unique(self.fold, return_index=True)[1]]


class Blocks(Protocol):
    """A tangent as 3x3 blocks, for the matrix of an implicit step.

    Attributes
    ----------
    pattern : Sparsity
        Positions of the blocks.
    order : ndarray of int
        All dofs, 3 row + axis, in an order that keeps a factorization narrow.
    unused : ndarray of int
        Padding dofs of the last row.
    """

    pattern: Sparsity
    order: NDArray
    unused: NDArray

    def put(
        self, of: Any, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """Fill `out` (nnz, 3, 3), for a pattern that contains this one, with the tangent at u.

        of : the owner of the blocks, or a copy with other rest angles.

        before : the start of the step or, if `again`, the last iterate, from which stresses are
        extrapolated to u. u and before are (rows, 3).
        """
        ...

    def put_mean(
        self, of: Any, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray, before: NDArray,
        again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """Fill `out` with the derivative d/du1 of the mean forces from u0 to u1; see `put`.

        angle : (nh,) dihedrals at u0.
        """
        ...

    def filled(self, pattern: Sparsity) -> NDArray:
        """Mask (nnz, 3, 3), for a pattern that contains this one, of entries that `put` fills."""
        ...


class SheetTerm(Term):
    """A sheet with m dofs and its rest angles; see `Term`.

    The sheet's kernels write forces and energies; kernels of other terms add to these. Defaults
    suit a sheet without hinges and hidden dofs.

    Attributes
    ----------
    model : named tuple
        The arrays of the sheet's kernels.
    size, rows : int
        Number m of the dofs, and rows of the arrays that hold them.
    hidden : ndarray of int
        Massless dofs in addition to nodal displacements.
    per_hidden : float
        Turn per unit of a hidden dof, rad/m.
    offsets : int
        Number of folds with compliant panels: nf or 0.
    mass : (m, m) or None
        Mass of a linear sheet on all of its dofs, kg; None if nodes alone have mass.
    laws : tuple of HingeLaw
        Laws of `fold_hinges` and of `bend_hinges`.
    crease_turns : CreaseTurns or None
        Turns of the creases of a linear sheet.
    rotated : ndarray or None
        Hidden dofs (h, 3) in rotations of the whole by 1 rad about x, y, z; None if they are
        relative to their panels, and stay zero.
    """

    model: Any
    size: int
    rows: int
    hidden: NDArray = np.zeros(0, np.int64)
    per_hidden: float = 0.0
    offsets: int = 0
    mass: sparse.csr_array | None = None
    laws: Any = ()
    crease_turns: CreaseTurns | None = None
    rotated: NDArray | None = None
    shared = True

    # ------------------------------------------------------------------ mechanics
    @abstractmethod
    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Derivative (m, m) of the forces; slopes per unit stiffness are at least `floor`.

        Its entries have the same places at all q.
        """

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """Matrix for a Newton step at q, after an iterate `before`."""
        return self.tangent(q)

    def mean_tangent(
        self, q0: NDArray, q1: NDArray, angle: NDArray, before: NDArray, again: bool
    ) -> sparse.csr_array:
        """Matrix for the mean forces from q0 to q1; see `Blocks.put_mean`."""
        return 0.5 * self.step_tangent(0.5 * (q0 + q1))

    @abstractmethod
    def blocks(self) -> Blocks:
        """Tangent blocks for implicit integrators; see `mechanics.step_tangent`."""

    @abstractmethod
    def scratches(self, threads: int) -> Sequence[Any]:
        """Scratch of each thread, maybe of fewer threads than requested.

        Each has the fields `team`, `own`, `angle` and `fold_angle` of a `ThreadPart`.
        """

    def hinges_alone(self) -> SheetTerm | None:
        """The sheet with its hinges only; None if it has none."""
        return None

    @property
    @abstractmethod
    def folds(self) -> Folds:
        """Actuated hinges, as arrays that change in place."""

    @property
    def threads(self) -> int:
        """Number of threads that run a motion fastest."""
        return 1

    # ------------------------------------------------------------------ measures
    @abstractmethod
    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn (rad) of a part between two states; inf if parts collide."""

    def plate_energies(self, q: NDArray, turn: NDArray) -> NDArray:
        """Energy (p,), J, of bending of each panel, or of each triangle of a shell.

        turn : angles (rad) at which warm panels have no stress (see `Swelling`), or none, (0,).
        """
        return np.zeros(0)

    @abstractmethod
    def scale(self) -> NDArray:
        """Force (m,), N, on each dof at unit strain; rounding errors are proportional to it."""

    @abstractmethod
    def longest(self) -> float:
        """Length (m) of the longest bar or side, or else the extent of the nodes; 1 of one node."""

    def soft_hinges(self, q: NDArray) -> SoftHinges:
        """Hinges of the superlinear law; InputError if the model needs their slopes."""
        return SoftHinges(np.zeros(0), np.zeros(0), sparse.csr_array((0, self.size)))

    def soft_tangent(self, q: NDArray, slope: NDArray) -> sparse.csr_array:
        """Tangent (m, m) of the soft hinges alone, without moments, for given slopes / k (h,)."""
        return sparse.csr_array((self.size, self.size))

    def weakened(self, hinges: NDArray) -> Self:
        """The sheet without the stiffness of masked hinges (h,)."""
        return self

    def own_strains(self) -> Strains | None:
        """Bars and hinges of the sheet; None if panels bend as plates."""
        return None

    # ------------------------------------------------------------------ rest angles
    @property
    def rest_angles(self) -> NDArray:
        """Rest angles (nr,), rad, that loads may change, folds first.

        The last `offsets` entries are not rest angles but offsets of the folds' dihedrals.
        """
        return np.zeros(0)

    def rest_law(self, number: int) -> HingeLaw:
        """Law of the hinge with this rest angle."""
        raise IndexError(number)

    def fold_hinges(self) -> FoldHinges:
        """Hinges of the folds, at least one per fold."""
        return no_fold_hinges()

    def bend_hinges(self) -> FoldHinges:
        """Hinges within panels, for models whose panels bend by hinges."""
        return no_fold_hinges()

    def folded(self, rest: NDArray) -> Self:
        """The sheet with other rest angles (nr,), rad."""
        return self

    def actuated(self, numbers: NDArray) -> tuple[Self, NDArray, NDArray]:
        """A copy with rest angles that can change in place, and its actuated rows (a,).

        Returns the sheet, rows (k,) of `folds`, and the position (k,) of each in `numbers`.
        """
        return self, np.zeros(0, np.int64), np.zeros(0, np.int64)

    def turned(self) -> tuple[NDArray, NDArray]:
        """Rest angles (rad) of the actuated hinges, and their rows in `model.hinges`."""
        return np.zeros(0), np.zeros(0, np.int64)

    def series(self) -> tuple[NDArray, NDArray]:
        """For all actuated hinges: the share of the crease in a small turn, and offsets.

        Columns of the offsets (., 4): the angle added to the dihedral (rad); the moment of memory
        branches (N m); the offset and the total moment at the last accepted step. In a sheet from
        `actuated` they change in place.
        """
        count = len(self.turned()[0])
        return np.ones(count), np.zeros((count, 4))

    def offsets_under(self, moments: NDArray) -> NDArray:
        """The last `offsets` entries of `rest_angles` for moments (nf,), N m, on creases alone."""
        return np.zeros(0)

    def lowest_nodes(self, turned: NDArray) -> NDArray:
        """Lowest node of the actuated hinges in these rows (k,), which determines their thread."""
        return np.zeros(len(turned), np.int64)

    # ------------------------------------------------------------------ other sheets
    def renumbered(self) -> tuple[Self, NDArray]:
        """The sheet in a node order for long motions, and that order (n,) of the nodes."""
        return self, np.arange((self.size - len(self.hidden)) // 3)


def largest_turn(largest: float, before: NDArray, after: NDArray) -> float:
    """The larger of a turn and the turns of hinges (rad); inf if a hinge passes through itself."""
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
