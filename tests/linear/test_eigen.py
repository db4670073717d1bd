"""The eigensolver: chains of springs with known frequencies, none missed, any shift."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

import foldyn as fd
from foldyn.algebra import eigen
from foldyn.algebra.eigen import Pencil
from foldyn.algebra.solvers import SOLVERS
from foldyn.errors import ComputationError, InputError

N = 150
PRESENT = [name for name, backend in SOLVERS.items() if backend.found()]
NOTHING = np.zeros((N, 0))


def chain(n=N, free=False, mass=2.0, spring=3.0):
    """Masses on springs between two walls, or free; eigenvalues 4 k/m sin^2(...), ascending."""
    main = np.full(n, 2.0)
    if free:
        main[[0, -1]] = 1.0
        angles = np.pi * np.arange(n) / (2 * n)
    else:
        angles = np.pi * np.arange(1, n + 1) / (2 * (n + 1))
    off = np.full(n - 1, -1.0)
    stiffness = spring * sparse.diags_array([off, main, off], offsets=[-1, 0, 1])
    weights = mass * sparse.eye_array(n)
    values = 4 * spring / mass * np.sin(angles) ** 2
    return sparse.csc_array(stiffness), sparse.csc_array(weights), values


def twice(matrix):
    return sparse.csc_array(sparse.block_diag([matrix] * 2))


@pytest.fixture(autouse=True)
def always_sparse(monkeypatch):
    monkeypatch.setattr(eigen, "DENSE", 10)


@pytest.mark.parametrize("solver", PRESENT)
def test_a_chain(solver):
    stiffness, mass, values = chain()
    found = eigen.lowest(Pencil(stiffness, mass, solver), 12, NOTHING)
    np.testing.assert_allclose(found.values, values[:12], rtol=1e-11)
    gram = found.shapes.T @ (mass @ found.shapes)
    np.testing.assert_allclose(gram, np.eye(12), atol=1e-12)
    assert (found.checked, found.missed) == (12, 0)
    assert found.shift < 0.0


def test_few_dofs_are_solved_in_full(monkeypatch):
    stiffness, mass, values = chain()
    found = eigen.lowest(Pencil(stiffness, mass), N - 1, NOTHING)  # nearly all modes
    np.testing.assert_allclose(found.values, values[: N - 1], rtol=1e-10)
    monkeypatch.setattr(eigen, "DENSE", 10 * N)
    pencil = Pencil(stiffness, mass)
    found = eigen.lowest(pencil, N, NOTHING)
    np.testing.assert_allclose(found.values, values, rtol=1e-10)
    assert pencil.factorizations == 0 and np.isnan(found.shift)


def test_what_nothing_resists_has_the_eigenvalue_zero():
    stiffness, mass, _ = chain()
    found = eigen.lowest(Pencil(0.0 * stiffness, mass), N, NOTHING)
    np.testing.assert_array_equal(found.values, np.zeros(N))


def test_a_known_mode_is_taken_out_and_put_back():
    stiffness, mass, values = chain(free=True)
    uniform = np.full((N, 1), 1 / np.sqrt(2.0 * N))
    for known in (uniform, NOTHING):
        found = eigen.lowest(Pencil(stiffness, mass), 8, known)
        assert found.values[0] == 0.0  # zero to rounding is zero
        np.testing.assert_allclose(found.values[1:], values[1:8], rtol=1e-9)
        if len(known[0]):
            np.testing.assert_array_equal(found.shapes[:, :1], uniform)
            assert np.abs(found.shapes[:, 1:].T @ (mass @ uniform)).max() < 1e-12


@pytest.mark.parametrize("solver", PRESENT)
@pytest.mark.parametrize("below", [0.5, 1.5, 30.5])
def test_unstable_modes_are_found_whatever_their_number(below, solver):
    stiffness, mass, values = chain()
    k = int(below)
    moved = 0.5 * (values[k] + values[k - 1]) if k else 0.5 * values[0]
    pencil = Pencil(sparse.csc_array(stiffness - moved * mass), mass, solver)
    found = eigen.lowest(pencil, 6, NOTHING)
    np.testing.assert_allclose(found.values, values[:6] - moved, rtol=1e-9, atol=1e-12)
    assert pencil.below(0.0) == k
    assert found.shift < found.values[0]
    assert (found.checked, found.missed) == (6, 0)


def test_double_eigenvalues_come_twice():
    stiffness, mass, values = chain(n=90)
    pencil = Pencil(twice(stiffness), twice(mass))
    found = eigen.lowest(pencil, 10, np.zeros((180, 0)))
    np.testing.assert_allclose(found.values, np.repeat(values, 2)[:10], rtol=1e-10)
    gram = found.shapes.T @ (pencil.mass @ found.shapes)
    np.testing.assert_allclose(gram, np.eye(10), atol=1e-10)


def test_a_multiple_eigenvalue_that_goes_on_beyond_the_count():
    """Forty free masses: any five of them are modes of frequency zero; nothing lies below."""
    bound, *_ = chain(n=60)
    stiffness = sparse.csc_array(sparse.block_diag([bound, sparse.csc_array((40, 40))]))
    weights = sparse.csc_array(2.0 * sparse.eye_array(100))
    found = eigen.lowest(Pencil(stiffness, weights), 5, np.zeros((100, 0)))
    np.testing.assert_array_equal(found.values, np.zeros(5))
    assert found.missed == 0
    beyond = eigen.lowest(Pencil(stiffness, weights), 42, np.zeros((100, 0)))
    assert (beyond.values == 0.0).sum() == 40
    assert (beyond.checked, beyond.missed) == (42, 0)


def losing(times):
    """Lanczos that loses its second mode the first so many times."""
    plain, calls = eigen._lanczos, []

    def lanczos(*given):
        values, shapes = plain(*given)
        calls.append(1)
        keep = np.abs(values - chain()[2][1]) > (1e-9 if len(calls) <= times else -1.0)
        return values[keep], shapes[:, keep]

    return lanczos


@pytest.mark.parametrize("verify", [True, False])
def test_a_missed_mode_is_noticed_and_found(verify, monkeypatch):
    """Without the check it goes unnoticed."""
    stiffness, mass, values = chain()
    monkeypatch.setattr(eigen, "_lanczos", losing(1))
    found = eigen.lowest(Pencil(stiffness, mass), 6, NOTHING, verify=verify)
    wanted = values if verify else np.delete(values, 1)
    np.testing.assert_allclose(found.values, wanted[:6], rtol=1e-10)
    assert (found.checked, found.missed) == (6 if verify else 0, 0)


def test_a_mode_that_is_not_found_again_is_reported(monkeypatch):
    stiffness, mass, _ = chain()
    monkeypatch.setattr(eigen, "_lanczos", losing(100))
    monkeypatch.setattr(eigen, "ROUNDS", 2)
    assert eigen.lowest(Pencil(stiffness, mass), 6, NOTHING).missed == 1


def test_what_is_refused(monkeypatch):
    monkeypatch.setattr(eigen, "MOST_DENSE", 100)
    stiffness, mass, _ = chain()
    with pytest.raises(InputError, match="fewer than half of the modes of 150"):
        eigen.lowest(Pencil(stiffness, mass), 80, NOTHING)
    stiffness.data[3] = np.nan
    with pytest.raises(ComputationError, match="not finite"):
        eigen.lowest(Pencil(stiffness, mass), 6, NOTHING)


def test_a_shift_on_an_eigenvalue_is_moved():
    stiffness = sparse.diags_array(np.arange(1.0, N + 1)).tocsc()
    pencil = Pencil(sparse.csc_array(stiffness), sparse.csc_array(sparse.eye_array(N)), "superlu")
    assert pencil.below(5.0) in (4, 5)
    assert pencil.factorizations == 2


def test_rounding_of_an_eigenvalue_is_estimated_from_above():
    """Scatter of the quotient as the matrix is rounded to single precision, scaled to double."""
    stiffness, mass, _ = chain(spring=1e9 / 7)
    found = eigen.lowest(Pencil(stiffness, mass), 6, NOTHING)
    rounded = stiffness.astype(np.float32).astype(float)
    moved = np.abs(Pencil(sparse.csc_array(rounded), mass).quotients(found.shapes) - found.values)
    scale = np.finfo(float).eps / np.finfo(np.float32).eps
    assert (moved * scale < Pencil(stiffness, mass).noise(found.shapes)).all()


@pytest.mark.parametrize("count", [1, 4])
def test_few_modes_of_many_massless_dofs(count):
    """18 modes beside edges without mass: fewer than the basis of iterations has vectors."""
    pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30)
    sheet = fd.Sheet(1.2e9, 0.2, 0.24e-3, 667.0)
    tower = fd.Case(
        fd.discretize(pattern, sheet, preset="n5b8e"),
        [fd.Fix(range(6))],
        masses=[fd.PointMass(range(6, 12), 0.05)],
    )
    found, more = fd.modes(tower, count).frequency, fd.modes(tower, 12).frequency
    np.testing.assert_allclose(found, more[:count], rtol=1e-9)
