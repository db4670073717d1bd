"""Newton's method for steps with contact: no iterate lets parts penetrate.

The contact potential grows without bound as parts approach each other, and is undefined once they
penetrate. So the prediction of a step and every iteration are first limited to the share in which
no gap closes by more than a fraction of itself (`mechanics.contact.ccd`). A line search may then
shorten an iteration further, until the residual along it no longer has a large opposite sign: this
would mean that the energy has passed its minimum. If no equilibrium is found, the step is rejected
and halved.

The nodes in contact change from one iteration to the next. The tangent of contact is therefore a
sparse matrix of its own, which is added to the structure's matrix before the factorization.

As long as nothing touches, a step is first solved without contact, with a matrix that may serve
several steps. The result is accepted if the straight path to it is free of contact.

Friction uses the normal force at the end of the last step, so that it has a potential within a
step. Anchors and ties of slipping contacts are updated when a step is accepted, as in explicit
methods.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.newton import Newton
from foldyn.dynamics.implicit.scheme import NOT_CONVERGED, NOT_FINITE, SOLVED, Scheme, judge
from foldyn.dynamics.system import place
from foldyn.mechanics.contact.candidates import NORMAL, POINT
from foldyn.mechanics.contact.ccd import KEEP
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.panel_friction import add_rubs, slip_pairs
from foldyn.mechanics.contact.planes import move_planes, slip
from foldyn.mechanics.contact.search import place as put_at
from foldyn.mechanics.contact.term import ContactTerm

MOST = 60  # largest number of iterations, many of which are shortened
CUTS = 12  # how often the line search may shorten one iteration
OVERSHOT = 0.5  # opposite residual allowed at an iteration's end, relative to its start
SMALLEST, LARGEST = 0.1, 0.5  # least and largest factor that shortens an iteration
PREDICTIONS = (1.0, 0.5, 0.25, 0.0)  # shares of the prediction to try if obstacles move


class TouchingNewton(Newton):
    """Newton's method for steps with contact; see `Newton`."""

    def __init__(self, scheme: Scheme, matrix: StepMatrix) -> None:
        super().__init__(scheme, matrix)
        body = scheme.packed.body
        self._contact = body.term(ContactTerm)
        self._tables = self._contact.tables
        self.memory: Memory = body.kept(scheme.part, ContactTerm)
        self.memory.counts.lagged = 1
        self._free = np.zeros(3 * scheme.packed.system.rows, bool)
        self._free[matrix.free] = True
        self._moved = np.zeros((len(self._tables.planes), 3))  # planes at the step's start
        self._pushed = self.memory.friction.copy()  # friction on nodes at the step's start
        self._rubbed = np.zeros_like(self.memory.x)  # friction between panels at the step's start
        self._touched = False

    def begin(self) -> None:
        """Make the state of the last force evaluation the start of the next step."""
        kept = self.memory
        self._moved[:], self._pushed[:] = kept.moved[:, :3], kept.friction
        self._touched = float(kept.facts.energy) > 0.0
        slip(self._tables, kept.x, kept)
        if self._tables.friction > 0.0:
            self._rubbed[:] = self._rub()
            slip_pairs(self._tables, kept.x, kept)

    def works(self) -> tuple[float, float]:
        """Work (J) of moving planes in a solved step, and energy (J) dissipated by friction."""
        kept, scheme, done, lost = self.memory, self.scheme, 0.0, 0.0
        points = self._contact.points
        motion = points(scheme.moved()) - points(scheme.displacement())
        if len(self._moved):
            push = scheme.plane_push(self._pushed, kept.friction)
            along = (kept.moved[:, :3] - self._moved)[:, None, :]
            normal = push[:, :, 3:] * self._tables.planes[:, None, NORMAL : NORMAL + 3]
            done = float(((normal - push[:, :, :3]) * along).sum())
            lost = float((push[:, :, :3] * (motion - along)).sum())
        if self._tables.friction > 0.0:
            lost += float((scheme.rub(self._rubbed, self._rub()) * motion).sum())
        return done, lost

    def _rub(self) -> NDArray:
        """Gradient (n, 3), N, of friction between panels, at the last force evaluation."""
        force = np.zeros_like(self.memory.x)
        add_rubs(self._tables, self.memory, force)
        return force

    def solve(self, h: float, t: float) -> int:
        """Move scheme.shift to equilibrium at the end t (s) of a step h (s); see `Newton.solve`."""
        scheme, matrix = self.scheme, self.matrix
        if not self._predict(t):
            self._lasting = False
            return NOT_CONVERGED
        if not self._touched and self._passes_by(h, t):
            return SOLVED
        self._lasting = False
        goal = scheme.goal(h)
        before, again, last = scheme.displacement().copy(), False, 0.0
        norm, reference = self._residual(h, t)
        for _ in range(MOST):
            verdict = judge(goal, norm, reference, last, np.inf)
            if verdict in (SOLVED, NOT_FINITE):
                return verdict
            scheme.tangent(matrix, before, again)
            touching = scheme.contact_tangent(self._contact, self.memory)
            matrix.added = touching if touching.nnz else None
            try:
                matrix.factorize(scheme.weights(h))
            except SingularTangentError:
                return NOT_CONVERGED
            self._h = h
            before, again = scheme.moved().copy(), True
            step = -matrix.solve(scheme.out, scheme.step)
            self.iterations += 1
            last = norm
            norm, reference = self._along(h, t, step)
        return NOT_CONVERGED

    def _passes_by(self, h: float, t: float) -> bool:
        """Solve a step without contact; return whether the result is indeed free of contact."""
        scheme, kept, predicted = self.scheme, self.memory, self.scheme.shift.copy()
        start, self.matrix.added = scheme.displacement().copy(), None
        if super().solve(h, t) == SOLVED and float(kept.facts.energy) == 0.0:
            end, moved = scheme.moved().copy(), kept.moved.copy()
            share = self._start(start, end - start, moved[:, :3] - self._moved)
            kept.moved[:] = moved
            put_at(self._tables, self._contact.points(end), kept)
            if share == 1.0:
                return True
        scheme.shift[:] = predicted
        return False

    def _residual(self, h: float, t: float) -> tuple[float, float]:
        self.evaluations += 1
        return self.scheme.residual(h, t)

    def _along(self, h: float, t: float, step: NDArray) -> tuple[float, float]:
        """Move along a step (rows, 3) as far as the line search allows; return residual norms."""
        scheme, start = self.scheme, self.scheme.shift.copy()
        slope = float((scheme.out * step).sum())
        share = self._clear(scheme.moved(), step, np.zeros_like(self._moved))
        for _ in range(CUTS):
            scheme.shift[:] = start + share * step
            norm, reference = self._residual(h, t)
            there = float((scheme.out * step).sum())
            if there <= OVERSHOT * abs(slope) or slope >= 0.0:
                break
            share *= min(LARGEST, max(SMALLEST, -slope / (there - slope)))
        return norm, reference

    def _clear(self, u: NDArray, step: NDArray, moves: NDArray) -> float:
        """Share of a step from u, both (rows, 3), without penetration, as planes move by (q, 3)."""
        return self._contact.clear_with(self.memory, u, step, moves, KEEP)

    def _predict(self, t: float) -> bool:
        """Shorten the predicted motion until nothing penetrates; return whether that is possible.

        Supports and planes move to the end of the step at once, and planes push nodes aside. If
        parts still penetrate then, the step is too long.
        """
        scheme = self.scheme
        predicted, start = scheme.shift.copy(), scheme.displacement().copy()
        u, moves = self._at(t)
        if not moves.any() and not len(scheme.packed.system.moved.dof):
            scheme.shift *= self._start(start, u - start, moves)
            return True
        for share in PREDICTIONS:
            scheme.shift[:] = share * predicted
            u, moves = self._at(t)
            self._give_way(u, moves)
            u, moves = self._at(t)
            if self._start(start, u - start, moves) == 1.0:
                return True
        return False

    def _start(self, u: NDArray, step: NDArray, moves: NDArray) -> float:
        """`_clear` from the start of the step, with planes where they are at this start."""
        self.memory.moved[:, :3] = self._moved
        return self._clear(u, step, moves)

    def _at(self, t: float) -> tuple[NDArray, NDArray]:
        """Displacement (rows, 3) at time t (s) for the current shift, and plane motion (q, 3)."""
        scheme, kept = self.scheme, self.memory
        s, old = scheme.scratch, scheme.old
        place(scheme.packed.system, old.q + scheme.shift, old.w, t, s)
        move_planes(self._tables, s.factor, kept)
        return s.displacement.copy(), kept.moved[:, :3] - self._moved

    def _give_way(self, u: NDArray, moves: NDArray) -> None:
        """Push nodes out of the way of planes that would overtake them at u (rows, 3)."""
        own, met = self._tables, self._tables.meeting
        points, nodes = self._contact.points, self._contact.nodes[met]
        start, ahead = points(self.scheme.displacement()), points(u)
        d0, free = 0.5 * own.node_thickness[met], self._free.reshape(-1, 3)
        for p in np.flatnonzero(moves.any(axis=1)):
            point, normal = own.planes[p, POINT : POINT + 3], own.planes[p, NORMAL : NORMAL + 3]
            gap = (own.rest[met] + start[met] - point - self._moved[p]) @ normal
            now = (own.rest[met] + ahead[met] - point - self._moved[p] - moves[p]) @ normal
            short = np.zeros(len(free))
            np.maximum.at(short, nodes, 0.5 * np.minimum(gap, d0) - now)
            self.scheme.shift += np.where(free, short[:, None] * normal, 0.0)
