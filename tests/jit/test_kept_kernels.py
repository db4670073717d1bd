"""Where compiled kernels are kept, and what becomes of damaged ones."""

from __future__ import annotations

import errno
import importlib.util
import itertools
import os
import pickle
import stat
from collections import namedtuple
from pathlib import Path

import pytest
from jit_lab import ASK, ask, copy_package, python

from foldyn.errors import FoldynWarning
from foldyn.jit import kernel_cache, sources
from foldyn.jit.compiled import kernel, ready
from foldyn.jit.kernel_cache import REMEDY, folder_for

posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="folders have owners on POSIX only")
_numbers = itertools.count()


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """Makes kernels from text, as importing a module in a folder of its own does."""
    monkeypatch.setattr(kernel_cache.config, "CACHE_DIR", "")
    path = tmp_path / "double.py"

    def make(text: str = "return 2.0 * x"):
        path.write_text(f"def double(x):\n    {text}\n", "utf-8")
        for cached in vars(sources).values():
            if hasattr(cached, "cache_clear"):
                cached.cache_clear()
        spec = importlib.util.spec_from_file_location(f"double{next(_numbers)}", path)
        module = importlib.util.module_from_spec(spec)
        exec(compile(path.read_text("utf-8"), str(path), "exec"), module.__dict__)
        return kernel(module.double)

    return make


def files(function) -> list[Path]:
    return sorted(Path(function.stats.cache_path).glob("*.nbc"))


def test_kernels_are_found_again(kernels):
    first = kernels()
    assert not ready(first)
    assert (first(1.5), sum(first.stats.cache_misses.values())) == (3.0, 1)
    assert ready(first)
    again = kernels()
    assert (again(1.5), sum(again.stats.cache_hits.values())) == (3.0, 1)
    assert files(first) == files(again)
    again._cache.flush()
    assert not ready(again)


DAMAGE = {
    "empty": lambda whole: b"",
    "short": lambda whole: whole[:100],
    "one byte short": lambda whole: whole[:-1],
    "one bit": lambda whole: whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:],
    "garbage": lambda whole: b"no pickle at all" * 1000,
    "another pickle": lambda whole: pickle.dumps(("another", "pickle")),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_files_are_compiled_anew(kernels, damage):
    first = kernels()
    first(1.5)
    (file,) = files(first)
    file.write_bytes(DAMAGE[damage](file.read_bytes()))
    again = kernels()
    assert again(1.5) == 3.0
    assert not again.stats.cache_hits
    assert files(again) == [file]
    whole = kernels()
    assert (whole(1.5), sum(whole.stats.cache_hits.values())) == (3.0, 1)


@pytest.mark.matrix
def test_only_the_last_versions_stay(kernels):
    for turn in range(kernel_cache.OTHERS + 3):
        function = kernels(f"return {turn}.0 * x")
        assert function(1.0) == turn
        for age, path in enumerate(sorted(files(function), key=os.path.getmtime, reverse=True)):
            os.utime(path, (1e9 - age, 1e9 - age))
    assert len(files(function)) == kernel_cache.OTHERS + 1
    assert ready(function)


def test_fields_of_named_tuples_count(kernels):
    one, other = namedtuple("Pair", "a b"), namedtuple("Pair", "b a")
    function = kernels("return x.a - x.b")
    assert function(one(3.0, 1.0)) == 2.0
    assert kernels("return x.a - x.b")(other(3.0, 1.0)) == -2.0


def test_fields_of_named_tuples_within_tuples_count(kernels):
    one, other = namedtuple("Pair", "a b"), namedtuple("Pair", "b a")
    assert kernels("return x[1].a - x[1].b")((1.0, one(3.0, 1.0))) == 2.0
    assert kernels("return x[1].a - x[1].b")((1.0, other(3.0, 1.0))) == -2.0


def test_a_full_disk_is_told_and_does_no_harm(kernels, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    kernel_cache._warn.cache_clear()
    monkeypatch.setattr(kernel_cache.os, "replace", full)
    function = kernels()
    with pytest.warns(FoldynWarning, match="No space left on device; set NUMBA_CACHE_DIR"):
        assert function(1.5) == 3.0
    assert list(Path(function.stats.cache_path).iterdir()) == []


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """A place for sources, one for NUMBA_CACHE_DIR, a home, and one for temporary files."""
    found = {name: tmp_path / name for name in ("sources", "named", "home", "temporary")}
    for path in found.values():
        path.mkdir()
    monkeypatch.setattr(kernel_cache.config, "CACHE_DIR", str(found["named"]))
    monkeypatch.setenv("XDG_CACHE_HOME", str(found["home"]))
    monkeypatch.setattr(kernel_cache.AppDirs, "user_cache_dir", str(found["home"]))
    monkeypatch.setattr(kernel_cache.tempfile, "tempdir", str(found["temporary"]))
    forget()
    yield found
    forget()


def forget() -> None:
    """As a new process knows nothing."""
    for cached in (folder_for, kernel_cache._warn, kernel_cache._private):
        cached.cache_clear()


def spoil(path: Path) -> None:
    """Put a file where a folder would be written: that stops every user, even root."""
    path.rmdir()
    path.touch()


def test_the_first_folder_that_can_be_written(folders, recwarn):
    sources = folders["sources"]
    assert folder_for(sources).parent == folders["named"]
    kernel_cache.config.CACHE_DIR = ""
    forget()
    assert folder_for(sources) == sources / "__pycache__"
    spoil(sources / "__pycache__")
    forget()
    assert folder_for(sources).parent == folders["home"]
    assert not recwarn.list


def test_a_named_folder_that_cannot_be_written_is_told(folders):
    spoil(folders["named"])
    with pytest.warns(FoldynWarning, match=f"NUMBA_CACHE_DIR = .*named.*{REMEDY}"):
        assert folder_for(folders["sources"]) == folders["sources"] / "__pycache__"


def nothing_but_temporary(folders) -> None:
    spoil(folders["named"])
    spoil(folders["home"])
    (folders["sources"] / "__pycache__").touch()


@posix
def test_a_folder_for_temporary_files_is_the_users_alone(folders):
    nothing_but_temporary(folders)
    with pytest.warns(FoldynWarning, match=f"temporary.*{REMEDY}"):
        found = folder_for(folders["sources"])
    assert found.parent.parent == folders["temporary"]
    assert stat.S_IMODE(found.parent.stat().st_mode) == 0o700
    forget()
    with pytest.warns(FoldynWarning):
        assert folder_for(folders["sources"]) == found  # the next process finds it again


@posix
@pytest.mark.parametrize("trap", ["open to others", "a link", "a file", "of another user"])
def test_a_folder_that_others_may_have_filled_is_not_taken(folders, trap, monkeypatch):
    nothing_but_temporary(folders)
    usual = folders["temporary"] / f"foldyn-{os.getuid()}"
    if trap == "a link":
        (folders["temporary"] / "theirs").mkdir(mode=0o700)
        usual.symlink_to("theirs")
    elif trap == "a file":
        usual.touch()
    else:
        usual.mkdir(mode=0o700)
        usual.chmod(0o755 if trap == "open to others" else 0o700)
    if trap == "of another user":
        me = os.getuid()
        answers = itertools.chain([me], itertools.repeat(me + 1))
        monkeypatch.setattr(kernel_cache.os, "getuid", lambda: next(answers))
    with pytest.warns(FoldynWarning, match=REMEDY):
        found = folder_for(folders["sources"])
    assert not found.is_relative_to(usual)
    assert stat.S_IMODE(found.parent.stat().st_mode) == 0o700


def test_nowhere_to_keep_kernels(folders, kernels, monkeypatch):
    nothing_but_temporary(folders)
    spoil(folders["temporary"])
    with pytest.warns(FoldynWarning, match=f"anywhere: each start compiles anew; {REMEDY}"):
        assert folder_for(folders["sources"]) is None
    monkeypatch.setattr(kernel_cache, "folder_for", lambda source: None)
    function = kernels()
    assert function(1.5) == 3.0
    assert not ready(function) and function.stats.cache_path is None


@pytest.mark.matrix
def test_a_package_and_a_home_that_cannot_be_written(tmp_path):
    package = copy_package(tmp_path)
    for folder in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        (folder / "__pycache__").touch()
    (tmp_path / "temporary").mkdir()
    nowhere = str(package / "__init__.py" / "home")  # below a file nobody makes a folder
    where = {"HOME": nowhere, "XDG_CACHE_HOME": nowhere, "LOCALAPPDATA": nowhere}
    where |= {name: str(tmp_path / "temporary") for name in ("TMPDIR", "TEMP")}
    assert ask(package, **where) == (1.0, 1.0, 0)
    again = python(package, ASK, **where)
    assert again.stdout.split() == ["1.0", "1.0", "1"]
    assert again.stderr.count("FoldynWarning") == 1 and "set NUMBA_CACHE_DIR" in again.stderr
    assert "Traceback" not in again.stderr
