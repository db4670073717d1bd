"""What patterns and what is made of them show in a notebook."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

import foldyn as fd
from foldyn.patterns import GENERATORS
from foldyn.patterns.picture import HEIGHT, LINES, MOST_PANELS, WIDTH

SVG = "{http://www.w3.org/2000/svg}"


def drawn(thing):
    """Size, filled panels and stroked edges of a picture."""
    text = thing._repr_html_()
    figure = ET.fromstring(text)
    svg = figure[0]
    paths = svg.findall(f"{SVG}path")
    fills = [each for each in paths if "fill" in each.attrib]
    return svg, fills, [each for each in paths if "stroke" in each.attrib], text


@pytest.mark.parametrize("kind", GENERATORS)
def test_every_panel_and_edge_is_drawn_once_and_inside(kind):
    pattern = GENERATORS[kind]()
    svg, panels, edges, text = drawn(pattern)
    assert len(panels) == len(pattern.faces)
    assert len(edges) == len(pattern.creases) + len(pattern.boundary)
    letters = [*pattern.assignments, *"B" * len(pattern.boundary)]
    wanted = sorted(LINES[letter][0] for letter in letters)
    assert sorted(each.attrib["stroke"] for each in edges) == wanted
    width, height = float(svg.attrib["width"]), float(svg.attrib["height"])
    assert width <= WIDTH + 1 and height <= HEIGHT + 1
    for each in edges:
        numbers = [float(part) for part in each.attrib["d"][1:].split()]
        assert all(0.0 <= x <= width for x in numbers[::2])
        assert all(0.0 <= y <= height for y in numbers[1::2])
    assert len(text) < 100_000


def test_the_nearest_panel_comes_last():
    pattern = fd.patterns.simple_fold(dihedral=40)  # a mountain along y: seen from -y and above
    _, panels, _, _ = drawn(pattern)
    assert len({each.attrib["fill"] for each in panels}) == 2  # one faces us, one turns its back


def test_what_is_made_of_a_pattern_shows_it():
    pattern = fd.patterns.simple_fold()
    structure = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate")
    case = fd.Case(structure, [fd.Fix([0, 1])])
    own = pattern._repr_html_().partition("<path")[2].partition("</svg>")[0]
    for each in (structure, case, fd.shell(pattern, structure.sheet, divisions=2)):
        assert own in each._repr_html_()
    assert "&lt;Structure n5b8" in structure._repr_html_()
    folding = fd.fold(fd.patterns.simple_fold(dihedral=170), 90.0, steps=2)
    assert "rigid" in folding._repr_html_()


def test_large_patterns_have_none():
    cells = int((MOST_PANELS / 4) ** 0.5) + 1
    assert fd.patterns.miura(cells=(cells, cells))._repr_html_() is None
