"""Frequency responses and damping ratios with dashpots, creases and modal damping."""

from __future__ import annotations

import numpy as np
import pytest
from frf_structures import chain, chain_matrices, largest_error, miura_case
from scipy import sparse
from scipy.linalg import eigh

import foldyn as fd
from foldyn.algebra import complex_symmetric, superlu
from foldyn.algebra.complex_symmetric import Gram
from foldyn.linear.linearized import linearize

F = np.linspace(0.1, 4.0, 60)
K, M = chain_matrices()
VALUES, SHAPES = eigh(K, M)
MODAL = M @ SHAPES @ np.diag(2 * np.array([0.02, 0.05]) * np.sqrt(VALUES)) @ SHAPES.T @ M
C = 0.7
ALONG = C * np.array([[1.0, -1.0], [-1.0, 1.0]])
CASES = {
    "ground": (fd.Rayleigh(), [fd.Dashpot(C, nodes=[1], direction="x")], np.diag([C, 0.0])),
    "between": (fd.Rayleigh(), [fd.Dashpot(C, between=(1, 2))], ALONG),
    "fixed": (fd.Rayleigh(), [fd.Dashpot(C, between=(1, 2), direction="-x")], ALONG),
    "both": (fd.Rayleigh(0.1), [fd.Dashpot(C, nodes=[1, 2])], C * np.eye(2) + 0.1 * M),
    "modal": (fd.ModalDamping([0.02, 0.05]), [], MODAL),
    "added": ([fd.Rayleigh(0.1), fd.ModalDamping([0.02, 0.05])], [], 0.1 * M + MODAL),
}


def damped(name: str) -> tuple[fd.Case, np.ndarray]:
    damping, dashpots, matrix = CASES[name]
    plain = chain()
    return plain.altered(supports=[*plain.supports, *dashpots], damping=damping), matrix


@pytest.mark.parametrize("method", ["direct", "modal", "harmonic"])
@pytest.mark.parametrize("name", CASES)
def test_two_masses(name, method):
    """Receptance by dense inversion of K - w^2 M + i w C, C written down by hand.

    On a moving base absolute motion: the base pulls at the first spring, the ground at dashpots.
    """
    case, c = damped(name)
    w = 2 * np.pi * F[:, None]
    matrix = K - w[:, :, None] ** 2 * M + 1j * w[:, :, None] * c
    found = fd.frf(case, fd.Force([1], (1, 0, 0)), frequencies=F, method=method).receptance
    assert largest_error(found.values[:, 1:, 0], np.linalg.inv(matrix)[:, :, 0]) < 1e-12
    ground = {"ground": np.array([C, 0.0]), "both": np.array([C, C])}.get(name, np.zeros(2))
    load = (w**2 - 1j * w * case.rayleigh.alpha) * np.diag(M) - 1j * w * ground
    exact = 1.0 + np.linalg.solve(matrix, load[:, :, None])[:, :, 0]
    found = fd.frf(case, fd.BaseMotion("x"), frequencies=F, method=method).transmissibility
    assert largest_error(found.values[:, 1:, 0], exact) < 1e-12


@pytest.mark.parametrize("name", CASES)
def test_ratios_of_modes(name):
    case, c = damped(name)
    exact = np.einsum("ik,ij,jk->k", SHAPES, c, SHAPES) / (2 * np.sqrt(VALUES))
    assert fd.modes(case, 2).damping_ratio.values == pytest.approx(exact, rel=1e-9)


def test_at_a_resonance_that_only_modal_damping_limits():
    """The undamped matrix is singular there, and Woodbury's formula alone would fail."""
    case = chain().altered(damping=fd.ModalDamping(0.02))
    squares = VALUES[:, None]  # of w, at each resonance
    modal = VALUES - squares + 0.04j * np.sqrt(squares * VALUES)
    exact = (SHAPES[0] ** 2 / modal).sum(axis=1)
    for method in ("direct", "modal"):
        f = np.sqrt(VALUES) / (2 * np.pi)
        found = fd.frf(case, fd.Force([1], (1, 0, 0)), frequencies=f, method=method).receptance
        np.testing.assert_allclose(found.values[:, 1, 0], exact, rtol=1e-9)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("size", [1, 2, 30])
def test_a_matrix_that_only_modal_damping_makes_regular(size, full, monkeypatch):
    """A = sum of (k - 1) v_k v_k', singular along v_1, which alone is damped."""
    monkeypatch.setattr(Gram, "fills", lambda self, matrix: full)
    axes = np.linalg.qr(np.random.default_rng(1).standard_normal((size, size)))[0]
    axes = axes if size > 2 else np.eye(size)  # no rounding: a pivot is exactly zero
    values = np.arange(size, dtype=float)
    matrix = sparse.csc_array((axes * values) @ axes.T).astype(complex)
    load = axes @ np.ones(size)
    found = complex_symmetric.solve(matrix, load, Gram(axes[:, :1].T), 0.1j)
    exact = axes @ (1.0 / np.where(values > 0.0, values, 0.1j))
    assert largest_error(found, exact) < 1e-12
    assert np.isnan(complex_symmetric.solve(matrix, load)).all()
    if size > 1:  # what is damped is another direction
        other = complex_symmetric.solve(matrix, load, Gram(axes[:, 1:2].T), 0.1j)
        assert np.isnan(other).all()


@pytest.mark.parametrize("method", ["direct", "modal"])
@pytest.mark.parametrize("model", ["bars", "shell"])
def test_ratios_of_rayleigh_give_its_response(model, method):
    """Bars and hinges and the shell: Rayleigh's ratios of all modes are Rayleigh."""
    plain = miura_case(beta=1e-3)
    if model == "shell":
        pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=80)
        s = fd.shell(pattern, fd.Sheet(1e5, 0.25, 0.01, 1.0), divisions=2, fold_law="linear")
        plain = fd.Case(s, [fd.Fix([0, 1]), fd.Fix([4], "z")], damping=fd.Rayleigh(0.5, 1e-3))
    modes = fd.modes(plain, len(plain.free_dofs))
    case = plain.altered(damping=fd.ModalDamping(modes.damping_ratio.values.tolist()))
    f, drive = np.linspace(0.5, 1.5, 7) * float(modes.frequency[1]), fd.Force([3], (0, 0, 1.0))
    both = [
        fd.frf(one, drive, frequencies=f, method=method).receptance.values for one in (plain, case)
    ]
    assert largest_error(both[1], both[0]) < 1e-7


@pytest.mark.parametrize("method", ["direct", "modal"])
@pytest.mark.parametrize("model", ["bars", "shell"])
def test_creases_on_a_fold(model, method):
    """One flap on a crease of k and c per meter: the response of one degree of freedom."""
    k, c = 0.05, 2e-3
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
    sheet, laws = fd.Sheet(1e9, 0.25, 0.01, 1.0), {"fold_law": "linear", "crease_stiffness": k}
    if model == "bars":
        s = fd.discretize(pattern, sheet, bend_law="linear", preset="herkal", **laws)
    else:
        s = fd.shell(pattern, sheet, divisions=2, **laws)
    arm = (s.nodes - s.nodes[2]) * [1, 0, 1]
    turning = s.nodes[:, 0] > s.nodes[2, 0] + 1e-9
    case = fd.Case(s, [fd.Fix(np.flatnonzero(~turning))], damping=fd.CreaseDamping(c))
    inertia = (s.nodal_mass[turning] * (arm[turning] ** 2).sum(axis=1)).sum()
    reach = np.linalg.norm(arm[4])
    normal = np.array([-arm[4, 2], 0.0, arm[4, 0]]) / reach
    w = np.linspace(0.5, 1.5, 9) * np.sqrt(k / inertia)
    exact = reach**2 / (k - w**2 * inertia + 1j * w * c)
    found = fd.frf(case, fd.Force([4, 5], normal), frequencies=w / (2 * np.pi), method=method)
    assert largest_error(found.receptance.values[:, 4] @ normal, exact) < 3e-3


@pytest.mark.matrix
def test_in_time():
    """The burst of an impulse with all kinds of damping: the linear response."""
    dashpots = [fd.Dashpot(0.02, nodes=[7], direction="x"), fd.Dashpot(0.01, between=(1, 7))]
    damping = [fd.Rayleigh(0.8), fd.CreaseDamping(1e-3), fd.ModalDamping(0.02, 3)]
    plain = miura_case()
    case = plain.altered(supports=[*plain.supports, *dashpots], damping=damping)
    drive, f = fd.Force([7], (1e-5, 0, 0)), np.arange(0.2, 2.0, 0.2)
    exact = fd.frf(case, drive, frequencies=f).receptance.values
    found = fd.frf(case, drive, frequencies=f, method="impulse", integrator="newmark", dt=0.01)
    assert largest_error(found.receptance.values, exact) < 5e-3


@pytest.mark.parametrize("method", ["direct", "harmonic"])
@pytest.mark.parametrize("count", [3, None])
def test_modal_damping_fills_the_matrix_where_that_is_cheaper(count, method, monkeypatch):
    """Few damped modes leave the factorized matrix sparse, all of them are a full one."""
    pattern = fd.patterns.miura(cells=(3, 3))
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.3, 0.05, 100.0), preset="plate")
    case = fd.Case(s, [fd.Fix([0, 1, 2])], damping=fd.ModalDamping(0.02, count))
    system = linearize(case)
    there = abs(system.stiffness) + abs(system.mass)
    sizes = []

    def factorize(matrix, **options):
        sizes.append((matrix.shape, matrix.nnz))
        return superlu.factorize(matrix, **options)

    monkeypatch.setattr(complex_symmetric, "factorize", factorize)
    f = fd.modes(case, 3).frequency.values
    drive = fd.Force([case.free_dofs[-1] // 3], (0, 0, 1))
    found = fd.frf(case, drive, frequencies=f, method=method)
    assert set(sizes) == ({(there.shape, there.nnz)} if count else set())
    load = system.projected(np.eye(case.structure.nodes.size)[case.free_dofs[-1]])
    for k, omega in enumerate(2 * np.pi * f):
        matrix = system.stiffness - omega**2 * system.mass
        matrix = matrix.toarray() + 1j * omega * (system.modal.T @ system.modal)
        exact = system.expanded(np.linalg.solve(matrix, load)[:, None])[:, 0]
        assert largest_error(found.receptance.values[k].ravel(), exact) < 1e-8
