"""Large sheets under their own weight: few iterations, and all of it in the reactions."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.statics import trace
from foldyn.structures.bars_hinges import BarsHingesTerm


def sheet(cells, thickness=1e-3):
    """Miura cells with edges of 25 mm between two held rims."""
    pattern = fd.patterns.miura(cells=(cells, cells), a=0.025, b=0.025, panel_angle=60, dihedral=90)
    s = fd.discretize(pattern, fd.Sheet(1219e6, 0.2, thickness, 667.0, 2.7), preset="herkal")
    held = [fd.Fix("xmin", "xyz"), fd.Fix("xmax", "xyz")]
    return fd.Case(s, held, [fd.Gravity((0, 0, -9.81))])


@pytest.mark.parametrize(
    ("cells", "most"),
    [
        (5, 9),
        (15, 9),
        pytest.param(30, 20, marks=pytest.mark.matrix),  # 21,963 dofs
    ],
)
def test_one_load_step(cells, most):
    case = sheet(cells)
    path = trace(case, load_factors=[1.0])
    assert path.attrs["newton_iterations"] <= most
    assert path.attrs["step_cuts"] == 0
    upwards = path.reaction.values[0, path.support_axis.values == "z"].sum()
    assert upwards == pytest.approx(9.81 * case.structure.mass.sum(), rel=1e-9)
    assert path.negative_eigenvalues.values.tolist() == [0]


@pytest.mark.matrix
def test_extrapolated_stress_saves_iterations(monkeypatch):
    """Without it the same step takes half as many again: 11 and 7 iterations."""
    case = sheet(10, thickness=0.24e-3)
    quick = trace(case, load_factors=[1.0])
    exact = BarsHingesTerm.step_tangent
    monkeypatch.setattr(BarsHingesTerm, "step_tangent", lambda sheet, q, before: exact(sheet, q))
    plain = trace(case, load_factors=[1.0])
    np.testing.assert_allclose(plain.displacement, quick.displacement, atol=1e-9)
    assert plain.attrs["newton_iterations"] > 1.3 * quick.attrs["newton_iterations"]
