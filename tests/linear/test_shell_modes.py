"""Modes of shells, whose edge rotations have no mass."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import SHEET, flat, miura
from scipy.linalg import eigh

import foldyn as fd
from foldyn.algebra import eigen
from foldyn.errors import InputError
from foldyn.linear import linearize, mac, modes
from foldyn.shells import shell

CASE2 = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]


def unit_cell(divisions=4, supports=(), **options):
    pattern = fd.patterns.miura(cells=(1, 1), a=1, b=1, panel_angle=60, dihedral=60)
    return fd.Case(shell(pattern, SHEET, divisions=divisions, **options), supports)


def condensed(case):
    """Eigenvalues with the rotations condensed, by a dense solver."""
    linear = linearize(case)
    nodal = linear.free < linear.displacement.size
    stiffness, mass = flat(linear.stiffness), flat(linear.mass)[np.ix_(nodal, nodal)]
    assert not flat(linear.mass)[~nodal].any()
    across = stiffness[np.ix_(nodal, ~nodal)]
    follow = np.linalg.solve(stiffness[np.ix_(~nodal, ~nodal)], across.T)
    return eigh(stiffness[np.ix_(nodal, nodal)] - across @ follow, mass, eigvals_only=True)


@pytest.mark.parametrize("supports", [CASE2, []])
def test_rotations_follow_without_inertia(supports):
    case = unit_cell(supports=supports)
    found = modes(case, 10)
    rigid = 0 if supports else 6
    np.testing.assert_array_equal(found.rigid, np.arange(10) < rigid)
    exact = np.sqrt(condensed(case)[rigid:10]) / (2 * np.pi)
    np.testing.assert_allclose(found.frequency[rigid:], exact, rtol=1e-9)
    assert found.attrs["complete"] == 10 and found.attrs["solver"] == "superlu"
    assert found["shape"].shape == (10, len(case.structure.nodes), 3)


def test_all_at_once(monkeypatch):
    case = unit_cell(divisions=2, supports=CASE2)
    few = modes(case, 6)
    monkeypatch.setattr(eigen, "DENSE", 10_000)
    every = modes(case, few.attrs["free_dofs"])
    np.testing.assert_allclose(every.frequency[:6], few.frequency, rtol=1e-9)
    assert float(every.attrs["largest_residual"]) < 1e-10
    with pytest.raises(InputError, match="free dofs"):
        modes(case, few.attrs["free_dofs"] + 1)


def test_a_miura_cell_against_established_shells():
    """0.624, 1.051, 1.903 and 0.623, 1.049, 1.899 Hz by two other shells (design, section 5).

    Bars and hinges have the same modes on the vertices, which come first in both.
    """
    found = modes(unit_cell(divisions=8, supports=CASE2), 3)
    np.testing.assert_allclose(found.frequency, [0.6235, 1.05, 1.901], rtol=0.035)  # mesh 1/8
    reduced = modes(fd.Case(miura(cells=(1, 1)), CASE2), 3, secant=1.0)
    assert (mac(found, reduced, nodes=range(9)).diagonal() > 0.95).all()


def test_superlinear_folds_are_refused():
    with pytest.raises(InputError, match='"linear" or "enhanced"'):
        modes(unit_cell(fold_law="superlinear"), 3)
