"""Colors of a page: energies of panels add up to those of the result, also where creases fold."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.viewer.fields import fields

SHEET = fd.Sheet(1e9, 0.3, 1e-3, density=700.0)
SUPPORTS = [fd.Fix([0, 1, 2], axes="xyz")]


def structure(**options):
    return fd.discretize(fd.patterns.miura((2, 2), 0.1, 0.1, 60, 90), SHEET, **options)


@pytest.mark.parametrize(
    "options",
    [
        {"scheme": "n4b5"},
        {"scheme": "n5b8"},
        {"scheme": "n5b8", "bend_law": "plate_superlinear", "calibration": "plate"},
    ],
    ids=["n4b5", "n5b8", "bends with onsets of their own"],
)
def test_energies_of_panels_add_up(options):
    s = structure(**options)
    u = 1e-3 * np.random.default_rng(3).normal(size=(3, len(s.nodes), 3))
    moments = xr.Dataset(coords={"time": [0.0, 1.0, 2.0]})
    density = fields(fd.Case(s, SUPPORTS, []), moments, u)["energy"].values
    wanted = [s.energy(x) for x in u]
    assert np.allclose(density @ s.pattern.face_areas, wanted, rtol=1e-10)


def test_energy_lies_where_the_fold_is():
    s = structure()
    u = np.zeros((1, *s.nodes.shape))
    u[0, s.pattern.faces[0][0]] = (0.0, 0.0, 1e-3)  # a corner of the sheet
    density = fields(fd.Case(s, [], []), xr.Dataset(coords={"time": [0.0]}), u)["energy"].values[0]
    beside = set(s.pattern.crease_faces[(s.pattern.crease_faces == 0).any(axis=1)].ravel().tolist())
    assert set(np.flatnonzero(density > 1e-12 * density.max()).tolist()) <= beside
    assert density.argmax() == 0


@pytest.mark.parametrize("constant", [(), (0,)], ids=["growing", "constant"])
def test_rest_angles_follow_what_folds_them_on_a_path(constant):
    s = structure(fold_law="linear", bend_law="linear")
    loads = [
        fd.Actuate("all", fraction=0.4),
        fd.Force([s.pattern.faces[-1][2]], (0.0, 0.0, 0.02)),
    ]
    path = fd.trace(fd.Case(s, SUPPORTS, loads), load_factors=[0.5, 1.0], constant=constant)
    check(s, path)


def test_rest_angles_follow_what_folds_them_in_a_motion():
    s = structure(fold_law="linear", bend_law="linear")
    case = fd.Case(s, SUPPORTS, [fd.Actuate("all", fraction=0.6, history=fd.Ramp(0.01))])
    check(s, fd.simulate(case, 0.01, every=2e-3))


def check(s, result):
    """Compare with the energies that the solver stored."""
    found = fields(fd.case_of(result), result, result["displacement"].values)
    stored = sum(result[name].values for name in ("strain_bars", "strain_folds", "strain_bends"))
    total = found["energy"].values @ s.pattern.face_areas
    assert stored.max() > 0.0
    assert np.allclose(total, stored, rtol=1e-6, atol=1e-9 * stored.max())
