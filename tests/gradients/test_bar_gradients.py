"""Gradients by what makes up bars with laws."""

from __future__ import annotations

from typing import Any

import pytest
from differences import Design

import foldyn as fd

STRETCHED = fd.CustomBarLaw(
    energy_of=lambda s: (s - 1.0) ** 2 * (0.5 + (s - 1.0)),
    stress_of=lambda s: (s - 1.0) * (1.0 + 3.0 * (s - 1.0)) / s,
    slope_of=lambda s: (1.0 + 6.0 * (s - 1.0) - (s - 1.0) * (1.0 + 3.0 * (s - 1.0)) / s) / s**2,
)
ANALYSES: dict[str, tuple[list[str], dict[str, Any]]] = {
    "statics": (["displacement[5,z]"], {"kind": "statics", "load_factors": [0.0, 1.0]}),
    "modes": (["frequency[1]"], {"kind": "modes", "count": 3, "state": "equilibrium"}),
    "dynamics": (
        ["displacement[5,z]"], {"kind": "dynamics", "duration": 0.02, "method": "rk4", "dt": 1e-4}
    ),
}  # fmt: skip


def braced(law: Any, area: float, modulus: float, rest_length: float, a: float) -> fd.Case:
    """A fold, held at one side and pushed at the other, with bars across."""
    sheet = fd.Sheet(1e7, 0.3, 0.01, 100.0)
    fold = fd.discretize(fd.patterns.simple_fold(a=a, dihedral=100), sheet, preset="plate")
    bars = fd.Bar([(0, 4), (1, 5)], area=area, modulus=modulus, rest_length=rest_length, law=law)
    return fd.Case(fold, [fd.Fix([0, 1, 2, 3]), bars], [fd.Force([4, 5], (0.3, 0.1, -1.0))])


@pytest.mark.matrix  # by the arrays: test_pullback_terms
@pytest.mark.parametrize("law", ["ogden", "linear", STRETCHED, None], ids=["o", "l", "own", "none"])
@pytest.mark.parametrize("kind", ANALYSES)
def test_gradients_by_area_modulus_and_length(law, kind):
    own = {"area": 2e-6, "modulus": 1e7, "rest_length": 1.3, "a": 1.0}
    design = Design(lambda **given: braced(law, **given), own, *ANALYSES[kind])
    design.step = 2e-3
    assert max(design.errors().values()) < 1e-7
