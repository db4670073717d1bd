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


@pytest.mark.parametrize("name", ["missing.fold", "nowhere/missing.fold"])
def test_missing_file(name, tmp_path):
    with pytest.raises(InputError, match=r"missing\.fold: there is no such file"):
        read_pattern(tmp_path / name)


@pytest.mark.parametrize("name", ["dir.fold", "plain"])
def test_directory(name, tmp_path):
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"{name}: is a directory"):
        read_pattern(tmp_path / name)
    with pytest.raises(InputError, match=f"{name}: is a directory"):
        write_pattern(tmp_path / name, simple_fold())
    assert not list((tmp_path / name).iterdir())


@pytest.mark.parametrize("name", ["x.dwg", "x", "x.fold.bak"])
def test_unknown_extension(name, tmp_path):
    path = tmp_path / name
    with pytest.raises(InputError, match=r"known ones are .*\.fold"):
        read_pattern(path)
    with pytest.raises(InputError, match=r"known ones are .*\.fold"):
        write_pattern(path, simple_fold())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", [None, 5, 1.5])
def test_not_a_path(path):
    with pytest.raises(InputError, match="give the path of a file"):
        read_pattern(path)


@pytest.mark.parametrize("name", ["a\0b.fold", "x" * 5000 + ".fold"])
def test_impossible_name(name, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_pattern(tmp_path / name)
    with pytest.raises(InputError, match="cannot be written"):
        write_pattern(tmp_path / name, simple_fold())


def test_write_into_missing_directory(tmp_path):
    with pytest.raises(InputError, match=r"x\.fold: cannot be written.*directory exists"):
        write_pattern(tmp_path / "nowhere" / "x.fold", simple_fold())
    assert not list(tmp_path.iterdir())


def test_write_needs_a_pattern(tmp_path):
    with pytest.raises(InputError, match="pattern: got int, give a Pattern"):
        write_pattern(tmp_path / "x.fold", 5)
    assert not list(tmp_path.iterdir())


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "x.fold"
    write_pattern(path, simple_fold())
    before = path.read_bytes()

    def full(self, content):
        with open(self, "wb") as stream:
            stream.write(content[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left on device"):
        write_pattern(path, miura())
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["x.fold"]


def test_write_through_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    real, link = tmp_path / "real" / "x.fold", tmp_path / "link.fold"
    write_pattern(real, simple_fold())
    link.symlink_to(real)
    write_pattern(link, miura())
    assert link.is_symlink()
    assert read_pattern(real).name == "miura"


def test_one_way_formats(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, ".one", Format("One", (".one",)))
    with pytest.raises(InputError, match="One files can be written but not read"):
        read_pattern(tmp_path / "x.one")
    with pytest.raises(InputError, match="One files can be read but not written"):
        write_pattern(tmp_path / "x.one", simple_fold())


def test_libraries_of_drawings_are_loaded_where_they_are_needed(tmp_path):
    """Meshes are read without them, and nothing of them is loaded at the start of the command."""
    simple = tmp_path / "x.fold"
    write_pattern(simple, simple_fold())
    code = (
        f"import sys, foldyn as fd, foldyn.cli.main; fd.read_pattern({str(simple)!r})\n"
        "drawings = {'shapely', 'svgelements', 'defusedxml', 'ezdxf'}\n"
        "assert not drawings & set(sys.modules), drawings & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
