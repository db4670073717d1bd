"""Files that can be taken in two ways: read as they are meant, or doubted or refused by name."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.formats import diagnose, read_pattern
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
            assert fd.discretize(pattern, sheet).fold_rest[0] == pytest.approx(1e-4, rel=1e-3)
        else:
            with pytest.raises(InputError, match="folded flat upon itself"):
                fd.discretize(pattern, sheet)
