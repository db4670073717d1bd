"""Drawings with slips: ends that miss, lines drawn twice, patterns that just fail to fold flat."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import drawn, listed, square

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import diagnose, read_pattern, write_pattern
from foldyn.formats.building import built
from foldyn.patterns.flat_foldability import flat_foldability

SHEET = fd.patterns.miura(cells=(2, 2), a=0.035, b=0.03, panel_angle=62, dihedral=180)


def by_hand(pattern, slip, seed=0):
    """Lines (letter, start, end) of a flat pattern, each end a slip (m) away from its place."""
    rng = np.random.default_rng(seed)
    letters = dict(zip(map(tuple, pattern.creases.tolist()), pattern.assignments, strict=True))
    lines = []
    for pair in map(tuple, pattern.edges.tolist()):
        turn = rng.uniform(0.0, 2.0 * np.pi, 2)
        ends = pattern.vertices[list(pair), :2]
        ends = ends + slip * np.column_stack([np.cos(turn), np.sin(turn)])
        lines.append((letters.get(pair, "B"), *ends.tolist()))
    return lines


def written(lines, path):
    """A file with these lines, in mm."""
    colors = {"B": "black", "M": "red", "V": "blue"}
    text = [
        f'<line x1="{1e3 * a:.9f}" y1="{-1e3 * b:.9f}" x2="{1e3 * c:.9f}" y2="{-1e3 * d:.9f}" '
        f'stroke="{colors[letter]}"/>'
        for letter, (a, b), (c, d) in lines
    ]
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9" width="9mm" height="9mm">'
    path.write_text(head + "".join(text) + "</svg>")
    return path


# ------------------------------------------------------------------------------ nearly flat


def test_a_hand_drawn_sheet_is_doubted_and_mended(tmp_path):
    path = written(by_hand(SHEET, 3e-5), tmp_path / "hand.svg")
    drawn_, told = diagnose(path)
    (doubt,) = told.doubts
    assert "nearly flat-foldable: Kawasaki's sums are up to 0." in doubt
    assert "flat_foldable = true moves" in doubt
    mended, after = diagnose(path, flat_foldable=True)
    assert flat_foldability(mended).alternating.max() < 1e-11 and not after.doubts
    assert after.vertices.alternating.max() < 1e-11
    moves = np.linalg.norm(mended.vertices - drawn_.vertices, axis=1)
    np.testing.assert_allclose(after.moves, moves)
    np.testing.assert_allclose(told.moves, moves)  # as was offered
    assert 1e-6 < moves.max() < 6e-5
    assert f"by up to {1e3 * moves.max():.3g} mm to where they fold flat" in after.repairs[-1]
    assert f"(um): {moves.argmax()} by {1e6 * moves.max():.3g}," in str(after)
    with pytest.warns(FoldynWarning) as warned:
        read_pattern(path)
    assert any("nearly flat-foldable" in str(each.message) for each in warned)


@pytest.mark.matrix
def test_frequencies_of_a_mended_sheet_are_those_without_slips(tmp_path):
    path = written(by_hand(SHEET, 3e-5), tmp_path / "hand.svg")
    mended = diagnose(path, flat_foldable=True).pattern
    sheet = fd.Sheet(2e9, 0.3, 2e-4, density=900)
    found = []
    for pattern in (SHEET, mended):
        folded = fd.fold(pattern, fraction=0.4, steps=2, initial="pattern").pattern
        structure = fd.discretize(folded.moved(-folded.vertices.min(axis=0)), sheet, preset="plate")
        found.append(fd.modes(fd.Case(structure, [fd.Fix("x < 0.002")]), 4).frequency.values)
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)


@pytest.mark.parametrize("digits", [5, 6, 7])
def test_digits_of_a_file_are_no_slips(digits, tmp_path):
    """Coordinates rounded to so many digits of a meter, in panels of 30 mm."""
    rounded = SHEET.changed(vertices=np.round(SHEET.vertices, digits))
    write_pattern(rounded, tmp_path / "x.fold")
    doubted = any("nearly" in doubt for doubt in diagnose(tmp_path / "x.fold").diagnosis.doubts)
    assert doubted == (digits == 5)
    mended = diagnose(tmp_path / "x.fold", flat_foldable=True).pattern
    assert flat_foldability(mended).alternating.max() < 1e-11


def test_exact_and_other_patterns_are_not_doubted(tmp_path):
    for k, pattern in enumerate((SHEET, fd.patterns.miura(dihedral=100), fd.patterns.resch())):
        write_pattern(pattern, tmp_path / f"{k}.fold")
        told = diagnose(tmp_path / f"{k}.fold", flat_foldable=k == 0).diagnosis
        assert not len(told.moves) and not any("nearly" in doubt for doubt in told.doubts)


def test_folded_patterns_cannot_be_mended(tmp_path):
    off = built(drawn(*by_hand(SHEET, 3e-5))).pattern
    pair, letter = tuple(off.creases[0].tolist()), off.assignments[0]
    folded = fd.fold(off, {pair: 30 if letter == "V" else -30}, steps=1, initial="pattern").pattern
    write_pattern(folded, tmp_path / "x.fold")
    (doubt,) = diagnose(tmp_path / "x.fold").diagnosis.doubts
    assert "fold it again from its flat drawing, read with flat_foldable = true" in doubt
    with pytest.raises(InputError, match="flat_foldable: pattern: is folded"):
        diagnose(tmp_path / "x.fold", flat_foldable=True)


# ------------------------------------------------------------------------------ tolerance


def test_a_tolerance_joins_ends_that_miss_each_other(tmp_path):
    path = written(by_hand(SHEET, 4e-4, seed=2), tmp_path / "hand.svg")
    with pytest.raises(InputError, match="a `tolerance` joins ends that miss each other"):
        diagnose(path)  # lines of the outline cross, and part slivers from the sheet
    p = diagnose(path, tolerance=1e-3).pattern
    assert len(p.vertices) == len(SHEET.vertices)
    assert (len(p.faces), len(p.creases)) == (len(SHEET.faces), len(SHEET.creases))


def test_a_tolerance_joins_listed_panels():
    gap = 3e-4
    apart = listed(
        [(0, 0), (1, 0), (1, 1), (0, 1), (1 + gap, 0), (2, 0), (2, 1), (1 + gap, 1 + gap)],
        [(0, 1, 2, 3), (4, 5, 6, 7)],
    )
    assert len(built(apart).pattern.creases) == 0
    assert len(built(apart, tolerance=1e-3).pattern.creases) == 1
    assert len(built(apart, tolerance=1e-4).pattern.creases) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"tolerance": -1e-4}, "tolerance = -0.0001"),
        ({"tolerance": "1 mm"}, "tolerance = .1 mm"),
        ({"tolerance": 0.1}, "tolerance = 0.1: must be at most a 20th of the sheet's size"),
        ({"flat_foldable": "yes"}, "flat_foldable = .yes"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message, tmp_path):
    path = written(by_hand(SHEET, 0.0), tmp_path / "x.svg")
    with pytest.raises(InputError, match=message):
        read_pattern(path, **arguments)


# ------------------------------------------------------------------------------ lines drawn twice


@pytest.mark.parametrize("first", [True, False], ids=["before", "after"])
@pytest.mark.parametrize(
    "more",
    [
        [("M", (0.5, 0), (0.5, 0.4))],  # from an end on
        [("M", (0.5, 0.3), (0.5, 0.6))],  # inside
        [("M", (0.5, 0.3), (0.5, 0.6)), ("M", (0.5, 0.5), (0.5, 1))],  # and twice
        [("B", (0.2, 0), (0.7, 0))],  # of the outline
        [("B", (0, 0.1), (0, 0.5)), ("M", (0.5, 0.9), (0.5, 0.2))],
    ],
)
def test_lines_upon_others_leave_no_vertex(more, first):
    crease = [("M", (0.5, 0), (0.5, 1))]
    p, told = built(square(*(more + crease if first else crease + more)))
    assert (len(p.vertices), len(p.faces), p.assignments) == (6, 2, ("M",))
    assert any("of lines upon others, within these" in repair for repair in told.repairs)


def test_pieces_of_one_line_that_overlap_become_one():
    p, _ = built(square(("V", (0.5, 0), (0.5, 0.6)), ("V", (0.5, 0.4), (0.5, 1))))
    assert (len(p.vertices), p.assignments) == (6, ("V",))
    # but other letters, and lines that meet there, keep their vertices
    p, _ = built(square(("V", (0.5, 0), (0.5, 1)), ("M", (0.5, 0), (0.5, 0.4))))
    assert sorted(p.assignments) in (["M", "V"], ["V", "V"], ["V"])
    p, _ = built(
        square(("V", (0.5, 0), (0.5, 1)), ("V", (0.5, 0), (0.5, 0.4)), ("M", (0, 0.4), (1, 0.4)))
    )
    assert (len(p.faces), len(p.vertices)) == (4, 9)


def test_creases_that_are_lost_are_doubted():
    # the crease ends 30 mm before the other one: the two panels that it was to part are one
    p, told = built(square(("M", (0.5, 0), (0.5, 1)), ("V", (0, 0.5), (0.47, 0.5))))
    assert len(p.faces) == 2
    (doubt,) = told.doubts
    assert "left out 1 crease or parts of them that bound no panel" in doubt
    # an end that goes too far loses nothing
    p, told = built(square(("M", (0.5, 0), (0.5, 1)), ("V", (0, 0.5), (0.506, 0.5))))
    assert len(p.faces) == 3 and not told.doubts
    assert any("left out 1 line or parts of them" in repair for repair in told.repairs)
