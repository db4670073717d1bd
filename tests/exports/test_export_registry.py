"""`export`: which format it chooses, what it refuses, and that each format is documented."""

from __future__ import annotations

from pathlib import Path

import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.exports import EXPORTS
from foldyn.exports.registry import BY_SUFFIX
from foldyn.results.netcdf import OTHERS

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_each_format_has_its_row_in_the_documentation():
    rows = (DOCS / "exports.md").read_text("utf-8")
    for name, each in EXPORTS.items():
        assert f"| `{name}` |" in rows
        assert all(f"`{option}`" in rows for option in each.options)
        assert all(f"`{suffix}`" in rows for suffix in each.suffixes)


def test_no_suffix_has_two_formats_and_none_is_taken_for_a_result():
    assert len(BY_SUFFIX) == sum(len(each.suffixes) for each in EXPORTS.values())
    assert set(BY_SUFFIX) <= set(OTHERS)


@pytest.mark.matrix
def test_a_file_is_exported_as_the_result_in_it(motion, tmp_path):
    fd.save(motion, tmp_path / "run.nc")
    (one,) = fd.export(tmp_path / "run.nc", tmp_path / "one.glb")
    (two,) = fd.export(motion, tmp_path / "two.x", format="glb", every=None)
    assert one.read_bytes() == two.read_bytes()
    assert one == tmp_path / "one.glb" and two == tmp_path / "two.x"


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.xyz", {}, r"a\.xyz: has the unknown extension '\.xyz'; results go to \.\w+, "),
        ("a.vtu", {}, r"'\.vtu'; write a\.vtkhdf: all samples and fields, for ParaView; results"),
        ("a.VTK", {}, r"write a\.vtkhdf: "),
        ("a", {}, r"a: has no extension; results go to"),
        ("a.glb", {"format": "gltf"}, r"format = \"gltf\": .*choose one of"),
        ("a.glb", {"frame": 1}, r"frame: not an option of the format glb; did you mean 'frames'"),
        ("none/a.glb", {}, r"the folder \S*none does not exist; make it first"),
        (".", {}, r": is a folder; name a file in it"),
    ],
)
def test_what_is_refused(name, options, message, motion, tmp_path):
    with pytest.raises(InputError, match=message):
        fd.export(motion, tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


def test_a_result_is_needed_of_a_kind_that_the_format_holds(motion, tmp_path):
    with pytest.raises(InputError, match="result: is not a Foldyn result"):
        fd.export(motion.drop_attrs(), tmp_path / "a.glb")
    with pytest.raises(InputError, match=r"result: is of kind 'fidelity'.* glb does not hold"):
        fd.export(motion.assign_attrs(foldyn_result="fidelity"), tmp_path / "a.glb")
    with pytest.raises(InputError, match=r"path = 3: give the path of a file"):
        fd.export(motion, 3)
    with pytest.raises(InputError, match=r"result = 3: give the path of a file"):
        fd.export(3, tmp_path / "a.glb")
    with pytest.raises(InputError, match=r"none\.nc: there is no such file"):
        fd.export(tmp_path / "none.nc", tmp_path / "a.glb")


def test_a_result_that_cannot_be_run_again(motion, tmp_path):
    """Formats that need its case say so; patterns do not."""
    alone = motion.assign_attrs(rerunnable=0, not_rerunnable_because="a law of its own")
    with pytest.raises(InputError, match="cannot be run again from itself: a law of its own"):
        fd.export(alone, tmp_path / "a.glb")
    assert fd.export(alone, tmp_path / "a.fold") == [tmp_path / "a.fold"]
