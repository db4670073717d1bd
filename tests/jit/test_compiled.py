"""What compiled functions take: fields of a context, eight numbers at once; who may call them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from foldyn.dynamics.motion_state import TALLY
from foldyn.jit.compiled import inner, kernel, scalar
from foldyn.jit.context import Context
from foldyn.jit.eights import COUNT, any_of, choose, eight, per_cube_root, put
from foldyn.materials import superlinear
from foldyn.mechanics.dihedral import branch_free_atan2


@inner
def more(x):
    return x + 1


@kernel
def twice_more(x):
    return 2 * more(x)


def test_a_call_of_an_inner_function_is_refused_before_and_after_it_is_compiled():
    """There is no way in: without the refusal, the second call would end the process."""
    for _ in range(2):
        with pytest.raises(TypeError, match="more is for compiled functions"):
            more(1)
        assert twice_more(1) == 4


# ------------------------------------------------------------------ contexts
class Part(NamedTuple):
    yes: bool
    line: NDArray
    size: float


class Owner(NamedTuple):
    part: Part
    number: int
    table: NDArray
    tally: np.record
    last: Part


@inner
def _told(part):
    return part.size * part.line[1] if part.yes else -1.0


@kernel
def _read(own):
    own.tally.steps += own.number
    own.table[1, 2] = 7.0
    return _told(own.part), _told(own.last), own.table.shape[0], own.number


@pytest.mark.matrix
def test_fields_are_those_of_the_tuple():
    line, table, tally = np.array([1.0, 2.0, 3.0]), np.zeros((2, 3)), np.zeros(1, TALLY)[0]
    owner = Owner(Part(True, line, 2.5), -4, table, tally, Part(False, line[1:], 0.5))
    assert _read(Context(owner)) == (5.0, -1.0, 2, -4)
    assert tally.steps == -4 and table[1, 2] == 7.0
    last = Part(True, np.arange(6.0)[::2], 0.5)  # of another layout, and so of another type
    assert _read(Context(owner._replace(last=last)))[:2] == (5.0, 1.0)


def test_what_is_no_tuple_of_arrays_and_numbers_has_no_place():
    with pytest.raises(TypeError, match="str has no place in a context"):
        Context(Part(True, np.zeros(2), "2.5"))  # type: ignore[arg-type]


# ------------------------------------------------------------------ eights
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
        out[2, q] = superlinear.moment(x[q] - y[q])
        out[3, q] = per_cube_root(abs(x[q]))


@kernel
def by_eights(x, y, out):
    a, b = eight(x, 0), eight(y, 0)
    put(out[0], 0, formula(a, b))
    put(out[1], 0, branch_free_atan2(a, b))
    put(out[2], 0, superlinear.moment(a - b))
    put(out[3], 0, per_cube_root(abs(a)))


@kernel
def any_above(x, at, limit):
    return any_of(eight(x, at) > limit)


@kernel
def move(x, at, out, place):
    put(out, place, eight(x, at))


@pytest.mark.matrix
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


@pytest.mark.matrix
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
