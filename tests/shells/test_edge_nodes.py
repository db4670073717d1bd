"""The nodes along the edges of a pattern, in a shell."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.shells.mesh import shell_mesh


@pytest.mark.parametrize("divisions", [1, 2, 5])
def test_nodes_along_edges(divisions):
    pattern = fd.patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30, storeys=1)
    shell = fd.shell(pattern, fd.Sheet(1e6, 0.25, 0.01), divisions=divisions)
    ends = np.concatenate([pattern.creases, pattern.boundary])
    found = shell.edge_nodes
    np.testing.assert_array_equal(found[:, [0, -1]], ends)
    part = np.linspace(0.0, 1.0, divisions + 1)[:, None]
    for nodes, (a, b) in zip(found, pattern.vertices[ends], strict=True):
        np.testing.assert_allclose(shell.nodes[nodes], a + (b - a) * part, atol=1e-14)
    made = shell_mesh(pattern, divisions).edge_points
    assert {tuple(nodes) for nodes in found.tolist()} == {tuple(p) for p in made.values()}
