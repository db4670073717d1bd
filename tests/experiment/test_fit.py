"""Fits to data that a case of known parameters has made, memory of its creases included."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from fit_cases import PRESSED, SAME_STEPS, SWUNG, write

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from foldyn.experiment import ForceDisplacement, Parameter, Shapes, TimeHistory
from foldyn.experiment.calibration.fit_problem import problem

pytestmark = pytest.mark.filterwarnings(SAME_STEPS)

MOVED = -np.linspace(0.03, 0.3, 8)
TIME = np.linspace(0.0, 2.0, 60)
RATIO = Parameter("sheet.length_scale_ratio", 1.6, 0.2, 5.0)
ALPHA = Parameter("damping.alpha", 1.0, 0.0, 10.0)


def forces(path, noise=0.0, **known) -> ForceDisplacement:
    """Forces that the case file itself gives, with noise."""
    blank = ForceDisplacement(displacement=MOVED, force=np.zeros(8), **known)
    (true,) = problem(path, [blank], [RATIO], {}).predict([1.0])
    return replace(blank, force=true + noise * np.random.default_rng(4).standard_normal(8))


def histories(path, nodes, noise=0.0, **known) -> TimeHistory:
    """Histories that the case file itself gives, with noise."""
    wave = np.tile(np.sin(TIME)[:, None], len(nodes))
    blank = TimeHistory(nodes=nodes, time=TIME, values=wave)
    (true,) = problem(path, [blank], [ALPHA], {}).predict([0.4])
    true = true.reshape(len(nodes), -1).T
    values = true + noise * np.random.default_rng(4).standard_normal(true.shape)
    return TimeHistory(nodes=nodes, time=TIME, values=values, **known)


@pytest.mark.matrix
def test_exact_forces_give_the_parameters_exactly(pressed) -> None:
    theta = Parameter("model.fold_law.theta2", 280.0, 240.0, 299.0)
    found = fd.fit(pressed, [forces(pressed)], parameters=[RATIO, theta])
    assert found["sheet.length_scale_ratio"].value == pytest.approx(1.0, rel=1e-5)
    assert found["model.fold_law.theta2"].value == pytest.approx(290.0, rel=1e-5)
    assert found.descents[0].converged
    assert found.scores[0].relative < 1e-5


@pytest.mark.matrix
def test_a_tie_follows_its_parameter(pressed) -> None:
    ties = {"sheet.thickness": "0.01 * sheet.length_scale_ratio"}
    found = fd.fit(pressed, [forces(pressed, 1e-5)], parameters=[RATIO], ties=ties)
    document = found.document()
    ratio = found["sheet.length_scale_ratio"].value
    assert document["sheet"]["thickness"] == pytest.approx(0.01 * ratio, rel=1e-12)
    assert document["sheet"]["length_scale_ratio"] == ratio


@pytest.mark.matrix
def test_intervals_follow_the_noise(pressed) -> None:
    small = fd.fit(pressed, [forces(pressed, 1e-5, sigma=1e-5)], parameters=[RATIO])
    large = fd.fit(pressed, [forces(pressed, 1e-4, sigma=1e-4)], parameters=[RATIO])
    one, other = small.estimates[0], large.estimates[0]
    assert other.standard_error == pytest.approx(10.0 * one.standard_error, rel=0.05)
    assert one.lower < 1.0 < one.upper
    assert other.lower < 1.0 < other.upper
    assert 0.5 < small.misfit < 1.6


@pytest.mark.matrix
def test_what_the_data_cannot_tell_is_said(pressed) -> None:
    density = Parameter("sheet.density", 2.0)
    found = fd.fit(pressed, [forces(pressed, 1e-5)], parameters=[RATIO, density])
    assert found["sheet.length_scale_ratio"].determined
    assert not found["sheet.density"].determined
    assert found["sheet.density"].standard_error == np.inf
    assert found["sheet.density"].note == "the data do not determine it"


@pytest.mark.matrix
def test_parameters_of_which_only_quotients_count(swung) -> None:
    """Mass, stiffness and force times the same number make the same motion."""
    data = histories(swung, [0], 1e-6)
    three = [
        Parameter("sheet.density", 1.0, 0.2, 5.0),
        Parameter("sheet.youngs_modulus", 1e6, 2e5, 5e6),
        Parameter("loads[0].force[0]", -1e-3, -5e-3, -2e-4),
    ]
    found = fd.fit(swung, [data], parameters=[*three, ALPHA])
    assert [one.determined for one in found.estimates] == [False, False, False, True]
    assert found.singular_values[3] < 1e-5 * found.singular_values[0]
    scaled = np.abs(found.directions[3]) / [*found.values.values()] * [1.0, 1e6, -1e-3, 1.0]
    np.testing.assert_allclose(scaled / scaled[0], [1, 1, 1, 0], atol=1e-3)
    two = fd.fit(swung, [data], parameters=[*three[:2], ALPHA])
    assert all(one.determined for one in two.estimates)
    assert two["sheet.youngs_modulus"].value == pytest.approx(1e6, rel=0.01)


@pytest.mark.matrix
def test_a_parameter_at_its_bound_is_said_to_be_there(pressed) -> None:
    found = fd.fit(pressed, [forces(pressed)], parameters=[Parameter(RATIO.key, 2.0, 1.5, 5.0)])
    assert found.estimates[0].at_bound
    assert found.estimates[0].value == pytest.approx(1.5, rel=1e-3)
    assert "at its bound" in found.estimates[0].note


@pytest.mark.matrix
def test_damping_from_a_history_scored_on_held_out_nodes(swung) -> None:
    fitted = histories(swung, [0], 1e-5, sigma=1e-5, name="edge")
    kept = histories(swung, [2, 3], 1e-5, sigma=1e-5, name="ridge", held_out=True)
    found = fd.fit(swung, [fitted, kept], parameters=[ALPHA])
    alpha = found["damping.alpha"]
    assert alpha.value == pytest.approx(0.4, abs=4.0 * alpha.standard_error)
    assert alpha.standard_error < 0.02
    assert [score.held_out for score in found.scores] == [False, True]
    assert found.scores[1].rms == pytest.approx(1e-5, rel=0.3)
    assert found.freedom == len(TIME) - 1


@pytest.mark.matrix
def test_held_out_data_do_not_move_the_fit(swung) -> None:
    fitted = histories(swung, [0], 1e-5)
    wrong = TimeHistory(nodes=[2], time=TIME, values=np.sin(9.0 * TIME), held_out=True)
    alone, both = (fd.fit(swung, data, parameters=[ALPHA]) for data in ([fitted], [fitted, wrong]))
    assert both.values == alone.values
    assert both.scores[1].rms > 0.1


@pytest.mark.matrix
def test_a_case_of_statics_and_one_of_dynamics_together(pressed, swung) -> None:
    known = histories(swung, [0], 1e-5, sigma=1e-5, case=swung)
    found = fd.fit(pressed, [forces(pressed, 1e-5, sigma=1e-5), known], parameters=[RATIO, ALPHA])
    for one, truth in zip(found.estimates, (1.0, 0.4), strict=True):
        assert one.value == pytest.approx(truth, abs=4.0 * one.standard_error)
    assert len(found.problem.runs) == 2


@pytest.mark.matrix
def test_each_measurement_may_change_the_case(pressed) -> None:
    """Two specimens of one paper, the other with twice the thickness."""
    blank = ForceDisplacement(displacement=MOVED, force=np.zeros(8), sigma=1e-5)
    both = [blank, replace(blank, changes={"sheet.thickness": 0.02})]
    one, other = problem(pressed, both, [RATIO], {}).predict([1.0])
    assert np.abs(other / one).min() > 4.0
    data = [replace(each, force=f) for each, f in zip(both, (one, other), strict=True)]
    found = fd.fit(pressed, data, parameters=[RATIO])
    assert found.estimates[0].value == pytest.approx(1.0, rel=1e-5)


@pytest.mark.matrix
def test_shapes_under_a_force_give_a_stiffness(tmp_path) -> None:
    text = SWUNG.replace('history = { kind = "half_sine", duration = 0.5 }', "")
    text = text[: text.index("[analysis]")] + '[analysis]\nkind = "statics"\n'
    path = write(tmp_path, text)
    state = fd.trace(fd.read_case(path).case(), load_factors=[0.5, 1.0])
    seen = state.displacement.sel(node=[0, 2], axis=["x", "z"]).values
    one = Shapes(nodes=[0, 2], load_factor=[0.5, 1.0], values=seen, axes="xz")
    found = fd.fit(path, [one], parameters=[Parameter("sheet.youngs_modulus", 2e6, 1e5, 1e7)])
    assert found.estimates[0].value == pytest.approx(1e6, rel=1e-4)


@pytest.mark.matrix
def test_searches_from_several_starts_agree(pressed) -> None:
    found = fd.fit(pressed, [forces(pressed, 1e-5)], parameters=[RATIO], searches=4, seed=2)
    assert len(found.descents) == found.agreeing == 4
    assert len({one.guess for one in found.descents}) == 4
    assert min(one.cost for one in found.descents) == pytest.approx(
        0.5 * found.misfit**2 * found.freedom, rel=1e-6
    )


@pytest.mark.matrix
def test_a_fit_goes_on_where_it_was_cut_off(pressed, tmp_path) -> None:
    data = [forces(pressed, 1e-5)]
    seen: list[int] = []

    def stop(course) -> None:
        seen.append(course.computed)
        if course.computed == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fd.fit(pressed, data, parameters=[RATIO], folder=tmp_path, progress=stop)
    again: list[tuple[int, int]] = []
    found = fd.fit(
        pressed, data, parameters=[RATIO], folder=tmp_path,
        progress=lambda course: again.append((course.computed, course.found)),
    )  # fmt: skip
    assert again[2] == (0, 3)
    assert again[-1][0] > 0
    whole = fd.fit(pressed, data, parameters=[RATIO])
    assert found.values == whole.values
    third = fd.fit(pressed, data, parameters=[RATIO], folder=tmp_path)
    assert third.evaluations == found.evaluations


@pytest.mark.matrix
def test_damaged_evaluations_are_computed_again(pressed, tmp_path) -> None:
    data = [forces(pressed)]
    first = fd.fit(pressed, data, parameters=[RATIO], folder=tmp_path)
    for number, file in enumerate(sorted(tmp_path.glob("*.npz"))):
        sound = bytearray(file.read_bytes())
        if number % 4 == 0:
            sound[sound.index(b"NUMPY") + 130] ^= 1  # a number: the archive's checksum tells
        elif number % 4 == 1:
            sound[sound.index(b"PK\x01\x02") + 8] ^= 1  # "encrypted"
        elif number % 4 == 2:
            sound = sound[: len(sound) // 2]
        else:
            np.savez(file, values=np.array(["text"]), failure=np.array(""))
            continue
        file.write_bytes(sound)
    course = []
    again = fd.fit(pressed, data, parameters=[RATIO], folder=tmp_path, progress=course.append)
    assert again.values == first.values
    assert course[-1].found == 0


@pytest.mark.matrix
def test_kept_evaluations_of_another_model_are_not_used(pressed, tmp_path) -> None:
    data = [forces(pressed)]
    fd.fit(pressed, data, parameters=[RATIO], folder=tmp_path)
    thick = write(tmp_path, PRESSED.replace("thickness = 0.01", "thickness = 0.011"))
    found = fd.fit(thick, data, parameters=[RATIO], folder=tmp_path)
    assert found.values == fd.fit(thick, data, parameters=[RATIO]).values
    assert found.estimates[0].value > 1.01


@pytest.mark.matrix
def test_processes_change_nothing(pressed) -> None:
    data = [forces(pressed, 1e-5)]
    alone = fd.fit(pressed, data, parameters=[RATIO], searches=2)
    beside = fd.fit(pressed, data, parameters=[RATIO], searches=2, processes=2)
    assert beside.values == alone.values
    assert beside.descents == alone.descents


@pytest.mark.matrix
def test_a_search_steps_back_where_the_model_fails(pressed) -> None:
    """Beyond 180 degrees the law refuses theta1: the bounds let the search go there."""
    data = [forces(pressed, 1e-5)]
    theta = Parameter("model.fold_law.theta1", 170.0, 1.0, 400.0)
    found = fd.fit(pressed, data, parameters=[theta])
    assert np.isfinite(found.descents[0].cost)


def test_a_start_at_which_nothing_can_be_computed(pressed) -> None:
    with pytest.raises(InputError, match=r"model\.fold_law.*theta1"):
        fd.fit(pressed, [forces(pressed)], parameters=[Parameter("model.fold_law.theta1", 390.0)])


def test_a_model_that_fails_at_every_start(swung) -> None:
    """The load is so large that panel passes through panel."""
    bad = histories(swung, [0])
    with pytest.raises(ComputationError, match="no search converged: "):
        fd.fit(swung, [bad], parameters=[Parameter("loads[0].force[0]", 50.0, 40.0, 60.0)])


@pytest.mark.matrix
def test_results_as_files(pressed, tmp_path) -> None:
    found = fd.fit(
        pressed, [forces(pressed, 1e-5)], parameters=[RATIO, Parameter("sheet.density", 2.0)]
    )
    found.save(tmp_path / "fit.json")
    told = json.loads((tmp_path / "fit.json").read_text())
    assert told["parameters"][0]["value"] == found.estimates[0].value
    assert told["parameters"][1]["standard_error"] is None
    found.save(tmp_path / "fit.nc")
    with xr.open_dataset(tmp_path / "fit.nc", engine="h5netcdf") as kept:
        assert float(kept["value"].sel(parameter=RATIO.key)) == found.estimates[0].value
        np.testing.assert_array_equal(kept["predicted_0"], found.predicted[0])
    found.write_case(tmp_path / "fitted.toml")
    again = fd.read_case(tmp_path / "fitted.toml")
    assert again.sheet.length_scale_ratio == found.estimates[0].value
    with pytest.raises(InputError, match=r"written as \.json or \.nc"):
        found.save(tmp_path / "fit.csv")
    with pytest.raises(InputError, match="was not fitted"):
        found["sheet.thickness"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"searches": 0}, "searches = 0: must be a whole number, at least 1"),
        ({"processes": 1.5}, "processes = 1.5: must be a whole number"),
        ({"confidence": 95}, "confidence = 95: must be less than 1"),
    ],
)
def test_arguments_that_make_no_sense(pressed, changes, message) -> None:
    with pytest.raises(InputError, match=message):
        fd.fit(pressed, [forces(pressed)], parameters=[RATIO], **changes)


ELASTIC = 'fold_law = { kind = "enhanced", theta1 = 45, theta2 = 290 }'
PRONY = 'fold_law = { kind = "prony", ratios = [0.6], times = [0.15] }'
PLASTIC = 'fold_law = { kind = "plastic", yield_moment = 2e-3, kinematic = 0.01, law = "linear" }'


@pytest.mark.matrix
def test_a_relaxation_is_found_in_a_motion(tmp_path):
    """Ratio and time of a branch from the history of one node, exact and within its noise."""
    path = write(tmp_path, SWUNG.replace(ELASTIC, PRONY))
    time = np.arange(0.1, 2.0, 0.02)
    parameters = [
        Parameter("model.fold_law.ratios[0]", 0.3, 0.05, 3.0),
        Parameter("model.fold_law.times[0]", 0.3, 0.02, 2.0),
    ]
    blank = TimeHistory(nodes=[0], time=time, values=np.sin(time)[:, None])
    (exact,) = problem(path, [blank], parameters, {}).predict([0.6, 0.15])
    exact = exact.reshape(-1, 1)
    fit = fd.fit(path, [TimeHistory(nodes=[0], time=time, values=exact)], parameters=parameters)
    assert fit["model.fold_law.ratios[0]"].value == pytest.approx(0.6, rel=1e-3)
    assert fit["model.fold_law.times[0]"].value == pytest.approx(0.15, rel=1e-3)
    noise = 1e-2 * np.ptp(exact) * np.random.default_rng(1).standard_normal(exact.shape)
    fit = fd.fit(
        path, [TimeHistory(nodes=[0], time=time, values=exact + noise)], parameters=parameters
    )
    for one, truth in zip(fit.estimates, (0.6, 0.15), strict=True):
        assert one.value == pytest.approx(truth, abs=4.0 * one.standard_error)


def cyclic(path, displacement):
    """The test that the case itself gives."""
    case = fd.read_case(path).case()
    factors = displacement / -0.3
    way = fd.statics.trace(case, load_factors=factors.tolist())
    moved = np.isin(way.support_node, [0, 1]) & (way.support_axis == "x").values
    force = way.reaction.values[:, moved].sum(axis=1)
    return ForceDisplacement(displacement=displacement, force=force)


@pytest.mark.matrix
def test_a_cyclic_test_gives_yield_moment_and_hardening(tmp_path):
    path = write(tmp_path, PRESSED.replace(ELASTIC, PLASTIC))
    way = np.array([0.0, 0.1, 0.2, 0.3, 0.2, 0.1, 0.0, 0.1, 0.2, 0.3])
    test = cyclic(path, -way)
    assert abs(test.force[4] - test.force[2]) > 0.1 * np.ptp(test.force)
    fit = fd.fit(
        path, [test],
        parameters=[
            Parameter("model.fold_law.yield_moment", 4e-3, 1e-4, 2e-2),
            Parameter("model.fold_law.kinematic", 0.02, 1e-3, 0.2),
        ],
    )  # fmt: skip
    assert fit["model.fold_law.yield_moment"].value == pytest.approx(2e-3, rel=1e-3)
    assert fit["model.fold_law.kinematic"].value == pytest.approx(0.01, rel=1e-3)
    test, other = (replace(one, sigma=1e-6) for one in (test, cyclic(path, -way[:3])))
    with pytest.raises(ComputationError, match="creases that yield depend on the loading path"):
        fd.fit(
            path,
            [test, other],
            parameters=[Parameter("model.fold_law.yield_moment", 4e-3, 1e-4, 2e-2)],
        )
