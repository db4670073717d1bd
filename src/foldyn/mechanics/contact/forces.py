"""Energy and force of all that touches."""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.edge_edge import edge_edge
from foldyn.mechanics.contact.hinge_guards import add_guards
from foldyn.mechanics.contact.planes import add_planes
from foldyn.mechanics.contact.search import follow, place
from foldyn.mechanics.contact.vertex_triangle import vertex_triangle


@kernel
def add_contact(tables, u, angle, force, memory):
    """Add the gradient (N) of the contact energy at u, and friction, to force, both (rows, 3).

    angle : dihedrals (nh,) that the model keeps, rad. The energy (J) stays in memory.facts.
    """
    counts, energy = memory.counts, 0.0
    panels = memory.d0.shape[1] > 0
    if counts.watched == 1:
        idle = counts.near_first + counts.near_second + counts.hinges == 0
        if idle and len(tables.planes) == 0:
            memory.facts.energy = 0.0
            return
        place(tables, u, memory)
    else:
        place(tables, u, memory)
        if panels:
            follow(tables, u, memory)
    x = memory.x
    if panels:
        for k in range(counts.near_first):
            p = memory.near[0, k]
            v, t = memory.pairs[0, p, 0], memory.pairs[0, p, 1]
            energy += vertex_triangle(tables, x, force, v, t, memory.d0[0, p])
        for k in range(counts.near_second):
            p = memory.near[1, k]
            i, j = memory.pairs[1, p, 0], memory.pairs[1, p, 1]
            energy += edge_edge(tables, x, force, i, j, memory.d0[1, p])
        if counts.watched == 0 or counts.hinges > 0:
            energy += add_guards(tables, x, angle, force)
        if counts.full == 1:
            energy = np.nan
            force[tables.surface[0], 0] = np.nan
    if len(tables.planes) > 0:
        energy += add_planes(tables, x, memory, force)
    memory.facts.energy = energy
