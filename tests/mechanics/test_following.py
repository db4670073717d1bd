"""Loads that depend on the displacement: forces, potentials, tangents, places in memory."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.checks import gradient_error, tangent_error
from foldyn.mechanics.following import (
    Following,
    asymmetry,
    following_force,
    following_places,
    following_tangent,
    joined,
    moments,
    pressures,
    pushes,
    put_following,
    tensions,
)

FACTOR = np.array([[1.3], [0.6]])
NODES, HIDDEN = 9, 4


@pytest.fixture
def x() -> np.ndarray:
    return np.random.default_rng(1).standard_normal((NODES, 3))


@pytest.fixture
def u() -> np.ndarray:
    return 0.1 * np.random.default_rng(2).standard_normal(3 * NODES + HIDDEN)


def triangles(x) -> Following:
    return pressures(x, np.array([[0, 1, 2], [2, 3, 7]]), np.array([2.0, -1.0]))


def hinges(x) -> Following:
    rows = np.array([[0, 1, 2, 3], [3, 4, 5, 6]])
    return moments(x[rows], rows, np.array([0.7, 0.3]))


def clamps(x) -> Following:
    """The second hinge's last wing rides on the mean of its axis."""
    rows = np.array([[0, 1, 2, 3], [3, 4, 5, 6]])
    ridden = rows.copy()
    ridden[1, 3] = -1
    return moments(x[rows], ridden, np.array([0.7, 0.3]))


def hidden(x) -> Following:
    return pushes(np.array([3 * NODES, 3 * NODES + 2]), np.array([0.4, -0.1]))


def bars(x) -> Following:
    return tensions(x, np.array([[0, 5], [2, 6]]), np.array([1.5, -2.0]))


@pytest.mark.parametrize("kind", [triangles, hinges, clamps, bars])
def test_the_tangent_is_the_derivative_of_the_force(kind, x, u) -> None:
    loads = joined([(kind(x), 1)])
    error = tangent_error(
        lambda q: -following_force(loads, q, FACTOR),
        lambda q: following_tangent(loads, q, FACTOR),
        at=u,
    )
    assert error < 1e-9


def test_the_symmetric_tangent_is_the_symmetric_part(x, u) -> None:
    loads = joined([(triangles(x), 0), (hinges(x), 1), (bars(x), 0)])
    whole = following_tangent(loads, u, FACTOR).toarray()
    row, column = following_places(loads)
    values, half = np.empty(len(row)), np.zeros_like(whole)
    put_following(loads, u, FACTOR, True, values)
    np.add.at(half, (row, column), values)
    np.testing.assert_allclose(half, 0.5 * (whole + whole.T), rtol=0, atol=1e-14)
    apart = np.linalg.norm(0.5 * (whole - whole.T)) / np.linalg.norm(whole)
    assert asymmetry(following_tangent(loads, u, FACTOR)) == pytest.approx(apart)
    assert apart > 0.01


def test_bars_have_the_potential_of_a_constant_tension(x, u) -> None:
    """N (|d|^2 - |D|^2) / 2 for each, N the second Piola-Kirchhoff force over the length."""
    loads, ends = joined([(bars(x), 1)]), np.array([[0, 5], [2, 6]])

    def potential(q) -> float:
        at = x + q[: 3 * NODES].reshape(-1, 3)
        now, rest = at[ends[:, 1]] - at[ends[:, 0]], x[ends[:, 1]] - x[ends[:, 0]]
        return 0.5 * 0.6 * float(np.array([1.5, -2.0]) @ ((now**2).sum(1) - (rest**2).sum(1)))

    assert gradient_error(potential, lambda q: -following_force(loads, q, FACTOR), at=u) < 1e-9
    force = following_force(joined([(bars(x), 1)]), np.zeros_like(u), FACTOR)[: 3 * NODES]
    # a tension pulls the ends together
    assert force.reshape(-1, 3)[0] @ (x[5] - x[0]) > 0.0


def test_hidden_dofs_are_pushed_whatever_the_displacement(x, u) -> None:
    loads = joined([(hidden(x), 0)])
    expected = np.zeros_like(u)
    expected[3 * NODES :: 2] = [0.4 * 1.3, -0.1 * 1.3]
    for state in (u, 2.0 * u):
        np.testing.assert_array_equal(following_force(loads, state, FACTOR), expected)
    assert not following_tangent(loads, u, FACTOR).nnz
    assert loads.acts


def test_a_free_body_feels_neither_force_nor_moment_of_hinges_and_bars(x, u) -> None:
    at = x + u[: 3 * NODES].reshape(-1, 3)
    for kind in (hinges, bars):
        force = following_force(joined([(kind(x), 0)]), u, FACTOR)[: 3 * NODES].reshape(-1, 3)
        np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-14)
        np.testing.assert_allclose(np.cross(at, force).sum(axis=0), 0.0, atol=1e-14)


def test_another_order_of_the_nodes(x, u) -> None:
    loads = joined([(triangles(x), 0), (hinges(x), 1), (bars(x), 0)])
    rank = np.random.default_rng(3).permutation(NODES)
    moved = u.copy()
    moved[: 3 * NODES].reshape(-1, 3)[rank] = u[: 3 * NODES].reshape(-1, 3)
    there = following_force(loads.placed(rank), moved, FACTOR)
    here = following_force(loads, u, FACTOR)
    np.testing.assert_array_equal(
        there[: 3 * NODES].reshape(-1, 3)[rank].ravel(), here[: 3 * NODES]
    )
    np.testing.assert_array_equal(there[3 * NODES :], here[3 * NODES :])
