"""Creases driven to known angles bring the sheet to the shape that has them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist

import foldyn as fd

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)


def make(model, pattern, sheet=SHEET, **options):
    if model == "shell":
        return fd.shell(pattern, sheet, divisions=2, **options)
    return fd.discretize(pattern, sheet, bend_law="linear", **options)


@pytest.mark.parametrize("model", ["n5b8", "shell"])
@pytest.mark.parametrize("to", [70.0, 130.0])
def test_a_miura_driven_to_compatible_angles(model, to):
    """All its creases go to those of `miura(dihedral=to)`: so do all distances, without stress."""
    start, end = fd.patterns.miura((1, 1), dihedral=100), fd.patterns.miura((1, 1), dihedral=to)
    structure = make(model, start)
    fold = fd.Actuate("all", fold_angle=180.0 - np.degrees(end.dihedrals))
    path = fd.trace(
        fd.Case(structure, [fd.Fix([0, 1, 3])], [fold]),
        method="displacement",
        load_factors=np.linspace(0.1, 1, 10),
    )
    moved = structure.nodes + path.displacement.to_numpy()[-1]
    np.testing.assert_allclose(pdist(moved[:9]), pdist(end.vertices), rtol=1e-9)
    names = [name for name in path.data_vars if name.startswith("strain_")]
    halfway = sum(float(path[name][4]) for name in names)
    assert halfway > 0.0  # between, the angles are not compatible
    assert sum(float(path[name][-1]) for name in names) < 1e-6 * halfway


def test_what_a_rigid_miura_cannot_follow_strains_it():
    """Every crease folded by the same fraction, which no rigid Miura can: energy stays."""
    structure = make("n5b8", fd.patterns.miura((1, 1), dihedral=100))
    fold = fd.Actuate("all", fraction=0.7)
    path = fd.trace(
        fd.Case(structure, [fd.Fix([0, 1, 3])], [fold]),
        method="displacement",
        load_factors=[0.25, 0.5, 0.75, 1.0],
    )
    assert float(path.strain_folds[-1] + path.strain_bends[-1]) > 1e-4


@pytest.mark.parametrize("model", ["n5b8", "shell"])
@pytest.mark.parametrize("given", [{"fraction": "50%"}, {"fold_angle": 90.0}])
def test_a_fold_that_goes_half_way(model, given):
    """A mountain at a fold angle of -90 degrees: the edges are sqrt(2) apart."""
    structure = make(model, fd.patterns.simple_fold(1.0, 0.6, dihedral=150))
    path = fd.trace(
        fd.Case(structure, [fd.Fix([0, 1, 2])], [fd.Actuate("all", **given)]),
        method="displacement",
        load_factors=[0.5, 1.0],
    )
    moved = structure.nodes + path.displacement.to_numpy()[-1]
    assert np.linalg.norm(moved[4] - moved[0]) == pytest.approx(np.sqrt(2.0), rel=1e-9)
