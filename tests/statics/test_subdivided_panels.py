"""Panels cut from their middles: the same sheet, which bends where whole panels stretch."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.statics.folding.subdivision import subdivided

CRANE = Path(__file__).resolve().parents[2] / "examples" / "patterns" / "crane.fold"


def vertex(sectors, letters):
    """Creases of unit length that meet at one vertex with these sector angles (degrees)."""
    way = np.radians(np.cumsum([0.0, *sectors[:-1]]))
    rim = np.column_stack([np.cos(way), np.sin(way)])
    n = len(sectors)
    faces = [(0, 1 + k, 1 + (k + 1) % n) for k in range(n)]
    creases = {(0, 1 + k): letter for k, letter in enumerate(letters)}
    angles, families = {(0, 1): 1.0}, {"first": [(0, 1), (0, 2)]}
    return fd.Pattern(
        np.vstack([[0, 0], rim]), faces, creases, fold_angles=angles, families=families
    )


def test_a_subdivided_pattern_is_the_same_sheet():
    pattern = vertex([40, 100, 140, 80], "MVVV")
    fine, rows = subdivided(pattern)
    np.testing.assert_array_equal(fine.vertices[:5], pattern.vertices)
    assert fine.face_areas.sum() == pytest.approx(pattern.face_areas.sum(), rel=1e-14)
    assert len(fine.faces) == 6 * len(pattern.faces) and len(fine.creases) == 8
    # each crease is two halves with what the crease has; all else inside is the sheet
    np.testing.assert_array_equal(np.bincount(rows), [2, 2, 2, 2])
    assert list(fine.assignments) == [pattern.assignments[k] for k in rows]
    np.testing.assert_array_equal(fine.fold_angles, pattern.fold_angles[rows])
    np.testing.assert_array_equal(np.unique(rows[fine.families["first"]]), [0, 1])
    assert len(fine.edges) == len(fine.creases) + len(fine.boundary) + len(fine.welds)
    lengths = np.linalg.norm(np.diff(fine.vertices[fine.creases], axis=1), axis=2)
    np.testing.assert_allclose(lengths, 0.5)


@pytest.mark.matrix
def test_a_driven_crease_is_driven_as_a_whole():
    folding = fd.fold(vertex([90] * 4, "VVVM"), {(0, 1): 60}, steps=4, panels="subdivided")
    driven = np.isfinite(folding.targets)
    assert driven.sum() == 2 and not folding.wrong
    np.testing.assert_allclose(np.degrees(folding.angles[driven]), 60.0, atol=0.5)
    assert folding.strain < 1e-3
    assert len(folding.pattern.vertices) == 5 + 8 + 4 == folding.path.sizes["node"]


def test_letters_that_plane_panels_forbid_fold_by_bending():
    # the odd crease is not beside the smallest sector, which four rigid panels do not allow
    pattern = vertex([40, 100, 140, 80], "VVMV")
    with pytest.warns(FoldynWarning, match="do not turn their way"):
        whole = fd.fold(pattern, 30, steps=3)
    assert whole.wrong
    bent = fd.fold(pattern, 30, steps=3, panels="subdivided")
    assert not bent.wrong and math.degrees(bent.bend) > 5.0


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:panels pass through")
@pytest.mark.filterwarnings("ignore:.* creases stay closed")
@pytest.mark.filterwarnings("ignore:pattern. its welds")
def test_a_crane_opens_from_its_folded_state_with_every_crease_its_way():
    flat = fd.read_pattern(CRANE)
    folding = fd.fold(flat, fraction=0.9, initial="folded", steps=2, panels="subdivided")
    assert len(folding.angles) == 186 and not folding.wrong
    turned = np.degrees(np.abs(folding.angles))
    assert turned.min() > 150.0 and turned.max() < 180.0
    assert folding.strain < 2e-3 and math.degrees(folding.bend) < 20.0
    # its own bends are no creases, so that a structure can be made of it
    structure = fd.discretize(folding.pattern, fd.Sheet(1.2e9, 0.2, 1e-4, 700.0), preset="plate")
    assert len(structure.folds) == 186


LINE = [(0, 0), (1, -1e-6), (2, 0), (1, 50), (-1, 25)]  # three corners are on a line


@pytest.mark.parametrize(
    ("pattern", "panels", "message"),
    [
        (vertex([90] * 4, "VVVM"), "fine", 'panels = "fine": choose one of whole'),
        (
            fd.Pattern(LINE, [(0, 1, 2, 3), (0, 3, 4)], ["V"]),
            "subdivided",
            r"panels = .*: panel 0 has three corners on a line",
        ),
    ],
)
def test_what_panels_are_is_checked(pattern, panels, message):
    with pytest.raises(InputError, match=message):
        fd.fold(pattern, 30, panels=panels)
