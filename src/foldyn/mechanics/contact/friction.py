"""Friction along a path of equilibria: updates at accepted steps.

Within a step friction is a function of the state: springs from the anchors and ties of the last
accepted step pull with at most mu N each, with N the current normal force (`planes`,
`panel_friction`). So a step is the return mapping of Coulomb friction by the backward Euler method.
A node or listed pair without contact is tied at its current position, so that friction acts from
the step in which contact begins.

A sliding anchor dissipates the length of its path times the mean of mu N at both ends of the step;
a released spring dissipates its energy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.contact.candidates import FRICTION, NORMAL, Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.panel_friction import rub_state, slip_pairs, tie_pairs
from foldyn.mechanics.contact.planes import LEAST, slip
from foldyn.mechanics.contact.search import lay_ties, take_ties


class Friction:
    """Anchors and ties of the friction springs, which change in place.

    The methods `commit`, `snapshot` and `recall` work as in `mechanics.inelastic.HingeMemory`.

    Parameters
    ----------
    tables : Tables
    kept : Memory
        Contact memory of the body whose steps are accepted.
    """

    def __init__(self, tables: Tables, kept: Memory) -> None:
        self._tables, self._kept = tables, kept
        shape = kept.anchor.shape[:2]
        self._stored = np.zeros(shape)  # J, spring energies at the last accepted step
        self._lost = np.zeros(1)  # J
        self._coefficient = tables.planes[:, FRICTION, None]

    def start(self) -> None:
        """Tie all nodes where they were last evaluated; the springs then exert no force."""
        self._kept.anchor[:], self._kept.tie[:] = 0.0, 0.0
        self._stored[:], self._lost[:] = 0.0, 0.0
        self._tie()

    def commit(self) -> None:
        """Accept the step that ends at the last evaluation."""
        anchor, before = self._kept.anchor, self._kept.anchor.copy()
        slip(self._tables, self._kept.x, self._kept)
        way = np.linalg.norm(anchor[:, :, :3] - before[:, :, :3], axis=2)
        bound = 0.5 * self._coefficient * (before[:, :, 3] + anchor[:, :, 3])
        lost = np.where(anchor[:, :, 3] > 0.0, bound * way, self._stored)
        self._lost += lost.sum()
        if self._tables.friction > 0.0:
            self._lost += slip_pairs(self._tables, self._kept.x, self._kept)
        self._stored[:] = stored_on_planes(self._tables, self._kept)
        self._tie()

    def slips(self) -> bool:
        """Whether a node or a pair slips at the last evaluation."""
        if self._tables.friction > 0.0 and rub_state(self._tables, self._kept)[1]:
            return True
        kept, normal = self._kept, self._tables.planes[:, None, NORMAL : NORMAL + 3]
        apart = kept.x - kept.moved[:, None, :3] - kept.anchor[:, :, :3]
        along = apart - (apart * normal).sum(axis=2, keepdims=True) * normal
        pull = self._tables.stiffness * np.linalg.norm(along, axis=2)
        pressed = kept.friction[:, :, 3]
        return bool(((pressed > 0.0) & (pull > self._coefficient * pressed)).any())

    @property
    def lost(self) -> float:
        """Energy dissipated since the start, J."""
        return float(self._lost[0])

    def snapshot(self) -> tuple[NDArray, ...]:
        """Copy of the state at the last accepted step, for `recall`."""
        tied = take_ties(self._kept) if self._tables.friction > 0.0 else ()
        return (*(array.copy() for array in self._state), *tied)

    def recall(self, snapshot: Sequence[NDArray]) -> None:
        """Return to the state at an accepted step."""
        for array, kept in zip(self._state, snapshot, strict=False):
            array[:] = kept
        if self._tables.friction > 0.0:
            lay_ties(self._kept, *snapshot[len(self._state) :])

    @property
    def _state(self) -> tuple[NDArray, ...]:
        return self._kept.anchor, self._stored, self._lost

    def _tie(self) -> None:
        anchor, moved = self._kept.anchor, self._kept.moved[:, None, :3]
        loose = anchor[:, :, 3] == 0.0
        anchor[:, :, :3] = np.where(loose[:, :, None], self._kept.x - moved, anchor[:, :, :3])
        anchor[:, :, 3] = np.where(loose, LEAST, anchor[:, :, 3])
        if self._tables.friction > 0.0:
            tie_pairs(self._tables, self._kept)


def stored_on_planes(tables: Tables, kept: Memory) -> NDArray:
    """Energy (q, n), J, of the springs on planes at the last force evaluation."""
    pull = kept.friction[:, :, :3]
    return (pull * pull).sum(axis=2) / (2.0 * tables.stiffness)


def stored(tables: Tables, kept: Memory) -> float:
    """Energy (J) of all friction springs at the last force evaluation."""
    on_planes = float(stored_on_planes(tables, kept).sum())
    return on_planes + (rub_state(tables, kept)[0] if tables.friction > 0.0 else 0.0)
