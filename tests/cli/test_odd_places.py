"""Streams that are closed, full or short of letters, and names, folders and variables that are odd.

Each ends with a sensible status and no traceback; what was computed is there.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from processes import ended, start

import foldyn as fd
from foldyn.cli.main import main

pytestmark = pytest.mark.skipif(os.name != "posix", reason="streams and names of POSIX")
ODD = b"f\xffall"
ODD_TITLE = 'output.interval = 0.02; title = "F\u00e4lle \u6298 $x^{$"'


def result_of(folder: bytes) -> int:
    """Number of samples of the result in a folder."""
    return fd.load(Path(os.fsdecode(folder)) / "result.nc").sizes["time"]


def close_streams() -> None:
    for number in (0, 1, 2):
        os.close(number)


@pytest.mark.matrix
def test_all_that_is_odd_at_once(tmp_path, edited) -> None:
    """Letters that the terminal lacks, names that are no UTF-8, no HOME, a backend that is none."""
    file = os.fsencode(tmp_path) + b"/" + ODD + b".toml"
    Path(os.fsdecode(file)).write_text(edited(ODD_TITLE), encoding="utf-8")
    odd = {"PYTHONIOENCODING": "ascii", "HOME": None, "MPLBACKEND": "bogus", "TMPDIR": "/nowhere"}
    odd |= {"LC_ALL": "xx_YY.none", "PYTHONUTF8": "0", "MPLCONFIGDIR": "/proc/none"}
    command = ("run", ODD + b".toml", "--out", b"o/" + ODD, "--figures", "png")
    status, out, err = ended(start(tmp_path, *command, changes=odd))
    assert status == 0, err
    assert "F\\xe4lle \\u6298 $x^{$: 13 nodes" in out
    assert "wrote o/f\\udcffall/result.nc\n" in out
    assert "wrote figures and o/f\\udcffall/report.html" in out
    folder = os.fsencode(tmp_path) + b"/o/" + ODD
    assert result_of(folder) == 6
    assert os.path.exists(folder + b"/motion.png")


@pytest.mark.matrix
def test_streams_that_are_closed_or_full(tmp_path, miura) -> None:
    (tmp_path / "case.toml").write_text(miura)
    run = ("run", "case.toml", "--no-figures", "--out")
    nowhere = {"stdin": None, "stdout": None, "stderr": None}
    closed = start(tmp_path, *run, "closed", preexec_fn=close_streams, **nowhere)
    with open("/dev/full", "w") as full:
        lost = start(tmp_path, *run, "lost", stdout=full)
    assert ended(closed)[0] == 0
    assert result_of(os.fsencode(tmp_path / "closed")) == 11
    status, _, err = ended(lost)
    assert status == 1  # the result is there, what was said is not
    assert err == "foldyn: cannot write to standard output: No space left on device\n"
    assert result_of(os.fsencode(tmp_path / "lost")) == 11


@pytest.mark.matrix
def test_a_working_folder_that_is_gone(tmp_path, miura, monkeypatch, capsys) -> None:
    (tmp_path / "case.toml").write_text(miura)
    gone = tmp_path / "gone"

    def leave() -> None:
        gone.mkdir(exist_ok=True)
        os.chdir(gone)
        shutil.rmtree(gone)

    case, out = str(tmp_path / "case.toml"), str(tmp_path / "r")
    there = start(tmp_path, "run", case, "--no-figures", "--out", out, preexec_fn=leave)
    status, _, err = ended(there)
    assert (status, err) == (0, "")
    assert result_of(os.fsencode(out)) == 11
    monkeypatch.chdir(tmp_path)  # and back at the end
    leave()
    assert main(["run", case, "--no-figures"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("foldyn: results folder case-results: cannot be written (No such file")
