"""Stiffness and rest angles of creases by assignment."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
MIURA = fd.patterns.miura((2, 1), 1.0, b=0.7, panel_angle=65, dihedral=80)
LETTERS = np.array(MIURA.assignments)
LENGTH = np.linalg.norm(np.diff(MIURA.vertices[MIURA.creases], axis=1)[:, 0], axis=1)
discretize = partial(fd.discretize, preset="herkal")  # folds of the creases alone
MODELS = [discretize, lambda *args, **options: fd.shell(*args, divisions=2, **options)]


@pytest.mark.parametrize("make", MODELS)
def test_each_family_has_its_own(make):
    """Those that are not named keep the calibration."""
    plain, mountain = make(MIURA, SHEET), LETTERS == "M"
    s = make(MIURA, SHEET, crease_stiffness={"valley": 0.2}, crease_rest={"valley": 95})
    np.testing.assert_array_equal(s.fold_stiffness[mountain], plain.fold_stiffness[mountain])
    np.testing.assert_allclose(s.fold_stiffness[~mountain], 0.2 * LENGTH[~mountain], rtol=1e-14)
    rest = np.where(mountain, plain.fold_rest, np.radians(95))
    np.testing.assert_allclose(s.fold_rest, rest, rtol=1e-14)
    both = make(MIURA, SHEET, crease_stiffness={"mountain": 0.1, "valley": 0.2}).fold_stiffness
    np.testing.assert_allclose(both, np.where(mountain, 0.1, 0.2) * LENGTH, rtol=1e-14)


def test_flat_creases_are_a_family():
    flat = fd.Pattern(MIURA.vertices, MIURA.faces, ["F", "U", *LETTERS[2:]])
    plain = discretize(flat, SHEET)
    s = discretize(flat, SHEET, crease_stiffness={"flat": 7.0})
    assert s.fold_stiffness[0] == pytest.approx(7.0 * LENGTH[0])
    np.testing.assert_array_equal(s.fold_stiffness[1:], plain.fold_stiffness[1:])


def test_a_closed_crease_needs_a_rest_angle_of_its_family():
    """Folded flat upon itself as drawn; its family's rest angle opens it."""
    shut = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.2, 0.1, 0), (0.2, 0.9, 0)],
                      [(0, 1, 2, 3), (2, 1, 4, 5)], {(1, 2): "V"})  # fmt: skip
    with pytest.raises(InputError, match="folded flat upon itself"):
        fd.discretize(shut, SHEET, preset="plate")
    s = fd.discretize(shut, SHEET, crease_rest={"valley": 20}, preset="plate")
    assert np.degrees(s.fold_rest) == pytest.approx([20.0])


def test_the_mapping_is_copied():
    given = {"mountain": 0.1}
    s = fd.discretize(MIURA, SHEET, crease_stiffness=given, preset="plate")
    given["mountain"] = 5.0
    assert s.options.crease_stiffness == {"mountain": 0.1}


@pytest.mark.parametrize("make", MODELS)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"crease_stiffness": {"montain": 1}}, "did you mean 'mountain'"),
        ({"crease_stiffness": {"flat": 1}}, "crease_stiffness.flat: this pattern has no crease"),
        ({"crease_stiffness": {"valley": -1}}, "crease_stiffness: must not be negative"),
        ({"crease_stiffness": {"valley": "1"}}, "crease_stiffness.valley = .*must be a number"),
        ({"crease_stiffness": {}}, "crease_stiffness: give a value by assignment or family"),
        ({"crease_stiffness": True}, "crease_stiffness = true"),
        ({"crease_rest": {"valley": 360}}, "crease_rest = 360: must lie between 0 and 360"),
    ],
)
def test_wrong_families(make, options, message):
    with pytest.raises(InputError, match=message):
        make(MIURA, SHEET, **options)
