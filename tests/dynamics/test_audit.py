"""What the energy audit says where rounding is all that moves, and where it hides the hinges."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics.audit import Balance, Rounding
from foldyn.dynamics.diagnostics import INACCURATE, doubts, is_off
from foldyn.errors import ComputationError, FoldynWarning

SUPPORTS = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]


def fold(thickness=0.01, density=1.0, size=1.0):
    pattern = fd.patterns.simple_fold(size, 1.2 * size, 60)
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, thickness, density))


def motion(structure, load, method="rk4", duration=0.3, initial=None, history=None):
    """A motion, and what was said of it."""
    force = fd.Force([0, 1], (-load, 0.0, 0.0), history or fd.HalfSine(0.2))
    case = fd.Case(structure, SUPPORTS, [force], fd.Rayleigh(0.5))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", FoldynWarning)
        found = fd.simulate(case, duration, method, every=0.1 * duration, initial=initial)
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
    return Rounding(fd.dynamics.system.pack(case, 1.0).body)


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
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)  # of many, none is unbalanced
        many = fd.simulate_many([held, held], 0.3, method="rk4", initial=start)
    assert float(np.abs(many.displacement - many.displacement.isel(time=0)).max()) < 1e-6


def test_a_motion_that_explodes_from_next_to_nothing_is_still_stopped():
    case = fd.Case(fold(), SUPPORTS, [fd.Force([0, 1], (-1e-9, 0.0, 0.0))])
    dt = 1.5 * fd.critical_step(case)
    with pytest.raises(ComputationError):
        fd.simulate(case, 2000 * dt, "rk4", dt=dt, force=True)


def test_samples_at_instants_of_rest_do_not_accuse_the_step():
    """All are at the start of a swing, but for the error of the steps: 1e-5 of the energy."""
    rounding, still = rounding_of(1.0), np.full((3, 6, 3), 0.01)
    plan = fd.dynamics.prepare(fd.Case(fold(), SUPPORTS), 0.1).plan
    columns = np.zeros((3, 5))
    columns[:, 0] = 1.0, 1.0 - 5e-6, 1.0 - 1e-5  # J: strain; then bends, kinetic, ...
    said = []
    for kinetic in (1e-9, 0.5):  # seen at the last
        balance, seen = Balance(), columns.copy()
        seen[2, 2] = kinetic
        balance.add(seen, still)
        assert balance.relative > INACCURATE
        said.append(doubts(balance, rounding, plan, 0.0, "REMEDY"))
        assert is_off(balance, rounding) == rounding.reveals(balance) == (kinetic > 0.1)
    assert said[0].endswith("sample more often") and said[1].endswith(": REMEDY")
