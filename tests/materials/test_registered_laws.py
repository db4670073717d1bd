"""What holds for every law: its functions agree with one another, and the kernels know it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import foldyn as fd
from custom_laws import CUBIC
from foldyn.errors import InputError
from foldyn.materials import (
    BAR_LAWS,
    HINGE_LAWS,
    BarLaw,
    HingeLaw,
    MemoryLaw,
    bar_law,
    hinge_law,
    switch,
)
from foldyn.materials.switch import move_rest

STEP = 1e-5
HINGES = {
    **{name: hinge_law(name) for name, law in HINGE_LAWS.items() if not issubclass(law, MemoryLaw)},
    # their elastic parts
    "prony": fd.Prony(0.5, 0.1, law=fd.EnhancedLinear(90, 270)),
    "plastic": fd.Plastic(0.1),
    "eyring": fd.Eyring(0.01, 1e-3, law="linear"),
    # limits within the rest angles below: locked at rest
    "locked, stress-free": fd.EnhancedLinear(90, 270),
    "locked, as published": fd.EnhancedLinear(90, 270, rest="as_published"),
    "custom": CUBIC,
}
THETA, REST = np.meshgrid(
    np.radians([30.0, 120.0, 250.0, 330.0]), np.radians([40.0, 100.0, 200.0, 320.0])
)


def difference(function, x):
    return (function(x + STEP) - function(x - STEP)) / (2.0 * STEP)


def close(found, wanted):
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("name", BAR_LAWS)
def test_functions_of_a_bar_law_are_derivatives(name):
    law, stretch = bar_law(name), np.linspace(0.6, 1.8, 25)
    close(law.stress(stretch) * stretch, difference(law.energy, stretch))
    close(law.slope(stretch) * stretch, difference(law.stress, stretch))


@pytest.mark.parametrize("name", HINGES)
def test_functions_of_a_hinge_law_are_derivatives(name):
    """In the dihedral and in the rest dihedral, along which moment and energy at rest move."""
    law = HINGES[name]
    close(law.moment(THETA, REST), difference(lambda theta: law.energy(theta, REST), THETA))
    close(law.slope(THETA, REST), difference(lambda theta: law.moment(theta, REST), THETA))
    close(law.rest_slope(THETA, REST), difference(lambda rest: law.energy(THETA, rest), REST))


@pytest.mark.parametrize("name", HINGES)
def test_the_moment_of_a_hinge_law_is_differentiated_by_all_numbers(name):
    """Gradients take this: by the rest angle, and by the first three parameters."""
    law, flat = HINGES[name], (THETA.ravel(), REST.ravel())
    parameters, address = law.parameters(flat[1]), np.array(law.addresses or (0, 0, 0), np.int64)

    def moment(rest, column=0, by=0.0):
        moved = parameters.copy()
        moved[:, column] += by
        return law.compiled(law.code, flat[0], rest, moved, address)[1]

    found = law.moment_by(*flat)
    close(found[0], difference(moment, flat[1]))
    for column in range(3):
        size = np.maximum(np.abs(parameters[:, column]), 1e-3)
        change = difference(lambda by, c=column, s=size: moment(flat[1], c, by * s), 0.0)
        close(found[1 + column], change / size)


@pytest.mark.parametrize("name", HINGES)
def test_a_hinge_law_has_no_kink_within_its_reach(name):
    """Its slope is smooth there: differences of a few thousandths of the way are exact."""
    law = HINGES[name]
    theta, rest = THETA.ravel(), REST.ravel()
    way = 3e-3 * np.minimum(law.reach(theta, rest, law.parameters(rest)), 1.0)
    at = [law.slope(theta + k * way, rest) for k in (-2, -1, 1, 2)]
    assert (law.slope(theta, rest) * 6.0) == pytest.approx(
        4.0 * (at[1] + at[2]) - (at[0] + at[3]), rel=1e-6, abs=1e-9
    )


def test_every_function_of_the_switch_is_asked_for():
    table = {name for name in vars(switch) if name.startswith(("bar_", "hinge_"))}
    assert table - {"bar_table", "hinge_table"} == {*BarLaw.functions, *HingeLaw.functions}


@pytest.mark.parametrize("row", range(5))
def test_a_missing_branch_is_named_when_a_structure_is_built(row, monkeypatch):
    known = HingeLaw.compiled

    def compiled(*given):
        table = known(*given)
        table[row] = np.nan
        return table

    monkeypatch.setattr(HingeLaw, "compiled", staticmethod(compiled))
    pattern, sheet = fd.patterns.simple_fold(), fd.Sheet(1e6, 0.25, 0.01)
    with pytest.raises(InputError, match=rf"branch in {HingeLaw.functions[row]} of materials"):
        fd.discretize(pattern, sheet, fold_law="linear")


@pytest.mark.parametrize("name", HINGES)
def test_parameters_of_a_hinge_law_follow_its_rest_angle(name):
    law, rest = HINGES[name], REST[:, 0]
    moved = law.parameters(rest[::-1].copy())
    for row, angle in zip(moved, rest, strict=True):
        move_rest(law.code, angle, row)
    np.testing.assert_array_equal(moved, law.parameters(rest))


@pytest.mark.parametrize("name", HINGES)
def test_a_hinge_law_is_linear_where_it_says_so(name):
    law = HINGES[name]
    if law.linear_between is None:
        assert np.ptp(law.slope(THETA, REST)) > 0.0
        return
    low, high = law.linear_between
    within = (np.minimum(THETA, REST) > low) & (np.maximum(THETA, REST) < high)
    np.testing.assert_array_equal(law.moment(THETA, REST)[within], (THETA - REST)[within])


def test_every_law_is_among_these():
    assert set(HINGE_LAWS) <= set(HINGES)


def test_codes_of_registered_laws_differ():
    """But for laws with memory, which have that of their elastic part."""
    elastic = [law for law in HINGE_LAWS.values() if not issubclass(law, MemoryLaw)]
    for laws in (BAR_LAWS.values(), elastic):
        assert len({kind().code for kind in laws}) == len(laws)


@dataclass(frozen=True)
class UnknownBar(BarLaw):
    code = 99
    name: str = "unknown"


@dataclass(frozen=True)
class UnknownHinge(HingeLaw):
    code = 99
    name: str = "unknown"


class Nameless(HingeLaw):
    """Has neither a code nor functions."""

    name = "nameless"


@pytest.mark.parametrize(
    ("field", "law"),
    [("bar_law", UnknownBar()), ("bend_law", UnknownHinge()), ("fold_law", Nameless())],
)
def test_a_law_that_the_kernels_do_not_know_is_refused(field, law):
    pattern, sheet = fd.patterns.simple_fold(), fd.Sheet(1e6, 0.25, 0.01)
    with pytest.raises(InputError, match=rf"^{field}: '{law.name}', code .*, is not a law"):
        fd.discretize(pattern, sheet, **{field: law})
    if field == "fold_law":
        with pytest.raises(InputError, match="is not a law that the kernels know"):
            fd.shell(pattern, sheet, divisions=2, fold_law=law)
