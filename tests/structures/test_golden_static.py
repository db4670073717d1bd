"""Calibration, forces, energies and tangents against MERLIN2's own numbers.

Source: ../shared/golden/static_*.npz (its README says how they were made). MERLIN2 counts from 1
and adds 1e-8 to the tangent's diagonal.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import foldyn as fd
from named_models import named

GOLDEN = Path(__file__).resolve().parents[3] / "shared" / "golden"
FILES = sorted(GOLDEN.glob("static_*.npz"))
TOLERANCE = 1e-9

pytestmark = pytest.mark.skipif(not FILES, reason="needs ../shared")


def relative(a, b):
    a, b = np.ravel(a), np.ravel(b)
    assert a.shape == b.shape
    return np.linalg.norm(a - b) / np.linalg.norm(b)


def pattern_of(data):
    panels = [[int(v) - 1 for v in row if v > 0] for row in np.atleast_2d(data["panels"])]
    return fd.Pattern(data["nodes_input"], panels)


def structure_of(path, calibration="merlin2", stored_centers=True):
    data = np.load(path)
    pattern = pattern_of(data)
    sheet = fd.Sheet(*(float(data[k]) for k in ("E", "nu", "t")), None, float(data["LScaleFactor"]))
    scheme = "n5b8" if "N5B8" in path.stem else "n4b5"
    low, high = np.ravel(data["fold_limits_deg"]).tolist()
    centers = None
    if stored_centers and scheme == "n5b8":
        # beyond four corners MERLIN2's center depends on its optimizer's tolerance
        with_center = [p for p, face in enumerate(pattern.faces) if len(face) > 3]
        stored = dict(zip(with_center, data["nodes"][len(pattern.vertices) :], strict=True))
        centers = {p: x for p, x in stored.items() if len(pattern.faces[p]) > 4}
    law = fd.EnhancedLinear(low, high, rest="as_published")
    options = {"scheme": scheme, "calibration": calibration, "fold_law": law, "centers": centers}
    return data, fd.discretize(pattern, sheet, **named(options))


@pytest.fixture(scope="module", params=FILES, ids=lambda p: p.stem.removeprefix("static_"))
def golden_path(request):
    return request.param


@pytest.fixture(scope="module")
def golden(golden_path):
    return structure_of(golden_path)


def order(ours, theirs):
    """Rows of ours that stand for each row of theirs (1-based node pairs, either way round)."""
    place = {tuple(sorted(row)): k for k, row in enumerate(ours[:, :2].tolist())}
    assert len(place) == len(ours)
    theirs = theirs.reshape(-1, 4 if theirs.shape[-1] == 4 else 2)[:, :2] - 1
    assert len(theirs) == len(ours)
    return [place[tuple(sorted(row))] for row in theirs.astype(int).tolist()]


def test_nodes_and_bars(golden):
    data, s = golden
    np.testing.assert_allclose(s.nodes, data["nodes"], rtol=0, atol=1e-12 * s.pattern.size)
    rows = order(s.bars, data["bars"])
    assert relative(s.bar_length[rows], data["bar_length"]) < TOLERANCE
    np.testing.assert_allclose(s.bar_area[rows], data["bar_area"], rtol=1e-12)


@pytest.mark.parametrize(("kind", "name"), [("fold", "kf_total"), ("bend", "kb_total")])
def test_hinges(golden, kind, name):
    data, s = golden
    theirs = np.ravel(data[name])
    ours, rest = getattr(s, f"{kind}_stiffness"), getattr(s, f"{kind}_rest")
    assert len(ours) == len(theirs)
    if not len(theirs):
        return
    rows = order(getattr(s, f"{kind}s"), data[kind])
    assert relative(ours[rows], theirs) < TOLERANCE
    # which side of a crease MERLIN2 reads depends on its node numbers
    folded = np.abs(np.ravel(data[f"rest_{kind}"]) - np.pi)
    np.testing.assert_allclose(np.abs(rest[rows] - np.pi), folded, rtol=0, atol=1e-7)


def test_force_at_rest(golden):
    data, s = golden
    force = s.internal_force(np.zeros_like(s.nodes))
    largest = max(np.linalg.norm(data[f"IF{c}"]) for c in "123")
    assert np.linalg.norm(force.ravel() - data["IF_rest"]) < TOLERANCE * largest


@pytest.mark.parametrize("c", [1, 2, 3])
def test_force_energies_and_tangent(golden, c):
    data, s = golden
    u, n = data[f"U{c}"].reshape(-1, 3), int(data[f"K{c}_n"])
    assert relative(s.internal_force(u), data[f"IF{c}"]) < TOLERANCE
    e = s.energies(u)
    ours = [e["strain_bars"], e["strain_bends"], e["strain_folds"], sum(e.values())]
    assert relative(ours, data[f"E{c}"]) < TOLERANCE
    # each energy by itself, as far as MERLIN2's acos knows its angles
    np.testing.assert_allclose(ours, data[f"E{c}"], rtol=1e-5, atol=1e-15 * sum(e.values()))
    entries = (data[f"K{c}_val"], (data[f"K{c}_row"] - 1, data[f"K{c}_col"] - 1))
    theirs = sparse.coo_array(entries, shape=(n, n)).toarray() - 1e-8 * np.eye(n)
    assert relative(s.tangent(u).toarray(), theirs) < TOLERANCE


def test_own_centers(golden, golden_path):
    """Also of polygons, for which MERLIN2's optimizer stops a little early."""
    data, _ = golden
    _, own = structure_of(golden_path, stored_centers=False)
    assert np.abs(own.nodes - data["nodes"]).max() < 1e-4 * own.pattern.size


def test_standard_calibration(golden, golden_path):
    """Where MERLIN2 mis-orders, the standard calibration is another, by design."""
    data, s = golden
    _, standard = structure_of(golden_path, "standard")
    np.testing.assert_array_equal(standard.fold_stiffness, s.fold_stiffness)
    if s.options.scheme == "n4b5" or all(len(f) == 3 for f in s.pattern.faces):
        np.testing.assert_array_equal(standard.bend_stiffness, s.bend_stiffness)
        np.testing.assert_array_equal(standard.bar_area, s.bar_area)
    same = relative(standard.internal_force(data["U3"].reshape(-1, 3)), data["IF3"]) < TOLERANCE
    pairs = ((getattr(one, k) for one in (standard, s)) for k in ("bend_stiffness", "bar_area"))
    assert same == all(np.allclose(a, b, rtol=1e-9) for a, b in pairs)
