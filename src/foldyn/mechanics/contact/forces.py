"""Energy and force of all contacts."""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.edge_edge import edge_edge
from foldyn.mechanics.contact.hinge_guards import add_guards
from foldyn.mechanics.contact.panel_friction import add_rubs
from foldyn.mechanics.contact.planes import add_planes
from foldyn.mechanics.contact.search import follow, place
from foldyn.mechanics.contact.thread_partition import ENERGY, finish, reaches
from foldyn.mechanics.contact.vertex_triangle import vertex_triangle
from foldyn.mechanics.threads import part, wait


@inner
def _add_pairs(tables, angle, force, memory):
    """Energy (J) of a member's share of near pairs and guards.

    Adds its gradient, and friction, to force (n, 3). Records the range of affected nodes.
    """
    counts, team, x, energy = memory.counts, memory.share.team, memory.x, 0.0
    low, high = len(x), 0
    first, last = part(team, counts.near_first)
    for k in range(first, last):
        p = memory.near[0, k]
        v, t = memory.pairs[0, p, 0], memory.pairs[0, p, 1]
        energy += vertex_triangle(tables, x, force, v, t, memory.d0[0, p])[0]
        a, b, c = tables.triangles[t, 0], tables.triangles[t, 1], tables.triangles[t, 2]
        low, high = min(low, v, a, b, c), max(high, v + 1, a + 1, b + 1, c + 1)
    first, last = part(team, counts.near_second)
    for k in range(first, last):
        p = memory.near[1, k]
        i, j = memory.pairs[1, p, 0], memory.pairs[1, p, 1]
        energy += edge_edge(tables, x, force, i, j, memory.d0[1, p])[0]
        for e in (i, j):
            a, b = tables.edges[e, 0], tables.edges[e, 1]
            low, high = min(low, a, b), max(high, a + 1, b + 1)
    if counts.watched == 0 or counts.hinges > 0:
        first, last = part(team, tables.hinge_limit.size)
        energy += add_guards(tables, x, angle, force, first, last)
        low, high = 0, len(x)
    if counts.full == 1:
        energy = np.nan
        force[tables.surface[0], 0] = np.nan
        low, high = 0, len(x)
    reaches(team, low, high)
    return energy


@kernel
def add_contact(tables, u, angle, force, memory):
    """Add the gradient (N) of the contact energy at u, and friction, to force, both (rows, 3).

    angle : dihedrals (nh,) of the model, rad. The energy (J) is stored in memory.facts. Each team
    member completes the force on its own nodes; see `thread_partition`.
    """
    counts, share, energy = memory.counts, memory.share, 0.0
    team = share.team
    near = counts.watched == 0 or counts.near_first + counts.near_second + counts.hinges > 0
    near = near and memory.d0.shape[1] > 0
    if near or len(tables.planes) > 0:
        place(tables, u, memory)
    if near:
        wait(team)  # for positions and dihedrals of the others
        if counts.watched == 0:
            follow(tables, u, memory)
        into = force if team.size == 1 else share.sums[team.number]
        energy += _add_pairs(tables, angle, into, memory)
        if tables.friction > 0.0:
            add_rubs(tables, memory, into)
    if len(tables.planes) > 0:
        energy += add_planes(tables, memory.x, memory, force)
    memory.facts.energy = team.note[team.number, ENERGY] = energy
    if near and team.size > 1:
        finish(share, force)
