"""What a sweep varies, and how it is written."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.analyses.ranges import varied
from foldyn.errors import InputError
from foldyn.sweeps.points import grid, samples


def one(spec, sampled=False):
    (found,) = varied({"sheet.thickness": spec}, sampled)
    return found


def test_a_range_meets_its_ends_and_is_even():
    assert one("1:5:9").values == tuple(np.linspace(1, 5, 9).tolist())
    assert one("5:1:5").values == (5, 4, 3, 2, 1)
    ratios = one("1e-3:1:7:log").values
    assert (ratios[0], ratios[-1]) == (1e-3, 1.0)
    np.testing.assert_allclose(np.diff(np.log10(ratios)), 0.5, rtol=1e-12)


@pytest.mark.parametrize(
    ("spec", "values"),
    [
        ("1:5:5", (1, 2, 3, 4, 5)),
        ("1:5.0:5", (1.0, 2.0, 3.0, 4.0, 5.0)),
        ("1,2.5,5", (1, 2.5, 5)),
        ([1, 2], (1, 2)),
        (np.array([1.0, 2.0]), (1.0, 2.0)),
        ("n5b8,n4b5", ("n5b8", "n4b5")),
        ("true,false", (True, False)),
        (7, (7,)),
    ],
)
def test_values_keep_their_kinds(spec, values):
    found = one(spec).values
    assert found == values
    assert [type(value) for value in found] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("spec", "sampled", "message"),
    [
        ("1:5", False, "write A:B:N"),
        ("1:5:9", True, "with samples, write A:B"),
        ("1:5:x", False, 'N = "x": must be a whole number'),
        ("1:5:1", False, "at least 2"),
        ("a:5:3", False, 'A = "a": must be a number'),
        ("1:1:4", False, "both ends are the same"),
        ("-1:1:4:log", False, "ends above 0"),
        ("1:nan:4", False, "must be a finite number"),
        ("1,,2", False, "value 2 is empty"),
        ("1,1", False, "1 is listed twice"),
        ([1, "b"], False, "all numbers, all texts"),
        ([], False, "names no values"),
        (float("inf"), False, "must be a finite number"),
        ({"a": 1}, False, "must be a number"),
    ],
)
def test_what_is_no_range_is_refused_with_its_key(spec, sampled, message):
    with pytest.raises(InputError, match=r'^\["sheet.thickness"\]') as caught:
        one(spec, sampled)
    assert message in str(caught.value)


def test_a_grid_has_every_combination_once_the_last_key_first():
    keys = varied({"a": "1:3:3", "b": "x,y"}, False)
    assert grid(keys) == [(1, "x"), (1, "y"), (2, "x"), (2, "y"), (3, "x"), (3, "y")]


def test_a_grid_that_nobody_means_is_refused():
    keys = varied({name: "0:1:1000" for name in "abc"}, False)
    with pytest.raises(InputError, match="1000000000 points"):
        grid(keys)


def test_a_latin_hypercube_has_one_point_in_each_slice():
    keys = varied({"a": "1:5", "b": "1e-2:1:log", "c": "x,y"}, True)
    points = samples(keys, 16, "latin_hypercube", 3)
    a, b, c = zip(*points, strict=True)
    assert sorted(np.floor((np.array(a) - 1.0) / 4.0 * 16).astype(int)) == list(range(16))
    decade = (np.log10(b) + 2.0) / 2.0 * 16
    assert sorted(np.floor(decade).astype(int)) == list(range(16))
    assert c.count("x") == c.count("y") == 8
    assert points == samples(keys, 16, "latin_hypercube", 3)
    assert points != samples(keys, 16, "latin_hypercube", 4)


def test_the_design_for_sobol_indices_exchanges_one_key_at_a_time():
    keys = varied({"a": "0:1", "b": "0:1", "c": "0:1"}, True)
    blocks = np.array(samples(keys, 8, "saltelli", 0)).reshape(5, 8, 3)
    for k in range(3):
        assert (blocks[2 + k] == np.where(np.arange(3) == k, blocks[1], blocks[0])).all()
    assert not (blocks[0] == blocks[1]).any()


def test_a_key_with_one_value_takes_no_points():
    keys = varied({"a": "0:1", "b": [7], "c": "0:1"}, True)
    points = samples(keys, 8, "saltelli", 0)
    assert len(points) == 8 * (2 + 2)
    assert {b for _, b, _ in points} == {7}
    alone = samples(varied({"a": "0:1", "c": "0:1"}, True), 8, "saltelli", 0)
    assert [(a, c) for a, _, c in points] == alone


@pytest.mark.parametrize("method", ["sobol", "saltelli"])
def test_a_sobol_sequence_needs_a_power_of_two(method):
    with pytest.raises(InputError, match=r"samples = 100: .* take 128"):
        samples(varied({"a": "0:1"}, True), 100, method, 0)
    assert len(samples(varied({"a": "0:1"}, True), 64, "sobol", 0)) == 64
