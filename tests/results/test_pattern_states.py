"""What a pattern says of its creases, in results; states of results as frames of a file."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.analyses import read_case
from foldyn.errors import InputError
from foldyn.results import frames_of, shapes_of, state_of
from foldyn.results.frames import SWING

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)


def told(pattern):
    return pattern.changed(
        fold_angles=[0.5, None, -1.0, 0.25],
        families={"zigzag": pattern.creases[:2], "a b": pattern.creases[3:]},
        custom={"tm:x": [1, None, {"y": 2.5}], "é:b": "ü"},
    )


HELD = [fd.Fix([0, 1, 2])]
MIURA = fd.patterns.miura()
TOLD = told(MIURA)


@pytest.fixture(scope="module")
def motion():
    """A Miura cell that is pulled."""
    case = fd.Case(fd.discretize(TOLD, SHEET, preset="plate"), HELD, [fd.Force([7], (0.01, 0, 0))])
    return fd.simulate(case, 0.01, method="rk4", every_steps=20)


@pytest.fixture(scope="module")
def path():
    plain = fd.Pattern(MIURA.vertices, MIURA.faces, name="miura")
    case = fd.Case(fd.discretize(plain, SHEET, preset="plate"), HELD, [fd.Force([7], (1e-4, 0, 0))])
    return fd.trace(case, load_factors=[0.5, 1.0])


@pytest.mark.parametrize("make", [fd.discretize, lambda p, s: fd.shell(p, s, divisions=2)])
def test_angles_families_and_data_survive_a_result(make, tmp_path):
    fd.save(fd.modes(fd.Case(make(TOLD, SHEET), HELD), count=1), tmp_path / "x.nc")
    found = fd.load(tmp_path / "x.nc")
    pattern = fd.case_of(found).structure.pattern
    np.testing.assert_array_equal(pattern.fold_angles, TOLD.fold_angles)
    assert {k: v.tolist() for k, v in pattern.families.items()} == {"zigzag": [0, 1], "a b": [3]}
    assert pattern.custom == TOLD.custom


def test_a_result_without_them_is_as_it_was(path):
    text = str(path["case"].values)
    assert "families" not in text and "fold_angles" not in text


def test_data_that_cannot_be_written_is_an_obstacle():
    pattern = MIURA.changed(custom={"a:b": object()})
    found = fd.modes(fd.Case(fd.discretize(pattern, SHEET, preset="plate"), HELD), count=1)
    assert "custom data" in found.attrs["not_rerunnable_because"]


def test_states_of_a_motion_go_to_a_file_and_back(motion, tmp_path):
    pattern, frames = frames_of(motion)
    assert len(frames) == motion.sizes["time"]
    np.testing.assert_array_equal(pattern.vertices, MIURA.vertices)
    x = motion["rest_position"].values + motion["displacement"].values
    fd.write_pattern(pattern, tmp_path / "x.fold", frames=frames)
    for k in (0, len(frames) - 1):
        found = fd.formats.diagnose(tmp_path / "x.fold", frame=k + 1).pattern
        np.testing.assert_array_equal(found.vertices, x[k, : len(pattern.vertices)])
        assert found.name == f"t = {float(motion.time[k]):.6g} s"
        assert found.assignments == pattern.assignments


def test_every_so_many_states_and_the_last(motion):
    count = motion.sizes["time"]
    titles = [frame.title for frame in frames_of(motion)[1]]
    some = [frame.title for frame in frames_of(motion, every=2)[1]]
    assert some == [titles[k] for k in sorted({*range(0, count, 2), count - 1})]
    assert [f.title for f in frames_of(motion, every=10**6)[1]] == [titles[0], titles[-1]]


def test_so_many_states_and_larger_displacements(motion):
    count = motion.sizes["time"]
    found = shapes_of(motion, frames=3, scale=2.0)
    assert found.samples.tolist() == [0, round((count - 1) / 2), count - 1]
    u = motion["displacement"].values[found.samples]
    np.testing.assert_array_equal(found.displacement, 2.0 * u)
    np.testing.assert_array_equal(found.nodes, motion["rest_position"].values)
    assert len(shapes_of(motion, frames=10**6).samples) == count
    last = state_of(motion, scale=3.0).vertices
    np.testing.assert_allclose(last, found.nodes[:9] + 3.0 * motion["displacement"].values[-1, :9])
    with pytest.raises(InputError, match="either every or frames"):
        shapes_of(motion, every=2, frames=2)
    with pytest.raises(InputError, match="frames = 1: must be a whole number, at least 2"):
        shapes_of(motion, frames=1)


def test_shapes_of_modes(motion):
    case = fd.case_of(motion)
    found = fd.modes(fd.Case(case.structure, case.supports), count=3)
    shapes = shapes_of(found, scale=0.5)
    farthest = np.linalg.norm(shapes.displacement, axis=2).max(axis=1)
    np.testing.assert_allclose(farthest, 0.5 * SWING * case.structure.pattern.size)
    assert np.diag(fd.mac(shapes.displacement, found)) == pytest.approx(1.0)
    assert shapes.titles[0] == f"mode 1: {float(found.frequency[0]):.6g} Hz"
    unstable = found.copy(deep=True)
    unstable["frequency"][0] = np.nan
    assert shapes_of(unstable).titles[0] == "mode 1: unstable"


def test_a_state_of_a_path(path):
    assert frames_of(path)[1][-1].title == "load factor 1"
    last = state_of(path)
    nodes = path["rest_position"].values + path["displacement"].values[-1]
    np.testing.assert_array_equal(last.vertices, nodes[: len(last.vertices)])
    assert last.name == "miura, load factor 1"
    np.testing.assert_array_equal(state_of(path, 0).vertices, frames_of(path)[1][0].vertices)


def test_what_has_no_states(motion):
    broken = motion.copy(deep=True)
    broken["displacement"][2:] = np.nan
    other, lost = motion.assign_attrs(foldyn_result="frf"), motion.drop_vars("displacement")
    kinds = r"result: is of kind 'frf'.*motion, a path or modes"
    for call, given, text in (
        (frames_of, (other,), kinds),
        (state_of, (other,), kinds),
        (frames_of, (motion.isel(time=slice(0)),), "has no samples"),
        (frames_of, (broken,), r"sample 2 is not finite.*isel\(time=slice\(2\)\)"),
        (frames_of, (motion, 0), "every = 0"),
        (state_of, (motion, 999), "frame = 999: the result has the samples 0 to"),
        (frames_of, (lost,), "displacement must be numbers over time, node, axis"),
    ):
        with pytest.raises(InputError, match=text):
            call(*given)
    assert len(frames_of(broken.isel(time=slice(2))).frames) == 2


CASE = """
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
preset = "plate"
[[supports]]
nodes = "xmin"
[analysis]
kind = "modes"
"""
INLINE = """
[pattern]
vertices = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
faces = [[0, 1, 4, 3], [1, 2, 5, 4]]
assignments = ["V"]
"""


def read(tmp_path, pattern):
    (tmp_path / "case.toml").write_text(pattern + CASE)
    return read_case(tmp_path / "case.toml").pattern


def test_angles_and_families_in_a_case_file(tmp_path):
    p = read(tmp_path, INLINE + "fold_angles = [120]\nfamilies = { middle = [[4, 1]] }\n")
    np.testing.assert_allclose(p.fold_angles, np.radians([120]))
    assert p.families["middle"].tolist() == [0]
    assert np.isnan(read(tmp_path, INLINE + "fold_angles = [nan]\n").fold_angles).all()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("fold_angles = 5", r"pattern\.fold_angles = 5: must be a list of angles"),
        ('fold_angles = ["5"]', r"pattern\.fold_angles = .*must be a list"),
        ("fold_angles = [1, 2]", r"pattern: fold_angles has 2 angles for 1 creases"),
        ("fold_angles = [181]", r"pattern: fold_angles: .*from -pi"),
        ("families = [1]", r"pattern\.families = .*table of lists"),
        ("families = { a = 1 }", r"pattern\.families = .*table of lists"),
        ("families = { a = [[0, 1]] }", r"pattern: families\[.a.\]: \(0, 1\) is not a crease"),
    ],
)
def test_wrong_angles_and_families_in_a_case_file(keys, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read(tmp_path, INLINE + keys + "\n")


def test_unit_scale_and_frame_in_a_case_file(tmp_path):
    flat, folded = (fd.patterns.miura(dihedral=angle) for angle in (180, 90))
    frame = fd.formats.Frame("folded", folded.vertices)
    fd.write_pattern(
        flat.changed(assignments=folded.assignments), tmp_path / "x.fold", frames=[frame]
    )
    file = '[pattern]\nfile = "x.fold"\n'
    for keys, scale in (('frame = "folded"\nunit = "mm"\n', 1e-3), ("frame = 1\nscale = 2\n", 2.0)):
        found = read(tmp_path, file + keys)
        np.testing.assert_allclose(found.vertices, scale * folded.vertices)
    for keys, text in (
        ('unit = "ell"\n', r'pattern\.file = "x\.fold": .*unit = "ell": choose'),
        ("frame = 7\n", "frame = 7: must be at most 1"),
        ('unt = "mm"\n', r"pattern\.unt"),
    ):
        with pytest.raises(InputError, match=text):
            read(tmp_path, file + keys)


def test_a_folding_is_a_result_of_a_pattern_alone(tmp_path):
    """It is stored with its pattern, and has states, but no case."""
    flat = fd.patterns.miura(dihedral=180)
    way = fd.fold(flat, fraction=0.5, steps=3).path
    fd.save(way, tmp_path / "way.nc")
    found = fd.load(tmp_path / "way.nc")
    assert found.identical(way)
    pattern, frames = frames_of(found)
    assert pattern.assignments == flat.assignments and len(frames) == 4
    np.testing.assert_array_equal(pattern.vertices, flat.vertices)
    np.testing.assert_allclose(frames[-1].vertices, way["position"].values[-1], atol=1e-15)
    assert [frame.title for frame in frames[::3]] == ["0 of the way", "1 of the way"]
    moved = flat.vertices + way["displacement"].values[2]
    np.testing.assert_array_equal(state_of(found, 2).vertices, moved)
    with pytest.raises(InputError, match="it is of a pattern alone, which has no sheet"):
        fd.case_of(found)
