"""Decaying exponentials: exact for known poles, scattered as little as noise allows."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import SPECIMEN, cramer_rao, free_vibration, response

from foldyn.errors import InputError
from foldyn.signals import matrix_pencil

DT = 1 / 240
# frequency (Hz), damping ratio, amplitude, phase
PARTS = np.array([(3.8, 0.02, 0.2, 1.0), (9.5, 0.0255, 1.0, 0.3), (16.7, 0.05, 0.3, -0.5)])


def record(n, parts=PARTS):
    return free_vibration(np.arange(n) * DT, *parts)


@pytest.mark.parametrize("n", [60, 240, 900])
def test_known_poles(n):
    modes = matrix_pencil(record(n), DT)
    assert modes.order == 6
    found = modes.natural_frequency, modes.damping_ratio, modes.amplitude, modes.phase
    np.testing.assert_allclose(found, PARTS.T, rtol=1e-10)
    damped = PARTS[:, 0] * np.sqrt(1 - PARTS[:, 1] ** 2)
    np.testing.assert_allclose(modes.damped_frequency, damped, rtol=1e-11)
    assert modes.rest < 1e-9
    np.testing.assert_allclose(modes.at(np.arange(n) * DT), record(n), atol=1e-8)


def test_the_specimens_damping():
    """5, 13.5 and 9 %: free vibration after a pulse of two samples, computed exactly."""
    force = np.zeros(500)
    force[1:3] = 1.0
    x = response(force, DT, *SPECIMEN)[3:]
    modes = matrix_pencil(x, DT)
    wanted = np.array([(mode.frequency, mode.damping) for mode in SPECIMEN]).T
    np.testing.assert_allclose((modes.natural_frequency, modes.damping_ratio), wanted, rtol=1e-8)


def test_channels_share_their_poles():
    n = 200
    shape = np.array([[1.0, -0.5, 0.0], [0.3, 2.0, 1.0]])
    parts = [record(n, [part]) for part in PARTS[:2]]
    x = np.einsum("kt,kc->tc", parts, shape).reshape(n, 3, 1)
    modes = matrix_pencil(x, DT)
    np.testing.assert_allclose(modes.natural_frequency, [3.8, 9.5], rtol=1e-9)
    assert modes.amplitude.shape == modes.phase.shape == (2, 3, 1)
    np.testing.assert_allclose(modes.amplitude[:, :, 0], np.abs(shape) * PARTS[:2, 2:3], atol=1e-9)
    # opposite motion: phases pi apart
    assert np.cos(modes.phase[0, 0, 0] - modes.phase[0, 1, 0]) == pytest.approx(-1)
    np.testing.assert_allclose(modes.at(np.arange(n) * DT), x, atol=1e-9)
    assert modes.rest.shape == (3, 1)


def test_an_offset_a_creep_and_a_growing_part():
    t = np.arange(300) * DT
    x = 0.7 - 0.4 * np.exp(-2.0 * t) + record(300, [PARTS[1]])
    modes = matrix_pencil(x, DT, order=4)
    np.testing.assert_allclose(modes.natural_frequency, [0, 1 / np.pi, 9.5], atol=1e-7)
    np.testing.assert_allclose(modes.amplitude, [0.7, 0.4, 1.0], rtol=1e-6)
    np.testing.assert_allclose(np.cos(modes.phase[:2]), [1, -1])
    assert modes.damping_ratio[1] == pytest.approx(1.0)
    flutter = matrix_pencil(record(300, [(9.5, -0.02, 1e-3, 0.3)]), DT)
    assert flutter.damping_ratio == pytest.approx([-0.02], rel=1e-7)
    assert flutter.amplitude == pytest.approx([1e-3], rel=1e-7)


def test_the_order_by_a_threshold():
    x = record(400) + 1e-6 * np.random.default_rng(1).normal(size=400)
    ratios = matrix_pencil(x, DT).singular_values
    ratios = ratios / ratios[0]
    assert matrix_pencil(x, DT, threshold=float(np.sqrt(ratios[5] * ratios[6]))).order == 6
    assert matrix_pencil(x, DT, threshold=float(np.sqrt(ratios[1] * ratios[2]))).order == 2
    assert (np.diff(ratios) <= 0).all()


@pytest.mark.matrix
@pytest.mark.parametrize("n", [100, 300, 900])
@pytest.mark.parametrize("noise", [1e-4, 1e-2])
def test_the_order_is_found_in_white_noise(n, noise):
    rng = np.random.default_rng(2)
    for _ in range(10 if n < 500 else 2):
        assert matrix_pencil(record(n) + noise * rng.normal(size=n), DT).order == 6


@pytest.mark.matrix
def test_scatter_over_seeds_is_near_the_least_possible():
    """Noise of 1 % of the largest amplitude, 240 samples, 100 seeds.

    Bounds: no bias beyond a quarter of a deviation, which is at most 1.25 times the Cramer-Rao
    bound: for the strongest mode 1.2e-4 of the frequency and 0.5 % of the damping ratio.
    """
    n, noise = 240, 0.01
    rng = np.random.default_rng(3)
    found = []
    for _ in range(100):
        modes = matrix_pencil(record(n) + noise * rng.normal(size=n), DT, order=6)
        found.append(np.stack([modes.natural_frequency, modes.damping_ratio], axis=1))
    bound = cramer_rao(lambda p: record(n, p.reshape(-1, 4)), PARTS.ravel(), noise).reshape(-1, 4)
    scatter = np.std(found, axis=0)
    assert (scatter < 1.25 * bound[:, :2]).all()
    assert (scatter > 0.8 * bound[:, :2]).all()
    assert (np.abs(np.mean(found, axis=0) - PARTS[:, :2]) < 0.35 * scatter).all()
    assert bound[1, 0] / 9.5 < 1.2e-4
    assert bound[1, 1] / 0.0255 < 5e-3


def test_a_long_record_goes_piece_by_piece():
    """10,000 samples: more rows than one piece; the poles are the same."""
    n = 10_000
    modes = matrix_pencil(record(n, [(0.5, 0.003, 1.0, 0.0)]), DT, width=40)
    assert modes.natural_frequency == pytest.approx([0.5], rel=1e-7)
    assert modes.damping_ratio == pytest.approx([0.003], rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x": np.ones(7)}, "at least 8 samples"),
        ({"x": np.zeros(50)}, "zero throughout"),
        ({"x": np.full(50, np.nan)}, "x: 50 samples are NaN"),
        ({"dt": 0.0}, "dt = 0.0"),
        ({"order": 40}, "order: 40, but 100 samples with windows of 34"),
        ({"order": 0}, "order = 0"),
        ({"threshold": 2.0}, "threshold = 2.0"),
        ({"width": 100}, "width: 100"),
        ({"x": np.random.default_rng(1).normal(size=100)}, "nothing but noise"),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        matrix_pencil(**({"x": record(100), "dt": DT} | arguments))
