"""Numbers at the door: what passes can be computed with, what does not is told in a few words."""

from __future__ import annotations

import itertools
import warnings
from fractions import Fraction

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.statics import Settings
from foldyn.values import (
    LARGEST,
    LONGEST,
    MOST,
    SHORTEST,
    SMALLEST,
    indices,
    number,
    numbers,
    show,
    whole,
)
from public_calls import DATA, PATTERNS

TOO_LARGE = [2**63, -(2**64), 2**70, 10**400, 10**5000, 1e51, -1e103, 1e308, np.inf, -np.inf]
TOO_SMALL = [1e-51, -1e-103, 1e-300, 5e-324]
BAD = [*TOO_LARGE[3:], *TOO_SMALL, np.nan, None, "1", True, [1.0], 1j]


@pytest.mark.parametrize("value", BAD, ids=show)
def test_what_is_no_number_or_none_of_a_size_is_refused(value):
    for name in ("a", "b.c[2]"):
        with pytest.raises(InputError, match=f"^{name.replace('[', '.').replace(']', '.')} = "):
            number(name, value)


def test_numbers_that_people_use_pass_as_they_are():
    for value in (0, 0.0, -0.0, 1, -3, 2.5, 1e-50, -1e50, np.float32(0.5), np.int64(7), True + 1):
        assert number("a", value) == value
    assert number("a", Fraction(1, 4)) == 0.25
    assert number("a", 5, above=0, most=5) == 5.0


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({"above": 2.0}, "greater than 2"),
        ({"least": 3.0}, "at least 3"),
        ({"below": 2.0}, "less than 2"),
        ({"most": 1.0}, "at most 1"),
        ({"most": 1.0, "unit": "m"}, "at most 1 m$"),
    ],
)
def test_bounds_are_told(bounds, words):
    with pytest.raises(InputError, match=f"^a = 2: must be {words}"):
        number("a", 2, **bounds)


@pytest.mark.parametrize("value", [*TOO_LARGE, 1.0, 2.5, "1", None, True, np.nan, [1]], ids=show)
def test_what_is_no_whole_number_of_64_bits_is_refused(value):
    with pytest.raises(InputError, match=r"^a = .*: must be "):
        whole("a", value)


def test_whole_numbers_pass():
    for value in (0, -1, MOST, -MOST - 1, np.int64(5), np.uint8(200)):
        assert whole("a", value) == value
        assert type(whole("a", value)) is int
    with pytest.raises(InputError, match=r"^a = 0: must be a whole number, at least 1 \(steps\)"):
        whole("a", 0, least=1, what="steps")
    with pytest.raises(InputError, match=r"^a = 9: must be at most 8"):
        whole("a", 9, most=8)


def test_arrays_have_a_size_and_may_have_tails():
    tails = np.exp(-(np.linspace(-25.0, 25.0, 5) ** 2))  # to 1e-272
    np.testing.assert_array_equal(numbers("a", tails), tails)
    assert numbers("a", []).size == 0
    nan = np.float64("nan")
    for bad in ([1.0, 1e51], [0, 2**70, 1e300], [0.0, 1e-60], [1, np.nan], nan, 10**400):
        with pytest.raises(InputError, match=r"^a.* must be "):
            numbers("a", bad)


def test_numbers_of_nodes_fit_into_arrays():
    assert indices("nodes", [3, 1], "node", "") == (3, 1)
    for bad in (2**63, -(2**70), 10**5000):
        with pytest.raises(InputError, match=r"^nodes: .*: is too large for a node number"):
            indices("nodes", [0, bad], "node", "")


def test_values_are_shown_short():
    deep: object = 1
    for _ in range(2000):
        deep = {"a": [deep]}
    for value in (deep, "x" * 10**6, list(range(10**5)), {str(i): i for i in range(10**4)},
                  10**5000, np.zeros((300, 300)), 1e300, b"y" * 1000):  # fmt: skip
        assert len(show(value)) <= 60
    assert show([1, "a", True, {"b": 2.5}]) == '[1, "a", true, { b = 2.5 }]'
    assert show(10**5000) == "a number of about 5001 digits"


@pytest.mark.parametrize("kind", [InputError, FoldynWarning, ComputationError])
def test_no_message_is_long(kind):
    for text in ("word " * 20_000, "\n".join(["line"] * 1000), "\n".join(["word " * 300] * 50)):
        told = str(kind(f"first: {text}: last"))
        assert len(told) <= 4000
        assert told.count("\n") < 20
        assert told.startswith("first: ")
    kept = "as it is; also" if kind is FoldynWarning else "as it is\n  also"  # a warning is a line
    assert str(kind("as it is\n  also")) == kept
    assert str(kind(f"file: {'x' * 5000}: take fewer")).endswith("x: take fewer")  # the remedy


@pytest.mark.matrix
def test_what_passes_the_doors_makes_sound_structures():
    """At the corners of the ranges nothing overflows or vanishes on the way in."""
    refused: list[str] = []
    ends = [(SMALLEST, LARGEST)] * 3 + [(SHORTEST, LONGEST), (2 * SHORTEST, 0.2 * LONGEST)]
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        for modulus, density, ratio, thickness, size in itertools.product(*ends):
            sheet = fd.Sheet(modulus, 0.25, thickness, density, ratio)
            pattern = fd.patterns.miura(a=size, b=size)
            try:
                bars = fd.discretize(pattern, sheet, preset="plate")
            except InputError as error:
                refused.append(str(error))
                with pytest.raises(InputError, match="out of range"):
                    fd.shell(pattern, sheet, divisions=2)
                continue
            shell = fd.shell(pattern, sheet, divisions=2)
            made = [bars.bar_area, bars.bend_stiffness, bars.mass.data, bars.fold_stiffness]
            made += [shell.fold_stiffness, shell.mass.data]
            for array in made:
                assert np.isfinite(array).all()
                assert (array > 0.0).all()
    assert 0 < len(refused) < 20
    assert all("out of range: check youngs_modulus = " in told for told in refused)


NUMBERS = {  # sound calls of constructors, with the arguments that are numbers
    name: (
        make,
        arguments,
        [key for key, value in arguments.items() if type(value) in (int, float)],
    )
    for name, (make, arguments) in {**DATA, **PATTERNS}.items()
}
NUMBERS["Settings"] = (Settings, {}, ["tolerance", "largest_turn", "jump", "iterations", "cuts"])


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_of_a_constructor_is_checked(name):
    make, sound, keys = NUMBERS[name]
    bad = [10**400, 10**5000, 1e103, 1e308, 1e-300, np.nan, "1"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for key, value in itertools.product(keys, bad):
            with pytest.raises(InputError, match=key):
                make(**{**sound, key: value})


def test_a_pattern_has_a_size():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    for scale in (1e-29, 1e29):
        assert fd.Pattern(scale * square, [(0, 1, 2, 3)]).size == pytest.approx(scale * 2**0.5)
    for scale in (1e-31, 1e31, 1e160, 1e308, 1e-310):
        with pytest.raises(InputError, match=r"vertices.*at (most|least) 1e"):
            fd.Pattern(scale * square, [(0, 1, 2, 3)])
