"""Derivatives of predictions by the parameters of a fit, found without whole runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fit_cases import PRESSED, SAME_STEPS, SWUNG, write

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, PLATE
from foldyn.dynamics.generalized_alpha import Alpha
from foldyn.errors import InputError
from foldyn.experiment import (
    DampingRatios,
    ForceDisplacement,
    FrequencyResponse,
    ModeShapes,
    NaturalFrequencies,
    Parameter,
    Shapes,
    TimeHistory,
)
from foldyn.experiment.calibration.fit_problem import Problem, problem

MIURA = HELD_MIURA_TEXT + "[damping]\nalpha = 0.4\nbeta = 0.01\n"
LOADED = '[[loads]]\nnodes = [8]\nforce = [0, 2e-4, -1e-3]\n[analysis]\nkind = "statics"\n'
MODES = '[analysis]\nkind = "modes"\ncount = 5\n'
FRF = '[[drive]]\nnodes = [8]\nforce = [0, 0, 1]\n[analysis]\nkind = "frf"\nfrequencies = [1]\n'
FREE = [3, 4, 5, 6, 7, 8]
SHAPES = [
    [[0.4, 0.3], [0.0, 0.0], [0.4, -0.3], [0.2, 1.0], [-0.1, 0.7], [0.3, 0.3]],
    [[0.3, 0.2], [0.0, 0.0], [-0.3, 0.2], [1.0, 0.1], [0.6, 0.0], [0.2, 0.1]],
]
LINES = np.linspace(0.2, 2.8, 5)
TIMES = np.linspace(0.0, 1.9, 20)
KEYS = {
    "pattern.panel_angle": 60.0, "sheet.youngs_modulus": 1e6, "sheet.thickness": 0.01,
    "sheet.length_scale_ratio": 1.0, "sheet.density": 1.0,
}  # fmt: skip


def seen(nodes, axes, rows):
    """Any values of nodes along axes."""
    return np.random.default_rng(5).uniform(0.5, 1.0, (rows, nodes, axes))


DATA = {
    "forces": (
        PRESSED, [ForceDisplacement(displacement=np.linspace(-0.2, -0.05, 6), force=np.zeros(6))],
        {"sheet.length_scale_ratio": 1.0, "model.fold_law.theta2": 275.0, "pattern.dihedral": 60.0,
         "supports[2].displacement": -0.3},
    ),
    "shapes": (
        MIURA + LOADED,
        [Shapes(nodes=FREE, load_factor=[0.5, 1.0], values=seen(6, 2, 2), axes="xz")],
        KEYS | {"loads[0].force[2]": -1e-3},
    ),
    "modes": (
        MIURA + PLATE + MODES,
        [NaturalFrequencies(frequency=[1.0, 2.0, 3.0, 4.0, 5.0], sigma=1.0),
         DampingRatios(damping_ratio=[0.1, 0.1, 0.1, 0.1, 0.1], sigma=1.0),
         ModeShapes(nodes=FREE, values=SHAPES, axes="xz", sigma=1.0)],
        KEYS | {"damping.alpha": 0.4, "damping.beta": 0.01},
    ),
    "responses": (
        MIURA.replace("alpha = 0.4", "alpha = 1.0") + PLATE + FRF,
        [FrequencyResponse(nodes=[6, 8], axis="z", frequency=LINES, values=np.ones((5, 2)) + 1j)],
        KEYS | {"damping.alpha": 1.0, "damping.beta": 0.01, "drive[0].force[1]": 0.3},
    ),
    "harmonic responses": (
        MIURA.replace("alpha = 0.4", "alpha = 1.0")
        + '[model]\npreset = "herkal"\n'
        + FRF.replace("force = [0, 0, 1]", "force = [0, 0, 1e-3]")
        + 'method = "harmonic"\ntolerance = 1e-9\n',
        [FrequencyResponse(nodes=[6, 8], axis="z", frequency=LINES, values=np.ones((5, 2)) + 1j)],
        KEYS | {"damping.alpha": 1.0, "damping.beta": 0.01, "drive[0].force[2]": 1e-3},
    ),
    "motions": (
        SWUNG.replace("alpha = 0.4", "alpha = 0.4\nbeta = 0.01").replace(
            '"herkal"', '"herkal"\nbend_law = "linear"'  # without infinite curvature
        ),
        [TimeHistory(nodes=[0, 2], time=TIMES, values=np.stack([TIMES, TIMES], 1), sigma=1.0)],
        {"sheet.length_scale_ratio": 1.0, "sheet.density": 1.0, "pattern.dihedral": 60.0,
         "damping.alpha": 0.4, "damping.beta": 0.01, "loads[0].force[0]": -1e-3},
    ),
}  # fmt: skip

# solutions differ by rounding, and by the tolerance of their iteration, over the neighbor's change
EXACT = {"modes": 3e-6, "motions": 2e-5, "harmonic responses": 1e-5}


def difference(made, values, k, step):
    """Difference of the fourth order of whole predictions."""
    total = 0.0
    for side, share in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
        point = values.copy()
        point[k] += side * step
        total = total + share * np.concatenate(made.predict(point)) / (12.0 * step)
    return total


@pytest.mark.matrix
@pytest.mark.parametrize("kind", DATA)
def test_derivatives_are_those_of_whole_predictions(tmp_path, kind, monkeypatch) -> None:
    monkeypatch.setattr(Alpha, "tolerance", 1e-14)  # whole motions, to the rounding of differences
    text, data, starts = DATA[kind]
    path = write(tmp_path, text)
    draw = np.random.default_rng(8)
    parameters = [Parameter(key, value) for key, value in starts.items()]
    made = problem(path, data, parameters, {})
    values = np.array([*starts.values()]) * draw.uniform(0.97, 1.03, len(starts))
    predicted, slopes = map(np.concatenate, made.differentiate(values))
    exact = EXACT.get(kind, 1e-6)
    np.testing.assert_array_equal(predicted, np.concatenate(made.predict(values)))
    for k, (one, scale) in enumerate(zip(parameters, made.space.column("scale"), strict=True)):
        expected = scale * difference(made, values, k, 1e-3 * scale)
        least = 1e-2 * np.abs(predicted).max()  # of a parameter that changes nothing
        np.testing.assert_allclose(
            scale * slopes[:, k], expected, 0.0, exact * max(np.abs(expected).max(), least),
            err_msg=one.key,
        )  # fmt: skip


def test_derivatives_within_the_bounds(tmp_path) -> None:
    """At a bound they are one-sided, of the second order."""
    text, data, _ = DATA["modes"]
    path, key = write(tmp_path, text), "sheet.length_scale_ratio"
    free, lower, upper = (
        np.concatenate(
            problem(path, data, [Parameter(key, 1.0, *bounds)], {}).differentiate(np.ones(1))[1]
        )
        for bounds in ((-np.inf, np.inf), (1.0, 2.0), (0.5, 1.0))
    )
    for one in (lower, upper):
        assert (one != free).any()
        np.testing.assert_allclose(one, free, 0.0, 1e-5 * np.abs(free).max())


@pytest.mark.matrix
@pytest.mark.filterwarnings(SAME_STEPS)
def test_what_has_no_neighbors_is_run_again(tmp_path) -> None:
    """As explicit motions are; what is held out needs no derivative at all."""
    explicit = SWUNG.replace('"newmark"', '"rk4"').replace("duration = 2.0", "duration = 0.6")
    pressed, swung = write(tmp_path), write(tmp_path, explicit, "swung.toml")
    ratio = Parameter("sheet.length_scale_ratio", 1.0)
    forces = ForceDisplacement(displacement=[-0.1, -0.2], force=[1e-3, 2e-3], sigma=1e-4)
    times = TIMES[TIMES < 0.6]
    history = TimeHistory(
        nodes=[0], time=times, values=1e-3 * np.sin(times), sigma=1e-3, case=swung, name="swing"
    )
    made = problem(pressed, [forces, history], [ratio], {})
    of_forces, of_history = made.differentiate(np.array([1.0]))[1]
    assert np.isfinite(of_forces).all()
    assert np.isnan(of_history).all()
    exact_forces, exact_history = made.predict(np.array([1.0]))  # where a search ends at once
    forces, history = replace(forces, force=exact_forces), replace(history, values=exact_history)
    found = fd.fit(pressed, [forces, history], parameters=[ratio])
    assert found.quotients == ("swing",)
    aside = replace(history, held_out=True)
    assert fd.fit(pressed, [forces, aside], parameters=[ratio]).quotients == ()


@pytest.mark.matrix
def test_optimum_and_intervals_are_those_of_difference_quotients(tmp_path, monkeypatch) -> None:
    text, data, _ = DATA["shapes"]
    path = write(tmp_path, text)
    keys = [Parameter("sheet.youngs_modulus", 1.2e6), Parameter("pattern.panel_angle", 61.0)]
    (true,) = problem(path, data, keys, {}).predict([1e6, 60.0])
    noise = 1e-4 * np.random.default_rng(2).standard_normal(len(true))
    data = [replace(data[0], values=(true + noise).reshape(data[0].values.shape), sigma=1e-4)]
    near = fd.fit(path, data, parameters=keys)
    monkeypatch.setattr(Problem, "_beside", refuse)
    whole = fd.fit(path, data, parameters=keys)
    assert near.quotients == ()
    assert whole.quotients == ("shapes",)
    assert near.evaluations < 0.6 * whole.evaluations
    for one, other in zip(near.estimates, whole.estimates, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-3 * other.standard_error)
        assert one.standard_error == pytest.approx(
            other.standard_error, rel=1e-3
        )  # of quotients over a thousandth


def refuse(*_):
    raise InputError("no neighbors")
