"""The paper's case studies with the shell: frequencies and static displacements (design, 5)."""

from __future__ import annotations

import numpy as np
import pytest
from shell_lab import angular_frequencies, at_rest, dofs, equilibrium, split

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.shells import shell

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
MIURA = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
MIURA_HELD = np.concatenate([dofs([0, 1, 2], "x"), dofs([0, 2, 6, 8], "z"), dofs(1, "y")])
# of a separate implementation of the same element at meshes of 1/20 to 1/30; two established
# shells gave 0.624, 1.051, 1.903 and 0.623, 1.049, 1.899
FREQUENCIES = np.array([0.625, 1.043, 1.901])


def frequencies(divisions, mass="lumped"):
    s = shell(MIURA, SHEET, divisions=divisions, mass=mass)
    return angular_frequencies(s, MIURA_HELD, 3, shift=2.0) / (2 * np.pi)


@pytest.mark.matrix
def test_frequencies_of_case_2_converge_from_below():
    assert frequencies(16, "consistent") == pytest.approx(FREQUENCIES, rel=5e-3)
    found = np.array([frequencies(n) for n in (4, 8, 16)])
    assert found[-1] == pytest.approx(FREQUENCIES, rel=5e-3)
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    assert limit == pytest.approx(FREQUENCIES, rel=3e-3)
    assert found[1] == pytest.approx(limit * [0.993, 0.984, 0.989], rel=2e-3)
    for mode in range(3):
        order = observed_order([1 / 4, 1 / 8, 1 / 16], found[:, mode] - limit[mode])
        assert order == pytest.approx(1.9, abs=0.2)


def load_up(s, load, held):
    q = at_rest(s)
    for part in np.linspace(0.2, 1.0, 5):
        q = equilibrium(s, q, part * load, held)
    return split(s, q)[0]


def test_static_displacement_of_case_1():
    """0.0348 m of the loaded edge at full load."""
    s = shell(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60), SHEET, divisions=12)
    load = at_rest(s)
    load[dofs([0, 1], "x")] = -1e-3
    u = load_up(s, load, np.concatenate([dofs([4, 5]), dofs([0, 1], "z")]))
    assert u[[0, 1], 0] == pytest.approx([-0.0348, -0.0348], rel=5e-3)
    assert np.abs(u[[0, 1], 1]).max() < 1e-5


@pytest.mark.matrix
def test_static_displacement_of_case_2():
    """x displacements 0.0271, 0.0103, 0.0225 m of vertices 6, 8, 7 at full load."""
    s = shell(MIURA, SHEET, divisions=16)
    load = at_rest(s)
    load[dofs(7, "x")] = 0.01
    u = load_up(s, load, MIURA_HELD)
    assert u[[6, 8, 7], 0] == pytest.approx([0.0271, 0.0103, 0.0225], rel=1.2e-2)
