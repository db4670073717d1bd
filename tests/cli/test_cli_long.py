"""`foldyn run` of motions that are cut off: --checkpoint, --resume."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT, changed
from foldyn.cli.main import main
from foldyn.dynamics import Keeping, motion

CASE = f"""{FOLD_TEXT}[model]
mass = ["centroid", "panel"]
[[supports]]
nodes = [2, 3]
[[loads]]
nodes = [0, 1]
force = [1e-5, 0, 0]
history = {{ kind = "half_sine", duration = 0.1 }}
[analysis]
kind = "dynamics"
duration = 0.1
[output]
interval = 5e-4
"""
FILES = ["result-centroid.nc", "result-panel.nc"]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the case; motions are looked after every few steps."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(motion, "CHUNK", 16)
    monkeypatch.setattr(motion, "REPORT_EVERY", 0.0)
    Path("case.toml").write_text(CASE)
    return tmp_path


def cut(monkeypatch, name: str) -> None:
    """Have Ctrl-C come after the third checkpoint of a result."""
    made, original = [], Keeping.checkpoint

    def checkpoint(self, *given):
        original(self, *given)
        made.append(self.file.name)
        if made.count(name) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(Keeping, "checkpoint", checkpoint)


def ran(*given: str) -> int:
    return main(["run", "case.toml", "--quiet", "--no-figures", *given])


@pytest.mark.matrix
def test_a_run_that_is_cut_off_goes_on(place, monkeypatch, capsys):
    assert ran("--out", "whole") == 0
    with monkeypatch.context() as patch:
        cut(patch, FILES[0])
        assert ran("--checkpoint", "1e-9") == 130
    said = capsys.readouterr().err
    assert "keeps it up to t = " in said
    assert "continue it by --resume" in said
    results = place / "case-results"
    assert (results / "result-centroid.nc.unfinished").is_dir()
    assert ran() == 2
    said = capsys.readouterr().err
    assert "keeps an interrupted motion" in said
    assert "continue it by --resume, or --replace to start again" in said
    assert ran("--resume") == 0
    assert sorted(name for name in os.listdir(results) if name[0] != ".") == FILES
    for name in FILES:
        found, wanted = fd.load(results / name), fd.load(place / "whole" / name)
        assert "stopped_because" not in found.attrs
        for variable in wanted.variables:
            np.testing.assert_array_equal(found[variable].values, wanted[variable].values)


@pytest.mark.matrix
def test_finished_results_are_not_computed_again(place, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        cut(patch, FILES[1])
        assert ran("--checkpoint", "1e-9") == 130
    first = fd.load(place / "case-results" / FILES[0]).attrs["wall_seconds"]
    assert (place / "case-results" / f"{FILES[1]}.unfinished").is_dir()
    assert main(["run", "case.toml", "--resume"]) == 0
    assert fd.load(place / "case-results" / FILES[0]).attrs["wall_seconds"] == first
    assert (place / "case-results" / "report.html").is_file()


@pytest.mark.matrix
def test_another_case_is_refused_or_replaces(place, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        cut(patch, FILES[0])
        assert ran("--checkpoint", "1e-9") == 130
    Path("case.toml").write_text(CASE.replace("thickness = 0.01", "thickness = 0.02"))
    capsys.readouterr()
    assert ran("--resume") == 2
    assert "was begun with sheet.thickness = 0.01, which is 0.02 now" in capsys.readouterr().err
    assert ran("--replace") == 0
    found = fd.load(place / "case-results" / FILES[0])
    assert fd.case_of(found).structure.sheet.thickness == 0.02
    assert not list((place / "case-results").glob("*.unfinished"))


@pytest.mark.matrix
def test_a_result_that_a_script_writes_is_refused_before_anything_runs(place, capsys):
    results = place / "case-results"
    results.mkdir()
    with Keeping(results / FILES[1]).held():
        assert ran() == 2
        said = capsys.readouterr().err
        assert f"{FILES[1]}: is being written by process {os.getpid()} on" in said
        assert not list(results.glob("*.nc"))
    assert ran() == 0
    assert sorted(path.name for path in results.glob("*.nc*")) == FILES


def test_what_has_no_checkpoints(place, capsys):
    assert ran("--resume", "--replace") == 2
    assert "leave out --replace" in capsys.readouterr().err
    assert ran("--checkpoint", "0") == 2
    assert "--checkpoint" in capsys.readouterr().err
    Path("case.toml").write_text(changed(CASE, 'loads =; output =; analysis = { kind = "modes" }'))
    assert ran("--resume") == 2
    assert "--resume: only motions have checkpoints" in capsys.readouterr().err
