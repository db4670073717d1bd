"""Edges of three and more panels: one crease between each two neighbors about the edge."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.patterns.geometry import face_geometry
from junctions import copied, crease_of, stack, star
from verification.benchmarks.shells import double_box


def test_neighbors_about_an_edge():
    pattern = star((0.0, 200.0, 90.0))
    assert pattern.creases.tolist() == [[0, 1]] * 3
    assert {frozenset(pair) for pair in pattern.crease_faces.tolist()} == {
        frozenset(pair) for pair in ((0, 2), (2, 1), (1, 0))
    }
    by_pair = crease_of(pattern)
    for (one, two), angle in (((0, 2), 90.0), ((2, 1), 110.0), ((1, 0), 160.0)):
        row = by_pair[(0, 1), frozenset((one, two))]
        assert np.degrees(pattern.dihedrals[row]) == pytest.approx(angle, abs=1e-9)
    assert pattern.junctions.tolist() == [[0, 1]]
    assert pattern.lines.tolist().count([0, 1]) == 1
    assert len(pattern.lines) == len(pattern.edges)


@pytest.mark.parametrize("seed", range(6))
def test_angles_about_a_junction_fill_the_circle(seed):
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.uniform(20.0, 90.0, rng.integers(3, 6)))
    made = copied(star(angles, backwards=rng.permutation(3)[:2]), seed)[0]
    assert np.degrees(made.dihedrals).sum() == pytest.approx(360.0, abs=1e-9)
    found = np.sort(np.degrees(made.dihedrals))
    expected = np.sort(np.diff(np.append(angles, angles[0] + 360.0)))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_two_panels_are_as_before():
    """The general rule, from the first to the second by the right hand, is that of any crease."""
    pattern = star((0.0, 70.0))
    assert pattern.crease_ways.tolist() == [[1, 1]]
    assert np.degrees(pattern.dihedrals) == pytest.approx(70.0)
    assert not len(pattern.junctions)


def test_a_welded_junction_has_all_pairs():
    pattern = star(welded=True)
    assert len(pattern.creases) == 0
    pairs = [frozenset(pair) for pair in pattern.weld_faces.tolist()]
    assert len(set(pairs)) == len(pairs) == 6
    angles = dict(zip(pairs, np.degrees(pattern.weld_dihedrals), strict=True))
    assert angles[frozenset((0, 1))] == pytest.approx(80.0)
    assert min(angles[frozenset((0, 2))], 360.0 - angles[frozenset((0, 2))]) == pytest.approx(160.0)


def test_only_sheets_share_a_front():
    """Panels at a junction keep the side that they are given; others follow the first."""
    one, other = (star((0.0, 120.0, 240.0), backwards=back) for back in ((), (0, 1, 2)))
    for pattern in (one, other):
        assert not any(pattern.flipped)
        normals = face_geometry(pattern.vertices, pattern.faces).face_normals
        np.testing.assert_allclose(normals, pattern.face_normals)
        np.testing.assert_allclose(np.degrees(pattern.dihedrals), 120.0)
    box = double_box()
    assert box.flipped.count(True) > 0  # walls at corners of two panels turn with each other


def test_letters_of_junctions_follow_the_angles():
    pattern = star((0.0, 40.0, 100.0))
    assert sorted(pattern.assignments) == ["M", "V", "V"]  # 300, 60 and 40 degrees
    given = fd.Pattern(pattern.vertices, pattern.faces, {(0, 1): "M"})
    assert given.assignments == pattern.assignments


def test_families_name_all_creases_of_a_junction():
    plain = star()
    pattern = fd.Pattern(plain.vertices, plain.faces, families={"core": [(0, 1)]})
    assert pattern.families["core"].tolist() == [0, 1, 2, 3]
    assert pattern.changed(name="other").families["core"].tolist() == [0, 1, 2, 3]


def test_layers_are_joined_along_creases():
    layer, pattern = stack()
    assert len(pattern.faces) == 2 * len(layer.faces)
    ridge = np.isclose(layer.vertices[:, 2], layer.vertices[:, 2].max())
    assert len(pattern.vertices) == 2 * len(layer.vertices) - ridge.sum()
    inner = layer.creases[ridge[layer.creases].all(axis=1)]
    assert len(pattern.junctions) == len(inner) > 0
    assert len(pattern.creases) == 2 * len(layer.creases) + 2 * len(inner)


@pytest.mark.parametrize("make", [lambda: double_box(welded=False), lambda: stack()[1]])
@pytest.mark.parametrize("suffix", ["fold", "obj"])
def test_files(tmp_path, suffix, make):
    """Three, and four faces at an edge."""
    path, pattern = tmp_path / f"box.{suffix}", make()
    fd.write_pattern(pattern, path)
    found = fd.read_pattern(path, facets="hinge")
    assert found.junctions.tolist() == pattern.junctions.tolist()
    np.testing.assert_allclose(found.dihedrals, pattern.dihedrals, atol=1e-9)
    assert found.faces == pattern.faces


def test_welded_junctions_in_files(tmp_path):
    pattern = double_box()
    fd.write_pattern(pattern, tmp_path / "box.fold")
    assert fd.read_pattern(tmp_path / "box.fold").welds.tolist() == pattern.welds.tolist()


def test_facets_at_junctions_are_welded_by_name_only():
    """Two of three panels are level; a sheet with a stiffener, which may hinge there."""
    pattern = star((0.0, 90.0, 180.0))
    assert "F" in pattern.assignments
    assert len(fd.welded(pattern).welds) == 0
    welded = fd.welded(pattern, [(0, 1)])
    assert len(welded.faces) == 3
    assert len(welded.welds) == 3


@pytest.mark.parametrize(
    "use", [lambda p: fd.fold(p, 10.0), lambda p: fd.thicken(p, 0.001)], ids=["fold", "thicken"]
)
def test_what_cannot_have_junctions_says_so(use):
    with pytest.raises(InputError, match=r"pattern: more than two panels meet at edge \(0, 1\)"):
        use(star())


@pytest.mark.parametrize("close", [1e-5, 1e-7, 1e-10, 0.0, -1e-10, -1e-7])
def test_panels_that_nearly_coincide(close):
    """The second may lie slightly behind the first."""
    pattern = star((0.0, np.degrees(close), 90.0, 143.0))
    assert np.degrees(pattern.dihedrals).sum() == pytest.approx(360.0, abs=1e-9)
    assert pattern.dihedrals.max() < np.pi * 1.3


def test_a_welded_layer_is_joined_to_a_creased_one():
    layer, _ = stack()
    top = layer.vertices[:, 2].max()
    other = layer.mirrored("z", about=(0.0, 0.0, top))
    welded = other.changed(welds=other.creases, assignments=None, families=None, fold_angles=None)
    made = layer.joined(welded, inner=True)
    assert len(made.junctions) == 2
    assert len(made.creases) < len(layer.creases)  # junctions are welded


def test_mirror_images_have_the_angles_of_the_same_panels():
    pattern = star((0.0, 40.0, 120.0, 200.0))
    one, other = pattern, pattern.mirrored("z")
    angles = (
        {frozenset(pair): angle for pair, angle in zip(p.crease_faces.tolist(), a, strict=True)}
        for p, a in ((one, one.dihedrals), (other, other.dihedrals))
    )
    first, second = angles
    assert first.keys() == second.keys()
    assert all(second[pair] == pytest.approx(angle) for pair, angle in first.items())
