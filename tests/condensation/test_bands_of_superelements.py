"""Bands of superelements: against shells, supercells and closed rings."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError, ModelRangeWarning
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.wave_solver import WaveSolver

SHEET = fd.Sheet(1e9, 0.3, thickness=5e-4, density=1000.0)
MIURA = fd.patterns.miura(a=0.03, b=0.031)
CHAIN = [(2.0 * MIURA.vertices[3, 0], 0.0, 0.0)]
PANEL = fd.Pattern([(0, 0, 0), (0.03, 0, 0), (0.04, 0.025, 0), (0.01, 0.025, 0)], [(0, 1, 2, 3)])
STEPS = [(0.03, 0.0, 0.0), (0.01, 0.025, 0.0)]
TOWER = fd.patterns.kresling(sides=6, radius=0.03, height=0.03)
SIDE = fd.Pattern(TOWER.vertices[[0, 1, 6, 7]], [(0, 1, 3), (0, 3, 2)])
RING = fd.Screw("z", 60.0, 0.0)
PHASES = [(0.0, 0.0), (1.1, 0.0), (0.0, np.pi), (0.7, -2.1)]


def frequencies(cell, phases=PHASES, count=8):
    """Frequencies without the estimate of their errors."""
    waves = WaveSolver(linearize_cell(cell).bloch, count).at(
        np.array(phases).reshape(len(phases), -1)
    )
    return np.sqrt([each.values for each in waves]) / (2.0 * np.pi)


def small(pattern=MIURA, supports=(), masses=(), vectors=None, screw=None, level=1, **options):
    """A cell with few unknowns."""
    structure = fd.superelements(pattern, SHEET, level=level, divisions=4, **options)
    return fd.UnitCell(fd.Case(structure, supports, masses=masses), vectors, screw)


def assert_those_of_shells(
    pattern, phases, divisions=4, vectors=None, screw=None, supports=(), sheet=SHEET, count=6,
    **options,
):  # fmt: skip
    own = fd.superelements(pattern, sheet, divisions=divisions, **options)
    radius = sheet.thickness
    shell = fd.shell(
        pattern, sheet, divisions=divisions, mass="consistent", vertex_radius=radius, **options
    )
    found, known = (
        fd.bands(fd.UnitCell(fd.Case(each, supports), vectors, screw), phases, count=count,
                 track=False, polarization=True)
        for each in (own, shell)
    )  # fmt: skip
    np.testing.assert_allclose(found["frequency"], known["frequency"], rtol=0.01, atol=1e-3)
    return found, known


@pytest.mark.matrix
def test_bands_of_a_sector_of_a_ring_are_those_of_the_shell():
    assert_those_of_shells(SIDE, [(0.0,), (2.0,)], screw=RING, count=4)


@pytest.mark.matrix
@pytest.mark.parametrize("options", [{}, {"clamped": [(0, 3), (3, 6)]}], ids=["held", "clamped"])
def test_bands_of_a_chain_on_supports_are_those_of_the_shell(options):
    held = [fd.Fix([0, 3, 6], "yz", along=True)]
    assert_those_of_shells(MIURA, [(0.0,), (1.3,)], vectors=CHAIN, supports=held, **options)


@pytest.mark.matrix
def test_the_gap_of_the_gallery_is_that_of_the_shell():
    sheet = fd.Sheet(3e9, 0.3, thickness=2.4e-4, density=1200.0, length_scale_ratio=10.0)
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=60)
    edges = [(0.0, np.pi), (0.0, 0.63)]  # of the bands below and above it
    assert_those_of_shells(pattern, edges, sheet=sheet)
    fine = fd.UnitCell(fd.Case(fd.superelements(pattern, sheet, divisions=8)))
    values = frequencies(fine, edges, 5)
    assert 495.0 < values[:, 3].max() < 505.0 and 540.0 < values[:, 4].min() < 550.0


@pytest.mark.matrix
def test_bands_of_a_miura_sheet_are_those_of_the_shell():
    found, known = assert_those_of_shells(MIURA, PHASES)
    values = known["frequency"].values
    apart = np.diff(values, axis=1) > 0.05 * values[:, 1:]
    apart = np.pad(apart, ((0, 0), (1, 0))) & np.pad(apart, ((0, 0), (0, 1)))
    off = np.abs(found["polarization"].values - known["polarization"].values)[apart]
    assert len(off) > 3 and off.max() < 0.01


@pytest.mark.matrix
def test_bands_of_a_tower_are_those_of_the_shell():
    tower = fd.patterns.kresling(sides=3, radius=0.03, height=0.03)
    assert_those_of_shells(tower, [(0.5,), (2.0,)])


@pytest.mark.matrix
def test_a_closed_ring_has_the_waves_of_its_sector():
    """A storey of a tower, of which a side is the cell: rotations about the axis."""
    whole = fd.superelements(TOWER, SHEET, level=1, divisions=4)
    known = fd.modes(fd.Case(whole), 30, verify=False)["frequency"].values
    cell = small(SIDE, screw=RING)
    found = frequencies(cell, 2.0 * np.pi / 6 * np.arange(6), 12).ravel()
    np.testing.assert_allclose(np.sort(found)[:30], known, rtol=1e-6, atol=1e-3)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("one", "two"),
    [
        ({}, {}),
        (
            {"supports": [fd.Spring(300.0, nodes=[4])], "masses": [fd.PointMass([1], 1e-3)]},
            {"supports": [fd.Spring(300.0, nodes=[4, 10])], "masses": [fd.PointMass([1, 7], 1e-3)]},
        ),
        (
            {"supports": [fd.Fix([3, 4], "z", along=True)]},
            {"supports": [fd.Fix([3, 4, 9, 10], "z", along=True)]},
        ),
        ({"rigid": [1]}, {"rigid": [1, 3]}),
    ],
    ids=["plain", "attached", "held", "rigid"],
)
def test_two_cells_have_the_waves_of_one(one, two):
    """Those with the phases k and k + pi."""
    own, pair = small(**one), small(fd.patterns.miura(cells=(2, 1), a=0.03, b=0.031), **two)
    of_one = [(0.0, 0.0), (np.pi, 0.0), (0.4, 1.2), (0.4 + np.pi, 1.2)]
    found = np.sort(frequencies(own, of_one, 6).reshape(2, -1))[:, :6]
    known = frequencies(pair, [(0.0, 0.0), (0.8, 1.2)], 6)
    np.testing.assert_allclose(found, known, rtol=1e-6, atol=1e-3)


@pytest.mark.matrix
def test_another_choice_of_the_cell_has_the_same_bands():
    """Panels moved by a period, in another order, with other first corners."""
    vertices, faces = MIURA.vertices, [np.array(face) for face in MIURA.faces]
    moved = vertices + np.array(CHAIN)
    pattern = fd.Pattern(
        *joined([(moved, faces[2]), (vertices, np.roll(faces[3], 1)), (moved, faces[0]),
                 (vertices, np.roll(faces[1], 2))])
    )  # fmt: skip
    steps = fd.UnitCell(fd.Case(fd.discretize(MIURA, SHEET, preset="plate"))).vectors
    found, known = (
        frequencies(small(each, vectors=steps), PHASES[1:]) for each in (pattern, MIURA)
    )
    np.testing.assert_allclose(found, known, rtol=1e-6)


def joined(panels):
    """Vertices and faces of panels, each with its own vertices."""
    places: dict[tuple, int] = {}
    faces = [
        [places.setdefault(tuple(points[v].round(9)), len(places)) for v in face]
        for points, face in panels
    ]
    return np.array(list(places)), faces


@pytest.mark.matrix
def test_matrices_are_hermitian_and_waves_run_both_ways_alike():
    cell = small()
    bloch = linearize_cell(cell).bloch
    factors = bloch.factors(np.array([0.7, -2.1]))
    for part in (bloch.stiffness, bloch.mass):
        whole = part.at(factors)
        assert np.abs(whole - whole.conj().T).max() < 1e-12 * np.abs(whole).max()
    there, back = frequencies(cell, [(0.7, -2.1), (-0.7, 2.1)])
    np.testing.assert_allclose(there, back, rtol=1e-9)


@pytest.mark.matrix
def test_damping_and_attenuation_fit_the_bands():
    cell = small(PANEL, vectors=STEPS)
    known = frequencies(cell, [(1.0, 0.0)], 4)
    damped = fd.linear.damped_bands(cell, [(1.0, 0.0)], count=4)
    np.testing.assert_allclose(damped["frequency"], known, rtol=1e-6)
    waves = fd.linear.attenuation(cell, known[0])["phase"].values
    assert (np.abs(waves - 1.0).min(axis=1) < 1e-5).all()


@pytest.mark.matrix
def test_damped_creases_damp_and_attenuate_as_in_shells():
    options = {"divisions": 4, "mass": "consistent", "vertex_radius": SHEET.thickness}
    found = []
    for make in (fd.superelements, fd.shell):
        case = fd.Case(make(SIDE, SHEET, **options), damping=fd.CreaseDamping(1e-4))
        cell = fd.UnitCell(case, screw=RING)
        damped = fd.linear.damped_bands(cell, [(1.3,)], count=3)
        decay = fd.linear.attenuation(cell, [800.0])["attenuation"]
        found.append(np.concatenate([np.ravel(damped["rate"]), decay]))
    np.testing.assert_allclose(*found, rtol=0.015)


@pytest.mark.matrix
def test_errors_of_bands():
    own = fd.superelements(PANEL, SHEET, level=3, divisions=8)
    cell = fd.UnitCell(fd.Case(own), STEPS)
    bands, best = (
        fd.bands(cell, PHASES, count=3),
        cell.with_case(cell.case.altered(structure=own.at_level(5))),
    )
    off = np.sort(bands["frequency"]) - frequencies(best, count=3)
    error = bands["frequency_error"].values
    assert (np.sort(error) >= np.sort(off)).all() and (off > -1e-6).all()
    assert (error[bands["frequency"].values == 0.0] == 0.0).all()
    assert bands.attrs["holds_to"] == bands["frequency"].max()


def test_bands_tell_up_to_where_they_hold():
    with pytest.warns(ModelRangeWarning, match="hold up to"):
        bands = fd.bands(small(SIDE, screw=RING), [(1.0,)], count=8)
    doubtful = bands["frequency_error"] > 0.05 * bands["frequency"]
    assert bands.attrs["holds_to"] == bands["frequency"].values[doubtful].min()


def test_what_is_not_linear_about_rest_is_refused():
    cell = small(TOWER)
    state = fd.State(displacement=np.zeros_like(TOWER.vertices))
    for refused in (
        lambda: fd.bands(cell, [0.5], state=state),
        lambda: fd.linear.relaxed(cell),
        lambda: fd.linear.long_waves(cell),
    ):
        with pytest.raises(InputError, match="superelements"):
            refused()


CASE = """
[pattern]
kind = "miura"
a = 0.03
b = 0.031
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 0.0005
density = 1000.0
[model]
kind = "superelements"
level = 1
divisions = 4
[analysis]
kind = "bands"
path = "G-X"
points = 2
count = 4
"""


@pytest.mark.matrix
def test_a_case_file_gives_bands(tmp_path):
    path = tmp_path / "sheet.toml"
    path.write_text(CASE, encoding="utf-8")
    found = fd.read_case(path).run()
    known = frequencies(small(), [(0.0, 0.0), (np.pi, 0.0)], 4)
    np.testing.assert_allclose(np.sort(found["frequency"]), known, rtol=1e-9, atol=1e-6)
    assert found["frequency_error"].shape == known.shape and found.attrs["holds_to"] > 0.0
