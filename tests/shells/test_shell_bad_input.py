"""What is refused, and what it says."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.shells import shell

SHEET = fd.Sheet(1e6, 0.25, 0.01)
FOLD = fd.patterns.simple_fold(1.0, 1.0, dihedral=60)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"divisions": 0}, r"divisions = 0: must be a whole number, at least 1"),
        ({"divisions": 2.5}, r"divisions = 2.5: must be a whole number"),
        ({"mass": "panel"}, r'mass = "panel": choose one of lumped, consistent'),
        ({"clamped": [(0, 2), (2, 3)]}, r"clamped: \(2, 3\) is not a boundary edge"),
        ({"clamped": [(0, 9)]}, r"clamped: \(0, 9\) is not a boundary edge"),
        ({"clamped": (0, 1)}, r"clamped = \[0, 1\]: give pairs of vertices, as in"),
        ({"clamped": [("a", "b")]}, r"clamped = .*: give pairs of vertices, as in"),
        ({"fold_law": "rubber"}, r"fold_law"),
        ({"crease_stiffness": -1.0}, r"crease_stiffness: must not be negative"),
        ({"crease_stiffness": [1.0, 2.0]}, r"crease_stiffness: 2 values for 1 creases"),
        ({"crease_rest": 0.0}, r"crease_rest = 0: must lie between 0 and 360 degrees"),
        ({"crease_rest": [10.0, 20.0]}, r"crease_rest: 2 values for 1 creases"),
    ],
)
def test_options(options, message):
    with pytest.raises(InputError, match=message):
        shell(FOLD, SHEET, **options)


def test_pattern_and_sheet():
    with pytest.raises(InputError, match="pattern: got str, give a Pattern"):
        shell("miura", SHEET)
    with pytest.raises(InputError, match="sheet: got float, give a Sheet"):
        shell(FOLD, 1e6)


def test_mass_needs_a_density():
    s = shell(FOLD, SHEET, divisions=1)
    with pytest.raises(InputError, match="density is missing: give it"):
        _ = s.mass


def test_a_pattern_folded_flat_needs_an_opening():
    flat = fd.Pattern([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1e-12, 1, 0]], [[0, 1, 2], [1, 0, 3]])
    with pytest.raises(InputError, match="folded flat upon itself"):
        shell(flat, SHEET, divisions=2)


def test_whole_numbers_of_any_kind_are_good():
    assert len(shell(FOLD, SHEET, divisions=np.int64(2)).triangles) == 16
    assert shell(FOLD, SHEET, clamped=[(1, 0)], divisions=1).options.clamped == ((0, 1),)


def test_it_says_what_it_is():
    text = repr(shell(FOLD, SHEET, divisions=4, mass="consistent"))
    assert text == "<Shell: 45 nodes, 64 triangles, 1 folds, mass consistent>"


def test_arrays_cannot_be_changed():
    s = shell(FOLD, SHEET, divisions=1)
    for array in (s.nodes, s.triangles, s.triangle_panel, s.fold_stiffness, s.piece_rest):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
