"""Pattern files of any format: paths, endings, files that cannot be read or written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from foldyn.errors import InputError
from foldyn.formats import FORMATS, Format, read_pattern, write_pattern
from foldyn.patterns import miura, simple_fold

# ------------------------------------------------------------------------------ paths


UNKNOWN = r"known ones are .*\.fold"


@pytest.mark.parametrize(
    ("name", "reading", "writing"),
    [
        ("none/x.fold", r"x\.fold: there is no such file", r"cannot be written.*directory exists"),
        ("dir.fold", r"dir\.fold: is a directory", r"dir\.fold: is a directory"),
        ("dir", "dir: is a directory", "dir: is a directory"),
        ("x.dwg", UNKNOWN, UNKNOWN),
        ("x", UNKNOWN, UNKNOWN),
        ("x.fold.bak", UNKNOWN, UNKNOWN),
        ("a\0b.fold", "cannot be read", "cannot be written"),
        ("x" * 5000 + ".fold", "cannot be read", "cannot be written"),
    ],
)
def test_paths_that_cannot_be_used(name, reading, writing, tmp_path):
    if name.startswith("dir"):
        (tmp_path / name).mkdir()
    before = list(tmp_path.rglob("*"))
    with pytest.raises(InputError, match=reading):
        read_pattern(tmp_path / name)
    with pytest.raises(InputError, match=writing):
        write_pattern(simple_fold(), tmp_path / name)
    assert list(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("path", [None, 5, 1.5])
def test_not_a_path(path):
    with pytest.raises(InputError, match="give the path of a file"):
        read_pattern(path)


def test_write_needs_a_pattern(tmp_path):
    with pytest.raises(InputError, match="pattern: got int, give a Pattern"):
        write_pattern(5, tmp_path / "x.fold")
    assert not list(tmp_path.iterdir())


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "x.fold"
    write_pattern(simple_fold(), path)
    before = path.read_bytes()

    def full(self, content):
        with open(self, "wb") as stream:
            stream.write(content[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left on device"):
        write_pattern(miura(), path)
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["x.fold"]


def test_write_through_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    real, link = tmp_path / "real" / "x.fold", tmp_path / "link.fold"
    write_pattern(simple_fold(), real)
    link.symlink_to(real)
    write_pattern(miura(), link)
    assert link.is_symlink()
    assert read_pattern(real).name == "miura"


def test_one_way_formats(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, ".one", Format("One", (".one",)))
    with pytest.raises(InputError, match="One files can be written but not read"):
        read_pattern(tmp_path / "x.one")
    with pytest.raises(InputError, match="One files can be read but not written"):
        write_pattern(simple_fold(), tmp_path / "x.one")


@pytest.mark.matrix
def test_libraries_of_drawings_are_loaded_where_they_are_needed(tmp_path):
    """Meshes are read without them, and nothing of them is loaded at the start of the command."""
    simple = tmp_path / "x.fold"
    write_pattern(simple_fold(), simple)
    code = (
        f"import sys, foldyn as fd, foldyn.cli.main; fd.read_pattern({str(simple)!r})\n"
        "drawings = {'shapely', 'svgelements', 'defusedxml', 'ezdxf'}\n"
        "assert not drawings & set(sys.modules), drawings & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
