"""Drawings with faces: joined where they meet, letters and angles of their edges, winding."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import listed

from foldyn.errors import InputError
from foldyn.formats.building import built
from foldyn.patterns import eggbox, kresling, miura, simple_fold

FOLD = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
FACES = [[0, 1, 4, 3], [1, 2, 5, 4]]


def soup(pattern):
    """Panels that share no vertices, as some programs write meshes."""
    vertices = np.concatenate([pattern.vertices[list(face)] for face in pattern.faces])
    ends = np.cumsum([len(face) for face in pattern.faces])
    faces = [range(end - len(face), end) for face, end in zip(pattern.faces, ends, strict=True)]
    return listed(vertices, faces)


@pytest.mark.parametrize(
    "pattern", [miura(cells=(2, 2)), miura(dihedral=180), eggbox(), kresling(storeys=2)]
)
def test_panels_without_common_vertices_are_joined(pattern):
    found = built(soup(pattern))
    p = found.pattern
    assert (len(p.vertices), len(p.edges)) == (len(pattern.vertices), len(pattern.edges))
    assert sorted(p.dihedrals) == pytest.approx(sorted(pattern.dihedrals))
    merged = sum(len(face) for face in pattern.faces) - len(pattern.vertices)
    assert f"merged {merged} vertices where panels meet" in found.diagnosis.repairs


def test_layers_stay_apart():
    # two squares hinged and closed: their free edges lie in one place, and are no seam
    vertices = [[1, 0], [0, 0], [1, 0], [1, 1], [0, 1], [1, 1]]
    found = built(listed(vertices, FACES, [(1, 4)], "M"))
    assert len(found.pattern.vertices) == 6
    assert found.pattern.dihedrals[0] == 2 * np.pi
    assert found.diagnosis.repairs == ()


APART = [[0, 0, 0], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0], [1, 0, 0.5], [2, 0, 0], [2, 1, 0],
         [1, 1, 0.5]]  # fmt: skip


@pytest.mark.parametrize(("letters", "creases"), [("CC", 0), ("BB", 0), ("", 1), ("MM", 1)])
def test_what_the_file_calls_boundary_stays_apart(letters, creases):
    edges = [(1, 2), (4, 7)] if letters else []
    found = built(listed(APART, [[0, 1, 2, 3], [4, 5, 6, 7]], edges, letters))
    assert len(found.pattern.creases) == creases
    assert found.diagnosis.doubts == ()


def test_a_cut_between_panels_opens():
    vertices = [*FOLD, [0, 2], [1, 2], [2, 2]]
    faces = [*FACES, [3, 4, 7, 6], [4, 5, 8, 7]]
    edges = [(1, 4), (3, 4), (4, 5), (4, 7)]
    found = built(listed(vertices, faces, edges, "MCVV"))
    p = found.pattern
    assert len(p.vertices) == 10 and p.assignments == ("M", "V", "V")
    assert "opened 1 cut edge: each is two boundary edges" in found.diagnosis.repairs
    assert found.diagnosis.doubts == ()  # no seam is doubted


def test_boundary_edges_of_two_panels():
    found = built(listed(FOLD, FACES, [(1, 4), (0, 1)], "BB"))
    assert found.pattern.assignments == ("U",)
    assert "all edges are given as the boundary: the 1 of two panels" in found.diagnosis.doubts[0]
    found = built(listed(FOLD, FACES, [(1, 4), (0, 1)], "BM"))
    assert len(found.pattern.creases) == 0
    assert "1 boundary edge of two panels taken as cuts" in found.diagnosis.doubts


def test_joins_are_flat():
    assert built(listed(FOLD, FACES, [(1, 4)], "J")).pattern.assignments == ("F",)


def test_missing_letters_follow_the_dihedral():
    p = simple_fold(dihedral=60)
    assert built(listed(p.vertices, p.faces)).pattern.assignments == ("M",)


def test_letters_that_contradict():
    found = built(listed(FOLD, FACES, [(1, 4), (4, 1)], "MV", places=("a", "b")))
    assert found.pattern.assignments == ("M",)
    assert found.diagnosis.doubts[0].startswith("a and b lie in one place")


def test_panels_are_turned_over_where_every_letter_says_so():
    p = miura(cells=(2, 2))
    turned = [face[::-1] for face in p.faces]
    found = built(listed(p.vertices, turned, p.creases, p.assignments))
    q = found.pattern
    assert q.assignments == p.assignments
    assert q.dihedrals == pytest.approx(p.dihedrals)
    assert "turned all panels over" in found.diagnosis.repairs[0]
    assert found.diagnosis.doubts == ()


def test_single_letters_that_contradict_are_doubted():
    p = miura(cells=(2, 2))
    letters = ["MV"[p.assignments[0] == "M"], *p.assignments[1:]]
    found = built(listed(p.vertices, p.faces, p.creases, letters))
    assert "is given as" in found.diagnosis.doubts[0]
    assert found.diagnosis.repairs == ()


def test_inconsistent_winding():
    p = miura(cells=(2, 2))
    faces = [face[::-1] if k % 3 == 1 else face for k, face in enumerate(p.faces)]
    found = built(listed(p.vertices, faces, p.creases, p.assignments))
    assert found.pattern.dihedrals == pytest.approx(p.dihedrals)


def test_panels_listed_twice_and_collapsed():
    faces = [*FACES, [4, 3, 0, 1], [0, 1, 1], [2, 2, 2, 5]]
    found = built(listed(FOLD, faces))
    assert len(found.pattern.faces) == 2
    assert "left out 3 panels listed twice or of fewer than 3 corners" in found.diagnosis.repairs


def test_repeated_corners():
    assert built(listed(FOLD, [[0, 1, 1, 4, 3, 0], FACES[1]])).pattern.faces[0] == (0, 1, 4, 3)


def test_edges_of_no_panel():
    found = built(listed(FOLD, FACES, [(1, 4), (0, 5)], "MV"))
    assert "left out 1 line that bound no panel" in found.diagnosis.repairs


def test_fold_angles_in_radians():
    found = built(listed(FOLD, FACES, [(4, 1)], "V", [120]))
    assert found.pattern.fold_angles[0] == pytest.approx(2 * np.pi / 3)
    found = built(listed(FOLD, FACES, [(4, 1)], "V", [-120]))
    assert found.pattern.fold_angles[0] == pytest.approx(2 * np.pi / 3)
    assert "turned the signs" in found.diagnosis.repairs[0]


def test_unused_vertices_are_kept():
    assert len(built(listed([*FOLD, [9, 9]], FACES)).pattern.vertices) == 7


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ([], "faces is empty"),
        ([[0, 1]], "at least 3 distinct"),
        ([[0, 1, 2]], "has no area"),
        ([[0, 4, 2, 3]], "crosses itself|has no area"),
    ],
)
def test_refused(faces, message):
    with pytest.raises(InputError, match=message):
        built(listed(FOLD, faces))


def test_the_text_of_a_diagnosis():
    p = miura(cells=(1, 2), dihedral=180)
    # three vertices inside, of four mountains each
    text = str(built(listed(p.vertices, p.faces, p.creases, "M" * len(p.creases))).diagnosis)
    assert text.startswith("size: ") and " m\n" in text
    assert "doubts: none" in text
    assert "vertices inside: 3; Maekawa holds at 0, Kawasaki at 3, developable 3" in text
    assert "       4     4     0     0     0.000     0.000  Maekawa" in text


BRICK = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 1, 0], [1, 2, 0], [2, 2, 0], [0, 2, 0]]
WALL = [[0, 1, 2, 3], [3, 4, 5, 7], [4, 2, 6, 5]]
"""Two panels on one whose upper edge is whole."""


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("turn", [0.0, 60.0])
def test_a_vertex_inside_an_edge_divides_it(apart, turn):
    """Flat and folded along the edge, with common vertices and without."""
    vertices = np.array(BRICK, dtype=float)
    up = vertices[:, 1] > 1.0
    way = np.radians(turn)
    vertices[up] = np.column_stack(
        [vertices[up, 0], 1 + np.cos(way) * np.ones(up.sum()), np.sin(way) * np.ones(up.sum())]
    )
    faces = WALL
    if apart:
        vertices, faces = vertices[np.concatenate(WALL)], np.arange(12).reshape(3, 4).tolist()
    found = built(listed(vertices, faces))
    p = found.pattern
    assert (len(p.vertices), len(p.creases)) == (8, 3)
    assert sorted(len(face) for face in p.faces) == [4, 4, 5]
    assert sorted(np.degrees(p.dihedrals)) == pytest.approx(sorted([180.0, *[180.0 - turn] * 2]))
    told = "divided edges of panels at 1 vertex of others that lie in them"
    assert told in found.diagnosis.repairs


def test_pieces_of_a_divided_edge_have_its_letter_or_their_own():
    found = built(listed(BRICK, WALL, [(2, 3), (2, 4), (4, 5)], "MVU", [-90, 45, np.nan]))
    p = found.pattern
    told = dict(zip(map(tuple, p.creases.tolist()), p.assignments, strict=True))
    assert told == {(2, 4): "V", (3, 4): "M", (4, 5): "U"}
    angles = dict(zip(told, np.degrees(p.fold_angles), strict=True))
    assert angles[2, 4] == pytest.approx(45) and angles[3, 4] == pytest.approx(-90)
    assert not any("bound no panel" in text for text in found.diagnosis.repairs)


@pytest.mark.parametrize("letter", "BC")
def test_an_edge_that_the_file_calls_boundary_or_cut_stays_whole(letter):
    found = built(listed(BRICK, WALL, [(2, 3)], letter))
    assert len(found.pattern.creases) == 1  # between the two upper panels
    assert found.diagnosis.repairs == ()


def test_bricks_that_overlap_by_half_are_divided_on_both_sides():
    vertices = [[x, y, 0] for y in (0, 1) for x in (0, 2, 4)] + [[x, y, 0] for y in (1, 2)
                for x in (-1, 1, 3)]  # fmt: skip
    faces = [[0, 1, 4, 3], [1, 2, 5, 4], [6, 7, 10, 9], [7, 8, 11, 10]]
    found = built(listed(vertices, faces))
    assert len(found.pattern.creases) == 5
    assert found.diagnosis.repairs[0].startswith("divided edges of panels at 4 vertices")


@pytest.mark.parametrize("off", [0.0, 2e-6])
def test_a_vertex_on_an_edge_of_another_layer_does_not_divide_it(off):
    """A small flap folded back upon a large panel, its free edge along that of the panel."""
    vertices = [[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0], [1, off, off], [2, 0, 0], [2, 1, 0],
                [1, 1, off]]  # fmt: skip
    found = built(listed(vertices, [[0, 1, 2, 3], [4, 5, 6, 7]]))
    assert [len(face) for face in found.pattern.faces] == [4, 4]
    assert found.diagnosis.repairs == ()


def test_an_edge_that_three_panels_would_meet_at_stays_whole():
    vertices = [[0, 0, 0], [2, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]]
    faces = [[0, 2, 3], [0, 2, 4], [0, 1, 5]]
    found = built(listed(vertices, faces))
    assert sorted(len(face) for face in found.pattern.faces) == [3, 3, 3]
