"""Pencils of parts beside those of all unknowns."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from foldyn.algebra.solvers import factorizer
from foldyn.algebra.substructures import Substructures

OUTER, OWNER = 5, np.repeat([0, 1, 2], 30)


def matrices():
    """K0, positive definite, and K1 of a chain of masses; the outer unknowns join its parts."""
    rng = np.random.default_rng(3)
    size = OUTER + len(OWNER)
    joined = (rng.random((size, size)) < 0.1) | np.eye(size, dtype=bool)
    joined[OUTER:, OUTER:] &= OWNER[:, None] == OWNER
    first, second = (
        joined * joined.T * (one + one.T) for one in rng.standard_normal((2, size, size))
    )
    first += (1.0 + np.abs(first).sum(axis=0)) * np.eye(size)
    return sparse.csr_array(first), sparse.csr_array(second)


def test_factors_by_parts_solve_the_whole():
    first, _ = matrices()
    made = Substructures(first, OWNER, factorizer("auto", OUTER)[1])
    force = np.random.default_rng(0).standard_normal(first.shape[0])
    np.testing.assert_allclose(first @ made.solve(force), force, atol=1e-12)


def test_factors_nearest_to_zero_are_those_of_the_whole():
    first, second = matrices()
    made = Substructures(first, OWNER, factorizer("auto", OUTER)[1])
    pencil = made.pencil(second)
    assert pencil.stiffness.shape[0] < 0.7 * first.shape[0]
    expected = eigh(-second.toarray(), first.toarray(), eigvals_only=True)
    values, shapes = eigh(-pencil.change.toarray(), pencil.stiffness.toarray())
    np.testing.assert_allclose(values[[0, -1]], expected[[0, -1]], rtol=1e-3)
    assert values[-1] <= expected[-1] + 1e-12  # factors of fewer motions are not lower
    whole = made.whole(pencil, shapes[:, -1:])[:, 0]
    assert np.isclose(whole @ (first @ whole), 1.0)
    assert np.isclose(-whole @ (second @ whole), values[-1])
