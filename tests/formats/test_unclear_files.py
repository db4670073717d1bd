"""Files that can be taken in two ways: read as they are meant, or doubted or refused by name."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.formats import diagnose, read_pattern, svg
from foldyn.formats.building import built
from foldyn.patterns.frames import fold_angles

# a square vertex with creases to its corners and, below, two lists of letters and angles
FAN = {
    "vertices_coords": [[0, 0], [2, 0], [0, 2], [-2, 0], [0, -2]],
    "faces_vertices": [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]],
    "edges_vertices": [[0, 1], [0, 2], [0, 3], [0, 4]],
    "edges_assignment": ["V", "V", "U", "M"],
}


@pytest.mark.parametrize(
    ("letters", "angles", "wanted"),
    [
        ("VVUM", [40, 50, 0, -60], [40, 50, None, -60]),  # 0: none is given
        ("VVUM", [40, 50, 25, -60], [40, 50, 25, -60]),
        ("VVUM", [40, 0, None, -60], [40, 0, None, -60]),  # a valley may stay flat at first
        ("UUUU", [40, 0, 0, -60], [40, None, None, -60]),
    ],
)
def test_an_unassigned_crease_with_an_angle_of_0_is_free(file, letters, angles, wanted):
    path = file(**{**FAN, "edges_assignment": list(letters)}, edges_foldAngle=angles)
    given = np.degrees(read_pattern(path).fold_angles)
    np.testing.assert_allclose(given, [np.nan if w is None else w for w in wanted])


# ------------------------------------------------------------------------------ closed creases


def pleats(letters, depth=0.0):
    """Fields of a strip of panels 2 x 1, closed at each crease, and what FOLD says of its layers.

    A panel lies in front of the one before it, seen from that one's front, at a valley. `depth` is
    that of one layer upon the next.
    """
    count = len(letters) + 1
    points = [[2.0 * (k % 2), y, 0.0] for k in range(count + 1) for y in (0, 1)]
    faces, orders, z = [], [], 0.0
    for k in range(count):
        faces.append([2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1])
    for k, letter in enumerate(letters):
        front = 1 if k % 2 == 0 else -1  # panel k faces up
        z += depth * front * (1 if letter == "V" else -1)
        for point in points[2 * k + 4 : 2 * k + 6]:
            point[2] = z
        orders.append([k + 1, k, 1 if letter == "V" else -1])
    return {
        "vertices_coords": points,
        "faces_vertices": faces,
        "edges_vertices": [[2 * k + 2, 2 * k + 3] for k in range(count - 1)],
        "edges_assignment": list(letters),
        "faceOrders": orders,
    }


@pytest.mark.parametrize("letters", ["M", "V", "MV", "VMM", "MVVM"])
@pytest.mark.parametrize("known", ["orders", "orders turned", "angles", "unassigned"])
def test_letters_of_closed_creases_are_those_of_their_layers(file, letters, known):
    fields = pleats(letters)
    if known == "angles":
        del fields["faceOrders"]
        fields["edges_foldAngle"] = [180 if letter == "V" else -180 for letter in letters]
    if known == "orders turned":  # a panel listed the other way around has its front below
        fields["faces_vertices"][1].reverse()
        for order in fields["faceOrders"]:
            order[2] *= -1 if order[1] == 1 else 1
    if known == "unassigned":
        fields["edges_assignment"] = ["U"] * len(letters)
    drop = ["edges_assignment"] if known != "unassigned" else []
    if known.startswith("orders"):
        drop.append("edges_vertices")
    found = diagnose(file(**fields, drop=drop))
    assert not found.diagnosis.doubts
    dihedrals = found.pattern.dihedrals
    np.testing.assert_array_equal(dihedrals, [0 if each == "V" else 2 * np.pi for each in letters])
    if known.startswith("orders"):
        assert "".join(found.pattern.assignments) == letters
        folding = fd.fold(found.pattern, 180.0, steps=2)  # closed: no panel moves
        assert folding.layers is not None
        held = {tuple(row) for row in np.sort(folding.layers[:, :2]).tolist()}
        assert held >= {(k, k + 1) for k in range(len(letters))}


def test_closed_creases_without_letters_or_layers_are_doubted(file):
    found = diagnose(
        file(**pleats("MV"), drop=["edges_assignment", "edges_vertices", "faceOrders"])
    )
    (doubt,) = found.diagnosis.doubts
    assert "2 closed creases without letter or order of layers, as (2, 3)" in doubt
    assert found.pattern.assignments == ("V", "V")


def test_letters_that_contradict_the_layers_are_doubted(file):
    fields = {**pleats("MV"), "edges_assignment": ["M", "M"]}
    (doubt,) = diagnose(file(**fields)).diagnosis.doubts
    assert "1 closed crease whose letter contradicts the order of layers, as (4, 5)" in doubt


@pytest.mark.parametrize("depth", [3e-10, -3e-10, -2e-7, 3e-4])
def test_the_letter_tells_the_side_of_a_closed_crease(file, depth):
    # a negative depth puts each layer on the wrong side of the one before, as rounding does
    found = diagnose(file(**pleats("MVM", depth)))
    assert not found.diagnosis.doubts and found.pattern.assignments == ("M", "V", "M")
    angles = np.array([-180.0, 180.0, -180.0])
    told = 180.0 - np.degrees(found.pattern.dihedrals)
    np.testing.assert_allclose(told, angles, atol=0.02)
    np.testing.assert_allclose(np.degrees(fold_angles(found.pattern)), angles, atol=0.02)
    opened = fd.fold(found.pattern, 120.0, steps=4)  # it opens on its own side
    np.testing.assert_allclose(np.degrees(opened.angles), angles / 1.5, atol=1e-3)


def test_a_crease_on_the_wrong_side_of_closed_cannot_be_simulated(file):
    sheet = fd.Sheet(1e6, 0.3, 1e-3)
    for depth in (-2e-7, 2e-4):
        pattern = read_pattern(file(**pleats("V", depth)))
        if depth > 0:
            assert fd.discretize(pattern, sheet, preset="plate").fold_rest[0] == pytest.approx(
                1e-4, rel=1e-3
            )
        else:
            with pytest.raises(InputError, match="folded flat upon itself"):
                fd.discretize(pattern, sheet, preset="plate")


# ------------------------------------------------------------------------------ SVG

PAGE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40" width="60mm" height="40mm">'


def drawn(inner):
    """Letter and ends of each line of an SVG file, in mm, y down."""
    drawing = svg.read(f"{PAGE}{inner}</svg>")
    ends = (drawing.vertices * [1, -1])[drawing.edges].round(6).tolist()
    return [(letter, *map(tuple, pair)) for letter, pair in zip(drawing.letters, ends, strict=True)]


@pytest.mark.parametrize(
    ("transform", "start", "end"),
    [  # of a line from (2, 1) to (4, 1)
        ("translate(3px, 2px)", (5, 3), (7, 3)),
        ("translate(3px)", (5, 1), (7, 1)),
        ("translateY(1cm)", (2, 1 + 96 / 2.54), (4, 1 + 96 / 2.54)),
        ("scale(50%)", (1, 0.5), (2, 0.5)),
        ("scaleX(3)", (6, 1), (12, 1)),
        ("rotate(90deg)", (-1, 2), (-1, 4)),
        ("rotate(0.25turn)", (-1, 2), (-1, 4)),
        ("rotate(100grad) translateX(1px)", (-1, 3), (-1, 5)),
        ("skewX(45deg)", (3, 1), (5, 1)),
        ("skew(0.7853981634rad, 0deg)", (3, 1), (5, 1)),
        ("matrix(0, 1, -1, 0, 5, 0)", (4, 2), (4, 4)),
        ("none", (2, 1), (4, 1)),
    ],
)
def test_css_transforms_place_lines_as_browsers_do(transform, start, end):
    line = '<line x1="2" y1="1" x2="4" y2="1" stroke="red"'
    wanted = [("M", tuple(np.round(start, 6)), tuple(np.round(end, 6)))]
    assert drawn(f'{line} style="transform: {transform}"/>') == wanted
    assert drawn(f"<style>.a {{transform: {transform}}}</style>{line} class='a'/>") == wanted
    # CSS goes before the attribute of the element, not before that of a group
    assert drawn(f'{line} transform="scale(9)" style="transform:{transform}"/>') == wanted
    (moved,) = drawn(f'<g transform="translate(1,0)">{line} style="transform:{transform}"/></g>')
    np.testing.assert_allclose(np.subtract(moved[1:], wanted[0][1:]), [[1, 0]] * 2, atol=1e-6)


def test_transforms_about_an_origin():
    for origin in ("2px 1px", "2 1"):
        style = f"transform: rotate(90deg) scale(2); transform-origin: {origin}"
        line = f'<line x1="2" y1="1" x2="4" y2="1" stroke="red" style="{style}"/>'
        assert drawn(line) == [("M", (2, 1), (2, 5))]
    corner = "transform: scale(2); transform-origin: left top"
    assert drawn(f'<line x2="4" stroke="red" style="{corner}"/>') == [("M", (0, 0), (8, 0))]


@pytest.mark.parametrize(
    ("style", "message"),
    [
        ("transform: rotate(45deg); transform-origin: 50% 50%", "line 1.transform-origin: is not"),
        ("transform: rotate(45deg); transform-origin: center", "line 1.transform-origin = "),
        ("transform: scale(2); transform-box: fill-box", "line 1.transform-origin: is not read"),
        ("transform: translate(10%, 0)", 'line 1.transform = "translate.10%, 0.": is no transform'),
        ("transform: rotate3d(1, 0, 0, 60deg)", "line 1.transform = .* is no transform"),
        ("transform: rotate(3px)", "line 1.transform = .* is no transform"),
        ("transform: translate(calc(1mm + 2px), 0)", "or apply it to the coordinates"),
        ("translate: 3px 4px", 'line 1.translate = "3px 4px": is not read from CSS'),
        ("rotate: 30deg", 'line 1.rotate = "30deg": is not read from CSS'),
        ("zoom: 2", 'line 1.zoom = "2": is not read from CSS; write it as a "transform"'),
    ],
)
def test_css_that_moves_lines_in_other_ways_is_refused(style, message):
    with pytest.raises(InputError, match=message):
        drawn(f'<line x2="4" stroke="red" style="{style}"/>')


def test_css_that_shapes_lines_is_refused():
    with pytest.raises(InputError, match=r'circle 1\.r = "9px": is not read from CSS; write it'):
        drawn('<style>circle {r: 9px}</style><circle r="4" stroke="red"/>')
    assert drawn('<g style="width: 100%"/><line x2="4" stroke="blue"/>') == [("V", (0, 0), (4, 0))]
    assert drawn('<line x2="4" stroke="blue" style="zoom: 100%"/>') == [("V", (0, 0), (4, 0))]


@pytest.mark.parametrize("letter", "BMVFUC")
@pytest.mark.parametrize("look", ["", 'stroke="none"', 'stroke="#0000ff"', 'stroke="white"'])
def test_data_assignment_goes_before_colors(letter, look):
    line = f'<line x2="7" {look} data-assignment="{{}}"/>'
    wanted = [(letter, (0, 0), (7, 0))]
    assert drawn(line.format(letter)) == drawn(line.format(letter.lower())) == wanted
    inside = f'<g data-assignment="{letter}"><line x2="7" {look}/></g>'
    assert drawn(inside) == wanted
    assert drawn(f'<g data-assignment="F">{line.format(letter)}</g>') == wanted


def test_data_fold_angles_go_before_opacity():
    text = f"""{PAGE}<rect width="60" height="40" data-assignment="B"/>
      <line x1="20" x2="20" y2="40" data-assignment="V" data-foldAngle="35"/>
      <line x1="40" x2="40" y2="40" data-assignment="M" data-foldAngle="-70" opacity="0.5"/>
      </svg>"""
    found = built(svg.read(text))
    assert found.pattern.assignments == ("V", "M") and not found.diagnosis.assumptions
    np.testing.assert_allclose(np.degrees(found.pattern.fold_angles), [35, -70])


@pytest.mark.parametrize(
    ("attribute", "message"),
    [
        ('data-assignment="mountain"', "line 1.data-assignment = "),
        ('data-assignment="M" data-foldAngle="x"', "line 1.data-foldangle = .x.: give degrees"),
        ('data-assignment="M" data-foldAngle="200"', "line 1: a fold angle of 200 degrees"),
        ('data-assigned="M"', "lines: there are none to be seen; .* or attributes data-assignment"),
    ],
)
def test_strange_data_attributes_are_refused(attribute, message):
    with pytest.raises(InputError, match=message):
        built(svg.read(f'{PAGE}<line x2="7" {attribute}/></svg>'))


# ------------------------------------------------------------------------------ black lines inside

SHEET = '<rect width="60" height="40" fill="none" stroke="black"/>'


@pytest.mark.parametrize(
    ("black", "leaves"),
    [
        ("M20 0V40", 1600),  # one crease drawn in black: a third would be lost
        ("M20 0V40M40 0V40", 800),
        ("M0 10H60M0 20H60M0 30H60", 600),
        ("M0 0L60 40M60 0L0 40", 600),
        ("M20 0V40M0 25H60", 1000),
        ("M10 10H50V30H10ZM30 30V40M30 0V10", 800),  # a window, and the frame cut in two
    ],
)
def test_black_lines_that_would_cut_pieces_off_are_refused(black, leaves):
    edge = '<line x1="60" y2="1" x2="60" stroke="red"/>'  # with it not all lines are black
    text = f'{PAGE}{SHEET}{edge}<path d="{black}" fill="none" stroke="black"/></svg>'
    with pytest.raises(InputError, match=f"would leave {leaves} of its 2400 mm2: draw creases"):
        built(svg.read(text))
    magenta = text.replace('"none" stroke="black"/></svg>', '"none" stroke="magenta"/></svg>')
    found = built(svg.read(magenta))
    assert found.pattern.face_areas.sum() == pytest.approx(2400e-6)
    assert set(found.pattern.assignments) <= {"U", "F"}


def test_black_slits_and_windows_stay_cuts_but_are_doubted():
    fold = '<path d="M30 0V10M30 30V40" stroke="red"/>'
    window = '<rect x="20" y="10" width="20" height="20" fill="none" stroke="black"/>'
    found = built(svg.read(f"{PAGE}{SHEET}{fold}{window}</svg>"))
    assert found.pattern.face_areas.sum() == pytest.approx(2000e-6)
    first, second = found.diagnosis.doubts
    assert "6 lines of the outline inside the sheet taken as cuts" in first
    assert "left out 1 region that cuts bound on all sides, of 400 mm2" in second
    slit = '<path d="M10 0V40M50 0V40" stroke="blue"/><path d="M10 20H50" stroke="black"/>'
    found = built(svg.read(f"{PAGE}{SHEET}{slit}</svg>"))
    assert found.pattern.face_areas.sum() == pytest.approx(2400e-6)
    assert "1 line of the outline inside the sheet taken as cuts" in found.diagnosis.doubts[0]
