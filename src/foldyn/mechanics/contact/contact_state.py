"""State of contact between evaluations, and its partition among the threads of a team.

A member owns nodes, as in `mechanics.strips`: it places them, handles their contact with planes and
completes the force on them. Pairs and guarded hinges are split by index, regardless of who owns
their nodes. Each member adds the forces of its share of pairs and hinges to its own sums; then each
member adds up the sums of all members on its own nodes, in member order. So the order of summation
does not depend on the threads' speed. A single thread owns everything and adds to the force
directly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.mechanics.contact.candidates import Tables
from foldyn.mechanics.contact.distances import VERTEX
from foldyn.mechanics.threads import Team, part, team, total, wait

# positions in a member's notes to its team: its parts of the mean velocity and of the mean motion
# since pairs were listed, three numbers each; its largest deviations from both means; the step it
# allows; its numbers of near pairs of each kind and of near hinges; the range of nodes that its
# sums reach; the energy of its share
SPEED, MOTION, FAST, FAR, LIMIT, NEAR, HINGES, LOW, HIGH, ENERGY = 0, 3, 6, 7, 8, 9, 11, 12, 13, 14
NOTES = 16  # two cache lines


class Share(NamedTuple):
    """Share of one member of a team of k threads; room for m pairs of each kind."""

    team: Team  # with its own notes, (k, NOTES)
    own: NDArray  # (2,) first and last + 1 of the member's nodes
    meeting: NDArray  # (2,) the same, of its nodes that planes may meet
    found: NDArray  # (2, m) near pairs in the order of discovery; for one thread, the list itself
    sums: NDArray  # (k, n, 3) pair forces of each member, N, else 0; (1, 0, 3) for one thread
    counts: NDArray  # (k, ...) int64, counters of all members
    facts: NDArray  # (k, ...) float64, measured values of all members


@inner_scalar
def reaches(team, first, last):
    """Note that this member's sums affect only the nodes first to last - 1."""
    team.note[team.number, LOW], team.note[team.number, HIGH] = first, last


@inner
def pass_on(share):
    """Wait for the first member; then copy its counts and facts to all."""
    wait(share.team)
    mine = share.team.number
    if mine > 0:
        for k in range(share.counts.shape[1]):
            share.counts[mine, k] = share.counts[0, k]
        for k in range(share.facts.shape[1]):
            share.facts[mine, k] = share.facts[0, k]


@inner_scalar
def gather(memory):
    """Merge the near pairs of all members into one list, ordered as on one thread."""
    counts, team = memory.counts, memory.share.team
    for kind in range(2):
        listed = counts.listed_first if kind == VERTEX else counts.listed_second
        if team.size > 1:
            begin, at = part(team, listed)[0], 0
            for member in range(team.number):
                at += int(team.note[member, NEAR + kind])
            for k in range(int(team.note[team.number, NEAR + kind])):
                memory.near[kind, at + k] = memory.share.found[kind, begin + k]
        near = int(total(team, NEAR + kind))
        if kind == VERTEX:
            counts.near_first = near
        else:
            counts.near_second = near
    counts.hinges = int(total(team, HINGES))


@inner
def finish(share, force):
    """Add all members' sums to the force (n, 3) on this member's nodes, and reset them."""
    team = share.team
    wait(team)
    for member in range(team.size):
        low = max(share.own[0], int(team.note[member, LOW]))
        high = min(share.own[1], int(team.note[member, HIGH]))
        sums = share.sums[member]
        for i in range(low, high):
            for c in range(3):
                force[i, c] += sums[i, c]
                sums[i, c] = 0.0


@inner_scalar
def energy_of_all(memory):
    """Contact energy (J) of all members at the last force evaluation, after a `wait` for them."""
    if memory.share.team.size == 1:
        return memory.facts.energy
    return total(memory.share.team, ENERGY)


ROOM = 64  # room for pairs of each kind, per triangle


class Memory(NamedTuple):
    """Memory of a motion of n nodes against q planes; room for m pairs of each kind.

    Members of a thread team share the arrays, except `moved`, `counts` and `facts`. Each member has
    its own copies of these, with equal values except for the energy, which covers its share.
    """

    x: NDArray  # (n, 3) positions at the last evaluation, m
    listed: NDArray  # (n, 3) displacement at the last listing of pairs, m
    pairs: NDArray  # (2, m, 2) vertex and triangle; edge and edge
    d0: NDArray  # (2, m) m
    gap: NDArray  # (2, m) distance minus d0 at the last listing, m
    near: NDArray  # (2, m) pairs that may come within d0 in this step
    # with friction between panels, else (2, 0, 4): where a pair is tied (`distances.weights_of`),
    # the normal force at the last accepted step, N, 0 if it is not tied, and the stretch of its
    # spring, m
    tie: NDArray  # (2, m, 4)
    # (q, n, 4) anchor of friction's spring on the plane, m, and the normal force at the last
    # accepted step, N, 0 if there is no contact
    anchor: NDArray
    friction: NDArray  # (q, n, 4) gradient of friction and normal force, last evaluated, N
    moved: NDArray  # (q, 6) displacement of the planes, m, and their velocity, m/s
    counts: np.record
    facts: np.record
    share: Share  # the share of a team member


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
# energy at the last force evaluation (J), skin of the list (m), the shortest step requested so far
# (s), the longest step that resolves the current contacts (s)
MEASURED = ("energy", "skin", "shortest", "resolved")
COUNTS = np.dtype((np.record, [(name, np.int64) for name in COUNTED]))
FACTS = np.dtype((np.record, [(name, np.float64) for name in MEASURED]))


def memory(tables: Tables, panels: bool = True) -> Memory:
    """New memory."""
    return memories(tables, panels, team(1), [np.array([0, len(tables.rest)])])[0]


def memories(
    tables: Tables, panels: bool, members: Sequence[Team], own: Sequence[NDArray]
) -> list[Memory]:
    """New memory of each member k of a team, with the first and last + 1 own[k] of its nodes."""
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
