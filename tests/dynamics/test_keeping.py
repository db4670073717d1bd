"""What is kept of a motion: nothing that counts changes unnoticed, and one process keeps it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from foldyn.dynamics import Keeping
from foldyn.dynamics.checkpoint import CHECKPOINT
from foldyn.errors import ComputationError, InputError
from foldyn.results import columns

ABOUT = {"method": "rk4"}
ROWS = {"time": (), "displacement": (9, 3), "memory": (0, 4)}


def some(count: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(count)
    return {name: random.random((count, *row)) for name, row in ROWS.items()}


def kept(file: Path, resume: bool = False) -> Keeping:
    """How a motion is kept, with the samples of its checkpoint and others behind them."""
    keeping = Keeping(file, resume=resume)
    keeping.begin(ABOUT, ROWS)
    keeping.append(some(7))
    keeping.append(some(4))
    keeping.checkpoint({"speed": np.arange(9.0)}, 0.5)
    keeping.append(some(2))
    return keeping


def resumed(file: Path) -> Keeping:
    keeping = Keeping(file, resume=True)
    keeping.begin(ABOUT, ROWS)
    return keeping


def full(*_):
    raise OSError(28, "No space left on device")


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "run.nc"


def test_every_changed_byte_that_counts_shows(file, monkeypatch):
    monkeypatch.setattr(columns, "SUMMED", 500)
    folder, random = kept(file).folder, np.random.default_rng(0)
    counted = {"time.f8": 8 * 11, "displacement.f8": 8 * 27 * 11}
    sound = {path: path.read_bytes() for path in folder.iterdir()}
    counted[CHECKPOINT] = len(sound[folder / CHECKPOINT])
    for name, size in counted.items():
        path = folder / name
        for at in (0, size - 1, *random.integers(0, size, 70)):
            changed = bytearray(sound[path])
            changed[at] ^= 1 << int(random.integers(8))
            path.write_bytes(changed)
            with pytest.raises(InputError, match=f"{path}: is damaged"):
                resumed(file)
        path.write_bytes(sound[path])
    for name in counted:  # what does not count is cut off
        if name != CHECKPOINT:
            (folder / name).write_bytes(sound[folder / name][:-4] + b"else")
    again = resumed(file)
    assert again.columns.count == 11
    np.testing.assert_array_equal(again.columns["displacement"][7:], some(4)["displacement"])


def test_checksums_go_on_and_follow_what_is_cut(file, monkeypatch):
    kept(file)
    again = resumed(file)
    again.append(some(3))
    again.checkpoint({}, 0.6)
    assert resumed(file).columns.damaged() is None
    again.columns.cut(9)  # as a motion that fails is cut, whose result may find no room
    assert resumed(file).columns.count == 14
    again.append(some(1))
    assert again.columns.damaged() is None
    with monkeypatch.context() as patch:
        patch.setattr("zlib.crc32", full)  # when a column is written and others are not
        with pytest.raises(ComputationError):
            again.append(some(5))
    assert again.columns.count == 10
    assert again.columns.damaged() is None


def test_samples_are_summed_once(file, monkeypatch):
    """A checkpoint reads nothing again."""
    keeping = kept(file)
    read = []
    monkeypatch.setattr(columns.Columns, "_sum", lambda *_: read.append(1))
    keeping.append(some(5))
    keeping.checkpoint({}, 1.0)
    assert not read


def test_what_was_changed_meanwhile_is_not_taken_for_a_result(file):
    keeping = kept(file)
    keeping.check()
    for harm in (lambda path: os.truncate(path, 40), Path.unlink):
        harm(keeping.folder / "time.f8")
        with pytest.raises(ComputationError, match=r"time\.f8: was changed.*keeps it up to t"):
            keeping.check()


def test_only_a_full_disk_needs_room(file):
    keeping = kept(file)
    shutil.rmtree(keeping.folder)
    with pytest.raises(ComputationError, match=r"No such file.*: see that nothing else moves"):
        keeping.append(some(1))


HOLD = """
import sys
from pathlib import Path
from foldyn.lock import locked
with locked(Path(sys.argv[1])):
    print(flush=True)
    sys.stdin.read()
"""


def test_the_process_that_writes_is_named(file):
    command = [sys.executable, "-c", HOLD, str(file.with_name(".run.nc.lock"))]
    other = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    other.stdout.readline()
    said = rf"run\.nc: is being written by process {other.pid} on .*; wait until it ends, or name"
    with pytest.raises(InputError, match=said), Keeping(file).held():
        pass
    other.kill()  # the system lifts the lock
    other.communicate()
    with Keeping(file).held():
        with pytest.raises(InputError, match=rf"process {os.getpid()} on"), Keeping(file).held():
            pass
        with Keeping(file.with_name("other.nc")).held():
            pass
    assert not list(file.parent.iterdir())


def test_a_place_that_cannot_be_written_is_refused_at_once(file):
    file.with_name(".run.nc.lock").mkdir()
    said = r"run\.nc: cannot be written \(.*choose another folder"
    with pytest.raises(InputError, match=said), Keeping(file).held():
        pass
