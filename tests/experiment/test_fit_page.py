"""Figures and page of a fit show what was measured and what the model says."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import unescape

import fit_cases
import numpy as np
import pytest

import foldyn as fd
from foldyn.experiment import ForceDisplacement, Parameter, Shapes, Spectrum, TimeHistory
from foldyn.experiment.calibration.fit_figures import plot_correlation, plot_measured
from foldyn.experiment.calibration.fit_page import write_fit
from foldyn.experiment.calibration.fit_problem import problem

pytestmark = pytest.mark.filterwarnings(fit_cases.SAME_STEPS)

TIME = np.linspace(0.0, 2.0, 80)
MOVED = -np.linspace(0.05, 0.3, 6)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A fit of all kinds of measurements at once, with a parameter that none of them sees."""
    folder = tmp_path_factory.mktemp("fit")
    pressed = fit_cases.write(folder)
    swung = fit_cases.write(folder, fit_cases.SWUNG, "swung.toml")
    draw = np.random.default_rng(2)
    wave = np.tile(np.sin(TIME)[:, None], 2)
    blank = [
        ForceDisplacement(displacement=MOVED, force=np.zeros(6), sigma=1e-5, name="forces"),
        Shapes(nodes=[0, 1, 2, 3], load_factor=[0.5, 1.0], values=np.zeros((2, 4, 3)),
               sigma=1e-4, name="corners"),
        TimeHistory(nodes=[0, 2], time=TIME, values=wave, sigma=1e-5, name="sway", case=swung,
                detrend="constant"),
    ]  # fmt: skip
    parameters = [
        Parameter("sheet.length_scale_ratio", 1.2, 0.5, 3.0),
        Parameter("damping.alpha", 0.6, 0.0, 5.0),
        Parameter("model.fold_law.theta1", 45.0, 30.0, 55.0),
    ]
    true = problem(pressed, blank, parameters[:2], {}).predict([1.0, 0.4])
    data = []
    for one, said in zip(blank, true, strict=True):
        seen = said + one.sigma * draw.standard_normal(said.shape)
        if isinstance(one, ForceDisplacement):
            data.append(replace(one, force=seen))
        elif isinstance(one, Shapes):
            data.append(replace(one, values=seen.reshape(one.values.shape)))
        else:
            data.append(replace(one, values=seen.reshape(2, -1).T + 0.7))
    data.append(replace(Spectrum.of(data[2], (0.5, 5.0)), held_out=True, name="lines"))
    return fd.fit(pressed, data, parameters=parameters)


@pytest.mark.matrix
def test_the_page_says_what_was_found_and_what_was_not(fitted, tmp_path) -> None:
    assert not fitted["model.fold_law.theta1"].determined
    page = write_fit(fitted, tmp_path, "A fold", figures="png").read_text("utf-8")
    assert "<h1>A fold</h1>" in page
    assert "The data do not determine model.fold_law.theta1" in page
    assert "+1.00 model.fold_law.theta1" in page or "-1.00 model.fold_law.theta1" in page
    for text in ("sway: measured and model.", "lines: measured and model. Held out", "forces",
                 "corners", "the parameters move no more", "sheet.length_scale_ratio"):  # fmt: skip
        assert text in page
    drawn = sorted(path.name for path in tmp_path.glob("*.png"))
    assert drawn == ["correlation.png", *(f"data-{k}.png" for k in range(4))]
    assert page.count("data:image/png") == 5


@pytest.mark.matrix
def test_the_page_shows_the_model_and_charts(fitted, tmp_path) -> None:
    """Without figures: a path and a motion, with what was measured as dots beside them."""
    page = write_fit(fitted, tmp_path).read_text("utf-8")
    assert not list(tmp_path.glob("*.png"))
    assert page.count("data-foldyn=") == 2
    shown = re.findall(r'<script type="application/json" id="[^"]*about">(.*?)</script>', page)
    assert [json.loads(text)["node"] for text in shown] == [0, 0]  # pressed, and swung
    plots = [json.loads(unescape(text)) for text in re.findall(r'data-plot="(.*?)"', page)]
    assert [plot["title"] for plot in plots] == [
        "", "load factor 0.5", "load factor 1", "node 0", "node 2", "node 0", "node 2",
    ]  # fmt: skip
    model, seen = plots[0]["curves"]
    assert (model["dots"], seen["dots"]) == (False, True)
    at = [model["x"].index(x) for x in seen["x"]]
    np.testing.assert_allclose(np.take(model["y"], at), seen["y"], atol=5e-5)
    assert page.index("data-foldyn=") < page.index("Parameters") < page.index("How it was computed")


@pytest.mark.matrix
def test_histories_are_drawn_where_they_are_compared(fitted) -> None:
    """Without the mean, which is taken off both."""
    one = fitted.problem.measurements[2]
    run = fitted.problem.runs[1]
    values = [*fitted.values.values()]
    case = fitted.problem.case_file(run, values).case()
    figure = plot_measured(one, fitted.problem.result(run, values), case)
    for frame, measured in zip(figure.axes, one.values.T, strict=True):
        model, seen, misfit = (line.get_ydata() for line in frame.get_lines())
        np.testing.assert_allclose(seen, measured - measured.mean(), atol=1e-12)
        np.testing.assert_allclose(misfit, model - seen, atol=1e-15)
        assert np.abs(misfit).max() < 5e-5  # the noise
        assert np.mean(misfit) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.matrix
def test_shapes_are_drawn_as_positions(fitted) -> None:
    one = fitted.problem.measurements[1]
    run = fitted.problem.runs[0]
    values = [*fitted.values.values()]
    case = fitted.problem.case_file(run, values).case()
    figure = plot_measured(one, fitted.problem.result(run, values), case)
    assert [frame.get_title() for frame in figure.axes] == ["load factor 0.5", "load factor 1"]
    (seen,) = [line for line in figure.axes[1].get_lines() if line.get_label() == "measured"]
    drawn = {figure.axes[1].get_xlabel()[0]: seen.get_xdata()}
    drawn[figure.axes[1].get_ylabel()[:1] or figure.axes[0].get_ylabel()[0]] = seen.get_ydata()
    assert set(drawn) == {"y", "z"}  # along which the fold is longest
    rest = case.structure.nodes[:4]
    for axis, points in drawn.items():
        k = "xyz".index(axis)
        np.testing.assert_allclose(points, rest[:, k] + one.values[1, :, k])


def test_the_correlation_names_all_parameters(fitted) -> None:
    (frame,) = plot_correlation(fitted).axes
    names = [label.get_text() for label in frame.get_yticklabels()]
    assert names == ["length_scale_ratio", "alpha", "theta1"]
    assert [text.get_text() for text in frame.texts].count("?") == 4
