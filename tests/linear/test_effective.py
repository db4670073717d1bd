"""Equivalent plates and beams: closed forms, other cells, finite sheets and towers, long waves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cells import SHEET, kresling, miura
from scipy import sparse
from scipy.sparse.linalg import splu

import foldyn as fd
from foldyn.algebra import superlu
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.effective import _solved, effective
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.moduli import compliance
from foldyn.patterns.screw import of_twist, translation
from verification.benchmarks.sheets import ANGLE, A, B, miura_of, ratio, thin

BLOCKS = ("membrane", "coupling", "bending")


def slow(value):
    """A value in the matrix."""
    return pytest.param(value, marks=pytest.mark.matrix)


def stiffness(found):
    """C (6, 6) of a plate."""
    a, b, d = (found[name].values for name in BLOCKS)
    return np.block([[a, b], [b.T, d]])


def tensors():
    """Strains of the rows of a plate as tensors (3, 2, 2)."""
    return np.array([[[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 0.5], [0.5, 0]]])


def turned(way):
    """Strains (3, 3) in axes (2, 2), from strains in the axes x and y."""
    moved = [way @ each @ way.T for each in tensors()]
    return np.array([[each[0, 0], each[1, 1], 2 * each[0, 1]] for each in moved]).T


# ---------------------------------------------------------------------- flat sheets
ONE = fd.Pattern([(0, 0), (0.05, 0), (0.05, 0.04), (0, 0.04)], [(0, 1, 2, 3)])
STEPS = [(0.05, 0, 0), (0, 0.04, 0)]
CREASE = 0.5  # N m/rad per m


def uncreased(found):
    """Compliance of bending without the creases between cells, which are in series with it."""
    series = [1 / (CREASE * STEPS[0][0]), 1 / (CREASE * STEPS[1][1]), 0.0]
    return np.linalg.inv(found.bending.values) - np.diag(series)


@pytest.mark.parametrize("wood", [False, True])
def test_a_flat_shell_is_a_plate(wood):
    """Of one panel a cell: E t/(1 - nu^2), and E t^3/12 (1 - nu^2) beside the creases."""
    t = 1e-3
    e1, e2, g = (9e9, 5e8, 7e8) if wood else (1e9, 1e9, 1e9 / 2.6)
    fibers = {"shear_modulus": g, "direction": (1.0, 0.0, 0.0)} if wood else {}
    sheet = fd.Sheet([e1, e2] if wood else e1, 0.3, t, **fibers)
    plane = np.linalg.inv([[1 / e1, -0.3 / e1, 0], [-0.3 / e1, 1 / e2, 0], [0, 0, 1 / g]])
    shell = fd.shell(ONE, sheet, divisions=2, crease_stiffness=CREASE)
    found = effective(fd.UnitCell(fd.Case(shell), vectors=STEPS))
    np.testing.assert_allclose(found.membrane, t * plane, atol=1e-10 * t * e1)
    inverse = np.linalg.inv(t**3 / 12 * plane)
    np.testing.assert_allclose(uncreased(found), inverse, atol=1e-10 * inverse.max())
    assert np.abs(found.coupling).max() < 1e-12 * t**2 * e1
    assert "density" not in found


def test_a_laminate_needs_no_density():
    ply = {"youngs_modulus": [9e9, 5e8], "poissons_ratio": 0.3, "shear_modulus": 7e8}
    plies = [fd.Ply(1e-4, angle=angle, **ply) for angle in (0.0, 90.0, 0.0)]
    sheet = fd.Sheet(plies=plies, direction=(1.0, 0.0, 0.0))
    shell = fd.shell(ONE, sheet, divisions=2, crease_stiffness=CREASE)
    found = effective(fd.UnitCell(fd.Case(shell), vectors=STEPS))
    np.testing.assert_allclose(found.membrane, sheet.stretching, atol=1e-4)
    assert fd.linear.refinement(fd.Case(shell)) is not None


@pytest.mark.parametrize("make", [fd.superelements, fd.discretize])
def test_flat_panels_of_other_models_bend_alike(make):
    """They stretch by less than 1 % differently; single bars in a panel resist shear twofold."""
    structure = make(ONE, SHEET, crease_stiffness=CREASE)
    found = effective(fd.UnitCell(fd.Case(structure), vectors=STEPS))
    plane = np.linalg.inv([[1, -0.3, 0], [-0.3, 1, 0], [0, 0, 2.6]])
    inverse = 12.0 * np.linalg.inv(plane)
    assert uncreased(found) == pytest.approx(inverse, abs=1e-5 * inverse.max())
    assert found.membrane[:2, :2].values == pytest.approx(1e6 * plane[:2, :2], rel=0.01)
    assert float(found.density) == pytest.approx(1.0)


# ---------------------------------------------------------------------- published sheets
def rates(shape, angle):
    """Size of a cell (2,), and its derivatives by an angle (degrees)."""
    step = 1e-4
    size, low, high = (np.array(shape(angle + k * step)) for k in (0, -1, 1))
    return size, (high - low) / (2.0 * np.radians(step))


def miura_size(dihedral):
    """S and L of Schenk and Guest, PNAS 110, 2013, twice: a cell."""
    tilt, g = np.radians(180.0 - dihedral) / 2.0, np.radians(ANGLE)
    t = np.cos(tilt) * np.tan(g)
    return 2 * B * t / np.hypot(1, t), 2 * A * np.sqrt(1 - (np.sin(tilt) * np.sin(g)) ** 2)


@pytest.mark.parametrize("dihedral", [90.0, *map(slow, (20.0, 45.0, 135.0, 170.0))])
def test_a_rigid_miura_sheet_has_the_published_ratios_and_moduli(dihedral):
    """nu = -cos^2 theta tan^2 gamma in the plane; opposite in bending (Wei et al., PRL 110)."""
    pattern, nu = miura_of(dihedral), ratio(dihedral)
    tilt, g = np.radians(180.0 - dihedral) / 2.0, np.radians(ANGLE)
    found = thin(pattern, 1e-5, 1e-2)
    assert found.poissons_ratio.values == pytest.approx([nu, 1 / nu], rel=1e-5)
    assert found.bending_poissons_ratio.values == pytest.approx([-nu, -1 / nu], rel=1e-3)
    size, rate = rates(miura_size, dihedral)
    p = 2.0 * np.arctan(np.cos(g) * np.tan(tilt))
    along_y = np.cos(g) * (np.cos(p / 2) / np.cos(tilt)) ** 2  # dp/dq of the straight creases
    crease = 1e-4
    resisted = 4 * crease * (A * along_y**2 + B)  # of the creases of a cell, by q
    moduli = resisted / size.prod() / (rate / size) ** 2
    assert thin(pattern, 1e-4, crease).modulus.values == pytest.approx(moduli, rel=1e-5)


def eggbox_size(dihedral):
    """Of the generator's docstring, twice."""
    g, half = np.radians(75.0), np.radians(dihedral) / 2.0
    cos_y = np.hypot(np.cos(g), np.sin(g) * np.cos(half))
    return 2 * B * np.sqrt(1 - (np.cos(g) / cos_y) ** 2), 2 * A * np.sqrt(1 - cos_y**2)


@pytest.mark.parametrize("dihedral", [90.0, *map(slow, (40.0, 140.0))])
def test_a_rigid_eggbox_is_the_reverse(dihedral):
    found = thin(fd.patterns.eggbox(a=A, b=B, panel_angle=75.0, dihedral=dihedral), 1e-5, 1e-2)
    size, rate = rates(eggbox_size, dihedral)
    ratio = -(rate[1] / size[1]) / (rate[0] / size[0])
    assert ratio > 0.0
    assert found.poissons_ratio.values == pytest.approx([ratio, 1 / ratio], rel=1e-5)
    assert found.bending_poissons_ratio.values == pytest.approx([-ratio, -1 / ratio], rel=1e-3)


# ---------------------------------------------------------------------- any cell of a sheet
STRETCH = np.array([[0.09, 0.0, 0.0], [0.02, 0.08, 0.0]])


def uneven(sizes=(3, 2), first=(0, 0), number=None, copies=(1, 1)):
    """Triangles between points with uneven places, over a lattice that is not rectangular."""
    offset = np.random.default_rng(1).uniform(-0.25, 0.25, (*sizes, 3)) / np.max(sizes)
    counts = [n * m for n, m in zip(sizes, copies, strict=True)]
    i, j = np.indices([n + 1 for n in counts]).reshape(2, -1) + np.array(first)[:, None]
    places = np.stack([i / sizes[0], j / sizes[1]], axis=1) @ STRETCH
    points = places + 0.09 * offset[i % sizes[0], j % sizes[1]]
    row = counts[1] + 1
    corners = [(row * p + q, row * (p + 1) + q, row * (p + 1) + q + 1, row * p + q + 1)
               for p in range(counts[0]) for q in range(counts[1])]  # fmt: skip
    faces = [face for a, b, c, d in corners for face in ((a, b, c), (a, c, d))]
    if number is not None:
        order = np.random.default_rng(number).permutation(len(points))
        points, faces = points[order], [tuple(np.argsort(order)[list(f)]) for f in faces]
    vectors = STRETCH * np.array(copies)[:, None]
    return points, faces, vectors


MODELS = {
    "n5b8e": fd.discretize,
    "shell": lambda *given, **more: fd.shell(*given, divisions=2, **more),
    "superelements": fd.superelements,
}


def properties(points, faces, vectors, model="n5b8e"):
    structure = MODELS[model](fd.Pattern(points, faces), SHEET, crease_stiffness=0.3)
    return effective(fd.UnitCell(fd.Case(structure), vectors=vectors))


@pytest.mark.parametrize("model", ["n5b8e", *map(slow, ("shell", "superelements"))])
def test_the_choice_of_the_cell_does_not_matter(model):
    sizes = (3, 1) if model == "superelements" else (3, 2)
    points, faces, vectors = uneven(sizes)
    others = [uneven(sizes, first=(2, 0)), uneven(sizes, number=3), uneven(sizes, copies=(1, 2))]
    one = properties(points, faces, vectors, model)
    own = stiffness(one)
    assert np.abs(own[:3, 3:]).max() > 1e-3 * np.sqrt(own[0, 0] * own[3, 3])
    np.testing.assert_array_equal(own, own.T)
    assert np.linalg.eigvalsh(own).min() > 0.0
    scale = np.sqrt(np.outer(np.diag(own), np.diag(own)))
    near = 1e-8 if model == "superelements" else 1e-9
    for other in (*others, (points, faces, [vectors[0], vectors[0] + vectors[1]])):
        again = stiffness(properties(*other, model))
        np.testing.assert_allclose(again / scale, own / scale, rtol=0.0, atol=near)
    # turned in the plane, turned out of it, and seen from behind
    c, s = np.cos(0.7), np.sin(0.7)
    spin = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    again = stiffness(properties(points @ spin.T, faces, vectors @ spin.T, model))
    change = np.kron(np.eye(2), turned(spin[:2, :2]))
    np.testing.assert_allclose(change.T @ again @ change / scale, own / scale, atol=near)
    mirror = np.diag([1.0, 1.0, -1.0])
    back = [face[::-1] for face in faces]
    again = stiffness(properties(points @ mirror, back, vectors, model))
    flip = np.diag([1, 1, 1, -1, -1, -1])
    np.testing.assert_allclose(flip @ again @ flip / scale, own / scale, atol=near)
    tilted = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]).T
    found = properties(points @ tilted.T, faces, vectors @ tilted.T, model)
    way = found.frame.values[:2] @ tilted[:, :2]
    change = np.kron(np.eye(2), turned(way)) @ np.kron(
        np.diag([1.0, np.linalg.det(way)]), np.eye(3)
    )
    again = stiffness(found)
    np.testing.assert_allclose(change.T @ again @ change / scale, own / scale, atol=near)


@pytest.mark.parametrize("preset", ["n5b8e", "plate", "herkal"])
def test_supercells_of_panels_with_four_corners_are_alike(preset):
    own, whole = (
        stiffness(effective(miura(cells, preset=preset), secant=1.0)) for cells in ((1, 1), (2, 1))
    )
    scale = np.sqrt(np.outer(np.diag(own), np.diag(own)))
    np.testing.assert_allclose(whole / scale, own / scale, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("model", ["n5b8e", slow("superelements")])
def test_long_waves_have_the_predicted_speeds(model):
    """The fourth order of the bending wave has A, B and D, relaxed along the wave."""
    points, faces, vectors = uneven((3, 1))
    thick = replace(SHEET, thickness=5e-3)
    structure = MODELS[model](fd.Pattern(points, faces), thick, crease_stiffness=30.0)
    if model == "superelements":
        structure = structure.for_stresses  # the shapes that `effective` takes
    cell = fd.UnitCell(fd.Case(structure), vectors=vectors)
    found = effective(cell)
    x, y = np.cos(0.4), np.sin(0.4)
    spread, bent = np.array([[x, 0], [0, y], [y, x]]), np.array([x * x, y * y, 2 * x * y])
    a, b, d = (found[name].values for name in BLOCKS)
    plane, couple = spread.T @ a @ spread, spread.T @ b @ bent
    bending = bent @ d @ bent - couple @ np.linalg.solve(plane, couple)
    expected = np.array([bending, *np.linalg.eigvalsh(plane)]) / float(found.density)
    for number, power, kept in ((0.1, 2, slice(1, 3)), (0.5, 4, slice(1))):  # rad/m
        phases = [n * vectors @ [x, y, 0.0] for n in (number, 2.0 * number)]
        waves = fd.bands(cell, phases, count=3, track=False, check_model=False)
        own = waves.eigenvalue.values[:, kept] / np.array([[1.0], [2.0**power]]) / number**power
        assert (4.0 * own[0] - own[1]) / 3.0 == pytest.approx(expected[kept], rel=2e-5)


# ---------------------------------------------------------------------- states
def cell_energy(cell, motions, state):
    """Energy (J) of the elements of a cell, relaxed under given motions."""
    linear = linearize_cell(cell, fd.linear.relaxed(cell, motions, state=state, steps=1))
    reach = linear.reach
    zero = np.flatnonzero((reach.steps == 0).all(axis=1))
    return reach.body.anchored(reach.number - zero).energies(linear.dofs).sum()


def second_derivative(energy, size):
    """About zero, of fourth order."""
    values = [energy(k * size) for k in (-2, -1, 0, 1, 2)]
    return np.dot([-1.0, 16.0, -30.0, 16.0, -1.0], values) / (12.0 * size**2)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_internal_forces_count_in_states_without_mean_forces():
    """A sheet with actuated creases, let go: against differences of the energies of its cell."""
    pattern = fd.patterns.miura(a=0.03, b=0.031, dihedral=100.0)
    structure = fd.discretize(pattern, replace(SHEET, thickness=3e-3), crease_stiffness=50.0)
    cell = fd.UnitCell(fd.Case(structure, loads=[fd.Actuate("straight", 140.0)]))
    state = fd.linear.relaxed(cell)
    found = effective(cell, state)
    for _ in range(8):
        e = -np.linalg.solve(found.membrane, found.mean_force)
        stretch = np.eye(3)
        stretch[:2, :2] += np.einsum("i,ijk", e, tensors())
        state = fd.linear.relaxed(cell, found.vectors.values @ stretch, state=state, steps=1)
        found = effective(cell, state)
    assert np.abs(found.mean_force).max() < 1e-8
    steps = found.vectors.values
    area = np.linalg.norm(np.cross(*steps))
    a, b, d = (found[name].values for name in BLOCKS)
    for x, y in ((1.0, 0.0), (0.0, 1.0), (0.8, 0.6)):
        way, along = np.array([x, y, 0.0]), np.array([x * x, y * y, 2 * x * y])

        def pulled(e, way=way):
            stretched = steps @ (np.eye(3) + e * np.outer(way, way))
            return cell_energy(cell, list(map(translation, stretched)), state)

        def bent(k, way=way):
            turns = [np.cross([0.0, 0.0, 1.0], k * way * (way @ step)) for step in steps]
            twists = [
                np.concatenate([turn, step - np.cross(turn, found.center)])
                for turn, step in zip(turns, steps, strict=True)
            ]
            return cell_energy(cell, list(map(of_twist, twists)), state)

        stretching, coupling, bending = (along @ each @ along for each in (a, b, d))
        assert second_derivative(pulled, 1e-4) / area == pytest.approx(stretching, rel=1e-8)
        bending -= coupling**2 / stretching  # the bent sheet is free to move along its normal
        assert second_derivative(bent, 0.1) / area == pytest.approx(bending, rel=1e-7)


def test_states_with_mean_forces_and_unstable_ones_are_told():
    cell = miura()
    with pytest.warns(FoldynWarning, match="the state has mean forces"):
        effective(cell, fd.linear.relaxed(cell, 1.01 * cell.vectors))
    flat = fd.Case(fd.discretize(fd.patterns.miura(dihedral=180.0), SHEET))
    pressed = fd.UnitCell(flat)
    with pytest.warns(FoldynWarning, match="mean forces|unstable") as told:
        effective(pressed, fd.linear.relaxed(pressed, 0.999 * pressed.vectors))
    assert any("the state is unstable" in str(each.message) for each in told)


def test_a_pressed_sheet_buckles_in_the_waves_of_the_plate():
    """Of D k^4 + N k^2 < 0, although a cell alone is stable."""
    cell = fd.UnitCell(fd.Case(fd.discretize(fd.patterns.miura(dihedral=180.0), SHEET)))
    state = fd.linear.relaxed(cell, cell.vectors @ np.diag([1.0 - 2e-9, 1.0, 1.0]))
    found = effective(cell, state)
    assert found.stable
    number = np.sqrt(-found.mean_force[0] / found.bending[0, 0])
    phases = float(number) * cell.vectors[0, 0] * np.array([[0.99, 0.0], [1.01, 0.0]])
    assert phases.max() < 0.2 * np.pi
    with pytest.warns(FoldynWarning, match="unstable"):
        longer, shorter = fd.bands(cell, phases, count=1, state=state).eigenvalue[:, 0]
    assert longer < 0.0 < shorter


def test_a_state_takes_few_factorizations(monkeypatch):
    """Of the largest number that is asked, 5: one for the waves of a cell, one for its strains."""
    factorized = []

    def counted(matrix, *args, **options):
        factorized.append(matrix.shape)
        return splu(matrix, *args, **options)

    monkeypatch.setattr(superlu, "splu", counted)
    effective(fd.UnitCell(fd.Case(fd.discretize(fd.patterns.miura(cells=(2, 3)), SHEET))))
    assert 1 <= len(factorized) <= 5


# ---------------------------------------------------------------------- beams
def test_a_strip_of_panels_is_a_beam():
    """EA = E t b, and GJ = 4 D (1 - nu)/2 b of a thin strip."""
    shell = fd.shell(ONE, SHEET, divisions=2, crease_stiffness=CREASE)
    found = effective(fd.UnitCell(fd.Case(shell), vectors=STEPS[:1]))
    assert float(found.axial_stiffness) == pytest.approx(1e6 * 0.04, rel=1e-10)
    twisting = 1e9 * 1e-9 / 12.0 / (1 + 0.3)
    assert float(found.torsional_stiffness) == pytest.approx(2 * twisting * 0.04, rel=1e-10)
    bending = 1.0 / (12.0 / 0.04 + 1.0 / (CREASE * 0.04 * 0.05))
    assert float(found.bending_stiffness[0]) == pytest.approx(bending, rel=1e-10)


@pytest.mark.matrix
def test_storeys_of_a_tower_are_cells_of_one_beam():
    """Bending of 1, 2 and 6 storeys is a wave, of 12 it is even: their screws turn by 360."""
    pattern = {"radius": 0.05, "height": 0.07, "sides": 6}
    found = []
    for storeys in (1, 2, 6, 12):
        towers = fd.patterns.kresling(**pattern, storeys=storeys)
        found.append(effective(fd.UnitCell(fd.Case(fd.discretize(towers, SHEET)))))
    own = found[0].stiffness.values
    scale = np.sqrt(np.outer(np.diag(own), np.diag(own)))
    for each in found[1:]:
        np.testing.assert_allclose(each.stiffness / scale, own / scale, rtol=0.0, atol=1e-9)
        assert float(each.density) == pytest.approx(float(found[0].density))
    assert abs(own[0, 1]) > 0.1 * scale[0, 1]


@pytest.mark.matrix
def test_a_tower_of_forty_storeys_stretches_and_twists_as_the_beam():
    """Loads at its ends; strains in the middle, where the ends are far."""
    structure = kresling(40).case.structure
    found = effective(kresling())
    x = structure.nodes
    (motion,) = kresling().motions
    level = np.round(x[:, 2] / motion.shift).astype(int)
    case = fd.Case(structure, [fd.Fix(np.flatnonzero(level == 0).tolist(), "xyz")])
    tangent = structure.tangent(np.zeros_like(x))
    free = np.flatnonzero(~case.fixed.ravel())
    arm = np.cross([0.0, 0.0, 1.0], x)
    top = (level == 40)[:, None]
    loads = np.stack([top * [0.0, 0.0, 1.0], top * arm], axis=2).reshape(-1, 2)
    resultant = [top.sum(), (top * arm**2).sum()]
    moved = np.zeros_like(loads)
    moved[free] = splu(tangent[free][:, free].tocsc()).solve(loads[free])
    moved = moved.reshape(*x.shape, 2)

    def means(n):
        here = level == n
        spin = np.einsum("ix,ixl->l", arm[here], moved[here]) / (arm[here] ** 2).sum()
        return np.array([moved[here, 2].mean(axis=0), spin])

    strains = (means(25) - means(15)) / (10 * motion.shift)
    compliance = np.linalg.inv(found.stiffness.values[:2, :2]) * resultant
    assert strains == pytest.approx(compliance, rel=1e-4)


# ---------------------------------------------------------------------- refusals
def test_what_is_no_free_material_is_refused():
    case = miura().case
    with pytest.raises(InputError, match="has supports or clamped edges"):
        effective(fd.UnitCell(fd.Case(case.structure, [fd.Fix([0], "z")])))
    light = replace(SHEET, density=None)
    for model in (fd.discretize, fd.superelements):
        made = model(case.structure.pattern, SHEET if model is fd.superelements else light)
        changed = replace(made, fold_stiffness=2.0 * made.fold_stiffness)
        with pytest.raises(InputError, match="was changed after"):
            effective(fd.UnitCell(fd.Case(changed)))
    stiff = fd.discretize(case.structure.pattern, SHEET, rigid=[0])
    with pytest.raises(InputError, match="has rigid panels"):
        effective(fd.UnitCell(fd.Case(stiff)))
    c, t = np.cos(np.pi / 6), np.sin(np.pi / 6)
    sector = [(1, 0, 0), (2, 0, 0), (2 * c, 2 * t, 0), (c, t, 0)]
    wall = [(1, 0, 0), (c, t, 0), (c, t, 1), (1, 0, 1)]
    turn = fd.Screw("z", 30.0, 0.0)
    for points, vectors, reason in (
        (sector, None, "without a shift"), (wall, [(0, 0, 1)], "turns from cell to cell"),
    ):  # fmt: skip
        structure = fd.discretize(fd.Pattern(points, [(0, 1, 2, 3)]), SHEET)
        with pytest.raises(InputError, match=reason):
            effective(fd.UnitCell(fd.Case(structure), vectors=vectors, screw=turn))
    with pytest.raises(InputError, match="without any force"):
        _solved(sparse.csc_array((2, 2)), np.ones((2, 1)), np.zeros((2, 0)))


@pytest.mark.filterwarnings("ignore:hinges of the superlinear law")
def test_a_secant_amplitude_gives_superlinear_bends_a_stiffness():
    structure = fd.discretize(miura().case.structure.pattern, SHEET, preset="merlin2")
    cell = fd.UnitCell(fd.Case(structure))
    with pytest.warns(FoldynWarning, match="costs no energy: one of curvature xy"):
        found = effective(cell)
    assert float(found.twisting_modulus) == found.bending_modulus_along[45] == 0.0
    assert found.bending_modulus.values == pytest.approx(
        effective(cell, secant=1e-9).bending_modulus.values, rel=1e-2
    )
    twisting = [float(effective(cell, secant=each).twisting_modulus) for each in (1e-9, 8e-9)]
    assert twisting[1] / twisting[0] == pytest.approx(2.0, rel=1e-3)  # amplitude^(1/3)


def test_folding_without_resistance_has_the_ratio_of_the_mechanism():
    pattern = miura_of(90.0)
    structure = fd.discretize(pattern, SHEET, crease_stiffness=0.0)
    with pytest.warns(FoldynWarning, match="costs no energy: one of strain xx, strain yy"):
        found = effective(fd.UnitCell(fd.Case(structure)))
    assert found.modulus.values.tolist() == [0.0, 0.0]
    assert found.poissons_ratio.values == pytest.approx([-1.5, -1 / 1.5], rel=1e-9)
    assert float(found.shear_modulus) > 1e4
    assert np.isnan(compliance(np.diag([0.0, 0.0, 1.0]))).all()
