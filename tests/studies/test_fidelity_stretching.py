"""Sheets whose panels stretch: numbers of the page on fidelity."""

from __future__ import annotations

import pytest

from foldyn.studies.fidelity.stretching import pressed, sheet, stiffness, tower


def test_a_tower_is_as_stiff_as_the_shell_where_panels_are_membranes():
    found = stiffness(tower(1e-3, (8, 12)), "z")
    assert found["plate"][0] == pytest.approx(-0.07, abs=0.02)
    assert found["n5b8e"][0] == pytest.approx(-0.12, abs=0.02)
    assert found["plate, bars"][0] > 3.0
    assert found["standard"][0] > 3.0


@pytest.mark.matrix
def test_the_force_at_which_a_tower_snaps():
    found = pressed(tower(1e-3, (8, 12)))
    for model in ("plate", "n5b8e"):
        assert abs(found[model]).max() < 0.09
    assert found["plate, bars"].min() > 3.0


@pytest.mark.matrix
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_sheets_between_two_rims(axis):
    found = stiffness(sheet(3, (4, 8)), axis)
    assert 0.0 < found["plate"][0] < 0.15
    assert -0.12 < found["n5b8e"][0] < 0.05
    assert found["plate, bars"][0] > 0.4
