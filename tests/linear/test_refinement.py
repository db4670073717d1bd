"""What a coarse mesh tells of its own error."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.linear import refinement

SHEET = fd.Sheet(1e6, 0.25, 0.01)  # without density: the ratios do not need it
LIMIT = [0.625, 1.0445, 1.903]
"""Hz, at 1 kg/m3: docs/shells.md, whose meshes of 32 pieces are within 0.1 % of it."""


def miura(divisions, supports=None):
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    shell = fd.shell(fd.patterns.miura(), SHEET, divisions, fold_law="linear")
    return fd.Case(shell, supports or held, [fd.Force([7], (1.0, 0.0, 0.0))])


@pytest.mark.parametrize(("divisions", "most"), [(4, 0.025), (8, 0.006)])
def test_the_error_is_told_by_one_refinement(divisions, most):
    found = refinement(miura(divisions))
    assert found is not None and found.divisions == divisions
    true = found.frequency / LIMIT - 1.0
    assert true.max() < 0.0 and abs(true).max() > 1.5 * most  # too soft
    assert np.abs(found.extrapolated / LIMIT - 1.0).max() < most
    assert 0.5 < found.error / true.min() < 1.1


def test_meshes_of_an_odd_number_of_pieces():
    found = refinement(miura(7))
    coarse = refinement(miura(3))
    assert found is not None and coarse is not None  # 3 pieces are what 7 are compared with
    gain = (found.frequency - coarse.frequency) / ((7 / 3) ** 2 - 1)
    np.testing.assert_allclose(found.extrapolated, found.frequency + gain, rtol=1e-12)


def test_where_there_is_nothing_to_compare_with():
    assert refinement(miura(1)) is None
    assert refinement(fd.Case(fd.discretize(fd.patterns.miura(), SHEET))) is None
    only_there = [fd.Fix([0, 1, 2, 20], "xyz")]  # no vertex
    assert refinement(miura(3, only_there)) is None
