"""Folding of patterns: closed forms of mechanisms, signs, what is left where none exists."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.errors import CrossingWarning, FoldynWarning, InputError, MotionInterrupted

SQUARE, HALVES = [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)]


def miura(dihedral, cells=(2, 2)):
    return fd.patterns.miura(cells=cells, a=1.0, b=1.2, panel_angle=65, dihedral=dihedral)


def flat_miura(cells=(2, 2)):
    """A Miura-ori laid flat, with the assignments that it has when folded."""
    flat = miura(180, cells)
    return fd.Pattern(flat.vertices, flat.faces, miura(120, cells).assignments)


def vertex(sectors, letters):
    """Creases of unit length that meet at one vertex with these sector angles (degrees)."""
    way = np.radians(np.cumsum([0.0, *sectors[:-1]]))
    rim = np.column_stack([np.cos(way), np.sin(way)])
    n = len(sectors)
    faces = [(0, 1 + k, 1 + (k + 1) % n) for k in range(n)]
    assignments = {(0, 1 + k): letter for k, letter in enumerate(letters)}
    return fd.Pattern(np.vstack([[0.0, 0.0], rim]), faces, assignments)


@pytest.mark.parametrize("dihedral", [150.0, 60.0, 20.0])
def test_one_crease_drives_a_miura_to_its_closed_form(dihedral):
    pattern, exact = flat_miura(), miura(dihedral)
    driven = np.argmin(np.abs(np.degrees(exact.dihedrals) - dihedral))
    pair = tuple(pattern.creases[driven].tolist())
    folding = fd.fold(pattern, {pair: 180.0 - dihedral}, steps=8)
    np.testing.assert_allclose(pdist(folding.pattern.vertices), pdist(exact.vertices), atol=1e-6)
    np.testing.assert_allclose(folding.pattern.dihedrals, exact.dihedrals, atol=1e-6)
    assert folding.kind == "rigid" and folding.rigid_path and not folding.wrong
    assert folding.pattern.faces == pattern.faces


def test_a_vertex_of_degree_4_keeps_the_relation_of_half_angles():
    # Flat-foldable vertex, sectors alpha, beta, pi - alpha, pi - beta: opposite creases turn by
    # angles equal in size, and tan(g2/2) = p tan(g1/2) with p = sin((a+b)/2)/sin((a-b)/2) or
    # cos((a+b)/2)/cos((a-b)/2) (Huffman 1976; Lang, Twists, Tilings and Tessellations, ch. 8).
    alpha, beta = 70.0, 50.0
    pattern = vertex([alpha, beta, 180 - alpha, 180 - beta], "VVMV")
    folding = fd.fold(pattern, {(0, 1): 100.0}, steps=8)
    turned = np.tan(0.5 * folding.angles)
    np.testing.assert_allclose(np.abs(turned[0]), np.abs(turned[2]), rtol=1e-9)
    np.testing.assert_allclose(np.abs(turned[1]), np.abs(turned[3]), rtol=1e-9)
    a, b = math.radians(alpha), math.radians(beta)
    multipliers = [math.cos((a + b) / 2) / math.cos((a - b) / 2), math.sin((a - b) / 2)]
    multipliers[1] /= math.sin((a + b) / 2)
    ratio = abs(turned[1] / turned[0])
    assert min(abs(max(ratio, 1 / ratio) * p - 1.0) for p in multipliers) < 1e-9
    assert math.degrees(folding.angles[0]) == pytest.approx(100.0, abs=1e-7)


@pytest.mark.parametrize(("angle", "letter"), [(90.0, "V"), (35.0, "M"), (170.0, "V")])
def test_a_simple_fold_is_exact(angle, letter):
    folding = fd.fold(fd.Pattern(SQUARE, HALVES, [letter]), angle, steps=4)
    sign, found = 1.0 if letter == "V" else -1.0, folding.pattern
    np.testing.assert_allclose(found.dihedrals, math.pi - sign * math.radians(angle))
    apart = np.linalg.norm(found.vertices[1] - found.vertices[3])
    assert apart == pytest.approx(math.sqrt(2.0) * math.cos(math.radians(angle) / 2))
    assert folding.error < 1e-9 and found.assignments == (letter,)


def test_a_vertex_of_eight_equal_sectors_folds_symmetrically():
    folding = fd.fold(vertex([45] * 8, "VMVMVMVM"), fraction=0.4, steps=6)
    turned = folding.angles.reshape(4, 2)
    np.testing.assert_allclose(turned, np.tile(turned[0], (4, 1)), atol=1e-8)
    assert folding.kind == "rigid" and not folding.wrong
    # A valley, the next mountain and the axis span a spherical triangle with 45 degrees at the axis
    # and on the side across; its other angles are half the dihedrals (law of cosines for angles).
    a, b = 0.5 * (math.pi - turned[0])
    sector = math.radians(45.0)
    closed = -math.cos(a) * math.cos(b) + math.sin(a) * math.sin(b) * math.cos(sector)
    assert closed == pytest.approx(math.cos(sector), abs=1e-9)


def test_every_mountain_and_valley_of_a_miura_turns_its_way():
    folding = fd.fold(flat_miura((3, 2)), fraction="75%", steps=6)
    signs = np.where(np.array(folding.pattern.assignments) == "V", 1.0, -1.0)
    assert (signs * folding.path["fold_angle"].values[1:] > 0.0).all()
    assert folding.kind == "rigid"
    np.testing.assert_allclose(folding.pattern.dihedrals, math.pi - folding.angles, atol=1e-9)
    pattern = flat_miura()
    none = fd.fold(pattern, fraction=0.0, steps=2)  # gives the same pattern
    np.testing.assert_allclose(none.pattern.vertices, pattern.vertices, atol=1e-9)
    assert not none.wrong and none.strain < 1e-12


STATES = {
    "square_twist": fd.patterns.square_twist,
    "waterbomb": lambda **keys: fd.patterns.waterbomb((3, 2), **keys),
    "arc_miura": fd.patterns.arc_miura,
    "resch": lambda **keys: fd.patterns.resch((2, 2), **keys),
}


@pytest.mark.parametrize("name", STATES)
def test_flat_patterns_reach_the_states_of_their_generators(name):
    flat, folded = STATES[name](dihedral=180), STATES[name]()
    folding = fd.fold(flat, folded, steps=8)
    assert folding.kind == "rigid" and not folding.wrong and not len(folding.crossings)
    np.testing.assert_allclose(pdist(folding.pattern.vertices), pdist(folded.vertices), atol=1e-6)
    assert folding.pattern.families.keys() == flat.families.keys()


def test_a_partly_folded_pattern_goes_on_from_where_it_is():
    half, exact = miura(100, (1, 1)), miura(40, (1, 1))
    pair = tuple(half.creases[np.argmin(np.abs(half.dihedrals - math.radians(260)))].tolist())
    folding = fd.fold(half, {pair: -140.0}, steps=4)
    np.testing.assert_allclose(folding.path["position"].values[0], half.vertices, atol=1e-12)
    np.testing.assert_allclose(folding.pattern.dihedrals, exact.dihedrals, atol=1e-7)


def test_angles_are_given_by_assignment_family_pair_or_crease():
    families = {"edge": [(0, 2)]}
    pattern = fd.Pattern(SQUARE, HALVES, ["M"], families=families)
    for angles in (60, {"mountain": 60}, {"all": 60}, {"edge": 60}, {(2, 0): -60}, [-60.0]):
        folding = fd.fold(pattern, angles, steps=2)
        assert math.degrees(folding.angles[0]) == pytest.approx(-60.0), angles
        np.testing.assert_array_equal(folding.pattern.families["edge"], [0])
    both = fd.fold(pattern, {"edge": 60, (0, 2): -20}, steps=2)  # a pair refines a family
    assert math.degrees(both.angles[0]) == pytest.approx(-20.0)


def test_fold_angles_of_a_file_are_the_whole_way():
    keys = {"fold_angles": [math.radians(-80)], "custom": {"x:y": 1}}
    pattern = fd.Pattern(SQUARE, HALVES, ["M"], "flap", **keys)
    assert math.degrees(fd.fold(pattern, steps=2).angles[0]) == pytest.approx(-80.0)
    half = fd.fold(pattern, fraction="50%", steps=2)
    assert math.degrees(half.angles[0]) == pytest.approx(-40.0)
    assert half.pattern.name == "flap" and half.pattern.custom == {"x:y": 1}
    np.testing.assert_array_equal(half.pattern.fold_angles, pattern.fold_angles)


def test_flat_creases_belong_to_panels():
    strip = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
    faces = [(0, 1, 5), (1, 4, 5), (1, 2, 3, 4)]
    pattern = fd.Pattern(strip, faces, {(1, 5): "F", (1, 4): "V"})
    folding = fd.fold(pattern, 100, steps=3)
    flat = pattern.assignments.index("F")
    assert abs(folding.angles[flat]) < 1e-9
    assert math.degrees(folding.angles[1 - flat]) == pytest.approx(100.0)
    driven = fd.fold(pattern, {(1, 5): 30, (1, 4): 0}, steps=3)
    assert math.degrees(driven.angles[flat]) == pytest.approx(30.0)


def square_twist(pleats="MV"):
    """Square twist with valleys around its square, which no rigid folding allows."""
    inner = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    across = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)], float)
    pleat = across @ Rotation.from_euler("z", 30, degrees=True).as_matrix()[:2, :2].T
    outer = np.stack([inner + 1.5 * pleat, np.roll(inner, -1, axis=0) + 1.5 * pleat], axis=1)
    faces, letters = [(0, 1, 2, 3)], {}
    for k in range(4):
        after, a, b = (k + 1) % 4, 4 + 2 * k, 5 + 2 * k
        faces += [(k, a, b, after), (after, b, 4 + 2 * after)]
        letters |= {(k, after): "V", (k, a): pleats[0], (after, b): pleats[1]}
    return fd.Pattern(np.vstack([inner, outer.reshape(-1, 2)]), faces, letters)


@pytest.mark.parametrize("slip", [5e-8, 5e-7, 5e-6])
def test_panels_bend_by_as_little_as_slips_of_drawing_need(slip):
    """Panels of 40 mm turn by an angle of about slip/(40 mm) against each other."""
    flat, rng = flat_miura((3, 3)), np.random.default_rng(3)
    x = flat.vertices * 0.04 / flat.sides[0].max()
    turn = rng.uniform(0.0, 2.0 * np.pi, len(x))
    slips = slip * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    exact, drawn = (
        fd.fold(flat.changed(vertices=place), fraction=0.6, steps=3) for place in (x, x + slips)
    )
    assert exact.kind == "rigid" and drawn.kind == "bent"
    # 2 degrees, whatever the slip, where panels are left free to bend
    assert drawn.path["bend"].values.max() < 2e-4 + 20.0 * slip / 0.04
    np.testing.assert_allclose(drawn.angles, exact.angles, atol=0.01)


@pytest.mark.matrix
def test_a_square_twist_folds_only_with_strain_and_says_so():
    folding = fd.fold(square_twist(), 60, steps=6)
    assert not folding.wrong
    assert folding.kind == "stretched" and 1e-4 < folding.strain < 0.1
    assert "does not fold without strain" in folding.report()
    signs = {"M": -1.0, "V": 1.0, "F": 0.0}
    turned = math.pi - folding.pattern.dihedrals
    ways = np.array([signs[letter] for letter in folding.pattern.assignments])
    assert (turned * ways >= 0.0).all()
    cut = [face for face in folding.pattern.faces if len(face) == 3]
    assert len(cut) > 4  # bent panels are cut along their bends, flat creases


@pytest.mark.parametrize(("letters", "folds"), [("MVVV", True), ("VMVV", True), ("VVMV", False)])
def test_the_odd_crease_of_a_vertex_must_be_beside_its_smallest_sector(letters, folds):
    # the creases of the smallest sector turn opposite ways (big-little-big lemma: Kawasaki 1989,
    # Justin 1994); with any other letters no state of four rigid panels turns all its creases
    pattern = vertex([40, 100, 140, 80], letters)
    if folds:
        folding = fd.fold(pattern, 90, steps=4)
        assert folding.kind == "rigid" and folding.rigid_path and not folding.wrong
        return
    with pytest.warns(FoldynWarning, match=r"do not turn their way: creases \d \(0, \d\)"):
        folding = fd.fold(pattern, 90, steps=4)
    signs = np.where(np.array(pattern.assignments) == "V", 1.0, -1.0)
    late = np.flatnonzero(signs * folding.angles <= 1e-3)
    assert folding.wrong == tuple(late.tolist()) and 1 <= len(late) <= 2
    assert f"{4 - len(late)} of 4 mountains and valleys turn their way; not" in folding.report()
    assert "does not fold without strain" in folding.report()


def test_a_state_that_rotations_close_is_opened():
    pattern = vertex([40, 100, 140, 80], "MVVV")
    folding = fd.fold(pattern, fraction=0.7, steps=6, initial="folded")
    assert folding.started_from == "folded" and not folding.wrong
    np.testing.assert_allclose(np.abs(folding.path["fold_angle"].values[0]), math.pi, atol=1e-9)
    assert folding.rigid_path
    unfolded = fd.fold(pattern, fraction=0.7, steps=6, initial="pattern")  # the other way
    np.testing.assert_allclose(folding.angles, unfolded.angles, atol=1e-6)
    with pytest.raises(InputError, match='initial = "folded": the panels do not close'):
        fd.fold(vertex([80, 90, 90, 100], "VVVM"), fraction=0.9, initial="folded")


@pytest.mark.filterwarnings("ignore:panels pass through")
def test_a_state_that_stays_closed_is_not_taken_where_less_was_asked():
    # two valleys beside the smallest sector: the folded state closes, but no rigid path opens it
    pattern = vertex([84, 57, 96, 123], "VVVM")
    with pytest.warns(FoldynWarning, match="do not turn their way"):
        folding = fd.fold(pattern, fraction=0.6, steps=4)
    assert folding.started_from == "pattern" and folding.wrong
    assert np.degrees(np.abs(folding.angles)).max() < 150.0
    with pytest.warns(FoldynWarning, match=r"4 creases stay closed that were to open: creases 0 "):
        folding = fd.fold(pattern, fraction=0.6, steps=4, initial="folded")
    assert np.degrees(np.abs(folding.angles)).min() > 175.0


def test_panels_that_pass_through_each_other_are_named():
    # two flaps of a strip of three panels, each wider than the middle one, folded by 170 degrees
    x = [0.0, 1.0, 1.6, 2.6]
    points = [(a, b) for a in x for b in (0.0, 1.0)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(3)]
    pattern = fd.Pattern(points, faces, ["V", "V"])
    said = r"each other from step 7 of 10 on \(0 and 2\); in the folded state 0 and 2"
    with pytest.warns(CrossingWarning, match=said):
        folding = fd.fold(pattern, 170, steps=10)
    assert folding.crossings.tolist() == [[0, 2]]
    # they meet where the flaps have the height of their hinges' distance over 2 tan
    first = min(folding.first_crossings)
    touching = math.degrees(math.pi - math.acos(0.3 / 1.0))
    assert 170 * (first - 1) / 10 <= touching <= 170 * first / 10
    assert f"from step {first} of 10 on (0 and 2)" in folding.report()
    apart = fd.fold(pattern, 90, steps=3)
    assert not apart.first_crossings and "no panels cross" in apart.report()


def test_the_path_can_be_watched():
    steps, pattern = [], flat_miura((1, 1))
    folding = fd.fold(pattern, {(1, 4): -90}, steps=5, progress=lambda *at: steps.append(at))
    assert steps == [(k, 5) for k in range(1, 6)]
    path = folding.path
    assert path["position"].dims == ("step", "node", "axis") and path.sizes["step"] == 6
    np.testing.assert_allclose(path["share"], np.linspace(0, 1, 6))
    np.testing.assert_array_equal(path["position"].values[-1], folding.pattern.vertices)
    jumps = np.abs(np.diff(path["position"].values, axis=0))
    assert jumps.max() < 0.6  # placed near each other, not turned about


def test_an_interrupted_folding_has_the_steps_that_are_done():
    def interrupt(step, _):
        if step == 2:
            raise KeyboardInterrupt

    pattern = flat_miura((1, 1))
    whole = fd.fold(pattern, {(1, 4): -100}, steps=4)
    with pytest.raises(MotionInterrupted, match="interrupted after 2 of 4 steps") as stop:
        fd.fold(pattern, {(1, 4): -100}, steps=4, progress=interrupt)
    partial = stop.value.partial
    assert partial.path.sizes["step"] == 3
    np.testing.assert_array_equal(partial.path["position"], whole.path["position"][:3])
    assert math.degrees(partial.pattern.dihedrals.max()) == pytest.approx(180 + 50, abs=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "fraction: missing; give it"),
        ({"angles": 30, "fraction": 0.5}, "fraction: give either angles or fraction"),
        ({"fraction": 1.5}, "fraction = 1.5"),
        ({"fraction": "80"}, 'must be as in "80%"'),
        ({"angles": -30}, "angles = -30: must be at least 0 for creases chosen by a word"),
        ({"angles": 200}, "must lie between -180 and 180 degrees"),
        ({"angles": [1, 2, 3]}, "has 3 angles for 1 creases"),
        ({"angles": {}}, "angles: is empty"),
        ({"angles": {(0, 1): 30}}, r"angles: \(0, 1\) is not a crease"),
        ({"angles": {"montain": 30}}, "angles.montain: did you mean 'mountain'"),
        ({"angles": {"valley": 30}}, "angles.valley: this pattern has no crease assigned valley"),
        ({"angles": {(0, 2): 30}}, r"crease \(0, 2\) is a mountain, and 30 degrees"),
        ({"angles": {(0, 2): [30]}}, "give one number"),
        ({"angles": fd.patterns.miura()}, "angles: has other creases"),
        ({"angles": 30, "steps": 0}, "steps = 0"),
        ({"angles": 30, "initial": "flat"}, 'initial = "flat"'),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    pattern = fd.Pattern(SQUARE, HALVES, ["M"])
    with pytest.raises(InputError, match=message):
        fd.fold(pattern, **arguments)


UNASSIGNED = fd.Pattern(SQUARE, HALVES, ["U"], families={"a": [(0, 2)]})


@pytest.mark.parametrize(
    ("pattern", "arguments", "message"),
    [
        ([[0, 0, 0]], {"angles": 30}, "pattern: got list, give a Pattern"),
        (fd.Pattern(SQUARE, [(0, 1, 2, 3)]), {"angles": 30}, "has no creases"),
        (UNASSIGNED, {"fraction": 0.5}, "neither mountains and valleys nor fold angles"),
        (UNASSIGNED, {"angles": {"a": 9}}, "is neither mountain nor valley"),
    ],
)
def test_what_cannot_be_folded_is_refused(pattern, arguments, message):
    with pytest.raises(InputError, match=message):
        fd.fold(pattern, **arguments)
    assert math.degrees(fd.fold(UNASSIGNED, [40], steps=2).angles[0]) == pytest.approx(40)


def test_welds_stay_flat_where_they_can():
    points = [(x, y) for x in range(5) for y in (0, 1)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(4)]
    strip = fd.Pattern(points, faces, {(4, 5): "V", (2, 3): "F", (6, 7): "F"})
    folding = fd.fold(fd.welded(strip, join=False), {"valley": 90.0})
    assert folding.pattern.welds.tolist() == [[2, 3], [6, 7]]
    np.testing.assert_allclose(np.degrees(folding.pattern.dihedrals), 90.0)
    np.testing.assert_allclose(np.degrees(folding.pattern.weld_dihedrals), 180.0)


@pytest.mark.parametrize("angles", [35.0, {"all": 35.0}], ids=["one size", "all"])
def test_unassigned_creases_are_free_beside_one_size_for_all_others(angles):
    # four creases of a symmetric vertex: the unassigned one follows from the three that are driven
    pattern = vertex([120, 60, 60, 120], "VVMU")
    folding = fd.fold(pattern, angles, steps=4)
    assert np.isnan(folding.targets).tolist() == [False, False, False, True]
    assert folding.kind == "rigid" and folding.angles[3] > math.radians(10)
    own = fd.Pattern(pattern.vertices, pattern.faces, pattern.assignments, fold_angles={"all": 0.6})
    np.testing.assert_array_equal(own.fold_angles, [0.6, 0.6, -0.6, np.nan])
