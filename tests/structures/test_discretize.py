"""The arrays of a structure: shapes, numbering, orientation, centers, cuts, arguments."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.patterns import GENERATORS
from named_models import named

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1000.0)
MORE = {"simple_fold": {}, "miura": {"cells": (2, 1)}, "eggbox": {"cells": (1, 2)}, "kresling": {}}
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def one(vertices, **options):
    pattern = fd.Pattern(vertices, [list(range(len(vertices)))])
    return fd.discretize(pattern, SHEET, **named(options))


@pytest.mark.parametrize("name", sorted(GENERATORS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_counts_and_shapes(name, scheme):
    pattern = GENERATORS[name](**MORE.get(name, {}))
    s = fd.discretize(pattern, SHEET, scheme=scheme)
    sizes = np.array([len(f) for f in pattern.faces])
    with_center = (sizes > 3) if scheme == "n5b8" else np.zeros(len(sizes), bool)
    inner = sizes[with_center].sum() + (sizes[~with_center] - 3).sum()
    n, creases = len(pattern.vertices) + with_center.sum(), len(pattern.creases)
    bars, triangles = inner + len(pattern.edges), inner + (~with_center).sum()
    for rows, names in (
        ((n, 3), ("nodes",)), ((n, n), ("mass",)), ((triangles, 3), ("triangles",)),
        ((bars, 2), ("bars",)), ((bars,), ("bar_length", "bar_area")),
        ((creases, 4), ("folds",)), ((creases,), ("fold_stiffness", "fold_rest")),
        ((inner, 4), ("bends",)), ((inner,), ("bend_stiffness", "bend_rest")),
    ):  # fmt: skip
        assert {getattr(s, name).shape for name in names} == {rows}
    np.testing.assert_array_equal(s.nodes[: len(pattern.vertices)], pattern.vertices)
    assert (s.bar_area > 0).all() and (s.bar_length > 0).all()
    assert len({tuple(sorted(b)) for b in s.bars.tolist()}) == len(s.bars)
    u = np.zeros_like(s.nodes)
    assert s.internal_force(u).shape == (n, 3) and s.tangent(u).shape == (3 * n, 3 * n)
    assert set(s.energies(u)) == {"strain_bars", "strain_folds", "strain_bends"}
    assert isinstance(s.energy(u), float) and scheme in repr(s)


@pytest.mark.parametrize("name", sorted(GENERATORS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_triangles_cover_the_panels(name, scheme):
    """Counter-clockwise from the front, with the panels' areas, each side used once."""
    pattern = GENERATORS[name](**MORE.get(name, {}))
    s = fd.discretize(pattern, SHEET, scheme=scheme)
    a, b, c = (s.nodes[s.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a) / 2
    signed = np.einsum("ij,ij->i", normal, pattern.face_normals[s.triangle_panel])
    np.testing.assert_allclose(signed, np.linalg.norm(normal, axis=1), rtol=1e-12)
    areas = np.bincount(s.triangle_panel, signed)
    np.testing.assert_allclose(areas, pattern.face_areas, rtol=1e-12)
    sides = [(t[k], t[(k + 1) % 3]) for t in s.triangles.tolist() for k in range(3)]
    assert len(sides) == len(set(sides))


@pytest.mark.parametrize("name", sorted(GENERATORS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_hinge_orientation(name, scheme):
    """Axis j to k as the face of wing i runs; wing l's face runs k to j; angle from the front."""
    pattern = GENERATORS[name](**MORE.get(name, {}))
    s = fd.discretize(pattern, SHEET, scheme=scheme)
    sides = {
        (t[k - 2], t[k - 1]): (t[k], p)
        for p, t in zip(s.triangle_panel.tolist(), s.triangles.tolist(), strict=True)
        for k in range(3)
    }
    for j, k, i, l in [*s.folds.tolist(), *s.bends.tolist()]:  # noqa: E741
        assert (sides[j, k][0], sides[k, j][0]) == (i, l)
    for (j, k, *_), crease in zip(s.folds.tolist(), pattern.creases.tolist(), strict=True):
        assert sorted((j, k)) == crease
        face = pattern.faces[sides[j, k][1]]
        assert face[(face.index(j) + 1) % len(face)] == k
    np.testing.assert_allclose(s.fold_rest, pattern.dihedrals, rtol=0, atol=1e-12)
    letters = np.array(pattern.assignments)
    if np.ptp(pattern.vertices[:, 2]) > 0.0:  # a flat pattern is neither yet
        assert (s.fold_rest[letters == "V"] < np.pi).all()
        assert (s.fold_rest[letters == "M"] > np.pi).all()
    np.testing.assert_allclose(s.bend_rest, np.pi, rtol=0, atol=1e-12)
    assert all(sides[j, k][1] == sides[k, j][1] for j, k, *_ in s.bends.tolist())


def test_angles_of_the_contract():
    """A mountain has 300 degrees for a dihedral of 60, the Miura's ridge along x, too."""
    s = fd.discretize(fd.patterns.simple_fold(dihedral=60), SHEET, preset="plate")
    np.testing.assert_allclose(np.degrees(s.fold_rest), [300.0], rtol=0, atol=1e-12)
    m = fd.discretize(fd.patterns.miura(dihedral=60), SHEET, preset="plate")
    found = np.degrees(m.fold_rest)[[m.pattern.creases.tolist().index(c) for c in ([1, 4], [4, 7])]]
    np.testing.assert_allclose(found, 300.0, rtol=0, atol=1e-10)


def test_specimen_numbering():
    """The paper's fold 2-9 and bend 8-64 are our 1-8 and 7-63."""
    pattern = fd.patterns.miura(cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=39.2)
    s = fd.discretize(pattern, SHEET, preset="plate")
    assert (len(pattern.vertices), len(pattern.faces), len(s.nodes)) == (63, 48, 111)
    assert [1, 8] in np.sort(s.folds[:, :2], axis=1).tolist()
    assert [7, 63] in np.sort(s.bends[:, :2], axis=1).tolist()
    np.testing.assert_array_equal(s.centers, np.arange(63, 111))
    middles = pattern.vertices[np.array(pattern.faces)].mean(axis=1)
    np.testing.assert_allclose(s.nodes[63:], middles, atol=1e-15)
    # panels run along x first: panel 1 starts one column of vertices further
    assert [set(face) for face in pattern.faces[:2]] == [{0, 1, 7, 8}, {7, 8, 14, 15}]


def test_arrays_are_read_only():
    s = fd.discretize(fd.patterns.miura(), SHEET, preset="plate")
    for name in ("nodes", "bars", "bar_length", "bar_area", "folds", "fold_stiffness",
                 "fold_rest", "bends", "bend_stiffness", "bend_rest", "triangles"):  # fmt: skip
        with pytest.raises(ValueError, match="read-only"):
            getattr(s, name)[0] = 0
    with pytest.raises(AttributeError):
        s.nodes = None
    with pytest.raises(AttributeError):
        s.options.mass = "panel"


def test_inputs_are_left_alone():
    vertices, center = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), [0.4, 0.5, 0.0]
    own, given = np.array(center), vertices.copy()
    s = fd.discretize(fd.Pattern(given, [[0, 1, 2, 3]]), SHEET, centers={0: own}, preset="plate")
    np.testing.assert_array_equal(given, vertices)
    own[:] = given[:] = 9.0
    assert given.flags.writeable
    np.testing.assert_array_equal(s.nodes, [*vertices, center])
    stiffness = np.array([1.0, 2.0, 3.0, 4.0])
    s = fd.discretize(fd.patterns.miura(), SHEET, crease_stiffness=stiffness, preset="plate")
    before = s.fold_stiffness.copy()
    stiffness[:] = 0.0
    np.testing.assert_array_equal(s.fold_stiffness, before)


def test_displacements_of_wrong_shape():
    s = fd.discretize(fd.patterns.simple_fold(), SHEET, preset="plate")
    n = len(s.nodes)
    u = np.random.default_rng(0).uniform(-0.01, 0.01, (n, 3))
    np.testing.assert_array_equal(s.internal_force(u.ravel()), s.internal_force(u))
    for wrong in (u.T, u[:-1], u[:, :2], np.zeros(3 * n + 1), 0.0):
        with pytest.raises(InputError, match="displacement"):
            s.internal_force(wrong)


# ---------------------------------------------------------------------------- creases


def test_crease_stiffness_per_length():
    pattern, each = fd.patterns.miura(a=1.0, b=1.5), [0.1, 0.2, 0.3, 0.0]
    length = np.linalg.norm(np.diff(pattern.vertices[pattern.creases], axis=1)[:, 0], axis=1)
    plain = fd.discretize(pattern, SHEET, preset="herkal")
    for given in (0.5, each):
        s = fd.discretize(pattern, SHEET, crease_stiffness=given, preset="herkal")
        np.testing.assert_allclose(s.fold_stiffness, given * length, rtol=1e-14)
        np.testing.assert_array_equal(s.bend_stiffness, plain.bend_stiffness)
        np.testing.assert_array_equal(s.bar_area, plain.bar_area)
    assert s.options.crease_stiffness == tuple(each)


def test_crease_rest_in_degrees():
    pattern = fd.patterns.miura(dihedral=60)
    for given in (170, [100.0, 200.0, 300.0, 1.0]):
        s = fd.discretize(pattern, SHEET, crease_rest=given, preset="plate")
        np.testing.assert_allclose(s.fold_rest, np.radians(given), rtol=1e-14)
    u = np.zeros_like(s.nodes)
    assert np.abs(s.internal_force(u)).max() > 1e-3  # not at rest as drawn
    assert (s.bend_rest == fd.discretize(pattern, SHEET, preset="plate").bend_rest).all()
    np.testing.assert_allclose(s.dihedrals(u)[0], pattern.dihedrals, rtol=1e-13)


SHUT = fd.Pattern([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 1, 0]], [[0, 1, 2], [1, 0, 3]])


@pytest.mark.parametrize("field", ["crease_stiffness", "crease_rest"])
@pytest.mark.parametrize(
    "value",
    [[1.0], [1.0] * 3, [1.0] * 5, [[1.0] * 4], np.nan, [1, 2, np.inf, 4], "soft", [1, "a", 2, 3],
     [[1], [2, 3]], -1.0],
)  # fmt: skip
def test_wrong_crease_values(field, value):
    with pytest.raises(InputError, match=field):
        fd.discretize(fd.patterns.miura(), SHEET, **named({field: value}))


@pytest.mark.parametrize(
    ("pattern", "sheet", "options", "message"),
    [
        (fd.patterns.miura(), SHEET, {"crease_rest": 0}, "crease_rest = .*between 0 and 360"),
        (fd.patterns.miura(), SHEET, {"crease_rest": [90, 90, 90, 360]}, "between 0 and 360"),
        # triangles that lie on each other: which side cannot be told
        (SHUT, SHEET, {}, r"crease 0 \(vertices 0, 1\)"),
        (fd.patterns.kresling(), SHEET, {"centers": {0: [0, 0, 0]}}, "panel 0 has no center"),
        ("miura", SHEET, {}, "pattern"),
        (fd.patterns.miura(), None, {}, "sheet"),
    ],
)
def test_what_cannot_be_made(pattern, sheet, options, message):
    with pytest.raises(InputError, match=message):
        fd.discretize(pattern, sheet, **named(options))


@pytest.mark.parametrize(
    "options",
    [
        {"scheme": "N5B8"}, {"scheme": 5}, {"mass": "lumped"}, {"mass": ["panel"]},
        {"bar_law": "hooke"}, {"fold_law": "ogden"}, {"bend_law": 1}, {"calibration": "merlin"},
        {"centers": {1: [0, 0, 0]}}, {"centers": {-1: [0, 0, 0]}}, {"centers": {0: [0, 0]}},
        {"centers": {0: "middle"}}, {"centers": {0: [np.nan, 0, 0]}}, {"centers": {"0": [0, 0, 0]}},
        {"centers": {0: [0.5, 0.5, 0]}, "scheme": "n4b5"},
    ],
)  # fmt: skip
def test_wrong_options(options):
    field = next(iter(options))
    with pytest.raises(InputError, match=field):
        one(SQUARE, **options)


@pytest.mark.parametrize(
    ("field", "value"),
    [("youngs_modulus", 0), ("youngs_modulus", -1e6), ("poissons_ratio", 0.5),
     ("poissons_ratio", -1), ("thickness", 0.0), ("thickness", -0.01), ("density", 0.0),
     ("density", np.nan), ("length_scale_ratio", 0), ("thickness", "0.01"), ("thickness", None),
     ("poissons_ratio", np.inf), ("youngs_modulus", True)],
)  # fmt: skip
def test_wrong_sheet(field, value):
    good = {"youngs_modulus": 1e6, "poissons_ratio": 0.25, "thickness": 0.01}
    with pytest.raises(InputError, match=f"sheet: {field}"):
        fd.Sheet(**{**good, field: value})


def test_sheet_takes_numpy_numbers():
    sheet = fd.Sheet(np.float32(1e6), np.float64(0.25), 1, density=np.int64(1000))
    assert sheet.bending_modulus == pytest.approx(1e6 / (12 * 0.9375))
