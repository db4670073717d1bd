"""What holds for every law: its functions agree with one another, and the kernels know it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from branch_runs import example

import foldyn as fd
from custom_laws import CUBIC
from foldyn.errors import InputError
from foldyn.jit.compiled import kernel, scalar
from foldyn.jit.switches import by_code
from foldyn.materials import BAR_LAWS, HINGE_LAWS, BarLaw, HingeLaw, LinearHinge, bar_law, hinge_law
from foldyn.materials.formulas import HingeFormulas
from foldyn.materials.switch import move_rest
from named_models import named

STEP = 1e-5
HINGES = {
    **{name: example(law) for name, law in HINGE_LAWS.items()},  # with memory: the elastic part
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
    by_rest = law._table(THETA, REST)[2]
    close(by_rest, difference(lambda rest: law.energy(THETA, rest), REST))


@pytest.mark.parametrize("name", HINGES)
def test_the_moment_of_a_hinge_law_is_differentiated_by_all_numbers(name):
    """Gradients take this: by the rest angle, and by the first three parameters."""
    law, flat = HINGES[name], (THETA.ravel(), REST.ravel())
    parameters, address = law.parameters(flat[1]), np.array(law.addresses or (0, 0, 0), np.int64)

    def moment(rest, column=0, by=0.0):
        moved = parameters.copy()
        moved[:, column] += by
        return law.compiled(law.code, flat[0], rest, moved, address)[1]

    found = law._table(*flat)[3:]
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


@kernel
def follow(code, rest, parameters):
    for i in range(rest.size):
        move_rest(code, rest[i], parameters[i])


@pytest.mark.parametrize("name", HINGES)
def test_parameters_of_a_hinge_law_follow_its_rest_angle(name):
    law, rest = HINGES[name], REST[:, 0]
    moved = law.parameters(rest[::-1].copy())
    follow(law.code, rest, moved)
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


@scalar
def of_turn(turn):
    return turn


@scalar
def of_turn_and_limit(turn, limit):
    return turn


@scalar
def of_both(theta, rest):
    return theta - rest


@pytest.mark.parametrize(
    ("formulas", "lacks"),
    [
        ((of_turn, of_turn), "slope"),
        ((of_turn, of_turn_and_limit, of_turn), "by_parameters, the derivatives of the moment"),
        ((of_both, of_turn, of_turn), "energy_by_rest and moment_by_rest, as a formula takes"),
        ((of_both, of_turn, of_turn, None, of_both), "energy_by_rest and moment_by_rest"),
    ],
)
def test_a_law_is_complete_or_refused_when_it_is_imported(formulas, lacks):
    with pytest.raises(TypeError, match=lacks):
        HingeFormulas(99, *formulas)


@pytest.mark.parametrize(
    ("declared", "said"),
    [
        ({"Cubic": (), "Linear": LinearHinge.formulas}, "Cubic is registered, but declares no"),
        ({"Linear": LinearHinge.formulas, "Cubic": LinearHinge.formulas}, "Cubic and Linear have"),
    ],
)
def test_laws_without_formulas_and_codes_of_others_are_refused(declared, said):
    with pytest.raises(TypeError, match=said):
        by_code(declared)


@dataclass(frozen=True)
class Forgetful(HingeLaw):
    """Has parameters that depend on the rest angle, and does not say how they follow it."""

    formulas = LinearHinge.formulas
    name: str = "forgetful"

    def parameters(self, rest):
        return np.tile(rest[:, None], 4)


def test_parameters_that_cannot_follow_a_rest_angle_are_refused():
    with pytest.raises(InputError, match=r"bend_law: parameters of 'forgetful' depend on the rest"):
        hinge_law(Forgetful(), "bend_law")


@dataclass(frozen=True)
class UnknownBar(BarLaw):
    code = 99
    name: str = "unknown"


@dataclass(frozen=True)
class UnknownHinge(HingeLaw):
    """Its code is that of another law, whose moments it would have."""

    formulas = (HingeFormulas(LinearHinge.code, of_turn, of_turn, of_turn),)
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
        fd.discretize(pattern, sheet, **named({field: law}))
    if field == "fold_law":
        with pytest.raises(InputError, match="is not a law that the kernels know"):
            fd.shell(pattern, sheet, divisions=2, fold_law=law)
