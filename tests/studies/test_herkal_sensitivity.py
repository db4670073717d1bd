"""The sensitivity of the case studies: tasks, tables, summaries, page, command."""

from __future__ import annotations

import itertools
import math
import re

import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.fidelity import MODELS as BESIDE
from foldyn.studies.herkal import report, runs
from foldyn.studies.herkal.claims import paper_table, tolerance
from foldyn.studies.herkal.metric import errors
from foldyn.studies.herkal.runs import REFERENCE, RULES, Numerics
from verification.herkal import __main__ as command
from verification.herkal import sensitivity, sensitivity_page, variations
from verification.herkal.models import (
    DISTRIBUTIONS,
    OTHERS,
    STIFFNESSES,
    Variant,
    Varied,
    case_with,
)
from verification.herkal.sensitivity import (
    BEND_LAWS,
    CALIBRATIONS,
    MODELS,
    PULSES,
    Comparison,
    tasks,
)
from verification.herkal.variations import Variations, frequency_errors, likeness, standings

SHORT = Numerics(divisions=2, dt=0.01, duration=0.5)


# ---------------------------------------------------------------------- models
@pytest.mark.parametrize("name", [*STIFFNESSES, *OTHERS, "inertia_exact"])
def test_models_share_supports_and_loads(name):
    case_file = runs.case_study("case2")
    given, case = case_file.case(), case_with(case_file, name)
    assert case.loads == given.loads and case.damping == given.damping
    assert case.structure.mass.sum() == pytest.approx(given.structure.mass.sum(), rel=1e-12)
    assert case.structure.options.fold_law == given.structure.options.fold_law
    with pytest.raises(InputError, match="choose one of shell, equi_inertial"):
        case_with(case_file, "voronoi")


def test_models_beyond_the_paper_are_those_of_the_fidelity_study():
    """No variant of bends and calibration is one of theirs; distributions keep the file's."""
    case_file = runs.case_study("case2")
    for name in STIFFNESSES:
        made = [
            case_with(case_file, name, variant).structure.options
            for variant in (Variant(), Variant(bend_law="superlinear", calibration="merlin2"))
        ]
        assert made[0] == made[1]
        options = vars(made[0])
        assert {key: options[key] for key in BESIDE[name]} == dict(BESIDE[name])
    own = vars(case_file.case().structure.options)
    for name in DISTRIBUTIONS:
        options = vars(case_with(case_file, name).structure.options)
        assert {key for key in own if own[key] != options[key]} <= {"mass"}


def test_variants():
    case_file = runs.case_study("case2")
    given = Variant(pulse=0.1, loads="edge", bend_law="linear", calibration="merlin2")
    case = case_with(case_file, "panel", given)
    assert [(load.history, load.nodes) for load in case.loads] == [(fd.HalfSine(0.1), (6, 7, 8))]
    assert case.structure.options.bend_law == "linear"
    assert case.structure.options.calibration == "merlin2"
    assert case.structure.options.mass == "panel"
    assert given.name == "pulse0.1-edge-linear-merlin2" and Variant().name == ""
    assert given.of_shell == Variant(pulse=0.1, loads="edge")
    with pytest.raises(InputError, match="choose one of file, edge"):
        Variant(loads="corner")


def test_variants_of_a_computation_are_kept_apart():
    jobs = [Varied("case1", "panel", "path", SHORT, one) for one in (Variant(), Variant(0.1))]
    assert [job.name for job in jobs] == ["case1-panel-path", "case1-panel-path-pulse0.1"]
    assert jobs[0].settings() != jobs[1].settings()
    coarse, fine = (Varied("case1", "n5b8e", "motion", Numerics(dt=dt)) for dt in (0.01, 0.02))
    assert coarse.settings() != fine.settings()  # it has steps of its own


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
    shell = Varied("case2", REFERENCE, "motion", SHORT, variant.of_shell).compute()
    ours = Varied("case2", "panel", "motion", SHORT, variant).compute()
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
        assert [r[m] for m in DISTRIBUTIONS] == [same[0][m] for m in DISTRIBUTIONS]
    low = [r for r in stored.frequencies if r["mode"] == 1 and r["bend_law"] == "superlinear"]
    assert all(abs(r["frequency"] / r["shell"] - 1.0) < 0.25 for r in low)


@pytest.mark.matrix
def test_page_of_the_sensitivity(stored, tmp_path):
    page = sensitivity_page.write(stored, tmp_path).read_text("utf-8")
    assert page.count("<img") == 1 and stored.about in page
    for text in ("load on every node of the edge", "merlin2", "other corners", "best of 56"):
        assert text in page
    assert ">nan<" not in page
    told = sensitivity_page.opinion(stored)
    hits = sum(
        min(RULES, key=lambda m: r[m]) == min(RULES, key=lambda m: paper_table()[r["case"]][m])
        for r in stored.chosen(bend_law="superlinear")
    )
    assert f"{hits} of 56 combinations" in told
    assert sensitivity_page.sections(Variations("", [], []), None) == []


def test_the_bound_on_the_page_of_the_study_is_explained_by_these_tables(stored):
    """`report.BOUND` has the medians in percent: half and twice the pulse, the whole edge."""
    changes = {"pulse": 0.25}, {"pulse": 1.0}, {"loads": "edge"}
    moved = [
        likeness(stored.filed(**change), stored.filed(), tuple(RULES), tolerance()).median
        for change in changes
    ]
    assert [f"{one:.0%}" for one in moved] == re.findall(r"\d+%", report.BOUND)


@pytest.mark.matrix
def test_the_command_varies_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command.studies, "QUICK", command.studies.StudyPlan(SHORT))
    monkeypatch.setattr(sensitivity, "PULSES", (0.5,))
    monkeypatch.setattr(sensitivity_page, "PULSES", (0.5,))
    given = ["sensitivity", "--cases", "case1", "--processes", "1", "--out", str(tmp_path)]
    assert command.main(given) == 0
    found = variations.read(tmp_path)
    assert len(found.motions) == 4 and "2 divisions" in found.about
    assert (tmp_path / "sensitivity.html").is_file()
    assert "0 runs were there" in capsys.readouterr().out
    assert command.main(given) == 0
    assert "2 runs were there" in capsys.readouterr().out
