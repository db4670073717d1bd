"""Maekawa, Kawasaki and developability, on vertices whose angles are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foldyn.patterns import Pattern, eggbox, kresling, miura, welded
from foldyn.patterns.flat_foldability import flat_foldability


def vertex(degrees, letters):
    """Pattern around the vertex 0, with sectors of the given angles before each crease."""
    turned = np.radians(np.cumsum(degrees))
    rim = np.column_stack((np.cos(turned), np.sin(turned)))
    n = len(degrees)
    faces = [[0, 1 + k, 1 + (k + 1) % n] for k in range(n)]
    return Pattern([[0, 0], *rim], faces, {(0, 1 + k): letter for k, letter in enumerate(letters)})


@pytest.mark.matrix
@given(
    st.lists(st.floats(25, 65), min_size=6, max_size=6).map(lambda a: np.array(a) * 360 / sum(a)),
    st.permutations("MMMMVV"),
)
def test_kawasaki_is_the_alternating_sum(degrees, letters):
    found = flat_foldability(vertex(degrees, letters))
    expected = abs(np.radians(degrees[::2].sum() - degrees[1::2].sum()))
    assert found.alternating[0] == pytest.approx(expected, abs=1e-12)
    assert found.maekawa[0]


def test_fulfilled_where_every_other_angle_makes_a_half_turn():
    degrees = [20, 35, 70, 100, 90, 45]
    found = flat_foldability(vertex(degrees, "MMMMVV"))
    assert found.alternating[0] < 1e-14
    assert not flat_foldability(vertex([21, 34, 70, 100, 90, 45], "MMMMVV")).kawasaki(1e-3)[0]


@pytest.mark.parametrize(
    ("letters", "holds"),
    [("MMMV", True), ("VVVM", True), ("MMVV", False), ("MMMM", False), ("MUUV", True),
     ("MMUU", True), ("MMMU", True), ("MMVU", True), ("FFFF", True), ("MMFF", True),
     ("MVFF", False), ("MFFF", False)],
)  # fmt: skip
def test_maekawa(letters, holds):
    # with letters to be given, it holds where some choice makes the difference 2
    assert flat_foldability(vertex([80, 100, 80, 100], letters)).maekawa[0] == holds


def test_flat_creases_do_not_part_angles():
    # a straight mountain with flat creases beside it: two angles of 180 degrees
    found = flat_foldability(vertex([50, 130, 50, 130], "MFMF"))
    assert found.alternating[0] < 1e-12 and found.degrees[0] == 2
    assert flat_foldability(vertex([50, 130, 60, 120], "FFFF")).alternating[0] == 0.0


def test_odd_degree_never_folds_flat():
    found = flat_foldability(vertex([120, 120, 120], "MMV"))
    assert np.isnan(found.alternating[0])
    assert not found.kawasaki(9.0)[0] and not found.maekawa[0]


def test_folding_does_not_change_it():
    flat, folded = (flat_foldability(miura(cells=(2, 3), dihedral=d)) for d in (180, 70))
    assert flat.vertices.tolist() == folded.vertices.tolist()
    for found in (flat, folded):
        assert len(found.vertices) == 3 * 5  # of the 5 x 7 vertices
        assert found.developable(1e-12).all()
        assert found.kawasaki(1e-12).all()
    assert folded.maekawa.all()


def test_the_eggbox_has_cones_and_saddles():
    # corners of parallelograms: four of 60 degrees at each apex, four of 120 at each saddle
    found = flat_foldability(eggbox(cells=(2, 2), panel_angle=60))
    degrees = np.degrees(found.deficits).round(9)
    assert set(degrees.tolist()) == {120.0, -120.0}
    assert not found.developable(1.0).any()


def test_a_reflex_corner():
    # an L of three squares, and the square that completes it: the corner inside has 270 degrees
    vertices = [[1, 1], [2, 1], [2, 2], [1, 2], [0, 2], [0, 0], [2, 0]]
    p = Pattern(vertices, [[0, 1, 2, 3], [0, 3, 4, 5, 6, 1]], {(0, 1): "M", (0, 3): "M"})
    found = flat_foldability(p)
    assert found.vertices.tolist() == [0]
    assert abs(found.deficits[0]) < 1e-12
    assert np.degrees(found.alternating[0]) == pytest.approx(180)


def test_no_vertex_inside():
    assert len(flat_foldability(kresling(storeys=1)).vertices) == 0


def test_panels_that_meet_in_a_point_alone_have_no_vertex_inside():
    vertices = [[0, 0], [1, 0], [1, 1], [-1, 0], [-1, -1]]
    assert len(flat_foldability(Pattern(vertices, [[0, 1, 2], [0, 3, 4]])).vertices) == 0


def test_welds_count_as_lines_that_do_not_fold():
    pattern = vertex([60, 40, 50, 120, 90], "MFMMV")
    line = welded(pattern, join=False)
    assert len(line.welds) == 1
    found, expected = flat_foldability(line), flat_foldability(pattern)
    for name, values in vars(expected).items():
        np.testing.assert_array_equal(getattr(found, name), values)
