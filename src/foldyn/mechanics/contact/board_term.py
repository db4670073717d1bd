"""Contact of boards, as solvers see it: contact of points that ride on the mesh."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.context import Context
from foldyn.mechanics.contact import boards
from foldyn.mechanics.contact.candidates import Tables
from foldyn.mechanics.contact.ccd import clear_share
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.kernels import add_contact, board_kernels
from foldyn.mechanics.contact.term import ContactTerm, contact_tangent
from foldyn.mechanics.term import CompiledTerm, nodal

STRAIGHT = 0.1  # rad, largest turn in a piece of a step, so that points move nearly straight
MOST = 64  # largest number of these pieces per step


class BoardContactTerm(ContactTerm):
    """Contact of points y(x) that ride on the mesh; see `ContactTerm`.

    Contact kernels treat y as nodes. The transpose of dy/dx maps forces back to nodes; tangents
    also need the second derivative of y.
    """

    sheets: boards.BoardSheets
    shared = eased = False

    @cached_property
    def _riding(self) -> tuple[boards.Ride, NDArray, NDArray]:
        own = self.sheets
        return boards.ride_on(own.nodes, own.triangles, own.panel, own.middle)

    @property
    def ride(self) -> boards.Ride:
        """The riding points."""
        return self._riding[0]

    @cached_property
    def tables(self) -> Tables:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Contact data as arrays, with boards' points; see `ContactTerm`."""
        return boards.board_tables(self.sheets, *self._riding, self._guarded.hinges)

    def compiled(self, part: Any, kept: Memory, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return board_kernels(self.ride, self.tables, kept, part.angle, group)

    def points(self, q: NDArray) -> NDArray:
        """Displacements of the riding points, followed by the nodes; see `ContactTerm`."""
        out = np.empty_like(self.ride.rest)
        boards.put_points(Context(self.ride), nodal(q), out)
        return out

    @property
    def nodes(self) -> NDArray:
        """Node (m,) that each point belongs to; see `ContactTerm`."""
        return self._riding[2]

    def carried(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Points (m,) that depend on the chosen nodes only; see `ContactTerm`."""
        return boards.carried(self.ride, chosen)

    def on_nodes(self, q: NDArray, force: NDArray) -> NDArray:
        """Nodal forces that are equivalent to forces on the points; see `ContactTerm`."""
        out = np.zeros_like(self.ride.x)
        boards.add_back(Context(self.ride), nodal(q), force, out)
        return out

    def step_back(self, u0: NDArray, u1: NDArray, force: NDArray) -> NDArray:
        """Nodal forces that do the work of the points' forces in a step; see `ContactTerm`."""
        motion = boards.step_jacobian(self.ride, u0, u1, self.ride.x.size)
        return (motion.T @ force.ravel()).reshape(-1, 3)

    def step_tangent(
        self, u0: NDArray, u1: NDArray, force: NDArray, inner: sparse.csr_array
    ) -> sparse.csr_array:
        """Step tangent with respect to nodes; takes the points' motion to first order."""
        ride, size = self.ride, u0.size
        motion, ahead = boards.step_jacobian(ride, u0, u1, size), boards.jacobian(ride, u1, size)
        bent = boards.curvature(ride, 0.5 * (u0 + u1), force, size)
        return sparse.csr_array(motion.T @ inner @ ahead + 0.5 * bent)

    def tangent_at(self, q: NDArray, kept: Memory) -> sparse.csr_array:
        """Tangent with respect to nodes at the last evaluation; see `ContactTerm`."""
        tables, push, angle = self.tables, np.zeros_like(kept.x), self._guarded.angles(q)
        add_contact(Context(tables), kept.x - tables.rest, angle, push, Context(kept))
        motion = boards.jacobian(self.ride, nodal(q), q.size)
        inner = contact_tangent(tables, kept, push.size)
        bent = boards.curvature(self.ride, nodal(q), push, q.size)
        return sparse.csr_array(motion.T @ inner @ motion + bent)

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Unit rows (s, m) of the term's internal constraints; see `Term`."""
        rows = self.held(q, self.ride.rest.size) @ boards.jacobian(self.ride, nodal(q), q.size)
        size = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
        return sparse.csr_array(sparse.diags_array(1.0 / size) @ rows)

    def clear_with(
        self, kept: Memory, q: NDArray, step: NDArray, moves: NDArray, keep: float
    ) -> float:
        """Share of a step without crossing, found in pieces in which points hardly turn."""
        u, motion = nodal(q), nodal(step)
        turn = boards.largest_turn(self.ride, u, motion)
        if not turn < math.inf:
            return 0.0
        pieces = max(1, math.ceil(turn / STRAIGHT))
        planes, before, done = kept.moved[:, :3].copy(), self.points(u), 0.0
        for k in range(min(pieces, MOST)):
            after = self.points(u + (k + 1) / pieces * motion)
            kept.moved[:, :3] = planes + k / pieces * moves
            share = clear_share(self.tables, kept, before, after - before, moves / pieces, keep)
            before, done = after, (k + share) / pieces
            if share < 1.0:
                break
        kept.moved[:, :3] = planes
        return done
