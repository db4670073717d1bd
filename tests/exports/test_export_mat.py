"""MAT files: what SciPy reads of them, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import loadmat
from small_results import modes, motion, path, response

import foldyn as fd
from foldyn.errors import InputError
from foldyn.exports import mat


def read(result, folder, **options):
    (file,) = fd.export(result, folder / "a.mat", **options)
    return loadmat(file, simplify_cells=True)


def test_a_motion_comes_back(tmp_path):
    found = read(motion(), tmp_path)
    for name in ("displacement", "velocity", "reaction", "kinetic", "time", "rest_position"):
        np.testing.assert_array_equal(found[name], motion()[name])
    assert found["units"]["velocity"] == "m/s"
    assert found["labels"]["kinetic"] == "kinetic energy"
    assert found["attributes"]["foldyn_result"] == "trajectory"
    assert found["attributes"]["dt"] == motion().attrs["dt"]
    assert "[sheet]" in found["case_file"]
    assert found["axis"].tolist() == ["x", "y", "z"]


def test_numbers_count_from_one(tmp_path):
    found = read(motion(), tmp_path)
    np.testing.assert_array_equal(found["node"], motion().node + 1)
    np.testing.assert_array_equal(found["support_node"], motion().support_node + 1)
    np.testing.assert_array_equal(found["faces"], [[1, 3, 4, 2], [3, 5, 6, 4]])
    np.testing.assert_array_equal(found["creases"], [3, 4])
    assert found["assignments"] == "M"


def test_vectors_are_columns_and_panels_of_other_sizes_are_filled_up(tmp_path):
    (file,) = fd.export(motion(), tmp_path / "a.mat")
    assert loadmat(file)["time"].shape == (6, 1)
    faces = mat._faces([(0, 1, 2), (2, 1, 3, 4, 5)])
    np.testing.assert_array_equal(faces, [[1, 2, 3, np.nan, np.nan], [3, 2, 4, 5, 6]])


def test_responses_stay_complex(tmp_path):
    found = read(response(), tmp_path)
    np.testing.assert_array_equal(found["receptance"], response().receptance)
    assert np.iscomplexobj(found["receptance"])


def test_other_kinds(tmp_path):
    np.testing.assert_array_equal(read(modes(), tmp_path)["shape"], modes()["shape"])
    found = read(path(), tmp_path)
    np.testing.assert_array_equal(found["load_factor"], path().load_factor)
    assert found["point"].tolist() == path().point.values.tolist()


def test_some_samples_and_fields(tmp_path):
    found = read(motion(), tmp_path, every=2, fields=["velocity"])
    np.testing.assert_array_equal(found["velocity"], motion().velocity.values[[0, 2, 4, 5]])
    np.testing.assert_array_equal(found["time"], motion().time[[0, 2, 4, 5]])
    assert "displacement" not in found


@pytest.mark.parametrize(
    ("name", "valid"),
    [("end", "x_end"), ("_own", "x__own"), ("höhe", "h_he"), ("tip", "tip"), ("f" * 70, "f" * 63)],
)
def test_names_are_valid_in_matlab(tmp_path, name, valid):
    more = motion().assign({name: ("time", np.arange(6.0))})
    np.testing.assert_array_equal(read(more, tmp_path)[valid], np.arange(6.0))


def test_names_that_become_alike_stay_apart():
    assert list(mat._named({"hö": 1, "hü": 2, "h_": 3})) == ["h_", "h__2", "h__3"]


@pytest.mark.parametrize(
    ("options", "message"),
    [({"fields": "speed"}, "fields = .speed.: .*choose one of"), ({"every": -1}, "every")],
)
def test_wrong_options(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        fd.export(motion(), tmp_path / "a.mat", **options)


def test_what_is_larger_than_the_format_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(mat, "MOST", 1000)
    with pytest.raises(InputError, match=r"displacement has .* GiB, .*every = 10"):
        fd.export(motion(), tmp_path / "a.mat")
    assert not list(tmp_path.iterdir())
    fd.export(motion(), tmp_path / "a.mat", every=5)
