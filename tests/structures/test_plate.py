"""The calibration "plate": bends and folds with the stiffness of thin plates."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import HEXAGON, PANELS, PENTAGON

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.errors import InputError
from foldyn.structures.plate import COMPLIANCE, POLYGON, TRIANGLE
from foldyn.structures.quad_plates import flexibilities
from named_models import named
from verification.fidelity.cases import polygons

SHEET = fd.Sheet(1e6, 0.3, 0.01, density=1.0)
G = SHEET.bending_modulus
PARALLELOGRAMS = ["square", "rectangle", "rhombus", "parallelogram", "oblique"]


def panel(vertices, sheet=SHEET, **options):
    vertices = np.asarray(vertices, float)
    pattern = fd.Pattern(vertices, [list(range(len(vertices)))])
    return fd.discretize(pattern, sheet, bend_law="linear", calibration="plate", **options)


def bending(structure, heights):
    """Energy of the bends for small heights (n,) of the nodes of a flat panel."""
    u = np.zeros((len(structure.nodes), 3))
    u[:, 2] = 1e-5 * np.asarray(heights)
    return structure.energies(u)["strain_bends"] / 1e-10


def twist_stiffness(structure):
    """Second derivative of the energy by w for corners at +w, -w, +w, -w, the center at ease."""
    corners = [1.0, -1.0, 1.0, -1.0]
    if len(structure.nodes) == 4:
        return 2.0 * bending(structure, corners)
    middle = bending(structure, [*corners, 0.0])
    up, down = (bending(structure, [*corners, h]) for h in (0.5, -0.5))
    slope, curvature = up - down, 4.0 * (up + down - 2.0 * middle)
    return 2.0 * (middle - 0.5 * slope**2 / curvature)


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
@pytest.mark.parametrize("name", PARALLELOGRAMS)
def test_twist_is_that_of_the_plate(name, scheme):
    """By the flexibility of `quad_plates`, of a plate without creases.

    Of rectangles w = xi eta, with the constant curvature 4 w/(a b): 32 (1 - nu) G/A.
    """
    x, nu, s = (
        np.array(PANELS[name], float),
        SHEET.poissons_ratio,
        panel(PANELS[name], scheme=scheme),
    )
    own = flexibilities(x[None], np.zeros((1, 4), bool), np.array([nu]))
    found = twist_stiffness(s)
    assert found == pytest.approx(G / own[0, 0, 0], rel=1e-4)
    if name in ("square", "rectangle"):
        assert found == pytest.approx(32.0 * (1.0 - nu) * G / s.pattern.face_areas[0], rel=1e-6)
    if scheme == "n5b8":  # spokes are alike
        np.testing.assert_allclose(s.bend_stiffness, s.bend_stiffness[0], rtol=1e-12)


def test_twist_depends_on_the_edges_that_are_free():
    """The inner panels of a Miura-ori keep more of a plate's twist than those at its corners."""
    pattern = fd.patterns.miura(cells=(2, 2), panel_angle=60, dihedral=100)
    s = fd.discretize(pattern, SHEET, calibration="plate")
    corners, sides, inner = [0, 3, 12, 15], [1, 2, 4, 7, 8, 11, 13, 14], [5, 6, 9, 10]
    least = s.bend_stiffness.reshape(16, 4).min(axis=1)
    assert least[corners].max() < least[sides].min()
    assert least[sides].max() < least[inner].min()


def test_spokes_of_a_square():
    """(1 - nu) G, whatever its size."""
    for size in (0.1, 1.0, 7.0):
        found = panel(size * np.array(PANELS["square"])).bend_stiffness
        np.testing.assert_allclose(found, 0.7 * G, rtol=1e-12)


@pytest.mark.parametrize("m", [5, 6, 8])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_regular_polygons_bend_as_plates_in_curvatures_without_mean(m, turn):
    """W = (A/2) G (1 - nu) kappa : kappa, which is (1 - nu) G A for diag(1, -1).

    Corners alone bend a plate to less: 0.768, 0.871, 0.925 of it with 5, 6, 8 corners, found with
    the shell (nu = 0.25, 8 and 16 divisions extrapolated).
    """
    angle = 2.0 * np.pi * np.arange(m) / m
    s = panel(1.7 * np.c_[np.cos(angle), np.sin(angle)])
    x, y = s.nodes[:, 0] - s.nodes[-1, 0], s.nodes[:, 1] - s.nodes[-1, 1]
    heights = 0.5 * np.cos(2 * turn) * (x**2 - y**2) + np.sin(2 * turn) * x * y
    plate = {5: 0.768, 6: 0.871, 8: 0.925}[m] * 0.7 * G * s.pattern.face_areas[0]
    assert bending(s, heights) == pytest.approx(plate, rel=6e-3)
    turned = bending(s, 0.5 * (x**2 - y**2))
    assert bending(s, heights) == pytest.approx(turned, rel=1e-6)


@pytest.mark.parametrize("vertices", [HEXAGON, PENTAGON], ids=["hexagon", "pentagon"])
def test_polygons_have_the_plates_energy_in_the_mean_of_two_curvatures(vertices):
    s = panel(np.array(vertices) * [1.0, 0.8])
    x, y = s.nodes[:, 0] - s.nodes[-1, 0], s.nodes[:, 1] - s.nodes[-1, 1]
    found = bending(s, 0.5 * (x**2 - y**2)) + bending(s, x * y)
    plate = 2.0 * 0.7 * G * s.pattern.face_areas[0]
    assert found == pytest.approx(POLYGON[len(vertices) - 5] * plate, rel=1e-6)


@pytest.mark.parametrize("name", sorted(PANELS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_bends_do_not_depend_on_place_or_first_corner(name, scheme):
    x = np.array(PANELS[name], float)
    before = panel(x, scheme=scheme).bend_stiffness
    q = np.linalg.qr(np.random.default_rng(7).standard_normal((3, 3)))[0]
    moved = np.c_[x, np.zeros(len(x))] @ (q * np.linalg.det(q)).T + [0.2, 0.1, -0.3]
    np.testing.assert_allclose(panel(moved, scheme=scheme).bend_stiffness, before, rtol=1e-9)
    turned = panel(np.roll(x, 1, axis=0), scheme=scheme).bend_stiffness
    np.testing.assert_allclose(np.sort(turned), np.sort(before), rtol=1e-9)


def test_folds_are_in_series_with_the_panels_they_bend():
    """Two rectangles on a crease of 1.5, and a triangle on another of length 1.5."""
    x = [[-2, 0, 1], [0, 0, 0], [1, 0, 1], [1, 1.5, 1], [0, 1.5, 0], [-2, 1.5, 1], [2, 0.7, 0]]
    pattern = fd.Pattern(x, [[0, 1, 4, 5], [1, 2, 3, 4], [2, 6, 3]])

    def soft(**options):
        return 1.0 / fd.discretize(pattern, SHEET, **named(options)).fold_stiffness

    plate = soft(calibration="plate")
    own = [plate - soft(calibration="plate", rigid=[p]) for p in range(3)]  # of each panel
    np.testing.assert_allclose(sum(own), plate - soft(calibration="standard"), rtol=1e-9)
    triangle = TRIANGLE[1] * pattern.face_areas[2] / (G * 1.5**2)
    rows = pattern.creases.tolist()
    assert own[2][rows.index([2, 3])] == pytest.approx(triangle, rel=1e-9)
    assert own[2][rows.index([1, 4])] == pytest.approx(0.0, abs=1e-12)


def test_a_moment_turns_the_edge_of_a_square():
    """By 0.357 M/G in the shell with nu = 0.25, of which 1/6 by way of the center."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=90)
    s = fd.discretize(pattern, sheet, crease_stiffness=1e9, preset="plate")
    found = sheet.bending_modulus / s.fold_stiffness[0] / 2.0 + 1.0 / 6.0
    assert found == pytest.approx(0.357, rel=0.01)


def test_polygons_give_way_by_a_constant():
    pattern = polygons(sides=6, dihedral=90.0)
    s = fd.discretize(pattern, SHEET, crease_stiffness=1e9, preset="plate")
    soft = 2.0 * COMPLIANCE * pattern.face_areas[0] / G
    assert 1.0 / s.fold_stiffness[0] == pytest.approx(soft, rel=1e-6)


def test_folds_of_a_given_stiffness():
    """Creases without stiffness have none, and rigid ones that of their panels."""
    free, rigid, both, own = (
        fd.discretize(fd.patterns.simple_fold(dihedral=90), SHEET, **named(options)).fold_stiffness
        for options in (
            {"crease_stiffness": 0.0}, {"crease_stiffness": 1e9 * G}, {},
            {"calibration": "standard"},
        )
    )  # fmt: skip
    np.testing.assert_array_equal(free, 0.0)
    np.testing.assert_allclose(1.0 / rigid, 1.0 / both - 1.0 / own, rtol=1e-6)


@pytest.mark.parametrize(("rigid", "bent"), [("all", 0), ([1], 1), ([0, 1], 0), (None, 2)])
def test_rigid_panels_do_not_give_way_to_their_creases(rigid, bent):
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=90)
    (own,) = fd.discretize(pattern, SHEET, calibration="standard").fold_stiffness
    (found,) = fd.discretize(pattern, SHEET, rigid=rigid, preset="plate").fold_stiffness
    (soft,) = fd.discretize(pattern, SHEET, preset="plate").fold_stiffness
    assert 1.0 / found == pytest.approx(1.0 / own + 0.5 * bent * (1.0 / soft - 1.0 / own), rel=1e-9)


def test_what_stays_as_in_the_standard_calibration():
    pattern = fd.patterns.miura(cells=(1, 1))
    plain, plate = (
        fd.discretize(pattern, SHEET, calibration=c, membrane="bars") for c in ("standard", "plate")
    )  # fmt: skip
    np.testing.assert_array_equal(plate.bar_area, plain.bar_area)
    np.testing.assert_array_equal(plate.fold_rest, plain.fold_rest)
    assert (plate.fold_stiffness < plain.fold_stiffness).all()


@pytest.mark.matrix
def test_case_files_and_results_keep_it(read, kept):
    found = read(f"""{HELD_MIURA_TEXT}[model]
calibration = "plate"
mass = "bubble"
bend_law = "linear"
[analysis]
kind = "modes"
count = 2
""").run()
    structure = kept(found).structure
    assert (structure.options.calibration, structure.options.mass) == ("plate", "bubble")
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    direct = fd.discretize(fd.patterns.miura(), sheet, calibration="plate", bend_law="linear")
    for name in ("fold_stiffness", "bend_stiffness"):
        np.testing.assert_array_equal(getattr(structure, name), getattr(direct, name))
    with pytest.raises(InputError, match=r"calibration.*standard, merlin2, plate"):
        fd.discretize(fd.patterns.miura(), SHEET, calibration="shell")
