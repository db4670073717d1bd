"""Added inertia of contacts that a step need not resolve.

Contacts between pressed panels are stiff but hardly move. An explicit method that resolved their
vibrations would need steps of the order of their period. So a distance (or dihedral) g of stiffness
K gets the inertia tau^2 K, of the order of the step squared,

    (M + tau^2 sum K g_i g_i') a = F,

which limits the vibration of g to the frequency 1/tau. Slow relative motions and rigid motions are
not affected, so that both momenta are conserved; `step_limit` bounds the energy in such contacts.
This module selects the contacts; integrators solve for the accelerations.

Selective mass scaling: Olovsson, Simonsson and Unosson, Int. J. Numer. Meth. Engng 63, 2005.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inlined, inner
from foldyn.mechanics.contact.candidates import NORMAL, Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.distances import (
    VERTEX,
    closest_of,
    dot,
    nodes_of,
    weighted,
    weights_of,
)
from foldyn.mechanics.contact.hinge_guards import TURN, gradient_at
from foldyn.mechanics.contact.planes import height
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.contact.search import place

SLOWNESS = 2.0  # tau divided by the step: limits contact vibrations to half a radian per step
STRETCH = 1.02  # steps that end at load jumps may exceed the resolving step by this factor


class Added(NamedTuple):
    """Contacts with inertia in a step, with room for all candidates."""

    count: NDArray  # (1,) int64
    nodes: NDArray  # (room, 4)
    gradient: NDArray  # (room, 4, 3) gradient of the distance, or of the dihedral
    ease: NDArray  # (room,) 1 / (tau^2 K)
    lightness: NDArray  # (room,) approximate 1 / moving mass of each contact
    lines: NDArray  # (4, room) scratch of the solver


def room_for(tables: Tables, memory: Memory) -> Added:
    """Room for all pairs, hinges and nodes on planes that may touch in a step."""
    room = memory.near.size + tables.hinge_limit.size + tables.meeting.size * len(tables.planes)
    nodes, gradient = np.empty((room, 4), np.int64), np.empty((room, 4, 3))
    ease, lightness, lines = np.empty(room), np.empty(room), np.empty((4, room))
    return Added(np.zeros(1, np.int64), nodes, gradient, ease, lightness, lines)


@inner
def _slow(added, k, stiffness, dt, beta, lightness):
    """Whether a step is too long to resolve contact k; if so, gives the contact inertia."""
    light = 0.0
    for i in range(4):
        for axis in range(3):
            light += added.gradient[k, i, axis] ** 2 * lightness[added.nodes[k, i]]
    if not dt * math.sqrt(stiffness * light) > STRETCH * beta:
        return False
    added.ease[k] = 1.0 / ((SLOWNESS * dt) ** 2 * stiffness)
    added.lightness[k] = light
    return True


@inlined
def added_inertia(tables, added, u, dt, beta, lightness, memory):
    """Collect in `added` the contacts that a step of dt from displacement u does not resolve.

    beta : largest vibration angle of a contact per step, rad; lightness : (n,) 1 / mass of the
    nodes, 1/kg.
    """
    counts, x, found = memory.counts, memory.x, 0
    added.count[0] = 0
    if not dt > STRETCH * memory.facts.resolved:
        return
    meeting, planes, stiffness = tables.meeting.size, len(tables.planes), tables.stiffness
    hinges = tables.hinge_limit.size if counts.hinges > 0 else 0
    nodes, gradient = added.nodes, added.gradient
    place(tables, u, memory)
    for kind in range(2):
        for near in range(counts.near_first if kind == VERTEX else counts.near_second):
            k = memory.near[kind, near]
            one, other, d0 = memory.pairs[kind, k, 0], memory.pairs[kind, k, 1], memory.d0[kind, k]
            a, b, c, d = nodes_of(tables.triangles, tables.edges, kind, one, other)
            p, q, _ = closest_of(tables.triangles, tables.edges, x, kind, one, other)
            weights = weights_of(kind, p, q)
            r = weighted(x, (a, b, c, d), weights)
            distance = math.sqrt(dot(r, r))
            if distance < d0:
                nodes[found, 0], nodes[found, 1], nodes[found, 2], nodes[found, 3] = a, b, c, d
                for i in range(4):
                    for axis in range(3):
                        gradient[found, i, axis] = weights[i] * r[axis] / distance
                own = stiffness * barrier(distance / d0)[2]
                found += _slow(added, found, own, dt, beta, lightness)
    for h in range(hinges):
        turn = gradient_at(tables, x, h)
        theta, begin = min(turn[0], TURN - turn[0]), tables.hinge_limit[h]
        if theta < begin:
            for i in range(4):
                nodes[found, i] = tables.hinges[h, i]
                for axis in range(3):
                    gradient[found, i, axis] = turn[1 + 3 * i + axis]
            own = tables.hinge_stiffness[h] * barrier(theta / begin)[2]
            found += _slow(added, found, own, dt, beta, lightness)
    for p in range(planes):
        for m in range(meeting):
            i = tables.meeting[m]
            d0, d = 0.5 * tables.node_thickness[i], height(tables, x, memory.moved, p, i)
            if d < d0:
                for one in range(4):
                    nodes[found, one] = i
                    for axis in range(3):
                        gradient[found, one, axis] = 0.0
                for axis in range(3):
                    gradient[found, 0, axis] = tables.planes[p, NORMAL + axis]
                own = stiffness * barrier(d / d0)[2]
                found += _slow(added, found, own, dt, beta, lightness)
    added.count[0] = found
