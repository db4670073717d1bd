"""Sweeps that are killed and go on: every point once, the same as without."""

from __future__ import annotations

import random
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from processes import children, running, start, wait_for

import foldyn as fd
from case_texts import MODES_TEXT
from foldyn.cli.main import main

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

MEASURE = """
import time

def slow(result, case):
    time.sleep({seconds})
    return result["frequency"].values
"""


def kept(folder: Path) -> dict[str, tuple[int, int]]:
    """Whole files, each with what changes if it is written again."""
    found = folder.glob("*.npz") if folder.is_dir() else ()
    return {
        one.name: (one.stat().st_ino, one.stat().st_mtime_ns)
        for one in found
        if not one.name.startswith(".")
    }


@pytest.mark.matrix
def test_a_sweep_that_is_killed_goes_on(tmp_path, monkeypatch):
    """Killed at a random moment after the first points were kept."""
    count, seconds = 10, 0.1
    (tmp_path / "case.toml").write_text(MODES_TEXT)
    (tmp_path / "mine.py").write_text(MEASURE.format(seconds=seconds))
    vary = f"sheet.thickness=0.005:0.02:{count}"
    command = ("sweep", "case.toml", "--vary", vary, "--measure", "mine.py:slow")
    command = (*command, "--measure", "frequencies", "--no-figures", "--processes")
    points = tmp_path / "case-sweep" / "points"
    one = start(tmp_path, *command, "2")
    wait_for(lambda: kept(points) or one.poll() is not None)
    time.sleep(seconds * random.Random(0).uniform(0.0, 0.3 * count))
    workers = children(one.pid)
    one.send_signal(signal.SIGKILL)
    one.communicate(timeout=30)
    wait_for(lambda: not any(map(running, workers)), 10.0)
    before = kept(points)
    assert 0 < len(before) < count
    monkeypatch.chdir(tmp_path)
    assert main([*command, "1"]) == 0
    assert kept(points).items() >= before.items()  # nothing lost, nothing computed again
    assert len(kept(points)) == count
    assert not [one for one in points.iterdir() if one.suffix != ".npz"]
    found = fd.load(tmp_path / "case-sweep" / "sweep.nc")
    thickness = np.linspace(0.005, 0.02, count)
    alone = fd.sweep(tmp_path / "case.toml", {"sheet.thickness": thickness},
    measures=["frequencies"],
                     processes=1)  # fmt: skip
    np.testing.assert_array_equal(found["thickness"], alone["thickness"])
    np.testing.assert_array_equal(found["frequencies"], alone["frequencies"])
    np.testing.assert_array_equal(found["slow"], alone["frequencies"])
    assert found.attrs["failed"] == 0


DEADLY = """
import os, signal
from pathlib import Path

def deadly(result, case):
    if case.structure.sheet.thickness > 0.019:
        os.kill(os.getpid(), signal.SIGKILL)
    return 1.0
"""


@pytest.mark.matrix
def test_a_point_that_ends_its_process_does_not_stop_the_rest(tmp_path, monkeypatch, capsys):
    (tmp_path / "case.toml").write_text(MODES_TEXT)
    (tmp_path / "mine.py").write_text(DEADLY)
    command = ("sweep", "case.toml", "--vary", "sheet.thickness=0.005:0.02:6")
    monkeypatch.chdir(tmp_path)
    assert main([*command, "--measure", "mine.py:deadly", "--processes", "2"]) == 0
    assert "values are missing at 1 of 6 points" in capsys.readouterr().out
    found = fd.load(tmp_path / "case-sweep" / "sweep.nc")
    np.testing.assert_array_equal(found["deadly"], [1.0, 1.0, 1.0, 1.0, 1.0, np.nan])
    assert "ended from outside" in str(found["failure"].values[-1])
    assert len(kept(tmp_path / "case-sweep" / "points")) == 5  # it is tried again next time
