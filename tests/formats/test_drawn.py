"""What SVG, STL, DXF and CP files hold that others will read."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from foldyn.formats import write_pattern
from foldyn.formats.dxf import ezdxf
from foldyn.formats.stl import triangles
from foldyn.patterns import Pattern, kresling, miura, simple_fold

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def strip():
    """Flat, 40 x 30 mm, with a mountain to be folded by a right angle."""
    p = simple_fold(a=0.02, b=0.03, dihedral=180)
    return p.changed(assignments="M", fold_angles=[-np.pi / 2], name="a <b> & c")


def test_svg_has_its_true_size_and_the_colors_of_origami_simulator(strip, tmp_path):
    write_pattern(strip, tmp_path / "x.svg")
    root = ElementTree.fromstring((tmp_path / "x.svg").read_text("utf-8"))
    _, _, width, height = map(float, root.attrib["viewBox"].split())
    assert root.attrib["width"] == f"{width!r}mm" and root.attrib["height"] == f"{height!r}mm"
    lines = root.findall(f".//{SVG}line")
    ends = np.array(
        [[float(line.attrib[key]) for key in ("x1", "y1", "x2", "y2")] for line in lines]
    )
    np.testing.assert_allclose(np.ptp(ends.reshape(-1, 2), axis=0), [40.0, 30.0])
    (mountain,) = [line.attrib for line in lines if line.attrib["stroke"] == "#ff0000"]
    assert float(mountain["stroke-opacity"]) == 0.5
    assert sum(line.attrib["stroke"] == "#000000" for line in lines) == 6
    assert root.find(f"{SVG}title").text == "a <b> & c"
    # the legend names what is there, in text that no cutter cuts
    (legend,) = [group for group in root.findall(f"{SVG}g") if group.attrib["id"] == "legend"]
    said = " ".join("".join(legend.itertext()).split())
    assert "boundary mountain" in said and "valley" not in said
    assert "40 x 30 mm" in said and "opacity is the fold angle" in said
    assert {element.tag for element in legend.iter()} == {SVG + "g", SVG + "text", SVG + "tspan"}


def test_a_crease_to_be_folded_by_nothing_is_still_drawn(strip, tmp_path):
    write_pattern(strip.changed(fold_angles=[0.0]), tmp_path / "x.svg")
    (share,) = re.findall('stroke-opacity="([^"]*)"', (tmp_path / "x.svg").read_text())
    assert 0.0 < float(share) < 1e-5


def facets(path):
    """Normals (n, 3) and corners (n, 3, 3) of a text STL file."""
    numbers = [
        [float(word) for word in line.split()[-3:]]
        for line in path.read_text().splitlines()
        if line.startswith(("facet", "vertex"))
    ]
    table = np.array(numbers).reshape(-1, 4, 3)
    return table[:, 0], table[:, 1:]


@pytest.mark.parametrize("p", [miura(), kresling(), simple_fold()], ids=repr)
def test_stl_triangles_cover_the_panels_and_keep_their_front(p, tmp_path):
    write_pattern(p, tmp_path / "x.stl")
    normals, corners = facets(tmp_path / "x.stl")
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(across, axis=1)
    assert areas.sum() == pytest.approx(1e6 * p.face_areas.sum())  # mm2
    np.testing.assert_allclose(normals, across / (2 * areas[:, None]), atol=1e-8)
    up = {tuple(np.round(n, 6) + 0.0) for n in p.face_normals}
    assert {tuple(np.round(n, 6) + 0.0) for n in normals} == up


def test_stl_of_a_polygon_with_a_notch_and_a_corner_on_a_side():
    outline = [(0, 0), (1, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)]
    p = Pattern(np.array(outline, dtype=float), [range(6)]).rotated(37, (1, 2, 3))
    found = triangles(p)
    x = p.vertices[found]
    across = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    assert len(found) == 4
    assert (across @ p.face_normals[0] > 0).all()
    assert 0.5 * np.linalg.norm(across, axis=1).sum() == pytest.approx(p.face_areas[0])


def test_dxf_has_layers_and_millimeters(strip, tmp_path):
    write_pattern(strip.changed(fold_angles=None), tmp_path / "x.dxf")
    library = pytest.importorskip("ezdxf")
    assert ezdxf() is library
    document = library.readfile(tmp_path / "x.dxf")
    assert document.units == library.units.MM
    lines = list(document.modelspace())
    layers = [line.dxf.layer for line in lines]
    assert (layers.count("MOUNTAIN"), layers.count("BOUNDARY")) == (1, 6)
    assert max(line.dxf.start.x for line in lines) == pytest.approx(40.0)


def test_cp_has_the_numbers_of_oripa_and_the_y_of_the_screen(strip, tmp_path):
    write_pattern(strip.changed(fold_angles=None), tmp_path / "x.cp")
    rows = [line.split() for line in (tmp_path / "x.cp").read_text().splitlines()]
    assert sorted(row[0] for row in rows) == ["1"] * 6 + ["2"]
    (mountain,) = [list(map(float, row[1:])) for row in rows if row[0] == "2"]
    assert mountain == pytest.approx([20.0, 0.0, 20.0, -30.0])
