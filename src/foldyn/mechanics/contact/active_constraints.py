"""Directions that active contact constrains, for the search for mechanisms."""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.candidates import FRICTION, NORMAL, Tables
from foldyn.mechanics.contact.contact_state import Memory
from foldyn.mechanics.contact.pairs import EDGES, VERTEX, closest_of, nodes_of, weights_of
from foldyn.mechanics.contact.tangent import touching_pairs
from foldyn.mechanics.sheet_term import unit_rows


def held_by_planes(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): normals of planes at contact nodes, all axes with friction."""
    plane, node = np.nonzero(kept.friction[:, :, 3])
    rubs = (own.planes[plane, FRICTION] > 0.0) & (kept.anchor[plane, node, 3] > 0.0)
    normals = own.planes[plane, NORMAL : NORMAL + 3]
    nodes = np.concatenate([node, np.repeat(node[rubs], 3)])[:, None]
    axes = np.tile(np.eye(3), (int(rubs.sum()), 1))
    return unit_rows(nodes, np.concatenate([normals, axes]), size)


def held_by_panels(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): distances of touching pairs, all relative motions with friction."""
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

    Also returns whether friction ties each (k,).
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
