"""Laws with memory in a method that chooses its steps by their error."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import prepare
from foldyn.dynamics.checkpoint import restore, snapshot
from one_hinge import STIFFNESS, WING, moment, one_hinge, opened

LAWS = {
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear"),
    "plastic": fd.Plastic(2e-4, isotropic=1e-3, kinematic=2e-3, law="linear"),
    "eyring": fd.Eyring(2e-5, 1e-5, law="linear"),
}


def pushed(law):
    """The wing under a constant force, from rest: it swings, yields and creeps."""
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, 3e-4))], hold=False)


def controlled(case, tolerance, duration=2.0, **options):
    return fd.simulate(case, duration, "dormand_prince", tolerance=tolerance, **options)


@pytest.mark.parametrize("name", LAWS)
def test_motions_come_to_those_of_small_equal_steps(name):
    """As the tolerance goes down, with the balance of energy; states of branches too."""
    case = pushed(LAWS[name])
    for method, near in (("rk4", 1e-6), ("newmark", 2e-5)):
        fine = fd.simulate(case, 2.0, method, dt=2.0**-13, every=2**10)
        scale = np.abs(opened(fine)).max()
        for tolerance, error in ((1e-4, 2e-3), (1e-6, 4e-5), (1e-8, 1e-6)):
            found = controlled(case, tolerance, every=0.125)
            assert np.abs(opened(found) - opened(fine)).max() < (error + near) * scale
            assert np.abs(found.memory - fine.memory).max() < (error + near) * scale
            assert found.attrs["energy_error"] < error
            assert np.diff(found.dissipated).min() > -error * float(found.dissipated[-1])


@pytest.mark.filterwarnings("ignore:the motion is small")  # beside that of the support
def test_errors_of_memory_alone_are_seen():
    """A support turns the hinge, so that nothing else errs: steps follow the relaxation."""
    law, frequency = LAWS["prony"], 2.0
    swing = fd.Impose([WING], "z", 1e-2, fd.Harmonic(frequency))
    case = one_hinge(law, [swing], hold=False, mass=1e-13)
    found = controlled(case, 1e-4, 6.0, every=0.025)
    last = slice(-20, None)
    phase = np.exp(-2j * np.pi * frequency * found.time.values[last])
    ratio = (moment(found)[last] * phase).sum() / (opened(found)[last] * phase).sum()
    assert abs(ratio / STIFFNESS / law.modulus(frequency) - 1.0) < 1e-3
    assert found.attrs["largest_step"] < 0.05 / frequency


def test_steps_are_cut_where_a_crease_begins_to_yield_or_turns_back():
    law = LAWS["plastic"]
    found, elastic = (controlled(pushed(one), 1e-8, every=1) for one in (law, "linear"))
    assert found.attrs["refused_steps"] > elastic.attrs["refused_steps"] + 5
    begins = int(np.argmax(found.memory.values[:, 0, 1] > 0.0))
    turns = int(np.argmax(np.diff(opened(found)) < 0.0))
    steps = np.diff(found.time)
    for place in (begins, turns):
        assert steps[max(place - 3, 0) : place + 3].min() < 0.3 * np.median(steps)
    fine = fd.simulate(pushed(law), 2.0, "rk4", dt=2.0**-14)
    assert opened(found).max() == pytest.approx(opened(fine).max(), rel=1e-6)


@pytest.mark.parametrize("name", LAWS)
def test_refused_steps_leave_no_trace(name):
    """A step that is taken after others were refused has the bits of one that is taken at once."""
    motion = prepare(pushed(LAWS[name]), 2.0, "dormand_prince", tolerance=1e-7, every=10**6)
    motion.run()  # to where everything has flowed
    plan = motion.plan._replace(end=4.0, dt=1.0)
    engine = motion.method.engine(motion.case, motion.packed, motion.course, plan)
    tally, out = motion.course.tally, motion.output.window
    parts = engine._parts()
    tally.wanted, tally.shortest, before = 1.0, np.inf, tally.refused
    begun = snapshot(parts)
    assert engine.advance(out, 1)[0] == 0
    assert tally.refused > before
    ended, step = snapshot(parts), float(tally.shortest)
    restore(parts, begun)
    tally.wanted = step
    assert engine.advance(out, 1)[0] == 0
    assert tally.refused == before
    again = snapshot(parts)
    for part in ("u", "v", "carry"):
        np.testing.assert_array_equal(again[f"course.{part}"], ended[f"course.{part}"])
    for part in ("angle", "state", "rate", "lost"):
        np.testing.assert_array_equal(again[f"branches.{part}"], ended[f"branches.{part}"])


@pytest.mark.parametrize("law", [None, *LAWS])
def test_folds_and_bends_of_a_sheet(law):
    """Without a law its creases have dampers, in series with the panels."""
    pattern, sheet = (
        fd.patterns.miura((1, 1), 0.1, 0.1, dihedral=120),
        fd.Sheet(1e9, 0.3, 1e-3, 1000.0),
    )
    given = {
        None: None,
        "prony": fd.Prony(0.5, 0.01),
        "plastic": fd.Plastic(1e-3, 0.01),
        "eyring": fd.Eyring(0.01, 0.1),
    }[law]
    laws = {"fold_law": given, "bend_law": given} if given else {}
    structure = fd.discretize(pattern, sheet, **laws)
    damping = fd.Rayleigh() if given else fd.CreaseDamping(1e-3)
    case = fd.Case(structure, [fd.Fix([0, 1, 2], "xyz")], damping=damping)
    assert len(case.remembering)
    v = np.zeros(structure.nodes.shape)
    v[-1, 2] = 0.3
    start = fd.State(velocity=v)
    dt = 0.025 / 2**14
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fd.errors.FoldynWarning)
        fine = fd.simulate(case, 0.025, "rk4", dt=dt, every=2**14, initial=start)
    found = controlled(case, 1e-7, 0.025, every=0.025, initial=start)
    scale = np.abs(fine.displacement.values).max()
    assert np.abs(found.displacement - fine.displacement).max() < 1e-4 * scale
    assert float(found.dissipated[-1]) == pytest.approx(float(fine.dissipated[-1]), rel=1e-3)
    assert float(found.dissipated[-1]) > 0.0
    assert found.attrs["energy_error"] < 2e-4
