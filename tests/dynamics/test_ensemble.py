"""Many models at once: equal to one after the other, whatever lanes take of them."""

from __future__ import annotations

import numpy as np
import pytest
from measured import agree

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.lanes import WIDTH
from named_models import named

STEPS = {"dt": 2e-5, "every_steps": 10}


def sheet(k: int = 0, cells=(1, 1), **options) -> fd.Case:
    """A cell, whose geometry, stiffness, mass, load and damping go by the number."""
    pattern = fd.patterns.miura(cells, panel_angle=60.0, dihedral=110.0 + 2 * k)
    material = fd.Sheet(1e6 * (1.0 + 0.1 * k), 0.25, 0.01, density=1.0 + 0.05 * k)
    laws = {"fold_law": fd.EnhancedLinear(60, 300), "bend_law": "superlinear"}
    s = fd.discretize(pattern, material, **named({"mass": "mixed_voronoi", **laws, **options}))
    x = pattern.vertices[:, 0]
    held, far = np.flatnonzero(x <= 1e-9), np.flatnonzero(x >= x.max() - 1e-9)
    loads = [fd.Force(far, (0, 0, -2e-3 * (k + 1)), fd.HalfSine(0.02 + 0.002 * k))]
    if k % 2:
        loads.append(fd.Gravity((0, 0, -9.81)))
    return fd.Case(s, [fd.Fix(held)], loads, fd.Rayleigh(alpha=0.2 * k))


CASES = [sheet(k) for k in range(WIDTH + 3)]  # one vector is full, and one is not
FIRST = CASES[0]


@pytest.fixture(scope="module")
def many():
    return fd.simulate_many(CASES, 0.1, interval=0.005)


def moved(case: fd.Case, size: float, seed: int = 0) -> np.ndarray:
    """Numbers at random for free dofs."""
    return size * np.random.default_rng(seed).standard_normal(case.fixed.shape) * ~case.fixed


def compare(many, k, case, duration, near, **options) -> None:
    """Hold one of many to the motion of it alone, each variable relative to its largest value."""
    alone = fd.simulate(case, duration, method="central_difference", **options)
    alone = alone.drop_vars("contact_force", errors="ignore")  # which motions alone tell
    np.testing.assert_allclose(many.time, alone.time, rtol=1e-14)
    assert len([name for name in alone.data_vars if "time" in alone[name].dims]) > 5
    agree(many.isel(model=k), alone, near)


@pytest.mark.parametrize("k", [0, 1, WIDTH - 1, WIDTH, WIDTH + 2])
def test_each_is_the_motion_of_the_model_alone(many, k):
    compare(many, k, CASES[k], 0.1, 1e-11, dt=float(many.dt), interval=0.005)
    assert str(many.outcome[k].values) == "done"


def test_the_step_is_that_of_the_stiffest(many):
    limits = [fd.critical_step(case, "central_difference") for case in CASES]
    assert many.attrs["critical_step"] == pytest.approx(min(limits), rel=1e-12)
    assert many.attrs["dt"] <= 0.5 * min(limits) * (1 + 1e-12)
    assert many.attrs["energy_error"] < 1e-3


def test_threads_do_not_change_a_bit(many):
    again = fd.simulate_many(CASES, 0.1, interval=0.005, threads=1)
    for name in ("displacement", "velocity", "reaction", "work"):
        np.testing.assert_array_equal(again[name], many[name])


@pytest.mark.parametrize("law", ["linear", fd.EnhancedLinear(112, 248)], ids=["linear", "enhanced"])
def test_other_laws_and_initial_states(law):
    """Beyond where the folds lock, too."""
    cases = [sheet(k, fold_law=law, bend_law=law, bar_law="linear") for k in range(3)]
    states = [fd.State(moved(cases[k], 1e-4, k), moved(cases[k], 1e-2, k + 9)) for k in range(3)]
    many = fd.simulate_many(cases, 0.004, initial=states, **STEPS)
    for k, case in enumerate(cases):
        compare(many, k, case, 0.004, 1e-10, initial=states[k], **STEPS)


@pytest.mark.parametrize("method", ["central_difference", "rk4"])
def test_starts_of_one_case_are_as_those_of_copies(method):
    starts = [fd.State(moved(FIRST, 1e-5 * k, k)) for k in range(3)]
    copies = [sheet(0) for _ in starts]
    shared, apart = (
        fd.simulate_many(cases, 0.01, initial=starts, method=method, **STEPS)
        for cases in ([FIRST] * 3, copies)
    )
    for name in ("displacement", "velocity", "reaction", "kinetic", "work"):
        np.testing.assert_array_equal(shared[name], apart[name])


def test_a_start_in_a_stiffer_state_limits_the_step():
    """Bars that are pulled far are stiffer than at rest: the shared step is too long for them."""
    limit = fd.critical_step(FIRST, "central_difference")
    far = fd.State(0.5 * FIRST.structure.nodes * ~FIRST.fixed)
    own = fd.critical_step(FIRST, "central_difference", state=far)
    assert own < 0.95 * limit
    dt = 0.5 * (own + limit)
    with pytest.raises(InputError, match=r"above the critical step of .* of cases\[1\]"):
        fd.simulate_many([FIRST] * 2, 10 * dt, dt=dt, initial=[None, far])


def test_without_loads():
    case = FIRST.altered(loads=[])
    given = {"every_steps": 10, "initial": fd.State(velocity=1e-3 * ~case.fixed), "start": 3.0}
    many = fd.simulate_many([case], 0.01, **given)
    assert float(many.time[0]) == 3.0
    assert not many.work.any()
    compare(many, 0, case, 0.01, 1e-11, dt=float(many.dt), **given)


def test_one_that_fails_does_not_stop_the_others():
    """It is nan from there on; the others are what they are without it."""
    wild = [None, fd.State(velocity=moved(CASES[1], 1e3, 1))]
    with pytest.warns(FoldynWarning, match=r"1 of 2 motions .*: cases\[1\], the first with: "):
        many = fd.simulate_many(CASES[:2], 0.02, every_steps=10, initial=wild)
    assert many.outcome.values[0] == "done" != many.outcome.values[1]
    assert np.isnan(many.displacement.values[1, -1]).all()
    without = fd.simulate_many(CASES[:1], 0.02, dt=float(many.dt), every_steps=10)
    np.testing.assert_array_equal(without.displacement[0], many.displacement[0])


@pytest.mark.matrix
def test_what_lanes_do_not_take_is_computed_alone():
    """Between cases that they take, of two kinds of laws; each with the bits of `simulate`."""
    s, (fix,) = FIRST.structure, FIRST.supports
    held = fd.Fix(np.flatnonzero(s.nodes[:, 0] <= s.nodes[:, 0].min() + 1e-9))
    gravity = [fd.Gravity("-z")]
    consistent = fd.discretize(s.pattern, s.sheet, mass="consistent", preset="plate")
    alone = [
        fd.Case(s, [fix], [fd.Actuate("all", 120.0, fd.Ramp(0.1))]),
        fd.Case(s, [fix, fd.BaseMotion("x", fd.Harmonic(2.0), 1e-3)], gravity),
        fd.Case(s, [fix], gravity, fd.Rayleigh(0.0, 1e-6)),
        fd.Case(s, [fix], [fd.Pressure(1e-3)]),
        fd.Case(consistent, [held], gravity),
    ]
    given = [FIRST, *alone, *(sheet(k, bend_law="linear") for k in range(2)), CASES[1]]
    many = fd.simulate_many(given, 0.01, dt=2e-5, every_steps=50)
    assert (many.outcome == "done").all()
    for k, case in enumerate(given):
        compare(many, k, case, 0.01, 0.0 if case in alone else 1e-11, dt=2e-5, every_steps=50)


def test_contact_is_computed_alone():
    touching = [case.altered(contact=fd.Contact()) for case in CASES[:2]]
    many = fd.simulate_many(touching, 0.002, **STEPS)
    assert "contact" in many
    compare(many, 1, touching[1], 0.002, 0.0, **STEPS)


FAST = fd.State(velocity=np.ones(FIRST.fixed.shape))


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"cases": [FIRST, sheet(0, (2, 1))]}, r"cases\[1\].*has other nodes than cases"),
        (
            {"cases": [FIRST, FIRST.altered(supports=[fd.Fix([0, 1])])]},
            r"cases\[1\].*has other supported dofs",
        ),
        (
            {"cases": [FIRST, FIRST.altered(contact=fd.Contact())]},
            r"cases\[1\].*has other energies",
        ),
        ({"cases": [FIRST, 3]}, r"cases\[1\].*got int, give a Case"),
        ({"cases": []}, "give a list of cases"),
        ({"dt": 6e-4}, r"^dt = 0.0006 s is above the critical step of .* s of cases\[10\]"),
        ({"every_steps": 0}, "^every_steps = 0: must be"),
        ({"initial": [None]}, "give one State, or a list of 11"),
        ({"initial": [None] * 10 + [FAST]}, r"cases\[10\]: initial: velocity of node"),
        ({"threads": 0}, "threads"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(given, text):
    with pytest.raises(InputError, match=text):
        fd.simulate_many(**{"cases": CASES, "duration": 0.1, **given})


def test_a_step_that_is_too_long_is_told():
    state = fd.State(moved(FIRST, 1e-4))
    with pytest.warns(FoldynWarning, match=r"\(the worst of cases\[0\], cases\[1\]\): the energy"):
        fd.simulate_many(CASES[:2], 0.02, every_steps=10, initial=state)


def test_it_is_a_result(many, tmp_path):
    fd.save(many, tmp_path / "many.nc")
    again = fd.load(tmp_path / "many.nc")
    assert again.displacement.dims == ("model", "time", "node", "axis")
    np.testing.assert_array_equal(again.displacement, many.displacement)
    assert again.outcome.values.tolist() == ["done"] * (WIDTH + 3)
