"""Friction between panels, pair by pair: its potential, its return mapping, no moments."""

from __future__ import annotations

import numpy as np
import pytest
from contact_samples import NO_HINGES, sheets
from numpy.testing import assert_allclose

from foldyn.checks import gradient_error, tangent_error
from foldyn.mechanics.contact.candidates import tables
from foldyn.mechanics.contact.contact_state import memory
from foldyn.mechanics.contact.distances import EDGES, VERTEX
from foldyn.mechanics.contact.panel_friction import (
    add_rub,
    add_rub_tangent,
    add_rubs,
    pressed_pair,
    rub_power,
    rub_state,
    slip_pairs,
)
from foldyn.mechanics.contact.search import list_pairs, use_all

D0, MU = 0.2, 0.3
# a triangle amid others of its panel, and a triangle of another panel with vertex 0 and edge 0-8
FAN = [[1, 2, 3], [1, 3, 4], [1, 4, 2], [2, 5, 3], [3, 6, 4], [4, 7, 2], [8, 9, 0]]


class Rubbing:
    """One pair near each other, of a kind; k is 1 N/m."""

    def __init__(self, kind: str) -> None:
        nodes = np.random.default_rng(0).standard_normal((10, 3))
        made = sheets(nodes, FAN, [0, 0, 0, 0, 0, 0, 1], D0, friction=MU)
        self.tables = tables(made, NO_HINGES)
        self.kept = memory(self.tables)
        self.kind = VERTEX if kind == "vertex" else EDGES
        self.nodes = [0, 1, 2, 3] if self.kind == VERTEX else [0, 8, 1, 2]
        parts = (0, 0) if self.kind == VERTEX else (self._edge(0, 8), self._edge(1, 2))
        kept = self.kept
        kept.pairs[self.kind, 0], kept.d0[self.kind, 0] = parts, D0
        kept.counts.listed_first = kept.counts.near_first = int(self.kind == VERTEX)
        kept.counts.listed_second = kept.counts.near_second = int(self.kind == EDGES)
        kept.near[:, 0] = 0
        self.tie = kept.tie[self.kind, 0]

    def _edge(self, a: int, b: int) -> int:
        return int(np.flatnonzero((self.tables.edges == sorted((a, b))).all(axis=1))[0])

    def touching(self, rng, beside: bool = False) -> np.ndarray:
        """Positions (10, 3) at which the pair touches, tied a part of d0 beside that.

        beside : a vertex near a side, edges that are nearly parallel.
        """
        most = rng.choice([0.2, np.inf])  # N: what is pressed less slips
        while True:
            x = rng.standard_normal((10, 3))
            if self.kind == VERTEX:
                within = rng.dirichlet([30.0, 30.0, 1.0] if beside else [3.0] * 3)
                x[0] = within @ x[1:4] + 0.08 * rng.standard_normal(3)
            else:
                if beside:
                    x[8] = x[0] + (x[2] - x[1]) + 0.02 * rng.standard_normal(3)
                s, t = rng.uniform(0.2, 0.8, 2)
                off = x[1] + s * (x[2] - x[1]) - x[0] - t * (x[8] - x[0])
                x[[0, 8]] += off + 0.08 * rng.standard_normal(3)
            pressed, p, q = self.pressed(x)
            if 0.0 < pressed < most:
                there = (
                    rng.dirichlet([1.0] * 3)[:2] if self.kind == VERTEX else rng.uniform(0, 1, 2)
                )
                self.tie[:] = *(0.8 * np.array([p, q]) + 0.2 * there), pressed, 0.0
                return x

    def pressed(self, x) -> tuple[float, float, float]:
        return pressed_pair(self.tables, self.kept, x, self.kind, 0)

    def force(self, x) -> np.ndarray:
        force = np.zeros((10, 3))
        add_rub(self.tables, self.kept, x, force, self.kind, 0, *self.pressed(x))
        return force

    def inside(self, x) -> bool:
        """Whether no rim is closest."""
        _, p, q = self.pressed(x)
        return self.kind == EDGES or min(p, q, 1.0 - p - q) > 0.0

    def first(self, force) -> np.ndarray:
        """The part of a force on the first part of the pair."""
        return force[0] if self.kind == VERTEX else force[[0, 8]].sum(axis=0)

    def tangent(self, x) -> np.ndarray:
        block, out = np.zeros((12, 12)), np.zeros((30, 30))
        add_rub_tangent(self.tables, self.kept, x, self.kind, 0, 1.0, block)
        dofs = (3 * np.asarray(self.nodes)[:, None] + np.arange(3)).ravel()
        out[np.ix_(dofs, dofs)] = block
        return out

    def tangent_error(self, x, size: float) -> float:
        """Of the tangent as the derivative of the force."""

        def force(u):
            return self.force(u.reshape(10, 3)).ravel()

        return tangent_error(
            force, lambda u: self.tangent(u.reshape(10, 3)), at=x.ravel(), size=size
        )

    def state(self, x) -> tuple[float, bool]:
        """Energy of the spring, and whether it slips."""
        self.kept.x[:] = x
        return rub_state(self.tables, self.kept)

    def slip(self, x) -> float:
        return slip_pairs(self.tables, x, self.kept)


@pytest.fixture(params=["vertex", "edges"])
def pair(request) -> Rubbing:
    return Rubbing(request.param)


def weak(pair: Rubbing, x) -> None:
    """Tie the pair so near that it sticks."""
    _, p, q = pair.pressed(x)
    for _ in range(60):
        if not pair.state(x)[1]:
            return
        pair.tie[:2] += 0.5 * (np.array([p, q]) - pair.tie[:2])


@pytest.mark.matrix
def test_what_sticks_has_a_potential(pair):
    """Its gradient is the force, its second derivative the tangent."""
    rng, errors = np.random.default_rng(3), []
    for _ in range(30):
        x = pair.touching(rng)
        weak(pair, x)
        assert not pair.state(x)[1]
        gradient = gradient_error(
            lambda u: pair.state(u.reshape(10, 3))[0],
            lambda u: pair.force(u.reshape(10, 3)).ravel(), at=x.ravel(), size=1e-3,
        )  # fmt: skip
        errors.append((gradient, pair.tangent_error(x, 1e-3)))
    assert (np.median(errors, axis=0) < [1e-8, 1e-8]).all()


@pytest.mark.parametrize("where", ["anywhere", "beside"])
@pytest.mark.parametrize("lagged", [False, True])
def test_tangents_of_what_slips_are_exact(pair, lagged, where):
    """Also beside inner sides, whose parts count then, and of edges that are nearly parallel."""
    rng, errors = np.random.default_rng(4), []
    pair.kept.counts.lagged = int(lagged)
    while len(errors) < 30:
        x = pair.touching(rng, where == "beside")
        if not pair.state(x)[1]:
            continue
        errors.append(pair.tangent_error(x, 1e-2))
        tangent = pair.tangent(x)
        uneven = np.abs(tangent - tangent.T).max() > 1e-9 * np.abs(tangent).max()
        assert uneven == (not lagged) or where == "beside"
    # where a closest point passes to another part, differences straddle a kink
    assert np.quantile(errors, 0.8) < 1e-7 and np.median(errors) < 1e-8


def test_friction_is_bounded_along_the_parts_and_has_no_moment(pair):
    rng, seen = np.random.default_rng(5), set()
    for _ in range(60):
        x = pair.touching(rng)
        force, (pressed, *_), slips = pair.force(x), pair.pressed(x), pair.state(x)[1]
        size = np.abs(force).max()
        assert np.abs(force.sum(axis=0)).max() < 1e-13 * size
        assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-12 * size
        first = pair.first(force)
        assert np.linalg.norm(first) <= MU * pressed * (1 + 1e-9)
        if slips and pair.inside(x):
            assert np.linalg.norm(first) == pytest.approx(MU * pressed, rel=1e-9)
        seen.add(slips and pair.inside(x))
    assert seen == {True, False}


def test_a_rigid_motion_strains_no_spring(pair):
    rng = np.random.default_rng(6)
    x = pair.touching(rng)
    before, turned = pair.force(x), np.linalg.qr(rng.standard_normal((3, 3)))[0]
    energy = pair.state(x)[0]
    assert_allclose(pair.force(x @ turned.T + 1.0), before @ turned.T, atol=1e-9 * before.max())
    assert pair.state(x @ turned.T + 1.0)[0] == pytest.approx(energy, rel=1e-9)


def test_a_slip_keeps_the_force_and_dissipates_what_the_spring_lets_go(pair):
    rng, slipped = np.random.default_rng(7), 0
    for _ in range(60):
        x = pair.touching(rng)
        if not pair.inside(x):
            continue
        (pressed, *_), before = pair.pressed(x), pair.force(x)
        energy, slips = pair.state(x)
        tied = pair.tie[:2].copy()
        lost = pair.slip(x)
        # the nodes share it a little differently, as the tied points move
        assert_allclose(pair.first(pair.force(x)), pair.first(before), rtol=1e-9)
        assert_allclose(pair.force(x), before, atol=0.2 * np.abs(before).max())
        assert pair.state(x)[0] == pytest.approx(energy, rel=1e-8)
        if not slips:
            assert lost == 0.0 and (pair.tie[:2] == tied).all()
            continue
        slipped += 1
        # the tie ends mu N / k from the closest points, its way is what was more
        assert pair.tie[3] == pytest.approx(MU * pressed, rel=1e-9)
        assert lost > 0.0
        assert pair.slip(x) < 1e-9 * lost
    assert slipped > 5


@pytest.mark.matrix
def test_power_is_that_of_the_forces(pair):
    rng = np.random.default_rng(8)
    x, v = pair.touching(rng), rng.standard_normal((10, 3))
    pair.kept.x[:] = x
    assert rub_power(pair.tables, v, pair.kept) == pytest.approx(
        (pair.force(x) * v).sum(), rel=1e-12
    )


def test_what_lets_go_is_untied_and_loses_its_spring(pair):
    rng = np.random.default_rng(9)
    x = pair.touching(rng)
    pair.slip(x)
    held = pair.state(x)[0]
    away = x.copy()
    away[[0, 8, 9]] += 10.0
    assert pair.slip(away) == pytest.approx(held, rel=1e-9)
    assert pair.tie[2] == 0.0 and np.abs(pair.force(x)).max() == 0.0


def test_ties_stay_where_lists_are_made_anew(pair):
    """Also where the new list does not have their pair."""
    rng = np.random.default_rng(10)
    x, kept = pair.touching(rng), pair.kept
    kept.tie[:, :, 3] = 1.0
    tie, parts = pair.tie.copy(), kept.pairs[pair.kind, 0].copy()
    for positions in (x, x + 20.0 * rng.standard_normal((10, 3)), x):
        kept.x[:] = positions
        list_pairs(pair.tables, positions - pair.tables.rest, kept)
        use_all(kept)
        listed = kept.counts.listed_first if pair.kind == VERTEX else kept.counts.listed_second
        pairs = kept.pairs[pair.kind, :listed]
        (place,) = np.flatnonzero((pairs == parts).all(axis=1) | (pairs == parts[::-1]).all(axis=1))
        assert (kept.tie[pair.kind, place] == tie).all()
        # no stretch is left in other rows
        assert (np.count_nonzero(kept.tie[pair.kind, :listed, 2:], axis=0) == 1).all()


def test_ties_stay_where_no_list_can_be_made(pair):
    rng = np.random.default_rng(11)
    x, kept = pair.touching(rng), pair.kept
    force = pair.force(x)
    for positions in (np.full_like(x, np.nan), x):
        kept.x[:] = positions
        list_pairs(pair.tables, positions - pair.tables.rest, kept)
        use_all(kept)
        assert kept.counts.full == np.isnan(positions).any()
    rub = np.zeros((10, 3))
    add_rubs(pair.tables, kept, rub)
    assert_allclose(rub, force, rtol=1e-12)
