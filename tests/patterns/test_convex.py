"""Panels that are not convex, cut along welds, and the models of what results."""

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.patterns.convex import what_was_cut
from foldyn.patterns.topology import around
from sheets_with_facets import STEEL, elastic

L_SHAPE = 0.1 * np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
OUTLINES = {
    "L": L_SHAPE,
    "dart": [(0, 0), (1, 0), (0.3, 0.3), (0, 1)],
    "U": [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)],
    "vertex within an edge": [(0, 0), (0.5, 0), (1, 0), (1, 1)],
    "star": [
        (
            (1 + 1.5 * (k % 2)) * np.cos(0.2 * np.pi * k),
            (1 + 1.5 * (k % 2)) * np.sin(0.2 * np.pi * k),
        )
        for k in range(10)
    ],
}


def darts(turned=0):
    """Two panels with a corner that points inwards, on both sides of a crease."""
    points = 0.1 * np.array([(0, 0), (2, 0), (0.6, 0.6), (0, 2), (0.6, -0.6), (0, -2)])
    faces = [(0, 1, 2, 3), (0, 5, 4, 1)]
    faces = [face[turned:] + face[:turned] for face in faces]
    return fd.Pattern(points, faces, {(0, 1): "V"}, families={"middle": [(0, 1)]})


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_parts_are_convex_and_cover_the_panel(outline):
    whole = fd.Pattern(outline, [range(len(outline))])
    made = fd.convex(whole)
    np.testing.assert_array_equal(made.vertices, whole.vertices)
    assert made.face_areas.sum() == pytest.approx(whole.face_areas.sum(), rel=1e-12)
    assert len(made.creases) == 0
    assert len(made.welds) == len(made.faces) - 1
    np.testing.assert_array_equal(made.boundary, whole.boundary)
    for face in made.faces:
        x = made.vertices[list(face), :2]
        side = np.roll(x, -1, axis=0) - x
        assert (
            np.cross(np.c_[np.roll(side, 1, axis=0), 0 * x[:, 0]], np.c_[side, 0 * x[:, 0]])[:, 2]
            > 0
        ).all()
    assert fd.convex(made) is made
    fd.discretize(made, STEEL)
    fd.shell(made, STEEL, divisions=2)


def test_few_parts():
    assert fd.convex(fd.Pattern(L_SHAPE, [range(6)])).faces == ((0, 1, 2, 3), (0, 3, 4, 5))


@pytest.mark.parametrize("turned", range(4))
def test_numbers_stay(turned):
    whole = darts(turned)
    made = fd.convex(whole)
    np.testing.assert_array_equal(made.creases, whole.creases)
    assert (made.assignments, made.families["middle"].tolist()) == (("V",), [0])
    assert len(made.faces) == 4
    for part, panel in zip(made.faces, whole.faces, strict=False):  # by its first edge
        assert panel[:2] in list(around(part))
    assert what_was_cut(whole, made).startswith("cut 2 panels not convex")
    assert what_was_cut(whole, made).endswith("(panels 2 to 3 are new)")


def test_what_cannot_be_cut():
    with pytest.raises(InputError, match="pattern: got list, give a Pattern"):
        fd.convex([])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="pattern: panel 0 is thick and not convex"):
        fd.convex(fd.thicken(darts(), 0.001))


@pytest.mark.parametrize("make", [fd.discretize, fd.shell])
def test_the_message_names_the_remedy(make):
    with pytest.raises(InputError, match=r"panel 0 .*cut it with fd\.convex\(pattern\)"):
        make(darts(), STEEL)


def test_a_folded_sheet_with_panels_that_are_not_convex():
    """Cut before it is folded or afterward, it is the same; the models agree within 15 %."""
    before = fd.fold(fd.convex(darts()), angles={(0, 1): 60}).pattern
    after = fd.convex(fd.fold(darts(), angles={(0, 1): 60}).pattern)
    assert before.faces == after.faces
    for pattern in (before, after):
        assert np.degrees(pattern.dihedrals) == pytest.approx([120])
        reduced, shell = fd.discretize(pattern, STEEL), fd.shell(pattern, STEEL, divisions=6)
        assert elastic(reduced)[0] == pytest.approx(elastic(shell)[0], rel=0.15)


INLINE = """
[pattern]
vertices = [[0, 0], [0.2, 0], [0.2, 0.1], [0.1, 0.1], [0.1, 0.2], [0, 0.2]]
faces = [[0, 1, 2, 3, 4, 5]]
{facets}
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 1e-3
density = 500
[analysis]
kind = "modes"
"""


def test_case_files_say_so(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(INLINE.format(facets=""))
    with pytest.warns(FoldynWarning, match=r"pattern: cut a panel not convex.*\(panel 1 is new\)"):
        case = fd.read_case(path).case()
    assert len(case.structure.pattern.faces) == 2
    path.write_text(INLINE.format(facets='facets = "line"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        with pytest.raises(InputError, match=r'leave out facets = "line"'):
            fd.read_case(path).case()
