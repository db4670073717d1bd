"""Factorizations: solutions, counts of negative eigenvalues, and the choice of the backend."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import sparse
from sheets import compression

from foldyn.algebra import pardiso, solvers
from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import SingularTangentError, SuperLU
from foldyn.errors import InputError
from foldyn.notice import NOTICE
from foldyn.statics import SOLVERS, OrigamiProblem, Settings, Solver, trace

PRESENT = [name for name, backend in SOLVERS.items() if backend.found()]


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
    matrix, random = symmetric(200, negative), np.random.default_rng(1)
    factors = SOLVERS[name].make()(matrix)
    for b in (random.standard_normal(200), random.standard_normal((200, 5))):
        found = factors.solve(b)
        assert found.shape == b.shape
        np.testing.assert_allclose(matrix @ found, b, atol=1e-8)
    assert factors.negative() == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum() == negative


@pytest.mark.parametrize("name", PRESENT)
def test_a_zero_on_the_diagonal(name):
    """Its pivot has to leave the diagonal; the count still holds."""
    matrix = sparse.csc_array(np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 1.0], [0.0, 1.0, 3.0]]))
    factors = SOLVERS[name].make()(matrix)
    assert factors.negative() == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum() == 1
    np.testing.assert_allclose(matrix @ factors.solve(np.ones(3)), np.ones(3), atol=1e-12)


@pytest.mark.parametrize("name", PRESENT)
def test_singular_and_not_finite(name):
    factorize = SOLVERS[name].make()
    for singular in (np.diag([1.0, 0.0, 2.0]), np.ones((2, 2))):
        with pytest.raises(SingularTangentError, match="singular"):
            factorize(sparse.csc_array(singular))
    with pytest.raises(SingularTangentError, match="not finite"):
        factorize(sparse.csc_array(np.diag([1.0, np.nan])))


@pytest.mark.parametrize("name", PRESENT)
def test_factors_keep_their_matrix(name):
    """One factorizer, matrices of one pattern and of another: each of the factors is its own's."""
    factorize, b = SOLVERS[name].make(), np.ones(200)
    one, other = symmetric(200, 3), symmetric(200, 8, seed=1)
    matrices = [one, 2.0 * one, one - 0.1 * sparse.eye_array(200, format="csc"), other, one]
    living = [factorize(sparse.csc_array(matrix)) for matrix in matrices]
    del living[1], matrices[1]  # its memory serves the next
    matrices.append(3.0 * one)
    living.append(factorize(matrices[-1]))
    for matrix, factors in zip(matrices, living, strict=True):
        np.testing.assert_allclose(matrix @ factors.solve(b), b, atol=1e-8)
        assert factors.negative() == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum()


@pytest.mark.skipif("pardiso" not in PRESENT, reason="needs mkl")
def test_a_pattern_is_ordered_once(monkeypatch):
    """Factors that follow each other take the order of the first; two at a time need two."""
    phases, real = [], pardiso._call

    def call(phase, *arguments):
        phases.append(phase)
        return real(phase, *arguments)

    monkeypatch.setattr(pardiso, "_call", call)
    factorize, matrix = pardiso.Pardiso(), symmetric(200, 0)
    first = factorize(matrix)
    for factor in (2.0, 3.0):
        del first
        first = factorize(factor * matrix)
    assert (phases.count(pardiso.ANALYSIS), phases.count(pardiso.NUMERIC)) == (1, 3)
    second = factorize(4.0 * matrix)
    assert phases.count(pardiso.ANALYSIS) == 2
    np.testing.assert_allclose(first.solve(np.ones(200)), 4.0 / 3.0 * second.solve(np.ones(200)))
    factorize(symmetric(200, 0, seed=1))
    assert phases.count(pardiso.ANALYSIS) == 3


@pytest.mark.matrix
@pytest.mark.skipif("pardiso" not in PRESENT, reason="needs mkl")
def test_the_same_bits_again():
    matrix, b = symmetric(3000, 0), np.ones(3000)
    found = [pardiso.Pardiso()(matrix).solve(b) for _ in range(3)]
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def without(monkeypatch, *names):
    """Let packages of solvers be missing."""
    for name in names:
        monkeypatch.setitem(SOLVERS, name, SOLVERS[name]._replace(found=lambda: False))


def test_choice_of_the_backend(monkeypatch):
    """The last that is installed is taken, and the message says what to install."""
    assert factorizer("auto", 300)[0] == factorizer("superlu", 10**6)[0] == "superlu"
    assert factorizer("auto", 10**6)[0] == PRESENT[-1]
    without(monkeypatch, "pardiso")
    assert factorizer("auto", 10**6)[0] == "rslab"
    with pytest.raises(InputError, match=r'"pardiso": needs pip install "foldyn\[mkl\]"'):
        factorizer("pardiso", 10)
    without(monkeypatch, "rslab")
    assert factorizer("auto", 10**6)[0] == "superlu"


@pytest.mark.parametrize(("used", "mkl", "best"), [
    ("superlu", True, "pardiso"), ("rslab", True, "pardiso"), ("superlu", False, "rslab"),
])  # fmt: skip
def test_a_package_that_would_save_time_is_named_once(monkeypatch, used, mkl, best):
    """After ten seconds that it would have saved, where there are wheels of it."""
    told, names = [], list(SOLVERS)
    monkeypatch.setattr(solvers, "perf_counter", itertools.count(0.0, 4.0).__next__)
    monkeypatch.setattr(solvers, "_lost", [0.0])
    monkeypatch.setattr(NOTICE, "tell", told.append)
    without(monkeypatch, *names[names.index(used) + 1 :])
    monkeypatch.setitem(SOLVERS, "pardiso", SOLVERS["pardiso"]._replace(wheels=mkl))
    name, factorize = factorizer("auto", 10**6)
    assert name == used
    share = 1.0 - SOLVERS[best].time / SOLVERS[used].time
    for _ in range(int(10.0 / (4.0 * share))):  # each takes 4 s
        factorize(symmetric(20, 0))
    assert not told
    for _ in range(5):
        factorizer("auto", 10**6)[1](symmetric(20, 0))
    assert len(told) == 1
    assert told[0].startswith(f'pip install "{SOLVERS[best].package}" would have saved 1')


def test_nothing_is_named_where_the_best_solver_is_taken(monkeypatch):
    without(monkeypatch, "pardiso")
    monkeypatch.setitem(SOLVERS, "pardiso", SOLVERS["pardiso"]._replace(wheels=False))
    assert isinstance(factorizer("auto", 10**6)[1], pardiso.Rslab)
    assert factorizer("superlu", 10**6)[1] is SuperLU


def test_reduction_follows_the_pattern():
    reduce = Reduction(np.array([0, 2, 3]))
    for seed in (1, 2):
        full = sparse.csr_array(symmetric(5, 2, seed))
        expected = full.toarray()[np.ix_([0, 2, 3], [0, 2, 3])]
        np.testing.assert_array_equal(reduce(full).exact.toarray(), expected)
        np.testing.assert_array_equal(reduce(2.0 * full).exact.toarray(), 2.0 * expected)


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
