"""The study of the paper's case studies: metric, resumption, tables, claims, page, command."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.store import digest
from foldyn.structures.discretize import PER_NODE
from foldyn.studies import pool
from foldyn.studies.herkal import report, runs
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.claims import CLAIMS, claims, table1
from foldyn.studies.herkal.metric import (
    FAR,
    LEAST_MAC,
    best,
    content,
    deviation,
    errors,
    rank_correlation,
    ranks,
)
from foldyn.studies.herkal.runs import REFERENCE, RULES, Job, Numerics, shell_case
from foldyn.studies.herkal.specimen import tasks as tasks_of_the_specimen
from foldyn.studies.herkal.study import Study, StudyPlan, mean_ranks
from foldyn.studies.herkal.targets import Target, Verdict, read_targets
from foldyn.studies.pool import Done

SHORT = Numerics(divisions=2, dt=0.02, duration=0.5)
TIMES = np.arange(1000) * 0.01  # 10 s: 0.1 Hz is a bin


def moving(*records):
    """A motion along x of as many nodes as there are records."""
    x = np.zeros((len(TIMES), len(records), 3))
    x[:, :, 0] = np.stack(records, axis=1)
    coordinates = {"time": TIMES, "node": np.arange(len(records)), "axis": ["x", "y", "z"]}
    return xr.Dataset({"displacement": (("time", "node", "axis"), x)}, coordinates)


def sine(frequency, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * frequency * TIMES)


# ---------------------------------------------------------------------- metric
def test_content_is_the_amplitude_up_to_a_frequency():
    frequency, amplitude = content(moving(sine(2.0, 0.3), sine(7.0)), [0, 1], "x")
    assert frequency[-1] == pytest.approx(5.0)
    assert amplitude[20, 0] == pytest.approx(0.3)
    np.testing.assert_allclose(amplitude[:, 1], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("ours", "expected"),
    [
        (sine(1.0), 0.0),
        (-sine(1.0), 0.0),  # phases do not count
        (sine(1.0, 1.5), 0.5),
        (sine(1.0, 0.0), 1.0),
        (sine(1.5), math.sqrt(2.0)),  # another bin: nothing in common
        (sine(1.0) + sine(3.0, 0.75), 0.75),
        (sine(1.0) + sine(8.0), 0.0),  # above 5 Hz
    ],
)
def test_metric_of_sines_on_bins(ours, expected):
    found = errors(moving(ours), moving(sine(1.0)), [0], "x")
    assert found[0] == pytest.approx(expected, abs=1e-9)


def test_metric_is_per_node():
    reference = moving(sine(1.0), sine(1.0, 100.0))
    found = errors(moving(sine(1.0, 2.0), sine(1.0, 150.0)), reference, [0, 1], "x")
    np.testing.assert_allclose(found, [1.0, 0.5], rtol=1e-9)


def test_metric_refuses_what_cannot_be_compared():
    with pytest.raises(InputError, match="same length"):
        deviation(np.ones((4, 2)), np.ones((5, 2)))
    with pytest.raises(InputError, match="is still"):
        deviation(np.ones((4, 2)), np.array([[1.0, 0.0]] * 4))


def test_ranks():
    assert ranks({"a": 0.3, "b": 0.1, "c": math.nan, "d": 0.3}) == {"a": 2, "b": 1, "d": 2}
    table = {"case1": {"a": 1.0, "b": 2.0}, "case2": {"a": 3.0, "b": 2.0}}
    assert mean_ranks(table, ["a", "b"]) == {"a": 1.5, "b": 1.5}
    assert best({"a": math.nan, "b": 2.0}) == "b"
    assert best({"a": math.nan}) == ""
    assert rank_correlation({"a": 1, "b": 2, "c": 3}, {"a": 1, "b": 3, "c": 2}) == 0.5


# ---------------------------------------------------------------------- runs
@pytest.mark.parametrize("name", [REFERENCE, *RULES])
def test_models_share_supports_and_loads(name):
    case_file = runs.case_study("case2")
    given, case = case_file.case(), Job("case2", name, "path", SHORT).given(case_file)
    n = len(case_file.pattern.vertices)
    np.testing.assert_array_equal(case.structure.nodes[:n], given.structure.nodes[:n])
    np.testing.assert_array_equal(case.fixed[:n], given.fixed[:n])
    assert case.loads == given.loads and case.damping == given.damping
    assert case.structure.mass.sum() == pytest.approx(given.structure.mass.sum(), rel=1e-12)
    assert case.structure.options.fold_law == given.structure.options.fold_law


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


@pytest.mark.matrix
def test_what_is_there_is_skipped(tmp_path):
    jobs = [Job("case1", "panel", "path"), Job("case1", "panel", "modes")]
    first = pool.run(jobs, tmp_path, processes=1)
    assert [done.skipped for done in first] == [False, False]
    times = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.nc")}
    assert set(times) == {"case1-panel-path.nc", "case1-panel-modes.nc"}
    told: list[Done] = []
    second = pool.run(jobs * 2, tmp_path, told.append, processes=1)
    assert [done.skipped for done in second] == [True, True] and told == second
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.nc")} == times
    assert not list(tmp_path.glob(".*"))


@pytest.mark.matrix
def test_other_settings_and_damaged_files_are_computed_again(tmp_path):
    job = Job("case1", "panel", "motion", SHORT)
    for damage in (b"cut short", None):
        if damage is None:  # one bit
            sound = job.file(tmp_path).read_bytes()
            damage = sound[:3000] + bytes([sound[3000] ^ 1]) + sound[3001:]
        job.file(tmp_path).write_bytes(damage)
        with pytest.warns(FoldynWarning, match=f"{job.name}.nc: is damaged.*computed again"):
            assert job.result(tmp_path) is None
        with pytest.warns(FoldynWarning, match="computed again"):
            pool.run([job], tmp_path, processes=1)
        assert job.result(tmp_path) is not None
    finer = replace(job, numerics=replace(SHORT, divisions=4, dt=0.01))
    assert finer.result(tmp_path) is not None  # of the shell alone
    longer = replace(job, numerics=replace(SHORT, duration=0.6))
    assert longer.result(tmp_path) is None
    coarse, fine = (Job("case1", REFERENCE, "motion", n) for n in (SHORT, finer.numerics))
    assert coarse.settings() != fine.settings()


def test_one_failure_does_not_stop_the_others(tmp_path, monkeypatch):
    compute = Job.compute

    def failing(job, folder):
        if job.model == "panel":
            raise ComputationError("it did not converge")
        return compute(job, folder)

    monkeypatch.setattr(Job, "compute", failing)
    jobs = [Job("case1", "panel", "path"), Job("case1", "centroid", "path")]
    ended = pool.run(jobs, tmp_path, processes=1)
    assert [done.failure for done in ended] == ["it did not converge", ""]
    assert [path.name for path in tmp_path.glob("*.nc")] == ["case1-centroid-path.nc"]


@pytest.mark.matrix
def test_results_are_those_of_the_vertices(tmp_path):
    job = Job("case2", REFERENCE, "path", SHORT)
    pool.run([job], tmp_path, processes=1)
    found = job.result(tmp_path)
    assert found.sizes["node"] == 9
    case_file = fd.read_case(fd.studies.find_case("herkal/case2"))
    whole = fd.trace(shell_case(case_file, divisions=2), steps=runs.STEPS)
    np.testing.assert_allclose(found["displacement"], whole["displacement"][:, :9], atol=1e-12)
    with pytest.raises(InputError, match="vertices only"):
        fd.case_of(found)


def test_plans_have_the_longest_first_and_statics_once():
    jobs = StudyPlan().jobs()
    assert len(set(jobs)) == len(jobs)
    assert {job.model for job in jobs[:4]} == {REFERENCE} and jobs[0].kind == "motion"
    assert sum(job.kind == "path" for job in jobs) == 4 * 2  # shell, bars and hinges
    assert sum(job.kind == "motion" for job in jobs) == 4 * (1 + len(RULES))


# ---------------------------------------------------------------------- tables
@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A study of case 1 over 4 s in which the motion with panel masses stands for the shell's."""
    plan = StudyPlan(Numerics(divisions=2, duration=4.0), ("case1",))
    study = Study(plan, tmp_path_factory.mktemp("study"))
    folder = study.folder / studies.RESULTS
    folder.mkdir()
    shell = Job("case1", REFERENCE, "motion", plan.numerics)
    pool.run([job for job in plan.jobs() if job != shell], folder, processes=1)
    panel = study.result("case1", "panel", "motion")
    shell.store.keep(shell.file(folder), shell.settings(), panel)
    return Study(plan, study.folder)


@pytest.mark.matrix
def test_table_from_stored_runs(small):
    row = small.table()["case1"]
    assert row["panel"] == 0.0 and best(row) == "panel"
    assert all(0.0 < row[m] < 1.0 for m in RULES if m != "panel")
    assert small.node_errors("case1", "consistent").mean() == row["consistent"]
    assert math.isnan(small.error("case2", "panel"))  # not computed


@pytest.mark.matrix
def test_statics_of_shell_and_bars_and_hinges(small):
    found = small.displacements("case1")
    assert list(found) == ["shell", "bars and hinges"]
    assert found["bars and hinges"][0] == pytest.approx(-0.0312, abs=5e-5)  # design, section 5
    assert found["shell"][0] == pytest.approx(-0.0348, rel=0.1)  # at 2 divisions


@pytest.mark.matrix
def test_modes_have_partners(small):
    found = small.frequencies("case1", "consistent")
    assert found.mac[0] > 0.99 and 0.0 < found.deviation[0] < 0.2  # 2 divisions are soft
    known = np.isfinite(found.frequency)
    assert (found.mac[known] >= LEAST_MAC).all()
    ratio = found.frequency[known] / found.reference[known]
    assert ((ratio > 1 / FAR) & (ratio < FAR)).all()
    assert found.mean_error == pytest.approx(np.abs(ratio - 1.0).mean())


# ---------------------------------------------------------------------- claims
def test_table_1_is_the_papers():
    rows = read_targets("table1")
    assert len(rows) == 20
    assert [rows[f"case1_{m}"].value for m in RULES] == [
        0.1970, 0.1556, 0.0620, 0.1698, 0.2931,
    ]  # fmt: skip
    assert rows["case3_equi_inertial"].value == 1.2393
    assert {f"{c}_{m}" for c in runs.CASES for m in RULES} == set(rows)


@pytest.mark.matrix
def test_a_claim_on_the_best_is_judged_by_its_error_over_the_smallest(small, monkeypatch):
    row = {"equi_inertial": 0.4, "panel": 0.3, "centroid": 0.5, "circumcenter": 0.6}
    monkeypatch.setattr(Study, "error", lambda self, case, model, *_: row.get(model, 0.2))
    found = {v.target.key: v for v in claims(small)}
    assert found["best_case1"].computed == pytest.approx(2.5) and not found["best_case1"].holds
    assert found["best_case2"].computed == 1.0 and found["best_case2"].holds
    row["panel"] = math.nan
    assert "best_case1" not in {v.target.key for v in claims(small)}


def test_what_density_was_chosen_by_is_not_judged():
    rows = read_targets("claims")
    assert Verdict(rows["second_peak_case2"], 1.9).holds is None
    assert Verdict(rows["second_peak_case3"], 1.8).holds is None
    assert rows["second_peaks_apart"].value == pytest.approx(1.8 / 1.9, abs=5e-4)
    assert Verdict(rows["second_peaks_apart"], 1.0).holds is False


def test_every_claim_has_a_row_and_every_row_a_claim():
    assert set(CLAIMS) == set(read_targets("claims"))
    assert len(read_targets("specimen")) == 7


def test_bounds():
    least = Target("a", 1.0, "", "here", "a thing", bound="least")
    assert Verdict(least, 1.0).holds is True and Verdict(least, 0.9).holds is False
    most = replace(least, bound="most")
    assert Verdict(most, 0.9).holds is True and Verdict(most, 1.1).holds is False
    assert Verdict(most, math.nan).holds is False
    assert Verdict(most, 1.5).asked == "at most 1" and Verdict(most, 1.5).word == "fails"


@pytest.mark.matrix
def test_claims_of_one_case(small):
    found = {v.target.key: v for v in claims(small)}
    assert set(found) == {
        "asymmetry_equi_inertial", "asymmetry_others", "second_peak_case1",
    }  # fmt: skip
    # two heavy corners lie across each square of the fold: its edge turns as it moves
    assert found["asymmetry_equi_inertial"].holds
    assert found["asymmetry_others"].computed < 1e-9
    modes = small.result("case1", "equi_inertial", "modes")["frequency"].values
    assert found["second_peak_case1"].computed == pytest.approx(modes[1], rel=0.1)
    assert {v.target.key for v in table1(small)} == {f"case1_{m}" for m in RULES}


@pytest.mark.matrix
# ---------------------------------------------------------------------- page and command
def test_page_of_a_study(small, monkeypatch):
    monkeypatch.setattr(runs, "case_study", cache(runs.case_study))  # reads them a hundred times
    page = report.write(small).read_text("utf-8")
    for text in ("This is a coarse run", "In this coarse run", "Table 1 of the paper and ours"):
        assert text in page
    assert page.count("<img") == 3  # structure, statics, motions
    for label in RULES.values():
        assert label in page
    assert "nan" not in page.split("<style>")[0] and ">nan<" not in page


@pytest.mark.matrix
def test_page_without_motions(tmp_path):
    study = Study(StudyPlan(SHORT, ("case1",), {"panel": "panel"}), tmp_path)
    assert "None of the paper" in report.write(study).read_text("utf-8")


def test_command_refuses_bad_input(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["study", "herkal", "--quick", "--out", str(tmp_path / "file")]) == 2
    assert "is a file" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        main(["study", "unknown"])
    assert stop.value.code == 2


@pytest.mark.matrix
def test_the_specimen_is_left_out_without_opencv(tmp_path, monkeypatch, capsys):
    """It is an optional part: the case studies do not need it."""

    def missing():
        raise InputError("pip install foldyn[experiment]")

    monkeypatch.setattr("foldyn.experiment.opencv", missing)
    monkeypatch.setattr(studies, "QUICK", StudyPlan(SHORT, ("case2",), {"panel": "panel"}))
    monkeypatch.setattr(Study, "compute", lambda *_: [])
    (tmp_path / "study").mkdir()
    assert main(["study", "herkal", "--quick", "--out", str(tmp_path / "study")]) == 0
    told = capsys.readouterr().out
    assert "synthetic film is left out: pip install foldyn[experiment]" in told
    assert "the specimen: calibrated" not in told
    assert "The paper specimen" not in (tmp_path / "study/report.html").read_text("utf-8")


@pytest.mark.matrix
def test_the_command_takes_half_of_the_memory_unless_forced(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("foldyn.ram_limit.memory", lambda: 1.5 * PER_NODE * 13)
    monkeypatch.setattr(studies, "QUICK", StudyPlan(SHORT, ("case2",), {"panel": "panel"}))
    monkeypatch.setattr(Study, "compute", lambda *_: [])
    monkeypatch.setattr("foldyn.cli.study._data", lambda *_: None)
    command = ["study", "herkal", "--quick", "--quiet", "--out", str(tmp_path / "study")]
    assert main(command) == 2
    assert "a structure of 13 nodes needs about" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0


@pytest.mark.matrix
def test_an_interrupted_study_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        studies, "QUICK", StudyPlan(replace(SHORT, dt=0.01), ("case1",), {"panel": "panel"})
    )
    monkeypatch.setattr("foldyn.cli.study._data", lambda *_: None)
    monkeypatch.setattr("foldyn.cli.study.PROCESSES", 1)
    command = ["study", "herkal", "--quick", "--out", str(tmp_path / "out")]

    class Bar(contextlib.nullcontext):
        def __enter__(self):
            return self

        def update(self):
            raise KeyboardInterrupt

    with monkeypatch.context() as first:
        first.setattr("foldyn.cli.study.progress_bar", lambda *_, **__: Bar())
        assert main(command) == 130
    kept = f"foldyn: kept what was computed: {tmp_path / 'out' / 'runs'}; the same command"
    assert kept in capsys.readouterr().err
    assert main(command) == 0
    assert "skipped 1 of " in capsys.readouterr().out
