"""State of contact between evaluations: nearby pairs, anchors of friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.contact.candidates import Tables
from foldyn.mechanics.contact.thread_partition import NOTES, Share
from foldyn.mechanics.threads import Team, team

ROOM = 64  # pairs per triangle, for each kind


class Memory(NamedTuple):
    """Memory of a motion of n nodes against q planes; room for m pairs of each kind.

    Members of a thread team share the arrays, except `moved`, `counts` and `facts`: these take
    equal values, except for the energy, which covers a member's share.
    """

    x: NDArray  # (n, 3) positions at the last evaluation, m
    listed: NDArray  # (n, 3) displacement at the last listing of pairs, m
    pairs: NDArray  # (2, m, 2) vertex and triangle; edge and edge
    d0: NDArray  # (2, m) m
    gap: NDArray  # (2, m) distance minus d0 at the last listing, m
    near: NDArray  # (2, m) pairs that may come within d0 in this step
    # with friction between panels, else (2, 0, 4): where a pair is tied (see `pairs.weights_of`),
    # the normal force when it was, N, 0 if it is not, and the stretch of its spring, m
    tie: NDArray  # (2, m, 4)
    anchor: NDArray  # (q, n, 4) anchor of friction's spring on the plane, m, and the normal force
    # force when it was, N; 0 if it is not
    friction: NDArray  # (q, n, 4) gradient of friction, N, and the normal force at the last force
    moved: NDArray  # (q, 6) displacement of the planes, m, and their velocity, m/s
    counts: np.record
    facts: np.record
    share: Share  # of a team member


COUNTED = (
    "listed_first",  # vertices and triangles
    "listed_second",  # edges
    "near_first",
    "near_second",
    "lists",  # number of lists made
    "has_list",
    "watched",  # whether `limited` updates the lists before every step
    "hinges",  # hinges that may reach their guard in this step
    "full",  # whether the last list did not fit
    "lagged",  # whether friction is limited by the normal force at the end of the last step
)
# energy at the last force (J), skin of the list (m), the shortest step asked for so far (s), the
# longest one that resolves what touches now (s)
MEASURED = ("energy", "skin", "shortest", "resolved")
COUNTS = np.dtype((np.record, [(name, np.int64) for name in COUNTED]))
FACTS = np.dtype((np.record, [(name, np.float64) for name in MEASURED]))


def memory(tables: Tables, panels: bool = True) -> Memory:
    """New memory."""
    return memories(tables, panels, team(1), [np.array([0, len(tables.rest)])])[0]


def memories(
    tables: Tables, panels: bool, members: Sequence[Team], own: Sequence[NDArray]
) -> list[Memory]:
    """New memory of each member of a team, who owns the nodes own[0] to own[1]."""
    n, q, size = len(tables.rest), len(tables.planes), len(members)
    room = ROOM * len(tables.triangles) + 256 if panels else 0
    near = np.empty((2, room), np.int32)
    counts, facts = np.zeros(size, COUNTS), np.zeros(size, FACTS)
    facts["skin"] = tables.skin
    facts["shortest"] = np.inf
    share = Share(
        team=members[0],
        own=own[0],
        meeting=own[0],
        found=near if size == 1 else np.empty_like(near),
        sums=np.zeros((size, 0 if size == 1 else n, 3)),
        counts=counts.view(np.int64).reshape(size, -1),
        facts=facts.view(np.float64).reshape(size, -1),
    )
    first = Memory(
        x=tables.rest.copy(),
        listed=np.zeros((n, 3)),
        pairs=np.empty((2, room, 2), np.int32),
        d0=np.empty((2, room)),
        gap=np.empty((2, room)),
        near=near,
        tie=np.zeros((2, room if tables.friction > 0.0 else 0, 4)),
        anchor=np.zeros((q, n, 4)),
        friction=np.zeros((q, n, 4)),
        moved=np.zeros((q, 6)),
        counts=counts[0],
        facts=facts[0],
        share=share,
    )
    notes = np.zeros((size, NOTES))
    return [
        first._replace(
            moved=np.zeros((q, 6)),
            counts=counts[k],
            facts=facts[k],
            share=share._replace(
                team=members[k]._replace(note=notes),
                own=own[k],
                meeting=np.searchsorted(tables.meeting, own[k]),
            ),
        )
        for k in range(size)
    ]
