"""Laws with memory in small vibrations: complex modulus in responses and modes."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.linear.linearized import linearize
from one_hinge import STIFFNESS, WING, one_hinge

PRONY = fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear")
MASS = 1e-3  # kg, 1 m from the hinge
LIFT = fd.Force([WING], (0, 0, 1.0))


def sprung(law, **given):
    return one_hinge(law, hold=False, mass=MASS, **given)


@pytest.mark.parametrize("method", ["direct", "modal"])
def test_the_response_has_the_complex_modulus(method):
    frequency = np.array([0.0, 0.1, 0.5, 0.9, 2.0, 10.0])
    found = fd.frf(
        sprung(PRONY, damping=fd.Rayleigh(0.7)), LIFT, frequencies=frequency, method=method
    )
    omega = 2.0 * np.pi * frequency
    dynamic = STIFFNESS * PRONY.modulus(frequency) - MASS * (omega**2 - 0.7j * omega)
    np.testing.assert_allclose(
        found.receptance.sel(node=WING, axis="z").values, 1.0 / dynamic, rtol=1e-9
    )


def test_the_response_is_that_of_a_simulated_sine():
    """Of 0.5 degrees at most, over the last of many periods: 1e-3 asked for, 1e-6 found."""
    frequency, push = 0.5, 1e-4
    case = sprung(PRONY, damping=fd.Rayleigh(3.0))
    wanted = (
        fd.frf(case, LIFT, frequencies=[frequency]).receptance.sel(node=WING, axis="z").values[0]
    )
    sine = fd.Force([WING], (0, 0, push), fd.Harmonic(frequency))
    found = fd.simulate(case.altered(loads=[sine]), 16.0, method="rk4", dt=2.0**-9, every_steps=32)
    last = slice(-32, None)
    phase = np.exp(-2j * np.pi * frequency * found.time.values[last])
    response = 2j * np.mean(found.displacement.sel(node=WING, axis="z").values[last] * phase)
    assert abs(response / push / wanted - 1.0) < 1e-4


@pytest.mark.parametrize("law", [PRONY, fd.Prony(3.0, 0.05, law="linear")])
def test_modes_are_roots_of_the_characteristic_polynomial(law):
    """m s^2 + k (1 + sum g s / (s + r)) = 0, with Rayleigh's damping beside it."""
    ratio, tau = law.series
    rate = 1.0 / tau
    whole = np.poly1d([MASS, 0.0, STIFFNESS]) * np.poly1d(-rate, r=True)
    for k, g in enumerate(ratio):
        others = np.poly1d(-np.delete(rate, k), r=True)
        whole = whole + np.poly1d([STIFFNESS * g, 0.0]) * others
    (root,) = [s for s in whole.roots if s.imag > 0.0]
    found = fd.modes(sprung(law), 2).isel(mode=[1])  # the first is that of the mass beside it
    assert float(found.frequency[0]) == pytest.approx(abs(root) / (2.0 * np.pi), rel=1e-9)
    assert float(found.damping_ratio[0]) == pytest.approx(-root.real / abs(root), rel=1e-9)
    damped = fd.modes(sprung(law, damping=fd.Rayleigh(0.1)), 2).damping_ratio[1]
    assert float(damped - found.damping_ratio[0]) == pytest.approx(0.05 / abs(root), rel=1e-9)


def test_creep_is_a_dashpot_to_small_vibrations():
    """And to slow ones gives way: far below its rate, nothing but the mass resists."""
    law = fd.Eyring(1e-3, 0.2, law="linear")
    frequency = np.array([1e-4, 0.2, 3.0])
    found = (
        fd.frf(sprung(law), LIFT, frequencies=frequency).receptance.sel(node=WING, axis="z").values
    )
    s = 2j * np.pi * frequency
    dynamic = STIFFNESS * s / (s + 2.0 * 0.2 * STIFFNESS / 1e-3) + MASS * s**2
    np.testing.assert_allclose(found, 1.0 / dynamic, rtol=1e-9)


def test_modes_of_a_sheet_solve_their_equation():
    """Every mode of a Miura sheet with a memory of its folds and its bends, to rounding."""
    pattern, sheet = (
        fd.patterns.miura((2, 2), 0.05, b=0.05, dihedral=120),
        fd.Sheet(1e9, 0.3, 5e-4, 1e3),
    )
    folds, bends = fd.Prony([0.5, 0.2], [0.02, 0.3]), fd.Prony(0.3, 0.01, "linear")
    structure = fd.discretize(pattern, sheet, fold_law=folds, bend_law=bends)
    case = fd.Case(structure, [fd.Fix([0, 1, 2, 3, 4], "xyz")])
    system, found = linearize(case), fd.modes(case, 5)
    assert system.branches is not None
    assert system.branches.share.shape == (len(structure.folds) + len(structure.bends), 2)
    for ratio, value in zip(found.damping_ratio.values, found.eigenvalue.values, strict=True):
        assert 0.0 < ratio < 0.2
        s = np.sqrt(value) * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
        matrix = system.stiffness + system.branches.stiffness(s) + s**2 * system.mass
        values = np.linalg.eigvals(np.linalg.solve(system.mass.toarray(), matrix.toarray()))
        assert np.abs(values).min() < 1e-7 * np.abs(values).max()
    plain = fd.modes(fd.Case(fd.discretize(pattern, sheet, preset="plate"), case.supports), 5)
    assert (found.frequency.values > plain.frequency.values).all()
