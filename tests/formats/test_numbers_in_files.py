"""Numbers in text that only Python takes for some: 1_0, digits of other scripts; nan and inf."""

from __future__ import annotations

import json

import pytest

import foldyn as fd
from foldyn.cases.csv_table import read_numbers
from foldyn.cli.folding import read_angles
from foldyn.cli.options import frame_of, integer, number
from foldyn.errors import InputError
from foldyn.formats import cp, dxf, fold, obj, opx, svg
from foldyn.formats.building import built
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES
from foldyn.values import parsed

SQUARE = "\n".join(f"v {x} {y} 0" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 99 99">{}</svg>'
OPX = (
    '<java><object class="oripa.OriLineProxy"><void property="x1"><double>{}</double></void>'
    '<void property="y1"><double>3</double></void></object></java>'
)
DXF = "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\nM\n10\n0\n20\n0\n11\n{}\n21\n3\n0\nENDSEC\n0\nEOF\n"

READERS = {
    "CP": lambda n: cp.read(f"2 0 0 {n} 50"),
    "OPX": lambda n: opx.read(OPX.format(n)),
    "OBJ coordinate": lambda n: obj.read(f"{SQUARE}\nv {n} 0 0\nf 1 2 3 4"),
    "OBJ vertex": lambda n: obj.read(f"{SQUARE}\n" + "v 2 2 2\n" * 8 + f"f 1 2 {n}"),
    "OBJ angle": lambda n: obj.read(f"{SQUARE}\nf 1 2 3\nf 1 3 4\n#e 1 3 2 {n}"),
    "SVG length": lambda n: svg.read(SVG.format(f'<line x2="{n}" stroke="red"/>')),
    "SVG points": lambda n: svg.read(SVG.format(f'<polyline points="0,0 {n},5" stroke="red"/>')),
    "SVG path": lambda n: svg.read(SVG.format(f'<path d="M0 0L{n} 5" stroke="red"/>')),
    "SVG transform": lambda n: svg.read(
        SVG.format(f'<line x2="5" transform="scale({n})" stroke="red"/>')
    ),
    "DXF": lambda n: dxf.read(DXF.format(n)),
    "FOLD": lambda n: fold.read(
        f'{{"vertices_coords": [[0, {n}]], "edges_vertices": [], "faces_vertices": []}}'
    ),
}
OTHERS = {
    "percent": lambda n: fd.Actuate("all", fraction=f"{n}%"),
    "measure": lambda n: asked(f"frequency[{n}]", MEASURES),
    "selection": lambda n: fd.patterns.select([[0, 0, 0], [9, 9, 9]], f"x<{n}"),
}


@pytest.mark.parametrize("reader", [*READERS, *OTHERS])
@pytest.mark.parametrize("text", ["1_0", "１０", "1０"])
def test_numbers_to_python_alone_are_refused(reader, text):
    read = {**READERS, **OTHERS}[reader]
    read("10")
    with pytest.raises(InputError):
        read(text)


@pytest.mark.parametrize("reader", sorted(set(READERS) - {"OBJ angle"}))
@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "NaN", "Infinity", "1e999"])
def test_what_is_not_finite_is_refused(reader, text):
    with pytest.raises(InputError):
        built(READERS[reader](text))


@pytest.mark.parametrize("text", ["1_0", "１０"])
def test_tables_and_command_lines(text, tmp_path):
    table = tmp_path / "t.csv"
    table.write_text(f"time [s],force [N]\n0,1\n1,{text}\n", "utf-8")
    with pytest.raises(InputError, match="is not a number"):
        fd.Table.from_csv(table, unit="N")
    with pytest.raises(InputError, match="is not a number"):
        read_numbers(table, {"force": ("force", "N")})
    angles = tmp_path / "angles.txt"
    angles.write_text(f"mountain {text}\n", "utf-8")
    with pytest.raises(InputError, match="line 1"):
        read_angles(str(angles))
    for kind in (number, integer, parsed):
        with pytest.raises(ValueError, match=text):
            kind(text)
    assert frame_of(text) == text  # a title


def test_obj_comments_after_data():
    text = SQUARE.replace("1 0 0", "1 0 0 # a corner") + "\nf 1 2 3 # one\nf 1 3 4\t# two\n"
    drawing = obj.read(f"# a comment # in a comment\n{text}#e 1 3 2 90 # a valley\n")
    assert drawing.faces == ((0, 1, 2), (0, 2, 3))
    assert drawing.letters == ("V",)
    assert drawing.fold_angles.tolist() == [90.0]
    assert drawing.vertices[1].tolist() == [1.0, 0.0, 0.0]


def test_lines_that_a_scale_of_0_makes_points_are_told_of():
    crease = '<line id="c" x1="50" x2="50" y2="99" stroke="red" transform="scale({})"/>'
    border = '<rect width="99" height="99" stroke="black"/>'
    assert "of no length" not in str(svg.read(SVG.format(border + crease.format(1))).repairs)
    told = svg.read(SVG.format(border + crease.format(0))).repairs
    assert 'left out 1 element of no length: line "c"' in told
    closed = '<path d="M0 0L9 0L9 9L0 0Z" stroke="black"/>'  # its last piece is a point
    assert svg.read(SVG.format(closed)).repairs == ()
    insert = DXF.format("10").replace(
        "0\nENDSEC", "0\nLINE\n8\nM\n10\n5\n20\n5\n11\n5\n21\n5\n0\nENDSEC"
    )
    assert any("1 element of no length: LINE" in told for told in dxf.read(insert).repairs)


def test_keys_that_a_fold_file_has_twice_are_told_of():
    square = {"vertices_coords": [[0, 0], [1, 0], [1, 1]], "faces_vertices": [[0, 1, 2]]}
    text = json.dumps(square)
    assert fold.read(text).repairs == ()
    twice = text[:-1] + ', "vertices_coords": [[0, 0], [2, 0], [2, 2]]}'
    drawing = fold.read(twice)
    assert drawing.vertices[1].tolist() == [2.0, 0.0, 0.0]
    assert '"vertices_coords" is there twice, of which the last counts' in drawing.repairs
