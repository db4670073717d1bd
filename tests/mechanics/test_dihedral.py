"""The dihedral where it is hardest: at flat, at both closures, and for slender wings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foldyn.mechanics import angles
from foldyn.mechanics.dihedral import branch_free_atan2
from pairwise import in_pairs

TWO_PI = 2 * math.pi
ROW = np.array([[0, 1, 2, 3]], np.int32)


def wings(theta, length=1.0, along=(0.3, 0.6), width=(1.0, 1.0)):
    """Points j, k, i, l (4, 3): wing l is wing i turned by theta about the axis x.

    Wing i lies in the x-y plane, so its front is +z and theta < pi is a valley.
    """
    other = [along[1], width[1] * math.cos(theta), width[1] * math.sin(theta)]
    return np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0], [along[0], width[0], 0.0], other])


def angle(points):
    return float(angles(np.ascontiguousarray(points), ROW)[0])


ANGLES = [
    1e-9, 1e-6, 1e-3, 0.1, math.pi / 3, math.pi / 2, 3.0, math.pi - 1e-9, math.pi,
    math.pi + 1e-9, 3.3, 1.5 * math.pi, 5.0, TWO_PI - 1e-3, TWO_PI - 1e-6, TWO_PI - 1e-9,
]  # fmt: skip


@pytest.mark.parametrize(
    ("along", "width", "length", "theta"),
    in_pairs(
        [(0.3, 0.6), (-1.0, 2.0)],
        [(1.0, 1.0), (0.2, 3.0), (1e-6, 1.0), (1e-7, 1e-8)],
        [1.0, 1e-3, 1e3],
        ANGLES,
    ),
)
def test_known_angle(theta, length, width, along):
    """Also nearly collapsed triangles: wings 1e-8 of the axis wide."""
    assert angle(wings(theta, length, along, width)) == pytest.approx(theta, rel=0, abs=1e-12)


@pytest.mark.parametrize("theta", ANGLES)
def test_known_angle_anywhere_in_space(theta):
    """Turned and moved, the coordinates are rounded: 1e-16 of the size, no more."""
    rng = np.random.default_rng(11)
    for _ in range(20):
        q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        q *= np.linalg.det(q)
        assert angle(wings(theta) @ q.T + rng.uniform(-1, 1, 3)) == pytest.approx(theta, abs=1e-14)


def test_small_angles_near_flat_are_resolved():
    """acos would lose everything below 1e-8."""
    for d in (1e-9, 1e-12, 1e-14):
        assert angle(wings(math.pi + d)) - angle(wings(math.pi - d)) == pytest.approx(
            2 * d, rel=0.1
        )
    points = wings(math.pi)
    points[3, 2] = -1e-300  # below flat by less than rounding: still flat
    assert angle(points) == math.pi


def test_symmetries_of_the_row():
    """Axis reversed and wings exchanged: the same hinge; one of the two: its back."""
    points = wings(1.2, 1.3, (0.2, 0.9), (0.7, 1.4))
    theta = angle(points)
    assert angle(points[[1, 0, 3, 2]]) == pytest.approx(theta, abs=1e-15)
    assert angle(points[[1, 0, 2, 3]]) == pytest.approx(TWO_PI - theta, abs=1e-15)
    assert angle(points[[0, 1, 3, 2]]) == pytest.approx(TWO_PI - theta, abs=1e-15)
    assert angle(points * [1, 1, -1]) == pytest.approx(TWO_PI - theta, abs=1e-15)


@given(st.floats(1e-6, TWO_PI - 1e-6), st.floats(-6, 6))
def test_scale_does_not_matter(theta, exponent):
    assert angle(wings(theta) * 10.0**exponent) == pytest.approx(theta, abs=1e-13)


def test_nan_survives():
    points = wings(1.0)
    points[2, 1] = math.nan
    assert math.isnan(angle(points))


# ---------------------------------------------------------------------------- atan2


def ulps(a, b):
    return np.abs(a - b) / np.spacing(np.abs(b))


def test_atan2_over_all_quadrants():
    rng = np.random.default_rng(13)
    phi = np.concatenate([np.linspace(-math.pi, math.pi, 20011), rng.uniform(-4, 4, 20000)])
    r = 10.0 ** rng.uniform(-20, 20, phi.size)
    y, x = r * np.sin(phi), r * np.cos(phi)
    ours = np.array([branch_free_atan2(a, b) for a, b in zip(y, x, strict=True)])
    assert ulps(ours, np.arctan2(y, x)).max() <= 4


def test_atan2_with_very_different_arguments():
    rng = np.random.default_rng(14)
    y, x = (rng.choice([-1, 1], 20000) * 10.0 ** rng.uniform(-100, 100, 20000) for _ in range(2))
    ours = np.array([branch_free_atan2(a, b) for a, b in zip(y, x, strict=True)])
    expected = np.arctan2(y, x)
    normal = np.abs(expected) > 1e-300
    assert ulps(ours[normal], expected[normal]).max() <= 4


@pytest.mark.parametrize(
    ("y", "x"),
    [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1), (1e-300, 1), (1, 1e-300),
     (math.sqrt(2) - 1, 1), (1, math.sqrt(2) - 1)],
)  # fmt: skip
def test_atan2_at_the_seams(y, x):
    assert branch_free_atan2(float(y), float(x)) == pytest.approx(
        math.atan2(y, x), rel=4e-16, abs=0
    )


def test_atan2_of_nothing_is_nan():
    assert math.isnan(branch_free_atan2(0.0, 0.0))
    assert math.isnan(branch_free_atan2(math.nan, 1.0))
    assert math.isnan(branch_free_atan2(1.0, math.nan))
