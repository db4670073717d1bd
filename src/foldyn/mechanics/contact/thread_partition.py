"""Partition of the work of contact among the threads of a team.

A member owns nodes, as in `mechanics.strips`: it places them, meets planes with them and finishes
the force on them. Pairs and guarded hinges are shared by their numbers, whoever owns their nodes.
Each member adds their forces to sums of its own; then each adds up the sums of all on its own
nodes, in the order of the members. So the order of summation does not depend on which thread is
quicker. A thread that is alone owns everything, and adds to the force itself.
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
    """Share of a member of a team of k threads; room for m pairs of either kind."""

    team: Team  # with notes of its own, (k, NOTES)
    own: NDArray  # (2,) first and last + 1 of the member's nodes,
    meeting: NDArray  # (2,) and of those that planes may meet
    found: NDArray  # (2, m) near pairs as members find them; alone where they are kept
    sums: NDArray  # (k, n, 3) forces of the pairs of each member, N, else 0; alone none (1, 0, 3)
    counts: NDArray  # (k, ...) int64, the records of all members,
    facts: NDArray  # (k, ...) and what they have measured


@inner_scalar
def reaches(team, first, last):
    """Note that this member's sums reach the nodes first to last - 1, and no other ones."""
    team.note[team.number, LOW], team.note[team.number, HIGH] = first, last


@inner
def pass_on(share):
    """Wait for the first member; then all have its counts and facts."""
    wait(share.team)
    mine = share.team.number
    if mine > 0:
        for k in range(share.counts.shape[1]):
            share.counts[mine, k] = share.counts[0, k]
        for k in range(share.facts.shape[1]):
            share.facts[mine, k] = share.facts[0, k]


@inner_scalar
def gather(memory):
    """Make the near pairs that the members have found one list, that of one thread."""
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
    """Add the sums of all members to the force (n, 3) on this one's nodes; they become 0 there."""
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
    """Energy (J) of contact at the last force of all members: after a `wait` for them."""
    if memory.share.team.size == 1:
        return memory.facts.energy
    return total(memory.share.team, ENERGY)
