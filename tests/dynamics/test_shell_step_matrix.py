"""The matrix of an implicit step of a shell: what is in it, and how narrow it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

import foldyn as fd
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.system import pack

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
PATTERNS = {
    "fold": fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60),
    "miura": fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60),
}


def matrix_of(name, divisions, mass="lumped", beta=0.0):
    shell = fd.shell(PATTERNS[name], SHEET, divisions, mass=mass)
    case = fd.Case(shell, [fd.Fix([0, 1], "xyz")], damping=fd.Rayleigh(0.0, beta))
    packed = pack(case, 1.0)
    return shell, packed, StepMatrix(packed, symmetric=True)


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("name", PATTERNS)
def test_it_solves_with_stiffness_mass_and_damping(name, mass):
    beta, weights = 0.01, Weights(0.7, 3e4, 50.0)
    shell, packed, matrix = matrix_of(name, 3, mass, beta)
    n, size = len(shell.nodes), 3 * len(shell.nodes) + shell.rotations
    rows = packed.system.rows
    rng = np.random.default_rng(1)
    u = np.zeros((rows, 3))
    u[:n] = 1e-3 * rng.standard_normal((n, 3))
    rotation = np.zeros(shell.rotations)
    matrix.blocks.put(packed.body, matrix.pattern, u, u, False, matrix.stiffness)
    matrix.follow(u, 1.0)
    matrix.factorize(weights)
    force = rng.standard_normal((rows, 3))
    found = matrix.solve(force, np.zeros((rows, 3))).ravel()

    none = sparse.csr_array((shell.rotations, shell.rotations))
    inertia = sparse.block_diag([sparse.kron(shell.mass, np.eye(3)), none])
    body, rest = shell.body, np.concatenate([np.zeros(3 * n), rotation])
    whole = weights.stiffness * body.tangent(np.concatenate([u[:n].ravel(), rotation]))
    whole = whole + weights.mass * inertia + weights.damping * beta * body.tangent(rest)
    free = np.setdiff1d(np.arange(size), range(6))
    expected = np.linalg.solve(whole.toarray()[np.ix_(free, free)], force.ravel()[free])
    np.testing.assert_allclose(found[free], expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    assert set(matrix.free.tolist()) == set(free.tolist())


@pytest.mark.parametrize(("name", "across"), [("fold", 17), ("miura", 33)])
def test_its_band_is_two_lines_of_nodes_wide(name, across):
    """A line across the sheet has `across` nodes, with three dofs and up to three sides each."""
    shell, _, matrix = matrix_of(name, 16)
    number = np.empty(3 * len(shell.nodes) + shell.rotations, int)
    number[:] = -1
    number[matrix.free] = np.arange(len(matrix.free))
    entries = sparse.coo_array(shell.tangent(np.zeros_like(shell.nodes)))
    row, column = number[entries.coords[0]], number[entries.coords[1]]
    known = (row >= 0) & (column >= 0)
    width = np.abs(row - column)[known].max()
    assert width < 2.2 * 6 * across
    assert matrix.solver == "banded"  # no wider than that: nothing else is counted as an entry
