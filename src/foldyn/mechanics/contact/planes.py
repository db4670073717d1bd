"""Planes that nodes of a sheet touch, with Coulomb friction.

A node at the distance d from a plane has the energy k d0^2 f(d/d0), with d0 half the sheet's
thickness. Friction is a spring along the plane from the node to an anchor that moves with the
plane: it pulls with k s, s its stretch, but at most with mu N, N the normal force. At the end of a
step the anchor follows a slipping node, and the energy that the spring loses is dissipated (the
elastic predictor and slip of return mapping; Wriggers, Computational Contact Mechanics, 2006,
section 5.2.3). Implicit methods use N from the end of the last step: friction then has a potential
within a step, and a symmetric tangent.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.candidates import FRICTION, HISTORY, MOTION, NORMAL, POINT
from foldyn.mechanics.contact.potential import barrier

LEAST = 1e-300  # N: smallest normal force that counts as contact


@kernel
def move_planes(tables, factor, memory):
    """Set displacements and velocities of the planes for the factors (h, 3) of histories."""
    for p in range(len(tables.planes)):
        row = int(tables.planes[p, HISTORY])
        if row < 0:
            continue
        for c in range(3):
            memory.moved[p, c] = tables.planes[p, MOTION + c] * factor[row, 0]
            memory.moved[p, 3 + c] = tables.planes[p, MOTION + c] * factor[row, 1]


@inner
def height(tables, x, moved, p, i):
    """Distance (m) of node i from plane p, positive in front, for plane displacements (q, 3)."""
    plane, out = tables.planes[p], 0.0
    for c in range(3):
        out += (x[i, c] - plane[POINT + c] - moved[p, c]) * plane[NORMAL + c]
    return out


@inner
def add_planes(tables, x, memory, force):
    """Energy (J) of a member's nodes on planes; adds gradient and friction to force (n, 3)."""
    energy, k, mine = 0.0, tables.stiffness, memory.share.meeting
    for p in range(len(tables.planes)):
        plane = tables.planes[p]
        for m in range(mine[0], mine[1]):
            i = tables.meeting[m]
            push = memory.friction[p, i]
            push[0] = push[1] = push[2] = push[3] = 0.0
            d0, d = 0.5 * tables.node_thickness[i], height(tables, x, memory.moved, p, i)
            if d >= d0:
                continue
            f, f1, _ = barrier(d / d0)
            energy += k * d0 * d0 * f
            push[3] = -k * d0 * f1
            for c in range(3):
                force[i, c] -= push[3] * plane[NORMAL + c]
            if plane[FRICTION] > 0.0 and memory.anchor[p, i, 3] > 0.0:
                stretch = stretch_of(tables, x, memory.moved, memory, p, i)
                most = farthest_stretch(tables, memory, p, i)
                share = k if stretch[3] <= most else k * most / stretch[3]
                for c in range(3):
                    push[c] = share * stretch[c]
                    force[i, c] += push[c]
    return energy


@inner_scalar
def farthest_stretch(tables, memory, p, i):
    """Stretch (m) at which the spring of node i on plane p slips, given its normal force."""
    lagged = memory.counts.lagged == 1
    normal = memory.anchor[p, i, 3] if lagged else memory.friction[p, i, 3]
    return tables.planes[p, FRICTION] * normal / tables.stiffness


@inner
def stretch_of(tables, x, moved, memory, p, i):
    """Stretch (m) of the spring of node i on plane p: three components, then their norm.

    moved : (q, 3) displacement of the planes, m.
    """
    plane, anchor = tables.planes[p], memory.anchor[p, i]
    a, b, c = x[i, 0] - moved[p, 0], x[i, 1] - moved[p, 1], x[i, 2] - moved[p, 2]
    a, b, c = a - anchor[0], b - anchor[1], c - anchor[2]
    out = a * plane[NORMAL] + b * plane[NORMAL + 1] + c * plane[NORMAL + 2]
    a -= out * plane[NORMAL]
    b -= out * plane[NORMAL + 1]
    c -= out * plane[NORMAL + 2]
    return a, b, c, math.sqrt(a * a + b * b + c * c)


@kernel
def slip(tables, x, memory):
    """Update anchors at the end of a step: follow slipping nodes, begin or end a contact."""
    mine = memory.share.meeting
    for p in range(len(tables.planes)):
        plane, moved = tables.planes[p], memory.moved[p]
        if plane[FRICTION] == 0.0:
            continue
        for m in range(mine[0], mine[1]):
            i = tables.meeting[m]
            anchor = memory.anchor[p, i]
            d0, d = 0.5 * tables.node_thickness[i], height(tables, x, memory.moved, p, i)
            if d >= d0:
                anchor[3] = 0.0
                continue
            fresh, pressed = anchor[3] == 0.0, -d0 * barrier(d / d0)[1]
            anchor[3] = max(tables.stiffness * pressed, LEAST)
            if fresh:
                for c in range(3):
                    anchor[c] = x[i, c] - moved[c]
                continue
            most = plane[FRICTION] * pressed
            stretch = stretch_of(tables, x, memory.moved, memory, p, i)
            if stretch[3] > most:
                for c in range(3):
                    anchor[c] += (1.0 - most / stretch[3]) * stretch[c]


@inner
def plane_powers(tables, v, memory):
    """Power (W) of moving planes on a member's nodes with velocities v (n, 3), and of friction.

    Call it after `add_planes`.
    """
    work, dissipated, mine = 0.0, 0.0, memory.share.meeting
    for p in range(len(tables.planes)):
        plane, moved = tables.planes[p], memory.moved[p]
        for m in range(mine[0], mine[1]):
            i = tables.meeting[m]
            push = memory.friction[p, i]
            if push[3] == 0.0:
                continue
            for c in range(3):
                speed = moved[3 + c]
                work += (push[3] * plane[NORMAL + c] - push[c]) * speed
                dissipated += push[c] * (v[i, c] - speed)
    return work, dissipated
