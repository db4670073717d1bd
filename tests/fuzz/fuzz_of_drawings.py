"""Fuzzers of pattern files that hold lines: SVG, CP, OPX and DXF."""

from __future__ import annotations

import io
from pathlib import Path

from fuzz_target import Target

from foldyn.formats import cp, dxf, svg
from foldyn.formats.files import diagnose
from foldyn.patterns import miura, simple_fold

STYLED = """<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="10cm"
 height="8cm" viewBox="0 0 100 80">
<style>.m{stroke:#f00;stroke-opacity:.5} line, #v {stroke: blue} /* all */</style>
<defs><g id="part"><polyline points="0,0 10,0 10,10" class="m"/></g></defs>
<rect x="0" y="0" width="100" height="80" rx="5" fill="none" stroke="black"/>
<g transform="translate(50,40) rotate(30) scale(2 1)" opacity="0.9">
 <circle r="10" stroke="rgb(0,0,255)"/><ellipse cx="1" cy="2" rx="3" ry="5%" stroke="lime"/>
 <use xlink:href="#part" x="3"/></g>
<path class="m" d="M0 40 C30 10 60 70 100 40 m-50-40 q5 20 0 40 t0 40 M0,20 A60 40 0 0 1 100,20z"/>
<path id="v" d="M0,0L100,80M100 0 0 80"/><text x="3">words</text>
<polygon points="20,20 30,20 30,30" style="stroke:yellow;display:inline"/>
</svg>
"""
LINE = """<void index="{0}"><object class="oripa.OriLineProxy">
<void property="type"><int>{1}</int></void><void property="x0"><double>{2}</double></void>
<void property="x1"><double>{4}</double></void><void property="y0"><double>{3}</double></void>
<void property="y1"><double>{5}</double></void></object></void>
"""
OPX = """<?xml version="1.0" encoding="UTF-8"?>
<java version="1.5.0_05" class="java.beans.XMLDecoder"><object class="oripa.DataSet">
<void property="title"><string>fold</string></void><void property="lines">
<array class="oripa.OriLineProxy" length="{}">
{}</array></void></object></java>
"""
SVG_WORDS = (
    "svg", "g", "path", "line", "rect", "circle", "use", "style", "defs", "stroke", "opacity", "d",
    "transform", "points", "viewBox", "width", "matrix", "scale", "rotate", "none", "red", "#00f",
    "M", "L", "C", "A", "Q", "z", "mm", "%", "id", "class", "href", "<!ENTITY a 'b'>", "&a;",
    "preserveAspectRatio", "<![CDATA[", "<!--", "url(#a)", "display",
)  # fmt: skip
DXF_WORDS = (
    "LINE", "CIRCLE", "ARC", "SPLINE", "LWPOLYLINE", "POLYLINE", "VERTEX", "SEQEND", "INSERT",
    "BLOCK", "ENDBLK", "LAYER", "MOUNTAIN", "VALLEY", "CUT", "SECTION", "ENDSEC", "ENTITIES", "EOF",
    "HEADER", "$INSUNITS", "$ACADVER", "AC1009", "AC1024", "  0", "  8", " 10", " 20", " 62",
)  # fmt: skip


def _flat() -> list:
    return [simple_fold(dihedral=180), miura(cells=(2, 1), dihedral=180)]


def _svg(_: Path) -> list[bytes]:
    return [STYLED.encode(), *(svg.write(pattern).encode() for pattern in _flat())]


def _cp(_: Path) -> list[bytes]:
    crossing = "1 0 0 9 0\n1 9 0 9 9\n1 9 9 0 9\n1 0 9 0 0\n2 0 0 9 9\n3 9 0 0 9\n4 0 5 9 4\n"
    return [crossing.encode(), *(cp.write(pattern).encode() for pattern in _flat())]


def _opx(_: Path) -> list[bytes]:
    texts = [cp.write(pattern).split("\n")[:-1] for pattern in _flat()]
    lines = [[LINE.format(k, *line.split()) for k, line in enumerate(text)] for text in texts]
    return [OPX.format(len(some), "".join(some)).encode() for some in lines]


def _dxf(_: Path) -> list[bytes]:
    import ezdxf

    document = ezdxf.new("R12")
    space = document.modelspace()
    space.add_polyline2d([(0, 0), (9, 0), (9, 9, 0.3), (0, 9)], close=True)
    block = document.blocks.new("part")
    block.add_circle((1, 1), 2, dxfattribs={"layer": "cut"})
    space.add_blockref("part", (4, 4))
    space.add_arc((0, 0), 5, 0, 90, dxfattribs={"color": 1})
    space.add_line((0, 0), (9, 9), dxfattribs={"color": 5})
    text = io.StringIO()
    document.write(text)
    return [text.getvalue().encode(), *(dxf.write(pattern).encode() for pattern in _flat())]


def read(file: Path) -> str:
    """Read a file, with all that is said of it."""
    return str(diagnose(file).diagnosis)


TARGETS = (
    Target("svg", _svg, read, ".svg", SVG_WORDS),
    Target("cp", _cp, read, ".cp", ("1", "2", "3", "4", "0", "#", "-1", "1e-9")),
    Target("opx", _opx, read, ".opx", ("object", "void", "property", "type", "x0", "y1", "double")),
    Target("dxf", _dxf, read, ".dxf", DXF_WORDS),
)
