"""The specimen's parameters found again in data that they made."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.studies import find_case
from foldyn.studies.herkal.calibration import (
    DAMPING_RANGES,
    FOLD_RANGES,
    MIRRORED,
    WEIGHTS,
    released_case,
)
from verification.herkal import calibration

CASE = find_case("herkal/specimen")


@pytest.fixture(scope="module")
def static_data():
    return calibration.static_data()


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    return released_case(tmp_path_factory.mktemp("released"), step=0.002)


@pytest.fixture(scope="module")
def release_data(released):
    return calibration.release_data(released)


def test_the_weights_are_those_of_the_paper(static_data) -> None:
    np.testing.assert_allclose(static_data[0].force, WEIGHTS, rtol=1e-6)
    assert (np.diff(static_data[0].displacement) > 0.0).all()


@pytest.mark.matrix
def test_folds_from_forces_and_shapes(static_data) -> None:
    """The issue asks for 3 % and 2 degrees."""
    data = calibration.noisy(static_data, np.random.default_rng(7))
    found = fd.fit(CASE, data, parameters=FOLD_RANGES, ties=MIRRORED)
    ratio, theta = found.estimates
    assert ratio.value == pytest.approx(2.7, rel=0.03)
    assert theta.value == pytest.approx(75.0, abs=2.0)
    assert ratio.lower < 2.7 < ratio.upper
    assert theta.lower < 75.0 < theta.upper
    assert found.document()["model"]["fold_law"]["theta2"] == pytest.approx(360.0 - theta.value)
    assert found.misfit == pytest.approx(1.0, abs=0.15)
    assert abs(found.correlation[0, 1]) > 0.99  # a softer crease locks earlier: hard to tell apart


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:.*time step is too coarse")  # as coarse as the data's
@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")  # as the paper has it
def test_damping_from_node_8_alone(released, release_data) -> None:
    """The issue asks for 10 %; all other front nodes are held out, and follow."""
    data = calibration.noisy(release_data, np.random.default_rng(7))
    found = fd.fit(released, data, parameters=DAMPING_RANGES)
    for one, truth in zip(found.estimates, (14.4, 4.1e-4), strict=True):
        assert one.value == pytest.approx(truth, rel=0.1)
        assert one.value == pytest.approx(truth, abs=4.0 * one.standard_error)
    held = found.scores[1]
    assert held.held_out
    assert held.rms == pytest.approx(calibration.FILM_ERROR, rel=0.05)
    (filmed, _), (modeled, ratio) = (
        calibration.peak(one[round(calibration.TURNED * calibration.RATE) :])
        for one in (data[0].values[:, 0], found.predicted[0])
    )
    assert filmed == pytest.approx(modeled, rel=0.02)  # what noise does to the estimator
    assert modeled == pytest.approx(9.5, rel=0.05)  # the paper's film: 9.5 Hz and 16 %
    assert ratio == pytest.approx(0.16, abs=0.03)
