"""Paths against MERLIN2's own, compared on the curve.

Source: ../shared/golden/path_*.npz (its README says how they were made): force-controlled MGDCM
of MERLIN2 v1.1, displacements `Uhis` (dof, increment) and load factors `Fhis`. The files name no
panels; the static files of the same patterns do.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import foldyn as fd
from foldyn.statics import Settings, trace

GOLDEN = Path(__file__).resolve().parents[3] / "shared" / "golden"
PATTERN_OF = {"fold_dih120": "fold_dih60", "kresling6": "kresling6", "miura11_L1": "miura11_L1"}
STABLE = ("fold_dih120", "miura11_L1")
TOLERANCE = 1e-5  # of the range of each curve

pytestmark = [
    pytest.mark.skipif(not list(GOLDEN.glob("path_*.npz")), reason="needs ../shared"),
    pytest.mark.filterwarnings("ignore:the path loses stability"),
]


def golden(name):
    """Arrays of a golden path, and its case."""
    data = np.load(GOLDEN / f"path_{name}_force_N5B8.npz")
    static = np.load(GOLDEN / f"static_{PATTERN_OF[name]}_N5B8.npz")
    panels = [[int(v) - 1 for v in row if v > 0] for row in np.atleast_2d(static["panels"])]
    pattern = fd.Pattern(data["nodes"][: len(static["nodes_input"])], panels)
    sheet = fd.Sheet(*(float(data[k]) for k in ("E", "nu", "t")), None, float(data["LScaleFactor"]))
    low, high = np.ravel(data["fold_limits_deg"]).tolist()
    law = fd.EnhancedLinear(low, high, rest="as_published")
    s = fd.discretize(pattern, sheet, calibration="merlin2", fold_law=law, preset="herkal")
    np.testing.assert_allclose(s.nodes, data["nodes"], atol=1e-12)
    supports = [fd.Fix([int(k - 1) // 3], "xyz"[int(k - 1) % 3]) for k in data["fixed_dofs"]]
    forces = data["load"].reshape(-1, 3)
    loads = [fd.Force([i], tuple(forces[i])) for i in np.flatnonzero(forces.any(axis=1)).tolist()]
    return data, fd.Case(s, supports, loads)


def displacements(data):
    return data["Uhis"].T.reshape(-1, len(data["nodes"]), 3)


def assert_same_curve(path, data, rows=slice(None)):
    theirs = displacements(data)[rows]
    assert np.abs(path.displacement.values - theirs).max() < TOLERANCE * np.ptp(theirs)
    energies = {"US": "strain_bars", "UF": "strain_folds", "UB": "strain_bends"}
    scale = max(np.ptp(data[key]) for key in energies)
    for key, ours in energies.items():
        error = np.abs(path[ours].values - data[key].ravel()[rows]).max()
        assert error < TOLERANCE * scale, key


@pytest.mark.parametrize("name", STABLE)
def test_at_the_same_load_factors(name):
    data, case = golden(name)
    path = trace(case, load_factors=data["Fhis"].ravel())
    assert_same_curve(path, data)


@pytest.mark.parametrize("method", ["mgdcm", "arc_length"])
@pytest.mark.parametrize("name", [*STABLE, "kresling6"])
def test_followed_with_a_free_factor(name, method):
    """Their load factors lie on the spline through our points."""
    data, case = golden(name)
    dof = int(np.flatnonzero(data["load"])[0])
    theirs = np.abs(data["Uhis"][dof])
    path = trace(
        case,
        method,
        first_step=float(data["initial_load_factor"]),
        steps=400,
        until=lambda u, factor: abs(u.ravel()[dof]) > theirs[-1],
        settings=Settings(largest_turn=0.75),
    )
    ours = np.abs(path.displacement.values.reshape(path.sizes["step"], -1)[:, dof])
    late = ours > 0.5 * theirs[0]  # from rest, soft bends give the curve a corner
    curve = CubicSpline(ours[late], path.load_factor.values[late])
    error = np.abs(curve(theirs) - data["Fhis"].ravel()).max()
    assert error < TOLERANCE * np.ptp(data["Fhis"])


def test_kresling_by_displacement():
    """All of their points, before and past the limit: the top moved down as theirs moves."""
    data, loaded = golden("kresling6")
    top = [load.nodes[0] for load in loaded.loads]
    case = fd.Case(loaded.structure, [*loaded.supports, fd.Impose(top, "z", -1.0)])
    theirs = displacements(data)
    down = -theirs[:, top, 2]
    assert np.ptp(down, axis=1).max() < 1e-9  # their six top nodes move together
    path = trace(case, load_factors=down.mean(axis=1))
    assert_same_curve(path, data)
    force = -path.reaction.values[:, path.support_node.isin(top).values].sum(axis=1)
    error = np.abs(force / len(top) - data["Fhis"].ravel()).max()
    assert error < TOLERANCE * np.ptp(data["Fhis"])


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["mgdcm", "arc_length"])
def test_kresling_limit_load(method):
    data, case = golden("kresling6")
    path = trace(case, method, first_step=60.0, until=lambda u, factor: u[6, 2] < -0.5)
    limit = path.isel(step=path.point.values == "limit")
    assert limit.sizes["step"] == 1
    assert float(limit.load_factor[0]) == pytest.approx(1801.8, rel=1e-3)
    assert float(limit.load_factor[0]) >= data["Fhis"].max()  # theirs are points beside it
    assert path.load_factor.values[-1] < 1700.0  # past it
