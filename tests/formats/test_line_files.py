"""CP, OPX and DXF: what is read, round trips, and files that must be refused."""

from __future__ import annotations

import io
import time
from pathlib import Path

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.formats import cp, dxf, opx
from foldyn.formats.building import built
from foldyn.formats.chords import CHORD
from foldyn.formats.files import FORMATS
from foldyn.patterns import miura

ezdxf = pytest.importorskip("ezdxf")
SAMPLES = Path(__file__).parents[3] / "shared" / "patterns"


def kinds(drawing):
    """(letter, start, end) of each line."""
    ends = drawing.vertices[drawing.edges][..., :2].round(9).tolist()
    return [(kind, *map(tuple, pair)) for kind, pair in zip(drawing.letters, ends, strict=True)]


def written(document) -> str:
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


# ------------------------------------------------------------------------ round trips


# ------------------------------------------------------------------------ CP


def test_cp_types():
    text = "1 0 0 10 0\n2 0,0,5,5\n\n# words\n3 1e1 -2.5 0 +3 # after\n4 0 0 1 1\r\n0 0 0 1 2\n"
    drawing = cp.read("\ufeff".strip("\ufeff") + text)
    assert kinds(drawing) == [("B", (0, 0), (10, 0)), ("M", (0, 0), (5, -5)),
                              ("V", (10, 2.5), (0, -3)), ("F", (0, 0), (1, -1)),
                              ("F", (0, 0), (1, -2))]  # fmt: skip
    assert drawing.places[2] == "line 5"
    assert (drawing.meters, drawing.assumed) == (None, 1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "lines: there are none"),
        ("# nothing\n\n", "lines: there are none"),
        ("1 0 0 1", 'line 1 = "1 0 0 1": give a type'),
        ("1 0 0 1 1\n5 0 0 1 1", "line 2"),
        ("1 0 0 1 1 1", "line 1"),
        ("1 0 0 1 x", 'line 1 = "1 0 0 1 x": coordinates must be finite numbers'),
        ("1 0 0 1 nan", "must be finite"),
        ("1 0 0 1 1e999", "must be finite"),
        ("{}", "line 1"),
        ("1 0 0 1 0\n" * 5, "they enclose no panel"),
        ("1 0 0 1 0\n1 1 0 2 0\n3 0 0 3 0", "they enclose no panel"),
        ("\x00\x07\x00", "line 1"),
    ],
)
def test_cp_refused(text, message):
    with pytest.raises(InputError, match=message):
        built(cp.read(text))


def test_the_bird_base():
    path = SAMPLES / "oriedita+oriedita__birdbase.cp"
    if not path.exists():
        pytest.skip("needs ../shared")
    found = built(cp.read(path.read_text()))
    p = found.pattern
    assert (len(p.vertices), len(p.faces), len(p.creases)) == (13, 14, 18)
    assert p.face_areas.sum() == pytest.approx(0.4**2)
    vertices = found.diagnosis.vertices
    assert len(vertices.vertices) == 5
    assert vertices.maekawa.all() and vertices.kawasaki(1e-9).all()
    assert found.diagnosis.repairs == found.diagnosis.doubts == ()


# ------------------------------------------------------------------------ OPX

OPX = """<?xml version="1.0" encoding="UTF-8"?>
<java version="1.5.0_05" class="java.beans.XMLDecoder"><object class="oripa.DataSet">
 <void property="title"><string>a  title</string></void>
 <void property="lines"><array class="oripa.OriLineProxy" length="2">
{}</array></void></object></java>"""


def opx_line(**values):
    found = "".join(
        f'<void property="{name}"><{"int" if name == "type" else "double"}>{value}'
        f"</{'int' if name == 'type' else 'double'}></void>"
        for name, value in values.items()
    )
    return f'<void index="0"><object class="oripa.OriLineProxy">{found}</object></void>\n'


def test_opx():
    mountain = opx_line(type=2, x0=-200.0, y0=1, x1=5, y1="1.5E2")
    drawing = opx.read(OPX.format(mountain + opx_line(type=3, y1=4) + opx_line(x0=1)))
    # values of 0 are left out by Java's encoder
    assert kinds(drawing) == [("M", (-200, -1), (5, -150)), ("V", (0, 0), (0, -4)),
                              ("F", (1, 0), (0, 0))]  # fmt: skip
    assert drawing.name == "a title"


def test_opx_and_cp_agree():
    text = FORMATS[".cp"].write(miura(dihedral=180))  # type: ignore[misc]
    rows = [line.split() for line in text.splitlines()]
    lines = [opx_line(type=kind, x0=a, y0=b, x1=c, y1=d) for kind, a, b, c, d in rows]
    assert kinds(opx.read(OPX.format("".join(lines)))) == kinds(cp.read(text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (OPX.format(""), "lines: there are none"),
        (OPX.format(opx_line(type=9)), r'lines\[0\].type = "9"'),
        (
            OPX.format(opx_line() + opx_line(x0="one")),
            r'lines\[1\].x0 = "one": coordinates must be finite',
        ),
        (OPX.format(opx_line(y1="NaN")), r"lines\[0\].y1"),
        (OPX[:200], "is not an OPX file"),
        ("", "is not an OPX file"),
        (
            '<!DOCTYPE a [<!ENTITY b SYSTEM "c">]><a>&b;</a>',
            "is not an OPX file that can be read safely",
        ),
    ],
)
def test_opx_refused(text, message):
    with pytest.raises(InputError, match=message):
        opx.read(text)


# ------------------------------------------------------------------------ DXF


def sheet_dxf(version="R2010", **keys):
    document = ezdxf.new(version, **keys)
    square = [(0, 0), (10, 0), (10, 10), (0, 10)]
    document.modelspace().add_lwpolyline(square, close=True, dxfattribs={"layer": "Border"})
    return document


@pytest.mark.parametrize(
    ("layer", "letter"),
    [("MountainLine", "M"), ("VALLEY folds", "V"), ("m", "M"), ("V", "V"), ("CutLine", "C"),
     ("outline", "B"), ("Facets", "F"), ("AuxiliaryLine", "F"), ("creases", "U"), ("FOLD", "U"),
     ("mountain_fold", "M")],
)  # fmt: skip
def test_dxf_layers(layer, letter):
    document = sheet_dxf()
    document.modelspace().add_line((0, 5), (10, 5), dxfattribs={"layer": layer, "color": 3})
    drawing = dxf.read(written(document))
    assert kinds(drawing)[-1] == (letter, (0, 5), (10, 5))
    assert drawing.doubts == ()


def test_dxf_colors():
    document = sheet_dxf()
    document.layers.add("some", color=5)
    space = document.modelspace()
    space.add_line((0, 1), (10, 1), dxfattribs={"color": 1})
    space.add_line((0, 2), (10, 2), dxfattribs={"layer": "some"})
    space.add_line((0, 3), (10, 3), dxfattribs={"layer": "some", "color": 7})
    space.add_line((0, 4), (10, 4), dxfattribs={"true_color": 0xFF00FF})
    space.add_line((0, 5), (10, 5), dxfattribs={"color": 4})  # cyan
    drawing = dxf.read(written(document))
    assert [kind for kind, *_ in kinds(drawing)[4:]] == list("MVBUF")
    assert drawing.doubts == ("color #00ffff of 1 line is taken for yellow, flat",)


@pytest.mark.parametrize(("code", "meters"), [(1, 0.0254), (4, 1e-3), (5, 0.01), (6, 1.0)])
def test_dxf_units(code, meters):
    found = built(dxf.read(written(sheet_dxf(units=code))))
    assert found.diagnosis.size[0] == pytest.approx(10 * meters, rel=1e-15)
    assert found.diagnosis.assumptions == ()


def test_dxf_without_a_unit():
    document = ezdxf.new("R12")
    document.modelspace().add_polyline2d([(0, 0), (10, 0), (10, 9)], close=True)
    found = built(dxf.read(written(document)))
    assert found.diagnosis.size[0] == pytest.approx(0.01)
    assert "1 unit is taken as 1 mm" in found.diagnosis.assumptions[0]


def test_dxf_curves():
    document = sheet_dxf()
    space = document.modelspace()
    space.add_circle((5, 5), 3, dxfattribs={"layer": "mountain"})
    space.add_arc((5, 5), 4, 30, 120, dxfattribs={"layer": "valley"})
    space.add_lwpolyline([(2, 9, 1), (4, 9)], format="xyb", dxfattribs={"layer": "facet"})
    space.add_spline([(1, 1), (2, 2), (3, 1)], dxfattribs={"layer": "cut"})
    space.add_ellipse((5, 5), (1, 0), 0.5, dxfattribs={"layer": "fold"})
    drawing = dxf.read(written(document))
    tolerance = CHORD * np.hypot(10, 10)
    round_ones = [("M", (5, 5), 3, 6 * np.pi), ("V", (5, 5), 4, 2 * np.pi), ("F", (3, 9), 1, np.pi)]
    for letter, center, radius, length in round_ones:
        rows = np.array(drawing.letters) == letter
        ends = drawing.vertices[drawing.edges[rows]][..., :2]
        away = np.linalg.norm(ends - center, axis=2)
        np.testing.assert_allclose(away, radius, rtol=1e-9 if letter in "MV" else 3e-4)
        middles = np.linalg.norm(ends.mean(axis=1) - center, axis=1)
        assert np.abs(radius - middles).max() < 1.2 * tolerance
        drawn = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
        assert drawn == pytest.approx(length, rel=0.01)
    assert {"C", "U"} <= set(drawing.letters)
    assert "5 curves drawn as chords" in drawing.repairs[0]


def test_dxf_blocks_hidden_layers_and_other_entities():
    document = sheet_dxf()
    block = document.blocks.new("part")
    block.add_line((0, 0), (1, 0), dxfattribs={"layer": "mountain"})
    space = document.modelspace()
    space.add_blockref("part", (2, 3), dxfattribs={"rotation": 90})
    document.layers.add("hidden").off()
    space.add_line((0, 0), (1, 1), dxfattribs={"layer": "hidden"})
    space.add_text("words")
    drawing = dxf.read(written(document))
    assert kinds(drawing)[4:] == [("M", (2, 3), (2, 4))]
    assert drawing.repairs == ("left out 1 TEXT, 1 hidden",)


def test_dxf_in_space_is_refused():
    document = sheet_dxf()
    document.modelspace().add_line((0, 0, 0), (1, 1, 5), dxfattribs={"layer": "mountain"})
    with pytest.raises(InputError, match="lines in space"):
        built(dxf.read(written(document)))


def test_dxf_of_oriedita():
    # AC1009 without tables, as Oriedita's DxfExporter.java writes it
    line = "  0\nLINE\n  8\n{}\n  6\nCONTINUOUS\n  62\n1\n  10\n{}\n  20\n{}\n  11\n{}\n  21\n{}\n"
    head = "  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  1\nAC1009\n  0\nENDSEC\n"
    ends = [(0, 0, 9, 0), (9, 0, 9, 9), (9, 9, 0, 9), (0, 9, 0, 0)]
    body = "".join(line.format("CutLine", *end) for end in ends)
    body += line.format("MountainLine", 0, 0, 9, 9)
    text = f"{head}  0\nSECTION\n  2\nENTITIES\n{body}  0\nENDSEC\n  0\nEOF\n"
    p = built(dxf.read(text)).pattern
    assert p.assignments == ("M",) and len(p.faces) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not a DXF file"),
        ("not a DXF", "is not a DXF file"),
        ("0\nSECTION\n2\nENTITIES\n", "is not a DXF file|lines: there are none"),
        ("  0\nEOF\n", "is not a DXF file|lines: there are none"),
        (written(ezdxf.new()), "lines: there are none that can be read"),
    ],
    ids=range(5),
)
def test_dxf_refused(text, message):
    with pytest.raises(InputError, match=message):
        dxf.read(text)


@pytest.mark.parametrize(
    ("levels", "grid", "message"),
    [(12, 1, "the entities of blocks are too many"), (1, 30_000, "the entities of blocks are"),
     (60, 1, "blocks: nested deeper than 50 levels"), (0, 1, "blocks: nested deeper than 50")],
)  # fmt: skip
def test_bombs_of_blocks(levels, grid, message):
    document = ezdxf.new()
    for k in range(levels or 1):
        block = document.blocks.new(f"b{k}")  # the innermost one is empty, or within itself
        for _ in range(10 if k else not levels):
            block.add_blockref(f"b{max(k - 1, 0)}", (0, 0))
    keys = {"row_count": grid, "column_count": grid, "row_spacing": 1, "column_spacing": 1}
    document.modelspace().add_blockref(f"b{max(levels - 1, 0)}", (0, 0), dxfattribs=keys)
    start = time.perf_counter()
    with pytest.raises(InputError, match=message):
        dxf.read(written(document))
    assert time.perf_counter() - start < 10.0


def test_dxf_without_ezdxf(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ezdxf", None)
    with pytest.raises(InputError, match=r"pip install ezdxf \(or foldyn\[dxf\]\)"):
        dxf.read("")
