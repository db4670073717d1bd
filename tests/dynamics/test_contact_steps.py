"""Forces of contact in the conserving method: their work, their moment, limit, tangent."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from foldyn.checks import observed_order, tangent_error
from foldyn.dynamics.implicit.contact_measure import new_move
from foldyn.dynamics.implicit.contact_pairs import edges_step, vertex_step
from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.candidates import Sheets, tables
from foldyn.mechanics.contact.pair_potentials import edge_edge, vertex_triangle
from foldyn.mechanics.contact.potential import difference_quotient

D0 = 0.2
# triangle 0 amid others of its panel, of which it shares all sides and corner 1 is closed
FAN = [[1, 2, 3], [1, 3, 4], [1, 4, 2], [2, 5, 3], [3, 6, 4], [4, 7, 2], [8, 9, 0]]
KINDS = ["vertex", "edges", "parallel edges"]


@kernel
def _quotient(x0, x1):
    return difference_quotient(x0, x1)


def test_quotients_are_those_of_the_potential():
    def f(x):
        return (1 - x) ** 3 / x**4 if x < 1 else 0.0

    for x0, x1 in ((0.3, 0.7), (0.9, 0.2), (0.5, 1.3), (1.4, 0.6), (1.0, 0.4)):
        value, slope = _quotient(x0, x1)
        assert value == pytest.approx((f(x1) - f(x0)) / (x1 - x0), rel=1e-13)
        near = [_quotient(x0, x1 * (1 + h))[0] for h in (-1e-5, 1e-5)]
        assert slope == pytest.approx((near[1] - near[0]) / (2e-5 * x1), rel=1e-8)
    x = 0.3  # without a difference that cancels
    assert _quotient(x, x)[0] == pytest.approx(-(0.7**2) / x**4 * (3 + 4 * 0.7 / x), rel=1e-14)
    assert _quotient(1.2, 1.5) == (0.0, 0.0)
    assert not np.isfinite(_quotient(0.5, -0.1)).any()


class Pair:
    """A pair in a step: energies, force and tangent."""

    def __init__(self, kind: str) -> None:
        nodes = np.random.default_rng(0).standard_normal((10, 3))
        sheets = Sheets(
            nodes, np.array(FAN), np.array([0, 0, 0, 0, 0, 0, 1]), np.full(2, D0), 1.0, True, 0.0,
            np.zeros((0, 11)), np.zeros(10, bool),
        )  # fmt: skip
        self.own = tables(sheets, np.zeros((0, 4), np.int64))
        ends = [int(np.flatnonzero((self.own.edges == e).all(axis=1))[0]) for e in ([0, 8], [1, 2])]
        self.edges, self.kind = ends, kind
        self.nodes = [0, 1, 2, 3] if kind == "vertex" else [0, 8, 1, 2]

    def energy(self, x, force=None) -> float:
        """Energy at corners (4, 3), whose gradient goes to force."""
        whole, pushed = np.zeros((10, 3)), np.zeros((10, 3))
        whole[self.nodes] = x
        if self.kind == "vertex":
            out = vertex_triangle(self.own, whole, pushed, 0, 0, D0)
        else:
            out = edge_edge(self.own, whole, pushed, *self.edges, D0)
        if force is not None:
            force[:] = pushed[self.nodes]
        return out[0]

    def step(self, start, end, tangent=False):
        """Force (4, 3) and its tangent; the energy at the end."""
        move, force, block = new_move(), np.zeros(12), np.zeros((12, 12))
        move.start[:], move.end[:] = start, end
        if self.kind == "vertex":
            energy = vertex_step(self.own, 0, D0, move, tangent, force, block)
        else:
            energy = edges_step(self.own, *self.edges, D0, move, tangent, force, block)
        return force.reshape(4, 3), block, energy

    def somewhere(self, rng) -> np.ndarray:
        """Corners (4, 3) near each other."""
        x = rng.standard_normal((4, 3))
        if self.kind == "vertex":
            x[0] = rng.dirichlet([0.3] * 3) @ x[1:] + 0.08 * rng.standard_normal(3)
            return x
        if self.kind == "parallel edges":
            x[1] = x[0] + (x[3] - x[2]) + 0.02 * rng.standard_normal(3)
        s, t = rng.uniform(0.1, 0.9, 2)
        x[:2] += x[2] + s * (x[3] - x[2]) - x[0] - t * (x[1] - x[0])
        x[:2] += 0.08 * rng.standard_normal(3)
        return x


def turned(x, angle):
    rotation = Rotation.from_rotvec(angle * np.array([0.48, -0.6, 0.64])).as_matrix()
    return x @ rotation.T + np.array([0.3, -0.2, 0.1])


@pytest.mark.matrix
@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("kind", KINDS)
def test_work_is_the_change_of_the_energy(kind, angle):
    """Whatever the step, also from and to where nothing touches; no resultant, no moment."""
    pair, rng, touched = Pair(kind), np.random.default_rng(1), 0
    for size in (1e-8, 1e-3, 0.05, 0.3):
        for _ in range(100):
            start = pair.somewhere(rng)
            end = turned(start + size * rng.standard_normal((4, 3)), angle)
            before, after = pair.energy(start), pair.energy(end)
            force, _, energy = pair.step(start, end)
            if max(before, after) > 1e6:  # of k d0^2: nearly through each other
                continue
            touched += before + after > 0.0
            scale = np.abs(force).sum()
            if scale < 1e-6:
                continue
            assert energy == pytest.approx(after, rel=1e-9, abs=1e-13)
            error = (force * (end - start)).sum() - (after - before)
            assert abs(error) < 1e-11 * (before + after + scale)
            assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
            moment = np.cross(0.5 * (start + end), force).sum(axis=0)
            assert np.abs(moment).max() < 1e-11 * scale
    assert touched > 50


@pytest.mark.matrix
@pytest.mark.parametrize("kind", KINDS)
def test_in_short_steps_it_is_the_gradient_halfway(kind):
    pair, rng, orders = Pair(kind), np.random.default_rng(2), []
    while len(orders) < 30:
        middle, along, gradient = pair.somewhere(rng), rng.standard_normal((4, 3)), np.zeros((4, 3))
        if not 1e-6 < pair.energy(middle, gradient) < 1e2:
            continue
        errors = []
        for size in (2e-4, 1e-4):
            force = pair.step(middle - size * along, middle + size * along)[0]
            errors.append(np.abs(force - gradient).max())
        orders.append(observed_order([2.0, 1.0], errors))
    assert np.median(orders) == pytest.approx(2.0, abs=0.05)


@pytest.mark.matrix
@pytest.mark.parametrize("kind", KINDS)
def test_tangents_are_exact(kind):
    pair, rng, errors = Pair(kind), np.random.default_rng(3), []
    while len(errors) < 60:
        start = pair.somewhere(rng)
        end = turned(start + 0.05 * rng.standard_normal((4, 3)), 0.1)
        if not 1e-6 < pair.energy(start) + pair.energy(end) < 1e4:
            continue

        def force(x, start=start):
            return pair.step(start, x.reshape(4, 3))[0].ravel()

        def tangent(x, start=start):
            return pair.step(start, x.reshape(4, 3), True)[1]

        errors.append(tangent_error(force, tangent, at=end.ravel(), size=1e-2))
    # kinks of closest points within the differences, where the tangent has none
    assert np.quantile(errors, 0.8) < 1e-6
