"""Files that appear only when complete."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.writing import made_folder, remove_leftovers, scratch, whole, write_text

SOURCE = str(Path(fd.__file__).parents[1])


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_when_it_is_complete(tmp_path) -> None:
    file = tmp_path / "page.html"
    with whole(file) as part:
        part.write_text("new")
        assert not file.exists()
        assert part.suffix == ".html" and part.parent == tmp_path
    assert (file.read_text(), names(tmp_path)) == ("new", ["page.html"])


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt, ValueError])
def test_what_is_raised_leaves_what_was_there(tmp_path, error) -> None:
    file = tmp_path / "page.html"
    file.write_text("old")

    def fail() -> None:
        with whole(file) as part:
            part.write_text("half")
            raise error

    with pytest.raises(error):
        fail()
    assert (file.read_text(), names(tmp_path)) == ("old", ["page.html"])


def test_a_link_stays_one(tmp_path) -> None:
    (tmp_path / "true.txt").write_text("old")
    try:
        (tmp_path / "link.txt").symlink_to("true.txt")
    except OSError:
        pytest.skip("no links here")
    write_text("new", tmp_path / "link.txt")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "true.txt").read_text() == "new"


def test_names_of_any_length_and_letters_that_are_none(tmp_path) -> None:
    file = tmp_path / ("折" * 80 + ".txt")
    write_text("a\udcffb", file)
    assert file.read_text(encoding="utf-8") == "a\\udcffb"


def test_leftovers_of_the_dead_go_and_no_others(tmp_path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for name in (f".result.nc.{dead.pid}.tmp.nc", f".a.{dead.pid}.tmp", f".b.{10**30}.tmp"):
        (tmp_path / name).write_text("cut")
    (tmp_path / f".film.nc.{dead.pid}.tmp").mkdir()
    (tmp_path / f".film.nc.{dead.pid}.tmp" / "film.mkv").write_text("cut")
    others = sorted([f".c.nc.{os.getpid()}.tmp.nc", "tmp", f"{dead.pid}.tmp", ".x.tmp", "x.1.tmp"])
    for name in others:
        (tmp_path / name).write_text("mine")
    remove_leftovers(tmp_path, tmp_path / "none")
    assert names(tmp_path) == others


def test_a_scratch_folder_goes(tmp_path) -> None:
    with scratch(tmp_path, "film") as folder:
        (folder / "frame.png").write_text("x")
        assert folder.is_dir()
    assert names(tmp_path) == []


LIMITED = """
import errno, os, resource, sys
import numpy as np
import xarray as xr
from foldyn.results import netcdf

endless = resource.RLIM_INFINITY
for count in (3, 300, 30000):
    values = np.random.default_rng(0).random((count, 20, 3))
    ds = xr.Dataset({"u": (("time", "node", "axis"), values), "s": ("name", ["a", "bcd"])},
                    {"time": np.arange(count) * 1.0}, {"case": "x" * 3000})
    netcdf.write(ds, "whole.nc")
    assert netcdf.read("whole.nc", "").identical(ds)
    size = os.path.getsize("whole.nc")
    os.unlink("whole.nc")
    parts = [int(size * part) for part in (0.1, 0.3, 0.5, 0.9, 0.99)]
    for limit in [0, 1, 96, 500, 2048, 4096, 5000, *parts, size - 8, size - 1]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, endless))
        try:
            netcdf.write(ds, "cut.nc")
        except OSError as error:
            assert error.errno == errno.EFBIG, error
        else:
            sys.exit(f"{limit} of {size} bytes were enough")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (endless, endless))
        assert os.listdir() == [], os.listdir()
"""


@pytest.mark.matrix
@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_hdf5_stands_a_full_disk_wherever_it_comes(tmp_path) -> None:
    """HDF5 itself ends the process with a segmentation fault."""
    command, source = [sys.executable, "-c", LIMITED], {**os.environ, "PYTHONPATH": SOURCE}
    done = subprocess.run(command, cwd=tmp_path, env=source, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "word").write_text("taken")
    for place in ("word", "word/below"):
        with pytest.raises(InputError, match=r"folder = .*give the path of a folder"):
            made_folder(tmp_path / place)
    assert made_folder(tmp_path / "new" / "one").is_dir()
