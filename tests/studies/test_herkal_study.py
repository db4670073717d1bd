"""The study of the paper's case studies: metric, resumption, tables, claims, page, command."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.linear.fidelity import MODELS as BESIDE
from foldyn.structures.discretize import PER_NODE
from foldyn.studies import pool
from foldyn.studies.herkal import report, runs
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.claims import CLAIMS, TARGETS, claims, table1
from foldyn.studies.herkal.metric import FAR, LEAST_MAC, best, content, deviation, errors, ranks
from foldyn.studies.herkal.opensees.stored import read_motion, stored_motions
from foldyn.studies.herkal.runs import (
    MODELS,
    OTHERS,
    REFERENCE,
    Job,
    Numerics,
    Variant,
    case_with,
    compared,
    model_of,
    paper_rules,
    rules,
)
from foldyn.studies.herkal.study import LINEAR, Study, StudyPlan, mean_ranks, second_table
from foldyn.studies.pool import Done
from foldyn.studies.targets import Target, Verdict, read_targets

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


# ---------------------------------------------------------------------- models
def test_models_are_those_of_the_paper_and_more():
    assert paper_rules() == ("equi_inertial", "panel", "centroid", "circumcenter", "consistent")
    assert set(rules()) - set(paper_rules()) == {"mixed_voronoi", "inertia_exact"}
    assert compared() == (*rules(), "plate", "n5b8e")
    assert next(iter(MODELS)) == REFERENCE and REFERENCE not in compared()
    with pytest.raises(InputError, match="choose one of shell, equi_inertial"):
        model_of("voronoi")


@pytest.mark.parametrize("name", [*MODELS, *OTHERS])
def test_models_share_supports_and_loads(name):
    case_file = fd.read_case(fd.studies.find_case("herkal/case2"))
    given, case = case_file.case(), case_with(case_file, name, divisions=2)
    n = len(case_file.pattern.vertices)
    np.testing.assert_array_equal(case.structure.nodes[:n], given.structure.nodes[:n])
    np.testing.assert_array_equal(case.fixed[:n], given.fixed[:n])
    assert case.loads == given.loads and case.damping == given.damping
    assert case.structure.mass.sum() == pytest.approx(given.structure.mass.sum(), rel=1e-12)
    assert case.structure.options.fold_law == given.structure.options.fold_law


def test_models_beyond_the_paper_are_those_of_the_fidelity_study():
    """No variant of bends and calibration is one of theirs; distributions keep the file's."""
    case_file = fd.read_case(fd.studies.find_case("herkal/case2"))
    for name in ("plate", "n5b8e"):
        made = [
            case_with(case_file, name, variant).structure.options
            for variant in (Variant(), Variant(bend_law="superlinear", calibration="merlin2"))
        ]
        assert made[0] == made[1]
        options = vars(made[0])
        assert {key: options[key] for key in BESIDE[name]} == dict(BESIDE[name])
    own = vars(case_file.case().structure.options)
    for name in rules():
        options = vars(case_with(case_file, name).structure.options)
        assert {key for key in own if own[key] != options[key]} <= {"mass"}


def test_variants():
    case_file = fd.read_case(fd.studies.find_case("herkal/case2"))
    given = Variant(pulse=0.1, loads="edge", bend_law="linear", calibration="merlin2")
    case = case_with(case_file, "panel", given)
    assert [(load.history, load.nodes) for load in case.loads] == [
        (fd.HalfSine(0.1), (6, 7, 8)),
    ]
    assert case.structure.options.bend_law == "linear"
    assert case.structure.options.calibration == "merlin2"
    assert case.structure.options.mass == "panel"
    assert given.name == "pulse0.1-edge-linear-merlin2" and Variant().name == ""
    assert given.of_shell == Variant(pulse=0.1, loads="edge")
    with pytest.raises(InputError, match="choose one of file, edge"):
        Variant(loads="corner")


# ---------------------------------------------------------------------- runs
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
    assert replace(job, variant=LINEAR).result(tmp_path) is None
    for model in (REFERENCE, "n5b8e"):  # these have steps of their own
        coarse, fine = (Job("case1", model, "motion", n) for n in (SHORT, finer.numerics))
        assert coarse.settings() != fine.settings()


def test_one_failure_does_not_stop_the_others(tmp_path, monkeypatch):
    compute = runs.compute

    def failing(job):
        if job.model == "panel":
            raise ComputationError("it did not converge")
        return compute(job)

    monkeypatch.setattr(runs, "compute", failing)
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
    whole = fd.trace(case_with(case_file, REFERENCE, divisions=2), steps=runs.STEPS)
    np.testing.assert_allclose(found["displacement"], whole["displacement"][:, :9], atol=1e-12)
    with pytest.raises(InputError, match="vertices only"):
        fd.case_of(found)


def test_plans_have_the_longest_first_and_statics_once():
    jobs = StudyPlan().jobs()
    assert len(set(jobs)) == len(jobs)
    assert {job.model for job in jobs[:4]} == {REFERENCE} and jobs[0].kind == "motion"
    paths = {(job.case, job.model, job.variant) for job in jobs if job.kind == "path"}
    assert len(paths) == 4 * 5  # shell, bars and hinges, and with linear bends, plate, n5b8e
    assert sum(job.kind == "motion" for job in jobs) == 4 * len(MODELS)


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
    assert all(0.0 < row[m] < 1.0 for m in compared() if m != "panel")
    assert row["mixed_voronoi"] == pytest.approx(row["circumcenter"], rel=1e-6)  # equal squares
    assert small.node_errors("case1", "consistent").mean() == row["consistent"]
    assert math.isnan(small.error("case1", "panel", LINEAR))  # not computed


@pytest.mark.matrix
def test_statics_of_shell_and_bars_and_hinges(small):
    found = small.displacements("case1")
    bars = ["bars and hinges", "bars and hinges, linear bends"]
    assert list(found) == ["shell", *bars, "plate", "n5b8e"]
    assert found["bars and hinges"][0] == pytest.approx(-0.0312, abs=5e-5)  # design, section 5
    assert found["bars and hinges, linear bends"][0] == pytest.approx(-0.0248, abs=5e-5)
    assert found["shell"][0] == pytest.approx(-0.0348, rel=0.1)  # at 2 divisions
    assert found["plate"][0] == pytest.approx(-0.0348, rel=0.01)
    assert found["n5b8e"][0] == pytest.approx(-0.0348, rel=0.01)


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
    rows = read_targets(TARGETS, "table1")
    assert len(rows) == 20
    assert [rows[f"case1_{m}"].value for m in paper_rules()] == [
        0.1970, 0.1556, 0.0620, 0.1698, 0.2931,
    ]  # fmt: skip
    assert rows["case3_equi_inertial"].value == 1.2393
    assert {f"{c}_{m}" for c in runs.CASES for m in paper_rules()} == set(rows)


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
    rows = read_targets(TARGETS, "claims")
    assert Verdict(rows["second_peak_case2"], 1.9).holds is None
    assert Verdict(rows["second_peak_case3"], 1.8).holds is None
    assert rows["second_peaks_apart"].value == pytest.approx(1.8 / 1.9, abs=5e-4)
    assert Verdict(rows["second_peaks_apart"], 1.0).holds is False


def test_every_claim_has_a_row_and_every_row_a_claim():
    assert set(CLAIMS) == set(read_targets(TARGETS, "claims"))
    groups = {target.group for target in read_targets(TARGETS).values()}
    assert groups == {"specimen", "table1", "claims"}


def test_bounds():
    least = Target("a", 1.0, "", "here", "a thing", bound="least")
    assert Verdict(least, 1.0).holds is True and Verdict(least, 0.9).holds is False
    most = replace(least, bound="most")
    assert Verdict(most, 0.9).holds is True and Verdict(most, 1.1).holds is False
    assert Verdict(most, math.nan).holds is False
    assert Verdict(most, 1.5).line() == "a thing: 1.5  beside at most 1 (here), +50.0%: fails"
    with pytest.raises(InputError, match='"least" or "most"'):
        replace(least, bound="about")
    with pytest.raises(InputError, match="no tolerance"):
        replace(least, tolerance=0.1)


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
    assert {v.target.key for v in table1(small)} == {f"case1_{m}" for m in paper_rules()}


@pytest.mark.matrix
# ---------------------------------------------------------------------- page and command
def test_page_of_a_study(small, monkeypatch):
    monkeypatch.setattr(runs, "case_study", cache(runs.case_study))  # reads them a hundred times
    page = report.write(small).read_text("utf-8")
    for text in ("This is a coarse run", "In this coarse run", "Table 1 of the paper and ours"):
        assert text in page
    assert page.count("<img") == 5  # sensitivity, structure, statics, motions of two groups
    assert page.count("plate (ours)") == page.count("n5b8e (ours)") == 1  # Table 1
    assert "consistent (ours)" not in page
    for model in MODELS.values():
        assert model.label in page
    assert "nan" not in page.split("<style>")[0] and ">nan<" not in page


def test_errors_against_the_finest_stored_motion_of_another_shell(tmp_path, monkeypatch):
    divisions, dt = stored_motions("case2")[-1]
    theirs = read_motion("case2", divisions, dt)
    x = np.zeros((len(theirs.time), 9, 3))
    x[:, theirs.node] = theirs.displacement
    coordinates = {"time": theirs.time, "node": np.arange(9), "axis": ["x", "y", "z"]}
    same = xr.Dataset({"displacement": (("time", "node", "axis"), x)}, coordinates)
    motions = {"panel": same, "centroid": 1.5 * same}
    monkeypatch.setattr(Study, "result", lambda self, case, model, kind: motions[model])
    study = Study(StudyPlan(cases=("case2",), models=("panel", "centroid")), tmp_path)
    found = second_table(study)
    assert found["case2"][0] == divisions
    assert found["case2"][1] == pytest.approx({"panel": 0.0, "centroid": 0.5}, abs=1e-12)
    motions["centroid"] = same.isel(time=slice(500))  # of another length: not comparable
    assert second_table(study) == {}


@pytest.mark.matrix
def test_page_without_motions(tmp_path):
    study = Study(StudyPlan(SHORT, ("case1",), ("panel",)), tmp_path)
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
    monkeypatch.setattr(studies, "QUICK", StudyPlan(SHORT, ("case2",), ("panel",)))
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
    monkeypatch.setattr(studies, "QUICK", StudyPlan(SHORT, ("case2",), ("panel",)))
    monkeypatch.setattr(Study, "compute", lambda *_: [])
    monkeypatch.setattr("foldyn.cli.study._data", lambda *_: None)
    command = ["study", "herkal", "--quick", "--quiet", "--out", str(tmp_path / "study")]
    assert main(command) == 2
    assert "a structure of 13 nodes needs about" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0


@pytest.mark.matrix
def test_an_interrupted_study_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        studies, "QUICK", StudyPlan(replace(SHORT, dt=0.01), ("case1",), ("panel",))
    )
    monkeypatch.setattr(StudyPlan, "stiffnesses", lambda _: [])
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
