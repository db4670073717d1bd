"""A folder of results belongs to one command on one file, and to one run at a time."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest

import foldyn as fd
from foldyn.cli.folder import LOCK, STAMP
from foldyn.cli.main import main
from foldyn.dynamics import Motion
from foldyn.lock import locked

RULES = 'model.mass = ["panel", "centroid"]'
OLD = ("case-results/result-panel.nc", "case-results/result-centroid.nc")


def stamped(folder: str = "case-results") -> dict:
    return json.loads(Path(folder, STAMP).read_text())


@pytest.mark.matrix
def test_the_stamp_says_what_the_folder_is_of(workplace, edited) -> None:
    assert workplace.run(edited(RULES)).status == 0
    told = stamped()
    assert (told["command"], told["source"], told["state"]) == ("run", "../case.toml", "complete")
    assert told["results"] == ["result-panel.nc", "result-centroid.nc"]
    assert told["outdated"] == []
    assert told["foldyn_version"] == fd.__version__


@pytest.mark.matrix
def test_results_of_rules_that_are_no_longer_asked_for_go(workplace, edited, miura) -> None:
    workplace.run(edited(RULES))
    workplace.write(miura)
    assert main(["run", "case.toml", "--no-figures"]) == 0
    names = {path.name for path in Path("case-results").iterdir()}
    assert names == {STAMP, "result.nc"}


@pytest.mark.matrix
def test_an_interruption_leaves_old_or_new_and_no_mixture(workplace, edited, monkeypatch) -> None:
    workplace.run(edited(RULES))
    before = {name: Path(name).read_bytes() for name in OLD}
    run = Motion.run

    def stopped_at(rule):
        def interrupted(self, progress=None, keeping=None):
            if self.case.structure.options.mass == rule:
                raise KeyboardInterrupt
            return run(self, progress, keeping)

        return interrupted

    workplace.write(edited(f"{RULES}; analysis.duration = 0.2"))
    monkeypatch.setattr(Motion, "run", stopped_at("panel"))  # the first one: nothing new yet
    assert main(["run", "case.toml", "--no-figures"]) == 130
    assert {name: Path(name).read_bytes() for name in OLD} == before
    assert stamped()["state"] == "complete"
    monkeypatch.setattr(Motion, "run", stopped_at("centroid"))
    assert main(["run", "case.toml", "--no-figures"]) == 130
    assert fd.load(OLD[0]).sizes["time"] == 21
    assert not Path(OLD[1]).exists()
    assert (stamped()["state"], stamped()["results"]) == ("stopped", ["result-panel.nc"])


@pytest.mark.matrix
def test_others_are_refused_by_name(workplace, miura) -> None:
    workplace.write(miura)
    workplace.write(miura, "other.toml")
    assert workplace.call("run", "case.toml", "--no-figures", "--out", "r").status == 0
    for command in (["run", "other.toml"], ["modes", "case.toml"]):
        assert workplace.refused(*command, "--no-figures", "--out", "r") == (
            "--out r: holds the results of foldyn run case.toml; name another folder, or "
            "replace them with --replace"
        )
    assert main(["modes", "case.toml", "--no-figures", "--out", "r", "--replace"]) == 0
    assert "frequency" in fd.load("r/result.nc")
    assert (stamped("r")["command"], stamped("r")["state"]) == ("modes", "complete")
    Path("r/result.nc").unlink()  # then nothing is lost
    assert workplace.call("run", "other.toml", "--no-figures", "--out", "r").status == 0


def test_what_fails_before_its_first_result_leaves_the_others(
    workplace, miura, monkeypatch
) -> None:
    workplace.write(miura)
    workplace.write(miura, "other.toml")
    assert workplace.call("run", "case.toml", "--no-figures", "--out", "r").status == 0
    old = stamped("r")

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("foldyn.results.save", full)
    failed = workplace.call("run", "other.toml", "--no-figures", "--out", "r", "--replace")
    assert (failed.status, failed.new) == (1, [])
    assert stamped("r") == old


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[1]", b'{"command": 1}', b"\xff" * 9, b"[" * 9999]
)
def test_a_damaged_stamp_is_none(workplace, miura, content) -> None:
    Path("case-results").mkdir()
    Path("case-results", STAMP).write_bytes(content)
    assert workplace.run(miura).status == 0
    assert stamped()["state"] == "complete"


def test_a_stamp_does_not_reach_beyond_its_folder(workplace, miura) -> None:
    workplace.write("mine", "notes.txt")
    Path("case-results").mkdir()
    told = {"command": "run", "source": "../case.toml", "state": "complete"}
    told |= {"results": ["../notes.txt"], "outdated": []}
    Path("case-results", STAMP).write_text(json.dumps(told))
    assert workplace.run(miura).status == 0
    assert Path("notes.txt").read_text() == "mine"


@pytest.mark.matrix
def test_results_without_a_stamp_that_would_stay_beside_new_ones(workplace, edited, miura) -> None:
    workplace.run(edited(RULES))
    Path("case-results", STAMP).unlink()
    workplace.write(miura)
    line = workplace.refused("run", "case.toml")
    assert "holds result-centroid.nc, which this run does not write" in line
    assert main(["run", "case.toml", "--no-figures", "--replace"]) == 0
    assert not Path(OLD[0]).exists()


def test_a_folder_that_another_run_holds(workplace, miura) -> None:
    Path("case-results").mkdir()
    workplace.write(miura)
    with locked(Path("case-results", LOCK)):
        line = workplace.refused("run", "case.toml")
        assert line.startswith("results folder case-results: another run writes to it (process ")
        assert "wait for its end, or name another folder" in line
    assert not Path("case-results", LOCK).exists()
    Path("case-results", LOCK).write_text("process 1 on a machine that lost its current")
    assert main(["run", "case.toml", "--no-figures"]) == 0
    assert not Path("case-results", LOCK).exists()


@pytest.mark.matrix
def test_a_full_disk_is_got_around(workplace, edited, monkeypatch, tmp_path_factory) -> None:
    """What cannot be saved where it was to go is saved in the temporary folder, and named."""
    save, elsewhere = fd.results.save, tmp_path_factory.mktemp("elsewhere")

    def full(ds, path):
        if path.name == "result-centroid.nc" and elsewhere not in path.parents:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        save(ds, path)

    monkeypatch.setattr("foldyn.results.save", full)
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    failed = workplace.run(edited(RULES))
    assert failed.status == 1
    reason, kept = failed.err.splitlines()
    assert reason.startswith(f"foldyn: {OLD[1]}: cannot be written (")
    assert "No space left on device): make room, or name another place with --out" in reason
    (saved,) = elsewhere.rglob("*.nc")
    assert kept == f"foldyn: kept what was computed: {OLD[0]}, {saved}"
    assert fd.load(saved).sizes["time"] == 11
    assert failed.new == ["case-results", OLD[0]]
    assert stamped()["results"] == ["result-panel.nc"]


@pytest.mark.matrix
def test_figures_that_cannot_be_drawn_do_not_hide_the_result(workplace, edited) -> None:
    Path("r/structure.png").mkdir(parents=True)
    workplace.write(edited("output.interval = 0.02"))
    failed = workplace.call("run", "case.toml", "--out", "r", "--figures", "png")
    assert "wrote r/result.nc" in failed.out
    reason = failed.failure("r/result.nc")
    assert reason.startswith("foldyn: case.toml: figures: ")
    assert "structure.png" in reason
    assert failed.new == ["r/result.nc"]
