"""What the energy audit says where rounding is all that moves, and where it hides the hinges."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import system
from foldyn.dynamics.audit import Rounding
from foldyn.errors import ComputationError, FoldynWarning

SUPPORTS = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]


def fold(thickness=0.01, density=1.0, size=1.0):
    pattern = fd.patterns.simple_fold(size, 1.2 * size, dihedral=60)
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, thickness, density), preset="plate")


def motion(structure, load, method="rk4", duration=0.3, initial=None, history=None):
    """A motion, and what was said of it."""
    force = fd.Force([0, 1], (-load, 0.0, 0.0), history or fd.HalfSine(0.2))
    case = fd.Case(structure, SUPPORTS, [force], fd.Rayleigh(0.5))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", FoldynWarning)
        found = fd.simulate(case, duration, method=method, interval=0.1 * duration, initial=initial)
    return found, [str(one.message) for one in told]


@pytest.mark.parametrize("load", [1e-3, 1e-9, 1e-12])
def test_nothing_is_said_of_motions_that_hinges_follow(load):
    found, said = motion(fold(), load)
    assert not said and found.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize(
    ("load", "density", "method", "most"),
    [
        (1e-15, 1.0, "rk4", 1e-12),
        (1e-30, 1.0, "rk4", 1e-12),
        (0.01, 1e45, "generalized_alpha", 1e-40),  # a body too heavy to move is not silently fine
    ],
)
def test_displacements_that_rounding_hides_from_the_hinges(load, density, method, most):
    """What they do is below rounding, which once counted as a balance that closes."""
    found, said = motion(fold(density=density), load, method)
    assert len(said) == 1 and said[0].startswith("nothing moves farther than")
    assert 0.0 < np.abs(found.displacement.values).max() < most


def rounding_of(size):
    case = fd.Case(fold(0.01 * size, 1.0, size), SUPPORTS)
    return Rounding(system.pack(case, 1.0).body)


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_it_does_not_depend_on_the_unit_of_length(size):
    one, other, still = rounding_of(1.0), rounding_of(size), np.zeros((1, 6))
    assert other.least_motion(0.01) / size == pytest.approx(one.least_motion(0.01), rel=1e-12)
    found = other.energy(still, 0.01 * size) / size**3
    assert found == pytest.approx(one.energy(still, 0.01), rel=1e-12)


@pytest.mark.parametrize("method", ["rk4", "dormand_prince"])
def test_an_equilibrium_that_rests_is_rounding_and_not_unstable(method):
    structure = fold()
    held = fd.Case(structure, SUPPORTS, [fd.Force([0, 1], (-1e-3, 0.0, 0.0))])
    start = fd.initial_state(fd.trace(held, steps=2))
    found, said = motion(structure, 1e-3, method, 0.3, start, fd.Constant())
    apart = np.abs(found.displacement - found.displacement[0]).max()
    assert float(apart) < 1e-6
    assert all("below the rounding errors" in one for one in said)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", FoldynWarning)
        many = fd.simulate_many([held, held], 0.3, method="rk4", initial=start)
    assert all("below the rounding errors" in str(one.message) for one in told)
    assert float(np.abs(many.displacement - many.displacement.isel(time=0)).max()) < 1e-6


def test_a_motion_that_explodes_from_next_to_nothing_is_still_stopped():
    case = fd.Case(fold(), SUPPORTS, [fd.Force([0, 1], (-1e-9, 0.0, 0.0))])
    dt = 1.5 * fd.critical_step(case)
    with pytest.raises(ComputationError):
        fd.simulate(case, 2000 * dt, method="rk4", dt=dt, force=True)


def swinging():
    """A fold that is let go, and the period of its slowest vibration (s)."""
    s = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.0, dihedral=60),
        fd.Sheet(1e6, 0.25, 0.01, 1.0),
        bend_law="linear",
    )
    case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")])
    spine = fd.backbone(case, amplitudes=(1e-3, 2e-3), harmonics=3)
    start = fd.State(spine.coefficient.values[-1].sum(axis=0).real)
    return case, 1.0 / float(spine.frequency[-1]), {"initial": start}


@pytest.mark.matrix
def test_samples_at_rest_instants_are_measured_by_the_motion_between_them():
    case, period, start = swinging()
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        for method in ("rk4", "generalized_alpha"):
            found = fd.simulate(case, 2.0 * period, method=method, interval=period, **start)
            assert found.kinetic.values.max() < 1e-4 * float(found.strain_folds[0])
            assert found.attrs["energy_error"] < 1e-3
        many = fd.simulate_many([case] * 2, 2.0 * period, interval=period, **start)
        assert many.attrs["energy_error"] < 1e-3


def test_of_many_motions_the_same_is_said_as_of_one():
    """Displacements of 1e-13 m, which rounding hides from the hinges."""
    case = fd.Case(fold(), SUPPORTS, damping=fd.Rayleigh(0.5))
    u = np.zeros((len(case.structure.nodes), 3))
    u[[2, 3], 2] = 1e-13
    with pytest.warns(FoldynWarning, match=r"^cases\[0\]: nothing moves far"):
        fd.simulate_many([case], 0.3, interval=0.03, initial=fd.State(u))
