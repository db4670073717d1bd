"""Actuation of creases: which ones, and how far their rest angles go."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases import Actuate, Case, Fix, Force, Gravity, Harmonic, Ramp
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
PATTERN = fd.patterns.miura(cells=(2, 2), a=1.0, b=1.0, panel_angle=60, dihedral=60)
STRUCTURE = fd.discretize(PATTERN, SHEET, preset="plate")
LETTERS = np.array(PATTERN.assignments)


def test_change_goes_from_the_rest_value_to_the_angle() -> None:
    case = Case(STRUCTURE, loads=[Actuate([3, 0], [120, 90.5], Ramp(2.0))])
    ((change, history),) = case.actuation_terms
    assert history == Ramp(2.0)
    expected = np.zeros(len(STRUCTURE.folds))
    expected[[3, 0]] = np.radians([120, 90.5]) - STRUCTURE.fold_rest[[3, 0]]
    np.testing.assert_array_equal(change, expected)
    assert not change.flags.writeable
    np.testing.assert_array_equal(case.actuated_creases, [0, 3])


def test_rest_values_given_to_discretize_are_where_it_starts() -> None:
    """An angle that is the rest value still actuates."""
    structure = fd.discretize(PATTERN, SHEET, crease_rest=100, preset="plate")
    case = Case(structure, loads=[Actuate([4, 5], [100, 130])])
    ((change, _),) = case.actuation_terms
    np.testing.assert_allclose(change[[4, 5]], [0.0, np.radians(30)], rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(case.actuated_creases, [4, 5])


def test_creases_by_assignment() -> None:
    """One angle for all of a word, or one for each."""
    angles = np.linspace(60, 100, (LETTERS == "V").sum())
    case = Case(STRUCTURE, loads=[Actuate("valley", angles), Actuate("mountain", 280, Ramp(1.0))])
    (valleys, _), (mountains, _) = case.actuation_terms
    np.testing.assert_array_equal(valleys != 0.0, LETTERS == "V")
    np.testing.assert_array_equal(mountains != 0.0, LETTERS == "M")
    rest = (STRUCTURE.fold_rest + valleys)[LETTERS == "V"]
    np.testing.assert_allclose(rest, np.radians(angles), rtol=1e-15)
    np.testing.assert_array_equal(case.actuated_creases, np.arange(len(LETTERS)))


def test_all_leaves_out_flat_creases() -> None:
    letters = ["F", "U", *PATTERN.assignments[2:]]
    with_flat = fd.Pattern(PATTERN.vertices, PATTERN.faces, letters)
    case = Case(fd.discretize(with_flat, SHEET, preset="plate"), loads=[Actuate("all", 180)])
    np.testing.assert_array_equal(case.actuated_creases, np.arange(1, len(letters)))
    # flattening: every rest angle of the others becomes pi
    ((change, _),) = case.actuation_terms
    rest = case.structure.fold_rest + change
    np.testing.assert_allclose(rest[1:], np.pi, rtol=1e-15)
    assert rest[0] == case.structure.fold_rest[0]


def test_equal_histories_are_one_term_and_no_force() -> None:
    loads = [
        Actuate(0, 100, Ramp(1.0)),
        Gravity((0, 0, -9.81)),
        Actuate([1], 110, Ramp(1.0)),
        Force([5], (1, 0, 0)),
        Actuate([2], 120, Harmonic(2.0)),
    ]
    case = Case(STRUCTURE, [Fix("xmin")], loads)
    (one, first), (other, second) = case.actuation_terms
    assert (first, second) == (Ramp(1.0), Harmonic(2.0))
    np.testing.assert_array_equal(np.flatnonzero(one), [0, 1])
    np.testing.assert_array_equal(np.flatnonzero(other), [2])
    assert len(case.load_terms) == len(case.force_terms) == len(case.gravity_terms) == 1
    np.testing.assert_array_equal(case.loaded_nodes, [5])


@pytest.mark.parametrize("angle", [0, 360.0, [120, 360]])
def test_closed_creases_need_a_law_that_allows_them(angle) -> None:
    load = Actuate([0, 1], angle)
    with pytest.raises(InputError, match=r"loads\[0\]\.angle = (0|360): .*infinite moment"):
        Case(STRUCTURE, loads=[load])
    for law in (fd.EnhancedLinear(rest="as_published"), "linear"):
        structure = fd.discretize(PATTERN, SHEET, fold_law=law, preset="plate")
        ((change, _),) = Case(structure, loads=[load]).actuation_terms
        rest = np.degrees(structure.fold_rest + change)[:2]
        np.testing.assert_allclose(rest, np.broadcast_to(angle, 2), atol=1e-12)


def test_equal_actuations_compare_equal() -> None:
    assert Actuate([1, 2], np.array([60, 70])) == Actuate((1, 2), (60.0, 70.0))
    assert Actuate(1, 60) == Actuate([1], np.array(60.0))
    assert Actuate("all", 60) != Actuate("all", 61)


FLAT = fd.discretize(
    fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)]), SHEET, preset="plate"
)
PANEL = fd.discretize(
    fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2, 3)]), SHEET, preset="plate"
)
BARE = dataclasses.replace(STRUCTURE, pattern=None)
PUSHED = [Force([5], (1, 0, 0)), Actuate([2, 3], 90)]
WORDS = [Actuate("all", 90), Actuate("valley", 90)]


@pytest.mark.parametrize(
    ("structure", "loads", "text"),
    [
        (STRUCTURE, [Actuate([1, 24], 90)], r"= \[1, 24\]: crease 24 is out of range; .* 0 to 23"),
        (STRUCTURE, [Actuate(-1, 90)], r"loads\[0\].creases = \[-1\]: crease -1 is out of range"),
        (STRUCTURE, [*PUSHED, Actuate([4, 3], 90)], r"\[2\].creases: crease 3 is .* loads\[1\] al"),
        (STRUCTURE, WORDS, r"loads\[1\].creases: crease \d+ is actuated by loads\[0\] already"),
        (STRUCTURE, [Actuate([2, 3], [90])], r"loads\[0\].angle = .* 1 value for 2 creases; give"),
        (STRUCTURE, [Actuate("all", [90, 90])], r"2 values for 24 creases"),
        (STRUCTURE, [Actuate("valleys", 90)], r"= \"valleys\": did you mean 'valley'\? this patte"),
        (PANEL, [Actuate([0], 90)], r"loads\[0\].creases = \[0\]: this structure has no folds"),
        (PANEL, [Actuate("all", 90)], r'loads\[0\].creases = "all": this structure has no folds'),
        (FLAT, [Actuate("all", 90)], r'"all": this pattern has no crease that is not flat; give'),
        (FLAT, [Actuate("valley", 90)], r'"valley": this pattern has no crease assigned valley;'),
        (BARE, [Actuate("all", 90)], r'"all": this structure has no pattern with assignments; giv'),
    ],
)
def test_creases_that_a_structure_does_not_have(structure, loads, text) -> None:
    with pytest.raises(InputError, match=text):
        Case(structure, loads=loads)


def test_a_structure_without_a_pattern_takes_crease_numbers() -> None:
    case = Case(BARE, loads=[Actuate([2], 90)])
    np.testing.assert_array_equal(np.flatnonzero(case.actuation_terms[0][0]), [2])


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Actuate("", 90), r'creases = "": give crease numbers, as in \[0, 1\], or one of'),
        (lambda: Actuate([], 90), r'creases = \[\]: must be crease numbers, as .* or one of "all"'),
        (lambda: Actuate([True], 90), "true is not a crease number"),
        (lambda: Actuate([1, 1], 90), r"creases = \[1, 1\]: crease 1 is listed twice"),
        (lambda: Actuate(0, -1), "angle = -1: must lie between 0 and 360 degrees"),
        (lambda: Actuate([0, 1], [90, 400]), r"angle\[1\] = 400: must lie between"),
        (lambda: Actuate(0, np.nan), "angle = nan: must be a finite number"),
        (lambda: Actuate(0, []), r"angle = \[\]: must be a number, or a list of one per crease"),
        (lambda: Actuate(0, 90, 1.0), "history = 1.0: must be a history"),
    ],
)
def test_wrong_input(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()
