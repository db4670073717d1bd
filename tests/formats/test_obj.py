"""OBJ files as origami programs write them."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import diagnose, read_pattern, write_pattern
from foldyn.patterns import miura, simple_fold

SQUARES = """\
# unit: cm
v 0 0 0
v 1 0 0
v 2 0 0
v 0 1 0
v 1 1 0
v 2 1 0
"""
PANELS = "f 1 2 5 4\nf 2 3 6 5\n"


@pytest.fixture
def read(tmp_path):
    """Pattern and diagnosis of a text."""

    def made(text):
        (tmp_path / "x.obj").write_text(text)
        return diagnose(tmp_path / "x.obj", facets="hinge")

    return made


def test_a_mesh(read):
    """Letters of a mesh without creases are those of its dihedrals."""
    p = read(SQUARES.replace("1 0 0", "1 0 1").replace("1 1 0", "1 1 1") + PANELS).pattern
    assert p.assignments == ("M",)
    assert p.vertices[2].tolist() == [0.02, 0.0, 0.0]


@pytest.mark.parametrize(
    "faces",
    ["f 1/1 2/2 5/3 4/4\nf 2/1 3/2 6/3 5/4\n", "f 1//1 2//1 5//1 4//1\nf 2//1 3//1 6//1 5//1\n",
     "f 1/1/1 2/1/1 5/1/1 4/1/1\nf 2/1/1 3/1/1 6/1/1 5/1/1\n", "f -6 -5 -2 -3\nf -5 -4 -1 -2\n",
     "f 1 2 \\\n 5 4\nf 2 3 6 5\n", "vt 0 0\nvn 0 0 1\ng a\nusemtl b\ns off\nf 1 2 5 4\nf 2 3 6 5"],
)  # fmt: skip
def test_ways_to_list_a_face(faces, read):
    assert read(SQUARES + faces).pattern.faces == ((0, 1, 4, 3), (1, 2, 5, 4))


@pytest.mark.parametrize(
    ("line", "letter", "angle"),
    [
        ("#e 2 5 1 0", "F", None),
        ("#e 2 5 2 90", "V", 90),
        ("#e 5 2 3 -90", "M", -90),
        ("#e 2 5 3 90", "M", -90),
        ("#e 2 5 3 0", "M", None),  # Origami Simulator fills the column with 0
        ("#e 2 5 3", "M", None),
        ("#e 2 5 4 30", "U", 30),
        ("#e 2 5", "U", None),
        ("#e 2 5 M -12.5", "M", -12.5),
    ],
)
def test_kinds_of_freeform_origami(line, letter, angle, read):
    p = read(SQUARES + PANELS + line + "\n#e 1 2 0 0\n").pattern
    assert p.assignments == (letter,)
    np.testing.assert_allclose(p.fold_angles, [np.nan if angle is None else np.radians(angle)])


def test_kinds_of_oripa(read):
    """Its y runs down, and a mountain is its 2: the sheet as it is seen on its screen."""
    header = "# Created by ORIPA\n\n"
    p = read(header + SQUARES + PANELS + "#e 2 5 2 180\n#e 1 2 1 180\n").pattern
    assert p.assignments == ("M",)
    assert p.vertices[3].tolist() == [0.0, -0.01, 0.0]
    np.testing.assert_allclose(p.face_normals[:, 2], 1.0)
    np.testing.assert_allclose(p.fold_angles, [-np.pi])


def test_lines_alone(read):
    """Panels are found; lines take the letter of the group that they are in."""
    lines = "g boundary lines\nl 1 2 3 6 5 4 1\ng Mountain\nl 2 5\n"
    p = read(SQUARES + lines).pattern
    assert (len(p.faces), p.assignments) == (2, ("M",))
    assert read(SQUARES + "l 1 2 3 6 5 4 1\nl 2 5\n").pattern.assignments == ("U",)


def test_lines_without_a_letter_leave_the_dihedral_to_say_it(read):
    raised = SQUARES.replace("1 0 0", "1 0 1").replace("1 1 0", "1 1 1")
    assert read(raised + PANELS + "l 2 5\n").pattern.assignments == ("M",)
    assert read(raised + PANELS + "g facets\nl 2 5\n").pattern.assignments == ("F",)


@pytest.mark.parametrize(
    ("comment", "meters"),
    [("# unit: mm", 1e-3), ("# Units: inches", 0.0254), ("# File units = meters", 1.0),
     ("#units cm", 1e-2), ("# made by hand", None), ("# unit: ell", None)],
)  # fmt: skip
def test_units(comment, meters, tmp_path):
    (tmp_path / "x.obj").write_text(comment + "\n" + SQUARES.split("\n", 1)[1] + PANELS)
    if meters is None:
        with pytest.warns(FoldynWarning, match=r"x\.obj: .*1000 mm.*the sheet is 2 x 1 x 0 m"):
            p = read_pattern(tmp_path / "x.obj")
        meters = 1.0
    else:
        p = read_pattern(tmp_path / "x.obj")
    assert p.vertices[2, 0] == 2.0 * meters


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not an OBJ file of a pattern: it has no vertices"),
        ("f 1 2 3\n", r'line 1: "1" is no vertex; they are counted from 1 to 0'),
        ("v 0 0\nv 1\n", 'line 2: v "1": give x y z, three numbers'),
        ("v 0 a 0\n", "line 1 = .v 0 a 0.: coordinates must be finite"),
        ("v 0 nan 0\n", "line 1 = .v 0 nan 0.: coordinates must be finite"),
        (SQUARES + "f 1 2 9\n", 'line 8: "9" is no vertex; they are counted from 1 to 6'),
        (SQUARES + "f 1 2 0\n", 'line 8: "0" is no vertex'),
        (SQUARES + "f 1 2 -7\n", 'line 8: "-7" is no vertex'),
        (SQUARES + "f 1 2 x\n", 'line 8: "x" is no vertex'),
        (SQUARES + "f 1 2\n", "line 8: a face needs at least three corners"),
        (SQUARES + PANELS + "#e 2\n", "line 10: #e needs two vertices"),
        (SQUARES + PANELS + "#e 2 2 1\n", "line 10: #e joins vertex 2 with itself"),
        (SQUARES + PANELS + "#e 2 5 9\n", 'line 10: "9" is no kind of edge: give 0 to 5'),
        (SQUARES + PANELS + "#e 2 5 1 200\n", 'line 10: "200": give an angle from -180 to 180'),
        (SQUARES, "lines: there are none"),
    ],
)
def test_what_is_wrong(text, message, read):
    with pytest.raises(InputError, match=rf"x\.obj: {message}"):
        read(text)


def test_what_is_written(tmp_path):
    write_pattern(simple_fold(dihedral=60), tmp_path / "x.obj")
    lines = (tmp_path / "x.obj").read_text().splitlines()
    assert "# unit: m" in lines and "o simple fold" in lines
    assert "f 1 3 4 2" in lines
    assert "#e 3 4 3" in lines  # a mountain, no angle to fold to
    assert sum(line.startswith("#e ") for line in lines) == 7
    p = miura().changed(fold_angles=[-1.0, None, None, None])
    write_pattern(p, tmp_path / "x.obj")
    (angle,) = [row.split()[4] for row in (tmp_path / "x.obj").read_text().splitlines()
                if row.startswith("#e ") and len(row.split()) == 5]  # fmt: skip
    assert float(angle) == pytest.approx(np.degrees(-1.0))
