"""SVG: colors, shapes, styles, transforms, units; and files that must be refused."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.formats import svg
from foldyn.formats.building import built
from foldyn.formats.chords import CHORD
from foldyn.formats.line_colors import COLORS, nearest

SAMPLES = Path(__file__).parents[3] / "shared" / "patterns"
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
BORDER = '<rect width="100" height="100" fill="none" stroke="#000"/>'


def document(inner, keys='width="100" height="100"'):
    return f"{HEAD}{keys}>{inner}</svg>"


def lines(inner, **keys):
    """(letter, start, end) of each line, y up."""
    drawing = svg.read(document(inner, **keys))
    ends = drawing.vertices[drawing.edges].round(9).tolist()
    return [(kind, *map(tuple, pair)) for kind, pair in zip(drawing.letters, ends, strict=True)]


def one(inner, **keys):
    (line,) = lines(inner, **keys)
    return line


# ------------------------------------------------------------------------ colors and angles


@pytest.mark.parametrize(
    ("color", "letter"),
    [("#FF0000", "M"), ("red", "M"), ("#00f", "V"), ("rgb(0,0,255)", "V"), ("black", "B"),
     ("#ff0", "F"), ("lime", "C"), ("#0F0", "C"), ("magenta", "U"), ("rgb(100%,0%,100%)", "U"),
     ("hsl(0,100%,50%)", "M"), ("currentColor", "B")],
)  # fmt: skip
def test_colors_of_origami_simulator(color, letter):
    assert one(f'<line x2="9" stroke="{color}"/>') == (letter, (0, 0), (9, 0))
    assert svg.read(document(f'<line x2="9" stroke="{color}"/>')).doubts == ()


@pytest.mark.parametrize(
    ("color", "letter"),
    [("#ED1C24", "M"), ("#2E3192", "V"), ("#00A651", "C"), ("#FFF200", "F"), ("#EC008C", "U"),
     ("#231F20", "B"), ("#808080", "F"), ("#00AEEF", "F"), ("crimson", "M"), ("navy", "V"),
     ("darkgreen", "C"), ("#333", "B"), ("orange", "F")],
)  # fmt: skip
def test_colors_of_other_programs_are_taken_for_the_nearest(color, letter):
    drawing = svg.read(document(f'<line x2="9" stroke="{color}"/>' * 2))
    assert drawing.letters == (letter,) * 2
    (doubt,) = drawing.doubts
    assert "of 2 lines is taken for" in doubt


def test_every_hue_and_gray_is_taken_for_something():
    for red in range(0, 256, 15):
        for green in range(0, 256, 15):
            for blue in range(0, 256, 15):
                color = nearest((red, green, blue))
                assert color in COLORS or (color is None and min(red, green, blue) > 200)
    assert all(nearest(color) == color for color in COLORS)


def test_white_lines_are_not_drawn():
    drawing = svg.read(document(BORDER + '<line x2="9" stroke="white"/>'))
    assert len(drawing.letters) == 4 and "white, not drawn" in drawing.doubts[0]


def test_opacity_is_the_fold_angle():
    inner = """<line x2="1" stroke="red" stroke-opacity="0.5"/>
    <line x2="2" stroke="blue" opacity="25%"/>
    <g opacity=".5"><line x2="3" stroke="blue" style="stroke-opacity:0.5"/></g>
    <line x2="4" stroke="rgba(255,0,0,0.2)"/><line x2="5" stroke="red"/>
    <line x2="6" stroke="#000"/>"""
    drawing = svg.read(document(inner))
    np.testing.assert_allclose(
        drawing.fold_angles, [-90, 45, 45, -36, -180, np.nan], atol=1e-12, rtol=0
    )
    assert drawing.assumptions == ("opacities are fold angles over 180 degrees",)


def test_opaque_lines_have_no_angle_unless_it_is_stated():
    drawing = svg.read(document('<line x2="1" stroke="red"/><line x2="2" stroke="blue"/>'))
    assert np.isnan(drawing.fold_angles).all() and drawing.assumptions == ()
    drawing = svg.read(
        document('<line x2="1" stroke="red" opacity="1"/><line x2="2" stroke="blue"/>')
    )
    assert drawing.fold_angles[0] == -180 and np.isnan(drawing.fold_angles[1])
    assert drawing.assumptions == (  # no claim that somebody drew angles
        "all lines have opacity 1: creases fold to 180 degrees unless --to says otherwise",
    )


# ------------------------------------------------------------------------ what is drawn


@pytest.mark.parametrize(
    "inner",
    ['<line x2="9" stroke="none"/>', '<line x2="9"/>', '<path d="M0 0h9" fill="red"/>',
     '<line x2="9" stroke="red" display="none"/>', '<line x2="9" stroke="red" opacity="0"/>',
     '<line x2="9" stroke="red" stroke-opacity="0"/>',
     '<line x2="9" stroke="red" style="visibility: hidden"/>',
     '<g display="none"><line x2="9" stroke="red"/></g>',
     '<g opacity="0"><line x2="9" stroke="red" opacity="1"/></g>',
     '<defs><line x2="9" stroke="red"/></defs>', '<symbol><line x2="9" stroke="red"/></symbol>',
     '<clipPath><line x2="9" stroke="red"/></clipPath>', '<mask><line x2="9" stroke="red"/></mask>',
     '<marker><line x2="9" stroke="red"/></marker>', "<!-- <line/> -->",
     '<x:line xmlns:x="urn:x"/>', '<g id="legend"><line x2="9" stroke="red"/></g>'],
)  # fmt: skip
def test_what_cannot_be_seen_is_left_out(inner):
    assert len(lines(BORDER + inner)) == 4
    with pytest.raises(InputError, match="lines: there are none to be seen; give crease lines"):
        svg.read(document(inner))


def test_parts_of_a_hidden_group_may_be_visible():
    inner = '<g visibility="hidden"><line x2="9" stroke="red" visibility="visible"/></g>'
    assert one(inner)[0] == "M"


def test_text_and_pictures_are_told_of_once():
    drawing = svg.read(document(BORDER + "<text>a</text><text>b</text><image/>"))
    assert drawing.repairs == ("left out 2 texts, 1 image",)


def test_styles():
    inner = """<style>/* red */ .m { stroke: #f00 } line.v, path { stroke:blue } #b{stroke:black}
      * {stroke: lime} @media print { .p { stroke: yellow } } g > .x { stroke: red }</style>
      <line class="m" x2="1"/><line class="v w" x2="2"/><line id="b" class="m v" x2="3"/>
      <line class="p" x2="4"/><line x2="5"/>
      <line class="m" style="stroke:magenta!important" x2="6"/>
      <path d="M0 0H7" stroke="black"/>"""
    assert [letter for letter, *_ in lines(inner)] == list("MVBFCUV")
    assert "1 style rule with selectors" in svg.read(document(inner)).doubts[0]


def test_styles_are_inherited():
    inner = '<g stroke="red"><g><line x2="1"/><line x2="2" stroke="inherit"/></g></g>'
    assert [letter for letter, *_ in lines(inner)] == ["M", "M"]


# ------------------------------------------------------------------------ shapes


def test_straight_shapes():
    assert lines('<rect x="1" y="2" width="3" height="4" stroke="red"/>') == [
        ("M", (1, -2), (4, -2)), ("M", (4, -2), (4, -6)), ("M", (4, -6), (1, -6)),
        ("M", (1, -6), (1, -2))]  # fmt: skip
    assert len(lines('<polyline points="0,0 1,0 1-1" stroke="red"/>')) == 2
    assert len(lines('<polygon points="0 0 1 0 1 1" stroke="red"/>')) == 3
    path = "M0,0 h2v2 H0 zm5 5l1e0.5 L9-9z"
    assert len(lines(f'<path d="{path}" stroke="red"/>')) == 4 + 3
    assert one('<line x1="10%" y1="1cm" x2="1in" y2="0" stroke="red"/>') == (
        "M", (10, round(-96 / 2.54, 9)), (96, 0))  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "center", "radius"),
    [('<circle cx="50" cy="40" r="20" stroke="red"/>', (50, -40), 20),
     ('<ellipse cx="50" cy="40" rx="20" ry="20" stroke="red"/>', (50, -40), 20),
     ('<path d="M30 40 A20 20 0 0 1 70 40 A20 20 0 0 1 30 40" stroke="red"/>', (50, -40), 20),
     ('<circle r="10" transform="translate(50 40) scale(2)" stroke="red"/>', (50, -40), 20)],
)  # fmt: skip
def test_circles_are_chords_within_the_tolerance(shape, center, radius):
    drawing = svg.read(document(BORDER + shape))
    rows = np.array(drawing.letters) == "M"
    ends = drawing.vertices[drawing.edges[rows]]
    size = 100 * np.sqrt(2)
    np.testing.assert_allclose(np.linalg.norm(ends - center, axis=2), radius, rtol=1e-9)
    middles = np.linalg.norm(ends.mean(axis=1) - center, axis=1)
    assert (
        0.2 * CHORD * size < (radius - middles).max() <= CHORD * size
    )  # and not finer than needed
    assert "drawn as chords, within 0.141 units" in drawing.repairs[0]


def test_bezier_curves_are_chords_within_the_tolerance():
    drawing = svg.read(document(BORDER + '<path d="M0 0 Q50 100 100 0" stroke="red"/>'))
    ends = drawing.vertices[drawing.edges[np.array(drawing.letters) == "M"]]
    x, y = ends.reshape(-1, 2).T
    np.testing.assert_allclose(y, -2 * x * (100 - x) / 100, atol=1e-9)  # the parabola
    middle = ends.mean(axis=1)
    assert np.abs(middle[:, 1] + 2 * middle[:, 0] * (100 - middle[:, 0]) / 100).max() < 0.1415


def test_rounded_corners():
    drawing = svg.read(document('<rect width="60" height="40" rx="10" stroke="#000"/>'))
    p = built(drawing, meters=1.0).pattern
    assert len(p.faces) == 1
    assert p.face_areas[0] == pytest.approx(60 * 40 - (4 - np.pi) * 100, rel=2e-3)


# ------------------------------------------------------------------------ placing and units


def test_transforms():
    inner = """<g transform="translate(10,20)"><g transform="rotate(90) scale(2,3)">
      <line x1="1" x2="2" y2="1" stroke="red"/></g></g>"""
    # (1, 0) -> (2, 0) -> (0, 2) -> (10, 22); (2, 1) -> (4, 3) -> (-3, 4) -> (7, 24)
    assert one(inner) == ("M", (10, -22), (7, -24))
    for text in ("matrix(0 2 -3 0 10 20)", "translate(10 20),rotate(90)\nscale(2 3)"):
        assert one(f'<line x1="1" x2="2" y2="1" transform="{text}" stroke="red"/>') == (
            "M", (10, -22), (7, -24))  # fmt: skip


def test_used_parts():
    inner = """<defs><g id="a"><line x2="1" stroke="red"/></g>
      <symbol id="s"><use href="#a" y="5"/></symbol></defs>
      <use xlink:href="#a" x="10"/><use href="#s" x="20"/><use href="#missing"/>"""
    assert lines(inner) == [("M", (10, 0), (11, 0)), ("M", (20, -5), (21, -5))]
    assert svg.read(document(inner)).repairs == ("left out 1 reference to what is not in the file",)


def test_y_is_up_and_mountains_stay():
    # an asymmetric drawing: the mountain is above the valley, as it is seen
    inner = BORDER + '<path d="M0 25H100" stroke="red"/><path d="M0 75H100" stroke="blue"/>'
    p = built(svg.read(document(inner)), meters=1.0).pattern
    height = {
        k: p.vertices[list(e), 1].mean() for k, e in zip(p.assignments, p.creases, strict=True)
    }
    assert height["M"] > height["V"]


@pytest.mark.parametrize(
    ("keys", "meters", "told"),
    [
        ('width="210mm" height="297mm" viewBox="0 0 210 297"', 1e-3, False),
        ('width="10cm" height="10cm" viewBox="0 0 50 50"', 2e-3, False),
        ('width="1in" height="1in"', 0.0254 / 96, False),
        ('width="10in" height="20in" viewBox="0 0 10 10"', 0.0254, False),  # meet
        ('width="10in" height="20in" viewBox="0 0 10 10" preserveAspectRatio="xMidYMid slice"',
         0.0508, False),
        ('width="100" height="100"', 0.0254 / 96, True),
        ('width="100px" height="100px" viewBox="0 0 50 50"', 2 * 0.0254 / 96, True),
        ('width="100%" viewBox="0 0 50 50"', 0.0254 / 96, True),
        ("", 0.0254 / 96, True),
    ],
)  # fmt: skip
def test_units(keys, meters, told):
    found = built(svg.read(document('<rect width="10" height="10" stroke="#000"/>', keys)))
    assert found.diagnosis.size[0] == pytest.approx(10 * meters, rel=1e-12)
    assert bool(found.diagnosis.assumptions) == told
    if told:
        assert "the file does not say its unit: 1 " in found.diagnosis.assumptions[0]


def test_stretched_view():
    keys = 'width="10mm" height="20mm" viewBox="0 0 10 10" preserveAspectRatio="none"'
    found = built(svg.read(document('<rect width="10" height="10" stroke="#000"/>', keys)))
    assert found.diagnosis.size[:2] == pytest.approx((0.01, 0.02))


def test_abbreviations_of_illustrator():
    doctype = """<?xml version="1.0" encoding="utf-8"?>
    <!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/svg11.dtd" [
    <!ENTITY ns_svg "http://www.w3.org/2000/svg">
    <!ENTITY col '#FF0000'>
    ]>"""
    text = doctype + '<svg xmlns="&ns_svg;"><line x2="1" stroke="&col;"/></svg>'
    assert svg.read(text.lstrip()).letters == ("M",)


# ------------------------------------------------------------------------ refused

ENTITIES = "".join(
    f'<!ENTITY {b} "{10 * f"&{a};"}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)
BOMB = f'<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa">{ENTITIES}]><svg>&j;</svg>'
USE_BOMB = document("".join(
    f'<g id="g{k}">' + f'<use href="#g{k + 1}"/>' * 10 + "</g>" for k in range(20)
) + '<line id="g20" x2="1" stroke="red"/>')  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOMB, "is not an SVG file that can be read safely"),
        ('<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]><svg>&x;</svg>', "safely"),
        ('<!DOCTYPE svg [<!ENTITY % x SYSTEM "http://localhost/x"> %x;]><svg/>', "safely"),
        (USE_BOMB, "the elements of the drawing are too many"),
        (document('<use id="a" href="#a"/>'), "used within each other more than 100 deep"),
        ("<g>" * 100_000 + "</g>" * 100_000, "nested deeper than 100 levels"),
        (document(BORDER)[:-9], "is not an SVG file"),
        ("", "is not an SVG file"),
        ("\x00\x01", "is not an SVG file"),
        ("<html/>", "is not an SVG file: its first element is <html>"),
        (document('<path d="M0 0 L" stroke="red"/>'), r'path 1\.d = "M0 0 L": is no path'),
        (document('<path id="p" d="0 1" stroke="red"/>'), r'path "p"\.d = "0 1": is no path'),
        (document('<line x2="wide" stroke="red"/>'), r'line 1\.x2 = "wide": give a length'),
        (document('<line x2="2" stroke="no-color"/>'), r'line 1\.stroke = "no-color": is no color'),
        (document('<line x2="2" stroke="red" opacity="x"/>'), r"line 1\.opacity = "),
        (document('<line x2="2" stroke="red" transform="spin(3)"/>'), r"line 1\.transform = "),
        (document('<line x2="1e99" stroke="red"/>'), "line 1: coordinates must be finite"),
        (document('<g transform="scale(1e300)"><line x2="1e300" stroke="red"/></g>'), "finite"),
        (document('<path d="M1 1z" stroke="red"/>'), "lines: "),
        (document(""), "lines: there are none to be seen"),
    ],
    ids=range(20),
)  # fmt: skip
def test_refused(text, message):
    start = time.perf_counter()
    with pytest.raises(InputError, match=message):
        built(svg.read(text))
    assert time.perf_counter() - start < 10.0


@pytest.mark.parametrize(
    "inner",
    [f"<style>{'/*' * 200_000}</style>", f"<style>{'a' * 400_000}</style>",
     f"<style>{'a,' * 100_000}{{stroke:red}}</style>",
     f'<line stroke="red" x2="{"1" * 100_000}"/>', f'<line stroke="{"r" * 100_000}"/>',
     f'<line stroke="red" transform="{"scale(1" * 20_000}"/>',
     f'<path stroke="red" d="M{" 1" * 60_001}"/>', f'<path stroke="red" d="{"M" * 100_000}"/>'],
    ids=range(8),
)  # fmt: skip
def test_long_text_takes_no_long_time(inner):
    start = time.perf_counter()
    with pytest.raises(InputError):
        built(svg.read(document(inner)))
    assert time.perf_counter() - start < 10.0


# ------------------------------------------------------------------------ real files

REAL = {
    # vertices, panels, creases by letter: counted in the pictures
    "curvedPleatSimple": (17, 16, {"M": 1, "V": 1, "F": 14}),
    "miura-ori": (13 * 14, 12 * 13, None),
    "popupSimple": (114, 72, None),
    "simpleVertex": (9, 4, {"M": 3, "V": 1}),
}


@pytest.mark.parametrize("name", sorted(REAL))
def test_real_files(name):
    path = SAMPLES / f"amandaghassaei+OrigamiSimulator__{name}.svg"
    if not path.exists():
        pytest.skip("needs ../shared")
    found = built(svg.read(path.read_text()))
    vertices, panels, letters = REAL[name]
    p = found.pattern
    assert (len(p.vertices), len(p.faces)) == (vertices, panels)
    if letters:
        assert {kind: p.assignments.count(kind) for kind in set(p.assignments)} == letters
    assert found.diagnosis.doubts == ()
    box = np.ptp(p.vertices[:, :2], axis=0).prod()
    if name != "miura-ori":  # a rectangle
        assert p.face_areas.sum() == pytest.approx(box, rel=1e-4)
    else:
        assert len(p.creases) == 12 * 12 + 13 * 11  # of each direction, without the outline's
        assert found.diagnosis.vertices.maekawa.all()
        assert found.diagnosis.vertices.kawasaki(1e-3).all()
