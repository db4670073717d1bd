"""Input decks: what is in them, and what OpenSees and CalculiX make of them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from decks_run import HAS_CALCULIX, HAS_OPENSEES, by_calculix, by_opensees
from scipy.sparse.linalg import spsolve

import foldyn as fd
from foldyn.algebra.extrapolation import extrapolated
from foldyn.errors import FoldynWarning, InputError
from foldyn.exports import opensees
from foldyn.exports.creased_shell import creased_shell
from foldyn.linear.linearized import linearize
from foldyn.linear.shell_of import shell_of
from foldyn.structures.material_axes import material_axes
from named_models import named

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)


def fold(sheet=SHEET, **options):
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    structure = fd.discretize(pattern, sheet, **named(options))
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    return fd.Case(structure, supports, [fd.Force([0, 1], (-1e-5, 0, 0))])


def clamped():
    """A clamped fold whose panels differ, with a point mass and its own weight."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0, panels=[fd.PanelSheet(1, thickness=0.015, density=2.0)])
    case = fold(sheet, clamped=[(4, 5)])
    mass = fd.PointMass(2, mass=0.004)
    loads = [fd.Gravity((0, 0, -1e-3)), fd.Force(3, (0, 1e-5, 0))]
    return case.altered(masses=[mass], loads=loads, supports=case.supports[:1])


def tower():
    """Triangles; six panels meet at inner vertices."""
    pattern = fd.patterns.kresling(sides=5, radius=1.0, height=0.9, twist=30, storeys=2)
    structure = fd.discretize(pattern, SHEET, preset="plate")
    return fd.Case(structure, [fd.Fix("zmin", "xyz")], [fd.Force("zmax", (0, 0, 1e-5))])


def welded():
    """A pentagon, drawn as a quadrilateral and a triangle, and a triangle hinged to it."""
    points = [[0, 0, 0], [1, 0, 0], [1.2, 0.7, 0], [0.5, 1.2, 0], [-0.2, 0.7, 0], [1.6, 0.2, 0.4]]
    faces = [(0, 1, 2, 4), (4, 2, 3), (1, 5, 2)]
    pattern = fd.Pattern(points, faces, welds=[(2, 4)])
    structure = fd.discretize(pattern, SHEET, preset="n5b8e")
    return fd.Case(structure, [fd.Fix([0, 4, 3])], [fd.Force(5, (0, 0, 1e-5))])


def junctions():
    """Three panels that hinge at one line, and a fourth line at which they are welded to others."""
    angles, out = np.radians([0.0, 100.0, 230.0]), [[0, 0, 0], [1, 0, 0]]
    for angle in angles:
        out += [[x, np.cos(angle), np.sin(angle)] for x in (0, 1)]
    out += [[x, 1.7, z] for z in (0.6, -0.6) for x in (0, 1)]
    faces = [(0, 1, 3, 2), (0, 1, 5, 4), (1, 0, 6, 7), (2, 3, 9, 8), (2, 3, 11, 10)]
    pattern = fd.Pattern(out, faces, welds=[(2, 3)])
    structure = fd.discretize(pattern, SHEET, preset="n5b8e", crease_stiffness=1e-4)
    return fd.Case(structure, [fd.Fix([4, 5, 6])], [fd.Force(9, (0, 0, 1e-6))])


CASES = {
    "fold": fold, "clamped": clamped, "tower": tower, "welded": welded, "junctions": junctions,
}  # fmt: skip


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param]()


# ------------------------------------------------------------------ the description
def test_the_shell_is_split_along_creases_alone(case):
    shell, own = creased_shell(case, 3), shell_of(case, 3).structure
    count = len(own.nodes)
    np.testing.assert_array_equal(shell.nodes[:count], own.nodes)
    np.testing.assert_array_equal(shell.nodes[shell.triangles], own.nodes[own.triangles])
    pattern = own.pattern
    panels = [
        set(shell.triangles[own.triangle_panel == k].ravel()) for k in range(len(pattern.faces))
    ]
    for a, b in pattern.crease_faces.tolist():
        assert not panels[a] & panels[b]
    for a, b in pattern.weld_faces.tolist():
        assert len(panels[a] & panels[b]) == 4
    for joint, faces in zip(shell.joints, pattern.crease_faces.tolist(), strict=True):
        for side in (0, 1):
            assert set(joint.nodes[:, side]) <= panels[faces[side]]
        first, second = (shell.nodes[joint.nodes[:, side]] for side in (0, 1))
        np.testing.assert_array_equal(first, second)
        assert np.diff(first @ joint.axis).min() > 0.0
    for place in shell.places:
        assert np.ptp(shell.nodes[list(place)], axis=0).max() == 0.0
    assert sum(len(place) - 1 for place in shell.places) == len(shell.nodes) - count


def test_stiffness_loads_and_masses_are_kept(case):
    shell, own = creased_shell(case, 3), shell_of(case, 3)
    folds = [joint.stiffness.sum() for joint in shell.joints]
    np.testing.assert_allclose(folds, own.structure.fold_stiffness, rtol=1e-12)
    for joint in shell.joints:
        np.testing.assert_allclose(joint.stiffness * 6 / joint.stiffness.sum(), [1, 2, 2, 1])
    for force, (whole, _) in zip(shell.forces, own.load_terms, strict=True):
        np.testing.assert_allclose(force.sum(axis=0), whole.sum(axis=0), rtol=1e-12, atol=1e-20)
    assert shell.masses.sum() == pytest.approx(own.point_masses.sum())
    assert shell.held[: len(own.structure.nodes)].tolist() == own.fixed.tolist()


def test_a_clamped_edge_keeps_the_rotations_of_its_panel():
    shell = creased_shell(clamped(), 4)
    assert shell.clamped.sum() == 5
    np.testing.assert_allclose(shell.nodes[shell.clamped][:, [0, 2]], [[1.0, 0.0]] * 5)
    assert shell.held[shell.clamped].all()


def test_panels_that_touch_at_a_vertex_are_tied():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0]]
    pattern = fd.Pattern(points, [(0, 1, 2, 3), (2, 4, 5, 6)])
    case = fd.Case(fd.discretize(pattern, SHEET, preset="plate"), [fd.Fix([0, 1, 3])])
    shell = creased_shell(case, 2)
    (pair,) = shell.loose
    assert not shell.joints
    np.testing.assert_array_equal(shell.nodes[list(pair)], [[1, 1, 0]] * 2)
    ties = [one for one in opensees.model(shell) if one[:2] == ("element", "zeroLength")]
    assert len(ties) == 1 and "-orient" not in ties[0]


# ------------------------------------------------------------------ files
class Recorder:
    """A model that takes down what it is told."""

    def __init__(self):
        self.told = []

    def __getattr__(self, name):
        return lambda *arguments: self.told.append([name, *map(str, arguments)])


def test_the_deck_has_the_commands_that_are_run(case, tmp_path):
    recorder, shell = Recorder(), creased_shell(case, 2)
    opensees.run(recorder, opensees.model(shell))
    opensees.run(recorder, opensees.solver("Newton"))
    (deck,) = fd.export(case, tmp_path / "a.tcl", divisions=2)
    lines = [line.split() for line in deck.read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == ["model", "basic", "-ndm", "3", "-ndf", "6"]
    assert lines[1 : len(recorder.told) + 1] == recorder.told


def parsed(path):
    """Blocks of a deck of Abaqus: keyword, parameters, rows of data."""
    blocks = []
    for line in path.read_text("ascii").splitlines():
        assert len(line) <= 256
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            word, *given = (part.strip() for part in line[1:].split(","))
            pairs = [part.split("=") for part in given]
            blocks.append((word, {pair[0]: pair[-1] for pair in pairs}, []))
        else:
            blocks[-1][2].append([part.strip() for part in line.split(",")])
            assert all(len(part) <= 20 for part in blocks[-1][2][-1]) or blocks[-1][0] == "HEADING"
    return blocks


KEYWORDS = {
    "HEADING", "NODE", "ELEMENT", "MATERIAL", "ELASTIC", "DENSITY", "SHELL SECTION", "EQUATION",
    "SPRING", "MASS", "BOUNDARY", "STEP", "FREQUENCY", "END STEP", "STATIC", "CLOAD", "NODE PRINT",
}  # fmt: skip


def test_a_deck_of_abaqus_is_consistent(case, tmp_path):
    """What it names is defined, once; no displacement is both held and eliminated."""
    (deck,) = fd.export(case, tmp_path / "a.inp", divisions=3)
    shell, blocks = creased_shell(case, 3), parsed(deck)
    assert {word for word, _, _ in blocks} <= KEYWORDS
    of = {word: [block for block in blocks if block[0] == word] for word in KEYWORDS}
    nodes = [int(row[0]) for _, _, rows in of["NODE"] for row in rows]
    assert nodes == list(range(1, len(nodes) + 1))
    turns = nodes[len(shell.nodes) :]
    elements = [row for _, _, rows in of["ELEMENT"] for row in rows]
    assert sorted(int(row[0]) for row in elements) == list(range(1, len(elements) + 1))
    assert {int(node) for row in elements for node in row[1:]} <= set(nodes)
    sets = {given["ELSET"]: rows for _, given, rows in of["ELEMENT"]}
    named = [
        given["ELSET"] for word in ("SHELL SECTION", "SPRING", "MASS") for _, given, _ in of[word]
    ]
    assert sorted(named) == sorted(sets)
    held = {
        (int(n), dof) for n, a, b in _plain(of["BOUNDARY"]) for dof in range(int(a), int(b) + 1)
    }
    gone = []
    for _, _, (count, *rows) in of["EQUATION"]:
        terms = np.array([x for row in rows for x in row], float).reshape(-1, 3)
        assert len(terms) == int(count[0])
        gone.append((int(terms[0, 0]), int(terms[0, 1])))
        if gone[-1][0] in turns:
            axis = terms[1::2, 2]
            np.testing.assert_allclose([axis @ axis, *(axis + terms[2::2, 2])], [1.0, *0 * axis])
    assert len(gone) == len(set(gone)) and not held & set(gone)
    assert {node for node, dof in gone if dof == 1} >= set(turns)
    springs = [float(rows[1][0]) * len(sets[given["ELSET"]]) for _, given, rows in of["SPRING"]]
    assert sum(springs) == pytest.approx(sum(joint.stiffness.sum() for joint in shell.joints))
    forces = np.array([row for _, _, rows in of["CLOAD"] for row in rows], float)
    total = [forces[forces[:, 1] == axis, 2].sum() for axis in (1, 2, 3)]
    np.testing.assert_allclose(total, np.sum(shell.forces, axis=(0, 1)), rtol=1e-9, atol=1e-20)


def _plain(blocks):
    return [row for _, _, rows in blocks for row in rows if row[0] != "TURNS"]


def test_options_of_decks(tmp_path):
    (deck,) = fd.export(fold(), tmp_path / "a.inp", divisions=2, modes=9, element="S3")
    text = deck.read_text()
    assert "*ELEMENT, TYPE=S3," in text and "*FREQUENCY\n9\n" in text
    (deck,) = fd.export(fold().altered(loads=()), tmp_path / "a.tcl", divisions=2, modes=4)
    text = deck.read_text()
    assert "[eigen -genBandArpack 4]" in text and "analyze" not in text
    (deck,) = fd.export(shell_of(fold(), 3), tmp_path / "b.tcl")
    assert deck.read_text().count("ASDShellT3") == 2 * 2 * 9


def test_a_result_stands_for_its_case(tmp_path):
    still = fd.modes(fold().altered(loads=()), 2)
    one = fd.export(still, tmp_path / "a.inp", divisions=2)[0].read_text()
    assert (
        one == fd.export(fold().altered(loads=()), tmp_path / "b.inp", divisions=2)[0].read_text()
    )


# ------------------------------------------------------------------ what other programs find
RUN = {name: CASES[name] for name in ("fold", "clamped", "welded", "junctions")}


def limits(find):
    """Frequencies extrapolated from meshes of 4 and 8 divisions."""
    return extrapolated(find(4), find(8), 2.0)


def ours(case):
    return lambda divisions: fd.modes(shell_of(case, divisions), 4).frequency.values


def displaced(case, divisions):
    """Linear displacements (m) of the vertices of our shell under all loads."""
    own = shell_of(case, divisions)
    small = linearize(own.altered(loads=()))
    force = np.sum([force for force, _ in own.load_terms], axis=0).ravel()
    moved = small.expanded(spsolve(small.stiffness, small.projected(force))[:, None])
    return moved.reshape(-1, 3)[: len(own.structure.pattern.vertices)]


def away(found, true):
    return float(np.linalg.norm(found[: len(true)] - true) / np.linalg.norm(true))


@pytest.mark.skipif(not HAS_OPENSEES, reason="needs opensees")
@pytest.mark.parametrize("name", RUN)
def test_opensees_finds_what_the_shell_does(name, tmp_path):
    """At worst 0.82 % in a frequency and 1.24 % in displacements, with 8 divisions."""
    case = RUN[name]()
    free = case.altered(loads=())

    def run(given, divisions):
        return by_opensees(*fd.export(given, tmp_path / "a.tcl", divisions=divisions, modes=4))

    found, true = limits(lambda n: run(free, n)[0]), limits(ours(free))
    assert np.abs(found / true - 1.0).max() < 0.01
    assert away(run(case, 8)[1], displaced(case, 8)) < 0.015


def fibers(sheet=None):
    """A fold of an orthotropic sheet, with fibers at 30 degrees to its first edge."""
    own = {"shear_modulus": 6e5, "direction": {"edge": (0, 1), "angle": 30.0}}
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    structure = fd.shell(
        pattern, sheet or fd.Sheet((4e6, 1e6), 0.25, 0.01, 1.0, **own), divisions=4,
        crease_stiffness=0.02,
    )  # fmt: skip
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    return fd.Case(structure, supports, [fd.Force([0, 1], (-1e-5, 0, 0))])


@pytest.mark.skipif(not HAS_OPENSEES, reason="needs opensees")
def test_opensees_finds_what_orthotropic_shells_do(tmp_path):
    """1.0 % in the second frequency, 0.2 % in others and in displacements."""
    case = fibers()

    def at(divisions):
        return case.altered(structure=case.structure.meshed(divisions))

    runs = {n: by_opensees(*fd.export(at(n), tmp_path / "a.tcl", modes=4)) for n in (4, 8)}
    found = extrapolated(runs[4][0], runs[8][0], 2.0)
    true = limits(lambda n: fd.modes(at(n).altered(loads=()), 4).frequency.values)
    assert np.abs(found / true - 1.0).max() < 0.015
    assert away(runs[8][1], displaced(at(8), 8)) < 0.005


def test_opensees_gets_directions_and_no_plies(tmp_path):
    (deck,) = fd.export(fibers(), tmp_path / "a.tcl")
    text = deck.read_text()
    assert "nDMaterial ElasticOrthotropic 1 4000000.0 1000000.0 1000000.0 0.25" in text
    assert text.count("-local") == text.count("ASDShellT3") > 0
    ply = fd.Ply(0.005, (4e6, 1e6), 0.25, shear_modulus=6e5, density=1.0)
    with pytest.raises(InputError, match="plies: OpenSees has no section"):
        fd.export(fibers(fd.Sheet(plies=[ply, ply], direction=0.0)), tmp_path / "b.tcl")


@pytest.mark.skipif(not HAS_CALCULIX, reason="needs CalculiX (ccx)")
@pytest.mark.parametrize("name", RUN)
def test_calculix_finds_what_the_shell_does(name, tmp_path):
    """At worst 0.21 % in a frequency and 1.08 % in displacements, with 8 divisions."""
    case = RUN[name]()

    def run(divisions):
        return by_calculix(*fd.export(case, tmp_path / "a.inp", divisions=divisions), 4)

    coarse, fine = run(4), run(8)
    found, true = extrapolated(coarse[0], fine[0], 2.0), limits(ours(case.altered(loads=())))
    assert np.abs(found / true - 1.0).max() < 0.004
    assert away(fine[1], displaced(case, 8)) < 0.015


def test_panels_of_fibers_have_axes_and_constants_of_their_own(tmp_path):
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    sheet = fd.Sheet(
        (9e6, 1e6), 0.25, 0.01, 1.0, shear_modulus=4e5, direction={"edge": (0, 1), "angle": 30.0},
        panels=[fd.PanelSheet(1, thickness=0.015)],
    )  # fmt: skip
    case = fd.Case(fd.shell(pattern, sheet, divisions=2), [fd.Fix([4, 5], "xyz")])
    lines = fd.export(case, tmp_path / "a.inp")[0].read_text().splitlines()
    own = lines.index("*ELASTIC, TYPE=ENGINEERING CONSTANTS")
    assert lines[own + 1 : own + 3] == ["9000000, 1000000, 1000000, 0.25, 0, 0, 400000, 400000",
                                        "400000"]  # fmt: skip
    for number, fibers in enumerate(material_axes(pattern, sheet), 1):
        at = lines.index(f"*ORIENTATION, NAME=AXES_{number}_1")
        axes = np.array(lines[at + 1].split(","), float).reshape(2, 3)
        across = np.cross(pattern.face_normals[number - 1], fibers)
        np.testing.assert_allclose(axes, [fibers, across], atol=1e-8)
        assert f"MATERIAL=MATERIAL_{number}, ORIENTATION=AXES_{number}_1" in "\n".join(lines)


def test_plies_are_a_composite_section_with_an_orientation_each(tmp_path):
    carbon = {"youngs_modulus": (9e6, 1e6), "poissons_ratio": 0.25, "shear_modulus": 4e5}
    plies = [fd.Ply(0.004, angle=angle, density=1.0, **carbon) for angle in (30, -30, 30)]
    sheet = fd.Sheet(plies=plies, direction=(1.0, 0.0, 0.0))
    flat = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    case = fd.Case(fd.shell(flat, sheet, divisions=2), [fd.Fix([0, 3], "xyz")])
    lines = fd.export(case, tmp_path / "a.inp")[0].read_text().splitlines()
    at = lines.index("*SHELL SECTION, ELSET=PANELS_1_1, COMPOSITE")
    assert lines[at + 1 : at + 3] == ["0.004, 3, MATERIAL_1_1, AXES_1_1_1",
                                      "0.004, 3, MATERIAL_1_2, AXES_1_1_2"]  # fmt: skip
    second = lines[lines.index("*ORIENTATION, NAME=AXES_1_1_2") + 1].split(",")
    c, s = np.cos(np.radians(-30)), np.sin(np.radians(-30))
    np.testing.assert_allclose(np.array(second, float), [c, s, 0, -s, c, 0], atol=1e-9)


# ------------------------------------------------------------------ what is refused
@pytest.mark.parametrize(
    ("options", "change", "message"),
    [
        ({}, {"supports": [fd.Impose([0], "z", 1e-3)]}, "supports: move nodes; hold them with Fix"),
        ({}, {"supports": [fd.Fix([0], direction=(1, 0, 1))]}, "supports: hold oblique directions"),
        ({}, {"supports": [fd.Spring(1.0, nodes=[0])]}, "supports: have springs"),
        ({}, {"loads": [fd.Pressure(1.0)]}, "loads: follow the sheet"),
        ({}, {"loads": [fd.Actuate([0], angle=90)]}, "loads: fold creases; give the folded"),
        ({"rigid": "all"}, {}, "rigid: panels are rigid|hold oblique"),
        ({"crease_rest": 90.0}, {}, "crease_rest: folds with another rest angle are under stress"),
        ({"fold_law": "superlinear"}, {}, 'fold_law = .*take "linear" or "enhanced"'),
    ],
)
def test_what_decks_have_no_place_for(options, change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        fd.export(fold(**options).altered(**change), tmp_path / "a.tcl", divisions=2)
    assert not list(tmp_path.iterdir())


def test_a_sheet_without_density(tmp_path):
    with pytest.raises(InputError, match=r"sheet\.density: missing"):
        fd.export(fold(fd.Sheet(1e6, 0.25, 0.01)), tmp_path / "a.inp")


def test_a_case_is_no_result(tmp_path):
    with pytest.raises(InputError, match=r"result: is a case, and the format glb holds"):
        fd.export(fold(), tmp_path / "a.glb")
    with pytest.raises(InputError, match="divisions = 4: the case is a shell already, with 3"):
        fd.export(shell_of(fold(), 3), tmp_path / "a.tcl", divisions=4)


def test_folds_beyond_their_linear_range_get_their_slope(tmp_path):
    law = fd.EnhancedLinear(theta1=75, theta2=285)
    with pytest.warns(FoldynWarning, match="1 of 1 folds are not linear about rest"):
        shell = creased_shell(fold(fold_law=law), 2)
    rest = np.radians(60.0)
    slope = law.slope(rest, rest)
    assert slope > 1.05
    plain = creased_shell(fold(), 2)
    assert shell.joints[0].stiffness.sum() == pytest.approx(slope * plain.joints[0].stiffness.sum())


def test_what_moves_over_time_is_left_out():
    swing = fd.BaseMotion("x", history=fd.HalfSine(duration=1.0))
    dashpot = fd.Dashpot(1.0, nodes=[0])
    case = fold()
    with pytest.warns(FoldynWarning, match="dashpots and motions of the base are left out"):
        creased_shell(case.altered(supports=[*case.supports, swing, dashpot]), 2)


def test_names_of_elements(tmp_path):
    with pytest.raises(InputError, match=re.escape('element = "S4": choose one of STRI3, S3')):
        fd.export(fold(), tmp_path / "a.inp", element="S4")
