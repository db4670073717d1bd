"""Orthotropic sheets: patch tests, Navier's plate, directions that continue over creases."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import SHELL_MODES, changed
from foldyn.algebra.extrapolation import extrapolated
from foldyn.errors import InputError
from foldyn.linear import modes
from foldyn.mechanics.triangle import plane_stress, triangle_stiffness, turned_axes
from foldyn.structures.material_axes import bending_across, material_axes

FIBERS = {"youngs_modulus": (140e9, 10e9), "poissons_ratio": 0.3, "shear_modulus": 5e9}
T, RHO = 1e-3, 1600.0
MIURA = fd.patterns.miura(cells=(1, 1), a=0.1, b=0.12, panel_angle=65, dihedral=110)
QUAD = fd.Pattern([(0, 0, 0), (0.3, 0.02, 0), (0.27, 0.2, 0), (-0.04, 0.16, 0)], [(0, 1, 2, 3)])

CASE = f"""{SHELL_MODES}[sheet]
youngs_modulus = [140e9, 10e9]
poissons_ratio = 0.3
shear_modulus = 5e9
thickness = 1e-3
density = 1600
direction = {{ edge = [0, 1], angle = 30 }}
panels = [{{ panels = [1], direction = [0, 1, 0] }}]
"""


def sheet(direction=0.0, **others) -> fd.Sheet:
    return fd.Sheet(**{**FIBERS, "thickness": T, "density": RHO, "direction": direction, **others})


def turned(pattern: fd.Pattern, by: np.ndarray) -> fd.Pattern:
    return fd.Pattern(pattern.vertices @ by.T, pattern.faces)


def axes(seed: int) -> np.ndarray:
    found = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return found * np.sign(np.linalg.det(found))


def test_turned_stiffness_is_that_of_turned_strains():
    """Energies are equal; the constants of an isotropic sheet do not depend on the angle."""
    elastic, angle = plane_stress(140.0, 10.0, 0.3, 5.0), 0.7
    c, s = np.cos(angle), np.sin(angle)
    tensor = np.array([[0.3, 0.2], [0.2, -0.4]])  # along x and y
    own = np.array([[c, s], [-s, c]]) @ tensor @ np.array([[c, -s], [s, c]])  # along 1 and 2
    one, other = (np.array([e[0, 0], e[1, 1], 2.0 * e[0, 1]]) for e in (tensor, own))
    energy = one @ turned_axes(elastic, angle) @ one
    assert energy == pytest.approx(other @ elastic @ other, rel=1e-12)
    alike = plane_stress(2.6, 2.6, 0.3, 1.0)
    np.testing.assert_allclose(turned_axes(alike, angle), alike, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 33.0, 90.0, 140.0])
def test_even_strains_and_curvatures_have_the_energy_of_the_plate(angle):
    """1/2 A eps eps and 1/2 D kappa kappa per area, for any direction of the fibers."""
    made = sheet((np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0))
    mesh = fd.shell(QUAD, made, divisions=4)
    x, y, _ = mesh.nodes.T
    area, small = float(QUAD.face_areas[0]), 1e-7
    xx, yy, xy = strain = np.array([0.7, -0.4, 0.5])  # twice the tensor's xy
    flat = small * np.stack([xx * x + 0.5 * xy * y, 0.5 * xy * x + yy * y, 0.0 * x], axis=1)
    exact = (
        0.5 * area * small**2 * strain @ turned_axes(made.stretching, np.radians(angle)) @ strain
    )
    assert mesh.energies(flat)["strain_membrane"] == pytest.approx(exact, rel=1e-5)
    # turns of the sheet at the sides of a triangle, relative to the plane of its corners
    curved = np.array([[xx, 0.5 * xy], [0.5 * xy, yy]])
    corners = np.array([(0.0, 0.0), (0.3, 0.1), (0.05, 0.2)])
    slope = np.linalg.solve(corners[1:] - corners[0], _height(corners[1:], curved))
    side = np.roll(corners, -1, axis=0) - corners
    outward = side @ [[0.0, -1.0], [1.0, 0.0]] / np.linalg.norm(side, axis=1)[:, None]
    turn = np.einsum("ka,ka->k", outward, (corners + 0.5 * side) @ curved - slope)
    along = np.array([[np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0]])
    flat = np.pad(corners, ((0, 0), (0, 1)))[None]
    _, bending = triangle_stiffness(flat, made.stretching, made.bending, along)
    per_area = 0.5 * strain @ turned_axes(made.bending, np.radians(angle)) @ strain
    own = 0.5 * turn @ bending[0] @ turn / (0.5 * abs(np.linalg.det(side[:2])))
    assert own == pytest.approx(per_area, rel=1e-12)


def _height(points, curved):
    return 0.5 * np.einsum("ka,ab,kb->k", points, curved, points)


@pytest.mark.parametrize("angle", [0.0, 25.0, 90.0])
def test_isotropic_constants_given_as_orthotropic_ones_change_nothing(angle):
    plain = fd.Sheet(3e9, 0.3, T, RHO)
    same = sheet(angle, youngs_modulus=(3e9, 3e9), shear_modulus=3e9 / 2.6)
    for one, other in zip(
        *(fd.shell(MIURA, own, divisions=4)._stiffness for own in (plain, same)), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * np.abs(one).max())
    one, other = (fd.shell(MIURA, own, divisions=2).fold_stiffness for own in (plain, same))
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_turning_pattern_and_fibers_together_changes_nothing():
    by = axes(3)
    along = np.array([0.8, 0.5, 0.3])
    found = [
        modes(fd.Case(fd.shell(pattern, sheet(tuple(way)), divisions=4), [fd.Fix([0, 1, 2])]), 5)
        for pattern, way in ((MIURA, along), (turned(MIURA, by), by @ along))
    ]
    np.testing.assert_allclose(found[0].frequency, found[1].frequency, rtol=1e-8)


@pytest.mark.matrix
@pytest.mark.parametrize("upright", [False, True])
def test_a_supported_plate_has_the_frequencies_of_navier(upright):
    """omega^2 rho t = D1 p^4 + 2 (D12 + 2 D66) p^2 q^2 + D2 q^4, p = m pi/a, q = n pi/b."""
    a, b = 0.3, 0.2
    plate = fd.Pattern([(0, 0, 0), (a, 0, 0), (a, b, 0), (0, b, 0)], [(0, 1, 2, 3)])
    made = sheet(90.0 if upright else 0.0)
    d, own = turned_axes(made.bending, np.pi / 2.0 if upright else 0.0), {}
    for m in range(1, 6):
        for n in range(1, 6):
            p, q = m * np.pi / a, n * np.pi / b
            stiff = (
                d[0, 0] * p**4 + 2.0 * (d[0, 1] + 2.0 * d[2, 2]) * p * p * q * q + d[1, 1] * q**4
            )
            own[m, n] = np.sqrt(stiff / (RHO * T)) / (2.0 * np.pi)
    exact = np.sort(list(own.values()))[:4]
    sides = [fd.Fix(side, "z", along=True) for side in ("xmin", "xmax", "ymin", "ymax")]
    held = [fd.Fix([0], "xy"), fd.Fix([1], "y"), *sides]

    def frequencies(structure):
        return modes(fd.Case(structure, held), count=4).frequency.values

    coarse, fine = (frequencies(fd.shell(plate, made, divisions=n)) for n in (12, 24))
    np.testing.assert_allclose(extrapolated(coarse, fine, 2.0), exact, rtol=0.01)
    np.testing.assert_allclose(frequencies(fd.superelements(plate, made)), exact, rtol=0.02)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(4))
def test_superelements_have_the_modes_of_the_shell(seed):
    rng = np.random.default_rng(seed)
    pattern = fd.patterns.miura(
        cells=(1, 1), a=0.1, b=rng.uniform(0.07, 0.13), panel_angle=rng.uniform(50, 80),
        dihedral=rng.uniform(40, 160),
    )  # fmt: skip
    first = 10 ** rng.uniform(9, 11)
    second = first / rng.uniform(2, 14)
    way = {"edge": pattern.creases[0].tolist(), "angle": rng.uniform(0, 180)}
    made = sheet(way, youngs_modulus=(first, second), shear_modulus=rng.uniform(0.3, 0.7) * second)
    held = [fd.Fix("xmin", along=True)]
    own = modes(fd.Case(fd.superelements(pattern, made), held), count=8).frequency
    coarse, fine = (
        modes(fd.Case(fd.shell(pattern, made, divisions=n, vertex_radius=T), held), 8).frequency
        for n in (8, 16)
    )
    np.testing.assert_allclose(own, extrapolated(coarse, fine, 2.0), rtol=0.01)


def test_a_direction_continues_over_creases_as_in_the_flat_sheet():
    """Angles from the panels' first edges are those of the flat sheet."""
    flat, folded = (
        fd.patterns.miura(cells=(2, 1), a=0.1, b=0.12, panel_angle=65, dihedral=own)
        for own in (179.999, 70)
    )
    found = []
    for pattern in (flat, folded):
        edge = pattern.creases[2].tolist()
        fibers = material_axes(pattern, sheet({"edge": edge, "angle": 20.0}))
        first = np.array([pattern.vertices[f[1]] - pattern.vertices[f[0]] for f in pattern.faces])
        across = np.cross(pattern.face_normals, first)
        x, y = (np.einsum("pk,pk->p", fibers, own) for own in (first, across))
        found.append(np.arctan2(y, x) % np.pi)
        np.testing.assert_allclose(np.linalg.norm(fibers, axis=1), 1.0, rtol=1e-12)
        np.testing.assert_allclose((fibers * pattern.face_normals).sum(axis=1), 0.0, atol=1e-12)
    apart = (found[0] - found[1] + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    np.testing.assert_allclose(apart, 0.0, atol=1e-4)


def test_a_crease_has_the_stiffness_of_bending_across_it():
    pattern = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
    low, high = pattern.creases[0].tolist()
    along, askew = (sheet({"edge": (low, high), "angle": own}) for own in (0.0, 90.0))
    np.testing.assert_allclose(bending_across(pattern, along), along.bending[1, 1], rtol=1e-12)
    np.testing.assert_allclose(bending_across(pattern, askew), askew.bending[0, 0], rtol=1e-12)
    soft, stiff = (fd.shell(pattern, own, divisions=2).fold_stiffness for own in (along, askew))
    np.testing.assert_allclose(stiff / soft, 14.0, rtol=1e-12)


def test_panels_may_be_orthotropic_among_isotropic_ones_and_the_other_way():
    mixed = sheet(panels=[fd.PanelSheet([0], 3e9, 0.3), fd.PanelSheet([1], direction=90.0)])
    (rest, plain, turned_one), kind = mixed.kinds(4)
    assert kind.tolist() == [1, 2, 0, 0]
    assert rest.orthotropic
    assert not plain.orthotropic
    assert (plain.shear_modulus, turned_one.direction) == (None, 90.0)
    own = fd.PanelSheet([2], (5e9, 1e9), shear_modulus=1e9, direction=0.0)
    assert fd.Sheet(3e9, 0.3, T, panels=[own]).of(2).moduli == (5e9, 1e9)


def test_a_case_with_fibers_is_stored_and_read(tmp_path):
    (tmp_path / "case.toml").write_text(CASE)
    result = fd.read_case(tmp_path / "case.toml").run()
    stored = fd.case_of(result).structure.sheet
    assert stored == fd.read_case(tmp_path / "case.toml").case().structure.sheet
    assert stored.direction == ((0, 1), 30.0)
    assert stored.panels[0].direction == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"shear_modulus": None}, "sheet: shear_modulus: missing; two moduli need it"),
        ({"direction": None}, "sheet: direction: missing; two moduli need it"),
        ({"poissons_ratio": 4.0}, "poissons_ratio = 4: must lie below the root of E1/E2, 3.742"),
        ({"youngs_modulus": (1e9, 2e9, 3e9)}, "must be one number .Pa., or two: along the dir"),
        ({"youngs_modulus": (1e9, -2e9)}, r"youngs_modulus\[1\] = -20.*: must be greater"),
        ({"youngs_modulus": 1e9}, "shear_modulus: belongs to orthotropic materials"),
        ({"direction": (0, 0, 0)}, "direction = .0, 0, 0.: must not be zero"),
        ({"direction": {"angle": 3}}, "direction = .*: must be { edge = .0, 1., angle = 30 }"),
        ({"direction": {"edge": (1, 2, 3)}}, r"direction.edge = \[1, 2, 3\]: must be two vertices"),
        (
            {"panels": [fd.PanelSheet(0, poissons_ratio=9.0)]},
            r"sheet: panels\[0\].poissons_ratio = 9",
        ),
    ],
)
def test_impossible_materials_get_one_message(given, message):
    with pytest.raises(InputError, match=message):
        sheet(**given)


@pytest.mark.parametrize(
    ("direction", "message"),
    [
        ((0.0, 0.0, 1.0), r"sheet: direction = \[0.0, 0.0, 1.0\]: is normal to panel 0"),
        ({"edge": (0, 8)}, r"sheet: direction.edge = \[0, 8\]: the pattern has no such edge"),
    ],
)
def test_impossible_directions_get_one_message(direction, message):
    flat = fd.patterns.miura(cells=(1, 1), a=0.1, b=0.1, panel_angle=60, dihedral=180)
    with pytest.raises(InputError, match=message):
        fd.shell(flat, sheet(direction), divisions=2)


def test_a_direction_that_depends_on_the_way_is_refused():
    """About the apex of a pyramid, angles do not add up to a full turn."""
    points = [(0, 0, 1), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]
    faces = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]
    with pytest.raises(InputError, match="gets two directions along two ways"):
        fd.shell(fd.Pattern(points, faces), sheet({"edge": (0, 1)}), divisions=2)


def test_bars_and_hinges_have_no_fibers():
    with pytest.raises(InputError, match="calibrated for isotropic sheets; take fd"):
        fd.discretize(MIURA, sheet())


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["shell", "superelements"])
def test_frequencies_have_gradients_by_moduli_and_direction(tmp_path, kind):
    """Beside central differences of whole computations."""
    edits = f'model.kind = "{kind}"; model.divisions = 4; sheet.panels ='
    text = changed(CASE, edits)
    path = tmp_path / "case.toml"
    path.write_text(text)
    values = {"sheet.youngs_modulus[1]": 10e9, "sheet.direction.angle": 30.0}
    found = fd.sensitivity(path, values, measures="frequency[2]")
    for key, value in values.items():
        ends = []
        for by in (-1e-3, 1e-3):
            path.write_text(changed(text, f"{key} = {value * (1 + by)!r}"))
            ends.append(float(fd.read_case(path).run().frequency[1]))
        slope = (ends[1] - ends[0]) / (2e-3 * value)
        assert found[f"gradient_{key}"].item() == pytest.approx(slope, rel=1e-3)
