"""A model as solvers see it: the sum of energies, forces and tangents of a list of terms.

The m dofs are 3 node + axis, followed by the hidden dofs: massless dofs that a sheet may have in
addition to its nodal displacements. Compiled loops store them in arrays with a row of three per
node, (rows, 3); hidden dofs follow in further rows, the last one padded. Both forms are accepted.

The first term is the sheet, which numbers the dofs; springs, clamped edges, contact and hinges with
memory follow. They are added in list order. Methods that derive another assembly (`folded`,
`nominal`, ...) leave the original unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import compress
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import ComputationError
from foldyn.mechanics.model import ranks
from foldyn.mechanics.sheet_term import Blocks, SheetTerm, largest_turn
from foldyn.mechanics.slots import add_at
from foldyn.mechanics.step_tangent import FLOOR
from foldyn.mechanics.tangent import Sparsity, entry_slots, joined
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    CompiledTerm,
    Strains,
    Term,
    ThreadTerms,
    Unstrained,
    evaluate,
    in_rows,
)
from foldyn.mechanics.threads import ThreadPart

ITERATIONS = 50
BALANCED = 1e-13  # rad: Newton's method for hidden dofs ends at smaller steps
LEAST_SLOPE = 1e-3  # least slope of a fold in these steps, relative to the fold's stiffness

Kind = TypeVar("Kind", bound=Term)


class Assembly:
    """A list of terms; keeps the arrays and contexts of their kernels alive.

    Parameters
    ----------
    sheet : SheetTerm
    *others : Term
        Terms added to the sheet.

    Attributes
    ----------
    sheet : SheetTerm
    others : tuple of Term
    size, rows : int
        Number m of the dofs, and rows of the arrays that hold them.
    hidden : ndarray of int
        Massless dofs in addition to nodal displacements.
    energy_groups : mapping of str to str
        Parts of the energy, with descriptions.
    """

    def __init__(self, sheet: SheetTerm, *others: Term) -> None:
        self.sheet, self.others = sheet, others
        self.terms: tuple[Term, ...] = (sheet, *others)
        self.size, self.rows, self.hidden = sheet.size, sheet.rows, sheet.hidden
        self.energy_groups = {k: v for term in self.terms for k, v in term.energy_groups.items()}

    def __getstate__(self) -> dict[str, Any]:
        """State without objects that hold addresses of this process."""
        return {name: value for name, value in vars(self).items() if name != "_evaluated"}

    def find(self, kind: type[Kind]) -> Kind | None:
        """Term of a kind, or None."""
        return next((term for term in self.others if isinstance(term, kind)), None)

    def term(self, kind: type[Kind]) -> Kind:
        """Term of a kind, which must exist."""
        found = self.find(kind)
        assert found is not None
        return found

    def parted(self, kind: type[Kind]) -> tuple[Assembly, Kind | None]:
        """Assembly without the term of a kind, and that term."""
        found = self.find(kind)
        return Assembly(self.sheet, *(term for term in self.others if term is not found)), found

    def with_terms(self, *terms: Term) -> Assembly:
        """Assembly with additional terms."""
        return Assembly(self.sheet, *self.others, *terms) if terms else self

    def displaced(self, moved: NDArray) -> Assembly:
        """Assembly with the contact planes displaced by `moved` (p, 3), m.

        Both share the compiled kernels: a term sets its planes before each evaluation.
        """
        body = Assembly(self.sheet, *(term.displaced(moved) for term in self.others))
        body._evaluated, body.hinges_alone = self._evaluated, self.hinges_alone
        return body

    # ------------------------------------------------------------------ energies and forces
    def dofs(
        self, displacement: NDArray, push: NDArray | None = None, memory: Term | None = None,
        held: tuple[NDArray, sparse.csr_array] | None = None, kept: list[Any] | None = None,
    ) -> NDArray:  # fmt: skip
        """Dof vector (m,) for displacements (n, 3), with the hidden dofs in balance.

        push : forces (m,), N, none by default; only forces on hidden dofs count.
        memory : hinges with memory that add stiffness to the sheet.
        held : initial hidden dofs (r,), and rows (k, r) along which they are held.
        kept : stores the last factors for reuse in the next state, while they converge fast.

        Raises
        ------
        ComputationError
            No balance was found near the initial values, zero by default.
        """
        begin, rows = held or (np.zeros(len(self.hidden)), sparse.csr_array((0, len(self.hidden))))
        q = np.concatenate([np.asarray(displacement, float).ravel(), begin])
        if not len(self.hidden):
            return q
        first, held_forces = self.size - len(self.hidden), np.zeros(rows.shape[0])
        body = self._of_hidden if memory is None else self._of_hidden.with_terms(memory)
        solve, last = kept[0] if kept else None, np.inf
        for _ in range(ITERATIONS):
            couple = body.internal(q)[first:]
            if push is not None:
                couple -= push[self.hidden]
            if not couple.any():
                return q
            if solve is None:
                stiffness = body.tangent(q, LEAST_SLOPE)[first:][:, first:]
                if rows.shape[0]:
                    stiffness = sparse.block_array([[stiffness, rows.T], [rows, None]])
                solve = splu(sparse.csc_array(stiffness)).solve
            step = solve(-np.append(couple, held_forces))[: len(couple)]
            q[first:] += step
            largest = self.sheet.per_hidden * float(np.abs(step).max(initial=0.0))
            if largest <= BALANCED:
                if kept is not None:
                    kept[:] = [solve]
                return q
            if kept is None or largest > 0.1 * last:
                solve = None
            last = largest
        raise ComputationError("the rotations of the panels do not balance at this displacement")

    @cached_property
    def _of_hidden(self) -> Assembly:
        """Assembly of the sheet and the terms that own hidden dofs."""
        own = [term for term in self.others if term.owns_hidden]
        return self if len(own) == len(self.others) else Assembly(self.sheet, *own)

    @cached_property
    def _evaluated(self) -> ThreadTerms:
        """Model for single evaluations from Python."""
        part = self._parts(1)[0]._replace(kept=tuple(term.memory for term in self.others))
        return ThreadTerms(self, part, [FORCES])

    def _at(self, q: NDArray, energy: NDArray) -> NDArray:
        """Internal forces (m,) at q; fills `energy` by group unless it is empty."""
        for term in self.others:
            term.prepare()
        u, force = self.in_rows(q), np.zeros((2, self.rows, 3))
        evaluate(self._evaluated.terms, u, force[0], force[1], energy)
        return force[1].ravel()[: self.size]

    def in_rows(self, q: NDArray) -> NDArray:
        """Dofs (m,) or (rows, 3) as (rows, 3)."""
        return in_rows(q, self.rows)

    def energies(self, q: NDArray) -> NDArray:
        """Strain energies (J) by group."""
        self._evaluated.call([ENERGIES])
        energy, first = np.empty(len(self.energy_groups)), len(self.sheet.energy_groups)
        self._at(q, energy)
        for term in self.others:
            energy[first : first + len(term.energy_groups)] += term.stored()
            first += len(term.energy_groups)
        return energy

    def internal(self, q: NDArray) -> NDArray:
        """Internal forces (m,), N, the gradient of the energy."""
        return self._at(q, np.zeros(0))

    def hinge_forces(self, q: NDArray) -> NDArray:
        """Internal forces of hinges (bends and folds) alone: a force scale even without loads."""
        alone = self.hinges_alone
        return np.zeros(self.size) if alone is None else alone.internal(q)

    @cached_property
    def hinges_alone(self) -> Assembly | None:
        """Assembly of the hinges alone, if there are any."""
        alone = self.sheet.hinges_alone()
        others = [term for term in self.others if term.of_hinges]
        return None if alone is None else Assembly(alone, *others)

    # ------------------------------------------------------------------ tangents
    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Derivative (m, m) of the forces; slopes per unit stiffness are at least `floor`."""
        return self._plus(self.sheet.tangent(q, floor), q, q, floor)

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """Matrix for a Newton step at q, after an iterate `before`."""
        old = q if before is None else before
        return self._plus(self.sheet.step_tangent(q, before), q, old, FLOOR)

    def _plus(
        self, matrix: sparse.csr_array, q: NDArray, before: NDArray, floor: float
    ) -> sparse.csr_array:
        flat, old = (np.ascontiguousarray(x, float).ravel()[: self.size] for x in (q, before))
        known = [type(term).tangent is Term.tangent for term in self.others]
        for term in compress(self.others, known):
            matrix = term.slots.added(matrix, term.step_entries(flat, (old, flat), floor))
        for term in compress(self.others, np.logical_not(known)):  # terms whose places change
            matrix = sparse.csr_array(matrix + term.tangent(flat, floor))
        return matrix

    def blocks(self) -> Blocks:
        """Tangent blocks for implicit steps, without contact; see `mechanics.step_tangent`."""
        return AssembledBlocks(self)

    # ------------------------------------------------------------------ what is compiled
    def thread_parts(self, threads: int) -> list[ThreadPart]:
        """The part of each thread in a motion; maybe of fewer threads than requested."""
        parts = self._parts(threads)
        kept = [term.memories(parts) for term in self.others]
        return [part._replace(kept=tuple(own[k] for own in kept)) for k, part in enumerate(parts)]

    def _parts(self, threads: int) -> list[ThreadPart]:
        """The parts of `thread_parts`, without the memory of terms."""
        alone = not all(term.shared for term in self.terms)
        scratches = self.sheet.scratches(1 if alone else threads)
        found = [ThreadPart(s.team, s.own, s.angle, s.fold_angle, s) for s in scratches]
        count = sum(len(term.hinges) for term in self.others)
        if not count:
            return found
        angle = np.empty(len(found[0].angle) + count)  # the sheet's hinges come first
        own = angle[:-count]
        scratch = found[0].scratch._replace(angle=own, fold_angle=own)
        return [found[0]._replace(angle=angle, fold_angle=own, scratch=scratch)]

    def compiled(self, part: ThreadPart) -> list[CompiledTerm]:
        """Compiled terms for a thread."""
        found, group = [self.sheet.compiled(part, part.scratch, 0)], len(self.sheet.energy_groups)
        for term, kept in zip(self.others, part.kept, strict=True):
            found.append(term.compiled(part, kept, group))
            group += len(term.energy_groups)
        for term, one in zip(self.terms, found, strict=True):
            if FORCES not in one.kernels or (term.energy_groups and ENERGIES not in one.kernels):
                raise TypeError(f"{type(term).__name__} has no kernel for its forces or energies")
        return found

    def kept(self, part: ThreadPart, kind: type[Term]) -> Any:
        """Memory of the term of a kind on a thread; None without such a term."""
        terms = zip(self.others, part.kept, strict=True)
        return next((kept for term, kept in terms if isinstance(term, kind)), None)

    @property
    def threads(self) -> int:
        """Number of threads that run a motion fastest."""
        return self.sheet.threads if all(term.shared for term in self.terms) else 1

    # ------------------------------------------------------------------ measures
    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of all hinges; -1 for a wing that is no node."""
        return np.concatenate([term.hinges.astype(np.int64) for term in self.terms])

    def angles(self, q: NDArray) -> NDArray:
        """Dihedrals (nh,) of all hinges, rad."""
        return np.concatenate([term.angles(q) for term in self.terms])

    def turn(self, q: NDArray, other: NDArray) -> float:
        """Largest turn (rad) of a part between two states; inf if parts collide."""
        turn = self.sheet.turn(q, other)
        for term in self.others:
            turn = largest_turn(turn, term.angles(q), term.angles(other))
        return turn

    def scale(self) -> NDArray:
        """Force (m,), N, on each dof at unit strain; rounding errors are proportional to it."""
        scale = self.sheet.scale()
        for term in self.others:
            term.add_scale(scale)
        return scale

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Unit rows (s, m) of internal constraints: motions along them cause strain."""
        q = np.append(q, np.zeros(self.size - len(q)))
        return sparse.csr_array(sparse.vstack([term.holds(q) for term in self.terms]))

    def turning_moments(self) -> float:
        """Sum of the hinges' moments (N m) for a unit turn."""
        return sum(term.turning_moments() for term in self.terms)

    def strains(self) -> Strains | None:
        """Bars and hinges of all terms; None if panels bend or stretch as plates."""
        found = self.sheet.own_strains()
        for term in self.others:
            found = None if found is None else term.strains(found)
        return found

    # ------------------------------------------------------------------ other assemblies
    def on(self, sheet: SheetTerm) -> Assembly:
        """Assembly of the same terms on a sheet with other rest angles."""
        return Assembly(sheet, *(term.on(sheet) for term in self.others))

    def folded(self, rest: NDArray) -> Assembly:
        """Assembly with other rest angles (nr,), rad."""
        return self.on(self.sheet.folded(rest))

    @property
    def histories(self) -> tuple[Any, ...]:
        """Histories that drive terms."""
        return tuple(dict.fromkeys(each for term in self.others for each in term.histories))

    def at(self, factor: Callable[[Any], float]) -> Assembly:
        """Assembly with what follows histories at their factors."""
        if not self.histories:
            return self
        return Assembly(self.sheet, *(term.at(factor) for term in self.others))

    def driven_by(self, histories: Sequence[Any]) -> Assembly:
        """Assembly for a motion; see `Term`."""
        return Assembly(self.sheet, *(term.driven_by(histories) for term in self.others))

    def anchored(self, place: NDArray) -> Assembly:
        """Assembly of the elements whose lowest place is 0; see `Term`."""
        return Assembly(self.sheet.anchored(place), *(term.anchored(place) for term in self.others))

    def renumbered(self) -> tuple[Assembly, Numbering]:
        """Assembly with nodes in memory order for motions."""
        sheet, order = self.sheet.renumbered()
        body = Assembly(sheet)
        for term in self.others:
            body = body.with_terms(term.placed(order, body))
        return body, self.numbering(order)

    def numbering(self, order: NDArray) -> Numbering:
        """Numbering of the assembly's dofs if node order[k] is stored at place k."""
        return Numbering(order, ranks(order), self.rows)

    def nominal(self, q: NDArray) -> Assembly:
        """Assembly with hinges at their nominal stiffness, about their angles at q."""
        sheet: Any = self.sheet.nominal(q)
        others = (term.nominal(q) for term in self.others)
        return Assembly(sheet, *(term.on(sheet) for term in others if term is not None))

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """Model without strain at q; None if every motion but a rigid one would strain it."""
        whole = self.sheet.unstrained(q)
        if whole is None:
            return None
        for term in self.others:
            own = term.unstrained(q)
            whole = whole if own is None else _together(whole, own)
        return whole


class AssembledBlocks:
    """Blocks of all terms with fixed places in a tangent; see `mechanics.sheet_term.Blocks`."""

    def __init__(self, body: Assembly) -> None:
        self._sheet = body.sheet.blocks()
        self._places = [term.places for term in _with_places(body)]
        self.pattern = self._sheet.pattern
        for row, column in self._places:
            self.pattern = joined(self.pattern, row // 3 * body.rows + column // 3)
        self.order, self.unused = self._sheet.order, self._sheet.unused
        self._slots: tuple[Sparsity, list[NDArray]] | None = None

    def put(
        self, of: Assembly, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """Fill blocks with the tangent; see `Blocks.put`."""
        self._sheet.put(of.sheet, pattern, u, before, again, out)
        way = before, u if again else before
        own = [term.step_entries(u, way, FLOOR) for term in _with_places(of)]
        self._add(pattern, own, out)

    def put_mean(
        self, of: Assembly, pattern: Sparsity, u0: NDArray, u1: NDArray, angle: NDArray,
        before: NDArray, again: bool, out: NDArray,
    ) -> None:  # fmt: skip
        """Fill blocks with the derivative of the mean forces; see `Blocks.put_mean`."""
        self._sheet.put_mean(of.sheet, pattern, u0, u1, angle, before, again, out)
        way = before, u1 if again else before
        own = [term.mean_entries(u0, u1, way, FLOOR) for term in _with_places(of)]
        self._add(pattern, own, out)

    def _add(self, pattern: Sparsity, entries: Sequence[NDArray], out: NDArray) -> None:
        """Add the entries of the other terms."""
        for slots, own in zip(self._slots_in(pattern), entries, strict=True):
            add_at(slots, own, out.reshape(-1))

    def filled(self, pattern: Sparsity) -> NDArray:
        """Mask of the entries that `put` may fill; see `Blocks.filled`."""
        filled = self._sheet.filled(pattern)
        for slots in self._slots_in(pattern):
            filled.reshape(-1)[slots] = True
        return filled

    def _slots_in(self, pattern: Sparsity) -> list[NDArray]:
        """Slots of each term's entries in the blocks of a pattern."""
        if self._slots is None or self._slots[0] is not pattern:
            self._slots = pattern, [entry_slots(pattern, *places) for places in self._places]
        return self._slots[1]


def _with_places(body: Assembly) -> list[Term]:
    """Terms, except the sheet, that have fixed places in a tangent."""
    return [term for term in body.others if len(term.places[0])]


def _together(one: Unstrained, other: Unstrained) -> Unstrained:
    """Sum of two unstrained models with the same dofs."""
    return Unstrained(
        sparse.csr_array(one.tangent + other.tangent),
        sparse.csr_array(one.hinges + other.hinges),
        lambda motion: max(one.stretch(motion), other.stretch(motion)),
    )


class Numbering(NamedTuple):
    """Node order in memory during a motion: along the sheet.

    Input and output use the structure's node numbers. Place k in memory holds node order[k]; node i
    stands at place rank[i].

    Rows of hidden dofs follow the nodes; the order of these rows does not change.
    """

    order: NDArray  # (n,)
    rank: NDArray  # (n,)
    rows: int  # number of rows in memory, n or more

    def inward(self, values: NDArray) -> NDArray:
        """Nodal values (n, ...) in memory order (rows, ...), zero in further rows."""
        out = np.zeros((self.rows, *values.shape[1:]), values.dtype)
        out[: len(self.order)] = values[self.order]
        return out

    def held(self, fixed: NDArray) -> NDArray:
        """Mask of held dofs (n, 3) in memory order (rows, 3), True in further rows."""
        out = self.inward(fixed)
        out[len(self.order) :] = True
        return out

    def outward(self, values: NDArray) -> NDArray:
        """Nodal values (n, ...) in the structure's order."""
        return np.ascontiguousarray(values[self.rank])

    def dofs(self, dofs: NDArray) -> NDArray:
        """Convert dofs 3 node + axis, and hidden dofs, to dofs 3 place + axis in memory."""
        rank = np.append(self.rank, np.arange(len(self.rank), self.rows))
        return (3 * rank[np.asarray(dofs) // 3] + np.asarray(dofs) % 3).astype(np.int64)

    def matrix(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Nodal matrix (n, n), or matrix of all dofs, in memory order."""
        places, size = self.order, self.rows
        if matrix.shape[0] > len(places):
            places = (3 * places[:, None] + np.arange(3)).ravel()
            places = np.concatenate([places, np.arange(len(places), matrix.shape[0])])
            size = 3 * self.rows
        placed = sparse.csr_array(sparse.csr_array(matrix)[places][:, places])
        placed.resize((size, size))
        placed.sort_indices()
        return placed
