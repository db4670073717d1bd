"""Models beyond the paper: small loads on the case studies, modes and peaks of the specimen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from foldyn.report import Table, Text
from foldyn.studies import pool
from foldyn.studies.herkal import runs
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.runs import Numerics
from foldyn.studies.herkal.study import Study, StudyPlan
from pairwise import beyond
from verification.herkal import __main__ as command
from verification.herkal import stiffnesses_page
from verification.herkal.models import LINEAR, WiderPlan
from verification.herkal.other_shell import second_table
from verification.herkal.stiffnesses import (
    OWN,
    PEAKED,
    Stiffness,
    specimen_modes,
    specimen_peaks,
    tasks,
)
from verification.herkal.stiffnesses_page import WiderStudy
from verification.opensees.stored import read_motion, stored_motions

COARSE = (3, 6)


def test_tasks_are_each_known_by_what_they_depend_on():
    every = tasks(runs.CASES)
    assert len({one.name for one in every}) == len(every) == 1 + 4 + len(PEAKED)
    coarse = Stiffness("modes", divisions=COARSE)
    assert coarse.settings() != Stiffness("modes").settings()
    peaks = [Stiffness("peaks", "plate", mesh) for mesh in ((6, 12), COARSE)]
    assert peaks[0].settings() == peaks[1].settings()  # they have no shell


@pytest.mark.matrix
def test_small_loads_and_the_papers(tmp_path):
    """Case 1: at small loads and at the paper's, plate and n5b8e are within 1 % of the shell."""
    plan = WiderPlan(Numerics(divisions=8), ("case1",))
    folder = tmp_path / studies.RESULTS
    folder.mkdir()
    asked = [*plan.paths("case1").values(), Stiffness("small-loads", "case1")]
    assert not any(done.failure for done in pool.run(asked, folder, processes=1))
    assert all(done.skipped for done in pool.run(asked, folder, processes=1))
    moved = stiffnesses_page.displacements(WiderStudy(plan, tmp_path), "case1")
    # two loaded nodes that move alike
    end = WiderStudy(plan, tmp_path).displacements("case1")
    assert end["bars and hinges, linear bends"][0] == pytest.approx(-0.0248, abs=5e-5)
    for label, displacement in moved.items():
        assert displacement == pytest.approx(np.abs(end[label]).mean(), rel=1e-6)
    table = stiffnesses_page._statics(WiderStudy(plan, tmp_path))
    small, large = table.rows
    assert small[:2] == ["1", "small"] and large[:2] == ["1", "paper's"]
    assert small[3] is None  # superlinear bends have no stiffness
    assert float(small[4].split("\N{NO-BREAK SPACE}")[0]) == pytest.approx(-29.1, abs=0.1)
    off = [float(cell.split("\N{NO-BREAK SPACE}")[0]) for cell in (*small[5:], *large[5:])]
    assert max(map(abs, off)) < 1.0


@pytest.mark.matrix
def test_modes_of_the_specimen_are_those_of_the_shell():
    """Linear folds: the shell (finer: 4.67, 6.58, 8.70, 14.8 and 19.1 Hz) within 1.7 and 2 %."""
    rows = specimen_modes(COARSE, fold_law="linear")
    shell = [row["shell"] for row in rows if row["model"] == OWN]
    np.testing.assert_allclose(shell, [4.67, 6.58, 8.70, 14.85, 19.12], rtol=0.01)
    for model, within in (("plate", 0.02), ("n5b8e", 0.017)):
        own = [row for row in rows if row["model"] == model]
        np.testing.assert_allclose([row["frequency"] for row in own], shell, rtol=within)
        assert min(row["mac"] for row in own) > 0.99
    standard = [row["frequency"] for row in rows if row["model"] == "standard"]
    assert max(abs(np.array(standard) / shell - 1.0)) > 0.5


@pytest.mark.parametrize("model", beyond(["plate", "n5b8e"]))
def test_peaks_of_the_specimen(model):
    """Nearer to the paper's 9.3 Hz than the model as filed, farther from 3.8 and 16.7 Hz."""
    found = [row["frequency"] for row in specimen_peaks(model)]
    np.testing.assert_allclose(found, [4.18, 9.38, 19.6], rtol=0.01)


def rows(*frequencies):
    return [{"frequency": f, "damping": None} for f in frequencies]


def test_the_page_says_which_model_is_nearer_to_the_experiment():
    exact, off = rows(3.8, 9.3, 16.7), rows(3.8 * 1.3, 9.3, 16.7)
    text = stiffnesses_page.verdict({OWN: exact, "plate": off})
    assert "as filed (superlinear bends) 0.0 %, plate 10.0 %." in text
    assert "The model as filed is nearer to this experiment" in text
    text = stiffnesses_page.verdict({OWN: off, "plate": exact})
    assert "nearer to the experiment, too" in text
    text = stiffnesses_page.verdict({OWN: exact, "plate": exact[:2]})
    assert text.endswith("Fewer than three peaks: plate.")
    table, said = stiffnesses_page.specimen(None, {OWN: exact, "plate": exact[:2]})
    assert isinstance(table, Table) and isinstance(said, Text)
    assert table.rows[0][1:] == ["3.8", "9.3", "16.7"]
    assert table.rows[2][-1] is None


def test_a_mode_without_a_partner_is_told():
    one = {"model": "plate", "mode": 1, "shell": 2.0, "frequency": None, "mac": 0.3}
    two = {"model": "n5b8e", "mode": 1, "shell": 2.0, "frequency": 2.02, "mac": 0.99}
    (table,) = stiffnesses_page.specimen([one, two], {})
    assert table.rows == [
        ["shell (Hz)", "2"],
        ["plate", "none"],
        ["n5b8e", "2.02 (+1.0 %, 0.99)".replace(" ", "\N{NO-BREAK SPACE}")],
    ]


def test_paths_have_no_variants_of_models_beyond_the_paper():
    paths = WiderPlan().paths("case1")
    assert list(paths)[:2] == ["shell", "bars and hinges"]
    assert [label for label, job in paths.items() if job.variant == LINEAR] == [
        "bars and hinges, linear bends"
    ]
    assert paths["plate"].variant == paths["n5b8e"].variant == paths["shell"].variant


def test_errors_against_the_finest_stored_motion_of_another_shell(tmp_path, monkeypatch):
    divisions, dt = stored_motions("case2")[-1]
    theirs = read_motion("case2", divisions, dt)
    x = np.zeros((len(theirs.time), 9, 3))
    x[:, theirs.node] = theirs.displacement
    coordinates = {"time": theirs.time, "node": np.arange(9), "axis": ["x", "y", "z"]}
    same = xr.Dataset({"displacement": (("time", "node", "axis"), x)}, coordinates)
    motions = {"panel": same, "centroid": 1.5 * same}
    monkeypatch.setattr(Study, "result", lambda self, case, model, kind: motions[model])
    study = Study(StudyPlan(cases=("case2",), models={"panel": "", "centroid": ""}), tmp_path)
    found = second_table(study)
    assert found["case2"][0] == divisions
    assert found["case2"][1] == pytest.approx({"panel": 0.0, "centroid": 0.5}, abs=1e-12)
    motions["centroid"] = same.isel(time=slice(500))  # of another length: not comparable
    assert second_table(study) == {}


@pytest.mark.matrix
def test_the_command_writes_its_page_and_goes_on(tmp_path, monkeypatch, capsys):
    """A few models, briefly; the specimen's computations are left out."""
    brief = studies.StudyPlan(Numerics(divisions=2, dt=0.01, duration=1.0))
    monkeypatch.setattr(command.studies, "QUICK", brief)
    monkeypatch.setattr(stiffnesses_page, "tasks", lambda *_: [])
    labels = {"circumcenter": "circumcenter", "mixed_voronoi": "mixed Voronoi", "plate": "plate"}
    monkeypatch.setattr(
        command, "WiderPlan", lambda *given: replace(WiderPlan(*given), models=labels)
    )
    given = ["stiffnesses", "--quick", "--cases", "case1", "--processes", "1"]
    assert command.main([*given, "--out", str(tmp_path)]) == 0
    page = (tmp_path / "stiffnesses.html").read_text("utf-8")
    assert page.count("<img") == 3 and ">nan<" not in page
    for words in ("Models beyond the paper", "mixed Voronoi", "linear bends", "low frequencies"):
        assert words in page
    capsys.readouterr()
    assert command.main([*given, "--out", str(tmp_path)]) == 0
    assert "12 runs were there" in capsys.readouterr().out
    study = WiderStudy(WiderPlan(brief.numerics, ("case1",), labels), tmp_path)
    row = study.table()["case1"]
    assert row["mixed_voronoi"] == pytest.approx(row["circumcenter"], rel=1e-6)  # equal squares
