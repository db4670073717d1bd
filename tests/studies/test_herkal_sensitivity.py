"""The sensitivity of the case studies: tasks, tables, summaries, page, command."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import FoldynWarning
from foldyn.store import digest
from foldyn.studies.herkal import report, runs, sensitivity, sensitivity_page, variations
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.claims import paper_table, tolerance
from foldyn.studies.herkal.metric import errors
from foldyn.studies.herkal.runs import REFERENCE, Job, Numerics, Variant, paper_rules, rules
from foldyn.studies.herkal.sensitivity import (
    BEND_LAWS,
    CALIBRATIONS,
    MODELS,
    PULSES,
    Comparison,
    tasks,
)
from foldyn.studies.herkal.specimen import tasks as tasks_of_the_specimen
from foldyn.studies.herkal.variations import (
    Variations,
    frequency_errors,
    likeness,
    rank_correlation,
    standings,
)

SHORT = Numerics(divisions=2, dt=0.01, duration=0.5)


# ---------------------------------------------------------------------- tasks
def test_tasks_are_all_combinations_of_loads():
    found = [task for task in tasks(runs.CASES, SHORT) if task.load is not None]
    assert len(set(found)) == len(found) == 4 * 1 + 3 * 4 * 2  # the edge of case 1 is loaded whole
    assert {(t.load.pulse, t.load.loads) for t in found if t.case == "case3"} == set(
        itertools.product(PULSES, ("file", "edge"))
    )
    assert [t.case for t in found[:8]] == ["case4"] * 8
    assert len({t.name for t in found}) == len(found)


@pytest.mark.matrix
def test_a_task_keeps_the_errors_against_the_shell_under_the_same_load(tmp_path):
    task = Comparison("case2", SHORT, Variant(0.25, "edge"))
    assert not task.there(tmp_path)
    task.make(tmp_path)
    assert task.there(tmp_path)
    rows = task.result(tmp_path)
    assert [(r["bend_law"], r["calibration"]) for r in rows] == list(
        itertools.product(BEND_LAWS, CALIBRATIONS)
    )
    variant = Variant(0.25, "edge", "linear", "merlin2")
    shell = runs.compute(Job("case2", REFERENCE, "motion", SHORT, variant.of_shell))
    ours = runs.compute(Job("case2", "panel", "motion", SHORT, variant))
    expected = errors(ours, shell, [6, 7, 8], "x").mean()
    assert rows[-1]["panel"] == pytest.approx(expected, rel=1e-9)
    assert rows[0]["panel"] != rows[1]["panel"] != rows[2]["panel"]  # each changes something
    assert set(MODELS) < set(rows[0])


@pytest.mark.matrix
def test_outdated_and_damaged_results_are_computed_again(tmp_path, monkeypatch):
    task = Comparison("case1", SHORT)
    task.make(tmp_path)
    assert task.there(tmp_path)
    assert not Comparison("case1", Numerics(3)).there(tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(runs, "program", lambda: "another")
        assert not task.there(tmp_path)
    file = tmp_path / f"{task.name}.json"
    sound = file.read_text()
    settings, key, rows = sound.partition('"rows"')
    flipped = settings + key + re.sub(r"\.(\d)", lambda m: f".{9 - int(m[1])}", rows)
    for damaged in ('{"settings": ', "[]", "[" * 9999, flipped, sound.replace("rows_sha256", "x")):
        file.write_text(damaged)
        with pytest.warns(FoldynWarning, match=f"{task.name}.json: is damaged.*computed again"):
            assert not task.there(tmp_path)
    file.write_text(sound)
    assert task.there(tmp_path)


@pytest.mark.matrix
def test_frequencies_are_those_of_partners(tmp_path):
    task = Comparison("case1", SHORT)
    task.make(tmp_path)
    rows = task.result(tmp_path)
    assert len(rows) == len(MODELS) * 4 * runs.SHELL_MODES
    first = rows[0]
    assert (first["model"], first["mode"]) == (MODELS[0], 1)
    assert first["mac"] > 0.9 and first["frequency"] == pytest.approx(first["shell"], rel=0.2)


def test_the_program_is_told_by_what_computes(tmp_path):
    for name in (*runs.COMPUTING, *tasks_of_the_specimen.COMPUTING):
        assert (Path(fd.__file__).parent / name).exists(), name
    for name in ("shells/shell.py", "studies/herkal/runs.py", "studies/herkal/report.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("a = 1\n")
    before = digest(tmp_path)
    (tmp_path / "studies/herkal/report.py").write_text("a = 2\n")
    assert digest(tmp_path) == before
    assert digest(tmp_path, "studies/herkal/report.py") != before
    (tmp_path / "shells/shell.py").write_text("a = 2\n")
    assert digest(tmp_path) != before


@pytest.mark.matrix
def test_results_of_another_program_are_computed_again(tmp_path, monkeypatch):
    job = Job("case1", "panel", "path")
    job.make(tmp_path)
    assert job.there(tmp_path)
    monkeypatch.setattr(runs, "program", lambda: "another")
    assert not job.there(tmp_path)


# ---------------------------------------------------------------------- summaries
def row(case, values, pulse=0.5, loads="file", bends="superlinear", calibration="standard"):
    named = dict(zip("abc", values, strict=True))
    given = {"pulse": pulse, "loads": loads, "bend_law": bends, "calibration": calibration}
    return {"case": case, **given, **named}


def test_standings():
    rows = [row("case1", (1, 2, 3)), row("case1", (1, 3, 2)), row("case2", (3, 1, 2))]
    found = standings(rows, ["a", "b", "c"])
    assert found["a"].mean_rank == 2.0  # 1 in case 1, 3 in case 2: cases count alike
    assert found["b"].mean_rank == 0.5 * (2.5 + 1.0)
    assert (found["a"].best, found["b"].best, found["c"].best) == (2, 1, 0)
    assert (found["a"].worst_rank, found["c"].worst_rank) == (3, 3)
    assert (found["a"].median, found["a"].largest) == (1.0, 3)


def test_likeness():
    theirs = {"case1": {"a": 1.0, "b": 2.0, "c": 4.0}, "case2": {"a": 1.0, "b": 2.0, "c": 4.0}}
    ours = {"case1": {"a": 1.1, "b": 2.0, "c": 6.0}, "case2": {"a": 4.0, "b": 2.0, "c": 1.0}}
    found = likeness(ours, theirs, ["a", "b", "c"], 0.25)
    assert (found.within, found.of, found.same_best) == (3, 6, 1)
    assert found.largest == pytest.approx(3.0)
    assert found.median == pytest.approx(0.5 * (0.5 + 0.1))
    assert found.correlation == pytest.approx(0.5 * (1.0 - 1.0))
    assert rank_correlation({"a": 1, "b": 2, "c": 3}, {"a": 1, "b": 3, "c": 2}) == 0.5


def test_frequencies_are_compared_where_all_have_a_partner():
    def mode(model, number, frequency):
        return {"case": "case1", "bend_law": "linear", "calibration": "standard", "model": model,
                "mode": number, "shell": 2.0, "frequency": frequency}  # fmt: skip

    rows = [mode("a", 1, 2.2), mode("b", 1, 1.6), mode("a", 2, 9.0), mode("b", 2, math.nan)]
    found, count = frequency_errors(rows, ["a", "b"])
    assert count == 1
    assert found == pytest.approx({"a": 0.1, "b": 0.2})
    assert math.isnan(frequency_errors(rows[3:], ["a", "b"])[0]["a"])


def test_changes_of_the_case_files():
    rows = [
        row("case1", (1, 2, 3)), row("case1", (4, 5, 6), pulse=1.0),
        row("case2", (1, 2, 3)), row("case2", (7, 8, 9), loads="edge"),
    ]  # fmt: skip
    found = Variations("", rows, [])
    assert found.filed() == {"case1": rows[0], "case2": rows[2]}
    assert found.filed(loads="edge") == {"case1": rows[0], "case2": rows[3]}
    assert found.filed(pulse=1.0) == {"case1": rows[1]}


def test_tables_are_read_as_they_were_written(tmp_path):
    assert variations.read(tmp_path) is None
    frequency = {"case": "case1", "model": "a", "mode": 1.0, "frequency": math.nan, "mac": 0.5}
    given = Variations("shells, of 2", [row("case1", (1.5, 2.25, 1e-3))], [frequency])
    variations.write(given, tmp_path)
    found = variations.read(tmp_path)
    assert found.about == given.about and found.motions == given.motions
    assert math.isnan(found.frequencies[0].pop("frequency"))
    assert found.frequencies[0].items() <= frequency.items()
    file = tmp_path / variations.METRIC
    sound = file.read_bytes()
    for damaged in (b"\xff" + sound, sound[:-20], sound.replace(b",", b",x,", 40), b"#\na\n1,2\n"):
        file.write_bytes(damaged)
        with pytest.warns(FoldynWarning, match=r"is damaged.*left out"):
            assert variations.read(tmp_path) is None


# ---------------------------------------------------------------------- stored tables and page
@pytest.fixture(scope="module")
def stored():
    return variations.read(variations.STORED)


def test_stored_tables_are_whole(stored):
    wanted = [t for t in tasks(runs.CASES, SHORT) if t.load is not None]
    keys = {(t.case, t.load.pulse, t.load.loads, *laws) for t in wanted
            for laws in itertools.product(BEND_LAWS, CALIBRATIONS)}  # fmt: skip
    found = [
        tuple(r[k] for k in ("case", "pulse", "loads", "bend_law", "calibration"))
        for r in stored.motions
    ]
    assert len(found) == len(keys) and set(found) == keys
    assert all(math.isfinite(r[m]) and r[m] > 0.0 for r in stored.motions for m in MODELS)
    assert len(stored.frequencies) == 4 * 4 * len(MODELS) * runs.SHELL_MODES
    assert "divisions" in stored.about


def test_stored_tables_know_what_cannot_differ(stored):
    """Equal masses and equal calibrations give equal errors."""
    for r in stored.motions:
        assert r["mixed_voronoi"] == r["circumcenter"]  # no obtuse corner in these triangles
    for r in stored.chosen(case="case1", calibration="merlin2"):  # squares: one order as the other
        same = stored.chosen(**{k: r[k] for k in ("case", "pulse", "loads", "bend_law")},
                             calibration="standard")  # fmt: skip
        assert [r[m] for m in rules()] == [same[0][m] for m in rules()]
    low = [r for r in stored.frequencies if r["mode"] == 1 and r["bend_law"] == "superlinear"]
    assert all(abs(r["frequency"] / r["shell"] - 1.0) < 0.25 for r in low)


@pytest.mark.matrix
def test_page_of_the_sensitivity(stored, tmp_path):
    page = report.write_sensitivity(stored, tmp_path).read_text("utf-8")
    assert page.count("<img") == 1 and stored.about in page
    for text in ("load on every node of the edge", "merlin2", "other corners", "best of 56"):
        assert text in page
    assert ">nan<" not in page
    told = sensitivity_page.opinion(stored)
    hits = sum(
        min(paper_rules(), key=lambda m: r[m])
        == min(paper_rules(), key=lambda m: paper_table()[r["case"]][m])
        for r in stored.chosen(bend_law="superlinear")
    )
    assert f"{hits} of 56 combinations" in told
    assert sensitivity_page.sections(Variations("", [], []), None, tolerance()) == []


@pytest.mark.matrix
def test_the_command_varies_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runs, "CASES", ("case1",))
    monkeypatch.setattr(studies, "QUICK", studies.StudyPlan(SHORT))
    monkeypatch.setattr(sensitivity, "PULSES", (0.5,))
    monkeypatch.setattr("foldyn.cli.study.PROCESSES", 1)
    monkeypatch.setattr(sensitivity_page, "PULSES", (0.5,))
    command = ["study", "herkal", "--quick", "--sensitivity", "--out", str(tmp_path / "study")]
    assert main(command) == 0
    found = variations.read(tmp_path / "study" / report.SENSITIVITY)
    assert len(found.motions) == 4 and "2 divisions" in found.about
    assert (tmp_path / "study" / "sensitivity.html").is_file()
    capsys.readouterr()
    assert main(command) == 0
    assert "skipped 2 of 2 runs" in capsys.readouterr().out
