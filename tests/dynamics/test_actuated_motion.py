"""Motions driven by folds whose rest angle moves."""

from __future__ import annotations

import moving_sheets as sheets
import numpy as np
import pytest
from measured import apart, order
from moving_sheets import SHEET

import foldyn as fd
from custom_laws import CUBIC

# theta1 and theta2 such that rest angles of 60 and 300 degrees lie in the locking range
LAWS = {
    "linear": "linear",
    "superlinear": "superlinear",
    "stress_free": fd.EnhancedLinear(theta1=90, theta2=270),
    "as_published": fd.EnhancedLinear(theta1=90, theta2=270, rest="as_published"),
    "custom": CUBIC,
}


def fold(law="linear", **options) -> fd.Structure:
    return sheets.fold(fold_law=LAWS[law], bend_law="linear", **options)


@pytest.mark.parametrize("law", ["linear", "stress_free", "as_published", "custom"])
def test_energy_of_a_fold_that_opens_itself(law):
    """Kinetic + strain + dissipated = work of the actuator, with the order of RK4 or better."""
    open_up = fd.Actuate("all", 240.0, fd.Ramp(duration=0.5, smooth=True))
    case = fd.Case(fold(law), loads=[open_up], damping=fd.Rayleigh(alpha=1.0))
    steps = [2000, 4000, 8000]
    motions = [fd.simulate(case, 0.6, method="rk4", dt=0.6 / n, every_steps=n // 20) for n in steps]
    motion, errors = motions[-1], [one.attrs["energy_error"] for one in motions]
    folds, _ = case.structure.dihedrals(motion.displacement[-1])
    assert np.degrees(folds[0]) < 285.0  # it does open, from 300
    assert errors[-1] < 1e-5
    assert order(steps, errors) > 3.5


@pytest.mark.parametrize("law", LAWS)
def test_a_constant_actuation_is_another_rest_angle(law):
    """The same motion as of a structure made with these rest angles."""
    actuated = fd.Case(fold(law), loads=[fd.Actuate("all", 250.0)])
    made = fd.Case(fold(law, crease_rest=250.0))
    one, two = (
        fd.simulate(case, 0.2, method="rk4", dt=1e-4, every_steps=100) for case in (actuated, made)
    )
    assert float(np.abs(two.displacement).max()) > 1e-4
    assert apart(one, two) < 1e-10
    np.testing.assert_allclose(one.strain_folds, two.strain_folds, rtol=1e-10)
    assert float(np.abs(one.work).max()) < 1e-15


def test_only_the_chosen_creases_turn_and_the_structure_stays_as_it_was():
    """Folds and bends of one law share their arrays inside: the right rows must move."""
    s = sheets.cell((2, 2), 120, **sheets.LINEAR)
    before = s.model.hinge_rest.copy()
    target = np.degrees(s.fold_rest[5]) - 30.0
    case = fd.Case(s, loads=[fd.Actuate([5], target)])
    start = fd.simulate(case, 1e-3, method="rk4", dt=1e-4)
    # at the start nothing has moved: the energy is that of one fold turned by 30 degrees
    wanted = 0.5 * s.fold_stiffness[5] * np.radians(30.0) ** 2
    assert float(start.strain_folds[0]) == pytest.approx(wanted, rel=1e-12)
    assert float(start.strain_bends[0]) == pytest.approx(0.0, abs=1e-12 * wanted)
    np.testing.assert_array_equal(s.model.hinge_rest, before)
    again = fd.simulate(case, 1e-3, method="rk4", dt=1e-4)
    np.testing.assert_array_equal(again.displacement, start.displacement)


def test_a_rest_angle_beyond_closing_is_named():
    swing = fd.Actuate([0], 350.0, fd.Harmonic(frequency=1.0, phase=0.0))
    big = fd.Actuate([0], 350.0, lambda t: 3.0 * t)
    assert (
        fd.simulate(fd.Case(fold(), loads=[swing]), 0.3, method="rk4", interval=0.1).sizes["time"]
        == 4
    )
    named = "rest dihedral of the crease between"
    with pytest.raises(fd.errors.InstabilityError, match=named) as e:
        fd.simulate(fd.Case(fold(), loads=[big]), 1.0, method="rk4", interval=0.1)
    assert 0.3 < float(e.value.partial.time[-1]) < 0.42
    with pytest.raises(fd.errors.InputError, match="actuation with the history step jumps"):
        fd.simulate(
            fd.Case(fold(), loads=[fd.Actuate([0], 240.0, fd.Step(0.5))]), 1.0, method="rk4"
        )


@pytest.mark.matrix
@pytest.mark.parametrize("history", [fd.Ramp(0.5, smooth=True), None])
def test_a_shell_that_its_crease_folds(history):
    """Free of all else it comes to rest at the new angle, and the actuator's work is counted."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=150)
    s = fd.shell(pattern, SHEET, divisions=2)
    case = fd.Case(s, loads=[fd.Actuate([0], 170.0, history)], damping=fd.Rayleigh(alpha=8.0))
    motion = fd.simulate(case, 4.0, method="newmark", interval=0.5)
    assert motion.attrs["energy_error"] < 2e-3
    corners = motion.displacement[-1].to_numpy()[: len(pattern.vertices)]
    folds, _ = fd.discretize(pattern, SHEET, scheme="n4b5", preset="herkal").dihedrals(corners)
    assert np.degrees(folds) == pytest.approx(170.0, abs=0.05)
