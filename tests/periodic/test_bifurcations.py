"""Bifurcations of made-up families, whose places are known."""

import numpy as np
import pytest

from foldyn.periodic.continuation import Step, Stride, point_at, steps
from foldyn.periodic.response import events


class Curve:
    """R(z, p) = z1^2 + p - 1, z2 - z1: a fold at p = 1; or z1 - p, without one."""

    span, rounding, tolerance = 1.0, 0.0, 1e-12

    def __init__(self, folds):
        self.folds = folds

    def residual(self, z, p):
        return np.array([z[0] ** 2 + p - 1.0 if self.folds else z[0] - p, z[1] - z[0]])

    def jacobian(self, z, p):
        return np.array([[2.0 * z[0] if self.folds else 1.0, 0.0], [-1.0, 1.0]])

    def slope(self, z, p):
        return np.array([1.0 if self.folds else -1.0, 0.0])

    def size(self, z):
        return 1.0


def found(family, z, of, end):
    p = 1.0 - z**2 if family.folds else z
    first = point_at(family, np.array([z, z]), p, np.array([0.0, 0.0, 1.0]))
    every = []
    for step in steps(family, first, Stride(0.05, 0.2, 100), end):
        assert isinstance(step, Step)
        every += events(family, step, of)
    return [(event.name, event.point) for event in every]


def test_a_curve_is_followed_around_its_fold():
    ((name, point),) = found(
        Curve(True),
        -1.0,
        lambda point: np.array([0.5, 0.2], complex),
        lambda point: point.z[0] - 1.0,
    )
    assert name == "fold"
    assert point.p == pytest.approx(1.0, abs=1e-12)
    assert point.z == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("of", "name", "place"),
    [
        (lambda p: [-2.0 * p, 0.1], "period doubling", 0.5),
        (lambda p: [1.5 * p * np.exp(1j), 1.5 * p * np.exp(-1j)], "Neimark-Sacker", 1.0 / 1.5),
    ],
)
def test_multipliers_that_leave_the_circle_are_named_and_located(of, name, place):
    ((kind, point),) = found(
        Curve(False), 0.1, lambda point: np.array(of(point.p), complex), lambda point: point.p - 1.0
    )
    assert kind == name
    assert point.p == pytest.approx(place, abs=1e-9)


def test_pairs_that_meet_on_the_real_axis_beyond_the_circle_are_no_bifurcation():
    def of(point):  # a pair outside; past 0.5 real, with a product above 1
        if point.p < 0.5:
            return np.array(
                [1.2 * np.exp(1j * (0.5 - point.p)), 1.2 * np.exp(1j * (point.p - 0.5))]
            )
        return np.array([1.2 + point.p - 0.5, 1.2 - 0.1 * (point.p - 0.5)], complex)

    assert found(Curve(False), 0.1, of, lambda point: point.p - 1.0) == []


class Circle(Curve):
    """R(z, p) = z1^2 + p^2 - 1, z2 - z1."""

    def residual(self, z, p):
        return np.array([z[0] ** 2 + p**2 - 1.0, z[1] - z[0]])

    def jacobian(self, z, p):
        return np.array([[2.0 * z[0], 0.0], [-1.0, 1.0]])

    def slope(self, z, p):
        return np.array([2.0 * p, 0.0])


def test_a_closed_curve_is_followed_once():
    family = Circle(True)
    first = point_at(family, np.array([0.8, 0.8]), 0.6, np.array([0.0, 0.0, 1.0]))
    taken = list(steps(family, first, Stride(0.05, 0.1, 500), lambda point: point.p - 2.0))
    assert all(isinstance(step, Step) for step in taken)
    angles = np.unwrap([np.arctan2(step.after.p, step.after.z[0]) for step in taken])
    turned = abs(angles[-1] - np.arctan2(0.6, 0.8))
    assert 2.0 * np.pi - 0.2 < turned < 2.0 * np.pi
    folds = [e for step in taken for e in events(family, step, lambda point: np.ones(2, complex))]
    assert [event.point.p for event in folds] == pytest.approx([1.0, -1.0], abs=1e-12)
