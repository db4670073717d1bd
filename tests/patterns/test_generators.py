from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.patterns import GENERATORS, eggbox, kresling, miura, simple_fold
from pairwise import in_pairs

GOLDEN = Path(__file__).resolve().parents[3] / "shared" / "golden"
CELLS = [(1, 1), (2, 1), (1, 3), (4, 3)]


def by_crease(pattern):
    pairs = [(int(a), int(b)) for a, b in pattern.creases]
    return dict(zip(pairs, np.degrees(pattern.dihedrals), strict=True))


def grid_creases(cells):
    """Creases along x and along y of a grid, as (low, high, index of the line)."""
    rows, columns = 2 * cells[0], 2 * cells[1]
    step = columns + 1
    along_x = [
        (i * step + j, (i + 1) * step + j, j) for i in range(rows) for j in range(1, columns)
    ]
    along_y = [(i * step + j, i * step + j + 1, i) for i in range(1, rows) for j in range(columns)]
    return along_x, along_y


# ------------------------------------------------------------------------------ simple fold


@pytest.mark.parametrize("dihedral", [1e-3, 30, 60, 120, 179, 180])
@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (0.3, 2.0)])
def test_simple_fold(a, b, dihedral):
    p = simple_fold(a=a, b=b, dihedral=dihedral)
    w, h = a * np.sin(np.radians(dihedral / 2)), a * np.cos(np.radians(dihedral / 2))
    expected = [[0, 0, 0], [0, b, 0], [w, 0, h], [w, b, h], [2 * w, 0, 0], [2 * w, b, 0]]
    np.testing.assert_allclose(p.vertices, expected, atol=1e-15)
    assert p.creases.tolist() == [[2, 3]]
    assert np.degrees(p.dihedrals[0]) == pytest.approx(360 - dihedral, abs=1e-10)
    assert p.assignments == ("M",)
    assert (p.face_normals[:, 2] > 0).all()  # the front is above


# ------------------------------------------------------------------------------ grids


@pytest.mark.parametrize("make", [miura, eggbox])
@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize(
    ("a", "b", "panel_angle", "dihedral"),
    [(1, 1, 60, 60), (0.025, 0.025, 60, 39.2), (1, 1.3, 75, 20), (2, 0.7, 35, 150), (1, 1, 89, 2)],
)
def test_panels_of_a_grid(
    make, cells, a, b, panel_angle, dihedral, edge_length, corner_angle, dihedral_by_wings
):
    p = make(cells=cells, a=a, b=b, panel_angle=panel_angle, dihedral=dihedral)
    rows, columns = 2 * cells[0], 2 * cells[1]
    step = columns + 1
    assert p.vertices.shape == ((rows + 1) * step, 3)
    assert len(p.faces) == rows * columns
    # panels run along x first, counter-clockwise from above, from their corner (i, j)
    for n, face in enumerate(p.faces):
        j, i = divmod(n, rows)
        first = i * step + j
        assert face == (first, first + step, first + step + 1, first + 1)
    assert (p.face_normals[:, 2] > 0).all()
    assert not any(p.flipped)
    assert p.face_planarity.max() < 1e-13
    for face in p.faces:
        for u, v, length in zip(face, face[1:] + face[:1], (b, a, b, a), strict=True):
            assert edge_length(p, u, v) == pytest.approx(length, rel=1e-12)
    for f in range(len(p.faces)):
        corners = [corner_angle(p, f, k) for k in range(4)]
        assert min(corners) == pytest.approx(panel_angle, abs=1e-9)
        assert max(corners) == pytest.approx(180 - panel_angle, abs=1e-9)
    np.testing.assert_allclose(p.dihedrals, dihedral_by_wings(p), atol=1e-11)
    # the named dihedral: valleys on even lines along x, mountains on odd ones
    angle = by_crease(p)
    for low, high, j in grid_creases(cells)[0]:
        expected = 360 - dihedral if j % 2 else dihedral
        assert angle[low, high] == pytest.approx(expected, abs=1e-9)
    letters = dict(zip(map(tuple, p.creases.tolist()), p.assignments, strict=True))
    for low, high, j in grid_creases(cells)[0]:
        assert letters[low, high] == ("M" if j % 2 else "V")


@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize(("panel_angle", "dihedral"), [(60, 60), (75, 20), (35, 150)])
def test_second_family_of_the_miura(cells, panel_angle, dihedral):
    # Flat-foldable vertex of degree four: tan(rho2/2) = cos(g) tan(rho1/2), rho the fold angles
    # (Schenk & Guest, PNAS 110 (2013) 3276, eq. 5 in other words).
    p = miura(cells=cells, panel_angle=panel_angle, dihedral=dihedral)
    rho = 2 * np.arctan(np.cos(np.radians(panel_angle)) * np.tan(np.radians(180 - dihedral) / 2))
    second = 180 - np.degrees(rho)
    angle = by_crease(p)
    step = 2 * cells[1] + 1
    for low, high, i in grid_creases(cells)[1]:
        j = low - i * step
        # mountain and valley alternate along y and along x
        expected = second if (i + j) % 2 else 360 - second
        assert angle[low, high] == pytest.approx(expected, abs=1e-9)


def test_miura_rows_keep_their_height():
    p = miura(cells=(3, 2), a=1.1, b=0.8, panel_angle=50, dihedral=100)
    z = p.vertices[:, 2].reshape(7, 5)
    assert not z[:, ::2].any()
    np.testing.assert_allclose(
        z[:, 1::2], 1.1 * np.sin(np.radians(50)) * np.sin(np.radians(40)), rtol=1e-13
    )


@pytest.mark.parametrize("dihedral", [20, 60, 140])
def test_eggbox_against_its_formulas(dihedral):
    a, b, g, d = 1.0, 1.3, np.radians(75), np.radians(dihedral)
    p = eggbox(cells=(2, 3), a=a, b=b, panel_angle=75, dihedral=dihedral)
    cos_y = np.sqrt(np.cos(g) ** 2 + np.sin(g) ** 2 * np.cos(d / 2) ** 2)
    h1, h2 = a * cos_y, b * np.cos(g) / cos_y
    length, s = a * np.sqrt(1 - cos_y**2), b * np.sqrt(1 - np.cos(g) ** 2 / cos_y**2)
    for i in range(5):
        for j in range(7):
            expected = [s * i, length * j, h1 * (j % 2) + h2 * (i % 2)]
            np.testing.assert_allclose(p.vertices[i * 7 + j], expected, atol=1e-13)


# ------------------------------------------------------------------------------ the specimen


def test_specimen():
    # Design, section 7: a = b = 25 mm, panel angle 60, cells (4, 3), tilt 70.40 degrees,
    # rest dihedrals 39.2 and 70.9 degrees, height along x 8 s = 100.48 mm.
    p = miura(cells=(4, 3), a=25e-3, b=25e-3, panel_angle=60, dihedral=180 - 2 * 70.40)
    assert len(p.vertices) == 63
    assert len(p.faces) == 48
    assert np.ptp(p.vertices[:, 0]) == pytest.approx(100.48e-3, abs=1e-5)
    angle = by_crease(p)
    smaller = {round(min(d, 360 - d), 1) for d in angle.values()}
    assert smaller == {39.2, 70.9}
    # the fold "2-9" of the paper lies between our nodes 1 and 8; rows i = 0 and 8 are the ends
    assert (1, 8) in angle
    np.testing.assert_allclose(p.vertices[:7, 0], 0.0)
    np.testing.assert_allclose(p.vertices[56:, 0], np.max(p.vertices[:, 0]), rtol=1e-15)


# ------------------------------------------------------------------------------ golden data


TILT = 100.48 / 8 / np.sqrt(25**2 - (100.48 / 8) ** 2)  # the golden nodes were made for this height
TALL = 180 - 2 * np.degrees(np.arccos(TILT / np.tan(np.radians(60))))


@pytest.mark.parametrize(
    ("name", "pattern", "rows"),
    [
        ("miura11_L1", miura(a=1, b=1, panel_angle=60, dihedral=60), slice(None)),
        ("specimen_mm", miura((4, 3), 25, b=25, panel_angle=60, dihedral=TALL), slice(None)),
        ("kresling6", kresling(sides=6, radius=1, height=0.9, twist=30), slice(None)),
        # its ridge comes first, and its far edge stands in the origin
        ("fold_dih60", simple_fold(dihedral=60).moved((-1, 0, 0)), [4, 5, 0, 1, 2, 3]),
    ],
)
def test_vertices_against_golden(name, pattern, rows):
    path = GOLDEN / f"static_{name}_N5B8.npz"
    if not path.exists():
        pytest.skip("needs ../shared")
    np.testing.assert_allclose(pattern.vertices, np.load(path)["nodes_input"][rows], atol=1e-10)


# ------------------------------------------------------------------------------ Kresling


@pytest.mark.parametrize(
    ("sides", "radius", "height", "twist", "storeys"),
    [
        (6, 1, 0.9, 30, 1),
        (3, 1, 1, -60, 2),
        (5, 0.1, 0.05, -20, 3),
        (8, 2, 3, 100, 2),
        (4, 1, 1, 0, 1),
    ],
)
def test_kresling(sides, radius, height, twist, storeys, edge_length, dihedral_by_wings):
    p = kresling(sides=sides, radius=radius, height=height, twist=twist, storeys=storeys)
    n = sides
    assert p.vertices.shape == ((storeys + 1) * n, 3)
    assert len(p.faces) == 2 * n * storeys
    for r in range(storeys + 1):
        for m in range(n):
            angle = np.radians(m * 360 / n + r * twist)
            expected = [radius * np.cos(angle), radius * np.sin(angle), r * height]
            np.testing.assert_allclose(p.vertices[r * n + m], expected, atol=1e-14 * radius * n)
    for r in range(storeys):
        low, high = r * n, (r + 1) * n
        for m in range(n):
            after = (m + 1) % n
            assert p.faces[2 * (low + m)] == (low + m, low + after, high + after)
            assert p.faces[2 * (low + m) + 1] == (low + m, high + after, high + m)
            for top, turn in ((high + m, twist), (high + after, twist + 360 / n)):
                chord = 2 * radius * np.sin(np.radians(turn) / 2)
                assert edge_length(p, low + m, top) == pytest.approx(np.hypot(chord, height))
    assert not any(p.flipped)
    np.testing.assert_allclose(p.dihedrals, dihedral_by_wings(p), atol=1e-11)
    middles = np.array([p.vertices[list(face)].mean(axis=0) for face in p.faces])
    assert ((p.face_normals * middles)[:, :2].sum(axis=1) > 0).all()  # the front is outside
    # closed around, open at both ends
    assert len(p.boundary) == 2 * n
    assert len(p.creases) == n * (3 * storeys - 1)


@pytest.mark.parametrize(
    ("twist", "diagonal", "side"),
    [
        (30, "V", "M"),
        (5, "V", "M"),
        (0, "F", "M"),
        (-30, "M", "M"),
        (-60, "M", "F"),
        (-90, "M", "V"),
    ],
)
def test_kresling_sign_of_twist(twist, diagonal, side):
    p = kresling(sides=6, height=0.9, twist=twist)
    letters = dict(zip(map(tuple, p.creases.tolist()), p.assignments, strict=True))
    for m in range(6):
        assert letters[m, 6 + (m + 1) % 6] == diagonal
        assert letters[m, 6 + m] == side


# ------------------------------------------------------------------------------ arguments


@pytest.mark.parametrize(
    ("value", "name", "kind"),
    in_pairs(
        [0, -1.0, np.nan, np.inf, "1", None, True, [1.0]],
        ["a", "b"],
        ["simple_fold", "miura", "eggbox"],
    ),
)
def test_bad_lengths(kind, name, value):
    told = "must be (a number|a finite number|greater than 0 m)"
    with pytest.raises(InputError, match=f"^{kind}: {name} = .*{told}"):
        GENERATORS[kind](**{name: value})


@pytest.mark.parametrize("kind", ["simple_fold", "miura", "eggbox"])
@pytest.mark.parametrize("value", [0, -10, 181, 300, np.nan, "60", None, True])
def test_bad_dihedral(kind, value):
    told = "(must be a (finite )?number|smaller angle)"
    with pytest.raises(InputError, match=f"^{kind}: dihedral = .*{told}"):
        GENERATORS[kind](dihedral=value)


def test_eggbox_cannot_be_flat():
    with pytest.raises(InputError, match=r"eggbox: dihedral = 180.*closes to a line"):
        eggbox(dihedral=180)


@pytest.mark.parametrize("kind", ["miura", "eggbox"])
@pytest.mark.parametrize("value", [0, 90, 120, -5, np.inf, "60", False])
def test_bad_panel_angle(kind, value):
    with pytest.raises(InputError, match=f"^{kind}: panel_angle = .*(number|acute corner)"):
        GENERATORS[kind](panel_angle=value)


@pytest.mark.parametrize("kind", ["miura", "eggbox"])
@pytest.mark.parametrize(
    ("value", "message"),
    [
        (3, "cells = 3: give two integers"),
        ((1, 2, 3), "give two integers"),
        ("12", 'cells = "12": give two integers'),
        (None, "give two integers"),
        ((1, 0), r"cells\[1\] = 0: must be a whole number, at least 1"),
        ((-1, 1), r"cells\[0\] = -1: must be a whole number, at least 1"),
        ((1.5, 1), r"cells\[0\] = 1.5: must be a whole number, at least 1"),
    ],
)
def test_bad_cells(kind, value, message):
    with pytest.raises(InputError, match=message):
        GENERATORS[kind](cells=value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sides": 2}, "kresling: sides = 2: must be a whole number, at least 3"),
        ({"storeys": 0}, "storeys = 0: must be a whole number, at least 1"),
        ({"radius": 0}, "radius = 0: must be greater than 0 m"),
        ({"height": -1}, "height = -1: must be greater than 0 m"),
        ({"twist": 120}, "twist = 120: must be between -180 and 120 degrees: beyond.*6 sides"),
        ({"twist": -180}, "twist = -180: must be between"),
        ({"sides": 3, "twist": 60}, "between -180 and 60 degrees"),
        ({"twist": "30"}, 'twist = "30": must be a number'),
    ],
)
def test_bad_kresling(arguments, message):
    with pytest.raises(InputError, match=message):
        kresling(**arguments)


def test_numpy_arguments_are_fine():
    p = miura(cells=np.array([2, 1]), a=np.float32(1), panel_angle=np.int64(60))
    assert len(p.faces) == 8
    assert {type(v) for face in p.faces for v in face} == {int}


def test_registry_is_complete():
    assert set(GENERATORS) >= {"simple_fold", "miura", "eggbox", "kresling"}
    for kind, make in GENERATORS.items():
        p = make()
        assert p.name == kind.replace("_", " ")
        assert p.face_planarity.max() < 1e-13
