"""Frequencies of square plates against published ones, with the observed order of convergence."""

from __future__ import annotations

import numpy as np
import pytest
from plate_theory import LEISSA, ritz_frequencies
from shell_lab import SQUARE, WEST, angular_frequencies, dofs

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.shells import shell

SHEET = fd.Sheet(1e6, 0.3, 0.01, density=2.0)
DIVISIONS = np.array([8, 16, 32])


def frequencies(edges, divisions, mass, count=6):
    """omega a^2 sqrt(rho t / D), of all rigid and elastic modes."""
    clamped = [WEST] if edges == "cantilevered" else []
    s = shell(SQUARE, SHEET, divisions=int(divisions), clamped=clamped, mass=mass)
    held = dofs(np.flatnonzero(s.nodes[:, 0] < 1e-12)) if clamped else []
    unit = np.sqrt(SHEET.bending_modulus / (SHEET.density * SHEET.thickness))
    rigid = 0 if clamped else 6
    return angular_frequencies(s, held, rigid + count, shift=unit) / unit


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("edges", ["free", "cantilevered"])
def test_first_six_frequencies(edges, mass):
    exact = ritz_frequencies(SHEET.poissons_ratio, clamped=edges == "cantilevered")[:6]
    found = np.array([frequencies(edges, n, mass)[-6:] for n in DIVISIONS])
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    assert limit == pytest.approx(LEISSA[edges], rel=1.1e-2)  # his are upper bounds
    assert limit == pytest.approx(exact, rel=1.5e-3)
    assert (found < exact).all()  # softer than the plate, and lumping adds to it
    assert found[-1] == pytest.approx(exact, rel=1.4e-2 if mass == "lumped" else 5e-3)
    for mode in range(6):
        order = observed_order(1.0 / DIVISIONS, found[:, mode] / exact[mode] - 1.0)
        assert 1.75 < order < 2.05


def test_frequencies_go_with_thickness_and_density():
    """omega ~ t sqrt(E / rho): membrane stiffness has no part in bending modes."""
    thin = fd.Sheet(3e6, 0.3, 0.001, density=5.0)
    found = []
    for sheet in (SHEET, thin):
        s = shell(SQUARE, sheet, divisions=6, clamped=[WEST])
        held = dofs(np.flatnonzero(s.nodes[:, 0] < 1e-12))
        unit = np.sqrt(sheet.bending_modulus / (sheet.density * sheet.thickness))
        found.append(angular_frequencies(s, held, 4, unit) / unit)
    assert found[1] == pytest.approx(found[0], rel=1e-8)
