"""Our shell against stored results of OpenSees, and the model that made them.

The results are in verification/opensees/results; no test needs `opensees`.
"""

from __future__ import annotations

import sys
from functools import cache

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.studies import find_case
from foldyn.studies.herkal.runs import CASES
from named_models import named
from pairwise import beyond
from verification.opensees import compare, model
from verification.opensees.model import panel_mesh
from verification.opensees.stored import (
    Moved,
    read_motion,
    read_still,
    stored_divisions,
    stored_motions,
    write_motion,
    write_still,
)

FINEST = 32


@cache
def stored(name, divisions=FINEST):
    return read_still(name, divisions)


@cache
def ours(name, divisions):
    return compare.our_still(name, divisions)


# ------------------------------------------------------------------ what is stored
@pytest.mark.parametrize("name", CASES)
def test_half_the_mesh_changes_little(name):
    """From 16 to 32 divisions, below 0.5 % in statics and the first three frequencies."""
    assert stored_divisions(name)[-1] == FINEST
    moved, frequency = compare.away(stored(name, 16), stored(name))
    assert moved < 0.005
    assert np.abs(frequency[:3]).max() < 0.005


@pytest.mark.parametrize(
    ("coarse", "fine"), [((8, 0.005), (8, 0.0025)), ((12, 0.01), (24, 0.01))], ids=["step", "mesh"]
)
def test_half_the_step_or_mesh_changes_the_motion_of_case_1_little(coarse, fine):
    """Relative L2 over 10 s: 0.08 % and 0.41 %."""
    found = [read_motion("case1", *one) for one in (coarse, fine)]
    assert compare.motion_away(*found) < 0.005


def test_case_1_is_symmetric():
    """The fold is its own mirror image at y = 1/2; so is its mesh with an even number of cells."""
    left, right = np.moveaxis(stored("case1").displacement, 1, 0)
    np.testing.assert_allclose(left, right * [1, -1, 1], atol=1e-9)


def test_case_3_is_symmetric():
    """Pulled in its plane of symmetry x = const at node 5; supported alike on both sides in z."""
    node, moved = stored("case3").node.tolist(), stored("case3").displacement[-1]
    assert moved[node.index(2), 1] == pytest.approx(moved[node.index(8), 1], rel=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_nodes_are_those_that_the_case_file_reports(name):
    case_file = fd.read_case(find_case(f"herkal/{name}"))
    np.testing.assert_array_equal(stored(name).node, case_file.output.nodes)
    for one in stored_motions(name):
        motion = read_motion(name, *one)
        np.testing.assert_array_equal(motion.node, case_file.output.nodes)
        duration = case_file.analysis.arguments["duration"]
        assert motion.time[-1] == pytest.approx(duration)


def test_soft_folds_move_more_and_swing_slower():
    """Case 4 is case 2 with folds of five times the length scale."""
    stiff, soft = stored("case2"), stored("case4")
    assert (np.abs(soft.displacement[-1, :, 0]) > 2 * np.abs(stiff.displacement[-1, :, 0])).all()
    assert (soft.frequency < stiff.frequency).all()


# ------------------------------------------------------------------ our shell
@pytest.mark.matrix
@pytest.mark.parametrize("name", CASES)
def test_a_coarse_shell_is_near(name):
    """With 8 divisions, at worst 2.3 % (case 2, statics) and 1.9 % (case 1, third frequency)."""
    moved, frequency = compare.away(ours(name, 8), stored(name))
    assert moved < 0.026
    assert np.abs(frequency[:3]).max() < 0.022


@pytest.mark.parametrize("name", beyond(CASES))
def test_a_fine_shell_agrees(name):
    """At worst 0.73 % (case 3, statics) and 0.40 % (case 1, second frequency)."""
    moved, frequency = compare.away(ours(name, FINEST), stored(name))
    assert moved < 0.01
    assert np.abs(frequency[:3]).max() < 0.01


@pytest.mark.matrix
def test_a_coarse_shell_moves_alike():
    """Case 1 with 8 divisions, relative L2 over 10 s: 4.6 %; 16 change ours by 4.4 %."""
    motion = compare.our_motion("case1", 8, 0.01, duration=3.0)
    assert compare.motion_away(motion, read_motion("case1", 8, 0.0025)) < 0.05


@pytest.mark.parametrize("name", beyond([name for name in CASES if stored_motions(name)][::-1]))
def test_motions_of_all_cases_begin_alike(name):
    """The first 2 s with 10 divisions: at worst 4.8 % (case 2); see docs/opensees.md for 10 s."""
    motion = compare.our_motion(name, 10, 0.01, duration=2.0)
    assert motion.time[-1] == pytest.approx(2.0)
    assert compare.motion_away(motion, read_motion(name, 10, 0.005)) < 0.06


# ------------------------------------------------------------------ tables
def test_tables_of_what_is_stored(capsys):
    assert compare.main(["--cases", "case1", "--divisions"]) == 0
    lines = [line.split(" | ") for line in capsys.readouterr().out.splitlines()]
    stills = [line for line in lines if len(line) == 7 and "case1" in line[0]]
    assert [int(line[1]) for line in stills] == stored_divisions("case1")
    moved, frequency = compare.away(stored("case1", 16), stored("case1"))
    assert float(stills[-2][4]) == pytest.approx(100 * moved, abs=0.006)
    assert float(stills[-2][5]) == pytest.approx(100 * np.abs(frequency[:3]).max(), abs=0.006)
    assert float(stills[-2][3].split(", ")[0]) == pytest.approx(0.4477, abs=1e-4)
    assert stills[-1][4] == ""
    motions = [line for line in lines if len(line) == 4 and "case1" in line[0]]
    found = [(int(line[1]), float(line[2])) for line in motions]
    assert found == stored_motions("case1")
    coarse, finest = read_motion("case1", *found[0]), read_motion("case1", *found[-1])
    off = 100 * compare.motion_away(coarse, finest)
    assert float(motions[0][3].removesuffix(" |")) == pytest.approx(off, abs=0.006)


def test_rows_of_ours_have_two_references():
    rows = compare.still_table([[ours("case1", 4)]], [[ours("case1", 2)], [stored("case1")]])
    row = rows.splitlines()[-1].split(" | ")
    assert len(row) == 10
    moved, _ = compare.away(ours("case1", 4), stored("case1"))
    assert float(row[7]) == pytest.approx(100 * moved, abs=0.006)


# ------------------------------------------------------------------ the model
@cache
def case(name="case2"):
    return fd.read_case(find_case(f"herkal/{name}")).case()


def test_stiffness_of_creases_is_that_of_the_calibration():
    """0.06387 N m/rad with E 1e6, nu 0.25, t 0.01, L 1 and Ls 1 (design, section 5)."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    assert model.crease_stiffness(1.0, sheet) == pytest.approx(0.06387, abs=5e-6)
    structure = case("case4").structure
    found = [model.crease_stiffness(1.0, structure.sheet)] * len(structure.folds)
    np.testing.assert_allclose(found, structure.fold_stiffness, rtol=1e-12)


@pytest.mark.parametrize("divisions", [3, 4])
@pytest.mark.parametrize(
    "pattern",
    [
        fd.patterns.simple_fold(a=0.7, b=1.3, dihedral=60),
        fd.patterns.miura(cells=(2, 1), a=1.0, b=1.4, panel_angle=70, dihedral=100),
    ],
    ids=["fold", "miura"],
)
def test_the_mesh_covers_the_panels_and_meets_at_creases(pattern, divisions):
    mesh = panel_mesh(pattern, divisions)
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    normal = 0.5 * np.cross(b - a, c - a)
    normal = normal.reshape(len(pattern.faces), -1, 3)
    np.testing.assert_allclose(
        normal.sum(axis=1), pattern.face_areas[:, None] * pattern.face_normals, atol=1e-12
    )
    assert (np.einsum("pti,pi->pt", normal, pattern.face_normals) > 0.0).all()
    for vertex, nodes in enumerate(mesh.corners):
        np.testing.assert_allclose(
            mesh.points[list(nodes)] - pattern.vertices[vertex], 0.0, atol=1e-12
        )
    panel = mesh.points.shape[0] // len(pattern.faces)
    for crease, faces, (low, high) in zip(
        mesh.creases, pattern.crease_faces, pattern.creases, strict=True
    ):
        np.testing.assert_array_equal(crease.nodes // panel, np.tile(faces, (divisions + 1, 1)))
        first, second = (mesh.points[crease.nodes[:, side]] for side in (0, 1))
        np.testing.assert_allclose(first, second, atol=1e-12)
        ends = pattern.vertices[[low, high]]
        np.testing.assert_allclose(first[[0, -1]], ends, atol=1e-12)
        np.testing.assert_allclose(crease.length * crease.axis, ends[1] - ends[0], atol=1e-12)


def test_panels_of_other_shapes_are_refused():
    tower = fd.patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30, storeys=1)
    with pytest.raises(InputError, match="panel 0 has 3 corners"):
        panel_mesh(tower, 4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"supports": [fd.Impose([7], "z", 1e-3)]}, "`Fix` alone"),
        ({"loads": [fd.Gravity((0, 0, -9.81))]}, "`Force` alone"),
        ({"loads": [fd.Force([9], (0, 0, 1.0))]}, "vertices of the pattern"),
        ({"damping": fd.Rayleigh(beta=1e-3)}, "beta = 0.001"),
    ],
)
def test_what_the_model_does_not_know_is_refused(change, message):
    given = {"supports": case().supports, "loads": case().loads} | change
    with pytest.raises(InputError, match=message):
        model.PanelShells(fd.Case(case().structure, **given), 4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"crease_stiffness": 0.1}, "those of the sheet"),
        ({"crease_rest": 90.0}, "those of the sheet"),
        ({"fold_law": "superlinear"}, "linear at rest"),
        ({"fold_law": fd.EnhancedLinear(theta1=75, theta2=285)}, "linear at rest"),
    ],
)
def test_folds_that_the_model_does_not_know_are_refused(options, message):
    structure = fd.discretize(case().structure.pattern, case().structure.sheet, **named(options))
    with pytest.raises(InputError, match=message):
        model.PanelShells(fd.Case(structure), 4)


def test_a_missing_package_is_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "opensees", None)
    monkeypatch.setitem(sys.modules, "opensees.openseespy", None)
    with pytest.raises(InputError, match="needs OpenSees, which is not installed"):
        model.PanelShells(case(), 2).frequencies()


# ------------------------------------------------------------------ files
def test_results_come_back_as_they_were_written(tmp_path):
    still = stored("case1")
    assert write_still(still, tmp_path).name == "case1-d32.json"
    again = read_still("case1", 32, tmp_path)
    for name in ("node", "load_factor", "displacement", "frequency"):
        np.testing.assert_array_equal(getattr(again, name), getattr(still, name))
    assert again.about == still.about
    motion = Moved(
        np.array([4]), np.array([0.0, 0.01]), np.full((2, 1, 3), 0.1),
        {"case": "case1", "divisions": 8, "dt": 0.0025},
    )  # fmt: skip
    write_motion(motion, tmp_path)
    assert stored_motions("case1", tmp_path) == [(8, 0.0025)]
    found = read_motion("case1", 8, 0.0025, tmp_path)
    np.testing.assert_allclose(found.displacement, motion.displacement, rtol=1e-7)
    assert found.about == motion.about
    assert compare.motion_away(found, motion) < 1e-7
