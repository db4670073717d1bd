"""Arrays of a page: what is packed comes back, to the accuracy that was asked for."""

from __future__ import annotations

import numpy as np
import pytest
from decode import changing, decoded

from foldyn.viewer.arrays import LARGEST, Arrays


@pytest.mark.parametrize("kind", ["u1", "u4", "i2", "f4"])
@pytest.mark.parametrize("shape", [(7,), (5, 3), (4, 3, 2)])
def test_exact_arrays_come_back(kind, shape):
    values = np.random.default_rng(1).integers(0, 120, shape).astype(kind)
    arrays = Arrays()
    assert np.array_equal(decoded(arrays, arrays.exact("a", values, kind)), values)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("name", ["motion", "noise", "still", "one sample", "not finite"])
def test_values_over_time_come_back_to_the_tolerance(name, tolerance):
    random = np.random.default_rng(2)
    t = np.linspace(0.0, 1.0, 300)
    shapes = random.normal(size=(4, 60))
    sines = np.sin(2 * np.pi * np.outer(t, [1.0, 3.3, 7.1, 20.0])) * [1.0, 0.3, 0.02, 1e-3]
    motion = (sines @ shapes).reshape(300, 20, 3)
    values = {
        "motion": motion,
        "noise": random.normal(size=(50, 20, 3)),
        "still": np.zeros((10, 4, 3)),
        "one sample": motion[50:51],
        "not finite": np.where(motion > motion.max() * 0.99, np.nan, motion),
    }[name]
    arrays = Arrays()
    found = changing(arrays, arrays.changing("u", values, tolerance))
    values = np.nan_to_num(values)
    largest = np.abs(values).max()
    # what is stored as a sum may take twice the least step that 16 bits have
    assert np.abs(found - values).max() <= max(tolerance, 2.0 / LARGEST) * largest * (1 + 1e-6)


@pytest.mark.matrix
def test_a_motion_of_few_shapes_takes_little_room():
    t = np.linspace(0.0, 10.0, 2000)
    shapes = np.random.default_rng(3).normal(size=(3, 900))
    motion = np.sin(np.outer(t, [1.0, 2.7, 8.0])) @ shapes
    arrays = Arrays()
    about = arrays.changing("u", motion, 1e-4)
    assert len(about["sizes"]) == 3
    assert sum(map(len, arrays.packed.values())) < 0.01 * 2 * motion.size
