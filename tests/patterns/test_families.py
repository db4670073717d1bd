"""Families of creases by name, wherever creases are given."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.crease_data import crease_rows

MIURA = fd.patterns.miura((2, 2), 0.03, b=0.03, panel_angle=60, dihedral=80)
ZIGZAG, STRAIGHT = MIURA.families["zigzag"], MIURA.families["straight"]
LETTERS = np.array(MIURA.assignments)
SHEET = fd.Sheet(1e9, 0.3, 2e-4, 700.0)


def bars(pattern=MIURA, **options):
    return fd.discretize(pattern, SHEET, preset="herkal", **options)


def shell(pattern=MIURA, **options):
    return fd.shell(pattern, SHEET, divisions=2, **options)


@pytest.mark.parametrize("make", [bars, shell])
def test_actuated_by_family_as_by_numbers(make):
    structure = make()
    by_name = fd.Case(structure, loads=[fd.Actuate("zigzag", fold_angle=110)])
    sizes = np.where(LETTERS[ZIGZAG] == "V", 110.0, -110.0)
    by_number = fd.Case(structure, loads=[fd.Actuate(ZIGZAG.tolist(), fold_angle=sizes.tolist())])
    (one, _), (other, _) = by_name.actuation_terms[0], by_number.actuation_terms[0]
    np.testing.assert_array_equal(one, other)
    assert (one != 0.0).sum() == len(ZIGZAG)
    np.testing.assert_array_equal(by_name.actuated_creases, ZIGZAG)


def test_moments_and_damping_by_family():
    case = fd.Case(
        bars(),
        loads=[fd.CreaseMoment("straight", 1e-3)],
        damping=[fd.CreaseDamping(2e-4, "zigzag"), fd.CreaseDamping(1e-4, "valley")],
    )
    creases, moment = case.loads[0].of_creases(case.structure, "loads[0]")
    np.testing.assert_array_equal(creases, STRAIGHT)
    assert set(moment) == {1e-3}
    wanted = np.where(np.isin(np.arange(len(LETTERS)), ZIGZAG), 2e-4, 0.0)
    np.testing.assert_allclose(case.crease_damping, wanted + 1e-4 * (LETTERS == "V"))


@pytest.mark.parametrize("make", [bars, shell])
def test_stiffness_and_rest_angles_by_family(make):
    plain = make()
    named = make(crease_stiffness={"zigzag": 0.2}, crease_rest={"straight": 170, "zigzag": 190})
    length = np.linalg.norm(np.diff(MIURA.vertices[MIURA.creases], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(named.fold_stiffness[ZIGZAG], 0.2 * length[ZIGZAG])
    np.testing.assert_array_equal(named.fold_stiffness[STRAIGHT], plain.fold_stiffness[STRAIGHT])
    np.testing.assert_allclose(np.degrees(named.fold_rest[STRAIGHT]), 170)
    np.testing.assert_allclose(np.degrees(named.fold_rest[ZIGZAG]), 190)


def test_families_survive_thick_panels_and_say_where_they_are_hinged():
    flat = [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (3, 1)]
    strip = Pattern(
        flat, [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)], {(1, 5): "V", (2, 6): "M"},
        fold_angles={(1, 5): 1.0}, families={"first": [(1, 5)]}, custom={"a:b": 1},
    )  # fmt: skip
    thick = fd.thicken(strip, 0.1, offsets={"first": -0.03})
    np.testing.assert_array_equal(thick.families["first"], strip.families["first"])
    np.testing.assert_array_equal(thick.fold_angles, strip.fold_angles)
    assert thick.custom == strip.custom
    # hinged 0.03 m below the middle as told, and in the back face as a mountain is
    assert thick.vertices[[1, 5], 2] == pytest.approx(-0.03)
    assert (thick.vertices[2, 2] - thick.vertices[1, 2]) == pytest.approx(-0.02)


INLINE = """
[pattern]
vertices = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
faces = [[0, 1, 4, 3], [1, 2, 5, 4]]
assignments = ["V"]
families = { spine = [[1, 4]] }
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 2.0
[model]
preset = "herkal"
crease_stiffness = { spine = 0.1 }
[damping]
creases = { coefficient = 1e-3, creases = "spine" }
[[loads]]
creases = "spine"
fold_angle = 30
[analysis]
kind = "statics"
inertia_relief = true
steps = 2
"""


def test_families_of_a_pattern_in_a_case_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(INLINE)
    case_file = fd.read_case(path)
    assert case_file.pattern.families["spine"].tolist() == [0]
    case, found = case_file.case(), case_file.run()
    assert case.structure.fold_stiffness == pytest.approx([0.1])  # of one metre
    assert case.crease_damping == pytest.approx([1e-3])
    folds, _ = case.structure.dihedrals(found.displacement.values[-1])
    assert np.degrees(folds) == pytest.approx([150])
    for old, new, message in (
        ('creases = "spine"\nf', 'creases = "spin"\nf', r"loads\[0\]\.creases = .spin.: did you"),
        ("[[1, 4]]", "[[0, 4]]", r"families\['spine'\]: \(0, 4\) is not a crease"),
        ("spine = [[", "valley = [[", "families: 'valley' is no name for a family"),
        ("{ spine = [[1, 4]] }", "[1]", r"families = \[1\]: must be a table"),
    ):
        path.write_text(INLINE.replace(old, new))
        with pytest.raises(InputError, match=message):
            fd.read_case(path).case()


def test_letters_and_angles_of_a_pattern_by_family():
    """Pairs refine families; a size folds each crease its own way."""
    flat = fd.patterns.miura((2, 2), dihedral=180)
    a, b = flat.creases[flat.families["zigzag"][0]].tolist()
    named = flat.changed(assignments={"straight": "V", "zigzag": "M", (b, a): "V"})
    letters = np.array(named.assignments)
    assert set(letters[STRAIGHT]) == {"V"} and set(letters[ZIGZAG[1:]]) == {"M"}
    assert letters[ZIGZAG[0]] == "V"
    told = named.changed(fold_angles={"zigzag": 1.0, (a, b): 0.25, "straight": 0.5}).fold_angles
    assert set(told[ZIGZAG[1:]]) == {-1.0} and told[ZIGZAG[0]] == 0.25
    assert set(told[STRAIGHT]) == {0.5}
    only = named.changed(fold_angles={"mountain": 1.0}).fold_angles
    np.testing.assert_array_equal(np.isnan(only), letters != "M")


def test_letters_and_angles_by_family_in_a_case_file(tmp_path):
    path = tmp_path / "case.toml"
    text = INLINE.replace('["V"]', '{ spine = "M" }\nfold_angles = { spine = 90 }')
    path.write_text(text)
    pattern = fd.read_case(path).pattern
    assert pattern.assignments == ("M",) and np.degrees(pattern.fold_angles) == pytest.approx(-90)
    for old, new, message in (
        ('{ spine = "M" }', "{ spine = 1 }", "assignments = .*or a table by family"),
        ("{ spine = 90 }", '{ spine = "90" }', "fold_angles = .*or a table of sizes by family"),
        ('{ spine = "M" }', '{ spin = "M" }', "is no family; did you mean 'spine'"),
        ("{ spine = 90 }", "{ spine = -90 }", r"fold_angles.spine = -1.57.*: is a size"),
    ):
        path.write_text(text.replace(old, new))
        with pytest.raises(InputError, match=message):
            fd.read_case(path)


SHARED = {"a": MIURA.creases[:2], "b": MIURA.creases[1:3]}
KNOWN = '"all", "mountain", "valley", "flat", "unassigned", "zigzag", "straight"; give one of these'


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.Case(bars(), loads=[fd.Actuate("zig", 90)]), f"knows {KNOWN}"),
        (lambda: fd.Case(bars(), damping=fd.CreaseDamping(1.0, "ring")), '= "ring": .*knows'),
        (lambda: bars(crease_stiffness={"zigzag": 1.0, "valley": 2.0}), "a value by another name"),
        (lambda: bars(crease_rest={"sides": 90}), "crease_rest.sides: this pattern knows"),
        (lambda: bars(crease_rest={3: 90}), "crease_rest: 3 is no assignment or family"),
        (lambda: fd.thicken(MIURA, 1e-4, offsets={"rim": 0.0}), "offsets.rim: this pattern knows"),
        (lambda: fd.Actuate(" ", 90), 'creases = " ": give crease numbers'),
        (lambda: wrong({"rim": "V"}), 'rim: is no family; this pattern has "zigzag"'),
        (lambda: wrong({"valley": "V"}), "assignments.valley: is no family; this pattern has"),
        (lambda: wrong({"a": "V", "b": "M"}, families=SHARED), 'b = "M": crease .* has a letter'),
        (lambda: wrong({"zigzag": "U"}, fold_angles={"zigzag": 1.0}), "some of them are neither"),
        (lambda: crease_rows("creases", "flat", MIURA), "no crease assigned flat"),
    ],
)  # fmt: skip
def test_wrong_words(make, message):
    with pytest.raises(InputError, match=message):
        make()


def wrong(letters, **changes):
    return MIURA.changed(assignments=letters, **changes)
