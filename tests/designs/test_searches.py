"""Searches for designs: known optima, failures, counts, and going on after a stop."""

from __future__ import annotations

import json

import numpy as np
import pytest
from formulas import Formulas, best, plan

import foldyn as fd
from foldyn.designs.methods import METHODS
from foldyn.designs.run_design import designed
from foldyn.designs.search import NEAR, STILL, Ended, Search, Trial
from foldyn.errors import ComputationError, FoldynWarning, InputError

SQUARE = {"a": (-2.0, 2.0), "b": (-1.0, 2.0)}
AWAY = {"a": -1.2, "b": 1.0}
VALLEY = "(1 - a)**2 + 100 * (b - a**2)**2"
CIRCLE = VALLEY, ["a**2 + b**2 <= 1"], 0.0456748, (0.786415, 0.617698)
CORNER = "a + b", ["a**2 + b**2 == 1", "b >= -0.5"], -1.3660254, (-0.8660254, -0.5)


@pytest.fixture(params=METHODS)
def method(request):
    if METHODS[request.param].needs:
        pytest.importorskip(METHODS[request.param].needs)
    return request.param


@pytest.mark.parametrize(("text", "keep", "least", "where"), [CIRCLE, CORNER])
def test_known_optima_under_constraints_are_found(method, text, keep, least, where):
    found = best(SQUARE, text, keep, guess=AWAY, method=method)
    assert found.feasible
    assert found.objective == pytest.approx(least, abs=3e-4)
    assert [*found.parameters.values()] == pytest.approx(where, abs=2e-3)
    assert max(found.constraints.values()) <= 1e-4


def test_a_curved_valley_is_followed_to_its_end():
    for method in ("slsqp", "trust-constr"):
        found = best(SQUARE, VALLEY, guess=AWAY, method=method)
        assert [*found.parameters.values()] == pytest.approx([1.0, 1.0], abs=1e-3)
        assert found.ends[0].converged and found.evaluations < 100


def test_maximum_at_a_bound_and_arrays():
    bounds = {"a": ([0.0, -1.0, 0.0], [1.0, 2.0, 3.0])}
    found = best(bounds, maximize="a[0] + 2 * a[1] + 0.5 * a[2]")
    np.testing.assert_allclose(found["parameters"]["a"], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(found["gradient"]["a"], [1.0, 2.0, 0.5])
    assert found.history["parameter_a"].dims == ("evaluation", "a_entry")
    assert found["history"].attrs["sense"] == "max"


def test_each_design_is_evaluated_once_with_its_gradient():
    evaluator = Formulas()
    found = best(SQUARE, VALLEY, ["a**2 + b**2 <= 1"], guess=AWAY, evaluator=evaluator)
    assert all(gradient for _, gradient in evaluator.asked)
    assert len(set(evaluator.asked)) == len(evaluator.asked) == found.evaluations
    history = found.history
    assert history.sizes["evaluation"] == found.evaluations
    np.testing.assert_array_equal(
        history["parameter_a"], [point[0] for point, _ in evaluator.asked]
    )
    a, b = history["parameter_a"].values, history["parameter_b"].values
    np.testing.assert_allclose(history["constraints"].values[:, 0], a**2 + b**2 - 1.0)
    np.testing.assert_allclose(history["objective"], (1.0 - a) ** 2 + 100.0 * (b - a**2) ** 2)
    assert (np.diff(history["iteration"]) >= 0).all()
    k = int(history["best"])
    assert (a[k], b[k]) == tuple(found.parameters.values())


def test_a_method_without_gradients_asks_for_none():
    pytest.importorskip("cma")
    evaluator = Formulas()
    state = np.random.get_state()[1].tolist()
    found = best(SQUARE, VALLEY, method="cma", evaluator=evaluator, most=50)
    assert not any(gradient for _, gradient in evaluator.asked)
    assert found.gradient == {} and found.evaluations == 50
    assert "50 evaluations" in found.ends[0].message
    again = best(SQUARE, VALLEY, method="cma", most=50)
    np.testing.assert_array_equal(found.history["objective"], again.history["objective"])
    assert np.random.get_state()[1].tolist() == state


def test_all_starts_are_counted_and_the_best_is_returned():
    text = "a**4 - 4 * a**2 + a"  # a minimum on either side
    found = best({"a": (-2.0, 2.0)}, text, guess={"a": 1.0}, searches=5)
    assert [end.search for end in found.ends] == [0, 1, 2, 3, 4]
    assert sum(end.evaluations for end in found.ends) == found.evaluations
    assert found.ends[0].objective == pytest.approx(-2.6185, abs=1e-3)
    assert found.objective == pytest.approx(-5.4442, abs=1e-3)
    assert found.objective == min(end.objective for end in found.ends)
    assert np.unique(found.history["search"]).tolist() == [0, 1, 2, 3, 4]
    again = best({"a": (-2.0, 2.0)}, text, guess={"a": 1.0}, searches=5)
    assert again.history.drop_vars("seconds").equals(found.history.drop_vars("seconds"))


def test_designs_that_fail_shorten_the_step_and_are_noted(method):
    evaluator = Formulas(fails=lambda x: x[0] > 0.5)
    found = best(SQUARE, "(a - 0.45)**2 + (b - 1)**2", guess=AWAY, method=method,
                 evaluator=evaluator)  # fmt: skip
    assert found.objective == pytest.approx(0.0, abs=1e-3)
    failed = found.history["failure"].values == "no equilibrium"
    assert np.isnan(found.history["objective"].values[failed]).all()
    assert not found.history["feasible"].values[failed].any()
    assert (found.history["parameter_a"].values[failed] > 0.5).all()
    if method == "slsqp":
        assert 0 < failed.sum() < 20


def test_starts_are_drawn_again_where_they_fail():
    evaluator = Formulas(fails=lambda x: x[0] > 0.0)
    found = best({"a": (-1.0, 9.0)}, "(a + 0.5)**2", guess={"a": -0.9}, searches=3,
                 evaluator=evaluator)  # fmt: skip
    assert all(end.converged for end in found.ends)
    assert found.parameters["a"] == pytest.approx(-0.5, abs=1e-4)


def test_a_first_design_that_fails_is_an_error():
    with pytest.raises(ComputationError, match="no equilibrium"):
        best(SQUARE, VALLEY, evaluator=Formulas(fails=lambda x: True))


def test_a_search_that_stands_still_ends():
    search = object.__new__(Search)
    search.gradient, search._last, search._still = True, None, 0
    seen: list[float] = []

    def go_on() -> None:
        for k in range(99):
            trial = Trial(np.full(2, 0.5 + k * 0.1 * NEAR), *[0.0] * 5)  # type: ignore[arg-type]
            search._count_still(trial)
            search._last = trial
            seen.append(k)

    with pytest.raises(Ended, match="no longer changes"):
        go_on()
    assert len(seen) == STILL + 1
    search._still = 0
    for k in range(99):  # as long as it moves it goes on
        moving = Trial(np.full(2, 0.5 + k * 10.0 * NEAR), *[0.0] * 5)  # type: ignore[arg-type]
        search._count_still(moving)
        search._last = moving


@pytest.mark.parametrize("text", ["(a**2 - 1)**2 + b**2", "3 + 0 * (a + b)"])
def test_a_start_that_no_parameter_improves_is_no_optimum_found(method, text):
    """A saddle, and what depends on nothing: derivatives are 0 there."""
    if not METHODS[method].gradient:
        pytest.skip("draws its designs")
    start = {"a": 0.0, "b": 0.0}
    with pytest.warns(FoldynWarning, match=r"no parameter changes .* at the best design"):
        found = best({"a": (-2.0, 2.0), "b": (-2.0, 2.0)}, text, guess=start, method=method)
    assert found.parameters == start
    assert not found.ends[0].converged
    assert "stays at its guess, where no parameter changes" in found.ends[0].message


def test_a_start_that_is_the_optimum_is_said_to_be_the_start():
    found = best(SQUARE, "a + b", guess={"a": -2.0, "b": -1.0})
    assert found.ends[0].converged
    assert "stays at its guess, no design that was tried is better" in found.ends[0].message


def test_without_a_feasible_design_the_nearest_is_returned_with_a_warning():
    with pytest.warns(FoldynWarning, match=r"none of \d+ designs is feasible.*a \+ b == 5 by 1"):
        found = best(SQUARE, "a", ["a + b == 5", "a <= 100"])
    assert not found["feasible"]
    assert found.constraints == {"a + b == 5": pytest.approx(1.0), "a <= 100": 0.0}
    assert [*found.parameters.values()] == pytest.approx([2.0, 2.0])
    assert not found.history["feasible"].any()


def test_a_search_that_was_cut_off_goes_on(tmp_path):
    known = best(SQUARE, VALLEY, guess=AWAY, searches=2).history

    class Stop(Exception):
        pass

    def stop(course):
        if course.done == 17:
            raise Stop

    asked = Formulas()
    with pytest.raises(Stop):
        designed(plan(SQUARE, VALLEY, guess=AWAY, searches=2, evaluator=asked), tmp_path, stop)
    assert len(asked.asked) == 17
    courses, later = [], Formulas()
    found = designed(
        plan(SQUARE, VALLEY, guess=AWAY, searches=2, evaluator=later), tmp_path, courses.append
    )
    assert len(later.asked) == len(known["evaluation"]) - 17
    assert not set(later.asked) & set(asked.asked)
    assert found.history.drop_vars("seconds").equals(known.drop_vars("seconds"))
    assert courses[-1].found == 17 and courses[-1].done == found.evaluations
    other = Formulas(stamp="another program")
    designed(plan(SQUARE, VALLEY, guess=AWAY, evaluator=other), tmp_path)
    assert other.asked


def test_a_design_is_saved(tmp_path):
    found = best({"a": (0.0, 1.0), "b": ([0.0] * 2, 1.0)}, "a + b[0] + b[1]", ["a >= 0.5"])
    found.save(tmp_path / "design.nc")
    found.save(tmp_path / "history.csv")
    lines = (tmp_path / "history.csv").read_text().splitlines()
    assert len(lines) == 1 + found.evaluations
    assert "parameter_b[1]" in lines[0] and "a >= 0.5" in lines[0]
    found.save(tmp_path / "design.json")
    kept = json.loads((tmp_path / "design.json").read_text())
    assert kept["parameters"]["b"] == found.parameters["b"].tolist()
    assert kept["ends"][0]["converged"] is found.ends[0].converged
    with pytest.raises(InputError, match=r"written as \.json, \.nc or \.csv"):
        found.save(tmp_path / "design.txt")
    with pytest.raises(InputError, match=r"the folder .* does not exist"):
        found.save(tmp_path / "none" / "design.json")
    with pytest.raises(InputError, match="did you mean 'parameters'"):
        found["parameter"]
    assert "feasible=True" in repr(found) and "<table>" in found._repr_html_()


def build(thickness):
    pattern = fd.patterns.miura(cells=(1, 1), dihedral=100)
    sheet = fd.Sheet(1e6, 0.25, thickness, density=1000.0)
    return fd.Case(fd.discretize(pattern, sheet, preset="plate"), [fd.Fix("xmin")])


BOUNDS = {"thickness": (0.005, 0.02)}
MODES = {"kind": "modes", "count": 3}


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"minimize": None}, "minimize, maximize: give one of the two"),
        ({"maximize": "frequency[1]"}, "minimize, maximize: give one of the two"),
        ({"minimize": "3 + 4"}, "minimize.*has no measure"),
        ({"minimize": "frequency(1)"}, r"minimize = \"frequency\(1\)\": .*measures have brackets"),
        ({"minimize": "frequencies"}, "minimize: frequencies is an array; ask for one"),
        ({"minimize": "frequensy[1]"}, "no measure frequensy; did you mean 'frequency'"),
        ({"minimize": "limit_load"}, "limit_load needs a result of kind statics, not modes"),
        ({"subject_to": ["frequency[1]"]}, r"subject_to\[0\] = .*compares nothing"),
        ({"subject_to": ["mass = 3"]}, r"subject_to\[0\] = .*cannot be read; .*mass <= 0.1"),
        ({"subject_to": ["rigid_modes <= 0"]}, r"subject_to\[0\]: rigid_modes has no derivative"),
        ({"subject_to": 3}, "subject_to = 3"),
        ({"bounds": {}}, "bounds = .*: give each parameter its bounds"),
        ({"bounds": {"thickness": 0.1}}, "bounds.thickness = 0.1: must be a lower and an upper"),
        ({"bounds": {"thickness": (2, 1)}}, "bounds.thickness: from 2 to 1: the lower bound"),
        ({"bounds": {"thickness": ([0, 0], [1, 1, 1])}}, "lists of different lengths"),
        ({"bounds": {"thickness": ("a", 1)}}, r"bounds.thickness\[0\] = .*must be numbers"),
        ({"guess": {"thickness": 1.0}}, "guess.thickness = 1: must be within its bounds"),
        ({"guess": {"width": 1.0}}, "guess: width has no bounds"),
        ({"guess": 3}, "guess = 3: give a mapping"),
        ({"method": "newton"}, "method = .newton.: choose one of slsqp"),
        ({"searches": 0}, "searches = 0"),
        ({"seed": -1}, "seed = -1"),
        ({"tolerance": 0.0}, "tolerance = 0.0: must be greater than 0"),
        ({"slack": 2.0}, "slack = 2.0: must be less than 1"),
        ({"max_evaluations": 1.5}, "max_evaluations = 1.5"),
        ({"analysis": None}, "analysis = .*: say what is computed"),
        ({"analysis": {"kind": "mode"}}, "analysis.kind = .mode.: did you mean 'modes'"),
        ({"build": 7}, "build = 7: give a function or a case file"),
    ],
)
def test_bad_input_is_refused_before_anything_is_computed(changes, why):
    given = {"build": build, "bounds": BOUNDS, "minimize": "frequency[1]", "analysis": MODES}
    with pytest.raises(InputError, match=why):
        fd.design(**{**given, **changes})


@pytest.mark.matrix
def test_a_real_case_without_gradients():
    pytest.importorskip("cma")
    found = fd.design(
        build, BOUNDS, minimize="(frequency[1] - 5)**2", analysis=MODES, method="cma",
        max_evaluations=30,
    )  # fmt: skip
    case = build(**found.parameters)
    frequency = float(fd.modes(case, count=3)["frequency"][0])
    assert found.measures["frequency[1]"] == frequency
    assert found.objective == (frequency - 5.0) ** 2


@pytest.mark.matrix
def test_a_real_case_with_exact_gradients():
    wanted = float(fd.modes(build(0.013), count=3)["frequency"][0])
    found = fd.design(
        build, BOUNDS, minimize="mass", subject_to=[f"frequency[1] >= {wanted!r}"], analysis=MODES
    )
    assert found.parameters["thickness"] == pytest.approx(0.013, rel=1e-4)
    assert found.feasible and found.evaluations < 25
    with pytest.raises(InputError, match="there are 3 modes"):
        fd.design(build, BOUNDS, minimize="frequency[4]", analysis=MODES)
    with pytest.raises(InputError, match="unexpected keyword"):
        fd.design(build, {"width": (1.0, 2.0)}, minimize="frequency[1]", analysis=MODES)
