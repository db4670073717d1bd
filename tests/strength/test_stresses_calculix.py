"""What docs/stresses.md says of the table that verification/stresses_calculix.py has written."""

from __future__ import annotations

import csv

import numpy as np

from verification.stresses_calculix import RESULTS


def test_stored_comparison_with_calculix():
    lines = list(csv.reader(RESULTS.read_text(encoding="utf-8").splitlines()))[1:]
    assert {line[1] for line in lines} == {"tip", "edge", "pressure", "gravity"}
    found = {}
    for line in lines:
        found.setdefault(line[2], []).append(np.abs(np.array(line[3:], float)))
    allowed = {  # largest, at centers and middles of edges, at corners, moments of creases
        "shell": (0.012, 0.016, 0.047, 0.0024),
        "superelements": (0.22, 0.009, 0.22, 0.01),
        "superelements, default radius": (0.24, 0.012, 0.34, 0.0032),
    }
    assert found.keys() == allowed.keys()
    for model, own in found.items():
        assert len(own) == 6
        assert (np.max(own, axis=0) < np.array(allowed[model])).all(), model
