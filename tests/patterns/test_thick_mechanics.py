"""Thick panels in both models: mass, inertia, mobility, how they fold, how they are stored."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from strips import section, strip

T, W, B, RHO = 0.1, 1.0, 0.6, 500.0  # m, m, m, kg/m3
SHEET = fd.Sheet(1e8, 0.3, T, RHO)
MASS = RHO * T * W * B  # of a board, kg
G = 9.81
MODELS = ["n5b8", "n4b5", "shell"]


def make(model, pattern, sheet=SHEET, **options):
    if model == "shell":
        return fd.shell(pattern, sheet, divisions=4, **options)
    return fd.discretize(
        pattern, sheet, scheme=model, bend_law="linear", **options, preset="herkal"
    )


@pytest.mark.parametrize("model", MODELS)
def test_mass_center_and_inertia_of_a_board_about_its_hinge(model):
    """(w^2 + t^2) m / 3 about the hinge line in its face; the center of mass in its middle."""
    s = make(model, fd.thicken(strip(2), T), mass="consistent")
    assert s.total_mass == pytest.approx(2 * MASS, rel=1e-13)
    np.testing.assert_allclose(s.center_of_mass, [W, B / 2, 0.0], atol=1e-13)
    away = s.center_of_mass - s.nodes[1]
    about_the_hinge = s.inertia[1, 1] + s.total_mass * (away[0] ** 2 + away[2] ** 2)
    assert about_the_hinge == pytest.approx(2 * MASS * (W**2 + T**2) / 3, rel=1e-13)


def test_inertia_of_an_accordion_about_all_axes():
    """Moments of boards of width w, length b and thickness t, all three exact."""
    s = make("n5b8", fd.thicken(strip(4), T), mass="consistent")
    apart = MASS * 2 * (0.5**2 + 1.5**2)
    wanted = [B**2 + T**2, W**2 + T**2, W**2 + B**2] * np.array(4 * MASS / 12)
    np.testing.assert_allclose(np.diag(s.inertia), wanted + np.array([0, apart, apart]), rtol=1e-12)


def test_what_a_tilted_plane_adds_to_the_inertia_of_one_board():
    """A product m w t / 12 of the axes across the hinge, which the board itself does not have."""
    weightless = fd.PanelSheet([1], density=1e-12 * RHO)
    s = make("n5b8", fd.thicken(strip(2), T), fd.Sheet(1e8, 0.3, T, RHO, panels=[weightless]),
             mass="consistent")  # fmt: skip
    wanted = np.diag([B**2 + T**2, W**2 + T**2, W**2 + B**2]) * MASS / 12
    wanted[0, 2] = wanted[2, 0] = -MASS * W * T / 12
    np.testing.assert_allclose(s.inertia, wanted, atol=1e-9)


def test_both_hinges_in_one_face_leave_the_mass_there():
    """The plane of a board with two hinges at one height is half a thickness off its middle."""
    s = make("n5b8", fd.thicken(strip(3, letters="VV"), T), mass="consistent")
    middle = s.triangle_panel == 1
    z = s.nodes[s.triangles[middle], 2].mean()
    assert z == pytest.approx(T / 2)
    np.testing.assert_allclose(s.total_mass, 3 * MASS, rtol=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_a_board_is_a_compound_pendulum(model):
    """It hangs from the edge of its face: w^2 = (m g r + k) / I, r = sqrt(w^2 + t^2) / 2."""
    stiff = fd.Sheet(1e10, 0.3, T, RHO)
    s = make(model, fd.thicken(strip(2), T), stiff, crease_stiffness=0.1, mass="consistent")
    held = np.flatnonzero(s.nodes[:, 0] < W + 1e-9)
    r = 0.5 * np.hypot(W, T)
    # gravity from the hinge line straight through the board's center balances it as drawn
    down = np.array([W / 2, 0.0, -T / 2]) / r
    found = fd.modes(
        fd.Case(s, [fd.Fix(held)], [fd.Gravity(tuple(G * down))]), count=1, state="equilibrium"
    )
    inertia = MASS * (W**2 + T**2) / 3
    wanted = np.sqrt((MASS * G * r + 0.1 * B) / inertia) / (2 * np.pi)
    assert float(found.frequency[0]) == pytest.approx(wanted, rel=1e-6)
    assert float(np.abs(found.displacement).max()) < 1e-6


@pytest.mark.parametrize("angle", [0.0, 70.0])
@pytest.mark.parametrize("model", MODELS)
def test_one_soft_mode_for_each_hinge(model, angle):
    """Six rigid motions and one for each of three creases without stiffness, as of thin panels."""
    for pattern in (strip(4, fold_angle=angle), fd.thicken(strip(4, fold_angle=angle), T)):
        s = make(model, pattern, crease_stiffness=0.0)
        frequency = fd.modes(fd.Case(s), count=10).frequency.to_numpy()
        assert np.abs(frequency[:9]).max() < 1e-3 * frequency[9]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("fraction", ["50%", "100%"])
def test_it_folds_as_the_boards_do(model, fraction):
    """Driven to a fraction, hinge lines are where `thicken` puts them in the folded pattern."""
    flat = fd.thicken(strip(4), T)
    s = make(model, flat)
    fold = fd.Actuate("all", fraction=fraction)
    case = fd.Case(s, [fd.Fix([0, 1, 5])], [fold])
    path = fd.trace(case, method="displacement", load_factors=np.linspace(0.1, 1, 10))
    moved = (s.nodes + path.displacement.to_numpy()[-1])[:10]
    folded = fd.thicken(strip(4, fold_angle=180.0 * fold.fraction), T)
    pairs = np.array([(i, j) for i in range(10) for j in range(i)])
    found, wanted = (
        np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) for x in (moved, folded.vertices)
    )
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    if fraction == "100%":
        corners = np.vstack([section(flat, k, moved) for k in range(4)])
        assert np.ptp(corners[:, 1]) == pytest.approx(4 * T, rel=1e-9)


@pytest.mark.matrix
@pytest.mark.parametrize(("model", "method"), [("n5b8", "rk4"), ("shell", "newmark")])
def test_a_motion_that_closes_two_boards(model, method):
    """It comes to rest with faces touching, at a dihedral of the hinge planes of 2 atan(t/w)."""
    soft = fd.Sheet(1e6, 0.3, T, 2.0)
    s = make(model, fd.thicken(strip(2), T), soft, crease_stiffness=5.0)
    fold = fd.Actuate("all", fold_angle=180.0, history=fd.Ramp(0.5, smooth=True))
    case = fd.Case(s, loads=[fold], damping=fd.Rayleigh(alpha=15.0))
    motion = fd.simulate(case, 1.5, method=method, interval=0.25)
    moved = (s.nodes + motion.displacement.to_numpy()[-1])[:6]
    assert np.linalg.norm(moved[2] - moved[0]) == pytest.approx(2 * T, rel=1e-3)
    assert motion.attrs["energy_error"] < 3e-3


def test_a_crease_does_not_fold_to_the_side_away_from_its_hinge():
    """A valley hinged in the back face has no way to close."""
    s = make("n5b8", fd.thicken(strip(2), T, offsets=-T / 2))
    with pytest.raises(InputError, match=r"loads\[0\].fraction: crease 0 cannot fold that far"):
        fd.Case(s, loads=[fd.Actuate("all", fraction=1.0)])
    fd.Case(s, loads=[fd.Actuate("all", fraction=0.9)])


def test_sheet_and_pattern_have_one_thickness():
    for model in MODELS:
        with pytest.raises(InputError, match=r"thickness = 0.1 m of panel 0, .* made with 0.2 m"):
            make(model, fd.thicken(strip(2), 0.2))
    mixed = fd.Sheet(1e8, 0.3, T, RHO, panels=[fd.PanelSheet([1], thickness=0.2)])
    s = make("n5b8", fd.thicken(strip(2), [T, 0.2]), mixed)
    assert s.total_mass == pytest.approx(3 * MASS, rel=1e-13)


FILE = """
[pattern]
vertices = [[0, 0], [1, 0], [2, 0], [3, 0], [0, 1], [1, 1], [2, 1], [3, 1]]
faces = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
assignments = ["V", "M"]
hinge_offset = {offset}
[sheet]
youngs_modulus = 1e8
poissons_ratio = 0.3
thickness = 0.05
density = 500
[[sheet.panels]]
panels = [1]
thickness = 0.1
[model]
kind = "{kind}"
{model}
[[supports]]
nodes = [0, 1, 4]
[[loads]]
creases = "all"
fold_angle = 60
[analysis]
kind = "statics"
method = "displacement"
load_factors = [0.5, 1]
"""


@pytest.mark.matrix
@pytest.mark.parametrize(("kind", "model"), [("bars_and_hinges", ""), ("shell", "divisions = 2")])
def test_from_a_case_file_to_a_result_and_back(tmp_path, kind, model):
    path = tmp_path / "case.toml"
    path.write_text(FILE.format(kind=kind, model=model, offset='"faces"'))
    case = fd.read_case(path).case()
    pattern = case.structure.pattern
    np.testing.assert_allclose(pattern.boards.thickness, [0.05, 0.1, 0.05])
    result = fd.read_case(path).run()
    fd.save(result, tmp_path / "result.nc")
    again = fd.case_of(fd.load(tmp_path / "result.nc"))
    kept = again.structure.pattern
    np.testing.assert_array_equal(kept.flat_dihedrals, pattern.flat_dihedrals)
    np.testing.assert_array_equal(kept.boards.corners, pattern.boards.corners)
    np.testing.assert_array_equal(kept.boards.thickness, pattern.boards.thickness)
    np.testing.assert_array_equal(again.nodal_mass, case.nodal_mass)
    np.testing.assert_array_equal(again.actuation_terms[0][0], case.actuation_terms[0][0])
    path.write_text(FILE.format(kind=kind, model=model, offset="[0.02, -0.01]"))
    heights = fd.read_case(path).case().structure.pattern.vertices[[1, 2], 2]
    np.testing.assert_allclose(heights - heights[0], [0.0, -0.03], atol=1e-15)


@pytest.mark.parametrize(
    ("offset", "message"),
    [
        ('"face"', r'pattern.hinge_offset = "face": give "faces", or heights \(m\)'),
        ("[0.02]", r"pattern.hinge_offset = \[0.02\]: 1 value for 2 creases"),
        ("0.03", "pattern.hinge_offset: crease 0 has 0.03 m: must be at most half the thickness"),
        ("true", "pattern.hinge_offset = true: must be a number"),
    ],
)
def test_wrong_offsets_in_a_case_file(tmp_path, offset, message):
    path = tmp_path / "case.toml"
    path.write_text(FILE.format(kind="bars_and_hinges", model="", offset=offset))
    with pytest.raises(InputError, match=message):
        fd.read_case(path)
