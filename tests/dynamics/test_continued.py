"""Implicit motions that go on from the end of another one: bit by bit, or as from any state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from one_hinge import WING, one_hinge

LAWS = {
    "linear": "linear",
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear"),
    "plastic": fd.Plastic(2e-4, isotropic=1e-3, kinematic=2e-3, law="linear"),
    "eyring": fd.Eyring(2e-5, 1e-5, law="linear"),
}
MIURA = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
VARIABLES = ("displacement", "velocity", "memory")
STEPS = {"dt": 0.003, "every": 50}  # s: times that are not exact


def pushed(law="linear", push=3e-4):
    """The wing under a constant force: it swings, yields and creeps."""
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, push))], hold=False)


def same(again, whole, first):
    """Hold a continued motion to the samples of the whole one from the first of them on."""
    assert again.attrs["started_from"] == "end of a motion"
    for name in VARIABLES:
        if name in whole:
            np.testing.assert_array_equal(again[name].values, whole[name].values[first:])


def continued(case, method, folder, duration, start=0.0, state=None, **steps):
    """Two motions of `duration`, the second from the stored end of the first; and both in one."""
    whole = fd.simulate(case, 2 * duration, method, initial=state, start=start, **steps)
    part = fd.simulate(case, duration, method, initial=state, start=start, **steps)
    fd.save(part, folder / "part.nc")
    stored = fd.initial_state(fd.load(folder / "part.nc"))
    end = start + duration
    again = fd.simulate(case, duration, method, initial=stored, start=end, **steps)
    same(again, whole, len(part.time) - 1)
    return part, again


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("method", ["newmark", "generalized_alpha", "energy_momentum"])
def test_laws_with_and_without_memory(law, method, tmp_path):
    continued(pushed(LAWS[law]), method, tmp_path, 0.6, **STEPS)


@pytest.mark.parametrize("law", ["linear", "prony"])
def test_steps_that_are_chosen_by_their_error(law, tmp_path):
    steps = {"tolerance": 1e-5, "dt": 0.05, "every": 0.125}
    part, _ = continued(pushed(LAWS[law]), "generalized_alpha", tmp_path, 0.5, **steps)
    assert part.attrs["smallest_step"] < 0.5 * part.attrs["largest_step"]


def driven(**options):
    """A sheet whose supports, loads and folds move: matrices are made anew, and kept in between."""
    structure = fd.discretize(MIURA, replace(SHEET, density=1.0), **options)
    supports = [
        fd.Fix([0, 1, 2], "x"),
        fd.Fix([0, 2, 6, 8], "z"),
        fd.Fix([1], "y"),
        fd.Impose([6, 8], "x", 0.1, fd.Harmonic(5.0)),
        fd.BaseMotion("z", fd.Harmonic(4.0), 1e-2),
    ]
    loads = [
        fd.Force([7], (1.0, 0.0, 0.0), fd.Harmonic(3.0)),
        fd.Actuate([0], 290.0, fd.Ramp(0.5)),
    ]
    return fd.Case(structure, supports, loads, fd.Rayleigh(0.1, 1e-3))


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance", "ignore:damping. beta resists")
@pytest.mark.parametrize("method", ["generalized_alpha", "energy_momentum"])
def test_supports_loads_and_folds_that_move(method, tmp_path):
    """With exact times, as histories depend on them; 2 minutes, compiling."""
    case = driven(preset="herkal", fold_law="linear", mass="consistent")
    part, again = continued(case, method, tmp_path, 0.25, dt=2.0**-9, every=64)
    assert 1 < again.attrs["factorizations"] < again.attrs["iterations"]
    assert "continued_from" in again and "continued_from" not in part


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["generalized_alpha", "energy_momentum"])
def test_rotations_of_a_shell(method, tmp_path):
    """They have no mass, and where they are is no part of a displacement; 2 minutes, compiling."""
    shell = fd.shell(fd.patterns.simple_fold(1.0, 1.0, dihedral=60), SHEET, 2)
    push = fd.Force([4], (0.0, 0.0, 1.0))
    law = fd.Case(shell, [fd.Fix([0, 1], "xyz")], [push], fd.Rayleigh(0.1, 1e-3))
    continued(law, method, tmp_path, 0.1, dt=1e-3, every=20)


def test_a_continued_motion_runs_again_from_itself(tmp_path):
    _, again = continued(pushed(), "generalized_alpha", tmp_path, 0.6, **STEPS)
    state = fd.initial_state(again, at=0)
    once_more = fd.simulate(pushed(), 0.6, "generalized_alpha", initial=state, start=0.6, **STEPS)
    np.testing.assert_array_equal(once_more.displacement, again.displacement)


@pytest.fixture(scope="module")
def end():
    """The state at the end of a motion."""
    return fd.initial_state(fd.simulate(pushed(), 0.6, "generalized_alpha", **STEPS))


CHANGES = {
    "velocity": (lambda state: replace(state, velocity=-state.velocity), pushed()),
    "displacement": (lambda state: replace(state, displacement=0.5 * state.displacement), pushed()),
    "load": (lambda state: state, pushed(push=0.0)),
    "mass": (lambda state: state, one_hinge("linear", loads=pushed().loads, mass=2e-3, hold=False)),
    "dofs": (lambda state: state, one_hinge(LAWS["prony"], loads=pushed().loads, hold=False)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_has_changed_starts_as_from_any_state(change, end):
    """Then what a method has carried on from before would be wrong."""
    changed, case = CHANGES[change]
    state = changed(end)
    one, other = (
        fd.simulate(case, 0.15, "generalized_alpha", initial=start, start=0.6, **STEPS)
        for start in (state, replace(state, continuation=None))
    )
    assert one.attrs["started_from"] == "state"
    np.testing.assert_array_equal(one.displacement, other.displacement)


def test_only_the_ends_of_a_motion_and_the_same_method_go_on(end):
    case = pushed()
    assert fd.simulate(case, 0.15, "newmark", initial=end, **STEPS).attrs["started_from"] == "state"
    motion = fd.simulate(case, 0.61, "generalized_alpha", **STEPS)  # ends beyond its last sample
    assert fd.initial_state(motion).continuation is None
    motion = fd.simulate(case, 0.6, "generalized_alpha", **STEPS)
    assert fd.initial_state(motion, at=1).continuation is None
    assert fd.initial_state(motion.isel(time=slice(0, 3))).continuation is None
    assert "continuation" not in fd.simulate(case, 0.15, "rk4", **STEPS)


def test_a_continuation_comes_from_a_result():
    with pytest.raises(InputError, match=r"continuation: got list; it comes from fd.initial_state"):
        fd.State(continuation=[1.0])
