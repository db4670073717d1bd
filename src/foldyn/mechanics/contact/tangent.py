"""Tangents of all contacts as elements of four nodes, and the directions that contact holds."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import assembled, pairs_within
from foldyn.mechanics.contact.candidates import FRICTION, NORMAL, Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.distances import (
    EDGES,
    VERTEX,
    closest_of,
    gap_of,
    nodes_of,
    weights_of,
)
from foldyn.mechanics.contact.hinge_guards import TURN, gradient_at
from foldyn.mechanics.contact.pair_potentials import edge_edge_tangent, vertex_triangle_tangent
from foldyn.mechanics.contact.panel_friction import add_rub_tangent
from foldyn.mechanics.contact.planes import farthest_stretch, height, stretch_of
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.sheet_term import unit_rows


@kernel
def touching_pairs(tables, memory):
    """Indices of the listed pairs of each kind closer than d0 at memory.x."""
    x, triangles, edges = memory.x, tables.triangles, tables.edges
    out, found = np.empty((2, memory.d0.shape[1]), np.int64), np.zeros(2, np.int64)
    for kind in range(2):
        listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
        for k in range(listed):
            one, other = memory.pairs[kind, k, 0], memory.pairs[kind, k, 1]
            if kind == EDGES and not closest_of(triangles, edges, x, kind, one, other)[2]:
                continue
            if gap_of(triangles, edges, x, kind, one, other) < memory.d0[kind, k]:
                out[kind, found[kind]] = k
                found[kind] += 1
    return out[0, : found[0]].copy(), out[1, : found[1]].copy()


@kernel
def pair_tangents(tables, memory, first, second, nodes, blocks):
    """Force derivatives of some listed pairs, into nodes (k, 4) and blocks (k, 12, 12)."""
    x, triangles, edges = memory.x, tables.triangles, tables.edges
    for k in range(first.size + second.size):
        kind = VERTEX if k < first.size else EDGES
        pair = first[k] if kind == VERTEX else second[k - first.size]
        one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
        d0, own = memory.d0[kind, pair], nodes_of(triangles, edges, kind, one, other)
        nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3] = own
        if kind == VERTEX:
            vertex_triangle_tangent(tables, x, one, other, d0, blocks[k])
        else:
            edge_edge_tangent(tables, x, one, other, d0, blocks[k])
        if tables.friction > 0.0:
            add_rub_tangent(tables, memory, x, kind, pair, 1.0, blocks[k])


@kernel
def guard_tangents(tables, x, blocks):
    """Second derivatives (h, 4, 3, 4, 3) of hinge guards, and whether each acts (h,)."""
    acts = np.zeros(tables.hinge_limit.size, np.bool_)
    points, gradient = np.empty((4, 3)), np.empty((4, 3))
    for h in range(tables.hinge_limit.size):
        found, limit = gradient_at(tables, x, h), tables.hinge_limit[h]
        theta, sign = found[0], 1.0
        if theta > math.pi:
            theta, sign = TURN - theta, -1.0
        if theta >= limit:
            continue
        acts[h] = True
        _, f1, f2 = barrier(theta / limit)
        for v in range(4):
            for c in range(3):
                points[v, c], gradient[v, c] = x[tables.hinges[h, v], c], found[1 + 3 * v + c]
        turning, block = flat(gradient), blocks[h].reshape(12, 12)
        for p in range(12):
            for q in range(12):
                block[p, q] = tables.hinge_stiffness[h] * f2 * turning[p] * turning[q]
        add_hessian(points, gradient, sign * tables.hinge_stiffness[h] * limit * f1, blocks[h])
    return acts


@kernel
def plane_tangents(tables, x, memory):
    """Force derivatives (q, n, 3, 3) of planes on nodes, friction included.

    Call it after `add_planes`.
    """
    out = np.zeros((len(tables.planes), len(x), 3, 3))
    for p in range(len(tables.planes)):
        for m in range(tables.meeting.size):
            i = tables.meeting[m]
            d0, d = 0.5 * tables.node_thickness[i], height(tables, x, memory.moved, p, i)
            if d >= d0:
                continue
            stiffness = tables.stiffness * barrier(d / d0)[2]
            for a in range(3):
                for b in range(3):
                    normal = tables.planes[p, NORMAL + a] * tables.planes[p, NORMAL + b]
                    out[p, i, a, b] += stiffness * normal
            if tables.planes[p, FRICTION] > 0.0 and memory.anchor[p, i, 3] > 0.0:
                friction_tangent(tables, x, memory.moved, memory, p, i, stiffness, out[p, i])
    return out


@inner
def friction_tangent(tables, x, moved, memory, p, i, stiffness, out):
    """Add the derivative of the spring of node i on plane p to out (3, 3).

    moved : (q, 3) displacement of the planes, m.
    stiffness : rate, N/m, at which the current normal force falls as the node rises; if that force
    limits friction, the derivative of a slipping node is not symmetric.
    """
    k, stretch = tables.stiffness, stretch_of(tables, x, moved, memory, p, i)
    most = farthest_stretch(tables, memory, p, i)
    slips = stretch[3] > most
    share = most / stretch[3] if slips else 1.0
    rate = 0.0 if memory.counts.lagged == 1 else tables.planes[p, FRICTION] * stiffness
    for a in range(3):
        for b in range(3):
            along = -tables.planes[p, NORMAL + a] * tables.planes[p, NORMAL + b]
            along += 1.0 if a == b else 0.0
            if slips:  # the force keeps its direction
                along -= stretch[a] * stretch[b] / (stretch[3] * stretch[3])
                out[a, b] -= rate * stretch[a] / stretch[3] * tables.planes[p, NORMAL + b]
            out[a, b] += k * share * along


def of_contacts(
    nodes: NDArray, blocks: NDArray, hinges: NDArray, guards: NDArray, planes: NDArray, size: int
) -> sparse.csr_array:
    """Matrix (size, size) of pairs (k, 12, 12), hinge guards (h, 4, 3, 4, 3), planes (n, 3, 3)."""
    four = np.concatenate([blocks.reshape(-1, 4, 3, 4, 3), guards])
    met = np.flatnonzero(planes.any(axis=(1, 2)))
    within = pairs_within(np.concatenate([nodes, hinges]))
    pairs = np.concatenate([within, np.column_stack([met, met])])
    entries = np.concatenate([four.swapaxes(2, 3).reshape(-1, 3, 3), planes[met]])
    return assembled(pairs, entries, size)


def held_by_planes(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): plane normals at contact nodes; with friction, all axes."""
    plane, node = np.nonzero(kept.friction[:, :, 3])
    rubs = (own.planes[plane, FRICTION] > 0.0) & (kept.anchor[plane, node, 3] > 0.0)
    normals = own.planes[plane, NORMAL : NORMAL + 3]
    nodes = np.concatenate([node, np.repeat(node[rubs], 3)])[:, None]
    axes = np.tile(np.eye(3), (int(rubs.sum()), 1))
    return unit_rows(nodes, np.concatenate([normals, axes]), size)


def held_by_panels(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): touching pairs' distances; with friction, all relative motions."""
    first, second = touching_pairs(own, kept)
    count = len(first) + len(second)
    nodes = np.empty((count, 4), np.int64)
    weights, normals = np.empty((count, 4)), np.empty((count, 3))
    tied = _directions(own, kept, first, second, nodes, weights, normals)
    axes = np.tile(np.eye(3), (int(tied.sum()), 1))
    which = np.concatenate([np.arange(count), np.repeat(np.flatnonzero(tied), 3)])
    entries = weights[which][:, :, None] * np.concatenate([normals, axes])[:, None, :]
    return unit_rows(nodes[which], entries.reshape(-1, 12), size)


@kernel
def _directions(tables, memory, first, second, nodes, weights, normals):
    """Nodes (k, 4), weights (k, 4) and direction (k, 3) of the distances of some listed pairs.

    Also returns whether friction ties each pair (k,).
    """
    tied = np.zeros(first.size + second.size, np.bool_)
    for k in range(first.size + second.size):
        kind = VERTEX if k < first.size else EDGES
        pair = first[k] if kind == VERTEX else second[k - first.size]
        one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
        own = nodes_of(tables.triangles, tables.edges, kind, one, other)
        p, q, _ = closest_of(tables.triangles, tables.edges, memory.x, kind, one, other)
        nodes[k, 0], nodes[k, 1], nodes[k, 2], nodes[k, 3] = own
        weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3] = weights_of(kind, p, q)
        for c in range(3):
            normals[k, c] = 0.0
            for i in range(4):
                normals[k, c] += weights[k, i] * memory.x[nodes[k, i], c]
        normals[k] /= math.sqrt((normals[k] * normals[k]).sum())
        tied[k] = tables.friction > 0.0 and memory.tie[kind, pair, 2] > 0.0
    return tied
