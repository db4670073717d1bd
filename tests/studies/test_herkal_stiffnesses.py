"""Models beyond the paper: small loads on the case studies, modes and peaks of the specimen."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.report import Table, Text
from foldyn.studies import pool
from foldyn.studies.herkal import report, runs, stiffnesses_page
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.runs import REFERENCE, Job, Numerics
from foldyn.studies.herkal.stiffnesses import (
    OWN,
    PEAKED,
    Stiffness,
    specimen_modes,
    specimen_peaks,
    tasks,
)
from foldyn.studies.herkal.study import LINEAR, Study, StudyPlan
from pairwise import beyond

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
    plan = StudyPlan(Numerics(divisions=8), ("case1",))
    study = Study(plan, tmp_path)
    folder = tmp_path / studies.RESULTS
    folder.mkdir()
    assert stiffnesses_page.sections(study) == []
    paths = [
        Job("case1", model, "path", plan.numerics, variant)
        for model, variant in plan.paths().values()
    ]
    asked = [*paths, Stiffness("small-loads", "case1")]
    assert not any(done.failure for done in pool.run(asked, folder, processes=1))
    assert all(done.skipped for done in pool.run(asked, folder, processes=1))
    moved = stiffnesses_page.displacements(Study(plan, tmp_path), "case1")
    # two loaded nodes that move alike
    end = Study(plan, tmp_path).displacements("case1")
    for label, displacement in moved.items():
        assert displacement == pytest.approx(np.abs(end[label]).mean(), rel=1e-6)
    found = stiffnesses_page.sections(Study(plan, tmp_path))
    (table,) = [one for one in found if isinstance(one, Table)]
    small, large = table.rows
    assert small[:2] == ["1", "small"] and large[:2] == ["1", "paper's"]
    assert small[3] is None  # superlinear bends have no stiffness
    assert float(small[4].split("\N{NO-BREAK SPACE}")[0]) == pytest.approx(-29.1, abs=0.1)
    off = [float(cell.split("\N{NO-BREAK SPACE}")[0]) for cell in (*small[5:], *large[5:])]
    assert max(map(abs, off)) < 1.0
    page = report.write(Study(plan, tmp_path)).read_text("utf-8")
    assert "Models beyond the paper" in page


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
    paths = StudyPlan().paths()
    assert paths["plate"][1] == paths["n5b8e"][1] == paths["shell"][1]
    assert [label for label, (_, variant) in paths.items() if variant == LINEAR] == [
        "bars and hinges, linear bends"
    ]
    assert paths["shell"][0] == REFERENCE
