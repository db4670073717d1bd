"""Terms of a model: contributions to its energy and forces, called by address.

A model is a flat list of terms (`mechanics.assembly`). Each is a `Term`, which provides solvers
with a tangent and other properties, and compiles itself into a context (`jit.context`), which is a
named tuple of the term's data, and into kernels of fixed signatures, each compiled once per kind of
term. Loops receive kernels as data, by address, so that a loop is compiled once, not once for every
combination of terms. A missing kernel has the address 0.

Kernels receive arrays as addresses, from which `rows_at` and `numbers_at` make arrays: u, v and
force are (rows, 3), as in `mechanics.assembly`. The signatures, after the address of the context:

    forces(u, v, t, force, powers)   adds the term's forces at u, v and the time t to `force`, N,
                                     and to `powers` the powers that the term puts in, dissipates
                                     and loses to the air, W; the sheet's kernel runs first and
                                     overwrites `force`
    energies(u, out)                 adds the term's energies to their groups; the sheet's kernel
                                     overwrites `out`
    limit(u, v, a, h, beta, energy, lightness) -> h
                                     the longest step (s), at most h, that resolves all contacts
                                     and ends where a cable goes slack or taut:
                                     called before each step, after the forces at the end of the
                                     last step; a is the acceleration at that end, beta and energy
                                     are the fields of `contact.step_limit.Pace`; lightness (n,) is
                                     1 / mass of the nodes, 1/kg
    place_obstacles(factors)         sets obstacles, air and springs to the factors (h, 3) of their
                                     histories
    advance_clock(since)             the next evaluation is `since` (s) after the last accepted step
    commit()                         accepts the step that ends at the last evaluation
    dissipated() -> J                energy that the term's laws have dissipated up to the last
                                     evaluation
    branch_states(out)               writes the states (b, 2) of the branches at the last evaluation
    step_error(scale) -> ratio       error of the branches if the step that ends at the last
                                     evaluation is accepted: a turn, divided by the largest turn or
                                     by the turn that moves nodes by `scale` (m)
    mean_forces(u0, u1, before, h, t, force, powers)
                                     adds forces whose work from u0 to u1 is the change of the
                                     term's energy plus the dissipation of its laws, in a step h (s)
                                     about the time t, and writes the term's dihedrals at u1; before
                                     (nh,) are all dihedrals at u0. Adds other powers like `forces`.
                                     If a term has no such kernel, `mechanics.mean_forces` derives
                                     these forces from its other kernels
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numba import types
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.jit.compiled import Addressed, addressed, inner_scalar, kernel
from foldyn.jit.context import Context, run_at, value_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.slots import Slots
from foldyn.mechanics.threads import ThreadPart
from foldyn.values import writable

(
    FORCES, ENERGIES, LIMIT, PLACE_OBSTACLES, ADVANCE_CLOCK, COMMIT, DISSIPATED, BRANCH_STATES,
    STEP_ERROR,
) = EVERY = range(9)  # fmt: skip
MEAN_FORCES = 9  # kind of kernel only for `dynamics.energy_momentum`
ADDRESS, NUMBER = types.int64, types.float64
Way = tuple[NDArray, NDArray]  # two states: stresses are extrapolated from the first to the second

forces = addressed(ADDRESS, ADDRESS, NUMBER, ADDRESS, ADDRESS)
energies = addressed(ADDRESS, ADDRESS)
limit = addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER, NUMBER, NUMBER, ADDRESS)
place_obstacles = addressed(ADDRESS)
advance_clock = step_error = addressed(NUMBER)
commit = dissipated = addressed()
branch_states = addressed(ADDRESS)
mean_forces = addressed(ADDRESS, ADDRESS, ADDRESS, NUMBER, NUMBER, ADDRESS, ADDRESS)


PARTS = {
    "stiffness": {"places", "entries"},
    "damping": {"damping_places", "damping_entries"},
    "gradients": {"arrays", "pulled"},
}
WHOLE = {"stiffness": "tangent", "damping": "damping"}  # method that may replace both parts


class CompiledTerm(NamedTuple):
    """A term as compiled loops see it: its context, and its kernels by kind."""

    context: Context
    kernels: Mapping[int, Addressed]


class Unstrained(NamedTuple):
    """A model with linear laws and without strain, whose soft motions are mechanisms."""

    tangent: sparse.csr_array  # (m, m)
    hinges: sparse.csr_array  # (m, m) of the hinges alone
    stretch: Callable[[NDArray], float]  # bar elongation in a motion (m,) / the largest possible


class Strains(NamedTuple):
    """The stiffness at rest of p bars, h hinges, and panels with membranes."""

    bars: NDArray  # (p, 2) nodes
    vector: NDArray  # (p, 3) from the first to the second node of a bar, at rest, m
    bar_stiffness: NDArray  # (p,) N/m
    hinges: NDArray  # (h, 4) nodes: axis j, k, wings i, l
    corners: NDArray  # (h, 4, 3) rest positions, m
    hinge_stiffness: NDArray  # (h,) N m/rad
    membranes: tuple[Any, ...] = ()  # `membranes.Membranes`, one per kind of panel


class Term(ABC):
    """Base class of contributions to energy and forces: springs, contact, hinges with memory.

    A term is immutable, except for memory that is documented to change; methods that derive another
    term leave it unchanged. A term must define `compiled`, and `places` and `entries` or, if it
    damps, `damping_places` and `damping_entries`; if it has gradients, `arrays` and `pulled`. A
    class that lacks one of these is refused at its definition. Other defaults suit a term on the
    nodes without hinges and hidden dofs. Dofs q are (m,), as in `mechanics.assembly`, or arrays
    (rows, 3).

    Attributes
    ----------
    energy_groups : mapping of str to str
        Its own energy groups, with descriptions; empty if it adds to groups of other terms.
    of_hinges : bool
        Whether its forces are hinge moments, which count for the force scale even without loads.
    shared : bool
        Whether threads may share a model with this term.
    owns_hidden : bool
        Whether it owns some of the hidden dofs.
    damps : bool
        Whether its forces resist velocities, and all their work is dissipated or lost to the air.
    symmetric : bool
        Whether its tangent and its damping are symmetric.
    undifferentiated : str
        Name for messages that refuse gradients, for a term without `pulled`.
    without : tuple of str
        "stiffness" or "damping" if solvers obtain it elsewhere, or the term has none.
    histories : tuple of History
        What drives the term, in addition to obstacles and air.
    """

    energy_groups: ClassVar[Mapping[str, str]] = {}
    of_hinges: ClassVar[bool] = False
    shared: ClassVar[bool] = False
    owns_hidden: bool = False
    damps: ClassVar[bool] = False
    symmetric: ClassVar[bool] = True
    undifferentiated: ClassVar[str] = ""
    without: ClassVar[tuple[str, ...]] = ()
    histories: tuple[Any, ...] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        """Refuse a term class that lacks a part, which solvers would take for zero."""
        super().__init_subclass__(**options)
        names = [name for name in vars(Term) if not name.startswith("_")]
        if any(getattr(getattr(cls, name), "__isabstractmethod__", False) for name in names):
            return  # an abstract base class
        has = {name for name in names if getattr(cls, name) is not getattr(Term, name)}
        needed = "damping" if cls.damps else "stiffness"
        for whole, parts in PARTS.items():
            asked = parts & has or (whole == needed and needed not in cls.without)
            if asked and WHOLE.get(whole) not in has and (lacks := sorted(parts - has)):
                raise TypeError(f"{cls.__name__} has no {' and no '.join(lacks)}, for its {whole}")

    # ------------------------------------------------------------------ what is compiled
    @abstractmethod
    def compiled(self, part: ThreadPart, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels of the term for a thread.

        part : the thread's part, one of `Assembly.thread_parts`.
        kept : the term's memory, from `memories` or `memory`.
        group : the term's first energy group.
        """

    def memories(self, parts: Sequence[ThreadPart]) -> Sequence[Any]:
        """Memory of the term's kernels, for each thread of a motion."""
        return [None] * len(parts)

    @property
    def memory(self) -> Any:
        """Memory for evaluations from Python."""
        return None

    def prepare(self) -> None:  # noqa: B027
        """Set the memory to the term's state before an evaluation."""

    def stored(self) -> float:
        """Energy (J) of the term's group that the kernels leave out, after an evaluation."""
        return 0.0

    # ------------------------------------------------------------------ stiffness
    @property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the dofs that the term's tangent can couple."""
        none = np.zeros(0, np.int64)
        return none, none

    @cached_property
    def slots(self) -> Slots:
        """Slots of the term's entries in the tangent of a model."""
        return Slots(*self.places)

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m, at `places`; entries of the same place are added.

        floor : least slope per unit stiffness of a hinge.
        """
        return np.zeros(0)

    def step_entries(self, q: NDArray, way: Way, floor: float) -> NDArray:
        """Tangent entries (k,) for a Newton step, with stresses extrapolated along `way`."""
        return self.entries(q, floor)

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """Entries (k,) of the derivative of the mean forces from q0 to q1 with respect to q1.

        Call it after the mean forces. way : states that give the stresses at q1.
        """
        return 0.5 * self.entries(0.5 * (q0 + q1), floor)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent as a matrix (m, m), N/m."""
        return sparse.csr_array((self.entries(q, floor), self.places), (q.size, q.size))

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """The term without strain at q, with linear laws; None if it resists nothing."""
        return None

    # ------------------------------------------------------------------ damping
    @property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the dofs that the term's damping can couple."""
        none = np.zeros(0, np.int64)
        return none, none

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Derivative (k,) of the forces with respect to velocity, N s/m, at `damping_places`.

        Entries of the same place are added. hidden : velocity change of hidden dofs relative to
        other dofs.
        """
        return np.zeros(0)

    def damping(self, q: NDArray) -> sparse.csr_array:
        """Damping as a matrix (m, m), N s/m."""
        return sparse.csr_array((self.damping_entries(q), self.damping_places), (q.size, q.size))

    # ------------------------------------------------------------------ gradients
    def arrays(self) -> Any:
        """`pullback.Arrays` that the term's forces depend on; None without gradients."""
        return None

    def pulled(self) -> Any:
        """Pullback of the term's forces, as `pullback.Pulled`; None without gradients."""
        return None

    # ------------------------------------------------------------------ measures
    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of the term's hinges; -1 for a virtual wing."""
        return np.zeros((0, 4), np.int64)

    def angles(self, q: NDArray) -> NDArray:
        """Dihedrals (nh,) of the term's hinges, rad."""
        return np.zeros(0)

    def add_scale(self, scale: NDArray) -> None:  # noqa: B027
        """Add the term's force scale, N, at the dofs (m,), for unit strain."""

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Unit rows (s, m), one per internal constraint: a motion along a row strains the term."""
        return sparse.csr_array((0, q.size))

    def turning_moments(self) -> float:
        """Sum of the moments of the term's hinges (N m) for a unit turn."""
        return 0.0

    def strains(self, others: Strains) -> Strains | None:
        """Bars and hinges of this and the preceding terms; None if this term has other strains."""
        return others

    # ------------------------------------------------------------------ other terms
    def placed(self, order: NDArray, before: Any) -> Self:
        """The term with nodes in memory order (n,), after the terms of an assembly."""
        return self

    def displaced(self, moved: NDArray) -> Self:
        """The term, with the same memory, with contact planes displaced by `moved` (p, 3), m."""
        return self

    def at(self, factor: Callable[[Any], float]) -> Self:
        """The term with what follows its histories at their factors."""
        return self

    def driven_by(self, histories: Sequence[Any]) -> Self:
        """A copy of the term for a motion, which numbers its histories among these."""
        return self

    def on(self, sheet: Any) -> Self:
        """The term on a sheet with other rest angles."""
        return self

    def anchored(self, place: NDArray) -> Self:
        """The term's elements alone whose lowest place, of places (m,) of all dofs, is 0."""
        raise InputError(f": {type(self).__name__} does not belong to cells; leave it out", "case")

    def nominal(self, q: NDArray) -> Self | None:
        """The term at nominal stiffness, about its state at q; None if it has none."""
        return self


def nodal(q: NDArray) -> NDArray:
    """Nodal displacements and complete rows of hidden dofs, from dofs (m,) or (rows, 3)."""
    flat = writable(q).reshape(-1)
    return flat[: flat.size // 3 * 3].reshape(-1, 3)


def in_rows(q: NDArray, rows: int) -> NDArray:
    """A copy of dofs (m,) or (rows, 3) as (rows, 3)."""
    out = np.zeros((rows, 3))
    out.reshape(-1)[: np.size(q)] = np.ravel(q)
    return out


class Folds(NamedTuple):
    """Actuated hinges: k of them."""

    rest: NDArray  # (k,) rest angles, rad
    parameters: NDArray  # (k, 4)
    stiffness: NDArray  # (k,) N m/rad


class Terms(NamedTuple):
    """Terms of a body as compiled loops see them, with the same type for every body."""

    context: NDArray  # (k,) addresses
    kernel: NDArray  # (k, 9) addresses, or 0
    powers: NDArray  # (3,) scratch of `forces_of`


class ThreadTerms:
    """Terms of a body on one thread; keeps their arrays and contexts alive.

    Parameters
    ----------
    body : Assembly
    part : ThreadPart
        One of `Assembly.thread_parts`.
    kinds : sequence of int
        Kinds of the kernels to compile.

    Attributes
    ----------
    terms : Terms
    """

    def __init__(self, body: Any, part: ThreadPart, kinds: Sequence[int] = EVERY) -> None:
        self._held = terms = body.compiled(part)
        kernel = np.zeros((len(terms), len(EVERY)), np.int64)
        context = np.array([term.context.address for term in terms], np.int64)
        self.terms = Terms(context, kernel, np.zeros(3))
        self.call(kinds)

    def call(self, kinds: Sequence[int]) -> None:
        """Compile kernels of these kinds, too."""
        for row, term in zip(self.terms.kernel, self._held, strict=True):
            for kind in kinds:
                if kind in term.kernels and not row[kind]:
                    row[kind] = term.kernels[kind].at(term.context)


@inner_scalar
def parted_rows(values, n, r):
    """Rows of n nodes (n, 3), and values of the r hidden dofs in the rows after them."""
    return values[:n], flat(values)[3 * n : 3 * n + r]


@inner_scalar
def forces_of(terms, u, v, t, force):
    """Internal forces (rows, 3) at u, v and t; returns the powers in, out and to the air, W.

    Stores all dihedrals in `angle` and `fold_angle` of the `ThreadPart`.
    """
    terms.powers[0], terms.powers[1], terms.powers[2] = 0.0, 0.0, 0.0
    for k in range(terms.context.size):
        run_at(terms.kernel[k, FORCES], (terms.context[k], u, v, t, force, terms.powers))
    return terms.powers[0], terms.powers[1], terms.powers[2]


@inner_scalar
def run_each(terms, kind, given):
    """Run the kernels of a kind for all terms that have one, with the arguments `given`."""
    for k in range(terms.context.size):
        if terms.kernel[k, kind] != 0:
            run_at(terms.kernel[k, kind], (terms.context[k],) + given)  # noqa: RUF005 - for Numba


@inner_scalar
def energies_of(terms, u, out):
    """Strain energies (J) by group, into `out`; some terms report their last force evaluation."""
    run_each(terms, ENERGIES, (u, out))


@inner_scalar
def limit_of(terms, u, v, a, dt, beta, energy, lightness):
    """Longest step (s), at most dt, that all terms allow."""
    for k in range(terms.context.size):
        if terms.kernel[k, LIMIT] != 0:
            own = terms.context[k]
            dt = value_at(terms.kernel[k, LIMIT], (own, u, v, a, dt, beta, energy, lightness))
    return dt


@inner_scalar
def dissipated_by(terms):
    """Energy (J) dissipated by all terms up to their last evaluation."""
    lost = 0.0
    for k in range(terms.context.size):
        if terms.kernel[k, DISSIPATED] != 0:
            lost += value_at(terms.kernel[k, DISSIPATED], (terms.context[k],))
    return lost


@inner_scalar
def step_error_of(terms, scale):
    """Largest error ratio of the branch states; see `step_error` above."""
    error = 0.0
    for k in range(terms.context.size):
        if terms.kernel[k, STEP_ERROR] != 0:
            error = max(error, value_at(terms.kernel[k, STEP_ERROR], (terms.context[k], scale)))
    return error


@kernel
def evaluate(terms, u, v, force, energy):
    """Internal forces (rows, 3), N, and, unless `energy` is empty, strain energies (J)."""
    forces_of(terms, u, v, 0.0, force)
    if energy.size > 0:
        energies_of(terms, u, energy)
