from __future__ import annotations

import copy
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from foldyn.errors import FoldynWarning, InputError
from foldyn.patterns import GENERATORS, Pattern

SQUARES = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], dtype=float)
TWO = ((0, 1, 4, 3), (1, 2, 5, 4))


def hinge(dihedral_degrees):
    """Two unit squares about the y axis; positive-z side in front."""
    fold = np.pi - np.radians(dihedral_degrees)  # the second panel rises by this much
    wing = [np.cos(fold), np.sin(fold)]
    side = np.array([[-1, 0, 0], [0, 0, 0], [wing[0], 0, wing[1]]])
    return np.concatenate([side, side + np.array([0, 1, 0])])


def test_two_squares():
    p = Pattern(SQUARES, TWO, name="pair")
    assert p.vertices.shape == (6, 3)
    assert p.vertices.dtype == np.float64
    assert not p.vertices[:, 2].any()
    assert p.faces == TWO
    assert p.edges.tolist() == [[0, 1], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [4, 5]]
    assert p.creases.tolist() == [[1, 4]]
    assert p.boundary.tolist() == [[0, 1], [0, 3], [1, 2], [2, 5], [3, 4], [4, 5]]
    assert p.crease_faces.tolist() == [[0, 1]]  # face 0 runs 1 -> 4
    assert p.assignments == ("F",)
    assert p.dihedrals[0] == np.pi
    assert p.flipped == (False, False)
    np.testing.assert_allclose(p.face_areas, 1.0, rtol=1e-15)
    np.testing.assert_array_equal(p.face_normals, [[0, 0, 1], [0, 0, 1]])
    assert p.face_planarity.max() == 0.0
    assert p.size == pytest.approx(np.sqrt(5), rel=1e-15)
    assert repr(p) == "<Pattern 'pair': 6 vertices, 2 faces, 1 creases>"


def test_one_face_has_no_crease():
    p = Pattern([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])
    assert p.creases.shape == p.crease_faces.shape == (0, 2)
    assert p.dihedrals.shape == (0,)
    assert p.assignments == ()


def test_arrays_are_read_only_copies():
    vertices = SQUARES.copy()
    p = Pattern(vertices, TWO)
    vertices[0, 0] = 9.0
    assert p.vertices[0, 0] == 0.0
    for name in ("vertices", "edges", "creases", "boundary", "crease_faces", "dihedrals"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(p, name)[...] = 0
    with pytest.raises(AttributeError):
        p.name = "other"


def test_faces_become_python_integers():
    p = Pattern(SQUARES, np.array(TWO, dtype=np.int32))
    assert p.faces == TWO
    assert {type(v) for face in p.faces for v in face} == {int}


def test_survives_pickle_and_deepcopy():
    p = GENERATORS["miura"]()
    for q in (pickle.loads(pickle.dumps(p)), copy.deepcopy(p)):
        np.testing.assert_array_equal(q.vertices, p.vertices)
        assert (q.faces, q.assignments, q.name) == (p.faces, p.assignments, p.name)


def test_unused_vertex_is_kept():
    p = Pattern(np.vstack([SQUARES, [[7, 7]]]), TWO)
    assert len(p.vertices) == 7


def test_planarity_of_a_warped_square():
    z = 0.01
    p = Pattern([[0, 0, z], [1, 0, -z], [1, 1, z], [0, 1, -z]], [[0, 1, 2, 3]])
    assert p.face_planarity[0] == pytest.approx(z / np.sqrt(2), rel=1e-12)
    np.testing.assert_allclose(p.face_normals[0], [0, 0, 1], atol=1e-15)


def test_concave_face():
    p = Pattern([[0, 0], [2, 0], [0.5, 0.5], [0, 2]], [[0, 1, 2, 3]])  # an arrowhead
    assert p.face_areas[0] == pytest.approx(1.0, rel=1e-14)  # two triangles of base 2
    assert p.face_normals[0].tolist() == [0, 0, 1]


@pytest.mark.parametrize(
    "degrees", [1e-6, 1e-3, 1, 60, 90, 179, 180 - 1e-9, 181, 270, 300, 359, 360 - 1e-6]
)
def test_dihedral_of_a_hinge(degrees):
    p = Pattern(hinge(degrees), TWO)
    # exact to rounding on both sides of flat and when nearly collapsed
    assert p.dihedrals[0] == pytest.approx(np.radians(degrees), abs=3e-15, rel=0)
    flat = abs(degrees - 180) < 1e-6
    assert p.assignments[0] == ("F" if flat else "V" if degrees < 180 else "M")


@pytest.mark.parametrize(("letter", "angle"), [("V", 0.0), ("M", 2 * np.pi), (None, 0.0)])
def test_letter_decides_where_panels_coincide(letter, angle):
    vertices = [[1, 0, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 0]]
    p = Pattern(vertices, TWO, letter and {(1, 4): letter})
    assert p.dihedrals[0] == angle
    assert p.assignments == ((letter or "V"),)


@pytest.mark.matrix
@settings(max_examples=60)
@given(data=st.data(), kind=st.sampled_from(sorted(GENERATORS)))
def test_winding_is_made_consistent(data, kind):
    p = GENERATORS[kind]()
    flips = data.draw(st.lists(st.booleans(), min_size=len(p.faces), max_size=len(p.faces)))
    beside = coo_array((np.ones(len(p.creases)), p.crease_faces.T), (len(p.faces), len(p.faces)))
    for first in np.unique(connected_components(beside, directed=False)[1], return_index=True)[1]:
        flips[first] = False  # the lowest face of each part decides
    given_faces = [(f[0], *f[:0:-1]) if flip else f for f, flip in zip(p.faces, flips, strict=True)]
    q = Pattern(p.vertices, given_faces)
    assert q.faces == p.faces
    assert q.flipped == tuple(flips)
    np.testing.assert_array_equal(q.crease_faces, p.crease_faces)
    np.testing.assert_array_equal(q.dihedrals, p.dihedrals)


@pytest.mark.parametrize("kind", sorted(GENERATORS))
def test_creases_run_as_crease_faces_say(kind):
    p = GENERATORS[kind]()
    for (low, high), (first, second) in zip(p.creases, p.crease_faces, strict=True):
        for face, (a, b) in ((first, (low, high)), (second, (high, low))):
            corners = p.faces[face]
            assert (a, b) in list(zip(corners, corners[1:] + corners[:1], strict=True))
    for pairs in (p.edges, p.creases, p.boundary):
        assert pairs.tolist() == sorted(pairs.tolist())
        assert (pairs[:, 0] < pairs[:, 1]).all()
    assert len(p.edges) == len(p.creases) + len(p.boundary)


def test_turning_all_faces_over_turns_the_dihedrals():
    p = GENERATORS["miura"](cells=(2, 2))
    q = Pattern(p.vertices, [f[::-1] for f in p.faces])
    np.testing.assert_allclose(q.dihedrals, 2 * np.pi - p.dihedrals, atol=1e-14)
    swap = {"M": "V", "V": "M", "F": "F"}
    assert q.assignments == tuple(swap[letter] for letter in p.assignments)


# ------------------------------------------------------------------------------ assignments


@pytest.mark.parametrize("letter", ["M", "V", "F", "U"])
@pytest.mark.parametrize("how", ["mapping", "sequence", "array", "string"])
def test_given_letters_are_kept(letter, how):
    mapping = {(4, 1): letter, (0, 1): "B"}
    given_as = {"mapping": mapping, "sequence": [letter], "array": np.array([letter])}
    p = Pattern(SQUARES, TWO, given_as.get(how, letter))
    assert p.assignments == (letter,)
    assert type(p.assignments[0]) is str


def test_partial_mapping_leaves_the_rest_to_the_geometry():
    p = GENERATORS["miura"]()
    k = 1
    q = Pattern(p.vertices, p.faces, {tuple(p.creases[k].tolist()): "U"})
    expected = list(p.assignments)
    expected[k] = "U"
    assert q.assignments == tuple(expected)


def test_contradiction_warns_and_keeps_the_letter():
    with pytest.warns(FoldynWarning, match=r'crease \(1, 4\).*"V".*300\.0 degrees.*turn') as record:
        p = Pattern(hinge(300), TWO, "V")
    assert p.assignments == ("V",)
    assert record[0].filename == __file__
    with pytest.warns(FoldynWarning, match='"M"'):
        Pattern(hinge(60), TWO, "M")


@pytest.mark.parametrize("letter", ["M", "V"])
def test_no_warning_near_flat(letter):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for degrees in (180.0, 180.05, 179.95):  # 0.05 degrees: 0.9e-3 rad
            Pattern(hinge(degrees), TWO, letter)


@pytest.mark.parametrize(
    ("assignments", "message"),
    [
        ({(1, 4): "B"}, r'edge \(1, 4\) is "B" \(boundary\) but two faces share it'),
        ({(1, 4): "C"}, r'edge \(1, 4\) is "C" \(a cut\) but two faces share it.*own there'),
        ({(1, 4): "J"}, r'"J" \(a join'),
        ({(1, 4): "X"}, r"edge \(1, 4\) is 'X'; give"),
        ({(1, 4): None}, "is None; give"),
        ({(0, 1): "M"}, r"edge \(0, 1\) is 'M' but only one face has it"),
        ({(0, 5): "M"}, r"\(0, 5\) is not an edge of any face"),
        ({(1, 4): "M", (4, 1): "V"}, r"\(1, 4\) is given both 'M' and 'V'"),
        ({3: "M"}, "key 3 is not a pair"),
        ({"14": "M"}, "14: is no family; this pattern has none; give a family, or pairs"),
        ({(1, 2, 3): "M"}, "is not a pair"),
        (["M", "V"], "has 2 letters for 1 creases"),
        (["B"], r'edge \(1, 4\) is "B"'),
        ({"M"}, "give a mapping"),
        (5, "give a mapping"),
    ],
)
def test_bad_assignments(assignments, message):
    with pytest.raises(InputError, match=f"^assignments.*{message}"):
        Pattern(SQUARES, TWO, assignments)


# ------------------------------------------------------------------------------ bad geometry


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ([[0, 0, 0], [1, 0]], "different lengths"),
        ([["a", 0], [1, 0], [0, 1]], "not all entries are real numbers"),
        ("text", "real numbers"),
        ([0, 1, 2], r"has shape \(3,\)"),
        ([[0, 0, 0, 0]] * 3, r"has shape \(3, 4\)"),
        ([[0, 0], [1, 0]], r"has shape \(2, 2\): give at least 3"),
        ([[0, 0], [1, np.nan], [0, 1]], r"\[1\] = \[1.0, nan\]: coordinates must be finite"),
        ([[0, 0], [1, 0], [np.inf, 1]], r"\[2\] = .*must be finite"),
        ([[0, 0], [1e-40, 0], [0, 1e-40]], "they span 1e-40 m: give coordinates that span"),
    ],
)
def test_bad_vertices(vertices, message):
    with pytest.raises(InputError, match=f"^vertices.*{message}"):
        Pattern(vertices, [[0, 1, 2]])


def test_small_and_far_patterns_are_not_degenerate():
    p = Pattern(1e-6 * SQUARES, TWO)
    np.testing.assert_allclose(p.face_areas, 1e-12, rtol=1e-12)
    q = Pattern(SQUARES + 1e6, TWO)
    np.testing.assert_allclose(q.face_areas, 1.0, rtol=1e-9)


def test_moebius_strip_is_refused():
    n = 5
    t = 2 * np.pi * np.arange(n) / n
    u, s = np.repeat(t, 2), np.tile([-1, 1], n)
    away = 2 + s * np.cos(u / 2)
    strip = np.column_stack([away * np.cos(u), away * np.sin(u), s * np.sin(u / 2)])
    quads = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(n - 1)]
    quads.append((2 * n - 2, 2 * n - 1, 0, 1))  # closed with a half twist
    with pytest.raises(InputError, match=r"only one side.*edge \(\d+, \d+\) between faces"):
        Pattern(strip, quads)
    assert len(Pattern(strip, quads[:-1]).creases) == n - 2


def test_name_must_be_text():
    with pytest.raises(InputError, match="name = 5"):
        Pattern(SQUARES, TWO, name=5)


@pytest.mark.parametrize("far", [-(2**63), 1e30])
@pytest.mark.filterwarnings("error")
def test_vertices_may_be_far(far):
    Pattern([[0, 0, 0], [far, 0, 0], [0, far, 0]], [[0, 1, 2]])


@pytest.mark.parametrize("far", [1e31, 1e200, 1.7e308])
@pytest.mark.filterwarnings("error")
def test_vertices_too_far_for_numbers_are_refused(far):
    with pytest.raises(InputError, match=r"vertices\[1\] = .*at most 1e\+30 m"):
        Pattern([[0, 0, 0], [far, 0, 0], [0, far, 0]], [[0, 1, 2]])


STAR = [[np.cos(t), np.sin(t)] for t in 2 * np.pi * np.arange(5) * 2 / 5]


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (SQUARES, [], "faces is empty"),
        (SQUARES, None, "faces = None: give a list of faces"),
        (SQUARES, "012", 'faces = "012": give a list of faces'),
        (SQUARES, [0, 1, 2], r"faces\[0\] = 0: give a list of vertex numbers"),
        (SQUARES, ["012"], r'faces\[0\] = "012": give'),
        (SQUARES, [[0, 1, 4.0, 3]], r"faces\[0\]: vertex number 4.0 is not an integer"),
        (SQUARES, [[0, 1, True]], "faces.*vertex number True is not an integer"),
        (SQUARES, [TWO[0], [1, 2, 6]], r"\[1, 2, 6\]: vertex 6 does not exist; with 6.* 5"),
        (SQUARES, [[0, 1, -2]], "faces.*vertex -2 does not exist"),
        (SQUARES, [[0, 1]], r"faces.*at least 3 distinct vertices, this has 2"),
        (SQUARES, [[0, 1, 0, 1]], r"faces.*at least 3 distinct vertices, this has 2"),
        (SQUARES, [[0, 1, 4, 0]], r"faces.*vertex 0 occurs twice"),
        (SQUARES, [*TWO, (3, 4, 1, 0)], r"faces\[2\] = .*same vertices as faces\[0\]"),
        (SQUARES, [[0, 1, 2]], r"faces\[0\] = \[0, 1, 2\]: has no area"),
        (SQUARES, [[0, 4, 1, 3]], r"faces.*has no area.*in order around"),  # corners crosswise
        (SQUARES, [[0, 2, 3, 5]], r"faces.*(has no area|crosses itself)"),
        ([[0, 0], [3, 0], [2, 2], [0, 1]], [[0, 2, 1, 3]], r"\[0, 2, 1, 3\]: its outline crosses"),
        (STAR, [range(5)], "crosses itself"),
        (
            [[0, 0], [1, 0], [1, 1], [1, 1], [0, 1]],
            [range(5)],
            r"faces\[0\].*two of its corners lie in the same place",
        ),
    ],
)
def test_bad_faces(vertices, faces, message):
    with pytest.raises(InputError, match=message):
        Pattern(vertices, faces)
