"""A case as an equilibrium problem, for structures of any kind.

All contact planes that move along a path share one extra dof, held like a moving support. The value
of this dof is the travel (m) of the plane that moves farthest; at the load factor f each plane has
moved by f times its full motion. So a Newton step moves the planes together with the sheet, and is
cut where the planes would cross the sheet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Actuate, Case
from foldyn.cases.air import refuse_air, refuse_wind
from foldyn.cases.case_assembly import SomeLoads
from foldyn.cases.heat import heat_of
from foldyn.cases.springs import refuse_varying
from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.following import following_force, following_tangent, joined
from foldyn.mechanics.heat import add_heat
from foldyn.statics.newton import EPS, Problem
from foldyn.statics.path_memory import REFUSED, Memories
from foldyn.statics.rigid import Relief

PROBE = 1e-4  # change of the load factor in central differences

AdaptiveLoad = Callable[[NDArray, float], NDArray]


class Plates:
    """The extra dof that moves the contact planes of a case, if any plane moves.

    Parameters
    ----------
    case : Case

    Attributes
    ----------
    length : float
        Travel of this dof per unit of the load factor, m.
    """

    def __init__(self, case: Case) -> None:
        planes = () if case.contact is None else case.contact.planes
        motion = np.array([plane.motion or (0.0, 0.0, 0.0) for plane in planes], float)
        motion = motion.reshape(-1, 3)
        self.length = float(np.linalg.norm(motion, axis=1).max(initial=0.0))
        self._motion = motion / self.length if self.length else motion

    def __bool__(self) -> bool:
        """Whether any plane moves."""
        return self.length > 0.0

    @property
    def held(self) -> NDArray[np.bool_]:
        """Mask that marks this dof as held: one True, or empty if no plane moves."""
        return np.ones(int(bool(self)), bool)

    def joined(self, values: NDArray, own: float = 0.0) -> NDArray:
        """Values (m,) of the other dofs, with the value of this dof appended."""
        return np.append(values, own) if self else values

    def others(self, values: NDArray) -> NDArray:
        """Values (m, ...) of all dofs but this one."""
        return values[:-1] if self else values

    def moved(self, values: NDArray) -> NDArray:
        """Displacements (p, 3) of the planes, m, from the values of all dofs."""
        return float(values[-1]) * self._motion if self else np.zeros_like(self._motion)

    def placed(self, body: Assembly, values: NDArray) -> Assembly:
        """A body with its contact planes at their positions in a state."""
        return body.displaced(self.moved(values)) if self else body

    def force(self, contact: ContactTerm, q: NDArray) -> float:
        """Force that moves the planes along their motion, N; q (m,) of the body."""
        return float(((contact.plane_forces(q) + contact.plane_friction(q)) * self._motion).sum())

    def bordered(
        self, matrix: sparse.csr_array, contact: ContactTerm, q: NDArray, project: Any
    ) -> sparse.csr_array:
        """Tangent (N/m) of the other dofs, extended by the row and column of this dof.

        project : maps forces on the body's dofs to forces on states.
        """
        column, row, own = contact.plane_borders(q, self._motion)
        right, below = project(column)[:, None], project(row)[None, :]
        return sparse.csr_array(sparse.block_array([[matrix, right], [below, [[own]]]]))


class Actuation:
    """A body whose rest angles change by `change` (nr,), rad, per unit of the load factor.

    The lengths of springs and cables with a history change with it, too.

    A rest angle that leaves 0..2 pi becomes nan, which no solver accepts.
    """

    def __init__(self, body: Assembly, change: NDArray, constant: NDArray) -> None:
        self._body, self._change, self._constant = body, change, constant
        self._turns, self.acts = bool(change.any() or constant.any()), bool(body.histories)
        self.acts |= self._turns
        self.body = lru_cache(maxsize=4)(self._folded)

    def rest(self, factor: float) -> NDArray:
        """Rest angles (nr,), rad."""
        angle = self._body.sheet.rest_angles + self._constant + factor * self._change
        possible = (angle >= 0.0) & (angle <= 2.0 * math.pi)
        possible[len(angle) - self._body.sheet.offsets :] = True
        return np.where(possible, angle, np.nan)

    def _folded(self, factor: float) -> Assembly:
        body = self._body.at(lambda history: factor)
        return body.folded(self.rest(factor)) if self._turns else body


class OrigamiProblem(Problem):
    """Equilibrium of a case along the load factor; dofs as in `mechanics.assembly`.

    If constraints tie displacements together, states and forces are the x and E' f of
    `Constraints`: each slave dof is replaced by the value of its constraint equation, and this
    value is held. `dofs` and `displacement` map a state to displacements, `state` maps
    displacements to a state.

    Parameters
    ----------
    case : Case
        Its loads, imposed displacements and actuations are multiplied by the factor;
        its histories and base motions are ignored.
    constant : sequence of int
        Numbers of the loads that act in full at every load factor.
    rest : ndarray, shape (n, 3), optional
        Displacement (m) at which supports hold their nodes; zero unless given.
    adaptive_load : callable, optional
        Further forces (n, 3), N, from (displacement (n, 3), factor). Their stiffness is left out
        of the tangent.
    inertia_relief : bool
        Balance the loads on a free body by its inertia.
    flow : {"refused", "followed", "at rest"}
        How to treat friction, and creases that yield or creep: refuse them, follow friction and
        yielding along the path, or take the state at rest, in which nothing has flowed.
    memory : ndarray of shape (b, 2) or "fresh", optional
        State of the creases at the start; see `cases.State`.
    timed : bool
        Whether steps take time, during which creases relax and creep.

    Attributes
    ----------
    constant, growing : ndarray, shape (m,)
        Forces (N) that act in full at every factor, and forces (N) per unit of the factor.
    load : float
        Sum of the absolute components of `growing`, N.
    motion : ndarray, shape (m,)
        Displacements (m) imposed per unit of the factor.
    actuation : Actuation
        The body at each factor.
    following : Following
        Forces that depend on the displacement: constant in row 0, growing in row 1.
    pinned : Constraints
        Constraints of the case, and the dofs that fix the position of a free body.
    """

    def __init__(
        self, case: Case, constant: Sequence[int] = (), rest: NDArray | None = None,
        adaptive_load: AdaptiveLoad | None = None, inertia_relief: bool = False,
        flow: str = REFUSED, memory: NDArray | str | None = None, timed: bool = False,
    ) -> None:  # fmt: skip
        refuse_wind(case, "statics")
        refuse_varying(case)
        if inertia_relief:
            refuse_air(case, "inertia relief")
            if case.structure.linear:
                raise InputError(f": {case.structure.linear} need supports", "inertia_relief")
        self.memories, self._plates = Memories(case, flow, timed), Plates(case)
        self.case, structure = case, case.structure
        self.structure, self._adaptive = structure, adaptive_load
        body = self.memories.body
        self.groups, self._hidden = tuple(body.energy_groups), len(body.hidden)
        self._ties = case.constraints
        self._shape = structure.nodes.shape
        loads, chosen = range(len(case.loads)), set(constant)
        steady = SomeLoads(case, [i for i in loads if i in chosen])
        growing = SomeLoads(case, [i for i in loads if i not in chosen])
        kinds = enumerate((steady, growing))
        self.following = joined((part, k) for k, kind in kinds for part, _ in kind.following_terms)
        at_rest = body.dofs(np.zeros(self._shape) if rest is None else rest)
        self._rest = self._plates.joined(self._ties.coordinates(at_rest))
        self.memories.start(at_rest, memory)
        self._constant = self._extended(_total(steady.load_terms, self._shape))
        self._growing = self._extended(_total(growing.load_terms, self._shape))
        self.constant = self._plates.joined(self._ties.force(self._constant))
        self.growing = self._plates.joined(self._ties.force(self._growing))
        self.load = float(np.abs(self._growing).sum())
        moved = self._extended(_total(case.imposed_terms, self._shape))
        moves = self._extended(case.imposed).astype(bool)
        moves[case.imposed_slaves] = True
        motion = np.where(moves, self._ties.coordinates(moved), 0.0)
        self.motion = self._plates.joined(motion, self._plates.length)
        self._moves = np.append(moves, self._plates.held)
        angles = body.sheet.rest_angles.shape
        heated = [(own, k) for k, kind in enumerate((steady, growing)) for own, _ in kind.swellings]
        self.heat = heat_of(structure, heated, 2)
        self.actuation = Actuation(
            body, _total(growing.rest_terms, angles), _total(steady.rest_terms, angles)
        )
        self._relief = Relief(case, at_rest[: structure.nodes.size]) if inertia_relief else None
        pins = self._relief.pins if self._relief else np.zeros(0, np.int64)
        self.pinned = self._ties.with_held(pins)
        self.free = np.concatenate([np.setdiff1d(case.free_dofs, pins), body.hidden])
        self.held = np.union1d(np.flatnonzero(case.constraints.determined), pins)
        self.held = np.append(self.held, body.size + np.flatnonzero(self._plates.held))
        self.length = float(np.linalg.norm(structure.nodes - structure.nodes.mean(axis=0)))
        scale = self._ties.largest(body.scale())
        self.force_rounding = EPS * float(np.linalg.norm(scale[self.free]))

    def _extended(self, values: NDArray) -> NDArray:
        """Values (n, 3) extended to all dofs (m,), with zeros at hidden dofs."""
        return np.concatenate([np.asarray(values, float).ravel(), np.zeros(self._hidden)])

    def dofs(self, u: NDArray) -> NDArray:
        """Dofs (m,) of the body in a state (m,)."""
        return self._ties.displacement(self._plates.others(u))

    def displacement(self, u: NDArray) -> NDArray:
        """Displacements (n, 3) of the nodes in a state (m,)."""
        return self.dofs(u)[: math.prod(self._shape)].reshape(self._shape)

    def state(self, displacement: NDArray, factor: float) -> NDArray:
        """State (m,) with nodal displacements (n, 3), its hidden dofs in balance."""
        push = self._external(self._extended(displacement), factor)
        q = self.actuation.body(factor).dofs(displacement, push)
        return self._plates.joined(self._ties.coordinates(q.copy()), factor * self._plates.length)

    def projected(self, force: NDArray) -> NDArray:
        """Forces (m,) on states, N, from forces (m,) on the body's dofs."""
        return self._ties.force(force)

    def start(self, factor: float = 0.0) -> NDArray:
        """State (m,) from which the path starts, with planes where they stand at a factor."""
        return self._plates.joined(self._plates.others(self._rest), factor * self._plates.length)

    def planes(self, u: NDArray) -> NDArray:
        """Displacements (p, 3) of the planes of contact in a state (m,), m."""
        return self._plates.moved(u)

    def body(self, u: NDArray, factor: float) -> Assembly:
        """The body with its folds actuated and its planes placed for a state (m,)."""
        return self._plates.placed(self.actuation.body(factor), u)

    def _contact(self, u: NDArray) -> ContactTerm:
        """The contact, with its planes placed for a state (m,)."""
        return self.body(u, 0.0).term(ContactTerm)

    def prescribed(self, factor: float) -> NDArray:
        """Values of held dofs: imposed displacements times the factor; other dofs stay put."""
        return np.where(self._moves, factor * self.motion, self._rest)[self.held]

    def external(self, u: NDArray, factor: float) -> NDArray:
        """External forces (m,), N."""
        return self._plates.joined(self._ties.force(self._external(self.dofs(u), factor)))

    def _external(self, q: NDArray, factor: float) -> NDArray:
        """External forces (m,) on the body's dofs q (m,), N."""
        force = self._constant + factor * self._growing
        if self.following.acts:
            force = force + self.following_force(q, factor)
        if self._adaptive is not None:
            displacement = q[: math.prod(self._shape)].reshape(self._shape)
            added = np.asarray(self._adaptive(displacement.copy(), factor), float)
            if added.shape != self._shape:
                raise InputError(
                    f"adaptive_load: returned forces of shape {added.shape}, give {self._shape}"
                )
            force = force + self._extended(added)
        if self._relief is not None:
            nodal = q.size - self._hidden
            force[:nodal] = force[:nodal] - self._relief.inertia(q[:nodal], force[:nodal])
        return force

    def unbalanced(self, u: NDArray, factor: float) -> NDArray:
        """Internal minus external force (m,) on the body's dofs, N."""
        q = self.dofs(u)
        return self.body(u, factor).internal(q) - self._external(q, factor)

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Internal minus external force (m,), N."""
        force = self._ties.force(self.unbalanced(u, factor))
        if not self._plates:
            return force
        return np.append(force, self._plates.force(self._contact(u), self.dofs(u)))

    def reactions(self, u: NDArray, factor: float) -> NDArray:
        """Support reactions, N, on `case.reaction_dofs`."""
        return self._ties.reactions @ self.unbalanced(u, factor)[: math.prod(self._shape)]

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> sparse.csr_array:
        """Tangent stiffness (m, m), N/m, for steps; see `Assembly.step_tangent`."""
        q, old = self.dofs(u), None if before is None else self.dofs(before)
        matrix = self.body(u, factor).step_tangent(q, old)
        if self.following.acts:
            matrix = sparse.csr_array(matrix + self.load_stiffness(q, factor))
        matrix = self._ties.matrix(matrix)
        if not self._plates:
            return matrix
        return self._plates.bordered(matrix, self._contact(u), q, self._ties.force)

    def following_force(self, q: NDArray, factor: float) -> NDArray:
        """Forces (m,), N, of loads that depend on the displacement, on the body's dofs q (m,)."""
        return following_force(self.following, q, _factors(1.0, factor))

    def load_stiffness(self, q: NDArray, factor: float) -> sparse.csr_array:
        """Part (m, m) of the body's tangent, N/m, of loads that depend on the displacement."""
        return following_tangent(self.following, q, _factors(1.0, factor))

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative (3n,) of the residual with respect to the factor at fixed u."""
        if not self.actuation.acts and self._adaptive is None and self._relief is None:
            if not self.following.acts:
                return -self.growing
            pushed = following_force(self.following, self.dofs(u), _factors(0.0, 1.0))
            return -self.growing - self._plates.joined(self._ties.force(pushed))
        ahead, behind = self.residual(u, factor + PROBE), self.residual(u, factor - PROBE)
        return (ahead - behind) / (2.0 * PROBE)

    def reference(self, u: NDArray, factor: float) -> float:
        """Largest of the norms of the external, hinge and contact forces, N."""
        q, body = self.dofs(u), self.body(u, factor)
        forces = [body.hinge_forces(q), self._external(q, factor)]
        if self.case.contact is not None:
            forces.append(self._contact(u).contact(q)[1])
        return max(float(np.linalg.norm(force)) for force in forces)

    def begin(self, factor: float) -> None:
        """Begin at a load factor, with friction at rest."""
        self.energy_at_rest = float(self.memories.body.energies(self.dofs(self.start())).sum())
        self._evaluate(self.start(factor), factor)
        self.memories.tie()

    def elapse(self, seconds: float) -> None:
        """Set the time (s) from the last accepted state to the next one."""
        if seconds > 0.0:
            self.memories.elapse(seconds)

    def keep(self, u: NDArray, factor: float) -> Any:
        """Accept a state (m,), storing what has yielded and slipped; see `recall`."""
        if not self.memories:
            return None
        self._evaluate(u, factor)
        return self.memories.commit()

    def recall(self, kept: Any) -> None:
        """Go back to an accepted state."""
        self.memories.recall(kept)

    def slips(self, u: NDArray) -> bool:
        """Whether anything slips in a state (m,)."""
        if not self.memories.rubs:
            return False
        self._evaluate(u, 0.0)
        return self.memories.slips()

    def opens(self, u: NDArray, factor: float) -> bool:
        """Whether a latch opens on the way to a state (m,), so that what it held jumps there."""
        if not self.memories:
            return False
        self._evaluate(u, factor)
        return self.memories.opens()

    def _evaluate(self, u: NDArray, factor: float) -> None:
        self.body(u, factor).energies(self.dofs(u))

    def turn(self, u: NDArray, v: NDArray) -> float:
        """Largest turn (rad) of a part of the structure from u to v; inf on penetration."""
        return self.actuation.body(0.0).turn(self.dofs(u), self.dofs(v))

    def touch(self, u: NDArray, factor: float) -> dict[str, NDArray]:
        """Tensions, and contact forces (N) as in `results.quantities.CONTACT`, in a state (m,)."""
        q, lines = self.dofs(u), self.case.lines
        out = {} if lines is None else {"tension": lines.at(lambda _: factor).pulls(q)}
        if self.case.contact is None:
            return out
        contact = self._contact(u)
        out["contact_force"] = contact.touch(q)
        if self.case.contact.planes:
            out["plane_force"] = contact.plane_forces(q)
            if self.memories.rubs:
                out["plane_friction"] = contact.plane_friction(q)
        return out

    def clear(self, u: NDArray, step: NDArray) -> float:
        """Share of a step (m,) that can be taken before anything crosses."""
        if self.case.contact is None:
            return 1.0
        q, contact = self.dofs(u), self._contact(u)
        return contact.clear(q, self.dofs(u + step) - q, self._plates.moved(step))

    def energies(self, u: NDArray, factor: float) -> NDArray:
        """Strain energies (J) by `groups`."""
        q, body = self.dofs(u), self.body(u, factor)
        out = body.energies(q)
        if self.heat is not None:
            add_heat(self.heat, q, _factors(1.0, factor), out)
        return out

    def working(self, u: NDArray, factor: float) -> NDArray:
        """External forces (m,), N, without thermal forces (thermal forces are not loads)."""
        force = self.external(u, factor)
        if self.heat is None:
            return force
        pushed = following_force(self.heat.loads, self.dofs(u), _factors(1.0, factor))
        return force - self._plates.joined(self._ties.force(pushed))

    def actuation_rate(self, u: NDArray, factor: float) -> float:
        """Derivative (J) of the energy with respect to the factor at fixed u (actuation, heat)."""
        if not self.actuation.acts and self.heat is None:
            return 0.0
        first = 1 if self.heat is None else 0  # bars (group 0) change with heat only
        ahead, behind = self.energies(u, factor + PROBE), self.energies(u, factor - PROBE)
        return float((ahead - behind)[first:].sum() / (2.0 * PROBE))


def _factors(steady: float, growing: float) -> NDArray:
    """Factors (2, 1) of constant and of growing loads."""
    return np.array([[steady], [growing]])


def _total(terms: Iterable[tuple[NDArray, Any]], shape: tuple[int, ...]) -> NDArray:
    """Sum of the vectors of load terms, regardless of their histories."""
    return sum((vector for vector, _ in terms), np.zeros(shape))


def drives(case: Case, constant: Sequence[int]) -> bool:
    """Whether anything in a case grows with the load factor."""
    return any(i not in set(constant) for i in range(len(case.loads))) or is_moved(case)


def is_moved(case: Case) -> bool:
    """Whether supports, planes, or lengths of springs or cables change with the load factor."""
    return bool(case.imposed_terms or case.obstacle_terms or case.elastic_body.histories)


def is_actuated(case: Case) -> bool:
    """Whether a case has actuated folds."""
    return any(isinstance(load, Actuate) for load in case.loads)
