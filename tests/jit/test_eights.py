"""Eight numbers as one value: the arithmetic of each, and its place in an array."""

from __future__ import annotations

import math

import numpy as np
import pytest

from foldyn.jit.compiled import kernel, scalar
from foldyn.jit.eights import COUNT, any_of, choose, eight, per_cube_root, put
from foldyn.materials import superlinear
from foldyn.mechanics.dihedral import branch_free_atan2


@scalar
def formula(x, y):
    """All that eights can."""
    far = choose(abs(x) > 1.5, 2.0 * x - y, x / (y * y + 1.0))
    return choose(y < 0.0, -far, math.sqrt(abs(x) + 1.0)) - 0.5


@kernel
def by_numbers(x, y, out):
    for q in range(COUNT):
        out[0, q] = formula(x[q], y[q])
        out[1, q] = branch_free_atan2(x[q], y[q])
        out[2, q] = superlinear.moment(x[q], y[q])
        out[3, q] = per_cube_root(abs(x[q]))


@kernel
def by_eights(x, y, out):
    a, b = eight(x, 0), eight(y, 0)
    put(out[0], 0, formula(a, b))
    put(out[1], 0, branch_free_atan2(a, b))
    put(out[2], 0, superlinear.moment(a, b))
    put(out[3], 0, per_cube_root(abs(a)))


@kernel
def any_above(x, at, limit):
    return any_of(eight(x, at) > limit)


@kernel
def move(x, at, out, place):
    put(out, place, eight(x, at))


def test_formulas_of_eights_are_those_of_numbers():
    """On both sides of every choice, and of what is not a number."""
    random = np.random.default_rng(0)
    for scale in (1.0, 1e-3, 1e3):
        x, y = scale * random.standard_normal((2, COUNT))
        x[3], y[5] = np.nan, np.nan
        found, wanted = np.empty((2, 4, COUNT))
        by_eights(x, y, found)
        by_numbers(x, y, wanted)
        np.testing.assert_allclose(found, wanted, rtol=2e-15, atol=0.0)
        assert np.isnan(found[1, [3, 5]]).all()
        good = np.isfinite(x + y)
        np.testing.assert_allclose(found[1, good], np.arctan2(x, y)[good], rtol=1e-15)
        d = (x - y)[good]
        np.testing.assert_allclose(found[2, good], np.cbrt(d) * np.abs(d), rtol=2e-15)


def test_a_guess_of_the_cube_root_is_near():
    x = np.geomspace(1e-200, 1e200, COUNT)
    out = np.empty((4, COUNT))
    by_eights(x, np.ones(COUNT), out)
    np.testing.assert_allclose(out[3] * np.cbrt(x), 1.0, atol=0.035)


@pytest.mark.parametrize("at", [0, 1, 5])
def test_they_stand_anywhere_in_an_array(at):
    x, out = np.arange(20.0), np.zeros(20)
    move(x, at, out, at + 2)
    wanted = np.zeros(20)
    wanted[at + 2 :][:COUNT] = x[at:][:COUNT]
    np.testing.assert_array_equal(out, wanted)


@pytest.mark.parametrize("number", range(COUNT))
def test_one_is_enough(number):
    x = np.zeros(COUNT + 1)
    x[number + 1] = 2.0
    assert any_above(x, 1, 1.0)
    assert not any_above(x, 1, 2.0)
    x[number + 1] = np.nan
    assert not any_above(x, 1, 1.0)
