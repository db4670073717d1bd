"""Factorizations: solutions, counts of negative eigenvalues, and the choice of the backend."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from sheets import compression

from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import SingularTangentError, SuperLU
from foldyn.errors import InputError
from foldyn.statics import SOLVERS, OrigamiProblem, Settings, Solver, trace

PRESENT = [name for name, backend in SOLVERS.items() if backend.present]


def symmetric(size, negative, seed=0):
    """A sparse symmetric matrix with so many negative eigenvalues: congruent to a diagonal."""
    rng = np.random.default_rng(seed)
    lower = sparse.random_array((size, size), density=0.02, rng=rng).tolil()
    lower = sparse.tril(lower.tocsr(), k=-1) + sparse.eye_array(size)
    signs = np.ones(size)
    signs[rng.permutation(size)[:negative]] = -1.0
    diagonal = sparse.diags_array(signs * rng.uniform(0.5, 2.0, size))
    return sparse.csc_array(lower @ diagonal @ lower.T)


@pytest.mark.parametrize("name", PRESENT)
@pytest.mark.parametrize("negative", [0, 1, 7, 100])
def test_solution_and_count(name, negative):
    matrix = symmetric(200, negative)
    factors = SOLVERS[name].factorize(matrix)
    b = np.random.default_rng(1).standard_normal(200)
    np.testing.assert_allclose(matrix @ factors.solve(b), b, atol=1e-8)
    assert factors.negative() == negative
    assert (np.linalg.eigvalsh(matrix.toarray()) < 0).sum() == negative


@pytest.mark.parametrize("name", PRESENT)
def test_a_zero_on_the_diagonal(name):
    """Its pivot has to leave the diagonal; the count still holds."""
    matrix = sparse.csc_array(np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 1.0], [0.0, 1.0, 3.0]]))
    factors = SOLVERS[name].factorize(matrix)
    assert factors.negative() == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum() == 1
    np.testing.assert_allclose(matrix @ factors.solve(np.ones(3)), np.ones(3), atol=1e-12)


def test_singular_and_not_finite():
    with pytest.raises(SingularTangentError, match="singular"):
        SuperLU(sparse.csc_array(np.diag([1.0, 0.0, 2.0])))
    with pytest.raises(SingularTangentError, match="not finite"):
        SuperLU(sparse.csc_array(np.diag([1.0, np.nan])))


def test_reduction_follows_the_pattern():
    reduce = Reduction(np.array([0, 2, 3]))
    for seed in (1, 2):
        full = sparse.csr_array(symmetric(5, 2, seed))
        expected = full.toarray()[np.ix_([0, 2, 3], [0, 2, 3])]
        np.testing.assert_array_equal(reduce(full).exact.toarray(), expected)
        np.testing.assert_array_equal(reduce(2.0 * full).exact.toarray(), 2.0 * expected)


def test_choice_of_the_backend():
    assert factorizer("auto", 300)[0] == "superlu"
    assert factorizer("superlu", 10**6)[0] == "superlu"
    best = [name for name in PRESENT if SOLVERS[name].worthwhile <= 10**6][-1]
    assert factorizer("auto", 10**6)[0] == best


@pytest.mark.parametrize("name", [name for name in SOLVERS if name not in PRESENT])
def test_backend_that_is_not_installed(name):
    with pytest.raises(InputError, match="is not installed"):
        factorizer(name, 10)


@pytest.mark.parametrize("name", PRESENT)
def test_path_with_each_backend(name):
    path = trace(compression(), "displacement", steps=4, settings=Settings(solver=name))
    assert path.attrs["solver"] == name
    plain = trace(compression(), "displacement", steps=4)
    np.testing.assert_allclose(path.displacement, plain.displacement, atol=1e-10)


def test_tangent_of_the_problem_is_symmetric_and_exact():
    """At a bent state no slope is below the floor, and the tangent is the structure's own."""
    case = compression()
    u = trace(case, load_factors=[0.5]).displacement.values[0]
    problem = OrigamiProblem(case)
    tangent = problem.tangent(u.ravel(), 0.5)
    exact = case.structure.tangent(u)
    assert abs(tangent - tangent.T).max() < 1e-9 * abs(tangent).max()
    assert abs(tangent - exact).max() < 1e-12 * abs(exact).max()
    assert Solver(problem).backend == "superlu"


def test_extrapolated_stress_changes_steps_only():
    """The tangent for the step after one differs by the bars' geometric stiffness alone."""
    case = compression()
    u = trace(case, load_factors=[0.5]).displacement.values[0].ravel()
    problem = OrigamiProblem(case)
    plain, same = problem.tangent(u, 0.5), problem.tangent(u, 0.5, before=u)
    assert abs(plain - same).max() < 1e-9 * abs(plain).max()
    after = problem.tangent(u, 0.5, before=u * 1.01)
    difference = (after - plain).toarray().reshape(111, 3, 111, 3)
    off = difference - np.einsum("ab,ij->iajb", np.eye(3), difference[:, 0, :, 0])
    assert np.abs(difference).max() > 1e-3
    assert np.abs(off).max() < 1e-9 * np.abs(difference).max()
