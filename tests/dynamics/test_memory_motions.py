"""Laws with memory in motions: closed forms, energy, order, restarts, what cannot take them."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS as METHODS_BY_NAME
from foldyn.errors import InputError
from one_hinge import STIFFNESS, WING, moment, one_hinge, opened, turned

PRONY = fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear")
LAWS = {
    "prony": PRONY,
    "plastic": fd.Plastic(2e-4, isotropic=1e-3, kinematic=2e-3, law="linear"),
    "eyring": fd.Eyring(2e-5, 1e-5, law="linear"),
}
EXPLICIT = ["rk4", pytest.param("central_difference", marks=pytest.mark.matrix)]
METHODS = [*EXPLICIT, "generalized_alpha", "energy_momentum"]


def pushed(law):
    """The wing under a constant force, from rest: it swings, yields and creeps."""
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, 3e-4))], hold=False)


def equal(method, duration, steps):
    """Arguments for so many equal steps, of which the last is kept."""
    loose = {"tolerance": 1e9} if METHODS_BY_NAME[method].adaptive else {}
    return {"dt": duration / steps, "every": steps, **loose}


@pytest.mark.parametrize("method", [*METHODS, "dormand_prince"])
def test_relaxation_of_a_hinge_that_is_held(method):
    """The whole sheet at once in a new shape: any step is exact."""
    fresh = fd.State(turned(0.01), memory="fresh")
    found = fd.simulate(one_hinge(PRONY), 1.0, method, dt=0.01, initial=fresh)
    wanted = STIFFNESS * 0.01 * PRONY.relaxation(found.time.values)
    np.testing.assert_allclose(moment(found), wanted, rtol=1e-12)
    assert found.attrs["energy_error"] < 1e-12
    settled = fd.simulate(one_hinge(PRONY), 0.1, method, dt=0.01, initial=fd.State(turned(0.01)))
    np.testing.assert_allclose(moment(settled), STIFFNESS * 0.01, rtol=1e-12)
    assert float(settled.dissipated[-1]) == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_a_steady_sine_of_the_angle_sees_the_complex_modulus(method):
    """Of order 2: 1,600 steps in a period err by 5.3e-7."""
    frequency, errors = 2.0, []
    swing = fd.Impose([WING], "z", 1e-4, fd.Harmonic(frequency))
    case = one_hinge(PRONY, [swing], hold=False, mass=1e-13)
    for steps in (400, 1600):
        found = fd.simulate(case, 6.0, method, dt=1 / frequency / steps, every=steps // 20)
        last = slice(-20, None)
        phase = np.exp(-2j * np.pi * frequency * found.time.values[last])
        ratio = (moment(found)[last] * phase).sum() / (opened(found)[last] * phase).sum()
        errors.append(abs(ratio / STIFFNESS / PRONY.modulus(frequency) - 1.0))
    assert errors[1] < 1e-6
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.05)


def test_creep_under_a_constant_moment():
    """theta = M/k (1 - g/(1 + g) exp(-t / (1 + g) tau)): the standard linear solid, of order 2."""
    law, push, errors = fd.Prony(0.7, 0.3, law="linear"), 1e-5, []
    case = one_hinge(law, loads=[fd.Force([WING], (0, 0, push))], hold=False, mass=1e-14)
    start = fd.State(turned(push / STIFFNESS / 1.7), memory="fresh")
    for steps in (100, 400):
        found = fd.simulate(
            case, 1.0, "generalized_alpha", dt=1 / steps, initial=start, spectral_radius=0.0
        )
        wanted = push / STIFFNESS * (1 - 0.7 / 1.7 * np.exp(-found.time.values / (1.7 * 0.3)))
        errors.append(np.abs(opened(found) / wanted - 1.0).max())
    assert errors[1] < 1e-6


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", LAWS)
def test_the_energy_balance_closes(name, method):
    found = fd.simulate(pushed(LAWS[name]), 2.0, method, dt=2.0**-10, every=16)
    assert float(found.dissipated[-1]) > 0.2 * float(found.work.max())
    assert (np.diff(found.dissipated) >= 0.0).all()
    assert found.attrs["energy_error"] < 1e-5


@pytest.mark.parametrize("method", [*METHODS, "dormand_prince"])
@pytest.mark.parametrize(("name", "least"), [("prony", 1.9), ("eyring", 1.8)])
def test_motions_are_of_order_2(name, least, method):
    """Whatever the order of the method: angles between the ends of a step are on a line."""
    ends = [
        opened(fd.simulate(pushed(LAWS[name]), 2.0, method, **equal(method, 2.0, 2 << k)))[-1]
        for k in (7, 8, 9)
    ]
    assert np.log2(abs((ends[0] - ends[1]) / (ends[1] - ends[2]))) > least


@pytest.mark.parametrize("method", [*METHODS, "dormand_prince"])
def test_creases_that_go_on_yielding_keep_the_order_of_the_method(method):
    """Turns in one direction are followed exactly, whatever happens within a step."""
    v = np.zeros((5, 3))
    v[WING, 2] = 0.05  # m/s; after 0.2 s it has lost a part
    start, case, steps = (
        fd.State(turned(0.02), v),
        one_hinge(LAWS["plastic"], hold=False),
        (4, 8, 16),
    )
    motions = [
        fd.simulate(case, 0.2, method, initial=start, **equal(method, 0.2, n))
        for n in (*steps, 256)
    ]
    assert motions[-1].memory.values[-1, 0, 1] > motions[-1].memory.values[0, 0, 1] + 1e-3
    assert float(motions[-1].velocity.sel(node=WING, axis="z")[-1]) > 0.0  # it yields to the end
    ends = np.array([opened(motion)[-1] for motion in motions])
    errors = np.abs(ends[:-1] - ends[-1])
    assert (np.log2(errors[:-1] / errors[1:]) > METHODS_BY_NAME[method].order - 0.2).all()


@pytest.mark.parametrize("method", METHODS)
def test_creases_that_begin_and_cease_to_yield_are_of_order_2(method):
    """Wherever in a step they do: the mean square of the errors over eight such places.

    A single error is a matter of luck; all of them are below a constant times the square.
    """
    case = pushed(LAWS["plastic"])

    def end(n):
        return opened(fd.simulate(case, 2.0, method, dt=2.0 / n, every=n))[-1]

    true, first, last = end(2**16), 128, 1024
    coarse, fine = (
        np.array([end(n) - true for n in range(base, base + base // 4, base // 32)])
        for base in (first, last)
    )
    order = np.log2(np.sqrt((coarse**2).mean() / (fine**2).mean())) / np.log2(last / first)
    assert order == pytest.approx(2.0, abs=0.25)
    assert np.abs(fine).max() * last**2 < 3.0 * np.abs(coarse).max() * first**2


@pytest.mark.parametrize("method", EXPLICIT)
@pytest.mark.parametrize("name", LAWS)
def test_a_restart_is_the_same_motion_bit_by_bit(name, method, tmp_path):
    """Also from a file, and wherever the first part was computed in stretches."""
    case, steps = pushed(LAWS[name]), {"dt": 2.0**-9, "every": 64}
    whole = fd.simulate(case, 2.0, method, **steps)
    fd.save(whole, tmp_path / "whole.nc")
    stored = fd.initial_state(fd.load(tmp_path / "whole.nc"), 8)
    again = fd.simulate(case, 1.0, method, initial=stored, start=1.0, **steps)
    for variable in ("displacement", "velocity", "memory"):
        np.testing.assert_array_equal(again[variable].values, whole[variable].values[8:])


def test_a_restart_amid_a_motion_of_an_implicit_method_is_near():
    """At its ends it is exact (`test_continued`); between them memory is what matters."""
    case, steps = pushed(PRONY), {"dt": 2.0**-9, "every": 64}
    whole = fd.simulate(case, 2.0, "generalized_alpha", **steps)
    again = fd.simulate(
        case, 1.0, "generalized_alpha", initial=fd.initial_state(whole, 8), start=1.0, **steps
    )
    np.testing.assert_allclose(opened(again), opened(whole)[8:], rtol=0, atol=2e-8)
    forgotten = fd.State(whole.displacement[8].values, whole.velocity[8].values)
    other = fd.simulate(case, 1.0, "generalized_alpha", initial=forgotten, start=1.0, **steps)
    assert np.abs(opened(other) - opened(whole)[8:]).max() > 1e-4


def test_refused_steps_leave_no_trace():
    """Steps chosen by their error end near those of small equal ones."""
    case = pushed(PRONY)
    fine = fd.simulate(case, 2.0, "generalized_alpha", dt=2.0**-11, every=1.0)
    chosen = fd.simulate(case, 2.0, "generalized_alpha", tolerance=1e-6, every=1.0)
    assert chosen.attrs["refused_steps"] > 0
    assert opened(chosen)[-1] == pytest.approx(opened(fine)[-1], rel=1e-4)


@pytest.mark.parametrize("method", ["dormand_prince", "generalized_alpha"])
@pytest.mark.parametrize("name", LAWS)
def test_a_structure_that_has_moved_does_the_same_work(name, method):
    """Branches know nothing of their moments in other motions."""
    pattern, sheet = fd.patterns.simple_fold(1, 1, dihedral=120), fd.Sheet(1e6, 0.25, 0.01, 1.0)
    structure = fd.discretize(pattern, sheet, crease_stiffness=0.2, fold_law=LAWS[name])
    fix = fd.Fix([0, 1, 2, 3])
    pushed = fd.Case(structure, [fix], [fd.Force([4, 5], (0.0, 0.0, 0.01))])
    turned = fd.Case(structure, [fix], [fd.CreaseMoment("all", 0.02, fd.Ramp(0.4))])
    first = fd.simulate(turned, 0.2, method)
    fd.simulate(pushed, 0.2, method)
    again = fd.simulate(turned, 0.2, method)
    np.testing.assert_array_equal(again.work, first.work)


def test_a_law_without_branches_that_matter_is_its_elastic_part():
    weak = fd.simulate(pushed(fd.Prony(1e-12, 1.0, law="linear")), 1.0, "rk4", dt=2.0**-9)
    plain = fd.simulate(pushed("linear"), 1.0, "rk4", dt=2.0**-9)
    np.testing.assert_allclose(opened(weak), opened(plain), rtol=0, atol=1e-11)
    assert "memory" not in plain


def test_the_critical_step_counts_what_resists_at_once():
    light = [one_hinge(law, hold=False, mass=1e-9) for law in ("linear", PRONY)]
    plain, stiffer = (fd.critical_step(case) for case in light)
    assert plain / stiffer == pytest.approx(np.sqrt(1.7), rel=1e-3)


def test_states_of_other_cases_are_refused():
    state = fd.State(memory=np.zeros((3, 2)))
    with pytest.raises(InputError, match=r"memory of shape .*the case has \(2, 2\)"):
        fd.simulate(one_hinge(PRONY), 0.1, "rk4", initial=state)
    with pytest.raises(InputError, match='memory = "old": choose one of fresh'):
        fd.State(memory="old")


def test_creases_that_yield_cannot_be_actuated():
    pattern, sheet = fd.patterns.simple_fold(1, 1, dihedral=120), fd.Sheet(1e6, 0.3, 0.01, 1.0)
    for law in (fd.Plastic(1.0), fd.Prony(0.1, 0.1)):
        structure = fd.discretize(pattern, sheet, fold_law=law)
        ramp = fd.Actuate("all", 100.0, fd.Ramp(1.0))
        case = fd.Case(structure, [fd.Fix([0, 1, 2, 3], "xyz")], [ramp])
        if law.relaxes:
            fd.dynamics.prepare(case, 1.0)
        else:
            with pytest.raises(InputError, match="turns the rest angle of a hinge with the law"):
                fd.dynamics.prepare(case, 1.0)
