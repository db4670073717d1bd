"""The sixty fresh sheets: what is drawn, and what is stored of the models beside the shell."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from foldyn.patterns import GENERATORS
from foldyn.patterns.topology import edge_lookup
from foldyn.structures.beyond_range import BELOW
from verification.fidelity import fresh
from verification.fidelity.mixed import sizes
from verification.fidelity.references import read_references, stored

pytestmark = pytest.mark.matrix


@pytest.fixture(scope="module")
def cases():
    return fresh.fresh()


def known():
    return [row for row in fresh.read() if row.doubt <= fresh.KNOWN]


def test_all_patterns_are_drawn(cases):
    assert len({case.name for case in cases}) == 60
    kinds = Counter(case.kind for case in cases)
    assert set(kinds) == set(GENERATORS) and kinds["kresling"] == 10
    supports = Counter(case.support for case in cases)
    assert 18 <= supports["clamped"] + supports["two edges"] <= 22
    folds = [case.shape["dihedral"] for case in cases if "dihedral" in case.shape]
    assert min(folds) < 30.0 and max(folds) > 170.0
    slender = [sizes(case.pattern())[0] / case.sheet.thickness for case in cases]
    assert 30.0 <= min(slender) < 40.0 and 300.0 < max(slender) <= 400.0


def test_held_edges_are_rims(cases):
    for case in cases:
        rim = edge_lookup(case.pattern().boundary)
        assert all(tuple(sorted(edge)) in rim for edge in case.held.edges), case.name
        assert bool(case.held.edges) == (case.support in ("one edge", "two edges", "clamped"))


@pytest.mark.usefixtures("compared")
def test_stored_modes_are_what_the_code_gives(cases):
    lines, kept = read_references(fresh.NAME), {}
    for row in fresh.read():
        kept.setdefault(row.case, []).append(row)
    assert set(lines) == set(kept)
    case = min((one for one in cases if one.name in kept), key=lambda one: one.triangles(8))
    found = fresh.rows(case, stored(case, lines[case.name]))
    for again, row in zip(found, kept[case.name], strict=True):
        np.testing.assert_allclose(again[3:], row[3:], rtol=1e-3, atol=2e-4)


def test_superelements_hold_what_they_state():
    rows = known()
    error = np.abs([row.error for row in rows])
    assert np.mean(error <= 0.01) >= 0.95 and np.mean(error <= 0.03) >= 0.99
    assert np.mean([row.stated for row in rows] >= error) >= 0.95


def test_bars_and_hinges_are_near_or_tell():
    rows = known()
    for clamped, least in ((False, 0.95), (True, 0.85)):
        low = [
            abs(row.bars_error) <= fresh.NEAR
            for row in rows
            if row.over_plate < BELOW and row.kind != "kresling"
            and (row.support == "clamped") == clamped
        ]  # fmt: skip
        assert np.mean(low) >= least
    wrong = [row.told for row in rows if not abs(row.bars_error) <= fresh.WRONG]
    assert np.mean(wrong) > 0.99
    right = [row.told for row in rows if abs(row.bars_error) <= fresh.NEAR]
    assert sum(right) <= 0.05 * len(rows)
