"""Derivatives of the families that continuation follows, against differences."""

import numpy as np
import pytest
from duffing import oscillator

import foldyn as fd
from foldyn.periodic.balance import Balance, Fourier
from foldyn.periodic.equation import Drive, Equation
from foldyn.periodic.families import ByFrequency, ByLevel, Free, InResonance
from foldyn.periodic.motion import balance_of

STEP = 1e-4


def shaken():
    """The oscillator on a dashpot, pushed at twice its base's frequency; mass ties both."""
    case = oscillator(frequency=0.5, dashpot=0.05)
    own = case.structure
    s = fd.discretize(own.pattern, own.sheet, scheme="n4b5", bar_law="linear", mass="consistent")
    return case.altered(
        structure=s, supports=[*case.supports, fd.BaseMotion("z", fd.Harmonic(0.25), 0.3)]
    )


def families():
    one, doubled = (balance_of(shaken(), "a test", 3, periods) for periods in (1, 2))
    place = np.zeros(1)
    free = Balance(Equation(shaken(), "a test", driven=False), Fourier(4, even=True))
    return {
        "by frequency": (ByFrequency(one, 1.0, 1e-9), 0.3),
        "by frequency, doubled": (ByFrequency(doubled, 1.0, 1e-9), 0.3),
        "by level": (ByLevel(one, 1.0, 1e-9, 0.25), 0.7),
        "in resonance": (InResonance(one, 1e-9, place, 0.25), -0.2),
        "free": (Free(free, 1.0, 1e-9, place), 0.3),
    }


@pytest.mark.parametrize("name", families())
def test_derivatives_are_those_of_the_residual(name):
    family, p = families()[name]
    size = family.balance.shape[0] * family.balance.shape[1]
    z = np.random.default_rng(3).uniform(0.2, 0.5, size)
    if name == "in resonance":
        z = np.append(z, 0.3 / family.unit)

    def change(dz, dp):
        up, down = (family.residual(z + s * dz, p + s * dp) for s in (STEP, -STEP))
        return (up - down) / (2.0 * STEP)

    still = np.zeros_like(z)
    columns = np.array([change(row, 0.0) for row in np.eye(len(z))]).T
    size = np.abs(columns).max()
    assert family.jacobian(z, p) == pytest.approx(columns, rel=1e-6, abs=1e-6 * size)
    along = change(still, 1.0)
    assert family.slope(z, p) == pytest.approx(along, rel=1e-6, abs=1e-6 * np.abs(along).max())


def test_motions_of_supports_are_differentiated_twice():
    """A base that swings three times as fast as the force."""
    case = oscillator()
    fast = fd.BaseMotion("z", fd.Harmonic(0.75, phase=20.0), 0.3)
    drive = Drive(case.altered(supports=[*case.supports, fast]))

    def moved(phase):
        return drive.sums(drive.moves, np.array([phase]), 0.8, 9)[:, 0]

    for phase in (0.1, 2.0):
        assert moved(phase)[0].max() == pytest.approx(0.24 * np.sin(3.0 * phase + np.radians(20.0)))
        change = (moved(phase + STEP) - moved(phase - STEP)) / (2.0 * STEP)
        assert moved(phase)[1:] == pytest.approx(change[:2], rel=1e-6)


@pytest.mark.matrix
def test_resonance_of_a_swinging_base_is_that_of_the_forces_by_which_it_moves_the_mass():
    """Bars at right angles to it have no stiffness: inertia and drag alone drive the node."""
    case = shaken().altered(loads=[])
    found = fd.backbone(case, amplitudes=(1e-4, 2e-4), harmonics=2, damped=True)
    linear = found.attrs["linear_frequency"]
    assert found.frequency.values == pytest.approx(linear, rel=1e-6)
