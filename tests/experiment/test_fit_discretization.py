"""Intervals reach as far as the time step, or the mesh, has moved a value."""

from __future__ import annotations

import warnings
from dataclasses import replace

import fit_cases
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import foldyn as fd
from case_texts import HELD_FOLD_TEXT
from foldyn.errors import FoldynWarning
from foldyn.experiment import ForceDisplacement, NaturalFrequencies, Parameter, TimeHistory
from foldyn.experiment.calibration.fit_problem import problem

TIME = np.linspace(0.0, 2.0, 60)
NOISE = 3e-5
ALPHA = Parameter("damping.alpha", 1.0, 0.0, 10.0)


@pytest.fixture(scope="module")
def seen(swung):
    """What a camera with some noise sees of the motion of the true sheet, alpha = 0.4."""
    true = fd.simulate(fd.read_case(swung).case(), 2.0, method="newmark", dt=5e-4, interval=5e-4)
    along = CubicSpline(true.time.values, true.displacement.sel(node=[0, 2], axis="x").values)
    noise = NOISE * np.random.default_rng(1).standard_normal((60, 2))
    return TimeHistory(nodes=[0, 2], time=TIME, values=along(TIME) + noise, sigma=NOISE)


def refined(path, **changes):
    """The case with other steps."""
    text = path.read_text()
    for old, new in changes.items():
        text = text.replace(f"{old} = 0.02", new)
    return fit_cases.write(path.parent, text, "refined.toml")


@pytest.mark.matrix
def test_an_interval_reaches_the_truth_though_the_step_is_coarse(swung, seen) -> None:
    with pytest.warns(FoldynWarning, match=r"damping\.alpha: the time step is too coarse") as told:
        found = fd.fit(swung, [seen], parameters=[ALPHA])
    assert "set analysis.dt below 0.02 s" in str(told[0].message)
    alpha = found.estimates[0]
    half = alpha.value - alpha.lower
    assert alpha.value + half < 0.4 < alpha.upper  # noise alone would leave it out
    assert alpha.value + alpha.discretization == pytest.approx(0.4, abs=half)
    assert alpha.upper - alpha.value == pytest.approx(half + alpha.discretization)
    kept = found.dataset()
    assert float(kept["discretization"][0]) == alpha.discretization
    assert found.summary()["parameters"][0]["discretization"] == alpha.discretization


EGGBOX = """
[pattern]
kind = "eggbox"
cells = [2, 1]
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.3
thickness = 0.02
density = 3.0
[model]
crease_stiffness = 0.2
mass = "panel"
[[supports]]
nodes = "xmin"
[damping]
alpha = 0.25
[[loads]]
nodes = "xmax"
force = [0, 0, 0.0005]
[analysis]
kind = "dynamics"
method = "newmark"
duration = 20.64
[output]
interval = 0.129
"""


@pytest.mark.matrix
def test_steps_too_coarse_for_their_order_widen_the_interval_further(tmp_path) -> None:
    """27 steps a period: half of them tell too little, and the interval ended before the truth."""
    case_file = fd.read_case(fit_cases.write(tmp_path, EGGBOX))
    node = int(case_file.case().loaded_nodes[-1])
    true = case_file.run(dt=0.00215).displacement.sel(node=node, axis="z")
    noise = 1e-3 * float(abs(true).max())
    scatter = noise * np.random.default_rng(1).standard_normal(len(true))
    values = (true.values + scatter)[:, None]
    seen = TimeHistory(nodes=[node], axis="z", time=true.time.values, values=values, sigma=noise)
    stiffness = Parameter("model.crease_stiffness", 0.19, 0.05, 0.6)
    with pytest.warns(FoldynWarning, match=r"finer time step disagrees with that by .* miss"):
        found = fd.fit(
            case_file.path, [seen], parameters=[stiffness, Parameter("damping.alpha", 0.2)]
        )
    for one, truth in zip(found.estimates, (0.2, 0.25), strict=True):
        assert one.lower < truth < one.upper
    one = found.estimates[0]
    assert one.value + one.discretization - 2.0 * one.standard_error > 0.2  # without the doubt


@pytest.mark.matrix
def test_fine_steps_leave_the_interval_to_the_noise(swung, seen) -> None:
    fine = refined(swung, interval="interval = 0.004")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fd.fit(fine, [seen], parameters=[replace(ALPHA, guess=0.42)])
    alpha = found.estimates[0]
    assert abs(alpha.discretization) < 0.5 * alpha.standard_error
    assert alpha.lower < 0.4 < alpha.upper


@pytest.mark.parametrize(
    ("sampling", "step", "kept"),
    [
        ("interval = 0.02", 0.01, {"interval": 0.01}),
        ("interval = 0.04", 0.02, {"interval": 0.02}),
        ("every_steps = 2", 0.005, {"every_steps": 2}),
    ],
)
def test_step_and_sampling_are_halved(swung, seen, sampling, step, kept) -> None:
    path = refined(swung, interval=sampling)
    if sampling == "every_steps = 2":
        path.write_text(path.read_text().replace('"newmark"', '"newmark"\ndt = 0.01'))
    (finer,) = problem(path, [seen], [ALPHA], {}).finer([0.4])
    said = finer.problem.runs[0].document
    assert (finer.what, finer.order) == ("time step", 2)
    assert said["analysis"]["dt"] == pytest.approx(step)
    assert {key: said["output"].get(key) for key in kept} == pytest.approx(kept)


@pytest.mark.matrix
def test_an_interval_reaches_the_truth_though_the_mesh_is_coarse(tmp_path) -> None:
    """With elements of a quarter of an edge the third frequency is 8 % low."""
    text = HELD_FOLD_TEXT + '[model]\nkind = "shell"\ndivisions = 4\n'
    text += '[analysis]\nkind = "modes"\ncount = 4\n'
    coarse = fit_cases.write(tmp_path, text)
    fine = fit_cases.write(tmp_path, text.replace("divisions = 4", "divisions = 16"), "fine.toml")
    true = fd.read_case(fine).run()["frequency"].values[2]
    seen = [
        NaturalFrequencies(frequency=[true * (1.0 + noise)], mode=[3], sigma=0.005 * true)
        for noise in (-0.006, 0.003, 0.004, -0.002)
    ]
    modulus = Parameter("sheet.youngs_modulus", 1.2e6, 1e5, 1e7)
    with pytest.warns(
        FoldynWarning, match=r"mesh is too coarse.*A finer mesh disagrees.*divisions = 8"
    ):
        found = fd.fit(coarse, seen, parameters=[modulus])
    (one,) = found.estimates
    noise = one.upper - one.value
    assert one.lower < 1e6 < one.value - noise
    assert one.value + one.discretization == pytest.approx(1e6, rel=0.03)


def test_a_path_has_no_time_step(tmp_path) -> None:
    one = ForceDisplacement(displacement=[-0.1, -0.2], force=[0.0, 0.0])
    pressed = fit_cases.write(tmp_path)
    assert problem(pressed, [one], [Parameter("sheet.thickness")], {}).finer([0.01]) == []


@pytest.mark.matrix
def test_a_model_that_fails_with_finer_steps_is_told_of(swung, seen, monkeypatch) -> None:
    from foldyn.experiment.calibration import fit

    evaluate = fit.evaluate

    def failing(made, values):
        found = evaluate(made, values)
        coarse = "dt" not in made.runs[0].document["analysis"]
        return found if coarse else replace(found, values={}, failure="no equilibrium")

    monkeypatch.setattr(fit, "evaluate", failing)
    with pytest.warns(FoldynWarning, match=r"finer time step \(no equilibrium\): the intervals"):
        found = fd.fit(swung, [seen], parameters=[replace(ALPHA, guess=0.41)])
    alpha = found.estimates[0]
    assert np.isnan(alpha.discretization)
    assert alpha.lower < alpha.value < alpha.upper


@pytest.mark.matrix
def test_finer_evaluations_are_kept_too(swung, seen, tmp_path) -> None:
    course: list = []
    for _ in range(2):
        with pytest.warns(FoldynWarning, match="too coarse"):
            found = fd.fit(
                swung,
                [seen],
                parameters=[replace(ALPHA, guess=0.41)],
                folder=tmp_path,
                progress=course.append,
            )
    assert course[-1].computed == 0
    assert course[-1].found == found.evaluations


@pytest.mark.matrix
def test_trends_and_shifts_take_degrees_of_freedom(swung, seen) -> None:
    """The residual of noise has as many less as a record's mean, slope and start are free."""
    aligned = replace(seen, time=TIME[10:50], values=seen.values[10:50], align=0.01)
    lines = [replace(seen, detrend=name) for name in (None, "constant", "linear")]
    assert [one.absorbed for one in (*lines, aligned)] == [0, 2, 4, 1]
    noise = np.random.default_rng(0).standard_normal((500, 60, 2))
    for one in lines:
        left = [(replace(one, values=values).observed() ** 2).sum() for values in noise]
        assert np.mean(left) == pytest.approx(120 - one.absorbed, abs=3.0 * np.sqrt(240 / 500))
