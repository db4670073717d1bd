"""Cells whose walls or layers meet at junctions, within a cell or between cells."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import attenuation
from junctions import SHEET

SIDE, HEIGHT = 0.05, 0.03
PERIODS = SIDE * np.array([[1.5, np.sqrt(0.75), 0.0], [1.5, -np.sqrt(0.75), 0.0]])
PHASES = [(0.3, 0.2), (2.0, -1.0)]
MODELS = {
    "plate": lambda p: fd.discretize(p, SHEET, preset="plate", crease_stiffness=0.3),
    "n5b8e": lambda p: fd.discretize(p, SHEET, preset="n5b8e", crease_stiffness=0.3),
    "shell": lambda p: fd.shell(p, SHEET, divisions=2, crease_stiffness=0.3),
    "superelements": lambda p: fd.superelements(
        p, SHEET, divisions=8, level=1, crease_stiffness=0.3
    ),
}


def honeycomb(walls, backwards=()):
    """A cell of a hexagonal honeycomb; walls are between points (kind, period, period)."""
    places = {"A": np.zeros(3), "B": np.array([SIDE, 0.0, 0.0])}
    points = sorted({point for wall in walls for point in wall})
    foot = [places[kind] + np.array(step) @ PERIODS for kind, *step in points]
    number = {point: k for k, point in enumerate(points)}
    faces = []
    for k, (one, two) in enumerate(walls):
        a, b = number[one], number[two]
        face = (a, b, b + len(points), a + len(points))
        faces.append(face[::-1] if k in backwards else face)
    return fd.Pattern(np.concatenate([foot, np.add(foot, (0.0, 0.0, HEIGHT))]), faces)


ABOUT_B = [
    (("A", 0, 0), ("B", 0, 0)), (("B", 0, 0), ("A", 1, 0)), (("B", 0, 0), ("A", 0, 1)),
]  # fmt: skip
ABOUT_A = [
    (("A", 0, 0), ("B", 0, 0)), (("A", 0, 0), ("B", -1, 0)), (("A", 0, 0), ("B", 0, -1)),
]  # fmt: skip
IN_A_ROW = [
    (("A", 0, 0), ("B", 0, 0)), (("B", 0, 0), ("A", 1, 0)), (("A", 1, 0), ("B", 1, -1)),
]  # fmt: skip


def frequencies(pattern, vectors, phases, model):
    cell = fd.UnitCell(fd.Case(MODELS[model](pattern)), vectors)
    return np.sort(fd.bands(cell, phases, count=4, check_model=False).frequency.values)


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
def test_any_cell_of_a_honeycomb(model):
    expected = frequencies(honeycomb(ABOUT_B), PERIODS, PHASES, model)
    for walls, backwards in ((ABOUT_A, ()), (ABOUT_B, (1,)), (IN_A_ROW, ())):
        found = frequencies(honeycomb(walls, backwards), PERIODS, PHASES, model)
        np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.matrix
def test_supercell_of_a_honeycomb():
    """Two cells as one: its bands are those of both phases that it cannot tell apart."""
    two = [*ABOUT_B, *((tuple((k, a + 1, b) for k, a, b in wall)) for wall in ABOUT_B)]
    phase, other = 0.7, 0.4
    apart = [(phase / 2.0, other), (phase / 2.0 + np.pi, other)]
    expected = np.sort(frequencies(honeycomb(ABOUT_B), PERIODS, apart, "plate").ravel())[:4]
    vectors = PERIODS * [[2.0], [1.0]]
    found = frequencies(honeycomb(two), vectors, [(phase, other)], "plate")[0]
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def layers():
    """Two cells of the same solid, of a Miura layer and its image above or below; three steps."""
    layer = fd.patterns.miura(a=0.04, b=0.04, dihedral=110.0)
    flat = fd.UnitCell(fd.Case(fd.discretize(layer, SHEET))).vectors
    low, high = layer.vertices[:, 2].min(), layer.vertices[:, 2].max()
    above, below = (
        layer.joined(layer.mirrored("z", about=(0.0, 0.0, z)), inner=True) for z in (high, low)
    )
    return above, below, [*flat.tolist(), [0.0, 0.0, 2.0 * (high - low)]]


@pytest.mark.parametrize(
    "model", ["plate", *(pytest.param(m, marks=pytest.mark.matrix) for m in ("n5b8e", "shell"))]
)
def test_layers_repeat_in_three_directions(model):
    above, below, steps = layers()
    phases = [(1.0, 0.5, 0.7), (0.2, 2.0, 3.0)]
    one, other = (frequencies(pattern, steps, phases, model) for pattern in (above, below))
    np.testing.assert_allclose(one, other, rtol=1e-7)
    assert np.ptp(one[0]) > 0.0


@pytest.mark.matrix
def test_long_waves_of_a_solid_are_sound():
    """Three waves whose frequencies grow with the phase, in every direction."""
    above, _, steps = layers()
    for along in np.eye(3):
        once, twice = frequencies(above, steps, [0.002 * along, 0.004 * along], "n5b8e")
        np.testing.assert_allclose(twice[:3], 2.0 * once[:3], rtol=2e-3)
        assert once[3] > 10.0 * once[2]


def test_points_of_the_zone_of_a_solid():
    above, _, steps = layers()
    cell = fd.UnitCell(fd.Case(MODELS["plate"](above)), steps)
    assert cell.dimensions == 3
    path = cell.path("G-X-M-Y-G-Z-U-R-T-Z", 10)
    expected = ["000", "100", "110", "010", "000", "001", "101", "111", "011", "001"]
    assert ["".join(str(int(one > 0.0)) for one in row) for row in path.values] == expected
    assert cell.grid(2).sizes["phase"] == 8
    found = attenuation(cell, [1.0], along=2, phase=(0.1, 0.2))
    assert found.attenuation.values[0] > 0.0  # slower than any wave of these phases
    with pytest.raises(InputError, match="in one plane"):
        fd.UnitCell(cell.case, [steps[0], steps[1], np.add(steps[0], steps[1])])
    with pytest.raises(InputError, match="3 values for 2 other periods"):
        attenuation(cell, [1.0], phase=(0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    "model", ["n5b8e", pytest.param("superelements", marks=pytest.mark.matrix)]
)
def test_stiffness_of_a_honeycomb(model):
    """Walls that bend: E* = 4/sqrt(3) (t/l)^3 E, Poisson's ratio 1, shear modulus E*/4.

    Regular hexagons of thin walls without Poisson's ratio: L. J. Gibson, M. F. Ashby, Cellular
    Solids, 2nd ed., 1997, section 4.3. Stretch of the walls takes 3 (t/l)^2 of it.
    """
    slender = 0.01
    sheet = fd.Sheet(1e9, 0.0, thickness=slender * SIDE, density=1000.0)
    open_ = honeycomb(ABOUT_B)
    pattern = fd.Pattern(open_.vertices, open_.faces, welds=open_.creases[:1])
    stiff = {"crease_stiffness": 1e6}  # between cells
    made = {
        "n5b8e": lambda: fd.discretize(pattern, sheet, preset="n5b8e", **stiff),
        "superelements": lambda: fd.superelements(pattern, sheet, **stiff),
    }[model]()
    found = fd.effective(fd.UnitCell(fd.Case(made), PERIODS))
    expected = 4.0 / np.sqrt(3.0) * slender**3 * 1e9 * HEIGHT
    np.testing.assert_allclose(found.modulus, expected, rtol=1e-3)
    np.testing.assert_allclose(found.poissons_ratio, 1.0, rtol=2e-3)
    np.testing.assert_allclose(found.shear_modulus, 0.25 * expected, rtol=1e-3)
    assert (found.bending_poissons_ratio < 1.0 + 1e-9).all()


def test_letters_of_creases_that_are_junctions_between_cells_are_refused():
    pattern = honeycomb(IN_A_ROW)
    made = fd.discretize(pattern, SHEET, preset="plate", crease_stiffness={"mountain": 0.2})
    with pytest.raises(InputError, match="crease_stiffness: mountain: creases at which"):
        fd.bands(fd.UnitCell(fd.Case(made), PERIODS), PHASES, check_model=False)
