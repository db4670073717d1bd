"""Matrices condensed to their last unknowns by eights."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.algebra.condensing import Condensing
from foldyn.algebra.superlu import SingularTangentError

SIZE, KEPT = 40, 5


def matrices(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Definite ones (count, SIZE, SIZE), and pairs of unknowns with an entry."""
    rng = np.random.default_rng(1)
    there = np.triu(rng.random((SIZE, SIZE)) < 0.08) | np.eye(SIZE, dtype=bool)
    upper = np.where(there, rng.standard_normal((count, SIZE, SIZE)), 0.0)
    return upper + np.swapaxes(upper, 1, 2) + 12.0 * np.eye(SIZE), np.argwhere(there)


def condensed(whole: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    return Condensing(pairs, SIZE, KEPT)(whole[:, pairs[:, 0], pairs[:, 1]].T)


@pytest.mark.parametrize("count", [1, 3, 8])
def test_what_is_left_is_the_schur_complement(count):
    whole, pairs = matrices(count)
    half = np.random.default_rng(2).random((len(pairs), 1)) < 0.5  # either will do
    found = condensed(whole, np.where(half, pairs, pairs[:, ::-1]))
    free = SIZE - KEPT
    inner, across = whole[:, :free, :free], whole[:, :free, free:]
    balanced = np.swapaxes(across, 1, 2) @ np.linalg.solve(inner, across)
    wanted = whole[:, free:, free:] - balanced
    np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-10)


def test_a_matrix_that_is_not_definite_is_refused():
    whole, pairs = matrices(2)
    whole[1, 3, 3] = -1.0
    with pytest.raises(SingularTangentError, match="not positive definite"):
        condensed(whole, pairs)
