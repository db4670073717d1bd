"""Expressions of measures: values, derivatives against differences, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.gradients.expressions import constraint, parse

AT = {"frequency[1]": 3.0, "frequency[2]": 7.0, "peak_frequency[8,x]": 2.5, "mass": 0.3}
TEXTS = {
    "-frequency[2] / frequency[1]": -7.0 / 3.0,
    "+mass - (2 - frequency[1]) * 4": 4.3,
    "frequency[1] ** 2 + 2 ** mass": 9.0 + 2.0**0.3,
    "frequency[1] ** mass": 3.0**0.3,
    "mass ** -1.5": 0.3**-1.5,
    "peak_frequency[8, x] * min(mass, frequency[1], 1)": 0.75,
    "max(frequency[1], 2 * mass) - 1": 2.0,
    "abs(mass - frequency[1])": 2.7,
    "sqrt(mass) * log(frequency[2]) / exp(mass)": np.sqrt(0.3) * np.log(7.0) / np.exp(0.3),
    "(frequency[1]**8 + frequency[2]**8) ** (1 / 8)": (3.0**8 + 7.0**8) ** 0.125,
    "1e-3": 1e-3,
}


@pytest.mark.parametrize("text", TEXTS)
def test_values_and_derivatives_are_those_of_the_formula(text):
    one = parse(text)
    assert one.value(AT) == pytest.approx(TEXTS[text], rel=1e-14)
    value, slopes = one.value_and_slopes(AT)
    assert value == one.value(AT)
    assert tuple(slopes) == one.measures
    for name, slope in slopes.items():
        step = 1e-5 * AT[name]
        up, down = (one.value({**AT, name: AT[name] + way * step}) for way in (1.0, -1.0))
        assert slope == pytest.approx((up - down) / (2.0 * step), rel=1e-8, abs=1e-12)


def test_measures_are_told_with_their_arguments():
    text = "peak_frequency[8, x] + frequency_error[n5b8e] / mass - peak_frequency[8,x]"
    assert parse(text).measures == ("peak_frequency[8,x]", "frequency_error[n5b8e]", "mass")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "must be an expression of measures"),
        (3, "must be an expression of measures"),
        ("frequency[1", "cannot be read; write for example"),
        ("frequency[1]^2", r"frequency\[1\] \^ 2 \(character 1\): .* write powers with \*\*"),
        ("2 * foo(mass)", r"foo\(mass\) \(character 5\): the functions are min, max"),
        ("sqr(mass)", "did you mean 'sqrt'"),
        ("sqrt(mass, 2)", "sqrt has one argument"),
        ("min(mass)", "min has two arguments or more"),
        ("max(*mass, 1)", "plain numbers and measures"),
        ("__import__('os').system('x')", "the functions are"),
        ("mass.real", r"mass.real \(character 1\): is neither a number"),
        ("mass if 1 else 2", "is neither a number"),
        ("[mass]", "is neither a number"),
        ("True * mass", "is neither a number"),
        ("(lambda: 1)()", "the functions are"),
        ("mass <= 1", "one belongs in subject_to"),
        ("1e400 * mass", "is neither a number"),
        ("+".join(["mass"] * 300), "is longer than 1000 characters"),
    ],
)
def test_what_is_no_expression_is_refused_with_its_place(text, why):
    with pytest.raises(InputError, match=why):
        parse(text)


@pytest.mark.parametrize(
    ("text", "at", "why"),
    [
        ("1 / mass", 0.0, "no finite value at mass = 0"),
        ("log(mass)", 0.0, "no finite value"),
        ("sqrt(mass)", -1.0, "no finite value"),
        ("mass ** 0.5", -1.0, "no finite value"),
        ("mass ** -1", 0.0, "no finite value"),
        ("exp(exp(mass))", 100.0, "no finite value"),
        ("sqrt(mass)", 0.0, "no finite derivative at mass = 0"),
        ("abs(mass)", 0.0, "take its square instead"),
        ("min(mass, 2 - mass)", 1.0, r"its arguments are equal \(1\).*write it smoothly"),
        ("max(mass, 1, 2 * mass - 1)", 1.0, "constrain the other"),
        ("max(mass, 2 - mass)", 1.0 + 1e-12, "its arguments are equal"),
        ("abs(mass - 2)", 2.0 - 1e-12, "is 0, .*take its square instead"),
    ],
)
def test_where_there_is_no_value_or_derivative_the_message_says_so(text, at, why):
    with pytest.raises(InputError, match=why):
        parse(text).value_and_slopes({"mass": at})


def test_values_alone_need_no_derivative():
    assert parse("sqrt(mass) + abs(mass) + min(mass, -mass)").value({"mass": 0.0}) == 0.0


def test_equal_arguments_with_one_derivative_are_no_tie():
    value, slopes = parse("max(2 * mass, mass + mass)").value_and_slopes({"mass": 1.5})
    assert (value, slopes) == (3.0, {"mass": 2.0})


@pytest.mark.parametrize(
    ("text", "difference", "violation", "size"),
    [
        ("frequency[1] == 12", -9.0, 9.0, 12.0),
        ("0.1 >= mass", -0.2, 0.2, 0.1),
        ("mass <= 0.1", 0.2, 0.2, 0.1),
        ("frequency[2] >= 2 * frequency[1]", 1.0, 0.0, 7.0),
        ("mass <= 0", 0.3, 0.3, 0.3),
    ],
)
def test_constraints(text, difference, violation, size):
    one = constraint(text)
    assert one.value(AT) == pytest.approx(difference)
    assert one.violation(one.value(AT)) == pytest.approx(violation)
    assert one.size(AT) == pytest.approx(size)
    value, slopes = one.value_and_slopes(AT)
    assert value == one.value(AT) and set(slopes) == set(one.measures)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("mass", "compares nothing; write for example"),
        ("mass < 1", "compare with ==, <= or >="),
        ("0 <= mass <= 1", "several comparisons; write one each"),
        ("1 <= 2", "has no measure"),
        ("mass == foo(1)", r"foo\(1\) \(character 9\)"),
        (None, "must be a constraint"),
    ],
)
def test_what_is_no_constraint_is_refused(text, why):
    with pytest.raises(InputError, match=why):
        constraint(text)
