"""Load factors of superelements beside closed forms, and beside shells on the same meshes."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError

SHEET = fd.Sheet(1e9, 0.3, 5e-3, 900.0)


def boards(length, width, count=1, welded=False):
    """Panels side by side along x, joined by creases or welds."""
    x, n = np.linspace(0.0, length, count + 1), count + 1
    vertices = [(each, y, 0.0) for y in (0.0, width) for each in x]
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(count)]
    welds = [(k, n + k) for k in range(1, count)] if welded else []
    return fd.Pattern(vertices, faces, welds=welds)


def gable(length, width, angle):
    """Two panels that meet at a ridge along x, under an angle (degrees)."""
    half = np.radians(angle) / 2.0
    rows = [(side * np.sin(half), -np.cos(half)) for side in (-1.0, 0.0, 1.0)]
    rows[1] = (0.0, 0.0)
    vertices = [(x, width * y, width * z) for y, z in rows for x in (0.0, length)]
    return fd.Pattern(vertices, [(0, 1, 3, 2), (2, 3, 5, 4)])


def superelements(pattern, sheet, divisions=8, **options):
    return fd.superelements(pattern, sheet, divisions=divisions, **options)


def shell(pattern, sheet, divisions=8, **options):
    radius = sheet.thickness
    return fd.shell(pattern, sheet, divisions=divisions, vertex_radius=radius, **options)


PINNED = [fd.Fix("xmin", "xz", along=True), fd.Fix("xmax", "z", along=True), fd.Fix([0], "y")]
PRESSED = fd.LineLoad("xmax", (-1.0, 0.0, 0.0))


# ------------------------------------------------------------------ closed forms
def test_a_column():
    """Euler: n^2 pi^2 EI / L^2, Timoshenko and Gere, Theory of Elastic Stability, section 2.1."""
    sheet = fd.Sheet(1e9, 0.0, 2e-3, 900.0)
    made = fd.superelements(boards(1.0, 0.1, 4, welded=True), sheet, divisions=12)
    found = fd.buckling(fd.Case(made, PINNED, [PRESSED]), 3)
    euler = np.pi**2 * 1e9 * 2e-3**3 / 12.0
    np.testing.assert_allclose(found.load_factor, euler * np.array([1.0, 4.0, 9.0]), rtol=3e-3)
    assert found.attrs["complete"] == found.attrs["positive"] == 3
    assert abs(found.attrs["departure"]) < 1e-4


def test_a_square_plate():
    """k = 4.00 of pi^2 D / b^2: Timoshenko and Gere, section 9.2."""
    sheet = fd.Sheet(1e9, 0.3, 0.01, 900.0)
    held = [*PINNED, fd.Fix("ymin", "z", along=True), fd.Fix("ymax", "z", along=True)]
    made = fd.superelements(boards(1.0, 1.0), sheet)
    found = fd.buckling(fd.Case(made, held, [PRESSED]), 1)
    unit = np.pi**2 * 1e9 * 0.01**3 / (12.0 * (1.0 - 0.3**2))
    assert float(found.load_factor[0]) / unit == pytest.approx(4.0, rel=0.015)


def test_a_narrow_cantilever_tips_over():
    """4.013 sqrt(EI GJ) / L^2: Timoshenko and Gere, section 6.3."""
    sheet = fd.Sheet(1e9, 0.0, 2e-3, 900.0)
    pattern = boards(1.0, 0.05, 4, welded=True)
    made = fd.superelements(pattern, sheet, divisions=12, clamped="xmin")
    load = fd.Force([4, 9], (0.0, -0.5, 0.0))
    found = fd.buckling(fd.Case(made, [fd.Fix("xmin", along=True)], [load]), 1)
    bending, twisting = 1e9 * 0.05 * 2e-3**3 / 12.0, 0.5e9 * 0.05 * 2e-3**3 / 3.0
    expected = 4.013 * np.sqrt(bending * twisting)
    np.testing.assert_allclose(np.abs(found.load_factor), expected, rtol=0.02)


# ------------------------------------------------------------------ beside the shell
def strip(make, supports=PINNED, loads=(PRESSED,), **options):
    made = make(boards(1.0, 0.5, 2), SHEET, crease_stiffness=50.0, **options)
    return fd.Case(made, supports, loads)


def roof(make, loads, **options):
    made = make(gable(0.5, 0.4, 120), SHEET, crease_stiffness=20.0, **options)
    return fd.Case(made, [fd.Fix("zmin", along=True)], loads)


BOTH_HELD = [fd.Fix("xmin", along=True), fd.Fix("xmax", along=True)]
SHEARED = [fd.Fix("xmin", along=True), fd.Fix("xmax", "xz", along=True)]
MOVED = [
    fd.Fix("xmin", along=True),
    fd.Fix("xmax", "yz", along=True),
    fd.Impose("xmax", "x", -1e-3, along=True),
]
CASES = {
    "crease": lambda make: strip(make),
    "point forces": lambda make: strip(make, loads=[fd.Force([2, 5], (-0.5, 0.0, 0.0))]),
    "sheared": lambda make: strip(make, SHEARED, [fd.LineLoad("xmax", (0.0, 1.0, 0.0))]),
    "warmed": lambda make: strip(make, BOTH_HELD, [fd.Temperature(1.0, expansion=1e-5)]),
    "moved": lambda make: strip(make, MOVED, []),
    "weight": lambda make: strip(make, loads=[fd.Gravity((-9.81, 0.0, 0.0))]),
    "ridge": lambda make: roof(make, [fd.LineLoad("zmax", (0.0, 0.0, -1.0))]),
    "pressure": lambda make: roof(make, [fd.Pressure(1.0)]),
    "actuated": lambda make: roof(make, [fd.Actuate([0], 0.1)]),
}


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("name", CASES)
def test_beside_a_shell(name):
    found, expected = (fd.buckling(CASES[name](make), 1) for make in (superelements, shell))
    np.testing.assert_allclose(found.load_factor[0], expected.load_factor[0], rtol=0.01)
    assert found.attrs["departure"] == pytest.approx(expected.attrs["departure"], abs=0.005)
    assert found.attrs["free_dofs"] < 0.3 * expected.attrs["free_dofs"]
    moved, given = found["prebuckling"].values, expected["prebuckling"].values
    np.testing.assert_allclose(moved, given, atol=0.02 * np.abs(given).max())
    shape, other = found["shape"].values[0].ravel(), expected["shape"].values[0].ravel()
    assert (shape @ other) ** 2 > 0.99 * (shape @ shape) * (other @ other)


def test_a_coarse_mesh_has_fewer_turns():
    spring = fd.Spring(5.0, [1, 4], direction="z")
    factors = [
        fd.buckling(strip(make, [*PINNED, spring], divisions=4), 1).load_factor[0]
        for make in (superelements, shell)
    ]
    assert float(factors[0]) == pytest.approx(float(factors[1]), rel=1e-3)


@pytest.mark.matrix
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_tube(way):
    """Pulled, it bulges at its creases, where moments of the sheet count."""
    pattern = fd.patterns.kresling(sides=6, radius=0.05, height=0.04, twist=30)
    sheet, load = fd.Sheet(2e9, 0.3, 0.5e-3, 900.0), fd.Force("zmax", (0.0, 0.0, way / 6.0))
    factors = []
    for make in (superelements, shell):
        with pytest.warns(FoldynWarning, match="displacements are not small"):
            found = fd.buckling(fd.Case(make(pattern, sheet), [fd.Fix("zmin")], [load]), 1)
        factors.append(found.load_factor.values)
    np.testing.assert_allclose(*factors, rtol=0.04)


# ------------------------------------------------------------------ results and refusals
def test_the_result_has_the_mesh_of_the_panels():
    case = strip(superelements)
    found = fd.buckling(case, 1)
    vertices = len(case.structure.nodes)
    assert found.sizes["node"] > 10 * vertices
    rest = found["rest_position"].values
    np.testing.assert_allclose(rest[:vertices], case.structure.nodes)
    shape = found["shape"].values[0]
    assert np.linalg.norm(shape, axis=1).max() == pytest.approx(1.0)
    held = np.isin(rest[:, 0], (0.0, 1.0))
    assert np.abs(shape[held, 2]).max() < 1e-9
    moved = fd.imperfect(case.structure.pattern, 1e-3, shapes=found, modes=[1]).vertices
    assert np.abs(moved - case.structure.nodes).max() == pytest.approx(1e-3)


def test_refusals():
    with pytest.raises(InputError, match=r"preload: superelements .* take fd.shell"):
        fd.buckling(strip(superelements), preload=fd.Force([2], (1.0, 0.0, 0.0)))
    with pytest.raises(InputError, match=r"iterations: superelements .* take fd.shell"):
        fd.buckling(strip(superelements), iterations=2)
    with pytest.raises(InputError, match=r"rigid: .* take fd.shell"):
        fd.buckling(strip(superelements, rigid=[0]))
    with pytest.raises(InputError, match=r"crease_rest: .* take fd.shell"):
        fd.buckling(strip(superelements, crease_rest=170))
    with pytest.raises(InputError, match="can move freely"):
        fd.buckling(strip(superelements, PINNED[:1]))
