"""Creases that fold to an angle, a fold angle or a fraction: what is meant, and what is refused."""

from __future__ import annotations

from tomllib import loads

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT
from foldyn.cases.loads import LOAD
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
PATTERN = fd.patterns.miura((2, 1), dihedral=100)
LETTERS = np.array(PATTERN.assignments)
MAKERS = [fd.discretize, lambda *args, **options: fd.shell(*args, divisions=2, **options)]


def reached(load: fd.Actuate, structure: fd.Structure | None = None) -> np.ndarray:
    """Rest dihedrals (degrees) at factor 1; nan of creases that the load leaves alone."""
    structure = structure or fd.discretize(PATTERN, SHEET, preset="plate")
    case = fd.Case(structure, loads=[load])
    ((change, _),) = case.actuation_terms
    angles = np.degrees(structure.fold_rest + change)
    angles[np.setdiff1d(np.arange(len(angles)), case.actuated_creases)] = np.nan
    return angles


@pytest.mark.parametrize("make", MAKERS)
def test_one_fold_angle_of_a_word_is_a_size(make):
    for word, valley in (("all", 110.0), ("mountain", np.nan)):
        found = reached(fd.Actuate(word, fold_angle=70), make(PATTERN, SHEET))
        np.testing.assert_allclose(found, np.where(LETTERS == "V", valley, 250.0), rtol=1e-14)


def test_fold_angles_of_numbers_have_their_sign():
    found = reached(fd.Actuate([3, 0], fold_angle=-30))
    np.testing.assert_allclose(found[[0, 3]], 210.0, rtol=1e-14)
    found = reached(fd.Actuate([3, 0], fold_angle=[170, -170]))
    np.testing.assert_allclose(found[[3, 0]], [10.0, 350.0], rtol=1e-13)


def test_a_list_of_fold_angles_of_a_word_has_their_signs():
    """The fold angles of another Miura, crease by crease."""
    other = fd.patterns.miura((2, 1), dihedral=60)
    found = reached(fd.Actuate("all", fold_angle=180.0 - np.degrees(other.dihedrals)))
    np.testing.assert_allclose(found, np.degrees(other.dihedrals), rtol=1e-13)


@pytest.mark.parametrize("fraction", [0.8, "80%", " 80 %", "8e1%"])
def test_a_fraction_folds_each_crease_its_own_way(fraction):
    found = reached(fd.Actuate("all", fraction=fraction))
    np.testing.assert_allclose(found, np.where(LETTERS == "V", 36.0, 324.0), rtol=1e-13)
    assert fd.Actuate("all", fraction=fraction).fraction == pytest.approx(0.8, rel=1e-15)


@pytest.mark.parametrize("given", [{"fraction": 1}, {"fraction": "100%"}, {"fold_angle": 180}])
def test_fully_folded_needs_a_law_that_allows_it(given):
    with pytest.raises(InputError, match=r"loads\[0\]\.(fraction = 1|fold_angle = 180): this fold"):
        reached(fd.Actuate("all", **given))
    mountain = fd.Actuate(int(np.flatnonzero(LETTERS == "M")[0]), fold_angle=-180)
    with pytest.raises(InputError, match=r"loads\[0\]\.fold_angle = -180: this fold law"):
        reached(mountain)  # is named by its own fold angle
    found = reached(
        fd.Actuate("all", **given), fd.discretize(PATTERN, SHEET, fold_law="linear", preset="plate")
    )
    np.testing.assert_allclose(found, np.where(LETTERS == "V", 0.0, 360.0), atol=1e-13)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "angle: missing; give it"),
        ({"angle": 90, "fraction": 0.5}, "fraction: give only one of angle and fraction"),
        ({"fold_angle": 90, "fraction": 0.5}, "fraction: give only one of fold_angle and fraction"),
        ({"fold_angle": 181}, "fold_angle = 181: must lie between -180 and 180 degrees"),
        ({"fold_angle": [0, -200]}, r"fold_angle\[1\] = -200: must lie"),
        ({"fraction": 1.2}, "fraction = 1.2: must be at most 1"),
        ({"fraction": -0.1}, "fraction = -0.1: must be at least 0"),
        ({"fraction": "120%"}, "fraction = 1.2: must be at most 1"),
        ({"fraction": "80"}, 'fraction = "80": must be as in "80%"'),
        ({"fraction": "most%"}, 'fraction = "most%": must be as in "80%"'),
    ],
)
def test_wrong_arguments(given, message):
    with pytest.raises(InputError, match=message):
        fd.Actuate("all", **given)


@pytest.mark.parametrize(
    ("load", "message"),
    [
        (fd.Actuate("valley", fold_angle=-10), r"loads\[0\].fold_angle = -10: must be at least 0"),
        (fd.Actuate([0, 1], fold_angle=[1]), r"fold_angle = .*1 value for 2 creases"),
        (fd.Actuate([0, 1], fraction=0.5), r"loads\[0\].fraction: a crease is flat, so it"),
        (fd.Actuate("all", fraction=0.5), r"fraction: a crease is unassigned"),
        (fd.Actuate("all", fold_angle=5), r"fold_angle: a crease is unassigned"),
    ],
)
def test_creases_that_cannot_fold_so(load, message):
    letters = ["F", "U", *PATTERN.assignments[2:]]
    structure = fd.discretize(
        fd.Pattern(PATTERN.vertices, PATTERN.faces, letters), SHEET, preset="plate"
    )
    with pytest.raises(InputError, match=message):
        fd.Case(structure, loads=[load])


@pytest.mark.parametrize(
    "key", ["angle = 100", "fold_angle = 80.5", 'fraction = "45%"', "fold_angle = [80.5, -3]"]
)
def test_from_a_table_and_back(key):
    load = LOAD("", loads(f"creases = [0, 1]\n{key}"))
    assert LOAD("", load.table()) == load
    assert len(load.table()) == 2


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["", 'kind = "shell"\ndivisions = 2'])
def test_from_a_case_file_to_a_result_and_back(model, read, kept):
    case_file = read(f"""{FOLD_TEXT}[model]
{model}
[[supports]]
nodes = [0, 1, 2]
[[loads]]
creases = "all"
fraction = "25%"
[analysis]
kind = "statics"
method = "displacement"
load_factors = [0.5, 1]
""")
    case = kept(case_file.run())
    assert case.loads == (fd.Actuate("all", fraction=0.25),)
    (change, _), (own, _) = (one.actuation_terms[0] for one in (case, case_file.case()))
    np.testing.assert_array_equal(change, own)
