"""Partition of contact work among the threads of a team.

A member owns nodes, as in `mechanics.strips`: it places them, handles their contact with planes and
completes the force on them. Pairs and guarded hinges are split by index, regardless of who owns
their nodes. Each member adds their forces to its own sums; then each adds up all members' sums on
its own nodes, in member order. So the order of summation does not depend on the threads' speed. A
single thread owns everything and adds to the force directly.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.mechanics.contact.pairs import VERTEX
from foldyn.mechanics.threads import Team, part, total, wait

# places of a member's notes to its team: shares of the mean velocity and of the mean motion since
# pairs were listed, three each; the largest against those; the step it allows, how many pairs of
# either kind are near, how many hinges; which nodes its sums reach; the energy of its share
SPEED, MOTION, FAST, FAR, LIMIT, NEAR, HINGES, LOW, HIGH, ENERGY = 0, 3, 6, 7, 8, 9, 11, 12, 13, 14
NOTES = 16  # two cache lines


class Share(NamedTuple):
    """Share of one member of a team of k threads; room for m pairs of each kind."""

    team: Team  # with its own notes, (k, NOTES)
    own: NDArray  # (2,) first and last + 1 of the member's nodes
    meeting: NDArray  # (2,) and of its nodes that planes may meet
    found: NDArray  # (2, m) near pairs in the order of discovery; for one thread, the list itself
    sums: NDArray  # (k, n, 3) pair forces of each member, N, else 0; (1, 0, 3) for one thread
    counts: NDArray  # (k, ...) int64, counters of all members
    facts: NDArray  # (k, ...) and their measured values


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
    """Contact energy (J) of all members at the last force, after a `wait` for them."""
    if memory.share.team.size == 1:
        return memory.facts.energy
    return total(memory.share.team, ENERGY)
