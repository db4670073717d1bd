"""Laws with memory in motions: closed forms, energy, order, restarts, what cannot take them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from measured import apart
from moving_sheets import CELL_HELD, HEAVY, IMPLICIT, cell, equal_steps, fold

import foldyn as fd
from foldyn.dynamics import METHODS as METHODS_BY_NAME
from foldyn.dynamics import prepare
from foldyn.dynamics.checkpoint import restore, snapshot
from foldyn.errors import InputError
from named_models import named
from one_hinge import STIFFNESS, WING, moment, one_hinge, opened, turned
from pairwise import beyond

PRONY = fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear")
LAWS = {
    "prony": PRONY,
    "plastic": fd.Plastic(2e-4, isotropic=1e-3, kinematic=2e-3, law="linear"),
    "eyring": fd.Eyring(2e-5, 1e-5, law="linear"),
}
DP, ALPHA = "dormand_prince", "generalized_alpha"
EXPLICIT = ["rk4", pytest.param("central_difference", marks=pytest.mark.matrix)]
METHODS = [*EXPLICIT, ALPHA, "energy_momentum"]


def pushed(law="linear", push=3e-4, **more):
    """The wing under a constant force, from rest: it swings, yields and creeps."""
    return one_hinge(law, loads=[fd.Force([WING], (0, 0, push))], hold=False, **more)


def controlled(case, tolerance, duration=2.0, **options):
    return fd.simulate(case, duration, method=DP, tolerance=tolerance, **options)


@pytest.mark.parametrize("method", [*METHODS, DP])
def test_relaxation_of_a_hinge_that_is_held(method):
    """The whole sheet at once in a new shape: any step is exact."""
    fresh = fd.State(turned(0.01), memory="fresh")
    found = fd.simulate(one_hinge(PRONY), 1.0, method=method, dt=0.01, initial=fresh)
    wanted = STIFFNESS * 0.01 * PRONY.relaxation(found.time.values)
    np.testing.assert_allclose(moment(found), wanted, rtol=1e-12)
    assert found.attrs["energy_error"] < 1e-12
    settled = fd.simulate(
        one_hinge(PRONY), 0.1, method=method, dt=0.01, initial=fd.State(turned(0.01))
    )
    np.testing.assert_allclose(moment(settled), STIFFNESS * 0.01, rtol=1e-12)
    assert float(settled.dissipated[-1]) == 0.0


def modulus_error(size, run) -> float:
    """Of the complex modulus that a steady sine of the angle sees, 2 Hz, in the last samples."""
    swing = fd.Impose([WING], "z", size, fd.Harmonic(2.0))
    found = run(one_hinge(PRONY, [swing], hold=False, mass=1e-13))
    phase = np.exp(-4j * np.pi * found.time.values[-20:])
    ratio = (moment(found)[-20:] * phase).sum() / (opened(found)[-20:] * phase).sum()
    return abs(ratio / STIFFNESS / PRONY.modulus(2.0) - 1.0)


@pytest.mark.parametrize("method", [*EXPLICIT, *beyond(METHODS[len(EXPLICIT) :])])
def test_a_steady_sine_of_the_angle_sees_the_complex_modulus(method):
    """Of order 2: 800 steps in a period err by 2.1e-6."""

    def error(n):
        options = {"dt": 0.5 / n, "every_steps": n // 20}
        return modulus_error(1e-4, lambda case: fd.simulate(case, 6.0, method=method, **options))

    coarse, fine = error(200), error(800)
    assert fine < 4e-6
    assert coarse / fine == pytest.approx(16.0, rel=0.05)


@pytest.mark.filterwarnings("ignore:the motion is small")  # beside that of the support
def test_errors_of_memory_alone_are_seen():
    """A support turns the hinge, so that nothing else errs: steps follow the relaxation."""
    found = []

    def run(case):
        found.append(controlled(case, 1e-4, 6.0, interval=0.025))
        return found[0]

    assert modulus_error(1e-2, run) < 1e-3
    assert found[0].attrs["largest_step"] < 0.05 / 2.0


def test_creep_under_a_constant_moment():
    """theta = M/k (1 - g/(1 + g) exp(-t / (1 + g) tau)): the standard linear solid."""
    law, push = fd.Prony(0.7, 0.3, law="linear"), 1e-5
    start = fd.State(turned(push / STIFFNESS / 1.7), memory="fresh")
    options = {"dt": 1 / 400, "initial": start, "spectral_radius": 0.0}
    found = fd.simulate(pushed(law, push, mass=1e-14), 1.0, method=ALPHA, **options)
    wanted = push / STIFFNESS * (1 - 0.7 / 1.7 * np.exp(-found.time.values / (1.7 * 0.3)))
    assert np.abs(opened(found) / wanted - 1.0).max() < 1e-6


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", LAWS)
def test_the_energy_balance_closes(name, method):
    found = fd.simulate(pushed(LAWS[name]), 2.0, method=method, dt=2.0**-10, every_steps=16)
    assert float(found.dissipated[-1]) > 0.2 * float(found.work.max())
    assert (np.diff(found.dissipated) >= 0.0).all()
    assert found.attrs["energy_error"] < 1e-5


def end(case, method, n, duration=2.0, **more) -> float:
    """Where the wing is after so many equal steps."""
    steps = {"dt": duration / n, "every_steps": n} | equal_steps(method)
    return opened(fd.simulate(case, duration, method=method, **steps, **more))[-1]


@pytest.mark.parametrize("method", [*METHODS, DP])
@pytest.mark.parametrize(("name", "least"), [("prony", 1.9), ("eyring", 1.8)])
def test_motions_are_of_order_2(name, least, method):
    """Whatever the order of the method: angles between the ends of a step are on a line."""
    ends = [end(pushed(LAWS[name]), method, n) for n in (256, 512, 1024)]
    assert np.log2(abs((ends[0] - ends[1]) / (ends[1] - ends[2]))) > least


@pytest.mark.parametrize("method", [*METHODS, DP])
def test_creases_that_go_on_yielding_keep_the_order_of_the_method(method):
    """Turns in one direction are followed exactly, whatever happens within a step."""
    v = np.zeros((5, 3))
    v[WING, 2] = 0.05  # m/s; after 0.2 s it has lost a part
    start, case = fd.State(turned(0.02), v), one_hinge(LAWS["plastic"], hold=False)
    whole = fd.simulate(case, 0.2, method="rk4", initial=start)
    assert whole.memory.values[-1, 0, 1] > whole.memory.values[0, 0, 1] + 1e-3
    assert float(whole.velocity.sel(node=WING, axis="z")[-1]) > 0.0  # it yields to the end
    ends = np.array([end(case, method, n, 0.2, initial=start) for n in (4, 8, 16, 256)])
    errors = np.abs(ends[:-1] - ends[-1])
    assert (np.log2(errors[:-1] / errors[1:]) > METHODS_BY_NAME[method].order - 0.2).all()


@pytest.mark.parametrize(
    "method", [*beyond(["rk4", "central_difference"], 1), *beyond(METHODS[len(EXPLICIT) :])]
)
def test_creases_that_begin_and_cease_to_yield_are_of_order_2(method):
    """Wherever in a step they do: the mean square of the errors over eight such places.

    A single error is a matter of luck; all of them are below a constant times the square.
    """
    case, first, last = pushed(LAWS["plastic"]), 128, 1024
    true = end(case, "rk4", 2**16)
    coarse, fine = (
        np.array([end(case, method, n) - true for n in range(b, b + b // 4, b // 32)])
        for b in (first, last)
    )
    order = np.log2(np.sqrt((coarse**2).mean() / (fine**2).mean())) / np.log2(last / first)
    assert order == pytest.approx(2.0, abs=0.25)
    assert np.abs(fine).max() * last**2 < 3.0 * np.abs(coarse).max() * first**2


# ------------------------------------------------------------------ steps chosen by their error
@pytest.mark.matrix
@pytest.mark.parametrize("name", LAWS)
def test_motions_come_to_those_of_small_equal_steps(name):
    """As the tolerance goes down, with the balance of energy; states of branches too."""
    case = pushed(LAWS[name])
    equal = [
        (near, fd.simulate(case, 2.0, method=method, dt=2.0**-k, every_steps=2 ** (k - 3)))
        for method, k, near in (("rk4", 13, 1e-6), ("newmark", 12, 8e-5))
    ]
    scale = np.abs(opened(equal[0][1])).max()
    for tolerance, error in ((1e-4, 2e-3), (1e-6, 4e-5), (1e-8, 1e-6)):
        found = controlled(case, tolerance, interval=0.125)
        for near, fine in equal:
            assert apart(opened(found), opened(fine)) < error + near
            assert np.abs(found.memory - fine.memory).max() < (error + near) * scale
        assert found.attrs["energy_error"] < error
        assert np.diff(found.dissipated).min() > -error * float(found.dissipated[-1])


def test_steps_are_cut_where_a_crease_begins_to_yield_or_turns_back():
    law = LAWS["plastic"]
    found, elastic = (controlled(pushed(one), 1e-8, every_steps=1) for one in (law, "linear"))
    assert found.attrs["refused_steps"] > elastic.attrs["refused_steps"] + 5
    begins = int(np.argmax(found.memory.values[:, 0, 1] > 0.0))
    turns = int(np.argmax(np.diff(opened(found)) < 0.0))
    steps = np.diff(found.time)
    for place in (begins, turns):
        assert steps[max(place - 3, 0) : place + 3].min() < 0.3 * np.median(steps)
    fine = fd.simulate(pushed(law), 2.0, method="rk4", dt=2.0**-14)
    assert opened(found).max() == pytest.approx(opened(fine).max(), rel=1e-6)


@pytest.mark.parametrize("name", LAWS)
def test_refused_steps_leave_no_trace(name):
    """A step that is taken after others were refused has the bits of one that is taken at once."""
    motion = prepare(pushed(LAWS[name]), 2.0, DP, tolerance=1e-7, every_steps=10**6)
    motion.run()  # to where everything has flowed
    plan = motion.plan._replace(end=4.0, dt=1.0)
    engine = motion.method.engine(motion.case, motion.packed, motion.state, plan)
    tally, out = motion.state.tally, motion.output.window
    parts = engine.changing()
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
    state = [f"state.{part}" for part in ("u", "v", "carry")]
    for part in (*state, *(f"branches.{part}" for part in ("angle", "state", "rate", "lost"))):
        np.testing.assert_array_equal(again[part], ended[part])


@pytest.mark.matrix
def test_refused_steps_of_an_implicit_method_leave_no_trace():
    """Steps chosen by their error end near those of small equal ones."""
    fine = fd.simulate(pushed(PRONY), 2.0, method=ALPHA, dt=2.0**-11, interval=1.0)
    chosen = fd.simulate(pushed(PRONY), 2.0, method=ALPHA, tolerance=1e-6, interval=1.0)
    assert chosen.attrs["refused_steps"] > 0
    assert opened(chosen)[-1] == pytest.approx(opened(fine)[-1], rel=1e-4)


@pytest.mark.matrix
@pytest.mark.parametrize(
    "law", [None, fd.Prony(0.5, 0.01), fd.Plastic(1e-3, 0.01), fd.Eyring(0.01, 0.1)]
)
def test_folds_and_bends_of_a_sheet(law):
    """Without a law its creases have dampers, in series with the panels."""
    pattern = fd.patterns.miura((1, 1), 0.1, b=0.1, dihedral=120)
    laws = {"fold_law": law, "bend_law": law} if law else {}
    structure = fd.discretize(pattern, fd.Sheet(1e9, 0.3, 1e-3, 1000.0), **named(laws))
    damping = fd.Rayleigh() if law else fd.CreaseDamping(1e-3)
    case = fd.Case(structure, [fd.Fix([0, 1, 2], "xyz")], damping=damping)
    assert len(case.remembering)
    v = np.zeros(structure.nodes.shape)
    v[-1, 2] = 0.3
    start = fd.State(velocity=v)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fd.errors.FoldynWarning)
        fine = fd.simulate(
            case, 0.025, method="rk4", dt=0.025 / 2**14, every_steps=2**14, initial=start
        )
    found = controlled(case, 1e-7, 0.025, interval=0.025, initial=start)
    assert apart(found, fine) < 1e-4
    assert float(found.dissipated[-1]) == pytest.approx(float(fine.dissipated[-1]), rel=1e-3)
    assert float(found.dissipated[-1]) > 0.0
    assert found.attrs["energy_error"] < 2e-4


# ------------------------------------------------------------------ motions that go on
STEPS = {"dt": 0.003, "every_steps": 50}  # s: times that are not exact
EXACT = {"dt": 2.0**-9, "every_steps": 64}


def assert_goes_on(again, whole, first):
    """Hold a continued motion to the samples of the whole one from the first of them on."""
    for name in {"displacement", "velocity", "memory"} & set(whole.data_vars):
        np.testing.assert_array_equal(again[name].values, whole[name].values[first:])


def continued(case, method, folder, duration, **steps):
    """Two motions of `duration`, the second from the stored end of the first; and both in one."""
    whole = fd.simulate(case, 2 * duration, method=method, **steps)
    part = fd.simulate(case, duration, method=method, **steps)
    fd.save(part, folder / "part.nc")
    stored = fd.initial_state(fd.load(folder / "part.nc"))
    again = fd.simulate(case, duration, method=method, initial=stored, start=duration, **steps)
    assert again.attrs["started_from"] == "end of a motion"
    assert_goes_on(again, whole, len(part.time) - 1)
    return part, again


@pytest.mark.matrix
@pytest.mark.parametrize("law", ["linear", *LAWS])
@pytest.mark.parametrize("method", IMPLICIT)
def test_implicit_motions_go_on_from_their_ends_bit_by_bit(law, method, tmp_path):
    continued(pushed(LAWS.get(law, law)), method, tmp_path, 0.6, **STEPS)


@pytest.mark.matrix
@pytest.mark.parametrize("law", ["linear", PRONY], ids=["linear", "prony"])
def test_they_go_on_with_steps_that_are_chosen_by_their_error(law, tmp_path):
    steps = {"tolerance": 1e-5, "dt": 0.05, "interval": 0.125}
    part, _ = continued(pushed(law), ALPHA, tmp_path, 0.5, **steps)
    assert part.attrs["smallest_step"] < 0.5 * part.attrs["largest_step"]


@pytest.mark.matrix
@pytest.mark.parametrize("method", EXPLICIT)
@pytest.mark.parametrize("name", LAWS)
def test_explicit_motions_go_on_from_anywhere_bit_by_bit(name, method, tmp_path):
    """Also from a file, and wherever the first part was computed in stretches."""
    case = pushed(LAWS[name])
    whole = fd.simulate(case, 2.0, method=method, **EXACT)
    fd.save(whole, tmp_path / "whole.nc")
    stored = fd.initial_state(fd.load(tmp_path / "whole.nc"), 8)
    assert_goes_on(
        fd.simulate(case, 1.0, method=method, initial=stored, start=1.0, **EXACT), whole, 8
    )


def test_an_implicit_motion_that_goes_on_from_amid_another_is_near():
    """At its ends it is exact; between them memory is what matters."""
    whole = fd.simulate(pushed(PRONY), 2.0, method=ALPHA, **EXACT)
    forgotten = fd.State(whole.displacement[8].values, whole.velocity[8].values)
    near, far = (
        np.abs(opened(again) - opened(whole)[8:]).max()
        for state in (fd.initial_state(whole, 8), forgotten)
        for again in [
            fd.simulate(pushed(PRONY), 1.0, method=ALPHA, initial=state, start=1.0, **EXACT)
        ]
    )
    assert near < 2e-8 and far > 1e-4


def driven() -> fd.Case:
    """A sheet whose supports, loads and folds move: matrices are made anew, and kept in between."""
    supports = [fd.Impose([6, 8], "x", 0.1, fd.Harmonic(5.0)),
                fd.BaseMotion("z", fd.Harmonic(4.0), 1e-2)]  # fmt: skip
    loads = [fd.Force([7], (1.0, 0, 0), fd.Harmonic(3.0)), fd.Actuate([0], 290.0, fd.Ramp(0.5))]
    structure = cell(fold_law="linear", mass="consistent")
    return fd.Case(structure, [*CELL_HELD, *supports], loads, fd.Rayleigh(0.1, 1e-3))


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance", "ignore:damping. beta resists")
@pytest.mark.parametrize("method", [ALPHA, "energy_momentum"])
def test_supports_loads_and_folds_that_move_go_on(method, tmp_path):
    """With exact times, as histories depend on them; 2 minutes, compiling."""
    part, again = continued(driven(), method, tmp_path, 0.25, dt=2.0**-9, every_steps=64)
    assert 1 < again.attrs["factorizations"] < again.attrs["iterations"]
    assert "continued_from" in again and "continued_from" not in part


@pytest.mark.matrix
@pytest.mark.parametrize("method", [ALPHA, "energy_momentum"])
def test_rotations_of_a_shell_go_on(method, tmp_path):
    """They have no mass, and where they are is no part of a displacement; 2 minutes, compiling."""
    shell, push = (
        fd.shell(fd.patterns.simple_fold(), HEAVY, divisions=2),
        fd.Force([4], (0.0, 0.0, 1.0)),
    )
    case = fd.Case(shell, [fd.Fix([0, 1], "xyz")], [push], fd.Rayleigh(0.1, 1e-3))
    continued(case, method, tmp_path, 0.1, dt=1e-3, every_steps=20)


@pytest.mark.matrix
def test_a_continued_motion_runs_again_from_itself(tmp_path):
    _, again = continued(pushed(), ALPHA, tmp_path, 0.6, **STEPS)
    state = fd.initial_state(again, at=0)
    once_more = fd.simulate(pushed(), 0.6, method=ALPHA, initial=state, start=0.6, **STEPS)
    np.testing.assert_array_equal(once_more.displacement, again.displacement)


@pytest.fixture(scope="module")
def whole():
    return fd.simulate(pushed(), 0.6, method=ALPHA, **STEPS)


CHANGES = {
    "velocity": (lambda state: replace(state, velocity=-state.velocity), pushed()),
    "displacement": (lambda state: replace(state, displacement=0.5 * state.displacement), pushed()),
    "load": (lambda state: state, pushed(push=0.0)),
    "mass": (lambda state: state, pushed(mass=2e-3)),
    "dofs": (lambda state: state, pushed(PRONY)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_has_changed_starts_as_from_any_state(change, whole):
    """Then what a method has carried on from before would be wrong."""
    changed, case = CHANGES[change]
    state = changed(fd.initial_state(whole))
    one, other = (
        fd.simulate(case, 0.15, method=ALPHA, initial=start, start=0.6, **STEPS)
        for start in (state, replace(state, continuation=None))
    )
    assert one.attrs["started_from"] == "state"
    np.testing.assert_array_equal(one.displacement, other.displacement)


def test_only_the_ends_of_a_motion_and_the_same_method_go_on(whole):
    end = fd.initial_state(whole)
    other = fd.simulate(pushed(), 0.15, method="newmark", initial=end, **STEPS)
    assert other.attrs["started_from"] == "state"
    beyond = fd.simulate(pushed(), 0.61, method=ALPHA, **STEPS)  # ends beyond its last sample
    states = [fd.initial_state(beyond), fd.initial_state(whole, at=1)]
    states.append(fd.initial_state(whole.isel(time=slice(0, 3))))
    assert [state.continuation for state in states] == [None] * 3
    assert "continuation" not in fd.simulate(pushed(), 0.15, method="rk4", **STEPS)


# ------------------------------------------------------------------ what laws are, and take
@pytest.mark.matrix
@pytest.mark.parametrize("method", [DP, ALPHA])
@pytest.mark.parametrize("name", LAWS)
def test_a_structure_that_has_moved_does_the_same_work(name, method):
    """Branches know nothing of their moments in other motions."""
    s = fold(120, preset="plate", crease_stiffness=0.2, fold_law=LAWS[name])
    loads = fd.Force([4, 5], (0.0, 0.0, 0.01)), fd.CreaseMoment("all", 0.02, fd.Ramp(0.4))
    other, case = (fd.Case(s, [fd.Fix([0, 1, 2, 3])], [load]) for load in loads)
    first, _, again = (fd.simulate(each, 0.2, method=method) for each in (case, other, case))
    np.testing.assert_array_equal(again.work, first.work)


def test_a_law_without_branches_that_matter_is_its_elastic_part():
    weak = fd.simulate(pushed(fd.Prony(1e-12, 1.0, law="linear")), 1.0, method="rk4", dt=2.0**-9)
    plain = fd.simulate(pushed("linear"), 1.0, method="rk4", dt=2.0**-9)
    np.testing.assert_allclose(opened(weak), opened(plain), rtol=0, atol=1e-11)
    assert "memory" not in plain


def test_the_critical_step_counts_what_resists_at_once():
    plain, stiffer = (
        fd.critical_step(one_hinge(law, hold=False, mass=1e-9)) for law in ("linear", PRONY)
    )
    assert plain / stiffer == pytest.approx(np.sqrt(1.7), rel=1e-3)


def test_states_of_other_cases_and_kinds_are_refused():
    state = fd.State(memory=np.zeros((3, 2)))
    with pytest.raises(InputError, match=r"memory of shape .*the case has \(2, 2\)"):
        fd.simulate(one_hinge(PRONY), 0.1, method="rk4", initial=state)
    with pytest.raises(InputError, match='memory = "old": choose one of fresh'):
        fd.State(memory="old")
    with pytest.raises(InputError, match=r"continuation: got list; it comes from fd.initial_state"):
        fd.State(continuation=[1.0])


def test_creases_that_yield_cannot_be_actuated():
    ramp = fd.Actuate("all", 100.0, fd.Ramp(1.0))
    relaxing, yielding = (
        fd.Case(fold(120, fold_law=law), [fd.Fix([0, 1, 2, 3], "xyz")], [ramp])
        for law in (fd.Prony(0.1, 0.1), fd.Plastic(1.0))
    )
    prepare(relaxing, 1.0, method="rk4")
    with pytest.raises(InputError, match="turns the rest angle of a hinge with the law"):
        prepare(yielding, 1.0, method="rk4")
