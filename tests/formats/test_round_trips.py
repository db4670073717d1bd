"""Patterns written in every format and read again: the same geometry and assignments."""

from __future__ import annotations

import inspect
from pathlib import Path

import numpy as np
import pytest
from fold_texts import assert_same
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import FORMATS, diagnose, read_pattern, write_pattern
from foldyn.patterns import GENERATORS, Pattern, miura, simple_fold, thicken

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "patterns"
BOTH = sorted(end for end, fmt in FORMATS.items() if fmt.read and fmt.write)
FOLDED = [".fold", ".obj"]
ANGLED = [".fold", ".obj", ".svg"]
LETTERS = {".cp": "MVF"}
"""Letters that a format knows, of those that do not know all."""
NEAR = 1e-9


def flat(kind):
    """A generator's pattern in the plane, or None if it has none."""
    make = GENERATORS[kind]
    arguments = inspect.signature(make).parameters
    for given_ in ({"dihedral": 180}, {"fold_angle": 0}, {}):
        if set(given_) <= set(arguments):
            try:
                pattern = make(**given_)
            except InputError:
                continue
            if not pattern.vertices[:, 2].any():
                return pattern
    return None


def planar(seed, letters="MVFU", angles=False):
    """Triangles on random points, with random letters."""
    random = np.random.default_rng(seed)
    points = random.uniform(-0.2, 0.3, (random.integers(4, 14), 2))
    faces = Delaunay(points).simplices.tolist()
    bare = Pattern(points, faces)
    chosen = random.choice(list(letters), len(bare.creases)).tolist()
    sign = {"M": -1.0, "V": 1.0}
    wanted = [
        sign[letter] * random.uniform(0.01, np.pi) if letter in sign else np.nan
        for letter in chosen
    ]
    kept = bare.changed(assignments=chosen, fold_angles=wanted if angles else None)
    sides = [np.ptp(points[face], axis=0).max() for face in faces]
    thick = min(kept.face_areas / sides) > 2e-3  # slivers are closed as lines that nearly meet
    return kept if thick else planar(seed + 1000, letters, angles)


def assert_alike(p, q):
    """The same panels, and lines with letters and angles, in the same places; cuts too."""
    assert (len(p.vertices), len(p.faces)) == (len(q.vertices), len(q.faces))

    def place(vertex):
        """First vertex of p in that place."""
        distance = np.linalg.norm(p.vertices - vertex, axis=1)
        assert distance.min() < NEAR * p.size
        return int(np.argmax(distance < NEAR * p.size))

    told = []
    for pattern in (p, q):
        where = np.array([place(vertex) for vertex in pattern.vertices])
        ends = np.sort(where[pattern.creases], axis=1).tolist()
        panels = sorted(sorted(where[list(face)].tolist()) for face in pattern.faces)
        angles = np.nan_to_num(pattern.fold_angles, nan=9.0).tolist()
        lines = sorted(zip(ends, pattern.assignments, angles, strict=True))
        rim = sorted(np.sort(where[pattern.boundary], axis=1).tolist())
        told.append((panels, rim, [line[:2] for line in lines], [line[2] for line in lines]))
    (*one, angles), (*other, found) = told
    assert one == other
    np.testing.assert_allclose(found, angles, atol=1e-9)


@pytest.mark.parametrize("extension", BOTH)
@pytest.mark.parametrize("kind", sorted(GENERATORS))
def test_flat_patterns_of_every_generator(kind, extension, tmp_path):
    p = flat(kind)
    if p is None:
        pytest.skip("cannot be flattened")
    known = LETTERS.get(extension, "MVFU")
    letters = [known[k % len(known)] for k in range(len(p.creases))]
    p = p.changed(assignments=letters, fold_angles=[np.nan] * len(letters))  # made for others
    write_pattern(p, tmp_path / f"x{extension}")
    found = diagnose(tmp_path / f"x{extension}", facets="hinge")
    assert_alike(p, found.pattern)
    assert kind != "miura" or found.diagnosis.repairs == found.diagnosis.doubts == ()


@pytest.mark.matrix
@pytest.mark.parametrize("extension", BOTH)
@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
def test_random_flat_patterns(extension, seed, tmp_path_factory):
    p = planar(seed, LETTERS.get(extension, "MVFU"), extension in ANGLED)
    path = tmp_path_factory.mktemp("trip") / f"x{extension}"
    write_pattern(p, path)
    assert_alike(p, diagnose(path, facets="hinge").pattern)


@pytest.mark.matrix
@pytest.mark.parametrize("extension", FOLDED)
@settings(max_examples=25)
@given(seed=st.integers(0, 2**31))
@example(seed=268435455)  # with a needle
def test_random_folded_patterns(extension, seed, tmp_path_factory):
    """Heights make every crease a mountain or a valley; numbers stay to the last digit."""
    p = planar(seed)
    heights = np.random.default_rng(seed).uniform(-0.05, 0.05, len(p.vertices))
    points = 1e6 * np.column_stack([p.vertices[:, :2], heights]) ** 3
    p = Pattern(points, p.faces, name='"hills" <\\> é')
    path = tmp_path_factory.mktemp("trip") / f"x{extension}"
    write_pattern(p, path)
    assert_same(p, read_pattern(path))


@pytest.mark.parametrize("extension", FOLDED)
def test_angles_to_fold_to_survive_on_folded_patterns(extension, tmp_path):
    p = miura(dihedral=120)
    wanted = [-1.5 if letter == "M" else 1.25 for letter in p.assignments]
    p = p.changed(fold_angles=[*wanted[:-1], None])
    write_pattern(p, tmp_path / f"x{extension}")
    np.testing.assert_allclose(
        read_pattern(tmp_path / f"x{extension}", facets="hinge").fold_angles, p.fold_angles
    )


@pytest.mark.parametrize("extension", [".svg", ".dxf", ".cp"])
def test_a_drawing_of_a_folded_pattern_is_refused(extension, tmp_path):
    with pytest.raises(InputError, match=r"folded at 1 creases; write the flat .* as .fold, .obj"):
        write_pattern(simple_fold(), tmp_path / f"x{extension}")
    upright = simple_fold(dihedral=180).rotated(90, "x")
    with pytest.raises(InputError, match="not level; write the flat pattern"):
        write_pattern(upright, tmp_path / f"x{extension}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("extension", sorted(end for end, fmt in FORMATS.items() if fmt.write))
def test_boards_are_left_out_aloud(extension, tmp_path):
    thick = thicken(simple_fold(dihedral=180).changed(assignments="F"), 0.1)
    with pytest.warns(FoldynWarning, match="no place for the thickness of its panels"):
        write_pattern(thick, tmp_path / f"x{extension}")


@pytest.mark.parametrize("extension", [".dxf", ".cp"])
def test_angles_that_a_format_cannot_hold_are_left_out_aloud(extension, tmp_path):
    p = simple_fold(dihedral=180).changed(assignments="V", fold_angles=[1.0])
    with pytest.warns(FoldynWarning, match="no place for fold angles"):
        write_pattern(p, tmp_path / f"x{extension}")


def test_cuts_survive(tmp_path):
    """A slit from the middle of one side to the center stays open."""
    points = [(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2), (1, 1), (1, 0)]
    p = Pattern(
        points, [(0, 1, 6, 5), (5, 6, 4), (7, 2, 3, 6), (6, 3, 4)],
        {(1, 6): "B", (6, 7): "B", (5, 6): "V", (4, 6): "M", (3, 6): "V"},
    )  # fmt: skip
    for extension in (".fold", ".obj", ".svg", ".dxf"):
        write_pattern(p, tmp_path / f"x{extension}")
        q = diagnose(tmp_path / f"x{extension}", facets="hinge").pattern
        assert (len(q.vertices), len(q.faces), len(q.creases)) == (8, 4, 3), extension
        assert sorted(q.assignments) == ["M", "V", "V"]


@pytest.mark.parametrize("path", sorted(SAMPLES.glob("*.*")) or [None], ids=str)
def test_real_files_in_every_suitable_format(path, tmp_path):
    """Flat ones in all formats, folded ones in those of panels."""
    if path is None or path.suffix not in FORMATS:
        pytest.skip("no file of a pattern")
    facets = "hinge"
    p = diagnose(path, unit="mm", facets=facets).pattern
    if len(p.welds):  # cuts of panels that are not convex: in a file they are lines like others
        facets = "line"
        p = diagnose(path, unit="mm", facets=facets).pattern
    is_flat = not p.vertices[:, 2].any() and (np.abs(p.dihedrals - np.pi) < 1e-6).all()
    for extension in BOTH if is_flat else FOLDED:
        if not set(p.assignments) <= set(LETTERS.get(extension, "MVFU")):
            continue
        q = p if extension in ANGLED else p.changed(fold_angles=None)
        write_pattern(q, tmp_path / f"x{extension}")
        assert_alike(q, diagnose(tmp_path / f"x{extension}", facets=facets).pattern)
