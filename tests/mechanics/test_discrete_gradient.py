"""Forces of the conserving method: their work, their resultant and moment, their limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from foldyn.checks import observed_order
from foldyn.mechanics import angles
from foldyn.mechanics.discrete_gradient import (
    discrete_gradient,
    mean_moment,
    mean_stress,
)


@pytest.mark.parametrize(("turn", "order"), [(0.0, 3.0), (0.7, 2.0)])
def test_gradient_of_the_dihedral_needs_little_help(turn, order):
    """What is made up along the deformation is of third order in it, of second with a rotation."""
    x0 = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.4, 0.9, 0.3], [0.6, -0.8, 0.2]])
    deform = np.random.default_rng(7).standard_normal((4, 3))
    rotation = Rotation.from_rotvec(turn * np.array([0.48, -0.6, 0.64])).as_matrix()
    rows = np.array([[0, 1, 2, 3]], np.uint32)
    sizes, missing = np.array([1e-2, 5e-3, 2.5e-3]), []
    for size in sizes:
        x1 = (x0 + size * deform) @ rotation.T
        turned = float(angles(x1, rows)[0] - angles(x0, rows)[0])
        points, plain, gradient = (np.empty((4, 3)) for _ in range(3))
        mean = 0.5 * (x0 + x1)
        discrete_gradient(mean, x1 - x0, turned, points, plain, gradient)
        assert (gradient * (x1 - x0)).sum() == pytest.approx(turned, abs=1e-14)
        assert np.abs(np.cross(mean, gradient).sum(axis=0)).max() < 1e-13
        assert np.abs(gradient.sum(axis=0)).max() < 1e-13
        # points = A (mean about its center): without the correction the gradient is A^-1 plain
        stretch = np.linalg.lstsq(mean - mean.mean(axis=0), points, rcond=None)[0].T
        bare = plain @ np.linalg.inv(stretch).T
        missing.append(turned - (bare * (x1 - x0)).sum())
    assert observed_order(sizes, missing) == pytest.approx(order, abs=0.2)


def test_mean_values_are_quotients():
    """Closed forms: linear laws give the mean stress and moment, whatever the change."""
    code, address = 0, np.zeros(3, np.int64)
    for x, change in ((0.1, 0.3), (-0.2, 0.5), (0.4, 1e-14), (0.0, 0.0)):
        stress, slope = mean_stress(code, address, x, change)
        assert stress == pytest.approx(0.5 * x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
        p = np.zeros(4)
        moment, slope = mean_moment(code, address, p, 1.0, 1.0, 1.0 + x, change)
        assert moment == pytest.approx(x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
    # superlinear through its rest angle: (3/7)(b^(7/3) - a^(7/3)) / (a + b)
    moment, _ = mean_moment(1, address, np.zeros(4), 1.0, 1.0, 0.9, 0.3)
    assert moment == pytest.approx(3 / 7 * (0.2 ** (7 / 3) - 0.1 ** (7 / 3)) / 0.3, rel=1e-12)
