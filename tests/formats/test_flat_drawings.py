"""Panels of lines: Euler's formula, areas, repairs, and what cannot be repaired."""

from __future__ import annotations

import time

import numpy as np
import pytest
from drawings import drawn, listed, square
from hypothesis import given, settings
from hypothesis import strategies as st

from foldyn.errors import InputError
from foldyn.formats.building import built
from foldyn.formats.drawing import Drawing


def repairs(found):
    return "\n".join(found.diagnosis.repairs)


def doubts(found):
    return "\n".join(found.diagnosis.doubts)


def segments(pattern, letter):
    """Creases of a letter as sorted ends."""
    return sorted(
        sorted(map(tuple, pattern.vertices[list(pair), :2].round(9).tolist()))
        for pair, kind in zip(pattern.creases.tolist(), pattern.assignments, strict=True)
        if kind == letter
    )


# ------------------------------------------------------------------------ planar graphs


def scattered(count, seed):
    """Square with random lines across it, each from one side to another."""
    random = np.random.default_rng(seed)
    along = random.random((count, 2))
    sides = [random.permutation(4)[:2] for _ in range(count)]
    place = [lambda t: (t, 0.0), lambda t: (1.0, t), lambda t: (t, 1.0), lambda t: (0.0, t)]
    ends = [(place[a](s), place[b](t)) for (a, b), (s, t) in zip(sides, along, strict=True)]
    return [("MV"[k % 2], *pair) for k, pair in enumerate(ends)]


@pytest.mark.parametrize(("count", "seed"), [(1, 0), (3, 1), (12, 2), (40, 3), (90, 4)])
def test_random_lines_obey_euler_and_fill_the_sheet(count, seed):
    p = built(square(*scattered(count, seed))).pattern
    assert len(p.vertices) - len(p.edges) + len(p.faces) == 1  # without the outer face
    assert p.face_areas.sum() == pytest.approx(1.0, abs=1e-9)
    assert (p.face_normals[:, 2] > 0.9).all()
    # every crease lies on a line that was drawn, within the tolerance
    middles = p.vertices[p.creases, :2].mean(axis=1)
    lines = np.array([ends for _, *ends in scattered(count, seed)])
    start, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    normals = np.column_stack((-along[:, 1], along[:, 0]))
    normals /= np.linalg.norm(along, axis=1)[:, None]
    away = np.abs(np.einsum("klj,lj->kl", middles[:, None] - start, normals)).min(axis=1)
    assert away.max() < 1e-3


@pytest.mark.parametrize("count", [3, 4, 7, 12])
def test_lines_through_one_point(count):
    # diameters of a polygon: pairs of opposite sectors
    turned = np.pi * np.arange(2 * count) / count
    rim = 3.0 + np.column_stack((np.cos(turned), np.sin(turned)))
    border = [("B", rim[k - 1], rim[k]) for k in range(2 * count)]
    lines = [("M", rim[k], rim[k + count]) for k in range(count)]
    p = built(drawn(*border, *lines)).pattern
    assert (len(p.faces), len(p.vertices)) == (2 * count, 2 * count + 1)


@pytest.mark.matrix
@settings(max_examples=15)
@given(st.randoms(use_true_random=False), st.integers(2, 9))
def test_the_order_of_lines_does_not_matter(random, count):
    lines = [*square(*scattered(count, 5)).letters]
    whole = square(*scattered(count, 5))
    order = list(range(len(lines)))
    random.shuffle(order)
    turned = [random.random() < 0.5 for _ in order]
    ends = np.array([whole.edges[k][::-1] if turn else whole.edges[k]
                     for k, turn in zip(order, turned, strict=True)])  # fmt: skip
    mixed = Drawing(whole.vertices, ends, tuple(whole.letters[k] for k in order),
                    whole.fold_angles, meters=1.0)  # fmt: skip
    one, other = built(whole).pattern, built(mixed).pattern
    assert {tuple(v) for v in one.vertices.round(7)} == {tuple(v) for v in other.vertices.round(7)}
    for letter in "MV":
        np.testing.assert_allclose(segments(one, letter), segments(other, letter), atol=1e-7)


def test_vertices_keep_their_order_and_coordinates():
    vertices = [[0, 0], [0.1, 0], [0.3, 0], [0.3, 0.1], [0.1, 0.1], [0, 0.1]]
    edges = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 4)]
    drawing = Drawing(np.array(vertices), np.array(edges), tuple("BBBBBBV"), np.full(7, np.nan))
    found = built(drawing, meters=1.0)
    np.testing.assert_array_equal(found.pattern.vertices[:, :2], vertices)
    assert found.pattern.faces == ((0, 1, 4, 5), (1, 2, 3, 4))
    assert found.diagnosis.repairs == found.diagnosis.doubts == ()


# ------------------------------------------------------------------------ repairs


MIDDLE = ("M", (0, 0.5), (1, 0.5))
UPRIGHT = ("V", (0.5, 0), (0.5, 1))
OTHER_SHEET = [("B", (2, 0), (2.5, 0)), ("B", (2.5, 0), (2, 0.5)), ("B", (2, 0.5), (2, 0))]


@pytest.mark.parametrize(
    ("lines", "letters", "said"),
    [
        ([("M", (1e-5, 0.5), (1 - 1e-5, 0.5 + 2e-5)), UPRIGHT], "MMVV", "moved 2 line ends"),
        ([("M", (0.004, 0.5), (0.996, 0.5))], "M", "drew 2 open ends on to the next line"),
        ([("M", (-0.003, 0.5), (1.003, 0.5))], "M", "bound no panel: line 4"),
        ([MIDDLE, ("V", (0.5, 0.5), (0.5, 0.5))], "M", "left out 1 line of no length"),
        ([MIDDLE, ("B", (1, 0.5), (0, 0.5))], "M", ""),
        ([("V", *MIDDLE[1:]), MIDDLE], "V", "line 4 and line 5 lie in one place"),
        ([("J", *MIDDLE[1:])], "F", ""),
        ([MIDDLE, ("C", (0.2, 0.7), (0.8, 0.7))], "M", "left out 1 cut that end inside a panel"),
        ([("B", *MIDDLE[1:])], "U", "the 1 inside the sheet are taken as creases"),
        (
            [("B", (0.5, 0.5), (1, 0.5)), ("M", (0, 0.5), (0.5, 0.5)), UPRIGHT],
            "MVV",
            "1 line of the outline inside the sheet taken as cuts",
        ),
        ([("M", (0, 0), (1, 1)), *OTHER_SHEET], "M", "left out another sheet of 1.25e+05 mm2"),
    ],
)
def test_lines_that_are_repaired_or_doubted(lines, letters, said):
    found = built(square(*lines))
    assert "".join(sorted(found.pattern.assignments)) == letters
    assert said in repairs(found) + doubts(found)
    assert found.pattern.face_areas.sum() == pytest.approx(1.0, abs=1e-12)
    if letters == "M" and lines[0][2][1] == 0.5:
        assert segments(found.pattern, "M") == [[(0.0, 0.5), (1.0, 0.5)]]


def test_open_ends_are_left_out_and_named():
    lines = [("M", (0, 0.5), (1, 0.5)), ("V", (0.3, 0.5), (0.3, 0.7)), ("V", (2, 2), (3, 3))]
    found = built(square(*lines, places=(*"abcdefg",)))
    assert len(found.pattern.faces) == 2 and len(found.pattern.creases) == 1  # one line again
    (told,) = found.diagnosis.doubts  # a panel may be lost
    assert "left out 2 creases or parts of them that bound no panel" in told
    assert told.endswith("f near (0.3, 0.6), g near (2.5, 2.5)")


def test_places_are_told_in_the_units_of_the_file():
    found = built(square(("M", (0, 0.5), (1, 0.5)), ("V", (0.3, 0.5), (0.3, 0.7))), meters=1e-3)
    assert "near (0.3, 0.6)" in doubts(found)
    assert found.diagnosis.size == pytest.approx((1e-3, 1e-3, 0.0))


def test_mountains_on_the_outline():
    lines = [("M", (0, 0), (1, 0)), ("B", (1, 0), (1, 1)), ("B", (1, 1), (0, 0))]
    found = built(drawn(*lines))
    assert len(found.pattern.creases) == 0
    assert "1 mountain or valley on the outline" in repairs(found)


def test_fold_angles_and_letters_go_to_all_pieces():
    found = built(square(("M", (0, 0.5), (1, 0.5)), ("V", (0.5, 0), (0.5, 1)), angles=[-90, 45]))
    p = found.pattern
    by_letter = {"M": -np.pi / 2, "V": np.pi / 4}
    assert sorted(p.assignments) == ["M", "M", "V", "V"]
    for letter, angle in zip(p.assignments, p.fold_angles, strict=True):
        assert angle == pytest.approx(by_letter[letter])


def test_reversed_signs():
    lines = [("M", (0, 0.5), (1, 0.5)), ("V", (0.5, 0), (0.5, 1))]
    found = built(square(*lines, angles=[90, -45]))
    assert "turned the signs of all fold angles" in repairs(found)
    assert np.allclose(sorted(found.pattern.fold_angles), np.radians([-90, -90, 45, 45]))
    found = built(square(*lines, angles=[90, 45]))
    assert "1 fold angle of the other sign than the letter: line 4" in doubts(found)
    assert (found.pattern.fold_angles > 0).all()


# ------------------------------------------------------------------------ cuts and openings


def test_a_cut_from_the_outline_opens_there():
    folds = [("M", (0, 0.5), (0.5, 0.5)), ("V", (0.5, 0), (0.5, 1))]
    p = built(square(*folds, ("C", (0.5, 0.5), (1, 0.5)))).pattern
    # 9 places, and the end of the cut at the outline twice
    assert len(p.vertices) == 10 and len(p.faces) == 4 and len(p.creases) == 3
    assert (np.abs(p.vertices[:, :2] - [1, 0.5]).max(axis=1) < 1e-12).sum() == 2
    assert len(p.vertices) - len(p.edges) + len(p.faces) == 1


def test_a_cut_inside_is_a_hole_that_can_open():
    folds = [("M", (0, 0.5), (0.25, 0.5)), ("M", (0.75, 0.5), (1, 0.5))]
    cut = [("C", (0.25, 0.5), (0.5, 0.5)), ("C", (0.5, 0.5), (0.75, 0.5))]
    found = built(square(*folds, *cut))
    p = found.pattern
    assert "opened 2 cut edges" in repairs(found)
    assert len(p.creases) == 2 and len(p.vertices) == 4 + 2 + 2 + 2  # its middle twice
    assert len(p.vertices) - len(p.edges) + len(p.faces) == 0  # a ring
    one = built(square(*folds, ("C", (0.25, 0.5), (0.75, 0.5)))).pattern  # drawn as one line
    assert (len(one.vertices), len(one.creases)) == (len(p.vertices), 2)


def test_cuts_that_cross_part_four_panels():
    lines = [("C", (0.25, 0.5), (0.75, 0.5)), ("C", (0.5, 0.25), (0.5, 0.75)),
             ("M", (0, 0.5), (0.25, 0.5)), ("M", (0.75, 0.5), (1, 0.5)),
             ("V", (0.5, 0), (0.5, 0.25)), ("V", (0.5, 0.75), (0.5, 1))]  # fmt: skip
    p = built(square(*lines)).pattern
    middle = np.abs(p.vertices[:, :2] - 0.5).max(axis=1) < 1e-12
    assert middle.sum() == 4
    assert sorted(p.assignments) == ["M", "M", "V", "V"]


def window(letter):
    a, b = 0.25, 0.75
    corners = [(a, a), (b, a), (b, b), (a, b)]
    return [(letter, corners[k - 1], corners[k]) for k in range(4)]


@pytest.mark.parametrize("letter", ["C", "B"])
def test_a_window_falls_out(letter):
    found = built(
        square(("M", (0, 0.5), (0.25, 0.5)), ("M", (0.75, 0.5), (1, 0.5)), *window(letter))
    )
    p = found.pattern
    assert p.face_areas.sum() == pytest.approx(1 - 0.25)
    told = repairs(found) if letter == "C" else doubts(found)  # B only may mean cuts
    assert "left out 1 region that cuts bound on all sides, of 2.5e+05 mm2" in told
    assert p.assignments.count("M") == 2


@pytest.mark.parametrize("letter", ["C", "B", "M"])
def test_a_window_that_nothing_connects(letter):
    found = built(square(*window(letter)))
    p = found.pattern
    assert "divided 1 panel with others or openings inside into triangles" in repairs(found)
    if letter == "M":
        assert p.face_areas.sum() == pytest.approx(1.0)
        assert p.assignments.count("M") == 4
        return
    assert p.face_areas.sum() == pytest.approx(0.75)
    assert set(p.assignments) == {"F"}
    assert len(p.vertices) - len(p.edges) + len(p.faces) == 0


# ------------------------------------------------------------------------ refused


@pytest.mark.parametrize(
    ("drawing", "message"),
    [
        (drawn(("M", (0, 0), (1, 1)), ("V", (1, 0), (0, 1))), "lines: they enclose no panel"),
        (drawn(*[("B", (k, 0), (k + 2, 0)) for k in range(9)]), "lines: they enclose no panel"),
        (drawn(("M", (1, 1), (1, 1))), "vertices: they span 0 m"),
        (drawn(("M", (0, 0), (np.nan, 1))), r"vertices\[1\] = \[nan, 1.0\]: coordinates must be"),
        (drawn(("M", (0, 0), (np.inf, 1))), r"vertices\[1\]"),
        (drawn(("M", (0, 0), (1e40, 1))), r"vertices\[1\].*at most 1e\+30 m"),
        (drawn(("M", (1e9, 1e9), (1e9 + 1, 1e9))), "vertices: they span 1 m, too little at"),
        (drawn(("M", (0, 0, 0), (1, 1, 1)), ("M", (0, 0, 0), (1, 0, 0))), "lines in space; give a"),
        (square(("M", (0, 0), (1, 1)), angles=[200]), "line 4: a fold angle of 200 degrees"),
        (listed([[0, 0], [1, 0], [0, 1]], [[0, 1, 3]]), r"faces\[0\] = .*vertex 3 does not exist"),
        (listed([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], [(0, 7)], "M"), r"edges\[0\] = \[0, 7\]"),
    ],
)  # fmt: skip
def test_refused(drawing, message):
    with pytest.raises(InputError, match=message):
        built(drawing)


def test_nothing_is_drawn():
    none = Drawing(np.empty((0, 2)), np.empty((0, 2), int), (), np.empty(0))
    with pytest.raises(InputError, match=r"they span 0 m"):
        built(none)


def random_lines(count, reach=1.0):
    random = np.random.default_rng(1)
    start = random.random((count, 2))
    points = np.stack((start, start + reach * (random.random((count, 2)) - 0.5)), axis=1)
    return Drawing(points.reshape(-1, 2), np.arange(2 * count).reshape(-1, 2), ("M",) * count,
                   np.full(count, np.nan))  # fmt: skip


@pytest.mark.parametrize(
    ("drawing", "message"),
    [
        (random_lines(100_000), "100000 lines are too many"),
        (random_lines(20_000), "are too many"),
        (random_lines(1_500), r"\d+ (crossings|lines) are too many"),
    ],
)
def test_too_much_is_refused_soon(drawing, message):
    start = time.perf_counter()
    with pytest.raises(InputError, match=message):
        built(drawing)
    assert time.perf_counter() - start < 20.0  # seconds on a busy machine; hours without limits


def test_many_lines_in_one_place_are_one():
    lines = [("B", (0, 0), (1, 0)), ("B", (1, 0), (1, 1)), ("B", (1, 1), (0, 0))] * 2000
    assert len(built(drawn(*lines)).pattern.edges) == 3


def test_scale_and_unit():
    found = built(square(("M", (0, 0), (1, 1)), meters=None, assumed=1e-3, unit="px"), scale=2.0)
    assert found.diagnosis.size[0] == pytest.approx(2e-3)
    assert found.diagnosis.assumptions[0].startswith(
        "the file does not say its unit: 1 px is taken"
    )
    found = built(square(("M", (0, 0), (1, 1)), meters=None), meters=0.0254)
    assert found.diagnosis.size[0] == pytest.approx(0.0254)
    assert found.diagnosis.assumptions == ()
    with pytest.raises(InputError, match="scale"):
        built(square(), scale=-1.0)
