"""Motions of what `discretize` makes without a word: consistent mass, stiffness of plates."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
MIURA = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
HELD = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
PUSH = fd.Force([7], (0.01, 0.0, 0.0), fd.HalfSine(0.1))


@pytest.fixture(scope="module")
def motions():
    """The same pulse by every integrator."""
    case = fd.Case(fd.discretize(MIURA, SHEET), HELD, [PUSH], fd.Rayleigh(alpha=0.5))
    assert fd.critical_step(case) > 4e-4  # s
    return {
        name: fd.simulate(case, 0.3, name, every=0.01, **({} if method.adaptive else {"dt": 1e-4}))
        for name, method in METHODS.items()
    }


@pytest.mark.parametrize("method", METHODS)
def test_the_energy_balance_closes_and_all_integrators_agree(motions, method):
    motion = motions[method]
    assert motion.attrs["energy_error"] < 1e-4
    true = motions["rk4"].displacement.sel(node=7, axis="x").values
    found = motion.displacement.sel(node=7, axis="x").values
    assert np.abs(found - true).max() < 2e-3 * np.abs(true).max()


def test_a_free_sheet_keeps_its_momenta():
    """The consistent matrix has the exact inertia of flat panels: all momenta are kept."""
    case = fd.Case(fd.discretize(MIURA, SHEET))
    s = case.structure
    x = s.nodes - s.center_of_mass
    start = fd.State(velocity=np.cross([0.3, -0.5, 0.8], x) + np.array([0.2, 0.1, 0.4]))
    motion = fd.simulate(case, 0.1, "rk4", every=0.05, initial=start)
    p = np.einsum("nm,tmk->tnk", s.mass.toarray(), motion.velocity.values)
    np.testing.assert_allclose(p.sum(axis=1), np.outer(np.ones(3), p[0].sum(axis=0)), rtol=1e-10)
    spin = np.cross(s.nodes + motion.displacement.values, p).sum(axis=1)
    np.testing.assert_allclose(spin, np.outer(np.ones(3), spin[0]), rtol=1e-7)


def test_small_vibrations_have_the_frequency_of_the_mode_without_a_secant():
    case = fd.Case(fd.discretize(MIURA, SHEET), HELD)
    mode = fd.modes(case, 1)
    assert mode.attrs["soft_hinges"] == 0
    shape, period = mode.shape.values[0], 1.0 / float(mode.frequency[0])
    start = fd.State(1e-4 * shape / np.abs(shape).max())
    motion = fd.simulate(case, period, "newmark", dt=period / 400, every=period, initial=start)
    np.testing.assert_allclose(motion.displacement[-1], start.displacement, atol=2e-7)
