"""Many models at once: equal to one after the other, whatever lanes take of them."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.lanes import WIDTH


def sheet(k: int = 0, cells=(1, 1), **options) -> fd.Case:
    """A cell, whose geometry, stiffness, mass, load and damping go by the number."""
    pattern = fd.patterns.miura(cells, panel_angle=60.0, dihedral=110.0 + 2 * k)
    material = fd.Sheet(1e6 * (1.0 + 0.1 * k), 0.25, 0.01, density=1.0 + 0.05 * k)
    laws = {"fold_law": fd.EnhancedLinear(60, 300), "bend_law": "superlinear"} | options
    laws = {"mass": "mixed_voronoi"} | laws
    s = fd.discretize(pattern, material, **laws)
    x = pattern.vertices[:, 0]
    held, far = np.flatnonzero(x <= 1e-9), np.flatnonzero(x >= x.max() - 1e-9)
    loads = [fd.Force(far, (0, 0, -2e-3 * (k + 1)), fd.HalfSine(0.02 + 0.002 * k))]
    if k % 2:
        loads.append(fd.Gravity((0, 0, -9.81)))
    return fd.Case(s, [fd.Fix(held)], loads, fd.Rayleigh(alpha=0.2 * k))


@pytest.fixture(scope="module")
def cases():
    return [sheet(k) for k in range(WIDTH + 3)]  # one vector is full, and one is not


@pytest.fixture(scope="module")
def many(cases):
    return fd.simulate_many(cases, 0.1, every=0.005)


@pytest.mark.parametrize("k", [0, 1, WIDTH - 1, WIDTH, WIDTH + 2])
def test_each_is_the_motion_of_the_model_alone(cases, many, k):
    """Within rounding, every variable, relative to its largest value."""
    alone = fd.simulate(cases[k], 0.1, "central_difference", dt=float(many.dt), every=0.005)
    np.testing.assert_allclose(many.time, alone.time, rtol=1e-14)
    names = [name for name in alone.data_vars if "time" in alone[name].dims]
    assert len(names) > 5
    for name in names:
        wanted, found = alone[name].values, many[name].sel(model=k).values
        assert found.shape == wanted.shape
        largest = np.abs(wanted).max()
        assert np.abs(found - wanted).max() <= 1e-11 * largest, name
    assert str(many.outcome[k].values) == "done"


def test_the_step_is_that_of_the_stiffest(cases, many):
    limits = [fd.critical_step(case, "central_difference") for case in cases]
    assert many.attrs["critical_step"] == pytest.approx(min(limits), rel=1e-12)
    assert many.attrs["dt"] <= 0.5 * min(limits) * (1 + 1e-12)
    assert many.attrs["energy_error"] < 1e-3


def test_threads_do_not_change_a_bit(cases, many):
    again = fd.simulate_many(cases, 0.1, every=0.005, threads=1)
    for name in ("displacement", "velocity", "reaction", "work"):
        np.testing.assert_array_equal(again[name], many[name])


@pytest.mark.parametrize("laws", [("linear", "linear"), ("enhanced", "enhanced")])
def test_other_laws_and_initial_states(laws):
    """Beyond where the folds lock, too."""
    own = [fd.EnhancedLinear(112, 248) if law == "enhanced" else law for law in laws]
    cases = [sheet(k, fold_law=own[0], bend_law=own[1], bar_law="linear") for k in range(3)]
    random = np.random.default_rng(0)
    free = ~cases[0].fixed
    states = [
        fd.State(*(scale * random.standard_normal(free.shape) * free for scale in (1e-4, 1e-2)))
        for _ in cases
    ]
    many = fd.simulate_many(cases, 0.004, dt=2e-5, every=10, initial=states)
    for k, (case, state) in enumerate(zip(cases, states, strict=True)):
        alone = fd.simulate(case, 0.004, "central_difference", dt=2e-5, every=10, initial=state)
        for name in ("displacement", "velocity", "kinetic", "strain_folds", "work"):
            wanted = alone[name].values
            error = np.abs(many[name].values[k] - wanted).max()
            assert error <= 1e-10 * np.abs(wanted).max(), name


def test_without_loads(cases):
    case = fd.Case(cases[0].structure, cases[0].supports)
    thrown = fd.State(velocity=1e-3 * ~case.fixed)
    many = fd.simulate_many([case], 0.01, every=10, initial=thrown, start=3.0)
    alone = fd.simulate(
        case, 0.01, "central_difference", dt=float(many.dt), every=10, initial=thrown, start=3.0
    )
    assert float(many.time[0]) == 3.0
    assert not many.work.any()
    error = np.abs(many.displacement[0] - alone.displacement).max()
    assert error <= 1e-11 * np.abs(alone.displacement).max()


def test_one_that_fails_does_not_stop_the_others():
    """It is nan from there on; the others are what they are without it."""
    cases = [sheet(0), sheet(1)]
    wild = np.zeros((len(cases[0].structure.nodes), 3))
    wild[~cases[0].fixed] = 1e3 * np.random.default_rng(1).standard_normal((~cases[0].fixed).sum())
    with pytest.warns(FoldynWarning, match=r"1 of 2 motions .* the first of cases\[1\]"):
        many = fd.simulate_many(cases, 0.02, every=10, initial=[None, fd.State(velocity=wild)])
    assert many.outcome.values[0] == "done"
    assert many.outcome.values[1] != "done"
    assert np.isnan(many.displacement.values[1, -1]).all()
    without = fd.simulate_many(cases[:1], 0.02, dt=float(many.dt), every=10)
    np.testing.assert_array_equal(without.displacement[0], many.displacement[0])


def test_what_lanes_do_not_take_is_computed_alone(cases):
    """Between cases that they take, of two kinds of laws; each with the bits of `simulate`."""
    s, (fix,) = cases[0].structure, cases[0].supports
    held = fd.Fix(np.flatnonzero(s.nodes[:, 0] <= s.nodes[:, 0].min() + 1e-9))
    gravity = [fd.Gravity("-z")]
    consistent = fd.discretize(s.pattern, s.sheet, mass="consistent")
    alone = [
        fd.Case(s, [fix], [fd.Actuate("all", 120.0, fd.Ramp(0.1))]),
        fd.Case(s, [fix, fd.BaseMotion("x", fd.Harmonic(2.0), 1e-3)], gravity),
        fd.Case(s, [fix], gravity, fd.Rayleigh(0.0, 1e-6)),
        fd.Case(s, [fix], [fd.Pressure(1e-3)]),
        fd.Case(consistent, [held], gravity),
    ]
    laws = [sheet(k, bend_law="linear") for k in range(2)]
    given = [cases[0], *alone, *laws, cases[1]]
    many = fd.simulate_many(given, 0.01, dt=2e-5, every=50)
    assert (many.outcome == "done").all()
    for k, case in enumerate(given):
        single = fd.simulate(case, 0.01, "central_difference", dt=2e-5, every=50)
        for name in ("displacement", "velocity", "reaction", "kinetic", "work"):
            wanted, found = single[name].values, many[name].values[k]
            rounding = 0.0 if case in alone else 1e-11
            assert np.abs(found - wanted).max() <= rounding * np.abs(wanted).max(), (k, name)


def test_contact_is_computed_alone(cases):
    touching = [case.altered(contact=fd.Contact()) for case in cases[:2]]
    many = fd.simulate_many(touching, 0.002, dt=2e-5, every=10)
    single = fd.simulate(touching[1], 0.002, "central_difference", dt=2e-5, every=10)
    np.testing.assert_array_equal(many["displacement"][1], single["displacement"])
    np.testing.assert_array_equal(many["contact"][1], single["contact"])


def test_what_does_not_fit_is_refused_by_name(cases):
    s, (fix,) = cases[0].structure, cases[0].supports
    for other, text in [
        (sheet(0, (2, 1)), "has other nodes than cases"),
        (fd.Case(s, [fd.Fix([0, 1])]), "has other supported dofs"),
        (fd.Case(s, [fix], contact=fd.Contact()), "has other energies"),
        (3, "got int, give a Case"),
    ]:
        with pytest.raises(InputError, match=rf"cases\[1\].*{text}"):
            fd.simulate_many([cases[0], other], 0.01)
    fast = fd.State(velocity=np.ones(s.nodes.shape))
    for given, text in [
        ({"cases": []}, "give a list of cases"),
        ({"dt": 6e-4}, r"^dt = 0.0006 s is above the critical step of .* s of cases\[10\]"),
        ({"every": 0}, "^every = 0: must be"),
        ({"initial": [None]}, "give one State, or a list of 11"),
        ({"initial": [None] * 10 + [fast]}, r"cases\[10\]: initial: velocity of node"),
        ({"threads": 0}, "threads"),
    ]:
        with pytest.raises(InputError, match=text):
            fd.simulate_many(**{"cases": cases, "duration": 0.1, **given})


def test_a_step_that_is_too_long_is_told(cases):
    shaken = 1e-4 * np.random.default_rng(0).standard_normal(cases[0].fixed.shape)
    state = fd.State(shaken * ~cases[0].fixed)
    with pytest.warns(FoldynWarning, match=r"the energy balance of cases\[\d+\] is off by"):
        fd.simulate_many(cases[:2], 0.02, every=10, initial=state)


def test_it_is_a_result(many, tmp_path):
    fd.save(many, tmp_path / "many.nc")
    again = fd.load(tmp_path / "many.nc")
    assert again.displacement.dims == ("model", "time", "node", "axis")
    np.testing.assert_array_equal(again.displacement, many.displacement)
    assert again.outcome.values.tolist() == ["done"] * (WIDTH + 3)
