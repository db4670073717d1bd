"""What contact holds where it touches: for the search for mechanisms."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from foldyn.mechanics.body import unit_rows
from foldyn.mechanics.contact.memory import Memory
from foldyn.mechanics.contact.tables import FRICTION, NORMAL, Tables
from foldyn.mechanics.contact.tangent import pair_directions, touching_pairs


def held_by_planes(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): normals of planes at nodes that touch, all axes where these rub."""
    plane, node = np.nonzero(kept.friction[:, :, 3])
    rubs = (own.planes[plane, FRICTION] > 0.0) & (kept.anchor[plane, node, 3] > 0.0)
    normals = own.planes[plane, NORMAL : NORMAL + 3]
    nodes = np.concatenate([node, np.repeat(node[rubs], 3)])[:, None]
    axes = np.tile(np.eye(3), (int(rubs.sum()), 1))
    return unit_rows(nodes, np.concatenate([normals, axes]), size)


def held_by_panels(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Unit rows (s, size): distances of pairs that touch, all motions where these rub."""
    first, second = touching_pairs(own, kept)
    count = len(first) + len(second)
    nodes, weights, normals = (
        np.empty((count, 4), np.int64),
        np.empty((count, 4)),
        np.empty((count, 3)),
    )
    tied = pair_directions(own, kept, first, second, nodes, weights, normals)
    axes = np.tile(np.eye(3), (int(tied.sum()), 1))
    which = np.concatenate([np.arange(count), np.repeat(np.flatnonzero(tied), 3)])
    entries = weights[which][:, :, None] * np.concatenate([normals, axes])[:, None, :]
    return unit_rows(nodes[which], entries.reshape(-1, 12), size)
