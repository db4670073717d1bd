"""Pairs in contact: distances, potential, forces, tangents; what is counted once."""

from __future__ import annotations

import numpy as np
import pytest
from contact_samples import NO_HINGES, sheets

from foldyn.checks import gradient_error, tangent_error
from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.candidates import tables
from foldyn.mechanics.contact.distances import closest_of_segments, closest_on_triangle
from foldyn.mechanics.contact.pair_potentials import (
    edge_edge,
    edge_edge_tangent,
    vertex_triangle,
    vertex_triangle_tangent,
)
from foldyn.mechanics.contact.potential import barrier

D0 = 0.2
# a vertex over a triangle amid others of its panel, and two edges
FAN = [[1, 2, 3], [1, 3, 4], [1, 4, 2], [2, 5, 3], [3, 6, 4], [4, 7, 2], [8, 9, 0]]


@pytest.fixture(scope="module")
def amid():
    """Tables in which all sides of triangle 0 are shared, and its corner 1 is closed."""
    nodes = np.random.default_rng(0).standard_normal((10, 3))
    return tables(sheets(nodes, FAN, [0, 0, 0, 0, 0, 0, 1], D0), NO_HINGES)


@kernel
def _barrier(x):
    return barrier(x)


def test_potential_grows_without_bound_and_ends_smoothly():
    for x in (0.05, 0.3, 0.9):
        f, f1, f2 = _barrier(x)
        h = 1e-5 * x
        near = [_barrier(x + k * h) for k in (-1, 1)]
        assert (1 - x) ** 3 / x**4 == pytest.approx(f, rel=1e-13)
        assert (near[1][0] - near[0][0]) / (2 * h) == pytest.approx(f1, rel=1e-8)
        assert (near[1][1] - near[0][1]) / (2 * h) == pytest.approx(f2, rel=1e-8)
    assert np.abs(_barrier(1.0 - 1e-9)).max() < 1e-8
    assert _barrier(1e-3)[0] > 1e11 and _barrier(0.0)[0] == np.inf == _barrier(-0.1)[0]


def test_closest_points_are_closest():
    rng = np.random.default_rng(1)
    fine = rng.dirichlet([0.5] * 3, 4000)
    s, t = rng.beta(0.4, 0.4, (2, 4000, 1))
    for _ in range(40):
        p, a, b, c = rng.standard_normal((4, 3))
        wa, wb, wc, _ = closest_on_triangle(tuple(p), tuple(a), tuple(b), tuple(c))
        found = np.linalg.norm(p - wa * a - wb * b - wc * c)
        tried = np.linalg.norm(p - fine @ [a, b, c], axis=1).min()
        assert found <= tried + 1e-12 and found >= tried - 0.1
        si, ti, _ = closest_of_segments(tuple(p), tuple(a), tuple(b), tuple(c))
        found = np.linalg.norm(p + si * (a - p) - b - ti * (c - b))
        tried = np.linalg.norm(p + s * (a - p) - b - t * (c - b), axis=1).min()
        assert found <= tried + 1e-12 and found >= tried - 0.1


def vertex_over(rng) -> np.ndarray:
    """Positions (10, 3) with node 0 near triangle 0: over its inside, its sides, its corners."""
    x = rng.standard_normal((10, 3))
    x[0] = rng.dirichlet([0.3] * 3) @ x[1:4] + 0.05 * rng.standard_normal(3)
    return x


def edges_near(rng, parallel: bool) -> np.ndarray:
    """Positions (10, 3) at which edge 0-8 is near edge 1-2, and perhaps nearly parallel to it."""
    x = rng.standard_normal((10, 3))
    if parallel:
        x[8] = x[0] + (x[2] - x[1]) + 0.05 * rng.standard_normal(3)
    s, t = rng.beta(0.5, 0.5, 2)
    off = x[1] + s * (x[2] - x[1]) - x[0] - t * (x[8] - x[0]) + 0.05 * rng.standard_normal(3)
    x[[0, 8]] += off
    return x


def number(of, a, b) -> int:
    return int(np.flatnonzero((of.edges == sorted((a, b))).all(axis=1))[0])


def whole(block, nodes) -> np.ndarray:
    """Matrix (30, 30) with a block (12, 12) of four nodes."""
    out = np.zeros((30, 30))
    dofs = (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()
    out[np.ix_(dofs, dofs)] = block
    return out


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["vertex", "edges", "parallel edges"])
def test_forces_and_tangents_are_exact(amid, kind):
    rng, errors = np.random.default_rng(2), []
    i, j = number(amid, 0, 8), number(amid, 1, 2)

    def of(u):
        x, force = u.reshape(10, 3), np.zeros((10, 3))
        if kind == "vertex":
            return vertex_triangle(amid, x, force, 0, 0, D0)[0], force.ravel()
        return edge_edge(amid, x, force, i, j, D0)[0], force.ravel()

    def tangent(u):
        block = np.zeros((12, 12))
        if kind == "vertex":
            vertex_triangle_tangent(amid, u.reshape(10, 3), 0, 0, D0, block)
            return whole(block, [0, 1, 2, 3])
        edge_edge_tangent(amid, u.reshape(10, 3), i, j, D0, block)
        return whole(block, [*amid.edges[i], *amid.edges[j]])

    while len(errors) < 60:
        x = vertex_over(rng) if kind == "vertex" else edges_near(rng, kind == "parallel edges")
        u = x.ravel()
        energy, force = of(u)
        if energy == 0.0:
            continue
        gradient = gradient_error(lambda u: of(u)[0], lambda u: of(u)[1], at=u, size=2e-2)
        errors.append((gradient, tangent_error(lambda u: of(u)[1], tangent, at=u, size=2e-2)))
        pushed = force.reshape(10, 3)
        assert np.abs(pushed.sum(axis=0)).max() < 1e-13 * np.abs(pushed).max()
        assert np.abs(np.cross(x, pushed).sum(axis=0)).max() < 1e-12 * np.abs(pushed).max()
    # where the closest point passes from one part to another, differences straddle a kink
    assert (np.median(errors, axis=0) < [1e-10, 1e-8]).all()
    assert (np.quantile(errors, 0.9, axis=0) < [1e-7, 1e-5]).all()


def test_a_vertex_over_a_flat_sheet_is_counted_once():
    """Also above what triangles share: plain sums of pairs would count up to six times there."""
    grid = np.array([[i, j, 0.0] for i in range(4) for j in range(4)])
    cells = [[4 * i + j, 4 * i + j + 4, 4 * i + j + 5, 4 * i + j + 1] for i in range(3)
             for j in range(3)]  # fmt: skip
    flat = [[c[0], c[1], c[2]] for c in cells] + [[c[0], c[2], c[3]] for c in cells]
    own = len(grid)
    nodes = np.vstack([grid, [[0, 0, 0], [0, 0, 9], [1, 0, 9]]])
    panel = [0] * len(flat) + [1]
    made = tables(sheets(nodes, [*flat, [own, own + 1, own + 2]], panel, 0.1), NO_HINGES)
    once = -0.1 * _barrier(0.6)[1]
    for place in ((1.3, 1.2), (1.5, 1.5), (1.5, 1.0), (1.0, 1.0), (2.0, 1.7)):
        nodes[own] = (*place, 0.06)
        force = np.zeros_like(nodes)
        pressed = [vertex_triangle(made, nodes, force, own, t, 0.1)[1] for t in range(len(flat))]
        assert sum(pressed) == pytest.approx(once, rel=1e-12)
        assert -force[own, 2] == pytest.approx(once, rel=1e-12)
